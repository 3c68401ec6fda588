//! Pictures of maps: the whole sphere in Mollweide's projection, with a title and a colour bar.
//!
//! A picture is made in memory as an [`Image`]; writing it to a file is left to the caller. Where a point of the sphere
//! goes is decided in [`projection`]; everything here works for any [`Projection`].

pub mod axes;
pub mod canvas;
pub mod chart;
pub mod cloud;
mod image;
pub mod projection;
mod scale;

use std::sync::LazyLock;

use longan_formats::Healpix;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};
use rayon::prelude::*;

use canvas::failed;
pub use image::Image;
pub use projection::{Mollweide, Projection};
use scale::{Scale, Ticks, superscript};

/// Widths of a panel that are drawn, in pixels.
pub const WIDTHS: std::ops::RangeInclusive<usize> = 200..=5000;

/// Everything is drawn this many times larger and then averaged, which smooths edges, lines and letters.
const SUPERSAMPLING: usize = 3;

const FONT: &str = "DejaVu Sans";
const INK: RGBColor = RGBColor(30, 30, 30);

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

/// The side on which east lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Orientation {
    /// East to the left, as the sky is seen from inside.
    #[default]
    EastLeft,
    /// East to the right, as on maps of the Earth.
    EastRight,
}

/// How a map is drawn.
#[derive(Clone, Debug)]
pub struct Options {
    /// Text above the map; may be empty.
    pub title: String,
    /// Text below the colour bar, the quantity and its unit; may be empty.
    pub label: String,
    /// The values at the ends of the colour bar; by default the 1st and 99th percentiles.
    pub range: Option<(f64, f64)>,
    /// The side on which east lies.
    pub orientation: Orientation,
    /// Width of the panel in pixels, within [`WIDTHS`]; its height follows.
    pub width: usize,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            title: String::new(),
            label: String::new(),
            range: None,
            orientation: Orientation::default(),
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

/// The map of the whole sphere in Mollweide's projection; see [`Panel`] for the values.
///
/// # Errors
/// [`Error::PixelCount`], [`Error::Range`] or [`Error::Width`] for unusable arguments; [`Error::Draw`] if drawing fails.
pub fn mollweide(values: &[f64], options: &Options) -> Result<Image, Error> {
    draw(&Mollweide, values, options)
}

/// Several maps in one image, in rows of `columns` (at least one) from the top left.
///
/// # Errors
/// Those of [`mollweide`], and [`Error::NoPanels`].
pub fn panels(panels: &[Panel<'_>], columns: usize) -> Result<Image, Error> {
    let images = panels.iter().map(|p| mollweide(p.values, &p.options)).collect::<Result<Vec<_>, _>>()?;
    let rows: Vec<&[Image]> = images.chunks(columns.max(1)).collect();
    let width = rows.iter().map(|row| row.iter().map(|i| i.width).sum()).max().ok_or(Error::NoPanels)?;
    let heights: Vec<usize> = rows.iter().map(|row| row.iter().map(|i| i.height).max().unwrap_or(0)).collect();
    let mut image = Image::new(width, heights.iter().sum());
    let mut y = 0;
    for (row, height) in rows.into_iter().zip(heights) {
        let mut x = 0;
        for panel in row {
            image.put(panel, x, y);
            x += panel.width;
        }
        y += height;
    }
    Ok(image)
}

/// The parts of a panel, in pixels of the enlarged drawing.
struct Layout {
    width: usize,
    height: usize,
    /// Size of the title's letters; the others are smaller by [`Layout::SMALL`].
    font: f64,
    title_baseline: f64,
    map: Frame,
    bar: Frame,
    ticks_baseline: f64,
    label_baseline: f64,
}

#[derive(Clone, Copy, Debug)]
struct Frame {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Layout {
    const SMALL: f64 = 0.85;

    fn new(projection: &dyn Projection, options: &Options) -> Self {
        let width = options.width * SUPERSAMPLING;
        let w = width as f64;
        let font = w / 42.0;
        let margin = 0.8 * font;
        let title_baseline = margin + font;
        let (a, b) = projection.half_extent();
        let map_top = if options.title.is_empty() { margin } else { title_baseline + margin };
        let map_width = w - 2.0 * margin;
        let map = Frame { left: margin, top: map_top, width: map_width, height: map_width * b / a };
        let bar =
            Frame { left: 0.22 * w, top: map.top + map.height + 1.1 * font, width: 0.56 * w, height: 0.75 * font };
        let ticks_baseline = bar.top + bar.height + 1.35 * font;
        let label_baseline = ticks_baseline + 1.4 * font;
        let bottom = if options.label.is_empty() { ticks_baseline } else { label_baseline } + margin;
        let height = (bottom / SUPERSAMPLING as f64).ceil() as usize * SUPERSAMPLING;
        Layout { width, height, font, title_baseline, map, bar, ticks_baseline, label_baseline }
    }
}

type Canvas<'a> = DrawingArea<BitMapBackend<'a>, plotters::coord::Shift>;

fn draw(projection: &dyn Projection, values: &[f64], options: &Options) -> Result<Image, Error> {
    if !WIDTHS.contains(&options.width) {
        return Err(Error::Width { width: options.width });
    }
    let grid = Healpix::with_pixels(values.len()).ok_or(Error::PixelCount { pixels: values.len() })?;
    let scale = Scale::new(values, options.range)?;
    let layout = Layout::new(projection, options);
    let mut image = Image::new(layout.width, layout.height);
    let place = Place { projection, frame: layout.map, mirrored: options.orientation == Orientation::EastLeft };
    paint_map(&mut image, &place, |theta, phi| scale.colour(values[grid.pixel_at(theta, phi)]));
    paint_bar(&mut image, layout.bar, &scale);
    {
        LazyLock::force(&FONT_REGISTERED);
        let size = (image.width as u32, image.height as u32);
        let canvas = BitMapBackend::with_buffer(&mut image.rgb, size).into_drawing_area();
        draw_lines(&canvas, &place, &layout)?;
        draw_scale(&canvas, &layout, &scale, &options.label)?;
        let middle = layout.width as f64 / 2.0;
        write(&canvas, &layout, &options.title, middle, layout.title_baseline, layout.font)?;
        canvas.present().map_err(failed)?;
    }
    Ok(image.reduced(SUPERSAMPLING))
}

/// Where a projection's plane lies in the drawing.
struct Place<'a> {
    projection: &'a dyn Projection,
    frame: Frame,
    mirrored: bool,
}

impl Place<'_> {
    fn sphere(&self, x: usize, y: usize) -> Option<(f64, f64)> {
        let (a, b) = self.projection.half_extent();
        let u = ((x as f64 + 0.5 - self.frame.left) / self.frame.width * 2.0 - 1.0) * a;
        let v = (1.0 - (y as f64 + 0.5 - self.frame.top) / self.frame.height * 2.0) * b;
        self.projection.inverse(if self.mirrored { -u } else { u }, v)
    }

    fn pixel(&self, (u, v): (f64, f64)) -> (i32, i32) {
        let (a, b) = self.projection.half_extent();
        let u = if self.mirrored { -u } else { u };
        let x = self.frame.left + (u / a + 1.0) / 2.0 * self.frame.width;
        let y = self.frame.top + (1.0 - v / b) / 2.0 * self.frame.height;
        (x.round() as i32, y.round() as i32)
    }
}

fn paint_map(image: &mut Image, place: &Place<'_>, colour: impl Fn(f64, f64) -> [u8; 3] + Sync) {
    image.rgb.par_chunks_mut(3 * image.width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.chunks_mut(3).enumerate() {
            if let Some((theta, phi)) = place.sphere(x, y) {
                pixel.copy_from_slice(&colour(theta, phi));
            }
        }
    });
}

