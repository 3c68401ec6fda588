//! Which values an axis or a colour bar names, and how they are written. Drawing is left to others.

use super::scale::{Meaning, Scale};

/// Where the colour bar has ticks, and what is written there.
#[derive(Debug, PartialEq)]
pub(super) struct Ticks {
    pub(super) values: Vec<f64>,
    /// Empty for a tick that is not named.
    pub(super) labels: Vec<String>,
    /// The power of ten that the labels leave out.
    pub(super) exponent: i32,
}

/// Powers of ten that are written out, with three digits after the point at most.
const PLAIN: std::ops::Range<i32> = -3..5;

impl Ticks {
    /// At most `most` multiples of 1, 2 or 5 times a power of ten, within the range.
    pub(super) fn new(low: f64, high: f64, most: usize) -> Self {
        let largest = low.abs().max(high.abs()).log10().floor() as i32;
        let exponent = if PLAIN.contains(&largest) { 0 } else { largest };
        let power = |n: i32| 10f64.powi(n.max(-307));
        let finest = ((high - low) / most as f64).log10().floor() as i32;
        // An end that is a multiple but for rounding counts.
        let multiples = |step: f64| (low / step - 1e-9).ceil() as i64..=(high / step + 1e-9).floor() as i64;
        let (n, factor) = (finest..)
            .flat_map(|n| [1.0, 2.0, 5.0].map(|factor| (n, factor)))
            .find(|&(n, factor)| multiples(factor * power(n)).count() <= most)
            .expect("a step longer than the range");
        let decimals = (exponent - n).max(0) as usize;
        let label = |k: i64| signed(format!("{:.decimals$}", k as f64 * factor * power(n - exponent)));
        let ks = multiples(factor * power(n));
        Ticks {
            values: ks.clone().map(|k| k as f64 * factor * power(n)).collect(),
            labels: ks.map(label).collect(),
            exponent,
        }
    }

    /// Quarters of a full turn of directions.
    fn of_directions(half: f64) -> Self {
        let values: Vec<f64> = (-2..=2).map(|k| f64::from(k) * half / 2.0).collect();
        let decimals = if half.fract() == 0.0 && (half / 2.0).fract() == 0.0 { 0 } else { 1 };
        let labels = values.iter().map(|v| signed(format!("{v:.decimals$}"))).collect();
        Ticks { values, labels, exponent: 0 }
    }

    /// Powers of ten, every `every`-th of them named; where there are hardly any, 1, 2 and 5 times these.
    fn logarithmic(low: f64, high: f64, every: i32) -> Self {
        // An end that is a tick but for rounding counts.
        let (low, high) = (low * (1.0 - 1e-9), high * (1.0 + 1e-9));
        let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let within = |value: f64| (low..=high).contains(&value);
        let power = |n: i32| 10f64.powi(n.max(-307));
        let few = decades.clone().filter(|&n| within(power(n))).count() < 3;
        let plain = decades.clone().filter(|&n| within(power(n))).all(|n| PLAIN.contains(&n))
            && PLAIN.contains(&(low.log10().floor() as i32));
        let mut ticks = Ticks { values: Vec::new(), labels: Vec::new(), exponent: 0 };
        for n in decades {
            for factor in 1..10 {
                let value = f64::from(factor) * power(n);
                if !within(value) {
                    continue;
                }
                let named = if few { [1, 2, 5].contains(&factor) } else { factor == 1 && n.rem_euclid(every) == 0 };
                if !named && every > 1 {
                    continue;
                }
                let decimals = (-n).max(0) as usize;
                ticks.values.push(value);
                ticks.labels.push(match factor {
                    _ if !named => String::new(),
                    _ if plain => format!("{value:.decimals$}"),
                    1 => format!("10{}", superscript(n)),
                    _ => format!("{factor} × 10{}", superscript(n)),
                });
            }
        }
        ticks
    }

