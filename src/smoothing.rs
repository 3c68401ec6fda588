//! Gaussian smoothing on the sphere, of maps with masked pixels.
//!
//! The kernel is the Gaussian of the sphere (that of heat on it), K(γ) = Σ (2l+1)/(4π) exp(−l(l+1)σ²/2) P_l(cos γ) with
//! σ = FWHM/√(8 ln 2), which multiplies the harmonics of a map by exp(−l(l+1)σ²/2). A smoothed pixel is the mean of all
//! unmasked pixels, weighted by the kernel at their distances and by the areas that they stand for; masked pixels stay
//! masked. What is smoothed, and why, is left to others.

use std::f64::consts::{LN_2, PI};

use longan_grid::{Healpix, Ring};
use rayon::prelude::*;

use crate::window::reach::OutputRing;

/// The kernel ends where a Gaussian has fallen to this share of its peak: so little is missing of its integral.
const NEGLIGIBLE: f64 = 1e-10;

/// Intervals of the kernel's table: between their ends, cubics are off by less than 10⁻¹⁰ of its peak.
const INTERVALS: usize = 4096;

/// Terms of the kernel's series below this share of their sum are lost in its rounding.
const ROUNDING: f64 = 1e-18;

/// Sides of a pixel that the width at half maximum must span: pixels do not resolve a narrower kernel.
const PIXELS_PER_FWHM: f64 = 2.0;

/// Full width at half maximum, in sides of a pixel, of the kernel whose sums make out which areas pixels stand for. Of
/// those from 2 to 4 it is the one that makes smoothing by any width most accurate.
const AREA_FWHM: f64 = 3.0;

/// Areas are found when these sums are as near to integrals about all pixels, or after so many steps. Beyond, they gain
/// nothing.
const AREA_TOLERANCE: f64 = 1e-5;
const STEPS_MAX: usize = 100;

/// Why a map cannot be smoothed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SmoothingError {
    /// A width that is none.
    #[error("a full width at half maximum of {degrees} degrees is not above 0 and at most 180")]
    Width {
        /// The width.
        degrees: f64,
    },
    /// A width that pixels do not resolve.
    #[error(
        "a full width at half maximum of {degrees} degrees is less than two pixels of Nside {nside}, {least:.4} degrees; choose a larger one"
    )]
    Narrow {
        /// The width.
        degrees: f64,
        /// The Nside.
        nside: usize,
        /// The least width.
        least: f64,
    },
    /// A map on another grid.
    #[error("a map of {found} pixels cannot be smoothed as one of Nside {nside}; bring it to that Nside")]
    Pixels {
        /// Pixels of the map.
        found: usize,
        /// The Nside.
        nside: usize,
    },
}

/// Smoothing by one width on one grid.
#[derive(Clone, Debug)]
pub struct Smoothing {
    sums: Sums,
    kernel: Kernel,
    /// The areas that pixels stand for.
    areas: Vec<f64>,
    /// The sum of all weights about each pixel.
    whole: Vec<f64>,
}

/// Sums over pixels about pixels.
#[derive(Clone, Debug)]
struct Sums {
    grid: Healpix,
    rings: Vec<RingOfPixels>,
}

/// A ring with what its pixels' distances need.
#[derive(Clone, Debug)]
struct RingOfPixels {
    ring: Ring,
    theta: f64,
    /// Cosine and sine of each pixel's longitude.
    cos_sin: Vec<(f64, f64)>,
}

impl Smoothing {
    /// Smoothing by a full width at half maximum in degrees.
    ///
    /// # Errors
    /// [`SmoothingError::Width`], [`SmoothingError::Narrow`].
    pub fn new(grid: Healpix, fwhm: f64) -> Result<Self, SmoothingError> {
        if !(fwhm > 0.0 && fwhm <= 180.0) {
            return Err(SmoothingError::Width { degrees: fwhm });
        }
        let pixel = grid.pixel_side().to_degrees();
        let least = PIXELS_PER_FWHM * pixel;
        if fwhm < least {
            return Err(SmoothingError::Narrow { degrees: fwhm, nside: grid.nside(), least });
        }
        let sums = Sums::new(grid);
        let areas = sums.areas(AREA_FWHM * pixel);
        let kernel = Kernel::new(sigma(fwhm));
        let whole = sums.weighted(&kernel, &[&areas]).swap_remove(0);
        Ok(Smoothing { sums, kernel, areas, whole })
    }

