//! What the gallery's figures show: bodies of the paper side by side, an El Niño-like field on the earth, a cell-like
//! surface.
//!
//! Run with `cargo run --release --example gallery FOLDER`, which writes `bodies.fits`, `enso.nc` and `cell.ply`;
//! `make gallery` does, and draws them.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use longan::Healpix;
use longan::simulate::{Body, Edge, Shape, Waves, shapes};
use longan_formats::{self as formats, Column, Extension, HealpixLayout, HealpixWriter};
use longan_grid::{Map, Ordering};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).ok_or("name a folder to write to")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    bodies(&folder.join("bodies.fits"))?;
    enso(&folder.join("enso.nc"))?;
    cell(&folder.join("cell.ply"))?;
    Ok(())
}

/// Six bodies in two rows about longitude 0, latitude 0, each 6° long but the square, of 4°; the distance to their edge
/// in degrees, so that the contour at 0 is the edge itself.
fn bodies(path: &Path) -> Result<(), Box<dyn Error>> {
    let body = |shape, lon, lat| Body::new(shape, lon, lat, if shape == Shape::Square { 4.0 } else { 6.0 }, 0.0);
    let bodies = [
        body(Shape::Square, -15.0, 8.0)?,
        body(Shape::Rectangle2, 0.0, 8.0)?,
        body(Shape::Rectangle3, 15.0, 8.0)?,
        body(Shape::Cross, -15.0, -8.0)?,
        body(Shape::Triangle, 0.0, -8.0)?,
        body(Shape::Parallelogram, 15.0, -8.0)?,
    ];
    let map = shapes(Healpix::new(512)?, &bodies, Edge::Smooth);
    let layout = HealpixLayout { grid: map.grid(), ordering: Ordering::Ring, coordinates: None, float32: false };
    let column = Column { name: "DISTANCE".into(), unit: "deg".into(), values: map.values().to_vec() };
    let table = Extension { name: "BODIES".into(), cards: Vec::new(), history: Vec::new(), columns: vec![column] };
    formats::save(path, true, |temporary| {
        let mut writer = HealpixWriter::create(temporary, layout)?;
        writer.append(&table)?;
        writer.finish()
    })?;
    Ok(())
}

/// Anomalies of temperature as in an El Niño winter, on a grid of 1°: a warm tongue along the equator of the eastern
/// Pacific, a cold horseshoe about it in the west, and weather.
fn enso(path: &Path) -> Result<(), Box<dyn Error>> {
    let weather = Waves::new(7.0, 4)?.map(Healpix::new(128)?);
    let latitudes: Vec<f64> = (0..180).map(|i| f64::from(i) - 89.5).collect();
    let longitudes: Vec<f64> = (0..360).map(|i| f64::from(i) + 0.5).collect();
    let mut anomalies = Vec::new();
    for lat in &latitudes {
        for lon in &longitudes {
            let east = 1.0 / (1.0 + ((185.0 - lon) / 12.0).exp()) / (1.0 + ((lon - 278.0) / 4.0).exp());
            let tongue = 2.6 * east * (-(lat / 7.0).powi(2)).exp();
            let arm = (-((lat.abs() - 0.6 * (lon - 130.0)) / 8.0).powi(2) - ((lon - 155.0) / 22.0).powi(2)).exp();
            anomalies.push((tongue - 1.1 * arm + 0.35 * at(&weather, *lat, *lon)) as f32);
        }
    }
    let mut file = netcdf::create(path)?;
    for (name, unit, values) in [("lat", "degrees_north", latitudes), ("lon", "degrees_east", longitudes)] {
        file.add_dimension(name, values.len())?;
        let mut axis = file.add_variable::<f64>(name, &[name])?;
        axis.put_values(&values, ..)?;
        axis.put_attribute("units", unit)?;
    }
    let mut variable = file.add_variable::<f32>("t2m", &["lat", "lon"])?;
    variable.put_values(&anomalies, ..)?;
    variable.put_attribute("long_name", "temperature anomaly")?;
    variable.put_attribute("units", "K")?;
    Ok(())
}

/// A closed, bumpy surface with patches of a signal, as a microscope sees them on a cell.
fn cell(path: &Path) -> Result<(), Box<dyn Error>> {
    let (bumps, patches) = (Waves::new(25.0, 2)?.map(Healpix::new(64)?), Waves::new(9.0, 3)?.map(Healpix::new(128)?));
    // Rings of vertices, and one vertex at each pole.
    let (rings, columns) = (89, 180);
    let mut places = vec![(90.0, 0.0)];
    for ring in 1..=rings {
        places.extend((0..columns).map(|column| (90.0 - 2.0 * f64::from(ring), 2.0 * f64::from(column))));
    }
    places.push((-90.0, 0.0));
    let at_ring = |ring: i32, column: i32| match ring {
        0 => 0,
        _ if ring > rings => 1 + rings * columns,
        _ => 1 + (ring - 1) * columns + column % columns,
    };
    let mut triangles = Vec::new();
    for ring in 0..=rings {
        for column in 0..columns {
            let [a, b] = [at_ring(ring, column), at_ring(ring, column + 1)];
            let [c, d] = [at_ring(ring + 1, column), at_ring(ring + 1, column + 1)];
            triangles.extend([[a, c, d], [a, d, b]].into_iter().filter(|[p, q, r]| p != q && q != r && r != p));
        }
    }
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float signal\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        places.len(),
        triangles.len()
    );
    for (lat, lon) in places {
        let radius = 6.0 * (1.0 + 0.08 * at(&bumps, lat, lon));
        let signal = (1.5 * at(&patches, lat, lon)).exp();
        let ((sin_lat, cos_lat), (sin_lon, cos_lon)) = (f64::to_radians(lat).sin_cos(), f64::to_radians(lon).sin_cos());
        let [x, y, z] = [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat].map(|x| radius * x);
        writeln!(text, "{x:.5} {y:.5} {z:.5} {signal:.5}")?;
    }
    for [a, b, c] in triangles {
        writeln!(text, "3 {a} {b} {c}")?;
    }
    Ok(std::fs::write(path, text)?)
}

/// The value of the pixel at a latitude and longitude in degrees.
fn at(map: &Map, lat: f64, lon: f64) -> f64 {
    map.values()[map.grid().pixel_at((90.0 - lat).to_radians(), lon.to_radians())]
}
