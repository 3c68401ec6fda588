//! The values of a field, brought to RING order.
//!
//! The meaning of the header is left to [`super::table`], cells of several sizes to [`super::multi_order`].

use super::multi_order;
use super::problem::Problem;
use super::table::{Column, Layout, Table};
use super::values::{read_integers, read_values};
use crate::cfitsio::FitsReader;
use crate::error::Error;
use crate::request::{Field, Selection};
use longan_grid::accumulate::{Accumulator, CHUNK};
use longan_grid::{Map, Ordering};

/// Reads one field of a table.
pub(super) fn read(fits: &mut FitsReader, table: &Table, column: &Column, selection: &Selection) -> Result<Map, Error> {
    if let (Some(nside), Layout::Implicit { .. } | Layout::Explicit { .. }) = (selection.nside, &table.layout) {
        return Err(Problem::NotMultiOrder { hdu: table.hdu, nside }.into());
    }
    let canvas = match &table.layout {
        Layout::Implicit { named } => implicit(fits, table, column, *named)?,
        Layout::Explicit { index, grain } => explicit(fits, table, column, (index, *grain), plane(table, selection))?,
        Layout::MultiOrder { index } => multi_order::read(fits, table, column, index, selection.nside)?,
    };
    let mut map = Map::from_masked(canvas.grid, canvas.values);
    map.ordering = table.ordering;
    Ok(map)
}

/// The plane (energy band) of a sparse table that a field's number names, the first unless given.
pub(super) fn plane(table: &Table, selection: &Selection) -> Option<usize> {
    table.sparse.then_some(match selection.field {
        Some(Field::Number(number)) => number,
        _ => 0,
    })
}

fn implicit(
    fits: &mut FitsReader,
    table: &Table,
    column: &Column,
    named: Option<(usize, usize)>,
) -> Result<Accumulator, Error> {
    let (grid, pixels) = table.implicit(column, named)?;
    let chunks = (0..pixels.len()).step_by(CHUNK).map(|start| (start, CHUNK.min(pixels.len() - start)));
    match table.ordering {
        Ordering::Ring => {
            // The map grows chunk by chunk, for each to be in the cache when it is filled.
            let mut canvas = Accumulator::reserved(grid, table.ordering)?;
            canvas.values.resize(pixels.start, f64::NAN);
            for (start, count) in chunks {
                let place = canvas.values.len();
                canvas.values.resize(place + count, 0.0);
                read_values(fits, table, column, start, &mut canvas.values[place..])?;
            }
            canvas.values.resize(grid.pixels(), f64::NAN);
            Ok(canvas)
        }
        Ordering::Nested => {
            let mut canvas = Accumulator::new(grid, table.ordering)?;
            let (mut values, mut places) = (Vec::new(), Vec::new());
            for (start, count) in chunks {
                values.resize(count, 0.0);
                read_values(fits, table, column, start, &mut values)?;
                let first = (pixels.start + start) as u64;
                places.clear();
                places.extend(first..first + count as u64);
                canvas.put(&mut places, &values)?;
            }
            Ok(canvas)
        }
    }
}

fn explicit(
    fits: &mut FitsReader,
    table: &Table,
    column: &Column,
    (index, grain): (&Column, usize),
    plane: Option<usize>,
) -> Result<Accumulator, Error> {
    let grid = table.explicit_grid(index)?;
    let run = table.run(column, index, grain)?;
    let total = table.rows * index.repeat;
    let mut canvas = Accumulator::new(grid, table.ordering)?;
    let mut seen = vec![0u64; grid.pixels().div_ceil(64)];
    let indices_per_chunk = (CHUNK / run).max(1);
    let (mut indices, mut values, mut places) = (Vec::new(), Vec::new(), Vec::new());
    for start in (0..total).step_by(indices_per_chunk) {
        let count = indices_per_chunk.min(total - start);
        indices.resize(count, 0);
        values.resize(count * run, 0.0);
        read_integers(fits, table, index, start, &mut indices)?;
        read_values(fits, table, column, start * run, &mut values)?;
        places.clear();
        if let Some(plane) = plane {
            // Of a sparse table's planes, this one; a key is plane · Npix + pixel.
            let pixels = grid.pixels() as i128;
            let wanted: Vec<bool> = indices.iter().map(|key| key.div_euclid(pixels) == plane as i128).collect();
            let mut of_value = wanted.iter().flat_map(|&wanted| std::iter::repeat_n(wanted, run));
            values.retain(|_| of_value.next() == Some(true));
            let mut of_index = wanted.iter();
            indices.retain(|_| of_index.next() == Some(&true));
            indices.iter_mut().for_each(|key| *key = key.rem_euclid(pixels));
        }
        for &first in &indices {
            for pixel in first..first + run as i128 {
                let Some(p) = usize::try_from(pixel).ok().filter(|&p| p < grid.pixels()) else {
                    let (nside, last) = (grid.nside(), grid.pixels() - 1);
                    return Err(Problem::PixelRange { hdu: table.hdu, pixel, nside, last }.into());
                };
                let (word, bit) = (p / 64, 1 << (p % 64));
                if seen[word] & bit != 0 {
                    return Err(Problem::Duplicate { hdu: table.hdu, pixel: p }.into());
                }
                seen[word] |= bit;
                places.push(p as u64);
            }
        }
        canvas.put(&mut places, &values)?;
    }
    Ok(canvas)
}
