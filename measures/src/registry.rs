//! The list of built-in measures, and finding one by its name.
//!
//! Command line, `longan measures` and the documentation all read this list.

use crate::kind::Kind;
use crate::{Measure, Needs, Quantity, Window, coverage, functionals, irreducible, rank2, rank4};

/// All built-in measures.
pub const BUILT_INS: &[&Kind] = &[
    &functionals::W0,
    &functionals::W1,
    &functionals::W2,
    &functionals::TRACE,
    &rank2::EVQ,
    &rank2::BETA,
    &rank2::EVQ_DIRECTION,
    &irreducible::PSI,
    &irreducible::PSI_DIRECTION,
    &irreducible::Q,
    &rank4::MIN,
    &rank4::MID,
    &rank4::MAX,
    &rank4::NORM,
    &coverage::MASKED_FRACTION,
    &coverage::CONTOUR_LENGTH,
];

/// One measure of the built-in kinds.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn {
    kind: &'static Kind,
    rank: u32,
}

impl Measure for BuiltIn {
    fn name(&self) -> String {
        self.with_rank(self.kind.pattern)
    }

    fn definition(&self) -> String {
        self.with_rank(self.kind.definition)
    }

    fn quantity(&self) -> Quantity {
        (self.kind.quantity)(self.rank)
    }

    fn unit(&self) -> &str {
        self.kind.unit
    }

    fn rank(&self) -> u32 {
        self.rank
    }

    fn needs(&self) -> Needs {
        (self.kind.needs)(self.rank)
    }

    fn evaluate(&self, window: &Window<'_>) -> Option<f64> {
        (self.kind.evaluate)(self.rank, window)
    }
}

impl AsRef<dyn Measure> for BuiltIn {
    fn as_ref(&self) -> &(dyn Measure + 'static) {
        self
    }
}

impl BuiltIn {
    /// The measure of this kind; `rank` counts only for a family.
    pub fn new(kind: &'static Kind, rank: u32) -> Self {
        BuiltIn { kind, rank: kind.rank.unwrap_or(rank) }
    }

    fn with_rank(&self, text: &str) -> String {
        if self.kind.rank.is_some() { text.to_owned() } else { text.replace('N', &self.rank.to_string()) }
    }
}

/// A name that no measure has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no measure '{name}'{}", nearest.as_ref().map(|n| format!(" (did you mean '{n}'?)")).unwrap_or_default())]
pub struct UnknownMeasure {
    /// The name asked for.
    pub name: String,
    /// The known name most like it, if any is like it.
    pub nearest: Option<String>,
}

impl UnknownMeasure {
    /// A name that is none of the known ones.
    pub(crate) fn new(name: &str, known: impl Iterator<Item = String>) -> Self {
        let usual = usual(name);
        let nearest = known
            .map(|known| (strsim::damerau_levenshtein(&known, &usual), known))
            .min()
            .filter(|(distance, known)| 2 * distance <= known.len())
            .map(|(_, known)| known);
        UnknownMeasure { name: name.to_owned(), nearest }
    }
}

/// A name as measures have it, in small letters and with hyphens, however it is typed: `EVQ` is `evq`,
/// `Psi2_Direction` is `psi2-direction`.
pub fn usual(name: &str) -> String {
    name.trim().to_lowercase().replace('_', "-")
}

/// The built-in measure of this [`usual`] name.
///
/// # Errors
/// [`UnknownMeasure`], with the nearest name.
pub fn find(name: &str) -> Result<BuiltIn, UnknownMeasure> {
    let usual = usual(name);
    let found = BUILT_INS.iter().find_map(|&kind| named(kind, &usual));
    found.ok_or_else(|| UnknownMeasure::new(name, names_like(name)))
}

/// The names of the built-ins, families with the rank that `name` has.
pub(crate) fn names_like(name: &str) -> impl Iterator<Item = String> {
    let digits: String = name.chars().filter(char::is_ascii_digit).collect();
    let rank = digits.parse().ok().filter(|&rank: &u32| rank > 0).unwrap_or(2);
    BUILT_INS.iter().map(move |kind| BuiltIn::new(kind, rank).name())
}

