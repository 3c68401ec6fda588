use std::fs::{self, File};
use std::time::{Duration, SystemTime};

use super::*;

/// A store of a smooth field on a grid of ten degrees.
fn store(folder: &Folder, name: &str, seed: usize) {
    let latitudes: Vec<f64> = (0..18).map(|i| -85.0 + 10.0 * f64::from(i)).collect();
    let longitudes: Vec<f64> = (0..36).map(|i| 10.0 * f64::from(i)).collect();
    let units = |units: &str| serde_json::json!({"units": units});
    gridded::zarr(
        &folder.path(name),
        2,
        &[
            ("t", &[18, 36], &field(seed), units("K"), &["lat", "lon"]),
            ("lat", &[18], &latitudes, units("degrees_north"), &["lat"]),
            ("lon", &[36], &longitudes, units("degrees_east"), &["lon"]),
        ],
    );
}

/// Values of the field.
fn field(seed: usize) -> Vec<f64> {
    let seed = seed as f64;
    let value = |i: usize| (0.37 * (1.0 + seed) * i as f64).sin() + (0.11 * i as f64 + seed).cos();
    (0..18 * 36).map(value).collect()
}

/// The time of a file is set to long ago.
fn of_old(path: &Path) {
    let long_ago = SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000);
    File::options().write(true).open(path).unwrap().set_modified(long_ago).unwrap();
}

/// A comparison with the maps kept in `work` is that with new ones.
#[track_caller]
fn is_up_to_date(folder: &Folder, words: &str, run: usize) {
    folder.done(&format!("{words} --work work -o kept{run}.fits"));
    folder.done(&format!("{words} --work new{run} -o new{run}.fits"));
    for column in ["EVQ_SIGMA", "EVQ_MEAN"] {
        let column = column.to_owned();
        assert_same(&folder.read(format!("kept{run}.fits"), &column), &folder.read(format!("new{run}.fits"), &column));
    }
}

const WINDOW: &str = "--window 40 --thresholds 0 --nside-out 4";

#[test]
fn a_rewritten_chunk_of_a_store_is_noticed() {
    let folder = Folder::new();
    (0..3).for_each(|i| store(&folder, &format!("{i}.zarr"), i));
    let compare = format!("compare 0.zarr 1.zarr 2.zarr {WINDOW}");
    is_up_to_date(&folder, &compare, 0);
    let map = format!("map 1.zarr -o maps/ {WINDOW}");
    folder.done(&map);
    let bytes: Vec<u8> = field(7).iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(folder.path("1.zarr/t/0.0"), bytes).unwrap();
    folder.refused(&format!("{map} --resume"), &["maps/1.nc: ", "was made before ", "1.zarr changed", "--overwrite"]);
    is_up_to_date(&folder, &compare, 1);
    folder.done(&format!("{map} --overwrite"));
    assert_eq!(folder.done(&format!("{map} --resume")), "1 of 1 outputs exist, and stay as they are\n");
}

#[test]
fn an_input_replaced_by_an_older_file_is_noticed() {
    let folder = Folder::with_sims(4, 8);
    let compare = format!("compare sims/0.fits sims/1.fits sims/2.fits {WINDOW}");
    is_up_to_date(&folder, &compare, 0);
    let map = format!("map sims/1.fits -o maps/ {WINDOW}");
    folder.done(&map);
    of_old(&folder.path("sims/3.fits"));
    fs::rename(folder.path("sims/3.fits"), folder.path("sims/1.fits")).unwrap();
    folder.refused(&format!("{map} --resume"), &["was made before ", "sims/1.fits changed"]);
    is_up_to_date(&folder, &compare, 1);
    // The mask too.
    let values: Vec<f64> = (0..768).map(|p| if p < 600 { 1.0 } else { 0.0 }).collect();
    folder.write("mask.fits", &map_file(&values, &[]));
    let (compare, map) = (format!("{compare} -m mask.fits"), format!("{map} -m mask.fits"));
    fs::remove_dir_all(folder.path("work")).unwrap();
    is_up_to_date(&folder, &compare, 2);
    folder.done(&format!("{map} --overwrite"));
    folder.write("mask.fits", &map_file(&[1.0; 768], &[]));
    of_old(&folder.path("mask.fits"));
    folder.refused(&format!("{map} --resume"), &["was made before ", "mask.fits changed"]);
    is_up_to_date(&folder, &compare, 3);
}

