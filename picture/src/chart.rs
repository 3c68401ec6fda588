//! Charts: curves over a common axis, one panel a quantity, with bands behind them and a legend above.
//!
//! What curves mean, and the texts about them, come from the caller. The look is that of [`axes`](super::axes).

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::Error;
use super::axes::{Axes, Axis, Frame, Letters, PALETTE, SMALL, dot, line, units, with_unit};
use super::canvas::{Area, Drawing, failed};
use super::pen::INK;

/// Width of a chart in pixels.
pub const WIDTH: u32 = 1600;

/// Letters to the width: at 85 mm, a column of a journal, they are 6.7 points high.
const LETTERS: f64 = 36.0;

/// Height of a panel in units of its width.
const ASPECT: f64 = 0.62;

/// Colours of a band and of one within it.
const BANDS: [RGBColor; 2] = [RGBColor(224, 224, 224), RGBColor(190, 190, 190)];

/// The axis that all panels share.
#[derive(Clone, Debug, Default)]
pub struct Shared {
    /// What it counts.
    pub name: String,
    /// In which unit; may be empty.
    pub unit: String,
    /// Whether it is logarithmic.
    pub logarithmic: bool,
}

/// Between which values most of an ensemble lies.
#[derive(Clone, Debug)]
pub struct Band {
    /// Place, lower end and upper end.
    pub ends: Vec<(f64, f64, f64)>,
    /// Whether it lies within another one, and is darker.
    pub inner: bool,
}

/// A line.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Its points; where a number is not finite it is interrupted.
    pub points: Vec<(f64, f64)>,
    /// Which of the [`PALETTE`].
    pub colour: usize,
    /// Whether it is dashed.
    pub dashed: bool,
    /// Points that are marked by dots.
    pub marked: Vec<usize>,
}

/// A quantity.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// What it is.
    pub name: String,
    /// In which unit; may be empty.
    pub unit: String,
    /// Bands, the wider first.
    pub bands: Vec<Band>,
    /// Curves, the last above all.
    pub curves: Vec<Curve>,
}

/// What stands for a thing in the legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// A line of this colour.
    Line(usize),
    /// A dashed line.
    Dashed,
    /// Both bands.
    Bands,
    /// A dot.
    Dot,
    /// Nothing: a text about all that is drawn.
    None,
}

/// A chart.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// The axis that all panels share.
    pub shared: Shared,
    /// Panels, in rows of two unless there is only one.
    pub panels: Vec<Panel>,
    /// What is said in the legend.
    pub legend: Vec<(Sample, String)>,
}

impl Chart {
    /// Draws it.
    ///
    /// # Errors
    /// [`Error::NoPanels`]; [`Error::Draw`] if drawing fails.
    pub fn draw(&self) -> Result<Drawing, Error> {
        if self.panels.is_empty() {
            return Err(Error::NoPanels);
        }
        let em = f64::from(WIDTH) / LETTERS;
        // How high a chart is depends on the widths of its texts, which a drawing can tell.
        let mut height = 0.0;
        Drawing::new((WIDTH, 1), &[], |area| {
            height = self.lay_out(area, em)?.height;
            Ok(())
        })?;
        Drawing::new((WIDTH, height.ceil() as u32), &[], |area| {
            let layout = self.lay_out(area, em)?;
            self.draw_legend(area, em, &layout)?;
            for (i, axes) in layout.axes.iter().enumerate() {
                self.draw_panel(area, i, axes, layout.lowest(i))?;
            }
            Ok(())
        })
    }

    fn lay_out(&self, area: &Area<'_>, em: f64) -> Result<Layout, Error> {
        let (legend, below_legend) = self.lay_out_legend(area, em)?;
        let count = self.panels.len();
        let columns = count.min(2);
        let column_width = (f64::from(WIDTH) - GAP * em) / columns as f64;
        let mut axes: Vec<Axes> = self.panels.iter().map(|panel| self.axes(panel, em)).collect();
        // Frames of a column are as wide as the widest labels there allow.
        let (mut left, mut right) = (vec![0.0; columns], 0.0);
        for (i, axes) in axes.iter_mut().enumerate() {
            axes.frame = Frame { width: column_width * 0.8, height: column_width * ASPECT * 0.8, ..axes.frame };
            let label = axes.label_width(area)?;
            left[i % columns] = f64::max(left[i % columns], label);
            right = f64::max(right, axes.label_overhang(area)?);
        }
        let widest = left.iter().copied().fold(0.0, f64::max);
        let mut top = below_legend;
        for row in 0..count.div_ceil(columns) {
            top += 1.7 * em;
            let height = (column_width - widest - right) * ASPECT;
            let mut below: f64 = 0.0;
            for i in row * columns..((row + 1) * columns).min(count) {
                let column = i % columns;
                let from = GAP * em + column as f64 * column_width;
                let width = column_width - left[column] - right;
                axes[i].frame = Frame { left: from + left[column], top, width, height };
                let lowest = i + columns >= count;
                below = below.max(if lowest { axes[i].label_height() + 1.5 * em } else { 0.4 * em });
            }
            top += height + below;
        }
        Ok(Layout { legend, axes, columns, height: top + 0.3 * em })
    }

