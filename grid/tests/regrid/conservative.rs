//! Areas that cells and pixels share.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use longan_grid::{Healpix, LatLon, Method, Weights};
use proptest::prelude::*;

use crate::*;

/// Rows and columns by their edges in degrees, ascending.
#[derive(Clone, Debug)]
struct Edges {
    latitudes: Vec<f64>,
    longitudes: Vec<f64>,
}

impl Edges {
    fn grid(&self) -> LatLon {
        let middles = |edges: &[f64]| edges.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect::<Vec<_>>();
        LatLon::new(
            &middles(&self.latitudes),
            Some(&self.latitudes),
            &middles(&self.longitudes),
            Some(&self.longitudes),
        )
        .unwrap()
    }

    fn weights(&self, nside: usize) -> Weights {
        Weights::new(&self.grid(), healpix(nside), Method::Conservative).unwrap()
    }

    /// The cells' areas on the unit sphere.
    fn areas(&self) -> Vec<f64> {
        let row = |lat: &[f64]| {
            // The difference of sines, without cancellation.
            let [south, north] = [lat[0].to_radians(), lat[1].to_radians()];
            let height = 2.0 * (0.5 * (north + south)).cos() * (0.5 * (north - south)).sin();
            let width = |lon: &[f64]| (lon[1] - lon[0]).to_radians();
            self.longitudes.windows(2).map(|lon| width(lon) * height).collect::<Vec<_>>()
        };
        self.latitudes.windows(2).flat_map(row).collect()
    }
}

fn even(rows: usize, columns: usize, start: f64) -> Edges {
    Edges {
        latitudes: (0..=rows).map(|i| -90.0 + 180.0 * i as f64 / rows as f64).collect(),
        longitudes: (0..=columns).map(|i| start + 360.0 * i as f64 / columns as f64).collect(),
    }
}

/// The longitudes from and to which a pixel extends at a given z: the boundaries of Górski et al. 2005, equations 19 to
/// 22, by quadrant and sphere.
fn extent(grid: Healpix, pixel: usize, z: f64) -> (f64, f64) {
    let nside = grid.nside() as f64;
    let i = grid.ring_of(pixel);
    let ring = grid.ring(i);
    let number = pixel - ring.start;
    if z.abs() > 2.0 / 3.0 {
        let from_pole = i.min(4 * grid.nside() - i);
        let (quadrant, m) = (number / from_pole, (number % from_pole) as f64);
        let line = 1.0 / (nside * (3.0 * (1.0 - z.abs())).sqrt());
        let (after, before) = (m * line, (m + 1.0) * line);
        let opposite = |k: f64| 1.0 - k * line;
        let west = after.max(opposite(from_pole as f64 - m));
        let east = before.min(opposite(from_pole as f64 - m - 1.0));
        (FRAC_PI_2 * (quadrant as f64 + west), FRAC_PI_2 * (quadrant as f64 + east.max(west)))
    } else {
        let half = FRAC_PI_4 / nside * (1.0 - 1.5 * nside * (z - ring.cos_theta).abs());
        let phi = ring.phi(number as isize);
        (phi - half.max(0.0), phi + half.max(0.0))
    }
}

