//! Windows from prefix sums along the input rings: the cost of an (output pixel, input ring) pair does not depend on how
//! many pixels the ring has within the window.
//!
//! For a fixed pair of rings the phase of transport is a smooth function of x = Δφ, so
//! e^{isδ(x)} ≈ Σ_k c_k e^{i m_k x} with real c_k. The frequencies m_k are common to a group of output rings and
//! a fit gives the c_k of each pair. So prefix sums of P e^{i m_k φ} along an input ring turn its part of a window into
//! two look-ups. Each fit's error is measured between its nodes; a pair that misses the tolerance is summed directly.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

use nalgebra::DMatrix;
use num_complex::Complex64;

use super::reach::{OutputRing, Reached};
use super::{Band, Summation, Sums, Ways, direct};
use crate::moments::Layout;
use crate::transport::RingTransport;

/// Numbers side by side; terms come in multiples of it.
const LANES: usize = 4;

/// Numbers of terms to a phase that are tried in turn.
const TERMS: [usize; 4] = [4, 8, 12, 16];

/// Most output rings to a group.
const GROUP: usize = 32;

/// Output pixels of a ring that are summed at a time, about: what they need stays in the processor's cache.
const TILE: usize = 256;

/// Prefix sums are used where they take less than this share of the direct sum's time.
const WORTHWHILE: f64 = 0.5;

/// Singular values below this share of the largest are dropped from a fit.
const SINGULAR: f64 = 1e-13;

/// Output rings that are summed in one way.
pub(super) struct Group {
    /// Their places among the rings of the band.
    pub(super) rings: Range<usize>,
    /// How to sum them from prefix sums; directly without.
    pub(super) plan: Option<Plan>,
}

/// Prefix sums for a group: how many numbers a pixel has, and the terms of each rank.
pub(super) struct Plan {
    ranks: Vec<Terms>,
    /// Plain rows, then real and imaginary parts of each rank's terms; each part a multiple of [`LANES`].
    width: usize,
    tolerance: f64,
}

/// The terms of one rank's phase.
struct Terms {
    rank: u32,
    /// m_k.
    frequencies: Vec<f64>,
    /// From values at the nodes (real parts, then imaginary parts) to c_k.
    fit: DMatrix<f64>,
    nodes: Vec<Node>,
    checks: Vec<Node>,
}

/// A place x at which a phase is taken.
struct Node {
    cos: f64,
    sin: f64,
    /// e^{−i m x} with m the middle frequency.
    back: Complex64,
    /// e^{i (m_k − m) x}.
    terms: Vec<Complex64>,
}

/// Divides rings into groups and finds the cheaper way for each.
pub(super) fn groups(rings: &[OutputRing], layout: &Layout, radius: f64, summation: Summation) -> Vec<Group> {
    let (tolerance, worthwhile) = match summation {
        Summation::Exact => return (0..rings.len()).map(|i| Group { rings: i..i + 1, plan: None }).collect(),
        Summation::Tolerance(tolerance) => (tolerance, WORTHWHILE),
        Summation::Prefix(tolerance) => (tolerance, f64::INFINITY),
    };
    // Groups no higher than the window's radius: their phases differ little more than those of one ring.
    let mut groups = Vec::new();
    let mut start = 0;
    for end in 1..=rings.len() {
        let full = end - start == GROUP || end == rings.len() || rings[end].theta - rings[start].theta > radius;
        if full {
            let plan = Plan::new(&rings[start..end], layout, tolerance);
            match plan
                .filter(|plan| plan.cost(&rings[start..end]) < worthwhile * direct_cost(&rings[start..end], layout))
            {
                Some(plan) => groups.push(Group { rings: start..end, plan: Some(plan) }),
                None => groups.extend((start..end).map(|i| Group { rings: i..i + 1, plan: None })),
            }
            start = end;
        }
    }
    groups
}

/// Nanoseconds, about, that summing a quadrant directly takes.
fn direct_cost(rings: &[OutputRing], layout: &Layout) -> f64 {
    let pixel = 1.0 + 0.3 * layout.first_rank as f64 + 0.7 * layout.ranks.len() as f64;
    let of_ring = |ring: &OutputRing| {
        let pixels: f64 = ring.reached.iter().map(|r| 2.0 * r.half_width / r.phi.1).sum();
        ring.in_quadrant as f64 * (pixels * pixel + 30.0 * ring.reached.len() as f64)
    };
    rings.iter().map(of_ring).sum()
}

