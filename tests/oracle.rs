//! The same definitions once more, as slowly and as literally as they can be written: global vectors, neighbours from
//! `cdshealpix`, the vector formula of transport, every window pixel by pixel. Nothing here is shared with the engine.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use cdshealpix::compass_point::MainWind::{E, NE, SE};
use longan::contour::Field;
use longan::moments::{Selection, Weight};
use longan::totals::totals;
use longan::window::{Moments, MovingWindows, Summation};
use longan::{Body, Healpix, Map, Thresholds};
use proptest::prelude::*;

type V = [f64; 3];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn sum(a: V, x: f64, b: V, y: f64) -> V {
    [a[0] * x + b[0] * y, a[1] * x + b[1] * y, a[2] * x + b[2] * y]
}
fn unit(a: V) -> V {
    sum(a, 1.0 / dot(a, a).sqrt(), a, 0.0)
}
fn angle(a: V, b: V) -> f64 {
    dot(cross(a, b), cross(a, b)).sqrt().atan2(dot(a, b))
}
fn triangle(a: V, b: V, c: V) -> f64 {
    2.0 * dot(a, cross(b, c)).atan2(1.0 + dot(a, b) + dot(b, c) + dot(c, a))
}

/// Position, south and east at a place.
fn frame((theta, phi): (f64, f64)) -> [V; 3] {
    let ((st, ct), (sp, cp)) = (theta.sin_cos(), phi.sin_cos());
    [[st * cp, st * sp, ct], [ct * cp, ct * sp, -st], [-sp, cp, 0.0]]
}

/// Angle at w of the tangent vector v at x.
fn transported(v: V, x: V, [w, south, east]: [V; 3]) -> f64 {
    let moved = sum(v, 1.0, sum(x, 1.0, w, 1.0), -dot(v, w) / (1.0 + dot(x, w)));
    dot(moved, east).atan2(dot(moved, south))
}

fn centres(depth: u8) -> Vec<(f64, f64)> {
    let layer = cdshealpix::nested::get(depth);
    let mut centres = vec![(0.0, 0.0); 12 << (2 * depth)];
    for h in 0..centres.len() as u64 {
        let (lon, lat) = layer.center(h);
        centres[layer.to_ring(h) as usize] = (FRAC_PI_2 - lat, lon);
    }
    centres
}

/// Corners of all cells, counter-clockwise from outside.
fn cells(depth: u8) -> Vec<Vec<usize>> {
    let layer = cdshealpix::nested::get(depth);
    let n = 12usize << (2 * depth);
    let mut cells: Vec<Vec<usize>> = (0..n as u64)
        .map(|h| {
            let around = layer.neighbours(h, false);
            let others = [SE, E, NE].iter().filter_map(|&w| around.get(w)).map(|&h| layer.to_ring(h) as usize);
            std::iter::once(layer.to_ring(h) as usize).chain(others).collect()
        })
        .collect();
    cells.push(vec![0, 1, 2, 3]);
    cells.push(vec![n - 1, n - 2, n - 3, n - 4]);
    cells
}

/// Where a contour crosses an edge: the point, the nearer corner of the cell, and the offset from there.
#[derive(Clone, Copy)]
struct Crossing {
    at: V,
    near: usize,
    offset: V,
}

impl Crossing {
    fn minus(self, other: Crossing) -> V {
        let [a, b] = if self.near == other.near { [self.offset, other.offset] } else { [self.at, other.at] };
        sum(a, 1.0, b, -1.0)
    }
}

/// Per window: masked fraction, area, length, curvature, then Re and Im ψ_s for s = 1…8.
const ROWS: usize = 4 + 16;

struct Case<'a> {
    depth: u8,
    values: &'a [f64],
    thresholds: &'a [f64],
    below: bool,
    by_turn: bool,
}

