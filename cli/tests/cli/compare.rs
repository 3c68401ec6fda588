use longan::compare::{Comparison, Outcome};
use longan::simulate::Waves;
use longan::{Analysis, Healpix, measures::find};
use rayon::prelude::*;

use super::*;
use longan_support::noise;

/// Measures of the maps that most tests compare.
const MEASURES: &str = "--measure evq,w1,rank4-mid --window 12 --nside-out 8";

/// A folder with the Minkowski maps `data.fits` and `sims/1.fits` to `sims/n.fits` of Gaussian fields.
fn with_maps(n: usize, measures: &str) -> Folder {
    let folder = with_raw(n);
    done(&folder, &format!("map raw/*.fits -o sims/ {measures}"));
    std::fs::rename(folder.path("sims/0.fits"), folder.path("data.fits")).unwrap();
    folder
}

/// A folder with the fields `raw/0.fits` to `raw/n.fits`, Nside 16.
fn with_raw(n: usize) -> Folder {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("raw")).unwrap();
    for i in 0..=n {
        folder.done(&format!("simulate waves -o raw/{i}.fits --nside 16 --correlation 15 --seed {i}"));
    }
    folder
}

/// Words for the files that match, since there is no shell.
fn all(folder: &Folder, words: &str) -> String {
    let expand = |word: &str| match word.split_once('*') {
        None => word.to_owned(),
        Some((before, after)) => {
            let name = |i: usize| format!("{before}{i}{after}");
            (0..100).map(name).filter(|name| folder.path(name).is_file()).collect::<Vec<_>>().join(" ")
        }
    };
    words.split(' ').map(expand).collect::<Vec<_>>().join(" ")
}

fn done(folder: &Folder, words: &str) -> String {
    folder.done(&all(folder, words))
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

/// Both passes over the simulations.
fn outcome<'a>(data: &'a [f64], simulations: &[Vec<f64>]) -> Outcome<'a> {
    let mut comparison = Comparison::new(data).unwrap();
    simulations.iter().for_each(|map| comparison.first(map).unwrap());
    simulations.iter().for_each(|map| comparison.second(map).unwrap());
    comparison.finish().unwrap()
}

#[test]
fn columns_are_those_of_the_library() {
    let folder = with_maps(6, MEASURES);
    let printed = done(&folder, "compare data.fits sims/*.fits -o out.fits");
    assert!(printed.starts_with("data.fits among 6 simulations, Nside 8\n\nEVQ in windows of 12 deg: "), "{printed}");
    for measure in ["EVQ", "W1", "RANK4_MID"] {
        let data = folder.read("data.fits", measure);
        let mut comparison = Comparison::new(data.values()).unwrap();
        for i in 1..=6 {
            comparison.first(folder.read(format!("sims/{i}.fits"), measure).values()).unwrap();
        }
        let expected = comparison.deviation();
        for (suffix, expected) in [
            ("MEAN", expected.mean),
            ("STD", expected.std),
            ("SIGMA", expected.sigma),
            ("LOCAL_PERCENTILE", expected.local_percentile),
            ("GLOBAL_PERCENTILE", expected.global_percentile),
            ("COUNT", expected.count),
        ] {
            let found = folder.read("out.fits", &format!("{measure}_{suffix}"));
            assert_eq!(difference(found.values(), &expected.to_vec()), 0.0, "{measure}_{suffix}");
        }
    }
    let header = &folder.headers("out.fits")[0];
    for (key, value) in [
        ("DATAFILE", "data.fits"),
        ("NSIMS", "6"),
        ("SIMFIRST", "sims/1.fits"),
        ("SMOOTH", "0.0"),
        ("TIES", "half"),
        ("WINDOW", "12.0"),
        ("INFILE", "raw/0.fits"),
        ("MEASURE2", "W1"),
        ("TUNIT7", "rad"),
        ("COMMAND", "longan compare data.fits sims/1.fits -o out.fits"),
    ] {
        assert_eq!(header[key], value, "{key}");
    }
    assert!((1.0 / 7.0..=1.0).contains(&header["PVALUE1"].parse::<f64>().unwrap()));
}

