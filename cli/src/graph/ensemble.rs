//! Simulations, and where data lie among them.

use super::Curves;

/// The values of all simulations.
#[derive(Default)]
pub(super) struct Ensemble {
    /// For each quantity, for each threshold, those that are defined.
    values: Vec<Vec<Vec<f64>>>,
    /// The number of simulations.
    pub(super) count: usize,
}

impl Ensemble {
    /// Adds a simulation.
    pub(super) fn add(&mut self, curves: &Curves) {
        self.count += 1;
        self.values.resize(curves.values.len(), Vec::new());
        for (all, values) in self.values.iter_mut().zip(&curves.values) {
            all.resize(values.len(), Vec::new());
            for (all, value) in all.iter_mut().zip(values) {
                all.extend(Some(value.value).filter(|value| !value.is_nan()));
            }
        }
    }

    /// The same, ready to be asked.
    pub(super) fn sorted(mut self) -> Self {
        self.values.iter_mut().flatten().for_each(|values| values.sort_by(f64::total_cmp));
        self
    }

    /// The values of a quantity at a threshold, ascending.
    pub(super) fn at(&self, quantity: usize, threshold: usize) -> &[f64] {
        self.values.get(quantity).map_or(&[], |values| &values[threshold])
    }
}

/// The quantile of a share of ascending values, linear between them as in numpy; NaN where there are none.
pub(super) fn quantile(ascending: &[f64], share: f64) -> f64 {
    let Some(last) = ascending.len().checked_sub(1) else { return f64::NAN };
    let place = share * last as f64;
    let (below, above) = (ascending[place.floor() as usize], ascending[(place.floor() as usize + 1).min(last)]);
    below + (above - below) * place.fract()
}

/// The share in percent of ascending values below this one, of those equal to it half; NaN where there are none.
pub(super) fn percentile(ascending: &[f64], value: f64) -> f64 {
    if value.is_nan() {
        return f64::NAN;
    }
    let below = ascending.partition_point(|v| *v < value) as f64;
    let up_to = ascending.partition_point(|v| *v <= value) as f64;
    100.0 * 0.5 * (below + up_to) / ascending.len() as f64
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
