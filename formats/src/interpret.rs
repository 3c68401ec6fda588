//! The choice of what the arrays of a dataset are as maps, whatever file holds them.
//!
//! Each interpretation is left to its own module.

use std::rc::Rc;

use crate::dataset::Dataset;
use crate::{Error, Maps, Selection, TableDescription, latlon};

/// Finds what is selected of a dataset.
///
/// # Errors
/// Where no interpretation has what is selected, or it cannot be read.
pub(crate) fn open(dataset: Rc<dyn Dataset>, selection: &Selection) -> Result<Box<dyn Maps>, Error> {
    latlon::open(dataset, selection)
}

/// What a dataset holds.
///
/// # Errors
/// Where it cannot be read or holds no map.
pub(crate) fn describe(dataset: &dyn Dataset) -> Result<Vec<TableDescription>, Error> {
    latlon::describe(dataset)
}