    /// Smooths maps together, which takes less time than one by one: values in RING order, NaN where masked. The result
    /// does not depend on the number of threads.
    ///
    /// # Errors
    /// [`SmoothingError::Pixels`].
    pub fn apply(&self, maps: &[&[f64]]) -> Result<Vec<Vec<f64>>, SmoothingError> {
        let grid = self.sums.grid;
        if let Some(map) = maps.iter().find(|map| map.len() != grid.pixels()) {
            return Err(SmoothingError::Pixels { found: map.len(), nside: grid.nside() });
        }
        let filled = |map: &&[f64]| -> Vec<f64> {
            map.iter().zip(&self.areas).map(|(v, area)| if v.is_nan() { 0.0 } else { v * area }).collect()
        };
        let present = |map: &&[f64]| -> Vec<f64> {
            map.iter().zip(&self.areas).map(|(v, area)| if v.is_nan() { 0.0 } else { *area }).collect()
        };
        let masked: Vec<&[f64]> = maps.iter().copied().filter(|map| map.iter().any(|v| v.is_nan())).collect();
        let columns: Vec<Vec<f64>> = maps.iter().map(filled).chain(masked.iter().map(present)).collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let mut values = self.sums.weighted(&self.kernel, &columns);
        let mut weights = values.split_off(maps.len()).into_iter();
        let mean = |(values, map): (Vec<f64>, &&[f64])| {
            let weights = map.iter().any(|v| v.is_nan()).then(|| weights.next()).flatten();
            let weights = weights.as_ref().unwrap_or(&self.whole);
            let pixels = values.iter().zip(weights).zip(*map);
            pixels.map(|((sum, weight), old)| if old.is_nan() { f64::NAN } else { sum / weight }).collect()
        };
        Ok(values.into_iter().zip(maps).map(mean).collect())
    }
}

/// The σ in radians of a full width at half maximum in degrees.
fn sigma(fwhm: f64) -> f64 {
    fwhm.to_radians() / (8.0 * LN_2).sqrt()
}

impl Sums {
    fn new(grid: Healpix) -> Self {
        let ring = |number| {
            let ring = grid.ring(number);
            let cos_sin = (0..ring.len as isize).map(|j| ring.phi(j).sin_cos()).map(|(sin, cos)| (cos, sin)).collect();
            RingOfPixels { ring, theta: ring.theta(), cos_sin }
        };
        Sums { grid, rings: (1..=grid.rings()).map(ring).collect() }
    }

    /// The areas that pixels stand for in sums, in units of their own: such that the sum over a kernel of this width is 1
    /// about every pixel, and so that over any wider one. Without them sums are off by some 10⁻³ where the faces of the
    /// grid meet. By conjugate gradients.
    fn areas(&self, fwhm: f64) -> Vec<f64> {
        let pixels = self.grid.pixels();
        let kernel = Kernel::new(sigma(fwhm));
        let scale = kernel.integral_share(pixels);
        let sums = |values: &[f64]| -> Vec<f64> {
            let sums = self.weighted(&kernel, &[values]).swap_remove(0);
            sums.into_iter().map(|sum| sum * scale).collect()
        };
        let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let mut areas = vec![1.0; pixels];
        let mut rest: Vec<f64> = sums(&areas).into_iter().map(|sum| 1.0 - sum).collect();
        let mut direction = rest.clone();
        let mut square = product(&rest, &rest);
        for _ in 0..STEPS_MAX {
            if rest.iter().all(|rest| rest.abs() <= AREA_TOLERANCE) {
                break;
            }
            let along = sums(&direction);
            let step = square / product(&direction, &along);
            areas.iter_mut().zip(&direction).for_each(|(area, direction)| *area += step * direction);
            rest.iter_mut().zip(&along).for_each(|(rest, along)| *rest -= step * along);
            let last = std::mem::replace(&mut square, product(&rest, &rest));
            direction
                .iter_mut()
                .zip(&rest)
                .for_each(|(direction, rest)| *direction = rest + square / last * *direction);
        }
        areas
    }

