//! Quantities in files: of columns as they are written, and of columns as they are read.
//!
//! Here, and nowhere else, the name of a column that states no quantity tells it: of files of older releases and of other
//! programs. Which quantities there are is left to [`longan::measures`].

use longan::measures::Quantity;
use longan_formats::StatedQuantity;
use longan_picture::Meaning;

/// The quantity as files state it.
pub(crate) fn stated(quantity: Quantity) -> StatedQuantity {
    StatedQuantity { quantity: quantity.name().to_owned(), symmetry: quantity.symmetry() }
}

/// The quantity of a column: the one that the file states or, where it states none that is known, the one of this name.
pub(crate) fn of_column(stated: Option<&StatedQuantity>, name: &str) -> Quantity {
    known(stated).unwrap_or_else(|| Quantity::of_column(name))
}

/// As [`of_column`], in a file of Minkowski maps. All that is in degrees there, and states no quantity, is an angle.
pub(crate) fn of_measure(stated: Option<&StatedQuantity>, name: &str, unit: &str) -> Quantity {
    match of_column(stated, name) {
        Quantity::Number if known(stated).is_none() && unit == "deg" => Quantity::Angle { symmetry: 1 },
        quantity => quantity,
    }
}

fn known(stated: Option<&StatedQuantity>) -> Option<Quantity> {
    stated.and_then(|stated| Quantity::named(&stated.quantity, stated.symmetry))
}

/// How pictures show values of a quantity.
pub(crate) fn meaning(quantity: Quantity) -> Meaning {
    match quantity {
        Quantity::Angle { symmetry } => Meaning::Direction { symmetry },
        Quantity::Deviation => Meaning::Deviation,
        Quantity::Percentile => Meaning::Percentile,
        _ => Meaning::Any,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_counts_and_else_the_name() {
        let says = |quantity: &str, symmetry| StatedQuantity { quantity: quantity.to_owned(), symmetry };
        let angle = |symmetry| Quantity::Angle { symmetry };
        assert_eq!(of_column(Some(&says("ratio", None)), "EVQ_DIRECTION"), Quantity::Ratio);
        assert_eq!(of_column(Some(&says("angle", Some(4))), "WIND"), angle(4));
        // None that is known.
        for unknown in [says("air temperature", None), says("angle", None)] {
            assert_eq!(of_column(Some(&unknown), "EVQ_DIRECTION"), angle(2));
            assert_eq!(of_measure(Some(&unknown), "OWN", "deg"), angle(1));
        }
        assert_eq!(of_column(None, "PSI3_DIRECTION"), angle(3));
        assert_eq!(of_column(None, "WIND_DIRECTION"), Quantity::Number);
        assert_eq!(of_measure(Some(&says("number", None)), "OWN", "deg"), Quantity::Number);
        assert_eq!(of_measure(None, "PSI3_DIRECTION", "deg"), angle(3));
        assert_eq!(of_measure(None, "OWN", ""), Quantity::Number);
        for quantity in [Quantity::Area, Quantity::Percentile, angle(7)] {
            assert_eq!(of_column(Some(&stated(quantity)), ""), quantity);
        }
    }

    #[test]
    fn pictures_follow_from_the_quantity() {
        assert_eq!(meaning(Quantity::Angle { symmetry: 4 }), Meaning::Direction { symmetry: 4 });
        assert_eq!(meaning(Quantity::Deviation), Meaning::Deviation);
        assert_eq!(meaning(Quantity::Percentile), Meaning::Percentile);
        assert_eq!(meaning(Quantity::Curvature), Meaning::Any);
    }
}