impl Case<'_> {
    /// Contributions to every pixel.
    fn at_pixels(&self) -> Vec<[f64; ROWS]> {
        let centres = centres(self.depth);
        // For each threshold and edge that the contour crosses: where, and the normals of the arriving and the leaving
        // segment.
        let mut vertices = BTreeMap::new();
        let mut pixels = vec![[0.0; ROWS]; self.values.len()];
        for cell in cells(self.depth) {
            let n = cell.len();
            let share = 1.0 / n as f64;
            let v: Vec<f64> = cell.iter().map(|&p| self.values[p]).collect();
            if v.iter().any(|v| v.is_nan()) {
                cell.iter().for_each(|&p| pixels[p][0] += 1.0);
                continue;
            }
            let x: Vec<V> = cell.iter().map(|&p| frame(centres[p])[0]).collect();
            for (level, &t) in self.thresholds.iter().enumerate() {
                let inside: Vec<bool> = v.iter().map(|&v| (v >= t) != self.below).collect();
                // Crossing of each edge that has one, with its nearer corner and the offset from there: what points close
                // together differ by is not lost in rounding.
                let crossing: Vec<Option<Crossing>> = (0..n)
                    .map(|i| {
                        let j = (i + 1) % n;
                        let (near, far) = if (t - v[i]).abs() <= (v[j] - t).abs() { (i, j) } else { (j, i) };
                        let q = ((t - v[near]) / (v[far] - v[near])).max(1e-6);
                        let a = q * angle(x[near], x[far]);
                        let towards = unit(sum(x[far], 1.0, x[near], -dot(x[near], x[far])));
                        let offset = sum(x[near], -2.0 * (a / 2.0).sin().powi(2), towards, a.sin());
                        let at = unit(sum(x[near], 1.0, offset, 1.0));
                        (inside[i] != inside[j]).then_some(Crossing { at, near, offset })
                    })
                    .collect();
                let mean_above = v.iter().sum::<f64>() / n as f64 > t;
                let saddle = crossing.iter().all(Option::is_some) && n == 4;
                // A saddle's body corners hang together if the middle is on their side.
                let joined = saddle && mean_above != self.below;
                let mut area = 0.0;
                let mut segments: Vec<(usize, usize)> = Vec::new();
                if saddle {
                    for i in (0..4).filter(|&i| inside[i] != joined) {
                        let before = (i + 3) % 4;
                        let piece = triangle(crossing[before].unwrap().at, x[i], crossing[i].unwrap().at);
                        area += if joined { -piece } else { piece };
                        segments.push(if joined { (before, i) } else { (i, before) });
                    }
                    if joined {
                        area += triangle(x[0], x[1], x[2]) + triangle(x[0], x[2], x[3]);
                    }
                } else {
                    let mut polygon: Vec<V> = Vec::new();
                    for i in 0..n {
                        if inside[i] {
                            polygon.push(x[i]);
                        }
                        polygon.extend(crossing[i].map(|crossing| crossing.at));
                    }
                    for i in 2..polygon.len() {
                        area += triangle(polygon[0], polygon[i - 1], polygon[i]);
                    }
                    let out = (0..n).find(|&i| inside[i] && crossing[i].is_some());
                    let back = (0..n).find(|&i| !inside[i] && crossing[i].is_some());
                    segments.extend(out.zip(back));
                }
                cell.iter().for_each(|&p| pixels[p][1] += share * area);
                for (from_edge, to_edge) in segments {
                    let (begin, end) = (crossing[from_edge].unwrap(), crossing[to_edge].unwrap());
                    let normal = unit(cross(end.at, begin.minus(end)));
                    let (from, to) = (begin.at, end.at);
                    let length = angle(from, to);
                    // The body lies to the left of the way from `from` to `to`.
                    for (edge, at, leaving) in [(from_edge, from, 1), (to_edge, to, 0)] {
                        let (a, b) = (cell[edge], cell[(edge + 1) % n]);
                        let vertex: &mut (V, [Option<V>; 2]) =
                            vertices.entry((level, [a.min(b), a.max(b)])).or_insert((at, [None; 2]));
                        vertex.1[leaving] = Some(normal);
                    }
                    let middle = unit(sum(from, 1.0, to, 1.0));
                    for &p in &cell {
                        pixels[p][2] += share * length;
                        let phi = transported(normal, middle, frame(centres[p]));
                        for s in (1..=8).filter(|_| !self.by_turn) {
                            pixels[p][2 + 2 * s] += share * length * (s as f64 * phi).cos();
                            pixels[p][3 + 2 * s] += share * length * (s as f64 * phi).sin();
                        }
                    }
                }
            }
        }
        for ((_, edge), (at, normals)) in vertices {
            let [Some(arriving), Some(leaving)] = normals else { continue };
            let exterior = dot(at, cross(arriving, leaving)).atan2(dot(arriving, leaving));
            for p in edge {
                pixels[p][3] += 0.5 * exterior;
                let phi = transported(arriving, at, frame(centres[p]));
                for s in (1..=8).filter(|_| self.by_turn) {
                    let (from, to) = (s as f64 * phi, s as f64 * (phi + exterior));
                    pixels[p][2 + 2 * s] += 0.5 * (to.sin() - from.sin()) / s as f64;
                    pixels[p][3 + 2 * s] -= 0.5 * (to.cos() - from.cos()) / s as f64;
                }
            }
        }
        pixels
    }

    fn windows(&self, output: &[(f64, f64)], radius: f64) -> Vec<[f64; ROWS]> {
        let centres = centres(self.depth);
        let pixels = self.at_pixels();
        output
            .iter()
            .map(|&centre| {
                let [w, south, east] = frame(centre);
                let (mut window, mut all) = ([0.0; ROWS], 0.0);
                for (p, &at) in centres.iter().enumerate() {
                    let [x, x_south, _] = frame(at);
                    if angle(x, w) > radius {
                        continue;
                    }
                    all += 4.0;
                    let delta = transported(x_south, x, [w, south, east]);
                    (0..4).for_each(|row| window[row] += pixels[p][row]);
                    for s in 1..=8 {
                        let (re, im) = (pixels[p][2 + 2 * s], pixels[p][3 + 2 * s]);
                        let (sin, cos) = (s as f64 * delta).sin_cos();
                        window[2 + 2 * s] += re * cos - im * sin;
                        window[3 + 2 * s] += re * sin + im * cos;
                    }
                }
                window[0] = if all > 0.0 { window[0] / all } else { 1.0 };
                window[1..].iter_mut().for_each(|v| *v /= self.thresholds.len() as f64);
                window
            })
            .collect()
    }
}

