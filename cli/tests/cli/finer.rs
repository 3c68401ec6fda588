//! Pixels finer than the grid, or than points lie: contours keep their length, and what was done is told.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::gridded::Layout;
use super::*;

/// Where the Legendre polynomial of degree 8 is zero, on the positive side.
const ZEROS: [f64; 4] =
    [0.183_434_642_495_649_8, 0.525_532_409_916_329, 0.796_666_477_413_626_7, 0.960_289_856_497_536_2];

/// Distance of the grid's latitudes and longitudes, in degrees.
const SPACING: f64 = 2.5;

/// The root of the area that there is for each point, in degrees: the pixels of Nside 32 are as large as that suits.
const OF_POINTS: f64 = 2.2;

/// Contours are as long as they should be within this share, whatever the Nside from that of pixels as large as cells.
const LENGTH: f64 = 0.01;

/// Contours of points at random within this share: their mean in a Gaussian varies with how they happen to lie.
const LENGTH_AT_RANDOM: f64 = 0.025;

/// How sharply steps stand out, at the least: what a test without them would not find.
const STEPS: f64 = 0.1;

/// The Legendre polynomial of degree 8 about an axis that is askew to everything, which has no structure within nine
/// cells of the grid, and whose contours at 0 are eight circles.
fn smooth(latitude: f64, longitude: f64) -> f64 {
    let (lat, lon) = (latitude.to_radians(), longitude.to_radians());
    let direction = [lat.cos() * lon.cos(), lat.cos() * lon.sin(), lat.sin()];
    let axis = [0.48, -0.6, 0.64];
    let z: f64 = std::iter::zip(direction, axis).map(|(a, b)| a * b).sum();
    let (mut before, mut here) = (1.0, z);
    for degree in 2..=8 {
        let n = f64::from(degree);
        (before, here) = (here, ((2.0 * n - 1.0) * z * here - (n - 1.0) * before) / n);
    }
    here
}

/// The length of its contours at 0.
fn truth() -> f64 {
    ZEROS.iter().map(|z| 2.0 * TAU * (1.0 - z * z).sqrt()).sum()
}

/// A folder with the field in `grid.nc`, and with points in `points.csv` on a lattice and `random.csv` at random.
fn with_fields() -> Folder {
    let folder = Folder::new();
    Layout::of(SPACING).write(&folder.path("grid.nc"), |_, latitude, longitude| smooth(latitude, longitude));
    let count = (4.0 * PI / OF_POINTS.to_radians().powi(2)) as usize;
    let row = |z: f64, turn: f64| {
        let (latitude, longitude) = (z.asin().to_degrees(), 360.0 * turn);
        format!("{longitude},{latitude},{}\n", smooth(latitude, longitude))
    };
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let lattice = (0..count).map(|i| row(1.0 - (2 * i + 1) as f64 / count as f64, (i as f64 / golden).fract()));
    folder.write("points.csv", ("lon,lat,v\n".to_owned() + &lattice.collect::<String>()).as_bytes());
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let at_random = (0..count).map(|_| row(rng.random_range(-1.0..1.0), rng.random_range(0.0..1.0)));
    folder.write("random.csv", ("lon,lat,v\n".to_owned() + &at_random.collect::<String>()).as_bytes());
    folder
}

/// By which share contours at 0 come out too long, and what is said on standard error.
fn excess(folder: &Folder, words: &str) -> (f64, String) {
    let ran = folder.run(&format!("totals {words} --thresholds 0 --format json"));
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let rows: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    (rows[0]["length_rad"].as_f64().unwrap() / truth() - 1.0, ran.err)
}

#[test]
fn contours_keep_their_length_however_fine_the_pixels() {
    let folder = with_fields();
    for (file, most) in [("grid.nc", LENGTH), ("points.csv", LENGTH), ("random.csv", LENGTH_AT_RANDOM)] {
        for nside in [64, 128, 256] {
            let (excess, err) = excess(&folder, &format!("{file} --nside {nside}"));
            assert!(excess.abs() < most, "{file}, Nside {nside}: {excess}");
            assert!(err.starts_with(&format!("note: {file}: ")) && err.lines().count() == 1, "{err}");
        }
        // The Nside by default suits the spacing; means of points are few there.
        let (_, err) = excess(&folder, file);
        assert_eq!(err.contains("% of the pixels hold none"), file != "grid.nc", "{err}");
        assert_eq!(err.is_empty(), file == "grid.nc", "{err}");
        if file != "grid.nc" {
            assert_eq!(excess(&folder, &format!("{file} --gather mean")).1, "");
            assert_eq!(excess(&folder, &format!("{file} --nside 12")).1, "");
        }
    }
    // Where means of points are the default but few, the line says what they do.
    let line = folder.done("regrid random.csv -o out.fits --nside 32");
    assert!(line.contains("% of the pixels hold none") && line.contains("--gather gaussian:4.8"), "{line}");
    assert!(!folder.done("regrid random.csv -o out.fits --overwrite --nside 12").contains("means"));
    // Pixels nearly as large as cells.
    let (excess, err) = excess(&folder, "grid.nc --nside 32");
    assert!(excess.abs() < LENGTH && err.is_empty(), "{excess}: {err}");
}

