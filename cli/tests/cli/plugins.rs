use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

use super::steps::steps;
use super::*;
use longan_support::skip;

/// Where crates are built for these tests.
const BUILT: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/plugins");

/// Cargo, without the network: all that is needed was there to build these tests.
fn cargo(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
    command.args(words).arg("--offline").current_dir(folder).env("CARGO_TARGET_DIR", BUILT);
    command.env("CARGO_PROFILE_DEV_OPT_LEVEL", "0").env("CARGO_PROFILE_DEV_DEBUG", "0").stdin(Stdio::null());
    command
}

#[track_caller]
fn built(mut command: Command) -> String {
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{command:?}: {}{}", text(&output.stdout), text(&output.stderr));
    text(&output.stdout)
}

fn library(name: &str) -> String {
    longan::measures::plugin::library_of(name)
}

/// The folder of this repository.
fn sources() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The plugins in Rust, built once: the example, and the tests' own.
fn in_rust() -> [PathBuf; 3] {
    static DONE: OnceLock<()> = OnceLock::new();
    DONE.get_or_init(|| {
        let packages = ["-p", "longan-example-plugin", "-p", "longan-plugin", "--lib", "--examples"];
        built(cargo(sources(), &[&["build", "--locked", "--quiet"], &packages[..]].concat()));
    });
    let built = Path::new(BUILT).join("debug");
    [
        built.join(library("longan_example_plugin")),
        built.join("examples").join(library("misbehaving")),
        built.join("examples").join(library("unready")),
    ]
}

/// The example in C, in this folder.
pub(super) fn in_c(folder: &Folder, flags: &[&str]) -> PathBuf {
    let flags: Vec<String> = flags.iter().map(|flag| (*flag).to_owned()).collect();
    let include = sources().join("measures/include");
    let source = sources().join("examples/plugin-c/axis_ratio.c");
    compile::library(folder.root(), "axis_ratio", &source, include.to_str().unwrap(), &flags)
}

/// A path as one word.
fn quoted(path: &Path) -> String {
    format!("'{}'", path.display())
}

#[test]
fn the_examples_are_the_built_in_bit_for_bit() {
    let folder = Folder::with_sky();
    std::fs::copy(folder.path("sky.fits"), folder.path("other.fits")).unwrap();
    let values: Vec<f64> = (0..3072).map(|p| if p < 2304 { 1.0 } else { 0.0 }).collect();
    folder.write("mask.fits", &map_file(&values, &[]));
    let [rust, ..] = in_rust();
    let plugins = format!("--plugin {} --plugin {}", quoted(&in_c(&folder, &[])), quoted(&rust));
    let measures = "--measure evq,example:quotient,example-c:quotient,axis-ratio,shape-index,psi3,w0";
    for options in [
        "",
        "--mask mask.fits --window 20",
        "--window 0",
        "--nside-out 32 --threads 3",
        "--sequence --thresholds=-1,0,1",
    ] {
        folder.done(&format!("map sky.fits other.fits -o maps --overwrite {plugins} {measures} {options}"));
        for (name, hdu) in
            [("maps/sky.fits", 1), ("maps/other.fits", 1), ("maps/sky.fits", folder.headers("maps/sky.fits").len())]
        {
            let column = |field: &str| folder.read_hdu(name, field, Some(hdu)).values().to_vec();
            let evq = column("EVQ");
            for field in ["EXAMPLE_QUOTIENT", "EXAMPLE_C_QUOTIENT"] {
                let same =
                    evq.iter().zip(column(field)).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan());
                assert!(same, "{options}: {name} {field}");
            }
            assert!(evq.iter().any(|v| !v.is_nan()), "{options}");
            assert_eq!(difference(&column("AXIS_RATIO"), &column("SHAPE_INDEX")), 0.0, "{options}");
        }
    }
    let header = &folder.headers("maps/sky.fits")[0];
    assert!(
        header["PLUGIN1"].starts_with("example ") && header["PLUGIN2"].starts_with("example-c 1.0 ("),
        "{header:?}"
    );
    folder.done(&format!("map sky.fits -o alone.fits {plugins} --measure axis-ratio"));
    assert_eq!(folder.headers("alone.fits")[0]["TTYPE1"], "AXIS_RATIO");
    // One that is defined for one weight only.
    folder.refused(
        &format!("map sky.fits -o out.fits {plugins} --measure axis-ratio --weight curvature"),
        &["sky.fits: ", "'axis-ratio' is defined for tensors weighted by length", "weighted by curvature"],
    );
}

