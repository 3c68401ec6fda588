//! Which colour a value has, and which values the colour bar names. Drawing is left to the parent module.

use colorous::VIRIDIS;
use longan_formats::{UNSEEN, is_bad};

use super::Error;

/// Share of the values below and above the default colour range, each.
const TAIL: f64 = 0.01;

/// Largest magnitude of a colour range's ends, for which no sum or power of ten overflows.
pub(super) const LIMIT: f64 = 1e300;

/// The colour of masked pixels.
pub(super) const MASKED: [u8; 3] = [178, 178, 178];

/// The values at the ends of the colour bar, and whether there are values beyond them.
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) below: bool,
    pub(super) above: bool,
}

impl Scale {
    pub(super) fn new(values: &[f64], range: Option<(f64, f64)>) -> Result<Self, Error> {
        let mut seen: Vec<f64> = values.iter().copied().filter(|&v| !is_bad(v, UNSEEN)).collect();
        let (low, high) = range.unwrap_or_else(|| default_range(&mut seen));
        if !(low.abs() <= LIMIT && high.abs() <= LIMIT && (high - low).is_normal() && low < high) {
            return Err(Error::Range { low, high });
        }
        Ok(Scale { low, high, below: seen.iter().any(|&v| v < low), above: seen.iter().any(|&v| v > high) })
    }

    pub(super) fn colour(&self, value: f64) -> [u8; 3] {
        if is_bad(value, UNSEEN) {
            return MASKED;
        }
        let colour = VIRIDIS.eval_continuous((value - self.low) / (self.high - self.low));
        [colour.r, colour.g, colour.b]
    }
}

/// The central 1 − 2 [`TAIL`] of the values; all of them where that has no width; something around a constant.
fn default_range(values: &mut [f64]) -> (f64, f64) {
    if values.is_empty() {
        return (0.0, 1.0);
    }
    let last = values.len() - 1;
    let mut at =
        |quantile: f64| *values.select_nth_unstable_by((last as f64 * quantile).round() as usize, f64::total_cmp).1;
    let (low, high) = (at(TAIL), at(1.0 - TAIL));
    let (low, high) = if low < high { (low, high) } else { (at(0.0), at(1.0)) };
    if (high - low).is_normal() {
        (low, high)
    } else {
        let half = if (low / 2.0).is_normal() { low.abs() / 2.0 } else { 0.5 };
        (low - half, low + half)
    }
}

/// Where the colour bar has ticks, and what is written there.
#[derive(Debug, PartialEq)]
pub(super) struct Ticks {
    pub(super) values: Vec<f64>,
    pub(super) labels: Vec<String>,
    /// The power of ten that the labels leave out.
    pub(super) exponent: i32,
}

impl Ticks {
    /// At most `most` multiples of 1, 2 or 5 times a power of ten, within the range.
    pub(super) fn new(low: f64, high: f64, most: usize) -> Self {
        let largest = low.abs().max(high.abs()).log10().floor() as i32;
        let exponent = if (-3..5).contains(&largest) { 0 } else { largest };
        let power = |n: i32| 10f64.powi(n.max(-307));
        let finest = ((high - low) / most as f64).log10().floor() as i32;
        // An end that is a multiple but for rounding counts.
        let multiples = |step: f64| (low / step - 1e-9).ceil() as i64..=(high / step + 1e-9).floor() as i64;
        let (n, factor) = (finest..)
            .flat_map(|n| [1.0, 2.0, 5.0].map(|factor| (n, factor)))
            .find(|&(n, factor)| multiples(factor * power(n)).count() <= most)
            .expect("a step longer than the range");
        let decimals = (exponent - n).max(0) as usize;
        // A true minus sign is as wide as a plus.
        let label = |k: i64| format!("{:.decimals$}", k as f64 * factor * power(n - exponent)).replace('-', "−");
        let ks = multiples(factor * power(n));
        Ticks {
            values: ks.clone().map(|k| k as f64 * factor * power(n)).collect(),
            labels: ks.map(label).collect(),
            exponent,
        }
    }

    /// As many ticks, up to six, as have room for their labels, `room` letters in all.
    pub(super) fn fitting(scale: &Scale, room: f64) -> Self {
        let fits = |ticks: &Ticks| {
            let longest = ticks.labels.iter().map(|l| l.chars().count()).max().unwrap_or(0);
            ((longest + 2) * ticks.labels.len()) as f64 <= room
        };
        (2..=6)
            .rev()
            .map(|most| Ticks::new(scale.low, scale.high, most))
            .find(fits)
            .unwrap_or_else(|| Ticks::new(scale.low, scale.high, 1))
    }
}

