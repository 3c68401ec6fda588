//! Maps whose cells have several sizes, each named by its UNIQ number, brought to one grid.
//!
//! UNIQ = 4^(order + 1) + NESTED pixel number (Fernique et al. 2014, MOC 1.0). Cells are sorted along the NESTED tree,
//! so that overlaps show between neighbours, and each pixel of the grid is made in passing; nothing is ever held at a
//! finer resolution than that of the grid.

use rayon::prelude::*;

use super::read::{CHUNK, Canvas, read_integers, read_values};
use super::table::{Column, Table};
use crate::cfitsio::FitsReader;
use crate::{Error, Healpix, Ordering};

/// The finest order of HEALPix, and so of UNIQ numbers.
const ORDER_MAX: u32 = 29;

/// The finest Nside that a map is brought to without being asked for: 6 GiB.
const UNASKED_MAX: usize = 8192;

/// One cell and its value.
struct Cell {
    /// (2 pixel + 1) 4^(29 − order), which sorts cells along the tree and holds pixel and order.
    place: u64,
    value: f64,
}

impl Cell {
    fn order(&self) -> u32 {
        ORDER_MAX - self.place.trailing_zeros() / 2
    }

    /// The pixel number at the cell's order.
    fn pixel(&self) -> u64 {
        self.place >> (2 * (ORDER_MAX - self.order()) + 1)
    }

    fn uniq(&self) -> u64 {
        (1 << (2 * (self.order() + 1))) + self.pixel()
    }

    /// Begin and end at order 29.
    fn span(&self) -> (u64, u64) {
        let finer = 2 * (ORDER_MAX - self.order());
        (self.pixel() << finer, (self.pixel() + 1) << finer)
    }
}

/// The place of a cell along the tree, if there is such a cell.
fn place(uniq: i128) -> Option<u64> {
    let uniq = u64::try_from(uniq).ok().filter(|&uniq| uniq >= 4)?;
    let order = uniq.ilog2() / 2 - 1;
    // Orders follow each other without gaps, so any pixel number is one of this order.
    let pixel = uniq - (1 << (2 * (order + 1)));
    (order <= ORDER_MAX).then(|| (2 * pixel + 1) << (2 * (ORDER_MAX - order)))
}

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
            places.push(place(uniq).ok_or(Error::Uniq { hdu: table.hdu, uniq, row })?);
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
///
/// A pixel gets the mean over the cells in it, weighted by their area and without those that are masked; a pixel
/// within a cell gets the cell's value.
pub(super) fn read(
    fits: &mut FitsReader,
    table: &Table,
    column: &Column,
    index: &Column,
    nside: Option<usize>,
) -> Result<Canvas, Error> {
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
    cells.par_sort_unstable_by_key(|cell| cell.place);
    for pair in cells.windows(2) {
        if pair[0].span().1 > pair[1].span().0 {
            return Err(Error::Overlap { hdu, first: pair[0].uniq(), second: pair[1].uniq() });
        }
    }

    let finest = 1 << cells.iter().map(Cell::order).max().unwrap_or(0);
    let grid = match nside {
        Some(nside) => Healpix::new(nside).ok().filter(|grid| grid.has_nested()).ok_or(Error::Resolution { nside })?,
        None if finest > UNASKED_MAX => return Err(Error::TooFine { hdu, finest, limit: UNASKED_MAX }),
        None => Healpix::new(finest)?,
    };
    let depth = u32::from(grid.depth()?);
    let mut canvas = Canvas::new(grid, Ordering::Nested)?;
    let mut batch = Batch { canvas: &mut canvas, places: Vec::with_capacity(CHUNK), values: Vec::with_capacity(CHUNK) };
    let mut mean = Mean { pixel: 0, first: 0.0, sum: 0.0, weight: 0.0 };
    for cell in &cells {
        if cell.order() <= depth {
            let children = 2 * (depth - cell.order());
            for pixel in cell.pixel() << children..(cell.pixel() + 1) << children {
                batch.push(pixel, cell.value)?;
            }
        } else {
            let parents = 2 * (cell.order() - depth);
            let pixel = cell.pixel() >> parents;
            if mean.pixel != pixel {
                mean.flush(&mut batch)?;
                mean.pixel = pixel;
            }
            if !cell.value.is_nan() {
                mean.add(cell.value, 0.25f64.powi((cell.order() - depth) as i32));
            }
        }
    }
    mean.flush(&mut batch)?;
    batch.flush()?;
    Ok(canvas)
}

/// The mean over the cells of one pixel.
struct Mean {
    pixel: u64,
    first: f64,
    /// Of the differences to the first value, so that the mean of equal values is exact.
    sum: f64,
    weight: f64,
}

impl Mean {
    fn add(&mut self, value: f64, weight: f64) {
        if self.weight == 0.0 {
            self.first = value;
        }
        self.sum += weight * (value - self.first);
        self.weight += weight;
    }

    fn flush(&mut self, batch: &mut Batch<'_>) -> Result<(), Error> {
        if self.weight > 0.0 {
            batch.push(self.pixel, self.first + self.sum / self.weight)?;
            (self.sum, self.weight) = (0.0, 0.0);
        }
        Ok(())
    }
}

/// Pixels that are put onto the canvas together.
struct Batch<'a> {
    canvas: &'a mut Canvas,
    places: Vec<u64>,
    values: Vec<f64>,
}

impl Batch<'_> {
    fn push(&mut self, pixel: u64, value: f64) -> Result<(), Error> {
        if self.places.len() == CHUNK {
            self.flush()?;
        }
        self.places.push(pixel);
        self.values.push(value);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Error> {
        self.canvas.put(&mut self.places, &self.values)?;
        self.places.clear();
        self.values.clear();
        Ok(())
    }
}