/// Largest difference between engine and oracle, relative to the largest length (for areas and fractions: absolute).
fn compare(case: &Case<'_>, output: usize, radius: f64) -> f64 {
    let grid = Healpix::new(1 << case.depth).unwrap();
    let out = Healpix::new(output).unwrap();
    let thresholds = Thresholds::new(case.thresholds.to_vec()).unwrap();
    let body = if case.below { Body::Below } else { Body::Above };
    let selection = Selection {
        area: true,
        length: true,
        curvature: true,
        ranks: (1..=8).collect(),
        weight: if case.by_turn { Weight::Curvature } else { Weight::Length },
        by_threshold: false,
    };
    let map = Map::new("", case.values.to_vec()).unwrap();
    let field = Field::new(grid, map.values(), &thresholds, body);
    let fast = MovingWindows {
        field: &field,
        selection: &selection,
        output: out,
        radii: &[radius],
        summation: Summation::Exact,
    }
    .visit(ROWS, |m, row| {
        row[..4].copy_from_slice(&[m.masked_fraction, m.area, m.length, m.curvature]);
        m.psi.iter().enumerate().for_each(|(i, p)| row[4 + 2 * i..][..2].copy_from_slice(&[p.re, p.im]));
    })
    .remove(0)
    .values
    .remove(0);
    let places: Vec<_> = (0..out.pixels()).map(|p| out.centre(p)).collect();
    let slow = case.windows(&places, radius);
    let mut worst: f64 = 0.0;
    for (p, slow) in slow.iter().enumerate() {
        for (row, want) in slow.iter().enumerate() {
            worst = worst.max((fast[[row, p]] - want).abs());
        }
    }
    worst
}

fn values(depth: u8, kind: u8, seed: u64) -> Vec<f64> {
    let map = longan_support::noise(1 << depth, [2, 4, 1000, 1_000_000][kind as usize % 4], seed);
    map.values().to_vec()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn windows_agree(
        depth in 0u8..4, kind in 0u8..4, seed in 0u64..1000, below: bool, by_turn: bool,
        holes in 0usize..20, output in 1usize..9, radius in 0.02f64..3.1, levels in 1usize..5,
    ) {
        let mut values = values(depth, kind, seed);
        if holes > 1 {
            values.iter_mut().enumerate().filter(|(p, _)| (p * 7 + seed as usize).is_multiple_of(2 * holes)).for_each(|(_, v)| *v = f64::NAN);
        }
        let top = values.iter().copied().fold(1.0, f64::max);
        // Whole numbers among them, which are values of the map.
        let thresholds: Vec<f64> = (0..levels).map(|i| (top * (i + 1) as f64 / levels as f64 * 2.0).round() / 2.0).collect();
        let mut distinct = thresholds.clone();
        distinct.dedup();
        let case = Case { depth, values: &values, thresholds: &distinct, below, by_turn };
        let worst = compare(&case, output, radius);
        prop_assert!(worst < 1e-10, "{worst:e}");
    }
}

#[test]
fn constant_maps_have_no_contour() {
    for (value, area) in [(1.0, 4.0 * std::f64::consts::PI), (0.0, 0.0)] {
        let values = vec![value; 192];
        let case = Case { depth: 2, values: &values, thresholds: &[1.0], below: false, by_turn: false };
        assert!(compare(&case, 2, 1.0) < 1e-13);
        let thresholds = Thresholds::new(vec![1.0]).unwrap();
        let field = Field::new(Healpix::new(4).unwrap(), &values, &thresholds, Body::Above);
        let total = totals(&field).0[0];
        assert!((total.area - area).abs() < 1e-12 && total.length == 0.0 && total.curvature == 0.0);
    }
}

#[test]
fn single_pixels_agree() {
    for depth in 0..4 {
        let values = values(depth, 2, 7);
        let case = Case { depth, values: &values, thresholds: &[400.0, 600.0], below: false, by_turn: false };
        // A window that reaches its own pixel only is the window of radius 0.
        assert!(compare(&case, 1 << depth, 1e-3) < 1e-12);
        let grid = Healpix::new(1 << depth).unwrap();
        let thresholds = Thresholds::new(vec![400.0, 600.0]).unwrap();
        let field = Field::new(grid, &values, &thresholds, Body::Above);
        let selection = Selection { length: true, ranks: vec![3], ..Selection::default() };
        let of = |radius| {
            let visit = |m: &Moments, out: &mut [f64]| out.copy_from_slice(&[m.length, m.psi[0].re]);
            MovingWindows {
                field: &field,
                selection: &selection,
                output: grid,
                radii: &[radius],
                summation: Summation::Exact,
            }
            .visit(2, visit)
            .remove(0)
            .values
            .remove(0)
            .into_raw_vec_and_offset()
            .0
        };
        assert!(longan_support::difference(&of(0.0), &of(1e-3)) < 1e-14);
    }
}
