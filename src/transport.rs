//! Parallel transport of tangent vectors along geodesics of the unit sphere.
//!
//! Along the geodesic from x to w a tangent vector v goes over into v − (v·w)/(1 + x·w) (x + w). Tangent vectors are
//! counted here by their angle, from e_θ (south, 0) towards e_φ (east, π/2), so transport is a phase: the angle at w
//! is the angle at x plus δ, and a moment of rank s takes the factor e^{isδ}.
//! (Collischon et al. 2024, Commun. Phys. 7; the closed form follows by inserting e_θ(x).)

use glam::DVec3;
use num_complex::Complex64;

use crate::cells::Geometry;

/// The factor e^{iδ} of transport to a fixed point w from any point of one ring of colatitude.
///
/// With Δφ = φ_x − φ_w it is
/// (sin θ_x sin θ_w + (1 + cos θ_x cos θ_w) cos Δφ + i (cos θ_x + cos θ_w) sin Δφ) / (1 + x·w).
#[derive(Clone, Copy, Debug)]
pub struct RingTransport {
    sines: f64,
    one_plus_cosines: f64,
    sum_of_cosines: f64,
}

impl RingTransport {
    /// From the ring of colatitude θ_x to a point of colatitude θ_w, each given as (sin θ, cos θ).
    pub fn new((sin_x, cos_x): (f64, f64), (sin_w, cos_w): (f64, f64)) -> Self {
        RingTransport { sines: sin_x * sin_w, one_plus_cosines: 1.0 + cos_x * cos_w, sum_of_cosines: cos_x + cos_w }
    }

    /// dδ/dΔφ.
    pub fn rate(&self, dphi: f64) -> f64 {
        // δ = 2 atan(t tan(Δφ/2)) with t its rate at 0.
        let t = self.sum_of_cosines / (self.one_plus_cosines + self.sines);
        let (sin, cos) = (dphi / 2.0).sin_cos();
        t / (cos * cos + t * t * sin * sin)
    }

    /// e^{iδ} for a difference Δφ = φ_x − φ_w of longitude; 1 at the antipode, where no geodesic is singled out.
    #[inline(always)]
    pub fn phase(&self, cos_dphi: f64, sin_dphi: f64) -> Complex64 {
        let one_plus_dot = self.one_plus_cosines + self.sines * cos_dphi;
        if one_plus_dot > ANTIPODE {
            let scale = 1.0 / one_plus_dot;
            let re = (self.sines + self.one_plus_cosines * cos_dphi) * scale;
            Complex64::new(re, self.sum_of_cosines * sin_dphi * scale)
        } else {
            Complex64::ONE
        }
    }
}

/// Below this value of 1 + x·w the points are taken as antipodes.
pub const ANTIPODE: f64 = 1e-15;

/// The tangent vector v at x, where x is `midpoint` over its length, as e^{iϕ} at each corner of a cell after
/// transport there. v is a unit vector at right angles to x.
#[inline(always)]
pub fn to_corners(v: DVec3, midpoint: DVec3, length: f64, geometry: &Geometry) -> Phases<4> {
    let mut phases = Phases::default();
    let (v, x, frames) = (v.to_array(), midpoint.to_array(), &geometry.frames);
    for c in 0..4 {
        let dot = |a: [f64; 3], b: &[[f64; 4]; 3]| a[0] * b[0][c] + a[1] * b[1][c] + a[2] * b[2][c];
        let dot_east = |a: [f64; 3]| a[0] * frames.east[0][c] + a[1] * frames.east[1][c];
        // Both frames at w are at right angles to w, so only the part of x + w along x counts.
        let along = dot(v, &frames.at) / (length + dot(x, &frames.at));
        phases.re[c] = dot(v, &frames.south) - along * dot(x, &frames.south);
        phases.im[c] = dot_east(v) - along * dot_east(x);
    }
    phases
}

