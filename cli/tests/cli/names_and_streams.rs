use std::io::Read;

use super::*;
use longan_support::skip;

const NAMES: [&str; 10] = [
    "a[1].fits",
    "map.fits(copy)",
    "!a b.fits",
    "it's \"so\".fits",
    "-i.fits",
    "--overwrite",
    "~a.fits",
    "größe ✨.fits",
    "new\nline.fits",
    "a%s{}$HOME.fits",
];

#[test]
fn names_are_taken_literally() {
    let folder = Folder::with_sky();
    folder.done("map sky.fits -o expected.fits --mask sky.fits --mask-threshold -1");
    let expected = folder.read("expected.fits", "EVQ");
    let sky = std::fs::read(folder.path("sky.fits")).unwrap();
    let mut names: Vec<OsString> = NAMES.map(OsString::from).to_vec();
    #[cfg(unix)]
    names.push(std::os::unix::ffi::OsStringExt::from_vec(b"gr\xf6\xdfe.fits".to_vec()));
    for name in names {
        let inner = Folder(tempfile::tempdir_in(folder.path("")).unwrap());
        std::fs::write(inner.path(&name), &sky).unwrap();
        let words = |words: &[&str]| -> Vec<OsString> { words.iter().map(OsString::from).collect() };
        // As input and mask, into a folder; then as output.
        let mut mask = OsString::from("--mask=");
        mask.push(&name);
        let into = [words(&["map", "-omaps/", "--mask-threshold=-1"]), vec![mask, "--".into(), name.clone()]].concat();
        let mut output = OsString::from("--output=");
        output.push(&name);
        std::fs::write(inner.path("sky"), &sky).unwrap();
        let out = [words(&["map", "sky", "--mask=sky", "--mask-threshold=-1", "--overwrite"]), vec![output]].concat();
        for (words, output) in [(into, Path::new("maps").join(&name)), (out, PathBuf::from(&name))] {
            let ran = ran(inner.command_of(&words));
            assert!(ran.code == Some(0) && ran.err.is_empty(), "{words:?}: {ran:?}");
            assert_eq!(ran.out.lines().count(), 1, "{ran:?}");
            assert_same(&inner.read(&output, "EVQ"), &expected);
        }
        let mut names = inner.names();
        names.retain(|n| *n != name);
        assert_eq!(names, ["maps", "sky"], "nothing else is written");
        assert_eq!(std::fs::read_dir(inner.path("maps")).unwrap().count(), 1);
        // And what goes wrong is said on one line.
        std::fs::remove_dir_all(inner.path("maps")).unwrap();
        std::fs::write(inner.path(&name), b"").unwrap();
        let ran = ran(inner.command_of(&[words(&["info", "--"]), vec![name]].concat()));
        assert!(ran.code == Some(1) && ran.err.lines().count() == 1 && ran.err.ends_with("first\n"), "{ran:?}");
    }
}

#[test]
fn text_in_headers_is_ascii_and_of_any_length() {
    let folder = Folder::with_sky();
    let long = format!("{}é'.fits", "x".repeat(180));
    std::fs::copy(folder.path("sky.fits"), folder.path(&long)).unwrap();
    folder.done(&format!("map \"{long}\" -o out.fits"));
    let header = &folder.headers("out.fits")[0];
    assert_eq!(header["INFILE"], long.replace('é', "\\u{e9}"));
    assert_eq!(header["COMMAND"], format!("longan map \"{}\" -o out.fits", long.replace('é', "\\u{e9}")));
}

/// Every command that prints.
const PRINTING: [&str; 7] = [
    "measures",
    "measures --format json",
    "info sky.fits",
    "totals sky.fits",
    "totals sky.fits --format csv",
    "map sky.fits -o out.fits --overwrite",
    "simulate shapes -o out.fits --nside 8 --overwrite",
];

#[test]
fn a_reader_that_leaves_is_no_error() {
    let folder = Folder::with_sky();
    for words in PRINTING {
        let mut child = folder.command(words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let mut err = String::new();
        child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
        assert!(child.wait().unwrap().success() && err.is_empty(), "longan {words}: {err}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_the_output_is_an_error() {
    let folder = Folder::with_sky();
    for words in PRINTING {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = folder.command(words).stdout(full).output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "longan {words}: {err}");
        assert!(err.starts_with("longan: cannot print: No space left") && err.lines().count() == 1, "{words}: {err}");
        // And nobody hears it.
        let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
        let status = folder.command(words).stdout(full()).stderr(full()).status().unwrap();
        assert_eq!(status.code(), Some(1), "longan {words}");
    }
}

/// Runs with standard error at a terminal; what appears there. `None` where no terminal is to be had.
fn at_a_terminal(folder: &Folder, words: &str) -> Option<String> {
    let command = format!("'{}' {words} >printed", env!("CARGO_BIN_EXE_longan"));
    let mut script = Command::new("script");
    script.args(["-qec", &command, "/dev/null"]).current_dir(folder.path("")).stdin(Stdio::null());
    let output = script.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).unwrap())
}

