//! How much stands behind a value: the masked part of a window, and the contour in it.

use crate::Needs;
use crate::registry::Kind;

/// Masked fraction.
pub(crate) const MASKED_FRACTION: Kind = Kind {
    pattern: "masked-fraction",
    rank: Some(0),
    unit: "",
    definition: "share of the window's cells that are masked",
    needs: |_| Needs::default(),
    evaluate: |_, w| Some(w.masked_fraction),
};

/// Contour length, not made up for masked cells.
pub(crate) const CONTOUR_LENGTH: Kind = Kind {
    pattern: "contour-length",
    rank: Some(0),
    unit: "rad",
    definition: "length of contour behind a value: W1, not made up for masked cells",
    needs: |_| Needs { length: true, ..Needs::default() },
    evaluate: |_, w| Some(w.length * (1.0 - w.masked_fraction)),
};
