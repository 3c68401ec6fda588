//! The coloured map as an image: which values are seen, and their colours.
//!
//! Only what is seen of a map is looked at, so a map of any size is drawn in the time that its picture takes.

use longan_formats::Healpix;
use rayon::prelude::*;

use super::Image;
use super::panel::Place;
use super::scale::Scale;

/// Each pixel of the image is the mean of this many times as many samples, along and across, so that the map's pixels
/// and its edge are smooth.
const SUPERSAMPLING: usize = 3;

/// Values that the colour range is found from, about.
const SEEN: usize = 1 << 20;

/// A map's grid and its values in RING order.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    pub(super) grid: Healpix,
    pub(super) values: &'a [f64],
}

impl Field<'_> {
    fn at(&self, (theta, phi): (f64, f64)) -> f64 {
        self.values[self.grid.pixel_at(theta, phi)]
    }
}

/// Values that are seen, evenly over the picture.
pub(super) fn seen(field: Field<'_>, place: &Place<'_>) -> Vec<f64> {
    let (width, height) = place.pixels();
    let step = (width * height).div_ceil(SEEN).isqrt().max(1);
    let rows: Vec<usize> = (0..height).step_by(step).collect();
    let row = |y: usize| (0..width).step_by(step).filter_map(move |x| place.sphere(x as f64 + 0.5, y as f64 + 0.5));
    rows.into_par_iter().flat_map_iter(|y| row(y).map(|at| field.at(at))).collect()
}

/// The map in colours; white outside.
pub(super) fn coloured(field: Field<'_>, place: &Place<'_>, scale: &Scale) -> Image {
    let (width, height) = place.pixels();
    let mut image = Image::new(width, height);
    let steps: Vec<f64> = (0..SUPERSAMPLING).map(|i| (i as f64 + 0.5) / SUPERSAMPLING as f64).collect();
    image.rgb.par_chunks_mut(3 * width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.chunks_mut(3).enumerate() {
            let mut sum = [0u16; 3];
            for dy in &steps {
                for dx in &steps {
                    let colour = match place.sphere(x as f64 + dx, y as f64 + dy) {
                        Some(at) => scale.colour(field.at(at)),
                        None => [255; 3],
                    };
                    sum.iter_mut().zip(colour).for_each(|(sum, channel)| *sum += u16::from(channel));
                }
            }
            let samples = (SUPERSAMPLING * SUPERSAMPLING) as u16;
            pixel.iter_mut().zip(sum).for_each(|(channel, sum)| *channel = ((sum + samples / 2) / samples) as u8);
        }
    });
    image
}
