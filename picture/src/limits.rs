//! What pictures keep to. Messages name these limits, and the parts of a picture hold them.

use std::ops::RangeInclusive;

/// Widths of a panel that are drawn, in pixels.
pub const WIDTHS: RangeInclusive<usize> = 200..=5000;

/// Sizes of [`Gnomonic`](crate::projection::Gnomonic), in degrees: beyond them its corners are stretched past use, or rounding shows.
pub const GNOMONIC_SIZES: RangeInclusive<f64> = 0.01..=120.0;

/// Largest magnitude of a colour range's ends, for which no sum or power of ten overflows.
pub(super) const LIMIT: f64 = 1e300;
