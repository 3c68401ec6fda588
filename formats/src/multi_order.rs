//! Maps whose cells have several sizes, brought to one grid.
//!
//! Cells are named by UNIQ numbers (CF: nuniq), 4^(order + 1) + NESTED pixel number (Fernique et al. 2014, MOC 1.0), or
//! by their place along the NESTED tree (CF: zuniq). They are sorted along the tree, so that overlaps show between
//! neighbours, and each pixel of the grid is made in passing; nothing is ever held at a finer resolution than that of
//! the grid. The way in which a file holds cells is left to its adapter.

use rayon::prelude::*;

use crate::error::{Ask, Error, ErrorKind, Reason};
use longan_grid::accumulate::{Accumulator, CHUNK};
use longan_grid::{Healpix, Ordering};

/// The finest order of HEALPix, and so of UNIQ numbers.
const ORDER_MAX: u32 = 29;

/// The finest Nside that a map is brought to without being asked for: 6 GiB.
const UNASKED_MAX: usize = 8192;

/// A resolution that a multi-order map cannot be brought to.
#[derive(Debug, thiserror::Error)]
#[error("a multi-order map can be brought to an Nside that is a power of two, from 1 to 2^29, not to {nside}")]
struct Resolution {
    nside: usize,
}

impl Reason for Resolution {
    fn kind(&self) -> ErrorKind {
        ErrorKind::OutOfRange
    }

    fn ask(&self) -> Option<Ask> {
        Some(Ask::Nside)
    }
}

/// The reason why cells make no map. The sentence is the adapter's, who knows where the cells are.
pub(crate) enum Problem {
    /// Two cells, by their UNIQ numbers, share an area.
    Overlap { first: u64, second: u64 },
    /// The finest cells have a finer Nside than is used without being asked for.
    TooFine { finest: usize, limit: usize },
    /// Any other problem, which is a sentence already.
    Other(Error),
}

impl From<Error> for Problem {
    fn from(error: Error) -> Self {
        Problem::Other(error)
    }
}

impl From<longan_grid::Error> for Problem {
    fn from(error: longan_grid::Error) -> Self {
        Problem::Other(error.into())
    }
}

/// One cell and its value.
#[derive(Clone, Copy)]
pub(crate) struct Cell {
    /// (2 pixel + 1) 4^(29 − order), which sorts cells along the tree and holds pixel and order.
    pub(crate) place: u64,
    pub(crate) value: f64,
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

/// The place along the tree of the cell of this UNIQ number, if there is such a cell.
pub(crate) fn place_of_uniq(uniq: i128) -> Option<u64> {
    let uniq = u64::try_from(uniq).ok().filter(|&uniq| uniq >= 4)?;
    let order = uniq.ilog2() / 2 - 1;
    // Orders follow each other without gaps, so any pixel number is one of this order.
    let pixel = uniq - (1 << (2 * (order + 1)));
    (order <= ORDER_MAX).then(|| (2 * pixel + 1) << (2 * (ORDER_MAX - order)))
}

/// The place along the tree of the cell of this zuniq number, which is the same, if there is such a cell.
pub(crate) fn place_of_zuniq(zuniq: i128) -> Option<u64> {
    let place = u64::try_from(zuniq).ok().filter(|&place| place > 0)?;
    let finer = place.trailing_zeros();
    let order = ORDER_MAX.checked_sub(finer / 2).filter(|_| finer.is_multiple_of(2))?;
    (place >> (finer + 1) < 12 << (2 * order)).then_some(place)
}

/// Nside of the finest of the cells at these places along the tree, 1 where there are none.
pub(crate) fn finest(places: impl Iterator<Item = u64>) -> usize {
    1 << places.map(|place| Cell { place, value: 0.0 }.order()).max().unwrap_or(0)
}

/// Brings cells to the resolution asked for, else to that of the finest of them.
///
/// A pixel gets the mean over the cells in it, weighted by their area and without those that are masked; a pixel
/// within a cell gets the cell's value.
pub(crate) fn gather(mut cells: Vec<Cell>, nside: Option<usize>) -> Result<Accumulator, Problem> {
    cells.par_sort_unstable_by_key(|cell| cell.place);
    for pair in cells.windows(2) {
        if pair[0].span().1 > pair[1].span().0 {
            return Err(Problem::Overlap { first: pair[0].uniq(), second: pair[1].uniq() });
        }
    }

    let finest = finest(cells.iter().map(|cell| cell.place));
    let grid = match nside {
        Some(nside) => {
            Healpix::new(nside).ok().filter(|grid| grid.has_nested()).ok_or(Error::from(Resolution { nside }))?
        }
        None if finest > UNASKED_MAX => return Err(Problem::TooFine { finest, limit: UNASKED_MAX }),
        None => Healpix::new(finest)?,
    };
    let depth = u32::from(grid.depth()?);
    let mut canvas = Accumulator::new(grid, Ordering::Nested)?;
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
    canvas: &'a mut Accumulator,
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