#[test]
fn files_of_any_form_give_the_same() {
    let folder = with_maps(4, MEASURES);
    done(&folder, "compare data.fits sims/*.fits -o out.fits --measure evq");
    for i in 1..=4 {
        folder.done(&format!("map raw/{i}.fits -o nested/ {MEASURES} --ordering nested"));
        folder.done(&format!("map raw/{i}.fits -o netcdf{i}.nc {MEASURES}"));
    }
    done(&folder, "compare data.fits nested/1.fits sims/2.fits netcdf3.nc netcdf4.nc -o mixed.nc --measure EVQ");
    done(&folder, "compare data.fits netcdf*.nc -o out.fits.gz --measure evq --ordering nested --quiet");
    for suffix in ["MEAN", "STD", "SIGMA", "LOCAL_PERCENTILE", "GLOBAL_PERCENTILE", "COUNT"] {
        let expected = folder.read("out.fits", &format!("EVQ_{suffix}"));
        for name in ["mixed.nc", "out.fits.gz"] {
            assert_same(&folder.read(name, &format!("EVQ_{suffix}")), &expected);
        }
    }
}

#[test]
fn the_report_is_what_the_maps_show() {
    let folder = with_maps(5, MEASURES);
    let words = "compare data.fits sims/*.fits -o out.fits --measure w1,evq --regions 3 --level 1";
    let report = json(&done(&folder, &format!("{words} --format json")));
    assert_eq!((report["simulations"].as_u64(), report["nside"].as_u64()), (Some(5), Some(8)));
    assert!(report["smoothing_fwhm_deg"].is_null() && report["data"] == "data.fits");
    let text = done(&folder, &format!("{words} --overwrite"));
    for (of, name) in report["measures"].as_array().unwrap().iter().zip(["W1", "EVQ"]) {
        assert_eq!((of["measure"].as_str(), of["window_deg"].as_f64()), (Some(name), Some(12.0)));
        let sigma = folder.read("out.fits", &format!("{name}_SIGMA"));
        let largest = sigma.values().iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        assert_eq!(of["largest_sigma"].as_f64(), Some(largest));
        let as_large = of["simulations_as_large"].as_f64().unwrap();
        assert_eq!(of["p_value"].as_f64(), Some((1.0 + as_large) / 6.0));
        let regions = of["regions"].as_array().unwrap();
        assert_eq!(regions.len(), 3);
        assert_eq!(regions[0]["sigma"].as_f64().map(f64::abs), Some(largest));
        for region in regions {
            let number = |key: &str| region[key].as_f64().unwrap();
            let pixel = region["pixel"].as_u64().unwrap() as usize;
            let (theta, phi) = sigma.grid().centre(pixel);
            assert_eq!((number("lon_deg"), number("lat_deg")), (phi.to_degrees(), 90.0 - theta.to_degrees()));
            assert_eq!(number("value"), folder.read("data.fits", name).values()[pixel]);
            for (key, suffix) in [
                ("mean", "MEAN"),
                ("standard_deviation", "STD"),
                ("sigma", "SIGMA"),
                ("local_percentile", "LOCAL_PERCENTILE"),
                ("global_percentile", "GLOBAL_PERCENTILE"),
                ("simulations", "COUNT"),
            ] {
                assert_eq!(number(key), folder.read("out.fits", &format!("{name}_{suffix}")).values()[pixel], "{key}");
            }
            assert!(text.contains(&format!(" {:.2} ", number("lon_deg"))), "{text}");
        }
    }
    assert!(text.ends_with("\nwritten: out.fits\n"), "{text}");
    let none = done(&folder, "compare data.fits sims/*.fits -o out.fits --overwrite --level 1000");
    assert!(none.contains("no deviation of 1000 sigma or more"), "{none}");
}

#[test]
fn p_values_are_ranks_among_all_maps() {
    // Each map in turn as the data: the p-values are the ranks, from 1/5 to 1, each once.
    let folder = with_maps(4, "--measure w1 --window 12 --nside-out 8");
    std::fs::rename(folder.path("data.fits"), folder.path("sims/0.fits")).unwrap();
    let p_value = |i: usize| {
        let others: Vec<_> = (0..5).filter(|j| *j != i).map(|j| format!("sims/{j}.fits")).collect();
        let words = format!("compare sims/{i}.fits {} -o out.fits --overwrite --format json", others.join(" "));
        json(&folder.done(&words))["measures"][0]["p_value"].as_f64().unwrap()
    };
    let mut p_values: Vec<f64> = (0..5).map(p_value).collect();
    p_values.sort_by(f64::total_cmp);
    assert_eq!(difference(&p_values, &[0.2, 0.4, 0.6, 0.8, 1.0]), 0.0);
}

