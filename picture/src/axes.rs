//! The look that charts share: a frame with ticks and labels, places within it, letters, colours and dashes.
//!
//! What is drawn into the frame is left to others.

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::FontTransform;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::Error;
use super::canvas::{Area, FONT, UNITS, failed};
use super::limits::LIMIT;
pub use super::pen::Frame;
use super::pen::INK;
use super::ticks::{Ticks, superscript};

/// Colours that people with any colour vision tell apart on white (Okabe & Ito 2008, without their yellow, which is too light).
pub const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

/// The place of black in the [`PALETTE`].
pub const BLACK: usize = 4;

/// Lines that guide the eye.
const GUIDE: RGBColor = RGBColor(225, 225, 225);

/// Size of tick labels in units of the letters' size.
pub const SMALL: f64 = 0.85;

/// Most ticks along an axis.
const MOST: usize = 6;

/// Share of a range that is left free at its ends.
const MARGIN: f64 = 0.05;

/// The values along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    /// All finite values, from the smallest to the largest; something around a single one.
    pub fn through(values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|v| v.is_finite()).map(|v| v.clamp(-LIMIT, LIMIT));
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        // Narrower ranges have no round numbers within.
        let narrow = high - low < 1e-12 * low.abs().max(high.abs()) || !(high - low).is_normal();
        let half = match low.abs().max(high.abs()) / 2.0 {
            half if half.is_normal() => half,
            _ => 0.5,
        };
        let (low, high) = if narrow { ((low - half).max(-LIMIT), (high + half).min(LIMIT)) } else { (low, high) };
        Axis { low, high, logarithmic: false }
    }

    /// The same with some room at both ends.
    pub fn around(values: impl IntoIterator<Item = f64>) -> Self {
        let Axis { low, high, .. } = Axis::through(values);
        let room = MARGIN * (high - low);
        Axis { low: (low - room).max(-LIMIT), high: (high + room).min(LIMIT), logarithmic: false }
    }

    /// Positive values in their logarithm.
    pub fn logarithmic(values: impl IntoIterator<Item = f64>) -> Self {
        let logarithms = values.into_iter().filter(|v| *v > 0.0).map(f64::log10);
        Axis { logarithmic: true, ..Axis::through(logarithms) }
    }

    /// Where a value lies, from 0 at the low end to 1 at the high one.
    fn share(&self, value: f64) -> f64 {
        let value = if self.logarithmic { value.log10() } else { value };
        (value - self.low) / (self.high - self.low)
    }

    /// Ticks as many as fit, by the room for letters of a label.
    fn ticks(&self, most: usize) -> Marks {
        if self.logarithmic {
            return self.decades(most);
        }
        let Ticks { values, labels, exponent } = Ticks::new(self.low, self.high, most);
        Marks { at: values.iter().map(|v| self.share(*v)).collect(), labels, exponent }
    }

    /// Powers of ten, and where there are few their multiples by 2 and 5.
    fn decades(&self, most: usize) -> Marks {
        let powers = self.low.floor() as i32..=self.high.ceil() as i32;
        let within = |x: f64| (-1e-9..=1.0 + 1e-9).contains(&((x - self.low) / (self.high - self.low)));
        let between = |factors: &[f64]| {
            let all = powers.clone().flat_map(|n| factors.iter().map(move |f| (n, *f)));
            all.filter(|(n, f)| within(f64::from(*n) + f.log10())).collect::<Vec<_>>()
        };
        let tens = between(&[1.0]);
        let few = between(&[1.0, 2.0, 5.0]);
        let chosen = if few.len() <= most { few } else { tens };
        let step = chosen.len().div_ceil(most).max(1);
        let plain = chosen.iter().all(|(n, _)| (-3..=4).contains(n));
        let label = |n: i32, f: f64| match (plain, f) {
            (true, _) => format!("{:.*}", (-n).max(0) as usize, f * 10f64.powi(n)),
            (false, 1.0) => format!("10{}", superscript(n)),
            (false, _) => format!("{f}·10{}", superscript(n)),
        };
        let kept = || chosen.iter().step_by(step);
        Marks {
            at: kept().map(|(n, f)| (f64::from(*n) + f.log10() - self.low) / (self.high - self.low)).collect(),
            labels: kept().map(|(n, f)| label(*n, *f)).collect(),
            exponent: 0,
        }
    }
}