    /// The sums of each of some maps about all pixels, weighted by a kernel.
    fn weighted(&self, kernel: &Kernel, maps: &[&[f64]]) -> Vec<Vec<f64>> {
        let rings: Vec<Vec<Vec<f64>>> =
            (1..=self.grid.rings()).into_par_iter().map(|number| self.ring(kernel, number, maps)).collect();
        (0..maps.len()).map(|i| rings.iter().flat_map(|maps| &maps[i]).copied().collect()).collect()
    }

    /// One ring of them. What is about a pixel of one quadrant differs by quarter turns only from what is about those of
    /// the others.
    fn ring(&self, kernel: &Kernel, number: usize, maps: &[&[f64]]) -> Vec<Vec<f64>> {
        let from = OutputRing::new(self.grid, self.grid, number, kernel.radius);
        let at = &self.rings[number - 1];
        let reached: Vec<_> = from
            .reach
            .clone()
            .filter_map(|i| {
                let to = &self.rings[i - 1];
                Some((to, from.reached(i, &to.ring, to.theta, kernel.radius)?))
            })
            .collect();
        let mut sums = vec![vec![0.0; at.ring.len]; maps.len()];
        let mut weights = Vec::new();
        for k in 0..from.in_quadrant {
            for (to, reached) in &reached {
                let (first, end) = reached.span(from.phi_of(k));
                at.weigh(kernel, &mut weights, k, to, reached.column(first, 0), (end - first).max(0) as usize);
                for (map, sums) in maps.iter().zip(&mut sums) {
                    let ring = &map[to.ring.start..to.ring.start + to.ring.len];
                    for quadrant in 0..4 {
                        sums[quadrant * from.in_quadrant + k] += along(ring, reached.column(first, quadrant), &weights);
                    }
                }
            }
        }
        sums
    }
}

impl RingOfPixels {
    /// A kernel from the `k`-th pixel of this ring to pixels of another from a column on.
    fn weigh(&self, kernel: &Kernel, weights: &mut Vec<f64>, k: usize, to: &Self, column: usize, count: usize) {
        // The squared chord is 4 sin²(Δθ/2) + 2 sin θ sin θ' (1 − cos Δφ).
        let apart = 4.0 * ((self.theta - to.theta) / 2.0).sin().powi(2);
        let along = 2.0 * self.ring.sin_theta * to.ring.sin_theta;
        let (cos_k, sin_k) = self.cos_sin[k];
        let pixels = to.cos_sin.iter().cycle().skip(column).take(count);
        weights.clear();
        weights.extend(pixels.map(|(cos, sin)| kernel.at(apart + along * (1.0 - cos * cos_k - sin * sin_k))));
    }
}

/// The weighted sum of a ring's values from a column on, around its end.
fn along(ring: &[f64], column: usize, weights: &[f64]) -> f64 {
    let (head, tail) = weights.split_at(weights.len().min(ring.len() - column));
    dot(head, &ring[column..]) + dot(tail, ring)
}

/// Σ a b over the shorter of both, in four interleaved sums.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let ((a, a_rest), (b, b_rest)) = (a[..n].split_at(n - n % 4), b[..n].split_at(n - n % 4));
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// The Gaussian of the sphere, tabulated; its peak is 1.
#[derive(Clone, Debug)]
struct Kernel {
    /// Where it ends, in radians.
    radius: f64,
    /// Its integral in steradian.
    integral: f64,
    /// Intervals in a unit of the squared chord.
    per_unit: f64,
    /// For each interval the coefficients of a cubic in the share of the interval that has passed.
    cubics: Vec<[f64; 4]>,
}