#[test]
fn plugins_are_listed_with_where_they_come_from() {
    let folder = Folder::new();
    let [rust, ..] = in_rust();
    let c = in_c(&folder, &[]);
    let plugins = format!("--plugin {} --plugin ./axis_ratio{}", quoted(&rust), std::env::consts::DLL_SUFFIX);
    let text = folder.done(&format!("measures {plugins}"));
    let line = |start: &str| text.lines().any(|line| line.starts_with(start));
    assert!(line("plugin example ") && line("plugin example-c 1.0 (./axis_ratio") && line("evq "), "{text}");
    assert!(
        line("axis-ratio ") && line("shape-index ") && line("example:quotient ") && line("example-c:quotient "),
        "{text}"
    );
    let listed: Vec<Value> = serde_json::from_str(&folder.done(&format!("measures {plugins} --format json"))).unwrap();
    let from = |name: &str| listed.iter().find(|row| row["name"] == name).unwrap()["from"].as_str().unwrap().to_owned();
    assert_eq!(from("evq"), "longan");
    assert_eq!(from("axis-ratio"), format!("plugin example-c 1.0 (./axis_ratio{})", std::env::consts::DLL_SUFFIX));
    assert!(from("shape-index").contains(rust.to_str().unwrap()));

    // The working folder is searched only when it is named.
    assert!(!folder.done("measures").contains("axis-ratio"));
    let with = |path: &str, words: &str| {
        let mut command = folder.command(words);
        command.env("LONGAN_PLUGIN_PATH", path);
        ran(command)
    };
    for path in ["", ":", "::"] {
        assert!(!with(path, "measures").out.contains("axis-ratio"), "'{path}'");
    }
    let own = folder.root().to_str().unwrap();
    let once = with(&format!("{own}:{own}"), &format!("measures --plugin {}", quoted(&c)));
    assert!(once.code == Some(0) && once.out.matches("plugin example-c").count() == 1, "{once:?}");
    folder.done("simulate waves -o sky.fits --nside 8 --correlation 30");
    assert_eq!(with(own, "map sky.fits -o out.fits --measure axis-ratio").code, Some(0));
    // Another file of the same name, and a folder with something else.
    std::fs::create_dir(folder.path("more")).unwrap();
    std::fs::copy(&c, folder.path("more").join(c.file_name().unwrap())).unwrap();
    let clash = with(&format!("{own}:{own}/more"), "measures");
    assert!(clash.code == Some(1) && clash.err.contains("same name, 'example-c'"), "{clash:?}");
    folder.write(&format!("more/text{}", std::env::consts::DLL_SUFFIX), b"text");
    let broken = with(&format!("{own}/more"), "measures");
    assert!(
        broken.code == Some(1) && broken.err.contains("text") && broken.err.contains("not a library"),
        "{broken:?}"
    );
    let missing = with("/no/such/folder", "measures");
    assert!(missing.code == Some(1) && missing.err.contains("/no/such/folder"), "{missing:?}");
    let help = folder.done("measures --help").split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(help.contains("A plugin is code that runs with your rights"), "{help}");
}

#[test]
fn names_of_plugins_are_checked_before_anything_is_read() {
    let folder = Folder::new();
    let [rust, ..] = in_rust();
    let plugins = format!("--plugin {} --plugin {}", quoted(&in_c(&folder, &[])), quoted(&rust));
    let map = format!("map missing.fits -o out.fits {plugins} --measure");
    folder.misused(&format!("{map} quotient"), &["--measure", "choose 'example-c:quotient' or 'example:quotient'"]);
    folder.misused(&format!("{map} shape-indx"), &["did you mean 'shape-index'"]);
    folder.misused(&format!("{map} axis-ratio,example-c:axis-ratio"), &["'axis-ratio' is given twice"]);
    folder.misused(&format!("{map} axis-ratio,'axis-ratio = w1'"), &["'axis-ratio' is given twice"]);
    folder.refused("map missing.fits -o out.fits --plugin none.so", &["none.so: there is no such file"]);
    folder.write("text.so", b"text");
    folder.refused("map missing.fits -o out.fits --plugin text.so", &["text.so: ", "not a library"]);
    folder.refused("measures --plugin text.so", &["text.so: ", "not a library"]);
    folder.refused("measures --plugin .", &[".: ", "not a file"]);
}

