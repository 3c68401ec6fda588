//! Minkowski functionals of the body in a window, and the trace of the tensors.

use crate::kind::Kind;
use crate::{Needs, Quantity};

/// Area.
pub(crate) const W0: Kind = Kind {
    pattern: "w0",
    rank: Some(0),
    quantity: |_| Quantity::Area,
    unit: "sr",
    definition: "W0, area of the body in the window",
    needs: |_| Needs { area: true, ..Needs::default() },
    evaluate: |_, w| Some(w.area),
};

/// Length.
pub(crate) const W1: Kind = Kind {
    pattern: "w1",
    rank: Some(0),
    quantity: |_| Quantity::Length,
    unit: "rad",
    definition: "W1, length of the contour in the window",
    needs: |_| Needs { length: true, ..Needs::default() },
    evaluate: |_, w| Some(w.length),
};

/// Total curvature.
pub(crate) const W2: Kind = Kind {
    pattern: "w2",
    rank: Some(0),
    quantity: |_| Quantity::Curvature,
    unit: "rad",
    definition: "W2, total geodesic curvature of the contour in the window",
    needs: |_| Needs { curvature: true, ..Needs::default() },
    evaluate: |_, w| Some(w.curvature),
};

/// Trace of the even-rank tensors.
pub(crate) const TRACE: Kind = Kind {
    pattern: "trace",
    rank: Some(2),
    quantity: |_| Quantity::Moment,
    unit: "rad",
    definition: "trace of the tensors of even rank, ψ_0: W1, or of tensors weighted by curvature W2",
    needs: |_| Needs { ranks: vec![0], ..Needs::default() },
    evaluate: |_, w| Some(w.psi0),
};