impl Plan {
    /// The smallest sets of terms that meet the tolerance on a sample of the group's pairs.
    fn new(rings: &[OutputRing], layout: &Layout, tolerance: f64) -> Option<Plan> {
        let width = rings.iter().flat_map(|ring| &ring.reached).map(|r| r.half_width).fold(0.0, f64::max);
        let mut sample: Vec<RingTransport> = Vec::new();
        for ring in [rings.first()?, &rings[rings.len() / 2], rings.last()?] {
            let n = ring.reached.len();
            sample.extend(
                [0, n / 4, n / 2, 3 * n / 4, n.saturating_sub(1)]
                    .iter()
                    .filter_map(|&i| ring.reached.get(i))
                    .map(|r| r.transport),
            );
        }
        let ranks: Option<Vec<Terms>> =
            layout.ranks.iter().map(|&rank| Terms::new(rank, width, &sample, tolerance)).collect();
        let ranks = ranks?;
        let terms: usize = ranks.iter().map(|t| 2 * t.frequencies.len()).sum();
        Some(Plan { ranks, width: layout.first_rank.next_multiple_of(LANES) + terms, tolerance })
    }

    /// Nanoseconds, about, that summing a quadrant of these rings takes.
    fn cost(&self, rings: &[OutputRing]) -> f64 {
        let pairs: f64 = rings.iter().map(|ring| (ring.in_quadrant * ring.reached.len()) as f64).sum();
        let fits: f64 = rings.iter().map(|ring| ring.reached.len() as f64).sum::<f64>() * self.width as f64 * 20.0;
        let tiles = tiles(rings);
        // Input pixels of all tiles, of the rings that the middle output ring reaches.
        let middle = &rings[rings.len() / 2];
        let share = 1.0 + rings.len() as f64 / middle.reached.len().max(1) as f64;
        let of_ring = |r: &Reached| (FRAC_PI_2 / tiles as f64 + 2.0 * r.half_width) / r.phi.1 * tiles as f64;
        let pixels: f64 = middle.reached.iter().map(of_ring).sum::<f64>() * share;
        pairs * (3.0 + 0.12 * self.width as f64) + pixels * 0.6 * self.width as f64 + fits
    }
}

/// Parts of a quadrant.
fn tiles(rings: &[OutputRing]) -> usize {
    rings.iter().map(|ring| ring.in_quadrant).max().unwrap_or(1).div_ceil(TILE)
}

