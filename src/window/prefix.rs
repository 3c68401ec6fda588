//! Windows from prefix sums along the input rings: the cost of an (output pixel, input ring) pair does not depend on how
//! many pixels the ring has within the window.
//!
//! For a fixed pair of rings the phase of transport is a smooth function of x = Δφ, so
//! e^{isδ(x)} ≈ Σ_k c_k e^{i m_k x} with real c_k. The frequencies m_k are common to all pairs of a block of input rings
//! and a group of output rings ([`fit`]), each pair has its own c_k. So prefix sums of P e^{i m_k φ} along an input ring
//! turn its part of a window into two look-ups. Each pair's error is measured; one that misses the tolerance is
//! summed directly.

mod fit;

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use num_complex::Complex64;
use pulp::{Arch, Simd, WithSimd};

use super::reach::{OutputRing, Reached};
use super::{Block, Summation, Sums, Ways, direct};
use crate::moments::{Layout, RingMoments};
use crate::transport::RingTransport;
use fit::Terms;

/// Output pixels of a ring that are summed at a time, about: what they need stays in the processor's cache.
const TILE: usize = 256;

/// Prefix sums are used where they take less than this share of the direct sum's time.
const WORTHWHILE: f64 = 0.5;

/// How to sum a block from prefix sums.
pub(super) struct Plan {
    ranks: Vec<Rank>,
    /// For each pair of the block (input ring by input ring) whether its fits meet the tolerance; nothing where the
    /// output ring does not reach the input ring.
    fits: Vec<Option<bool>>,
    /// Largest error of the pairs that do.
    error: f64,
    /// Largest half-width of the block, in radians.
    width: f64,
}

/// The fits of one rank.
struct Rank {
    terms: Terms,
    /// The c_k of each pair, twice: for the real and for the imaginary parts.
    factors: Vec<f64>,
}

/// The way in which a block is to be summed.
pub(super) enum Way {
    /// From prefix sums.
    Prefix(Plan),
    /// Pixel by pixel, which costs less or is asked for.
    Direct,
    /// Pixel by pixel, since no fit meets the tolerance.
    Missed,
}

impl Way {
    /// The cheapest way to meet the tolerance.
    pub(super) fn find(block: &Block<'_>, layout: &Layout, summation: Summation) -> Way {
        let (tolerance, worthwhile) = match summation {
            Summation::Exact => return Way::Direct,
            Summation::Tolerance(tolerance) => (tolerance, WORTHWHILE),
            Summation::Prefix(tolerance) => (tolerance, f64::INFINITY),
        };
        let Some(width) = block.pairs().map(|(_, r)| r.half_width).max_by(f64::total_cmp) else { return Way::Direct };
        let budget = if worthwhile.is_finite() { worthwhile * direct_cost(block, layout) } else { f64::INFINITY };
        if cost(block, layout, layout.ranks.len() * fit::FEWEST, width) > budget {
            return Way::Direct;
        }
        let sample = sample(block);
        let terms: Option<Vec<Terms>> =
            layout.ranks.iter().map(|&rank| Terms::new(rank, width, &sample, tolerance)).collect();
        let Some(terms) = terms else { return Way::Missed };
        if cost(block, layout, terms.iter().map(Terms::count).sum(), width) > budget {
            return Way::Direct;
        }
        let mut plan = Plan::with(terms, width, block.reached.len());
        for (i, reached) in block.reached.iter().enumerate() {
            let Some(reached) = reached else { continue };
            let error = plan.ranks.iter_mut().map(|rank| rank.fit(i, &reached.transport)).fold(0.0, f64::max);
            plan.fits[i] = Some(error <= tolerance);
            if error <= tolerance {
                plan.error = plan.error.max(error);
            }
        }
        Way::Prefix(plan)
    }
}

impl Plan {
    fn with(terms: Vec<Terms>, width: f64, pairs: usize) -> Plan {
        let ranks = terms.into_iter().map(|terms| Rank { factors: vec![0.0; 2 * terms.count() * pairs], terms });
        Plan { ranks: ranks.collect(), fits: vec![None; pairs], error: 0.0, width }
    }

