//! Pictures of maps: the sphere in a projection, with a title, a graticule, a colour bar and overlays.
//!
//! A picture is a [`Drawing`], which has the text of an SVG file and the bytes of a PNG; writing them to a file is left
//! to the caller. Where a point of the sphere goes is decided in [`projection`] and [`view`]; everything else works for
//! any [`Projection`](projection::Projection).

pub mod axes;
pub mod canvas;
pub mod chart;
pub mod cloud;
mod coastlines;
mod colour_bar;
mod colours;
mod error;
mod graticule;
mod image;
mod limits;
mod options;
mod overlay;
mod panel;
mod pen;
pub mod projection;
mod raster;
mod scale;
mod ticks;
pub mod view;
mod viewport;

pub use canvas::Drawing;
pub use colours::Colours;
pub use error::Error;
pub use image::Image;
pub use limits::WIDTHS;
pub use options::Options;
pub use overlay::{Circle, Mark, Overlays, Rods};
pub use scale::{Colouring, Meaning};
pub use ticks::superscript;
pub use view::{Orientation, View};

use panel::Prepared;

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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::sync::Arc;

    use longan_grid::{Healpix, UNSEEN};

    use super::projection::{Equirectangular, Gnomonic, Hammer, Mollweide, Orthographic, Projection, vector};
    use super::scale::MASKED;
    use super::*;

    fn options(width: usize) -> Options {
        Options { title: "A title".into(), label: "quantity [unit]".into(), width, ..Options::default() }
    }

    fn image(drawing: &Drawing) -> Image {
        let png = drawing.png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        Image { width: info.width as usize, height: info.height as usize, rgb }
    }

    fn colour(image: &Image, (x, y): (f64, f64)) -> [u8; 3] {
        image.rgb[3 * (y as usize * image.width + x as usize)..][..3].try_into().unwrap()
    }

    fn projections() -> [Arc<dyn Projection>; 5] {
        let gnomonic = Arc::new(Gnomonic::new(110.0).unwrap());
        [Arc::new(Mollweide), Arc::new(Hammer), Arc::new(Orthographic), Arc::new(Equirectangular), gnomonic]
    }

    #[test]
    fn a_pixel_has_its_colour_at_its_place() {
        let grid = Healpix::new(8).unwrap();
        let (theta, phi) = grid.centre(grid.pixel_at(1.2, 0.3));
        let mut values = vec![0.0; grid.pixels()];
        values[grid.pixel_at(theta, phi)] = 1.0;
        values[grid.pixel_at(PI - theta, -phi)] = UNSEEN;
        for projection in projections() {
            for (longitude, orientation) in [(0.0, Orientation::EastLeft), (-20.0, Orientation::EastRight)] {
                let view = View::new(projection.clone(), (longitude, 10.0), orientation).unwrap();
                let colouring = Colouring { range: (Some(0.0), Some(1.0)), ..Colouring::default() };
                let options = Options { view, colouring, graticule: false, ..options(600) };
                let prepared = Prepared::new(&values, &options).unwrap();
                let image = image(&draw(&values, &options).unwrap());
                let at = |theta, phi| colour(&image, prepared.place().pixel(vector(theta, phi)).unwrap());
                assert_eq!(at(theta, phi), Colours::Viridis.at(1.0), "{projection:?}");
                assert_eq!(at(PI - theta, -phi), MASKED, "{projection:?}");
                assert_eq!(at(theta, -phi), Colours::Viridis.at(0.0), "{projection:?}");
                assert_eq!(colour(&image, (1.0, 1.0)), [255; 3]);
            }
        }
    }

    #[test]
    fn unusual_maps_are_drawn() {
        let nan = f64::NAN;
        for values in [vec![3.0; 12], vec![0.0; 48], vec![nan; 12], [vec![nan; 40], vec![-1e299; 8]].concat()] {
            for projection in projections() {
                for log in [false, true] {
                    let view = View::new(projection.clone(), (77.0, -90.0), Orientation::EastRight).unwrap();
                    let colouring = Colouring { log, ..Colouring::default() };
                    match draw(&values, &Options { view, colouring, ..options(200) }) {
                        Ok(drawing) => assert_eq!(image(&drawing).width(), 200),
                        Err(error) => assert!(log && matches!(error, Error::NothingPositive), "{error}"),
                    }
                }
            }
        }
    }

    #[test]
    fn texts_stay_inside() {
        let texts = "WIDE TEXT ".repeat(40);
        let marks =
            vec![Mark { at: (-179.0, 0.0), label: "A NAME".into() }, Mark { at: (179.0, 0.0), label: "B".into() }];
        let range = (Some(-1.000_000_2e-9), Some(-1.000_000_1e-9));
        for projection in projections() {
            let options = Options {
                title: texts.clone(),
                label: texts.clone(),
                colouring: Colouring { range, ..Colouring::default() },
                view: View::new(projection, (0.0, 33.0), Orientation::EastRight).unwrap(),
                overlays: Overlays { marks: marks.clone(), ..Overlays::default() },
                ..options(300)
            };
            let image = image(&draw(&[0.0; 12], &options).unwrap());
            let white = |x: usize, y: usize| image.rgb[3 * (y * image.width + x)..][..3] == [255; 3];
            assert!((0..image.height).all(|y| white(0, y) && white(image.width - 1, y)), "{:?}", options.view);
            assert!((0..image.width).all(|x| white(x, 0) && white(x, image.height - 1)), "{:?}", options.view);
        }
    }

    #[test]
    fn unusable_arguments_are_named() {
        let drawn = |pixels: usize, options: Options| draw(&vec![0.0; pixels], &options).map(|_| ());
        assert!(matches!(drawn(13, options(300)), Err(Error::PixelCount { pixels: 13 })));
        assert!(matches!(drawn(0, options(300)), Err(Error::PixelCount { pixels: 0 })));
        assert!(matches!(drawn(12, options(199)), Err(Error::Width { width: 199 })));
        let colouring = Colouring { range: (Some(1.0), Some(0.0)), ..Colouring::default() };
        assert!(matches!(drawn(12, Options { colouring, ..options(300) }), Err(Error::Range { .. })));
        assert!(matches!(panels(&[], 1), Err(Error::NoPanels)));
    }

    #[test]
    fn panels_are_put_in_rows() {
        let panel =
            |value: f64, width| Panel { values: &[[0.0; 12], [1.0; 12]][value as usize], options: options(width) };
        let all = [panel(0.0, 300), panel(1.0, 200), panel(1.0, 200)];
        let one = |p: &Panel<'_>| image(&draw(p.values, &p.options).unwrap());
        let [a, b, _] = all.each_ref().map(one);
        let together = image(&panels(&all, 2).unwrap());
        assert_eq!((together.width, together.height), (500, a.height + b.height));
        let part = |x: usize, y: usize, like: &Image| {
            let rows =
                (y..y + like.height).flat_map(|y| &together.rgb[3 * (y * together.width + x)..][..3 * like.width]);
            // Letters at another place may be off by rounding.
            rows.zip(&like.rgb).all(|(p, q)| p.abs_diff(*q) <= 8)
        };
        assert!(part(0, 0, &a) && part(300, 0, &b) && part(0, a.height, &b));
        // No columns means one.
        assert_eq!(image(&panels(&all, 0).unwrap()).height, a.height + 2 * b.height);
    }

    #[test]
    fn a_map_of_any_size_is_looked_at_only_where_it_is_seen() {
        // Of pixels about the other side nothing is known.
        let grid = Healpix::new(64).unwrap();
        let value = |p: usize| if grid.centre(p).1.cos() < 0.0 { 1e9 } else { 1.0 };
        let values: Vec<f64> = (0..grid.pixels()).map(value).collect();
        let gnomonic = Arc::new(Gnomonic::new(40.0).unwrap());
        let options = Options { view: View::new(gnomonic, (0.0, 0.0), Orientation::EastLeft).unwrap(), ..options(200) };
        let prepared = Prepared::new(&values, &options).unwrap();
        assert_eq!((prepared.scale().low, prepared.scale().high), (0.5, 1.5));
    }
}
