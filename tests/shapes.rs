use std::f64::consts::{PI, TAU};

use longan::measures::{BuiltIn, find};
use longan::simulate::{Body as Solid, Edge, Shape, Waves, shapes};
use longan::{Analysis, Body, Healpix, Map, ThresholdUnit, Thresholds};

fn at(threshold: f64) -> Analysis {
    Analysis {
        thresholds: Thresholds::new(vec![threshold]).unwrap(),
        threshold_unit: ThresholdUnit::Value,
        ..Analysis::default()
    }
}

fn solid(shape: Shape, lon: f64, lat: f64, size: f64) -> Solid {
    Solid::new(shape, lon, lat, size, 0.0).unwrap()
}

/// Measures in the window about the output pixel that holds a place.
fn there(map: &Map, analysis: &Analysis, names: &[&str], (lon, lat): (f64, f64)) -> Vec<f64> {
    let measures: Vec<BuiltIn> = names.iter().map(|n| find(n).unwrap()).collect();
    let maps = analysis.minkowski_maps(map, &measures, longan::go_on).unwrap();
    let pixel = maps.grid.pixel_at((90.0 - lat).to_radians(), lon.to_radians());
    maps.blocks[0].values.column(pixel).to_vec()
}

#[test]
fn binary_rectangles_have_the_paper_s_quotients() {
    let grid = Healpix::new(512).unwrap();
    for (shape, size, expected) in
        [(Shape::Square, 4.0, 1.002), (Shape::Rectangle2, 6.0, 2.003), (Shape::Rectangle3, 6.0, 3.010)]
    {
        let map = shapes(grid, &[solid(shape, 0.0, 0.0, size)], Edge::Binary);
        let evq = there(&map, &at(0.5), &["evq"], (0.0, 0.0))[0];
        assert!((evq - expected).abs() < 6e-4, "{shape}: {evq}, not {expected}");
    }
}

#[test]
fn smooth_rectangles_converge_to_the_moments_of_their_sides() {
    let names = ["psi2", "psi4", "w1"];
    for (shape, a, b) in [(Shape::Square, 4.0, 4.0), (Shape::Rectangle2, 6.0, 3.0), (Shape::Rectangle3, 6.0, 2.0)] {
        let [coarse, fine] = [256, 512].map(|nside| {
            let map = shapes(Healpix::new(nside).unwrap(), &[solid(shape, 20.0, 30.0, a)], Edge::Smooth);
            there(&map, &Analysis { windows: vec![8.0], ..at(0.0) }, &names, (20.0, 30.0))
        });
        let (a, b) = (f64::to_radians(a), f64::to_radians(b));
        let limits = [2.0 * (a - b), 2.0 * (a + b), 2.0 * (a + b)];
        for i in 0..3 {
            // Contours cut the corners by about a pixel, so the error shrinks with the pixels.
            let [coarse, fine] = [coarse[i], fine[i]].map(|got| (got - limits[i]).abs());
            let what = format!("{shape}, {}: off by {coarse}, then {fine}", names[i]);
            assert!(fine < 0.65 * coarse + 2e-4 && fine < [4e-4, 0.012, 0.004][i], "{what}");
        }
    }
}

#[test]
fn a_smooth_cap_is_round() {
    let r = 3f64.to_radians();
    let output = Healpix::new(16).unwrap();
    // Centres of output pixels in belt and caps, on base pixels' boundaries and beside the pole.
    for (theta, phi) in [0, 100, 480, 1500, 2303, 3000].map(|p| output.centre(p)) {
        let (lon, lat) = (phi.to_degrees(), 90.0 - theta.to_degrees());
        let map = shapes(Healpix::new(512).unwrap(), &[solid(Shape::Cap, lon, lat, 6.0)], Edge::Smooth);
        let names = ["w0", "w1", "w2", "psi1", "psi2", "psi3", "psi4"];
        let got = there(&map, &Analysis { windows: vec![10.0], ..at(0.0) }, &names, (lon, lat));
        assert!((got[0] / (TAU * (1.0 - r.cos())) - 1.0).abs() < 5e-4, "area {got:?}");
        assert!((got[1] / (TAU * r.sin()) - 1.0).abs() < 2e-4, "length {got:?}");
        // The window holds all of the contour, so Gauss–Bonnet holds within it.
        assert!((got[0] + got[2] - TAU).abs() < 1e-9, "curvature {got:?}");
        for psi in &got[3..] {
            assert!(psi / got[1] < 3e-4, "{got:?}");
        }
    }
}

