//! Data against simulations, pixel by pixel, and how surprising the largest deviation is anywhere.
//!
//! A [`Comparison`] reads all simulations twice, one after the other, in memory that does not grow with their number: the
//! [`first`](Comparison::first) pass gives mean, scatter and percentiles at each pixel, the
//! [`second`](Comparison::second) the largest deviation of each simulation from all other maps. The [`Outcome`] has the
//! data's [`Rank`] among these, and the [`Outlier`]s. What the maps are, and where they come from, is left to others.
//!
//! ```
//! use longan::compare::Comparison;
//!
//! // The twelve pixels of Nside 1; the data has a seven where simulations have 0, 1, 2, 3.
//! let mut data = vec![1.5; 12];
//! data[3] = 7.0;
//! let simulations: Vec<Vec<f64>> = (0..4).map(|i| (0..12).map(|p| f64::from((i + p) % 4)).collect()).collect();
//!
//! let mut comparison = Comparison::new(&data)?;
//! simulations.iter().try_for_each(|simulation| comparison.first(simulation))?;
//! simulations.iter().try_for_each(|simulation| comparison.second(simulation))?;
//! let outcome = comparison.finish()?;
//! let outliers = outcome.outliers(30.0, 3.0, 10);
//! assert_eq!((outliers.len(), outliers[0].peak.pixel, outliers[0].local_percentile), (1, 3, 100.0));
//! assert_eq!(outcome.rank.unwrap().p_value(), 0.2);
//! # Ok::<(), longan::compare::ComparisonError>(())
//! ```

use std::convert::Infallible;

mod comparison;
mod ensemble;
mod peaks;

pub use comparison::{Comparison, Outcome, Outlier};
pub use ensemble::{Deviation, Rank};
pub use peaks::{Peak, peaks};

/// Why maps cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ComparisonError {
    /// Data that is on no grid.
    #[error(transparent)]
    Grid(#[from] longan_grid::Error),
    /// A simulation on another grid.
    #[error("a simulation of {found} pixels cannot be compared with data of {expected}; bring both to the same Nside")]
    Pixels {
        /// Pixels of the simulation.
        found: usize,
        /// Pixels of the data.
        expected: usize,
    },
    /// Simulations too few for a standard deviation.
    #[error("a standard deviation needs at least two simulations, and there are {found}")]
    TooFew {
        /// Number of simulations.
        found: usize,
    },
    /// A simulation that comes to the first pass after the second has begun.
    #[error("a simulation came to the first pass after the second had begun; give all to the first pass before")]
    SecondBegan,
    /// Passes of different lengths.
    #[error("the first pass had {first} simulations and the second {second}; give the same to both")]
    Passes {
        /// Simulations of the first pass.
        first: usize,
        /// Simulations of the second pass, the one refused among them.
        second: usize,
    },
}

impl From<Infallible> for ComparisonError {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}