    /// The axes of a panel, of which the frame is still to be found.
    fn axes(&self, panel: &Panel, em: f64) -> Axes {
        let all =
            || self.panels.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.points).map(|(x, _)| *x);
        let x = if self.shared.logarithmic { Axis::logarithmic(all()) } else { Axis::through(all()) };
        let curves = panel.curves.iter().flat_map(|curve| &curve.points).map(|(_, y)| *y);
        let bands = panel.bands.iter().flat_map(|band| &band.ends).flat_map(|(_, low, high)| [*low, *high]);
        let frame = Frame { left: 0.0, top: 0.0, width: 0.0, height: 0.0 };
        Axes { frame, x, y: Axis::around(curves.chain(bands)), em }
    }

    /// Where each entry of the legend begins, its text, and where the legend ends.
    fn lay_out_legend(&self, area: &Area<'_>, em: f64) -> Result<(Vec<Entry>, f64), Error> {
        let letters = Letters::new(em * SMALL);
        let (left, right) = (GAP * em, f64::from(WIDTH) - GAP * em);
        let (mut x, mut y) = (left, 0.9 * em);
        let mut entries = Vec::new();
        for (sample, text) in &self.legend {
            let text = letters.shortened(area, text, right - left - sample.width() * em)?;
            let width = sample.width() * em + letters.width(area, &text)?;
            if x > left && x + width > right {
                (x, y) = (left, y + 1.4 * em);
            }
            entries.push(Entry { sample: *sample, text, x, y });
            x += width + 1.2 * em;
        }
        let end = if entries.is_empty() { 0.0 } else { y + 0.6 * em };
        Ok((entries, end))
    }

    fn draw_legend(&self, area: &Area<'_>, em: f64, layout: &Layout) -> Result<(), Error> {
        let letters = Letters::new(em * SMALL);
        for Entry { sample, text, x, y } in &layout.legend {
            let end = x + (SAMPLE - 0.5) * em;
            let path = vec![(units(*x), units(*y)), (units(end), units(*y))];
            match sample {
                Sample::Line(colour) => line(area, path, em, PALETTE[colour % PALETTE.len()], false)?,
                Sample::Dashed => line(area, path, em, INK, true)?,
                Sample::Dot => dot(area, (units((x + end) / 2.0), units(*y)), em, INK)?,
                Sample::None => (),
                Sample::Bands => {
                    for (colour, half) in BANDS.iter().zip([0.45, 0.2]) {
                        let corners = [(units(*x), units(y - half * em)), (units(end), units(y + half * em))];
                        area.draw(&Rectangle::new(corners, colour.filled())).map_err(failed)?;
                    }
                }
            }
            letters.write(area, text, (x + sample.width() * em, *y), HPos::Left)?;
        }
        Ok(())
    }

    fn draw_panel(&self, area: &Area<'_>, i: usize, axes: &Axes, lowest: bool) -> Result<(), Error> {
        let (panel, em) = (&self.panels[i], axes.em);
        let Frame { left, top, width, height } = axes.frame;
        axes.draw_guides(area)?;
        for band in &panel.bands {
            let colour = BANDS[usize::from(band.inner)];
            let interrupted = |(x, low, high): &(f64, f64, f64)| ![x, low, high].iter().all(|v| v.is_finite());
            for ends in band.ends.split(interrupted) {
                let upper = ends.iter().filter_map(|(x, _, high)| axes.at(*x, *high));
                let lower = ends.iter().rev().filter_map(|(x, low, _)| axes.at(*x, *low));
                let outline: Vec<_> = upper.chain(lower).collect();
                match ends.len() {
                    0 => (),
                    1 => line(area, outline, 3.0 * em, colour, false)?,
                    _ => area.draw(&Polygon::new(outline, colour.filled())).map_err(failed)?,
                }
            }
        }
        for curve in &panel.curves {
            let places: Vec<_> = curve.points.iter().map(|(x, y)| axes.at(*x, *y)).collect();
            let colour = PALETTE[curve.colour % PALETTE.len()];
            for path in places.split(Option::is_none) {
                line(area, path.iter().flatten().copied().collect(), em, colour, curve.dashed)?;
            }
            for place in curve.marked.iter().filter_map(|i| places.get(*i).copied().flatten()) {
                dot(area, place, em, colour)?;
            }
        }
        axes.draw(area, lowest)?;
        let (power_x, power_y) = axes.exponents();
        let letters = Letters::new(em);
        let title = letters.shortened(area, &with_unit(&panel.name, &panel.unit, power_y), width)?;
        letters.write(area, &title, (left, top - 0.8 * em), HPos::Left)?;
        if lowest {
            let name = with_unit(&self.shared.name, &self.shared.unit, power_x);
            let name = letters.shortened(area, &name, width)?;
            let y = top + height + axes.label_height() + 0.7 * em;
            letters.write(area, &name, (left + width / 2.0, y), HPos::Center)?;
        }
        Ok(())
    }
}

