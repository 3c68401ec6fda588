//! Moments of moving windows: pixels within a radius of an output pixel, transported to its centre and summed.
//!
//! Works from north to south: the moments of a band of input rings are made, added to all windows that reach it, and
//! dropped; a window is visited when all that it reaches is in. Of the output, only the rings that reach the present
//! band hold sums. The sum over a window's pixels is taken one by one (`direct`), or ring by ring from prefix sums
//! (`prefix`), whichever costs less. What a window's moments mean is left to whoever visits them.

mod direct;
mod prefix;
pub(crate) mod reach;

use std::collections::VecDeque;
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::{ControlFlow, Range};

use longan_grid::{Healpix, Ring};
use ndarray::Array2;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::contour::Field;
use crate::moments::{self, Layout, RingMoments, SHARES, Selection, Weight};
use prefix::Way;
use reach::{OutputRing, Reached};

/// Rings of input moments that are made at a time, and how few they become where many rows would take more than so
/// many bytes.
const BAND: usize = 128;
const BAND_LEAST: usize = 16;
const BAND_BYTES: usize = 1 << 28;

/// Most output rings to a group.
const GROUP: usize = 32;

/// Most input rings to a block.
const BLOCK: usize = 32;

/// Rings to a block that is not divided further.
const SMALLEST: usize = 2;

/// Most windows that are visited together.
const BATCH: usize = 256;

/// Moments of one window, the mean over the thresholds or those of one; nothing is rescaled for masked pixels.
#[derive(Clone, Debug, Default)]
pub struct Moments {
    /// Colatitude and longitude of the window's centre in radians.
    pub centre: (f64, f64),
    /// Its radius in radians.
    pub radius: f64,
    /// Number of pixels in the window.
    pub pixels: u64,
    /// Share of the window's cells that are masked; 1 for a window without pixels.
    pub masked_fraction: f64,
    /// Share of the edges of the window's pixels that lie beside a masked cell, 0 where no curvature is selected; 1 for a
    /// window without pixels.
    pub lost_edges: f64,
    /// W0 in steradian; 0 unless selected, as the following.
    pub area: f64,
    /// W1 in radians.
    pub length: f64,
    /// W2 in radians.
    pub curvature: f64,
    /// ψ_s for the ranks selected.
    pub psi: Vec<Complex64>,
}

impl Moments {
    /// Makes up for what is masked: every extensive quantity is divided by the unmasked share of the window, that of
    /// cells, or for curvature, which sits on the edges, that of edges. `weight` is that of ψ_s.
    pub(crate) fn scale_up(&mut self, weight: Weight) {
        let (cells, edges) = (1.0 - self.masked_fraction, 1.0 - self.lost_edges);
        self.area /= cells;
        self.length /= cells;
        self.curvature /= edges;
        let share = match weight {
            Weight::Length => cells,
            Weight::Curvature => edges,
        };
        self.psi.iter_mut().for_each(|psi| *psi /= share);
    }
}

/// How windows are summed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Summation {
    /// Pixel by pixel.
    Exact,
    /// From prefix sums wherever that costs less and the phases of transport are met to this accuracy: then ψ_s is
    /// off by at most this share of the window's sum of |weights|, which is W1 where contours weigh by length. Areas,
    /// lengths, curvatures and masked fractions stay exact.
    Tolerance(f64),
    /// The same, from prefix sums wherever that is accurate enough, whatever it costs.
    Prefix(f64),
}

/// What rounding leaves of the accuracy of sums, generously: they may have many terms.
const ROUNDING: f64 = 1e-12;

impl Summation {
    /// The accuracy of ψ_s as a share of the sum of |weights|.
    pub fn resolution(self) -> f64 {
        match self {
            Summation::Exact => ROUNDING,
            Summation::Tolerance(tolerance) | Summation::Prefix(tolerance) => tolerance.max(ROUNDING),
        }
    }
}

impl Default for Summation {
    /// A tolerance of 10⁻⁷.
    fn default() -> Self {
        Summation::Tolerance(1e-7)
    }
}

/// Which way the windows of one radius were summed, counted in pairs of an output pixel and an input ring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SummationCounts {
    /// Pairs summed pixel by pixel, since that costs less or is asked for.
    pub direct: usize,
    /// Pairs summed pixel by pixel, since no fit of the phases meets the tolerance.
    pub missed: usize,
    /// Pairs from prefix sums.
    pub prefix: usize,
    /// Largest error of a phase in those.
    pub error: f64,
    /// Largest number of terms to a phase.
    pub terms: usize,
}

