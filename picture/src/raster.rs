//! The coloured map as an image: which values are seen, and their colours.
//!
//! Only what is seen of a map is looked at, so a map of any size is drawn in the time that its picture takes.

use longan_grid::Healpix;
use rayon::prelude::*;

use super::Image;
use super::scale::Scale;
use super::viewport::Viewport;

/// A pixel of the image in which several of the map's meet, or its edge, is the mean of this many times as many samples,
/// along and across; where the map's pixels are the smaller ones, fewer do.
const SUPERSAMPLING: usize = 3;
const FINE_SUPERSAMPLING: usize = 2;

/// Rows of the image that are coloured together.
const ROWS: usize = 16;

/// Values that the colour range is found from, about.
const SEEN: usize = 1 << 18;

/// A map's grid and its values in RING order.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    pub(super) grid: Healpix,
    pub(super) values: &'a [f64],
}

/// The colour beside the map.
const PAPER: [u8; 3] = [255; 3];

/// Values that are seen, evenly over the picture.
pub(super) fn seen(field: Field<'_>, place: &Viewport<'_>) -> Vec<f64> {
    let (width, height) = place.pixels();
    let step = (width * height).div_ceil(SEEN).isqrt().max(1);
    let rows: Vec<usize> = (0..height).step_by(step).collect();
    let row = |y: usize| (0..width).step_by(step).filter_map(move |x| place.sphere(x as f64 + 0.5, y as f64 + 0.5));
    rows.into_par_iter()
        .flat_map_iter(|y| row(y).map(|(theta, phi)| field.values[field.grid.pixel_at(theta, phi)]))
        .collect()
}

/// The map in colours; white outside.
pub(super) fn coloured(field: Field<'_>, place: &Viewport<'_>, scale: &Scale) -> Image {
    let (width, height) = place.pixels();
    let mut image = Image::new(width, height);
    let pixel_at = |x: f64, y: f64| place.sphere(x, y).map(|(theta, phi)| field.grid.pixel_at(theta, phi));
    let colour = |pixel: Option<usize>| pixel.map_or(PAPER, |pixel| scale.colour(field.values[pixel]));
    let is_fine = field.grid.pixel_side() * place.scale() < 1.0;
    let samples = if is_fine { FINE_SUPERSAMPLING } else { SUPERSAMPLING };
    let steps: Vec<f64> = (0..samples).map(|i| (i as f64 + 0.5) / samples as f64).collect();
    let samples = (samples * samples) as u16;
    let mean = |x: usize, y: usize| {
        let mut sum = [0u16; 3];
        for (dx, dy) in steps.iter().flat_map(|dy| steps.iter().map(move |dx| (dx, dy))) {
            let colour = colour(pixel_at(x as f64 + dx, y as f64 + dy));
            sum.iter_mut().zip(colour).for_each(|(sum, channel)| *sum += u16::from(channel));
        }
        sum.map(|sum| ((sum + samples / 2) / samples) as u8)
    };
    // Fine pixels hardly ever fill one of the image, so nothing is asked of its corners.
    let corner = |x: usize, y: usize| if is_fine { None } else { pixel_at(x as f64, y as f64) };
    let corners = |y: usize| -> Vec<_> { (0..=width).map(|x| corner(x, y)).collect() };
    image.rgb.par_chunks_mut(3 * width * ROWS).enumerate().for_each(|(block, rows)| {
        let mut above = corners(block * ROWS);
        for (y, row) in (block * ROWS..).zip(rows.chunks_mut(3 * width)) {
            let below = corners(y + 1);
            for (x, out) in row.chunks_mut(3).enumerate() {
                let here = above[x];
                // Between four corners of one pixel there is nothing else.
                let is_one = here.is_some() && [above[x + 1], below[x], below[x + 1]].iter().all(|at| *at == here);
                out.copy_from_slice(&if is_one { colour(here) } else { mean(x, y) });
            }
            above = below;
        }
    });
    image
}