fn named(kind: &'static Kind, name: &str) -> Option<BuiltIn> {
    if let Some(rank) = kind.rank {
        return (kind.pattern == name).then_some(BuiltIn { kind, rank });
    }
    let (before, after) = kind.pattern.split_once('N')?;
    let digits = name.strip_prefix(before)?.strip_suffix(after)?;
    let rank: u32 = digits.parse().ok()?;
    (rank > 0 && rank.to_string() == digits).then_some(BuiltIn { kind, rank })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found() {
        for name in ["w0", "evq-direction", "psi1", "psi17-direction", "q2", "rank4-mid", "contour-length"] {
            assert_eq!(find(name).unwrap().name(), name);
        }
        for name in ["EVQ", "Rank4_Mid", " psi2_direction ", "PSI2-Direction"] {
            assert_eq!(find(name).unwrap().name(), usual(name));
        }
        assert_eq!(find("psi12-direction").unwrap().column(), "PSI12_DIRECTION");
        assert_eq!(find("psi4").unwrap().rank(), 4);
    }

    #[test]
    fn others_are_not_but_the_nearest_is_named() {
        let nearest = |name: &str| find(name).unwrap_err().nearest;
        assert_eq!(nearest("evk").as_deref(), Some("evq"));
        assert_eq!(nearest("psi3-directon").as_deref(), Some("psi3-direction"));
        assert_eq!(nearest("psi0").as_deref(), Some("psi2"));
        assert_eq!(nearest("psi03").as_deref(), Some("psi3"));
        for name in ["psi0", "psi", "psi-1", "psi02", "psi99999999999", "e-v-q", "", "psi2x", "psiN"] {
            assert!(find(name).is_err(), "{name}");
        }
        assert_eq!(nearest("temperature"), None);
    }

    #[test]
    fn the_list_is_in_order() {
        for (i, kind) in BUILT_INS.iter().enumerate() {
            assert!(!kind.definition.is_empty() && !kind.definition.contains('\n'), "{}", kind.pattern);
            assert!(["sr", "rad", "deg", ""].contains(&kind.unit), "{}", kind.pattern);
            assert_eq!(kind.rank.is_none(), kind.pattern.contains('N'), "{}", kind.pattern);
            assert!(BUILT_INS[..i].iter().all(|other| other.pattern != kind.pattern), "{} twice", kind.pattern);
        }
    }

    #[test]
    fn quantities_follow_from_the_measure() {
        let angle = |symmetry| Quantity::Angle { symmetry };
        for (name, quantity, is_relative) in [
            ("w0", Quantity::Area, false),
            ("w1", Quantity::Length, false),
            ("w2", Quantity::Curvature, false),
            ("trace", Quantity::Moment, false),
            ("evq", Quantity::Ratio, true),
            ("beta", Quantity::Ratio, true),
            ("evq-direction", angle(2), true),
            ("psi3", Quantity::Moment, false),
            ("psi3-direction", angle(3), true),
            ("psi12-direction", angle(12), true),
            ("q4", Quantity::Ratio, true),
            ("rank4-min", Quantity::Moment, false),
            ("rank4-norm", Quantity::Moment, false),
            // Known of every window, whatever contour it has.
            ("masked-fraction", Quantity::Ratio, false),
            ("contour-length", Quantity::Length, false),
        ] {
            let measure = find(name).unwrap();
            assert_eq!((measure.quantity(), measure.is_relative()), (quantity, is_relative), "{name}");
            // The rule before measures stated their quantity.
            let by_unit = matches!(measure.unit(), "" | "deg") && measure.needs() != Needs::default();
            assert_eq!(measure.is_relative(), by_unit, "{name}");
        }
    }

    #[test]
    fn every_built_in_keeps_the_contract() {
        for kind in BUILT_INS {
            for rank in [1, 2, 3, 8] {
                crate::testing::check(&BuiltIn::new(kind, rank));
            }
        }
    }
}
