//! Moments of body and contour, gathered at the pixels.
//!
//! A cell's moments are shared equally among its corners, each share transported from the segment's midpoint to that
//! pixel's centre: ψ_s = Σ L e^{isϕ} with ϕ the angle of the contour's normal there. All thresholds are summed;
//! dividing by their number, and summing pixels to windows, is left to [`crate::window`].

use std::ops::Range;

use crate::contour::{Cell, Field, Segment, Sink, march};
use crate::transport::Powers;

/// What a segment weighs in the moments ψ_s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Weight {
    /// Its length: ψ_s of the tensors W_1^{0,s}.
    #[default]
    Length,
    /// Its turn: ψ_s of the curvature-weighted tensors W_2^{0,s}.
    Curvature,
}

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
}

/// Where each selected quantity stands among the rows of a ring.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Cell shares that are masked, in twelfths of a cell. Absent where nothing is masked.
    pub masked: Option<usize>,
    /// W0.
    pub area: Option<usize>,
    /// W1.
    pub length: Option<usize>,
    /// W2.
    pub curvature: Option<usize>,
    /// Re ψ_s of the first rank; Im ψ_s is the next row, then come the other ranks.
    pub first_rank: usize,
    /// Ranks s ≥ 1, ascending.
    pub ranks: Vec<u32>,
    /// Weight of the moments.
    pub weight: Weight,
    /// Number of rows.
    pub rows: usize,
}

impl Layout {
    /// Rows for this selection.
    pub fn new(selection: &Selection, masked: bool) -> Self {
        let mut rows = 0;
        let mut row = |wanted: bool| {
            rows += usize::from(wanted);
            wanted.then(|| rows - 1)
        };
        let (masked, area) = (row(masked), row(selection.area));
        let (length, curvature) = (row(selection.length), row(selection.curvature));
        Layout {
            masked,
            area,
            length,
            curvature,
            first_rank: rows,
            ranks: selection.ranks.clone(),
            weight: selection.weight,
            rows: rows + 2 * selection.ranks.len(),
        }
    }
}

/// Moments at the pixels of one ring, a row for each quantity.
#[derive(Clone, Debug)]
pub struct RingMoments {
    data: Vec<f64>,
    len: usize,
}

impl RingMoments {
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
    let mut gather =
        Gather { layout, first: rings.start, rings: moments.collect(), cell: vec![[0.0; 4]; layout.rows] };
    // A pixel's cells lie on its own ring and the two beside it.
    march(field, rings.start - 1..rings.end + 1, &mut gather);
    gather.rings
}

struct Gather<'a> {
    layout: &'a Layout,
    first: usize,
    rings: Vec<RingMoments>,
    /// The present cell's moments as seen from each of its corners, row by row.
    cell: Vec<[f64; 4]>,
}

impl Gather<'_> {
    /// Adds one share for each corner to a row.
    #[inline]
    fn share(&mut self, cell: Cell<'_>, row: usize, share: impl Fn(usize) -> f64) {
        for (c, pixel) in cell.pixels[..cell.count].iter().enumerate() {
            if let Some(ring) = pixel.ring.checked_sub(self.first).and_then(|i| self.rings.get_mut(i)) {
                ring.data[row * ring.len + pixel.column] += share(c);
            }
        }
    }
}

impl Sink for Gather<'_> {
    fn wants_area(&self) -> bool {
        self.layout.area.is_some()
    }

    fn masked(&mut self, cell: Cell<'_>, _: f64) {
        if let Some(row) = self.layout.masked {
            self.share(cell, row, |_| (12 / cell.count) as f64);
        }
    }

    fn inside(&mut self, cell: Cell<'_>, thresholds: Range<usize>, area: f64) {
        if let Some(row) = self.layout.area {
            self.share(cell, row, |_| area * thresholds.len() as f64 / cell.count as f64);
        }
    }

    fn area(&mut self, _: Cell<'_>, _: usize, area: f64) {
        if let Some(row) = self.layout.area {
            self.cell[row].iter_mut().for_each(|a| *a += area);
        }
    }

    #[inline]
    fn segment(&mut self, _: Cell<'_>, _: usize, segment: &Segment<'_>) {
        let layout = self.layout;
        let by_length = layout.weight == Weight::Length && !layout.ranks.is_empty();
        let by_turn = layout.weight == Weight::Curvature && !layout.ranks.is_empty();
        let length = if layout.length.is_some() || by_length { segment.length() } else { 0.0 };
        let turn = if layout.curvature.is_some() || by_turn { segment.turn() } else { 0.0 };
        if let Some(row) = layout.length {
            self.cell[row].iter_mut().for_each(|a| *a += length);
        }
        if let Some(row) = layout.curvature {
            self.cell[row].iter_mut().for_each(|a| *a += turn);
        }
        if layout.ranks.is_empty() {
            return;
        }
        let weight = if by_length { length } else { turn };
        let mut powers = Powers::new(segment.directions());
        for (rows, &rank) in self.cell[layout.first_rank..].chunks_exact_mut(2).zip(&layout.ranks) {
            let power = powers.raise(rank);
            for c in 0..4 {
                rows[0][c] += weight * power.re[c];
                rows[1][c] += weight * power.im[c];
            }
        }
    }

    fn finished(&mut self, cell: Cell<'_>) {
        let part = 1.0 / cell.count as f64;
        for row in 0..self.cell.len() {
            let shares = std::mem::take(&mut self.cell[row]);
            self.share(cell, row, |c| shares[c] * part);
        }
    }
}
