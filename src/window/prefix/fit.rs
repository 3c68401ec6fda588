//! Fits of the phase of transport by a few exponentials, e^{isδ(x)} ≈ Σ_k c_k e^{i m_k x} for |x| ≤ Φ.
//!
//! The frequencies are m_k = m + (k − (K − 1)/2) h/Φ. With u = x/Φ the least-squares problem then depends on K and h
//! alone, so that its solution is found once for the whole program. What the sums do with a fit is left to others.
//!
//! Near a pole, where windows hold most of a ring or all of it, the frequencies are 0, 1, 2, … (0, −1, −2, … in the
//! south) and Φ is π: with ρ = tan(θ_x/2) tan(θ_w/2) < 1, e^{iδ} = (e^{ix} + ρ)/(1 + ρ e^{ix}), a power series.

use std::f64::consts::PI;
use std::sync::OnceLock;

use nalgebra::DMatrix;
use num_complex::Complex64;

use crate::transport::RingTransport;

/// Numbers of terms that are tried in turn.
const COUNTS: [usize; 5] = [4, 8, 12, 16, 24];

/// The smallest of these.
pub(super) const FEWEST: usize = COUNTS[0];

/// Spacings h are π over powers of √2; so many of them.
const SPACINGS: usize = 24;

/// Spacings that are tried for each number of terms.
const TRIALS: usize = 3;

/// Share of the tolerance that a sample of a block's pairs has to keep, so that the others keep all of it.
const SAMPLED: f64 = 0.7;

/// Half-widths in radians from which the frequencies of whole rings are tried.
const WIDE: f64 = 1.5;

/// Singular values below this share of the largest are dropped from a fit: smaller ones amplify rounding more than they
/// improve it.
const SINGULAR: f64 = 1e-10;

/// A fit's largest error is at most so many times that at the checks.
const BETWEEN: f64 = 1.5;

/// Relative error of a prefix sum's differences that large c_k amplify.
const ROUNDING: f64 = 1e-14;

/// The terms of one rank's phase.
pub(super) struct Terms {
    rank: u32,
    /// m_k.
    pub(super) frequencies: Vec<f64>,
    basis: &'static Basis,
    /// cos x, sin x and e^{−i m x} at the nodes, then at the checks.
    places: Vec<(f64, f64, Complex64)>,
}

/// What fits with the same K and h share. Places lie in 0 ≤ u ≤ 1, since phases at −x are those at x conjugated.
struct Basis {
    /// (k − (K − 1)/2) h.
    offsets: Vec<f64>,
    /// From phases at the Chebyshev nodes (real parts, then imaginary parts) to c_k: K rows of 2K.
    solution: Vec<f64>,
    nodes: Vec<f64>,
    /// Places between the nodes and at both ends, and e^{i (m_k − m) x} there.
    checks: Vec<(f64, Vec<Complex64>)>,
}

impl Basis {
    /// The basis of COUNTS\[count\] terms, h = π/√2^spacing.
    fn get(count: usize, spacing: usize) -> &'static Basis {
        static ALL: [[OnceLock<Basis>; SPACINGS]; COUNTS.len()] =
            [const { [const { OnceLock::new() }; SPACINGS] }; COUNTS.len()];
        ALL[count][spacing].get_or_init(|| Basis::new(COUNTS[count], step(spacing)))
    }

    fn new(count: usize, step: f64) -> Basis {
        let offsets: Vec<f64> = (0..count).map(|k| (k as f64 - (count - 1) as f64 / 2.0) * step).collect();
        let terms = |u: f64| offsets.iter().map(|o| Complex64::cis(o * u)).collect::<Vec<_>>();
        let chebyshev = |n: usize, of: usize| (PI * n as f64 / of as f64).cos();
        let nodes: Vec<f64> = (0..count).map(|n| chebyshev(2 * n + 1, 4 * count)).collect();
        let at_nodes: Vec<_> = nodes.iter().map(|&u| terms(u)).collect();
        let design = DMatrix::from_fn(2 * count, count, |row, k| {
            if row < count { at_nodes[row][k].re } else { at_nodes[row - count][k].im }
        });
        let largest = design.singular_values().max();
        let solution = design.pseudo_inverse(SINGULAR * largest).unwrap_or_else(|_| DMatrix::zeros(count, 2 * count));
        let checks = (0..=count).map(|n| chebyshev(n, 2 * count)).map(|u| (u, terms(u)));
        Basis { solution: solution.transpose().as_slice().to_vec(), nodes, checks: checks.collect(), offsets }
    }
}

/// h of a spacing's number.
fn step(spacing: usize) -> f64 {
    PI / 2.0f64.powf(spacing as f64 / 2.0)
}

