//! The area, length and curvature expected of an isotropic Gaussian field at a threshold, from its two scales.
//!
//! σ0² is the field's variance and σ1² that of its gradient. With ν = (t − mean)/σ0, per area of the unit sphere
//! (Tomita 1986; Schmalzing & Górski 1998, MNRAS 297, 355; Collischon et al. 2024):
//!
//! - area of the body: W0/A = ½ erfc(ν/√2),
//! - length of the contour: W1/A = (σ1/σ0) e^{−ν²/2} / (2√2),
//! - its total curvature: W2/A = (σ1/σ0)² ν e^{−ν²/2} / (2√(2π)),
//!
//! and so χ/A = (W0 + W2)/(2πA), for the body above the threshold. Below it, W0/A is 1 less that and W2/A the negative.
//!
//! σ1 comes from the map itself, from the cells of the dual grid that have no masked corner, weighted by area. At each
//! corner the differences of the values along the two edges give the gradient in the plane that these span, and the
//! mean of its square over the corners is the square of the gradient in the cell. Differences over the length h of an
//! edge fall short of it where the field curves, by some ⟨(∂_x² f)²⟩ h²/6; in an isotropic field ⟨(∂_x² f)²⟩ is
//! 3 ⟨(∂_x ∂_y f)²⟩, and ∂_x ∂_y f is the difference of the differences along opposite edges, so that this is added
//! back. What remains is of fourth order in h. For a correlation C(r) = e^{−r²/2ℓ²} σ1 is short by less than 0.2 % from
//! ℓ = 3 h on, 1 % for 2 h, 4 % for 1 h; for values that are independent from pixel to pixel, which have no gradient, it is √6 σ0/h.

use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

use longan_grid::Map;
use rayon::prelude::*;

use crate::cells::{CellRing, Geometry};
use crate::contour::Body;
use crate::statistics::statistics;
use crate::totals::Totals;

/// The scales of a Gaussian field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Mean of the field.
    pub mean: f64,
    /// Its standard deviation σ0.
    pub sigma0: f64,
    /// The standard deviation σ1 of its gradient: the root mean square of |∇f|, to the radian.
    pub sigma1: f64,
}

impl Gaussian {
    /// The scales of a map; `None` where it has no scatter, or no cell without masked corners.
    pub fn of(map: &Map) -> Option<Self> {
        let of_map = statistics(map.values())?;
        let known = of_map.mean.is_finite() && of_map.sigma.is_finite() && of_map.sigma > 0.0;
        let slope = known.then(|| slope(map, of_map.sigma)).flatten()?;
        Some(Gaussian { mean: of_map.mean, sigma0: of_map.sigma, sigma1: slope * of_map.sigma })
    }

    /// W0, W1 and W2 per area, expected at a threshold in the field's unit.
    pub fn per_area(&self, threshold: f64, body: Body) -> Totals {
        let nu = threshold / self.sigma0 - self.mean / self.sigma0;
        let slope = self.sigma1 / self.sigma0;
        let decline = (-nu * nu / 2.0).exp();
        let side = if body == Body::Above { 1.0 } else { -1.0 };
        Totals {
            area: 0.5 * libm::erfc(side * nu * FRAC_1_SQRT_2),
            length: slope * decline / (2.0 * SQRT_2),
            curvature: side * slope * slope * nu * decline / (2.0 * (2.0 * PI).sqrt()),
        }
    }
}

/// σ1/σ0 of a map.
fn slope(map: &Map, sigma0: f64) -> Option<f64> {
    let rings: Vec<(f64, f64)> =
        (0..=4 * map.grid().nside()).into_par_iter().map(|ring| of_ring(map, ring, sigma0)).collect();
    // Summed in the order of the rings, so that the number of threads makes no difference.
    let (square, area) = rings.into_iter().fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    (area > 0.0).then(|| (square / area).max(0.0).sqrt())
}

/// The integral of |∇f|²/σ0² over the unmasked cells of a ring, and their area.
fn of_ring(map: &Map, ring: usize, sigma0: f64) -> (f64, f64) {
    let ring = CellRing::new(map.grid(), ring);
    let (mut square, mut area) = (0.0, 0.0);
    let mut known: Option<Edges> = None;
    for k in 0..ring.stencils {
        let stencil = ring.stencil(k);
        if !ring.uniform {
            known = None;
        }
        let edges = known.get_or_insert_with(|| Edges::new(&ring.geometry(&stencil)));
        for sector in 0..ring.sectors {
            let values = stencil.pixels(sector).map(|pixel| map.values()[pixel.index] / sigma0);
            if values.iter().all(|value| !value.is_nan()) {
                square += edges.area * edges.square(&values);
                area += edges.area;
            }
        }
    }
    (square, area)
}

/// The geometry that turns differences along the edges of a cell into gradients.
struct Edges {
    count: usize,
    area: f64,
    /// For each corner |b|²/Δ, a·b/Δ and |a|²/Δ with a and b the edges to the next corner and to the last, and
    /// Δ = |a|²|b|² − (a·b)²: the inverse of their Gram matrix.
    inverse: [[f64; 3]; 4],
    /// The factor of the square of f0 − f1 + f2 − f3.
    twist: f64,
}