/// What the continuum says of a great circle, in every window that it crosses: no curvature. Between pixels, the distance
/// from it is linear but for its third derivative, and so is the sine of that, with a larger one; so contours turn by what
/// vanishes with the pixels' area.
#[test]
fn a_great_circle_has_no_curvature_in_any_window() {
    let worst = |nside: usize, axis: [f64; 3], field: fn(f64) -> f64| {
        let grid = Healpix::new(nside).unwrap();
        let height = |p: usize| {
            let (theta, phi) = grid.centre(p);
            field(axis[0] * theta.sin() * phi.cos() + axis[1] * theta.sin() * phi.sin() + axis[2] * theta.cos())
        };
        let map = Map::new("", (0..grid.pixels()).map(height).collect()).unwrap();
        let measures = ["w2", "w1"].map(|name| find(name).unwrap());
        let analysis = Analysis { windows: vec![6.0], nside_out: Some(64), ..at(0.0) };
        let maps = analysis.minkowski_maps(&map, &measures, longan::go_on).unwrap();
        assert!(maps["w1"].iter().filter(|length| **length > 0.1).count() > 1000);
        maps["w2"].iter().fold(0.0, |worst: f64, w2| worst.max(w2.abs()))
    };
    for axis in [[0.48, -0.6, 0.64], [0.36, 0.48, 0.8], [-0.8, 0.6, 0.0], [0.28, 0.768, 0.576]] {
        for (nside, bound) in [(64, 5e-5), (128, 1.25e-5), (256, 3.2e-6)] {
            let worst = worst(nside, axis, f64::asin);
            assert!(worst < bound, "{axis:?}, Nside {nside}: {worst:e}");
        }
        let [coarse, fine] = [64, 256].map(|nside| worst(nside, axis, |height| height));
        assert!(coarse < 2e-4 && fine < coarse / 8.0, "{axis:?}: {coarse:e}, then {fine:e}");
    }
}

/// Tensors weighted by curvature: a cap is round, ever more so at rising resolution.
#[test]
fn the_curvature_of_a_smooth_cap_is_round() {
    let analysis = |nside: usize| Analysis {
        windows: vec![40.0],
        weight: longan::Weight::Curvature,
        nside_out: Some(nside),
        ..at(0.0)
    };
    for (lon, lat) in [(33.0, 12.0), (100.0, 55.0)] {
        for (nside, bound) in [(64, 1e-3), (128, 3e-4)] {
            let map = shapes(Healpix::new(nside).unwrap(), &[solid(Shape::Cap, lon, lat, 40.0)], Edge::Smooth);
            let q = there(&map, &analysis(nside), &["q1", "q2", "q3", "q4", "evq"], (lon, lat));
            // The window's centre is that of a pixel, not the cap's.
            assert!(q[1..4].iter().all(|q| q.abs() < bound), "Nside {nside}: {q:?}");
            assert!((q[4] - 1.0).abs() < 3.0 * bound, "Nside {nside}: {q:?}");
        }
    }
}

