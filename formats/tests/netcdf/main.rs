//! Fields on grids of latitude and longitude in NetCDF files. The files are made in [`inputs`], with libnetcdf.

mod broken;
mod described;
#[path = "../support/errors.rs"]
mod errors;
mod inputs;
mod layouts;
mod paths;
mod real_data;
mod selections;

use std::path::Path;

use longan_formats::{At, Error, Field, Place, Selection};
use longan_grid::Map;

use errors::{grid, is};

use inputs::{Data, Nc, text, var};

/// Latitudes from the south and longitudes from 0 of the test field, both at every 10 degrees.
const LATITUDES: usize = 18;
const LONGITUDES: usize = 36;

fn latitude(row: usize) -> f64 {
    -85.0 + 10.0 * row as f64
}

/// The field at a row from the south and a column from longitude 0, in units of 0.5 from 0 to 200; missing at some
/// places.
fn units(row: usize, column: usize) -> Option<i64> {
    let missing = (row * 5 + column * 3).is_multiple_of(23);
    (!missing).then(|| ((row * row * 7 + column * 11) % 201) as i64)
}

/// The field's values.
fn value(row: usize, column: usize) -> f64 {
    units(row, column).map_or(f64::NAN, |units| 3.0 + 0.5 * units as f64)
}

/// The field in double precision, latitudes upwards, longitudes from 0.
fn plain() -> Nc {
    let values = (0..LATITUDES).flat_map(|row| (0..LONGITUDES).map(move |column| value(row, column))).collect();
    let longitudes = (0..LONGITUDES).map(|column| 10.0 * column as f64).collect();
    Nc::new(
        &[("lat", LATITUDES), ("lon", LONGITUDES)],
        vec![
            var(
                "lat",
                &["lat"],
                Data::F64((0..LATITUDES).map(latitude).collect()),
                &[("units", text("degrees_north"))],
            ),
            var("lon", &["lon"], Data::F64(longitudes), &[("units", text("degrees_east"))]),
            var("t", &["lat", "lon"], Data::F64(values), &[("units", text("K")), ("long_name", text("Temperature"))]),
        ],
    )
}

fn read(path: &Path) -> Result<Map, Error> {
    longan_formats::read(path, &Selection::default())
}

fn variable(name: &str) -> Selection {
    Selection { field: Some(Field::Name(name.to_owned())), ..Selection::default() }
}

/// A selection of places: `level=500`, `time=#3`.
fn at(places: &[&str]) -> Selection {
    let one = |text: &&str| {
        let (dimension, place) = text.split_once('=').unwrap();
        let place = match place.strip_prefix('#') {
            Some(index) => Place::Index(index.parse().unwrap()),
            None => Place::Value(place.to_owned()),
        };
        At { dimension: dimension.to_owned(), place }
    };
    Selection { at: places.iter().map(one).collect(), ..Selection::default() }
}

/// The error, and its sentence without the file's name.
#[track_caller]
fn problem<T>(result: Result<T, Error>) -> (Error, String) {
    let Err(error) = result else { panic!("no error") };
    let path = error.path().expect("an error that names the file");
    let told = error.problem().to_string();
    assert!(!told.contains('\n') && !told.ends_with('.') && !told.contains(&path.display().to_string()), "{told}");
    (error, told)
}

/// Asserts that two maps are the same but for rounding, and NaN in the same places.
#[track_caller]
fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (p, (f, e)) in found.iter().zip(expected).enumerate() {
        let close = (f - e).abs() <= 1e-12 * e.abs();
        assert!(close || f.is_nan() && e.is_nan(), "pixel {p}: {f} instead of {e}");
    }
}
