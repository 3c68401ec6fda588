use std::f64::consts::PI;

use super::gridded::Layout;
use super::*;

/// A CSV with its columns by name.
struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(folder: &Folder, name: &str) -> Self {
        let text = std::fs::read_to_string(folder.path(name)).unwrap();
        let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines().map(split);
        let head = lines.next().unwrap();
        let rows: Vec<_> = lines.collect();
        assert!(rows.iter().all(|row| row.len() == head.len()), "{text}");
        Table { head, rows }
    }

    /// The cells of a column, of one measure.
    #[track_caller]
    fn texts(&self, measure: &str, column: &str) -> Vec<&str> {
        let place = |name: &str| self.head.iter().position(|n| n == name).unwrap_or_else(|| panic!("no {name}"));
        let (of, wanted) = (place("measure"), place(column));
        self.rows.iter().filter(|row| row[of] == measure).map(|row| &*row[wanted]).collect()
    }

    /// The same as numbers, NaN where a cell is empty.
    #[track_caller]
    fn column(&self, measure: &str, column: &str) -> Vec<f64> {
        self.texts(measure, column).iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()
    }
}

#[test]
fn densities_are_totals_per_area() {
    let folder = Folder::with_sky();
    folder.write("mask.fits", &map_file(&[&[0.0; 1000][..], &[1.0; 2072]].concat(), &[]));
    for options in ["", "--mask mask.fits", "--body below", "--thresholds -1,0.25,2e-6"] {
        folder.done(&format!("graph sky.fits -o graph.csv --overwrite {options}"));
        let options = if options.contains("thresholds") {
            options.to_owned()
        } else {
            format!("{options} --thresholds -4:4:33 --threshold-unit sigma")
        };
        let totals = folder.done(&format!("totals sky.fits --format csv {options}"));
        let graph = Table::read(&folder, "graph.csv");
        let measures = ["w0", "w1", "w2", "euler"];
        let [thresholds, masked] = ["threshold", "area_sr"].map(|column| graph.column("w0", column));
        assert_eq!(graph.rows.len(), 4 * (totals.lines().count() - 1));
        for (t, line) in totals.lines().skip(1).enumerate() {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
            assert_eq!(thresholds[t], cells[0]);
            let area = 4.0 * PI - cells[5];
            assert!((masked[t] - area).abs() < 1e-12);
            let [w0, w1, w2, euler] = measures.map(|measure| graph.column(measure, "value")[t] * area);
            assert!(difference(&[w0, w1, w2], &cells[1..4]) < 1e-11, "{options}: {w0} {w1} {w2} and {line}");
            assert!((euler - (w0 + w2) / (2.0 * PI)).abs() < 1e-11);
            assert!(cells[4].is_nan() || (euler - cells[4]).abs() < 1e-9);
        }
        // The whole sphere as a region.
        folder.done(&format!("graph sky.fits -o region.csv --overwrite --region 12,-34,180 {options}"));
        let region = Table::read(&folder, "region.csv");
        assert_eq!(region.texts("w1", "region_lat")[0], "-34");
        for measure in measures {
            assert_eq!(region.column(measure, "value"), graph.column(measure, "value"));
        }
    }
    let graph = Table::read(&folder, "graph.csv");
    assert_eq!([graph.texts("w0", "unit")[0], graph.texts("w2", "unit")[0]], ["", "rad/sr"]);
    assert_eq!(graph.texts("euler", "unit")[0], "1/sr");
}

