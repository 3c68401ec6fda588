//! Projections between the sphere and the plane. Turning the sphere is left to [`super::view`], drawing to the parent
//! module.
//!
//! The plane has x towards growing longitude and y towards north. Points of the sphere are colatitude and longitude in
//! radians; longitude 0 on the equator is in the middle.

use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};
use std::fmt::Debug;

use glam::DVec3;
use longan_grid::directions;

pub use super::limits::GNOMONIC_SIZES;

/// A map of the sphere, or of a part of it, onto a region of the plane.
pub trait Projection: Debug + Send + Sync {
    /// Half the width and half the height of the region, which is centred on the origin.
    fn half_extent(&self) -> (f64, f64);

    /// Colatitude in [0, π] and longitude in [−π, π] of a point of the plane, or nothing outside the region.
    fn inverse(&self, x: f64, y: f64) -> Option<(f64, f64)>;

    /// The point of the plane, which may lie outside the region, or nothing where there is none.
    fn forward(&self, theta: f64, phi: f64) -> Option<(f64, f64)>;

    /// The region's boundary as closed polygons.
    fn outline(&self) -> Vec<Vec<(f64, f64)>>;

    /// Where neighbours on the sphere are none in the plane.
    fn cut(&self) -> Cut;

    /// Whether the region is a rectangle.
    fn is_rectangle(&self) -> bool {
        false
    }
}

/// Where a projection cuts the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Along the meridian of ±180°.
    Meridian,
    /// Along the great circle at 90° from the middle.
    Limb,
}

/// Points of an ellipse about the origin.
fn ellipse(centre: f64, a: f64, b: f64) -> Vec<(f64, f64)> {
    let corner = |i: u16| (2.0 * PI * f64::from(i) / 720.0).sin_cos();
    (0..720).map(corner).map(|(sin, cos)| (centre + a * cos, b * sin)).collect()
}

/// The rectangle of half this width and height.
fn rectangle((a, b): (f64, f64)) -> Vec<(f64, f64)> {
    vec![(-a, -b), (a, -b), (a, b), (-a, b)]
}

/// The unit vector to a colatitude and longitude in radians.
pub(super) fn vector(theta: f64, phi: f64) -> DVec3 {
    DVec3::from_array(directions::at_colatitude(theta, phi))
}

/// The unit vector to a longitude and latitude in degrees.
pub(super) fn vector_of_degrees(longitude: f64, latitude: f64) -> DVec3 {
    vector((90.0 - latitude).to_radians(), longitude.to_radians())
}

/// Colatitude and longitude of a vector.
pub(super) fn angles(at: DVec3) -> (f64, f64) {
    (at.x.hypot(at.y).atan2(at.z), at.y.atan2(at.x))
}

/// Mollweide's equal-area projection of the whole sphere onto an ellipse.
///
/// x = (2√2/π) φ sin β, y = √2 cos β with 2β − sin 2β = 2π sin²(θ/2): the usual form (Snyder 1987, "Map
/// Projections", USGS Professional Paper 1395, p. 251) written with colatitudes, which keeps all digits near the poles.
#[derive(Clone, Copy, Debug)]
pub struct Mollweide;

impl Projection for Mollweide {
    fn half_extent(&self) -> (f64, f64) {
        (2.0 * SQRT_2, SQRT_2)
    }

    fn inverse(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let cos_beta = y / SQRT_2;
        if cos_beta.abs() > 1.0 {
            return None;
        }
        let sin_beta = ((1.0 - cos_beta) * (1.0 + cos_beta)).sqrt();
        let reach = 2.0 * SQRT_2 * sin_beta;
        if x.abs() > reach {
            return None;
        }
        let beta = sin_beta.atan2(cos_beta);
        let theta = 2.0 * ((beta - sin_beta * cos_beta) / PI).clamp(0.0, 1.0).sqrt().asin();
        Some((theta, if reach > 0.0 { PI * (x / reach) } else { 0.0 }))
    }

    fn forward(&self, theta: f64, phi: f64) -> Option<(f64, f64)> {
        let southern = theta > PI / 2.0;
        let from_pole = if southern { PI - theta } else { theta };
        let beta = auxiliary(2.0 * PI * (from_pole / 2.0).sin().powi(2));
        let y = SQRT_2 * beta.cos();
        Some((2.0 * SQRT_2 / PI * wrapped(phi) * beta.sin(), if southern { -y } else { y }))
    }

