//! Lines, areas and texts in pixels, on a canvas whose coordinates are finer. What they mean is left to others.

use std::sync::LazyLock;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::Error;
use super::canvas::{self, Area, FONT, UNITS, failed};

/// The colour of texts and outlines.
pub(super) const INK: RGBColor = RGBColor(30, 30, 30);

/// The SVG that plotters writes has letters smaller than asked for by this factor.
const SHRUNK: f64 = 1.24;

/// Height of a line of text in units of its size, from one baseline to the next.
pub(super) const LINE: f64 = 1.25;

/// How letters reach above the baseline, and below, in units of their size.
const ASCENT: f64 = 0.76;
const DESCENT: f64 = 0.24;

/// A place on the drawing, in pixels.
pub(super) type At = (f64, f64);

/// A rectangle in pixels of the drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Distance from the left.
    pub left: f64,
    /// Distance from the top.
    pub top: f64,
    /// Width.
    pub width: f64,
    /// Height.
    pub height: f64,
}

impl Frame {
    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    pub(super) fn corners(&self) -> [At; 4] {
        let (left, right, top, bottom) = (self.left, self.right(), self.top, self.bottom());
        [(left, top), (right, top), (right, bottom), (left, bottom)]
    }

    /// Points along its upper and lower side.
    pub(super) fn rim(&self) -> [At; 10] {
        let along = |i: usize| self.left + self.width * (i % 5) as f64 / 4.0;
        std::array::from_fn(|i| (along(i), if i < 5 { self.top } else { self.bottom() }))
    }

    /// The rectangle with this much more to the left and to the right.
    pub(super) fn wider(&self, by: f64) -> Frame {
        Frame { left: self.left - by, width: self.width + 2.0 * by, ..*self }
    }

    pub(super) fn overlaps(&self, other: &Frame) -> bool {
        self.left < other.right() && other.left < self.right() && self.top < other.bottom() && other.top < self.bottom()
    }

    pub(super) fn holds(&self, other: &Frame) -> bool {
        self.left <= other.left
            && self.top <= other.top
            && self.right() >= other.right()
            && self.bottom() >= other.bottom()
    }
}

/// Which part of a text is where it is put.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Left,
    Middle,
    Right,
}

/// A text, its place on the baseline, and its size.
#[derive(Clone, Debug)]
pub(super) struct Words {
    pub(super) text: String,
    pub(super) at: At,
    pub(super) anchor: Anchor,
    pub(super) size: f64,
}

impl Words {
    /// The room that it takes.
    pub(super) fn frame(&self) -> Frame {
        let width = width(&self.text, self.size);
        let left = match self.anchor {
            Anchor::Left => self.at.0,
            Anchor::Middle => self.at.0 - width / 2.0,
            Anchor::Right => self.at.0 - width,
        };
        let top = self.at.1 - ASCENT * self.size;
        Frame { left, top, width, height: (ASCENT + DESCENT) * self.size }
    }
}

/// A pen on a part of the drawing that begins `at`.
pub(super) struct Pen<'a, 'b> {
    pub(super) area: &'a Area<'b>,
    pub(super) at: At,
}

impl Pen<'_, '_> {
    fn units(&self, (x, y): At) -> (i32, i32) {
        let units = |pixels: f64| (pixels * f64::from(UNITS)).round() as i32;
        (units(self.at.0 + x), units(self.at.1 + y))
    }

    /// A line through points, this wide.
    pub(super) fn line(&self, points: &[At], colour: impl Color, width: f64) -> Result<(), Error> {
        let points: Vec<_> = points.iter().map(|&at| self.units(at)).collect();
        let width = (width * f64::from(UNITS)).round().max(1.0) as u32;
        self.area.draw(&PathElement::new(points, colour.stroke_width(width))).map_err(failed)
    }

    /// The line around an area.
    pub(super) fn outline(&self, points: &[At], colour: impl Color, width: f64) -> Result<(), Error> {
        // On past the start, so that the corner there is like the others.
        let closed: Vec<At> = points.iter().chain(&points[..2.min(points.len())]).copied().collect();
        self.line(&closed, colour, width)
    }

    /// An area in one colour.
    pub(super) fn fill(&self, points: &[At], colour: impl Color) -> Result<(), Error> {
        let points: Vec<_> = points.iter().map(|&at| self.units(at)).collect();
        self.area.draw(&Polygon::new(points, colour.filled())).map_err(failed)
    }

    /// A disc with an outline.
    pub(super) fn disc(&self, at: At, radius: f64, fill: impl Color, width: f64) -> Result<(), Error> {
        let units = |pixels: f64| (pixels * f64::from(UNITS)).round().max(1.0) as u32;
        let circle = |style| Circle::new(self.units(at), units(radius), style);
        self.area.draw(&circle(fill.filled())).map_err(failed)?;
        self.area.draw(&circle(INK.stroke_width(units(width)))).map_err(failed)
    }

