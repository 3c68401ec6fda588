//! The description of a variable: its dimensions, name, unit and attributes.
//!
//! The description of its grid is left to the adapters.

use super::select::Labels;
use crate::card::{Card, CardValue};
use crate::dataset::{Attribute, Dataset, Dimension, Variable};
use crate::describe::{DimensionDescription, FieldDescription, GridDescription, TableDescription, TablePlace};
use crate::error::Error;
use crate::quantity::StatedQuantity;

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
            quantity: StatedQuantity::of(variable),
        }],
        cards: cards(dataset, &variable.group),
    })
}

/// The attributes of a group and, where it does not have the same, those of the whole file.
fn cards(dataset: &dyn Dataset, group: &str) -> Vec<Card> {
    let mut cards: Vec<Card> = Vec::new();
    for (name, attribute) in dataset.group_attributes(group).iter().chain(dataset.group_attributes("/")) {
        let key = name.to_uppercase();
        if cards.iter().all(|card| card.key != key) {
            cards.push(Card { key, value: value(attribute), comment: String::new() });
        }
    }
    cards
}

/// An attribute as a header entry; several numbers as text.
fn value(attribute: &Attribute) -> CardValue {
    fn listed(numbers: &[impl ToString]) -> CardValue {
        CardValue::Text(numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
    }
    match attribute {
        Attribute::Text(text) => CardValue::Text(text.clone()),
        Attribute::Real(numbers) => match numbers[..] {
            [number] => CardValue::Real(number),
            _ => listed(numbers),
        },
        Attribute::Whole(numbers) => match numbers[..] {
            [number] => CardValue::Integer(number),
            _ => listed(numbers),
        },
        Attribute::Json(json) => CardValue::Text(json.to_string()),
    }
}
