//! What a file is said to hold.

use longan_formats::{AxisDescription, DimensionDescription, GridDescription, TablePlace, describe};

use crate::*;

fn axis(count: usize, first: f64, last: f64, spacing: Option<f64>) -> AxisDescription {
    AxisDescription { count, first, last, spacing }
}

#[test]
fn variables_and_their_dimensions() {
    let mut file = plain();
    file.dimensions.extend([("time".to_owned(), 3), ("level".to_owned(), 2), ("member".to_owned(), 2)]);
    let units = [("units", text("days since 2000-02-28"))];
    file.variables.push(var("time", &["time"], Data::F64(vec![0.0, 1.5, 3.0]), &units));
    file.variables.push(var("level", &["level"], Data::F32(vec![0.1, 500.0]), &[("units", text("hPa"))]));
    let values = Data::F32(vec![0.0; 3 * 2 * 2 * LATITUDES * LONGITUDES]);
    file.variables.push(var("g/u", &["time", "level", "member", "lat", "lon"], values, &[]));
    let description = describe(&file.scratch().path).unwrap();
    assert_eq!(description.format, "NetCDF");
    let [t, u] = &description.tables[..] else { panic!("{:?}", description.tables) };
    assert_eq!(t.place, TablePlace::Variable { variable: "t".into() });
    assert_eq!(u.place, TablePlace::Variable { variable: "g/u".into() });
    let grid = GridDescription::LatLon {
        latitudes: axis(18, -85.0, 85.0, Some(10.0)),
        longitudes: axis(36, 0.0, 350.0, Some(10.0)),
        global: true,
    };
    assert_eq!([&t.grid, &u.grid], [&grid, &grid]);
    assert!(t.dimensions.is_empty());
    let dimension = |name: &str, len, time, values: &str| DimensionDescription {
        name: name.into(),
        len,
        time,
        values: values.into(),
    };
    let dimensions = [
        dimension("time", 3, true, "2000-02-28 to 2000-03-02"),
        dimension("level", 2, false, "0.1, 500 (hPa)"),
        dimension("member", 2, false, "#0 to #1"),
    ];
    assert_eq!(u.dimensions, dimensions);
    let field = &t.fields[0];
    assert_eq!((field.name.as_str(), field.unit.as_deref()), ("t", Some("K")));
    assert_eq!(field.long_name.as_deref(), Some("Temperature"));
    let json = serde_json::to_value(&description).unwrap();
    assert_eq!(json["tables"][1]["variable"], "g/u");
    assert_eq!(json["tables"][1]["latitudes"]["spacing"], 10.0);
    assert_eq!(json["tables"][1]["dimensions"][0]["values"], "2000-02-28 to 2000-03-02");
}

#[test]
fn grids() {
    let described = |file: &Nc| describe(&file.scratch().path).unwrap().tables[0].grid.clone();
    // Across 360, and upside down.
    let mut file = plain();
    file.var("lon").data = Data::F64((0..LONGITUDES).map(|c| (100.0 + 10.0 * c as f64) % 360.0).collect());
    file.var("lat").data = Data::F64((0..LATITUDES).rev().map(latitude).collect());
    let expected = GridDescription::LatLon {
        latitudes: axis(18, 85.0, -85.0, Some(10.0)),
        longitudes: axis(36, 100.0, 90.0, Some(10.0)),
        global: true,
    };
    assert_eq!(described(&file), expected);
    // A region, unevenly spaced.
    file.var("lat").data = Data::F64((0..LATITUDES).map(|r| 0.2 * (r * r) as f64).collect());
    file.var("lon").data = Data::F64((0..LONGITUDES).map(|c| c as f64).collect());
    let expected = GridDescription::LatLon {
        latitudes: axis(18, 0.0, 0.2 * 289.0, None),
        longitudes: axis(36, 0.0, 35.0, Some(1.0)),
        global: false,
    };
    assert_eq!(described(&file), expected);
}
