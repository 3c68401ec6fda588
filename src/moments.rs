//! Moments of body and contour, gathered at the pixels.
//!
//! A cell's area and length are shared equally among its corners, each share transported from the segment's midpoint to
//! that pixel's centre: ψ_s = Σ L e^{isϕ} with ϕ the angle of the contour's normal there. Curvature sits at the vertices
//! of the contour: a vertex goes half to each of the two pixels whose edge it lies on, with the integral ∫ e^{isϕ} dϕ over
//! its exterior angle for ψ_s. (A cell alone knows only its part of that angle, which is of order 1 and cancels against its
//! neighbour's only where both go to the same pixels.) A vertex beside a masked cell has no exterior angle and counts
//! nothing; how many edges are so lost is counted too.
//!
//! All thresholds are summed, or each is kept by itself; dividing by their number, and summing pixels to windows, is left
//! to [`crate::window`].

use std::ops::Range;

use crate::cells::Pixel;
use crate::contour::{Cell, Field, Segment, Sink, march};
use crate::transport::{Phases, Powers};

pub use longan_measures::Weight;

/// Which moments to accumulate.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// W0.
    pub area: bool,
    /// W1.
    pub length: bool,
    /// W2.
    pub curvature: bool,
    /// Ranks s ≥ 1 of the moments ψ_s, ascending. (ψ_0 is the length or the curvature, after the weight.)
    pub ranks: Vec<u32>,
    /// The weight of the moments ψ_s.
    pub weight: Weight,
    /// Each threshold by itself instead of their sum.
    pub by_threshold: bool,
}

/// Where each selected quantity stands among the rows of a ring.
///
/// The shares that are masked come first, and the edges lost, then for each group of thresholds the plain rows, W0 to W2,
/// then for each group those of ψ_s. A group is one threshold where these are kept by themselves, else there is one group of them all.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Cell shares that are masked, of the four that each pixel has. Absent where nothing is masked.
    pub masked: Option<usize>,
    /// Edges beside masked cells, of the four that each pixel has. Absent where nothing is masked or no curvature is
    /// selected.
    pub lost_edges: Option<usize>,
    /// W0 of the first group; [`plain`](Self::plain) rows further on that of the next, as for the following.
    pub area: Option<usize>,
    /// W1.
    pub length: Option<usize>,
    /// W2.
    pub curvature: Option<usize>,
    /// Plain rows of a group.
    pub plain: usize,
    /// Re ψ_s of the first group's first rank; Im ψ_s is the next row, then come the other ranks, then other groups.
    pub first_rank: usize,
    /// Ranks s ≥ 1, ascending.
    pub ranks: Vec<u32>,
    /// Weight of the moments.
    pub weight: Weight,
    /// Number of groups.
    pub groups: usize,
    /// Number of rows.
    pub rows: usize,
}

impl Layout {
    /// Rows for this selection and so many thresholds.
    pub fn new(selection: &Selection, thresholds: usize, masked: bool) -> Self {
        let groups = if selection.by_threshold { thresholds } else { 1 };
        let mut rows = 0;
        let mut row = |wanted: bool| {
            rows += usize::from(wanted);
            wanted.then(|| rows - 1)
        };
        let by_curvature = selection.weight == Weight::Curvature && !selection.ranks.is_empty();
        let lost_edges = masked && (selection.curvature || by_curvature);
        let (masked, lost_edges) = (row(masked), row(lost_edges));
        let (area, length, curvature) = (row(selection.area), row(selection.length), row(selection.curvature));
        let plain = rows - [masked, lost_edges].iter().flatten().count();
        let first_rank = rows + (groups - 1) * plain;
        Layout {
            masked,
            lost_edges,
            area,
            length,
            curvature,
            plain,
            first_rank,
            ranks: selection.ranks.clone(),
            weight: selection.weight,
            groups,
            rows: first_rank + groups * 2 * selection.ranks.len(),
        }
    }

