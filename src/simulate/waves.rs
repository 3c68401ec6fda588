//! An isotropic Gaussian random field as a sum of random plane waves.
//!
//! f(x) = √(2/M) Σ cos(k_m · x + α_m) over x on the unit sphere, with Gaussian k_m of variance 1/ℓ² a component and
//! uniform α_m. Its covariance at the chord r is C(r) = exp(−r²/(2ℓ²)); hence σ0² = Var f = C(0) = 1 and
//! σ1² = Var |∇f| = −2 C″(0) = 2/ℓ².

use std::f64::consts::TAU;

use longan_grid::{Healpix, Map, Ring};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};

use super::Error;

/// Number of plane waves M: the excess kurtosis at a point is −3/(2M), and C(r) is exact to 1/M.
pub const WAVES: usize = 1024;

/// Pixels handled at a time, few enough to stay in the first-level cache.
const BLOCK: usize = 512;

/// Fewest pixels a correlation angle should span.
const PIXELS_PER_CORRELATION: f64 = 2.0;

/// A wave vector and its phase, both divided by 2π: arguments are counted in turns.
#[derive(Clone, Copy, Debug)]
struct Wave {
    k: [f64; 3],
    phase: f64,
}

/// One realisation of the field, defined everywhere on the sphere.
#[derive(Clone, Debug)]
pub struct Waves {
    correlation: f64,
    waves: Vec<Wave>,
}

impl Waves {
    /// The realisation of a seed, with the correlation angle ℓ in degrees.
    ///
    /// The same seed gives the same field on every machine (up to rounding in the system's sine and cosine) and with
    /// any number of threads. The wave vectors are drawn such that their second moments Σ k kᵀ / M are exactly those of
    /// the ensemble, so that no realisation prefers a direction.
    ///
    /// # Errors
    /// [`Error::CorrelationAngle`] unless 0 < ℓ ≤ 90.
    pub fn new(correlation_degrees: f64, seed: u64) -> Result<Self, Error> {
        if !(correlation_degrees > 0.0 && correlation_degrees <= 90.0) {
            return Err(Error::CorrelationAngle { degrees: correlation_degrees });
        }
        let correlation = correlation_degrees.to_radians();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let [x, y, z] = whitened(std::array::from_fn(|_| StandardNormal.sample_iter(&mut rng).take(WAVES).collect()));
        let phases = StandardUniform.sample_iter(&mut rng);
        let unit = 1.0 / (correlation * TAU);
        let waves = (0..WAVES)
            .zip(phases)
            .map(|(m, phase)| Wave { k: [x[m] * unit, y[m] * unit, z[m] * unit], phase })
            .collect();
        Ok(Waves { correlation, waves })
    }

    /// The field at the pixel centres of a grid.
    pub fn map(&self, grid: Healpix) -> Map {
        super::map("waves", grid, |ring, values| self.fill(ring, values))
    }

    /// σ0, the standard deviation of the field.
    pub fn sigma0(&self) -> f64 {
        1.0
    }

    /// σ1 = √2/ℓ, the root mean square of |∇f| in rad⁻¹: of the ensemble, and averaged over the sphere and the phases
    /// also of this realisation.
    pub fn sigma1(&self) -> f64 {
        2f64.sqrt() / self.correlation
    }

    /// What a user should know before measuring this field on a grid.
    pub fn warning(&self, grid: Healpix) -> Option<Warning> {
        let correlation = self.correlation.to_degrees();
        let pixel = grid.pixel_side().to_degrees();
        (correlation < PIXELS_PER_CORRELATION * pixel).then_some(Warning::Unresolved { correlation, pixel })
    }

    fn fill(&self, ring: Ring, values: &mut [f64]) {
        let amplitude = (2.0 / WAVES as f64).sqrt();
        let (mut cos_phi, mut sin_phi) = ([0.0; BLOCK], [0.0; BLOCK]);
        for (b, block) in values.chunks_mut(BLOCK).enumerate() {
            for (j, (c, s)) in cos_phi.iter_mut().zip(&mut sin_phi).take(block.len()).enumerate() {
                (*s, *c) = ring.phi((b * BLOCK + j) as isize).sin_cos();
            }
            block.fill(0.0);
            for Wave { k, phase } in &self.waves {
                let along = k[2] * ring.cos_theta + phase;
                add_wave(block, &cos_phi, &sin_phi, along, k[0] * ring.sin_theta, k[1] * ring.sin_theta);
            }
            block.iter_mut().for_each(|v| *v *= amplitude);
        }
    }
}

