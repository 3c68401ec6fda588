//! The sphere as it is seen: turned to its centre, mirrored where east lies to the left, and projected.
//!
//! Lines on the sphere become lines of the plane here, ended and begun anew where the projection cuts them. Points are
//! unit vectors. Pixels are left to the panel.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::Error;
use super::projection::{Cut, Mollweide, Projection, angles, vector};

/// How far, in radians, a line ends before a cut: within rounding of it, and surely on its side.
const BESIDE: f64 = 1e-9;

/// The side on which east lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Orientation {
    /// East to the left, as the sky is seen from inside.
    #[default]
    EastLeft,
    /// East to the right, as on maps of the Earth.
    EastRight,
}

/// What of the sphere lies where in the plane.
#[derive(Clone, Debug)]
pub struct View {
    projection: Arc<dyn Projection>,
    centre: (f64, f64),
    orientation: Orientation,
    /// From the sphere to the projection's: its rows are the centre, its right and its north.
    turn: DMat3,
}

impl Default for View {
    /// Mollweide's projection about longitude and latitude 0.
    fn default() -> Self {
        View::of(Arc::new(Mollweide), (0.0, 0.0), Orientation::default())
    }
}

impl View {
    /// The sphere about a longitude and latitude in degrees.
    ///
    /// # Errors
    /// [`Error::Centre`] for a centre that is not on the sphere: a longitude beyond ±360, a latitude beyond ±90.
    pub fn new(projection: Arc<dyn Projection>, centre: (f64, f64), orientation: Orientation) -> Result<Self, Error> {
        let (longitude, latitude) = centre;
        if !(longitude.abs() <= 360.0 && latitude.abs() <= 90.0) {
            return Err(Error::Centre { longitude, latitude });
        }
        Ok(View::of(projection, centre, orientation))
    }

    fn of(projection: Arc<dyn Projection>, centre: (f64, f64), orientation: Orientation) -> Self {
        let (theta, phi) = ((90.0 - centre.1).to_radians(), centre.0.to_radians());
        let east = DVec3::new(-phi.sin(), phi.cos(), 0.0);
        let north = -vector(theta + std::f64::consts::FRAC_PI_2, phi);
        let right = if orientation == Orientation::EastLeft { -east } else { east };
        let turn = DMat3::from_cols(vector(theta, phi), right, north).transpose();
        View { projection, centre, orientation, turn }
    }

    /// The projection.
    pub fn projection(&self) -> &dyn Projection {
        &*self.projection
    }

    /// Longitude and latitude of the centre, in degrees.
    pub fn centre(&self) -> (f64, f64) {
        self.centre
    }

    /// The side on which east lies.
    pub fn orientation(&self) -> Orientation {
        self.orientation
    }

    /// Colatitude and longitude of a point of the plane, or nothing outside the region.
    pub fn sphere(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (theta, phi) = self.projection.inverse(x, y)?;
        if self.centre.1 == 0.0 {
            // Turned about the pole only, which needs no vectors.
            let phi = if self.orientation == Orientation::EastLeft { -phi } else { phi };
            return Some((theta, phi + self.centre.0.to_radians()));
        }
        Some(angles(self.turn.transpose() * vector(theta, phi)))
    }

    /// The point of the plane where a point of the sphere is seen, if it is.
    pub fn plane(&self, at: DVec3) -> Option<(f64, f64)> {
        let (x, y) = self.beyond(self.turn * at)?;
        let (a, b) = self.projection.half_extent();
        (x.abs() <= a && y.abs() <= b).then_some((x, y))
    }

    /// The point of the plane, even outside the region, of one of the turned sphere.
    fn beyond(&self, turned: DVec3) -> Option<(f64, f64)> {
        let (theta, phi) = angles(turned);
        self.projection.forward(theta, phi)
    }

    /// What is seen of a line through points, each less than 90° from the next.
    pub fn line(&self, points: impl IntoIterator<Item = DVec3>) -> Vec<Vec<(f64, f64)>> {
        let mut pieces = vec![Vec::new()];
        let mut last: Option<DVec3> = None;
        for point in points {
            let turned = self.turn * point;
            let Some(from) = last.replace(turned) else {
                continue;
            };
            for (a, b) in parts(self.projection.cut(), from, turned).into_iter().flatten() {
                let seen = self.beyond(a).zip(self.beyond(b)).and_then(|(a, b)| self.clipped(a, b));
                let Some((a, b)) = seen else { continue };
                let piece = pieces.last_mut().filter(|piece: &&mut Vec<_>| piece.last() == Some(&a));
                match piece {
                    Some(piece) => piece.push(b),
                    None => pieces.push(vec![a, b]),
                }
            }
        }
        pieces.retain(|piece| piece.len() > 1);
        pieces
    }