#[test]
fn maps_are_smoothed_first() {
    let folder = with_maps(3, "--measure evq --window 12 --nside-out 8");
    let printed = done(&folder, "compare data.fits sims/*.fits -o out.fits --smooth 20");
    assert!(printed.contains("smoothed by 20 deg"), "{printed}");
    let smoothing = longan::smoothing::Smoothing::new(Healpix::new(8).unwrap(), 20.0).unwrap();
    let smooth = |name: String| smoothing.apply(&[folder.read(name, "EVQ").values()]).unwrap().remove(0);
    let data = smooth("data.fits".into());
    let mut comparison = Comparison::new(&data).unwrap();
    (1..=3).for_each(|i| comparison.first(&smooth(format!("sims/{i}.fits"))).unwrap());
    let sigma = comparison.deviation().sigma.to_vec();
    assert_eq!(difference(folder.read("out.fits", "EVQ_SIGMA").values(), &sigma), 0.0);
    assert_eq!(folder.headers("out.fits")[0]["SMOOTH"], "20.0");
    folder.refused(&all(&folder, "compare data.fits sims/*.fits -o no.fits --smooth 14"), &["14", "Nside 8", "14.6"]);
    folder.misused(&all(&folder, "compare data.fits sims/*.fits -o no.fits --smooth 181"), &["--smooth", "180"]);
}

#[test]
fn masks_may_differ() {
    let folder = with_raw(3);
    let mask = |name: &str, from: usize| {
        let values: Vec<f64> = (0..3072).map(|p| if (from..from + 600).contains(&p) { 0.0 } else { 1.0 }).collect();
        folder.write(name, &map_file(&values, &[]));
    };
    mask("north.fits", 0);
    mask("south.fits", 2400);
    folder.done(&format!("map raw/0.fits -o data.fits {MEASURES} --mask south.fits"));
    folder.done(&format!("map raw/1.fits raw/2.fits -o sims/ {MEASURES} --mask north.fits"));
    folder.done(&format!("map raw/3.fits -o sims/3.fits {MEASURES}"));
    let ran = folder.run(&all(&folder, "compare data.fits sims/*.fits -o out.fits"));
    assert!(ran.code == Some(0) && ran.err.starts_with("warning: data.fits has the mask south.fits, but sims/1.fits"));
    let of = |suffix: &str| folder.read("out.fits", &format!("W1_{suffix}")).into_values();
    let (count, sigma, local) = (of("COUNT"), of("SIGMA"), of("LOCAL_PERCENTILE"));
    // One simulation has no scatter, and masked data no deviation.
    assert_eq!((count[0], count[400], count[767]), (1.0, 3.0, 3.0));
    assert!(sigma[0].is_nan() && [0.0, 100.0].contains(&local[0]) && of("MEAN")[0] > 0.0 && of("STD")[0].is_nan());
    assert!(sigma[400].is_finite() && sigma[767].is_nan() && local[767].is_nan() && of("STD")[767] > 0.0);
}

