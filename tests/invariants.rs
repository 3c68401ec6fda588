use longan::contour::Field;
use longan::measures::{BuiltIn, find};
use longan::moments::{Selection, Weight};
use longan::simulate::Waves;
use longan::totals::{Totals, totals};
use longan::window::{MovingWindows, Summation};
use longan::{Analysis, Body, Healpix, Map, ThresholdUnit, Thresholds};

use longan_support::{difference, masked, noise, rows, turned};

const NSIDES: [usize; 9] = [1, 2, 3, 4, 5, 8, 13, 16, 64];

fn thresholds(values: &[f64]) -> Thresholds {
    Thresholds::new(values.to_vec()).unwrap()
}

fn totals_of(map: &Map, at: &Thresholds, body: Body) -> (Vec<Totals>, f64) {
    totals(&Field::new(map.grid(), map.values(), at, body))
}

/// Maps of every sort that has caused trouble somewhere: noise, values at the threshold, constants, one pixel, huge
/// and tiny values, a smooth field.
fn maps(nside: usize) -> Vec<Map> {
    let grid = Healpix::new(nside).unwrap();
    let of = |f: &dyn Fn(usize) -> f64| Map::new("", (0..grid.pixels()).map(f).collect()).unwrap();
    let mut maps = vec![
        of(&|_| 1.0),
        of(&|p| f64::from(u8::from(p == grid.pixels() / 3))),
        of(&|p| (p % 2) as f64),
        of(&|p| (p as f64 * 0.7).sin() * 1e308),
        of(&|p| (p as f64 * 0.7).sin() * 1e-308),
        of(&|p| if p % 7 == 0 { f64::MAX } else { -f64::MAX }),
        of(&|p| grid.centre(p).0.cos()),
        Waves::new(20.0, 3).unwrap().map(grid),
    ];
    maps.extend([2, 3, 5, 1000].map(|levels| noise(nside, levels, u64::from(levels))));
    maps
}

fn levels(map: &Map) -> Thresholds {
    // Values of the map itself among them.
    let v = map.values();
    let mut levels = vec![-0.5, 0.0, 0.5, 1.0, 1.5, v[0], v[v.len() / 2], v[v.len() - 1], 0.5 * v[1]];
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    thresholds(&levels)
}