/// Advice on a field that can be computed all the same.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The correlation angle spans fewer than two pixels, so that contours cut corners.
    Unresolved {
        /// Correlation angle in degrees.
        correlation: f64,
        /// Side of a pixel (root of its area) in degrees.
        pixel: f64,
    },
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Warning::Unresolved { correlation, pixel } => write!(
                f,
                "a correlation angle of {correlation:.3}° is under two pixels of {pixel:.3}°: contour lengths will be \
                 short and the Euler characteristic off; raise Nside or the correlation angle"
            ),
        }
    }
}

/// The three columns of components, made orthogonal and of mean square 1 (Gram–Schmidt).
fn whitened(mut columns: [Vec<f64>; 3]) -> [Vec<f64>; 3] {
    let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / WAVES as f64;
    for i in 0..columns.len() {
        let (done, rest) = columns.split_at_mut(i);
        let column = &mut rest[0];
        for other in done {
            let overlap = mean(other, column);
            column.iter_mut().zip(other.iter()).for_each(|(c, o)| *c -= overlap * o);
        }
        let norm = mean(column, column).sqrt();
        column.iter_mut().for_each(|c| *c /= norm);
    }
    columns
}

/// Adds cos 2π(along + x cos φ + y sin φ) to every value. A function of its own, so that the loop is vectorised.
#[inline(never)]
fn add_wave(values: &mut [f64], cos_phi: &[f64; BLOCK], sin_phi: &[f64; BLOCK], along: f64, x: f64, y: f64) {
    for ((v, c), s) in values.iter_mut().zip(cos_phi).zip(sin_phi) {
        *v += cos_turns(along + x * c + y * s);
    }
}

/// cos 2πu to 1e-11 for |u| < 2⁵⁰, without branches.
#[inline]
fn cos_turns(u: f64) -> f64 {
    /// Adding and subtracting this rounds to the nearest integer.
    const ROUND: f64 = 1.5 * (1u64 << 52) as f64;
    let fraction = u - ((u + ROUND) - ROUND);
    // cos 2πr = sin 2π(1/4 − |r|), whose argument is within ±π/2: Taylor's series to t¹⁵.
    let t = TAU * (0.25 - fraction.abs());
    let t2 = t * t;
    t * SINE[..7].iter().rev().fold(SINE[7], |sum, c| sum * t2 + c)
}

