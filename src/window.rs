//! Moments of moving windows: pixels within a radius of an output pixel, transported to its centre and summed.
//!
//! Works from north to south, holding pixel moments only for the rings that the windows of the present output rings
//! reach. The sum over a window's pixels is taken one by one (`direct`), or ring by ring from prefix sums
//! (`prefix`), whichever costs less. What a window's moments mean is left to whoever visits them.

mod direct;
mod prefix;
mod reach;

use std::collections::VecDeque;
use std::ops::Range;

use longan_formats::Healpix;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::contour::Field;
use crate::moments::{self, Layout, RingMoments, SHARES, Selection};
use reach::{OutputRing, rings_within};

/// Rings of input moments that are made at a time, at least.
const BAND: usize = 128;

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

/// How windows are summed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Summation {
    /// Pixel by pixel.
    Exact,
    /// From prefix sums wherever that costs less and the phases of transport are met to this accuracy: then ψ_s is
    /// off by at most this share of the window's W1. Areas, lengths, curvatures and masked fractions stay exact.
    Tolerance(f64),
    /// The same, from prefix sums wherever that is accurate enough, whatever it costs.
    Prefix(f64),
}

impl Default for Summation {
    /// A tolerance of 10⁻⁷.
    fn default() -> Self {
        Summation::Tolerance(1e-7)
    }
}

/// Which way the windows of one radius were summed, counted in pairs of an output pixel and an input ring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ways {
    /// Pairs summed pixel by pixel.
    pub direct: usize,
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
    /// What was visited, column by column, in RING order.
    pub columns: Vec<Vec<f64>>,
    /// How it was summed.
    pub ways: Ways,
}

/// Visits the windows of each radius (radians; 0: the input pixel itself) about all pixels of `output`.
///
/// `visit` fills `columns` numbers for each window. `progress` is told the share done, from 0 to 1. The result does not
/// depend on the number of threads.
///
/// # Panics
/// For radius 0 if the output grid is not the input's.
#[allow(clippy::too_many_arguments)]
pub fn windows(
    field: &Field<'_>,
    selection: &Selection,
    output: Healpix,
    radii: &[f64],
    summation: Summation,
    columns: usize,
    visit: impl Fn(&Moments, &mut [f64]) + Sync,
    mut progress: impl FnMut(f64),
) -> Vec<Windows> {
    let input = field.grid();
    let largest = radii.iter().copied().fold(0.0, f64::max);
    assert!(!radii.contains(&0.0) || output == input, "a window of one pixel needs the input's grid");
    let layout = Layout::new(selection, field.has_masked());
    let empty = || vec![Vec::with_capacity(output.pixels()); columns];
    let mut out: Vec<Windows> = radii.iter().map(|_| Windows { columns: empty(), ways: Ways::default() }).collect();
    let mut band = Band { first: 1, rings: VecDeque::new() };
    let mut next = 1;
    while next <= output.rings() {
        // As many output rings as make a band of input rings.
        let first = next;
        let mut reach = rings_within(input, output, first, largest);
        let lowest = reach.end + BAND;
        while next < output.rings() && rings_within(input, output, next + 1, largest).end <= lowest {
            next += 1;
            reach.end = reach.end.max(rings_within(input, output, next, largest).end);
        }
        next += 1;
        band.advance(field, &layout, reach);
        for (&radius, out) in radii.iter().zip(&mut out) {
            let rings: Vec<OutputRing> =
                (first..next).into_par_iter().map(|i| OutputRing::new(input, output, i, radius)).collect();
            let groups = prefix::groups(&rings, &layout, radius, summation);
            let quadrants: Vec<(Vec<Sums>, Ways)> = (0..4 * groups.len())
                .into_par_iter()
                .map(|task| {
                    let (group, quadrant) = (&groups[task / 4], task % 4);
                    let rings = &rings[group.rings.clone()];
                    match &group.plan {
                        Some(plan) => prefix::sums(rings, quadrant, &band, &layout, plan),
                        None => direct_sums(rings, quadrant, &band, &layout, radius == 0.0),
                    }
                })
                .collect();
            for (group, quadrants) in groups.iter().zip(quadrants.chunks_exact(4)) {
                for (i, ring) in rings[group.rings.clone()].iter().enumerate() {
                    let values: Vec<Vec<f64>> = (0..4usize)
                        .into_par_iter()
                        .map(|q| visited(ring, q, &quadrants[q].0[i], &layout, field.thresholds(), columns, &visit))
                        .collect();
                    for values in values {
                        for (column, out) in out.columns.iter_mut().enumerate() {
                            out.extend(values.iter().skip(column).step_by(columns));
                        }
                    }
                }
                quadrants.iter().for_each(|(_, ways)| out.ways.add(*ways));
            }
        }
        let done = output.ring(next - 1);
        progress((done.start + done.len) as f64 / output.pixels() as f64);
    }
    out
}

