//! Files with something wrong, each told in one sentence.

use longan_formats::{Error, ErrorKind};
use std::fs;

use netcdf::AttributeValue;

use crate::inputs::{Format, scratch};
use crate::*;

#[track_caller]
fn told(file: &Nc) -> (Error, String) {
    problem(read(&file.scratch().path))
}

#[test]
fn coordinates_that_are_no_degrees() {
    let with_units = |units: &str, standard_names: bool| {
        let mut file = plain();
        for (name, standard_name) in [("lat", "latitude"), ("lon", "longitude")] {
            let attributes = &mut file.var(name).attributes;
            *attributes = vec![("units", text(units))];
            if standard_names {
                attributes.push(("standard_name", text(standard_name)));
            }
        }
        file
    };
    for named in [false, true] {
        for units in ["radian", "radians", "rad"] {
            let (error, told) = told(&with_units(units, named));
            assert!(is(&error, ErrorKind::Unsupported, "but degrees are needed"), "{told}");
            assert!(told.contains(&format!("'lat' is in '{units}', but degrees are needed")), "{told}");
        }
        for units in ["m", "km", "1", "metres", "new\nline"] {
            let (error, told) = told(&with_units(units, named));
            assert!(is(&error, ErrorKind::Unsupported, "not degrees; bring the field"), "{told}");
            assert!(told.contains(&format!("'lat' is in '{}', not degrees", units.escape_debug())), "{told}");
        }
    }
    // Radians and metres that do not say so.
    let mut file = with_units("degrees", false);
    let longitudes = (0..LONGITUDES).map(|c| (10.0 * c as f64).to_radians()).collect();
    file.var("lat").data = Data::F64((0..LATITUDES).map(|r| latitude(r).to_radians()).collect());
    file.var("lon").data = Data::F64(longitudes);
    assert!(told(&file).1.contains("radians"));
    file.var("lat").data = Data::F64((0..LATITUDES).map(|r| 1e5 * r as f64).collect());
    assert!(told(&file).1.contains("metres"));
    // Axes of a rotated pole.
    let mut file = plain();
    file.var("lat").attributes =
        vec![("units", text("degrees")), ("standard_name", text("grid_latitude")), ("axis", text("Y"))];
    file.var("lon").attributes =
        vec![("units", text("degrees")), ("standard_name", text("grid_longitude")), ("axis", text("X"))];
    let (error, told) = told(&file);
    assert!(
        is(&error, ErrorKind::Unsupported, "not a latitude or longitude") && told.contains("'lat' is a grid_latitude"),
        "{told}"
    );
}

#[test]
fn coordinates_that_are_not_there() {
    let mut file = plain();
    file.variables.retain(|v| v.path != "lat");
    let (error, told) = told(&file);
    assert!(is(&error, ErrorKind::NoMap, "no variable is on a HEALPix grid"), "{told}");
    assert!(told.contains("'t' in K with dimensions lat (18), lon (36)"), "{told}");
    let empty = Nc::new(&[], vec![]);
    assert!(problem(read(&empty.scratch().path)).1.ends_with("the variables are none"));
    assert!(is(
        &problem(longan_formats::describe(&empty.scratch().path)).0,
        ErrorKind::NoMap,
        "no variable is on a HEALPix grid"
    ));
}

