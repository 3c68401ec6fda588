//! The colour bar: its image, its ends, ticks and texts, and the swatch of masked pixels.
//!
//! Which value has which colour is left to [`scale`](super::scale), which are named to [`ticks`](super::ticks).

use plotters::style::RGBColor;

use super::pen::{Anchor, Frame, INK, LINE, Pen, Words};
use super::scale::{MASKED, Scale};
use super::ticks::{Ticks, superscript};
use super::{Error, Image};

/// Width of a digit in units of the size of text.
const DIGIT: f64 = 0.64;

/// Where a colour bar and its texts are.
#[derive(Debug)]
pub(super) struct ColourBar {
    /// The bar without its pointed ends, in whole pixels.
    pub(super) frame: Frame,
    /// The size of its texts.
    size: f64,
    label: Vec<String>,
}

impl ColourBar {
    /// A bar below `top` for a panel of this width, with its texts of this size.
    pub(super) fn new(top: f64, width: f64, size: f64, label: Vec<String>) -> Self {
        let frame =
            Frame { left: (0.2 * width).round(), top: top.round(), width: (0.6 * width).round(), height: size.round() };
        ColourBar { frame, size, label }
    }

    fn ticks_baseline(&self) -> f64 {
        self.frame.bottom() + 1.25 * self.size
    }

    /// Where all of it ends.
    pub(super) fn bottom(&self) -> f64 {
        self.ticks_baseline() + (self.label.len() as f64 * LINE + 0.25) * self.size
    }

    /// The colours.
    pub(super) fn image(&self, scale: &Scale) -> Image {
        let (width, height) = (self.frame.width as usize, self.frame.height as usize);
        let mut image = Image::new(width, height);
        let colour = |x: usize| scale.colour_at((x as f64 + 0.5) / width as f64);
        let row: Vec<u8> = (0..width).flat_map(colour).collect();
        image.rgb.chunks_mut(row.len()).for_each(|line| line.copy_from_slice(&row));
        image
    }

    /// All but the colours.
    pub(super) fn draw(&self, pen: &Pen<'_, '_>, scale: &Scale) -> Result<(), Error> {
        let (bar, size) = (self.frame, self.size);
        let line = size / 16.0;
        let rgb = |[r, g, b]: [u8; 3]| RGBColor(r, g, b);
        let middle = bar.top + bar.height / 2.0;
        let mut outline = vec![(bar.left, bar.bottom())];
        let (low, high) = ((bar.left - 0.9 * bar.height, middle), (bar.right() + 0.9 * bar.height, middle));
        if scale.below {
            outline.push(low);
            pen.fill(&[(bar.left, bar.top), low, (bar.left, bar.bottom())], rgb(scale.colour_at(0.0)))?;
        }
        outline.extend([(bar.left, bar.top), (bar.right(), bar.top)]);
        if scale.above {
            outline.push(high);
            pen.fill(&[(bar.right(), bar.top), high, (bar.right(), bar.bottom())], rgb(scale.colour_at(1.0)))?;
        }
        outline.push((bar.right(), bar.bottom()));
        pen.outline(&outline, INK, line)?;

        let text = |text: String, x: f64, baseline: f64| {
            pen.words(&Words { text, at: (x, baseline), anchor: Anchor::Middle, size })
        };
        let ticks = Ticks::fitting(scale, bar.width / (DIGIT * size));
        for (value, label) in ticks.values.iter().zip(ticks.labels) {
            let x = bar.left + scale.place(*value).clamp(0.0, 1.0) * bar.width;
            let length = if label.is_empty() { 0.15 } else { 0.28 } * size;
            pen.line(&[(x, bar.bottom()), (x, bar.bottom() + length)], INK, line)?;
            text(label, x, self.ticks_baseline())?;
        }
        if ticks.exponent != 0 {
            let at = (bar.right() + 1.6 * size, self.ticks_baseline());
            let text = format!("× 10{}", superscript(ticks.exponent));
            pen.words(&Words { text, at, anchor: Anchor::Left, size })?;
        }
        for (i, label) in self.label.iter().enumerate() {
            let baseline = self.ticks_baseline() + (i + 1) as f64 * LINE * size;
            text(label.clone(), bar.left + bar.width / 2.0, baseline)?;
        }
        if scale.masked {
            let x = bar.left / 2.0 - 0.4 * bar.height;
            let swatch = Frame { left: x - bar.height, width: 2.0 * bar.height, ..bar };
            pen.fill(&swatch.corners(), rgb(MASKED))?;
            pen.outline(&swatch.corners(), INK, line)?;
            text("masked".to_owned(), x, self.ticks_baseline())?;
        }
        Ok(())
    }
}
