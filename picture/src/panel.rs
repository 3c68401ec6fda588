//! One map with all that belongs to it: where its parts lie, and the order in which they are drawn.

use longan_grid::Healpix;

use super::canvas::{Area, Placed};
use super::colour_bar::ColourBar;
use super::graticule::Graticule;
use super::pen::{Anchor, At, Frame, INK, LINE, Pen, Words, fitted};
use super::raster::{self, Field};
use super::scale::Scale;
use super::viewport::Viewport;
use super::{Error, Image, Options, WIDTHS};

/// The size of texts as a share of the width, of the title at its largest, and of both at their smallest. A picture
/// printed 85 mm wide has letters of 5.4 points at the smallest.
const TEXT: f64 = 1.0 / 40.0;
const TITLE: f64 = 1.0 / 32.0;
const SMALLEST: f64 = 1.0 / 44.0;

/// Lines of a title, and of the text below the colour bar, at most.
const TITLE_LINES: usize = 3;
const LABEL_LINES: usize = 2;

/// A panel of which the images are made and the lines are not.
pub(super) struct Prepared<'a> {
    options: &'a Options,
    /// Width and height in whole pixels.
    pub(super) size: (usize, usize),
    /// The size of texts.
    text: f64,
    title: (Vec<String>, f64),
    map: Frame,
    bar: ColourBar,
    scale: Scale,
    graticule: Option<Graticule>,
    images: [Image; 2],
}

impl<'a> Prepared<'a> {
    /// Checks all, lays it out and colours the map.
    pub(super) fn new(values: &[f64], options: &'a Options) -> Result<Self, Error> {
        if !WIDTHS.contains(&options.width) {
            return Err(Error::Width { width: options.width });
        }
        let grid = Healpix::with_pixels(values.len()).ok_or(Error::PixelCount { pixels: values.len() })?;
        options.overlays.check()?;
        let width = options.width as f64;
        let (text, smallest) = (TEXT * width, SMALLEST * width);
        let margin = 0.7 * text;
        let room = width - 2.0 * margin;
        let title = fitted(&options.title, room, (TITLE * width, smallest), TITLE_LINES);
        let (label, _) = fitted(&options.label, room, (text, text), LABEL_LINES);
        let graticule = options.graticule.then(|| Graticule::new(&options.view));
        let (left, below) = graticule.as_ref().map_or((0.0, 0.0), |graticule| graticule.room(smallest));
        let is_rectangle = options.view.projection().is_rectangle();
        let right = if is_rectangle { 0.8 * text } else { left };
        let map_left = (margin + left).round();
        let map_width = (width - margin - right).round() - map_left;
        let (a, b) = options.view.projection().half_extent();
        let title_height = if title.0.is_empty() { 0.0 } else { (title.0.len() as f64 * LINE + 0.3) * title.1 };
        let map = Frame {
            left: map_left,
            top: (margin + title_height).round(),
            width: map_width,
            height: (map_width * b / a).round(),
        };
        let bar = ColourBar::new(map.bottom() + below + 1.0 * text, width, text, label);
        let height = (bar.bottom() + 0.5 * margin).ceil() as usize;
        let place = Viewport { view: &options.view, frame: map, panel: width };
        let field = Field { grid, values };
        let scale = Scale::new(&raster::seen(field, &place), &options.colouring)?;
        let images = [raster::coloured(field, &place, &scale), bar.image(&scale)];
        let size = (options.width, height);
        Ok(Prepared { options, size, text, title, map, bar, scale, graticule, images })
    }

    /// Where the map lies.
    pub(super) fn place(&self) -> Viewport<'_> {
        Viewport { view: &self.options.view, frame: self.map, panel: self.size.0 as f64 }
    }

    /// Which colours values have.
    #[cfg(test)]
    pub(super) fn scale(&self) -> &Scale {
        &self.scale
    }

    /// The images, for a panel that begins `at`.
    pub(super) fn images(&self, at: At) -> [Placed<'_>; 2] {
        let placed = |image, frame: Frame| Placed {
            image,
            x: at.0 + frame.left,
            y: at.1 + frame.top,
            width: frame.width,
            height: frame.height,
        };
        [placed(&self.images[0], self.map), placed(&self.images[1], self.bar.frame)]
    }

    /// Draws all that lies on the images.
    pub(super) fn draw(&self, area: &Area<'_>, at: At) -> Result<(), Error> {
        let pen = Pen { area, at };
        let view = &self.options.view;
        let place = self.place();
        let (edge, width) = (0.3 * self.text, self.size.0 as f64);
        let top = 0.7 * self.text + self.title.0.len() as f64 * LINE * self.title.1;
        let sheet = Frame { left: edge, top, width: width - 2.0 * edge, height: self.bar.frame.top - top };
        let (title, size) = &self.title;
        for (i, line) in title.iter().enumerate() {
            let baseline = 0.7 * self.text + (0.8 + i as f64 * LINE) * size;
            let at = (self.size.0 as f64 / 2.0, baseline);
            pen.words(&Words { text: line.clone(), at, anchor: Anchor::Middle, size: *size })?;
        }
        if let Some(graticule) = &self.graticule {
            graticule.draw_lines(&pen, &place, self.text)?;
        }
        self.options.overlays.draw(&pen, &place, self.text)?;
        for outline in view.projection().outline() {
            pen.outline(&place.all(&outline), INK, self.text / 14.0)?;
        }
        let mut taken = self.options.overlays.draw_names(&pen, &place, self.text, &sheet)?;
        if let Some(graticule) = &self.graticule {
            graticule.draw_names(&pen, &place, SMALLEST * self.size.0 as f64, &sheet, &mut taken)?;
        }
        self.bar.draw(&pen, &self.scale)
    }
}
