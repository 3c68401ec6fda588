use longan::measures::{BUILT_INS, BuiltIn, Measure, find};
use longan::window::Summation;
use longan::{Analysis, Body, ThresholdUnit, Weight};

use super::*;
use longan_support::bytes::{gzip, i16s};
use longan_support::rows;

/// What the library makes of `sky.fits`, possibly masked.
fn of_library(folder: &Folder, analysis: &Analysis, measures: &[BuiltIn]) -> Vec<Vec<f64>> {
    rows(&analysis.minkowski_maps(&folder.read("sky.fits", "0"), measures, longan::go_on).unwrap().blocks[0].values)
}

/// The mask of `sky.fits` in RING order: nothing south of 30° S.
fn southless() -> Vec<f64> {
    (0..3072).map(|pixel| if pixel < 2304 { 1.0 } else { 0.0 }).collect()
}

#[test]
fn defaults() {
    let folder = Folder::new();
    for (nside, nside_out) in [(32, 16), (8, 8)] {
        folder.done(&format!("simulate waves -o sky.fits --nside {nside} --correlation 30 --overwrite"));
        let printed = folder.done("map sky.fits -o evq.fits --overwrite");
        assert!(printed.starts_with(&format!("evq.fits: EVQ of Nside {nside_out} from ")), "{printed}");

        let evq = folder.read("evq.fits", "EVQ");
        assert_eq!(evq.grid().nside(), nside_out);
        let expected = of_library(&folder, &Analysis::default(), &[find("evq").unwrap()]);
        assert_eq!(difference(evq.values(), &expected[0]), 0.0);

        let headers = folder.headers("evq.fits");
        let [header] = &headers[..] else { panic!("{headers:?}") };
        let of_map = longan::statistics::statistics(folder.read("sky.fits", "0").values()).unwrap();
        let number = |key: &str| header[key].parse::<f64>().unwrap();
        assert_eq!((number("INMEAN"), number("INSIGMA")), (of_map.mean, of_map.sigma));
        for (i, x) in (1..).zip([-3.0, -2.5, -2.0, -1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]) {
            assert_eq!(number(&format!("THR{i}")), of_map.mean + x * of_map.sigma);
        }
        let (nside, nside_out) = (nside.to_string(), nside_out.to_string());
        for (key, value) in [
            ("PIXTYPE", "HEALPIX"),
            ("ORDERING", "RING"),
            ("NSIDE", &nside_out),
            ("INDXSCHM", "IMPLICIT"),
            ("TTYPE1", "EVQ"),
            ("TFORM1", "1024D"),
            ("CREATOR", concat!("longan ", env!("CARGO_PKG_VERSION"))),
            ("INFILE", "sky.fits"),
            ("INFIELD", "WAVES"),
            ("INNSIDE", &nside),
            ("WINDOW", "6.0"),
            ("MAXMASK", "0.0625"),
            ("BODY", "above"),
            ("WEIGHT", "length"),
            ("THRUNIT", "sigma"),
            ("NTHRESH", "13"),
            ("COMMAND", "longan map sky.fits -o evq.fits"),
        ] {
            // The smallest maps have rows of one value.
            let value = if nside_out == "8" && key == "TFORM1" { "1D" } else { value };
            assert_eq!(header[key], value, "{key}");
        }
        assert!(!["TTYPE2", "MASKFILE", "COORDSYS", "THR14"].iter().any(|key| header.contains_key(*key)));
    }
}