impl Ways {
    fn add(&mut self, other: Ways) {
        self.direct += other.direct;
        self.prefix += other.prefix;
        self.error = self.error.max(other.error);
        self.terms = self.terms.max(other.terms);
    }
}

/// Windows of a quadrant of each output ring, pixel by pixel; `single`: of one pixel each.
fn direct_sums(rings: &[OutputRing], quadrant: usize, band: &Band, layout: &Layout, single: bool) -> (Vec<Sums>, Ways) {
    let sums = rings.iter().map(|ring| {
        if !single {
            return direct::sums(ring, quadrant, band, layout);
        }
        let mut sums = Sums::new(ring.in_quadrant, layout.rows);
        let moments = band.ring(ring.number);
        for k in 0..ring.in_quadrant {
            let column = quadrant * ring.in_quadrant + k;
            let sums = sums.of(k, 1);
            (0..layout.rows).for_each(|row| sums[row] = moments.row(row)[column]);
        }
        sums
    });
    let pairs = rings.iter().map(|ring| ring.in_quadrant * ring.reached.len()).sum();
    (sums.collect(), Ways { direct: pairs, ..Ways::default() })
}

/// What `visit` makes of the windows of a quadrant.
fn visited(
    ring: &OutputRing,
    quadrant: usize,
    sums: &Sums,
    layout: &Layout,
    thresholds: usize,
    columns: usize,
    visit: impl Fn(&Moments, &mut [f64]),
) -> Vec<f64> {
    let mut out = vec![0.0; ring.in_quadrant * columns];
    let mut moments = Moments::default();
    for (k, out) in out.chunks_exact_mut(columns).enumerate() {
        let sum = |row: usize| sums.data[k * sums.rows + row];
        let mean = |row: usize| sum(row) / thresholds as f64;
        let selected = |row: Option<usize>| row.map_or(0.0, mean);
        moments.centre = (ring.theta, ring.phi_of(quadrant * ring.in_quadrant + k));
        moments.masked_fraction = match (sums.pixels[k], layout.masked) {
            (0, _) => 1.0,
            (pixels, Some(row)) => sum(row) / (SHARES * pixels) as f64,
            (_, None) => 0.0,
        };
        moments.area = selected(layout.area);
        moments.length = selected(layout.length);
        moments.curvature = selected(layout.curvature);
        moments.psi.clear();
        let rows = (layout.first_rank..layout.rows).step_by(2);
        moments.psi.extend(rows.map(|row| Complex64::new(mean(row), mean(row + 1))));
        visit(&moments, out);
    }
    out
}

/// Sums over the windows about consecutive pixels.
struct Sums {
    rows: usize,
    /// The rows of each window.
    data: Vec<f64>,
    /// Number of pixels in each window.
    pixels: Vec<usize>,
}

impl Sums {
    fn new(windows: usize, rows: usize) -> Self {
        Sums { rows, data: vec![0.0; windows * rows], pixels: vec![0; windows] }
    }

    /// The rows of a window, to which this many pixels are to be added.
    fn of(&mut self, window: usize, pixels: usize) -> &mut [f64] {
        self.pixels[window] += pixels;
        &mut self.data[window * self.rows..(window + 1) * self.rows]
    }
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
