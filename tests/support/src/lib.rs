//! What the tests of several crates share: maps, FITS files made byte by byte, libraries from C, and the things that not
//! every machine has.

pub mod bytes;
pub mod compile;
mod needed;

pub use needed::{cdo, fitsverify, python_with, shared, skip};

use longan_grid::Map;
use ndarray::ArrayView2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A map of independent values from 0 to `levels` − 1: many of them equal, and equal to thresholds.
pub fn noise(nside: usize, levels: u32, seed: u64) -> Map {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let values = (0..12 * nside * nside).map(|_| f64::from(rng.random_range(0..levels))).collect();
    Map::new("noise", values).unwrap()
}

/// The map turned by 90° about the pole, eastwards.
pub fn turned(map: &Map) -> Map {
    let grid = map.grid();
    let mut values = map.values().to_vec();
    for i in 1..=grid.rings() {
        let ring = grid.ring(i);
        values[ring.start..ring.start + ring.len].rotate_right(ring.len / 4);
    }
    Map::new(map.name.clone(), values).unwrap()
}

/// A map with masked pixels wherever `masked` says so.
pub fn masked(map: &Map, masked: impl Fn(usize) -> bool) -> Map {
    let values = map.values().iter().enumerate().map(|(p, &v)| if masked(p) { f64::NAN } else { v });
    Map::new(map.name.clone(), values.collect()).unwrap()
}

/// The rows of an array.
pub fn rows<'a>(values: impl Into<ArrayView2<'a, f64>>) -> Vec<Vec<f64>> {
    values.into().outer_iter().map(|row| row.to_vec()).collect()
}

/// The largest difference; two NaN do not differ, NaN and a number do.
///
/// # Panics
/// Where the lengths differ.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let differ = |(a, b): (&f64, &f64)| match (a.is_nan(), b.is_nan()) {
        (true, true) => 0.0,
        (false, false) => (a - b).abs(),
        _ => f64::INFINITY,
    };
    a.iter().zip(b).map(differ).fold(0.0, f64::max)
}