#[test]
fn every_measure_in_one_run() {
    let folder = Folder::with_sky();
    let measures: Vec<BuiltIn> =
        BUILT_INS.iter().flat_map(|kind| [1, 5].map(|rank| BuiltIn::new(kind, rank))).collect();
    let mut names: Vec<String> = measures.iter().map(Measure::name).collect();
    names.dedup();
    assert!(names.len() > 15 && names.contains(&"psi5-direction".to_owned()), "{names:?}");
    // The way of summing is chosen by the moments wanted, and may change the last bit.
    let exact = Analysis { summation: Summation::Exact, ..Analysis::default() };
    folder.done(&format!("map sky.fits -o all.fits --exact --measure {}", names.join(",")));
    let header = &folder.headers("all.fits")[0];
    assert_eq!(header["TFIELDS"], names.len().to_string());
    for (i, name) in (1..).zip(&names) {
        let measure = find(name).unwrap();
        let column = name.to_uppercase().replace('-', "_");
        assert_eq!(header[&format!("TTYPE{i}")], column);
        let unit = header.get(&format!("TUNIT{i}")).map_or("", String::as_str);
        let expected = match column.as_str() {
            "W0" => "sr",
            "W1" | "W2" | "TRACE" | "CONTOUR_LENGTH" => "rad",
            "EVQ" | "BETA" | "MASKED_FRACTION" => "",
            c if c.ends_with("DIRECTION") => "deg",
            c if c.starts_with('Q') => "",
            _ => "rad",
        };
        assert_eq!(unit, expected, "{name}");
        // In company as alone.
        let alone = of_library(&folder, &exact, &[measure]);
        assert_eq!(difference(folder.read("all.fits", &column).values(), &alone[0]), 0.0, "{name}");
    }
}

#[test]
fn options_reach_the_analysis() {
    let folder = Folder::with_sky();
    folder.write("mask.fits", &map_file(&southless(), &[]));
    let base = Analysis::default();
    let value = |text: &str| Analysis {
        thresholds: text.parse().unwrap(),
        threshold_unit: ThresholdUnit::Value,
        ..Analysis::default()
    };
    let sigma = |text: &str| Analysis { threshold_unit: ThresholdUnit::Sigma, ..value(text) };
    let cases = [
        ("", base.clone()),
        ("--window 12.5", Analysis { windows: vec![12.5], ..base.clone() }),
        ("--window 180 --nside-out 2", Analysis { windows: vec![180.0], nside_out: Some(2), ..base.clone() }),
        ("--nside-out 5", Analysis { nside_out: Some(5), ..base.clone() }),
        ("--window 0", Analysis { windows: vec![0.0], ..base.clone() }),
        ("--body below", Analysis { body: Body::Below, ..base.clone() }),
        ("--weight curvature", Analysis { weight: Weight::Curvature, ..base.clone() }),
        ("--thresholds -0.7", value("-0.7")),
        ("--thresholds=-.5,1", value("-0.5,1")),
        ("--thresholds -1.5:1.25:4", value("-1.5:1.25:4")),
        ("--thresholds log:0.1:1.6:5", value("log:0.1:1.6:5")),
        ("--thresholds -1:1:3 --threshold-unit sigma", sigma("-1:1:3")),
        ("--thresholds -1,0.25 --threshold-unit value", value("-1,0.25")),
        ("--threshold-unit value", Analysis { threshold_unit: ThresholdUnit::Value, ..base.clone() }),
    ];
    let measures = ["evq", "w0", "w2"].map(|name| find(name).unwrap());
    let mut seen: Vec<Vec<f64>> = Vec::new();
    for (options, analysis) in cases {
        folder.done(&format!("map sky.fits -o out.fits --overwrite --measure evq,w0,w2 {options}"));
        let expected = of_library(&folder, &analysis, &measures);
        let found: Vec<f64> = ["EVQ", "W0", "W2"].map(|f| folder.read("out.fits", f).values().to_vec()).concat();
        assert_eq!(difference(&found, &expected.concat()), 0.0, "{options}");
        let new = |other: &Vec<f64>| found.len() != other.len() || difference(&found, other) > 1e-6;
        assert!(seen.iter().all(new), "{options} makes no difference");
        seen.push(found);
    }

    // The mask, and how much of it a window may have.
    let mut map = folder.read("sky.fits", "0");
    map.apply_mask(&folder.read("mask.fits", "0"), 0.9).unwrap();
    for (options, max_masked) in [("", 0.0625), ("--max-masked 0.4", 0.4)] {
        folder.done(&format!("map sky.fits -o out.fits --overwrite --mask mask.fits {options}"));
        let analysis = Analysis { max_masked, ..base.clone() };
        let expected = rows(&analysis.minkowski_maps(&map, &measures[..1], longan::go_on).unwrap().blocks[0].values);
        assert_eq!(difference(folder.read("out.fits", "EVQ").values(), &expected[0]), 0.0);
        let header = &folder.headers("out.fits")[0];
        assert_eq!([&header["MASKFILE"], &header["MASKTHR"]], ["mask.fits", "0.9"]);
        assert_eq!(header["MAXMASK"], max_masked.to_string());
    }
}

