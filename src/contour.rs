//! The marching loop: body and contour of a field in every cell, at every threshold.
//!
//! The body K at a threshold t is where the field is ≥ t, or, for [`Body::Below`], where it is < t. On a cell edge with
//! one end in the body the contour crosses at the fraction (t − a)/(b − a) of the edge; crossings are joined by
//! geodesics (mathematics: Collischon et al. 2024; marching squares with interpolation). Each piece goes to a
//! [`Sink`]; what is made of it, moments or totals, is the sink's affair.

use std::ops::Range;

use glam::DVec3;
use longan_grid::Healpix;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::angles;
use crate::cells::{CellRing, Geometry, Pixel, Point, Stencil, area_of_triangle};
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

impl Body {
    /// The name in options, headers and recipes: `above` or `below`.
    pub fn name(self) -> &'static str {
        match self {
            Body::Above => "above",
            Body::Below => "below",
        }
    }
}

/// A field on the grid and the thresholds at which to contour it.
#[derive(Debug)]
pub struct Field<'a> {
    grid: Healpix,
    values: &'a [f64],
    thresholds: &'a [f64],
    body: Body,
}

/// The bin of a masked pixel.
const MASKED: u16 = u16::MAX;

/// Pixels sorted into bins at a time.
const BINNED: usize = 1024;

impl<'a> Field<'a> {
    /// Values in RING order (NaN: masked) with the thresholds at which to contour them.
    ///
    /// # Panics
    /// If the number of values is not the grid's.
    pub fn new(grid: Healpix, values: &'a [f64], thresholds: &'a Thresholds, body: Body) -> Self {
        assert_eq!(values.len(), grid.pixels(), "one value for each pixel");
        Field { grid, values, thresholds: thresholds.values(), body }
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
        self.values.par_iter().any(|v| v.is_nan())
    }

    /// The bins of the pixels that are corners of cells on these cell rings, and the first of these pixels.
    fn bins(&self, cells: &Range<usize>) -> (usize, Vec<u16>) {
        let (first, last) = self.corner_rings(cells);
        let (first, last) = (self.grid.ring(first).start, self.grid.ring(last));
        let values = &self.values[first..last.start + last.len];
        let mut bins = vec![0; values.len()];
        for (values, bins) in values.chunks(BINNED).zip(bins.chunks_mut(BINNED)) {
            sort_into_bins(values, self.thresholds, bins);
        }
        (first, bins)
    }

    /// The first and the last pixel ring with corners of cells on these cell rings.
    fn corner_rings(&self, cells: &Range<usize>) -> (usize, usize) {
        (cells.start.saturating_sub(1).max(1), cells.end.min(self.grid.rings()))
    }
}

/// Which cells have masked corners, on some cell rings.
struct MaskedCells {
    /// The first of these cell rings.
    first: usize,
    /// For each ring, for each cell.
    rings: Vec<Vec<bool>>,
    /// Likewise, whether one of the cells beyond its edges has masked corners.
    beside: Vec<Vec<bool>>,
}

impl MaskedCells {
    /// The cells on these rings, by the bins of their corners, of which the first is that of pixel `first`; nothing where
    /// no pixel is masked.
    fn find(grid: Healpix, rings: Range<usize>, first: usize, bins: &[u16]) -> Option<Self> {
        let pixels: Vec<bool> = bins.iter().map(|bin| *bin == MASKED).collect();
        if !pixels.contains(&true) {
            return None;
        }
        let of_ring = |i| CellRing::new(grid, i).with_corners(&pixels, first);
        let masked: Vec<_> = rings.clone().map(of_ring).collect();
        let mut beside: Vec<_> = masked.iter().map(|ring| vec![false; ring.len()]).collect();
        for (i, masked) in rings.clone().zip(&masked) {
            let ring = CellRing::new(grid, i);
            for (cell, _) in masked.iter().enumerate().filter(|(_, masked)| **masked) {
                let (sector, k) = (cell / ring.stencils, cell % ring.stencils);
                let beyond = ring.beyond(&ring.stencil(k), sector).into_iter().flatten();
                beyond.filter(|(i, _)| rings.contains(i)).for_each(|(i, cell)| beside[i - rings.start][cell] = true);
            }
        }
        Some(MaskedCells { first: rings.start, rings: masked, beside })
    }