    fn outline(&self) -> Vec<Vec<(f64, f64)>> {
        let (a, b) = self.half_extent();
        vec![ellipse(0.0, a, b)]
    }

    fn cut(&self) -> Cut {
        Cut::Meridian
    }
}

/// The β in [0, π/2] with 2β − sin 2β = c, for c in [0, π].
fn auxiliary(c: f64) -> f64 {
    // 4β³/3 is an upper bound of the left side, so this is left of the root. Newton's method then crosses the root
    // once and, the function being convex, comes down to it.
    let mut beta = (0.75 * c).cbrt();
    for _ in 0..16 {
        let slope = 4.0 * beta.sin().powi(2);
        if slope == 0.0 {
            break;
        }
        let step = (2.0 * beta - (2.0 * beta).sin() - c) / slope;
        beta -= step;
        if step.abs() <= 1e-16 * beta {
            break;
        }
    }
    beta
}

/// Hammer's equal-area projection of the whole sphere onto an ellipse: Lambert's azimuthal one of half the longitude,
/// stretched to twice its width.
#[derive(Clone, Copy, Debug)]
pub struct Hammer;

impl Projection for Hammer {
    fn half_extent(&self) -> (f64, f64) {
        (2.0 * SQRT_2, SQRT_2)
    }

    fn inverse(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let x = x / 2.0;
        let square = x * x + y * y;
        if square > 2.0 {
            return None;
        }
        let factor = (1.0 - square / 4.0).sqrt();
        let (theta, half) = angles(DVec3::new(1.0 - square / 2.0, x * factor, y * factor));
        Some((theta, 2.0 * half))
    }

    fn forward(&self, theta: f64, phi: f64) -> Option<(f64, f64)> {
        let at = vector(theta, wrapped(phi) / 2.0);
        let factor = (2.0 / (1.0 + at.x)).sqrt();
        Some((2.0 * factor * at.y, factor * at.z))
    }

    fn outline(&self) -> Vec<Vec<(f64, f64)>> {
        Mollweide.outline()
    }

    fn cut(&self) -> Cut {
        Cut::Meridian
    }
}

/// Longitude and latitude as they are.
#[derive(Clone, Copy, Debug)]
pub struct Equirectangular;

impl Projection for Equirectangular {
    fn half_extent(&self) -> (f64, f64) {
        (PI, FRAC_PI_2)
    }

    fn inverse(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        (x.abs() <= PI && y.abs() <= FRAC_PI_2).then_some((FRAC_PI_2 - y, x))
    }

    fn forward(&self, theta: f64, phi: f64) -> Option<(f64, f64)> {
        Some((wrapped(phi), FRAC_PI_2 - theta))
    }

    fn outline(&self) -> Vec<Vec<(f64, f64)>> {
        vec![rectangle(self.half_extent())]
    }

    fn cut(&self) -> Cut {
        Cut::Meridian
    }

    fn is_rectangle(&self) -> bool {
        true
    }
}

/// Both halves of the sphere as seen from afar, side by side: to the left that about the middle, to the right that
/// about its antipode.
#[derive(Clone, Copy, Debug)]
pub struct Orthographic;

/// Distance of each disc's centre from the origin, in radii.
const APART: f64 = 1.04;

impl Projection for Orthographic {
    fn half_extent(&self) -> (f64, f64) {
        (1.0 + APART, 1.0)
    }

    fn inverse(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let side = if x <= 0.0 { 1.0 } else { -1.0 };
        let x = x + side * APART;
        let square = x * x + y * y;
        (square <= 1.0).then(|| angles(DVec3::new(side * (1.0 - square).sqrt(), side * x, y)))
    }

    fn forward(&self, theta: f64, phi: f64) -> Option<(f64, f64)> {
        let at = vector(theta, phi);
        let side = if at.x >= 0.0 { 1.0 } else { -1.0 };
        Some((side * (at.y - APART), at.z))
    }

    fn outline(&self) -> Vec<Vec<(f64, f64)>> {
        [-APART, APART].map(|centre| ellipse(centre, 1.0, 1.0)).to_vec()
    }

    fn cut(&self) -> Cut {
        Cut::Limb
    }
}

/// A square about the middle as seen from the sphere's centre; great circles are straight.
#[derive(Clone, Copy, Debug)]
pub struct Gnomonic {
    /// The tangent of half the side.
    half: f64,
}

