//! The engine's inner loops, each as bare as the public interface gives it, in one thread.
//!
//! `make kernels` runs them, `cargo bench -p longan --bench kernels -- contour` those whose name holds a word.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use longan::measures::find;
use longan::simulate::Waves;
use longan::window::Summation;
use longan::{Analysis, Healpix, Map, go_on};

/// A Gaussian field whose contours at the paper's 13 thresholds cross most cells.
fn field(nside: usize) -> Map {
    Waves::new(2.0, 1).unwrap().map(Healpix::new(nside).unwrap())
}

/// The field without a belt about the equator and one pixel in a hundred.
fn masked(map: &Map) -> Map {
    let grid = map.grid();
    let outside = |p: usize| (grid.centre(p).0.to_degrees() - 90.0).abs() < 10.0 || p.is_multiple_of(101);
    let value = |(p, &value): (usize, &f64)| if outside(p) { f64::NAN } else { value };
    Map::new("masked", map.values().iter().enumerate().map(value).collect()).unwrap()
}

/// The marching loop with the sink of totals: no moments, no windows.
fn contour(c: &mut Criterion) {
    let whole = field(128);
    let masked = masked(&whole);
    let analysis = Analysis::default();
    let mut group = c.benchmark_group("contour");
    for (name, map) in [("whole sky", &whole), ("masked", &masked)] {
        group.bench_function(name, |b| b.iter(|| analysis.totals(black_box(map)).unwrap()));
    }
}

/// The marching loop with the sink of moments at pixels: windows of 0 degrees are the pixels themselves.
fn moments(c: &mut Criterion) {
    let whole = field(128);
    let masked = masked(&whole);
    let analysis = Analysis { windows: vec![0.0], ..Analysis::default() };
    let mut group = c.benchmark_group("moments");
    for (what, names) in [("length and rank 2", &["evq"][..]), ("and curvature", &["evq", "w2"])] {
        let measures: Vec<_> = names.iter().map(|name| find(name).unwrap()).collect();
        for (sky, map) in [("whole sky", &whole), ("masked", &masked)] {
            let run = || analysis.minkowski_maps(black_box(map), &measures, go_on).unwrap();
            group.bench_function(format!("{what}, {sky}"), |b| b.iter(run));
        }
    }
}

/// Windows about so many pixels that their sums take nearly all the time.
fn windows(c: &mut Criterion) {
    let map = field(128);
    let evq = [find("evq").unwrap()];
    let mut group = c.benchmark_group("windows");
    for (name, summation, radius, nside_out) in [
        ("direct", Summation::Exact, 6.0, 32),
        ("prefix sums", Summation::Prefix(1e-7), 6.0, 64),
        ("prefix sums, 30 degrees", Summation::Prefix(1e-7), 30.0, 32),
    ] {
        let analysis = Analysis { windows: vec![radius], nside_out: Some(nside_out), summation, ..Analysis::default() };
        let run = || analysis.minkowski_maps(black_box(&map), &evq, go_on).unwrap();
        group.bench_function(name, |b| b.iter(run));
    }
}

fn short() -> Criterion {
    // A second thread would measure what else the machine does.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(3))
}

criterion_group! { name = kernels; config = short(); targets = contour, moments, windows }
criterion_main!(kernels);