    /// A text.
    pub(super) fn words(&self, words: &Words) -> Result<(), Error> {
        self.coloured(words, words.at, INK.to_rgba())
    }

    /// A text with a light seam, to be read on any colour.
    pub(super) fn words_on_map(&self, words: &Words) -> Result<(), Error> {
        let seam = 0.11 * words.size;
        for k in 0..8 {
            let (sin, cos) = (std::f64::consts::FRAC_PI_4 * f64::from(k)).sin_cos();
            self.coloured(words, (words.at.0 + seam * cos, words.at.1 + seam * sin), WHITE.mix(0.75))?;
        }
        self.words(words)
    }

    fn coloured(&self, words: &Words, at: At, colour: RGBAColor) -> Result<(), Error> {
        if words.text.is_empty() {
            return Ok(());
        }
        let horizontal = match words.anchor {
            Anchor::Left => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::Right => HPos::Right,
        };
        let size = words.size * SHRUNK * f64::from(UNITS);
        // The SVG has the top of a text this far above its baseline.
        let top = (at.0, at.1 - ASCENT * words.size);
        let style = (FONT, size).into_font().color(&colour).pos(Pos::new(horizontal, VPos::Top));
        self.area.draw(&Text::new(words.text.as_str(), self.units(top), style)).map_err(failed)
    }
}

/// Width of a text.
pub(super) fn width(text: &str, size: f64) -> f64 {
    LazyLock::force(&canvas::REGISTERED);
    /// The size that texts are measured at, and the font's height, which plotters takes for its size, in units of it.
    const MEASURED: f64 = 1000.0;
    const HEIGHT: f64 = 1.164;
    let measured = (FONT, MEASURED).into_font().box_size(text).map_or(0, |(width, _)| width);
    f64::from(measured) / MEASURED * HEIGHT * size
}

/// A text on at most `lines` lines within a width: as large as it fits, down to the smaller size, then broken, then cut.
pub(super) fn fitted(text: &str, within: f64, sizes: (f64, f64), lines: usize) -> (Vec<String>, f64) {
    // Texts are of one line each; what has no form is not drawn.
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.trim().is_empty() {
        return (Vec::new(), sizes.0);
    }
    let size = sizes.0 * (within / width(&text, sizes.0)).min(1.0);
    if size >= sizes.1 {
        return (vec![text], size);
    }
    let size = sizes.1;
    let fits = |text: &str| width(text, size) <= within;
    let mut all: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match all.last_mut() {
            Some(line) if fits(&format!("{line} {word}")) => *line = format!("{line} {word}"),
            _ => {
                // A word longer than a line is broken where the line ends.
                let mut part = String::new();
                for c in word.chars() {
                    if !part.is_empty() && !fits(&format!("{part}{c}")) {
                        all.push(std::mem::take(&mut part));
                    }
                    part.push(c);
                    if all.len() > lines {
                        break;
                    }
                }
                all.push(part);
            }
        }
        if all.len() > lines {
            break;
        }
    }
    if all.len() > lines {
        all.truncate(lines);
        if let Some(last) = all.last_mut() {
            while !last.is_empty() && !fits(&format!("{last}…")) {
                last.pop();
            }
            last.push('…');
        }
    }
    (all, size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_measured() {
        // The advances of DejaVu Sans are 0.636 for a digit, 0.838 for a minus sign.
        assert!((width("1234567890", 10.0) - 63.6).abs() < 0.5, "{}", width("1234567890", 10.0));
        assert!((width("−", 100.0) - 83.8).abs() < 1.0);
    }

    #[test]
    fn long_texts_shrink_then_break_then_end() {
        let fits = |lines: &[String], size: f64| lines.iter().all(|line| width(line, size) <= 200.5);
        let (lines, size) = fitted("short", 200.0, (20.0, 12.0), 2);
        assert_eq!((lines.as_slice(), size), (["short".to_owned()].as_slice(), 20.0));
        let (lines, size) = fitted("somewhat longer than short", 200.0, (20.0, 12.0), 2);
        assert!(lines.len() == 1 && size < 20.0 && fits(&lines, size), "{lines:?} {size}");
        let (lines, size) = fitted("a text that is too long for a single line", 200.0, (20.0, 12.0), 2);
        assert!(lines.len() == 2 && size == 12.0 && fits(&lines, size), "{lines:?}");
        let (lines, size) = fitted(&"a_word_without_end".repeat(400), 200.0, (20.0, 12.0), 3);
        assert!(lines.len() == 3 && lines[2].ends_with('…') && fits(&lines, size), "{lines:?}");
        assert!(fitted(" \n", 200.0, (20.0, 12.0), 3).0.is_empty());
    }
}
