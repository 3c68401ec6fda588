//! Maps under construction, whatever the ordering of their file.
//!
//! Which values a file has is left to its adapter.

use rayon::prelude::*;

use crate::{Error, Healpix, Ordering};

/// Values to handle at once: many enough that calls cost nothing, few enough to stay in the cache.
pub(crate) const CHUNK: usize = 1 << 17;

/// A map under construction: values come in the file's ordering and are put where RING order has them.
pub(crate) struct Canvas {
    pub(crate) grid: Healpix,
    pub(crate) ordering: Ordering,
    /// In RING order.
    pub(crate) values: Vec<f64>,
}

impl Canvas {
    /// A map with all pixels masked.
    pub(crate) fn new(grid: Healpix, ordering: Ordering) -> Result<Self, Error> {
        let mut canvas = Canvas::reserved(grid, ordering)?;
        canvas.values.resize(grid.pixels(), f64::NAN);
        Ok(canvas)
    }

    /// A map without any pixels yet, and the memory for all of them.
    pub(crate) fn reserved(grid: Healpix, ordering: Ordering) -> Result<Self, Error> {
        let mut values = Vec::new();
        values.try_reserve_exact(grid.pixels()).map_err(|_| Error::Memory {
            nside: grid.nside(),
            gibibytes: grid.pixels() as f64 * 8.0 / f64::from(1 << 30),
        })?;
        Ok(Canvas { grid, ordering, values })
    }

    /// Sets some pixels, named by `places` in the file's ordering, which this overwrites.
    pub(crate) fn put(&mut self, places: &mut [u64], values: &[f64]) -> Result<(), Error> {
        if self.ordering == Ordering::Nested {
            let layer = cdshealpix::nested::get(self.grid.depth()?);
            places.par_iter_mut().for_each(|p| *p = layer.to_ring(*p));
        }
        for (&place, &value) in places.iter().zip(values) {
            self.values[place as usize] = value;
        }
        Ok(())
    }
}
