//! Pixels of an input ring that lie in the windows about an output ring. Both ways of summing ask here, and smoothing.
//! How far a disc reaches along a ring is left to [`longan_grid::disc`].

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use longan_grid::disc::{half_width, rings_within};
use longan_grid::{Healpix, Ring};

use crate::transport::RingTransport;

/// An output ring and the input rings that windows about its pixels reach.
#[derive(Debug)]
pub(crate) struct OutputRing {
    /// Its number.
    pub(crate) number: usize,
    /// Colatitude in radians.
    pub(crate) theta: f64,
    /// Radius of its windows in radians.
    pub(crate) radius: f64,
    ring: Ring,
    /// Pixels in a quadrant of the ring; all that follows is the same in each.
    pub(crate) in_quadrant: usize,
    /// Longitude of the first pixel and distance to the next, in radians.
    pub(crate) phi: (f64, f64),
    /// Input rings that may be reached.
    pub(crate) reach: Range<usize>,
}

/// An input ring that windows about an output ring reach.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    /// Pixels of the ring.
    pub(crate) len: usize,
    /// Longitude of the first pixel and distance to the next, in radians.
    pub(crate) phi: (f64, f64),
    /// Pixels to a radian.
    pub(crate) per_radian: f64,
    /// Largest |Δφ| within the window, in radians; π for the whole ring.
    pub(crate) half_width: f64,
    /// Transport from the ring to the output ring.
    pub(crate) transport: RingTransport,
}

impl OutputRing {
    /// An output ring and what a radius (radians; 0: the pixel itself) reaches from it.
    pub(crate) fn new(input: Healpix, output: Healpix, number: usize, radius: f64) -> Self {
        let ring = output.ring(number);
        OutputRing {
            number,
            theta: ring.theta(),
            radius,
            ring,
            in_quadrant: ring.len / 4,
            phi: (ring.phi(0), TAU / ring.len as f64),
            reach: if radius > 0.0 { rings_within(input, ring.theta(), radius) } else { number..number + 1 },
        }
    }

    /// An input ring with its number and colatitude, as seen from here; nothing where it is out of reach.
    pub(crate) fn reached(&self, number: usize, ring: &Ring, theta: f64, radius: f64) -> Option<Reached> {
        if !self.reach.contains(&number) {
            return None;
        }
        let half_width = half_width(radius, (self.theta, self.ring.sin_theta), (theta, ring.sin_theta))?;
        Some(Reached {
            len: ring.len,
            phi: (ring.phi(0), TAU / ring.len as f64),
            per_radian: ring.len as f64 / TAU,
            half_width,
            transport: RingTransport::new((ring.sin_theta, ring.cos_theta), (self.ring.sin_theta, self.ring.cos_theta)),
        })
    }

    /// Longitude in radians of the `k`-th pixel of the first quadrant.
    #[inline(always)]
    pub(crate) fn phi_of(&self, k: usize) -> f64 {
        self.phi.0 + k as f64 * self.phi.1
    }

    /// By how many pixels of an input ring the windows about neighbouring pixels differ, where that is a whole number.
    pub(crate) fn stride(&self, ring: &Reached) -> Option<usize> {
        let pixels = 4 * self.in_quadrant;
        ring.len.is_multiple_of(pixels).then(|| ring.len / pixels)
    }
}

impl Reached {
    /// The pixels from..to within the window about longitude `phi`, counted on beyond either end of the ring.
    #[inline(always)]
    pub(crate) fn span(&self, phi: f64) -> (isize, isize) {
        let offset = phi - self.phi.0;
        // Truncation is the floor of what is not negative.
        let beyond = (4 * self.len) as f64;
        let floor = |x: f64| (x * self.per_radian + beyond) as isize - 4 * self.len as isize;
        let from = floor(offset - self.half_width) + 1;
        let to = floor(offset + self.half_width) + 1;
        // The whole ring, and never a pixel twice.
        let limit = from + self.len as isize;
        (from, if self.half_width < PI { to.min(limit) } else { limit })
    }

    /// Longitude in radians of a pixel, counted on beyond either end of the ring.
    #[inline(always)]
    pub(crate) fn phi_of(&self, j: isize) -> f64 {
        self.phi.0 + j as f64 * self.phi.1
    }

    /// The place in the ring of a pixel counted in the first quadrant, `quadrant`s further on.
    #[inline(always)]
    pub(crate) fn column(&self, j: isize, quadrant: usize) -> usize {
        (j + (quadrant * self.len / 4) as isize).rem_euclid(self.len as isize) as usize
    }
}
