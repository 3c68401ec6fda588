//! What is drawn over the map: circles, marked points, contours, rods of directions and coastlines.
//!
//! Where it appears is left to the [`view`](super::view), which pieces a contour has to
//! [`contours`](super::contours).

use std::f64::consts::TAU;

use glam::DVec3;
use longan_grid::{Healpix, UNSEEN, is_bad};
use plotters::style::{Color, WHITE};

use super::Error;
use super::coastlines::coastlines;
use super::pen::{Anchor, Frame, INK, Pen, Words};
use super::projection::{vector, vector_of_degrees};
use super::viewport::Viewport;

/// Points of a circle.
const POINTS: u32 = 720;

/// Points of lines that are nearer to one another than this, in pixels, are not told apart.
const RESOLUTION: f64 = 0.3;

/// Rods are no nearer to one another than this share of the panel's width.
const ROD_SPACING: f64 = 1.0 / 60.0;

/// The length of a rod as a share of their distance, so that they do not touch.
const ROD_LENGTH: f64 = 0.72;

/// A circle on the sphere, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Longitude and latitude of its centre.
    pub centre: (f64, f64),
    /// Its radius.
    pub radius: f64,
}

/// A marked point.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Longitude and latitude in degrees.
    pub at: (f64, f64),
    /// What is written beside it; may be empty.
    pub label: String,
}

/// Directions, drawn as rods without heads, or for symmetries other than two as stars.
#[derive(Clone, Debug)]
pub struct Rods {
    /// Directions in degrees from south to east, in RING order; NaN where there is none.
    pub directions: Vec<f64>,
    /// The number of arms, each a turn by 360 degrees over it from the next.
    pub symmetry: u32,
}

/// All that is drawn over the map.
#[derive(Clone, Debug, Default)]
pub struct Overlays {
    /// The coastlines of the Earth.
    pub coastlines: bool,
    /// Lines through points of the sphere, unit vectors.
    pub lines: Vec<Vec<[f64; 3]>>,
    /// Directions.
    pub rods: Option<Rods>,
    /// Circles.
    pub circles: Vec<Circle>,
    /// Marked points.
    pub marks: Vec<Mark>,
}

impl Overlays {
    /// What cannot be drawn.
    pub(super) fn check(&self) -> Result<(), Error> {
        let on_sphere = |(longitude, latitude): (f64, f64)| {
            if longitude.is_finite() && latitude.abs() <= 90.0 {
                Ok(())
            } else {
                Err(Error::Place { longitude, latitude })
            }
        };
        for circle in &self.circles {
            on_sphere(circle.centre)?;
            if !(circle.radius > 0.0 && circle.radius < 180.0) {
                return Err(Error::Radius { radius: circle.radius });
            }
        }
        self.marks.iter().try_for_each(|mark| on_sphere(mark.at))?;
        if let Some(Rods { directions, symmetry }) = &self.rods {
            if Healpix::with_pixels(directions.len()).is_none() {
                return Err(Error::PixelCount { pixels: directions.len() });
            }
            if *symmetry == 0 {
                return Err(Error::Symmetry);
            }
        }
        Ok(())
    }

    /// Draws all but the names of marked points. `size` is that of texts.
    pub(super) fn draw(&self, pen: &Pen<'_, '_>, place: &Viewport<'_>, size: f64) -> Result<(), Error> {
        if self.coastlines {
            let lines: Vec<_> = coastlines().flat_map(|line| seen(place, line)).collect();
            on_any_colour(pen, &lines, size / 22.0)?;
        }
        let contours: Vec<_> =
            self.lines.iter().flat_map(|line| seen(place, line.iter().map(|&at| DVec3::from_array(at)))).collect();
        on_any_colour(pen, &contours, size / 14.0)?;
        if let Some(rods) = &self.rods {
            on_any_colour(pen, &rods.seen(place), size / 13.0)?;
        }
        let circles: Vec<_> = self.circles.iter().flat_map(|circle| seen(place, circle.points())).collect();
        on_any_colour(pen, &circles, size / 9.0)?;
        for mark in &self.marks {
            if let Some(at) = place.pixel(mark.place()) {
                pen.disc(at, 0.24 * size, WHITE, size / 9.0)?;
            }
        }
        Ok(())
    }

