//! Sets of thresholds: how they are written, spaced and brought to the field's own unit.

use std::str::FromStr;

use crate::statistics::Statistics;

/// The largest number of thresholds in a set; bins are 16 bit wide and one value is kept for masked pixels.
pub const THRESHOLDS_MAX: usize = u16::MAX as usize - 1;

/// Several thresholds in the field's unit that together cover less than this many standard deviations are hardly meant:
/// most often they are standard deviations.
pub const LEAST_SPAN: f64 = 0.2;

/// What makes one doubt that thresholds are meant for a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// None of them lies within the field's values, so that there is no contour.
    Missed {
        /// Statistics of the field.
        of_map: Statistics,
    },
    /// They cover less than [`LEAST_SPAN`].
    Narrow {
        /// Statistics of the field.
        of_map: Statistics,
        /// What they cover, in standard deviations.
        span: f64,
    },
}

/// Finite, distinct thresholds in ascending order, in the unit of the field.
#[derive(Clone, Debug, PartialEq)]
pub struct Thresholds(Vec<f64>);

/// What is wrong with a set of thresholds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ThresholdError {
    /// Neither a list nor a range.
    #[error("thresholds '{text}' are not of the form lo:hi:n, log:lo:hi:n or a,b,c with finite numbers")]
    Syntax {
        /// What was given.
        text: String,
    },
    /// A range that does not ascend or has too few steps for its ends.
    #[error("thresholds '{text}' need lo < hi and at least 2 steps")]
    Range {
        /// What was given.
        text: String,
    },
    /// Logarithmic spacing from zero or below.
    #[error("thresholds '{text}' cannot be spaced logarithmically: lo must be above 0")]
    Logarithm {
        /// What was given.
        text: String,
    },
    /// No threshold at all.
    #[error("no threshold is given")]
    Empty,
    /// Too many thresholds.
    #[error("{count} thresholds are more than the {THRESHOLDS_MAX} that one run takes")]
    TooMany {
        /// How many were given.
        count: usize,
    },
    /// The same threshold twice.
    #[error("threshold {value} is given twice")]
    Repeated {
        /// The value.
        value: f64,
    },
    /// A threshold that is NaN or infinite.
    #[error("threshold {value} is not a finite number")]
    NotFinite {
        /// The value.
        value: f64,
    },
}

impl Thresholds {
    /// A set of these values, sorted.
    ///
    /// # Errors
    /// Where a value is not finite or given twice, or where there is none or more than [`THRESHOLDS_MAX`].
    pub fn new(mut values: Vec<f64>) -> Result<Self, ThresholdError> {
        if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
            return Err(ThresholdError::NotFinite { value });
        }
        values.sort_by(f64::total_cmp);
        match values.windows(2).find(|w| w[0] == w[1]) {
            Some(w) => Err(ThresholdError::Repeated { value: w[0] }),
            None if values.is_empty() => Err(ThresholdError::Empty),
            None if values.len() > THRESHOLDS_MAX => Err(ThresholdError::TooMany { count: values.len() }),
            None => Ok(Thresholds(values)),
        }
    }

    /// Each threshold as a set of its own.
    pub(crate) fn each(&self) -> impl Iterator<Item = Self> {
        self.0.iter().map(|&threshold| Thresholds(vec![threshold]))
    }

    /// The paper's set: 13 from −3 to 3, to be taken in standard deviations.
    pub fn standard() -> Self {
        Thresholds((-6..=6).map(|i| f64::from(i) / 2.0).collect())
    }

    /// The thresholds mean + x · σ for each x of this set.
    ///
    /// # Errors
    /// As [`new`](Self::new), in particular for a field without variance.
    pub fn in_units_of(&self, mean: f64, sigma: f64) -> Result<Self, ThresholdError> {
        Self::new(self.0.iter().map(|x| mean + x * sigma).collect())
    }

    /// What is doubtful about these thresholds for a field of such statistics; nothing about one that is constant, which
    /// has no contour anyway.
    pub fn doubt(&self, of_map: Statistics) -> Option<Doubt> {
        let Statistics { min, max, sigma, .. } = of_map;
        if sigma <= 0.0 || !sigma.is_finite() {
            return None;
        }
        // A body has all values at or above its threshold.
        if !self.0.iter().any(|threshold| min < *threshold && *threshold <= max) {
            return Some(Doubt::Missed { of_map });
        }
        let span = (self.0[self.0.len() - 1] - self.0[0]) / sigma;
        (self.0.len() > 1 && span < LEAST_SPAN).then_some(Doubt::Narrow { of_map, span })
    }

    /// The values, ascending.
    pub fn values(&self) -> &[f64] {
        &self.0
    }
}

