//! The colour of a value: the range, by the values seen and their meaning, and the colours along it.
//!
//! The colour maps themselves are left to [`colours`](super::colours), what the colour bar names to
//! [`ticks`](super::ticks).

use longan_grid::{UNSEEN, is_bad};

use super::Error;
use super::colours::Colours;
use super::limits::LIMIT;

/// Share of the values below and above the default colour range, each.
const TAIL: f64 = 0.01;

/// The default range ends at most this many times the distance of the quartiles beyond them, though more than [`TAIL`]
/// of the values lie there: a normal distribution ends at 1.2 times.
const FENCE: f64 = 10.0;

/// The colour of masked pixels.
pub(super) const MASKED: [u8; 3] = [178, 178, 178];

/// Values on both sides of zero are shown about it where the shorter side has at least this share of the longer one:
/// then neither colour of a diverging map goes to waste.
const SIGNED: f64 = 0.2;

/// Colours along the range.
const STEPS: usize = 1024;

/// The meaning of a map's values, as far as it decides how they are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Meaning {
    /// Any numbers.
    #[default]
    Any,
    /// Deviations from what is expected, about zero.
    Deviation,
    /// From 0 to 100.
    Percentile,
    /// Directions in degrees, the same again after a turn by 360 degrees over this number.
    Direction {
        /// The number of turns that change nothing.
        symmetry: u32,
    },
}

/// How values become colours, as far as that is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Colouring {
    /// The values at the ends of the colour bar; by default robust percentiles of the values seen.
    pub range: (Option<f64>, Option<f64>),
    /// Whether colours follow the logarithm.
    pub log: bool,
    /// The colour map; by default one that suits the meaning.
    pub colours: Option<Colours>,
    /// The meaning of the values.
    pub meaning: Meaning,
}

/// The values at the ends of the colour bar, the colours between, and what is seen besides.
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) log: bool,
    /// Whether there are values beyond the ends.
    pub(super) below: bool,
    pub(super) above: bool,
    /// Whether masked pixels are seen.
    pub(super) masked: bool,
    pub(super) meaning: Meaning,
    colours: Vec<[u8; 3]>,
}

impl Scale {
    /// The scale for values that are seen.
    pub(super) fn new(values: &[f64], colouring: &Colouring) -> Result<Self, Error> {
        let Colouring { range: asked, log, meaning, .. } = *colouring;
        let masked = values.iter().any(|&v| is_bad(v, UNSEEN));
        let seen: Vec<f64> = values.iter().copied().filter(|&v| !is_bad(v, UNSEEN)).collect();
        let mut shown: Vec<f64> = seen.iter().copied().filter(|&v| !log || v > 0.0).collect();
        if log && shown.is_empty() && !seen.is_empty() {
            return Err(Error::NothingPositive);
        }
        let (low, high) = match meaning {
            Meaning::Direction { symmetry } if !log => (-180.0 / f64::from(symmetry), 180.0 / f64::from(symmetry)),
            Meaning::Percentile if !log => (0.0, 100.0),
            _ => default_range(&mut shown, log),
        };
        let signed = !log
            && match meaning {
                Meaning::Deviation => true,
                Meaning::Any => {
                    let (low, high) = (asked.0.unwrap_or(low), asked.1.unwrap_or(high));
                    low < 0.0 && high > 0.0 && (-low).min(high) >= SIGNED * (-low).max(high)
                }
                _ => false,
            };
        let colours = colouring.colours.unwrap_or(match meaning {
            Meaning::Direction { .. } => Colours::Cyclic,
            _ if signed => Colours::BlueRed,
            _ => Colours::Viridis,
        });
        let about_zero = colours.are_diverging() && !log;
        // An end that is given has its opposite for company.
        let (low, high) = match asked {
            (Some(low), Some(high)) => (low, high),
            (Some(low), None) if about_zero && low < 0.0 => (low, -low),
            (None, Some(high)) if about_zero && high > 0.0 => (-high, high),
            (None, None) if about_zero && (signed || low < 0.0 && high > 0.0) => {
                let most = low.abs().max(high.abs());
                (-most, most)
            }
            (asked_low, asked_high) => (asked_low.unwrap_or(low), asked_high.unwrap_or(high)),
        };
        if !(low.abs() <= LIMIT && high.abs() <= LIMIT && (high - low).is_normal() && low < high) {
            return Err(Error::Range { low, high });
        }
        if log && low <= 0.0 {
            return Err(Error::LogRange { low });
        }
        let (below, above) = (seen.iter().any(|&v| v < low), seen.iter().any(|&v| v > high));
        let mut scale = Scale { low, high, log, below, above, masked, meaning, colours: Vec::new() };
        let centred = about_zero && low < 0.0 && high > 0.0;
        let place = |along: f64| match scale.value(along) {
            value if centred => 0.5 + 0.5 * value / low.abs().max(high),
            _ => along,
        };
        scale.colours = (0..STEPS).map(|i| colours.at(place(i as f64 / (STEPS - 1) as f64))).collect();
        Ok(scale)
    }