#[test]
fn steps_that_are_asked_for_are_warned_of() {
    let folder = with_fields();
    let (found, err) = excess(&folder, "grid.nc --nside 128 --method conservative");
    assert!(found > STEPS, "{found}");
    let warning = "warning: grid.nc: pixels of 0.458° are 5.5 times finer than the grid's cells of 2.5°, so conservative \
                   regridding draws their outlines, and contours come out too long; leave out --method, or choose \
                   --nside 32\n";
    assert_eq!(err, warning);
    let (found, err) = excess(&folder, "random.csv --nside 128 --gather mean");
    assert!(found > STEPS, "{found}");
    assert!(err.starts_with("warning: random.csv: pixels of 0.458° are 5.") && err.lines().count() == 1, "{err}");
    for part in ["times finer than the distance of 2.", "leave out --gather, or choose --nside 32\n"] {
        assert!(err.contains(part), "{err}");
    }
    for command in [
        "map grid.nc -o map.fits --window 15",
        "regrid grid.nc -o grid.fits",
        "plot grid.nc -o grid.png",
        "graph grid.nc -o graph.png --measure w1",
    ] {
        let ran = folder.run(&format!("{command} --nside 128 --method conservative"));
        assert!(ran.code == Some(0) && ran.err == warning && !ran.out.contains("pixels of"), "{command}: {ran:?}");
    }
    // Where pixels are as large as cells, and where the nearest value is wanted, there is nothing to warn of.
    for options in ["--nside 32 --method conservative", "--nside 128 --method nearest", "--nside 128 --method bilinear"]
    {
        folder.done(&format!("totals grid.nc {options}"));
    }
    for options in ["--nside 32 --gather mean", "--nside 128 --gather nearest", "--nside 128 --gather gaussian:4"] {
        folder.done(&format!("totals points.csv {options}"));
    }
}

#[test]
fn the_line_of_output_and_headers_say_what_was_done() {
    let folder = with_fields();
    let interpolated = "interpolated (bilinear): pixels of 0.458° are finer than the grid of 2.5°";
    for command in ["map grid.nc -o map.fits --window 15", "regrid grid.nc -o grid.fits", "plot grid.nc -o grid.png"] {
        let out = folder.done(&format!("{command} --nside 128"));
        assert!(out.ends_with(&format!("; {interpolated}\n")), "{out}");
        let other = folder.done(&format!("{command} --overwrite"));
        assert!(!other.contains("pixels of"), "{other}");
        folder.done(&format!("{command} --overwrite --nside 128 --method bilinear"));
    }
    let ran = folder.run("graph grid.nc -o graph.png --measure w1 --nside 128");
    assert!(ran.code == Some(0) && ran.err == format!("note: grid.nc: {interpolated}\n"), "{ran:?}");
    let out = folder.done("map points.csv -o points.fits --window 15 --nside 128");
    assert!(out.contains("; smoothed (gaussian:4.7)"), "{out}");
    // Headers, of both formats.
    folder.done("map grid.nc -o map.nc --window 15 --nside 128");
    let header = &folder.headers("map.fits")[0];
    assert_eq!(header["REGRID"], "bilinear");
    assert!((header["REGRATIO"].parse::<f64>().unwrap() - 5.458).abs() < 1e-3);
    let described = formats::describe(&folder.path("map.nc")).unwrap();
    assert_eq!(described.tables[0].card("REGRID"), Some(&formats::CardValue::Text("bilinear".to_owned())));
    assert!(folder.headers("points.fits")[0]["REGRID"].starts_with("gaussian:4.7"));
    folder.done("map grid.nc -o coarse.fits --window 15");
    assert_eq!(folder.headers("coarse.fits")[0]["REGRID"], "conservative");
    folder.done("map grid.fits -o healpix.fits --window 15");
    assert!(!folder.headers("healpix.fits")[0].contains_key("REGRID"));
}

#[test]
fn a_region_is_told_to_lose_its_rim() {
    let folder = Folder::new();
    let degrees: Vec<f64> = (0..20).map(f64::from).collect();
    let values: Vec<f64> = (0..400).map(f64::from).collect();
    let units = |units: &str| serde_json::json!({"units": units});
    gridded::zarr(
        &folder.path("region.zarr"),
        2,
        &[
            ("t", &[20, 20], &values, units("K"), &["lat", "lon"]),
            ("lat", &[20], &degrees, units("degrees_north"), &["lat"]),
            ("lon", &[20], &degrees, units("degrees_east"), &["lon"]),
        ],
    );
    let out = folder.done("regrid region.zarr -o region.fits --nside 256");
    assert!(out.contains("interpolated (bilinear, without the outer halves of the outermost cells): "), "{out}");
}