    /// The first row of each ψ_s, with the place of its rank: all ranks of the first group, then of the next.
    pub(crate) fn psi(&self) -> impl Iterator<Item = (usize, usize)> {
        let ranks = self.ranks.len();
        (0..self.groups * ranks).map(move |i| (self.first_rank + 2 * i, i % ranks))
    }

    /// The plain rows of some groups, and their rows of ψ_s.
    #[inline(always)]
    fn rows_of(&self, groups: &Range<usize>) -> [Range<usize>; 2] {
        let (first, step) = (self.first_rank - self.groups * self.plain, 2 * self.ranks.len());
        if self.groups == 1 && !groups.is_empty() {
            // They follow one another.
            return [first..self.rows, self.rows..self.rows];
        }
        [
            first + groups.start * self.plain..first + groups.end * self.plain,
            self.first_rank + groups.start * step..self.first_rank + groups.end * step,
        ]
    }

    /// Whether there are moments ψ_s, s ≥ 1, weighted by curvature.
    #[inline(always)]
    fn is_by_curvature(&self) -> bool {
        self.weight == Weight::Curvature && !self.ranks.is_empty()
    }

    /// Whether anything is made of curvature.
    fn has_curvature(&self) -> bool {
        self.curvature.is_some() || self.is_by_curvature()
    }

    /// The row of Re ψ_s of a group's first rank.
    #[inline(always)]
    fn psi_of(&self, group: usize) -> usize {
        self.first_rank + 2 * self.ranks.len() * group
    }

    /// The group of a threshold.
    #[inline(always)]
    fn group(&self, threshold: usize) -> usize {
        if self.groups == 1 { 0 } else { threshold }
    }
}

/// Cell shares of a pixel, which is a corner of four cells; and its edges, one to each pixel that it shares a side with.
pub const SHARES: usize = 4;

/// Moments at the pixels of one ring, a row for each quantity.
#[derive(Clone, Debug)]
pub struct RingMoments {
    data: Vec<f64>,
    len: usize,
}

impl RingMoments {
    /// The moments of these pixels and those, one after the other.
    pub fn joined(&self, these: Range<usize>, those: Range<usize>) -> Self {
        let len = these.len() + those.len();
        let rows = self.data.chunks_exact(self.len);
        let data = rows.flat_map(|row| row[these.clone()].iter().chain(&row[those.clone()])).copied().collect();
        RingMoments { data, len }
    }

    /// One quantity at all pixels of the ring.
    #[inline]
    pub fn row(&self, row: usize) -> &[f64] {
        &self.data[row * self.len..(row + 1) * self.len]
    }
}

/// Moments at the pixels of these rings (`1..4 Nside`). Which rings are asked for together makes no difference.
pub fn at_pixels(field: &Field<'_>, layout: &Layout, rings: Range<usize>) -> Vec<RingMoments> {
    let moments = rings.clone().map(|i| {
        let len = field.grid().ring(i).len;
        RingMoments { data: vec![0.0; layout.rows * len], len }
    });
    // A pixel's cells lie on its own ring and the two beside it.
    let cells = rings.start - 1..rings.end + 1;
    let (rings, first) = (moments.collect(), rings.start);
    if layout.has_curvature() {
        curved(field, cells, Gather::new(layout, first, rings))
    } else {
        straight(field, cells, Gather::new(layout, first, rings))
    }
}

/// Marches where curvature is selected.
#[multiversion::multiversion(targets = "simd")]
fn curved(field: &Field<'_>, cells: Range<usize>, mut gather: Gather<'_, true>) -> Vec<RingMoments> {
    march(field, cells, &mut gather);
    gather.rings
}

/// Marches where no curvature is selected, which costs nothing then.
#[multiversion::multiversion(targets = "simd")]
fn straight(field: &Field<'_>, cells: Range<usize>, mut gather: Gather<'_, false>) -> Vec<RingMoments> {
    march(field, cells, &mut gather);
    gather.rings
}