    /// How the block's windows are summed.
    pub(super) fn ways(&self, block: &Block<'_>) -> Ways {
        let terms = self.ranks.iter().map(|rank| rank.terms.count()).max().unwrap_or(0);
        let mut ways = Ways { error: self.error, terms, ..Ways::default() };
        for (pair, met) in self.fits.iter().enumerate() {
            let pixels = 4 * block.output[pair % block.output.len()].in_quadrant;
            match met {
                Some(true) => ways.prefix += pixels,
                Some(false) => ways.missed += pixels,
                None => (),
            }
        }
        ways
    }
}

impl Rank {
    /// Fits a pair and tells the error.
    fn fit(&mut self, pair: usize, transport: &RingTransport) -> f64 {
        let n = self.terms.count();
        let (re, im) = self.factors[2 * n * pair..][..2 * n].split_at_mut(n);
        let error = self.terms.fit(transport, re);
        im.copy_from_slice(re);
        error
    }
}

/// Pairs by which the block's phases are judged: those of its outermost and middle rings.
fn sample(block: &Block<'_>) -> Vec<RingTransport> {
    let n = block.rings.len();
    let mut sample = Vec::new();
    for ring in [0, n / 2, n - 1] {
        let reaching: Vec<_> = block.reaching(block.rings.start + ring).map(|(_, _, r)| r.transport).collect();
        let last = reaching.len().saturating_sub(1);
        sample.extend([0, last / 2, last].iter().filter_map(|&i| reaching.get(i)));
    }
    sample
}

/// Nanoseconds, about, that adding the block to a quadrant takes directly.
fn direct_cost(block: &Block<'_>, layout: &Layout) -> f64 {
    let pixel = 1.0 + 0.3 * layout.first_rank as f64 + 0.7 * layout.ranks.len() as f64;
    let pair =
        |(ring, r): (&OutputRing, &Reached)| ring.in_quadrant as f64 * (2.0 * r.half_width / r.phi.1 * pixel + 30.0);
    block.pairs().map(pair).sum()
}

/// The same from prefix sums with so many terms for all ranks.
fn cost(block: &Block<'_>, layout: &Layout, terms: usize, width: f64) -> f64 {
    let (terms, plain) = (terms as f64, layout.first_rank as f64);
    let tiles = tiles(block.output) as f64;
    let pixels = |i: usize| {
        let (_, _, reached) = block.reaching(i).next()?;
        Some((FRAC_PI_2 + 2.0 * width * tiles) / reached.phi.1)
    };
    let pixels: f64 = block.rings.clone().filter_map(pixels).sum();
    let pairs = block.pairs().map(|(ring, _)| ring.in_quadrant).sum::<usize>() as f64;
    let windows = block.output.iter().map(|ring| ring.in_quadrant).sum::<usize>() as f64;
    let fits = block.pairs().count() as f64 / 4.0;
    pairs * (1.0 + 0.4 * plain + 0.3 * terms)
        + pixels * (1.0 + plain + 0.6 * terms)
        + windows * (2.0 + plain + 2.0 * terms)
        + fits * 60.0 * terms
}

/// Parts of a quadrant.
fn tiles(rings: &[OutputRing]) -> usize {
    rings.iter().map(|ring| ring.in_quadrant).max().unwrap_or(1).div_ceil(TILE)
}

/// Adds a block of input rings to the windows about the pixels of one quadrant of a group's rings.
///
/// Longitudes are counted from the quadrant's own meridian, as in the direct sum.
pub(super) fn add(block: &Block<'_>, quadrant: usize, layout: &Layout, plan: &Plan, sums: &mut [Sums]) {
    for number in block.rings.clone() {
        let fits = plan.fits_of(block, number);
        for (i, ring, reached) in block.reaching(number).filter(|(i, ..)| fits[*i] == Some(false)) {
            direct::add_ring(ring, reached, quadrant, block.band.moments(number), layout, &mut sums[i]);
        }
    }
    let tiles = tiles(block.output);
    let mut tile = Tile::new(layout, plan);
    for t in 0..tiles {
        let part = |n: usize| (t * n).div_ceil(tiles)..((t + 1) * n).div_ceil(tiles);
        tile.parts = block.output.iter().map(|ring| part(ring.in_quadrant)).collect();
        tile.add(block, quadrant, layout, plan, sums);
    }
}

