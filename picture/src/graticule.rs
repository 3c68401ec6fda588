//! Meridians and parallels: which are drawn, and where they are named.

use std::f64::consts::SQRT_2;

use glam::DVec3;
use plotters::style::{Color, RGBColor};

use super::Error;
use super::pen::{Anchor, At, Frame, Pen, Words, width};
use super::projection::{Cut, vector_of_degrees};
use super::ticks::signed;
use super::view::{Orientation, View};
use super::viewport::Viewport;

/// Distances of parallels and of meridians, in degrees, on a picture of the whole sphere.
const PARALLELS: f64 = 30.0;
const MERIDIANS: f64 = 60.0;

/// Distances of parallels and of meridians on a picture of a part.
const ROUND: [f64; 19] =
    [90.0, 60.0, 45.0, 30.0, 20.0, 15.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001];

/// Parallels across a picture of a part, at most.
const ACROSS: f64 = 5.0;

/// The latitude at which meridians end: nearer to the pole than is seen.
const NEARLY_POLE: f64 = 90.0 - 5e-5;

/// Points of a line.
const POINTS: u16 = 360;

/// Where a line is named, in units of its text's size, from the line or the edge.
const GAP: f64 = 0.35;

/// A meridian or a parallel.
#[derive(Debug)]
struct Line {
    name: String,
    is_meridian: bool,
    /// What is seen of it, in the plane.
    seen: Vec<Vec<(f64, f64)>>,
    /// Where it may be named within the map, best first.
    inside: Vec<DVec3>,
}

/// The lines of a view.
#[derive(Debug)]
pub(super) struct Graticule {
    lines: Vec<Line>,
    is_rectangle: bool,
    /// Whether another parallel than the equator may end where the outline is widest.
    is_tilted: bool,
}

impl Graticule {
    pub(super) fn new(view: &View) -> Self {
        let (longitude, latitude) = view.centre();
        let at = vector_of_degrees;
        let is_part = view.projection().cut() == Cut::Limb && view.projection().is_rectangle();
        let mut graticule =
            Graticule { lines: Vec::new(), is_rectangle: view.projection().is_rectangle(), is_tilted: latitude != 0.0 };
        // Half the height of what is seen in latitude, and half its width in longitude.
        let (mut height, mut width) = (180.0, 180.0);
        let (mut parallels, mut meridians) = (PARALLELS, MERIDIANS);
        if view.projection().cut() == Cut::Limb {
            meridians = PARALLELS;
        }
        if is_part {
            let corner = (SQRT_2 * view.projection().half_extent().0).atan();
            height = corner.to_degrees();
            let share = corner.sin() / latitude.to_radians().cos();
            if latitude.abs() + height < 90.0 && share < 1.0 {
                width = share.asin().to_degrees();
            }
            let side = 2.0 * view.projection().half_extent().0.atan().to_degrees();
            let finest = ROUND[ROUND.len() - 1];
            let round = |least: f64| ROUND.into_iter().rev().find(|step| *step >= least).unwrap_or(ROUND[0]);
            parallels = round(side / ACROSS).max(finest);
            let shrunk = latitude.to_radians().cos();
            meridians = if width == 180.0 { MERIDIANS / 2.0 } else { round(side / ACROSS / shrunk) };
        }
        let earthly = view.orientation() == Orientation::EastRight;
        let steps =
            |from: f64, to: f64| (0..=POINTS).map(move |i| from + (to - from) * f64::from(i) / f64::from(POINTS));
        let multiples = |from: f64, to: f64, step: f64| (from / step).ceil() as i64..=(to / step).floor() as i64;
        // A pole by itself has no longitude.
        let (south, north) = ((latitude - height).max(-NEARLY_POLE), (latitude + height).min(NEARLY_POLE));
        let (west, east) = (longitude - width, longitude + width);
        for k in multiples(south, north, parallels) {
            let lat = k as f64 * parallels;
            let seen = view.line(steps(west, east).map(|lon| at(lon, lat)));
            let inside = vec![at(longitude, lat), at(longitude + 180.0, lat)];
            let name = latitude_name(lat, parallels, earthly);
            graticule.lines.push(Line { name, is_meridian: false, seen, inside });
        }
        // All around, the first and the last are the same.
        let last = if width == 180.0 { east - 1e-9 * meridians } else { east };
        for k in multiples(west, last, meridians) {
            let lon = k as f64 * meridians;
            // That along the cut is the outline.
            let is_cut = view.projection().cut() == Cut::Meridian
                && latitude == 0.0
                && ((lon - longitude).abs() - 180.0).abs() < 1e-6;
            if is_cut {
                continue;
            }
            let seen = view.line(steps(south, north).map(|lat| at(lon, lat)));
            // On the equator, or, from above a pole, half way from there.
            let named = if latitude.abs() <= 45.0 { 0.0 } else { 45f64.copysign(latitude) };
            let inside = vec![at(lon, named), at(lon, -named)];
            let name = longitude_name(lon, meridians, earthly);
            graticule.lines.push(Line { name, is_meridian: true, seen, inside });
        }
        graticule
    }