#[test]
fn coordinates_over_two_dimensions_or_one() {
    let all = |degrees: fn(usize, usize) -> f64| {
        Data::F64((0..LATITUDES).flat_map(|r| (0..LONGITUDES).map(move |c| degrees(r, c))).collect())
    };
    let mut file = plain();
    for (name, units) in [("lat", "degrees_north"), ("lon", "degrees_east")] {
        let coordinate = file.var(name);
        coordinate.path = format!("nav_{name}");
        coordinate.dimensions = vec!["lat", "lon"];
        coordinate.attributes = vec![("units", text(units))];
        coordinate.data = if name == "lat" { all(|r, _| latitude(r)) } else { all(|_, c| 10.0 * c as f64) };
    }
    for listed in [false, true] {
        if listed {
            file.var("t").attributes.push(("coordinates", text("nav_lat nav_lon")));
        }
        let (error, told) = told(&file);
        assert!(is(&error, ErrorKind::Unsupported, "is on a curvilinear grid"), "{told}");
        assert!(told.contains("'t' is on a curvilinear grid") && told.contains("cdo remapbil"), "{told}");
    }
    // With the axes of a rotated pole beside them.
    for (name, axis) in [("lat", "Y"), ("lon", "X")] {
        let len = if axis == "Y" { LATITUDES } else { LONGITUDES };
        file.variables.push(var(
            name,
            &[name],
            Data::F64((0..len).map(|i| i as f64).collect()),
            &[("axis", text(axis))],
        ));
    }
    assert!(is(&told(&file).0, ErrorKind::Unsupported, "is on a curvilinear grid"));

    let mut file = plain();
    file.dimensions = vec![("cell".to_owned(), LATITUDES), ("time".to_owned(), 2)];
    file.var("lat").dimensions = vec!["cell"];
    file.var("lon").dimensions = vec!["cell"];
    file.var("lon").data = Data::F64(vec![0.0; LATITUDES]);
    file.var("t").dimensions = vec!["time", "cell"];
    file.var("t").data = Data::F64(vec![0.0; 2 * LATITUDES]);
    let (error, told) = told(&file);
    assert!(is(&error, ErrorKind::Unsupported, "is on an unstructured grid") && told.contains("'cell'"), "{told}");
}

#[test]
fn coordinates_out_of_order_or_missing_values() {
    let mut file = plain();
    let Data::F64(latitudes) = &mut file.var("lat").data else { panic!() };
    latitudes.swap(3, 4);
    let (error, told) = told(&file);
    assert!(matches!(grid(&error), longan_grid::Error::NotMonotonic { coordinate: "latitude", .. }), "{told}");
    let mut file = plain();
    let Data::F64(longitudes) = &mut file.var("lon").data else { panic!() };
    longitudes[7] = f64::NAN;
    assert!(matches!(grid(&problem(read(&file.scratch().path)).0), longan_grid::Error::CoordinateRange { .. }));
    let mut file = plain();
    file.var("lat").data = Data::Text(vec!["x"; LATITUDES]);
    assert!(is(&problem(read(&file.scratch().path)).0, ErrorKind::NotNumbers, "which is not a field of numbers"));
}

#[test]
fn dimensions_without_places() {
    let mut file = plain();
    file.dimensions.push(("time".to_owned(), 0));
    let time = [("units", text("days since 2000-01-01"))];
    file.variables.push(var("time", &["time"], Data::F64(vec![]), &time));
    // The variable's values are left out, since it has none.
    let Nc { format, dimensions, mut variables } = file;
    variables.retain(|v| v.path != "t");
    let scratch = Nc { format, dimensions, variables }.scratch();
    let mut more = netcdf::append(&scratch.path).unwrap();
    more.add_variable::<f64>("t", &["time", "lat", "lon"]).unwrap();
    more.close().unwrap();
    let (error, told) = problem(read(&scratch.path));
    assert!(is(&error, ErrorKind::NoValues, "has length 0"), "{told}");
    assert!(told.contains("dimension 'time' of variable 't' has length 0"), "{told}");
    assert_eq!(longan_formats::describe(&scratch.path).unwrap().tables[0].dimensions[0].len, 0);
}

