//! Windows summed pixel by pixel: exact, at a cost that grows with the window's area.

use std::f64::consts::TAU;
use std::ops::Range;

use num_complex::Complex64;

use super::reach::{OutputRing, Reached};
use super::{Block, Sums};
use crate::moments::{Layout, RingMoments};
use crate::transport::{Phases, Powers};

/// Pixels transported at a time.
const PIXELS: usize = 32;

/// Numbers summed side by side, as many as the widest vector units hold.
const LANES: usize = 8;

/// Adds a block of input rings to the windows about the pixels of one quadrant of a group's rings.
///
/// Longitudes are counted from the quadrant's own meridian, so that a field turned by 90° gives the same windows to
/// the last bit.
pub(super) fn add(block: &Block<'_>, quadrant: usize, layout: &Layout, sums: &mut [Sums]) {
    // Input ring by input ring, so that what neighbouring windows share is read once.
    for number in block.rings.clone() {
        for (i, ring, reached) in block.reaching(number) {
            add_ring(ring, reached, quadrant, block.band.moments(number), layout, &mut sums[i]);
        }
    }
}

/// Adds what the windows about the pixels of an output ring's quadrant hold of one input ring.
pub(super) fn add_ring(
    ring: &OutputRing,
    reached: &Reached,
    quadrant: usize,
    moments: &RingMoments,
    layout: &Layout,
    sums: &mut Sums,
) {
    let steps = Steps::new(reached.len);
    // Where the input ring's pixels lie in the same way about each output pixel, their phases are the same.
    let stride = ring.stride(reached);
    let (from_first, to_first) = reached.span(ring.phi_of(0));
    let mut turns = Vec::new();
    for k in 0..ring.in_quadrant {
        let phi = ring.phi_of(k);
        let (from, to) = match stride {
            Some(pixels) => (from_first + (k * pixels) as isize, to_first + (k * pixels) as isize),
            None => reached.span(phi),
        };
        let start = reached.column(from, quadrant);
        let columns = start..start + (to - from).max(0) as usize;
        if stride.is_none() || k == 0 {
            let dphi = reached.phi_of(from) - phi;
            find_turns(columns.len(), layout, dphi, reached, &steps, &mut turns);
        }
        let sums = sums.of(k, columns.len());
        if columns.end <= reached.len {
            add_pixels(moments, layout, columns, &turns, sums);
        } else {
            // Across φ = 0: put together first, so that the sum is the same wherever the window lies.
            let joined = moments.joined(columns.start..reached.len, 0..columns.end - reached.len);
            add_pixels(&joined, layout, 0..columns.len(), &turns, sums);
        }
    }
}

/// e^{iφ} for the longitudes of pixels in a ring, counted from the first.
struct Steps {
    steps: Phases<PIXELS>,
    /// The same for PIXELS pixels.
    stride: Complex64,
}

impl Steps {
    fn new(len: usize) -> Self {
        let mut steps = [Complex64::ONE; PIXELS];
        steps[1] = Complex64::cis(TAU / len as f64);
        (2..PIXELS).for_each(|k| steps[k] = steps[k / 2] * steps[k - k / 2]);
        let stride = steps[PIXELS / 2] * steps[PIXELS / 2];
        Steps { steps: Phases { re: steps.map(|s| s.re), im: steps.map(|s| s.im) }, stride }
    }
}

/// Phases of transport from so many consecutive pixels, the first of which lies `dphi` east of the centre: for each block
/// of pixels those of each rank.
#[multiversion::multiversion(targets = "simd")]
fn find_turns(
    pixels: usize,
    layout: &Layout,
    dphi: f64,
    reached: &Reached,
    steps: &Steps,
    turns: &mut Vec<Phases<PIXELS>>,
) {
    turns.clear();
    if layout.ranks.is_empty() {
        return;
    }
    let mut base = Complex64::cis(dphi);
    for _ in 0..pixels.div_ceil(PIXELS) {
        let mut phases = Phases::<PIXELS>::default();
        for k in 0..PIXELS {
            let (step_re, step_im) = (steps.steps.re[k], steps.steps.im[k]);
            let (cos, sin) = (base.re * step_re - base.im * step_im, base.re * step_im + base.im * step_re);
            let phase = reached.transport.phase(cos, sin);
            (phases.re[k], phases.im[k]) = (phase.re, phase.im);
        }
        base *= steps.stride;
        let mut powers = Powers::new(phases);
        turns.extend(layout.ranks.iter().map(|&rank| *powers.raise(rank)));
    }
}

/// Adds the moments of a range of pixels of a ring, each turned by its phase.
#[multiversion::multiversion(targets = "simd")]
fn add_pixels(ring: &RingMoments, layout: &Layout, columns: Range<usize>, turns: &[Phases<PIXELS>], sums: &mut [f64]) {
    for (row, sum) in sums[..layout.first_rank].iter_mut().enumerate() {
        *sum += sum_of(&ring.row(row)[columns.clone()]);
    }
    let ranks = layout.ranks.len();
    for (row, rank) in layout.psi() {
        let (re, im) = (&ring.row(row)[columns.clone()], &ring.row(row + 1)[columns.clone()]);
        let mut sum = Complex64::ZERO;
        for (block, (re, im)) in re.chunks(PIXELS).zip(im.chunks(PIXELS)).enumerate() {
            sum += sum_of_turned(re, im, &turns[block * ranks + rank]);
        }
        sums[row] += sum.re;
        sums[row + 1] += sum.im;
    }
}

/// Sum of the values, in lanes side by side.
#[inline(always)]
fn sum_of(values: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        (0..LANES).for_each(|k| lanes[k] += chunk[k]);
    }
    (0..rest.len()).for_each(|k| lanes[k] += rest[k]);
    lanes.iter().sum()
}

/// Sum of the complex numbers re + i im, each turned by its phase.
#[inline(always)]
fn sum_of_turned(re: &[f64], im: &[f64], by: &Phases<PIXELS>) -> Complex64 {
    let (mut lanes_re, mut lanes_im) = ([0.0; LANES], [0.0; LANES]);
    let mut add = |lane: usize, re: f64, im: f64, u: f64, v: f64| {
        lanes_re[lane] += re * u - im * v;
        lanes_im[lane] += re * v + im * u;
    };
    let (re_chunks, re_rest) = re.as_chunks::<LANES>();
    let (im_chunks, im_rest) = im.as_chunks::<LANES>();
    let (u_chunks, v_chunks) = (by.re.as_chunks::<LANES>().0, by.im.as_chunks::<LANES>().0);
    for (((re, im), u), v) in re_chunks.iter().zip(im_chunks).zip(u_chunks).zip(v_chunks) {
        for k in 0..LANES {
            add(k, re[k], im[k], u[k], v[k]);
        }
    }
    let done = re.len() - re_rest.len();
    for k in 0..re_rest.len() {
        add(k, re_rest[k], im_rest[k], by.re[done + k], by.im[done + k]);
    }
    Complex64::new(lanes_re.iter().sum(), lanes_im.iter().sum())
}
