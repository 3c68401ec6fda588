//! The kind of quantity that a measure or a column of a file holds.
//!
//! The treatment of a value follows from its quantity: whether it has a mean and an order, whether a window with hardly
//! any contour leaves it to chance, and how it is drawn. Units are left to the measures.

use std::fmt::{self, Display};

use crate::registry::{find, usual};
use crate::{Measure, Weight};

/// The kind of quantity that a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Quantity {
    /// An area on the sphere.
    Area,
    /// A length on the sphere.
    Length,
    /// A total curvature: the angle by which a contour turns, which has a sign.
    Curvature,
    /// A moment ψ_s by magnitude, or an eigenvalue: of tensors weighted by length a length, of tensors weighted by
    /// curvature a curvature.
    Moment,
    /// A number of things, such as parts or holes, or a Euler characteristic.
    Count,
    /// A quotient of quantities of one kind.
    Ratio,
    /// A direction in degrees, from south towards east.
    Angle {
        /// The number of turns within 360° that change nothing: the direction is known up to 360° over this, at least 1.
        symmetry: u32,
    },
    /// A deviation from an expected value in standard deviations, about 0.
    Deviation,
    /// A rank among other values, from 0 to 100.
    Percentile,
    /// Any other number, of which no more is known than its unit says.
    Number,
}

/// All quantities by their names, angles of the symmetry 1.
const NAMES: [(&str, Quantity); 10] = [
    ("area", Quantity::Area),
    ("length", Quantity::Length),
    ("curvature", Quantity::Curvature),
    ("moment", Quantity::Moment),
    ("count", Quantity::Count),
    ("ratio", Quantity::Ratio),
    ("angle", Quantity::Angle { symmetry: 1 }),
    ("deviation", Quantity::Deviation),
    ("percentile", Quantity::Percentile),
    ("number", Quantity::Number),
];

impl Quantity {
    /// The name that headers have: `area`, `angle` and so on. The [symmetry](Self::symmetry) is said beside it.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Area => "area",
            Quantity::Length => "length",
            Quantity::Curvature => "curvature",
            Quantity::Moment => "moment",
            Quantity::Count => "count",
            Quantity::Ratio => "ratio",
            Quantity::Angle { .. } => "angle",
            Quantity::Deviation => "deviation",
            Quantity::Percentile => "percentile",
            Quantity::Number => "number",
        }
    }

    /// The symmetry of an angle; `None` for other quantities.
    pub fn symmetry(self) -> Option<u32> {
        match self {
            Quantity::Angle { symmetry } => Some(symmetry),
            _ => None,
        }
    }

    /// The quantity of a [name](Self::name), whatever its case, and a symmetry; `None` for an unknown name, and for an
    /// angle without symmetry.
    pub fn named(name: &str, symmetry: Option<u32>) -> Option<Self> {
        let (_, quantity) = NAMES.into_iter().find(|(known, _)| known.eq_ignore_ascii_case(name.trim()))?;
        match quantity {
            Quantity::Angle { .. } => {
                symmetry.filter(|symmetry| *symmetry > 0).map(|symmetry| Quantity::Angle { symmetry })
            }
            _ => Some(quantity),
        }
    }

    /// The quantity of a column that states none, by its name: a built-in measure's, with the window, the threshold and
    /// the statistic that stand behind it, as in `EVQ_WINDOW_4_SIGMA`. [`Number`](Self::Number) for all other names.
    pub fn of_column(column: &str) -> Self {
        let name = column.trim().to_ascii_uppercase().replace('-', "_");
        if name.ends_with("_SIGMA") {
            return Quantity::Deviation;
        }
        if name.ends_with("_PERCENTILE") {
            return Quantity::Percentile;
        }
        if name.ends_with("_COUNT") {
            return Quantity::Count;
        }
        let ends = ["_WINDOW_", "_THRESHOLD_"].iter().filter_map(|part| name.find(part));
        let name = &name[..ends.min().unwrap_or(name.len())];
        let name = name.strip_suffix("_MEAN").or(name.strip_suffix("_STD")).unwrap_or(name);
        find(&usual(name)).map_or(Quantity::Number, |measure| measure.quantity())
    }

    /// The quantity under tensors of this weight, which tells what a [`Moment`](Self::Moment) is.
    #[must_use]
    pub fn weighted(self, weight: Weight) -> Self {
        match (self, weight) {
            (Quantity::Moment, Weight::Length) => Quantity::Length,
            (Quantity::Moment, Weight::Curvature) => Quantity::Curvature,
            _ => self,
        }
    }

    /// Whether values have a mean and an order. Angles have neither.
    pub fn has_mean(self) -> bool {
        !matches!(self, Quantity::Angle { .. })
    }
}

impl Display for Quantity {
    /// The name, and the symmetry of an angle: `angle/2`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.symmetry() {
            Some(symmetry) => f.pad(&format!("{}/{symmetry}", self.name())),
            None => f.pad(self.name()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_the_quantity() {
        for (name, quantity) in NAMES {
            assert_eq!(quantity.name(), name);
            assert_eq!(Quantity::named(name, quantity.symmetry()), Some(quantity));
            assert_eq!(Quantity::named(&format!(" {} ", name.to_uppercase()), quantity.symmetry()), Some(quantity));
        }
        let angle = Quantity::Angle { symmetry: 4 };
        assert_eq!(Quantity::named("angle", angle.symmetry()), Some(angle));
        assert_eq!((angle.to_string(), Quantity::Area.to_string()), ("angle/4".to_owned(), "area".to_owned()));
        for (name, symmetry) in [("angle", None), ("angle", Some(0)), ("temperature", None), ("", None)] {
            assert_eq!(Quantity::named(name, symmetry), None, "{name}");
        }
    }

    #[test]
    fn columns_that_state_nothing_are_known_by_their_name() {
        for (name, quantity) in [
            ("EVQ", Quantity::Ratio),
            ("W0", Quantity::Area),
            ("PSI2_WINDOW_4", Quantity::Moment),
            ("EVQ_SIGMA", Quantity::Deviation),
            ("evq_local_percentile", Quantity::Percentile),
            ("EVQ_COUNT", Quantity::Count),
            ("W2_MEAN", Quantity::Curvature),
            ("EVQ_DIRECTION", Quantity::Angle { symmetry: 2 }),
            ("psi4-direction", Quantity::Angle { symmetry: 4 }),
            ("PSI12_DIRECTION_WINDOW_4", Quantity::Angle { symmetry: 12 }),
            ("PSI3_DIRECTION_WINDOW_2_5_THRESHOLD_1", Quantity::Angle { symmetry: 3 }),
            ("PSI2_DIRECTION_SIGMA", Quantity::Deviation),
            ("PSI0_DIRECTION", Quantity::Number),
            ("WIND_DIRECTION", Quantity::Number),
            ("EVQ_DIRECTIONAL", Quantity::Number),
            ("", Quantity::Number),
        ] {
            assert_eq!(Quantity::of_column(name), quantity, "{name}");
        }
    }

    #[test]
    fn the_weight_tells_what_a_moment_is() {
        assert_eq!(Quantity::Moment.weighted(Weight::Length), Quantity::Length);
        assert_eq!(Quantity::Moment.weighted(Weight::Curvature), Quantity::Curvature);
        assert_eq!(Quantity::Ratio.weighted(Weight::Curvature), Quantity::Ratio);
    }
}
