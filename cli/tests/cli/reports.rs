use longan::measures::BUILT_INS;
use serde_json::Value;

use super::*;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// The rows of `totals` as CSV: threshold, area, length, curvature, Euler characteristic (if any), masked area.
fn rows(csv: &str) -> Vec<(Vec<f64>, Option<i64>)> {
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("threshold,area_sr,length_rad,curvature_rad,euler_characteristic,masked_area_sr"));
    lines
        .map(|line| {
            let mut cells: Vec<&str> = line.split(',').collect();
            let euler = cells.remove(4);
            (cells.iter().map(|c| c.parse().unwrap()).collect(), euler.parse().ok())
        })
        .collect()
}

#[test]
fn totals_in_every_format() {
    let folder = Folder::with_sky();
    for options in
        ["", "--thresholds -1,0.5", "--mask mask.fits", "--body below --thresholds -1:1:3 --threshold-unit sigma"]
    {
        folder.write("mask.fits", &map_file(&[&[0.0; 1000][..], &[1.0; 2072]].concat(), &[]));
        let masked = options.contains("mask");
        let csv = rows(&folder.done(&format!("totals sky.fits --format csv {options}")));
        let json = json(&folder.done(&format!("totals sky.fits --format json {options}")));
        let table = folder.done(&format!("totals sky.fits {options}"));
        let lines: Vec<&str> = table.lines().skip(1).collect();
        assert_eq!(json.as_array().unwrap().len(), csv.len());
        assert_eq!(lines.len(), csv.len() + usize::from(masked), "{table}");
        for ((row, line), (numbers, euler)) in json.as_array().unwrap().iter().zip(&lines).zip(&csv) {
            let [_, area, _, curvature, masked_area] = numbers[..] else { panic!("{numbers:?}") };
            let keys = ["threshold", "area_sr", "length_rad", "curvature_rad", "masked_area_sr"];
            assert!(difference(&keys.map(|key| row[key].as_f64().unwrap()), numbers) < 1e-14);
            assert_eq!(row["euler_characteristic"].as_i64(), *euler);
            let cells: Vec<f64> = line.split_whitespace().map(|c| c.parse().unwrap()).collect();
            assert_eq!(cells.len(), if masked { 4 } else { 5 }, "{line}");
            assert!(difference(&cells[..4], &numbers[..4]) < 1e-6, "{line}");
            match euler {
                None => assert!(masked && masked_area > 4.0),
                Some(euler) => {
                    assert!(!masked && masked_area == 0.0 && cells[4] == *euler as f64);
                    assert!(((area + curvature) / std::f64::consts::TAU - *euler as f64).abs() < 1e-9);
                }
            }
        }
    }
    // Above and below are each other's complement.
    let above = rows(&folder.done("totals sky.fits --format csv --thresholds 0.3"));
    let below = rows(&folder.done("totals sky.fits --format csv --thresholds 0.3 --body below"));
    let ([_, a, l, k, _], [_, b, m, n, _]) = (&above[0].0[..], &below[0].0[..]) else { panic!() };
    assert!((a + b - 4.0 * std::f64::consts::PI).abs() < 1e-9 && (l - m).abs() < 1e-9 && (k + n).abs() < 1e-9);
    assert_eq!(rows(&folder.done("totals sky.fits --format csv")).len(), 13);
    assert_eq!(folder.done("totals sky.fits"), folder.done("totals sky.fits --threads 1 --quiet"));
}

#[test]
fn small_thresholds_are_not_rounded_away() {
    let folder = Folder::with_sky();
    let values: Vec<f64> = folder.read("sky.fits", "0").values().iter().map(|v| v * 1e-5).collect();
    folder.write("small.fits", &map_file(&values, &[("TUNIT1", "'K'")]));
    let table = folder.done("totals small.fits --thresholds 1.234567e-5");
    assert!(table.contains("threshold [K]") && table.contains(" 1.2345670e-5 "), "{table}");
}

