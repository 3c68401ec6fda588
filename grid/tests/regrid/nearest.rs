//! The nearest points.

use longan_grid::{LatLon, Method, Weights};
use proptest::prelude::*;

use crate::*;

/// The square of half the chord between two places in degrees.
fn distance((lat, lon): (f64, f64), (lat2, lon2): (f64, f64)) -> f64 {
    let half = |a: f64, b: f64| (0.5 * (a - b).to_radians()).sin().powi(2);
    half(lat, lat2) + lat.to_radians().cos() * lat2.to_radians().cos() * half(lon, lon2)
}

/// Checks that what each pixel takes is as near as any point.
fn check(latitudes: &[f64], longitudes: &[f64], nside: usize, covered: impl Fn(f64, f64) -> Option<bool>) {
    let grid = LatLon::new(latitudes, None, longitudes, None).unwrap();
    let weights = Weights::new(&grid, healpix(nside), Method::Nearest).unwrap();
    for pixel in 0..healpix(nside).pixels() {
        let at = centre(healpix(nside), pixel);
        let taken: Vec<(usize, f64)> = weights.pixel(pixel).collect();
        if let Some(covered) = covered(at.0, at.1) {
            assert_eq!(taken.len(), usize::from(covered), "{at:?} of {latitudes:?} {longitudes:?}");
        }
        let Some(&(point, weight)) = taken.first() else { continue };
        assert_eq!(weight, 1.0);
        let n = longitudes.len();
        let to = |point: usize| distance(at, (latitudes[point / n], longitudes[point % n]));
        let least = (0..latitudes.len() * n).map(to).fold(f64::INFINITY, f64::min);
        // Distances whose squares differ less do so by less than 1e-9 degrees, or by rounding.
        assert!(to(point) <= least * (1.0 + 1e-9) + 1e-15, "{at:?}: {} is farther than {least}", to(point));
    }
}

#[test]
fn nearest_on_whole_spheres() {
    let grids = [with_poles(10, 17), without_poles(9, 5), without_poles(4, 3), with_poles(2, 2), without_poles(2, 40)];
    for grid in grids {
        for nside in [1, 3, 8, 13] {
            check(&grid.latitudes, &grid.longitudes, nside, |_, _| Some(true));
        }
    }
}

#[test]
fn nearest_in_a_region() {
    // Cells to 5° and 10° beyond the points.
    let covered = |lat: f64, lon: f64| {
        let east = (lon + 60.0).rem_euclid(360.0);
        let margin = (lat - 65.0).abs().min((lat + 5.0).abs()).min((east - 80.0).abs()).min(360.0 - east);
        (margin > 1e-6).then_some((-5.0..65.0).contains(&lat) && (0.0..80.0).contains(&east))
    };
    for nside in [4, 7, 16] {
        check(&[60.0, 50.0, 40.0, 30.0, 20.0, 10.0, 0.0], &[-50.0, -30.0, -10.0, 10.0], nside, covered);
    }
}

proptest! {
    #[test]
    fn nearest_on_uneven_grids(
        mut latitudes in prop::collection::vec(-90.0..90.0f64, 2..8),
        mut longitudes in prop::collection::vec(0.0..360.0f64, 3..9),
        nside in 1usize..9,
    ) {
        latitudes.sort_by(f64::total_cmp);
        latitudes.dedup();
        longitudes.sort_by(f64::total_cmp);
        let n = longitudes.len();
        let wide = |i: usize| (longitudes[(i + 1) % n] - longitudes[i]).rem_euclid(360.0) > 170.0;
        prop_assume!(latitudes.len() > 1 && longitudes.windows(2).all(|pair| pair[1] - pair[0] > 0.01));
        // Half a turn or more between columns may go either way around, and the last may be taken for the first.
        prop_assume!(!(0..n - 1).any(wide) && longitudes[0] + 360.0 - longitudes[n - 1] > 40.0);
        check(&latitudes, &longitudes, nside, |_, _| None);
    }
}

#[test]
fn converges_at_first_order() {
    for (name, f) in harmonics() {
        let error = |scale: usize| {
            let grid = without_poles(10 * scale, 20 * scale);
            rms(&grid.weights(32, Method::Nearest).apply(&grid.field(f), 1.0), &at_centres(healpix(32), f))
        };
        let errors = [1, 2, 4].map(error);
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((0.8..1.2).contains(&order), "{name}: order {order}, errors {errors:?}");
        }
    }
}

#[test]
fn missing_points_mask() {
    let grid = without_poles(18, 36);
    let field: Vec<f64> = (0..18 * 36).map(|point| if point % 3 == 0 { f64::NAN } else { point as f64 }).collect();
    let weights = grid.weights(8, Method::Nearest);
    for (pixel, value) in weights.apply(&field, 0.0).into_iter().enumerate() {
        let (point, _) = weights.pixel(pixel).next().unwrap();
        assert!(if point % 3 == 0 { value.is_nan() } else { value == point as f64 });
    }
}
