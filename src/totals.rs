//! Minkowski functionals over the unmasked sphere or a region of it, for each threshold.

use std::f64::consts::TAU;
use std::ops::Range;

use rayon::prelude::*;

use crate::contour::{Cell, Field, Segment, Sink, march};
use crate::region::Region;

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

    /// The same to the steradian of an area.
    pub fn per_area(&self, area: f64) -> Totals {
        Totals { area: self.area / area, length: self.length / area, curvature: self.curvature / area }
    }
}

/// Totals over the sphere or a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Regional {
    /// For each threshold, in the field's order.
    pub totals: Vec<Totals>,
    /// Area of the cells without masked corners, in steradian.
    pub unmasked: f64,
    /// Area of the other cells, in steradian.
    pub masked: f64,
}

/// Totals for each threshold, in the field's order, and the area of masked cells in steradian.
pub fn totals(field: &Field<'_>) -> (Vec<Totals>, f64) {
    let whole = sum(field, |_| 1.0);
    (whole.totals, whole.masked)
}

/// Totals over the pixels of a region, or over the sphere. A cell gives equal shares to its corners, as in windows, and
/// the shares of those count whose centre lies in the region. So parts of the sphere add up to the whole.
pub fn totals_within(field: &Field<'_>, region: Option<&Region>) -> Regional {
    let Some(region) = region else { return sum(field, |_| 1.0) };
    let pixels = region.pixels(field.grid());
    sum(field, |cell| {
        let corners = &cell.pixels[..cell.count];
        corners.iter().filter(|pixel| pixels[pixel.index]).count() as f64 / cell.count as f64
    })
}

/// Sums over all cells, each as much as `share` says.
fn sum(field: &Field<'_>, share: impl Fn(Cell<'_>) -> f64 + Sync) -> Regional {
    let past = 4 * field.grid().nside() + 1;
    let nothing = Regional { totals: vec![Totals::default(); field.thresholds()], unmasked: 0.0, masked: 0.0 };
    let chunks: Vec<Vec<Regional>> = (0..past.div_ceil(CHUNK))
        .into_par_iter()
        .map(|i| {
            let mut sink =
                ByRing { share: &share, ring: nothing.clone(), empty: nothing.clone(), finished: Vec::new() };
            march(field, i * CHUNK..((i + 1) * CHUNK).min(past), &mut sink);
            sink.finished
        })
        .collect();
    // Summed in the order of the rings, so that the number of threads makes no difference.
    let mut all = nothing;
    for ring in chunks.iter().flatten() {
        for (total, part) in all.totals.iter_mut().zip(&ring.totals) {
            total.area += part.area;
            total.length += part.length;
            total.curvature += part.curvature;
        }
        all.unmasked += ring.unmasked;
        all.masked += ring.masked;
    }
    all
}

/// Cell rings that are gone through in a row.
const CHUNK: usize = 32;

/// Totals of the present ring, and of those finished.
struct ByRing<'a, S> {
    /// How much of a cell counts.
    share: &'a S,
    ring: Regional,
    empty: Regional,
    finished: Vec<Regional>,
}

impl<S: Fn(Cell<'_>) -> f64> Sink for ByRing<'_, S> {
    fn wants_area(&self) -> bool {
        true
    }

    fn masked(&mut self, cell: Cell<'_>, area: f64) {
        self.ring.masked += (self.share)(cell) * area;
    }

    fn inside(&mut self, cell: Cell<'_>, thresholds: Range<usize>, area: f64) {
        let area = (self.share)(cell) * area;
        self.ring.unmasked += area;
        self.ring.totals[thresholds].iter_mut().for_each(|t| t.area += area);
    }

    fn area(&mut self, cell: Cell<'_>, threshold: usize, area: f64) {
        self.ring.totals[threshold].area += (self.share)(cell) * area;
    }

    fn contour(&mut self, cell: Cell<'_>, threshold: usize, segments: &[Segment<'_>]) {
        let (share, totals) = ((self.share)(cell), &mut self.ring.totals[threshold]);
        totals.length += share * segments.iter().map(Segment::length).sum::<f64>();
        totals.curvature += share * segments.iter().map(Segment::turn).sum::<f64>();
    }

    fn cell_finished(&mut self, _: Cell<'_>) {}

    fn ring_finished(&mut self, _: usize) {
        self.finished.push(std::mem::replace(&mut self.ring, self.empty.clone()));
    }
}
