//! Projections between the sphere and the plane. Drawing is left to the parent module.
//!
//! The plane has x towards growing longitude and y towards north; a picture may mirror x. Points of the sphere are
//! colatitude and longitude in radians.

use std::f64::consts::{PI, SQRT_2};

/// A map of the sphere, or of a part of it, onto a region of the plane.
pub trait Projection: Sync {
    /// Half the width and half the height of the region, which is centred on the origin.
    fn half_extent(&self) -> (f64, f64);

    /// Colatitude in [0, π] and longitude in [−π, π] of a point of the plane, or nothing outside the region.
    fn inverse(&self, x: f64, y: f64) -> Option<(f64, f64)>;

    /// The point of the plane, or nothing where the point of the sphere is not shown.
    fn forward(&self, theta: f64, phi: f64) -> Option<(f64, f64)>;

    /// The region's boundary as a closed polygon.
    fn outline(&self) -> Vec<(f64, f64)>;
}

/// Mollweide's equal-area projection of the whole sphere onto an ellipse, longitude 0 in the middle.
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

    fn outline(&self) -> Vec<(f64, f64)> {
        let (a, b) = self.half_extent();
        (0..720).map(|i| (2.0 * PI * f64::from(i) / 720.0).sin_cos()).map(|(sin, cos)| (a * cos, b * sin)).collect()
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

/// A longitude brought to [−π, π].
fn wrapped(phi: f64) -> f64 {
    if phi.abs() <= PI { phi } else { (phi + PI).rem_euclid(2.0 * PI) - PI }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sphere_makes_the_round_trip() {
        for i in 0..=400 {
            for j in -40..=40 {
                // At the very edge rounding decides on which side a point is.
                let (theta, phi) = (PI * f64::from(i) / 400.0, 0.999 * PI * f64::from(j) / 40.0);
                let (x, y) = Mollweide.forward(theta, phi).unwrap();
                let (t, p) = Mollweide.inverse(x, y).unwrap();
                assert!((t - theta).abs() < 1e-12, "{theta} {phi}: {t}");
                assert!(((p - phi) * theta.sin()).abs() < 1e-12, "{theta} {phi}: {p}");
            }
        }
    }

    #[test]
    fn the_plane_makes_the_round_trip() {
        let (a, b) = Mollweide.half_extent();
        let mut inside = 0;
        for i in -100..=100 {
            for j in -50..=50 {
                let (x, y) = (a * f64::from(i) / 100.0, b * f64::from(j) / 50.0);
                let in_ellipse = (x / a).powi(2) + (y / b).powi(2);
                let Some((theta, phi)) = Mollweide.inverse(x, y) else {
                    assert!(in_ellipse > 1.0 - 1e-12);
                    continue;
                };
                inside += 1;
                assert!(in_ellipse < 1.0 + 1e-12);
                let (u, v) = Mollweide.forward(theta, phi).unwrap();
                assert!((u - x).abs() < 1e-12 && (v - y).abs() < 1e-12, "({x}, {y}): ({u}, {v})");
            }
        }
        assert!(inside > 15_000);
    }

    #[test]
    fn areas_are_kept() {
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
    fn longitudes_are_wrapped() {
        let (x, _) = Mollweide.forward(1.0, 0.3).unwrap();
        for turns in [-2.0, 1.0, 3.0] {
            assert!((Mollweide.forward(1.0, 0.3 + turns * 2.0 * PI).unwrap().0 - x).abs() < 1e-12);
        }
    }
}