impl Kernel {
    /// The kernel of a σ in radians.
    fn new(sigma: f64) -> Self {
        let radius = (sigma * (-2.0 * NEGLIGIBLE.ln()).sqrt()).min(PI);
        let step = 4.0 * (radius / 2.0).sin().powi(2) / INTERVALS as f64;
        let series = Series::new(sigma);
        let peak = series.at(1.0);
        // One node beyond either end; there, too, the series has a value.
        let nodes: Vec<f64> = (-1..=INTERVALS as isize + 1)
            .into_par_iter()
            .map(|node| series.at(1.0 - node as f64 * step / 2.0) / peak)
            .collect();
        let cubic = |v: &[f64]| {
            let (a, b, c, d) = (v[0], v[1], v[2], v[3]);
            [b, c - b / 2.0 - a / 3.0 - d / 6.0, (a + c) / 2.0 - b, (d - a) / 6.0 + (b - c) / 2.0]
        };
        Kernel {
            radius,
            integral: 4.0 * PI / peak,
            per_unit: 1.0 / step,
            cubics: nodes.windows(4).map(cubic).collect(),
        }
    }

    /// What a sum over so many pixels of equal area is multiplied by to be 1 for 1.
    fn integral_share(&self, pixels: usize) -> f64 {
        4.0 * PI / (pixels as f64 * self.integral)
    }

    /// Its value at a squared chord.
    #[inline(always)]
    fn at(&self, chord_sq: f64) -> f64 {
        let x = chord_sq * self.per_unit;
        // A little below 0 from rounding is 0, and a little beyond the end still on the last cubic.
        let interval = (x as usize).min(self.cubics.len() - 1);
        let [a, b, c, d] = self.cubics[interval];
        let x = x - interval as f64;
        a + x * (b + x * (c + x * d))
    }
}

/// The kernel's harmonics.
struct Series(Vec<f64>);

impl Series {
    /// (2l+1) exp(−l(l+1)σ²/2) for each l, as far as they matter.
    fn new(sigma: f64) -> Self {
        let term = |l: usize| (2 * l + 1) as f64 * (-0.5 * (l * (l + 1)) as f64 * sigma * sigma).exp();
        let (mut terms, mut sum) = (Vec::new(), 0.0);
        // Terms grow up to about 1/σ before they fall.
        while terms.last().is_none_or(|last| *last > ROUNDING * sum) || (terms.len() as f64) * sigma < 1.0 {
            terms.push(term(terms.len()));
            sum += terms[terms.len() - 1];
        }
        Series(terms)
    }

