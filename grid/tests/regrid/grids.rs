//! Coordinates in every layout, and those that are wrong.

use longan_grid::{Error, LatLon, Method, Weights};
use proptest::prelude::*;

use crate::*;

/// A grid in some layout, with a field in the same.
#[derive(Clone, Debug)]
struct Laid {
    latitudes: Vec<f64>,
    latitude_bounds: Option<Vec<f64>>,
    longitudes: Vec<f64>,
    longitude_bounds: Option<Vec<f64>>,
    field: Vec<f64>,
}

impl Laid {
    fn new(grid: Grid, f: impl Fn(usize) -> f64) -> Self {
        let Grid { latitudes, longitudes } = grid;
        let field = (0..latitudes.len() * longitudes.len()).map(f).collect();
        Laid { latitudes, latitude_bounds: None, longitudes, longitude_bounds: None, field }
    }

    fn map(&self, nside: usize, method: Method) -> Vec<f64> {
        let bounds = (self.latitude_bounds.as_deref(), self.longitude_bounds.as_deref());
        let grid = LatLon::new(&self.latitudes, bounds.0, &self.longitudes, bounds.1).unwrap();
        Weights::new(&grid, healpix(nside), method).unwrap().apply(&self.field, 0.5)
    }

    /// The rows in another order.
    fn rows(mut self, order: impl Fn(usize) -> usize) -> Self {
        let (rows, columns) = (self.latitudes.len(), self.longitudes.len());
        self.field = (0..rows * columns).map(|i| self.field[order(i / columns) * columns + i % columns]).collect();
        self.latitudes = (0..rows).map(|row| self.latitudes[order(row)]).collect();
        self
    }

    /// The columns in another order, and how many of them.
    fn columns(mut self, count: usize, order: impl Fn(usize) -> usize) -> Self {
        let (rows, columns) = (self.latitudes.len(), self.longitudes.len());
        let place = |i: usize| i / count * columns + order(i % count);
        self.field = (0..rows * count).map(|i| self.field[place(i)]).collect();
        self.longitudes = (0..count).map(|column| self.longitudes[order(column)]).collect();
        self
    }

    /// Longitudes in another convention.
    fn longitudes(mut self, convention: impl Fn(f64) -> f64) -> Self {
        self.longitudes = self.longitudes.into_iter().map(convention).collect();
        self
    }

    /// The first column again after the last, with values that must not count.
    fn repeated(mut self) -> Self {
        let columns = self.longitudes.len();
        let turn = if self.longitudes[1] > self.longitudes[0] { 360.0 } else { -360.0 };
        self.longitudes.push(self.longitudes[0] + turn);
        self.field = self.field.chunks(columns).flat_map(|row| row.iter().copied().chain([1e9])).collect();
        self
    }

    /// The bounds that would be derived for a grid of equal steps, as pairs.
    fn bounded(mut self, convention: impl Fn(f64) -> f64) -> Self {
        let step = |values: &[f64]| (values[1] - values[0]).rem_euclid(360.0);
        let pairs = |values: &[f64], half: f64| values.iter().flat_map(|v| [v - half, v + half]).collect::<Vec<_>>();
        let rows = (self.latitudes[1] - self.latitudes[0]).abs();
        let latitudes = pairs(&self.latitudes, 0.5 * rows);
        self.latitude_bounds = Some(latitudes.into_iter().map(|bound| bound.clamp(-90.0, 90.0)).collect());
        let columns = step(&self.longitudes).min(360.0 - step(&self.longitudes));
        let longitudes = pairs(&self.longitudes, 0.5 * columns);
        self.longitude_bounds = Some(longitudes.into_iter().map(convention).collect());
        self
    }
}

fn positive(lon: f64) -> f64 {
    lon.rem_euclid(360.0)
}

fn signed(lon: f64) -> f64 {
    (lon + 180.0).rem_euclid(360.0) - 180.0
}

