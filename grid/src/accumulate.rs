//! Maps under construction, whatever the ordering of their source.

use rayon::prelude::*;

use crate::map::reserved;
use crate::{Error, Healpix, Map, Ordering};

pub use crate::map::CHUNK;

/// A map under construction: values come in their source's ordering and are put where RING order has them.
#[derive(Debug)]
pub struct Accumulator {
    /// The grid.
    pub grid: Healpix,
    /// The ordering by which pixels are named.
    pub ordering: Ordering,
    /// Values in RING order, NaN where masked.
    pub values: Vec<f64>,
}

impl Accumulator {
    /// A map with all pixels masked.
    ///
    /// # Errors
    /// [`Error::Memory`] where there is not the memory for it.
    pub fn new(grid: Healpix, ordering: Ordering) -> Result<Self, Error> {
        let mut map = Accumulator::reserved(grid, ordering)?;
        map.values.resize(grid.pixels(), f64::NAN);
        Ok(map)
    }

    /// A map without any pixels yet, and the memory for all of them.
    ///
    /// # Errors
    /// [`Error::Memory`] where there is not the memory for it.
    pub fn reserved(grid: Healpix, ordering: Ordering) -> Result<Self, Error> {
        Ok(Accumulator { grid, ordering, values: reserved(grid)? })
    }

    /// Sets some pixels, named by `places` in the source's ordering, which this overwrites.
    ///
    /// # Errors
    /// [`Error::NotNested`] for NESTED numbers where Nside is not a power of two.
    ///
    /// # Panics
    /// Where a place is not a pixel of the grid.
    pub fn put(&mut self, places: &mut [u64], values: &[f64]) -> Result<(), Error> {
        if self.ordering == Ordering::Nested {
            let layer = cdshealpix::nested::get(self.grid.depth()?);
            places.par_iter_mut().for_each(|p| *p = layer.to_ring(*p));
        }
        for (&place, &value) in places.iter().zip(values) {
            self.values[place as usize] = value;
        }
        Ok(())
    }

    /// The map, which has no name yet. Every pixel must have been set, or be NaN.
    pub fn finish(self) -> Map {
        Map::from_masked(self.grid, self.values)
    }
}