#[test]
fn what_does_not_go_together_is_named() {
    let folder = with_maps(2, MEASURES);
    for (options, parts) in [
        ("--window 12 --nside-out 4", &["Nside 8", "Nside 4"][..]),
        ("--window 10 --nside-out 8", &["window of 12 degrees", "window of 10 degrees"]),
        ("--window 12 --nside-out 8 --body below", &["above", "below"]),
        ("--window 12 --nside-out 8 --weight curvature", &["length", "curvature"]),
        (
            "--window 12 --nside-out 8 --thresholds -3:3:7 --threshold-unit sigma",
            &["thresholds -3, -2.5,", "thresholds -3, -2, -1, 0, 1, 2, 3 sigma"],
        ),
        (
            "--window 12 --nside-out 8 --thresholds -3:2:13 --threshold-unit sigma",
            &["thresholds -3, -2.5, -2,", "-2.583333", "sigma"],
        ),
        ("--window 12 --nside-out 8 --thresholds -3:3:13", &["unit of thresholds sigma", "unit of thresholds value"]),
    ] {
        folder.done(&format!("map raw/2.fits -o other.fits --overwrite --measure evq {options}"));
        // In whatever place it stands.
        for files in ["data.fits sims/1.fits sims/2.fits other.fits", "other.fits sims/1.fits sims/2.fits"] {
            let parts = [parts, &["other.fits has", "compare maps that were made in the same way"]].concat();
            folder.refused(&format!("compare {files} -o out.fits"), &parts);
        }
    }
    folder.done("map raw/2.fits -o other.fits --overwrite --measure psi2 --window 12 --nside-out 8");
    folder.refused(
        "compare data.fits sims/1.fits other.fits -o out.fits",
        &["data.fits has the measures EVQ, W1, RANK4_MID", "other.fits has PSI2"],
    );
    // The same name for something else.
    for (name, formula) in [("one", "w1 + 1"), ("two", "w1 + 2")] {
        let words = format!("map raw/1.fits raw/2.fits -o {name}/ --measure 'beta = {formula}'");
        folder.done(&words);
    }
    folder.refused(
        "compare one/1.fits one/2.fits two/1.fits -o out.fits",
        &["one/1.fits", "two/1.fits", "w1 + 1", "w1 + 2"],
    );
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = with_maps(2, "--measure evq,evq-direction --window 12 --nside-out 8");
    let sims = "sims/1.fits sims/2.fits";
    folder.misused("compare data.fits sims/1.fits -o out.fits", &["sims/1.fits", "at least two"]);
    folder.refused(&format!("compare data.fits {sims} -o sims/1.fits --overwrite"), &["would replace this input"]);
    folder.refused(&format!("compare data.fits {sims} -o nowhere/out.fits"), &["nowhere"]);
    folder.refused(&format!("compare data.fits {sims} -o out.txt"), &["out.txt", ".fits"]);
    folder.refused(&format!("compare data.fits {sims} -o out.fits --measure psi2"), &["'psi2'", "EVQ, EVQ_DIRECTION"]);
    folder.refused(&format!("compare data.fits {sims} -o out.fits --measure evq-direction"), &["angle"]);
    folder.refused(
        "compare raw/0.fits raw/1.fits raw/2.fits -o out.fits",
        &["raw/0.fits", "no Minkowski map", "longan map", "--work"],
    );
    folder.refused(
        "compare data.fits sims/1.fits raw/2.fits -o out.fits",
        &["data.fits is a Minkowski map", "raw/2.fits is none"],
    );
    folder.misused(&format!("compare data.fits {sims} -o out.fits --window 6"), &["--work"]);
    folder.misused(&format!("compare data.fits {sims} -o out.fits --mask raw/0.fits"), &["--work"]);
    for (scatter, part) in [
        ("1 evq,evq", "longitude and a latitude"),
        ("1,91 evq,evq", "latitude is not between"),
        ("x,1 evq,evq", "longitude is not"),
        ("1,1 evq", "two measures"),
        ("1,1 evq,w1,w2", "two measures"),
    ] {
        folder.misused(&format!("compare data.fits {sims} -o out.fits --scatter {scatter}"), &["--scatter", part]);
    }
    // What is left of it is compared, and the rest is named.
    let ran = folder.run(&format!("compare data.fits {sims} -o out.fits"));
    assert!(ran.code == Some(0) && ran.err.contains("left out is EVQ_DIRECTION: it is an angle"), "{ran:?}");
    let ran =
        folder.run(&format!("compare data.fits {sims} data.fits sims/1.fits -o out.fits --overwrite --measure evq"));
    assert!(ran.code == Some(0) && ran.err.contains("data.fits: the data is among the simulations"), "{ran:?}");
    assert!(ran.err.contains("sims/1.fits: this simulation is given twice"), "{ran:?}");
    // The data among its simulations has company.
    assert!(ran.out.contains("of 4 simulations"), "{ran:?}");
    folder.refused(&format!("compare data.fits {sims} -o out.fits --measure evq"), &["out.fits"]);
}

