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
    /// W2, the contour's total curvature in radians, without that at edges beside masked cells, where it is not known.
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
    /// For each threshold, in the field's order, as they stand: parts of the sphere add up to the whole.
    pub totals: Vec<Totals>,
    /// Area of the cells without masked corners, in steradian.
    pub unmasked: f64,
    /// Area of the other cells, in steradian.
    pub masked: f64,
    /// Area of the unmasked cells, as far as it belongs to edges beside masked cells, in steradian. A cell's area belongs
    /// to its edges in equal parts.
    pub lost: f64,
}

impl Regional {
    /// Totals over the unmasked cells, W2 made up for the edges beside masked cells. Nothing is known of it where all edges
    /// are.
    pub fn made_up(&self) -> Vec<Totals> {
        let curvature =
            |raw: f64| if self.lost > 0.0 { raw * self.unmasked / (self.unmasked - self.lost) } else { raw };
        self.totals.iter().map(|t| Totals { curvature: curvature(t.curvature), ..*t }).collect()
    }
}

/// Totals as they stand for each threshold, in the field's order, and the area of masked cells in steradian.
pub fn totals(field: &Field<'_>) -> (Vec<Totals>, f64) {
    let whole = sum(field, None);
    (whole.totals, whole.masked)
}

/// Totals over the pixels of a region, or over the sphere. A cell gives equal shares to its corners, as in windows, and
/// the shares of those count whose centre lies in the region. So parts of the sphere add up to the whole.
pub fn totals_within(field: &Field<'_>, region: Option<&Region>) -> Regional {
    let pixels = region.map(|region| region.pixels(field.grid()));
    sum(field, pixels.as_deref())
}

/// Sums over all cells, or over the shares of these pixels.
fn sum(field: &Field<'_>, pixels: Option<&[bool]>) -> Regional {
    let past = 4 * field.grid().nside() + 1;
    let nothing =
        Regional { totals: vec![Totals::default(); field.thresholds()], unmasked: 0.0, masked: 0.0, lost: 0.0 };
    let chunks: Vec<Vec<Regional>> = (0..past.div_ceil(CHUNK))
        .into_par_iter()
        .map(|i| {
            let mut sink = ByRing { pixels, ring: nothing.clone(), empty: nothing.clone(), finished: Vec::new() };
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
        all.lost += ring.lost;
    }
    all
}

/// Cell rings that are gone through in a row.
const CHUNK: usize = 32;

/// Totals of the present ring, and of those finished.
struct ByRing<'a> {
    /// The pixels whose shares count; without, all do.
    pixels: Option<&'a [bool]>,
    ring: Regional,
    empty: Regional,
    finished: Vec<Regional>,
}

impl ByRing<'_> {
    /// How much of what these corners of a cell share in equal parts counts.
    fn share(&self, cell: Cell<'_>, corners: &[usize]) -> f64 {
        let Some(pixels) = self.pixels else { return 1.0 };
        let within = corners.iter().filter(|&&corner| pixels[cell.pixels[corner].index]);
        within.count() as f64 / corners.len() as f64
    }

    fn share_of_cell(&self, cell: Cell<'_>) -> f64 {
        self.share(cell, &[0, 1, 2, 3][..cell.count])
    }
}

impl Sink for ByRing<'_> {
    fn wants_area(&self) -> bool {
        true
    }

    fn wants_edges(&self) -> bool {
        true
    }

    fn masked(&mut self, cell: Cell<'_>, area: f64) {
        self.ring.masked += self.share_of_cell(cell) * area;
    }

    fn inside(&mut self, cell: Cell<'_>, thresholds: Range<usize>, area: f64) {
        for edge in (0..cell.count).filter(|&edge| cell.masked_beyond[edge]) {
            self.ring.lost += self.share(cell, &[edge, cell.next(edge)]) * area / cell.count as f64;
        }
        let area = self.share_of_cell(cell) * area;
        self.ring.unmasked += area;
        self.ring.totals[thresholds].iter_mut().for_each(|t| t.area += area);
    }

    fn area(&mut self, cell: Cell<'_>, threshold: usize, area: f64) {
        self.ring.totals[threshold].area += self.share_of_cell(cell) * area;
    }

    fn contour(&mut self, cell: Cell<'_>, threshold: usize, segments: &[Segment<'_>]) {
        let share = self.share_of_cell(cell);
        let ends = segments.iter().flat_map(Segment::ends_at).filter(|end| !cell.masked_beyond[end.edge]);
        let curvature: f64 = ends.map(|end| self.share(cell, &[end.edge, cell.next(end.edge)]) * end.angle()).sum();
        let totals = &mut self.ring.totals[threshold];
        totals.length += share * segments.iter().map(Segment::length).sum::<f64>();
        totals.curvature += curvature;
    }

    fn cell_finished(&mut self, _: Cell<'_>) {}

    fn ring_finished(&mut self, _: usize) {
        self.finished.push(std::mem::replace(&mut self.ring, self.empty.clone()));
    }
}
