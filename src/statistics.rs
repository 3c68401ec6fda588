//! Mean, standard deviation and range of a field's unmasked pixels.

use rayon::prelude::*;

/// Pixels summed at a time; the sums of the pieces are added in order, whatever the number of threads.
const PIECE: usize = 1 << 16;

/// What the unmasked pixels of a field look like.
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

/// Statistics of the values that are not NaN; `None` if there is none.
pub fn statistics(values: &[f64]) -> Option<Statistics> {
    let pieces = |f: &(dyn Fn(&mut dyn Iterator<Item = f64>) -> f64 + Sync)| -> Vec<f64> {
        values.par_chunks(PIECE).map(|piece| f(&mut piece.iter().copied().filter(|v| !v.is_nan()))).collect()
    };
    let sum = |f: &(dyn Fn(f64) -> f64 + Sync)| pieces(&|piece| piece.map(f).sum()).iter().sum::<f64>();
    let unmasked = sum(&|_| 1.0);
    let mean = sum(&|v| v / unmasked);
    (unmasked > 0.0).then(|| Statistics {
        unmasked: unmasked as usize,
        min: pieces(&|piece| piece.fold(f64::INFINITY, f64::min)).into_iter().fold(f64::INFINITY, f64::min),
        max: pieces(&|piece| piece.fold(f64::NEG_INFINITY, f64::max)).into_iter().fold(f64::NEG_INFINITY, f64::max),
        mean,
        sigma: (sum(&|v| (v - mean) * (v - mean)) / unmasked).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masked_pixels_do_not_count() {
        let s = statistics(&[f64::NAN, 1.0, 3.0, f64::NAN]).unwrap();
        assert_eq!((s.unmasked, s.min, s.max, s.mean, s.sigma), (2, 1.0, 3.0, 2.0, 1.0));
        assert_eq!(statistics(&[f64::NAN]), None);
    }
}
