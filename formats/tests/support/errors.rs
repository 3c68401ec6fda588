//! Questions about errors, for all tests of files.

use longan_formats::{Error, ErrorKind};

/// Whether an error is of a kind, and its sentence has this part.
#[track_caller]
pub(crate) fn is(error: &Error, kind: ErrorKind, part: &str) -> bool {
    error.kind() == kind && error.problem().to_string().contains(part)
}

/// The problem of the grid in an error.
#[track_caller]
#[allow(dead_code, reason = "not every folder of tests has problems of grids")]
pub(crate) fn grid(error: &Error) -> &longan_grid::Error {
    error.problem().downcast_ref().unwrap_or_else(|| panic!("no problem of the grid: {error}"))
}