    /// Beyond which edges of a cell there is a masked cell.
    #[inline(always)]
    fn beyond(&self, i: usize, ring: &CellRing, k: usize, stencil: &Stencil, sector: usize) -> [bool; 4] {
        if !self.beside[i - self.first][sector * ring.stencils + k] {
            return [false; 4];
        }
        let is_masked = |(ring, cell): (usize, usize)| self.rings[ring - self.first][cell];
        ring.beyond(stencil, sector).map(|cell| cell.is_some_and(is_masked))
    }
}

/// The number of thresholds ≤ each value, or [`MASKED`].
#[multiversion::multiversion(targets = "simd")]
fn sort_into_bins(values: &[f64], thresholds: &[f64], bins: &mut [u16]) {
    for &threshold in thresholds {
        for (bin, &value) in bins.iter_mut().zip(values) {
            *bin += u16::from(threshold <= value);
        }
    }
    for (bin, value) in bins.iter_mut().zip(values) {
        if value.is_nan() {
            *bin = MASKED;
        }
    }
}

/// A cell as a sink sees it.
#[derive(Clone, Copy, Debug)]
pub struct Cell<'a> {
    /// The cell ring, from 0 at the north pole.
    pub ring: usize,
    /// Corners, counter-clockwise; only the first [`count`](Self::count) are meant.
    pub pixels: &'a [Pixel; 4],
    /// Number of corners, 4 or 3.
    pub count: usize,
    /// Edges beyond which the cell is masked, each with the number of its first corner; none where the sink does not
    /// [want](Sink::wants_edges) them.
    pub masked_beyond: [bool; 4],
}

impl Cell<'_> {
    /// The corner at which an edge ends.
    #[inline(always)]
    pub fn next(&self, edge: usize) -> usize {
        if edge + 1 == self.count { 0 } else { edge + 1 }
    }
}

/// Where the contour crosses an edge.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    edge: usize,
    point: Point,
}

/// A piece of contour within a cell, from where it leaves the body's side of the boundary to where it returns: the
/// body lies to the left.
#[derive(Clone, Copy, Debug)]
pub struct Segment<'a> {
    /// The cell's geometry, in whose frame the points are.
    pub geometry: &'a Geometry,
    from: Crossing,
    to: Crossing,
    /// Sine of the length.
    sin: f64,
    /// Whether the body is above the threshold.
    above: bool,
    /// Unit normal, at right angles to the whole segment, out of the body.
    pub normal: DVec3,
}

impl<'a> Segment<'a> {
    #[inline(always)]
    fn new(geometry: &'a Geometry, from: Crossing, to: Crossing, body: Body) -> Self {
        let cross = to.point.at.cross(from.point.minus(&to.point));
        let sin = cross.length();
        let above = body == Body::Above;
        let normal = cross * (if above { 1.0 } else { -1.0 } / sin);
        Segment { geometry, from, to, sin, above, normal }
    }

    /// Length in radians.
    #[inline(always)]
    pub fn length(&self) -> f64 {
        angles::from_sin_cos(self.sin, self.from.point.at.dot(self.to.point.at))
    }

    /// Where it begins and ends, as unit vectors.
    pub fn ends(&self) -> [DVec3; 2] {
        [self.from.point.at, self.to.point.at]
    }

    /// The edges that it begins and ends on, each numbered by its first corner.
    pub fn edges(&self) -> [usize; 2] {
        [self.from.edge, self.to.edge]
    }

    /// Direction of the normal at each corner, after transport there from the segment's midpoint: e^{iϕ} with ϕ
    /// counted from south towards east.
    #[inline(always)]
    pub fn directions(&self) -> Phases<4> {
        let midpoint = self.from.point.at + self.to.point.at;
        transport::to_corners(self.normal, midpoint, midpoint.length(), self.geometry)
    }