struct Gather<'a, const CURVATURE: bool> {
    layout: &'a Layout,
    first: usize,
    rings: Vec<RingMoments>,
    /// What the present cell ring's cells give to the pixels of the same ring, apart from the rest: two cells to each,
    /// in an order that differs where the ring begins. So the sum does not depend on where that is.
    same_ring: Vec<f64>,
    /// The present cell's moments as seen from each of its corners, row by row.
    cell: Vec<[f64; 4]>,
    /// Groups of thresholds between which all lie that have moments in the present cell.
    touched: Range<usize>,
}

impl<'a, const CURVATURE: bool> Gather<'a, CURVATURE> {
    fn new(layout: &'a Layout, first: usize, rings: Vec<RingMoments>) -> Self {
        let cell = vec![[0.0; 4]; layout.rows];
        Gather { layout, first, rings, same_ring: Vec::new(), cell, touched: 0..0 }
    }

    /// Where to add what a cell gives to one of its corners, and that ring's length; nowhere for other rings.
    #[inline(always)]
    fn target(&mut self, cell: Cell<'_>, pixel: Pixel) -> Option<(&mut [f64], usize)> {
        let ring = pixel.ring.checked_sub(self.first).and_then(|i| self.rings.get_mut(i))?;
        if pixel.ring == cell.ring {
            self.same_ring.resize(ring.data.len(), 0.0);
            Some((&mut self.same_ring, ring.len))
        } else {
            Some((&mut ring.data, ring.len))
        }
    }

    #[inline(always)]
    fn touch(&mut self, groups: Range<usize>) {
        let Range { start, end } = self.touched;
        self.touched = if start == end { groups } else { start.min(groups.start)..end.max(groups.end) };
    }

    #[inline(always)]
    fn add(&mut self, cell: Cell<'_>, segment: &Segment<'_>, group: usize) {
        let layout = self.layout;
        if CURVATURE {
            self.add_curvature(cell, segment, group);
        }
        let by_length = layout.weight == Weight::Length && !layout.ranks.is_empty();
        if layout.length.is_none() && !by_length {
            return;
        }
        let length = segment.length();
        let rows = &mut self.cell;
        if let Some(row) = layout.length {
            let row = row + group * layout.plain;
            rows[row] = rows[row].map(|a| a + length);
        }
        if !by_length {
            return;
        }
        let mut powers = Powers::new(segment.directions());
        for (rows, &rank) in rows[layout.psi_of(group)..].chunks_exact_mut(2).zip(&layout.ranks) {
            let power = powers.raise(rank);
            for c in 0..4 {
                rows[0][c] += length * power.re[c];
                rows[1][c] += length * power.im[c];
            }
        }
    }

    /// Adds the segment's parts of the exterior angles at its ends.
    #[inline(always)]
    fn add_curvature(&mut self, cell: Cell<'_>, segment: &Segment<'_>, group: usize) {
        let layout = self.layout;
        // Half to each pixel of the edge, where all else is divided by the number of corners.
        let half = cell.count as f64 / 2.0;
        for end in segment.ends_at() {
            let corners = [end.edge, cell.next(end.edge)];
            if cell.masked_beyond[end.edge] {
                continue;
            }
            if let Some(row) = layout.curvature {
                let angle = half * end.angle();
                corners.iter().for_each(|&c| self.cell[row + group * layout.plain][c] += angle);
            }
            if !layout.is_by_curvature() {
                continue;
            }
            // ∫ e^{isϕ} dϕ from the edge's direction ε to the normal ν is (e^{isν} − e^{isε})/(is).
            let mut powers = Powers::new(Phases::from(end.cone()));
            for (rows, &rank) in self.cell[layout.psi_of(group)..].chunks_exact_mut(2).zip(&layout.ranks) {
                let power = powers.raise(rank);
                let weight = half * end.sign() / f64::from(rank);
                for (i, &c) in corners.iter().enumerate() {
                    rows[0][c] += weight * (power.im[i + 2] - power.im[i]);
                    rows[1][c] -= weight * (power.re[i + 2] - power.re[i]);
                }
            }
        }
    }
}

