//! Fields with steps in time: a cube in NetCDF, extensions in FITS; and the data of `LONGAN_SHARED`.

use longan_formats::open;

use super::gridded::Layout;
use super::*;

/// Number of steps of the field.
const STEPS: usize = 5;
/// The step that is missing everywhere.
const EMPTY: usize = 3;

fn field(step: usize, latitude: f64, longitude: f64) -> f64 {
    let (lat, lon) = (latitude.to_radians(), longitude.to_radians() + step as f64);
    let wave = lat.cos() * lon.sin() + 0.6 * (2.0 * lat).sin() * (3.0 * lon).cos() + step as f64;
    if step == EMPTY { f64::NAN } else { wave }
}

/// A folder with the field, each chunk of it of two steps.
fn with_series() -> Folder {
    let folder = Folder::new();
    let layout = Layout { steps: STEPS, chunk: Some(2), ..Layout::of(7.5) };
    layout.write(&folder.path("series.nc"), field);
    folder
}

const WARNING: &str =
    "warning: series.nc: the map at 1997-12-04 is masked or constant, so the result is masked there\n";

/// All steps of a variable.
pub(super) fn steps(folder: &Folder, name: &str, variable: &str) -> Vec<Map> {
    let selection = Selection { field: Some(variable.parse::<Field>().unwrap()), ..Selection::default() };
    let mut maps = open(&folder.path(name), &selection).unwrap();
    (0..maps.times().len()).map(|step| maps.read(step).unwrap()).collect()
}

#[test]
fn one_map_for_each_step() {
    let folder = with_series();
    let options = "--window 25 --nside-out 4 --measure evq,w1";
    for output in ["cube.nc", "tables.fits"] {
        let ran = folder.run(&format!("map series.nc -o {output} {options}"));
        assert!(ran.code == Some(0) && ran.err == WARNING, "{ran:?}");
        assert!(ran.out.starts_with(&format!("{output}: 5 steps of EVQ of Nside 4 from ")), "{}", ran.out);
    }
    let headers = folder.headers("tables.fits");
    assert_eq!(headers.len(), STEPS);
    for measure in ["EVQ", "W1"] {
        let cube = steps(&folder, "cube.nc", measure);
        assert_eq!(cube.len(), STEPS);
        for (step, map) in cube.iter().enumerate() {
            let date = format!("1997-12-0{}", step + 1);
            assert_eq!(map.time.as_ref().unwrap().label, date);
            let table = folder.read_hdu("tables.fits", measure, Some(step + 1));
            assert_eq!(difference(map.values(), table.values()), 0.0);
            assert_eq!(headers[step]["EXTNAME"], format!("MINKOWSKI MAP {date}"));
            assert_eq!((&headers[step]["DATE-OBS"], &headers[step]["TIME"]), (&date, &format!("{step}.0")));
            assert_eq!(headers[step].contains_key("THR1"), step != EMPTY);
            if step == EMPTY {
                assert!(map.values().iter().all(|v| v.is_nan()));
                folder.refused(&format!("map series.nc -o none.fits --select time={date}"), &["is masked"]);
                continue;
            }
            // The same as of this step alone.
            folder.done(&format!("map series.nc -o alone.nc --overwrite --select time={date} {options}"));
            folder.done(&format!("map series.nc -o alone.fits --overwrite --select time=#{step} {options}"));
            assert_same(&steps(&folder, "alone.nc", measure)[0], &table);
            assert_same(&folder.read("alone.fits", measure), &table);
        }
    }
    let info = folder.done("info cube.nc --select time=1997-12-02");
    for part in ["5 steps: 1997-12-01 to 1997-12-05", "(at 1997-12-02)", "Variable 'EVQ'", "Variable 'W1'"] {
        assert!(info.contains(part), "no '{part}' in {info}");
    }
    let cube = netcdf::open(folder.path("cube.nc")).unwrap();
    let means: Vec<f64> = cube.variable("input_mean").unwrap().get_values(..).unwrap();
    for (step, mean) in means.iter().enumerate() {
        let found = headers[step]["INMEAN"].parse::<f64>();
        assert!(if step == EMPTY { mean.is_nan() } else { found == Ok(*mean) }, "{step}: {mean}");
    }
    for (name, expected) in [
        ("Conventions", "CF-1.13"),
        ("title", "Minkowski map of t"),
        ("infile", "series.nc"),
        ("thresholds", "-3, -2.5, -2, -1.5, -1, -0.5, 0, 0.5, 1, 1.5, 2, 2.5, 3 sigma"),
        ("history", &format!("longan map series.nc -o cube.nc {}", options.replace("evq,w1", "'evq,w1'"))),
    ] {
        let value = cube.attribute(name).unwrap().value().unwrap();
        assert_eq!(String::try_from(value).unwrap(), expected);
    }
    assert!(cube.attribute("inmean").is_none() && cube.attribute("thr1").is_none());
}