/// All shares of all pixels, integrated numerically over z.
fn shares(edges: &Edges, nside: usize, steps: usize) -> Vec<Vec<f64>> {
    let grid = healpix(nside);
    let columns = edges.longitudes.len() - 1;
    let area = 4.0 * PI / grid.pixels() as f64;
    let height = |i: usize| match i {
        0 => 1.0,
        i if i == 4 * nside => -1.0,
        i => grid.ring(i).cos_theta,
    };
    let overlap = |(a, b): (f64, f64), (c, d): (f64, f64)| (b.min(d) - a.max(c)).max(0.0);
    let share = |pixel: usize| {
        let mut shares = vec![0.0; columns * (edges.latitudes.len() - 1)];
        let i = grid.ring_of(pixel);
        for (row, lat) in edges.latitudes.windows(2).enumerate() {
            // From one kink of the boundary to the next.
            let (south, north) = (lat[0].to_radians().sin(), lat[1].to_radians().sin());
            let kinks = [height(i + 1), height(i), height(i - 1)].map(|z| z.clamp(south, north));
            for (low, high) in [(kinks[0], kinks[1]), (kinks[1], kinks[2])] {
                let dz = (high - low) / steps as f64;
                for step in 0..steps {
                    let phi = extent(grid, pixel, low + (step as f64 + 0.5) * dz);
                    for (column, lon) in edges.longitudes.windows(2).enumerate() {
                        let lon = [lon[0].to_radians(), lon[1].to_radians()];
                        let turned = |turn: f64| (lon[0] + turn * 2.0 * PI, lon[1] + turn * 2.0 * PI);
                        let width: f64 = [-1.0, 0.0, 1.0].iter().map(|&turn| overlap(phi, turned(turn))).sum();
                        shares[row * columns + column] += width * dz / area;
                    }
                }
            }
        }
        shares
    };
    (0..grid.pixels()).map(share).collect()
}

#[test]
fn shares_agree_with_numerical_integration() {
    let irregular = Edges {
        latitudes: vec![-90.0, -71.0, -41.0, -3.0, 0.5, 40.0, 44.0, 80.0, 90.0],
        longitudes: vec![-10.0, 35.0, 90.0, 91.0, 200.0, 270.0, 350.0],
    };
    let regional = Edges { latitudes: vec![-20.0, 30.0, 60.0], longitudes: vec![-30.0, -5.0, 3.0, 50.0] };
    let whole = Edges { latitudes: vec![-90.0, 90.0], longitudes: vec![20.0, 380.0] };
    for edges in [even(4, 3, 0.0), even(12, 20, -7.0), irregular, regional, whole, even(2, 1, 10.0)] {
        for nside in [1, 2, 3, 5] {
            let weights = edges.weights(nside);
            for (pixel, expected) in shares(&edges, nside, 200).into_iter().enumerate() {
                let mut found = vec![0.0; expected.len()];
                weights.pixel(pixel).for_each(|(cell, weight)| found[cell] += weight);
                for (cell, (f, e)) in found.iter().zip(&expected).enumerate() {
                    // The midpoint rule's error, from the kinks where meridians cross the boundary.
                    assert!((f - e).abs() < 1e-4, "Nside {nside}, pixel {pixel}, cell {cell}: {f}, not {e}: {edges:?}");
                }
            }
        }
    }
}

/// Checks that pixels are wholly covered and that cells are wholly used.
fn check_areas(edges: &Edges, nside: usize) {
    let (weights, areas) = (edges.weights(nside), edges.areas());
    let pixels = healpix(nside).pixels();
    let area = 4.0 * PI / pixels as f64;
    let mut used = vec![0.0; areas.len()];
    for pixel in 0..pixels {
        let mut sum = 0.0;
        for (cell, weight) in weights.pixel(pixel) {
            assert!(weight > 0.0);
            sum += weight;
            used[cell] += weight * area;
        }
        assert!((sum - 1.0).abs() < 1e-13, "Nside {nside}, pixel {pixel}: {sum}");
    }
    for (cell, (used, area)) in used.iter().zip(&areas).enumerate() {
        assert!((used - area).abs() < 1e-13 + 1e-12 * area, "Nside {nside}, cell {cell}: {used}, not {area}");
    }
}

#[test]
fn pixels_are_covered_and_cells_are_used() {
    for nside in [1, 2, 3, 4, 5, 7, 16, 33, 64] {
        for edges in [even(4, 3, 0.0), even(1, 1, 5.0), even(18, 36, -5.0), even(37, 50, 179.3), even(180, 360, 0.0)] {
            check_areas(&edges, nside);
        }
    }
}