#[test]
fn progress_is_shown_at_a_terminal_only() {
    let folder = Folder::new();
    folder.done("simulate waves -o sky.fits --nside 128 --correlation 5");
    let words = "map sky.fits -o out.fits --overwrite --window 25 --nside-out 32";
    // `done` demands that nothing is on standard error.
    folder.done(words);
    let Some(shown) = at_a_terminal(&folder, words) else {
        return skip("script", "there is no `script` to run a program at a terminal, so progress bars are not tested");
    };
    assert!(shown.contains("left  sky.fits") && shown.contains('%'), "{shown:?}");
    assert!(!std::fs::read_to_string(folder.path("printed")).unwrap().contains('['));
    assert_eq!(at_a_terminal(&folder, &format!("{words} --quiet")).as_deref(), Some(""));
}

/// A surface.
const TETRAHEDRON: &str = "ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property float signal
element face 4
property list uchar int vertex_indices
end_header
1 1 1 0
1 -1 -1 1
-1 1 -1 2
-1 -1 1 3
3 0 1 2
3 0 3 1
3 0 2 3
3 1 3 2
";

/// A file like ERA5's, with times and levels.
fn netcdf_with_levels(path: &Path) {
    let mut file = netcdf::create(path).unwrap();
    for (name, units, values) in [
        ("time", "days since 1997-12-01", &[0.0, 31.0][..]),
        ("level", "hPa", &[500.0, 850.0]),
        ("lat", "degrees_north", &[60.0, 20.0, -20.0, -60.0]),
        ("lon", "degrees_east", &[0.0, 60.0, 120.0, 180.0, 240.0, 300.0]),
    ] {
        file.add_dimension(name, values.len()).unwrap();
        let mut coordinate = file.add_variable::<f64>(name, &[name]).unwrap();
        coordinate.put_attribute("units", units).unwrap();
        coordinate.put_values(values, ..).unwrap();
    }
    let values: Vec<f64> = (0..96).map(|n| f64::from(n * 7 % 13)).collect();
    file.add_variable::<f64>("z", &["time", "level", "lat", "lon"]).unwrap().put_values(&values, ..).unwrap();
    file.close().unwrap();
    unlock(path);
}

#[test]
fn help_fits_a_terminal_and_its_examples_run() {
    let folder = Folder::new();
    for words in [
        "--help",
        "-h",
        "map --help",
        "map -h",
        "compare --help",
        "totals --help",
        "regrid --help",
        "info --help",
        "measures --help",
        "plugin new --help",
        "demo --help",
    ] {
        let help = folder.done(words);
        assert!(help.contains("Usage: longan") && help.lines().all(|l| l.chars().count() <= 100), "{help}");
    }
    assert_eq!(folder.done("--version"), concat!("longan ", env!("CARGO_PKG_VERSION"), "\n"));

    // Inputs that the examples name.
    folder.done("simulate waves -o sky.fits --nside 16 --correlation 15");
    let values: Vec<f64> = folder.read("sky.fits", "0").values().iter().map(|v| v.exp()).collect();
    folder.write("rain.fits", &map_file(&values, &[]));
    folder.write("mask.fits", &map_file(&[1.0; 3072], &[]));
    std::fs::create_dir(folder.path("sims")).unwrap();
    for seed in [1, 2] {
        folder.done(&format!("simulate waves -o sims/sim{seed}.fits --nside 16 --correlation 15 --seed {seed}"));
    }
    netcdf_with_levels(&folder.path("era5.nc"));
    let row = |i: usize| format!("{},{},{}\n", i * 7 % 360, i as f64 / 4.0 - 80.0, i % 11);
    let stations: String = (0..640).map(row).collect();
    folder.write("stations.csv", ("lon,lat,rain\n".to_owned() + &stations).as_bytes());
    folder.write("cell.ply", TETRAHEDRON.as_bytes());
    let mut run = 0;
    for words in ["--help", "map --help", "totals --help", "regrid --help", "simulate --help", "compare --help"] {
        let help = folder.done(words);
        let examples = help.lines().filter(|l| l.starts_with("  longan "));
        for example in examples {
            // What follows the command is an explanation; the demonstration has a test of its own.
            let words = example.trim_start().strip_prefix("longan ").unwrap().split("   ").next().unwrap();
            let words = words.split(" > ").next().unwrap().to_owned();
            let words = ["sims/*.fits", "maps/*.fits", "maps/sim*.fits"].iter().fold(words, |words, all| {
                let folder = all.split('/').next().unwrap();
                words.replace(all, &format!("{folder}/sim1.fits {folder}/sim2.fits"))
            });
            if words.starts_with("demo") {
                continue;
            }
            let overwrite = if words.contains("-o ") && !words.contains("--resume") { " --overwrite" } else { "" };
            // Fields of the default Nside take long.
            let coarse = if words.starts_with("simulate") && !words.contains("--nside") { " --nside 64" } else { "" };
            folder.done(&format!("{words}{overwrite}{coarse}"));
            run += 1;
        }
    }
    assert!(run > 12, "{run} examples");
}