    /// Its parts of the exterior angles at both ends.
    #[inline(always)]
    pub fn ends_at(&self) -> [End<'a>; 2] {
        let end = |crossing: &Crossing, leaves: bool| {
            let inward = self.geometry.inward(crossing.edge);
            End {
                geometry: self.geometry,
                edge: crossing.edge,
                sign: if leaves == self.above { 1.0 } else { -1.0 },
                sin: self.normal.dot(inward),
                cos: crossing.point.at.cross(self.normal).dot(inward).abs(),
            }
        };
        [end(&self.from, true), end(&self.to, false)]
    }
}

/// A segment's part of the exterior angle at a vertex of the contour, where it crosses an edge into the next cell.
///
/// With the body on the left the exterior angle goes from the normal of the arriving segment to that of the leaving one.
/// Each of both cells has the part between its segment's normal and the edge's direction out of the body. A vertex
/// belongs to its edge, half to each of the edge's two pixels.
#[derive(Clone, Copy, Debug)]
pub struct End<'a> {
    geometry: &'a Geometry,
    /// The edge, with the number of its first corner; it ends at the next.
    pub edge: usize,
    /// 1 where the segment begins here, −1 where it ends. Also 1 where the edge runs out of the body, −1 where it runs
    /// into it.
    sign: f64,
    /// Sine and cosine of the part.
    sin: f64,
    cos: f64,
}

impl End<'_> {
    /// The part of the exterior angle in radians.
    #[inline(always)]
    pub fn angle(&self) -> f64 {
        // The cosine is not negative, and this is faster than `atan2`.
        (self.sin / self.cos).atan()
    }

    /// At both corners of the edge, e^{iϕ} of the edge's direction out of the body and of the segment's normal, after
    /// transport along the edge: the bounds of the normal cone's part.
    #[inline(always)]
    pub fn cone(&self) -> [Complex64; 4] {
        // Transport along a geodesic keeps the angle to it.
        let turn = Complex64::new(self.cos, self.sign * self.sin) / self.cos.hypot(self.sin);
        let [first, next] = self.geometry.directions(self.edge).map(|(cos, sin)| Complex64::new(cos, sin) * self.sign);
        [first, next, first * turn, next * turn]
    }

    /// The sign of the integral over the cone from the edge's direction to the normal.
    #[inline(always)]
    pub fn sign(&self) -> f64 {
        self.sign
    }
}

/// What takes the pieces of body and contour that the marching loop finds.
pub trait Sink {
    /// Whether [`inside`](Self::inside) and [`area`](Self::area) are wanted.
    fn wants_area(&self) -> bool;
    /// Whether it matters which [cells beyond edges](Cell::masked_beyond) are masked.
    fn wants_edges(&self) -> bool;
    /// A cell with a masked corner, which contributes nothing else; its area in steradian, if wanted.
    fn masked(&mut self, cell: Cell<'_>, area: f64);
    /// A cell that lies wholly in the body at these thresholds, and its area in steradian.
    fn inside(&mut self, cell: Cell<'_>, thresholds: Range<usize>, area: f64);
    /// Area in steradian of the body in a cell that the contour crosses at this threshold.
    fn area(&mut self, cell: Cell<'_>, threshold: usize, area: f64);
    /// The contour in a cell at this threshold: one piece, or two at a saddle. All of a cell come in a row.
    fn contour(&mut self, cell: Cell<'_>, threshold: usize, segments: &[Segment<'_>]);
    /// No more pieces of this cell follow.
    fn cell_finished(&mut self, cell: Cell<'_>);
    /// No more cells of this cell ring follow.
    fn ring_finished(&mut self, ring: usize);
}

/// Marches through all cells of these cell rings (`0..=4 Nside`, at least one), ring by ring and eastwards within a sector.
///
/// Inlined, so that callers compiled for a processor's own instructions make use of them here.
#[inline(always)]
pub fn march(field: &Field<'_>, rings: Range<usize>, sink: &mut impl Sink) {
    // With the cells beyond the edges of these.
    let past = 4 * field.grid.nside() + 1;
    let around =
        if sink.wants_edges() { rings.start.saturating_sub(1)..(rings.end + 1).min(past) } else { rings.clone() };
    let (first, bins_of) = field.bins(&around);
    let masked_cells = if sink.wants_edges() { MaskedCells::find(field.grid, around, first, &bins_of) } else { None };
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
                let bins = pixels.map(|p| bins_of[p.index - first]);
                // A triangle's fourth corner repeats its first.
                let lo = bins[0].min(bins[1]).min(bins[2].min(bins[3]));
                let hi = bins[0].max(bins[1]).max(bins[2].max(bins[3]));
                if lo == hi && hi != MASKED && !sink.wants_area() {
                    continue;
                }
                let masked_beyond = match &masked_cells {
                    Some(cells) => cells.beyond(i, &ring, k, &stencil, sector),
                    None => [false; 4],
                };
                let cell = Cell { ring: i, pixels: &pixels, count: stencil.count(), masked_beyond };
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
                    sink.inside(cell, whole, *area);
                }
                if lo < hi {
                    let values = pixels.map(|p| field.values[p.index]);
                    for t in lo..hi {
                        cut(field, t, geometry, *area, cell, &values, bins.map(|b| usize::from(b) > t), sink);
                    }
                }
                sink.cell_finished(cell);
            }
        }
        sink.ring_finished(i);
    }
}