/// Edges that begin and end where they are told to, with others anywhere between.
fn some_edges(from: f64, to: f64, most: usize) -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.0..1.0f64, 0..most).prop_map(move |inner| {
        let mut edges: Vec<f64> = inner.into_iter().map(|part| from + (to - from) * part).collect();
        edges.extend([from, to]);
        edges.sort_by(f64::total_cmp);
        // Neighbours closer than this would be taken for one bound.
        edges.dedup_by(|after, before| *after - *before < 0.05);
        edges.pop();
        if edges.len() > 1 && to - edges[edges.len() - 1] < 0.05 {
            edges.pop();
        }
        edges.push(to);
        edges
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_grid_of_the_whole_sphere_is_used_once(
        latitudes in some_edges(-90.0, 90.0, 12),
        (start, longitudes) in (-180.0..360.0f64, some_edges(0.0, 360.0, 12)),
        nside in 1usize..20,
    ) {
        check_areas(&Edges { latitudes, longitudes: longitudes.iter().map(|lon| start + lon).collect() }, nside);
    }
}

#[test]
fn integrals_are_kept() {
    for (rows, columns, nside) in [(181, 360, 64), (181, 360, 7), (19, 36, 32), (721, 1440, 32), (4, 3, 5)] {
        let edges = even(rows, columns, -180.0 / columns as f64);
        let field: Vec<f64> = (0..rows * columns).map(noise).collect();
        let map = edges.weights(nside).apply(&field, 1.0);
        let integral: f64 = field.iter().zip(edges.areas()).map(|(value, area)| value * area).sum();
        let found = map.iter().sum::<f64>() * (4.0 * PI / map.len() as f64);
        assert!((found / integral - 1.0).abs() < 1e-12, "{rows} x {columns}, Nside {nside}: {found}, not {integral}");
    }
}

#[test]
fn derived_cells_keep_integrals_too() {
    for grid in [with_poles(73, 144), without_poles(72, 144)] {
        let step = 180.0 / (grid.latitudes.len() as f64 - if grid.latitudes.contains(&90.0) { 1.0 } else { 0.0 });
        let edge = |lat: f64| lat.clamp(-90.0, 90.0).to_radians().sin();
        let area = |lat: f64| (edge(lat + 0.5 * step) - edge(lat - 0.5 * step)) * 2.0 * PI / 144.0;
        let field = grid.field(|lat, lon| lat.sin() + 0.3 * lon.sin() + 2.0);
        let areas = grid.field(|lat, _| area(lat.to_degrees()));
        assert!((areas.iter().sum::<f64>() - 4.0 * PI).abs() < 1e-12);
        let integral: f64 = field.iter().zip(&areas).map(|(value, area)| value * area).sum();
        let map = grid.weights(32, Method::Conservative).apply(&field, 1.0);
        let found = map.iter().sum::<f64>() * (4.0 * PI / map.len() as f64);
        assert!((found / integral - 1.0).abs() < 1e-12, "{found}, not {integral}");
    }
}

#[test]
fn a_cap_keeps_its_area_and_its_inside() {
    let edges = even(36, 72, 0.0);
    let field: Vec<f64> = (0..36 * 72).map(|cell| if cell / 72 >= 30 { 1.0 } else { 0.0 }).collect();
    for nside in [3, 8, 32] {
        let map = edges.weights(nside).apply(&field, 1.0);
        let found = map.iter().sum::<f64>() * (4.0 * PI / map.len() as f64);
        let expected = 2.0 * PI * (1.0 - 60f64.to_radians().sin());
        assert!((found - expected).abs() < 1e-12, "Nside {nside}: {found}, not {expected}");
        let grid = healpix(nside);
        for (pixel, value) in map.iter().enumerate() {
            // A pixel ends on its neighbouring rings.
            let i = grid.ring_of(pixel);
            let north = if i == 1 { 1.0 } else { grid.ring(i - 1).cos_theta };
            let south = if i == grid.rings() { -1.0 } else { grid.ring(i + 1).cos_theta };
            let edge = 60f64.to_radians().sin();
            let expected = if south > edge { 1.0 } else { 0.0 };
            assert!((value - expected).abs() < 1e-13 || (south < edge && edge < north), "pixel {pixel}: {value}");
        }
    }
}

/// The mean over a pixel of a function of latitude and longitude in radians, from many points; for powers of two.
fn pixel_mean(grid: Healpix, pixel: usize, f: Function) -> f64 {
    const DEEPER: u8 = 4;
    let depth = grid.depth().unwrap();
    let nested = cdshealpix::nested::get(depth).from_ring(pixel as u64);
    let fine = cdshealpix::nested::get(depth + DEEPER);
    let points = nested << (2 * DEEPER)..(nested + 1) << (2 * DEEPER);
    points.clone().map(|point| fine.center(point)).map(|(lon, lat)| f(lat, lon)).sum::<f64>() / points.count() as f64
}

#[test]
fn converges_at_first_order() {
    // Of values at the middles of cells; they differ from means by the second order.
    for (name, f) in harmonics() {
        let error = |scale: usize| {
            let (grid, to) = (without_poles(10 * scale, 20 * scale), healpix(4 * scale));
            let map = grid.weights(to.nside(), Method::Conservative).apply(&grid.field(f), 1.0);
            let some: Vec<usize> = (0..to.pixels()).step_by(1 + to.pixels() / 3001).collect();
            let expected: Vec<f64> = some.iter().map(|&pixel| pixel_mean(to, pixel, f)).collect();
            rms(&some.iter().map(|&pixel| map[pixel]).collect::<Vec<_>>(), &expected)
        };
        let errors = [2, 8, 32].map(error);
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2() / 2.0;
            assert!((0.8..1.2).contains(&order), "{name}: order {order}, errors {errors:?}");
        }
    }
}