/// An integer in raised digits.
pub(super) fn superscript(number: i32) -> String {
    let digit = |c: char| match c.to_digit(10) {
        Some(d) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][d as usize],
        None => '⁻',
    };
    number.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(values: &[f64]) -> (f64, f64) {
        let scale = Scale::new(values, None).unwrap();
        (scale.low, scale.high)
    }

    #[test]
    fn default_ranges_ignore_tails_and_masked_values() {
        let mut values: Vec<f64> = (0..=1000).rev().map(f64::from).collect();
        values.extend([f64::NAN, f64::INFINITY, UNSEEN]);
        let scale = Scale::new(&values, None).unwrap();
        assert_eq!((scale.low, scale.high, scale.below, scale.above), (10.0, 990.0, true, true));
        assert_eq!([values[1001], f64::INFINITY, UNSEEN].map(|v| scale.colour(v)), [MASKED; 3]);
        // A body too small for the percentiles still shows.
        let mut values = vec![0.0; 1000];
        values[7] = 1.0;
        assert_eq!(range(&values), (0.0, 1.0));
        assert_eq!(range(&[-4.0; 12]), (-6.0, -2.0));
        assert_eq!(range(&[0.0; 12]), (-0.5, 0.5));
        assert_eq!(range(&[f64::NAN; 12]), (0.0, 1.0));
    }

    #[test]
    fn ranges_given_are_checked_and_kept() {
        let scale = Scale::new(&[0.0, 5.0], Some((0.0, 4.0))).unwrap();
        assert_eq!((scale.low, scale.high, scale.below, scale.above), (0.0, 4.0, false, true));
        let end = |value| scale.colour(value);
        assert_eq!((end(-1.0), end(9.0)), (end(0.0), end(4.0)));
        assert_eq!((end(0.0), end(4.0)), ([68, 1, 84], [253, 231, 37]));
        for range in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY), (0.0, 2e300)] {
            assert!(matches!(Scale::new(&[1.0], Some(range)), Err(Error::Range { .. })), "{range:?}");
        }
    }

    #[test]
    fn ticks_are_round_numbers_within_the_range() {
        let labels = |low, high| {
            let ticks = Ticks::new(low, high, 6);
            (ticks.labels.join(" "), ticks.exponent)
        };
        assert_eq!(labels(-2.3, 2.4), ("−2 −1 0 1 2".into(), 0));
        assert_eq!(labels(0.0, 1.0), ("0.0 0.2 0.4 0.6 0.8 1.0".into(), 0));
        assert_eq!(labels(-0.3, 0.3), ("−0.2 0.0 0.2".into(), 0));
        assert_eq!(labels(-0.2, 0.3), ("−0.2 −0.1 0.0 0.1 0.2 0.3".into(), 0));
        assert_eq!(labels(-5e-5, 5e-5), ("−4 −2 0 2 4".into(), -5));
        assert_eq!(labels(0.0, 1.1e7), ("0.0 0.2 0.4 0.6 0.8 1.0".into(), 7));
        assert_eq!(labels(250.0, 310.0), ("260 280 300".into(), 0));
        assert_eq!(superscript(-105), "⁻¹⁰⁵");
    }

    #[test]
    fn no_range_is_too_strange_for_ticks() {
        for magnitude in [1e-300, 1e-20, 1e-3, 1.0, 7e4, 1e15, 1e300] {
            for width in [1e-15, 1e-9, 0.3, 2.0] {
                for sign in [-1.0, 1.0] {
                    let (low, high) = (sign * magnitude, sign * magnitude + width * magnitude);
                    let Ok(scale) = Scale::new(&[], Some((low, high))) else { continue };
                    for room in [0.0, 20.0, 100.0] {
                        let ticks = Ticks::fitting(&scale, room);
                        assert!(ticks.values.len() <= 6 && ticks.values.len() == ticks.labels.len());
                        let slack = 1e-6 * (high - low) + 1e-15 * magnitude;
                        assert!(ticks.values.iter().all(|v| (low - slack..=high + slack).contains(v)), "{low} {high}");
                        assert!(ticks.labels.windows(2).all(|l| l[0] != l[1]), "{:?}", ticks.labels);
                    }
                }
            }
        }
    }
}
