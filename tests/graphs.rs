//! What graphs are made of: each threshold by itself in one pass, sums over regions, and what Gaussian fields have.

use longan::contour::Field;
use longan::gaussian::Gaussian;
use longan::measures::find;
use longan::simulate::Waves;
use longan::totals::{Totals, totals, totals_within};
use longan::window::Summation;
use longan::{Analysis, Body, Healpix, Map, Region, ThresholdUnit, Thresholds};

use longan_support::{difference, masked, noise};

#[test]
fn a_threshold_among_many_is_as_it_is_alone() {
    let holes = masked(&noise(16, 7, 3), |p| p % 97 == 5);
    let measures = ["w0", "w1", "w2", "evq", "psi1", "psi4-direction"].map(|name| find(name).unwrap());
    for map in [noise(16, 7, 3), holes] {
        for summation in [Summation::Exact, Summation::Tolerance(1e-7), Summation::Prefix(1e-5)] {
            for body in [Body::Above, Body::Below] {
                let analysis = Analysis {
                    thresholds: "0.5,2,3.25,6,9".parse().unwrap(),
                    threshold_unit: ThresholdUnit::Value,
                    windows: vec![25.0, 0.0],
                    nside_out: Some(16),
                    body,
                    summation,
                    max_masked: 0.5,
                    ..Analysis::default()
                };
                let all = Analysis { by_threshold: true, ..analysis.clone() };
                let all = all.minkowski_maps(&map, &measures, longan::go_on).unwrap().blocks;
                assert_eq!(all.len(), 10);
                for (i, maps) in all.iter().enumerate() {
                    let thresholds = Thresholds::new(vec![analysis.thresholds.values()[i % 5]]).unwrap();
                    assert_eq!((maps.window, &maps.thresholds), ([25.0, 0.0][i / 5], &thresholds));
                    let windows = vec![maps.window];
                    let alone = Analysis { thresholds, windows, ..analysis.clone() };
                    let alone = &alone.minkowski_maps(&map, &measures, longan::go_on).unwrap().blocks[0];
                    for (a, b) in maps.values.rows().into_iter().zip(alone.values.rows()) {
                        assert_eq!(difference(&a.to_vec(), &b.to_vec()), 0.0, "{summation:?} {body:?} {i}");
                    }
                    assert_eq!(maps.counts, alone.counts);
                }
            }
        }
    }
}

#[test]
fn parts_of_the_sphere_add_up_to_it() {
    let thresholds: Thresholds = "0.5,2,3.25".parse().unwrap();
    for map in [noise(16, 7, 3), masked(&noise(16, 7, 3), |p| p % 31 == 5 || p < 100)] {
        for body in [Body::Above, Body::Below] {
            let field = Field::new(map.grid(), map.values(), &thresholds, body);
            let (whole, without) = totals(&field);
            let all = totals_within(&field, Some(&Region::new(10.0, 20.0, 180.0).unwrap()));
            assert_eq!((&all.totals, all.masked), (&whole, without));
            assert!((all.unmasked + without - 4.0 * std::f64::consts::PI).abs() < 1e-11);
            // A disc, and what is beyond it: that about the opposite point. No pixel's centre lies on the edge.
            let parts = [(40.0, 55.0, 77.7), (-140.0, -55.0, 102.3)]
                .map(|(lon, lat, radius)| totals_within(&field, Some(&Region::new(lon, lat, radius).unwrap())));
            let [one, other] = &parts;
            assert!((one.masked + other.masked - without).abs() < 1e-11);
            assert!((one.unmasked + other.unmasked - all.unmasked).abs() < 1e-11);
            for ((one, other), whole) in one.totals.iter().zip(&other.totals).zip(&whole) {
                assert!((one.area + other.area - whole.area).abs() < 1e-10);
                assert!((one.length + other.length - whole.length).abs() < 1e-9);
                assert!((one.curvature + other.curvature - whole.curvature).abs() < 1e-9);
            }
        }
    }
}

/// Simulated skies, and what is measured of them.
const SKIES: u64 = 40;
/// Standard errors within which a mean must lie. With 40 skies, by Student's distribution, one mean is beyond in 6 of 100 000
/// cases, so one of the 54 below in fewer than 4 of 1000; the seeds are fixed.
const ERRORS: f64 = 4.5;

/// Mean and standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

#[test]
fn skies_are_on_the_mean_as_the_analytic_curves() {
    check_skies(10.0, |_| false);
}

