//! What is said of a variable to people who ask what a file holds.
//!
//! Of what grid it is, is left to the adapters.

use super::select::Labels;
use crate::dataset::{Dataset, Dimension, Variable};
use crate::{DimensionDescription, Error, FieldDescription, GridDescription, TableDescription, TablePlace};

/// A variable on a grid, which takes the dimensions at the places `sphere`: its other dimensions, name and unit.
///
/// # Errors
/// Where the coordinates of those dimensions cannot be read.
pub(crate) fn describe(
    dataset: &dyn Dataset,
    variable: &Variable,
    sphere: &[usize],
    grid: GridDescription,
) -> Result<TableDescription, Error> {
    let others = variable.dimensions.iter().enumerate().filter(|(place, _)| !sphere.contains(place));
    let describe = |(_, dimension): (usize, &Dimension)| {
        let labels = Labels::of(dataset, variable, dimension)?;
        Ok(DimensionDescription {
            name: dimension.name.clone(),
            len: dimension.len,
            time: matches!(labels, Labels::Times(..)),
            values: labels.listed(),
        })
    };
    Ok(TableDescription {
        place: TablePlace::Variable { variable: variable.path() },
        grid,
        dimensions: others.map(describe).collect::<Result<_, Error>>()?,
        fields: vec![FieldDescription {
            name: variable.name.clone(),
            unit: variable.text("units").map(str::to_owned),
            long_name: variable.text("long_name").map(str::to_owned),
        }],
    })
}