#[test]
fn plugins_that_panic_or_fail_leave_no_output() {
    let folder = Folder::with_sky();
    let [_, misbehaving, unready] = in_rust();
    for (measure, parts) in [
        ("panicking", &["'panicking' failed: it panicked at ", "misbehaving.rs:", ": no value at colatitude "][..]),
        ("throwing", &["'throwing' failed: it panicked", "no reason is given"]),
        ("failing", &["'failing' failed: the instrument is off, says the plugin misbehaving"]),
        ("later", &["'later' failed: it panicked", "only the north is known"]),
        ("evq,w0,later", &["only the north is known"]),
    ] {
        for options in ["", "--sequence --thresholds 0,1", "--window 0 --threads 3"] {
            let words =
                format!("map sky.fits -o out.fits --plugin {} --measure {measure} {options}", quoted(&misbehaving));
            folder.refused(&words, &[parts, &["sky.fits: "]].concat());
        }
    }
    // Others of the run go on, and say so each.
    std::fs::copy(folder.path("sky.fits"), folder.path("other.fits")).unwrap();
    let words = format!("map sky.fits other.fits -o maps --plugin {} --measure later", quoted(&misbehaving));
    let ran = folder.run(&words);
    assert!(ran.code == Some(1) && ran.err.starts_with("longan: 2 of 2 inputs failed:\n"), "{ran:?}");
    assert_eq!(std::fs::read_dir(folder.path("maps")).unwrap().count(), 0);
    std::fs::remove_dir(folder.path("maps")).unwrap();
    folder.refused(
        &format!("map sky.fits -o out.fits --plugin {}", quoted(&unready)),
        &["unready", "cannot start: it panicked at ", "the table of constants is missing"],
    );
}

#[test]
fn plugins_measure_each_step() {
    let folder = Folder::new();
    // Only the last step has the south too.
    Layout { steps: 3, ..Layout::of(7.5) }.write(&folder.path("series.nc"), |step, latitude, longitude| {
        let (lat, lon) = (latitude.to_radians(), longitude.to_radians() + step as f64);
        if step < 2 && lat < 0.0 {
            f64::NAN
        } else {
            lat.cos() * lon.sin() + 0.6 * (2.0 * lat).sin() * (3.0 * lon).cos()
        }
    });
    let [rust, misbehaving, _] = in_rust();
    let options =
        format!("--plugin {} --measure 'evq,quotient,Twice = 2*evq' --window 25 --nside-out 4", quoted(&rust));
    for output in ["cube.nc", "tables.fits"] {
        let printed = folder.done(&format!("map series.nc -o {output} {options}"));
        assert!(printed.starts_with(&format!("{output}: 3 steps of EVQ of Nside 4 from ")), "{printed}");
    }
    let headers = folder.headers("tables.fits");
    let [evq, quotient, twice] = ["EVQ", "QUOTIENT", "TWICE"].map(|variable| steps(&folder, "cube.nc", variable));
    assert_eq!([headers.len(), evq.len(), quotient.len()], [3, 3, 3]);
    for step in 0..3 {
        assert!(evq[step].values().iter().any(|v| !v.is_nan()));
        assert_same(&evq[step], &quotient[step]);
        let doubled: Vec<f64> = evq[step].values().iter().map(|v| 2.0 * v).collect();
        assert_eq!(difference(twice[step].values(), &doubled), 0.0);
        assert_same(&folder.read_hdu("tables.fits", "QUOTIENT", Some(step + 1)), &quotient[step]);
        folder.done(&format!("map series.nc -o alone.fits --overwrite --select time=#{step} {options}"));
        assert_same(&folder.read("alone.fits", "QUOTIENT"), &quotient[step]);
        assert!(headers[step]["PLUGIN1"].starts_with("example ") && headers[step]["FORMULA1"] == "Twice = 2*evq");
    }
    let cube = netcdf::open(folder.path("cube.nc")).unwrap();
    let attribute = |name: &str| String::try_from(cube.attribute(name).unwrap().value().unwrap()).unwrap();
    assert_eq!(
        [attribute("plugin1"), attribute("formula1")],
        ["PLUGIN1", "FORMULA1"].map(|key| headers[0][key].clone())
    );
    assert!(cube.attribute("plugin2").is_none() && cube.attribute("formula2").is_none());

    // A failure in a later step leaves nothing of the earlier ones.
    let map = format!("map series.nc --plugin {} --measure evq,later --window 5 --nside-out 4", quoted(&misbehaving));
    for output in ["out.nc", "out.fits"] {
        folder.refused(
            &format!("{map} -o {output}"),
            &["series.nc: at 1997-12-03: the measure 'later' failed: it panicked at ", "only the north is known"],
        );
        folder.done(&format!("{map} -o early_{output} --select time=#1"));
    }
}