fn paint_bar(image: &mut Image, bar: Frame, scale: &Scale) {
    for x in bar.left as usize..(bar.left + bar.width) as usize {
        let along = (x as f64 + 0.5 - bar.left) / bar.width;
        let colour = scale.colour(scale.low + (scale.high - scale.low) * along);
        for y in bar.top as usize..(bar.top + bar.height) as usize {
            let start = 3 * (y * image.width + x);
            image.rgb[start..start + 3].copy_from_slice(&colour);
        }
    }
}

/// The graticule, every 60° of longitude and 30° of latitude, and the outline.
fn draw_lines(canvas: &Canvas<'_>, place: &Place<'_>, layout: &Layout) -> Result<(), Error> {
    let thin = (layout.font / 25.0).max(1.0) as u32;
    let meridians = (-2..=2).map(|k| f64::from(60 * k)).map(|lon| {
        let points = (0..=180).map(|theta| (f64::from(theta), lon));
        points.collect::<Vec<_>>()
    });
    let parallels = (1..6).map(|k| f64::from(30 * k)).map(|theta| {
        let points = (-180..=180).map(|lon| (theta, f64::from(lon)));
        points.collect::<Vec<_>>()
    });
    for line in meridians.chain(parallels) {
        let at = |(theta, phi): (f64, f64)| place.projection.forward(theta.to_radians(), phi.to_radians());
        let points: Vec<_> = line.into_iter().map(|point| at(point).map(|p| place.pixel(p))).collect();
        let style = ShapeStyle { color: WHITE.mix(0.45), filled: false, stroke_width: thin };
        for shown in points.split(Option::is_none) {
            let shown: Vec<_> = shown.iter().flatten().copied().collect();
            canvas.draw(&PathElement::new(shown, style)).map_err(failed)?;
        }
    }
    let outline = place.projection.outline().into_iter().map(|p| place.pixel(p)).collect();
    draw_closed(canvas, outline, INK.stroke_width((2 * thin).max(SUPERSAMPLING as u32)))
}