#[test]
fn attributes_of_the_wrong_type() {
    let real = AttributeValue::Double;
    for (name, value, expected) in [
        ("scale_factor", text("0.5"), "variable 't' has scale_factor = the text '0.5', which is not one number"),
        ("add_offset", AttributeValue::Doubles(vec![1.0, 2.0]), "add_offset = 2 numbers, which is not one number"),
        ("missing_value", text("none"), "missing_value = the text 'none', which is not a number or several"),
        ("valid_range", real(1.0), "valid_range = 1, which is not two numbers"),
        ("scale_factor", real(f64::INFINITY), "scale_factor = inf, which is not a finite number"),
    ] {
        let mut file = plain();
        file.var("t").attributes.push((name, value));
        let (error, told) = told(&file);
        assert!(is(&error, ErrorKind::Invalid, "such as with ncatted") && told.contains(expected), "{told}");
    }
    // Units that are numbers, and coordinates that are, say nothing.
    let mut file = plain();
    file.var("t").attributes = vec![
        ("units", real(1.0)),
        ("coordinates", real(1.0)),
        ("long_name", AttributeValue::Strs(vec!["a".into(); 2])),
    ];
    let map = read(&file.scratch().path).unwrap();
    assert_eq!((map.unit, map.long_name), (None, None));
}

#[test]
fn variables_that_hold_no_field() {
    let mut file = plain();
    file.dimensions.push(("code".to_owned(), 3));
    file.variables.push(var("names", &["code"], Data::Text(vec!["a", "b", "c"]), &[]));
    let (error, told) = problem(longan_formats::read(&file.scratch().path, &variable("names")));
    assert!(is(&error, ErrorKind::Unknown, "with latitude and longitude"), "{told}");
    // A number that no signed one holds, and the largest that one does.
    for (number, readable) in [(u64::MAX, false), (1 << 63, false), ((1 << 63) - 1, true)] {
        let mut file = plain();
        file.var("t").data = Data::U64(vec![number; LATITUDES * LONGITUDES]);
        let read = read(&file.scratch().path);
        if readable {
            assert_eq!(read.unwrap().values()[0], number as f64);
        } else {
            let (error, told) = problem(read);
            assert!(is(&error, ErrorKind::Unsupported, &format!("holds {number}, beyond 2^63 - 1")), "{told}");
        }
    }
}

#[test]
fn files_cut_anywhere() {
    let mut file = plain();
    for format in [Format::Classic, Format::Offset64, Format::Data64, Format::Netcdf4] {
        file.format = format;
        let whole = file.scratch();
        let bytes = fs::read(&whole.path).unwrap();
        let expected = read(&whole.path).unwrap();
        let cuts = (4..bytes.len()).step_by(bytes.len() / 60).chain([bytes.len() - 1, bytes.len() - 4]);
        for cut in cuts {
            // What is cut must not be read as zeros.
            match read(&scratch(&bytes[..cut]).path) {
                Ok(map) => {
                    assert!(format == Format::Netcdf4, "cut to {cut} of {}", bytes.len());
                    assert_close(map.values(), expected.values());
                }
                error => drop(problem(error)),
            }
        }
    }
    file.format = Format::Classic;
    let bytes = fs::read(&file.scratch().path).unwrap();
    let (error, told) = problem(read(&scratch(&bytes[..bytes.len() - 8]).path));
    let needed = bytes.len() as u128;
    assert!(is(&error, ErrorKind::Truncated, &format!("the header promises {needed} bytes")), "{told}");
}

#[test]
fn records_cut_anywhere() {
    // Records of one variable, which are not padded, and of two.
    for names in [&["time"][..], &["time", "other"]] {
        let mut file = plain();
        file.format = Format::Classic;
        file.dimensions.push(("time".to_owned(), 0));
        for name in names {
            file.variables.push(var(name, &["time"], Data::F64(vec![1.0, 2.0, 3.0]), &[]));
        }
        let bytes = fs::read(&file.scratch().path).unwrap();
        read(&scratch(&bytes).path).unwrap();
        let (error, told) = problem(read(&scratch(&bytes[..bytes.len() - 8]).path));
        assert!(is(&error, ErrorKind::Truncated, "the header promises"), "{told}");
    }
}