    /// The part of a line of the plane within the region's width and height (Liang and Barsky 1984).
    fn clipped(&self, a: (f64, f64), b: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
        if !self.projection.is_rectangle() {
            return Some((a, b));
        }
        let (width, height) = self.projection.half_extent();
        let step = (b.0 - a.0, b.1 - a.1);
        let (mut start, mut end) = (0.0f64, 1.0f64);
        for (at, step, half) in [(a.0, step.0, width), (a.1, step.1, height)] {
            if step == 0.0 {
                if at.abs() > half {
                    return None;
                }
                continue;
            }
            let (enter, leave) = ((-half * step.signum() - at) / step, (half * step.signum() - at) / step);
            start = start.max(enter);
            end = end.min(leave);
        }
        let at = |t: f64| match t {
            0.0 => a,
            1.0 => b,
            _ => ((a.0 + t * step.0).clamp(-width, width), (a.1 + t * step.1).clamp(-height, height)),
        };
        (start < end).then(|| (at(start), at(end)))
    }
}

/// The arc from `a` to `b`, or both its parts where it crosses the cut. None ends on the cut itself, where rounding would
/// decide on its side.
fn parts(cut: Cut, a: DVec3, b: DVec3) -> [Option<(DVec3, DVec3)>; 2] {
    let across = match cut {
        Cut::Meridian => DVec3::Y,
        Cut::Limb => DVec3::X,
    };
    let (from, to) = (across.dot(a), across.dot(b));
    let side = |off: f64| if off < 0.0 { -1.0 } else { 1.0 };
    // The side of a point on the cut is that of the other end.
    let is_on = |at: DVec3, off: f64| off.abs() < BESIDE && (cut == Cut::Limb || at.x < 0.0);
    let (from_side, to_side) = match (is_on(a, from), is_on(b, to)) {
        (true, true) => (1.0, 1.0),
        (true, false) => (side(to), side(to)),
        (false, true) => (side(from), side(from)),
        (false, false) => (side(from), side(to)),
    };
    let beside = |at: DVec3, side: f64| at + across * (BESIDE * side - across.dot(at));
    let whole = || {
        let a = if is_on(a, from) { beside(a, from_side) } else { a };
        let b = if is_on(b, to) { beside(b, to_side) } else { b };
        [Some((a, b)), None]
    };
    if from_side == to_side {
        return whole();
    }
    let crossing = ((a * to - b * from) * to_side).normalize_or(a);
    if cut == Cut::Meridian && crossing.x > 0.0 {
        return whole();
    }
    [Some((a, beside(crossing, from_side))), Some((beside(crossing, to_side), b))]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::projection::{Equirectangular, Gnomonic, Hammer, Orthographic};
    use super::*;

    fn views() -> Vec<View> {
        let gnomonic: Arc<dyn Projection> = Arc::new(Gnomonic::new(80.0).unwrap());
        let all: [Arc<dyn Projection>; 5] =
            [Arc::new(Mollweide), Arc::new(Hammer), Arc::new(Equirectangular), Arc::new(Orthographic), gnomonic];
        let centres = [(0.0, 0.0), (170.0, 0.0), (-75.0, 40.0), (20.0, 90.0), (300.0, -90.0)];
        let orientations = [Orientation::EastLeft, Orientation::EastRight];
        let view = |p: &Arc<dyn Projection>, c, o| View::new(p.clone(), c, o).unwrap();
        all.iter().flat_map(|p| centres.iter().flat_map(move |&c| orientations.map(|o| view(p, c, o)))).collect()
    }

    #[test]
    fn the_centre_is_in_the_middle_and_east_where_it_was_asked_to_be() {
        for view in views() {
            let (lon, lat) = view.centre();
            let (theta, phi) = ((90.0 - lat).to_radians(), lon.to_radians());
            let middle = view.plane(vector(theta, phi)).unwrap();
            let disc = view.projection().half_extent().0 > 2.0 && view.projection().half_extent().0 < 2.5;
            let expected = if disc { -1.04 } else { 0.0 };
            assert!((middle.0 - expected).hypot(middle.1) < 1e-7, "{view:?}: {middle:?}");
            let east = view.plane(vector(theta, phi) + 1e-3 * DVec3::new(-phi.sin(), phi.cos(), 0.0)).unwrap();
            assert_eq!(east.0 < middle.0, view.orientation() == Orientation::EastLeft, "{view:?}");
        }
    }

    #[test]
    fn points_make_the_round_trip() {
        for view in views() {
            let (a, b) = view.projection().half_extent();
            for i in -9..=9 {
                for j in -9..=9 {
                    let (x, y) = (a * f64::from(i) / 10.3, b * f64::from(j) / 10.3);
                    let Some((theta, phi)) = view.sphere(x, y) else { continue };
                    let (u, v) = view.plane(vector(theta, phi)).unwrap();
                    assert!((u - x).hypot(v - y) < 1e-11 * a, "{view:?} ({x}, {y}): ({u}, {v})");
                }
            }
        }
    }

    #[test]
    fn lines_are_seen_in_short_steps_only() {
        // A circle about each of many points: no step of it in the plane may be long.
        for view in views() {
            let (a, b) = view.projection().half_extent();
            for k in 0..40 {
                let middle = vector(PI * f64::from(k) / 39.0, 2.4 * f64::from(k));
                let (one, other) = (middle.any_orthonormal_vector(), middle.cross(middle.any_orthonormal_vector()));
                let turn = |i: u16| PI * f64::from(i) / 1800.0;
                let circle = (0..=3600).map(|i| middle * 0.8 + 0.6 * (one * turn(i).cos() + other * turn(i).sin()));
                for piece in view.line(circle) {
                    for step in piece.windows(2) {
                        let length = (step[1].0 - step[0].0).hypot(step[1].1 - step[0].1);
                        // Near the pole of a cylinder a short way may be far around.
                        let polar = step[0].1.abs() > 0.97 * b && view.projection().is_rectangle();
                        assert!(polar || length < 0.1 * a, "{view:?} {middle}: {step:?}");
                        assert!(step[0].0.abs() <= a * (1.0 + 1e-12), "{view:?} {middle}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_line_across_the_cut_goes_on_at_the_other_side() {
        let view = View::default();
        let pieces = view.line([vector(1.5, PI - 0.1), vector(1.6, PI + 0.1)]);
        assert_eq!(pieces.len(), 2);
        let (left, right) = (pieces[0][1], pieces[1][0]);
        // Colatitude 1.55, just short of both ends.
        assert!((left.0 + right.0).abs() < 1e-6 && (left.1 - right.1).abs() < 1e-6);
        let reach = Mollweide.forward(1.55, PI).unwrap().0;
        assert!((left.0.abs() - reach).abs() < 1e-3 && left.0 < 0.0, "{left:?}");
        // Through the centre it is whole.
        assert_eq!(view.line([vector(1.5, -0.1), vector(1.6, 0.1)]).len(), 1);
        // Behind a gnomonic picture nothing is seen.
        let view = View::new(Arc::new(Gnomonic::new(60.0).unwrap()), (0.0, 0.0), Orientation::EastRight).unwrap();
        assert!(view.line([vector(1.5, PI - 0.1), vector(1.6, PI + 0.1)]).is_empty());
        let across = view.line([vector(1.57, -1.0), vector(1.57, 0.0), vector(1.57, 1.0)]);
        let half = 30f64.to_radians().tan();
        assert!((across[0][0].0 + half).abs() < 1e-12 && (across[0].last().unwrap().0 - half).abs() < 1e-12);
    }

    #[test]
    fn a_point_on_the_cut_is_on_the_side_that_the_line_comes_from() {
        // The equator and a meridian touch the limb, and the cut, at points of theirs.
        for projection in [Arc::new(Orthographic) as Arc<dyn Projection>, Arc::new(Mollweide)] {
            for orientation in [Orientation::EastLeft, Orientation::EastRight] {
                let view = View::new(projection.clone(), (0.0, 0.0), orientation).unwrap();
                for lat in [-60, -30, 0, 50] {
                    let at = |lon: i32| vector(f64::from(90 - lat).to_radians(), f64::from(lon).to_radians());
                    let pieces = view.line((-180..=180).map(at));
                    let longest = |piece: &Vec<(f64, f64)>| {
                        let steps = piece.windows(2).map(|w| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1));
                        steps.fold(0.0, f64::max)
                    };
                    assert!(pieces.iter().all(|piece| longest(piece) < 0.1), "{view:?} {lat}: {pieces:?}");
                    assert!((1..=3).contains(&pieces.len()), "{view:?} {lat}: {}", pieces.len());
                }
            }
        }
    }

    #[test]
    fn centres_off_the_sphere_are_refused() {
        for centre in [(0.0, 91.0), (361.0, 0.0), (f64::NAN, 0.0)] {
            assert!(View::new(Arc::new(Mollweide), centre, Orientation::EastLeft).is_err(), "{centre:?}");
        }
    }
}
