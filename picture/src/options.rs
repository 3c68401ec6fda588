//! How a map is drawn, all in one place. What comes of it is left to the panel.

use crate::overlay::Overlays;
use crate::scale::Colouring;
use crate::view::View;

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
    /// Width of the panel in pixels, within [`WIDTHS`](crate::WIDTHS); its height follows.
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
