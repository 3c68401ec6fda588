//! Values between points.

use longan_grid::{LatLon, Method, Weights};

use crate::*;

#[test]
fn linear_fields_are_exact_between_points_and_masked_beyond() {
    // Uneven, from the north, and across longitude 0.
    let latitudes = [41.0, 30.0, 28.0, 11.0, -7.0, -30.5];
    let longitudes = [310.0, 330.0, 331.5, 359.0, 2.0, 11.0];
    let east = |lon: f64| (lon - 310.0).rem_euclid(360.0);
    let f = |lat: f64, lon: f64| 2.0 + 3.0 * lat - 0.5 * lon;
    let field: Vec<f64> = latitudes.iter().flat_map(|&lat| longitudes.map(|lon| f(lat, east(lon)))).collect();
    let grid = LatLon::new(&latitudes, None, &longitudes, None).unwrap();
    let to = healpix(16);
    let map = Weights::new(&grid, to, Method::Bilinear).unwrap().apply(&field, 1.0);
    for (pixel, value) in map.into_iter().enumerate() {
        let (lat, lon) = centre(to, pixel);
        if (-30.5..41.0).contains(&lat) && east(lon) < east(11.0) {
            assert!((value - f(lat, east(lon))).abs() < 1e-11, "{lat} {lon}: {value}");
        } else {
            assert!(value.is_nan(), "{lat} {lon}: {value}");
        }
    }
}

/// The value at a place of a field on a grid of the whole sphere, by its definition.
fn interpolated(grid: &Grid, field: &[f64], lat: f64, lon: f64) -> f64 {
    let columns = grid.longitudes.len();
    let step = 360.0 / columns as f64;
    let along = |row: usize| {
        let at = (lon - grid.longitudes[0]).rem_euclid(360.0) / step;
        let (west, part) = (at as usize % columns, at.fract());
        field[row * columns + west] * (1.0 - part) + field[row * columns + (west + 1) % columns] * part
    };
    let mean = |row: usize| field[row * columns..][..columns].iter().sum::<f64>() / columns as f64;
    // From the south: latitude and value of the pole, of each row, and of the other pole.
    let mut rows: Vec<usize> = (0..grid.latitudes.len()).collect();
    rows.sort_by(|&a, &b| grid.latitudes[a].total_cmp(&grid.latitudes[b]));
    let at_pole = |row: usize| grid.latitudes[row].abs() == 90.0;
    let mut profile: Vec<(f64, f64)> = Vec::new();
    profile.push((-90.0, mean(rows[0])));
    let within = rows.iter().filter(|&&row| !at_pole(row));
    profile.extend(within.map(|&row| (grid.latitudes[row], along(row))));
    profile.push((90.0, mean(rows[rows.len() - 1])));
    let pair = profile.windows(2).find(|pair| (pair[0].0..=pair[1].0).contains(&lat)).unwrap();
    let part = (lat - pair[0].0) / (pair[1].0 - pair[0].0);
    pair[0].1 * (1.0 - part) + pair[1].1 * part
}

#[test]
fn whole_spheres_by_definition() {
    for grid in [with_poles(7, 10), without_poles(6, 9), with_poles(2, 2), with_poles(19, 36)] {
        let field: Vec<f64> = (0..grid.latitudes.len() * grid.longitudes.len()).map(noise).collect();
        for nside in [1, 3, 4, 16] {
            let map = grid.weights(nside, Method::Bilinear).apply(&field, 1.0);
            let at = |p: usize| centre(healpix(nside), p);
            let expected: Vec<f64> =
                (0..map.len()).map(at).map(|(lat, lon)| interpolated(&grid, &field, lat, lon)).collect();
            assert_close(&map, &expected, 1e-12, &format!("Nside {nside}, {grid:?}"));
        }
    }
}

#[test]
fn converges_at_second_order() {
    for (name, f) in harmonics() {
        for kind in ["with", "without"] {
            // With the largest error, so that the poles count.
            let error = |scale: usize| {
                let grid = match kind {
                    "with" => with_poles(10 * scale + 1, 20 * scale),
                    _ => without_poles(10 * scale, 20 * scale),
                };
                let map = grid.weights(64, Method::Bilinear).apply(&grid.field(f), 1.0);
                let expected = at_centres(healpix(64), f);
                map.iter().zip(expected).map(|(found, expected)| (found - expected).abs()).fold(0.0, f64::max)
            };
            let errors = [1, 2, 4].map(error);
            for pair in errors.windows(2) {
                let order = (pair[0] / pair[1]).log2();
                assert!((1.7..2.3).contains(&order), "{name}, {kind} poles: order {order}, errors {errors:?}");
            }
        }
    }
}

