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
use super::{Block, Summation, SummationCounts, Sums, direct};
use crate::moments::Layout;
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
        Way::Prefix(Plan::new(terms, width, &block.reached, tolerance))
    }
}

impl Plan {
    /// Fits each pair of an output ring and the input ring that it reaches.
    fn new(terms: Vec<Terms>, width: f64, pairs: &[Option<Reached>], tolerance: f64) -> Plan {
        let of_rank = |terms: Terms| Rank { factors: vec![0.0; 2 * terms.count() * pairs.len()], terms };
        let mut ranks: Vec<Rank> = terms.into_iter().map(of_rank).collect();
        let mut worst: f64 = 0.0;
        let mut fit = |(i, reached): (usize, &Option<Reached>)| {
            let transport = &reached.as_ref()?.transport;
            let error = ranks.iter_mut().map(|rank| rank.fit(i, transport)).fold(0.0, f64::max);
            let met = error <= tolerance;
            if met {
                worst = worst.max(error);
            }
            Some(met)
        };
        let fits = pairs.iter().enumerate().map(&mut fit).collect();
        Plan { fits, error: worst, ranks, width }
    }

    /// How the block's windows are summed.
    pub(super) fn counts(&self, block: &Block<'_>) -> SummationCounts {
        let terms = self.ranks.iter().map(|rank| rank.terms.count()).max().unwrap_or(0);
        let mut counts = SummationCounts { error: self.error, terms, ..SummationCounts::default() };
        for (pair, met) in self.fits.iter().enumerate() {
            let pixels = 4 * block.output[pair % block.output.len()].in_quadrant;
            match met {
                Some(true) => counts.prefix += pixels,
                Some(false) => counts.missed += pixels,
                None => (),
            }
        }
        counts
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

/// Plain rows, of one group of thresholds: costs are compared for one, and so all are summed in the way of one alone.
fn plain_rows(layout: &Layout) -> f64 {
    (layout.plain + [layout.masked, layout.lost_edges].iter().flatten().count()) as f64
}

/// Nanoseconds, about, that adding the block to a quadrant takes directly.
fn direct_cost(block: &Block<'_>, layout: &Layout) -> f64 {
    let pixel = 1.0 + 0.3 * plain_rows(layout) + 0.7 * layout.ranks.len() as f64;
    let pair =
        |(ring, r): (&OutputRing, &Reached)| ring.in_quadrant as f64 * (2.0 * r.half_width / r.phi.1 * pixel + 30.0);
    block.pairs().map(pair).sum()
}

/// The same from prefix sums with so many terms for all ranks.
fn cost(block: &Block<'_>, layout: &Layout, terms: usize, width: f64) -> f64 {
    let (terms, plain) = (terms as f64, plain_rows(layout));
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

    /// The output rings that reach an input ring and whose fits meet the tolerance, each with its place.
    fn met<'a>(&self, block: &'a Block<'_>, ring: usize) -> impl Iterator<Item = (usize, &'a OutputRing, &'a Reached)> {
        let fits = self.fits_of(block, ring);
        block.reaching(ring).filter(|(i, ..)| fits[*i] == Some(true))
    }
}

/// Input rings that are added at a time: the windows' sums are then read and written but once for all of them.
const TOGETHER: usize = 4;

/// Some pixels of each output ring, and what is needed to sum their windows. Numbers come in sets, for each term of a
/// rank a real part, then for each an imaginary part.
struct Tile {
    /// The pixels of each ring's quadrant.
    parts: Vec<Range<usize>>,
    /// Sums of the plain rows: for each row, for each output ring, for each pixel.
    plain: Vec<Vec<Vec<f64>>>,
    /// Σ c_k (differences of prefix sums): for each ψ_s, for each output ring, a set for each pixel.
    totals: Vec<Vec<Vec<f64>>>,
    /// For each rank e^{i m_k φ} at pixels of the input rings, and, conjugated, of the output rings.
    phases: Vec<(Phases, Phases)>,
    inputs: [Input; TOGETHER],
}

/// Prefix sums along an input ring.
struct Input {
    /// Of each plain row.
    plain: Vec<Vec<f64>>,
    /// Of P e^{i m_k φ}, for each ψ_s.
    psi: Vec<Vec<f64>>,
    /// The ring's pixel at which they begin, counted in the first quadrant.
    first: isize,
    /// The pixels of the ring within each window of the present output ring, counted from there.
    spans: Spans,
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
        let input = || Input {
            plain: vec![vec![0.0]; layout.first_rank],
            psi: layout.psi().map(|(_, rank)| vec![0.0; 2 * plan.ranks[rank].terms.count()]).collect(),
            first: 0,
            spans: Spans::default(),
        };
        Tile {
            parts: Vec::new(),
            plain: vec![Vec::new(); layout.first_rank],
            totals: vec![Vec::new(); layout.psi().count()],
            phases: plan.ranks.iter().map(|_| Default::default()).collect(),
            inputs: std::array::from_fn(|_| input()),
        }
    }