    /// As many ticks, up to six with names, as have room for their labels, `room` letters in all.
    pub(super) fn fitting(scale: &Scale, room: f64) -> Self {
        let fits = |ticks: &Ticks| {
            let named = ticks.labels.iter().filter(|label| !label.is_empty());
            let longest = named.clone().map(|label| label.chars().count()).max().unwrap_or(0);
            ((longest + 2) * named.count()) as f64 <= room
        };
        let (low, high) = (scale.low, scale.high);
        if let Meaning::Direction { symmetry } = scale.meaning
            && high == 180.0 / f64::from(symmetry)
            && low == -high
        {
            return Some(Ticks::of_directions(high)).filter(fits).unwrap_or_else(|| Ticks::new(low, high, 1));
        }
        let linear = || {
            let tried = (2..=6).rev().map(|most| Ticks::new(low, high, most)).find(fits);
            tried.unwrap_or_else(|| Ticks::new(low, high, 1))
        };
        if !scale.log {
            return linear();
        }
        let logarithmic = (1..700).map(|every| Ticks::logarithmic(low, high, every));
        // Where the ends are near one another, round numbers lie nearly evenly.
        let useful = |ticks: &Ticks| ticks.labels.iter().filter(|label| !label.is_empty()).count() >= 2;
        logarithmic.into_iter().find(|ticks| fits(ticks)).filter(useful).unwrap_or_else(linear)
    }
}

/// A number with a true minus sign, which is as wide as a plus.
pub(super) fn signed(number: String) -> String {
    number.replace('-', "−")
}

/// An integer in raised digits.
pub fn superscript(number: i32) -> String {
    let digit = |c: char| match c.to_digit(10) {
        Some(d) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][d as usize],
        None => '⁻',
    };
    number.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::super::scale::Colouring;
    use super::*;

    fn scale(low: f64, high: f64, log: bool, meaning: Meaning) -> Option<Scale> {
        let colouring = Colouring { range: (Some(low), Some(high)), log, meaning, ..Colouring::default() };
        Scale::new(&[], &colouring).ok()
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
                    for log in [false, true] {
                        let (low, high) = (sign * magnitude, sign * magnitude + width * magnitude);
                        let Some(scale) = scale(low, high, log, Meaning::Any) else { continue };
                        for room in [0.0, 20.0, 100.0] {
                            let ticks = Ticks::fitting(&scale, room);
                            let named = ticks.labels.iter().filter(|l| !l.is_empty()).collect::<Vec<_>>();
                            assert!(named.len() <= 10 && ticks.values.len() == ticks.labels.len());
                            let slack = 1e-6 * (high - low) + 1e-15 * magnitude;
                            let within = low - slack - 1e-8 * magnitude..=high + slack + 1e-8 * magnitude;
                            assert!(ticks.values.iter().all(|v| within.contains(v)), "{low} {high}");
                            assert!(named.windows(2).all(|l| l[0] != l[1]), "{:?}", ticks.labels);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        let named = |low, high| {
            let ticks = Ticks::fitting(&scale(low, high, true, Meaning::Any).unwrap(), 60.0);
            ticks.labels.into_iter().filter(|label| !label.is_empty()).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(named(0.01, 1000.0), "0.01 0.10 1 10 100 1000".replace("0.10", "0.1"));
        assert_eq!(named(3.0, 40.0), "5 10 20");
        assert_eq!(named(1e-9, 1e-5), "10⁻⁹ 10⁻⁸ 10⁻⁷ 10⁻⁶ 10⁻⁵");
        assert!((4..10).contains(&named(1e-20, 1e20).split(' ').count()));
        assert_eq!(named(100.0, 101.0), "100.0 100.2 100.4 100.6 100.8 101.0");
    }

    #[test]
    fn directions_have_ticks_at_quarters_of_their_turn() {
        let labels = |symmetry: u32| {
            let half = 180.0 / f64::from(symmetry);
            let scale = scale(-half, half, false, Meaning::Direction { symmetry }).unwrap();
            Ticks::fitting(&scale, 60.0).labels.join(" ")
        };
        assert_eq!(labels(2), "−90 −45 0 45 90");
        assert_eq!(labels(4), "−45.0 −22.5 0.0 22.5 45.0");
    }
}