/// Ticks along an axis.
#[derive(Clone, Debug, PartialEq)]
struct Marks {
    /// From 0 to 1.
    at: Vec<f64>,
    labels: Vec<String>,
    /// The power of ten that the labels leave out.
    exponent: i32,
}

/// A frame with its axes.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    /// The frame.
    pub frame: Frame,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// Size of letters in pixels.
    pub em: f64,
}

impl Axes {
    /// A place in units of the drawing; nothing for what is not finite or outside.
    pub fn at(&self, x: f64, y: f64) -> Option<(i32, i32)> {
        let (x, y) = (self.x.share(x), self.y.share(y));
        let within = |share: f64| (-1e-9..=1.0 + 1e-9).contains(&share);
        let Frame { left, top, width, height } = self.frame;
        (within(x) && within(y)).then(|| (units(left + x * width), units(top + (1.0 - y) * height)))
    }

    fn x_marks(&self) -> Marks {
        let room = self.frame.width / (self.em * SMALL * LETTER);
        let fits = |marks: &Marks| {
            let longest = marks.labels.iter().map(|label| label.chars().count()).max().unwrap_or(0);
            ((longest + 2) * marks.labels.len()) as f64 <= room
        };
        let mut all = (1..=MOST + 3).rev().map(|most| self.x.ticks(most));
        all.find(fits).unwrap_or_else(|| self.x.ticks(1))
    }

    fn y_marks(&self) -> Marks {
        let room = self.frame.height / (self.em * SMALL * LINE);
        self.y.ticks((room as usize).clamp(1, MOST))
    }

    /// The powers of ten that the labels of both axes leave out.
    pub fn exponents(&self) -> (i32, i32) {
        (self.x_marks().exponent, self.y_marks().exponent)
    }

    /// Width of the labels of the upward axis, with their distance from it, in pixels.
    ///
    /// # Errors
    /// Where letters cannot be measured.
    pub fn label_width(&self, area: &Area<'_>) -> Result<f64, Error> {
        let letters = Letters::new(self.em * SMALL);
        let widths = self.y_marks().labels.into_iter().map(|label| letters.width(area, &label));
        Ok(widths.collect::<Result<Vec<_>, _>>()?.into_iter().fold(0.0, f64::max) + TICK * self.em * 2.0)
    }

    /// By how much the labels below the frame may reach beyond its ends, in pixels.
    ///
    /// # Errors
    /// Where letters cannot be measured.
    pub fn label_overhang(&self, area: &Area<'_>) -> Result<f64, Error> {
        let letters = Letters::new(self.em * SMALL);
        let widths = self.x_marks().labels.into_iter().map(|label| letters.width(area, &label));
        Ok(widths.collect::<Result<Vec<_>, _>>()?.into_iter().fold(0.0, f64::max) / 2.0)
    }

    /// Height of the labels below the frame, with their distance from it, in pixels.
    pub fn label_height(&self) -> f64 {
        self.em * (SMALL * LINE + TICK)
    }

    /// Draws guides behind all that follows.
    ///
    /// # Errors
    /// Where drawing fails.
    pub fn draw_guides(&self, area: &Area<'_>) -> Result<(), Error> {
        let Frame { left, top, width, height } = self.frame;
        let line = GUIDE.stroke_width(stroke(self.em, 0.04));
        for share in self.y_marks().at {
            let y = units(top + (1.0 - share) * height);
            area.draw(&PathElement::new(vec![(units(left), y), (units(left + width), y)], line)).map_err(failed)?;
        }
        for share in self.x_marks().at {
            let x = units(left + share * width);
            area.draw(&PathElement::new(vec![(x, units(top)), (x, units(top + height))], line)).map_err(failed)?;
        }
        Ok(())
    }

