//! Tests of longan as a whole, one module a theme.

/// The program, run as users run it.
mod cli;
/// Thresholds by themselves, regions, and Gaussian skies.
mod graphs;
/// Files exchanged with healpy.
mod healpy;
/// What holds for any map: Gauss–Bonnet, symmetry, duality, additivity, threads.
mod invariants;
/// Masked windows have what whole ones have.
mod masks;
/// A slow, obvious implementation judges the fast one.
mod oracle;
/// Pictures that look as they did.
mod pictures;
/// Expected values from an independent implementation, and litchi's, for the data in `LONGAN_SHARED`.
mod reference;
/// Bodies and fields whose measures are known in closed form.
mod shapes;
/// Windows from prefix sums against windows summed directly.
mod summation;
/// Files that xarray opens.
mod xarray;

use longan::Map;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A map of independent values from 0 to `levels` − 1: many of them equal, and equal to thresholds.
fn noise(nside: usize, levels: u32, seed: u64) -> Map {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let values = (0..12 * nside * nside).map(|_| f64::from(rng.random_range(0..levels))).collect();
    Map::new("noise", values).unwrap()
}

/// The map turned by 90° about the pole, eastwards.
fn turned(map: &Map) -> Map {
    let grid = map.grid();
    let mut values = map.values().to_vec();
    for i in 1..=grid.rings() {
        let ring = grid.ring(i);
        values[ring.start..ring.start + ring.len].rotate_right(ring.len / 4);
    }
    Map::new(map.name.clone(), values).unwrap()
}

/// A map with masked pixels wherever `masked` says so.
fn masked(map: &Map, masked: impl Fn(usize) -> bool) -> Map {
    let values = map.values().iter().enumerate().map(|(p, &v)| if masked(p) { f64::NAN } else { v });
    Map::new(map.name.clone(), values.collect()).unwrap()
}

/// The largest difference; two NaN do not differ, NaN and a number do.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let differ = |(a, b): (&f64, &f64)| match (a.is_nan(), b.is_nan()) {
        (true, true) => 0.0,
        (false, false) => (a - b).abs(),
        _ => f64::INFINITY,
    };
    a.iter().zip(b).map(differ).fold(0.0, f64::max)
}

/// Says that a test does not run. Written past the test runner's capture, so that it is seen.
fn skipped(why: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}