#[test]
fn means_are_those_of_the_maps_of_a_sequence() {
    let folder = Folder::with_sky();
    folder.write("mask.fits", &map_file(&[&[0.0; 900][..], &[1.0; 2172]].concat(), &[]));
    let options = "--measure evq,psi2,'beta = (w1 - psi2)/(w1 + psi2)',longan:w0 --window 20 --nside-out 8 \
                   --mask mask.fits --thresholds -2,0,1.5,9";
    folder.done(&format!("map sky.fits -o each.fits {options} --sequence"));
    folder.done(&format!("graph sky.fits -o whole.csv {options}"));
    folder.done(&format!("graph sky.fits -o region.csv {options} --region 30,-20,40"));
    let (whole, region) = (Table::read(&folder, "whole.csv"), Table::read(&folder, "region.csv"));
    let within = longan::Region::new(30.0, -20.0, 40.0).unwrap().pixels(longan::Healpix::new(8).unwrap());
    for (measure, column) in [("evq", "EVQ"), ("psi2", "PSI2"), ("beta", "BETA"), ("longan:w0", "W0")] {
        for t in 0..4 {
            let map = folder.read_hdu("each.fits", column, Some(t + 1));
            let everywhere = vec![true; within.len()];
            for (table, pixels) in [(&whole, &everywhere), (&region, &within)] {
                let values = map.values().iter().zip(pixels).filter(|(v, within)| **within && !v.is_nan());
                let values: Vec<f64> = values.map(|(v, _)| *v).collect();
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                assert_eq!(table.column(measure, "windows")[t], values.len() as f64);
                assert!(difference(&[table.column(measure, "value")[t]], &[mean]) < 1e-12 * mean.abs().max(1.0));
            }
        }
        // No contour at the highest threshold: EVQ is undefined everywhere, an area is 0.
        let highest = whole.texts(measure, "value")[3];
        assert_eq!(highest, if ["evq", "beta"].contains(&measure) { "" } else { "0" });
        assert_eq!(whole.texts(measure, "window")[0], "20");
    }
}

#[test]
fn gaussian_curves_have_the_scales_of_the_map() {
    let folder = Folder::new();
    folder.done("simulate waves -o sky.fits --nside 32 --correlation 12");
    let out = folder.done("graph sky.fits -o graph.csv --gaussian --measure w0,w1,w2,euler,evq");
    let graph = Table::read(&folder, "graph.csv");
    let [sigma0, sigma1] = ["sigma0", "sigma1"].map(|column| graph.column("w1", column)[0]);
    assert!(out.contains(&format!("sigma1 {sigma1} per radian from finite differences")), "{out}");
    assert!(graph.texts("evq", "gaussian").iter().all(|cell| cell.is_empty()));
    for (t, nu) in graph.column("w1", "threshold_sigma").into_iter().enumerate() {
        assert_eq!(nu, -4.0 + 0.25 * t as f64);
        let slope = sigma1 / sigma0;
        let length = slope / (2.0 * 2f64.sqrt()) * (-nu * nu / 2.0).exp();
        let [w0, w1, w2, euler] = ["w0", "w1", "w2", "euler"].map(|measure| graph.column(measure, "gaussian")[t]);
        assert!((w1 - length).abs() < 1e-12);
        assert!((w2 - length * slope * nu / PI.sqrt()).abs() < 1e-11);
        assert!((euler - (w0 + w2) / (2.0 * PI)).abs() < 1e-13);
    }
    // ½ erfc(ν/√2) at −1, 0 and 1.
    let w0 = graph.column("w0", "gaussian");
    assert!(difference(&[w0[12], w0[16], w0[20]], &[0.841344746068543, 0.5, 0.158655253931457]) < 1e-12);
}