impl Edges {
    fn new(geometry: &Geometry) -> Self {
        let (corner, count) = (&geometry.corner, geometry.count);
        let mut inverse = [[0.0; 3]; 4];
        for c in 0..count {
            let (a, b) = (corner[(c + 1) % count] - corner[c], corner[(c + count - 1) % count] - corner[c]);
            let (aa, ab, bb) = (a.length_squared(), a.dot(b), b.length_squared());
            inverse[c] = [bb, ab, aa].map(|x| x / (aa * bb - ab * ab));
        }
        let [p, q, r, s] = corner;
        let (a, b) = ((q - p + r - s) * 0.5, (s - p + r - q) * 0.5);
        let (aa, ab, bb) = (a.length_squared(), a.dot(b), b.length_squared());
        // In a parallelogram and for a wave vector k of any direction: the mean square of the gradient from differences
        // is short by |k|⁴ · 3/8 (|a|² + |b|²)/Δ (|a|²|b|²/12 − (a·b)²/3), that of f0 − f1 + f2 − f3 is
        // |k|⁴/8 (|a|²|b|² + 2 (a·b)²).
        let (product, overlap) = (aa * bb, ab * ab);
        let short = 3.0 * (aa + bb) / (product - overlap) * (product / 12.0 - overlap / 3.0);
        let twist = if count == 4 { short / (product + 2.0 * overlap) } else { 0.0 };
        Edges { count, area: geometry.area(), inverse, twist }
    }

    /// The mean of |∇f|².
    fn square(&self, f: &[f64; 4]) -> f64 {
        let mut sum = 0.0;
        for c in 0..self.count {
            let (a, b) = (f[(c + 1) % self.count] - f[c], f[(c + self.count - 1) % self.count] - f[c]);
            let [aa, ab, bb] = self.inverse[c];
            sum += aa * a * a - 2.0 * ab * a * b + bb * b * b;
        }
        sum / self.count as f64 + self.twist * ((f[0] - f[1]) + (f[2] - f[3])).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Waves;
    use longan_grid::Healpix;

    fn map(nside: usize, value: impl Fn(f64, f64) -> f64) -> Map {
        let grid = Healpix::new(nside).unwrap();
        let values = (0..grid.pixels()).map(|p| {
            let (theta, phi) = grid.centre(p);
            value(theta, phi)
        });
        Map::new("", values.collect()).unwrap()
    }

    #[test]
    fn the_gradient_of_a_harmonic_is_known() {
        // ∫|∇Y|² = l(l + 1) ∫Y²: for cos θ a slope of √2, for sin²θ cos 2φ of √6.
        for (l, field) in [
            (1.0, map(32, |theta, _| theta.cos())),
            (1.0, map(32, |theta, phi| 1e100 * theta.sin() * phi.cos() + 3e100)),
            (2.0, map(32, |theta, phi| 1e-100 * theta.sin().powi(2) * (2.0 * phi).cos())),
        ] {
            let gaussian = Gaussian::of(&field).unwrap();
            let slope = gaussian.sigma1 / gaussian.sigma0;
            assert!((slope / f64::sqrt(l * (l + 1.0)) - 1.0).abs() < 1e-3, "{l}: {slope}");
        }
    }

    #[test]
    fn masked_cells_are_left_out() {
        // Of cos θ with all but the belt masked: |∇f|² = sin²θ is near 1 there.
        let belt = map(64, |theta, _| if (theta - PI / 2.0).abs() < 0.1 { theta.cos() } else { f64::NAN });
        assert!((Gaussian::of(&belt).unwrap().sigma1 - 1.0).abs() < 3e-3);
        // Two pixels that are no neighbours.
        let values = (0..192).map(|p| if p % 100 == 10 { f64::from(p) } else { f64::NAN });
        assert_eq!(Gaussian::of(&Map::new("", values.collect()).unwrap()), None);
        assert_eq!(Gaussian::of(&map(4, |_, _| 7.0)), None);
        assert_eq!(Gaussian::of(&map(4, |_, _| f64::NAN)), None);
    }

    /// The mean over skies of σ1² from the map over that of the ensemble, and its standard error.
    fn ratio(correlation: f64, nside: usize, skies: u64) -> (f64, f64) {
        let grid = Healpix::new(nside).unwrap();
        let ratios: Vec<f64> = (0..skies)
            .map(|seed| {
                let waves = Waves::new(correlation, seed).unwrap();
                (Gaussian::of(&waves.map(grid)).unwrap().sigma1 / waves.sigma1()).powi(2)
            })
            .collect();
        let mean = ratios.iter().sum::<f64>() / skies as f64;
        let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (skies - 1) as f64;
        (mean, (variance / skies as f64).sqrt())
    }

    #[test]
    fn sigma1_is_that_of_the_ensemble() {
        // Pixels of Nside 64 are 0.92° wide. By Student's distribution the mean of 36 is beyond 4 standard errors in 3 of
        // 10 000 cases. An error of 0.01 in σ1² is one of 0.5 % in σ1.
        let (mean, error) = ratio(6.0, 64, 36);
        assert!(error < 0.01 && (mean - 1.0).abs() < 4.0 * error, "{mean} ± {error}");
        // With ℓ of two pixels, and of one, it falls short by what is documented.
        for (correlation, lowest) in [(3.66, 0.98), (1.83, 0.91)] {
            let (mean, error) = ratio(correlation, 32, 6);
            assert!(mean < 1.0 + 4.0 * error && mean > lowest - 4.0 * error, "{correlation}: {mean} ± {error}");
        }
    }

    #[test]
    fn the_two_sides_make_the_whole() {
        let gaussian = Gaussian { mean: 2.0, sigma0: 3.0, sigma1: 40.0 };
        for threshold in [-7.0, 2.0, 4.5] {
            let [above, below] = [Body::Above, Body::Below].map(|body| gaussian.per_area(threshold, body));
            assert!((above.area + below.area - 1.0).abs() < 1e-15);
            assert_eq!((above.length, above.curvature), (below.length, -below.curvature));
            // χ of the two adds up to that of the sphere but for the contour, which has none.
            let euler = above.euler_characteristic() + below.euler_characteristic();
            assert!((4.0 * PI * euler - 2.0).abs() < 1e-12);
        }
    }
}
