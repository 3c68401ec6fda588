//! The evidence behind a value: the masked share of a window, and the length of contour in it.

use crate::kind::Kind;
use crate::{Needs, Quantity};

/// Masked fraction.
pub(crate) const MASKED_FRACTION: Kind = Kind {
    pattern: "masked-fraction",
    rank: Some(0),
    quantity: |_| Quantity::Ratio,
    unit: "",
    definition: "share of the window's cells that are masked",
    needs: |_| Needs::default(),
    evaluate: |_, w| Some(w.masked_fraction),
};

/// Length of the contour in the unmasked cells.
pub(crate) const CONTOUR_LENGTH: Kind = Kind {
    pattern: "contour-length",
    rank: Some(0),
    quantity: |_| Quantity::Length,
    unit: "rad",
    definition: "length of the contour in the window's unmasked cells: W1, not divided by their share",
    needs: |_| Needs { length: true, ..Needs::default() },
    evaluate: |_, w| Some(w.length * (1.0 - w.masked_fraction)),
};