impl Plan {
    fn fits_of(&self, block: &Block<'_>, ring: usize) -> &[Option<bool>] {
        let n = block.output.len();
        &self.fits[(ring - block.rings.start) * n..][..n]
    }
}

/// Some pixels of each output ring, and what is needed to sum their windows.
#[derive(Default)]
struct Tile {
    /// The pixels of each ring's quadrant.
    parts: Vec<Range<usize>>,
    /// For each plain row the prefix sums along an input ring, and for each output ring the windows' sums.
    plain: Vec<(Vec<f64>, Vec<Vec<f64>>)>,
    /// The pixels of that ring within each window, counted from the first prefix sum.
    spans: Spans,
    ranks: Vec<TileRank>,
}

/// The same for one rank. Numbers come in sets, for each term a real part, then for each an imaginary part.
#[derive(Default)]
struct TileRank {
    /// Prefix sums along an input ring of P e^{i m_k φ}.
    prefix: Vec<f64>,
    /// For each output ring Σ c_k (differences of prefix sums), a set for each pixel.
    totals: Vec<Vec<f64>>,
    /// e^{i m_k φ} at pixels of the input rings.
    phases: Phases,
    /// The same, conjugated, of the output rings.
    back: Phases,
}

/// e^{i m_k (φ − middle)} at consecutive pixels of the last two kinds of rings asked for, of which the belt has no more.
#[derive(Default)]
struct Phases([KindPhases; 2]);

#[derive(Default)]
struct KindPhases {
    /// Longitude of the first pixel and distance to the next, counted from the middle, and the number of pixels.
    pixels: (f64, f64, usize),
    /// A set for each pixel.
    sets: Vec<f64>,
}

impl Phases {
    fn at(&mut self, pixels: (f64, f64, usize), frequencies: &[f64]) -> &[f64] {
        let [last, other] = &mut self.0;
        if last.pixels != pixels {
            std::mem::swap(last, other);
        }
        if last.pixels != pixels {
            last.pixels = pixels;
            find_phases(&mut last.sets, frequencies, pixels);
        }
        &last.sets
    }
}

/// Ranges of prefix sums, from..to, of consecutive windows.
#[derive(Default)]
struct Spans {
    from: Vec<u32>,
    to: Vec<u32>,
}

impl Tile {
    fn new(layout: &Layout, plan: &Plan) -> Self {
        let ranks = plan.ranks.iter().map(|_| TileRank::default());
        Tile { plain: vec![Default::default(); layout.first_rank], ranks: ranks.collect(), ..Tile::default() }
    }

