//! The HEALPix grid: rings, pixel centres, and the two orderings.
//!
//! The closed forms of the RING scheme hold for every Nside, not only powers of two
//! (Górski et al. 2005, ApJ 622, 759, section 5). Everything else, such as the NESTED scheme or finding the
//! pixel under a point, is left to `cdshealpix`.
//!
//! Rings are counted from 1 at the north to 4 Nside − 1 at the south.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::Error;

/// The finest Nside that is used without being asked for: 12.6 million pixels, 100 MB.
const FINEST: usize = 1 << 10;

/// How the pixels of a file are numbered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Ordering {
    /// Along rings of constant colatitude, from the north.
    Ring,
    /// Along the tree of the twelve base pixels; Nside is a power of two.
    Nested,
}

impl std::fmt::Display for Ordering {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Ordering::Ring => "RING",
            Ordering::Nested => "NESTED",
        })
    }
}

/// The largest Nside that HEALPix defines.
pub const NSIDE_MAX: usize = 1 << 29;

/// A HEALPix grid of a given Nside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Healpix {
    nside: usize,
}

/// One ring of pixels of equal colatitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// RING index of the ring's first pixel.
    pub start: usize,
    /// Number of pixels, a multiple of four.
    pub len: usize,
    /// cos θ of the pixel centres.
    pub cos_theta: f64,
    /// sin θ of the pixel centres, without cancellation near the poles.
    pub sin_theta: f64,
    /// Whether the first centre lies half a pixel east of φ = 0 (else at φ = 0).
    pub shifted: bool,
}

impl Ring {
    /// Longitude of the centre of the ring's `j`-th pixel, in radians. `j` may lie outside `0..len`.
    pub fn phi(&self, j: isize) -> f64 {
        (2 * j + isize::from(self.shifted)) as f64 * (TAU / (2 * self.len) as f64)
    }

    /// Colatitude in radians.
    pub fn theta(&self) -> f64 {
        self.sin_theta.atan2(self.cos_theta)
    }
}

impl Healpix {
    /// The twelve base pixels.
    pub(crate) const BASE: Healpix = Healpix { nside: 1 };

    /// The grid of this Nside.
    ///
    /// # Errors
    /// [`Error::Nside`] for 0 or more than [`NSIDE_MAX`].
    pub fn new(nside: usize) -> Result<Self, Error> {
        if (1..=NSIDE_MAX).contains(&nside) { Ok(Healpix { nside }) } else { Err(Error::Nside { nside }) }
    }

    /// The grid that has this many pixels, if there is one.
    pub fn with_pixels(pixels: usize) -> Option<Self> {
        let nside = ((pixels / 12) as f64).sqrt().round() as usize;
        (pixels > 0 && 12 * nside * nside == pixels).then_some(Healpix { nside })
    }

    /// Pixels along the side of a base pixel.
    pub fn nside(self) -> usize {
        self.nside
    }

    /// Number of pixels, 12 Nside².
    pub fn pixels(self) -> usize {
        12 * self.nside * self.nside
    }

    /// The side, in radians, of a square as large as a pixel.
    pub fn pixel_side(self) -> f64 {
        (4.0 * PI / self.pixels() as f64).sqrt()
    }

    /// Number of rings, 4 Nside − 1.
    pub fn rings(self) -> usize {
        4 * self.nside - 1
    }

    /// The `i`-th ring, `1..=self.rings()`.
    pub fn ring(self, i: usize) -> Ring {
        let n = self.nside;
        debug_assert!((1..=self.rings()).contains(&i));
        let from_pole = i.min(4 * n - i);
        let (len, cos_north, sin_theta, shifted) = if from_pole < n {
            // 1 − cos θ, exact where cos θ is nearly 1.
            let versine = (from_pole as f64 / n as f64).powi(2) / 3.0;
            (4 * from_pole, 1.0 - versine, (versine * (2.0 - versine)).sqrt(), true)
        } else {
            let z = 2.0 * (2 * n - from_pole) as f64 / (3 * n) as f64;
            (4 * n, z, ((1.0 - z) * (1.0 + z)).sqrt(), (from_pole - n).is_multiple_of(2))
        };
        let southern = i > 2 * n;
        let start_of = |i: usize| if i <= n { 2 * i * (i - 1) } else { 2 * n * (n - 1) + (i - n) * 4 * n };
        Ring {
            start: if i <= 3 * n { start_of(i) } else { self.pixels() - 2 * from_pole * (from_pole + 1) },
            len,
            cos_theta: if southern { -cos_north } else { cos_north },
            sin_theta,
            shifted,
        }
    }