impl Terms {
    fn new(rank: u32, width: f64, sample: &[RingTransport], tolerance: f64) -> Option<Terms> {
        // The local frequency of e^{isδ(x)} lies between those at x = 0 and at the window's edge.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for transport in sample {
            for x in [0.0, width] {
                let frequency = f64::from(rank) * transport.rate(x);
                (low, high) = (low.min(frequency), high.max(frequency));
            }
        }
        let middle = if width < PI { (low + high) / 2.0 } else { ((low + high) / 2.0).round() };
        for terms in TERMS {
            let spread = (high - low) / (terms - 1) as f64;
            for spacing in [spread.max(0.02 / width), 0.75 / width, 1.0] {
                if spacing * width > PI || !spacing.is_finite() {
                    continue;
                }
                let set = Terms::with(rank, width, middle, spacing, terms);
                let mut coefficients = vec![0.0; terms];
                let worst = sample.iter().map(|t| set.fit(t, &mut coefficients)).fold(0.0, f64::max);
                if worst < tolerance / 2.0 {
                    return Some(set);
                }
            }
        }
        None
    }

    fn with(rank: u32, width: f64, middle: f64, spacing: f64, terms: usize) -> Terms {
        let offsets: Vec<f64> = (0..terms).map(|k| (k as f64 - ((terms - 1) / 2) as f64) * spacing).collect();
        let node = |x: f64| Node {
            cos: x.cos(),
            sin: x.sin(),
            back: Complex64::cis(-middle * x),
            terms: offsets.iter().map(|o| Complex64::cis(o * x)).collect(),
        };
        // Chebyshev nodes in −width..width; phases at −x are those at x conjugated.
        let chebyshev = |n: usize, of: usize| width * (PI * n as f64 / of as f64).cos();
        let nodes: Vec<Node> = (0..terms).map(|n| node(chebyshev(2 * n + 1, 4 * terms))).collect();
        let checks = (0..=terms).map(|n| node(chebyshev(n, 2 * terms))).collect();
        let design = DMatrix::from_fn(2 * terms, terms, |row, k| {
            if row < terms { nodes[row].terms[k].re } else { nodes[row - terms].terms[k].im }
        });
        let largest = design.clone().singular_values().max();
        let fit = design.pseudo_inverse(SINGULAR * largest).unwrap_or_else(|_| DMatrix::zeros(terms, 2 * terms));
        Terms { rank, frequencies: offsets.iter().map(|o| middle + o).collect(), fit, nodes, checks }
    }

    /// The c_k of a pair of rings, and the fit's largest error.
    fn fit(&self, transport: &RingTransport, coefficients: &mut [f64]) -> f64 {
        let phase = |node: &Node| transport.phase(node.cos, node.sin).powu(self.rank) * node.back;
        let terms = self.nodes.len();
        coefficients.fill(0.0);
        for (n, node) in self.nodes.iter().enumerate() {
            let phase = phase(node);
            for (k, c) in coefficients.iter_mut().enumerate() {
                *c += self.fit[(k, n)] * phase.re + self.fit[(k, terms + n)] * phase.im;
            }
        }
        let error = |node: &Node| {
            let fitted: Complex64 = node.terms.iter().zip(coefficients.iter()).map(|(t, c)| t * c).sum();
            (fitted - phase(node)).norm()
        };
        self.checks.iter().map(error).fold(0.0, f64::max)
    }
}

/// Windows about the pixels of one quadrant of each of a group's rings.
pub(super) fn sums(
    rings: &[OutputRing],
    quadrant: usize,
    band: &Band,
    layout: &Layout,
    plan: &Plan,
) -> (Vec<Sums>, Ways) {
    let terms = plan.ranks.iter().map(|t| t.frequencies.len()).max().unwrap_or(0);
    let mut ways = Ways { terms, ..Ways::default() };
    let mut sums: Vec<Sums> = rings.iter().map(|ring| Sums::new(ring.in_quadrant, layout.rows)).collect();
    // The fits of all pairs; those that miss the tolerance are left to the direct sum.
    let mut coefficients: Vec<Vec<Option<Vec<f64>>>> = Vec::new();
    for (ring, sums) in rings.iter().zip(&mut sums) {
        let mut of_ring = Vec::with_capacity(ring.reached.len());
        for reached in &ring.reached {
            let (fitted, error) = plan.coefficients(&reached.transport, layout);
            if error <= plan.tolerance {
                ways.prefix += ring.in_quadrant;
                ways.error = ways.error.max(error);
                of_ring.push(Some(fitted));
            } else {
                ways.direct += ring.in_quadrant;
                direct::add_ring(ring, reached, 0..ring.in_quadrant, quadrant, band, layout, sums);
                of_ring.push(None);
            }
        }
        coefficients.push(of_ring);
    }
    let tiles = tiles(rings);
    for tile in 0..tiles {
        let part = |ring: &OutputRing| {
            (tile * ring.in_quadrant).div_ceil(tiles)..((tile + 1) * ring.in_quadrant).div_ceil(tiles)
        };
        add_tile(rings, part, quadrant, band, layout, plan, &coefficients, &mut sums);
    }
    (sums, ways)
}

impl Plan {
    /// Factors of a pair's prefix sums, and the largest error of its phases.
    fn coefficients(&self, transport: &RingTransport, layout: &Layout) -> (Vec<f64>, f64) {
        let mut all = vec![1.0; layout.first_rank.next_multiple_of(LANES)];
        let mut worst: f64 = 0.0;
        for terms in &self.ranks {
            let n = terms.frequencies.len();
            let mut c = vec![0.0; n];
            worst = worst.max(terms.fit(transport, &mut c));
            all.extend_from_slice(&c);
            all.extend_from_slice(&c);
        }
        (all, worst)
    }
}