#[test]
fn info_says_what_it_sees() {
    let folder = Folder::new();
    let values: Vec<f64> = (0..48).map(|p| if p < 12 { f64::NAN } else { f64::from(p) }).collect();
    let columns = [column("TEMPERATURE", &values), col("TEXT", "2A", vec![b'x'; 96]), column("Q", &[-2.5; 48])];
    let keys =
        [("NSIDE", "2"), ("ORDERING", "'NESTED'"), ("COORDSYS", "'E'"), ("TUNIT1", "'mK'"), ("EXTNAME", "'SKY'")];
    let second =
        bytes::table(4, &[col("PIXEL", "J", bytes::i32s(&[0, 3, 5, 7])), column("V", &[1.0; 4])], &[("NSIDE", "1")]);
    folder.write("two.fits", &[file(48, &columns, &keys), second].concat());

    let text = folder.done("info two.fits");
    assert!(text.starts_with("two.fits: HEALPix FITS\n\nHDU 1 'SKY'\n"), "{text}");
    let line = |start: &str| {
        let mut lines = text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>().join(" "));
        lines.find(|l| l.starts_with(start)).unwrap_or_else(|| panic!("no '{start}' in {text}"))
    };
    assert!(line("Nside").starts_with("Nside 2 (48 pixels, one every 29.3162 deg)"));
    assert_eq!(line("ordering"), "ordering NESTED");
    assert_eq!(line("coordinates"), "coordinates ecliptic");
    assert_eq!(line("0 T"), "0 TEMPERATURE mK 12.000000 47.000000 29.500000 10.388295 25.000%");
    assert_eq!(line("1 T"), "1 TEXT - is text, not a map of numbers");
    assert_eq!(line("2 Q"), "2 Q - -2.500000 -2.500000 -2.500000 0.000000 0.000%");
    assert!(
        text.contains("4 of 12 pixels, by their numbers") && text.contains("RING (assumed, the file does not say)")
    );

    let report = json(&folder.done("info two.fits --format json"));
    let table = &report["tables"][0];
    let field = &table["fields"][0];
    assert_eq!((&table["nside"], &table["ordering"]), (&Value::from(2), &Value::from("NESTED")));
    assert_eq!((&field["name"], &field["unit"], &field["max"]), (&"TEMPERATURE".into(), &"mK".into(), &47.0.into()));
    assert_eq!(field["masked_fraction"].as_f64(), Some(0.25));
    assert_eq!(table["fields"][1]["not_a_map"], "text");
    assert_eq!(report["tables"][1]["fields"][0]["masked_fraction"].as_f64(), Some(2.0 / 3.0));

    // Nothing at all.
    folder.write("nothing.fits", &map_file(&[f64::NAN; 12], &[]));
    assert!(folder.done("info nothing.fits").contains("100.000%"));
    assert!(json(&folder.done("info nothing.fits --format json"))["tables"][0]["fields"][0]["mean"].is_null());

    // Cells too fine to be expanded unasked: one cell of order 20 among large ones.
    let cells = file(2, &[col("UNIQ", "K", bytes::i64s(&[4, 4i64.pow(21) * 2])), column("P", &[1.0, 2.0])], &[]);
    folder.write("fine.fits", &cells);
    folder.refused("info fine.fits", &["Nside 1048576", "--nside"]);
    assert!(folder.done("info fine.fits --nside 8").contains("1.000000"));
}

/// A field on a grid of 3 latitudes and 4 longitudes at 2 times, and one that also has levels.
fn netcdf_file(path: &std::path::Path) {
    let mut file = netcdf::create(path).unwrap();
    for (name, len, units, values) in [
        ("time", 2, "days since 1997-12-01", &[0.0, 31.0][..]),
        ("level", 2, "hPa", &[500.0, 850.0]),
        ("lat", 3, "degrees_north", &[60.0, 0.0, -60.0]),
        ("lon", 4, "degrees_east", &[0.0, 90.0, 180.0, 270.0]),
    ] {
        file.add_dimension(name, len).unwrap();
        let mut coordinate = file.add_variable::<f64>(name, &[name]).unwrap();
        coordinate.put_attribute("units", units).unwrap();
        coordinate.put_values(values, ..).unwrap();
    }
    let values: Vec<f64> = (0..24).map(|n| if n < 3 { f64::NAN } else { f64::from(n) }).collect();
    let mut field = file.add_variable::<f64>("t", &["time", "lat", "lon"]).unwrap();
    field.put_attribute("units", "K").unwrap();
    field.put_attribute("long_name", "Temperature").unwrap();
    field.put_values(&values, ..).unwrap();
    file.add_variable::<f32>("u", &["level", "lat", "lon"]).unwrap();
    file.close().unwrap();
    unlock(path);
}

