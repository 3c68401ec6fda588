//! The marching loop: body and contour of a field in every cell, at every threshold.
//!
//! The body K at a threshold t is where the field is ≥ t, or, for [`Body::Below`], where it is < t. On a cell edge with
//! one end in the body the contour crosses at the fraction (t − a)/(b − a) of the edge; crossings are joined by
//! geodesics (mathematics: Collischon et al. 2024; marching squares with interpolation). Each piece goes to a
//! [`Sink`]; what is made of it, moments or totals, is the sink's affair.

use std::ops::Range;

use glam::DVec3;
use longan_formats::Healpix;
use rayon::prelude::*;

use crate::cells::{CellRing, Geometry, Pixel, area_of_triangle};
use crate::thresholds::Thresholds;
use crate::transport::{self, Phases};

/// Crossings keep this fraction of an edge from its ends: the contour stays generic (no segment has length 0)
/// where values lie exactly at the threshold.
pub const CROSSING_MARGIN: f64 = 1e-6;

/// Which side of a threshold is the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Body {
    /// Values at or above the threshold.
    #[default]
    Above,
    /// Values below the threshold.
    Below,
}

/// A field on the grid, sorted into bins between thresholds.
#[derive(Debug)]
pub struct Field<'a> {
    grid: Healpix,
    values: &'a [f64],
    thresholds: &'a [f64],
    body: Body,
    /// Number of thresholds ≤ value, or [`MASKED`].
    bins: Vec<u16>,
}

const MASKED: u16 = u16::MAX;

impl<'a> Field<'a> {
    /// Values in RING order (NaN: masked) with the thresholds at which to contour them.
    ///
    /// # Panics
    /// If the number of values is not the grid's.
    pub fn new(grid: Healpix, values: &'a [f64], thresholds: &'a Thresholds, body: Body) -> Self {
        assert_eq!(values.len(), grid.pixels(), "one value for each pixel");
        let thresholds = thresholds.values();
        let bin = |v: &f64| if v.is_nan() { MASKED } else { thresholds.partition_point(|t| t <= v) as u16 };
        Field { grid, values, thresholds, body, bins: values.par_iter().map(bin).collect() }
    }

    /// The grid.
    pub fn grid(&self) -> Healpix {
        self.grid
    }

    /// Number of thresholds.
    pub fn thresholds(&self) -> usize {
        self.thresholds.len()
    }

    /// Whether any pixel is masked.
    pub fn has_masked(&self) -> bool {
        self.bins.par_iter().any(|&b| b == MASKED)
    }
}

/// A cell as a sink sees it.
#[derive(Clone, Copy, Debug)]
pub struct Cell<'a> {
    /// Corners, counter-clockwise; only the first [`count`](Self::count) are meant.
    pub pixels: &'a [Pixel; 4],
    /// Number of corners, 4 or 3.
    pub count: usize,
}

/// A piece of contour within a cell, from where it leaves the body's side of the boundary to where it returns: the
/// body lies to the left.
#[derive(Clone, Copy, Debug)]
pub struct Segment<'a> {
    /// The cell's geometry, in whose frame the points are.
    pub geometry: &'a Geometry,
    from: DVec3,
    to: DVec3,
    from_edge: usize,
    to_edge: usize,
    /// Sine of the length.
    sin: f64,
    /// Unit normal, at right angles to the whole segment, out of the body.
    pub normal: DVec3,
}

impl<'a> Segment<'a> {
    #[inline]
    fn new(geometry: &'a Geometry, (from_edge, from): (usize, DVec3), (to_edge, to): (usize, DVec3), body: Body) -> Self {
        let cross = to.cross(from);
        let sin = cross.length();
        let normal = cross * (if body == Body::Above { 1.0 } else { -1.0 } / sin);
        Segment { geometry, from, to, from_edge, to_edge, sin, normal }
    }

    /// Length in radians.
    #[inline]
    pub fn length(&self) -> f64 {
        self.sin.atan2(self.from.dot(self.to))
    }

    /// Direction of the normal at each corner, after transport there from the segment's midpoint: e^{iϕ} with ϕ
    /// counted from south towards east.
    #[inline]
    pub fn directions(&self) -> Phases<4> {
        let midpoint = self.from + self.to;
        transport::to_corners(self.normal, midpoint, midpoint.length(), self.geometry)
    }

    /// The part of the contour's total curvature that belongs to this segment: the angles, at both ends, between
    /// the contour and the perpendicular of the crossed edge. Two cells share each crossing's exterior angle.
    pub fn turn(&self) -> f64 {
        let end = |point: DVec3, edge: usize| {
            let inward = self.geometry.inward(edge);
            self.normal.dot(inward).atan2(point.cross(self.normal).dot(inward).abs())
        };
        end(self.from, self.from_edge) + end(self.to, self.to_edge)
    }
}