#[test]
fn bytes_changed_anywhere() {
    // A header in which any one byte is wrong may be read or not, but never crash.
    let mut file = plain();
    file.var("t").attributes.push(("scale_factor", AttributeValue::Double(2.0)));
    for format in [Format::Classic, Format::Data64] {
        file.format = format;
        let bytes = fs::read(&file.scratch().path).unwrap();
        let header = bytes.len() - 8 * (LATITUDES * LONGITUDES + LATITUDES + LONGITUDES);
        for at in 0..header {
            for with in [0, 1, 0x0b, 0x7f, 0x80, 0xff] {
                let mut changed = bytes.clone();
                changed[at] = with;
                let scratch = scratch(&changed);
                let selection = Selection { nside: Some(1), ..Selection::default() };
                let _ = longan_formats::read(&scratch.path, &selection).map_err(|e| problem::<()>(Err(e)));
            }
        }
    }
}

#[test]
fn names_that_are_too_long() {
    let mut file = plain();
    file.format = Format::Classic;
    let bytes = fs::read(file.scratch().path).unwrap();
    // The name of the first dimension: its length 3 and "lat", made one of 1000 characters.
    let at = bytes.windows(8).position(|window| window == b"\0\0\0\x03lat\0").unwrap();
    let name = [&1000u32.to_be_bytes()[..], &[b'x'; 1000]].concat();
    let changed = [&bytes[..at], &name, &bytes[at + 8..]].concat();
    assert!(is(&problem(read(&scratch(&changed).path)).0, ErrorKind::Corrupt, "the NetCDF header is damaged"));
}

#[test]
fn files_of_other_kinds() {
    for bytes in [&b"CDF\x01"[..], b"CDF\x02\0\0\0", b"CDF\x05\xff\xff\xff\xff"] {
        let (error, told) = problem(read(&scratch(bytes).path));
        assert!(is(&error, ErrorKind::Corrupt, "the NetCDF header is damaged"), "{told}");
    }
    for bytes in [&b"\x89HDF\r\n\x1a\n"[..], b"\x89HDF\r\n\x1a\n\0\0\0"] {
        let (error, told) = problem(read(&scratch(bytes).path));
        assert!(
            is(&error, ErrorKind::Unreadable, "the NetCDF library says") && told.contains("the NetCDF library says"),
            "{told}"
        );
    }
    let (error, told) = problem(read(&scratch(b"CDF\x03\0\0\0\0").path));
    assert!(is(&error, ErrorKind::Unrecognised, "longan reads"), "{told}");
}

#[test]
fn more_than_the_memory_holds() {
    // A sparse file of 2^50 doubles, of which nothing was ever written.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.nc");
    let mut file = netcdf::create(&path).unwrap();
    for (name, len) in [("lat", 1 << 25), ("lon", 1 << 25)] {
        file.add_dimension(name, len).unwrap();
    }
    for (name, units) in [("lat", "degrees_north"), ("lon", "degrees_east")] {
        let mut coordinate = file.add_variable::<f32>(name, &[name]).unwrap();
        coordinate.put_attribute("units", units).unwrap();
    }
    let mut field = file.add_variable::<f64>("t", &["lat", "lon"]).unwrap();
    field.set_chunking(&[1 << 10, 1 << 10]).unwrap();
    file.close().unwrap();
    drop(problem(read(&path)));
}

#[test]
fn hdf5_after_a_block_of_the_user_s() {
    let bytes = fs::read(plain().scratch().path).unwrap();
    for block in [512, 1024, 2048] {
        let shifted = [vec![b' '; block], bytes.clone()].concat();
        // Recognised; whether it can be read is the library's to say, as its addresses are from the file's beginning.
        if let Err(error) = read(&scratch(&shifted).path) {
            let (error, told) = problem::<()>(Err(error));
            assert!(is(&error, ErrorKind::Unreadable, "the NetCDF library says"), "{told}");
        }
    }
}