/// `lo:hi:n` (n values, evenly spaced, both ends included), `log:lo:hi:n` (evenly in the logarithm) or `a,b,c`.
impl FromStr for Thresholds {
    type Err = ThresholdError;

    fn from_str(text: &str) -> Result<Self, ThresholdError> {
        let syntax = || ThresholdError::Syntax { text: text.to_owned() };
        let number = |t: &str| t.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(syntax);
        if !text.contains(':') {
            return Self::new(text.split(',').map(number).collect::<Result<_, _>>()?);
        }
        let (range, logarithmic) = match text.trim().strip_prefix("log:") {
            Some(rest) => (rest, true),
            None => (text, false),
        };
        let [lo, hi, n] = range.split(':').collect::<Vec<_>>()[..] else { return Err(syntax()) };
        let (lo, hi) = (number(lo)?, number(hi)?);
        let n: usize = n.trim().parse().map_err(|_| syntax())?;
        if n < 2 || lo >= hi {
            return Err(ThresholdError::Range { text: text.to_owned() });
        }
        if n > THRESHOLDS_MAX {
            return Err(ThresholdError::TooMany { count: n });
        }
        if logarithmic && lo <= 0.0 {
            return Err(ThresholdError::Logarithm { text: text.to_owned() });
        }
        let between = |a: f64, b: f64, i: usize| a + (b - a) * i as f64 / (n - 1) as f64;
        Self::new(
            (0..n)
                .map(|i| match i {
                    0 => lo,
                    _ if i == n - 1 => hi,
                    _ if logarithmic => between(lo.ln(), hi.ln(), i).exp(),
                    _ => between(lo, hi, i),
                })
                .collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(text: &str) -> Result<Vec<f64>, ThresholdError> {
        text.parse::<Thresholds>().map(|t| t.values().to_vec())
    }

    #[test]
    fn every_way_of_writing_is_read() {
        assert_eq!(set("-3:3:13").unwrap(), Thresholds::standard().values());
        assert_eq!(set("-1:0:2").unwrap(), [-1.0, 0.0]);
        assert_eq!(set("3,-1e-3, 2").unwrap(), [-1e-3, 2.0, 3.0]);
        assert_eq!(set("-0.5").unwrap(), [-0.5]);
        let log = set("log:1e-2:100:5").unwrap();
        for (a, b) in log.iter().zip([0.01, 0.1, 1.0, 10.0, 100.0]) {
            assert!((a / b - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn thresholds_that_are_hardly_meant_are_doubted() {
        let of_map = Statistics { unmasked: 9, min: -300.0, max: 280.0, mean: 0.0, sigma: 70.0 };
        let doubt = |text: &str, of_map| text.parse::<Thresholds>().unwrap().doubt(of_map);
        assert!(
            matches!(doubt("-3:3:13", of_map), Some(Doubt::Narrow { span, .. }) if (span - 6.0 / 70.0).abs() < 1e-12)
        );
        assert_eq!(doubt("-300,300", of_map), Some(Doubt::Missed { of_map }));
        assert_eq!(doubt("281", of_map), Some(Doubt::Missed { of_map }));
        for meant in ["0", "280", "-7.1,7.1", "-1000,0"] {
            assert_eq!(doubt(meant, of_map), None, "{meant}");
        }
        for sigma in [0.0, f64::INFINITY, f64::NAN] {
            assert_eq!(doubt("-3:3:13", Statistics { sigma, ..of_map }), None);
        }
    }

    #[test]
    fn every_mistake_is_named() {
        for text in ["", "a", "1:2", "1:2:3:4", "1:2:x", "nan", "1,inf", "1,,2", "log:1:2", "1:2:-3"] {
            assert!(matches!(set(text), Err(ThresholdError::Syntax { .. })), "{text}");
        }
        for text in ["1:1:3", "2:1:3", "0:1:1", "0:1:0"] {
            assert!(matches!(set(text), Err(ThresholdError::Range { .. })), "{text}");
        }
        assert!(matches!(set("log:0:1:3"), Err(ThresholdError::Logarithm { .. })));
        assert!(matches!(set("1,2,1"), Err(ThresholdError::Repeated { .. })));
        assert!(matches!(set("0:1:99999999999"), Err(ThresholdError::TooMany { .. })));
        assert!(matches!(Thresholds::standard().in_units_of(1.0, 0.0), Err(ThresholdError::Repeated { .. })));
    }
}
