//! An image in memory, and its PNG form. What is on it is left to others.

use rayon::prelude::*;

use super::Error;

/// An image of 8-bit RGB pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<u8>,
}

impl Image {
    /// A white image.
    pub(super) fn new(width: usize, height: usize) -> Self {
        Image { width, height, rgb: vec![255; 3 * width * height] }
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Red, green and blue of every pixel, row by row from the top left.
    pub fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// The bytes of a PNG file.
    ///
    /// # Errors
    /// [`Error::Png`] if encoding fails.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// The image reduced `by` times, each pixel the mean of `by` × `by`. Width and height are multiples of `by`.
    pub(super) fn reduced(&self, by: usize) -> Image {
        let mut small = Image::new(self.width / by, self.height / by);
        small.rgb.par_chunks_mut(3 * small.width).enumerate().for_each(|(y, row)| {
            for (i, byte) in row.iter_mut().enumerate() {
                let (x, channel) = (i / 3, i % 3);
                let at = |k: usize| self.rgb[3 * ((y * by + k / by) * self.width + x * by + k % by) + channel];
                let sum: usize = (0..by * by).map(|k| usize::from(at(k))).sum();
                *byte = ((sum + by * by / 2) / (by * by)) as u8;
            }
        });
        small
    }

    /// Puts another image, which must fit, with its top left corner at (x, y).
    pub(super) fn put(&mut self, other: &Image, x: usize, y: usize) {
        for (i, row) in other.rgb.chunks(3 * other.width).enumerate() {
            let start = 3 * ((y + i) * self.width + x);
            self.rgb[start..start + row.len()].copy_from_slice(row);
        }
    }
}
