//! Placeholder.
pub mod cells;
pub mod contour;
pub mod totals;
pub mod moments;
pub mod thresholds;
pub mod window;
pub mod transport;
