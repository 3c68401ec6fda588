//! Shape on the sphere: Minkowski functionals and tensors of a field, in moving windows.
//!
//! A few lines do what `longan map` does:
//!
//! ```
//! use longan::{Analysis, ThresholdUnit, go_on, measures::find};
//! use ndarray::Array1;
//!
//! // Any field in RING order; here a body of one pixel at Nside 8.
//! let mut field = Array1::zeros(768);
//! field[400] = 1.0;
//! let analysis = Analysis {
//!     windows: vec![20.0],
//!     thresholds: "0.5".parse()?,
//!     threshold_unit: ThresholdUnit::Value,
//!     ..Analysis::default()
//! };
//! let maps = analysis.minkowski_maps(&field, &[find("w2")?, find("evq")?], go_on)?;
//! // The contour's total curvature in a window that holds all of it: 2π less the body's area.
//! assert!((maps["w2"][400] - std::f64::consts::TAU).abs() < 0.02);
//! assert!(maps["evq"][400] > 1.0 && maps["evq"][0].is_nan());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The way of a field: [`Map`] → [`contour`] in the [`cells`] of the dual grid → [`moments`] at
//! pixels, by [`transport`] → moments of [`window`]s, or [`totals`] → [`measures`] → output.
//! [`Analysis`] brings these together. No module here prints or knows a file or a
//! picture.
//!
//! Angles are in degrees in [`Analysis`], [`simulate`] and the measures, in radians below; lengths and areas on the
//! unit sphere, in radians and steradian.

mod analysis;
mod angles;
pub mod cells;
pub mod compare;
pub mod contour;
mod contour_lines;
pub mod gaussian;
pub mod graph;
mod minkowski_maps;
pub mod moments;
pub mod quantile;
mod recipe;
pub mod region;
pub mod simulate;
pub mod smoothing;
pub mod statistics;
pub mod thresholds;
pub mod totals;
pub mod transport;
pub mod window;

pub use analysis::{Analysis, AnalysisError, DEFAULT_NSIDE_OUT, ThresholdUnit};
pub use contour::Body;
pub use contour_lines::contour_lines;
pub use longan_grid as grid;
pub use longan_grid::{Healpix, Map};
pub use longan_measures as measures;
pub use minkowski_maps::{Block, MinkowskiMaps};
pub use moments::Weight;
pub use recipe::{FieldRecipe, MeasureRecipe, REVISION, Recipe};
pub use region::Region;
pub use thresholds::Thresholds;
pub use window::go_on;