#[test]
fn windows_with_little_contour_are_left_out_where_asked_for() {
    let folder = Folder::with_sky();
    let options = "--measure evq,beta,contour-length --thresholds 1 --threshold-unit sigma --window 9 --nside-out 16";
    folder.done(&format!("map sky.fits -o all.fits {options}"));
    folder.done(&format!("map sky.fits -o some.fits {options} --min-contour 0.8"));
    let [all, some] = ["all.fits", "some.fits"]
        .map(|name| ["EVQ", "BETA", "CONTOUR_LENGTH"].map(|field| folder.read(name, field).values().to_vec()));
    let least = 0.8 * 9f64.to_radians();
    let mut left_out = 0;
    for p in 0..3072 {
        left_out += usize::from(all[2][p] < least);
        assert!(all[2][p].to_bits() == some[2][p].to_bits() && (all[2][p] - least).abs() > 1e-9);
        for i in [0, 1] {
            let same = all[i][p].to_bits() == some[i][p].to_bits() || all[i][p].is_nan() && some[i][p].is_nan();
            assert!(if all[2][p] < least { some[i][p].is_nan() } else { same }, "pixel {p}");
        }
    }
    assert!(left_out > 50 && left_out < 3000, "{left_out}");
    assert_eq!(folder.headers("some.fits")[0]["MINCONT"], "0.8");
    // Of two ways to make maps, each counts.
    std::fs::copy(folder.path("all.fits"), folder.path("copy.fits")).unwrap();
    folder.refused("compare all.fits some.fits copy.fits -o out.fits", &["least contour", "0.8"]);
    folder.refused("map sky.fits -o out.fits --window 0 --min-contour 1", &["window of 0 degrees", "least contour"]);
    folder.misused("map sky.fits -o out.fits --min-contour -1", &["--min-contour", "not between 0"]);
    let graph = |least: &str| {
        folder.done(&format!("graph sky.fits -o graph.csv --overwrite --measure beta --thresholds 1 {least}"));
        String::from_utf8(std::fs::read(folder.path("graph.csv")).unwrap()).unwrap()
    };
    assert_ne!(graph(""), graph("--min-contour 2"));
}

#[test]
fn a_line_says_which_thresholds_and_which_windows_are_lost_to_what() {
    let folder = Folder::with_sky();
    let line = folder.done("map sky.fits -o out.fits --thresholds -1,0.5 --threshold-unit sigma");
    assert_eq!(line.lines().count(), 1, "{line}");
    let header = &folder.headers("out.fits")[0];
    let number = |key: &str| header[key].parse::<f64>().unwrap();
    let both = [number("THR1"), number("THR2")].map(|threshold| format!("{threshold:.4}"));
    let both = both.map(|text| text.trim_end_matches('0').trim_end_matches('.').to_owned());
    assert!(line.contains(&format!("at 2 thresholds, -1 to 0.5 sigma = {} to {}", both[0], both[1])), "{line}");
    assert!(line.contains("median ") && !line.contains("mean") && !line.contains("lost"), "{line}");
    // The same in the other unit.
    let value = folder.done("map sky.fits -o out.fits --overwrite --thresholds 0");
    assert!(value.contains(" sigma = 0") && value.contains(" at "), "{value}");

    let values: Vec<f64> = (0..3072).map(|p| if p < 2304 { 1.0 } else { 0.0 }).collect();
    folder.write("mask.fits", &map_file(&values, &[]));
    let line = folder.done("map sky.fits -o out.fits --overwrite --mask mask.fits");
    let lost = folder.read("out.fits", "EVQ").values().iter().filter(|value| value.is_nan()).count();
    assert!(
        line.contains(&format!("{lost} of 3072 windows lost to the mask")) && line.contains("--max-masked"),
        "{line}"
    );
    assert!(!line.contains("contour"), "{line}");

    let line = folder.done("map sky.fits -o out.fits --overwrite --thresholds 2.5 --threshold-unit sigma --window 3");
    let lost = folder.read("out.fits", "EVQ").values().iter().filter(|value| value.is_nan()).count();
    assert!(line.contains(&format!("{lost} of 3072 windows without contour")) && line.contains("--window"), "{line}");
    // Windows that hold no pixel are not lost to a mask that there is not.
    let line = folder.done("map sky.fits -o out.fits --overwrite --measure w0 --window 1 --nside-out 64");
    assert!(!line.contains("mask)") && line.contains("of 49152 windows without contour"), "{line}");
    let line = folder.done("map sky.fits -o out.fits --overwrite --min-contour 3");
    assert!(line.contains("windows with too little contour") && line.contains("--min-contour"), "{line}");
}

