//! Multi-order maps: columns of UNIQ numbers and values.
//!
//! What cells of several sizes make of a grid is left to [`crate::multi_order`].

use super::read::{read_integers, read_values};
use super::table::{Column, Table};
use crate::Error;
use crate::cfitsio::FitsReader;
use crate::multi_order::{Cell, Problem, gather, place_of_uniq};
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
            places.push(place_of_uniq(uniq).ok_or(Error::Uniq { hdu: table.hdu, uniq, row })?);
        }
        each(fits, start, &places)?;
    }
    Ok(())
}

/// Nside of the finest cells.
pub(super) fn finest(fits: &mut FitsReader, table: &Table, index: &Column) -> Result<usize, Error> {
    let mut order = 0;
    for_places(fits, table, index, |_, _, places| {
        let finest = places.iter().map(|&place| Cell { place, value: 0.0 }.order()).max();
        order = order.max(finest.unwrap_or(0));
        Ok(())
    })?;
    Ok(1 << order)
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
        return Err(Error::Run {
            hdu,
            column: column.name.clone(),
            values: column.repeat,
            indices: index.repeat,
            grain: 0,
        });
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
        Problem::Overlap { first, second } => Error::Overlap { hdu, first, second },
        Problem::TooFine { finest, limit } => Error::TooFine { hdu, finest, limit },
        Problem::Other(error) => error,
    })
}
