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
    let past = 4 * field.grid().nside() + 1;
    let chunks: Vec<Vec<RingTotals>> = (0..past.div_ceil(CHUNK))
        .into_par_iter()
        .map(|i| {
            let ring = RingTotals { by_threshold: vec![Totals::default(); field.thresholds()], masked: 0.0 };
            let mut sink = ByRing { ring: ring.clone(), empty: ring, finished: Vec::new() };
            march(field, i * CHUNK..((i + 1) * CHUNK).min(past), &mut sink);
            sink.finished
        })
        .collect();
    // Summed in the order of the rings, so that the number of threads makes no difference.
    let mut totals = vec![Totals::default(); field.thresholds()];
    let mut masked = 0.0;
    for ring in chunks.iter().flatten() {
        for (total, part) in totals.iter_mut().zip(&ring.by_threshold) {
            total.area += part.area;
            total.length += part.length;
            total.curvature += part.curvature;
        }
        masked += ring.masked;
    }
    (totals, masked)
}

/// Cell rings that are gone through in a row.
const CHUNK: usize = 32;

#[derive(Clone)]
struct RingTotals {
    by_threshold: Vec<Totals>,
    masked: f64,
}

/// Totals of the present ring, and of those finished.
struct ByRing {
    ring: RingTotals,
    empty: RingTotals,
    finished: Vec<RingTotals>,
}

impl Sink for ByRing {
    fn wants_area(&self) -> bool {
        true
    }

    fn masked(&mut self, _: Cell<'_>, area: f64) {
        self.ring.masked += area;
    }

    fn inside(&mut self, _: Cell<'_>, thresholds: Range<usize>, area: f64) {
        self.ring.by_threshold[thresholds].iter_mut().for_each(|t| t.area += area);
    }

    fn area(&mut self, _: Cell<'_>, threshold: usize, area: f64) {
        self.ring.by_threshold[threshold].area += area;
    }

    fn contour(&mut self, _: Cell<'_>, threshold: usize, segments: &[Segment<'_>]) {
        self.ring.by_threshold[threshold].length += segments.iter().map(Segment::length).sum::<f64>();
        self.ring.by_threshold[threshold].curvature += segments.iter().map(Segment::turn).sum::<f64>();
    }

    fn cell_finished(&mut self, _: Cell<'_>) {}

    fn ring_finished(&mut self, _: usize) {
        self.finished.push(std::mem::replace(&mut self.ring, self.empty.clone()));
    }
}
