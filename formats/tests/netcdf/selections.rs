//! Variables, and places along dimensions.

use longan_formats::{Ask, ErrorKind};
use netcdf::AttributeValue;

use crate::*;

/// A field of one value for each month of a year and each of three levels: 100 times the month from 1, plus the level's
/// number from 0.
fn months() -> Nc {
    let mut file = plain();
    file.dimensions.extend([("time".to_owned(), 12), ("level".to_owned(), 3)]);
    let days = (0..12).map(|m| 15.0 + [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334][m] as f64).collect();
    let time = [("units", text("days since 1997-01-01")), ("calendar", text("standard"))];
    file.variables.push(var("time", &["time"], Data::F64(days), &time));
    file.variables.push(var("level", &["level"], Data::F32(vec![1000.0, 500.0, 0.1]), &[("units", text("hPa"))]));
    let field = |m: usize, l: usize| vec![(100 * (m + 1) + l) as f64; LATITUDES * LONGITUDES];
    let all = (0..12).flat_map(|m| (0..3).flat_map(move |l| field(m, l))).collect();
    let t = file.var("t");
    (t.dimensions, t.data) = (vec!["time", "level", "lat", "lon"], Data::F64(all));
    file
}

/// The one value that each step's map has, and the steps' dates.
fn steps(file: &Nc, selection: &Selection) -> Vec<(f64, String)> {
    let path = file.scratch();
    let mut maps = longan_formats::open(&path.path, selection).unwrap();
    let times = maps.times().to_vec();
    let mut found = Vec::new();
    for step in 0..times.len().max(1) {
        let map = maps.read(step).unwrap();
        assert_eq!(map.time.as_ref(), times.get(step));
        let first = map.values()[0];
        assert_close(map.values(), &vec![first.round(); map.values().len()]);
        // Means of one value are that value but for rounding.
        found.push((first.round(), times.get(step).map(|time| time.label.clone()).unwrap_or_default()));
    }
    found
}

fn one(value: f64, label: &str) -> Vec<(f64, String)> {
    vec![(value, label.to_owned())]
}

#[test]
fn a_place_by_value_or_number() {
    let file = months();
    for level in ["level=500", "level=500.0", "level=#1", "LEVEL=5e2", "level= 500 "] {
        assert_eq!(steps(&file, &at(&[level, "time=1997-12"])), one(1201.0, "1997-12-16"), "{level}");
    }
    // 0.1 in single precision.
    assert_eq!(steps(&file, &at(&["time=#0", "level=0.1"])), one(102.0, "1997-01-16"));
    let times = ["1997-03", "1997-03-16", "1997-03-16T00", "1997-03-16 00:00", "1997-03-16T00:00:00Z", "#2", "74"];
    for time in times {
        let time = format!("time={time}");
        assert_eq!(steps(&file, &at(&["level=1000", &time])), one(300.0, "1997-03-16"), "{time}");
    }
}

#[test]
fn times_left_over_are_steps() {
    let file = months();
    let all = steps(&file, &at(&["level=500"]));
    assert_eq!(all.len(), 12);
    assert_eq!((all[0].0, all[11].0), (101.0, 1201.0));
    assert_eq!(all[11].1, "1997-12-16");
    assert_eq!(steps(&file, &at(&["level=500", "time=1997"])), all);
    // Of a month's beginning, no other is part: 1997-1 is neither 10 nor 11 nor 12.
    let (error, told) =
        problem(longan_formats::open(&file.scratch().path, &at(&["level=500", "time=1997-1"])).map(|_| ()));
    assert!(is(&error, ErrorKind::Unknown, "the values are"), "{told}");
    assert!(told.contains("1997-01-16 to 1997-12-16"), "{told}");
    let (error, told) = problem(longan_formats::read(&file.scratch().path, &at(&["level=500"])));
    assert!(is(&error, ErrorKind::Ambiguous, "there is a map for each of 12 times; choose one"), "{told}");
    // Only the longer ones: two steps of a part of a year are a series.
    let mut two = months();
    let Data::F64(days) = &mut two.var("time").data else { panic!() };
    days[1] = days[0] + 1.5;
    let january = steps(&two, &at(&["level=500", "time=1997-01"]));
    assert_eq!(january, [(101.0, "1997-01-16".to_owned()), (201.0, "1997-01-17T12:00".to_owned())]);
}