#[test]
fn means_of_z_have_closed_forms() {
    const NSIDE: usize = 6;
    // Rows of equal height in z, as many on either side of each equatorial ring's centre.
    const ROWS: usize = 1800;
    let z = |k: usize| (2 * k) as f64 / ROWS as f64 - 1.0;
    let latitudes = (0..=ROWS).map(|k| z(k).asin().to_degrees()).collect();
    let edges = Edges { latitudes, longitudes: vec![0.0, 90.0, 180.0, 270.0, 360.0] };
    let field: Vec<f64> = (0..4 * ROWS).map(|cell| 0.5 * (z(cell / 4) + z(cell / 4 + 1))).collect();
    let map = edges.weights(NSIDE).apply(&field, 1.0);
    let grid = healpix(NSIDE);
    for (pixel, value) in map.into_iter().enumerate() {
        let i = grid.ring_of(pixel);
        let n = NSIDE as f64;
        if (NSIDE + 1..3 * NSIDE).contains(&i) {
            let expected = grid.ring(i).cos_theta;
            assert!((value - expected).abs() < 1e-13, "ring {i}: {value}, not {expected}");
        } else if i < NSIDE {
            // 1 − z goes as the square of the distance from the pole, which has the variance 1/6 within a pixel.
            let expected = 1.0 - ((i * i) as f64 + 1.0 / 6.0) / (3.0 * n * n);
            // Within a row, the pixel's width is not constant.
            assert!((value - expected).abs() < 1e-5, "ring {i}: {value}, not {expected}");
        }
    }
}