#[test]
fn missing_values_do_not_spread() {
    let grid = without_poles(36, 72);
    let weights = grid.weights(16, Method::Bilinear);
    let missing = |point: usize| noise(point) < 0.4;
    let field: Vec<f64> = (0..36 * 72).map(|point| if missing(point) { f64::NAN } else { noise(point + 9) }).collect();
    for min_valid in [0.0, 0.5, 1.0] {
        let map = weights.apply(&field, min_valid);
        for (pixel, value) in map.into_iter().enumerate() {
            let valid = || weights.pixel(pixel).filter(|&(point, _)| !missing(point));
            let share: f64 = valid().map(|(_, weight)| weight).sum();
            let sum: f64 = valid().map(|(point, weight)| weight * field[point]).sum();
            let masked = share == 0.0 || share < min_valid - 1e-12;
            assert!(
                if masked { value.is_nan() } else { (value - sum / share).abs() < 1e-13 },
                "pixel {pixel}: {value}"
            );
        }
    }
}

#[test]
fn points_at_centres_keep_their_values() {
    // Of Nside 1, the equatorial ring has its centres at multiples of 90°.
    let grid = with_poles(19, 8);
    let mut field: Vec<f64> = (0..19 * 8).map(noise).collect();
    // Points beside one that is met do not count, so that they may be missing.
    field[9 * 8 + 1] = f64::NAN;
    field[8 * 8..9 * 8].fill(f64::NAN);
    let map = grid.weights(1, Method::Bilinear).apply(&field, 1.0);
    for j in 0..4 {
        assert!((map[4 + j] - field[9 * 8 + (2 * j + 4) % 8]).abs() < 1e-13);
    }
}

#[test]
fn one_column_around_the_sphere_is_a_zonal_mean() {
    let latitudes = [-60.0, 0.0, 60.0];
    let grid = LatLon::new(&latitudes, None, &[0.0], Some(&[-180.0, 180.0])).unwrap();
    let map = Weights::new(&grid, healpix(4), Method::Bilinear).unwrap().apply(&[1.0, 4.0, 1.0], 1.0);
    for (pixel, value) in map.into_iter().enumerate() {
        let (lat, _) = centre(healpix(4), pixel);
        let expected = 4.0 - (lat.abs() / 60.0).min(1.0) * 3.0;
        assert!((value - expected).abs() < 1e-13, "{lat}: {value}");
    }
}

#[test]
fn rows_short_of_the_poles_end_there() {
    let grid = Grid { latitudes: vec![-50.0, -25.0, 0.0, 25.0, 50.0], longitudes: without_poles(1, 12).longitudes };
    for (pixel, value) in grid.weights(8, Method::Bilinear).apply(&[1.0; 60], 0.0).into_iter().enumerate() {
        assert_eq!(value.is_nan(), centre(healpix(8), pixel).0.abs() > 50.0);
    }
}

#[test]
fn poles_take_the_mean_over_longitude_of_uneven_columns() {
    let longitudes = [0.0, 30.0, 40.0, 100.0, 200.0, 300.0];
    // Half-way to the neighbours.
    let widths = [45.0, 20.0, 35.0, 80.0, 100.0, 80.0];
    let grid = Grid { latitudes: vec![-90.0, 90.0], longitudes: longitudes.to_vec() };
    let field: Vec<f64> = (0..12).map(noise).collect();
    let mean = |row: usize| (0..6).map(|column| field[6 * row + column] * widths[column]).sum::<f64>() / 360.0;
    for (pixel, value) in grid.weights(4, Method::Bilinear).apply(&field, 1.0).into_iter().enumerate() {
        let part = (centre(healpix(4), pixel).0 + 90.0) / 180.0;
        assert!((value - mean(0) * (1.0 - part) - mean(1) * part).abs() < 1e-14);
    }
}