#[test]
fn the_same_field_in_every_layout_gives_the_same_map() {
    for base in [Laid::new(with_poles(19, 40), noise), Laid::new(without_poles(18, 36), noise)] {
        let (rows, columns) = (base.latitudes.len(), base.longitudes.len());
        let base = || base.clone();
        let flip = move |row: usize| rows - 1 - row;
        let mirror = move |column: usize| columns - 1 - column;
        let roll = move |by: usize| move |column: usize| (column + by) % columns;
        let layouts = [
            ("north up or down", base().rows(flip)),
            ("westward", base().columns(columns, mirror)),
            ("from 0", base().longitudes(positive).columns(columns, roll(columns / 2))),
            ("from -180", base().longitudes(signed)),
            ("across 0 or 180", base().longitudes(positive).columns(columns, roll(7))),
            ("across 180", base().longitudes(signed).columns(columns, roll(3))),
            ("westward across 180", base().longitudes(signed).columns(columns, mirror).columns(columns, roll(5))),
            ("from 360", base().longitudes(|lon| positive(lon) + 360.0)),
            ("repeated", base().repeated()),
            ("westward, repeated", base().columns(columns, mirror).repeated()),
            ("bounded", base().bounded(|lon| lon)),
            ("bounded, repeated", base().repeated().bounded(|lon| lon)),
            ("bounded within 0 and 360", base().rows(flip).longitudes(positive).bounded(positive)),
            ("bounded within -180 and 180", base().longitudes(positive).columns(columns, mirror).bounded(signed)),
        ];
        for method in METHODS {
            for nside in [3, 16] {
                let expected = base().map(nside, method);
                assert!(expected.iter().all(|value| value.is_finite()));
                for (what, layout) in &layouts {
                    let what = format!("{what}, {rows} rows, {method:?}, Nside {nside}");
                    assert_close(&layout.map(nside, method), &expected, 1e-14, &what);
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(50))]

    #[test]
    fn any_start_and_orientation(
        steps in prop::collection::vec(0.85..1.2f64, 4..20),
        start in -360.0..360.0f64,
        (by, mirrored, flipped) in (0usize..20, any::<bool>(), any::<bool>()),
        nside in 1usize..12,
    ) {
        // Columns all around with uneven steps.
        let total: f64 = steps.iter().sum();
        let longitudes: Vec<f64> = steps
            .iter()
            .scan(0.0, |sum, step| { *sum += step; Some(start + 360.0 * *sum / total) })
            .collect();
        let columns = longitudes.len();
        let latitudes = vec![-80.0, -50.0, -31.0, 0.0, 10.0, 50.0, 85.0];
        let base = Laid::new(Grid { latitudes, longitudes }, noise);
        let mut other = base.clone().longitudes(signed).columns(columns, |column| (column + by) % columns);
        if mirrored { other = other.columns(columns, |column| columns - 1 - column); }
        if flipped { other = other.rows(|row| 6 - row); }
        for method in [Method::Conservative, Method::Bilinear] {
            let (expected, found) = (base.map(nside, method), other.map(nside, method));
            for (f, e) in found.iter().zip(&expected) {
                // Longitudes are rounded differently, by 1e-13 degrees or less.
                prop_assert!((f - e).abs() < 1e-13, "{f}, not {e}");
            }
        }
    }
}

#[test]
fn single_precision_coordinates() {
    for (rows, columns) in [(721, 1440), (1800, 3600)] {
        let exact = without_poles(rows, columns);
        let round = |values: &[f64]| values.iter().map(|&value| f64::from(value as f32)).collect::<Vec<_>>();
        let (latitudes, longitudes) = (round(&exact.latitudes), round(&exact.longitudes));
        let step = 180.0 / rows as f64;
        let bounds: Vec<f64> = (0..=rows).map(|i| f64::from((-90.0 + step * i as f64) as f32)).collect();
        for bounds in [None, Some(bounds.as_slice())] {
            let grid = LatLon::new(&latitudes, bounds, &longitudes, None).unwrap();
            let weights = Weights::new(&grid, healpix(8), Method::Conservative).unwrap();
            for pixel in 0..healpix(8).pixels() {
                let sum: f64 = weights.pixel(pixel).map(|(_, weight)| weight).sum();
                assert!((sum - 1.0).abs() < 1e-12, "pixel {pixel}: {sum}");
            }
        }
    }
}

#[test]
fn halves_of_one_cell_at_both_ends() {
    // Columns at 0, 90, 180, 270 and 360, of which the first and the last have half a cell each.
    let bounds = [0.0, 45.0, 135.0, 225.0, 315.0, 360.0];
    let longitudes = [0.0, 90.0, 180.0, 270.0, 360.0];
    let grid = LatLon::new(&[0.0], Some(&[-90.0, 90.0]), &longitudes, Some(&bounds)).unwrap();
    let map = Weights::new(&grid, healpix(8), Method::Conservative).unwrap().apply(&[1.0, 2.0, 3.0, 4.0, 5.0], 1.0);
    for (pixel, value) in map.into_iter().enumerate() {
        let (lat, lon) = centre(healpix(8), pixel);
        if lat.abs() < 40.0 && (lon % 45.0).min(45.0 - lon % 45.0) > 6.0 {
            let expected = [1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 5.0][(lon / 45.0) as usize];
            assert!((value - expected).abs() < 1e-14, "{lat} {lon}: {value}");
        }
    }
}

/// The part of the sphere that a grid's cells cover.
fn covered(grid: &LatLon) -> f64 {
    let weights = Weights::new(grid, healpix(8), Method::Conservative).unwrap();
    (0..768).flat_map(|pixel| weights.pixel(pixel)).map(|(_, weight)| weight).sum::<f64>() / 768.0
}

#[test]
fn few_and_uneven_columns() {
    let lat = [-45.0, 45.0];
    // Half a turn goes as written; a repeated column closes a gap of any width.
    for lon in [&[0.0, 90.0, 270.0][..], &[270.0, 90.0, 0.0], &[0.0, 180.0], &[0.0, 60.0, 120.0, 180.0, 360.0]] {
        assert!((covered(&LatLon::new(&lat, None, lon, None).unwrap()) - 1.0).abs() < 1e-13, "{lon:?}");
    }
    // A gap of more than half a turn is none.
    assert!((covered(&LatLon::new(&lat, None, &[0.0, 60.0, 120.0], None).unwrap()) - 0.5).abs() < 1e-13);
}

#[test]
fn bounds_that_touch_but_for_rounding() {
    let grid = without_poles(6, 12);
    let bounds: Vec<f64> = (0..24).map(|i| f64::from((i + 1) / 2 * 30 - 15) + 1e-5 * noise(i as usize)).collect();
    let rounded = LatLon::new(&grid.latitudes, None, &grid.longitudes, Some(&bounds)).unwrap();
    assert!((covered(&rounded) - 1.0).abs() < 1e-13);
    let field: Vec<f64> = (0..72).map(noise).collect();
    let map = Weights::new(&rounded, healpix(8), Method::Bilinear).unwrap().apply(&field, 1.0);
    assert_close(&map, &grid.weights(8, Method::Bilinear).apply(&field, 1.0), 1e-6, "bilinear");
}

#[test]
fn columns_with_a_gap_do_not_go_around() {
    let bounds = [-45.0, 45.0, 45.0, 135.0, 160.0, 225.0, 225.0, 315.0];
    let lon = [0.0, 90.0, 180.0, 270.0];
    let grid = LatLon::new(&[-45.0, 45.0], None, &lon, Some(&bounds)).unwrap();
    let map = Weights::new(&grid, healpix(4), Method::Bilinear).unwrap().apply(&[1.0; 8], 0.0);
    for (pixel, value) in map.into_iter().enumerate() {
        let (lat, lon) = centre(healpix(4), pixel);
        assert_eq!(value.is_nan(), lat.abs() > 45.0 || lon > 270.0);
    }
}

#[test]
fn a_region_holds_its_edge_whatever_the_rounding() {
    // Of Nside 1, a pixel has its centre at longitude 90 on the equator.
    const PIXEL: usize = 5;
    for off in [-1e-13, 0.0, 1e-13] {
        let lon = [90.0 + off, 100.0];
        let (lat, bounds) = ([-off, 10.0], [90.0 + off, 95.0, 95.0, 105.0]);
        let points = LatLon::new(&lat, None, &lon, None).unwrap();
        let cells = LatLon::new(&[5.0, 15.0], Some(&[-off, 10.0, 20.0]), &lon, Some(&bounds)).unwrap();
        for (grid, method) in [(points, Method::Bilinear), (cells, Method::Nearest)] {
            let map = Weights::new(&grid, healpix(1), method).unwrap().apply(&[1.0, 2.0, 3.0, 4.0], 0.0);
            assert!((map[PIXEL] - 1.0).abs() < 1e-12, "{method:?}, {off:e}: {}", map[PIXEL]);
        }
    }
}

#[test]
fn rows_short_of_the_poles() {
    let share = |lat: &[f64], lon: &[f64]| covered(&LatLon::new(lat, None, lon, None).unwrap());
    let around: Vec<f64> = (0..36).map(|i| f64::from(10 * i)).collect();
    let height = |lat: f64| lat.to_radians().sin();
    // A Gaussian grid of eight rows: its outermost ones end 5.5° from the poles, and extend to them.
    let gaussian = [73.799, 52.813, 31.704, 10.570, -10.570, -31.704, -52.813, -73.799];
    assert!((share(&gaussian, &around) - 1.0).abs() < 1e-12);
    // Rows at the poles left out.
    let without: Vec<f64> = (1..18).map(|i| f64::from(10 * i - 90)).collect();
    assert!((share(&without, &around) - height(85.0)).abs() < 1e-12);
    // A region does not extend to a pole, nor beyond.
    let near = [86.0, 76.0];
    assert!((share(&near, &[0.0, 10.0, 20.0]) - (1.0 - height(71.0)) / 24.0).abs() < 1e-12);
    let nearer = [84.0, 76.0];
    assert!((share(&nearer, &[0.0, 10.0, 20.0]) - (height(88.0) - height(72.0)) / 24.0).abs() < 1e-12);
}

#[test]
fn the_closest_nside() {
    for (spacing, expected) in
        [(0.25, 256), (1.0, 64), (2.5, 32), (3.0, 16), (0.1, 512), (60.0, 1), (180.0, 1), (0.92, 64)]
    {
        let rows = ((180.0 / spacing) as usize).max(2);
        let grid = without_poles(rows, 2 * rows).lat_lon();
        assert!((grid.spacing_degrees() - 180.0 / rows as f64).abs() < 1e-9);
        assert_eq!(grid.nside_closest(), expected, "{spacing}°");
    }
    // Each pixel of Nside 16 has a side of 3.66°.
    let uneven = LatLon::new(&[0.0, 1.83, 3.66], None, &[0.0, 7.32, 14.64], None).unwrap();
    assert!((uneven.spacing_degrees() - 3.66).abs() < 1e-9);
    assert_eq!(uneven.nside_closest(), 16);
    let whole = LatLon::new(&[0.0], Some(&[-90.0, 90.0]), &[0.0], Some(&[-180.0, 180.0])).unwrap();
    assert_eq!((whole.nside_closest(), whole.values()), (1, 1));
    let fine = LatLon::new(&[0.0, 1e-12], None, &[0.0, 1e-12], None).unwrap();
    assert_eq!(fine.nside_closest(), 1 << 29);
}

/// What is wrong with these coordinates, and what the user is told.
fn problem(lat: &[f64], lat_bounds: Option<&[f64]>, lon: &[f64], lon_bounds: Option<&[f64]>) -> (Error, String) {
    let error = LatLon::new(lat, lat_bounds, lon, lon_bounds).unwrap_err();
    let told = error.to_string();
    assert!(!told.contains('\n') && !told.ends_with('.') && !told.is_empty(), "{told}");
    (error, told)
}

#[test]
fn coordinates_that_turn_back() {
    let lon = [0.0, 10.0, 20.0];
    let (error, told) = problem(&[0.0, 10.0, 20.0, 15.0], None, &lon, None);
    assert!(
        matches!(error, Error::NotMonotonic { coordinate: "latitude", index: 3, before: 20.0, value: 15.0 }),
        "{told}"
    );
    let (error, _) = problem(&[30.0, 20.0, 20.0], None, &lon, None);
    assert!(matches!(error, Error::NotMonotonic { coordinate: "latitude", index: 2, .. }));
    for (lon, at) in [(&[0.0, 10.0, 5.0][..], 2), (&[350.0, 0.0, 350.0], 2), (&[0.0, 0.0, 1.0], 1), (&[0.0, 360.0], 1)]
    {
        let (error, told) = problem(&[0.0, 1.0], None, lon, None);
        assert!(matches!(error, Error::NotMonotonic { coordinate: "longitude", index, .. } if index == at), "{told}");
    }
    let twice: Vec<f64> = (0..20).map(|i| f64::from(36 * i % 360)).collect();
    assert!(matches!(problem(&[0.0, 1.0], None, &twice, None).0, Error::LongitudeSpan { span: 684.0 }));
}

#[test]
fn coordinates_off_the_sphere() {
    let lon = [0.0, 10.0, 20.0];
    let (error, told) = problem(&[-2.5e6, 0.0, 2.5e6], None, &lon, None);
    assert!(matches!(error, Error::CoordinateRange { coordinate: "latitude", index: 0, .. }), "{told}");
    assert!(told.contains("metres") && told.contains("-2500000"), "{told}");
    let (error, told) = problem(&[0.0, 1.0], None, &[0.0, 5000.0], None);
    assert!(matches!(error, Error::CoordinateRange { coordinate: "longitude", index: 1, .. }), "{told}");
    let (_, told) = problem(&[0.0, 90.0, 180.0, 270.0], None, &lon, None);
    assert!(told.contains("180") && told.contains("looks like a longitude"), "{told}");
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (error, told) = problem(&[0.0, bad], None, &lon, None);
        assert!(matches!(error, Error::CoordinateRange { index: 1, .. }) && !told.contains("metres"), "{told}");
        assert!(matches!(problem(&[0.0, 1.0], None, &[bad, 1.0], None).0, Error::CoordinateRange { index: 0, .. }));
        let bounds = [0.0, bad, 2.0];
        let (error, _) = problem(&[0.5, 1.0], Some(&bounds), &lon, None);
        assert!(matches!(error, Error::CoordinateRange { coordinate: "latitude bound", index: 1, .. }));
        let (error, _) = problem(&[0.5, 1.0], None, &[0.5, 1.0], Some(&bounds));
        assert!(matches!(error, Error::CoordinateRange { coordinate: "longitude bound", index: 1, .. }));
    }
    let empty = problem(&[], None, &lon, None).0;
    assert!(matches!(empty, Error::NoCoordinates { coordinate: "latitude" }));
    assert!(matches!(problem(&[0.0], None, &[], None).0, Error::NoCoordinates { coordinate: "longitude" }));
}

#[test]
fn radians() {
    for grid in [with_poles(19, 36), without_poles(18, 36), with_poles(721, 1440)] {
        for repeated in [false, true] {
            let radians = |values: &[f64]| values.iter().map(|v| f64::from(v.to_radians() as f32)).collect::<Vec<_>>();
            let mut longitudes = grid.longitudes.clone();
            longitudes.extend(repeated.then_some(grid.longitudes[0] + 360.0));
            let (error, told) = problem(&radians(&grid.latitudes), None, &radians(&longitudes), None);
            assert!(matches!(error, Error::Radians) && told.contains("radians"), "{told}");
        }
    }
    // A region of six degrees is none.
    let lon: Vec<f64> = (0..63).map(|i| 0.1 * f64::from(i)).collect();
    assert!(LatLon::new(&[0.0, 0.1, 0.2], None, &lon, None).is_ok());
}

#[test]
fn bounds_that_do_not_fit() {
    let (lat, lon) = ([0.0, 10.0], [0.0, 10.0, 20.0]);
    let (error, told) = problem(&lat, Some(&[0.0; 5]), &lon, None);
    assert!(matches!(error, Error::BoundsCount { coordinate: "latitude", points: 2, bounds: 5 }), "{told}");
    let (error, _) = problem(&lat, None, &lon, Some(&[]));
    assert!(matches!(error, Error::BoundsCount { coordinate: "longitude", points: 3, bounds: 0 }));
    let (error, told) = problem(&lat, Some(&[-5.0, 5.0, 15.0, 25.0]), &lon, None);
    assert!(matches!(error, Error::BoundsApart { coordinate: "latitude", index: 1, .. }), "{told}");
    let (error, told) = problem(&lat, None, &lon, Some(&[-5.0, 5.0, 5.0, 15.0, 35.0, 45.0]));
    assert!(matches!(error, Error::BoundsApart { coordinate: "longitude", index: 2, .. }), "{told}");
    let (error, told) = problem(&lat, Some(&[-5.0, 7.0, 5.0, 15.0]), &lon, None);
    assert!(matches!(error, Error::BoundsOverlap { coordinate: "latitude", first: 0, second: 1 }), "{told}");
    let (error, _) = problem(&lat, None, &lon, Some(&[-5.0, 5.0, 5.0, 17.0, 15.0, 25.0]));
    assert!(matches!(error, Error::BoundsOverlap { coordinate: "longitude", first: 1, second: 2 }));
    let around = [0.0, 120.0, 240.0];
    let (error, _) = problem(&lat, None, &around, Some(&[-60.0, 60.0, 60.0, 180.0, 180.0, 320.0]));
    assert!(matches!(error, Error::BoundsOverlap { coordinate: "longitude", first: 2, second: 0 }));
    let (error, told) = problem(&[0.0], None, &lon, None);
    assert!(matches!(error, Error::NoSpacing { coordinate: "latitude", value: 0.0 }), "{told}");
    assert!(matches!(problem(&lat, None, &[7.0], None).0, Error::NoSpacing { coordinate: "longitude", value: 7.0 }));
}

#[test]
fn grids_too_large() {
    let axis = |n: usize, from: f64| (0..n).map(|i| from + 80.0 * i as f64 / n as f64).collect::<Vec<_>>();
    let (error, told) = problem(&axis(65_537, 0.0), None, &axis(65_536, 0.0), None);
    assert!(matches!(error, Error::GridSize { latitudes: 65_537, longitudes: 65_536 }), "{told}");
    assert!(LatLon::new(&axis(65_536, 0.0), None, &axis(65_536, 0.0), None).is_ok());
}

proptest! {
    #[test]
    fn nothing_panics(
        lat in prop::collection::vec(prop_oneof![-100.0..100.0f64, Just(90.0), Just(f64::NAN), Just(-90.0), Just(0.0)], 0..5),
        lat_bounds in prop::option::of(prop::collection::vec(-95.0..95.0f64, 0..8)),
        lon in prop::collection::vec(prop_oneof![-720.0..720.0f64, Just(180.0), Just(360.0), Just(1e300), Just(0.0)], 0..5),
        lon_bounds in prop::option::of(prop::collection::vec(prop_oneof![-400.0..400.0f64, Just(360.0), Just(0.0)], 0..8)),
        sorted: bool,
    ) {
        let (mut lat, mut lon) = (lat, lon);
        if sorted {
            lat.sort_by(f64::total_cmp);
            lon.sort_by(f64::total_cmp);
        }
        let Ok(grid) = LatLon::new(&lat, lat_bounds.as_deref(), &lon, lon_bounds.as_deref()) else { return Ok(()) };
        prop_assert!(grid.spacing_degrees() > 0.0 && grid.nside_closest().is_power_of_two());
        for method in METHODS {
            let weights = Weights::new(&grid, healpix(3), method).unwrap();
            for pixel in 0..healpix(3).pixels() {
                let sum: f64 = weights.pixel(pixel).map(|(_, weight)| weight).sum();
                prop_assert!((0.0..1.0 + 1e-12).contains(&sum), "{method:?}: {sum}");
            }
        }
    }
}
