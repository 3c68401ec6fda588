//! Minkowski functionals over the whole unmasked sphere, for each threshold.

use std::f64::consts::TAU;
use std::ops::Range;

use rayon::prelude::*;

use crate::contour::{Cell, Field, Segment, Sink, march};

/// Area, length and curvature of the body at one threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// W0, the body's area in steradian.
    pub area: f64,
    /// W1, the contour's length in radians.
    pub length: f64,
    /// W2, the contour's total curvature in radians.
    pub curvature: f64,
}

impl Totals {
    /// (W0 + W2)/2π. By Gauss–Bonnet the Euler characteristic, an integer to rounding, where no pixel is masked.
    pub fn euler_characteristic(&self) -> f64 {
        (self.area + self.curvature) / TAU
    }
}

/// Totals for each threshold, in the field's order, and the area of masked cells in steradian.
pub fn totals(field: &Field<'_>) -> (Vec<Totals>, f64) {
    let rings: Vec<RingTotals> = (0..=4 * field.grid().nside())
        .into_par_iter()
        .map(|ring| {
            let mut sink = RingTotals { by_threshold: vec![Totals::default(); field.thresholds()], masked: 0.0 };
            march(field, ring..ring + 1, &mut sink);
            sink
        })
        .collect();
    // Summed in the order of the rings, so that the number of threads makes no difference.
    let mut totals = vec![Totals::default(); field.thresholds()];
    let mut masked = 0.0;
    for ring in &rings {
        for (total, part) in totals.iter_mut().zip(&ring.by_threshold) {
            total.area += part.area;
            total.length += part.length;
            total.curvature += part.curvature;
        }
        masked += ring.masked;
    }
    (totals, masked)
}

struct RingTotals {
    by_threshold: Vec<Totals>,
    masked: f64,
}

impl Sink for RingTotals {
    fn wants_area(&self) -> bool {
        true
    }

    fn masked(&mut self, _: Cell<'_>, area: f64) {
        self.masked += area;
    }

    fn inside(&mut self, _: Cell<'_>, thresholds: Range<usize>, area: f64) {
        self.by_threshold[thresholds].iter_mut().for_each(|t| t.area += area);
    }

    fn area(&mut self, _: Cell<'_>, threshold: usize, area: f64) {
        self.by_threshold[threshold].area += area;
    }

    fn segment(&mut self, _: Cell<'_>, threshold: usize, segment: &Segment<'_>) {
        self.by_threshold[threshold].length += segment.length();
        self.by_threshold[threshold].curvature += segment.turn();
    }

    fn finished(&mut self, _: Cell<'_>) {}
}