#[test]
fn a_scatter_plot_is_a_table_and_a_picture() {
    let folder = with_maps(3, MEASURES);
    let words = "compare data.fits sims/*.fits -o out.fits --overwrite --scatter";
    let printed = done(&folder, &format!("{words} 200,-30 evq,rank4-mid"));
    assert!(printed.ends_with("\nwritten: out.fits, out_scatter.csv, out_scatter.png\n"), "{printed}");
    let table = std::fs::read_to_string(folder.path("out_scatter.csv")).unwrap();
    let mut expected = "kind,file,EVQ,RANK4_MID\n".to_owned();
    for (i, name) in ["data.fits", "sims/1.fits", "sims/2.fits", "sims/3.fits"].iter().enumerate() {
        let [x, y] = ["EVQ", "RANK4_MID"].map(|measure| {
            let map = folder.read(name, measure);
            let pixel = map.grid().pixel_at(120f64.to_radians(), 200f64.to_radians());
            map.values()[pixel]
        });
        expected += &format!("{},{name},{x},{y}\n", if i == 0 { "data" } else { "simulation" });
    }
    assert_eq!(table, expected);
    assert!(std::fs::read(folder.path("out_scatter.png")).unwrap().starts_with(b"\x89PNG"));
    done(&folder, &format!("{words} -160,-30 evq,rank4-mid --scatter-output plot.svg"));
    assert_eq!(std::fs::read_to_string(folder.path("plot.csv")).unwrap(), table);
    let svg = std::fs::read_to_string(folder.path("plot.svg")).unwrap();
    assert!(svg.contains("3 simulations") && svg.contains("data.fits") && svg.contains("RANK4_MID [rad]"));
    let refused = all(&folder, "compare data.fits sims/*.fits -o no.fits --scatter 1,1 evq,psi2");
    folder.refused(&refused, &["'psi2' is not compared", "EVQ, W1, RANK4_MID"]);
}

#[test]
fn raw_maps_are_measured_on_the_way() {
    let folder = with_maps(3, MEASURES);
    done(&folder, "compare data.fits sims/*.fits -o expected.fits");
    let words = format!("compare raw/0.fits raw/1.fits raw/2.fits raw/3.fits --work work {MEASURES}");
    folder.done(&format!("{words} -o out.fits"));
    for column in ["EVQ_SIGMA", "W1_GLOBAL_PERCENTILE", "RANK4_MID_LOCAL_PERCENTILE"] {
        assert_same(&folder.read("out.fits", column), &folder.read("expected.fits", column));
    }
    assert_same(&folder.read("work/0.fits", "EVQ"), &folder.read("data.fits", "EVQ"));
    // What is done is not done again, and what is missing is.
    let made = |name: &str| folder.path(name).metadata().unwrap().modified().unwrap();
    let before = made("work/1.fits");
    let bytes = std::fs::read(folder.path("work/2.fits")).unwrap();
    std::fs::remove_file(folder.path("work/2.fits")).unwrap();
    folder.done(&format!("{words} -o again.fits --smooth 20 --level 2"));
    assert_eq!(made("work/1.fits"), before);
    let again = std::fs::read(folder.path("work/2.fits")).unwrap();
    assert!(headers(&again)[0]["INFILE"] == "raw/2.fits" && again.len() == bytes.len());
    // A map that has changed is measured again.
    folder.done("simulate waves -o raw/1.fits --nside 16 --correlation 15 --seed 77 --overwrite");
    folder.done(&format!("{words} -o changed.fits"));
    assert!(made("work/1.fits") > before);

    folder.refused(
        &format!("{} -o no.fits", words.replace("--window 12", "--window 14")),
        &["work", "other options", "windows '12', not '14'"],
    );
    folder.refused(&format!("{} -o no.fits", words.replace("evq,w1", "evq,w2")), &["work", "other options"]);
    std::fs::create_dir(folder.path("elsewhere")).unwrap();
    std::fs::copy(folder.path("raw/2.fits"), folder.path("elsewhere/3.fits")).unwrap();
    folder.refused(
        &format!("{} -o no.fits", words.replace("raw/3.fits", "elsewhere/3.fits")),
        &["work/3.fits", "made of ", "/raw/3.fits, not of ", "/elsewhere/3.fits"],
    );
    folder.refused(
        &format!("{} elsewhere/3.fits -o no.fits", words),
        &["raw/3.fits and elsewhere/3.fits", "different names"],
    );
    folder.refused(
        &format!("{} -o no.fits", words.replace("raw/0", "data")),
        &["data.fits", "already", "without --work"],
    );
    // What `longan map` made of the same files in the same way is as good.
    let before = made("sims/2.fits");
    folder.done(&format!("{} -o other.fits", words.replace("--work work", "--work sims")));
    assert_eq!(made("sims/2.fits"), before);
    std::fs::write(folder.path("sims/2.fits"), "foreign").unwrap();
    folder.refused(&format!("{} -o no.fits", words.replace("--work work", "--work sims")), &["sims/2.fits"]);
}