/// Unit complex numbers, N at a time.
#[derive(Clone, Copy, Debug)]
pub struct Phases<const N: usize> {
    /// Real parts.
    pub re: [f64; N],
    /// Imaginary parts.
    pub im: [f64; N],
}

impl<const N: usize> Default for Phases<N> {
    /// All 1.
    fn default() -> Self {
        Phases { re: [1.0; N], im: [0.0; N] }
    }
}

impl<const N: usize> From<[Complex64; N]> for Phases<N> {
    fn from(phases: [Complex64; N]) -> Self {
        Phases { re: phases.map(|phase| phase.re), im: phases.map(|phase| phase.im) }
    }
}

impl<const N: usize> Phases<N> {
    #[inline(always)]
    fn multiply(&mut self, by: &Self) {
        for k in 0..N {
            let (re, im) = (self.re[k], self.im[k]);
            self.re[k] = re * by.re[k] - im * by.im[k];
            self.im[k] = re * by.im[k] + im * by.re[k];
        }
    }
}

/// Ascending powers of phases, each made from the one before.
#[derive(Clone, Copy, Debug)]
pub struct Powers<const N: usize> {
    base: Phases<N>,
    power: Phases<N>,
    rank: u32,
}

impl<const N: usize> Powers<N> {
    /// Starts at the power 1.
    #[inline(always)]
    pub fn new(base: Phases<N>) -> Self {
        Powers { base, power: base, rank: 1 }
    }

    /// The powers `rank` ≥ 1, which must not be below the last one asked for.
    #[inline(always)]
    pub fn raise(&mut self, rank: u32) -> &Phases<N> {
        let mut missing = rank - self.rank;
        self.rank = rank;
        if missing == 1 {
            self.power.multiply(&self.base);
            return &self.power;
        }
        let mut square = self.base;
        while missing > 0 {
            if missing & 1 == 1 {
                self.power.multiply(&square);
            }
            missing >>= 1;
            if missing > 0 {
                let factor = square;
                square.multiply(&factor);
            }
        }
        &self.power
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    fn frame(theta: f64, phi: f64) -> (DVec3, DVec3, DVec3) {
        let ((st, ct), (sp, cp)) = (theta.sin_cos(), phi.sin_cos());
        (dvec3(st * cp, st * sp, ct), dvec3(ct * cp, ct * sp, -st), dvec3(-sp, cp, 0.0))
    }

    #[test]
    fn the_phase_is_the_vector_formula() {
        for (tx, px, tw, pw) in [
            (0.3, 0.2, 0.5, 1.9),
            (1.5, 6.0, 1.6, 0.1),
            (3.0, 1.0, 0.4, 3.0),
            (0.01, 4.0, 0.02, 0.5),
            (1.0, 2.0, 1.0, 2.0),
        ] {
            let ((x, south, _), (w, south_w, east_w)) = (frame(tx, px), frame(tw, pw));
            let moved = south - (x + w) * (south.dot(w) / (1.0 + x.dot(w)));
            let (sin, cos) = (f64::sin(px - pw), f64::cos(px - pw));
            let phase = RingTransport::new(tx.sin_cos(), tw.sin_cos()).phase(cos, sin);
            assert!((phase.re - moved.dot(south_w)).abs() < 1e-14);
            assert!((phase.im - moved.dot(east_w)).abs() < 1e-14);
        }
    }

    #[test]
    fn there_and_back_is_nothing() {
        let (there, back) = (
            RingTransport::new(0.7f64.sin_cos(), 1.1f64.sin_cos()).phase(0.8, 0.6),
            RingTransport::new(1.1f64.sin_cos(), 0.7f64.sin_cos()).phase(0.8, -0.6),
        );
        assert!((there * back - 1.0).norm() < 1e-15);
    }

    #[test]
    fn the_antipode_does_no_harm() {
        let phase = RingTransport::new((1.0, 0.0), (1.0, 0.0)).phase(-1.0, 0.0);
        assert_eq!(phase, Complex64::ONE);
    }
}
