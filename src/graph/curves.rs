//! The curves of one map, as arrays.

use longan_measures::usual;
use ndarray::{Array1, Array2, ArrayView1};

use super::ordinate::Ordinate;
use crate::gaussian::Gaussian;
use crate::statistics::Statistics;

/// The curves of one map. Arrays of two dimensions are ordinate × threshold.
#[derive(Clone, Debug)]
pub struct Curves {
    /// The ordinates, one for each row.
    pub ordinates: Vec<Ordinate>,
    /// Thresholds in the unit of the map, ascending.
    pub thresholds: Array1<f64>,
    /// Thresholds in standard deviations from the mean of the map; NaN where the map has no scatter.
    pub sigmas: Array1<f64>,
    /// Values in the units of the ordinates; NaN where undefined.
    pub values: Array2<f64>,
    /// The number of windows that each value is the mean of; 0 for densities, which have none.
    pub windows: Array2<usize>,
    /// The expectation for an isotropic Gaussian field, where it is asked for; NaN for means over windows.
    pub expected: Option<Array2<f64>>,
    /// The scales of that field.
    pub gaussian: Option<Gaussian>,
    /// The unmasked area in steradian that densities are divided by, where there are densities.
    pub area: Option<f64>,
    /// Statistics of the map.
    pub statistics: Statistics,
}

/// One curve of a map.
#[derive(Clone, Copy, Debug)]
pub struct Curve<'a> {
    /// The ordinate.
    pub ordinate: &'a Ordinate,
    /// Values at the thresholds, in the unit of the ordinate; NaN where undefined.
    pub values: ArrayView1<'a, f64>,
    /// Numbers of windows behind the values; nothing for a density.
    pub windows: Option<ArrayView1<'a, usize>>,
    /// The expectation for an isotropic Gaussian field; nothing for a mean over windows, or where it is not asked for.
    pub expected: Option<ArrayView1<'a, f64>>,
}

impl Curves {
    /// The names of the ordinates.
    pub fn names(&self) -> impl Iterator<Item = String> {
        self.ordinates.iter().map(Ordinate::name)
    }

    /// The curve of the ordinate of this name, however it is typed.
    pub fn get(&self, name: &str) -> Option<Curve<'_>> {
        let row = self.names().position(|other| usual(&other) == usual(name))?;
        self.iter().nth(row)
    }

    /// All curves, in the order of the ordinates.
    pub fn iter(&self) -> impl Iterator<Item = Curve<'_>> {
        self.ordinates.iter().enumerate().map(|(row, ordinate)| {
            let is_density = matches!(ordinate, Ordinate::Density(_));
            Curve {
                ordinate,
                values: self.values.row(row),
                windows: (!is_density).then(|| self.windows.row(row)),
                expected: self.expected.as_ref().filter(|_| is_density).map(|expected| expected.row(row)),
            }
        })
    }
}
