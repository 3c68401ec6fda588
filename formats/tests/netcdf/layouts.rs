//! The same field in every layout gives the same map.

use netcdf::AttributeValue;

use longan_grid::{Method, Regrid};

use crate::inputs::Format;
use crate::*;

/// What the field of [`plain`] is as a map.
fn expected() -> Map {
    read(&plain().scratch().path).unwrap()
}

#[track_caller]
fn assert_same(file: &Nc) {
    assert_close(read(&file.scratch().path).unwrap().values(), expected().values());
}

/// Rows from the south to the north, or the reverse.
fn rows(down: bool) -> Vec<usize> {
    if down { (0..LATITUDES).rev().collect() } else { (0..LATITUDES).collect() }
}

/// Columns from this one on, once around.
fn columns(first: usize) -> Vec<usize> {
    (0..LONGITUDES).map(|i| (first + i) % LONGITUDES).collect()
}

/// The field with its rows and columns in this order, longitudes as given by `degrees`.
fn ordered(rows: &[usize], columns: &[usize], degrees: impl Fn(usize) -> f64) -> Nc {
    let mut file = plain();
    file.var("lat").data = Data::F64(rows.iter().map(|&row| latitude(row)).collect());
    file.var("lon").data = Data::F64(columns.iter().map(|&column| degrees(column)).collect());
    let values = rows.iter().flat_map(|&row| columns.iter().map(move |&column| value(row, column)));
    file.var("t").data = Data::F64(values.collect());
    file
}

fn eastward(column: usize) -> f64 {
    10.0 * column as f64
}

#[test]
fn the_plain_one_is_right() {
    let nearest = Regrid { method: Some(Method::Nearest), ..Regrid::default() };
    let selection = Selection { nside: Some(16), regrid: nearest, ..Selection::default() };
    let map = longan_formats::read(&plain().scratch().path, &selection).unwrap();
    let mut compared = 0;
    for (pixel, &found) in map.values().iter().enumerate() {
        let (theta, phi) = map.grid().centre(pixel);
        let distance = |row: usize, column: usize| {
            let (lat, lon) = (latitude(row).to_radians(), eastward(column).to_radians());
            theta.cos() * lat.sin() + theta.sin() * lat.cos() * (phi - lon).cos()
        };
        let mut places: Vec<_> = (0..LATITUDES).flat_map(|row| (0..LONGITUDES).map(move |c| (row, c))).collect();
        places.sort_by(|a, b| distance(b.0, b.1).total_cmp(&distance(a.0, a.1)));
        // Half-way between points, either is right.
        if distance(places[0].0, places[0].1) - distance(places[1].0, places[1].1) > 1e-9 {
            let value = value(places[0].0, places[0].1);
            assert!(found == value || found.is_nan() && value.is_nan(), "pixel {pixel}: {found} instead of {value}");
            compared += 1;
        }
    }
    assert!(compared > map.values().len() / 2);
    assert_eq!((map.name.as_str(), map.unit.as_deref()), ("t", Some("K")));
    assert_eq!((map.long_name.as_deref(), map.coordinates, map.time.is_none()), (Some("Temperature"), None, true));
}

#[test]
fn any_order_and_start() {
    for down in [false, true] {
        let from_0 = columns(0);
        assert_same(&ordered(&rows(down), &from_0, eastward));
        let from_180 = columns(18);
        assert_same(&ordered(&rows(down), &from_180, |c| eastward(c) - if c >= 18 { 360.0 } else { 0.0 }));
        // Across 360, where longitudes jump to 0, and where they go on.
        assert_same(&ordered(&rows(down), &columns(7), eastward));
        assert_same(&ordered(&rows(down), &columns(7), |c| eastward(c) + if c < 7 { 360.0 } else { 0.0 }));
        // Westward.
        let westward: Vec<_> = columns(0).into_iter().rev().collect();
        assert_same(&ordered(&rows(down), &westward, eastward));
    }
}

#[test]
fn longitudes_before_latitudes() {
    let mut file = plain();
    let values = (0..LONGITUDES).flat_map(|column| (0..LATITUDES).map(move |row| value(row, column))).collect();
    let t = file.var("t");
    (t.dimensions, t.data) = (vec!["lon", "lat"], Data::F64(values));
    assert_same(&file);
    assert_close(
        &longan_formats::open(&file.scratch().path, &Selection::default()).unwrap().values(0).unwrap(),
        &longan_formats::open(&plain().scratch().path, &Selection::default()).unwrap().values(0).unwrap(),
    );
}