#[test]
fn the_same_name_in_another_folder_is_another_input() {
    let folder = Folder::with_sims(3, 8);
    for place in ["here", "there"] {
        fs::create_dir(folder.path(place)).unwrap();
    }
    for (i, sim) in ["0", "1", "2"].into_iter().enumerate() {
        fs::copy(folder.path(format!("sims/{sim}.fits")), folder.path(format!("here/{sim}.fits"))).unwrap();
        let turned = (i + 1) % 3;
        fs::copy(folder.path(format!("sims/{turned}.fits")), folder.path(format!("there/{sim}.fits"))).unwrap();
    }
    let run_in = |place: &str, words: &str| {
        let mut command = folder.command(words);
        command.current_dir(folder.path(place));
        ran(command)
    };
    for (words, parts) in [
        (format!("map 0.fits -o ../maps/ --resume {WINDOW}"), ["is made of ", "/here/0.fits, not of "]),
        (
            format!("compare 0.fits 1.fits 2.fits --work ../work -o out.fits --overwrite {WINDOW}"),
            ["it is made of ", "/here/0.fits, not of "],
        ),
    ] {
        assert_eq!(run_in("here", &words).code, Some(0));
        assert_eq!(run_in("here", &words).code, Some(0));
        let ran = run_in("there", &words);
        assert!(ran.code == Some(1) && parts.iter().all(|part| ran.err.contains(part)), "{words}: {ran:?}");
    }
}

#[test]
fn a_rebuilt_plugin_is_noticed() {
    let folder = Folder::with_sims(3, 8);
    let plugin = plugins::in_c(&folder, &["-O1"]);
    let options = format!("{WINDOW} --plugin '{}' --measure axis-ratio,evq", plugin.display());
    let compare = format!("compare sims/0.fits sims/1.fits sims/2.fits {options}");
    let map = format!("map sims/1.fits -o maps/ {options}");
    folder.done(&map);
    is_up_to_date(&folder, &compare, 0);
    let before = fs::read(&plugin).unwrap();
    plugins::in_c(&folder, &["-O1", "-DREBUILT", "-g"]);
    assert_ne!(fs::read(&plugin).unwrap(), before);
    of_old(&plugin);
    folder.refused(&format!("{map} --resume"), &["was made before ", "axis_ratio", "changed"]);
    let made = || folder.path("work/1.fits").metadata().unwrap().modified().unwrap();
    let then = made();
    is_up_to_date(&folder, &compare, 1);
    assert!(made() > then);
    // It is known by its content, so that one that is built again as it was changes nothing.
    fs::write(&plugin, before).unwrap();
    folder.done(&format!("{map} --resume"));
    // A plugin that is there but of which nothing is taken plays no part.
    let evq = format!("map sims/2.fits -o maps/ {WINDOW} --resume");
    folder.done(&evq);
    folder.done(&format!("{evq} --plugin '{}'", plugin.display()));
}

#[test]
fn a_default_written_out_is_the_same_recipe() {
    let folder = Folder::with_sims(3, 8);
    store(&folder, "grid.zarr", 1);
    folder.write("mask.fits", &map_file(&[1.0; 768], &[]));
    let kept = "1 of 1 outputs exist, and stay as they are\n";
    let map = "map sims/0.fits -o maps/ --mask mask.fits --resume";
    folder.done(map);
    for written in [
        "--thresholds=-3:3:13 --threshold-unit sigma",
        "--measure EVQ --window 6 --nside-out 8 --weight length --body above",
        "--variable 0 --hdu 1 --ordering ring --tolerance 1e-7 --min-contour 0",
        "--mask-field 0 --mask-threshold 0.9 --max-masked 0.0625",
        "--jobs 1 --threads 1",
    ] {
        assert_eq!(folder.done(&format!("{map} {written}")), kept, "{written}");
    }
    let map = "map grid.zarr -o maps/ --window 40 --resume";
    folder.done(map);
    for written in ["--method conservative --nside 8", "--min-valid 0.5 --variable t --measure evq"] {
        assert_eq!(folder.done(&format!("{map} {written}")), kept, "{written}");
    }
    for (other, part) in [
        ("--thresholds 0", "thresholds"),
        ("--weight curvature", "weight 'length', not 'curvature'"),
        ("--ordering nested", "layout 'ring', not 'nested'"),
        ("--min-valid 0.25", "way to HEALPix 'min-valid=0.5', not 'min-valid=0.25'"),
        ("--exact", "tolerance '0.0000001', not '0'"),
        ("--measure evq,w1", "measures 'evq', not 'evq, w1'"),
    ] {
        folder.refused(&format!("{map} {other}"), &["maps/grid.nc", part]);
    }
    let work = "compare sims/0.fits sims/1.fits sims/2.fits --work work --overwrite -o out.fits";
    folder.done(work);
    let made = || folder.path("work/1.fits").metadata().unwrap().modified().unwrap();
    let before = made();
    folder.done(&format!("{work} --measure evq --thresholds=-3:3:13 --threshold-unit sigma"));
    assert_eq!(made(), before);
}