    /// The ring, `1..=self.rings()`, on which a pixel (RING index) lies.
    pub fn ring_of(self, pixel: usize) -> usize {
        let (n, cap) = (self.nside, 2 * self.nside * (self.nside - 1));
        // The cap ring i starts at 2 i (i − 1).
        let in_cap = |p: usize| {
            let mut i = ((1.0 + (1.0 + 2.0 * p as f64).sqrt()) / 2.0) as usize;
            while 2 * i * (i - 1) > p {
                i -= 1;
            }
            while 2 * i * (i + 1) <= p {
                i += 1;
            }
            i
        };
        if pixel < cap {
            in_cap(pixel)
        } else if pixel < self.pixels() - cap {
            n + (pixel - cap) / (4 * n)
        } else {
            4 * n - in_cap(self.pixels() - 1 - pixel)
        }
    }

    /// Colatitude and longitude of a pixel's centre (RING index), in radians.
    pub fn centre(self, pixel: usize) -> (f64, f64) {
        let ring = self.ring(self.ring_of(pixel));
        (ring.theta(), ring.phi((pixel - ring.start) as isize))
    }

    /// The pixel (RING index) that contains a point; colatitude and longitude in radians.
    pub fn pixel_at(self, theta: f64, phi: f64) -> usize {
        cdshealpix::ring::hash(self.nside as u32, phi.rem_euclid(TAU), FRAC_PI_2 - theta) as usize
    }

    /// Whether the NESTED scheme exists for this Nside.
    pub fn has_nested(self) -> bool {
        self.nside.is_power_of_two()
    }

    /// Depth in the NESTED tree, log2 Nside.
    ///
    /// # Errors
    /// [`Error::NotNested`] where Nside is not a power of two.
    pub fn depth(self) -> Result<u8, Error> {
        if self.has_nested() {
            Ok(self.nside.trailing_zeros() as u8)
        } else {
            Err(Error::NotNested { nside: self.nside })
        }
    }
}

/// The Nside, a power of two, of the pixels whose size is closest to a distance; no finer than the finest that is used
/// unasked.
pub(crate) fn closest_nside(spacing: f64) -> usize {
    let depth = (Healpix::BASE.pixel_side() / spacing).log2().round();
    1 << (depth.clamp(0.0, f64::from(FINEST.ilog2())) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NSIDES: [usize; 9] = [1, 2, 3, 4, 5, 7, 8, 12, 33];

    #[test]
    fn rings_are_contiguous_and_cover_the_grid() {
        for nside in NSIDES {
            let grid = Healpix::new(nside).unwrap();
            let mut next = 0;
            for i in 1..=grid.rings() {
                let ring = grid.ring(i);
                assert_eq!(ring.start, next, "Nside {nside}, ring {i}");
                for p in [ring.start, ring.start + ring.len - 1] {
                    assert_eq!(grid.ring_of(p), i);
                }
                next += ring.len;
            }
            assert_eq!(next, grid.pixels());
        }
    }

    #[test]
    fn centres_agree_with_cdshealpix() {
        for nside in NSIDES {
            let grid = Healpix::new(nside).unwrap();
            for p in 0..grid.pixels() {
                let (theta, phi) = grid.centre(p);
                let (lon, lat) = cdshealpix::ring::center(nside as u32, p as u64);
                assert!((theta - (FRAC_PI_2 - lat)).abs() < 1e-13, "Nside {nside}, pixel {p}");
                assert!(((phi - lon + 1.0).rem_euclid(TAU) - 1.0).abs() < 1e-13, "Nside {nside}, pixel {p}");
                assert_eq!(grid.pixel_at(theta, phi), p);
            }
        }
    }

    #[test]
    fn pixel_counts_are_recognised() {
        assert_eq!(Healpix::with_pixels(12 * 9).map(Healpix::nside), Some(3));
        assert_eq!(Healpix::with_pixels(0), None);
        assert_eq!(Healpix::with_pixels(100), None);
    }

    #[test]
    fn the_pixel_closest_to_a_spacing() {
        for nside in [1usize, 2, 64, 1024] {
            let size = Healpix::new(nside).unwrap().pixel_side();
            for factor in [0.72, 1.0, 1.4] {
                let expected = if nside == 1024 && factor < 1.0 { 1024 } else { nside };
                assert_eq!(closest_nside(size * factor), expected);
            }
        }
        assert_eq!(closest_nside(PI), 1);
        assert_eq!(closest_nside(1e-12), 1024);
    }
}