#[test]
fn times_in_other_calendars() {
    let mut file = months();
    file.var("time").attributes = vec![("units", text("days since 1997-02-28")), ("calendar", text("360_day"))];
    let found = steps(&file, &at(&["level=500", "time=#0"]));
    assert_eq!(found, one(101.0, "1997-03-13"));
    let path = file.scratch();
    let maps = longan_formats::open(&path.path, &at(&["level=500", "time=#0"])).unwrap();
    let time = &maps.times()[0];
    assert_eq!((time.value, time.units.as_str(), time.calendar.as_str()), (15.0, "days since 1997-02-28", "360_day"));
    // Units that nobody can read: numbers remain.
    for units in ["day as %Y%m%d.%f", "fortnights since 1997-01-01"] {
        file.var("time").attributes = vec![("units", text(units)), ("axis", text("T"))];
        assert_eq!(steps(&file, &at(&["level=500", "time=46"])), one(201.0, "46"));
        assert_eq!(steps(&file, &at(&["level=500"])).len(), 12);
    }
    // No coordinate at all.
    file.variables.retain(|v| v.path != "time");
    assert_eq!(steps(&file, &at(&["level=500"])).len(), 12);
    assert_eq!(steps(&file, &at(&["level=500", "time=#3"])), one(401.0, "#3"));
}

#[test]
fn a_time_without_a_dimension() {
    let mut file = plain();
    file.variables.push(var("valid_time", &[], Data::F64(vec![6.0]), &[("units", text("hours since 2000-01-01"))]));
    file.var("t").attributes.push(("coordinates", text("valid_time")));
    let map = read(&file.scratch().path).unwrap();
    assert_eq!(map.time.unwrap().label, "2000-01-01T06:00");
}

#[test]
fn a_dimension_of_one_place_needs_no_choice() {
    let mut file = plain();
    file.dimensions.extend([("time".to_owned(), 1), ("height".to_owned(), 1)]);
    file.variables.push(var("height", &["height"], Data::F64(vec![2.0]), &[("units", text("m"))]));
    file.var("t").dimensions = vec!["time", "height", "lat", "lon"];
    let expected = read(&plain().scratch().path).unwrap();
    for selection in [at(&[]), at(&["height=2"]), at(&["height=#0", "time=#0"])] {
        let map = longan_formats::read(&file.scratch().path, &selection).unwrap();
        assert_close(map.values(), expected.values());
    }
    let (error, told) = problem(longan_formats::read(&file.scratch().path, &at(&["height=10"])));
    assert!(is(&error, ErrorKind::Unknown, "the values are") && told.contains("the values are 2 (m)"), "{told}");
}

#[test]
fn places_named_in_words() {
    let mut file = months();
    file.variables.retain(|v| v.path != "level");
    file.variables.push(var("region", &["level"], Data::Text(vec!["sea", "land", "Größe"]), &[]));
    file.var("t").attributes.push(("coordinates", text("region")));
    for choice in ["level=land", "region=land", "region=#1"] {
        assert_eq!(steps(&file, &at(&[choice, "time=#0"])), one(101.0, "1997-01-16"));
    }
    let (error, told) = problem(longan_formats::read(&file.scratch().path, &at(&["time=#0"])));
    assert!(
        is(&error, ErrorKind::Ambiguous, "has several values along") && told.contains("sea, land, Größe"),
        "{told}"
    );
}