#[test]
fn a_mask_and_categories_keep_their_cells() {
    let folder = with_fields();
    // A quarter of the sphere is masked, whose edges cells have too.
    let quarter = |_, _, longitude: f64| f64::from(u8::from(!(90.0..180.0).contains(&longitude)));
    Layout::of(10.0).write(&folder.path("mask.nc"), quarter);
    let masked = "totals grid.nc --nside 128 --mask mask.nc --thresholds 0 --format json";
    let ran = folder.run(masked);
    let rows: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    let area = rows[0]["masked_area_sr"].as_f64().unwrap();
    // Two meridians, of which pixels are masked by any share.
    let pixel = (PI / 3.0).sqrt() / 128.0;
    assert!(area >= PI - 1e-9 && area < PI + 2.0 * PI * pixel, "{area}");
    assert_eq!(ran.err.lines().count(), 1, "nothing is said of the mask: {ran:?}");
    folder.done("regrid mask.nc -o categories.fits --nside 128 --method nearest");
    let categories = folder.read("categories.fits", "0");
    assert!(categories.values().iter().all(|v| *v == 0.0 || *v == 1.0));
}

#[test]
fn a_run_goes_on_only_with_maps_that_came_to_healpix_alike() {
    let folder = with_fields();
    for (input, named, other, way) in [
        ("grid.nc", "--method bilinear", "--method conservative", "bilinear"),
        ("points.csv", "", "--gather mean", "gaussian:4.7"),
    ] {
        for output in ["a.fits", "a.nc"] {
            let map = |options: &str| format!("map {input} -o {output} --window 15 --nside 64 {options}");
            folder.done(&map("--overwrite"));
            let kept = "1 of 1 outputs exist, and stay as they are\n";
            assert_eq!(folder.done(&map("--resume")), kept);
            assert_eq!(folder.done(&map(&format!("--resume {named}"))), kept);
            let parts = [output, &format!("'{way}"), &format!("'{}'", other.split(' ').next_back().unwrap())];
            folder.refused(&map(&format!("--resume {other}")), &parts);
        }
    }
    let made_before = std::fs::read(folder.path("a.fits")).unwrap();
    let at = made_before.windows(9).position(|card| card == b"RECIPE  =").unwrap();
    let renamed = [&made_before[..at], b"OLD     =", &made_before[at + 9..]].concat();
    folder.write("a.fits", &renamed);
    folder.refused("map points.csv -o a.fits --window 15 --nside 64 --resume", &["does not say", "older release"]);
}

#[test]
fn maps_that_came_to_healpix_otherwise_are_not_compared() {
    let folder = with_fields();
    let map = |output: &str, options: &str| {
        let ran = folder.run(&format!("map grid.nc -o {output} --window 15 {options}"));
        assert_eq!(ran.code, Some(0), "{ran:?}");
    };
    map("one.fits", "--nside 64");
    map("two.fits", "--nside 64 --method bilinear");
    map("steps.fits", "--nside 64 --method conservative");
    std::fs::copy(folder.path("two.fits"), folder.path("three.fits")).unwrap();
    folder.done("compare one.fits two.fits three.fits -o d.fits");
    assert_eq!(folder.headers("d.fits")[0]["REGRID"], "bilinear");
    folder.refused(
        "compare one.fits two.fits steps.fits -o e.fits",
        &["one.fits", "bilinear", "steps.fits", "conservative"],
    );
    // A map that was HEALPix, or made before this was said, is warned of.
    folder.done("regrid grid.nc -o grid.fits --nside 64");
    folder.done("map grid.fits -o healpix.fits --window 15");
    let ran = folder.run("compare one.fits two.fits healpix.fits -o f.fits");
    let warning = "warning: of how its input came to HEALPix, one.fits says 'bilinear', and healpix.fits does not say; \
                   shapes depend on it\n";
    assert!(ran.code == Some(0) && ran.err == warning, "{ran:?}");
    // As fine pixels of a finer grid.
    Layout::of(1.25).write(&folder.path("fine.nc"), |_, latitude, longitude| smooth(latitude, longitude));
    folder.done("map fine.nc -o fine.fits --window 15 --nside 64 --method bilinear");
    let ran = folder.run("compare one.fits two.fits fine.fits -o g.fits");
    assert!(
        ran.code == Some(0) && ran.err.starts_with("warning: the input of one.fits has another spacing"),
        "{ran:?}"
    );
}
