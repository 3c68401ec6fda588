//! Quantiles of a sample, and the percentile of a value among it: one rule for graphs and comparisons.
//!
//! A quantile is linear between neighbouring values, as numpy's by default (Hyndman & Fan 1996, type 7). A percentile
//! counts the values below, and half of those that are equal, so that it is uniform in the mean under ties.

/// The quantile of a share, from 0 to 1, of ascending values; NaN where there are none.
pub fn quantile(ascending: &[f64], share: f64) -> f64 {
    let Some(last) = ascending.len().checked_sub(1) else { return f64::NAN };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let (below, above) = (ascending[place.floor() as usize], ascending[(place.floor() as usize + 1).min(last)]);
    below + (above - below) * place.fract()
}

/// The share in percent of ascending values below this one, of those equal to it half; NaN for NaN, and where there are
/// no values.
pub fn percentile(ascending: &[f64], value: f64) -> f64 {
    if value.is_nan() {
        return f64::NAN;
    }
    let below = ascending.partition_point(|v| *v < value);
    let up_to = ascending.partition_point(|v| *v <= value);
    percent((below + up_to) as u128, ascending.len() as u64)
}

/// The percentile of a value that has `twice_below` halves of `count` values below it: two for each that is lower, one
/// for each that is equal. NaN where there are no values.
pub(crate) fn percent(twice_below: u128, count: u64) -> f64 {
    50.0 * twice_below as f64 / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_linear_between_values() {
        // numpy.quantile([1, 2, 4, 8], [0, 0.16, 0.5, 0.975, 1]).
        for (share, expected) in [(0.0, 1.0), (0.16, 1.48), (0.5, 3.0), (0.975, 7.7), (1.0, 8.0)] {
            assert!((quantile(&[1.0, 2.0, 4.0, 8.0], share) - expected).abs() < 1e-12, "{share}");
        }
        assert_eq!(quantile(&[5.0], 0.16), 5.0);
        assert!(quantile(&[], 0.5).is_nan());
    }

    #[test]
    fn ties_count_half() {
        let values = [1.0, 2.0, 2.0, 3.0];
        for (value, expected) in [(0.0, 0.0), (1.0, 12.5), (2.0, 50.0), (2.5, 75.0), (9.0, 100.0)] {
            assert_eq!(percentile(&values, value), expected);
        }
        assert!(percentile(&values, f64::NAN).is_nan() && percentile(&[], 1.0).is_nan());
    }
}