    /// Their sum with the Legendre polynomials, at cos γ.
    fn at(&self, cos: f64) -> f64 {
        let (mut last, mut this, mut sum) = (0.0, 1.0, 0.0);
        for (l, term) in self.0.iter().enumerate() {
            sum += term * this;
            let l = l as f64;
            (last, this) = (this, ((2.0 * l + 1.0) * cos * this - l * last) / (l + 1.0));
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// The weighted mean about each pixel, by the series itself at all other pixels.
    fn directly(grid: Healpix, fwhm: f64, areas: &[f64], map: &[f64]) -> Vec<f64> {
        let series = Series::new(sigma(fwhm));
        let centres: Vec<[f64; 3]> = (0..grid.pixels())
            .map(|p| grid.centre(p))
            .map(|(t, p)| [t.sin() * p.cos(), t.sin() * p.sin(), t.cos()])
            .collect();
        let smoothed = |here: usize| {
            let (mut sum, mut all) = (0.0, 0.0);
            for (there, value) in map.iter().enumerate().filter(|(_, v)| !v.is_nan()) {
                let cos: f64 = (0..3).map(|i| centres[here][i] * centres[there][i]).sum();
                let weight = areas[there] * series.at(cos.clamp(-1.0, 1.0));
                sum += weight * value;
                all += weight;
            }
            if map[here].is_nan() { f64::NAN } else { sum / all }
        };
        (0..map.len()).into_par_iter().map(smoothed).collect()
    }

    #[test]
    fn smoothing_is_the_direct_sum() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (nside, fwhm) in [(8, 15.0), (8, 40.0), (8, 120.0), (5, 180.0), (2, 60.0), (1, 180.0)] {
            let grid = Healpix::new(nside).unwrap();
            let mut map = |masked: f64| -> Vec<f64> {
                let mut value =
                    |_| if rng.random_range(0.0..1.0) < masked { f64::NAN } else { rng.random_range(-1.0..1.0) };
                (0..grid.pixels()).map(&mut value).collect()
            };
            let maps = [map(0.0), map(0.3), vec![f64::NAN; grid.pixels()]];
            let smoothing = Smoothing::new(grid, fwhm).unwrap();
            let found = smoothing.apply(&[&maps[0], &maps[1], &maps[2]]).unwrap();
            for (map, found) in maps.iter().zip(&found) {
                for (found, expected) in found.iter().zip(directly(grid, fwhm, &smoothing.areas, map)) {
                    let same = found.is_nan() && expected.is_nan() || (found - expected).abs() < 2e-9;
                    assert!(same, "Nside {nside}, {fwhm} degrees: {found} instead of {expected}");
                }
            }
            assert_eq!(smoothing.apply(&[&maps[0]]).unwrap()[0], found[0]);
        }
    }

    #[test]
    fn the_table_is_the_series() {
        for sigma in [0.005f64, 0.05, 0.3, 0.6, 1.3] {
            let (kernel, series) = (Kernel::new(sigma), Series::new(sigma));
            for i in 0..=10_000 {
                let angle = kernel.radius * f64::from(i) / 10_000.0;
                let exact = series.at(angle.cos()) / series.at(1.0);
                let found = kernel.at(4.0 * (angle / 2.0).sin().powi(2));
                assert!((found - exact).abs() < 1e-10, "{sigma}, {angle}: {found} instead of {exact}");
            }
            assert!(kernel.radius == PI || series.at(kernel.radius.cos()) / series.at(1.0) < 3.0 * NEGLIGIBLE);
        }
    }

    #[test]
    fn areas_make_sums_integrals() {
        for nside in [8, 16, 33] {
            let grid = Healpix::new(nside).unwrap();
            let areas = Smoothing::new(grid, 180.0).unwrap().areas;
            let off = |areas: &[f64], power: i32, mean: f64| {
                let terms = areas.iter().enumerate().map(|(p, area)| area * grid.centre(p).0.cos().powi(power));
                (terms.sum::<f64>() / areas.len() as f64 - mean).abs()
            };
            // The means over the sphere of powers of z are 1/(power + 1) or 0.
            for (power, mean) in [(0, 1.0), (1, 0.0), (2, 1.0 / 3.0), (3, 0.0), (4, 0.2)] {
                assert!(off(&areas, power, mean) < 1e-5, "Nside {nside}, z^{power}: {}", off(&areas, power, mean));
            }
            assert!(off(&areas, 4, 0.2) < 0.1 * off(&vec![1.0; grid.pixels()], 4, 0.2), "Nside {nside}");
            assert!(areas.iter().all(|area| (0.8..1.25).contains(area)), "Nside {nside}");
        }
    }

    #[test]
    fn a_constant_stays_whatever_the_mask() {
        let grid = Healpix::new(16).unwrap();
        let map: Vec<f64> = (0..grid.pixels()).map(|p| if p % 7 < 3 { f64::NAN } else { 2.5 }).collect();
        let found = Smoothing::new(grid, 20.0).unwrap().apply(&[&map]).unwrap().remove(0);
        for (found, map) in found.iter().zip(&map) {
            assert!(found.is_nan() == map.is_nan() && (map.is_nan() || (found - map).abs() < 1e-12));
        }
    }

    #[test]
    fn what_is_no_width_is_refused() {
        let grid = Healpix::new(16).unwrap();
        for fwhm in [0.0, -1.0, 180.1, f64::NAN, f64::INFINITY] {
            assert!(matches!(Smoothing::new(grid, fwhm), Err(SmoothingError::Width { .. })));
        }
        assert!(matches!(Smoothing::new(grid, 7.3), Err(SmoothingError::Narrow { nside: 16, .. })));
        let smoothing = Smoothing::new(grid, 7.4).unwrap();
        assert_eq!(smoothing.apply(&[&[1.0]]), Err(SmoothingError::Pixels { found: 1, nside: 16 }));
    }
}
