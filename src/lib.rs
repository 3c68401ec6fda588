//! Shape on the sphere: Minkowski functionals and tensors of a field, in moving windows.
//!
//! A few lines do what `longan map` does:
//!
//! ```
//! use longan::{Analysis, Map, measures::find};
//!
//! // Any field in RING order; here a body of one pixel at Nside 8.
//! let mut values = vec![0.0; 768];
//! values[400] = 1.0;
//! let map = Map::new("a pixel", values)?;
//!
//! let analysis = Analysis {
//!     window: 20.0,
//!     thresholds: "0.5".parse()?,
//!     threshold_unit: longan::ThresholdUnit::Value,
//!     ..Analysis::default()
//! };
//! let maps = analysis.minkowski_maps(&map, &[find("w2")?, find("evq")?], |_| ())?;
//! let (w2, evq) = (&maps.values[0], &maps.values[1]);
//! // The contour's total curvature in a window that holds all of it: 2π less the body's area.
//! assert!((w2[400] - std::f64::consts::TAU).abs() < 0.02);
//! assert!(evq[400] > 1.0 && evq[0].is_nan());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The way of a field: [`formats`](longan_formats) → [`contour`] in the [`cells`] of the dual grid → [`moments`] at
//! pixels, by [`transport`] → moments of [`window`]s, or [`totals`] → [`measures`](longan_measures) → output.
//! [`Analysis`] brings these together. No module here prints or knows a path.
//!
//! Angles are in degrees in [`Analysis`], [`simulate`] and the measures, in radians below; lengths and areas on the
//! unit sphere, in radians and steradian.

mod analysis;
pub mod cells;
pub mod contour;
pub mod moments;
pub mod statistics;
pub mod thresholds;
pub mod totals;
pub mod transport;
pub mod window;

pub use analysis::{Analysis, AnalysisError, DEFAULT_NSIDE_OUT, MinkowskiMaps, ThresholdUnit};
pub use contour::Body;
pub use longan_formats as formats;
pub use longan_formats::{Healpix, Map};
pub use longan_measures as measures;
pub use moments::Weight;
pub use thresholds::Thresholds;