#[test]
fn choices_that_cannot_be() {
    let file = months();
    let cases: [(&[&str], &str); 8] = [
        (&["time=#0"], "several values along 'level': 1000, 500, 0.1 (hPa); choose one"),
        (&["level=400", "time=#0"], "there is no level = 400; the values are 1000, 500, 0.1 (hPa)"),
        (&["level=high", "time=#0"], "there is no level = high"),
        (&["level=#3", "time=#0"], "there is no level = #3; they are numbered from #0 to #2"),
        (
            &["plev=500"],
            "no dimension 'plev' to choose along; its dimensions are time (12), level (3), lat (18), lon (36)",
        ),
        (&["lat=5"], "dimension 'lat' runs over the sphere"),
        (&["level=500", "level=#0"], "'level' is chosen along twice"),
        (&["level=500", "time=1998"], "there is no time = 1998; the values are 1997-01-16 to 1997-12-16"),
    ];
    for (choices, expected) in cases {
        let (_, told) = problem(longan_formats::open(&file.scratch().path, &at(choices)).map(|_| ()));
        assert!(told.contains(expected), "{told}");
    }
    // Many values are not all listed, and one that is met twice is not guessed.
    let mut file = months();
    file.dimensions.retain(|(name, _)| name != "level" && name != "time");
    file.dimensions.extend([("level".to_owned(), 36), ("time".to_owned(), 1)]);
    file.variables.retain(|v| v.path != "time");
    let levels: Vec<f64> = (0..36).map(|l| f64::from(l % 35)).collect();
    file.var("level").data = Data::F64(levels);
    let (_, told) = problem(read(&file.scratch().path));
    assert!(told.contains("'level': 0, 1, 2, 3, 4, 5, ..., 33, 34, 0 (hPa);"), "{told}");
    let (error, told) = problem(longan_formats::read(&file.scratch().path, &at(&["level=0"])));
    assert!(is(&error, ErrorKind::Ambiguous, "is met 2 times; choose one by its number, such as #0"), "{told}");
    assert!(matches!(error.ask(), Some(Ask::Place { dimension: Some(_), place: Some(place) }) if place == "#0"));
    let hdu = Selection { hdu: Some(1), ..Selection::default() };
    let error = problem(longan_formats::read(&plain().scratch().path, &hdu)).0;
    assert!(is(&error, ErrorKind::NotApplicable, "there is no HDU 1 in a file of this format"));
    assert_eq!(error.ask(), Some(&Ask::Hdu));
}

#[test]
fn which_variable() {
    let mut file = plain();
    let double = |x: f64| Data::F64(vec![x; LATITUDES * LONGITUDES]);
    // Weights, coordinates and bounds are not meant.
    file.variables.push(var("area", &["lat", "lon"], double(1.0), &[("standard_name", text("cell_area"))]));
    file.variables.push(var("quality", &["lat", "lon"], double(2.0), &[]));
    file.var("t").attributes.push(("cell_measures", text("area: area")));
    file.var("t").attributes.push(("ancillary_variables", text("quality")));
    assert_eq!(read(&file.scratch().path).unwrap().name, "t");
    // But they can be.
    let area = longan_formats::read(&file.scratch().path, &variable("area")).unwrap();
    assert_close(area.values(), &vec![1.0; area.values().len()]);

    file.variables.push(var("u", &["lat", "lon"], double(3.0), &[("units", AttributeValue::from("m s-1"))]));
    file.variables.push(var("group/t", &["lat", "lon"], double(4.0), &[]));
    let path = file.scratch();
    let (error, told) = problem(read(&path.path));
    assert!(is(&error, ErrorKind::Ambiguous, "there are several variables"), "{told}");
    let listed =
        "'t' in K with dimensions lat (18), lon (36); 'u' in m s-1 with dimensions lat (18), lon (36); 'group/t'";
    assert!(told.contains(listed) && error.ask() == Some(&Ask::Variable) && !told.contains("area"), "{told}");
    for (name, expected) in [("u", 3.0), ("U", 3.0), ("group/t", 4.0), ("/group/t", 4.0)] {
        let map = longan_formats::read(&path.path, &variable(name)).unwrap();
        assert_close(&map.values()[..1], &[expected]);
    }
    let second = Selection { field: Some(Field::Number(1)), ..Selection::default() };
    assert_eq!(longan_formats::read(&path.path, &second).unwrap().name, "u");
    for unknown in [Field::Name("v".into()), Field::Name("lat".into()), Field::Number(3)] {
        let selection = Selection { field: Some(unknown), ..Selection::default() };
        let (error, told) = problem(longan_formats::read(&path.path, &selection));
        assert!(is(&error, ErrorKind::Unknown, "with latitude and longitude") && told.contains(listed), "{told}");
    }
}