/// Values of all windows of one radius.
#[derive(Clone, Debug)]
pub struct Windows {
    /// The numbers visited, column × pixel in RING order: one array, or one for each threshold where these are kept by
    /// themselves.
    pub values: Vec<Array2<f64>>,
    /// How the windows were summed.
    pub counts: SummationCounts,
}

/// The work was stopped by the one who was told of its progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stopped;

/// For `progress`, where nobody asks: goes on.
pub fn go_on(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Windows of several radii about all pixels of a grid, moved over one field.
#[derive(Clone, Copy, Debug)]
pub struct MovingWindows<'a> {
    /// The field.
    pub field: &'a Field<'a>,
    /// The moments to sum.
    pub selection: &'a Selection,
    /// The grid of the windows' centres.
    pub output: Healpix,
    /// Radii in radians; 0: the input pixel itself.
    pub radii: &'a [f64],
    /// How windows are summed.
    pub summation: Summation,
}

impl MovingWindows<'_> {
    /// Visits all windows, each radius by itself; the contour is followed once for all.
    ///
    /// `visit` fills `columns` numbers for each window. The result does not depend on the number of threads.
    ///
    /// # Panics
    /// For radius 0 if the output grid is not the field's.
    pub fn visit(&self, columns: usize, visit: impl Fn(&Moments, &mut [f64]) + Sync) -> Vec<Windows> {
        let each = |batch: &mut [Moments], values: &mut [f64]| {
            batch.iter().zip(values.chunks_exact_mut(columns)).for_each(|(moments, values)| visit(moments, values));
            Ok::<(), Stopped>(())
        };
        self.visit_batches(columns, each, go_on).expect("nobody stops the work")
    }

    /// The same, with many windows at a time: `visit` fills `columns` numbers for the first, then for the next. Where
    /// thresholds are kept by themselves, each window comes once for each threshold. `progress` is told the share done, from
    /// 0 to 1, and says whether to go on.
    ///
    /// # Errors
    /// The northernmost of `visit`, which ends the work, or [`Stopped`].
    ///
    /// # Panics
    /// As [`visit`](Self::visit).
    pub fn visit_batches<E: Send + From<Stopped>>(
        &self,
        columns: usize,
        visit: impl Fn(&mut [Moments], &mut [f64]) -> Result<(), E> + Sync,
        mut progress: impl FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Vec<Windows>, E> {
        let input = self.field.grid();
        assert!(!self.radii.contains(&0.0) || self.output == input, "a window of one pixel needs the input's grid");
        let layout = Layout::new(self.selection, self.field.thresholds(), self.field.has_masked());
        let mut sweeps: Vec<Sweep<'_>> =
            self.radii.iter().map(|&radius| Sweep::new(self, &layout, radius, columns)).collect();
        let ring_bytes = 4 * input.nside() * layout.rows.max(1) * size_of::<f64>();
        let rings = (BAND_BYTES / ring_bytes).clamp(BAND_LEAST, BAND);
        for first in (1..=input.rings()).step_by(rings) {
            let band = Band::new(self.field, &layout, first..(first + rings).min(input.rings() + 1));
            for sweep in &mut sweeps {
                sweep.add(&band);
                sweep.visit_finished(band.rings.end, &visit)?;
            }
            let last = input.ring(band.rings.end - 1);
            if progress((last.start + last.len) as f64 / input.pixels() as f64).is_break() {
                return Err(Stopped.into());
            }
        }
        Ok(sweeps.into_iter().map(|sweep| sweep.windows).collect())
    }
}

/// About how many bytes the sums of one radius's windows take at most: those of the output rings that an input ring, a
/// band of them and a group's rings beside it reach.
pub(crate) fn memory(input: Healpix, output: Healpix, radius: f64, rows: usize) -> usize {
    let band = BAND as f64 * PI / input.rings() as f64;
    let group = (GROUP as f64 * PI / output.rings() as f64).min(radius);
    // The widest zone is about the equator.
    let share = (radius + group + band / 2.0).min(FRAC_PI_2).sin();
    (share * output.pixels() as f64 * ((rows + 1) * size_of::<f64>()) as f64) as usize
}

/// About how many bytes the moments of a band of input rings take.
pub(crate) fn band_memory(input: Healpix, rows: usize) -> usize {
    BAND.min(input.rings()) * 4 * input.nside() * rows * size_of::<f64>()
}