/// Adds the windows about a part of each ring's quadrant, input ring by input ring.
#[allow(clippy::too_many_arguments)]
fn add_tile(
    rings: &[OutputRing],
    part: impl Fn(&OutputRing) -> Range<usize>,
    quadrant: usize,
    band: &Band,
    layout: &Layout,
    plan: &Plan,
    coefficients: &[Vec<Option<Vec<f64>>>],
    sums: &mut [Sums],
) {
    let parts: Vec<Range<usize>> = rings.iter().map(&part).collect();
    let occupied = || rings.iter().zip(&parts).filter(|(_, part)| !part.is_empty());
    let west = occupied().map(|(ring, part)| ring.phi_of(part.start)).fold(f64::INFINITY, f64::min);
    let east = occupied().map(|(ring, part)| ring.phi_of(part.end - 1)).fold(f64::NEG_INFINITY, f64::max);
    if west > east {
        return;
    }
    let middle = (west + east) / 2.0;
    let width = plan.width / LANES;
    let mut totals: Vec<Vec<[f64; LANES]>> = parts.iter().map(|part| vec![[0.0; LANES]; part.len() * width]).collect();
    let mut prefix: Vec<[f64; LANES]> = Vec::new();
    let mut spans: Vec<(u32, u32)> = Vec::new();
    let first = rings.iter().filter_map(|ring| ring.reached.first()).map(|r| r.number).min();
    let last = rings.iter().filter_map(|ring| ring.reached.last()).map(|r| r.number).max();
    for number in first.unwrap_or(1)..=last.unwrap_or(0) {
        let reached_by = |ring: &OutputRing| {
            let at = number.checked_sub(ring.reached.first()?.number)?;
            ring.reached.get(at).map(|r| (at, *r))
        };
        let Some((_, widest)) =
            rings.iter().filter_map(reached_by).max_by(|a, b| a.1.half_width.total_cmp(&b.1.half_width))
        else {
            continue;
        };
        // Prefix sums from one pixel west of all windows to one east.
        let (from, _) = widest.span(west);
        let (_, to) = widest.span(east);
        let (from, to) = (from - 1, to + 1);
        fill(&mut prefix, band, layout, plan, &widest, from..to, quadrant, middle);
        for (i, ring) in rings.iter().enumerate() {
            let Some((at, reached)) = reached_by(ring) else { continue };
            let Some(factors) = &coefficients[i][at] else { continue };
            spans.clear();
            for k in parts[i].clone() {
                let (a, b) = reached.span(ring.phi_of(k));
                let b = b.max(a);
                sums[i].pixels[k] += (b - a) as usize;
                spans.push(((a - from) as u32, (b - from) as u32));
            }
            add(&prefix, width, &spans, factors, &mut totals[i]);
        }
    }
    for (i, ring) in rings.iter().enumerate() {
        for (k, totals) in parts[i].clone().zip(totals[i].chunks_exact(width)) {
            let totals = totals.as_flattened();
            let dphi = middle - ring.phi_of(k);
            let sums = sums[i].of(k, 0);
            (0..layout.first_rank).for_each(|row| sums[row] += totals[row]);
            let mut at = layout.first_rank.next_multiple_of(LANES);
            for (rank, terms) in plan.ranks.iter().enumerate() {
                let n = terms.frequencies.len();
                let mut psi = Complex64::ZERO;
                for (k, m) in terms.frequencies.iter().enumerate() {
                    psi += Complex64::new(totals[at + k], totals[at + n + k]) * Complex64::cis(m * dphi);
                }
                sums[layout.first_rank + 2 * rank] += psi.re;
                sums[layout.first_rank + 2 * rank + 1] += psi.im;
                at += 2 * n;
            }
        }
    }
}

