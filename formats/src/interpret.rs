//! The choice of what the arrays of a dataset are as maps, whatever file holds them.
//!
//! Each interpretation is left to its own module.

use std::rc::Rc;

use crate::dataset::Dataset;
use crate::{Error, Maps, Selection, TableDescription, healpix_cf, latlon};

/// Finds what is selected of a dataset.
///
/// # Errors
/// Where no interpretation has what is selected, or it cannot be read.
pub(crate) fn open(dataset: Rc<dyn Dataset>, selection: &Selection) -> Result<Box<dyn Maps>, Error> {
    match healpix_cf::open(&dataset, selection)? {
        Some(maps) => Ok(maps),
        None => latlon::open(dataset, selection),
    }
}

/// What a dataset holds.
///
/// # Errors
/// Where it cannot be read or holds no map.
pub(crate) fn describe(dataset: &dyn Dataset) -> Result<Vec<TableDescription>, Error> {
    let mut tables = healpix_cf::describe(dataset)?;
    match latlon::describe(dataset) {
        Ok(others) => tables.extend(others),
        // What is on HEALPix grids is enough.
        Err(_) if !tables.is_empty() => {}
        Err(error) => return Err(error),
    }
    Ok(tables)
}