impl<const CURVATURE: bool> Sink for Gather<'_, CURVATURE> {
    fn wants_area(&self) -> bool {
        self.layout.area.is_some()
    }

    fn wants_edges(&self) -> bool {
        CURVATURE && self.layout.lost_edges.is_some()
    }

    fn masked(&mut self, cell: Cell<'_>, _: f64) {
        let Layout { masked, lost_edges, .. } = *self.layout;
        // An edge between two masked cells is met twice.
        let lost = |edge: usize| if cell.masked_beyond[edge] { 0.5 } else { 1.0 };
        for (corner, &pixel) in cell.pixels[..cell.count].iter().enumerate() {
            let before = if corner == 0 { cell.count } else { corner } - 1;
            let edges = lost(before) + lost(corner);
            let Some((data, len)) = self.target(cell, pixel) else { continue };
            if let Some(row) = masked {
                data[row * len + pixel.column] += 1.0;
            }
            if let Some(row) = lost_edges {
                data[row * len + pixel.column] += edges;
            }
        }
    }

    fn inside(&mut self, cell: Cell<'_>, thresholds: Range<usize>, area: f64) {
        if self.layout.groups == 1 {
            self.area(cell, thresholds.start, area * thresholds.len() as f64);
        } else {
            thresholds.for_each(|threshold| self.area(cell, threshold, area));
        }
    }

    fn area(&mut self, _: Cell<'_>, threshold: usize, area: f64) {
        let group = self.layout.group(threshold);
        if let Some(row) = self.layout.area {
            self.cell[row + group * self.layout.plain].iter_mut().for_each(|a| *a += area);
            self.touch(group..group + 1);
        }
    }

    #[inline(always)]
    fn contour(&mut self, cell: Cell<'_>, threshold: usize, segments: &[Segment<'_>]) {
        let group = self.layout.group(threshold);
        self.touch(group..group + 1);
        let [one, other] = segments else {
            for segment in segments {
                self.add(cell, segment, group);
            }
            return;
        };
        // The two of a saddle are summed first: their order depends on how the cell is turned.
        let rows = self.layout.rows_of(&(group..group + 1));
        let so_far = rows.clone().map(|rows| self.cell[rows].to_vec());
        rows.iter().for_each(|rows| self.cell[rows.clone()].fill([0.0; 4]));
        self.add(cell, one, group);
        self.add(cell, other, group);
        for (rows, so_far) in rows.into_iter().zip(so_far) {
            for (row, so_far) in self.cell[rows].iter_mut().zip(so_far) {
                row.iter_mut().zip(so_far).for_each(|(a, b)| *a += b);
            }
        }
    }

    #[inline(always)]
    fn cell_finished(&mut self, cell: Cell<'_>) {
        let part = 1.0 / cell.count as f64;
        let mut moments = std::mem::take(&mut self.cell);
        for rows in self.layout.rows_of(&std::mem::take(&mut self.touched)) {
            if rows.is_empty() {
                continue;
            }
            for (c, &pixel) in cell.pixels[..cell.count].iter().enumerate() {
                if let Some((data, len)) = self.target(cell, pixel) {
                    for (row, moments) in rows.clone().zip(&moments[rows.clone()]) {
                        data[row * len + pixel.column] += moments[c] * part;
                    }
                }
            }
            moments[rows].fill([0.0; 4]);
        }
        self.cell = moments;
    }

    fn ring_finished(&mut self, ring: usize) {
        let same_ring = std::mem::take(&mut self.same_ring);
        if let Some(ring) = ring.checked_sub(self.first).and_then(|i| self.rings.get_mut(i)) {
            ring.data.iter_mut().zip(&same_ring).for_each(|(a, b)| *a += b);
        }
        self.same_ring = same_ring;
        self.same_ring.clear();
    }
}