impl Terms {
    /// The fewest terms that meet the tolerance on these pairs for |x| ≤ `width` (radians).
    pub(super) fn new(rank: u32, width: f64, sample: &[RingTransport], tolerance: f64) -> Option<Terms> {
        // The local frequency of e^{isδ(x)} lies between those at x = 0 and at the window's edge.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for transport in sample {
            for x in [0.0, width] {
                let frequency = f64::from(rank) * transport.rate(x);
                (low, high) = (low.min(frequency), high.max(frequency));
            }
        }
        let middle = (low + high) / 2.0;
        for (count, &terms) in COUNTS.iter().enumerate() {
            let meets = |set: &Terms| {
                let mut c = vec![0.0; terms];
                sample.iter().all(|t| set.fit(t, &mut c) < SAMPLED * tolerance)
            };
            if width > WIDE {
                let whole = Terms::with(rank, PI, ((terms - 1) as f64 / 2.0).copysign(middle), count, 0);
                if meets(&whole) {
                    return Some(whole);
                }
            }
            let ideal = (high - low) * width / (terms - 1) as f64;
            // The smallest spacing that spans them all and does not amplify rounding beyond the tolerance (c_k grow as
            // h^{1 − K}), then wider ones.
            let least = (10.0 * ROUNDING / tolerance).powf(1.0 / (terms - 1) as f64);
            let first = (0..SPACINGS).rev().find(|&s| step(s) >= ideal.max(least)).unwrap_or(0);
            for spacing in (0..=first).rev().take(TRIALS) {
                let set = Terms::with(rank, width, middle, count, spacing);
                if meets(&set) {
                    return Some(set);
                }
            }
        }
        None
    }

    fn with(rank: u32, width: f64, middle: f64, count: usize, spacing: usize) -> Terms {
        let basis = Basis::get(count, spacing);
        let place = |&u: &f64| {
            let (sin, cos) = (u * width).sin_cos();
            (cos, sin, Complex64::cis(-middle * u * width))
        };
        Terms {
            rank,
            frequencies: basis.offsets.iter().map(|o| middle + o / width).collect(),
            places: basis.nodes.iter().chain(basis.checks.iter().map(|(u, _)| u)).map(place).collect(),
            basis,
        }
    }

    /// Number of terms.
    pub(super) fn count(&self) -> usize {
        self.frequencies.len()
    }

    /// The c_k of a pair of rings, and the largest error of a phase that they make: that of the fit, and the rounding
    /// that they amplify.
    pub(super) fn fit(&self, transport: &RingTransport, c: &mut [f64]) -> f64 {
        let count = self.count();
        let phase = |&(cos, sin, back): &(f64, f64, Complex64)| {
            let phase = transport.phase(cos, sin);
            let mut power = phase;
            (1..self.rank).for_each(|_| power *= phase);
            power * back
        };
        let (nodes, checks) = self.places.split_at(count);
        c.fill(0.0);
        for (phase, solution) in nodes.iter().map(phase).zip(0..) {
            let (re, im) = (&self.basis.solution[solution..], &self.basis.solution[count + solution..]);
            let each = re.iter().step_by(2 * count).zip(im.iter().step_by(2 * count));
            c.iter_mut().zip(each).for_each(|(c, (a, b))| *c += a * phase.re + b * phase.im);
        }
        let error = |(place, (_, terms)): (_, &(f64, Vec<Complex64>))| {
            let fitted: Complex64 = terms.iter().zip(c.iter()).map(|(t, c)| t * c).sum();
            (fitted - phase(place)).norm_sqr()
        };
        let worst = checks.iter().zip(&self.basis.checks).map(error).fold(0.0, f64::max);
        BETWEEN * worst.sqrt() + ROUNDING * c.iter().map(|c| c.abs()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Terms {
        /// The same terms, used for another rank.
        pub(in crate::window::prefix) fn of_rank(mut self, rank: u32) -> Self {
            self.rank = rank;
            self
        }
    }

    /// The error told is that at a thousand places, not only where the fit was made or checked.
    #[test]
    fn the_error_is_that_between_the_nodes_too() {
        let mut worst_ratio: f64 = 0.0;
        for (theta_x, theta_w, width) in
            [(1.2, 1.1, 0.1), (0.3, 0.35, 0.4), (0.9, 1.5, 1.0), (0.1, 0.4, PI), (1.5, 1.7, 1.4)]
        {
            let transport = RingTransport::new(f64::sin_cos(theta_x), f64::sin_cos(theta_w));
            for rank in 1..=8 {
                for (count, spacing, middle) in [(0, 5, 0.0), (0, 10, 0.7), (1, 6, 1.0), (2, 4, 2.0), (4, 3, 3.0)] {
                    let terms = Terms::with(rank, width, middle, count, spacing);
                    let mut c = vec![0.0; terms.count()];
                    let told = terms.fit(&transport, &mut c);
                    let error = |i: i32| {
                        let x = width * f64::from(i) / 1000.0;
                        let phase = transport.phase(x.cos(), x.sin()).powu(rank);
                        let fitted: Complex64 =
                            c.iter().zip(&terms.frequencies).map(|(c, m)| Complex64::cis(m * x) * c).sum();
                        (fitted - phase).norm()
                    };
                    let worst = (-1000..=1000).map(error).fold(0.0, f64::max);
                    worst_ratio = worst_ratio.max(worst / told);
                }
            }
        }
        assert!(worst_ratio < 1.0, "{worst_ratio}");
    }
}
