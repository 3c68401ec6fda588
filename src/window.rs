//! Moments of moving windows: pixels within a radius of an output pixel, transported to its centre and summed.
//!
//! Works from north to south, holding pixel moments only for the rings that the windows of the present output rings
//! reach. What a window's moments mean is left to whoever visits them.

use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

use longan_formats::Healpix;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::cells;
use crate::contour::Field;
use crate::moments::{self, Layout, RingMoments, Selection};
use crate::transport::{Phases, Powers, RingTransport};

/// Rings of input moments that are made at a time, at least.
const BAND: usize = 128;

/// Pixels transported at a time.
const BLOCK: usize = 32;

/// Moments of one window, the mean over the thresholds; nothing is rescaled for masked pixels.
#[derive(Clone, Debug, Default)]
pub struct Moments {
    /// Colatitude and longitude of the window's centre in radians.
    pub centre: (f64, f64),
    /// Share of the window's cells that are masked; 1 for a window without pixels.
    pub masked_fraction: f64,
    /// W0 in steradian; 0 unless selected, as the following.
    pub area: f64,
    /// W1 in radians.
    pub length: f64,
    /// W2 in radians.
    pub curvature: f64,
    /// ψ_s for the ranks selected.
    pub psi: Vec<Complex64>,
}

/// Visits the windows of radius `radius` (radians; 0: the input pixel itself) about all pixels of `output`.
///
/// `visit` fills `columns` numbers for each; they are returned column by column, in RING order. `progress` is told the
/// share done, from 0 to 1. The result does not depend on the number of threads.
///
/// # Panics
/// For radius 0 if the output grid is not the input's.
pub fn windows(
    field: &Field<'_>,
    selection: &Selection,
    output: Healpix,
    radius: f64,
    columns: usize,
    visit: impl Fn(&Moments, &mut [f64]) + Sync,
    mut progress: impl FnMut(f64),
) -> Vec<Vec<f64>> {
    assert!(radius > 0.0 || output == field.grid(), "a window of one pixel needs the input's grid");
    let layout = Layout::new(selection, field.has_masked());
    let input = field.grid();
    let mut out = vec![Vec::with_capacity(output.pixels()); columns];
    let mut band = Band { first: 1, rings: VecDeque::new() };
    let mut next = 1;
    while next <= output.rings() {
        // As many output rings as make a band of input rings.
        let first = next;
        let mut reach = rings_within(input, output, first, radius);
        let lowest = reach.end + BAND;
        while next < output.rings() && rings_within(input, output, next + 1, radius).end <= lowest {
            next += 1;
            reach.end = reach.end.max(rings_within(input, output, next, radius).end);
        }
        next += 1;
        band.advance(field, &layout, reach);
        let quadrants: Vec<Vec<f64>> = (4 * first..4 * next)
            .into_par_iter()
            .map(|i| {
                let ring = OutputRing::new(input, output, i / 4, radius);
                ring.quadrant(i % 4, &band, &layout, field.thresholds(), columns, &visit)
            })
            .collect();
        for quadrant in &quadrants {
            for (column, out) in out.iter_mut().enumerate() {
                out.extend(quadrant.iter().skip(column).step_by(columns));
            }
        }
        let done = output.ring(next - 1);
        progress((done.start + done.len) as f64 / output.pixels() as f64);
    }
    out
}

/// The input rings that windows about an output ring may reach.
fn rings_within(input: Healpix, output: Healpix, ring: usize, radius: f64) -> Range<usize> {
    if radius == 0.0 {
        return ring..ring + 1;
    }
    let theta = output.ring(ring).theta();
    let first_south_of = |theta: f64| {
        let (mut north, mut south) = (1, input.rings() + 1);
        while north < south {
            let middle = (north + south) / 2;
            if input.ring(middle).theta() < theta { north = middle + 1 } else { south = middle }
        }
        north
    };
    // One ring more on each side: which pixels are in the window is decided for each ring.
    let (north, south) = (first_south_of(theta - radius), first_south_of(theta + radius));
    north.saturating_sub(1).max(1)..(south + 1).min(input.rings() + 1)
}

