//! The values of columns as numbers, with NaN where there is none.
//!
//! The pixels that values belong to are left to [`super::read`] and [`super::multi_order`].

use super::problem::Problem;
use super::table::{self, Column, Kind, Table};
use crate::cfitsio::FitsReader;
use crate::error::Error;
use longan_grid::{UNSEEN, is_bad};

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
            return Err(Problem::ColumnKind { hdu: table.hdu, column: column.name.clone(), found }.into());
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
    let mut scaling = |key: &str, default: i128| -> Result<i128, Error> {
        let key = format!("{key}{}", column.number);
        match table::number(fits, &key)? {
            None => Ok(default),
            Some(value) if value.fract() == 0.0 && value.abs() <= 2f64.powi(63) => Ok(value as i128),
            Some(value) => {
                Err(table::bad_key(table.hdu, &key, value, "a whole number of 64 bits, as pixel numbers need").into())
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