#[test]
fn regridded_steps_are_read_again() {
    let folder = with_series();
    folder.done("regrid series.nc -o cube.nc --nside 8");
    folder.done("regrid series.nc -o tables.fits --nside 8");
    folder.done("regrid series.nc -o small.nc --nside 8 --float32 --ordering nested");
    let [cube, small] = ["cube.nc", "small.nc"].map(|name| steps(&folder, name, "t"));
    for (step, map) in cube.iter().enumerate() {
        assert_same(map, &folder.read_hdu("tables.fits", "t", Some(step + 1)));
        assert!(difference(map.values(), small[step].values()) < 1e-6);
        assert_eq!((map.unit.as_deref(), map.long_name.as_deref()), (Some("K"), Some("Temperature")));
    }
    // Means over steps are kept, as the steps differ by 1.
    let mean = |map: &Map| map.values().iter().sum::<f64>() / 768.0;
    assert!((mean(&cube[2]) - mean(&cube[0]) - 2.0).abs() < 1e-12);
    let info = folder.done("info cube.nc");
    assert!(info.contains("768 pixels") && info.contains("5 steps: 1997-12-01 to 1997-12-05"), "{info}");
    // The cube gives what the original does.
    let rows = |input: &str| folder.run(&format!("totals {input} --thresholds 0.5,1.5 --format csv"));
    let [original, cube] = ["series.nc --nside 8", "cube.nc"].map(rows);
    assert!(original.code == Some(0) && cube.code == Some(0) && original.out == cube.out);
    assert!(folder.run("map cube.nc -o map.nc --window 30 --nside-out 2 --thresholds 1").out.contains("5 steps"));
}

#[test]
fn totals_of_each_step() {
    let folder = with_series();
    let totals = |format: &str| {
        let ran = folder.run(&format!("totals series.nc --threshold-unit sigma --thresholds -1,1 --format {format}"));
        let warning = "warning: series.nc: at 1997-12-04: every pixel of the map is masked\n";
        assert!(ran.code == Some(0) && ran.err == warning, "{ran:?}");
        ran.out
    };
    let csv = totals("csv");
    let lines: Vec<&str> = csv.lines().collect();
    assert!(lines.len() == 9 && lines[0].starts_with("time,threshold,area_sr,"), "{csv}");
    let json: serde_json::Value = serde_json::from_str(&totals("json")).unwrap();
    let table = totals("table");
    let blocks: Vec<&str> = table.split("\n\n").collect();
    assert_eq!((json.as_array().unwrap().len(), blocks.len()), (8, 4), "{table}");
    for (i, step) in [0, 1, 2, 4].into_iter().enumerate() {
        let date = format!("1997-12-0{}", step + 1);
        let alone = folder.done(&format!(
            "totals series.nc --select time=#{step} --threshold-unit sigma --thresholds -1,1 --format csv"
        ));
        assert_eq!(lines[1 + 2 * i..3 + 2 * i], alone.lines().skip(1).collect::<Vec<_>>()[..]);
        assert_eq!(json[2 * i]["time"], *date);
        assert!(blocks[i].starts_with(&format!("{date}\n   threshold [K]")), "{table}");
    }
    // A file without times has none here.
    Layout::of(10.0).write(&folder.path("plain.nc"), field);
    assert!(folder.done("totals plain.nc --format csv").starts_with("threshold,"));
}

#[test]
fn windows_and_thresholds_in_netcdf() {
    let folder = with_series();
    let options = "--select time=#0 --window 20,32.5 --nside-out 4 --measure w0,w1";
    for words in ["", "--sequence --thresholds -0.5,0.5"] {
        folder.done(&format!("map series.nc -o all.nc {options} {words} --overwrite"));
        folder.done(&format!("map series.nc -o all.fits {options} {words} --overwrite"));
        let file = netcdf::open(folder.path("all.nc")).unwrap();
        for (hdu, header) in (1..).zip(folder.headers("all.fits")) {
            let suffix = header["EXTNAME"].replace([' ', '.'], "_");
            for measure in ["W0", "W1"] {
                let variable = format!("{measure}_{suffix}");
                assert_same(&folder.read("all.nc", &variable), &folder.read_hdu("all.fits", measure, Some(hdu)));
                let long_name = file.variable(&variable).unwrap().attribute_value("long_name").unwrap().unwrap();
                let long_name = String::try_from(long_name).unwrap();
                let window = header["WINDOW"].trim_end_matches(".0");
                assert!(long_name.contains(&format!("in windows of {window} degrees")), "{long_name}");
                if words.contains("sequence") {
                    assert!(long_name.ends_with(&format!("at {} K", header["THR1"])), "{long_name}");
                }
            }
        }
    }
    assert_eq!(folder.headers("all.fits").len(), 4);
}