#[test]
fn a_sequence_has_an_extension_for_each_threshold() {
    let folder = Folder::with_sky();
    let options = "--measure w1,evq --thresholds -1,0,1.5 --window 20";
    folder.done(&format!("map sky.fits -o mean.fits {options}"));
    folder.done(&format!("map sky.fits -o each.fits {options} --sequence"));
    let headers = folder.headers("each.fits");
    assert_eq!(headers.len(), 3);
    let mut mean = vec![0.0; 3072];
    for (i, threshold) in (1..).zip(["-1.0", "0.0", "1.5"]) {
        let header = &headers[i - 1];
        assert_eq!(
            [&header["EXTNAME"], &header["NTHRESH"], &header["THR1"]],
            [&format!("THRESHOLD {i}"), "1", threshold]
        );
        let alone = Analysis {
            thresholds: threshold.parse().unwrap(),
            threshold_unit: ThresholdUnit::Value,
            windows: vec![20.0],
            ..Analysis::default()
        };
        let expected = of_library(&folder, &alone, &[find("w1").unwrap(), find("evq").unwrap()]);
        for (field, expected) in ["W1", "EVQ"].iter().zip(&expected) {
            assert_eq!(difference(folder.read_hdu("each.fits", field, Some(i)).values(), expected), 0.0);
        }
        mean.iter_mut().zip(&expected[0]).for_each(|(m, w)| *m += w / 3.0);
    }
    assert_eq!(folder.headers("mean.fits")[0]["NTHRESH"], "3");
    assert!(difference(folder.read("mean.fits", "W1").values(), &mean) < 1e-12);
}

#[test]
fn outputs_of_any_form_hold_the_same() {
    let folder = Folder::with_sky();
    folder.done("map sky.fits -o ring.fits --measure evq,w1");
    let ring = ["EVQ", "W1"].map(|field| folder.read("ring.fits", field));

    folder.done("map sky.fits -o nested.fits --measure evq,w1 --ordering nested");
    folder.done("map sky.fits -o out.fits.gz --measure evq,w1");
    folder.done("map sky.fits -o one.fits --measure evq,w1 --threads 1");
    folder.done("map sky.fits -o three.fits --measure evq,w1 --threads 3 --quiet");
    for name in ["nested.fits", "out.fits.gz", "one.fits", "three.fits"] {
        for (field, ring) in ["EVQ", "W1"].iter().zip(&ring) {
            assert_same(&folder.read(name, field), ring);
        }
    }
    assert_eq!(folder.headers("nested.fits")[0]["ORDERING"], "NESTED");
    assert!(std::fs::read(folder.path("out.fits.gz")).unwrap().starts_with(&[0x1f, 0x8b]));
    let size = |name: &str| folder.path(name).metadata().unwrap().len();

    folder.done("map sky.fits -o single.fits --measure evq,w1 --float32");
    assert!(size("single.fits") < size("ring.fits"));
    for (field, ring) in ["EVQ", "W1"].iter().zip(&ring) {
        let rounded: Vec<f64> = ring.values().iter().map(|&v| f64::from(v as f32)).collect();
        assert_eq!(difference(folder.read("single.fits", field).values(), &rounded), 0.0);
        assert_eq!(folder.headers("single.fits")[0]["TFORM1"], "1024E");
    }

    // The input's ordering and coordinate system are kept unless others are asked for.
    let nested: Vec<f64> = (0..48).map(f64::from).collect();
    folder.write("galactic.fits", &map_file(&nested, &[("ORDERING", "'NESTED'"), ("COORDSYS", "'G'")]));
    folder.done("map galactic.fits -o galactic_evq.fits");
    let header = &folder.headers("galactic_evq.fits")[0];
    assert_eq!([&header["ORDERING"], &header["COORDSYS"]], ["NESTED", "G"]);
    folder.done("map galactic.fits -o galactic_ring.fits --ordering ring");
    assert_eq!(folder.headers("galactic_ring.fits")[0]["ORDERING"], "RING");
    assert_same(&folder.read("galactic_ring.fits", "0"), &folder.read("galactic_evq.fits", "0"));
}

