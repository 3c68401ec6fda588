//! Mean, standard deviation and range of a field's unmasked pixels.

use rayon::prelude::*;

/// Pixels summed at a time; the sums of the pieces are added in order, whatever the number of threads.
const PIECE: usize = 1 << 16;

/// Mean, standard deviation and range of the unmasked pixels of a field, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Number of unmasked pixels.
    pub unmasked: usize,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Standard deviation: the root of the mean squared distance to the mean.
    pub sigma: f64,
}

impl Statistics {
    /// Those of a field that is masked everywhere.
    pub const NOTHING: Statistics =
        Statistics { unmasked: 0, min: f64::NAN, max: f64::NAN, mean: f64::NAN, sigma: f64::NAN };
}

/// Statistics of the values that are not NaN; `None` if there is none.
pub fn statistics(values: &[f64]) -> Option<Statistics> {
    let pieces: Vec<Statistics> = values.par_chunks(PIECE).filter_map(of_piece).collect();
    let unmasked: usize = pieces.iter().map(|p| p.unmasked).sum();
    let share = |p: &Statistics| p.unmasked as f64 / unmasked as f64;
    let mean: f64 = pieces.iter().map(|p| share(p) * p.mean).sum();
    // Within the pieces, and between them.
    let variance: f64 = pieces.iter().map(|p| share(p) * (p.sigma.powi(2) + (p.mean - mean).powi(2))).sum();
    pieces.iter().copied().reduce(|a, b| Statistics { min: a.min.min(b.min), max: a.max.max(b.max), ..a }).map(|all| {
        // A constant field keeps its value and has no scatter, whatever the rounding.
        let constant = all.min == all.max;
        Statistics {
            unmasked,
            mean: if constant { all.min } else { mean },
            sigma: if constant { 0.0 } else { variance.sqrt() },
            ..all
        }
    })
}

fn of_piece(values: &[f64]) -> Option<Statistics> {
    let (mut unmasked, mut sum, mut min, mut max) = (0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
    for &v in values.iter().filter(|v| !v.is_nan()) {
        unmasked += 1;
        sum += v;
        min = min.min(v);
        max = max.max(v);
    }
    let mean = sum / unmasked as f64;
    let squares: f64 = values.iter().filter(|v| !v.is_nan()).map(|v| (v - mean) * (v - mean)).sum();
    (unmasked > 0).then(|| Statistics { unmasked, min, max, mean, sigma: (squares / unmasked as f64).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_make_the_whole() {
        let values: Vec<f64> = (0..200_000).map(|i| f64::from(i % 1000) + 1e6).collect();
        let s = statistics(&values).unwrap();
        assert!((s.mean - 1_000_499.5).abs() < 1e-6);
        assert!((s.sigma - (999_999.0f64 / 12.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn masked_pixels_do_not_count() {
        let s = statistics(&[f64::NAN, 1.0, 3.0, f64::NAN]).unwrap();
        assert_eq!((s.unmasked, s.min, s.max, s.mean, s.sigma), (2, 1.0, 3.0, 2.0, 1.0));
        assert_eq!(statistics(&[f64::NAN]), None);
        assert_eq!(statistics(&[0.1; 100_000]).unwrap().sigma, 0.0);
    }
}