#[test]
fn a_new_crate_is_ready() {
    let folder = Folder::with_sky();
    let printed = folder.done("plugin new my-own2");
    assert!(printed.starts_with("my-own2: ") && printed.contains(&library("my_own2_measure")), "{printed}");
    // The versions of this repository, which are on this machine.
    std::fs::copy(sources().join("Cargo.lock"), folder.path("my-own2/Cargo.lock")).unwrap();
    let own = folder.path("my-own2");
    let tests = built(cargo(&own, &["test"]));
    assert!(tests.contains("2 passed"), "{tests}");
    built(cargo(&own, &["build"]));
    let plugin = Path::new(BUILT).join("debug").join(library("my_own2_measure"));
    folder.done(&format!(
        "map sky.fits -o out.fits --plugin {} --measure 'my-own2,b = (w1 - psi2)/(w1 + psi2)'",
        quoted(&plugin)
    ));
    let [own, formula] = ["MY_OWN2", "B"].map(|field| folder.read("out.fits", field));
    assert_eq!(difference(own.values(), formula.values()), 0.0);

    folder.refused("plugin new my-own2", &["my-own2: this exists", "another name"]);
    folder.refused("plugin new evq", &["'evq' is a built-in measure"]);
    for name in ["Beta", "2d", "a/b", "../up", "''", "a.b", "beta_2", "'a b'"] {
        folder.refused(&format!("plugin new {name}"), &["cannot be a measure's name", "lower-case"]);
    }
    folder.refused("plugin new my-beta --sources no/such", &["no/such: longan's sources are not there", "--sources"]);
    folder.done(&format!("plugin new my-beta --sources {}", quoted(sources())));
}

/// The example in C under the compiler's own checks of addresses and undefined behaviour, in many threads.
#[cfg(target_os = "linux")]
#[test]
fn the_example_in_c_is_sound() {
    let folder = Folder::with_sky();
    let cc = |name: &str| {
        let out = Command::new("cc").arg(format!("-print-file-name={name}")).output().unwrap().stdout;
        Some(PathBuf::from(String::from_utf8(out).unwrap().trim())).filter(|path| path.is_absolute() && path.exists())
    };
    let Some(runtime) = cc("libasan.so") else {
        return skip("sanitizer", "cc has no address sanitizer, so the example in C is not run under it");
    };
    let flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g"];
    let plugin = in_c(&folder, &flags);
    for options in ["", "--window 0", "--sequence"] {
        let words = format!(
            "map sky.fits -o out.fits --overwrite --plugin {} --measure axis-ratio,quotient --threads 8 {options}",
            quoted(&plugin)
        );
        let mut command = folder.command(&words);
        command.env("LD_PRELOAD", &runtime).env("ASAN_OPTIONS", "detect_leaks=0");
        let ran = ran(command);
        assert!(ran.code == Some(0) && ran.err.is_empty(), "{ran:?}");
    }
}
