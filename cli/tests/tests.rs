//! Tests of the program, one module a theme.

/// The program, run as users run it.
mod cli;
/// Files exchanged with healpy.
mod healpy;
/// Pictures that look as they did.
mod pictures;
/// Files that xarray opens.
mod xarray;