/// What takes the pieces of body and contour that the marching loop finds.
pub trait Sink {
    /// Whether [`inside`](Self::inside) and [`area`](Self::area) are wanted.
    fn wants_area(&self) -> bool;
    /// A cell with a masked corner, which contributes nothing else; its area in steradian, if wanted.
    fn masked(&mut self, cell: Cell<'_>, area: f64);
    /// A cell that lies wholly in the body at these thresholds, and its area in steradian.
    fn inside(&mut self, cell: Cell<'_>, thresholds: Range<usize>, area: f64);
    /// Area in steradian of the body in a cell that the contour crosses at this threshold.
    fn area(&mut self, cell: Cell<'_>, threshold: usize, area: f64);
    /// A piece of contour. All pieces of a cell come in a row.
    fn segment(&mut self, cell: Cell<'_>, threshold: usize, segment: &Segment<'_>);
    /// No more pieces of this cell follow.
    fn finished(&mut self, cell: Cell<'_>);
}

/// Marches through all cells of these cell rings (`0..=4 Nside`), ring by ring and eastwards within a sector.
pub fn march(field: &Field<'_>, rings: Range<usize>, sink: &mut impl Sink) {
    for i in rings {
        let ring = CellRing::new(field.grid, i);
        let mut known: Option<(Geometry, f64)> = None;
        for k in 0..ring.stencils {
            let stencil = ring.stencil(k);
            if !ring.uniform {
                known = None;
            }
            for sector in 0..ring.sectors {
                let pixels = stencil.pixels(sector);
                let cell = Cell { pixels: &pixels, count: stencil.count() };
                let bins = pixels.map(|p| field.bins[p.index]);
                // A triangle's fourth corner repeats its first.
                let lo = bins[0].min(bins[1]).min(bins[2].min(bins[3]));
                let hi = bins[0].max(bins[1]).max(bins[2].max(bins[3]));
                if lo == hi && hi != MASKED && !sink.wants_area() {
                    continue;
                }
                let (geometry, area) = known.get_or_insert_with(|| {
                    let geometry = ring.geometry(&stencil);
                    let area = if sink.wants_area() { geometry.area() } else { 0.0 };
                    (geometry, area)
                });
                if hi == MASKED {
                    sink.masked(cell, *area);
                    continue;
                }
                let (lo, hi) = (usize::from(lo), usize::from(hi));
                if sink.wants_area() {
                    let whole = match field.body {
                        Body::Above => 0..lo,
                        Body::Below => hi..field.thresholds.len(),
                    };
                    if !whole.is_empty() {
                        sink.inside(cell, whole, *area);
                    }
                }
                if lo < hi {
                    let values = pixels.map(|p| field.values[p.index]);
                    for t in lo..hi {
                        cut(field, t, geometry, *area, cell, &values, bins.map(|b| usize::from(b) > t), sink);
                    }
                    sink.finished(cell);
                }
            }
        }
    }
}

/// Body and contour in a cell that the contour at threshold `t` crosses; `above` tells which corners are ≥ t.
#[allow(clippy::too_many_arguments)]
#[inline]
fn cut(
    field: &Field<'_>,
    t: usize,
    geometry: &Geometry,
    cell_area: f64,
    cell: Cell<'_>,
    values: &[f64; 4],
    above: [bool; 4],
    sink: &mut impl Sink,
) {
    let threshold = field.thresholds[t];
    let next = |c: usize| if c + 1 == cell.count { 0 } else { c + 1 };
    let crossing = |edge: usize| {
        // Halves, so that differences of the largest numbers stay finite.
        let (a, b) = (0.5 * values[edge], 0.5 * values[next(edge)]);
        let fraction = ((0.5 * threshold - a) / (b - a)).clamp(CROSSING_MARGIN, 1.0 - CROSSING_MARGIN);
        (edge, geometry.point(edge, fraction))
    };
    let saddle = cell.count == 4 && above[0] == above[2] && above[1] == above[3];
    if !saddle {
        let leaving = (0..cell.count).find(|&e| above[e] && !above[next(e)]).expect("the contour crosses this cell");
        let mut returning = next(leaving);
        while !above[next(returning)] {
            returning = next(returning);
        }
        let (from, to) = (crossing(leaving), crossing(returning));
        sink.segment(cell, t, &Segment::new(geometry, from, to, field.body));
        if sink.wants_area() {
            // The part above: a fan of triangles from `to` over its corners to `from`.
            let mut area = 0.0;
            let mut corner = next(returning);
            while corner != leaving {
                area += area_of_triangle(to.1, geometry.corner[corner], geometry.corner[next(corner)]);
                corner = next(corner);
            }
            area += area_of_triangle(to.1, geometry.corner[leaving], from.1);
            sink.area(cell, t, if field.body == Body::Above { area } else { cell_area - area });
        }
        return;
    }
    // A saddle: the corners above are connected through the middle if the mean is above, else cut off one by one.
    let connected = values.iter().map(|v| 0.25 * v).sum::<f64>() > threshold;
    let crossings = [crossing(0), crossing(1), crossing(2), crossing(3)];
    let mut cut_off = 0.0;
    for corner in 0..4 {
        if above[corner] == connected {
            continue;
        }
        let (before, after) = (crossings[(corner + 3) % 4], crossings[corner]);
        let (from, to) = if connected { (before, after) } else { (after, before) };
        sink.segment(cell, t, &Segment::new(geometry, from, to, field.body));
        if sink.wants_area() {
            cut_off += area_of_triangle(before.1, geometry.corner[corner], after.1);
        }
    }
    if sink.wants_area() {
        sink.area(cell, t, if connected == (field.body == Body::Above) { cell_area - cut_off } else { cut_off });
    }
}
