//! Reasons why there is no graph of a map.

use longan_measures::CatalogueError;

use crate::analysis::AnalysisError;

/// Why there is no graph, or none of a map.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// No ordinate.
    #[error("no measure is asked for")]
    Nothing,
    /// A measure that does not exist.
    #[error(transparent)]
    Unknown(#[from] CatalogueError),
    /// An ordinate given twice.
    #[error("'{name}' is given twice")]
    Repeated {
        /// Its name.
        name: String,
    },
    /// A measure that is an angle.
    #[error(
        "directions count from the south of each place, so that a mean of them means nothing; take a formula such as 'x = psi2.re/psi0.re'"
    )]
    Direction {
        /// The measure.
        name: String,
    },
    /// A Gaussian expectation of means over windows.
    #[error("a Gaussian expectation is about w0, w1, w2 and euler, and none of these is asked for")]
    NoDensity,
    /// Windows of several radii.
    #[error("a graph has windows of one radius, and {count} are asked for")]
    Windows {
        /// Number of radii.
        count: usize,
    },
    /// A region in which all is masked.
    #[error("all that lies in the region is masked; choose another one")]
    Masked,
    /// A region without windows.
    #[error("no window's centre lies in the region; enlarge it, or choose a finer grid of windows")]
    NoWindow,
    /// A region without pixels.
    #[error("no pixel's centre lies in the region; enlarge it")]
    NoPixel,
    /// A map without the scales of a Gaussian field.
    #[error("the map has no scatter, or no two neighbouring pixels to find sigma1 of a Gaussian field from")]
    NoGaussian,
    /// An analysis that does not work out.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// Curves of another graph.
    #[error("curves of {found} cannot be set beside those of {expected}; make both by one graph")]
    Different {
        /// Ordinates and number of thresholds of these curves.
        found: String,
        /// Ordinates and number of thresholds of the others.
        expected: String,
    },
}

impl GraphError {
    /// Whether this map has nothing to measure, while another one under the same settings may have curves.
    pub fn is_of_map(&self) -> bool {
        match self {
            GraphError::Analysis(error) => {
                matches!(error, AnalysisError::AllMasked | AnalysisError::Constant { .. })
            }
            GraphError::Masked | GraphError::NoWindow | GraphError::NoPixel | GraphError::NoGaussian => true,
            _ => false,
        }
    }
}