    /// The room that names take to the left of the map and below it.
    pub(super) fn room(&self, size: f64) -> (f64, f64) {
        if !self.is_rectangle {
            return (if self.is_tilted { 2.7 } else { 1.7 } * size, 0.0);
        }
        let widest = self.lines.iter().map(|line| width(&line.name, size)).fold(0.0, f64::max);
        (widest + 2.0 * GAP * size, 1.4 * size)
    }

    pub(super) fn draw_lines(&self, pen: &Pen<'_, '_>, place: &Viewport<'_>, size: f64) -> Result<(), Error> {
        // Half way between black and white, so that it shows on dark colours and on light ones.
        let colour = RGBColor(128, 128, 128).mix(0.75);
        let seen = self.lines.iter().flat_map(|line| &line.seen);
        seen.into_iter().try_for_each(|line| pen.line(&place.all(line), colour, size / 22.0))
    }

    /// Names the lines where there is room besides what is `taken`, within `sheet`.
    pub(super) fn draw_names(
        &self,
        pen: &Pen<'_, '_>,
        place: &Viewport<'_>,
        size: f64,
        sheet: &Frame,
        taken: &mut Vec<Frame>,
    ) -> Result<(), Error> {
        // Parallels first, for there are fewer places for their names.
        let (meridians, parallels): (Vec<_>, Vec<_>) = self.lines.iter().partition(|line| line.is_meridian);
        for line in parallels.into_iter().chain(meridians) {
            let outside =
                if self.is_rectangle { beside_frame(line, place, size) } else { beside_disc(line, place, size) };
            let is_free = |words: &Words, taken: &[Frame]| {
                let frame = words.frame();
                sheet.holds(&frame) && !taken.iter().any(|other| other.overlaps(&frame.wider(GAP * size)))
            };
            let is_outside = |words: &&Words| !words.frame().rim().iter().any(|&at| place.covers(at));
            if let Some(words) = outside.iter().filter(is_outside).find(|words| is_free(words, taken)) {
                taken.push(words.frame());
                pen.words(words)?;
                continue;
            }
            if !outside.is_empty() {
                continue;
            }
            // Meridians are named on both halves of the sphere where both are seen by themselves.
            for &at in &line.inside {
                let Some((x, y)) = place.pixel(at) else { continue };
                let at = (x + GAP * size, y + if line.is_meridian { 1.1 } else { -GAP } * size);
                let words = Words { text: line.name.clone(), at, anchor: Anchor::Left, size };
                let is_inside = words.frame().rim().iter().all(|&at| place.covers(at));
                if is_inside && is_free(&words, taken) {
                    taken.push(words.frame());
                    pen.words_on_map(&words)?;
                    if !line.is_meridian {
                        break;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Where a line that ends at the rectangle's edge may be named: parallels at the left, meridians below, or else the
/// other way around.
fn beside_frame(line: &Line, place: &Viewport<'_>, size: f64) -> Vec<Words> {
    let (a, b) = place.view.projection().half_extent();
    let near = |x: f64, edge: f64| (x - edge).abs() < 1e-6 * a;
    // The ends of the line with its directions there.
    let ends = || {
        let end = |at: (f64, f64), before: (f64, f64)| (at, (at.0 - before.0, at.1 - before.1));
        line.seen.iter().flat_map(move |piece| {
            let last = piece.len() - 1;
            [end(piece[0], piece[1]), end(piece[last], piece[last - 1])]
        })
    };
    let words = |at: At, anchor: Anchor| Words { text: line.name.clone(), at, anchor, size };
    // One that meets the edge at a small angle is not told by it.
    let left = ends().filter(|&((x, _), (dx, dy))| near(x, -a) && dx.abs() > dy.abs()).map(|(end, _)| {
        let (x, y) = place.of_plane(end);
        words((x - GAP * size, y + 0.36 * size), Anchor::Right)
    });
    let below = ends().filter(|&((_, y), (dx, dy))| near(y, -b) && dy.abs() > dx.abs()).map(|(end, _)| {
        let (x, y) = place.of_plane(end);
        words((x, y + (GAP + 0.8) * size), Anchor::Middle)
    });
    if line.is_meridian { below.chain(left).collect() } else { left.chain(below).collect() }
}

/// Where a parallel that ends at the outline may be named: left of its leftmost end.
fn beside_disc(line: &Line, place: &Viewport<'_>, size: f64) -> Vec<Words> {
    if line.is_meridian {
        return Vec::new();
    }
    let ends = line.seen.iter().flat_map(|piece| {
        let (first, last) = (piece[0], piece[piece.len() - 1]);
        let closed = (first.0 - last.0).hypot(first.1 - last.1) < 1e-6;
        (!closed).then_some([first, last]).into_iter().flatten()
    });
    let leftmost = ends.min_by(|a, b| a.0.total_cmp(&b.0));
    let words = |end: (f64, f64)| {
        let (x, y) = place.of_plane(end);
        // Above the line in the north, below it in the south: the outline goes that way.
        let lift = 0.36 - 0.75 * end.1 / place.view.projection().half_extent().1;
        Words { text: line.name.clone(), at: (x - GAP * size, y + lift * size), anchor: Anchor::Right, size }
    };
    leftmost.map(words).into_iter().collect()
}

/// Digits after the point that multiples of a step have.
fn decimals(step: f64) -> usize {
    (0..3).find(|&n| (step * 10f64.powi(n)).fract().abs() < 1e-9).unwrap_or(3) as usize
}

fn latitude_name(latitude: f64, step: f64, earthly: bool) -> String {
    let decimals = decimals(step);
    match latitude {
        0.0 => "0°".to_owned(),
        x if earthly => format!("{:.decimals$}°{}", x.abs(), if x > 0.0 { "N" } else { "S" }),
        x => signed(format!("{x:+.decimals$}°")),
    }
}

fn longitude_name(longitude: f64, step: f64, earthly: bool) -> String {
    let decimals = decimals(step);
    // A sum of steps may be off a full turn by rounding.
    let round = |x: f64| (x / step).round() * step;
    if earthly {
        match round((longitude + 180.0).rem_euclid(360.0) - 180.0) {
            0.0 => "0°".to_owned(),
            x if (x.abs() - 180.0).abs() < 1e-9 => "180°".to_owned(),
            x => format!("{:.decimals$}°{}", x.abs(), if x > 0.0 { "E" } else { "W" }),
        }
    } else {
        format!("{:.decimals$}°", round(longitude.rem_euclid(360.0)).rem_euclid(360.0))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::projection::Gnomonic;
    use super::*;

    #[test]
    fn lines_are_named_as_on_the_sky_or_on_the_earth() {
        let names = |names: fn(f64, f64, bool) -> String, step: f64, all: &[f64], earthly| {
            all.iter().map(|&x| names(x, step, earthly)).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(names(latitude_name, 30.0, &[-30.0, 0.0, 60.0], false), "−30° 0° +60°");
        assert_eq!(names(latitude_name, 30.0, &[-30.0, 0.0, 60.0], true), "30°S 0° 60°N");
        assert_eq!(names(longitude_name, 60.0, &[-60.0, 0.0, 180.0, 240.0], false), "300° 0° 180° 240°");
        assert_eq!(names(longitude_name, 60.0, &[-60.0, 0.0, 180.0, 240.0], true), "60°W 0° 180° 120°W");
        assert_eq!(names(longitude_name, 0.05, &[-180.05, 0.05, 359.95], true), "179.95°E 0.05°E 0.05°W");
        assert_eq!(names(latitude_name, 0.2, &[-0.4, 0.2], false), "−0.4° +0.2°");
    }

    #[test]
    fn a_part_of_the_sphere_has_a_few_lines() {
        for size in [0.01, 0.3, 2.0, 10.0, 45.0, 120.0] {
            for centre in [(0.0, 0.0), (179.9, 50.0), (10.0, -88.0), (0.0, 90.0), (359.0, -89.99)] {
                let view = View::new(Arc::new(Gnomonic::new(size).unwrap()), centre, Orientation::EastLeft).unwrap();
                let lines = Graticule::new(&view).lines;
                let seen = |meridian: bool| {
                    lines.iter().filter(|line| line.is_meridian == meridian && !line.seen.is_empty()).count()
                };
                assert!((1..=12).contains(&seen(false)), "{size} {centre:?}: {}", seen(false));
                assert!((1..=14).contains(&seen(true)), "{size} {centre:?}: {}", seen(true));
            }
        }
    }
}