#[test]
fn missing_values_do_not_spread() {
    let grid = without_poles(36, 72);
    let missing = |cell: usize| noise(cell) < 0.5;
    let weights = grid.weights(16, Method::Conservative);
    let cells = 36 * 72;
    let field: Vec<f64> = (0..cells).map(|cell| if missing(cell) { f64::NAN } else { 5.0 + noise(cell) }).collect();
    for min_valid in [0.0, 0.3, 0.5, 0.9, 1.0] {
        let map = weights.apply(&field, min_valid);
        let mut masked = 0;
        for (pixel, &value) in map.iter().enumerate() {
            let valid: Vec<(usize, f64)> = weights.pixel(pixel).filter(|&(cell, _)| !missing(cell)).collect();
            let share: f64 = valid.iter().map(|(_, weight)| weight).sum();
            if share > 0.0 && share > min_valid - 1e-12 {
                let mean = valid.iter().map(|&(cell, weight)| field[cell] * weight).sum::<f64>() / share;
                assert!((value - mean).abs() < 1e-13 && (5.0..6.0).contains(&value), "pixel {pixel}: {value}");
            } else {
                assert!(value.is_nan(), "pixel {pixel}, share {share}, at least {min_valid}: {value}");
                masked += 1;
            }
        }
        assert!(masked < map.len() && (min_valid < 0.3 || masked > 0));
    }
    assert!(weights.apply(&vec![f64::NAN; cells], 0.0).iter().all(|value| value.is_nan()));
}

#[test]
fn outside_a_region_is_not_valid() {
    let edges = Edges {
        latitudes: (0..=40).map(|i| -10.0 + f64::from(i)).collect(),
        longitudes: (0..=30).map(|i| 345.0 + f64::from(i)).collect(),
    };
    let weights = edges.weights(16);
    let (any, half, all) =
        (weights.apply(&[2.0; 1200], 0.0), weights.apply(&[2.0; 1200], 0.5), weights.apply(&[2.0; 1200], 1.0));
    let grid = healpix(16);
    let inside = |lat: f64, lon: f64, margin: f64| {
        let east = (lon - 345.0).rem_euclid(360.0);
        (-10.0 + margin..30.0 - margin).contains(&lat) && (margin..30.0 - margin).contains(&east)
    };
    // From centre to tip: 2.5° northward, 2.8° eastward.
    const REACH: f64 = 3.0;
    for pixel in 0..grid.pixels() {
        let (lat, lon) = centre(grid, pixel);
        let values = [any[pixel], half[pixel], all[pixel]];
        assert!(values.iter().all(|&value| value.is_nan() || (value - 2.0).abs() < 1e-14));
        assert!(!inside(lat, lon, REACH) || values.iter().all(|value| !value.is_nan()), "{lat} {lon}");
        assert!(inside(lat, lon, -REACH) || (-10.0 - REACH..30.0 + REACH).contains(&lat) || any[pixel].is_nan());
        let share: f64 = weights.pixel(pixel).map(|(_, weight)| weight).sum();
        assert_eq!(half[pixel].is_nan(), share < 0.5 - 1e-12, "{lat} {lon}");
    }
    let count = |map: &[f64]| map.iter().filter(|value| !value.is_nan()).count();
    assert!(count(&any) > count(&half) && count(&half) > count(&all) && count(&all) > 0);
    // All of the region's area is used.
    let used: f64 = (0..grid.pixels()).flat_map(|p| weights.pixel(p)).map(|(_, weight)| weight).sum();
    let area: f64 = edges.areas().iter().sum();
    assert!((used * 4.0 * PI / grid.pixels() as f64 - area).abs() < 1e-12);
}

#[test]
fn gaps_between_bounds_are_not_valid() {
    // Two columns with nothing between 20 and 40.
    let bounds = [0.0, 20.0, 40.0, 60.0];
    let grid = LatLon::new(&[0.0], Some(&[-90.0, 90.0]), &[10.0, 50.0], Some(&bounds)).unwrap();
    let weights = Weights::new(&grid, healpix(32), Method::Conservative).unwrap();
    for (pixel, value) in weights.apply(&[1.0, 2.0], 1.0).into_iter().enumerate() {
        let (lat, lon) = centre(healpix(32), pixel);
        if lat.abs() < 40.0 {
            let expected = [(2.0..18.0, 1.0), (42.0..58.0, 2.0)].into_iter().find(|(lons, _)| lons.contains(&lon));
            let masked = [22.0..38.0, 62.0..358.0].iter().any(|lons| lons.contains(&lon));
            assert!(expected.is_none_or(|(_, e)| (value - e).abs() < 1e-14) && (!masked || value.is_nan()), "{lon}");
        }
    }
}
