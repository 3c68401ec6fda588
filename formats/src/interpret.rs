//! The maps in the arrays of a dataset: fields on HEALPix grids, then fields on grids of latitude and longitude.
//!
//! Each of the two interpretations is left to a module of its own.

use std::rc::Rc;

use crate::adapter::MapSeries;
use crate::dataset::Dataset;
use crate::describe::TableDescription;
use crate::error::Error;
use crate::request::Selection;
use crate::{healpix_cf, latlon};

/// Finds the selected field of a dataset.
///
/// # Errors
/// Where no interpretation has the selected field, or it cannot be read.
pub(crate) fn open(dataset: Rc<dyn Dataset>, selection: &Selection) -> Result<Box<dyn MapSeries>, Error> {
    match healpix_cf::open(&dataset, selection)? {
        Some(maps) => Ok(maps),
        None => latlon::open(dataset, selection),
    }
}

/// Describes the fields of a dataset.
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