impl Gnomonic {
    /// A square of this side in degrees, within [`GNOMONIC_SIZES`].
    ///
    /// # Errors
    /// [`super::Error::GnomonicSize`] for any other.
    pub fn new(size: f64) -> Result<Self, super::Error> {
        if !GNOMONIC_SIZES.contains(&size) {
            return Err(super::Error::GnomonicSize { size });
        }
        Ok(Gnomonic { half: (size.to_radians() / 2.0).tan() })
    }
}

impl Projection for Gnomonic {
    fn half_extent(&self) -> (f64, f64) {
        (self.half, self.half)
    }

    fn inverse(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        (x.abs() <= self.half && y.abs() <= self.half).then(|| angles(DVec3::new(1.0, x, y)))
    }

    fn forward(&self, theta: f64, phi: f64) -> Option<(f64, f64)> {
        let at = vector(theta, phi);
        (at.x > 0.0).then(|| (at.y / at.x, at.z / at.x))
    }

    fn outline(&self) -> Vec<Vec<(f64, f64)>> {
        vec![rectangle(self.half_extent())]
    }

    fn cut(&self) -> Cut {
        Cut::Limb
    }

    fn is_rectangle(&self) -> bool {
        true
    }
}

/// A longitude brought to [−π, π].
fn wrapped(phi: f64) -> f64 {
    if phi.abs() <= PI { phi } else { (phi + PI).rem_euclid(2.0 * PI) - PI }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beyond this rounding is all that two ways of computing may differ by.
    const ROUNDING: f64 = 1e-12;

    fn all() -> Vec<Box<dyn Projection>> {
        let gnomonic = |size| Box::new(Gnomonic::new(size).unwrap());
        vec![
            Box::new(Mollweide),
            Box::new(Hammer),
            Box::new(Equirectangular),
            Box::new(Orthographic),
            gnomonic(10.0),
            gnomonic(120.0),
        ]
    }

    #[test]
    fn the_sphere_makes_the_round_trip() {
        for projection in all() {
            let mut shown = 0;
            for i in 0..=400 {
                for j in -40..=40 {
                    // At the very edge rounding decides on which side a point is.
                    let (theta, phi) = (PI * f64::from(i) / 400.0, 0.999 * PI * f64::from(j) / 40.0);
                    let Some((x, y)) = projection.forward(theta, phi) else { continue };
                    let Some(back) = projection.inverse(x, y) else { continue };
                    // An orthographic picture has few digits near the limb.
                    let from_limb = vector(theta, phi).x.abs();
                    let regular = !matches!(projection.cut(), Cut::Limb) || from_limb > 0.05;
                    shown += usize::from(regular);
                    let off = (vector(back.0, back.1) - vector(theta, phi)).length();
                    assert!(!regular || off < ROUNDING, "{projection:?} {theta} {phi}: {off}");
                }
            }
            let expected = match projection.half_extent().0 {
                a if projection.cut() == Cut::Meridian || a > 2.0 => 25_000,
                a if a > 1.0 => 5000,
                _ => 40,
            };
            assert!(shown > expected, "{projection:?}: {shown}");
        }
    }

    #[test]
    fn the_plane_makes_the_round_trip() {
        for projection in all() {
            let (a, b) = projection.half_extent();
            let mut inside = 0;
            for i in -100i32..=100 {
                for j in -50i32..=50 {
                    let (x, y) = (a * f64::from(i) / 100.0, b * f64::from(j) / 50.0);
                    let Some((theta, phi)) = projection.inverse(x, y) else { continue };
                    assert!((0.0..=PI).contains(&theta) && phi.abs() <= PI + ROUNDING, "{projection:?} ({x}, {y})");
                    inside += 1;
                    // On the outline a point may come back at the other side of the cut.
                    let edge = i.abs() == 100 || j.abs() == 50 || vector(theta, phi).x.abs() < 1e-6;
                    let (u, v) = projection.forward(theta, phi).unwrap();
                    let off = (u - x).hypot(v - y) / a;
                    assert!(edge || off < ROUNDING, "{projection:?} ({x}, {y}): ({u}, {v})");
                }
            }
            assert!(inside > 15_000, "{projection:?}: {inside}");
        }
    }

    #[test]
    fn what_is_outside_is_nowhere() {
        for projection in all() {
            let (a, b) = projection.half_extent();
            for (x, y) in [(1.001 * a, 0.0), (0.0, -1.001 * b), (3.0 * a, 3.0 * b)] {
                assert_eq!(projection.inverse(x, y), None, "{projection:?} ({x}, {y})");
            }
            if !projection.is_rectangle() {
                assert_eq!(projection.inverse(0.99 * a, 0.99 * b), None, "{projection:?}");
            }
        }
        assert_eq!(Orthographic.inverse(0.0, 0.0), None);
        assert_eq!(Gnomonic::new(90.0).unwrap().forward(1.0, PI), None);
    }

    #[test]
    fn the_middle_is_longitude_nought_and_the_poles_are_above_and_below() {
        for projection in all() {
            let middle = projection.forward(FRAC_PI_2, 0.0).unwrap();
            let expected = if projection.half_extent().0 == 1.0 + APART { -APART } else { 0.0 };
            assert!((middle.0 - expected).hypot(middle.1) < 1e-15, "{projection:?}");
            let east = projection.forward(FRAC_PI_2, 0.01).unwrap();
            let north = projection.forward(FRAC_PI_2 - 0.01, 0.0).unwrap();
            assert!(east.0 > middle.0 && north.1 > middle.1, "{projection:?}");
        }
        for projection in [&Mollweide as &dyn Projection, &Hammer] {
            for (theta, y) in [(0.0, SQRT_2), (PI, -SQRT_2)] {
                let (u, v) = projection.forward(theta, 1.0).unwrap();
                assert!(u.abs() < 1e-15 && (v - y).abs() < 1e-15, "{projection:?}: ({u}, {v})");
                // Just within the outline, where rounding does not decide.
                let (back, _) = projection.inverse(0.0, y * (1.0 - 1e-15)).unwrap();
                assert!((back - theta).abs() < 1e-7, "{projection:?}: {back}");
            }
        }
    }

    #[test]
    fn areas_are_kept() {
        // The determinant of the derivative by (cos θ, φ), by differences.
        let h = 1e-5;
        for projection in [&Mollweide as &dyn Projection, &Hammer] {
            for theta in [0.2, 0.9, FRAC_PI_2, 2.0, 2.9f64] {
                for phi in [-2.9, -1.0, 0.0, 0.4, 2.0, 3.0] {
                    let at = |theta: f64, phi: f64| projection.forward(theta, phi).unwrap();
                    let ((a, b), (c, d)) = (at(theta - h, phi), at(theta + h, phi));
                    let ((e, f), (g, i)) = (at(theta, phi + h), at(theta, phi - h));
                    let area = ((e - g) * (b - d) - (f - i) * (a - c)) / (4.0 * h * h);
                    assert!((area / theta.sin() - 1.0).abs() < 1e-7, "{projection:?} {theta} {phi}: {area}");
                }
            }
        }
        // The ellipse has the sphere's area, and the cap north of θ its share of it.
        let (a, b) = Mollweide.half_extent();
        assert!((PI * a * b - 4.0 * PI).abs() < 1e-12);
        for theta in [0.1, 0.7, 1.3f64] {
            let beta = (Mollweide.forward(theta, 0.0).unwrap().1 / b).acos();
            let segment = a * b * (beta - beta.sin() * beta.cos());
            assert!((segment - 2.0 * PI * (1.0 - theta.cos())).abs() < 1e-12);
        }
    }

    #[test]
    fn gnomonic_great_circles_are_straight() {
        let projection = Gnomonic::new(100.0).unwrap();
        for (a, b) in [((1.2, -0.5), (2.0, 0.6)), ((0.9, 0.1), (1.0, 0.7)), ((1.57, -0.7), (1.6, 0.7))] {
            let (from, to) = (vector(a.0, a.1), vector(b.0, b.1));
            let at = |t: f64| {
                let (theta, phi) = angles(from.lerp(to, t).normalize());
                projection.forward(theta, phi).unwrap()
            };
            let (p, q) = (at(0.0), at(1.0));
            for t in [0.1, 0.35, 0.8] {
                let r = at(t);
                let cross = (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0);
                assert!(cross.abs() < ROUNDING, "{cross}");
            }
        }
    }

    #[test]
    fn longitudes_are_wrapped() {
        for projection in all() {
            let (x, _) = projection.forward(1.0, 0.3).unwrap();
            for turns in [-2.0, 1.0, 3.0] {
                let (u, _) = projection.forward(1.0, 0.3 + turns * 2.0 * PI).unwrap();
                assert!((u - x).abs() < ROUNDING, "{projection:?}");
            }
        }
    }

    #[test]
    fn gnomonic_sizes_are_checked() {
        for size in [0.0, -1.0, 121.0, f64::NAN, f64::INFINITY] {
            assert!(Gnomonic::new(size).is_err(), "{size}");
        }
    }
}