#[test]
fn results_of_another_release_are_made_again() {
    let folder = Folder::with_sims(3, 8);
    let compare = format!("compare sims/0.fits sims/1.fits sims/2.fits {WINDOW} --work work --overwrite -o out.fits");
    folder.done(&compare);
    folder.done(&format!("map sims/0.fits -o maps/ {WINDOW}"));
    // An older revision, and a release without recipes.
    for (from, to) in [("{\"revision\":", "{\"revision\":1"), ("RECIPE  =", "OLD     =")] {
        for name in ["work/1.fits", "maps/0.fits"] {
            let mut bytes = fs::read(folder.path(name)).unwrap();
            let at = bytes.windows(from.len()).position(|part| part == from.as_bytes()).unwrap();
            bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
            fs::write(folder.path(name), bytes).unwrap();
        }
        folder.refused(&format!("map sims/0.fits -o maps/ {WINDOW} --resume"), &["maps/0.fits", "release of longan"]);
        let old = folder.run("compare work/0.fits work/1.fits work/2.fits -o other.fits");
        assert!(old.code == Some(1) && old.err.contains("work/1.fits"), "{old:?}");
        let ran = folder.run(&compare);
        assert!(ran.code == Some(0) && ran.err.starts_with("note: 1 of the Minkowski maps"), "{ran:?}");
        folder.done(&compare);
        folder.done(&format!("map sims/0.fits -o maps/ {WINDOW} --overwrite"));
    }
}

#[test]
fn an_input_that_is_gone_is_not_asked_for() {
    let folder = Folder::with_sims(2, 8);
    let map = format!("map sims/0.fits sims/1.fits -o maps/ {WINDOW} --resume");
    folder.done(&map);
    fs::remove_file(folder.path("sims/0.fits")).unwrap();
    assert_eq!(folder.done(&map), "2 of 2 outputs exist, and stay as they are\n");
    folder.refused(&format!("{map} --weight curvature"), &["maps/0.fits", "sims/0.fits is gone", "the same command"]);
}

/// What the library makes of maps in memory is as good as what the program makes of files.
#[test]
fn a_cube_from_the_library_is_compared() {
    use longan::{Analysis, go_on};
    let folder = Folder::with_sims(1, 8);
    let (analysis, measures) = (Analysis::default(), [longan::measures::find("evq").unwrap()]);
    let cube = |name: &str, seed: u64| {
        let steps = (0..2u32).map(|step| {
            let mut map =
                longan::simulate::Waves::new(20.0, seed + 10 * u64::from(step))?.map(longan_grid::Healpix::new(16)?);
            let (units, calendar) = ("days since 2000-01-01".to_owned(), "standard".to_owned());
            map.time = Some(longan_grid::Time {
                value: step as f64,
                units,
                calendar,
                label: format!("2000-01-0{}", step + 1),
            });
            let maps = analysis.minkowski_maps(&map, &measures, go_on)?;
            Ok((map, maps))
        });
        longan_cli::write_minkowski_maps(&folder.path(name), false, &analysis, &measures, steps).unwrap();
        unlock(&folder.path(name));
    };
    (0..4).for_each(|seed| cube(&format!("{seed}.nc"), seed));
    let compare = "compare 0.nc 1.nc 2.nc 3.nc -o out.nc";
    folder.refused(compare, &["0.nc", "2 places along 'time'", "--select time=#0"]);
    folder.done(&format!("{compare} --select time=2000-01-02"));
    folder.refused("compare 0.nc 1.nc 2.nc 3.nc -o no.nc --select time=1999", &["0.nc", "time = 1999"]);
    // One that the program makes of the same field has the same values.
    folder.done("simulate waves -o waves.fits --nside 16 --correlation 20 --seed 10");
    folder.done("map waves.fits -o alone.fits");
    let alone = folder.read("alone.fits", "EVQ");
    let selection = Selection {
        field: Some(Field::Name("EVQ".into())),
        at: vec![formats::At { dimension: "time".into(), place: formats::Place::Index(1) }],
        ..Selection::default()
    };
    assert_same(&formats::read(&folder.path("0.nc"), &selection).unwrap(), &alone);
    folder.refused("map waves.fits -o 0.nc --resume", &["0.nc"]);
}