/// The field stored as `pack` has it.
fn stored(data: impl Fn(Vec<Option<i64>>) -> Data, attributes: &[(&'static str, AttributeValue)]) -> Nc {
    let mut file = plain();
    let all = (0..LATITUDES).flat_map(|row| (0..LONGITUDES).map(move |column| units(row, column))).collect();
    file.var("t").data = data(all);
    file.var("t").attributes.extend_from_slice(attributes);
    file
}

#[test]
fn any_packing() {
    let real = AttributeValue::Double;
    // From 0, signed with a negative scale, and beyond a signed byte.
    let short = |all: Vec<Option<i64>>| Data::I16(all.iter().map(|u| u.map_or(-999, |u| 100 - u as i16)).collect());
    let packed =
        [("scale_factor", real(-0.5)), ("add_offset", real(53.0)), ("_FillValue", AttributeValue::Short(-999))];
    assert_same(&stored(short, &packed));
    let missing = [packed[0].clone(), packed[1].clone(), ("missing_value", AttributeValue::Shorts(vec![5000, -999]))];
    assert_same(&stored(short, &missing));
    let valid = [packed[0].clone(), packed[1].clone(), ("valid_range", AttributeValue::Shorts(vec![-100, 100]))];
    assert_same(&stored(short, &valid));
    // The valid range of the unpacked values.
    let valid = [packed[0].clone(), packed[1].clone(), ("valid_min", real(3.0)), ("valid_max", real(103.0))];
    assert_same(&stored(short, &valid));
    let default = |all: Vec<Option<i64>>| Data::I16(all.iter().map(|u| u.map_or(-32767, |u| u as i16)).collect());
    let scaled = [("scale_factor", real(0.5)), ("add_offset", real(3.0))];
    assert_same(&stored(default, &scaled));

    let byte = |all: Vec<Option<i64>>| Data::U8(all.iter().map(|u| u.map_or(255, |u| u as u8)).collect());
    let [scale, offset] = scaled;
    assert_same(&stored(byte, &[scale.clone(), offset.clone(), ("_FillValue", AttributeValue::Uchar(255))]));
    let signed = |all: Vec<Option<i64>>| Data::I8(all.iter().map(|u| u.map_or(-1, |u| u as u8 as i8)).collect());
    let unsigned =
        [scale.clone(), offset.clone(), ("_Unsigned", text("true")), ("_FillValue", AttributeValue::Schar(-1))];
    assert_same(&stored(signed, &unsigned));
    let long = |all: Vec<Option<i64>>| Data::U64(all.iter().map(|u| u.map_or(1 << 40, |u| u as u64)).collect());
    assert_same(&stored(long, &[scale, offset, ("_FillValue", AttributeValue::Ulonglong(1 << 40))]));

    let single = |fill: f32| {
        move |all: Vec<Option<i64>>| Data::F32(all.iter().map(|u| u.map_or(fill, |u| 3.0 + 0.5 * u as f32)).collect())
    };
    assert_same(&stored(single(f32::NAN), &[]));
    assert_same(&stored(single(1e20), &[("missing_value", real(1e20))]));
    assert_same(&stored(single(-9.96921e36), &[("valid_min", AttributeValue::Float(0.0))]));
    assert_same(&stored(single(9.969_21e36), &[]));
}

#[test]
fn any_format() {
    let mut file = plain();
    for format in [Format::Classic, Format::Offset64, Format::Data64, Format::Netcdf4] {
        file.format = format;
        assert_same(&file);
    }
    file.format = Format::Netcdf4Classic;
    assert_same(&file);
}

#[test]
fn in_a_group() {
    // All of it in a group, and the coordinates in the root.
    let mut file = plain();
    file.var("t").path = "model/run 1/t".to_owned();
    assert_same(&file);
    for path in ["lat", "lon"] {
        file.var(path).path = format!("model/{path}");
    }
    file.dimensions.iter_mut().for_each(|(path, _)| *path = format!("model/{path}"));
    assert_same(&file);
    for name in ["t", "T", "model/run 1/t", "/model/run 1/t"] {
        let map = longan_formats::read(&file.scratch().path, &variable(name)).unwrap();
        assert_close(map.values(), expected().values());
    }
}

#[test]
fn within_other_dimensions() {
    // The field is that of the second time and the third level, all others are less by 1000.
    let mut file = plain();
    file.dimensions.extend([("time".to_owned(), 2), ("level".to_owned(), 3)]);
    let mut all = Vec::new();
    for (time, level) in (0..2).flat_map(|time| (0..3).map(move |level| (time, level))) {
        let less = if (time, level) == (1, 2) { 0.0 } else { 1000.0 };
        all.extend((0..LATITUDES).flat_map(|row| (0..LONGITUDES).map(move |column| value(row, column) - less)));
    }
    let t = file.var("t");
    (t.dimensions, t.data) = (vec!["time", "level", "lat", "lon"], Data::F64(all));
    let map = longan_formats::read(&file.scratch().path, &at(&["time=#1", "level=#2"])).unwrap();
    assert_close(map.values(), expected().values());
}

#[test]
fn coordinates_known_by_anything() {
    let known: [[&[(&'static str, &str)]; 2]; 6] = [
        [&[("units", "degree_N")], &[("units", "degreesE")]],
        [&[("units", "degreeN"), ("axis", "X")], &[("units", "DEGREES_EAST"), ("axis", "Y")]],
        [&[("standard_name", "latitude")], &[("standard_name", "longitude"), ("units", "degrees")]],
        [&[("axis", "Y")], &[("axis", "x")]],
        [&[("axis", "Y"), ("units", "degrees")], &[("axis", "X"), ("units", "\u{b0}")]],
        [&[], &[]],
    ];
    for (number, [latitude, longitude]) in known.into_iter().enumerate() {
        for names in [["lat", "lon"], ["Latitude", "Longitude"], ["y", "x"], ["dim_a", "dim_b"]] {
            if number == 5 && names[0] == "dim_a" {
                continue;
            }
            let mut file = plain();
            for ((name, attributes), new) in [("lat", latitude), ("lon", longitude)].into_iter().zip(names) {
                let coordinate = file.var(name);
                coordinate.attributes = attributes.iter().map(|(n, value)| (*n, text(value))).collect();
                (coordinate.path, coordinate.dimensions) = (new.to_owned(), vec![new]);
            }
            file.dimensions = vec![(names[0].to_owned(), LATITUDES), (names[1].to_owned(), LONGITUDES)];
            file.var("t").dimensions = names.to_vec();
            assert_same(&file);
        }
    }
    // Coordinates of another name than their dimensions.
    let mut file = plain();
    file.dimensions = vec![("j".to_owned(), LATITUDES), ("i".to_owned(), LONGITUDES)];
    file.var("lat").dimensions = vec!["j"];
    file.var("lon").dimensions = vec!["i"];
    file.var("t").dimensions = vec!["j", "i"];
    assert_same(&file);
    file.var("lat").attributes.clear();
    file.var("lon").attributes.clear();
    file.var("t").attributes.push(("coordinates", text("lat lon")));
    assert_same(&file);
}

#[test]
fn bounds_that_say_the_same_and_others() {
    let mut file = plain();
    file.dimensions.push(("bnds".to_owned(), 2));
    let lat_bnds = |width: f64| (0..LATITUDES).flat_map(|r| [latitude(r) - width, latitude(r) + width]).collect();
    let lon_bnds = (0..LONGITUDES).flat_map(|c| [eastward(c) - 5.0, eastward(c) + 5.0]).collect();
    file.variables.push(var("lat_bnds", &["lat", "bnds"], Data::F64(lat_bnds(5.0)), &[]));
    file.variables.push(var("lon_bnds", &["lon", "bnds"], Data::F64(lon_bnds), &[]));
    file.var("lat").attributes.push(("bounds", text("lat_bnds")));
    file.var("lon").attributes.push(("bounds", text("lon_bnds")));
    assert_same(&file);
    // Narrower cells leave gaps, which are not valid.
    file.var("lat_bnds").data = Data::F64(lat_bnds(2.0));
    let masked = |map: &Map| map.values().iter().filter(|v| v.is_nan()).count();
    let narrow = read(&file.scratch().path).unwrap();
    assert!(masked(&narrow) > 2 * masked(&expected()));
    // Bounds that are not there are none.
    file.var("lat").attributes.last_mut().unwrap().1 = text("nowhere");
    assert_same(&file);
}

#[test]
fn a_region() {
    // Rows 9 to 14, columns 3 to 11: the rest of the sphere is masked.
    let (some_rows, some_columns): (Vec<_>, Vec<_>) = ((9..15).collect(), (3..12).collect());
    let mut file = ordered(&some_rows, &some_columns, eastward);
    file.dimensions = vec![("lat".to_owned(), 6), ("lon".to_owned(), 9)];
    let selection = Selection { nside: Some(8), ..Selection::default() };
    let map = longan_formats::read(&file.scratch().path, &selection).unwrap();
    let whole = longan_formats::read(&plain().scratch().path, &selection).unwrap();
    let mut inside = 0;
    for (pixel, (&found, &of_whole)) in map.values().iter().zip(whole.values()).enumerate() {
        let (theta, phi) = map.grid().centre(pixel);
        let (lat, lon) = (90.0 - theta.to_degrees(), phi.to_degrees());
        // A pixel of Nside 8 reaches at most 7.3 degrees to the north or south, and 10.5 along these parallels.
        if (8.0..52.0).contains(&lat) && (36.0..104.0).contains(&lon) {
            assert_close(&[found], &[of_whole]);
            inside += 1;
        } else if !(-8.0..68.0).contains(&lat) || !(10.0..135.0).contains(&lon) {
            assert!(found.is_nan(), "pixel {pixel}");
        }
    }
    assert!(inside > 20);
}
