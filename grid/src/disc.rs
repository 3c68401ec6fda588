//! Discs on the sphere: the pixels whose centres lie within an angle of a point, ring by ring.
//!
//! The distance d of two points with colatitudes θ, θ′ and longitudes φ, φ′ follows from
//! sin²(d/2) = sin²((θ − θ′)/2) + sin θ sin θ′ sin²((φ − φ′)/2), which is free of cancellation at small distances.
//! Windows, regions and peaks ask here. Distances between directions that are not pixels are left to
//! [`directions`](crate::directions).

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

use crate::{Healpix, Ring};

/// A point whose distance exceeds the radius by no more than this, in radians, belongs to the disc: a centre on the edge
/// does not leave it by rounding.
pub const EDGE: f64 = 1e-12;

/// All points within an angle of a centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    theta: f64,
    sin_theta: f64,
    phi: f64,
    radius: f64,
}

impl Disc {
    /// The disc about a centre of colatitude `theta` and longitude `phi`; these and the radius in radians. A radius of π or
    /// more is the whole sphere.
    pub fn new(theta: f64, phi: f64, radius: f64) -> Self {
        Disc { theta, sin_theta: theta.sin(), phi, radius }
    }

    /// The disc about a longitude and latitude; these and the radius in degrees.
    pub fn from_degrees(longitude: f64, latitude: f64, radius: f64) -> Self {
        Disc::new(FRAC_PI_2 - latitude.to_radians(), longitude.to_radians(), radius.to_radians())
    }

    /// The pixels (RING indices) whose centres lie in the disc, each once, from the northernmost ring to the
    /// southernmost. The time is that of the pixels and rings in the disc, not of the grid.
    pub fn pixels(&self, grid: Healpix) -> impl Iterator<Item = usize> {
        let disc = *self;
        rings_within(grid, self.theta, self.radius).flat_map(move |number| {
            let ring = grid.ring(number);
            disc.columns(&ring).map(move |column| ring.start + column.rem_euclid(ring.len as isize) as usize)
        })
    }

    /// For each pixel of a grid, in RING order, whether its centre lies in the disc.
    pub fn mask(&self, grid: Healpix) -> Vec<bool> {
        let mut mask = vec![false; grid.pixels()];
        self.pixels(grid).for_each(|pixel| mask[pixel] = true);
        mask
    }

    /// The pixels of a ring that lie in the disc, counted on beyond either end of the ring.
    fn columns(&self, ring: &Ring) -> Range<isize> {
        let (theta, len) = (ring.theta(), ring.len as isize);
        let Some(half_width) = half_width(self.radius, (self.theta, self.sin_theta), (theta, ring.sin_theta)) else {
            return 0..0;
        };
        if half_width >= PI {
            return 0..len;
        }
        let column = |phi: f64| (phi - ring.phi(0)) * (ring.len as f64 / TAU);
        let first = column(self.phi - half_width).floor() as isize;
        let last = column(self.phi + half_width).ceil() as isize;
        // The ends are rounded; the distance itself decides.
        let across = ((theta - self.theta) / 2.0).sin().powi(2);
        let limit = ((self.radius + EDGE) / 2.0).sin().powi(2);
        let is_within = |column: &isize| {
            let along = ((ring.phi(*column) - self.phi) / 2.0).sin().powi(2);
            across + ring.sin_theta * self.sin_theta * along <= limit
        };
        let Some(from) = (first..=last).find(is_within) else { return 0..0 };
        let past = (from..=last).rev().find(is_within).map_or(from, |last| last + 1);
        from..past.min(from + len)
    }
}

/// The largest difference of longitude, in radians, at which points of one colatitude lie within a radius of a point of
/// another; π where all do, nothing where none does. Each colatitude comes with its sine, all angles in radians.
#[inline]
pub fn half_width(radius: f64, (theta, sin_theta): (f64, f64), (other, sin_other): (f64, f64)) -> Option<f64> {
    let half = (radius + EDGE) / 2.0;
    if half >= FRAC_PI_2 {
        return Some(PI);
    }
    let left = half.sin().powi(2) - ((theta - other) / 2.0).sin().powi(2);
    if left < 0.0 {
        return None;
    }
    // About a pole, all of a ring is at one distance.
    let sin_sq = left / (sin_theta * sin_other);
    Some(if sin_sq < 1.0 { 2.0 * sin_sq.sqrt().asin() } else { PI })
}

/// The rings that may have pixels within a radius of colatitude `theta`, both in radians: all that do, and up to one more
/// on each side.
pub fn rings_within(grid: Healpix, theta: f64, radius: f64) -> Range<usize> {
    let first_south_of = |theta: f64| {
        let (mut north, mut south) = (1, grid.rings() + 1);
        while north < south {
            let middle = (north + south) / 2;
            if grid.ring(middle).theta() < theta { north = middle + 1 } else { south = middle }
        }
        north
    };
    let (north, south) = (first_south_of(theta - radius), first_south_of(theta + radius));
    north.saturating_sub(1).max(1)..(south + 1).min(grid.rings() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directions;

    #[test]
    fn pixels_are_those_that_near() {
        for nside in [1, 3, 8, 16] {
            let grid = Healpix::new(nside).unwrap();
            for (longitude, latitude) in [(0.0, 0.0), (-170.0, 71.0), (340.0, -90.0), (45.0, 90.0), (700.0, 41.8)] {
                let centre = directions::at(f64::to_radians(longitude), f64::to_radians(latitude));
                for radius in [0.0, 1.0, 7.3, 30.0, 89.0, 90.0, 123.0, 179.0, 180.0] {
                    let disc = Disc::from_degrees(longitude, latitude, radius);
                    let mut found: Vec<usize> = disc.pixels(grid).collect();
                    let mask = disc.mask(grid);
                    assert_eq!(found.len(), mask.iter().filter(|within| **within).count());
                    found.sort_unstable();
                    let distance = |p: usize| {
                        let (theta, phi) = grid.centre(p);
                        let to = directions::at_colatitude(theta, phi);
                        let squared: f64 = to.iter().zip(centre).map(|(a, b)| (a - b).powi(2)).sum();
                        directions::angle(squared).to_degrees()
                    };
                    for p in 0..grid.pixels() {
                        let distance = distance(p);
                        // Chords near 180 degrees lose half of the digits.
                        let slack = if distance > 170.0 { 1e-6 } else { 1e-10 };
                        if (distance - radius).abs() > slack {
                            assert_eq!(
                                mask[p],
                                distance < radius,
                                "Nside {nside}, {longitude},{latitude},{radius}: pixel {p} at {distance}"
                            );
                        }
                    }
                    assert!(found.iter().all(|&p| mask[p]));
                }
            }
        }
    }

    #[test]
    fn centres_on_the_edge_belong_to_the_disc() {
        let grid = Healpix::new(16).unwrap();
        // Neighbours on the equator are 5.625 degrees apart.
        let disc = |radius| Disc::from_degrees(2.8125, 0.0, radius).pixels(grid).count();
        assert!(disc(5.625) >= disc(5.62) + 2);
        assert_eq!(disc(5.625), disc(5.625 + 1e-9));
    }

    #[test]
    fn rings_beyond_are_out_of_reach() {
        let grid = Healpix::new(8).unwrap();
        assert_eq!(rings_within(grid, 1.0, PI), 1..32);
        for number in 1..=grid.rings() {
            let theta = grid.ring(number).theta();
            assert!(rings_within(grid, theta, 0.0).contains(&number));
            assert!(rings_within(grid, theta, 0.3).len() < 12);
        }
    }
}