/// Pixel moments of consecutive rings.
struct Band {
    first: usize,
    rings: VecDeque<RingMoments>,
}

impl Band {
    /// Drops the rings north of `reach` and adds those that are missing in the south.
    fn advance(&mut self, field: &Field<'_>, layout: &Layout, reach: Range<usize>) {
        while self.first < reach.start && self.rings.pop_front().is_some() {
            self.first += 1;
        }
        self.first = self.first.max(reach.start);
        let have = self.first + self.rings.len();
        if have >= reach.end {
            return;
        }
        let missing = reach.end - have;
        let chunk = missing.div_ceil(2 * rayon::current_num_threads()).clamp(8, 64);
        let made: Vec<Vec<RingMoments>> = (0..missing.div_ceil(chunk))
            .into_par_iter()
            .map(|i| {
                let start = have + i * chunk;
                moments::at_pixels(field, layout, start..(start + chunk).min(reach.end))
            })
            .collect();
        self.rings.extend(made.into_iter().flatten());
    }

    fn ring(&self, i: usize) -> &RingMoments {
        &self.rings[i - self.first]
    }
}

/// What the windows about one output ring have in common.
struct OutputRing {
    output: Healpix,
    ring: usize,
    input: Healpix,
    reached: Vec<Reached>,
}

/// An input ring that windows about an output ring reach.
struct Reached {
    ring: usize,
    len: usize,
    /// Twice the longitude of the first pixel, in pixels.
    shift: usize,
    /// Largest |Δφ| within the window, in radians; π or more for the whole ring.
    half_width: f64,
    transport: RingTransport,
    /// cos and sin of k pixels' longitude, k < BLOCK.
    steps: [Complex64; BLOCK],
}

impl OutputRing {
    fn new(input: Healpix, output: Healpix, ring: usize, radius: f64) -> Self {
        let centre = output.ring(ring);
        let reached = rings_within(input, output, ring, radius).filter_map(|i| {
            let r = input.ring(i);
            // sin²(d/2) = sin²((θ_x − θ_w)/2) + sin θ_x sin θ_w sin²(Δφ/2), free of cancellation.
            let beyond = (radius / 2.0).sin().powi(2) - ((r.theta() - centre.theta()) / 2.0).sin().powi(2);
            let sin_sq = beyond / (r.sin_theta * centre.sin_theta);
            if sin_sq < 0.0 {
                return None;
            }
            let half_width = if sin_sq < 1.0 { 2.0 * sin_sq.sqrt().asin() } else { PI };
            let step = TAU / r.len as f64;
            Some(Reached {
                ring: i,
                len: r.len,
                shift: usize::from(r.shifted),
                half_width,
                transport: RingTransport::new((r.sin_theta, r.cos_theta), (centre.sin_theta, centre.cos_theta)),
                steps: std::array::from_fn(|k| Complex64::cis(k as f64 * step)),
            })
        });
        OutputRing { output, ring, input, reached: if radius == 0.0 { Vec::new() } else { reached.collect() } }
    }

    /// Windows about the pixels of one quadrant of the ring. Longitudes are counted from the quadrant's own meridian,
    /// so that a field turned by 90° gives the same windows to the last bit.
    fn quadrant(
        &self,
        quadrant: usize,
        band: &Band,
        layout: &Layout,
        thresholds: usize,
        columns: usize,
        visit: impl Fn(&Moments, &mut [f64]),
    ) -> Vec<f64> {
        let ring = self.output.ring(self.ring);
        let in_quadrant = ring.len / 4;
        let mut out = vec![0.0; in_quadrant * columns];
        let mut sums = vec![0.0; layout.rows];
        let mut moments = Moments::default();
        for (k, out) in out.chunks_exact_mut(columns).enumerate() {
            sums.fill(0.0);
            let mut shares = 0;
            let phi = ring.phi(k as isize);
            let column = quadrant * in_quadrant + k;
            if self.reached.is_empty() {
                shares += self.shares(self.ring, column..column + 1);
                for (row, sum) in sums.iter_mut().enumerate() {
                    *sum = band.ring(self.ring).row(row)[column];
                }
            }
            for reached in &self.reached {
                for (columns, dphi) in reached.columns(phi, quadrant) {
                    shares += self.shares(reached.ring, columns.clone());
                    add(band.ring(reached.ring), layout, columns, dphi, reached, &mut sums);
                }
            }
            moments.centre = (ring.theta(), ring.phi(column as isize));
            moments.masked_fraction = match (shares, layout.masked) {
                (0, _) => 1.0,
                (_, Some(row)) => sums[row] / shares as f64,
                (_, None) => 0.0,
            };
            sums.iter_mut().for_each(|sum| *sum /= thresholds as f64);
            let selected = |row: Option<usize>| row.map_or(0.0, |row| sums[row]);
            moments.area = selected(layout.area);
            moments.length = selected(layout.length);
            moments.curvature = selected(layout.curvature);
            moments.psi.clear();
            moments.psi.extend(sums[layout.first_rank..].chunks_exact(2).map(|p| Complex64::new(p[0], p[1])));
            visit(&moments, out);
        }
        out
    }