    /// Adds the block to the windows about the tile's pixels, input ring by input ring.
    fn add(&mut self, block: &Block<'_>, quadrant: usize, layout: &Layout, plan: &Plan, sums: &mut [Sums]) {
        let occupied = || block.output.iter().zip(&self.parts).filter(|(_, part)| !part.is_empty());
        let west = occupied().map(|(ring, part)| ring.phi_of(part.start)).fold(f64::INFINITY, f64::min);
        let east = occupied().map(|(ring, part)| ring.phi_of(part.end - 1)).fold(f64::NEG_INFINITY, f64::max);
        if west > east {
            return;
        }
        let middle = (west + east) / 2.0;
        let empty = |totals: &mut Vec<Vec<f64>>, set: usize| {
            totals.resize(self.parts.len(), Vec::new());
            for (totals, part) in totals.iter_mut().zip(&self.parts) {
                totals.clear();
                totals.resize(part.len() * set, 0.0);
            }
        };
        self.plain.iter_mut().for_each(|(_, totals)| empty(totals, 1));
        for (of, rank) in self.ranks.iter_mut().zip(&plan.ranks) {
            empty(&mut of.totals, 2 * rank.terms.count());
            (of.phases, of.back) = Default::default();
        }
        for number in block.rings.clone() {
            let fits = plan.fits_of(block, number);
            let met = || block.reaching(number).filter(|(i, ..)| fits[*i] == Some(true));
            let Some((_, _, widest)) = met().max_by(|a, b| a.2.half_width.total_cmp(&b.2.half_width)) else { continue };
            // Prefix sums from one pixel west of all windows to one east.
            let (from, to) = (widest.span(west).0 - 1, widest.span(east).1 + 1);
            // The same for all rings of this kind in the block.
            let all = Reached { half_width: plan.width, ..*widest };
            let all = all.span(west).0.min(from) - 1..all.span(east).1.max(to) + 1;
            let moments = block.band.moments(number);
            let columns =
                Columns { first: widest.column(from, quadrant), pixels: (to - from) as usize, len: widest.len };
            for (row, (prefix, _)) in self.plain.iter_mut().enumerate() {
                fill_plain(prefix, moments.row(row), columns);
            }
            for (rank, (of, plan)) in self.ranks.iter_mut().zip(&plan.ranks).enumerate() {
                of.fill(moments, layout.first_rank + 2 * rank, columns, widest, from, &all, middle, &plan.terms);
            }
            for (i, ring, reached) in met() {
                let part = self.parts[i].clone();
                self.spans.find(ring, reached, part.clone(), from, &mut sums[i].pixels[part.clone()]);
                for (prefix, totals) in &mut self.plain {
                    add_plain(&self.spans, prefix, &mut totals[i]);
                }
                let pair = (number - block.rings.start) * block.output.len() + i;
                for (of, plan) in self.ranks.iter_mut().zip(&plan.ranks) {
                    let set = 2 * plan.terms.count();
                    add_spans(set, &self.spans, &of.prefix, &plan.factors[set * pair..][..set], &mut of.totals[i]);
                }
            }
        }
        for (row, (_, totals)) in self.plain.iter().enumerate() {
            for ((sums, totals), part) in sums.iter_mut().zip(totals).zip(&self.parts) {
                let windows = sums.data.chunks_exact_mut(sums.rows).skip(part.start);
                windows.zip(totals).for_each(|(window, total)| window[row] += total);
            }
        }
        // Back to each window's own longitude.
        for (rank, (of, plan)) in self.ranks.iter_mut().zip(&plan.ranks).enumerate() {
            let row = layout.first_rank + 2 * rank;
            for (i, ring) in block.output.iter().enumerate() {
                let part = &self.parts[i];
                let Some(west) = part.clone().next().map(|k| ring.phi_of(k)) else { continue };
                let sets = of.back.at((middle - west, -ring.phi.1, part.len()), &plan.terms.frequencies);
                let rows = sums[i].rows;
                let windows = sums[i].data[part.start * rows + row..].chunks_mut(rows);
                turn_back(2 * plan.terms.count(), &of.totals[i], sets, windows);
            }
        }
    }
}

/// A stretch of a ring, which may go on from its end to its beginning.
#[derive(Clone, Copy)]
struct Columns {
    first: usize,
    pixels: usize,
    len: usize,
}

impl Columns {
    /// Its places in the ring, in order.
    #[inline(always)]
    fn ranges(self) -> impl Iterator<Item = Range<usize>> {
        let (mut at, mut left) = (self.first, self.pixels);
        std::iter::from_fn(move || {
            let range = at..(at + left).min(self.len);
            left -= range.len();
            at = 0;
            (!range.is_empty()).then_some(range)
        })
    }
}

fn fill_plain(prefix: &mut Vec<f64>, row: &[f64], columns: Columns) {
    prefix.clear();
    let mut sum = 0.0;
    prefix.push(sum);
    for range in columns.ranges() {
        prefix.extend(row[range].iter().map(|value| {
            sum += value;
            sum
        }));
    }
}

impl TileRank {
    #[allow(clippy::too_many_arguments)]
    fn fill(
        &mut self,
        moments: &RingMoments,
        row: usize,
        columns: Columns,
        ring: &Reached,
        from: isize,
        all: &Range<isize>,
        middle: f64,
        terms: &Terms,
    ) {
        let set = 2 * terms.count();
        let pixels = (ring.phi_of(all.start) - middle, ring.phi.1, all.len());
        let sets = self.phases.at(pixels, &terms.frequencies);
        let sets = &sets[(from - all.start) as usize * set..][..columns.pixels * set];
        self.prefix.resize((columns.pixels + 1) * set, 0.0);
        fill(set, &mut self.prefix, moments.row(row), moments.row(row + 1), columns, sets);
    }
}

