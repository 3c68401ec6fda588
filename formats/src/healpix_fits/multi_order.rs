//! Multi-order maps: columns of UNIQ numbers and values.
//!
//! The way from cells of several sizes to one grid is left to [`crate::multi_order`].

use super::problem::Problem;
use super::table::{Column, Table};
use super::values::{read_integers, read_values};
use crate::cfitsio::FitsReader;
use crate::error::Error;
use crate::multi_order::{self, Cell, gather, place_of_uniq};
use longan_grid::accumulate::{Accumulator, CHUNK};

/// Calls `each` with the place of every cell in chunks, in the table's order, and the number of the first of them.
fn for_places(
    fits: &mut FitsReader,
    table: &Table,
    index: &Column,
    mut each: impl FnMut(&mut FitsReader, usize, &[u64]) -> Result<(), Error>,
) -> Result<(), Error> {
    let total = table.rows * index.repeat;
    let (mut uniqs, mut places) = (Vec::new(), Vec::new());
    for start in (0..total).step_by(CHUNK) {
        uniqs.resize(CHUNK.min(total - start), 0);
        read_integers(fits, table, index, start, &mut uniqs)?;
        places.clear();
        for (i, &uniq) in (start..).zip(&uniqs) {
            let row = i / index.repeat + 1;
            places.push(place_of_uniq(uniq).ok_or(Problem::Uniq { hdu: table.hdu, uniq, row })?);
        }
        each(fits, start, &places)?;
    }
    Ok(())
}

/// Nside of the finest cells.
pub(super) fn finest(fits: &mut FitsReader, table: &Table, index: &Column) -> Result<usize, Error> {
    let mut nside = 1;
    for_places(fits, table, index, |_, _, places| {
        nside = nside.max(multi_order::finest(places.iter().copied()));
        Ok(())
    })?;
    Ok(nside)
}

/// Reads a column at the resolution asked for, else at that of the finest cells.
pub(super) fn read(
    fits: &mut FitsReader,
    table: &Table,
    column: &Column,
    index: &Column,
    nside: Option<usize>,
) -> Result<Accumulator, Error> {
    let hdu = table.hdu;
    if table.run(column, index, 0)? != 1 {
        let (values, indices) = (column.repeat, index.repeat);
        return Err(Problem::Run { hdu, column: column.name.clone(), values, indices, grain: 0 }.into());
    }
    let mut cells = Vec::with_capacity(table.rows * index.repeat);
    let mut values = Vec::new();
    for_places(fits, table, index, |fits, start, places| {
        values.resize(places.len(), 0.0);
        read_values(fits, table, column, start, &mut values)?;
        cells.extend(places.iter().zip(&values).map(|(&place, &value)| Cell { place, value }));
        Ok(())
    })?;
    gather(cells, nside).map_err(|problem| match problem {
        multi_order::Problem::Overlap { first, second } => Problem::Overlap { hdu, first, second }.into(),
        multi_order::Problem::TooFine { finest, limit } => Problem::TooFine { hdu, finest, limit }.into(),
        multi_order::Problem::Other(error) => error,
    })
}