#[test]
fn info_describes_grids_of_latitude_and_longitude() {
    let folder = Folder::new();
    netcdf_file(&folder.path("field.nc"));
    let text = folder.done("info field.nc");
    assert!(text.starts_with("field.nc: NetCDF\n\nVariable 't'\n"), "{text}");
    for line in [
        "grid         3 latitudes x 4 longitudes, global",
        "latitudes    60 to -60 deg, one every 60.0000 deg",
        "longitudes   0 to 270 deg, one every 90.0000 deg",
        "time         2 steps: 1997-12-01, 1998-01-01",
        "level        2 values: 500, 850 (hPa)",
        "long name    Temperature",
    ] {
        assert!(text.lines().any(|l| l.trim() == line), "no '{line}' in {text}");
    }
    let words: Vec<_> = text.lines().map(|l| l.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    // Of the first time, from 3 to 11, of which three values are missing.
    assert!(words.iter().any(|l| l == "0 t K 3.000000 11.000000 7.000000 2.581989 25.000% (at 1997-12-01)"), "{text}");
    assert!(words.iter().any(|l| l == "1 u - needs --select level=VALUE"), "{text}");

    let report = json(&folder.done("info field.nc --format json"));
    let [t, u] = [0, 1].map(|i| &report["tables"][i]);
    assert_eq!((&t["variable"], &t["latitudes"]["count"], &t["global"]), (&"t".into(), &3.into(), &true.into()));
    assert_eq!((&t["fields"][0]["time"], &t["fields"][0]["max"]), (&"1997-12-01".into(), &11.0.into()));
    assert_eq!(t["dimensions"][0]["values"], "1997-12-01, 1998-01-01");
    assert_eq!(u["fields"][0]["select"], serde_json::json!(["level"]));
    assert!(u["fields"][0]["max"].is_null() && t["fields"][0].get("select").is_none());
}

#[test]
fn every_measure_is_listed() {
    let folder = Folder::new();
    let text = folder.done("measures");
    let listed = json(&folder.done("measures --format json"));
    assert_eq!(listed.as_array().unwrap().len(), BUILT_INS.len());
    for (kind, row) in BUILT_INS.iter().zip(listed.as_array().unwrap()) {
        assert_eq!((&row["name"], &row["unit"]), (&kind.pattern.into(), &kind.unit.into()));
        let line = text.lines().find(|l| l.starts_with(&format!("{} ", kind.pattern))).unwrap();
        assert!(line.ends_with(kind.definition) && row["definition"] == kind.definition, "{line}");
        let rank = kind.rank.map_or("N".to_owned(), |rank| rank.to_string());
        assert_eq!(line.split_whitespace().nth(1), Some(&*rank));
        assert_eq!(row["rank"], rank);
    }
}

#[test]
fn simulated_maps() {
    let folder = Folder::new();
    folder.done("simulate shapes -o all.fits --nside 64");
    folder.done("simulate shapes -o cap.fits --nside 64 --shape cap --centre -30,45 --size 20 --edge smooth");
    folder.done("simulate shapes -o turned.fits --nside 64 --shape square --angle -30");
    let header = |name: &str| folder.headers(name).remove(0);
    assert_eq!([&header("all.fits")["CONTOUR"], &header("all.fits")["NSIDE"]], ["0.5", "64"]);
    assert_eq!(header("cap.fits")["SHAPES"], "cap of 20 deg at -30,45, turned by 0 deg");
    assert_eq!(header("turned.fits")["SHAPES"], "square of 6 deg at 0,0, turned by -30 deg");
    let all = folder.read("all.fits", "SHAPES");
    assert!(all.values().iter().all(|&v| v == 0.0 || v == 1.0));
    // Seven bodies; a cap of 10 degrees' radius about its centre.
    let euler = |words: &str| rows(&folder.done(&format!("totals {words} --format csv")))[0].1;
    folder.done("simulate shapes -o smooth.fits --nside 64 --edge smooth");
    assert_eq!(header("smooth.fits")["CONTOUR"], "0.0");
    assert_eq!(euler("smooth.fits --thresholds 0"), Some(7));
    let cap = rows(&folder.done("totals cap.fits --format csv --thresholds 0"));
    let area = std::f64::consts::TAU * (1.0 - 10f64.to_radians().cos());
    assert!((cap[0].0[1] - area).abs() < 3e-3 * area && cap[0].1 == Some(1));
    let map = folder.read("cap.fits", "0");
    let centre = map.grid().pixel_at(45f64.to_radians(), -30f64.to_radians());
    assert!((map.values()[centre] - 10.0).abs() < 1.0);

    let printed = folder.done("simulate waves -o 1.fits --nside 32 --correlation 8");
    assert_eq!(
        printed,
        format!("1.fits: waves at Nside 32\nsigma0 = 1, sigma1 = {} per radian\n", 2f64.sqrt() / 8f64.to_radians())
    );
    folder.done("simulate waves -o same.fits --nside 32 --correlation 8 --seed 1 --threads 1");
    assert_eq!(folder.done("simulate waves -o other.fits --nside 32 --correlation 8 --seed 2 --quiet"), "");
    assert_same(&folder.read("1.fits", "WAVES"), &folder.read("same.fits", "WAVES"));
    assert!(difference(folder.read("1.fits", "0").values(), folder.read("other.fits", "0").values()) > 0.1);
    assert_eq!([&header("1.fits")["SEED"], &header("1.fits")["CORRANG"]], ["1", "8.0"]);

    // A field too rough for the grid.
    let ran = folder.run("simulate waves -o rough.fits --nside 4");
    assert!(ran.code == Some(0) && ran.err.starts_with("warning: a correlation angle of 3"), "{ran:?}");
    assert_eq!(folder.done("simulate waves -o rough.fits --nside 4 --overwrite --quiet"), "");
}

#[test]
fn the_demonstration() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("here")).unwrap();
    folder.write("here/shapes.fits", b"old");
    folder.refused("demo here", &["here/shapes.fits", "exists"]);
    let printed = folder.done("demo here --overwrite");
    let number = |name: &str, place: usize| -> f64 {
        let line = printed.lines().find(|l| l.trim_start().starts_with(name)).unwrap_or_else(|| panic!("{printed}"));
        line.trim_start().strip_prefix(name).unwrap().split_whitespace().nth(place).unwrap().parse().unwrap()
    };
    // Of a pixelised outline, so not quite the ratio of the sides.
    for (name, ratio) in [("square", 1.0), ("2:1 rectangle", 2.0), ("3:1 rectangle", 3.0)] {
        assert!((number(name, 0) / ratio - 1.0).abs() < 0.01, "{printed}");
    }
    assert_eq!(number("Euler characteristic", 0), 7.0);
    // Threshold, length, the expected length, Euler characteristic.
    let numbers = |line: &str| line.split_whitespace().map(|w| w.parse().ok()).collect::<Option<Vec<f64>>>();
    let rows: Vec<_> = printed.lines().filter_map(numbers).filter(|row| row.len() == 4).collect();
    assert_eq!(rows.len(), 7, "{printed}");
    for row in rows {
        assert_eq!(row[3], row[3].round(), "{printed}");
        assert!(row[0].abs() > 1.5 || (row[1] / row[2] - 1.0).abs() < 0.05, "{printed}");
    }
    let png = std::fs::read(folder.path("here/waves_evq.png")).unwrap();
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n") && png.len() > 10_000);
    for name in ["shapes", "shapes_evq", "waves", "waves_evq"] {
        assert!(folder.read(format!("here/{name}.fits"), "0").values().iter().any(|v| v.is_finite()), "{name}");
    }
}