#[test]
fn percentiles_count_the_simulations() {
    let folder = Folder::new();
    let mut names = Vec::new();
    for seed in 1..=7 {
        let name = format!("sim{seed}.fits");
        folder.done(&format!("simulate waves -o {name} --nside 16 --correlation 15 --seed {seed}"));
        folder.done(&format!("graph {name} -o sim{seed}.csv --measure w1,evq"));
        names.push(name);
    }
    let simulations: Vec<Table> = (1..=7).map(|seed| Table::read(&folder, &format!("sim{seed}.csv"))).collect();
    // One of the simulations is the input too.
    let words = format!("graph sim3.fits -o graph.svg --measure w1,evq --ensemble {}", names.join(" "));
    let ran = folder.run(&words);
    assert!(ran.code == Some(0) && ran.err.contains("with 7 simulations the band of 95 %"), "{ran:?}");
    let graph = Table::read(&folder, "graph.csv");
    let mut undefined = 0;
    for measure in ["w1", "evq"] {
        for t in 0..33 {
            let all = simulations.iter().map(|table| table.column(measure, "value")[t]);
            let mut all: Vec<f64> = all.filter(|value| !value.is_nan()).collect();
            all.sort_by(f64::total_cmp);
            let value = graph.column(measure, "value")[t];
            let count = |keep: &dyn Fn(f64) -> bool| all.iter().filter(|v| keep(**v)).count() as f64;
            let percent = (count(&|v| v < value) + 0.5 * count(&|v| v == value)) / all.len() as f64 * 100.0;
            let column = |name: &str| graph.column(measure, name)[t];
            assert_eq!(column("simulations"), all.len() as f64);
            undefined += 7 - all.len();
            if value.is_nan() {
                assert!(column("percentile").is_nan());
            } else {
                assert!((column("percentile") - percent).abs() < 1e-12, "{measure} {t}");
            }
            if all.len() == 7 {
                assert_eq!(column("ensemble_median"), all[3]);
                // numpy's quantiles: 0.16 · 6 = 0.96 of the way.
                let expected = all[0] + 0.96 * (all[1] - all[0]);
                assert!((column("ensemble_p16") - expected).abs() < 1e-12 * expected.abs().max(1.0));
                assert!(column("ensemble_p2.5") <= column("ensemble_p16"));
                assert!(column("ensemble_p84") <= column("ensemble_p97.5"));
            }
        }
    }
    assert!(undefined > 0);
    let svg = std::fs::read_to_string(folder.path("graph.svg")).unwrap();
    for part in ["sim3.fits", "of 7 simulations", "⟨evq⟩, windows of 6°", "contour length W₁/A [rad/sr]"] {
        assert!(svg.contains(part), "no '{part}'");
    }
}

#[test]
fn a_field_with_times_has_a_curve_for_each() {
    let folder = Folder::new();
    let field = |step: usize, latitude: f64, longitude: f64| {
        let wave = latitude.to_radians().cos() * (longitude.to_radians() + step as f64).sin();
        if step == 2 { f64::NAN } else { wave * (step + 1) as f64 }
    };
    Layout { steps: 4, ..Layout::of(7.5) }.write(&folder.path("series.nc"), field);
    let ran = folder.run("graph series.nc -o graph.png --measure w1");
    assert!(ran.code == Some(0) && ran.err.contains("series.nc: at 1997-12-03: every pixel"), "{ran:?}");
    let graph = Table::read(&folder, "graph.csv");
    let times = graph.texts("w1", "time");
    assert_eq!(times.len(), 3 * 33);
    for (i, day) in ["1997-12-01", "1997-12-02", "1997-12-04"].iter().enumerate() {
        assert!(times[33 * i..33 * (i + 1)].iter().all(|time| time == day));
    }
    // A picture tells seven curves apart; numbers have no such limit.
    Layout { steps: 8, ..Layout::of(15.0) }.write(&folder.path("many.nc"), |step, lat, lon| field(step / 3, lat, lon));
    folder.refused("graph many.nc -o many.png", &["8 maps", "the 7 that", "--select", "-o many.csv"]);
    folder.run("graph many.nc -o many.csv --thresholds 0 --measure w1 --quiet");
    assert_eq!(Table::read(&folder, "many.csv").rows.len(), 6);
}