#[test]
fn gauss_bonnet_on_every_map_and_threshold() {
    let mut checked = 0;
    for nside in NSIDES {
        for (i, map) in maps(nside).iter().enumerate() {
            for body in [Body::Above, Body::Below] {
                let (totals, masked) = totals_of(map, &levels(map), body);
                assert_eq!(masked, 0.0);
                for t in totals {
                    let chi = t.euler_characteristic();
                    assert!((chi - chi.round()).abs() < 1e-10, "Nside {nside}, map {i}, {body:?}: χ = {chi}");
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 1000);
}

#[test]
fn body_and_complement_share_the_contour() {
    for nside in NSIDES {
        for map in maps(nside) {
            let levels = levels(&map);
            let (above, _) = totals_of(&map, &levels, Body::Above);
            let (below, _) = totals_of(&map, &levels, Body::Below);
            for (a, b) in above.iter().zip(&below) {
                let sphere = 4.0 * std::f64::consts::PI;
                assert!((a.area + b.area - sphere).abs() < 1e-11);
                assert!((a.length - b.length).abs() <= 1e-13 * a.length);
                assert!((a.curvature + b.curvature).abs() <= 1e-12 * (1.0 + a.curvature.abs()));
                let chi = a.euler_characteristic() + b.euler_characteristic();
                // 2 for whole and empty sphere; in general as many holes as components, plus one.
                assert!((chi - 2.0).abs() < 1e-10);
            }
        }
    }
}

/// All moments of windows, for comparing them.
fn moments(map: &Map, at: &Thresholds, body: Body, output: usize, radius: f64, weight: Weight) -> Vec<Vec<f64>> {
    moments_by(Summation::Exact, map, at, body, output, radius, weight)
}

fn moments_by(
    summation: Summation,
    map: &Map,
    at: &Thresholds,
    body: Body,
    output: usize,
    radius: f64,
    weight: Weight,
) -> Vec<Vec<f64>> {
    let selection =
        Selection { area: true, length: true, curvature: true, ranks: (1..=6).collect(), weight, by_threshold: false };
    let windows = MovingWindows {
        field: &Field::new(map.grid(), map.values(), at, body),
        selection: &selection,
        output: Healpix::new(output).unwrap(),
        radii: &[f64::to_radians(radius)],
        summation,
    }
    .visit(4 + 2 * 6, |m, out| {
        out[..4].copy_from_slice(&[m.masked_fraction, m.area, m.length, m.curvature]);
        m.psi.iter().enumerate().for_each(|(i, p)| out[4 + 2 * i..][..2].copy_from_slice(&[p.re, p.im]));
    });
    rows(&windows[0].values[0])
}

#[test]
fn a_map_turned_by_90_degrees_gives_the_same_to_the_last_bit() {
    for nside in [1, 2, 3, 8, 16] {
        for seed in 0..3 {
            let map = masked(&noise(nside, 5, seed), |p| seed == 2 && p % 11 == 3);
            let at = thresholds(&[1.0, 2.5, 3.0]);
            for (output, radius) in [(nside, 0.0), (nside, 20.0), (4, 35.0), (3, 180.0), (64, 40.0)] {
                let summation = if output == 64 { Summation::default() } else { Summation::Exact };
                for weight in [Weight::Length, Weight::Curvature] {
                    let run = |map: &Map| moments_by(summation, map, &at, Body::Above, output, radius, weight);
                    let (here, there) = (run(&map), run(&turned(&map)));
                    for (a, b) in here.iter().zip(there) {
                        let a = turned(&Map::new("", a.clone()).unwrap());
                        assert_eq!(a.values(), b, "Nside {nside} to {output}, {radius}°, {weight:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn normals_flip_with_the_body() {
    let map = noise(8, 4, 1);
    let at = thresholds(&[1.5]);
    for weight in [Weight::Length, Weight::Curvature] {
        let above = moments(&map, &at, Body::Above, 4, 30.0, weight);
        let below = moments(&map, &at, Body::Below, 4, 30.0, weight);
        for s in 1..=6 {
            // Odd ranks change sign with the normal, and all once more with the curvature.
            let sign = if (s % 2 == 1) == (weight == Weight::Length) { -1.0 } else { 1.0 };
            for row in [2 + 2 * s, 3 + 2 * s] {
                let flipped: Vec<f64> = below[row].iter().map(|x| sign * x).collect();
                assert!(difference(&above[row], &flipped) < 1e-12, "rank {s}, {weight:?}");
            }
        }
    }
}

#[test]
fn one_window_of_the_whole_sphere_has_the_totals() {
    for nside in [1, 3, 8] {
        let map = noise(nside, 6, 9);
        let at = thresholds(&[2.5]);
        let (totals, _) = totals_of(&map, &at, Body::Above);
        let window = moments(&map, &at, Body::Above, 1, 180.0, Weight::Length);
        for pixel in 0..12 {
            assert!((window[1][pixel] - totals[0].area).abs() < 1e-11);
            assert!((window[2][pixel] - totals[0].length).abs() < 1e-11);
            assert!((window[3][pixel] - totals[0].curvature).abs() < 1e-9);
        }
    }
}

#[test]
fn bodies_far_apart_add_up() {
    // Two noisy caps that no cell touches both of.
    let nside = 16;
    let noisy = noise(nside, 3, 5);
    let grid = noisy.grid();
    let part = |inside: &dyn Fn(f64) -> bool| {
        let value = |p: usize| if inside(grid.centre(p).0.to_degrees()) { noisy.values()[p] } else { 0.0 };
        Map::new("", (0..grid.pixels()).map(value).collect()).unwrap()
    };
    let (north, south) = (part(&|t| t < 60.0), part(&|t| t > 110.0));
    let both = part(&|t| !(60.0..=110.0).contains(&t));
    let at = thresholds(&[0.5]);
    let [north, south, both] = [north, south, both].map(|map| moments(&map, &at, Body::Above, 8, 40.0, Weight::Length));
    for row in 1..both.len() {
        let sum: Vec<f64> = north[row].iter().zip(&south[row]).map(|(a, b)| a + b).collect();
        assert!(difference(&both[row], &sum) < 1e-12, "row {row}");
        assert!(difference(&both[row], &vec![0.0; 768]) > 1e-3, "row {row} is empty");
    }
}

#[test]
fn thresholds_average() {
    let map = noise(8, 7, 2);
    let levels = [0.5, 2.0, 2.25, 5.0];
    let mean = moments(&map, &thresholds(&levels), Body::Above, 4, 25.0, Weight::Curvature);
    let each = levels.map(|t| moments(&map, &thresholds(&[t]), Body::Above, 4, 25.0, Weight::Curvature));
    for row in 0..mean.len() {
        let of_each: Vec<f64> = (0..192).map(|p| each.iter().map(|m| m[row][p]).sum::<f64>() / 4.0).collect();
        assert!(difference(&mean[row], &of_each) < 1e-12, "row {row}");
    }
}

fn analyse(threads: usize, map: &Map, analysis: &Analysis, measures: &[BuiltIn]) -> Vec<Vec<f64>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    rows(&pool.install(|| analysis.minkowski_maps(map, measures, longan::go_on)).unwrap().blocks[0].values)
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let map = masked(&Waves::new(8.0, 1).unwrap().map(Healpix::new(64).unwrap()), |p| p % 501 == 0);
    let measures = ["evq", "w0", "w2", "psi5", "rank4-mid"].map(|name| find(name).unwrap());
    for nside_out in [8, 64] {
        let analysis = Analysis { nside_out: Some(nside_out), ..Analysis::default() };
        let one = analyse(1, &map, &analysis, &measures);
        assert!(one[0].iter().any(|v| v.is_finite()));
        for threads in [2, 3, 8] {
            let many = analyse(threads, &map, &analysis, &measures);
            for (a, b) in one.iter().zip(&many) {
                assert!(a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits()), "{threads} threads");
            }
        }
    }
}

#[test]
fn masked_windows_are_masked_and_others_rescaled() {
    let map = masked(&Waves::new(10.0, 4).unwrap().map(Healpix::new(32).unwrap()), |p| p % 97 < 3 || p < 500);
    let names =
        ["w1", "contour-length", "masked-fraction", "psi2", "evq", "trace", "rank4-min", "rank4-mid", "rank4-max"];
    let measures = names.map(|name| find(name).unwrap());
    let with = |max_masked| {
        let analysis =
            Analysis { windows: vec![15.0], threshold_unit: ThresholdUnit::Sigma, max_masked, ..Analysis::default() };
        rows(&analysis.minkowski_maps(&map, &measures, longan::go_on).unwrap().blocks[0].values)
    };
    let (all, some) = (with(1.0), with(0.2));
    let fraction = &all[2];
    assert!(fraction.iter().any(|&f| f > 0.9) && fraction.iter().any(|&f| f < 0.2));
    for p in 0..fraction.len() {
        if fraction[p].is_nan() {
            assert!(all[0][p].is_nan(), "wholly masked");
            continue;
        }
        assert!((all[0][p] * (1.0 - fraction[p]) - all[1][p]).abs() < 1e-12);
        // Every measure sees the same moments.
        let [w1, psi2, evq, trace] = [all[0][p], all[3][p], all[4][p], all[5][p]];
        if evq.is_finite() {
            assert!(((w1 - psi2) / (w1 + psi2) * evq - 1.0).abs() < 1e-12);
        }
        let eigenvalues: f64 = (6..9).map(|row| all[row][p]).sum();
        assert!((eigenvalues - trace).abs() < 1e-12);
        for row in 0..4 {
            assert_eq!(some[row][p].is_nan(), fraction[p] > 0.2 || all[row][p].is_nan());
        }
    }
}
