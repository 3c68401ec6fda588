//! Data against simulations, pixel by pixel, and how surprising the largest deviation is anywhere.
//!
//! [`Ensemble`] takes one simulation after the other, in memory that does not grow with their number; a second reading
//! gives the largest deviation of each, for a [`Rank`]. [`peaks`] are the places that deviate most. What the maps are,
//! and where they come from, is left to others.

mod ensemble;
mod peaks;

pub use ensemble::{Deviation, Ensemble, Rank};
pub use peaks::{Peak, peaks};

/// Why maps cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A simulation on another grid.
    #[error("a simulation of {found} pixels cannot be compared with data of {expected}; bring both to the same Nside")]
    Pixels {
        /// Pixels of the simulation.
        found: usize,
        /// Pixels of the data.
        expected: usize,
    },
}
