//! Files as other programs write them, compared with what xarray and netCDF4-python read in them.

use std::path::PathBuf;

use longan_formats::{ErrorKind, GridDescription, describe, open};

use crate::*;

/// A file of the folder that LONGAN_SHARED names.
fn shared(name: &str) -> Option<PathBuf> {
    Some(longan_support::shared()?.join("data").join(name))
}

/// The values of the first step, and its date.
fn first(path: &Path, selection: &Selection) -> (Vec<f64>, Option<String>) {
    let mut maps = open(path, selection).unwrap();
    let label = maps.times().first().map(|time| time.label.clone());
    (maps.values(0).unwrap(), label)
}

/// The extremes and the mean of what is not missing.
fn summary(values: &[f64]) -> [f64; 3] {
    let valid: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
    let extreme = |f: fn(f64, f64) -> f64| valid.iter().copied().reduce(f).unwrap();
    [extreme(f64::min), extreme(f64::max), valid.iter().sum::<f64>() / valid.len() as f64]
}

#[track_caller]
fn assert_near(found: &[f64], expected: &[f64]) {
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= 1e-12 * e.abs(), "{found:?} instead of {expected:?}");
    }
}

#[test]
fn era_interim() {
    let Some(path) = shared("eraint_uvz.nc") else { return };
    let selection = Selection { field: Some(Field::Name("z".into())), ..at(&["level=500", "month=1"]) };
    let (values, label) = first(&path, &selection);
    assert_eq!((values.len(), label), (241 * 480, None));
    assert_near(&summary(&values), &[49169.8438701703, 57693.20458707197, 53882.10198470176]);
    assert_near(&[values[0], values[120 * 480 + 240]], &[49723.57768723677, 57434.45046694745]);

    let (error, told) = problem(longan_formats::read(&path, &Selection::default()));
    assert!(is(&error, ErrorKind::Ambiguous, "there are several variables"), "{told}");
    assert!(told.contains("'z' in m**2 s**-2 with dimensions month (2), level (3)"), "{told}");
    let (_, told) = problem(longan_formats::read(&path, &variable("z")));
    assert!(told.contains("'month': 1, 7;"), "{told}");

    let map = longan_formats::read(&path, &Selection { nside: Some(16), ..selection }).unwrap();
    assert_eq!((map.name.as_str(), map.unit.as_deref()), ("z", Some("m**2 s**-2")));
    let [least, most, _] = summary(map.values());
    assert!(least > 49169.8 && most < 57693.3 && map.values().iter().all(|v| !v.is_nan()));
    let tables = describe(&path).unwrap().tables;
    assert!(tables.iter().all(|table| matches!(table.grid, GridDescription::LatLon { global: true, .. })));
}

#[test]
fn geopotential_height() {
    let Some(path) = shared("hgt_djf.nc") else { return };
    let mut maps = open(&path, &Selection::default()).unwrap();
    let labels: Vec<_> = maps.times().iter().map(|time| time.label.as_str()).collect();
    assert_eq!(labels.len(), 65);
    assert_eq!([labels[0], labels[1], labels[64]], ["1948-01-15T12:00", "1949-01-15", "2012-01-15T12:00"]);
    let values = maps.values(0).unwrap();
    assert_near(&summary(&values)[..2], &[4947.516699218751, 5851.1000813802075]);
    assert_near(&[maps.values(3).unwrap()[0]], &[5829.266574435764]);
    let map = maps.read(64).unwrap();
    assert_eq!(map.time.unwrap().label, "2012-01-15T12:00");
}

#[test]
fn sea_surface_temperature() {
    let Some(path) = shared("sst_ndjfm_anom.nc") else { return };
    let (values, label) = first(&path, &at(&["time=1998"]));
    assert_eq!(label.as_deref(), Some("1998-01-15T12:00"));
    assert_near(&summary(&values), &[-1.662470305992278, 4.315390855271295, 0.5152632464163469]);
    assert_eq!(values.iter().filter(|v| v.is_nan()).count(), 90);
    let map = longan_formats::read(&path, &at(&["time=1998-01"])).unwrap();
    // The region's part of the sphere is 0.15, and some of it is land.
    let valid = map.values().iter().filter(|v| !v.is_nan()).count() as f64 / map.values().len() as f64;
    assert!((0.1..0.3).contains(&valid), "{valid}");
    let maps = open(&path, &Selection::default()).unwrap();
    assert_eq!(maps.times().len(), 50);
    let table = &describe(&path).unwrap().tables[0];
    assert!(matches!(table.grid, GridDescription::LatLon { global: false, .. }));
    assert_eq!(table.dimensions[0].values, "1963-01-15T12:00 to 2012-01-16");
}
