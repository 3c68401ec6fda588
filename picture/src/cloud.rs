//! Points of an ensemble in the plane of two quantities, one of them marked by a star.
//!
//! What points mean, and the texts about them, come from the caller. The look is that of [`axes`](super::axes).

use std::f64::consts::{FRAC_PI_2, PI};

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::Error;
use super::axes::{Axes, Axis, Frame, Letters, PALETTE, SMALL, dot, units, with_unit};
use super::canvas::{Area, Drawing, failed};
use super::pen::INK;

/// Width of a picture in pixels.
const WIDTH: u32 = 1200;

/// Letters to the width.
const LETTERS: f64 = 30.0;

/// Room between parts and at the edges, in units of the letters' size.
const GAP: f64 = 0.6;

/// Height of the frame in units of its width.
const ASPECT: f64 = 0.8;

/// Radii of the star's points and of the corners between them, in units of the letters' size.
const STAR: (f64, f64) = (0.62, 0.27);

/// The name and the unit of an axis.
#[derive(Clone, Debug, Default)]
pub struct AxisLabel {
    /// The name.
    pub name: String,
    /// The unit; may be empty.
    pub unit: String,
}

/// Points and a star. Those with a number that is not finite are not drawn.
#[derive(Clone, Debug, Default)]
pub struct Cloud {
    /// The quantity to the right.
    pub x: AxisLabel,
    /// The quantity upwards.
    pub y: AxisLabel,
    /// The points.
    pub points: Vec<(f64, f64)>,
    /// The star.
    pub star: (f64, f64),
    /// What the points and the star are.
    pub legend: [String; 2],
}

impl Cloud {
    /// Draws it.
    ///
    /// # Errors
    /// [`Error::Draw`] if drawing fails.
    pub fn draw(&self) -> Result<Drawing, Error> {
        let em = f64::from(WIDTH) / LETTERS;
        let finite = |(x, y): &&(f64, f64)| x.is_finite() && y.is_finite();
        let all: Vec<(f64, f64)> = self.points.iter().chain([&self.star]).filter(finite).copied().collect();
        let mut axes = Axes {
            frame: Frame { left: 0.0, top: 3.4 * em, width: 0.0, height: ASPECT * f64::from(WIDTH) },
            x: Axis::around(all.iter().map(|(x, _)| *x)),
            y: Axis::around(all.iter().map(|(_, y)| *y)),
            em,
        };
        // How wide the frame is depends on the widths of labels, which a drawing can tell.
        Drawing::new((WIDTH, 1), &[], |area| {
            axes.frame.left = GAP * em + axes.label_width(area)?;
            Ok(())
        })?;
        axes.frame.width = f64::from(WIDTH) - axes.frame.left - 2.0 * GAP * em;
        axes.frame.height = ASPECT * axes.frame.width;
        let bottom = axes.frame.top + axes.frame.height + axes.label_height();
        Drawing::new((WIDTH, (bottom + 1.7 * em).ceil() as u32), &[], |area| self.draw_on(area, &axes, bottom))
    }

    fn draw_on(&self, area: &Area<'_>, axes: &Axes, bottom: f64) -> Result<(), Error> {
        let Axes { frame: Frame { left, top, width, .. }, em, .. } = *axes;
        axes.draw_guides(area)?;
        for place in self.points.iter().filter_map(|(x, y)| axes.at(*x, *y)) {
            dot(area, place, em, PALETTE[0])?;
        }
        axes.draw(area, true)?;
        if let Some(place) = axes.at(self.star.0, self.star.1) {
            star(area, place, em)?;
        }
        let (power_x, power_y) = axes.exponents();
        let letters = Letters::new(em);
        let above = letters.shortened(area, &with_unit(&self.y.name, &self.y.unit, power_y), width)?;
        letters.write(area, &above, (left, top - 0.8 * em), HPos::Left)?;
        let below = letters.shortened(area, &with_unit(&self.x.name, &self.x.unit, power_x), width)?;
        letters.write(area, &below, (left + width / 2.0, bottom + 0.7 * em), HPos::Center)?;
        let letters = Letters::new(em * SMALL);
        let [points, data] = &self.legend;
        let y = 1.1 * em;
        dot(area, (units(left + 0.5 * em), units(y)), em, PALETTE[0])?;
        let points = letters.shortened(area, points, 0.4 * width)?;
        letters.write(area, &points, (left + 1.2 * em, y), HPos::Left)?;
        let x = left + 2.4 * em + letters.width(area, &points)?;
        star(area, (units(x + 0.5 * em), units(y)), em)?;
        let data = letters.shortened(area, data, 0.4 * width)?;
        letters.write(area, &data, (x + 1.4 * em, y), HPos::Left)
    }
}

/// A star of five points, with an outline.
fn star(area: &Area<'_>, (x, y): (i32, i32), em: f64) -> Result<(), Error> {
    let corner = |i: i32| {
        let radius = em * if i % 2 == 0 { STAR.0 } else { STAR.1 };
        let (sin, cos) = (f64::from(i) * PI / 5.0 - FRAC_PI_2).sin_cos();
        (x + units(radius * cos), y + units(radius * sin))
    };
    let corners: Vec<_> = (0..=10).map(corner).collect();
    area.draw(&Polygon::new(corners.clone(), PALETTE[1].filled())).map_err(failed)?;
    area.draw(&PathElement::new(corners, INK.stroke_width(units(0.05 * em).max(1) as u32))).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(cloud: &Cloud) -> String {
        cloud.draw().unwrap().svg().to_owned()
    }

    #[test]
    fn a_point_each_and_a_star() {
        let label = |name: &str, unit: &str| AxisLabel { name: name.into(), unit: unit.into() };
        let cloud = Cloud {
            x: label("EVQ", ""),
            y: label("RANK4_MID", "rad"),
            points: vec![(1.0, 2.0), (2.0, 1.0), (f64::NAN, 1.0), (1.5, f64::INFINITY)],
            star: (3.0, 3.0),
            legend: ["2 simulations".into(), "sky <&>".into()],
        };
        let svg = drawn(&cloud);
        // One circle more stands in the legend; so does a star.
        assert_eq!((svg.matches("<circle").count(), svg.matches("<polygon").count()), (3, 2));
        for text in ["EVQ", "RANK4_MID [rad]", "2 simulations", "sky &lt;&amp;&gt;"] {
            assert!(svg.contains(text), "{text}");
        }
        let without = Cloud { star: (f64::NAN, 0.0), ..cloud.clone() };
        assert_eq!(drawn(&without).matches("<polygon").count(), 1);
        // Nothing at all is a frame.
        assert_eq!(drawn(&Cloud { star: (f64::NAN, f64::NAN), ..Cloud::default() }).matches("<circle").count(), 1);
        assert!(cloud.draw().unwrap().png().unwrap().starts_with(b"\x89PNG"));
    }
}