impl Sample {
    /// Its width, in units of the letters' size.
    fn width(self) -> f64 {
        if self == Sample::None { 0.0 } else { SAMPLE }
    }
}

/// Room between parts and at the edges, and of a sample in the legend, in units of the letters' size.
const GAP: f64 = 0.6;
const SAMPLE: f64 = 2.4;

/// A line of the legend, in pixels.
struct Entry {
    sample: Sample,
    text: String,
    x: f64,
    y: f64,
}

/// Where the parts of a chart lie.
struct Layout {
    legend: Vec<Entry>,
    axes: Vec<Axes>,
    columns: usize,
    height: f64,
}

impl Layout {
    /// Whether there is no panel below this one.
    fn lowest(&self, panel: usize) -> bool {
        panel + self.columns >= self.axes.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Left end, right end and height of each text, in pixels; letters are taken to be as wide as they get on the mean.
    fn texts(svg: &str) -> Vec<(f64, f64, f64)> {
        let texts = svg.split("<text").skip(1).map(|text| {
            let number = |name: &str| {
                let (_, rest) = text.split_once(&format!("{name}=\"")).unwrap();
                rest.split_once('"').unwrap().0.parse::<f64>().unwrap() / 10.0
            };
            let letters = text.split_once('>').unwrap().1.split_once("</text>").unwrap().0.trim();
            let width = 0.53 * number("font-size") * letters.chars().count() as f64;
            let x = number(" x");
            let left = match text {
                _ if text.contains("\"middle\"") => x - width / 2.0,
                _ if text.contains("\"end\"") => x - width,
                _ => x,
            };
            (left, left + width, number(" y"))
        });
        texts.collect()
    }

    #[test]
    fn no_chart_is_too_strange() {
        let shared = Shared { name: "threshold".into(), unit: "kg m-2 s-1".into(), logarithmic: false };
        for values in [[1e-9, 2e-9, 5e-9], [-1e300, 0.0, 1e300], [f64::NAN; 3], [7.0; 3], [1e5, f64::INFINITY, 2e5]] {
            for (count, logarithmic) in [(1, false), (2, true), (3, false), (6, true)] {
                let points = [1e-3, 1.0, 1e3].into_iter().zip(values).collect();
                let curve = Curve { points, colour: 9, dashed: count == 3, marked: vec![0, 7] };
                let band = Band { ends: vec![(1e-3, -1.0, values[0]), (1.0, values[1], f64::NAN)], inner: true };
                let name =
                    "a name that is far too long for the width of a panel or a chart, however wide ".repeat(count);
                let panel = Panel { name: name.clone(), unit: "rad/sr".into(), bands: vec![band], curves: vec![curve] };
                let samples = [Sample::Line(3), Sample::Dashed, Sample::Bands, Sample::Dot, Sample::None];
                let legend = samples.into_iter().flat_map(|s| [(s, "short".to_owned()), (s, name.clone())]).collect();
                let shared = Shared { logarithmic, ..shared.clone() };
                let drawing = Chart { shared, panels: vec![panel; count], legend }.draw().unwrap();
                let svg = drawing.svg();
                assert!(!svg.contains("NaN") && !svg.contains("inf"));
                let (_, height) = svg.split_once("height=\"").unwrap();
                let height: f64 = height.split_once('"').unwrap().0.parse().unwrap();
                for (left, right, y) in texts(svg) {
                    let across = left > -0.02 * f64::from(WIDTH) && right < 1.02 * f64::from(WIDTH);
                    assert!(across && y > 0.0 && y < height, "{count} panels of {values:?}: {left} to {right}, {y}");
                }
            }
        }
        assert!(matches!(Chart::default().draw(), Err(Error::NoPanels)));
    }
}