impl Spans {
    /// Finds the pixels, counted from `first`, of an input ring in the windows about these pixels of an output ring, and
    /// adds their numbers to `pixels`.
    fn find(&mut self, ring: &OutputRing, reached: &Reached, part: Range<usize>, first: isize, pixels: &mut [u64]) {
        self.from.resize(part.len(), 0);
        self.to.resize(part.len(), 0);
        match ring.stride(reached) {
            Some(stride) => {
                let (from, to) = reached.span(ring.phi_of(0));
                let shift = (part.start * stride) as isize - first;
                let (from, to) = ((from + shift) as u32, (to.max(from) + shift) as u32);
                fill_evenly(self, from, to, stride as u32, pixels);
            }
            None => find_each(self, ring, reached, part, first, pixels),
        }
    }
}

#[multiversion::multiversion(targets = "simd")]
fn fill_evenly(spans: &mut Spans, from: u32, to: u32, stride: u32, pixels: &mut [u64]) {
    for (k, span) in spans.from.iter_mut().enumerate() {
        *span = from + k as u32 * stride;
    }
    for (k, span) in spans.to.iter_mut().enumerate() {
        *span = to + k as u32 * stride;
    }
    for pixels in pixels {
        *pixels += u64::from(to - from);
    }
}

#[multiversion::multiversion(targets = "simd")]
fn find_each(
    spans: &mut Spans,
    ring: &OutputRing,
    reached: &Reached,
    part: Range<usize>,
    first: isize,
    pixels: &mut [u64],
) {
    for (((span_from, span_to), pixels), k) in spans.from.iter_mut().zip(&mut spans.to).zip(pixels).zip(part) {
        let (from, to) = reached.span(ring.phi_of(k));
        let to = to.max(from);
        (*span_from, *span_to) = ((from - first) as u32, (to - first) as u32);
        *pixels += (to - from) as u64;
    }
}

/// Runs a kernel written for a set size known to the compiler.
macro_rules! for_set {
    ($set:expr, $kernel:ident($($argument:expr),*)) => {
        match $set {
            8 => $kernel::<4, 8>($($argument),*),
                16 => $kernel::<8, 16>($($argument),*),
            24 => $kernel::<12, 24>($($argument),*),
            32 => $kernel::<16, 32>($($argument),*),
            48 => $kernel::<24, 48>($($argument),*),
            set => unreachable!("no set has {set} numbers"),
        }
    };
}

/// Prefix sums of the complex numbers re + i im times the phases.
#[multiversion::multiversion(targets = "simd")]
fn fill(set: usize, prefix: &mut [f64], re: &[f64], im: &[f64], columns: Columns, phases: &[f64]) {
    for_set!(set, fill_sets(prefix, re, im, columns, phases))
}

#[inline(always)]
fn fill_sets<const K: usize, const SET: usize>(
    prefix: &mut [f64],
    re: &[f64],
    im: &[f64],
    columns: Columns,
    phases: &[f64],
) {
    let [first, rest @ ..] = prefix.as_chunks_mut::<SET>().0 else { return };
    let mut sum = [0.0; SET];
    *first = sum;
    let mut done = 0;
    for range in columns.ranges() {
        let n = range.len();
        let phases = &phases.as_chunks::<SET>().0[done..done + n];
        let values = re[range.clone()].iter().zip(&im[range]);
        for (((re, im), phase), prefix) in values.zip(phases).zip(&mut rest[done..done + n]) {
            for k in 0..K {
                let (u, v) = (phase[k], phase[K + k]);
                sum[k] += re * u - im * v;
                sum[K + k] += re * v + im * u;
            }
            *prefix = sum;
        }
        done += n;
    }
}

/// Adds the differences of prefix sums over each span.
#[multiversion::multiversion(targets = "simd")]
fn add_plain(spans: &Spans, prefix: &[f64], totals: &mut [f64]) {
    for ((&from, &to), total) in spans.from.iter().zip(&spans.to).zip(totals) {
        *total += prefix[to as usize] - prefix[from as usize];
    }
}

fn add_spans(set: usize, spans: &Spans, prefix: &[f64], factors: &[f64], totals: &mut [f64]) {
    Arch::new().dispatch(AddSpans { set, spans, prefix, factors, totals });
}

/// Adds factors times the differences of prefix sums over each span. Written with explicit vectors: left to itself, the
/// compiler reads several sets at a time, number by number.
struct AddSpans<'a> {
    set: usize,
    spans: &'a Spans,
    prefix: &'a [f64],
    factors: &'a [f64],
    totals: &'a mut [f64],
}