/// A spherical ellipse: the cone over a plane ellipse with these half-axes in the tangent plane at a place, turned. Its
/// curvature-weighted moments there follow from the geodesic curvature and the normal along it, by quadrature.
#[test]
fn the_curvature_of_a_smooth_ellipse_converges_to_its_closed_form() {
    type V = glam::DVec3;
    let (a, b, turn) = (0.45, 0.2, 0.4f64);
    let output = Healpix::new(64).unwrap();
    for place in [output.pixel_at(1.1, 0.7), output.pixel_at(0.5, 4.0)] {
        let (theta, phi) = output.centre(place);
        let ((st, ct), (sp, cp)) = (theta.sin_cos(), phi.sin_cos());
        let centre = V::new(st * cp, st * sp, ct);
        let (south, east) = (V::new(ct * cp, ct * sp, -st), V::new(-sp, cp, 0.0));
        let [first, second] = [turn, turn + PI / 2.0].map(|angle| south * angle.cos() + east * angle.sin());
        let n = 4000;
        let mut psi = [num_complex::Complex64::ZERO; 5];
        for i in 0..n {
            let t = TAU * f64::from(i) / f64::from(n);
            // The cone's edge and its derivatives; κ ds = γ·(γ′ × γ″)/|γ′|² dt holds for γ of unit length.
            let edge = |t: f64| (centre + first * (a * t.cos()) + second * (b * t.sin())).normalize();
            let h = 1e-3;
            let (before, here, after) = (edge(t - h), edge(t), edge(t + h));
            let (slope, bend) = ((after - before) / (2.0 * h), (after - here * 2.0 + before) / (h * h));
            let turned = here.dot(slope.cross(bend)) / slope.length_squared() * TAU / f64::from(n);
            let normal = slope.cross(here).normalize();
            let moved = normal - (here + centre) * (normal.dot(centre) / (1.0 + here.dot(centre)));
            let angle = moved.dot(east).atan2(moved.dot(south));
            for (s, psi) in psi.iter_mut().enumerate() {
                *psi += num_complex::Complex64::from_polar(turned, s as f64 * angle);
            }
        }
        let (whole, norm) = (psi[0].re, |s: usize| psi[s].norm());
        let expected = [
            whole,
            (whole + norm(2)) / (whole - norm(2)),
            norm(1) / whole,
            norm(2) / whole,
            norm(3) / whole,
            norm(4) / whole,
        ];
        assert!(expected[1] > 1.03, "{expected:?}");
        let errors = |nside: usize| {
            let grid = Healpix::new(nside).unwrap();
            let distance = |p: usize| {
                let (theta, phi) = grid.centre(p);
                let x = V::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                let height = x.dot(centre).max(0.1);
                1.0 - (x.dot(first) / height / a).hypot(x.dot(second) / height / b)
            };
            let map = Map::new("", (0..grid.pixels()).map(distance).collect()).unwrap();
            let analysis =
                Analysis { windows: vec![50.0], weight: longan::Weight::Curvature, nside_out: Some(64), ..at(0.0) };
            let measures: Vec<BuiltIn> =
                ["w2", "evq", "q1", "q2", "q3", "q4"].iter().map(|name| find(name).unwrap()).collect();
            let maps = analysis.minkowski_maps(&map, &measures, longan::go_on).unwrap();
            let got = maps.blocks[0].values.column(place).to_vec();
            got.iter().zip(expected).map(|(got, want)| (got - want).abs()).fold(0.0, f64::max)
        };
        let [coarse, fine] = [64, 256].map(errors);
        assert!(coarse < 3e-3 && fine < coarse / 6.0, "{coarse:e}, then {fine:e}");
    }
}

#[test]
fn a_triangle_has_only_every_third_moment() {
    let map = shapes(Healpix::new(512).unwrap(), &[solid(Shape::Triangle, 0.0, 10.0, 4.0)], Edge::Smooth);
    let got =
        there(&map, &Analysis { windows: vec![8.0], ..at(0.0) }, &["q1", "q2", "q3", "q4", "q5", "q6"], (0.0, 10.0));
    for (i, q) in got.iter().enumerate() {
        let limit = f64::from(u8::from((i + 1) % 3 == 0));
        assert!((q - limit).abs() < 0.05, "q{}: {q}", i + 1);
    }
}