/// The windows of one radius on their way over the field.
struct Sweep<'a> {
    of: &'a MovingWindows<'a>,
    layout: &'a Layout,
    radius: f64,
    /// Groups of output rings that have been reached but are not complete.
    groups: VecDeque<Group>,
    /// The next output ring to be reached.
    next: Option<OutputRing>,
    /// Numbers for each window and threshold.
    columns: usize,
    /// Windows visited.
    done: usize,
    windows: Windows,
}

/// Neighbouring output rings, whose windows are summed together.
struct Group {
    rings: Vec<OutputRing>,
    /// Input rings that may be reached.
    reach: Range<usize>,
    /// For each quadrant the windows of each ring.
    quadrants: [Vec<Sums>; 4],
    counts: SummationCounts,
}

impl<'a> Sweep<'a> {
    fn new(of: &'a MovingWindows<'a>, layout: &'a Layout, radius: f64, columns: usize) -> Self {
        let values = (0..layout.groups).map(|_| Array2::zeros((columns, of.output.pixels()))).collect();
        let windows = Windows { values, counts: SummationCounts::default() };
        let next = Some(OutputRing::new(of.field.grid(), of.output, 1, radius));
        Sweep { of, layout, radius, columns, groups: VecDeque::new(), next, done: 0, windows }
    }

    /// Adds a band of input rings to all windows that reach it.
    fn add(&mut self, band: &Band) {
        while self.next.as_ref().is_some_and(|ring| ring.reach.start < band.rings.end) {
            let group = self.next_group();
            self.groups.push_back(group);
        }
        let (of, layout, radius) = (self.of, self.layout, self.radius);
        self.groups.par_iter_mut().for_each(|group| group.add(band, of, layout, radius));
    }

    /// The next output rings, no farther apart than the windows' radius: their phases differ little more than those
    /// of one ring.
    fn next_group(&mut self) -> Group {
        let (input, output) = (self.of.field.grid(), self.of.output);
        let mut rings: Vec<OutputRing> = Vec::new();
        while let Some(ring) = self.next.take_if(|ring| {
            rings.len() < GROUP && rings.first().is_none_or(|first| ring.theta - first.theta <= self.radius)
        }) {
            self.next =
                (ring.number < output.rings()).then(|| OutputRing::new(input, output, ring.number + 1, self.radius));
            rings.push(ring);
        }
        let reach = rings[0].reach.start..rings[rings.len() - 1].reach.end;
        let sums = |_| rings.iter().map(|ring| Sums::new(ring.in_quadrant, self.layout.rows)).collect();
        let quadrants = std::array::from_fn(sums);
        Group { rings, reach, quadrants, counts: SummationCounts::default() }
    }

    /// Visits the windows that reach no farther than `end`.
    fn visit_finished<E: Send>(
        &mut self,
        end: usize,
        visit: &(impl Fn(&mut [Moments], &mut [f64]) -> Result<(), E> + Sync),
    ) -> Result<(), E> {
        let Windows { values: all, counts } = &mut self.windows;
        while self.groups.front().is_some_and(|group| group.reach.end <= end) {
            let Some(group) = self.groups.pop_front() else { break };
            let tasks = 4 * group.rings.len();
            let values: Vec<Result<Vec<f64>, E>> = (0..tasks)
                .into_par_iter()
                .map(|task| {
                    let (ring, quadrant) = (task / 4, task % 4);
                    let sums = &group.quadrants[quadrant][ring];
                    let thresholds = self.of.field.thresholds();
                    visited(&group.rings[ring], quadrant, sums, self.layout, thresholds, self.columns, visit)
                })
                .collect();
            let values = values.into_iter().collect::<Result<Vec<_>, E>>()?;
            let step = self.columns * all.len();
            for (i, mut row) in all.iter_mut().flat_map(|values| values.rows_mut()).enumerate() {
                let visited = values.iter().flat_map(|values| values.iter().skip(i).step_by(step));
                row.iter_mut().skip(self.done).zip(visited).for_each(|(value, visited)| *value = *visited);
            }
            self.done += values.iter().map(|values| values.len() / step).sum::<usize>();
            counts.add(group.counts);
        }
        Ok(())
    }
}