/// Many small holes: 1 in 60 pixels, so that every 15th cell and every 8th edge is lost.
#[test]
fn skies_with_holes_are_on_the_mean_as_the_analytic_curves() {
    check_skies(10.0, is_hole);
}

fn is_hole(pixel: usize) -> bool {
    pixel * 7919 % 60 == 11
}

/// Against the same skies without holes, the scatter of the skies drops out. Six pixels to the correlation angle.
#[test]
fn holes_do_not_change_what_skies_have_per_area() {
    let grid = Healpix::new(64).unwrap();
    let thresholds: Thresholds = "-2:2:9".parse().unwrap();
    let mut excess = vec![[const { Vec::new() }; 3]; 9];
    let mut largest = [0.0f64; 3];
    for seed in 0..SKIES {
        let waves = Waves::new(5.5, seed).unwrap();
        let thresholds = thresholds.in_units_of(0.0, waves.sigma0()).unwrap();
        let map = waves.map(grid);
        let of = |map: &Map| {
            let regional = totals_within(&Field::new(grid, map.values(), &thresholds, Body::Above), None);
            regional.made_up().iter().map(|t| t.per_area(regional.unmasked)).collect::<Vec<_>>()
        };
        for (t, (without, with)) in of(&map).iter().zip(of(&masked(&map, is_hole))).enumerate() {
            let three = |t: &Totals| [t.area, t.length, t.curvature];
            for (q, (without, with)) in three(without).into_iter().zip(three(&with)).enumerate() {
                excess[t][q].push(with - without);
                largest[q] = largest[q].max(without.abs());
            }
        }
    }
    for (t, threshold) in thresholds.values().iter().enumerate() {
        for q in 0..3 {
            let (excess, error) = mean(&excess[t][q]);
            assert!(excess.abs() < ERRORS * error, "{threshold} {q}: {excess} ± {error}");
            assert!(error < 0.003 * largest[q], "{threshold} {q}: ± {error} of {} says little", largest[q]);
        }
    }
}

/// What skies of this correlation angle in degrees have per area, with some pixels masked.
fn check_skies(correlation: f64, hole: fn(usize) -> bool) {
    // Eleven pixels to a correlation angle of 10°: contours are short by less than 0.1 %.
    let grid = Healpix::new(64).unwrap();
    let skies: Vec<(Waves, Map)> = (0..SKIES)
        .map(|seed| {
            let waves = Waves::new(correlation, seed).unwrap();
            let map = masked(&waves.map(grid), hole);
            (waves, map)
        })
        .collect();
    let thresholds: Thresholds = "-2:2:9".parse().unwrap();
    for body in [Body::Above, Body::Below] {
        // Deviations from the curves of the ensemble, and from those of each map's own scales.
        let mut of_ensemble = vec![[const { Vec::new() }; 3]; 9];
        let mut of_itself = vec![[const { Vec::new() }; 3]; 9];
        for (waves, map) in &skies {
            let regional = totals_within(&Field::new(grid, map.values(), &thresholds, body), None);
            let ensemble = Gaussian { mean: 0.0, sigma0: waves.sigma0(), sigma1: waves.sigma1() };
            let itself = Gaussian::of(map).unwrap();
            for (t, &threshold) in thresholds.values().iter().enumerate() {
                let seen = regional.made_up()[t].per_area(regional.unmasked);
                for (gaussian, all) in [(ensemble, &mut of_ensemble), (itself, &mut of_itself)] {
                    let expected = gaussian.per_area(threshold, body);
                    all[t][0].push(seen.area - expected.area);
                    all[t][1].push(seen.length - expected.length);
                    all[t][2].push(seen.euler_characteristic() - expected.euler_characteristic());
                }
            }
        }
        let largest = Gaussian { mean: 0.0, sigma0: 1.0, sigma1: skies[0].0.sigma1() };
        let largest = [1.0, largest.per_area(0.0, body).length, largest.per_area(1.0, body).euler_characteristic()];
        for (t, threshold) in thresholds.values().iter().enumerate() {
            for q in 0..3 {
                let (excess, error) = mean(&of_ensemble[t][q]);
                assert!(excess.abs() < ERRORS * error, "{body:?} {threshold} {q}: {excess} ± {error}");
                assert!(error < 0.05 * largest[q].abs(), "{body:?} {threshold} {q}: ± {error} says little");
                // A map's own scales follow its fluctuations, so that it deviates less, but for what they take with them.
                let (excess, error) = mean(&of_itself[t][q]);
                assert!(excess.abs() < ERRORS * error + 0.01 * largest[q].abs(), "{body:?} {threshold} {q}: {excess}");
            }
        }
    }
}