    /// Names the marked points within `sheet`, and tells what they and the marks take.
    pub(super) fn draw_names(
        &self,
        pen: &Pen<'_, '_>,
        place: &Viewport<'_>,
        size: f64,
        sheet: &Frame,
    ) -> Result<Vec<Frame>, Error> {
        let around = |(x, y): (f64, f64)| {
            let half = 0.3 * size;
            Frame { left: x - half, top: y - half, width: 2.0 * half, height: 2.0 * half }
        };
        let marks: Vec<_> =
            self.marks.iter().filter_map(|mark| Some((place.pixel(mark.place())?, &mark.label))).collect();
        let mut taken: Vec<Frame> = marks.iter().map(|(at, _)| around(*at)).collect();
        for ((x, y), label) in marks {
            if label.is_empty() {
                continue;
            }
            let words = |dx: f64, dy: f64, anchor| Words {
                text: label.clone(),
                at: (x + dx * size, y + dy * size),
                anchor,
                size,
            };
            let beside = [
                words(0.5, 0.36, Anchor::Left),
                words(-0.5, 0.36, Anchor::Right),
                words(0.0, -0.6, Anchor::Middle),
                words(0.0, 1.2, Anchor::Middle),
            ];
            let is_free = |words: &&Words| {
                let frame = words.frame();
                sheet.holds(&frame) && !taken.iter().any(|other| other.overlaps(&frame))
            };
            // A name that finds no room is on the map nevertheless: it was asked for.
            let words = beside.iter().find(is_free).unwrap_or(&beside[0]);
            taken.push(words.frame());
            pen.words_on_map(words)?;
        }
        Ok(taken)
    }
}

/// What is seen of a line, in pixels, without points that cannot be told apart.
fn seen(place: &Viewport<'_>, points: impl IntoIterator<Item = DVec3>) -> Vec<Vec<(f64, f64)>> {
    let lines = place.view.line(points).into_iter().map(|line| place.all(&line));
    lines.map(thinned).collect()
}

/// The line without points next to others; its ends stay.
fn thinned(line: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let last = line.len() - 1;
    let mut kept: Vec<(f64, f64)> = Vec::with_capacity(line.len());
    for (i, at) in line.into_iter().enumerate() {
        let far = kept.last().is_none_or(|k| (at.0 - k.0).hypot(at.1 - k.1) >= RESOLUTION);
        if far || i == last {
            kept.push(at);
        }
    }
    kept
}

/// Dark lines with a light seam.
fn on_any_colour(pen: &Pen<'_, '_>, lines: &[Vec<(f64, f64)>], width: f64) -> Result<(), Error> {
    for line in lines {
        pen.line(line, WHITE.mix(0.6), 2.2 * width)?;
    }
    for line in lines {
        pen.line(line, INK, width)?;
    }
    Ok(())
}

impl Circle {
    /// Points around it, the last being the first.
    fn points(&self) -> impl Iterator<Item = DVec3> + use<> {
        let middle = vector_of_degrees(self.centre.0, self.centre.1);
        let one = middle.any_orthonormal_vector();
        let other = middle.cross(one);
        let (sin, cos) = self.radius.to_radians().sin_cos();
        (0..=POINTS).map(move |i| {
            let (sin_turn, cos_turn) = (TAU * f64::from(i % POINTS) / f64::from(POINTS)).sin_cos();
            middle * cos + (one * cos_turn + other * sin_turn) * sin
        })
    }
}