/// A closed path. Its ends are joined by a second one, for a path that covers itself is left blank there.
fn draw_closed(canvas: &Canvas<'_>, mut points: Vec<(i32, i32)>, style: ShapeStyle) -> Result<(), Error> {
    let joint = vec![points[points.len() - 1], points[0], points[1]];
    points.push(points[0]);
    canvas.draw(&PathElement::new(points, style)).map_err(failed)?;
    canvas.draw(&PathElement::new(joint, style)).map_err(failed)
}

/// The colour bar's pointed ends, outline, ticks and texts.
fn draw_scale(canvas: &Canvas<'_>, layout: &Layout, scale: &Scale, label: &str) -> Result<(), Error> {
    let (bar, font) = (layout.bar, layout.font * Layout::SMALL);
    let (left, right) = (bar.left as i32, (bar.left + bar.width) as i32);
    let (top, bottom) = (bar.top as i32, (bar.top + bar.height) as i32);
    let (middle, point) = ((top + bottom) / 2, bar.height as i32);
    let rgb = |[r, g, b]: [u8; 3]| RGBColor(r, g, b);
    let mut outline = vec![(left, bottom)];
    if scale.below {
        let tip = (left - point, middle);
        outline.push(tip);
        let end = vec![(left, top), tip, (left, bottom)];
        canvas.draw(&Polygon::new(end, rgb(scale.colour(scale.low)).filled())).map_err(failed)?;
    }
    outline.extend([(left, top), (right, top)]);
    if scale.above {
        let tip = (right + point, middle);
        outline.push(tip);
        let end = vec![(right, top), tip, (right, bottom)];
        canvas.draw(&Polygon::new(end, rgb(scale.colour(scale.high)).filled())).map_err(failed)?;
    }
    outline.push((right, bottom));
    let line = INK.stroke_width((layout.font / 20.0).max(1.0) as u32);
    draw_closed(canvas, outline, line)?;

    let ticks = Ticks::fitting(scale, bar.width / (DIGIT * font));
    for (value, text) in ticks.values.iter().zip(&ticks.labels) {
        let x = bar.left + (value - scale.low) / (scale.high - scale.low) * bar.width;
        let end = bottom + (0.3 * font) as i32;
        canvas.draw(&PathElement::new(vec![(x as i32, bottom), (x as i32, end)], line)).map_err(failed)?;
        write(canvas, layout, text, x, layout.ticks_baseline, font)?;
    }
    if ticks.exponent != 0 {
        let factor = format!("× 10{}", superscript(ticks.exponent));
        write(canvas, layout, &factor, bar.left + bar.width + 3.0 * font, layout.ticks_baseline, font)?;
    }
    write(canvas, layout, label, layout.width as f64 / 2.0, layout.label_baseline, font)
}