#[test]
fn euler_characteristics_count_components_less_holes() {
    let grid = Healpix::new(64).unwrap();
    let chi = |bodies: &[Solid], threshold, body| {
        let (_, totals, _) = Analysis { body, ..at(threshold) }.totals(&shapes(grid, bodies, Edge::Smooth)).unwrap();
        let chi = totals[0].euler_characteristic();
        assert!((chi - chi.round()).abs() < 1e-10);
        chi.round()
    };
    let caps: Vec<Solid> =
        (0..5).map(|i| solid(Shape::Cap, 60.0 * f64::from(i), 70.0 - 30.0 * f64::from(i), 15.0)).collect();
    for n in 1..=5 {
        assert_eq!(chi(&caps[..n], 0.0, Body::Above), n as f64);
        assert_eq!(chi(&caps[..n], 0.0, Body::Below), 2.0 - n as f64);
    }
    assert_eq!(chi(&caps, -400.0, Body::Above), 2.0);
    assert_eq!(chi(&caps, 400.0, Body::Above), 0.0);
    // An annulus: near the equator, by its distance from the pole.
    let belt = (0..grid.pixels()).map(|p| -grid.centre(p).0.cos().abs()).collect();
    let (_, totals, _) = at(-0.4).totals(&Map::new("", belt).unwrap()).unwrap();
    assert!(totals[0].euler_characteristic().abs() < 1e-10);
    assert!((totals[0].area - 4.0 * PI * 0.4).abs() < 2e-3);
    assert!((totals[0].length - 2.0 * TAU * (1.0f64 - 0.16).sqrt()).abs() < 2e-3);
}

#[test]
fn random_waves_follow_the_gaussian_curves() {
    // Means over realisations; both contours and their neighbours are resolved by 10 pixels a correlation angle.
    let grid = Healpix::new(64).unwrap();
    let realisations = 12;
    let nus: Vec<f64> = (-4..=4).map(|i| f64::from(i) / 2.0).collect();
    let analysis = Analysis { thresholds: Thresholds::new(nus.clone()).unwrap(), ..at(0.0) };
    let mut sums = vec![[0.0f64; 3]; nus.len()];
    let mut squares = sums.clone();
    let mut slope = 0.0;
    for seed in 0..realisations {
        let waves = Waves::new(9.0, seed).unwrap();
        slope = waves.sigma1() / waves.sigma0();
        let (_, totals, _) = analysis.totals(&waves.map(grid)).unwrap();
        for ((sum, square), t) in sums.iter_mut().zip(&mut squares).zip(totals) {
            for (i, x) in [t.area, t.length, t.euler_characteristic()].into_iter().enumerate() {
                sum[i] += x / realisations as f64;
                square[i] += x * x / realisations as f64;
            }
        }
    }
    for ((nu, mean), square) in nus.iter().zip(&sums).zip(&squares) {
        let sphere = 4.0 * PI;
        let gauss = (-nu * nu / 2.0).exp();
        let above = upper_tail(*nu);
        let expected = [
            sphere * above,
            sphere * slope / (2.0 * 2f64.sqrt()) * gauss,
            sphere * slope * slope * nu * gauss / (2.0 * TAU.powf(1.5)) + 2.0 * above,
        ];
        for i in 0..3 {
            let error = ((square[i] - mean[i] * mean[i]) / (realisations - 1) as f64).sqrt();
            // Linear interpolation shortens contours by up to a per cent here.
            let allowed = 4.0 * error + [0.002, 0.015 * expected[1], 0.03 * expected[2].abs()][i];
            assert!(
                (mean[i] - expected[i]).abs() < allowed,
                "ν = {nu}, W{i}: {} ± {error}, not {}",
                mean[i],
                expected[i]
            );
        }
    }
}

/// ½ erfc(ν/√2), by Simpson's rule.
fn upper_tail(nu: f64) -> f64 {
    let f = |x: f64| (-x * x / 2.0).exp() / TAU.sqrt();
    let (n, top) = (2000, 10.0);
    let h = (top - nu) / f64::from(n);
    let weight = |i: i32| {
        if i == 0 || i == n {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    (0..=n).map(|i| weight(i) * f(nu + h * f64::from(i))).sum::<f64>() * h / 3.0
}