/// A file of the folder of data, if there is one.
fn shared(name: &str) -> Option<String> {
    Some(longan_support::shared()?.join("data").join(name).to_str().unwrap().to_owned())
}

#[test]
fn winters_of_the_pacific() {
    let Some(sst) = shared("sst_ndjfm_anom.nc") else { return };
    let folder = Folder::new();
    let options = "--window 12 --nside-out 8 --measure evq,w1 --thresholds -1,0,1";
    let printed = folder.done(&format!("map {sst} -o winters.nc {options}"));
    assert!(printed.contains("50 steps of EVQ of Nside 8"), "{printed}");
    folder.done(&format!("map {sst} -o one.fits --select time=1998 {options}"));
    let winters = steps(&folder, "winters.nc", "W1");
    let one = folder.read("one.fits", "W1");
    assert_eq!(winters.len(), 50);
    let at = winters.iter().position(|map| map.time.as_ref().unwrap().label.starts_with("1998-01")).unwrap();
    assert_same(&winters[at], &one);
    // The region is 0.15 of the sphere; windows over its edge and over land are masked.
    let valid = one.values().iter().filter(|v| !v.is_nan()).count();
    assert!((20..768 * 3 / 20).contains(&valid), "{valid}");
    let info = folder.done(&format!("info {sst} --select time=1998-01-15T12"));
    assert!(info.contains("regional") && info.contains("4.315391") && info.contains("(at 1998-01-15T12:00)"), "{info}");
}

#[test]
fn geopotential_and_wind() {
    let (Some(era), Some(hgt)) = (shared("eraint_uvz.nc"), shared("hgt_djf.nc")) else { return };
    let folder = Folder::new();
    let select = "--variable z --select level=500 --select month=1";
    folder.done(&format!("map {era} -o z.nc {select} --nside 32 --window 15"));
    folder.done(&format!("regrid {era} -o z.fits {select} --nside 32"));
    folder.done("map z.fits -o z_map.fits --window 15");
    assert_same(&folder.read("z.nc", "EVQ"), &folder.read("z_map.fits", "EVQ"));
    // The sphere is covered: the Euler characteristic is a whole number, and 2 where the body is all of it.
    let totals = folder.done(&format!("totals {era} {select} --nside 32 --thresholds 0,53000 --format json"));
    let totals: serde_json::Value = serde_json::from_str(&totals).unwrap();
    assert_eq!((&totals[0]["euler_characteristic"], &totals[1]["masked_area_sr"]), (&2.into(), &0.0.into()));
    folder.refused(&format!("map {era} -o out.nc"), &["--variable", "'u' in m s**-1", "'z' in m**2 s**-2"]);
    folder.refused(&format!("map {era} -o out.nc --variable u"), &["'month': 1, 7;", "--select month=VALUE"]);
    folder.refused(
        &format!("totals {era} --variable u --select month=1 --select level=501"),
        &["no level = 501", "200, 500, 850"],
    );
    folder.done(&format!("regrid {hgt} -o heights.nc --nside 16"));
    assert_eq!(steps(&folder, "heights.nc", "z").len(), 65);
}

#[test]
fn the_cortex_as_points_and_as_a_surface() {
    let (Some(csv), Some(ply)) = (shared("cortex_fsaverage5_left.csv"), shared("cortex_fsaverage5_left_sphere.ply"))
    else {
        return;
    };
    let folder = Folder::new();
    let options = "--nside 64 --window 20 --nside-out 8 --measure evq,w1 --thresholds 0";
    folder.done(&format!("map {csv} -o points.fits --gather gaussian:2 {options}"));
    folder.done(&format!("map {ply} -o surface.fits --variable sulc {options}"));
    folder.refused(&format!("map {ply} -o none.fits {options}"), &["'sulc'", "'curv'", "--variable"]);
    for (measure, most) in [("W1", 0.05), ("EVQ", 0.1)] {
        let [points, surface] = ["points.fits", "surface.fits"].map(|name| folder.read(name, measure));
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / points.values().len() as f64;
        let scale = mean(&mut surface.values().iter().copied());
        let apart = mean(&mut points.values().iter().zip(surface.values()).map(|(a, b)| (a - b).abs()));
        // Whole contours are the same; how points are weighed between vertices is not.
        assert!(apart < most * scale, "{measure}: {apart} of {scale}");
    }
}