/// Body and contour in a cell that the contour at threshold `t` crosses; `above` tells which corners are ≥ t.
#[allow(clippy::too_many_arguments)]
#[inline(always)]
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
    let next = |corner: usize| geometry.next(corner);
    let crossing = |edge: usize| {
        // Halves, so that differences of the largest numbers stay finite.
        let (a, b, t) = (0.5 * values[edge], 0.5 * values[next(edge)], 0.5 * threshold);
        let from_end = (b - t).abs() < (t - a).abs();
        let fraction = (if from_end { b - t } else { t - a }) / (b - a);
        Crossing { edge, point: geometry.point(edge, from_end, fraction.max(CROSSING_MARGIN)) }
    };
    let saddle = cell.count == 4 && above[0] == above[2] && above[1] == above[3];
    if !saddle {
        // Edges at which a walk around the cell leaves the part above and returns to it.
        let mask = above[..cell.count].iter().rev().fold(0u32, |mask, &above| mask << 1 | u32::from(above));
        let of_next = mask >> 1 | (mask & 1) << (cell.count - 1);
        let leaving = (mask & !of_next).trailing_zeros() as usize;
        let returning = (!mask & of_next).trailing_zeros() as usize;
        let (from, to) = (crossing(leaving), crossing(returning));
        sink.contour(cell, t, &[Segment::new(geometry, from, to, field.body)]);
        if sink.wants_area() {
            // The part above: a fan of triangles from `to` over its corners to `from`.
            let mut area = 0.0;
            let mut corner = next(returning);
            while corner != leaving {
                area += area_of_triangle(to.point.at, geometry.corner[corner], geometry.corner[next(corner)]);
                corner = next(corner);
            }
            area += area_of_triangle(to.point.at, geometry.corner[leaving], from.point.at);
            sink.area(cell, t, if field.body == Body::Above { area } else { cell_area - area });
        }
        return;
    }
    // A saddle: the corners above are connected through the middle if the mean is above, else cut off one by one.
    // (Summed crosswise, so that it does not depend on how the cell is turned.)
    let quarters = values.map(|v| 0.25 * v);
    let connected = (quarters[0] + quarters[2]) + (quarters[1] + quarters[3]) > threshold;
    let crossings = [crossing(0), crossing(1), crossing(2), crossing(3)];
    let first = usize::from(above[0] == connected);
    let cut_off = [first, first + 2].map(|corner| (crossings[(corner + 3) % 4], corner, crossings[corner]));
    let segments = cut_off.map(|(before, _, after)| {
        let (from, to) = if connected { (before, after) } else { (after, before) };
        Segment::new(geometry, from, to, field.body)
    });
    sink.contour(cell, t, &segments);
    if sink.wants_area() {
        let area = |(before, corner, after): (Crossing, usize, Crossing)| {
            area_of_triangle(before.point.at, geometry.corner[corner], after.point.at)
        };
        let cut_off = area(cut_off[0]) + area(cut_off[1]);
        sink.area(cell, t, if connected == (field.body == Body::Above) { cell_area - cut_off } else { cut_off });
    }
}
