//! The values of a field, brought to RING order.
//!
//! What the header means is left to [`super::table`], cells of several sizes to [`super::multi_order`].

use super::multi_order;
use super::table::{self, Column, Kind, Layout, Table};
use crate::cfitsio::FitsReader;
use crate::{Error, Field, Selection};
use longan_grid::accumulate::{Accumulator, CHUNK};
use longan_grid::{Map, Ordering, UNSEEN, is_bad};

/// Reads one field of a table.
pub(super) fn read(fits: &mut FitsReader, table: &Table, column: &Column, selection: &Selection) -> Result<Map, Error> {
    if let (Some(nside), Layout::Implicit { .. } | Layout::Explicit { .. }) = (selection.nside, &table.layout) {
        return Err(Error::NotMultiOrder { hdu: table.hdu, nside });
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
fn plane(table: &Table, selection: &Selection) -> Option<usize> {
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
                    return Err(Error::PixelRange {
                        hdu: table.hdu,
                        pixel,
                        nside: grid.nside(),
                        last: grid.pixels() - 1,
                    });
                };
                let (word, bit) = (p / 64, 1 << (p % 64));
                if seen[word] & bit != 0 {
                    return Err(Error::Duplicate { hdu: table.hdu, pixel: p });
                }
                seen[word] |= bit;
                places.push(p as u64);
            }
        }
        canvas.put(&mut places, &values)?;
    }
    Ok(canvas)
}

/// Reads values of a column from its `start`-th on (counted over all rows); all that mean "no value" become NaN.
pub(super) fn read_values(
    fits: &mut FitsReader,
    table: &Table,
    column: &Column,
    start: usize,
    out: &mut [f64],
) -> Result<(), Error> {
    let from = (start / column.repeat, start % column.repeat);
    match column.kind {
        Kind::Real => fits.read_f64(column.number, from, false, out)?,
        Kind::Integer { nulls } => fits.read_f64(column.number, from, nulls, out)?,
        Kind::Logical => {
            let mut truths = vec![0; out.len()];
            fits.read_logical(column.number, from, &mut truths)?;
            for (value, truth) in out.iter_mut().zip(truths) {
                *value = if truth <= 1 { f64::from(truth) } else { f64::NAN };
            }
        }
        Kind::Bits => {
            // cfitsio reads bits as bytes, of which each row has a whole number.
            let bytes_per_row = column.repeat.div_ceil(8);
            let rows = (from.1 + out.len()).div_ceil(column.repeat);
            let mut bytes = vec![0.0; rows * bytes_per_row];
            fits.read_f64(column.number, (from.0, 0), false, &mut bytes)?;
            for (i, value) in (start - from.0 * column.repeat..).zip(out.iter_mut()) {
                let (row, bit) = (i / column.repeat, i % column.repeat);
                *value = f64::from(bytes[row * bytes_per_row + bit / 8] as u8 >> (7 - bit % 8) & 1);
            }
        }
        Kind::Other(found) => {
            return Err(Error::ColumnKind { hdu: table.hdu, column: column.name.clone(), found });
        }
    }
    mask(out, table.bad_data);
    Ok(())
}

/// Makes NaN of all that means "no value": UNSEEN, the file's own marker, and what is not finite.
fn mask(values: &mut [f64], bad_data: Option<f64>) {
    // UNSEEN twice costs less than a branch.
    let marker = bad_data.unwrap_or(UNSEEN);
    for value in values {
        *value = if is_bad(*value, UNSEEN) | is_bad(*value, marker) { f64::NAN } else { *value };
    }
}

/// Reads integers of a column from its `start`-th on (counted over all rows), unsigned ones included.
pub(super) fn read_integers(
    fits: &mut FitsReader,
    table: &Table,
    column: &Column,
    start: usize,
    out: &mut [i128],
) -> Result<(), Error> {
    // cfitsio applies TZERO in 64 bits or in floating point, neither of which holds every unsigned number.
    let mut scaling = |key: &str, default: i128| {
        let key = format!("{key}{}", column.number);
        match table::number(fits, &key)? {
            None => Ok(default),
            Some(value) if value.fract() == 0.0 && value.abs() <= 2f64.powi(63) => Ok(value as i128),
            Some(value) => {
                Err(table::bad_key(table.hdu, &key, value, "a whole number of 64 bits, as pixel numbers need"))
            }
        }
    };
    let (scale, zero) = (scaling("TSCAL", 1)?, scaling("TZERO", 0)?);
    fits.set_scaling(column.number, 1.0, 0.0)?;
    let mut raw = vec![0; out.len()];
    fits.read_i64(column.number, (start / column.repeat, start % column.repeat), &mut raw)?;
    for (value, raw) in out.iter_mut().zip(raw) {
        *value = i128::from(raw) * scale + zero;
    }
    Ok(())
}
