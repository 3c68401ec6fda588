//! Grids of latitude and longitude brought to HEALPix: exact values, invariants, and slow obvious implementations as
//! judges.

mod bilinear;
mod cdo;
mod conservative;
mod grids;
mod nearest;

use std::f64::consts::PI;

use longan_grid::{Healpix, LatLon, Method, Weights};

const METHODS: [Method; 3] = [Method::Conservative, Method::Bilinear, Method::Nearest];

/// Coordinates in degrees.
#[derive(Clone, Debug)]
struct Grid {
    latitudes: Vec<f64>,
    longitudes: Vec<f64>,
}

impl Grid {
    fn lat_lon(&self) -> LatLon {
        LatLon::new(&self.latitudes, None, &self.longitudes, None).unwrap()
    }

    /// The values of a function of latitude and longitude, in radians.
    fn field(&self, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let at =
            |lat: &f64| self.longitudes.iter().map(|lon| f(lat.to_radians(), lon.to_radians())).collect::<Vec<_>>();
        self.latitudes.iter().flat_map(at).collect()
    }

    fn weights(&self, nside: usize, method: Method) -> Weights {
        Weights::new(&self.lat_lon(), healpix(nside), method).unwrap()
    }
}

/// A grid of the whole sphere: rows half a spacing from the poles, columns from longitude 0.
fn without_poles(rows: usize, columns: usize) -> Grid {
    Grid {
        latitudes: (0..rows).map(|i| -90.0 + 180.0 * (i as f64 + 0.5) / rows as f64).collect(),
        longitudes: (0..columns).map(|i| 360.0 * i as f64 / columns as f64).collect(),
    }
}

/// A grid of the whole sphere: rows at the poles, from the north, and columns from −180°.
fn with_poles(rows: usize, columns: usize) -> Grid {
    Grid {
        latitudes: (0..rows).map(|i| 90.0 - 180.0 * i as f64 / (rows - 1) as f64).collect(),
        longitudes: (0..columns).map(|i| -180.0 + 360.0 * i as f64 / columns as f64).collect(),
    }
}

fn healpix(nside: usize) -> Healpix {
    Healpix::new(nside).unwrap()
}

/// Latitude and longitude of a pixel's centre, in degrees.
fn centre(grid: Healpix, pixel: usize) -> (f64, f64) {
    let (theta, phi) = grid.centre(pixel);
    (90.0 - theta.to_degrees(), phi.to_degrees())
}

/// Some number from 0 to 1, that looks random.
fn noise(i: usize) -> f64 {
    let mut x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A function of latitude and longitude in radians.
type Function = fn(f64, f64) -> f64;

/// Spherical harmonics up to degree 3, without norm.
fn harmonics() -> [(&'static str, Function); 5] {
    [
        ("z", |lat, _| lat.sin()),
        ("z²", |lat, _| lat.sin().powi(2)),
        ("x", |lat, lon| lat.cos() * lon.cos()),
        ("xy", |lat, lon| lat.cos().powi(2) * (2.0 * lon).sin()),
        ("y (5z² − 1)", |lat, lon| lat.cos() * (5.0 * lat.sin().powi(2) - 1.0) * lon.sin()),
    ]
}

/// The root of the mean square of the differences.
fn rms(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let sum: f64 = found.iter().zip(expected).map(|(f, e)| (f - e).powi(2)).sum();
    (sum / found.len() as f64).sqrt()
}

/// The values of a function of latitude and longitude, in radians, at the pixels' centres.
fn at_centres(grid: Healpix, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    (0..grid.pixels()).map(|p| grid.centre(p)).map(|(theta, phi)| f(PI / 2.0 - theta, phi)).collect()
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len());
    for (p, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= tolerance || f.is_nan() && e.is_nan(), "{what}, pixel {p}: {f} instead of {e}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let grid = with_poles(37, 72);
    let field = grid.field(|lat, lon| (3.0 * lat).sin() + (7.0 * lon).cos());
    for method in METHODS {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| grid.weights(16, method).apply(&field, 0.5))
        };
        let one = run(1);
        assert!(run(3).iter().zip(&one).all(|(a, b)| a.to_bits() == b.to_bits()), "{method:?}");
    }
}

#[test]
fn constants_stay() {
    for grid in [with_poles(19, 36), without_poles(18, 36), without_poles(4, 3), with_poles(2, 2)] {
        for nside in [1, 3, 8] {
            for method in METHODS {
                let map = grid.weights(nside, method).apply(&grid.field(|_, _| 0.3), 1.0);
                assert_close(&map, &vec![0.3; map.len()], 1e-15, &format!("{method:?}, Nside {nside}"));
            }
        }
    }
}

#[test]
fn a_grid_that_no_memory_holds() {
    let grid = LatLon::new(&[0.0, 1.0], None, &[0.0, 1.0], None).unwrap();
    for method in METHODS {
        let told = Weights::new(&grid, healpix(1 << 29), method).unwrap_err().to_string();
        assert!(told.contains("Nside 536870912") && told.contains("memory"), "{told}");
    }
}