    /// Cell shares of these pixels, in twelfths of a cell.
    fn shares(&self, ring: usize, columns: Range<usize>) -> usize {
        12 * columns.len() + cells::triangles(self.input, ring, columns)
    }
}

impl Reached {
    /// The pixels within the window about longitude `phi` (of the first quadrant), moved on by `quadrant`s: at most two
    /// ranges of columns, each with its first pixel's Δφ.
    fn columns(&self, phi: f64, quadrant: usize) -> impl Iterator<Item = (Range<usize>, f64)> + use<> {
        let (len, step) = (self.len as isize, TAU / self.len as f64);
        let first_phi = self.shift as f64 * step / 2.0;
        let (mut from, mut to) = (0, len);
        if self.half_width < PI {
            from = ((phi - self.half_width - first_phi) / step).ceil() as isize;
            to = ((phi + self.half_width - first_phi) / step).floor() as isize + 1;
            to = to.clamp(from, from + len);
        }
        let at = (from + quadrant as isize * len / 4).rem_euclid(len);
        let before_end = (to - from).min(len - at);
        let dphi = |j: isize| (2 * j + self.shift as isize) as f64 * (step / 2.0) - phi;
        [
            (at as usize..(at + before_end) as usize, dphi(from)),
            (0..(to - from - before_end) as usize, dphi(from + before_end)),
        ]
        .into_iter()
        .filter(|(columns, _)| !columns.is_empty())
    }
}

/// Adds the moments of a range of pixels of a ring, transported; the first pixel lies `dphi` east of the centre.
#[inline(never)]
fn add(ring: &RingMoments, layout: &Layout, columns: Range<usize>, dphi: f64, reached: &Reached, sums: &mut [f64]) {
    for (row, sum) in sums[..layout.first_rank].iter_mut().enumerate() {
        *sum += ring.row(row)[columns.clone()].iter().sum::<f64>();
    }
    if layout.ranks.is_empty() {
        return;
    }
    let step = TAU / reached.len as f64;
    for start in columns.clone().step_by(BLOCK) {
        let base = Complex64::cis(dphi + (start - columns.start) as f64 * step);
        let mut phases = Phases::<BLOCK>::default();
        for k in 0..BLOCK {
            let dphi = base * reached.steps[k];
            let phase = reached.transport.phase(dphi.re, dphi.im);
            (phases.re[k], phases.im[k]) = (phase.re, phase.im);
        }
        let end = (start + BLOCK).min(columns.end);
        let mut powers = Powers::new(phases);
        for (i, &rank) in layout.ranks.iter().enumerate() {
            let row = layout.first_rank + 2 * i;
            let (re, im) = (&ring.row(row)[start..end], &ring.row(row + 1)[start..end]);
            let power = powers.raise(rank);
            let (mut sum_re, mut sum_im) = (0.0, 0.0);
            for (((re, im), u), v) in re.iter().zip(im).zip(&power.re).zip(&power.im) {
                sum_re += re * u - im * v;
                sum_im += re * v + im * u;
            }
            sums[row] += sum_re;
            sums[row + 1] += sum_im;
        }
    }
}
