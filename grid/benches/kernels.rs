//! The way to HEALPix from grids of latitude and longitude, points and surfaces, in one thread.
//!
//! `make kernels` runs them, `cargo bench -p longan-grid --bench kernels -- points` those whose name holds a word.

use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use longan_grid::{Gather, Healpix, LatLon, Method, Points, Regrid, Surface, Weights};
use ndarray::{Array1, Array2};

const METHODS: [(&str, Method); 3] =
    [("conservative", Method::Conservative), ("bilinear", Method::Bilinear), ("nearest", Method::Nearest)];

/// Something smooth.
fn value(latitude: f64, longitude: f64) -> f64 {
    (3.0 * latitude).sin() + latitude.cos() * (5.0 * longitude).cos()
}

/// A grid of 1° with a value in a hundred missing: the weights are made once, and applied to each field.
fn lat_lon(c: &mut Criterion) {
    let latitudes: Vec<f64> = (0..180).map(|i| f64::from(i) - 89.5).collect();
    let longitudes: Vec<f64> = (0..360).map(|i| f64::from(i) + 0.5).collect();
    let grid = LatLon::new(&latitudes, None, &longitudes, None).unwrap();
    let at = |i: usize| value(latitudes[i / 360].to_radians(), longitudes[i % 360].to_radians());
    let field: Vec<f64> = (0..180 * 360).map(|i| if i % 101 == 0 { f64::NAN } else { at(i) }).collect();
    let to = Healpix::new(128).unwrap();
    for (name, method) in METHODS {
        let mut group = c.benchmark_group(name);
        group.bench_function("weights", |b| b.iter(|| Weights::new(black_box(&grid), to, method).unwrap()));
        let weights = Weights::new(&grid, to, method).unwrap();
        group.bench_function("apply", |b| b.iter(|| weights.apply(black_box(&field), 0.5)));
    }
}

/// Ten thousand points along a spiral.
fn points(c: &mut Criterion) {
    let count = 10_000;
    let latitudes = Array1::from_shape_fn(count, |i| (1.0 - (2 * i + 1) as f64 / count as f64).asin().to_degrees());
    let longitudes =
        Array1::from_shape_fn(count, |i| (i as f64 * PI * (3.0 - 5f64.sqrt())).rem_euclid(TAU).to_degrees());
    let values = Array1::from_shape_fn(count, |i| value(latitudes[i].to_radians(), longitudes[i].to_radians()));
    let points = Points::from_degrees(longitudes.view(), latitudes.view(), values.view()).unwrap();
    let mut group = c.benchmark_group("points");
    for (name, gather) in
        [("mean", Gather::Mean), ("gaussian", Gather::Gaussian { fwhm: 4.0 }), ("nearest", Gather::Nearest)]
    {
        let regrid = Regrid { gather: Some(gather), ..Regrid::default() };
        group.bench_function(name, |b| b.iter(|| points.regrid(Some(32), black_box(&regrid)).unwrap()));
    }
}

/// A bumpy sphere of 16 000 vertices: rings, and one vertex at each pole.
fn surface(c: &mut Criterion) {
    let (rings, columns) = (89, 180);
    let vertices = rings * columns + 2;
    let place = |i: usize| match i {
        0 => (PI / 2.0, 0.0),
        _ if i == vertices - 1 => (-PI / 2.0, 0.0),
        _ => {
            let (ring, column) = ((i - 1) / columns + 1, (i - 1) % columns);
            (PI / 2.0 - PI * ring as f64 / (rings + 1) as f64, TAU * column as f64 / columns as f64)
        }
    };
    let positions = Array2::from_shape_fn((vertices, 3), |(i, axis)| {
        let (latitude, longitude) = place(i);
        let radius = 1.0 + 0.05 * value(latitude, longitude);
        radius * [latitude.cos() * longitude.cos(), latitude.cos() * longitude.sin(), latitude.sin()][axis]
    });
    let vertex = |ring: usize, column: usize| match ring {
        0 => 0,
        _ if ring > rings => vertices - 1,
        _ => 1 + (ring - 1) * columns + column % columns,
    };
    let squares = (0..=rings).flat_map(|ring| (0..columns).map(move |column| (ring, column)));
    let triangles: Vec<usize> = squares
        .flat_map(|(ring, column)| {
            let [a, b] = [vertex(ring, column), vertex(ring, column + 1)];
            let [c, d] = [vertex(ring + 1, column), vertex(ring + 1, column + 1)];
            [[a, c, d], [a, d, b]]
        })
        .filter(|[p, q, r]| p != q && q != r && r != p)
        .flatten()
        .collect();
    let triangles = Array2::from_shape_vec((triangles.len() / 3, 3), triangles).unwrap();
    let values = Array1::from_shape_fn(vertices, |i| value(place(i).0, place(i).1));
    let surface = Surface::new(positions.view(), triangles.view(), values.view()).unwrap();
    let regrid = Regrid::default();
    c.bench_function("surface", |b| b.iter(|| surface.regrid(Some(32), black_box(&regrid)).unwrap()));
}

fn short() -> Criterion {
    // A second thread would measure what else the machine does.
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
}

criterion_group! { name = kernels; config = short(); targets = lat_lon, points, surface }
criterion_main!(kernels);