#[test]
fn masks_of_any_form_mask_the_same() {
    let folder = Folder::with_sky();
    let ring = southless();
    let layer = cdshealpix::nested::get(4);
    let nested: Vec<f64> = (0..3072).map(|p| ring[layer.to_ring(p) as usize]).collect();
    let unset =
        |values: &[f64], other: f64| values.iter().map(|&v| if v > 0.0 { v } else { other }).collect::<Vec<_>>();
    let order = [("ORDERING", "'NESTED'")];
    let shorts: Vec<i16> = ring.iter().map(|&v| v as i16).collect();
    let bytes: Vec<u8> = nested.iter().map(|&v| v as u8).collect();
    let truths: Vec<u8> = ring.iter().map(|&v| if v > 0.0 { b'T' } else { b'F' }).collect();
    let two = [column("OTHER", &[1.0; 3072]), column("MASK", &ring)];
    let masks = [
        ("doubles", map_file(&ring, &[]), ""),
        ("nested", map_file(&nested, &order), ""),
        ("shorts", file(3072, &[col("M", "I", i16s(&shorts))], &[]), ""),
        ("nested bytes", file(3, &[col("M", "1024B", bytes)], &order), ""),
        ("truth values", file(3, &[col("M", "1024L", truths)], &[]), ""),
        ("compressed", gzip(&map_file(&ring, &[])), ""),
        ("NaN", map_file(&unset(&ring, f64::NAN), &[]), ""),
        ("UNSEEN", map_file(&unset(&ring, longan_grid::UNSEEN), &[]), "--mask-threshold=-2e30"),
        ("below the threshold", map_file(&unset(&ring, 0.89), &[]), ""),
        ("another threshold", map_file(&unset(&ring, -2.0), &[]), "--mask-threshold -1.5"),
        ("second column", file(3072, &two, &[]), "--mask-field mask"),
        ("column by number", file(3072, &two, &[]), "--mask-field 1"),
    ];
    folder.done("map sky.fits -o whole.fits --measure evq,masked-fraction");
    let mut first = None;
    for (what, mask, options) in masks {
        folder.write("mask.fits", &mask);
        folder.done(&format!(
            "map sky.fits -o out.fits --overwrite --mask mask.fits --measure evq,masked-fraction {options}"
        ));
        let maps = ["EVQ", "MASKED_FRACTION"].map(|field| folder.read("out.fits", field));
        assert!(difference(maps[0].values(), folder.read("whole.fits", "EVQ").values()) > 0.0, "{what}");
        let [evq, fraction] = first.get_or_insert(maps.clone());
        assert!(difference(evq.values(), maps[0].values()) == 0.0, "{what}");
        assert!(difference(fraction.values(), maps[1].values()) == 0.0, "{what}");
    }
    folder.done("map sky.fits -o out.fits --overwrite --mask mask.fits --mask-field OTHER");
    assert_same(&folder.read("out.fits", "EVQ"), &folder.read("whole.fits", "EVQ"));
}

#[test]
fn whatever_means_no_value_is_masked_the_same() {
    let folder = Folder::with_sky();
    let values = folder.read("sky.fits", "0").values().to_vec();
    let with = |bad: &[f64]| {
        let mut values = values.clone();
        values[1500..1510].iter_mut().zip(bad.iter().cycle()).for_each(|(v, &b)| *v = b);
        map_file(&values, &[])
    };
    let mut first = None;
    for bad in [&[f64::NAN][..], &[f64::INFINITY, f64::NEG_INFINITY], &[longan_grid::UNSEEN, f64::NAN, -1.63751e30]] {
        folder.write("holes.fits", &with(bad));
        folder.done("map holes.fits -o out.fits --overwrite --max-masked 1");
        let evq = folder.read("out.fits", "EVQ");
        assert_same(first.get_or_insert(evq.clone()), &evq);
    }
    folder.done("map sky.fits -o out.fits --overwrite --max-masked 1");
    assert!(difference(folder.read("out.fits", "EVQ").values(), first.unwrap().values()) > 0.0);
}

