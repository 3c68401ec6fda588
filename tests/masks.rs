use longan::measures::{BUILT_INS, BuiltIn, Formula, Measure};
use longan::simulate::Waves;
use longan::{Analysis, Healpix, Map, ThresholdUnit, Weight};
use longan_formats::{self as formats, Selection};

use longan_support::{masked, rows};

/// Every built-in measure that is neither a direction nor tells of the mask itself, with ranks 1 to 4 of families.
fn measures() -> Vec<BuiltIn> {
    let of_kind = |kind: &&'static longan::measures::Kind| -> Vec<BuiltIn> {
        let kind = *kind;
        let ranks = if kind.rank.is_none() { 1..=4 } else { 1..=1 };
        ranks.map(|rank| BuiltIn::new(kind, rank)).collect()
    };
    let all = BUILT_INS.iter().flat_map(of_kind);
    all.filter(|m| m.unit() != "deg" && !["masked-fraction", "contour-length"].contains(&m.name().as_str())).collect()
}

/// The ratio of each measure in windows that a mask takes little of to that without it must be 1 within its scatter. Windows do not overlap.
fn check_ratios(skies: &[(Map, Map)], weight: Weight) {
    let measures = measures();
    // On this side of the mean W2 is positive, and so fit to divide by.
    let analysis = Analysis {
        thresholds: "0.5,1,1.5".parse().unwrap(),
        threshold_unit: ThresholdUnit::Sigma,
        windows: vec![10.0],
        nside_out: Some(4),
        weight,
        max_masked: 0.2,
        ..Analysis::default()
    };
    let run = |map: &Map, analysis: &Analysis| {
        rows(&analysis.minkowski_maps(map, &measures, longan::go_on).unwrap().blocks[0].values)
    };
    // The thresholds are those of the whole sky, so that the body is the same.
    let of_sky = skies.iter().map(|(sky, with_holes)| {
        let (thresholds, _) = analysis.thresholds_of(sky).unwrap();
        let analysis = Analysis { thresholds, threshold_unit: ThresholdUnit::Value, ..analysis.clone() };
        (run(sky, &analysis), run(with_holes, &analysis))
    });
    let of_sky: Vec<_> = of_sky.collect();
    for (i, measure) in measures.iter().enumerate() {
        let pairs = of_sky.iter().flat_map(|(whole, holes)| whole[i].iter().zip(&holes[i]));
        let pairs: Vec<(f64, f64)> =
            pairs.map(|(a, b)| (*a, *b)).filter(|(a, b)| a.is_finite() && b.is_finite()).collect();
        let n = pairs.len() as f64;
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / n;
        // Medians of quotients, as these have no bound: single windows would rule their means.
        let centre = |values: Vec<f64>| if measure.is_relative() { median(values) } else { mean(values) };
        let size = centre(pairs.iter().map(|(a, _)| a.abs()).collect());
        let excess: Vec<f64> = pairs.iter().map(|(a, b)| (b - a) / size).collect();
        let (all, excess) = (excess.clone(), centre(excess));
        // The standard deviation of the mean; for the median, from the median deviation of a normal distribution.
        let scatter = match measure.is_relative() {
            true => 1.2533 * 1.4826 * median(all.iter().map(|e| (e - excess).abs()).collect()) / n.sqrt(),
            false => (mean(all.iter().map(|e| (e - excess).powi(2)).collect()) / n).sqrt(),
        };
        assert!(n > 60.0, "{weight:?} {}: {n} windows", measure.name());
        // What is lost at random makes vectors longer, by about half the variance that it brings.
        let allowed = 4.0 * scatter + scatter * scatter * n;
        assert!(excess.abs() < allowed, "{weight:?} {}: {excess} ± {scatter}", measure.name());
        assert!(scatter < 0.05, "{weight:?} {}: ± {scatter} says little", measure.name());
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn every_measure_of_masked_windows_is_that_of_whole_ones() {
    let grid = Healpix::new(64).unwrap();
    let skies: Vec<(Map, Map)> = (0..4)
        .map(|seed| {
            let sky = Waves::new(5.0, seed).unwrap().map(grid);
            let with_holes = masked(&sky, |p| p * 7919 % 97 == 11);
            (sky, with_holes)
        })
        .collect();
    check_ratios(&skies, Weight::Length);
    check_ratios(&skies, Weight::Curvature);
}

#[test]
fn every_measure_of_the_masked_shared_sky_is_that_of_the_whole() {
    let Some(shared) = longan_support::shared() else { return };
    let read = |name: &str| formats::read(&shared.join("cases").join(name), &Selection::default()).unwrap();
    let sky = read("sky64.fits");
    let mut with_holes = sky.clone();
    with_holes.apply_mask(&read("mask64.fits"), 0.9).unwrap();
    let skies = [(sky, with_holes)];
    check_ratios(&skies, Weight::Length);
}

#[test]
fn windows_with_little_contour_have_no_ratios_where_that_is_asked_for() {
    let sky = Waves::new(5.0, 5).unwrap().map(Healpix::new(64).unwrap());
    let names = ["evq", "beta", "q2", "evq-direction", "psi2", "w1", "masked-fraction", "contour-length"];
    let mut measures: Vec<std::sync::Arc<dyn Measure>> =
        names.iter().map(|name| std::sync::Arc::new(longan::measures::find(name).unwrap()) as _).collect();
    measures.push(std::sync::Arc::new(Formula::new("axis = psi2/w1").unwrap()));
    let run = |min_contour| {
        let analysis = Analysis { min_contour, thresholds: "0,1".parse().unwrap(), ..Analysis::default() };
        analysis.minkowski_maps(&masked(&sky, |p| p % 301 == 0), &measures, longan::go_on).unwrap()
    };
    let radius = 6f64.to_radians();
    let (all, some) = (run(0.0), run(1.0));
    let grid = all.grid;
    let [all, some] = [&all.blocks[0], &some.blocks[0]];
    let mut left_out = 0;
    for p in 0..grid.pixels() {
        let short = all.values[[7, p]] < radius;
        left_out += usize::from(short);
        for (i, (all, some)) in all.values.rows().into_iter().zip(some.values.rows()).enumerate() {
            let undefined = short && [0, 1, 2, 3, 8].contains(&i);
            let same = some[p].to_bits() == all[p].to_bits() || (some[p].is_nan() && all[p].is_nan());
            assert!(if undefined { some[p].is_nan() } else { same }, "pixel {p}, measure {i}: {} {}", all[p], some[p]);
        }
    }
    assert!(left_out > 100 && left_out < 2900, "{left_out}");
    assert_eq!(all.masked, some.masked);
    assert_eq!(all.masked, all.values.row(6).iter().filter(|v| v.is_nan()).count());
    for (windows, least) in [(vec![6.0], -1.0), (vec![6.0], f64::NAN), (vec![0.0], 1.0)] {
        let analysis = Analysis { windows, min_contour: least, ..Analysis::default() };
        assert!(analysis.check(sky.grid()).is_err());
    }
}

#[test]
fn undefined_maps_have_the_blocks_of_defined_ones() {
    let measures = [longan::measures::find("evq").unwrap()];
    let analysis = Analysis {
        thresholds: "-1,0,1".parse().unwrap(),
        windows: vec![10.0, 20.0],
        by_threshold: true,
        nside_out: Some(2),
        ..Analysis::default()
    };
    let sky = Waves::new(20.0, 3).unwrap().map(Healpix::new(8).unwrap());
    let blocks = |maps: longan::MinkowskiMaps| -> Vec<(f64, usize, usize)> {
        maps.blocks.iter().map(|b| (b.window, b.thresholds.values().len(), b.values.len())).collect()
    };
    let defined = blocks(analysis.minkowski_maps(&sky, &measures, longan::go_on).unwrap());
    assert_eq!(blocks(analysis.undefined(&vec![1.0; 768], &measures).unwrap()), defined);
    assert_eq!(defined.iter().map(|block| block.1).collect::<Vec<_>>(), [1; 6]);
}