    /// Draws the frame, ticks, and labels to the left and, if wanted, below.
    ///
    /// # Errors
    /// Where drawing fails.
    pub fn draw(&self, area: &Area<'_>, labels_below: bool) -> Result<(), Error> {
        let Frame { left, top, width, height } = self.frame;
        let (right, bottom) = (left + width, top + height);
        let line = INK.stroke_width(stroke(self.em, 0.05));
        // Once round and on, so that all corners are joined.
        let corners = [(left, top), (right, top), (right, bottom), (left, bottom), (left, top), (right, top)];
        let outline = corners.map(|(x, y)| (units(x), units(y))).to_vec();
        area.draw(&PathElement::new(outline, line)).map_err(failed)?;
        let letters = Letters::new(self.em * SMALL);
        let tick = TICK * self.em;
        let marks = self.y_marks();
        for (share, label) in marks.at.iter().zip(&marks.labels) {
            let y = top + (1.0 - share) * height;
            let path = vec![(units(left - tick), units(y)), (units(left), units(y))];
            area.draw(&PathElement::new(path, line)).map_err(failed)?;
            letters.write(area, label, (left - 1.6 * tick, y), HPos::Right)?;
        }
        let marks = self.x_marks();
        for (share, label) in marks.at.iter().zip(&marks.labels) {
            let x = left + share * width;
            let path = vec![(units(x), units(bottom)), (units(x), units(bottom + tick))];
            area.draw(&PathElement::new(path, line)).map_err(failed)?;
            if labels_below {
                letters.write(area, label, (x, bottom + tick + self.em * SMALL * LINE / 2.0), HPos::Center)?;
            }
        }
        Ok(())
    }
}

/// Length of a tick in units of the letters' size.
const TICK: f64 = 0.3;

/// Width of a digit and height of a line, in units of the letters' size.
const LETTER: f64 = 0.65;
const LINE: f64 = 1.3;

/// Whole units of the drawing.
pub fn units(pixels: f64) -> i32 {
    (pixels * f64::from(UNITS)).round() as i32
}

/// A line's width in units of the drawing, for one in units of the letters' size.
pub fn stroke(em: f64, width: f64) -> u32 {
    units(em * width).max(1) as u32
}

/// A name with its unit in brackets, and the power of ten that numbers leave out.
pub fn with_unit(name: &str, unit: &str, exponent: i32) -> String {
    let power = if exponent == 0 { String::new() } else { format!("10{}", superscript(exponent)) };
    match (unit, exponent) {
        ("", 0) => name.to_owned(),
        ("", _) | (_, 0) => format!("{name} [{power}{unit}]"),
        _ => format!("{name} [{power} {unit}]"),
    }
}

/// Letters of a size.
#[derive(Clone, Copy, Debug)]
pub struct Letters {
    size: f64,
}

impl Letters {
    /// Letters of a size in pixels.
    pub fn new(size: f64) -> Self {
        Letters { size }
    }

    fn style(&self, across: HPos) -> TextStyle<'static> {
        (FONT, units(self.size)).into_font().color(&INK).pos(Pos::new(across, VPos::Center))
    }

    /// Width of a text in pixels.
    ///
    /// # Errors
    /// Where the font fails.
    pub fn width(&self, area: &Area<'_>, text: &str) -> Result<f64, Error> {
        let (width, _) = area.estimate_text_size(text, &self.style(HPos::Left)).map_err(failed)?;
        Ok(f64::from(width) / f64::from(UNITS))
    }

    /// Writes a text, whose middle height is at a place.
    ///
    /// # Errors
    /// Where drawing fails.
    pub fn write(&self, area: &Area<'_>, text: &str, (x, y): (f64, f64), across: HPos) -> Result<(), Error> {
        area.draw(&Text::new(text.to_owned(), (units(x), units(y)), self.style(across))).map_err(failed)
    }

    /// Writes a text upwards, centred on a place.
    ///
    /// # Errors
    /// Where drawing fails.
    pub fn write_upwards(&self, area: &Area<'_>, text: &str, (x, y): (f64, f64)) -> Result<(), Error> {
        let style = self.style(HPos::Center).transform(FontTransform::Rotate270);
        area.draw(&Text::new(text.to_owned(), (units(x), units(y)), style)).map_err(failed)
    }

    /// A text that is no wider than so many pixels: its middle is left out where it has to be.
    ///
    /// # Errors
    /// Where the font fails.
    pub fn shortened(&self, area: &Area<'_>, text: &str, width: f64) -> Result<String, Error> {
        let letters: Vec<char> = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
        let of = |kept: usize| -> String {
            if kept >= letters.len() {
                return letters.iter().collect();
            }
            let (start, end) = (kept.div_ceil(2), kept / 2);
            letters[..start].iter().chain(&['…']).chain(&letters[letters.len() - end..]).collect()
        };
        // The most letters that fit.
        let (mut fits, mut beyond) = (0, letters.len() + 1);
        while beyond - fits > 1 {
            let middle = (fits + beyond) / 2;
            if self.width(area, &of(middle))? <= width { fits = middle } else { beyond = middle }
        }
        Ok(of(fits))
    }
}