    /// Adds the block to the windows about the tile's pixels.
    fn add(&mut self, block: &Block<'_>, quadrant: usize, layout: &Layout, plan: &Plan, sums: &mut [Sums]) {
        let occupied = || block.output.iter().zip(&self.parts).filter(|(_, part)| !part.is_empty());
        let west = occupied().map(|(ring, part)| ring.phi_of(part.start)).fold(f64::INFINITY, f64::min);
        let east = occupied().map(|(ring, part)| ring.phi_of(part.end - 1)).fold(f64::NEG_INFINITY, f64::max);
        if west > east {
            return;
        }
        let middle = (west + east) / 2.0;
        let parts = &self.parts;
        let zeros = |set: usize| parts.iter().map(|part| vec![0.0; part.len() * set]).collect::<Vec<_>>();
        self.plain.iter_mut().for_each(|totals| *totals = zeros(1));
        for (totals, (_, rank)) in self.totals.iter_mut().zip(layout.psi()) {
            *totals = zeros(2 * plan.ranks[rank].terms.count());
        }
        self.phases.iter_mut().for_each(|phases| *phases = Default::default());
        for first in block.rings.clone().step_by(TOGETHER) {
            let together = first..(first + TOGETHER).min(block.rings.end);
            for number in together.clone() {
                self.fill(number - first, block, number, quadrant, layout, plan, (west, middle, east));
            }
            self.add_inputs(block, together, layout, plan, sums);
        }
        self.turn_back(block, layout, plan, middle, sums);
    }

    /// Makes the prefix sums along an input ring, from one pixel west of all windows to one east.
    #[allow(clippy::too_many_arguments)]
    fn fill(
        &mut self,
        place: usize,
        block: &Block<'_>,
        number: usize,
        quadrant: usize,
        layout: &Layout,
        plan: &Plan,
        (west, middle, east): (f64, f64, f64),
    ) {
        let met = plan.met(block, number);
        let Some((_, _, ring)) = met.max_by(|a, b| a.2.half_width.total_cmp(&b.2.half_width)) else { return };
        let (from, to) = (ring.span(west).0 - 1, ring.span(east).1 + 1);
        let columns = Columns { first: ring.column(from, quadrant), pixels: (to - from) as usize, len: ring.len };
        // The same phases for all rings of this kind in the block.
        let widest = Reached { half_width: plan.width, ..*ring };
        let all = widest.span(west).0.min(from) - 1..widest.span(east).1.max(to) + 1;
        let moments = block.band.moments(number);
        let input = &mut self.inputs[place];
        input.first = from;
        for (row, prefix) in input.plain.iter_mut().enumerate() {
            fill_plain(prefix, moments.row(row), columns);
        }
        for (prefix, (row, rank)) in input.psi.iter_mut().zip(layout.psi()) {
            let plan = &plan.ranks[rank];
            let set = 2 * plan.terms.count();
            let pixels = (ring.phi_of(all.start) - middle, ring.phi.1, all.len());
            let sets = self.phases[rank].0.at(pixels, &plan.terms.frequencies);
            let sets = &sets[(from - all.start) as usize * set..][..columns.pixels * set];
            prefix.resize((columns.pixels + 1) * set, 0.0);
            fill(set, prefix, moments.row(row), moments.row(row + 1), columns, sets);
        }
    }

    /// Adds these input rings to the windows.
    fn add_inputs(&mut self, block: &Block<'_>, rings: Range<usize>, layout: &Layout, plan: &Plan, sums: &mut [Sums]) {
        let nothing = vec![0.0; plan.ranks.iter().map(|rank| 2 * rank.terms.count()).max().unwrap_or(0)];
        for (i, ring) in block.output.iter().enumerate() {
            let part = self.parts[i].clone();
            let mut pairs = [None; TOGETHER];
            for (place, input) in self.inputs.iter_mut().enumerate() {
                let pair = (rings.start + place - block.rings.start) * block.output.len() + i;
                let met = place < rings.len() && plan.fits[pair] == Some(true);
                match block.reached.get(pair) {
                    Some(Some(reached)) if met => {
                        pairs[place] = Some(pair);
                        let pixels = &mut sums[i].pixels[part.clone()];
                        input.spans.find(ring, reached, part.clone(), input.first, pixels);
                    }
                    _ => input.spans.empty(part.len()),
                }
            }
            if pairs == [None; TOGETHER] {
                continue;
            }
            let spans = self.inputs.each_ref().map(|input| &input.spans);
            for (row, totals) in self.plain.iter_mut().enumerate() {
                add_plain(spans, self.inputs.each_ref().map(|input| &*input.plain[row]), &mut totals[i]);
            }
            for (psi, (_, rank)) in layout.psi().enumerate() {
                let plan = &plan.ranks[rank];
                let set = 2 * plan.terms.count();
                let factors = pairs.map(|pair| match pair {
                    Some(pair) => &plan.factors[set * pair..][..set],
                    None => &nothing[..set],
                });
                let prefix = self.inputs.each_ref().map(|input| &*input.psi[psi]);
                Arch::new().dispatch(AddSpans { set, spans, prefix, factors, totals: &mut self.totals[psi][i] });
            }
        }
    }