impl Mark {
    fn place(&self) -> DVec3 {
        vector_of_degrees(self.at.0, self.at.1)
    }
}

impl Rods {
    /// Rods about the pixels of the finest grid, up to the map's own, on which they have room, each a line in pixels.
    fn seen(&self, place: &Viewport<'_>) -> Vec<Vec<(f64, f64)>> {
        let Some(grid) = Healpix::with_pixels(self.directions.len()) else { return Vec::new() };
        // Nside for which pixels are that far apart in the picture's middle.
        let nside = grid.pixel_side() * grid.nside() as f64 * place.scale() / (ROD_SPACING * place.width());
        let nside = (nside.max(1.0) as usize).min(grid.nside());
        let Ok(of_rods) = Healpix::new(nside) else { return Vec::new() };
        let half = 0.5 * ROD_LENGTH * of_rods.pixel_side();
        // Of a fine grid only what is seen is gone through.
        let mut rods = Vec::new();
        for p in 0..of_rods.pixels() {
            let (theta, phi) = of_rods.centre(p);
            let direction = self.directions[grid.pixel_at(theta, phi)];
            let middle = vector(theta, phi);
            if is_bad(direction, UNSEEN) || place.pixel(middle).is_none() {
                continue;
            }
            let (south, east) =
                (vector(theta + std::f64::consts::FRAC_PI_2, phi), DVec3::new(-phi.sin(), phi.cos(), 0.0));
            let end = |arm: u32| {
                let angle = direction.to_radians() + TAU * f64::from(arm) / f64::from(self.symmetry);
                middle * half.cos() + (south * angle.cos() + east * angle.sin()) * half.sin()
            };
            if self.symmetry == 2 {
                rods.extend(seen(place, [end(0), middle, end(1)]));
            } else {
                (0..self.symmetry).for_each(|arm| rods.extend(seen(place, [middle, end(arm)])));
            }
        }
        rods
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_are_circles() {
        for centre in [(0.0, 0.0), (130.0, 88.0), (-20.0, -90.0)] {
            for radius in [0.01, 6.0, 90.0, 150.0] {
                let points: Vec<_> = Circle { centre, radius }.points().collect();
                assert_eq!(points[0], points[POINTS as usize]);
                let off =
                    |at: &DVec3| (at.angle_between(vector_of_degrees(centre.0, centre.1)).to_degrees() - radius).abs();
                assert!(points.iter().all(|at| off(at) < 1e-6), "{centre:?} {radius}");
            }
        }
    }

    #[test]
    fn thin_lines_keep_their_ends() {
        let line: Vec<_> = (0..=1000).map(|i| (f64::from(i) * 0.01, 0.0)).collect();
        let thin = thinned(line);
        assert!((30..40).contains(&thin.len()));
        assert_eq!((thin[0], *thin.last().unwrap()), ((0.0, 0.0), (10.0, 0.0)));
    }

    #[test]
    fn what_cannot_be_drawn_is_named() {
        let with = |overlays: Overlays| overlays.check().map_err(|e| e.to_string());
        let circle = |centre, radius| Overlays { circles: vec![Circle { centre, radius }], ..Overlays::default() };
        assert!(with(circle((0.0, 0.0), 6.0)).is_ok());
        assert!(with(circle((0.0, 95.0), 6.0)).unwrap_err().contains("95"));
        assert!(with(circle((0.0, 0.0), 0.0)).unwrap_err().contains('0'));
        let mark = Mark { at: (f64::NAN, 0.0), label: String::new() };
        assert!(with(Overlays { marks: vec![mark], ..Overlays::default() }).is_err());
        let rods = |pixels, symmetry| Overlays {
            rods: Some(Rods { directions: vec![0.0; pixels], symmetry }),
            ..Overlays::default()
        };
        assert!(with(rods(12, 2)).is_ok());
        assert!(with(rods(13, 2)).is_err() && with(rods(12, 0)).is_err());
    }
}
