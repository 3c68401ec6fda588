//! A drawing in the making, and its SVG and PNG forms.
//!
//! plotters draws, always as SVG; a PNG is that SVG, drawn by resvg, so that both show the same. Coordinates are whole
//! [`UNITS`] to a pixel, for lines finer than pixels. What is drawn is left to others.

use std::sync::{Arc, LazyLock};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};
use resvg::{tiny_skia, usvg};

use super::{Error, Image};

/// Units of the drawing in a pixel of the PNG, which is a `px` of the SVG.
pub const UNITS: i32 = 10;

/// The font of all texts, and what viewers of an SVG without it take in its place.
pub const FONT: &str = "DejaVu Sans, Verdana, Arial, sans-serif";

/// What plotters draws on; its coordinates are in [`UNITS`].
pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A finished drawing.
#[derive(Clone, Debug)]
pub struct Drawing {
    width: u32,
    height: u32,
    svg: String,
}

/// An image below all lines, with its top left corner and its size in pixels of the drawing.
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    /// The image; white is what shows where nothing is drawn.
    pub image: &'a Image,
    /// Distance from the left.
    pub x: f64,
    /// Distance from the top.
    pub y: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Drawing {
    /// A drawing of a size in pixels: white, then images, then what `draw` puts on them.
    ///
    /// # Errors
    /// Those of `draw`, and of encoding images.
    pub fn new(
        (width, height): (u32, u32),
        images: &[Placed<'_>],
        draw: impl FnOnce(&Area<'_>) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        LazyLock::force(&REGISTERED);
        let units = (width * UNITS as u32, height * UNITS as u32);
        let mut lines = String::new();
        let area = SVGBackend::with_string(&mut lines, units).into_drawing_area();
        draw(&area)?;
        area.present().map_err(failed)?;
        drop(area);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
            units.0, units.1
        );
        for placed in images {
            let [x, y, width, height] =
                [placed.x, placed.y, placed.width, placed.height].map(|pixels| pixels * f64::from(UNITS));
            let png = BASE64_STANDARD.encode(placed.image.png()?);
            svg += &format!(
                "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" \
                 href=\"data:image/png;base64,{png}\"/>\n"
            );
        }
        svg += &lines;
        svg += "</svg>\n";
        Ok(Drawing { width, height, svg })
    }

    /// The text of an SVG file.
    pub fn svg(&self) -> &str {
        &self.svg
    }

    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// [`Error::Draw`] if the SVG cannot be drawn, [`Error::Png`] if encoding fails.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let options = usvg::Options { fontdb: FONTS.clone(), ..usvg::Options::default() };
        let tree = usvg::Tree::from_str(&self.svg, &options).map_err(failed)?;
        let mut pixels = tiny_skia::Pixmap::new(self.width, self.height)
            .ok_or(Error::Size { width: self.width as usize, height: self.height as usize })?;
        resvg::render(&tree, tiny_skia::Transform::identity(), &mut pixels.as_mut());
        // Everything lies on white, so that nothing is transparent.
        let rgb = pixels.data().chunks_exact(4).flat_map(|rgba| &rgba[..3]).copied().collect();
        Image { width: self.width as usize, height: self.height as usize, rgb }.png()
    }
}

/// Makes the font known to plotters, which measures texts with it, once.
pub(super) static REGISTERED: LazyLock<()> = LazyLock::new(|| {
    let registered = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
    assert!(registered.is_ok(), "the built-in font is a font");
});

/// The fonts that PNGs are written with.
static FONTS: LazyLock<Arc<usvg::fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    Arc::new(fonts)
});

/// An error of the drawing libraries.
pub(super) fn failed(error: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::Draw(Box::new(error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_png_shows_what_the_svg_says() {
        let mut image = Image::new(2, 1);
        image.rgb.copy_from_slice(&[255, 0, 0, 0, 0, 255]);
        let placed = Placed { image: &image, x: 10.0, y: 5.0, width: 2.0, height: 1.0 };
        let drawing = Drawing::new((40, 20), &[placed], |area| {
            let units = |pixels: i32| pixels * UNITS;
            let bar = Rectangle::new([(units(20), units(2)), (units(30), units(8))], BLACK.filled());
            area.draw(&bar).map_err(failed)?;
            area.draw(&Text::new("<M> & ψ₂", (units(2), units(10)), (FONT, units(8)).into_font())).map_err(failed)
        })
        .unwrap();
        assert!(drawing.svg().starts_with("<svg ") && drawing.svg().contains("&lt;M&gt; &amp; ψ₂"));
        let png = drawing.png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        assert_eq!((info.width, info.height), (40, 20));
        let at = |x: usize, y: usize| &rgb[3 * (40 * y + x)..][..3];
        assert_eq!(at(10, 5), [255, 0, 0]);
        assert_eq!(at(11, 5), [0, 0, 255]);
        assert_eq!(at(12, 5), [255; 3]);
        assert_eq!(at(25, 5), [0; 3]);
        assert_eq!(at(31, 5), [255; 3]);
        // The text is there.
        assert!((2..20).any(|x| (10..19).any(|y| at(x, y)[0] < 128)));
    }
}