/// Taylor coefficients of sin: (−1)^k / (2k + 1)!.
const SINE: [f64; 8] = {
    let mut c = [1.0; 8];
    let mut k = 1;
    while k < c.len() {
        c[k] = -c[k - 1] / (2 * k * (2 * k + 1)) as f64;
        k += 1;
    }
    c
};

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(nside: usize) -> Healpix {
        Healpix::new(nside).unwrap()
    }

    /// Realisations for statistics.
    fn maps(degrees: f64, nside: usize) -> Vec<Map> {
        (0..12).map(|seed| Waves::new(degrees, seed).unwrap().map(grid(nside))).collect()
    }

    fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
        let (sum, n) = values.into_iter().fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        sum / n
    }

    /// Mean of a statistic over the maps, and its standard error.
    fn over(maps: &[Map], statistic: impl Fn(&Map) -> f64) -> (f64, f64) {
        let values: Vec<f64> = maps.iter().map(statistic).collect();
        let m = mean(values.iter().copied());
        let variance = mean(values.iter().map(|v| (v - m).powi(2)));
        (m, (variance / (values.len() - 1) as f64).sqrt())
    }

    #[test]
    fn the_cosine_is_accurate() {
        for i in -4000..4000 {
            let u = f64::from(i) * 0.0317 + 0.001;
            let exact = (TAU * u.rem_euclid(1.0)).cos();
            assert!((cos_turns(u) - exact).abs() < 1e-11, "{u}: {}", cos_turns(u) - exact);
        }
    }

    #[test]
    fn a_map_is_the_sum_of_its_waves() {
        let field = Waves::new(3.0, 5).unwrap();
        for nside in [1, 3, 256] {
            let map = field.map(grid(nside));
            for p in (0..map.grid().pixels()).step_by(map.grid().pixels() / 11) {
                let (theta, phi) = map.grid().centre(p);
                let x = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
                let slow: f64 = field
                    .waves
                    .iter()
                    .map(|w| (TAU * (w.k[0] * x[0] + w.k[1] * x[1] + w.k[2] * x[2] + w.phase)).cos())
                    .sum::<f64>()
                    * (2.0 / WAVES as f64).sqrt();
                assert!((map.values()[p] - slow).abs() < 1e-9, "Nside {nside}, pixel {p}");
            }
        }
    }

    #[test]
    fn a_seed_is_one_field_with_any_number_of_threads() {
        let map = |threads, seed| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Waves::new(5.0, seed).unwrap().map(grid(16))).values().to_vec()
        };
        assert_eq!(map(1, 3), map(3, 3));
        assert_ne!(map(1, 3), map(1, 4));
    }

    #[test]
    fn wave_vectors_have_exact_second_moments() {
        let field = Waves::new(10.0, 1).unwrap();
        let turns = 10f64.to_radians() * TAU;
        for a in 0..3 {
            for b in 0..3 {
                let moment = mean(field.waves.iter().map(|w| w.k[a] * w.k[b] * turns * turns));
                assert!((moment - f64::from(a == b)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn mean_and_variance_are_those_of_the_ensemble() {
        let maps = maps(6.0, 32);
        let l2 = 6f64.to_radians().powi(2);
        // Variances of the mean and of the mean square over the sphere: averages of C and of 2C².
        let mean_error = (l2 / 2.0 * (1.0 - (-2.0 / l2).exp()) / maps.len() as f64).sqrt();
        let square_error = (l2 / 2.0 * (1.0 - (-4.0 / l2).exp()) / maps.len() as f64).sqrt();
        let (average, _) = over(&maps, |map| mean(map.values().iter().copied()));
        let (square, _) = over(&maps, |map| mean(map.values().iter().map(|v| v * v)));
        assert!(average.abs() < 3.0 * mean_error, "{average} ± {mean_error}");
        assert!((square - 1.0).abs() < 3.0 * square_error, "{square} ± {square_error}");
    }

    #[test]
    fn the_area_above_a_threshold_is_gaussian() {
        let maps = maps(4.0, 32);
        // ½ erfc(ν/√2).
        for (nu, expected) in
            [(-1.0, 0.841344746), (0.0, 0.5), (1.0, 0.158655254), (2.0, 0.022750132), (3.0, 0.001349898)]
        {
            let (area, error) = over(&maps, |map| mean(map.values().iter().map(|v| f64::from(*v >= nu))));
            assert!(error < 0.01 && (area - expected).abs() < 3.0 * error, "{nu}: {area} ± {error}");
        }
    }

    #[test]
    fn gradient_and_covariance_follow_the_correlation_angle() {
        let maps = maps(3.0, 64);
        let grid = grid(64);
        let l2 = 3f64.to_radians().powi(2);
        let covariance = |r: f64| (-r * r / (2.0 * l2)).exp();
        // The mean of a statistic of pixels `lag` apart in the rings of the equatorial belt, and of their chord.
        let pairs = |map: &Map, lag: usize, statistic: &dyn Fn(f64, f64, f64) -> f64| {
            mean((64..=192).map(|i| grid.ring(i)).flat_map(|ring| {
                let values = &map.values()[ring.start..ring.start + ring.len];
                let chord = 2.0 * ring.sin_theta * (ring.phi(lag as isize) / 2.0 - ring.phi(0) / 2.0).sin();
                (0..ring.len).map(move |j| statistic(values[j], values[(j + lag) % ring.len], chord))
            }))
        };
        // A ring runs along one of the gradient's two components, each of variance 1/ℓ²; over a step r that is blurred.
        let blur = |r: f64| (1.0 - covariance(r)) * 2.0 * l2 / (r * r);
        let (sigma12, error) = over(&maps, |map| pairs(map, 1, &|a, b, r| 2.0 * ((b - a) / r).powi(2) / blur(r)));
        let expected = Waves::new(3.0, 0).unwrap().sigma1().powi(2);
        assert!((expected - 2.0 / l2).abs() < 1e-9);
        assert!(error < 0.015 * expected, "{sigma12} ± {error}: {expected}");
        assert!((sigma12 - expected).abs() < 3.0 * error, "{sigma12} ± {error}: {expected}");

        // A lag of 1.4 ℓ at the equator.
        let (excess, error) = over(&maps, |map| pairs(map, 3, &|a, b, r| a * b - covariance(r)));
        assert!(error < 0.015, "{excess} ± {error}");
        assert!(excess.abs() < 3.0 * error, "{excess} ± {error}");
    }

    #[test]
    fn correlation_angles_are_checked() {
        for degrees in [0.0, -1.0, 90.1, f64::NAN, f64::INFINITY] {
            assert!(matches!(Waves::new(degrees, 0), Err(Error::CorrelationAngle { .. })));
        }
        let field = Waves::new(3.0, 0).unwrap();
        assert_eq!(field.warning(grid(64)), None);
        let Some(Warning::Unresolved { correlation, pixel }) = field.warning(grid(32)) else { panic!("no warning") };
        assert!((correlation - 3.0).abs() < 1e-12 && (pixel - 1.8323).abs() < 1e-4);
    }
}