impl Group {
    /// Adds what of a band is within reach, block of input rings by block.
    fn add(&mut self, band: &Band, of: &MovingWindows<'_>, layout: &Layout, radius: f64) {
        let (mut first, end) = (self.reach.start.max(band.rings.start), self.reach.end.min(band.rings.end));
        while first < end {
            let north = band.theta(first);
            let past = (first..end).find(|&i| i - first == BLOCK || band.theta(i) - north > radius / 4.0);
            let rings = first..past.unwrap_or(end);
            first = rings.end;
            self.add_block(band, rings, 0..self.rings.len(), of, layout, radius);
        }
    }

    /// Adds a block of input rings to some of the group's output rings; in smaller blocks where that lets prefix sums
    /// meet their tolerance.
    fn add_block(
        &mut self,
        band: &Band,
        rings: Range<usize>,
        output: Range<usize>,
        of: &MovingWindows<'_>,
        layout: &Layout,
        radius: f64,
    ) {
        let block = Block::new(&self.rings[output.clone()], band, rings.clone(), radius);
        let way = if radius > 0.0 { Way::find(&block, layout, of.summation) } else { Way::Direct };
        if matches!(way, Way::Missed) && rings.len().max(output.len()) > SMALLEST {
            let halves = |range: &Range<usize>| {
                let middle = range.start + range.len() / 2;
                [range.start..middle, middle..range.end]
            };
            if rings.len() >= output.len() {
                for rings in halves(&rings) {
                    self.add_block(band, rings, output.clone(), of, layout, radius);
                }
            } else {
                for output in halves(&output) {
                    self.add_block(band, rings.clone(), output, of, layout, radius);
                }
            }
            return;
        }
        self.quadrants.par_iter_mut().enumerate().for_each(|(quadrant, sums)| {
            let sums = &mut sums[output.clone()];
            match &way {
                Way::Prefix(plan) => prefix::add(&block, quadrant, layout, plan, sums),
                _ if radius == 0.0 => add_pixels(&block, quadrant, layout, sums),
                _ => direct::add(&block, quadrant, layout, sums),
            }
        });
        let pairs = block.pairs().map(|(ring, _)| 4 * ring.in_quadrant).sum();
        self.counts.add(match way {
            Way::Prefix(plan) => plan.counts(&block),
            Way::Direct => SummationCounts { direct: pairs, ..SummationCounts::default() },
            Way::Missed => SummationCounts { missed: pairs, ..SummationCounts::default() },
        });
    }
}

/// A group's windows of one pixel each.
fn add_pixels(block: &Block<'_>, quadrant: usize, layout: &Layout, sums: &mut [Sums]) {
    for (ring, sums) in block.output.iter().zip(sums) {
        if !block.rings.contains(&ring.number) {
            continue;
        }
        let moments = block.band.moments(ring.number);
        for k in 0..ring.in_quadrant {
            let column = quadrant * ring.in_quadrant + k;
            let sums = sums.of(k, 1);
            (0..layout.rows).for_each(|row| sums[row] = moments.row(row)[column]);
        }
    }
}

impl SummationCounts {
    fn add(&mut self, other: SummationCounts) {
        self.direct += other.direct;
        self.missed += other.missed;
        self.prefix += other.prefix;
        self.error = self.error.max(other.error);
        self.terms = self.terms.max(other.terms);
    }
}

/// What `visit` makes of the windows of a quadrant.
fn visited<E>(
    ring: &OutputRing,
    quadrant: usize,
    sums: &Sums,
    layout: &Layout,
    thresholds: usize,
    columns: usize,
    visit: impl Fn(&mut [Moments], &mut [f64]) -> Result<(), E>,
) -> Result<Vec<f64>, E> {
    let groups = layout.groups;
    let mut out = vec![0.0; ring.in_quadrant * groups * columns];
    let mut batch = vec![Moments::default(); (ring.in_quadrant * groups).min(BATCH)];
    for (number, out) in out.chunks_mut(BATCH * columns).enumerate() {
        let batch = &mut batch[..out.len() / columns];
        for (i, moments) in batch.iter_mut().enumerate() {
            let k = (number * BATCH + i) / groups;
            let group = (number * BATCH + i) % groups;
            let sum = |row: usize| sums.data[k * sums.rows + row];
            let mean = |row: usize| sum(row) / (thresholds / groups) as f64;
            let selected = |row: Option<usize>| row.map_or(0.0, |row| mean(row + group * layout.plain));
            moments.radius = ring.radius;
            moments.centre = (ring.theta, ring.phi_of(quadrant * ring.in_quadrant + k));
            moments.pixels = sums.pixels[k];
            let share = |row: Option<usize>| match (moments.pixels, row) {
                (0, _) => 1.0,
                (_, None) => 0.0,
                (pixels, Some(row)) => sum(row) / (SHARES as u64 * pixels) as f64,
            };
            moments.masked_fraction = share(layout.masked);
            moments.lost_edges = share(layout.lost_edges);
            moments.area = selected(layout.area);
            moments.length = selected(layout.length);
            moments.curvature = selected(layout.curvature);
            moments.psi.clear();
            let rows = layout.psi().map(|(row, _)| row).skip(group * layout.ranks.len()).take(layout.ranks.len());
            // |ψ_s| ≤ W1, which the error of prefix sums must not break where a contour is nearly straight.
            let most =
                if layout.weight == Weight::Length && layout.length.is_some() { moments.length } else { f64::INFINITY };
            let bounded = |psi: Complex64| if psi.norm() > most { psi * (most / psi.norm()) } else { psi };
            moments.psi.extend(rows.map(|row| bounded(Complex64::new(mean(row), mean(row + 1)))));
        }
        visit(batch, out)?;
    }
    Ok(out)
}

