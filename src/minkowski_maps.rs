//! The results of an analysis: arrays with names.

use std::ops::Index;

use longan_grid::Healpix;
use longan_measures::usual;
use ndarray::{Array2, ArrayView1};

use crate::statistics::Statistics;
use crate::thresholds::Thresholds;
use crate::window::SummationCounts;

/// Minkowski maps of one field: a [`Block`] for each window, and, where thresholds are kept by themselves, for each
/// threshold of each window.
#[derive(Clone, Debug)]
pub struct MinkowskiMaps {
    /// The grid of the maps.
    pub grid: Healpix,
    /// Statistics of the field analysed.
    pub of_map: Statistics,
    /// Window by window, the thresholds of each in ascending order.
    pub blocks: Vec<Block>,
}

/// Minkowski maps of one field in windows of one radius.
#[derive(Clone, Debug)]
pub struct Block {
    /// Radius of the window in degrees.
    pub window: f64,
    /// The thresholds, in the field's unit, of which the values are the mean.
    pub thresholds: Thresholds,
    /// Names of the measures, in the order of the rows of [`values`](Self::values).
    pub measures: Vec<String>,
    /// Measure × pixel of the grid in RING order; NaN where masked or undefined.
    pub values: Array2<f64>,
    /// Number of windows of which too large a share is masked; all measures are undefined there.
    pub masked: usize,
    /// How windows were summed.
    pub counts: SummationCounts,
}

impl MinkowskiMaps {
    /// The block of a window in degrees; where thresholds are kept by themselves, that of the lowest.
    pub fn window(&self, window: f64) -> Option<&Block> {
        self.blocks.iter().find(|block| block.window == window)
    }

    /// The block of a window in degrees at one threshold in the field's unit, where thresholds are kept by themselves.
    pub fn threshold(&self, window: f64, threshold: f64) -> Option<&Block> {
        self.blocks.iter().find(|block| block.window == window && block.thresholds.values() == [threshold])
    }

    /// The values of a measure in the first block, which is the only one for one window; in RING order.
    pub fn get(&self, measure: &str) -> Option<ArrayView1<'_, f64>> {
        self.blocks.first()?.get(measure)
    }
}

impl Block {
    /// The values of a measure in RING order. Its name may be written as for [`find`](longan_measures::find).
    pub fn get(&self, measure: &str) -> Option<ArrayView1<'_, f64>> {
        let row = self.measures.iter().position(|name| usual(name) == usual(measure))?;
        Some(self.values.row(row))
    }

    /// The mean of a measure, named by its row, over some pixels of the grid where it is defined, and their number; NaN
    /// where there are none.
    pub fn mean(&self, row: usize, pixels: &[bool]) -> (f64, usize) {
        let row = self.values.row(row);
        let defined = row.iter().zip(pixels).filter(|(value, within)| **within && !value.is_nan());
        let (sum, windows) = defined.fold((0.0, 0), |(sum, n), (value, _)| (sum + value, n + 1));
        (sum / windows as f64, windows)
    }
}

impl Index<&str> for MinkowskiMaps {
    type Output = [f64];

    /// The values of a measure in the first block; see [`get`](Self::get).
    ///
    /// # Panics
    /// Where there is no such measure.
    fn index(&self, measure: &str) -> &[f64] {
        &self.blocks[0][measure]
    }
}

impl Index<&str> for Block {
    type Output = [f64];

    /// The values of a measure; see [`get`](Self::get).
    ///
    /// # Panics
    /// Where there is no such measure.
    fn index(&self, measure: &str) -> &[f64] {
        let values = self.get(measure).and_then(|values| values.to_slice());
        values.unwrap_or_else(|| panic!("no measure '{measure}' was asked for"))
    }
}