#[test]
fn fields_and_tables_are_chosen() {
    let folder = Folder::with_sky();
    let values = folder.read("sky.fits", "0").values().to_vec();
    let other: Vec<f64> = values.iter().rev().map(|v| v * v).collect();
    let tables = [
        bytes::primary(),
        bytes::table(3072, &[column("I_STOKES", &values), column("7", &other)], &[("NSIDE", "16")]),
        bytes::table(3072, &[column("B", &other)], &[("NSIDE", "16")]),
    ];
    folder.write("two.fits", &tables.concat());
    folder.write("other.fits", &map_file(&other, &[]));
    folder.done("map sky.fits -o first.fits");
    folder.done("map other.fits -o second.fits");
    let [first, second] = ["first.fits", "second.fits"].map(|name| folder.read(name, "EVQ"));
    assert!(difference(first.values(), second.values()) > 0.0);
    for (options, field, expected) in [
        ("", "I_STOKES", &first),
        ("--field 0", "I_STOKES", &first),
        ("--field i_stokes", "I_STOKES", &first),
        ("--field 1", "7", &second),
        ("--field 7", "7", &second),
        ("--hdu 1", "I_STOKES", &first),
        ("--hdu 2", "B", &second),
        ("--hdu 2 --field b", "B", &second),
    ] {
        folder.done(&format!("map two.fits -o out.fits --overwrite {options}"));
        assert_same(&folder.read("out.fits", "EVQ"), expected);
        assert_eq!(folder.headers("out.fits")[0]["INFIELD"], field, "{options}");
    }
}

#[test]
fn multi_order_maps_are_brought_to_the_nside_asked_for() {
    let folder = Folder::with_sky();
    let ring = folder.read("sky.fits", "0");
    let layer = cdshealpix::nested::get(4);
    let values: Vec<f64> = (0..3072).map(|p| ring.values()[layer.to_ring(p) as usize]).collect();
    let uniqs: Vec<i64> = (0..3072).map(|p| 4 * 256 + p).collect();
    folder.write("uniq.fits", &file(3072, &[col("UNIQ", "K", bytes::i64s(&uniqs)), column("T", &values)], &[]));
    folder.done("map sky.fits -o plain.fits");
    folder.done("map uniq.fits -o uniq_evq.fits");
    folder.done("map uniq.fits -o coarse.fits --nside 8 --ordering ring");
    assert_same(&folder.read("uniq_evq.fits", "EVQ"), &folder.read("plain.fits", "EVQ"));
    let header = &folder.headers("coarse.fits")[0];
    assert_eq!([&header["INNSIDE"], &header["NSIDE"], &header["ORDERING"]], ["8", "8", "RING"]);
}

#[test]
fn windows_may_be_smaller_than_pixels() {
    let folder = Folder::new();
    for nside in [1, 2, 3, 8] {
        folder.done(&format!("simulate shapes -o sky.fits --edge smooth --nside {nside} --overwrite"));
        for (nside_out, window) in [(16, 0.5), (5, 3.0), (2, 0.001)] {
            let words = format!("map sky.fits -o out.fits --overwrite --nside-out {nside_out} --window {window}");
            folder.done(&format!("{words} --thresholds -40,0 --measure w0,masked-fraction"));
            let w0 = folder.read("out.fits", "W0");
            // A window has an area exactly if it holds the centre of a pixel.
            let sky = folder.read("sky.fits", "0");
            for (pixel, &area) in w0.values().iter().enumerate() {
                let (theta, phi) = w0.grid().centre(pixel);
                let near = (0..sky.values().len()).map(|other| {
                    let (t, p) = sky.grid().centre(other);
                    let cos = theta.cos() * t.cos() + theta.sin() * t.sin() * (phi - p).cos();
                    cos.clamp(-1.0, 1.0).acos().to_degrees()
                });
                let nearest = near.fold(f64::INFINITY, f64::min);
                let clear = (nearest - window).abs() > 1e-4;
                assert!(!clear || area.is_nan() == (nearest > window), "{words}: pixel {pixel}, {nearest} deg: {area}");
            }
        }
    }
}