/// Gaussian fields at Nside 64 and their EVQ in windows of 10°.
fn evq(nside: usize, seed: u64, planted: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let waves = Waves::new(6.0, seed).unwrap().map(Healpix::new(nside).unwrap());
    let grid = waves.grid();
    let values = waves.values().iter().enumerate().map(|(p, v)| {
        let (theta, phi) = grid.centre(p);
        v + planted(phi.to_degrees(), 90.0 - theta.to_degrees())
    });
    let map = longan::Map::new("waves", values.collect()).unwrap();
    let analysis = Analysis { windows: vec![10.0], nside_out: Some(8), ..Analysis::default() };
    analysis
        .minkowski_maps(&map, &[find("evq").unwrap()], longan::go_on)
        .unwrap()
        .blocks
        .remove(0)
        .values
        .row(0)
        .to_vec()
}

#[test]
fn aligned_structures_are_found_where_they_are_planted() {
    const SIMULATIONS: u64 = 40;
    let simulations: Vec<Vec<f64>> = (1..=SIMULATIONS).into_par_iter().map(|seed| evq(64, seed, |_, _| 0.0)).collect();
    let compared = |data: Vec<f64>| {
        let outcome = outcome(&data, &simulations);
        let found: Vec<_> = outcome.outliers(20.0, 4.0, 3).iter().map(|outlier| outlier.peak).collect();
        (found, outcome.rank.unwrap().p_value())
    };
    // Stripes along the meridians within some 15 degrees of (120, 20).
    let (lon, lat) = (120f64, 20f64);
    let stripes = |l: f64, b: f64| {
        let east = (l - lon) * lat.to_radians().cos();
        let distance = east.hypot(b - lat);
        4.0 * (-(distance / 12.0).powi(2)).exp() * (east * 60f64.to_radians()).sin()
    };
    let (peaks, p) = compared(evq(64, 0, stripes));
    let found = peaks.first().expect("a peak beyond 4 sigma");
    let distance = ((found.lon - lon) * lat.to_radians().cos()).hypot(found.lat - lat);
    assert!(found.sigma > 4.0 && distance < 12.0, "{found:?}");
    assert_eq!(p, 1.0 / (SIMULATIONS + 1) as f64);
    // The same sky without them: p is at most 1/41 in one of 41 skies, and this is one of the others.
    let (_, p) = compared(evq(64, 0, |_, _| 0.0));
    assert!(p > 0.05, "{p}");
}

#[test]
fn skies_without_structures_are_not_reported_more_often_than_stated() {
    // 40 skies of noise, each among 19 others of its own: p is 0.05 in one of 20. More than 8 of 40 would be so in fewer
    // than 1 of 3000 runs, and seeds are fixed.
    let analysis = Analysis { windows: vec![15.0], nside_out: Some(4), ..Analysis::default() };
    let measure = [find("evq").unwrap()];
    let evq = |seed| {
        analysis.minkowski_maps(&noise(16, 1000, seed), &measure, longan::go_on).unwrap().blocks[0]
            .values
            .row(0)
            .to_vec()
    };
    let reported = |sky: u64| {
        let simulations: Vec<Vec<f64>> = (1..20).map(|i| evq(100 * sky + i)).collect();
        outcome(&evq(100 * sky), &simulations).rank.unwrap().p_value() <= 0.05
    };
    let reported = (0..40).into_par_iter().filter(|sky| reported(*sky)).count();
    assert!(reported <= 8, "{reported} of 40");
}
