//! Pictures of maps: the sphere in a projection, with a title, a graticule, a colour bar and overlays.
//!
//! A picture is a [`Drawing`], which has the text of an SVG file and the bytes of a PNG; writing them to a file is left
//! to the caller. Where a point of the sphere goes is decided in [`projection`] and [`view`]; everything else works for
//! any [`Projection`](projection::Projection).

pub mod canvas;
mod coastlines;
mod colour_bar;
mod colours;
pub mod contours;
mod graticule;
mod image;
mod overlay;
mod panel;
mod pen;
pub mod projection;
mod raster;
mod scale;
mod ticks;
pub mod view;

pub use canvas::Drawing;
pub use colours::Colours;
pub use image::Image;
pub use overlay::{Circle, Mark, Overlays, Rods};
pub use scale::{Colouring, Meaning};
pub use ticks::superscript;
pub use view::{Orientation, View};

use panel::Prepared;

/// Widths of a panel that are drawn, in pixels.
pub const WIDTHS: std::ops::RangeInclusive<usize> = 200..=5000;

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
    #[error("the colour range {low:e} to {high:e} must go upwards within ±{:e}", scale::LIMIT)]
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
    #[error("there is no colour map '{}'; there are {}", name.escape_debug(), names())]
    Colours {
        /// The name asked for.
        name: String,
    },
    /// A width outside [`WIDTHS`].
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
    /// A side of a gnomonic picture outside [`projection::GNOMONIC_SIZES`].
    #[error(
        "a gnomonic picture of {size} degrees is not between {} and {} degrees wide",
        projection::GNOMONIC_SIZES.start(), projection::GNOMONIC_SIZES.end()
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

/// The names of the colour maps.
fn names() -> String {
    Colours::ALL.map(|(_, name)| name).join(", ")
}

/// How a map is drawn.
#[derive(Clone, Debug)]
pub struct Options {
    /// Text above the map; may be empty.
    pub title: String,
    /// Text below the colour bar, the quantity and its unit; may be empty.
    pub label: String,
    /// Which colours values have.
    pub colouring: Colouring,
    /// What of the sphere lies where.
    pub view: View,
    /// Whether meridians and parallels are drawn and named.
    pub graticule: bool,
    /// What is drawn over the map.
    pub overlays: Overlays,
    /// Width of the panel in pixels, within [`WIDTHS`]; its height follows.
    pub width: usize,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            title: String::new(),
            label: String::new(),
            colouring: Colouring::default(),
            view: View::default(),
            graticule: true,
            overlays: Overlays::default(),
            width: 1600,
        }
    }
}

/// A map and how to draw it.
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    /// Values in RING order; NaN, ±Inf and UNSEEN are drawn as masked.
    pub values: &'a [f64],
    /// How to draw them.
    pub options: Options,
}

/// A picture of a map; see [`Panel`] for the values.
///
/// # Errors
/// What is wrong with the arguments; [`Error::Draw`] or [`Error::Png`] if drawing fails.
pub fn draw(values: &[f64], options: &Options) -> Result<Drawing, Error> {
    together(&[Prepared::new(values, options)?], 1)
}

/// Several maps in one picture, in rows of `columns` (at least one) from the top left.
///
/// # Errors
/// Those of [`draw`], and [`Error::NoPanels`].
pub fn panels(panels: &[Panel<'_>], columns: usize) -> Result<Drawing, Error> {
    let prepared =
        panels.iter().map(|panel| Prepared::new(panel.values, &panel.options)).collect::<Result<Vec<_>, _>>()?;
    together(&prepared, columns.max(1))
}

fn together(panels: &[Prepared<'_>], columns: usize) -> Result<Drawing, Error> {
    let (mut places, mut width, mut top) = (Vec::new(), 0, 0);
    for row in panels.chunks(columns) {
        let mut left = 0;
        for panel in row {
            places.push((left as f64, top as f64));
            left += panel.size.0;
        }
        width = width.max(left);
        top += row.iter().map(|panel| panel.size.1).max().unwrap_or(0);
    }
    if panels.is_empty() {
        return Err(Error::NoPanels);
    }
    let size = |pixels: usize| u32::try_from(pixels).map_err(|_| Error::Size { width, height: top });
    let images: Vec<_> = panels.iter().zip(&places).flat_map(|(panel, &at)| panel.images(at)).collect();
    Drawing::new((size(width)?, size(top)?), &images, |area| {
        panels.iter().zip(&places).try_for_each(|(panel, &at)| panel.draw(area, at))
    })
}
