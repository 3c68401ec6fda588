//! HEALPix FITS files, read and written. Files to read are made byte by byte in [`longan_support::bytes`], without the FITS library.

#[path = "../support/errors.rs"]
mod errors;
mod headers;
mod layouts;
mod multi_order;
mod other_files;
mod paths;
mod saving;
mod writing;

use std::path::PathBuf;

use longan_formats::{Error, Field, Selection};
use longan_grid::Map;

use errors::{grid, is};

/// RING numbers of the NESTED pixels of Nside 2, from healpy's `nest2ring(2, range(48))`.
const NEST_TO_RING_2: [usize; 48] = [
    13, 5, 4, 0, 15, 7, 6, 1, 17, 9, 8, 2, 19, 11, 10, 3, 28, 20, 27, 12, 30, 22, 21, 14, 32, 24, 23, 16, 34, 26, 25,
    18, 44, 37, 36, 29, 45, 39, 38, 31, 46, 41, 40, 33, 47, 43, 42, 35,
];

/// Values of Nside 2 in RING order, of which no two are equal.
fn ring_values() -> Vec<f64> {
    (0..48).map(|p| f64::from(p) * 2.0 - 30.0).collect()
}

/// The same map in NESTED order.
fn nested_values() -> Vec<f64> {
    let ring = ring_values();
    NEST_TO_RING_2.iter().map(|&p| ring[p]).collect()
}

/// A file in a folder of its own.
struct Scratch {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn scratch(bytes: &[u8]) -> Scratch {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.fits");
    std::fs::write(&path, bytes).unwrap();
    Scratch { _folder: folder, path }
}

/// Reads a file of these bytes.
fn read_with(bytes: &[u8], selection: &Selection) -> Result<Map, Error> {
    longan_formats::read(&scratch(bytes).path, selection)
}

fn read(bytes: &[u8]) -> Result<Map, Error> {
    read_with(bytes, &Selection::default())
}

fn field(text: &str) -> Selection {
    Selection { field: Some(text.parse::<Field>().unwrap()), ..Selection::default() }
}

/// The error about a file of these bytes, and its sentence without the file's name.
fn problem_with(bytes: &[u8], selection: &Selection) -> (Error, String) {
    problem(read_with(bytes, selection))
}

/// The error, and its sentence without the file's name.
#[track_caller]
fn problem<T>(result: Result<T, Error>) -> (Error, String) {
    let Err(error) = result else { panic!("no error") };
    let path = error.path().expect("an error that names the file");
    let told = error.problem().to_string();
    let shown = path.display().to_string().replace(char::is_control, "\u{fffd}");
    assert_eq!(error.to_string(), format!("{shown}: {told}"));
    assert!(!told.contains('\n') && !told.ends_with('.') && !told.contains("map.fits"), "{told}");
    (error, told)
}

/// Asserts that two maps have the same bits, NaN equal to NaN.
#[track_caller]
fn assert_same(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (p, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!(f == e || f.is_nan() && e.is_nan(), "pixel {p}: {f} instead of {e}");
    }
}