/// Width of a digit in units of the font size.
const DIGIT: f64 = 0.55;

/// Writes a text centred on x, smaller where it would be wider than the map.
fn write(canvas: &Canvas<'_>, layout: &Layout, text: &str, x: f64, baseline: f64, font: f64) -> Result<(), Error> {
    let style = |font: f64| (FONT, font).into_font().color(&INK).pos(Pos::new(HPos::Center, VPos::Top));
    let (width, _) = canvas.estimate_text_size(text, &style(font)).map_err(failed)?;
    let font = font * (layout.map.width / f64::from(width.max(1))).min(1.0);
    // The top is half the font size above the baseline.
    let at = (x.round() as i32, (baseline - font / 2.0).round() as i32);
    canvas.draw(&Text::new(text, at, style(font))).map_err(failed)
}

/// Makes the font known to the drawing library, once.
static FONT_REGISTERED: LazyLock<()> = LazyLock::new(|| {
    let registered = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
    assert!(registered.is_ok(), "the font that comes with the program is valid");
});

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    fn options(width: usize) -> Options {
        Options { title: "A title".into(), label: "quantity / unit".into(), width, ..Options::default() }
    }

    /// The image's pixel at a point of the sphere, found through the layout.
    fn pixel(image: &Image, options: &Options, theta: f64, phi: f64) -> [u8; 3] {
        let mirrored = options.orientation == Orientation::EastLeft;
        let place = Place { projection: &Mollweide, frame: Layout::new(&Mollweide, options).map, mirrored };
        let (x, y) = place.pixel(Mollweide.forward(theta, phi).unwrap());
        let start = 3 * (y as usize / SUPERSAMPLING * image.width + x as usize / SUPERSAMPLING);
        image.rgb[start..start + 3].try_into().unwrap()
    }

    #[test]
    fn a_pixel_has_its_colour_at_its_place() {
        let grid = Healpix::new(8).unwrap();
        let (theta, phi) = grid.centre(grid.pixel_at(1.0, 0.8));
        let mut values = vec![0.0; grid.pixels()];
        values[grid.pixel_at(theta, phi)] = 1.0;
        values[grid.pixel_at(theta, phi + PI)] = f64::NAN;
        for orientation in [Orientation::EastLeft, Orientation::EastRight] {
            let options = Options { range: Some((0.0, 1.0)), orientation, ..options(600) };
            let image = mollweide(&values, &options).unwrap();
            let at = |theta, phi| pixel(&image, &options, theta, phi);
            let (none, full) = ([68, 1, 84], [253, 231, 37]);
            assert_eq!(at(theta, phi), full);
            assert_eq!(at(theta, phi - PI), scale::MASKED);
            for (theta, phi) in [(theta, -phi), (PI - theta, phi), (FRAC_PI_2 + 0.1, 0.1)] {
                assert_eq!(at(theta, phi), none);
            }
            // East is where it was asked to be, and nothing but paper lies outside the ellipse.
            let frame = Layout::new(&Mollweide, &options).map;
            let map = 3 * image.width * ((frame.top + frame.height) as usize / SUPERSAMPLING);
            let found = image.rgb[..map].chunks(3).enumerate().filter(|(_, rgb)| *rgb == full);
            let on_left: Vec<bool> = found.map(|(i, _)| i % image.width < image.width / 2).collect();
            assert!(on_left.len() > 100);
            assert!(on_left.into_iter().all(|left| left == (orientation == Orientation::EastLeft)));
            assert_eq!(image.rgb[3 * (frame.top as usize / SUPERSAMPLING * image.width)..][..3], [255; 3]);
        }
    }

    #[test]
    fn unusual_maps_are_drawn() {
        let nan = f64::NAN;
        for values in [vec![3.0; 12], vec![0.0; 48], vec![nan; 12], [vec![nan; 40], vec![-1e299; 8]].concat()] {
            let image = mollweide(&values, &options(200)).unwrap();
            assert_eq!(image.width(), 200);
            assert_eq!(image.rgb().len(), 3 * 200 * image.height());
        }
        let masked = mollweide(&[nan; 12], &options(200)).unwrap();
        assert_eq!(pixel(&masked, &options(200), 1.2, 0.5), scale::MASKED);
    }

    #[test]
    fn texts_stay_inside() {
        let texts = "WIDE TEXT ".repeat(12);
        let options = Options {
            title: texts.clone(),
            label: texts,
            range: Some((-1.000_000_2e-9, -1.000_000_1e-9)),
            ..options(300)
        };
        let image = mollweide(&[0.0; 12], &options).unwrap();
        let white = |x: usize, y: usize| image.rgb[3 * (y * image.width + x)..][..3] == [255; 3];
        assert!((0..image.height).all(|y| white(0, y) && white(image.width - 1, y)));
        assert!((0..image.width).all(|x| white(x, 0) && white(x, image.height - 1)));
        let top = Layout::new(&Mollweide, &options).map.top as usize / SUPERSAMPLING;
        assert!((0..image.width).any(|x| (0..top).any(|y| !white(x, y))));
    }

    #[test]
    fn unusable_arguments_are_named() {
        let draw = |pixels: usize, options: Options| mollweide(&vec![0.0; pixels], &options).map(|_| ());
        assert!(matches!(draw(13, options(300)), Err(Error::PixelCount { pixels: 13 })));
        assert!(matches!(draw(0, options(300)), Err(Error::PixelCount { pixels: 0 })));
        assert!(matches!(draw(12, options(199)), Err(Error::Width { width: 199 })));
        assert!(matches!(draw(12, Options { range: Some((1.0, 0.0)), ..options(300) }), Err(Error::Range { .. })));
        assert!(matches!(panels(&[], 1), Err(Error::NoPanels)));
    }

    #[test]
    fn panels_are_put_in_rows() {
        let panel =
            |value: f64, width| Panel { values: &[[0.0; 12], [1.0; 12]][value as usize], options: options(width) };
        let all = [panel(0.0, 300), panel(1.0, 200), panel(1.0, 200)];
        let one = |p: &Panel<'_>| mollweide(p.values, &p.options).unwrap();
        let [a, b, _] = all.each_ref().map(one);
        let image = panels(&all, 2).unwrap();
        assert_eq!((image.width, image.height), (500, a.height + b.height));
        let part = |x: usize, y: usize, like: &Image| {
            let rows = (y..y + like.height).flat_map(|y| &image.rgb[3 * (y * image.width + x)..][..3 * like.width]);
            rows.copied().collect::<Vec<u8>>()
        };
        assert_eq!(part(0, 0, &a), a.rgb);
        assert_eq!(part(300, 0, &b), b.rgb);
        assert_eq!(part(0, a.height, &b), b.rgb);
        // No columns means one.
        assert_eq!(panels(&all, 0).unwrap().height, a.height + 2 * b.height);
    }

    #[test]
    fn the_png_holds_the_image() {
        let image = mollweide(&[0.0; 12], &options(200)).unwrap();
        let bytes = image.png().unwrap();
        let mut reader = png::Decoder::new(bytes.as_slice()).read_info().unwrap();
        let mut decoded = vec![0; reader.output_buffer_size()];
        let info = reader.next_frame(&mut decoded).unwrap();
        assert_eq!((info.width, info.height as usize), (200, image.height));
        assert_eq!(decoded, image.rgb);
    }
}