#[test]
fn numbers_come_beside_the_picture() {
    let folder = Folder::with_sky();
    let out = folder.done("graph sky.fits -o graph.PNG --thresholds log:0.01:1:5");
    assert!(out.starts_with("graph.PNG, graph.csv: w0, w1, w2, euler at 5 thresholds"), "{out}");
    assert!(std::fs::read(folder.path("graph.PNG")).unwrap().starts_with(b"\x89PNG"));
    // Either file is left alone.
    folder.refused("graph sky.fits -o graph.svg", &["graph.csv: ", "exists", "--overwrite"]);
    std::fs::remove_file(folder.path("graph.csv")).unwrap();
    folder.refused("graph sky.fits -o graph.PNG", &["graph.PNG: ", "exists"]);
    assert_eq!(folder.done("graph sky.fits -o graph.PNG --overwrite --quiet"), "");
    // Names with commas, quotes and tags are texts.
    std::fs::copy(folder.path("sky.fits"), folder.path("a <b> & \"c\", d.fits")).unwrap();
    folder.done("graph 'a <b> & \"c\", d.fits' sky.fits -o names.svg --gaussian --region 0,0,90");
    let csv = std::fs::read_to_string(folder.path("names.csv")).unwrap();
    assert!(csv.contains("\n\"a <b> & \"\"c\"\", d.fits\",w0,"), "{csv}");
    let svg = std::fs::read_to_string(folder.path("names.svg")).unwrap();
    assert!(svg.contains("a &lt;b&gt; &amp;") && !svg.contains("<b>"));
    // However many threads.
    folder.done("graph sky.fits -o one.csv --threads 1 --measure w1,evq --gaussian");
    folder.done("graph sky.fits -o three.csv --threads 3 --measure w1,evq --gaussian");
    let [one, three] = ["one.csv", "three.csv"].map(|name| std::fs::read(folder.path(name)).unwrap());
    assert_eq!(one, three);
}

#[test]
fn refusals() {
    let folder = Folder::with_sky();
    folder.write("mask.fits", &map_file(&[&[0.0; 1536][..], &[1.0; 1536]].concat(), &[]));
    folder.write("flat.fits", &map_file(&[3.0; 12], &[]));
    folder.write("list.csv", b"lon,lat,rain\n0,0,1\n");
    let graph = |rest: &str| format!("graph sky.fits {rest}");
    folder.refused(&graph("-o graph.pdf"), &["graph.pdf: ", ".png or .svg", ".csv"]);
    folder.refused(&graph("-o graph"), &["graph: ", ".png or .svg"]);
    folder.refused(&graph("-o none/graph.png"), &["folder none does not exist"]);
    folder.refused("graph list.csv -o list.svg --overwrite", &["list.csv: the output would replace this input"]);
    folder.refused(&graph("-o a.csv --ensemble sky.fits"), &["ensemble of one", "more files"]);
    folder.refused(&graph("-o a.csv --ensemble sky.fits none.fits"), &["none.fits"]);
    folder.refused("graph flat.fits -o a.csv", &["flat.fits: ", "vary too little"]);
    folder.refused("graph flat.fits -o a.csv --gaussian --thresholds 1", &["flat.fits: ", "no scatter", "--gaussian"]);
    folder.refused(&graph("-o a.csv --region 0,80,5 --mask mask.fits"), &["sky.fits: ", "region is masked"]);
    folder.refused(&graph("-o a.csv --region 1,1,0.01"), &["sky.fits: no pixel's centre lies in the region"]);
    folder.refused(
        &graph("-o a.csv --region 1,1,0.01 --measure evq"),
        &["sky.fits: no window's centre lies in the region", "--nside-out"],
    );
    folder.refused(&graph("-o a.csv --measure evq --nside-out 500000000"), &["Nside 500000000 needs more memory"]);
    for (options, parts) in [
        ("--measure w1,nonsense", &["nonsense", "longan measures"][..]),
        ("--measure w1,w1", &["'w1' is given twice"]),
        ("--measure psi2-direction", &["means nothing", "psi2.re"]),
        ("--measure 'x = (w1'", &["--measure", "(w1"]),
        ("--measure evq --gaussian", &["--gaussian is about w0, w1, w2 and euler"]),
        ("--region 1,2", &["lon,lat,radius"]),
        ("--region 1,95,3", &["latitude 95"]),
        ("--region 1,2,0", &["radius of 0 degrees"]),
        ("--window 200", &["not between 0 and 180"]),
        ("--thresholds 3:1:4", &["lo < hi"]),
    ] {
        folder.misused(&graph(&format!("-o a.csv {options}")), parts);
    }
}
