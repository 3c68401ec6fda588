//! The description of a HEALPix table: its grid, fields and header.

use super::multi_order;
use super::table::{Column, Layout, Table, unquoted};
use crate::card::{Card, CardValue};
use crate::cfitsio::FitsReader;
use crate::describe::{FieldDescription, GridDescription, Indexing, TableDescription, TablePlace};
use crate::error::Error;
use longan_grid::Healpix;

/// Describes a table.
pub(super) fn describe(table: &Table, fits: &mut FitsReader) -> Result<TableDescription, Error> {
    let column = table.columns.iter().find(|c| c.check(table.hdu).is_ok()).unwrap_or(&table.columns[0]);
    let (indexing, nside, pixels) = match &table.layout {
        Layout::Implicit { named } => {
            let (grid, pixels) = table.implicit(column, *named)?;
            (Indexing::Implicit, grid.nside(), pixels.len())
        }
        Layout::Explicit { index, grain } => {
            let pixels = table.rows * index.repeat * table.run(column, index, *grain)?;
            (Indexing::Explicit, table.grid.map_or(0, Healpix::nside), pixels)
        }
        Layout::MultiOrder { index } => {
            let nside = multi_order::finest(fits, table, index)?;
            (Indexing::MultiOrder, nside, table.rows * index.repeat)
        }
    };
    let field = |c: &Column| FieldDescription {
        name: c.name.clone(),
        unit: c.unit.clone(),
        long_name: None,
        quantity: c.quantity.clone(),
    };
    Ok(TableDescription {
        place: TablePlace::Hdu { hdu: table.hdu, name: table.name.clone() },
        grid: GridDescription::Healpix {
            nside,
            ordering: table.ordering,
            ordering_assumed: table.ordering_assumed,
            coordinates: table.coordinates,
            indexing,
            pixels,
        },
        dimensions: Vec::new(),
        fields: table.columns.iter().map(field).collect(),
        cards: cards(table, fits)?,
    })
}

/// The entries of the header.
fn cards(table: &Table, fits: &mut FitsReader) -> Result<Vec<Card>, Error> {
    fits.go(table.hdu)?;
    let card = |(key, value): (String, String)| Card { key, value: card_value(&value), comment: String::new() };
    Ok(fits.keys()?.into_iter().map(card).collect())
}

/// The value of a header entry as it is written there. What is neither a number nor a truth value is text.
fn card_value(raw: &str) -> CardValue {
    if let Some(text) = unquoted(raw) {
        return CardValue::Text(text.trim_end().to_owned());
    }
    match raw.trim() {
        "T" => CardValue::Logical(true),
        "F" => CardValue::Logical(false),
        raw => match (raw.parse(), raw.replace(['D', 'd'], "E").parse()) {
            (Ok(whole), _) => CardValue::Integer(whole),
            (_, Ok(real)) => CardValue::Real(real),
            _ => CardValue::Text(raw.to_owned()),
        },
    }
}
