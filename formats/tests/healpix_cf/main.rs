//! HEALPix in NetCDF and Zarr, read and written. What a file holds is told once, by [`file::File`], and written in each
//! format.

mod broken;
mod dialects;
#[path = "../support/errors.rs"]
mod errors;
mod file;
mod steps;
mod writing;
mod zarr;

use std::path::Path;

use longan_formats::{Error, Field, Selection};
use longan_grid::Map;

use errors::is;

/// RING numbers of the NESTED pixels of Nside 2, from healpy's `nest2ring(2, range(48))`.
const NEST_TO_RING_2: [usize; 48] = [
    13, 5, 4, 0, 15, 7, 6, 1, 17, 9, 8, 2, 19, 11, 10, 3, 28, 20, 27, 12, 30, 22, 21, 14, 32, 24, 23, 16, 34, 26, 25,
    18, 44, 37, 36, 29, 45, 39, 38, 31, 46, 41, 40, 33, 47, 43, 42, 35,
];

/// A map of Nside 2 in RING order, of which no two values are equal and some are missing.
fn ring_values() -> Vec<f64> {
    (0..48).map(|p| if p % 11 == 5 { f64::NAN } else { f64::from(p) * 2.0 - 30.0 }).collect()
}

/// The same in NESTED order.
fn nested_values() -> Vec<f64> {
    let ring = ring_values();
    NEST_TO_RING_2.iter().map(|&p| ring[p]).collect()
}

/// Reads the only field.
fn read(path: &Path) -> Result<Map, Error> {
    longan_formats::read(path, &Selection::default())
}

fn field(name: &str) -> Selection {
    Selection { field: Some(Field::Name(name.to_owned())), ..Selection::default() }
}

/// The error, and its sentence without the file's name.
#[track_caller]
fn problem<T>(result: Result<T, Error>) -> (Error, String) {
    let Err(error) = result else { panic!("no error") };
    assert!(error.path().is_some(), "an error that does not name the file");
    let told = error.problem().to_string();
    assert!(!told.contains('\n') && !told.ends_with('.'), "{told}");
    (error, told)
}

/// Asserts that two maps have the same bits, NaN equal to NaN.
#[track_caller]
fn assert_same(found: &[f64], expected: &[f64], of: &str) {
    assert_eq!(found.len(), expected.len(), "{of}");
    for (p, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!(f == e || f.is_nan() && e.is_nan(), "{of}: pixel {p}: {f} instead of {e}");
    }
}