/// Sums over the windows about consecutive pixels.
struct Sums {
    rows: usize,
    /// The rows of each window.
    data: Vec<f64>,
    /// Number of pixels in each window.
    pixels: Vec<u64>,
}

impl Sums {
    fn new(windows: usize, rows: usize) -> Self {
        Sums { rows, data: vec![0.0; windows * rows], pixels: vec![0; windows] }
    }

    /// The rows of a window, to which this many pixels are to be added.
    fn of(&mut self, window: usize, pixels: usize) -> &mut [f64] {
        self.pixels[window] += pixels as u64;
        &mut self.data[window * self.rows..(window + 1) * self.rows]
    }
}

/// Pixel moments of consecutive input rings.
struct Band {
    rings: Range<usize>,
    /// Each ring with its colatitude and moments.
    of: Vec<(Ring, f64, RingMoments)>,
}

impl Band {
    fn new(field: &Field<'_>, layout: &Layout, rings: Range<usize>) -> Self {
        // Each chunk goes once more over the cells that it shares with its neighbours.
        let chunk = rings.len().div_ceil(2 * rayon::current_num_threads()).max(8);
        let starts: Vec<usize> = rings.clone().step_by(chunk).collect();
        let made: Vec<Vec<RingMoments>> = starts
            .into_par_iter()
            .map(|start| moments::at_pixels(field, layout, start..(start + chunk).min(rings.end)))
            .collect();
        let geometry = rings.clone().map(|i| field.grid().ring(i));
        let of = geometry.zip(made.into_iter().flatten()).map(|(ring, moments)| (ring, ring.theta(), moments));
        Band { of: of.collect(), rings }
    }

    fn theta(&self, ring: usize) -> f64 {
        self.of[ring - self.rings.start].1
    }

    fn moments(&self, ring: usize) -> &RingMoments {
        &self.of[ring - self.rings.start].2
    }
}

/// Some input rings of a band as seen from a group of output rings.
struct Block<'a> {
    band: &'a Band,
    rings: Range<usize>,
    output: &'a [OutputRing],
    /// For each input ring, for each output ring.
    reached: Vec<Option<Reached>>,
}

impl<'a> Block<'a> {
    fn new(output: &'a [OutputRing], band: &'a Band, rings: Range<usize>, radius: f64) -> Self {
        let reached = rings.clone().flat_map(|i| {
            let (ring, theta, _) = &band.of[i - band.rings.start];
            output.iter().map(move |from| from.reached(i, ring, *theta, radius))
        });
        Block { reached: reached.collect(), band, rings, output }
    }

    /// The output rings that reach an input ring, each with its place among them.
    fn reaching(&self, ring: usize) -> impl Iterator<Item = (usize, &'a OutputRing, &Reached)> {
        let n = self.output.len();
        let reached = &self.reached[(ring - self.rings.start) * n..][..n];
        self.output
            .iter()
            .zip(reached)
            .enumerate()
            .filter_map(|(i, (ring, reached))| Some((i, ring, reached.as_ref()?)))
    }

    /// All pairs of an output ring and an input ring that it reaches.
    fn pairs(&self) -> impl Iterator<Item = (&'a OutputRing, &Reached)> {
        self.rings.clone().flat_map(|ring| self.reaching(ring).map(|(_, ring, reached)| (ring, reached)))
    }
}