/// A line through places, broken into dashes if wanted. A single place is a dot.
///
/// # Errors
/// Where drawing fails.
pub fn line(area: &Area<'_>, path: Vec<(i32, i32)>, em: f64, colour: RGBColor, dashed: bool) -> Result<(), Error> {
    let style = colour.stroke_width(stroke(em, if dashed { 0.08 } else { 0.1 }));
    match path.len() {
        0 => Ok(()),
        1 => dot(area, path[0], em, colour),
        _ if dashed => {
            let (dash, gap) = (stroke(em, 0.35), stroke(em, 0.25));
            area.draw(&DashedPathElement::new(path, dash, gap, style)).map_err(failed)
        }
        _ => area.draw(&PathElement::new(path, style)).map_err(failed),
    }
}

/// A dot.
///
/// # Errors
/// Where drawing fails.
pub fn dot(area: &Area<'_>, at: (i32, i32), em: f64, colour: RGBColor) -> Result<(), Error> {
    area.draw(&Circle::new(at, units(0.17 * em), colour.filled())).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_range_has_ticks_within() {
        for magnitude in [0.0, 1e-320, 1e-300, 1e-20, 1.0, 7e4, 1e15, 1e300, f64::MAX] {
            for width in [0.0, 1e-15, 1e-9, 0.3, 2.0] {
                for sign in [-1.0, 1.0] {
                    let ends = [sign * magnitude, sign * magnitude + width * magnitude, f64::NAN, f64::INFINITY];
                    for axis in [Axis::through(ends), Axis::around(ends), Axis::logarithmic(ends)] {
                        assert!(axis.low < axis.high, "{ends:?}: {axis:?}");
                        for most in [1, 2, 6] {
                            let marks = axis.ticks(most);
                            assert!(marks.at.len() <= most && marks.at.len() == marks.labels.len());
                            assert!(marks.at.iter().all(|share| (-1e-6..=1.0 + 1e-6).contains(share)), "{marks:?}");
                        }
                    }
                }
            }
        }
        let labels = |axis: Axis, most: usize| axis.ticks(most).labels.join(" ");
        assert_eq!(labels(Axis::through([-4.0, 4.0]), 6), "−4 −2 0 2 4");
        assert_eq!(labels(Axis::logarithmic([0.1, 100.0]), 6), "0.1 1 10 100");
        assert_eq!(labels(Axis::logarithmic([1.0, 20.0]), 6), "1 2 5 10 20");
        assert_eq!(labels(Axis::logarithmic([1e-9, 1e3]), 6), "10⁻⁹ 10⁻⁶ 10⁻³ 10⁰ 10³");
    }

    #[test]
    fn units_and_powers_stand_in_brackets() {
        assert_eq!(with_unit("W₁", "rad/sr", 0), "W₁ [rad/sr]");
        assert_eq!(with_unit("W₁", "rad/sr", -5), "W₁ [10⁻⁵ rad/sr]");
        assert_eq!(with_unit("evq", "", 0), "evq");
        assert_eq!(with_unit("evq", "", 7), "evq [10⁷]");
    }
}