    /// The place of a value along the bar: 0 at its low end, 1 at its high end.
    pub(super) fn place(&self, value: f64) -> f64 {
        if self.log {
            // Nothing is far below what is positive.
            (value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// The value at a place along the bar.
    fn value(&self, place: f64) -> f64 {
        if self.log {
            (self.low.ln() + (self.high.ln() - self.low.ln()) * place).exp()
        } else {
            self.low + (self.high - self.low) * place
        }
    }

    /// The colour at a place along the bar.
    pub(super) fn colour_at(&self, place: f64) -> [u8; 3] {
        self.colours[(place.clamp(0.0, 1.0) * (STEPS - 1) as f64).round() as usize]
    }

    /// The colour of a value.
    pub(super) fn colour(&self, value: f64) -> [u8; 3] {
        if is_bad(value, UNSEEN) { MASKED } else { self.colour_at(self.place(value)) }
    }
}

/// The central 1 − 2 [`TAIL`] of the values, but not what is within no [`FENCE`]; all of them where that has no width; something around a constant.
fn default_range(values: &mut [f64], log: bool) -> (f64, f64) {
    if values.is_empty() {
        return if log { (1.0, 10.0) } else { (0.0, 1.0) };
    }
    let last = values.len() - 1;
    let mut at =
        |quantile: f64| *values.select_nth_unstable_by((last as f64 * quantile).round() as usize, f64::total_cmp).1;
    let (lower, upper) = (at(0.25), at(0.75));
    // Halves, so that differences of the largest numbers stay finite.
    let reach = if log { f64::INFINITY } else { FENCE * (0.5 * upper - 0.5 * lower) * 2.0 };
    let fence = if reach > 0.0 { reach } else { f64::INFINITY };
    let (low, high) = (at(TAIL).max(lower - fence), at(1.0 - TAIL).min(upper + fence));
    let (low, high) = if low < high { (low, high) } else { (at(0.0), at(1.0)) };
    if (high - low).is_normal() {
        return (low, high);
    }
    if log {
        return (low / 2.0, low * 2.0);
    }
    let half = if (low / 2.0).is_normal() { low.abs() / 2.0 } else { 0.5 };
    (low - half, low + half)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(values: &[f64], colouring: Colouring) -> Scale {
        Scale::new(values, &colouring).unwrap()
    }

    fn range(values: &[f64]) -> (f64, f64) {
        let scale = scale(values, Colouring::default());
        (scale.low, scale.high)
    }

    fn ranged(low: f64, high: f64) -> Colouring {
        Colouring { range: (Some(low), Some(high)), ..Colouring::default() }
    }

    #[test]
    fn default_ranges_ignore_tails_and_masked_values() {
        let mut values: Vec<f64> = (0..=1000).rev().map(f64::from).collect();
        assert!(!scale(&values, Colouring::default()).masked);
        values.extend([f64::NAN, f64::INFINITY, UNSEEN]);
        let scale = scale(&values, Colouring::default());
        assert_eq!((scale.low, scale.high, scale.below, scale.above), (10.0, 990.0, true, true));
        assert!(scale.masked);
        assert_eq!([values[1001], f64::INFINITY, UNSEEN].map(|v| scale.colour(v)), [MASKED; 3]);
        // Values far away from all others, even if not so few.
        let values: Vec<f64> = (0..1000).map(|i| if i < 960 { f64::from(i % 97) } else { 1e7 }).collect();
        assert!(range(&values).1 < 1000.0);
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
        let given = scale(&[0.0, 5.0], ranged(0.0, 4.0));
        assert_eq!((given.low, given.high, given.below, given.above), (0.0, 4.0, false, true));
        let end = |value| given.colour(value);
        assert_eq!((end(-1.0), end(9.0)), (end(0.0), end(4.0)));
        assert_eq!((end(0.0), end(4.0)), ([68, 1, 84], [253, 231, 37]));
        for (low, high) in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY), (0.0, 2e300)] {
            let refused = Scale::new(&[1.0], &ranged(low, high));
            assert!(matches!(refused, Err(Error::Range { .. })), "{low} {high}");
        }
        let open = scale(&[1.0, 2.0, 3.0], Colouring { range: (None, Some(2.5)), ..Colouring::default() });
        assert_eq!((open.low, open.high, open.above), (1.0, 2.5, true));
    }

    #[test]
    fn signed_values_are_shown_about_zero() {
        let values: Vec<f64> = (-500..=1000).map(f64::from).collect();
        let signed = scale(&values, Colouring::default());
        assert_eq!(signed.low, -signed.high);
        let [r, g, b] = signed.colour(0.0);
        assert!(r > 235 && g > 235 && b > 235, "zero is neutral");
        let ([r, _, b], [red, _, blue]) = (signed.colour(-400.0), signed.colour(400.0));
        assert!(b > r && red > blue);
        // A few values below zero make no signed field.
        let values: Vec<f64> = (-50..=1000).map(f64::from).collect();
        assert_eq!(scale(&values, Colouring::default()).colour(1000.0), Colours::Viridis.at(1.0));
        // Zero stays neutral in a range that is given.
        let lopsided = scale(&[0.0], Colouring { colours: Some(Colours::BlueRed), ..ranged(-1.0, 3.0) });
        assert_eq!(lopsided.colour(0.0), signed.colour(0.0));
        assert_eq!(lopsided.colour(3.0), Colours::BlueRed.at(1.0));
        let deviations = Colouring { meaning: Meaning::Deviation, ..Colouring::default() };
        let deviations = scale(&[0.5, 1.0, 4.0], deviations);
        assert_eq!((deviations.low, deviations.high), (-4.0, 4.0));
    }

    #[test]
    fn percentiles_and_directions_have_ranges_of_their_own() {
        let of = |meaning| scale(&[3.0], Colouring { meaning, ..Colouring::default() });
        let percentile = of(Meaning::Percentile);
        assert_eq!((percentile.low, percentile.high), (0.0, 100.0));
        let direction = of(Meaning::Direction { symmetry: 4 });
        assert_eq!((direction.low, direction.high), (-45.0, 45.0));
        assert_eq!(direction.colour(-45.0), direction.colour(45.0));
    }

    #[test]
    fn logarithms_want_positive_values() {
        let log = Colouring { log: true, ..Colouring::default() };
        let mut values: Vec<f64> = (0..=300).map(|i| 10f64.powf(f64::from(i) / 100.0)).collect();
        values.extend([0.0; 500]);
        let rain = scale(&values, log);
        assert!(rain.low > 1.0 && rain.high < 1000.0 && rain.below && rain.above);
        assert!((rain.place((rain.low * rain.high).sqrt()) - 0.5).abs() < 1e-12);
        assert_eq!(rain.colour(0.0), rain.colour(rain.low));
        assert!(matches!(Scale::new(&[0.0, -2.0], &log), Err(Error::NothingPositive)));
        assert!(matches!(
            Scale::new(&[1.0], &Colouring { log: true, ..ranged(0.0, 2.0) }),
            Err(Error::LogRange { .. })
        ));
        // A constant, and nothing at all.
        let constant = scale(&[4.0; 3], log);
        assert_eq!((constant.low, constant.high), (2.0, 8.0));
        assert!(Scale::new(&[f64::NAN], &log).is_ok());
    }
}
