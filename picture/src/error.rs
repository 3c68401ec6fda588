//! What can be wrong with a picture.

use crate::limits::{GNOMONIC_SIZES, LIMIT, WIDTHS};

/// What can be wrong with a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number of values that no grid has.
    #[error("{pixels} values are not a HEALPix map: no Nside has 12 Nside² = {pixels} pixels")]
    PixelCount {
        /// The number of values.
        pixels: usize,
    },
    /// A colour range that is empty, reversed or without bounds.
    #[error("the colour range {low:e} to {high:e} must go upwards within ±{:e}", LIMIT)]
    Range {
        /// The lower end.
        low: f64,
        /// The upper end.
        high: f64,
    },
    /// A logarithmic colour range that reaches zero.
    #[error("the colour range begins at {low:e}, but a logarithmic one must begin above 0")]
    LogRange {
        /// The lower end.
        low: f64,
    },
    /// Logarithms of nothing.
    #[error("no value that is seen is above 0, so there are no logarithms to draw; draw it without")]
    NothingPositive,
    /// A colour map that is not known.
    #[error("there is no colour map '{}'; there are {}", name.escape_debug(), known.join(", "))]
    Colours {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: Vec<&'static str>,
    },
    /// A width outside [`WIDTHS`](crate::WIDTHS).
    #[error("a width of {width} pixels is not between {} and {}", WIDTHS.start(), WIDTHS.end())]
    Width {
        /// The width given.
        width: usize,
    },
    /// A size that no picture can have.
    #[error("a picture of {width} × {height} pixels cannot be made")]
    Size {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
    /// A centre that is not on the sphere.
    #[error("the centre {longitude},{latitude} is not a longitude within ±360 degrees and a latitude within ±90")]
    Centre {
        /// The longitude.
        longitude: f64,
        /// The latitude.
        latitude: f64,
    },
    /// A side of a gnomonic picture outside [`GNOMONIC_SIZES`](crate::projection::GNOMONIC_SIZES).
    #[error(
        "a gnomonic picture of {size} degrees is not between {} and {} degrees wide",
        GNOMONIC_SIZES.start(), GNOMONIC_SIZES.end()
    )]
    GnomonicSize {
        /// The side in degrees.
        size: f64,
    },
    /// A place to mark that is not on the sphere.
    #[error("the place {longitude},{latitude} is not a longitude and a latitude within ±90 degrees")]
    Place {
        /// The longitude.
        longitude: f64,
        /// The latitude.
        latitude: f64,
    },
    /// A circle's radius that is none.
    #[error("a circle's radius of {radius} degrees is not above 0 and below 180")]
    Radius {
        /// The radius in degrees.
        radius: f64,
    },
    /// Directions that no turn keeps.
    #[error("directions need a symmetry of at least 1")]
    Symmetry,
    /// No panel to draw.
    #[error("there is no panel to draw")]
    NoPanels,
    /// The drawing library failed.
    #[error("could not draw the picture")]
    Draw(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The PNG encoder failed.
    #[error("could not encode the picture as PNG")]
    Png(#[from] png::EncodingError),
}