    /// Adds the totals to the windows, turned back to each window's own longitude.
    fn turn_back(&mut self, block: &Block<'_>, layout: &Layout, plan: &Plan, middle: f64, sums: &mut [Sums]) {
        for (i, ring) in block.output.iter().enumerate() {
            let part = &self.parts[i];
            let rows = sums[i].rows;
            let windows = &mut sums[i].data[part.start * rows..part.end * rows];
            for (row, totals) in self.plain.iter().enumerate() {
                windows.chunks_exact_mut(rows).zip(&totals[i]).for_each(|(window, total)| window[row] += total);
            }
            for (totals, (row, rank)) in self.totals.iter().zip(layout.psi()).filter(|_| !part.is_empty()) {
                let plan = &plan.ranks[rank];
                let pixels = (middle - ring.phi_of(part.start), -ring.phi.1, part.len());
                let sets = self.phases[rank].1.at(pixels, &plan.terms.frequencies);
                let windows = windows[row..].chunks_mut(rows);
                turn_back(2 * plan.terms.count(), &totals[i], sets, windows);
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

impl Spans {
    /// Nothing, for so many windows.
    fn empty(&mut self, windows: usize) {
        for ends in [&mut self.from, &mut self.to] {
            ends.clear();
            ends.resize(windows, 0);
        }
    }

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
fn add_plain(spans: [&Spans; TOGETHER], prefix: [&[f64]; TOGETHER], totals: &mut [f64]) {
    for (spans, prefix) in spans.into_iter().zip(prefix) {
        for ((&from, &to), total) in spans.from.iter().zip(&spans.to).zip(&mut *totals) {
            *total += prefix[to as usize] - prefix[from as usize];
        }
    }
}

/// Adds factors times the differences of prefix sums over each span. Written with explicit vectors: left to itself, the
/// compiler reads several sets at a time, number by number.
struct AddSpans<'a> {
    set: usize,
    spans: [&'a Spans; TOGETHER],
    prefix: [&'a [f64]; TOGETHER],
    factors: [&'a [f64]; TOGETHER],
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
        let AddSpans { spans, .. } = self;
        let factors = self.factors.map(|factors| S::as_simd_f64s(factors).0.as_chunks::<N>().0[0]);
        let prefix = self.prefix.map(|prefix| S::as_simd_f64s(prefix).0.as_chunks::<N>().0);
        let totals = S::as_mut_simd_f64s(self.totals).0.as_chunks_mut::<N>().0;
        let windows = totals.len();
        let spans = spans.map(|spans| (&spans.from[..windows], &spans.to[..windows]));
        for (w, total) in totals.iter_mut().enumerate() {
            let mut sum = *total;
            for r in 0..TOGETHER {
                let (from, to) = (&prefix[r][spans[r].0[w] as usize], &prefix[r][spans[r].1[w] as usize]);
                for k in 0..N {
                    sum[k] = simd.mul_add_f64s(factors[r][k], simd.sub_f64s(to[k], from[k]), sum[k]);
                }
            }
            *total = sum;
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

#[cfg(test)]
mod tests {
    use super::*;
    use longan_grid::Healpix;

    /// Fits are judged by what they give, whatever they were meant to fit.
    #[test]
    fn bad_fits_are_seen() {
        let (grid, radius) = (Healpix::new(64).unwrap(), 0.1);
        let output: Vec<OutputRing> = (40..48).map(|i| OutputRing::new(grid, grid, i, radius)).collect();
        let input = (38..46).map(|i| (i, grid.ring(i)));
        let pairs: Vec<Option<Reached>> = input
            .flat_map(|(i, ring)| output.iter().map(move |from| from.reached(i, &ring, ring.theta(), radius)))
            .collect();
        let width = pairs.iter().flatten().map(|r| r.half_width).fold(0.0, f64::max);
        let sample: Vec<RingTransport> = pairs.iter().flatten().map(|r| r.transport).collect();
        let good = || Terms::new(2, width, &sample, 1e-7).unwrap();
        let all = |terms: Terms, met: bool| {
            let plan = Plan::new(vec![terms], width, &pairs, 1e-7);
            pairs.iter().zip(&plan.fits).all(|(pair, fit)| *fit == pair.map(|_| met)) && (met == (plan.error > 0.0))
        };
        assert!(all(good(), true));
        // The phases of another hemisphere, and of wider windows.
        let mirrored: Vec<RingTransport> = (200..208)
            .map(|i| RingTransport::new(grid.ring(i).theta().sin_cos(), grid.ring(i).theta().sin_cos()))
            .collect();
        assert!(all(Terms::new(40, width, &mirrored, 1e-7).unwrap().of_rank(2), false));
        assert!(all(Terms::new(2, 30.0 * width, &sample, 0.1).unwrap(), false));
    }
}