/// Prefix sums along a stretch of an input ring, with phases counted from longitude `middle`.
#[allow(clippy::too_many_arguments)]
#[multiversion::multiversion(targets = "simd")]
fn fill(
    prefix: &mut Vec<[f64; LANES]>,
    band: &Band,
    layout: &Layout,
    plan: &Plan,
    ring: &Reached,
    stretch: Range<isize>,
    quadrant: usize,
    middle: f64,
) {
    let moments = band.ring(ring.number);
    let lanes = plan.width / LANES;
    let plain = layout.first_rank.div_ceil(LANES);
    prefix.clear();
    prefix.resize((stretch.len() + 1) * lanes, [0.0; LANES]);
    // e^{i m_k (φ − middle)} and its step from pixel to pixel, for each rank: real parts, then imaginary parts.
    let of = |angle: f64| -> Vec<[f64; LANES]> {
        let mut all = Vec::with_capacity(lanes - plain);
        for terms in &plan.ranks {
            let cis = |m: &f64| Complex64::cis(m * angle);
            all.extend(terms.frequencies.as_chunks::<LANES>().0.iter().map(|m| std::array::from_fn(|k| cis(&m[k]).re)));
            all.extend(terms.frequencies.as_chunks::<LANES>().0.iter().map(|m| std::array::from_fn(|k| cis(&m[k]).im)));
        }
        all
    };
    let (mut phases, steps) = (of(ring.phi_of(stretch.start) - middle), of(ring.phi.1));
    let mut column = ring.column(stretch.start, quadrant);
    for pixel in 0..stretch.len() {
        let (before, after) = prefix.split_at_mut((pixel + 1) * lanes);
        let (before, after) = (&before[pixel * lanes..], &mut after[..lanes]);
        after.copy_from_slice(before);
        for row in 0..layout.first_rank {
            after[row / LANES][row % LANES] += moments.row(row)[column];
        }
        let mut at = 0;
        for (rank, terms) in plan.ranks.iter().enumerate() {
            let row = layout.first_rank + 2 * rank;
            let (re, im) = (moments.row(row)[column], moments.row(row + 1)[column]);
            let n = terms.frequencies.len() / LANES;
            let (cos, sin) = phases[at..at + 2 * n].split_at_mut(n);
            let (step_cos, step_sin) = steps[at..at + 2 * n].split_at(n);
            let (to_re, to_im) = after[plain + at..plain + at + 2 * n].split_at_mut(n);
            for c in 0..n {
                for k in 0..LANES {
                    let (u, v) = (cos[c][k], sin[c][k]);
                    to_re[c][k] += re * u - im * v;
                    to_im[c][k] += re * v + im * u;
                    cos[c][k] = u * step_cos[c][k] - v * step_sin[c][k];
                    sin[c][k] = u * step_sin[c][k] + v * step_cos[c][k];
                }
            }
            at += 2 * n;
        }
        column += 1;
        if column == ring.len {
            column = 0;
        }
    }
}

/// Adds factors times the differences of prefix sums over each span.
#[multiversion::multiversion(targets = "simd")]
fn add(prefix: &[[f64; LANES]], width: usize, spans: &[(u32, u32)], factors: &[f64], totals: &mut [[f64; LANES]]) {
    let factors = factors.as_chunks::<LANES>().0;
    match width {
        1 => add_lanes::<1>(prefix, spans, factors, totals),
        2 => add_lanes::<2>(prefix, spans, factors, totals),
        3 => add_lanes::<3>(prefix, spans, factors, totals),
        4 => add_lanes::<4>(prefix, spans, factors, totals),
        5 => add_lanes::<5>(prefix, spans, factors, totals),
        _ => {
            for (&(from, to), total) in spans.iter().zip(totals.chunks_exact_mut(width)) {
                let (a, b) = (&prefix[from as usize * width..], &prefix[to as usize * width..]);
                for c in 0..width {
                    (0..LANES).for_each(|k| total[c][k] += factors[c][k] * (b[c][k] - a[c][k]));
                }
            }
        }
    }
}

/// The same for a width known to the compiler.
#[inline(always)]
fn add_lanes<const WIDTH: usize>(
    prefix: &[[f64; LANES]],
    spans: &[(u32, u32)],
    factors: &[[f64; LANES]],
    totals: &mut [[f64; LANES]],
) {
    let (prefix, totals) = (prefix.as_chunks::<WIDTH>().0, totals.as_chunks_mut::<WIDTH>().0);
    let factors = &factors.as_chunks::<WIDTH>().0[0];
    for (&(from, to), total) in spans.iter().zip(totals) {
        let (a, b) = (&prefix[from as usize], &prefix[to as usize]);
        for c in 0..WIDTH {
            for k in 0..LANES {
                total[c][k] += factors[c][k] * (b[c][k] - a[c][k]);
            }
        }
    }
}
