//! Points in CSV and surfaces in PLY, read to maps. Files are made here; slow and plain sums over all points or triangles
//! judge what the readers find.

mod broken;
mod cortex;
#[path = "../support/errors.rs"]
mod errors;
mod gathering;
mod surfaces;
mod tables;

use std::f64::consts::TAU;
use std::path::PathBuf;

use longan_formats::{Error, Selection};
use longan_grid::{Gather, Healpix, Map, Regrid};

use errors::{grid, is};

/// A file in a folder of its own.
struct Scratch {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn scratch(bytes: &[u8]) -> Scratch {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("points.dat");
    std::fs::write(&path, bytes).unwrap();
    Scratch { _folder: folder, path }
}

/// Reads a file of these bytes.
fn read_with(bytes: &[u8], selection: &Selection) -> Result<Map, Error> {
    longan_formats::read(&scratch(bytes).path, selection)
}

fn field(name: &str) -> Selection {
    Selection { field: Some(name.parse().unwrap()), ..Selection::default() }
}

fn nside(nside: usize, regrid: Regrid) -> Selection {
    Selection { nside: Some(nside), regrid, ..Selection::default() }
}

fn gather(gather: Gather) -> Regrid {
    Regrid { gather: Some(gather), ..Regrid::default() }
}

/// The error about a file of these bytes, and its sentence without the file's name.
#[track_caller]
fn problem_with(bytes: &[u8], selection: &Selection) -> (Error, String) {
    let Err(error) = read_with(bytes, selection) else { panic!("no error") };
    assert!(error.path().is_some(), "an error that does not name the file");
    let told = error.problem().to_string();
    assert!(!told.contains('\n') && !told.ends_with('.') && told.len() < 400, "{told}");
    (error, told)
}

/// Asserts that two maps have the same bits, NaN equal to NaN.
#[track_caller]
fn assert_same(found: &Map, expected: &Map) {
    assert_eq!(found.grid(), expected.grid());
    for (p, (f, e)) in found.values().iter().zip(expected.values()).enumerate() {
        assert!(f == e || f.is_nan() && e.is_nan(), "pixel {p}: {f} instead of {e}");
    }
}

/// The largest difference between a map and a function of the direction, where the map has values.
fn largest_error(map: &Map, field: impl Fn([f64; 3]) -> f64) -> f64 {
    let errors = map.values().iter().enumerate().map(|(p, v)| (v - field(centre(map.grid(), p))).abs());
    errors.filter(|e| !e.is_nan()).fold(0.0, f64::max)
}

/// The direction to a pixel's centre.
fn centre(grid: Healpix, pixel: usize) -> [f64; 3] {
    let (theta, phi) = grid.centre(pixel);
    [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]
}

/// Directions spread evenly over the sphere.
fn fibonacci(count: usize) -> Vec<[f64; 3]> {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let direction = |i: usize| {
        let z: f64 = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (phi, sin_theta) = (TAU * (i as f64 / golden).fract(), (1.0 - z * z).sqrt());
        [sin_theta * phi.cos(), sin_theta * phi.sin(), z]
    };
    (0..count).map(direction).collect()
}

/// Numbers from 0 to 1 that follow no pattern, always the same.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        // Splitmix64 (Steele, Lea & Flood 2014).
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Longitude and latitude in degrees.
fn degrees([x, y, z]: [f64; 3]) -> (f64, f64) {
    (y.atan2(x).to_degrees(), z.atan2(x.hypot(y)).to_degrees())
}

/// A table of points.
fn table(points: &[[f64; 3]], values: impl Fn([f64; 3]) -> f64) -> String {
    let row = |&d: &[f64; 3]| {
        let (lon, lat) = degrees(d);
        format!("{lon},{lat},{}\n", values(d))
    };
    "lon,lat,value\n".to_owned() + &points.iter().map(row).collect::<String>()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The angle between two directions.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let c = cross(a, b);
    dot(c, c).sqrt().atan2(dot(a, b))
}