impl WithSimd for AddSpans<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.set / S::F64_LANES {
            1 => self.add::<S, 1>(simd),
            2 => self.add::<S, 2>(simd),
            3 => self.add::<S, 3>(simd),
            4 => self.add::<S, 4>(simd),
            6 => self.add::<S, 6>(simd),
            8 => self.add::<S, 8>(simd),
            12 => self.add::<S, 12>(simd),
            16 => self.add::<S, 16>(simd),
            24 => self.add::<S, 24>(simd),
            32 => self.add::<S, 32>(simd),
            _ => self.add::<S, 48>(simd),
        }
    }
}

impl AddSpans<'_> {
    #[inline(always)]
    fn add<S: Simd, const N: usize>(self, simd: S) {
        let sets = |values| S::as_simd_f64s(values).0.as_chunks::<N>().0;
        let (factors, prefix) = (&sets(self.factors)[0], sets(self.prefix));
        let totals = S::as_mut_simd_f64s(self.totals).0.as_chunks_mut::<N>().0;
        for ((&from, &to), total) in self.spans.from.iter().zip(&self.spans.to).zip(totals) {
            let (from, to) = (&prefix[from as usize], &prefix[to as usize]);
            for k in 0..N {
                total[k] = simd.mul_add_f64s(factors[k], simd.sub_f64s(to[k], from[k]), total[k]);
            }
        }
    }
}

/// e^{i m_k φ} for so many longitudes φ = start, start + step, …: a set for each.
#[multiversion::multiversion(targets = "simd")]
fn find_phases(sets: &mut Vec<f64>, frequencies: &[f64], (start, step, count): (f64, f64, usize)) {
    let set = 2 * frequencies.len();
    sets.resize(count * set, 0.0);
    for_set!(set, find_phase_sets(sets, frequencies, start, step))
}

#[inline(always)]
fn find_phase_sets<const K: usize, const SET: usize>(sets: &mut [f64], frequencies: &[f64], start: f64, step: f64) {
    /// Sets made side by side.
    const SIDE: usize = 8;
    let cis = |angle: f64| {
        let mut set = [0.0; SET];
        for k in 0..K {
            let phase = Complex64::cis(frequencies[k] * angle);
            (set[k], set[K + k]) = (phase.re, phase.im);
        }
        set
    };
    let times = |a: &[f64; SET], b: &[f64; SET]| {
        let mut product = [0.0; SET];
        for k in 0..K {
            product[k] = a[k] * b[k] - a[K + k] * b[K + k];
            product[K + k] = a[k] * b[K + k] + a[K + k] * b[k];
        }
        product
    };
    let sets = sets.as_chunks_mut::<SET>().0;
    let mut power = cis(step);
    let mut known = sets.len().min(1);
    if known == 1 {
        sets[0] = cis(start);
    }
    while known < SIDE && known < sets.len() {
        let (old, new) = sets.split_at_mut(known);
        for (new, old) in new.iter_mut().zip(&*old) {
            *new = times(old, &power);
        }
        known *= 2;
        power = times(&power, &power);
    }
    for i in SIDE..sets.len() {
        sets[i] = times(&sets[i - SIDE], &power);
    }
}

/// Adds to real and imaginary part, the first two numbers of each window, the sum of its terms, each times its phase.
#[multiversion::multiversion(targets = "simd")]
fn turn_back(set: usize, totals: &[f64], phases: &[f64], windows: std::slice::ChunksMut<'_, f64>) {
    for_set!(set, turn_sets_back(totals, phases, windows))
}

#[inline(always)]
fn turn_sets_back<const K: usize, const SET: usize>(
    totals: &[f64],
    phases: &[f64],
    windows: std::slice::ChunksMut<'_, f64>,
) {
    let sets = totals.as_chunks::<SET>().0.iter().zip(phases.as_chunks::<SET>().0);
    for ((total, phase), window) in sets.zip(windows) {
        let (mut re, mut im) = (0.0, 0.0);
        for k in 0..K {
            re += total[k] * phase[k] - total[K + k] * phase[K + k];
            im += total[k] * phase[K + k] + total[K + k] * phase[k];
        }
        window[0] += re;
        window[1] += im;
    }
}
