//! NetCDF files written are those read, and what other software expects.

use longan_formats::{Error, ErrorKind};
use std::fs;
use std::path::Path;

use longan_formats::*;
use longan_grid::{Healpix, Ordering, Time};

use crate::{assert_same, field, is, problem};

fn value(step: usize, column: usize, pixel: usize) -> f64 {
    match (pixel + step + column).is_multiple_of(7) {
        true => f64::NAN,
        false => (pixel as f64 + 0.1).sqrt() * (1.0 - 2.0 * column as f64) + step as f64 * 1e-3,
    }
}

fn card(key: &str, value: CardValue) -> Card {
    Card { key: key.to_owned(), value, comment: "not written".to_owned() }
}

fn layout(nside: usize, ordering: Ordering, float32: bool, steps: usize) -> NetcdfLayout {
    let column = |name: &str, unit: &str, long_name: &str| NetcdfColumn {
        name: name.into(),
        unit: unit.into(),
        long_name: long_name.into(),
        quantity: None,
    };
    NetcdfLayout {
        grid: Healpix::new(nside).unwrap(),
        ordering,
        float32,
        columns: vec![column("anisotropy", "1", "anisotropy of the contours"), column("V 1/2", "K m-1", "")],
        numbers: vec![column("mean", "K", "mean of the input")],
        attributes: vec![
            card("TITLE", CardValue::Text("Größe".into())),
            card("HISTORY", CardValue::Text("longan map\nlonger".into())),
            card("RANK", CardValue::Integer(-2)),
            card("BIG", CardValue::Integer(1 << 40)),
            card("THRESH", CardValue::Real(0.1)),
            card("INFTY", CardValue::Real(f64::NEG_INFINITY)),
            card("NORMED", CardValue::Logical(true)),
            card("DATE-OBS", CardValue::Text(String::new())),
        ],
        time: (steps > 1).then(|| TimeAxis { units: "days since 1979-01-01".into(), calendar: "noleap".into() }),
    }
}

fn time(step: usize) -> Time {
    Time {
        value: step as f64 * 30.5,
        units: "days since 1979-01-01".into(),
        calendar: "noleap".into(),
        label: String::new(),
    }
}

fn write(path: &Path, layout: &NetcdfLayout, steps: usize) -> Result<(), Error> {
    save(path, true, |path| {
        let mut writer = NetcdfWriter::create(path, layout.clone())?;
        for step in 0..steps {
            let columns = [0, 1].map(|c| (0..layout.grid.pixels()).map(|p| value(step, c, p)).collect::<Vec<_>>());
            writer.append(
                &[&columns[0], &columns[1]],
                &[step as f64],
                layout.time.is_some().then(|| time(step)).as_ref(),
            )?;
        }
        writer.finish()
    })
}

#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    // The last has more values than are written at once.
    for (nside, ordering, float32, steps) in [
        (1, Ordering::Ring, false, 1),
        (1, Ordering::Nested, true, 1),
        (8, Ordering::Ring, true, 3),
        (8, Ordering::Nested, false, 3),
        (8, Ordering::Ring, false, 1),
        (256, Ordering::Nested, true, 2),
    ] {
        let path = folder.path().join("map.nc");
        let layout = layout(nside, ordering, float32, steps);
        write(&path, &layout, steps).unwrap();
        for (number, name) in ["anisotropy", "V_1_2"].into_iter().enumerate() {
            let mut maps = open(&path, &field(name)).unwrap();
            assert_eq!(maps.times().len(), if steps > 1 { steps } else { 0 });
            for step in (0..steps).rev() {
                let map = maps.read(step).unwrap();
                let stored = |v: f64| if float32 { f64::from(v as f32) } else { v };
                let expected: Vec<_> = (0..layout.grid.pixels()).map(|p| stored(value(step, number, p))).collect();
                assert_same(map.values(), &expected, name);
                assert_eq!((map.grid(), map.ordering, map.name.as_str()), (layout.grid, ordering, name));
                assert_eq!(map.unit.as_deref(), Some(["1", "K m-1"][number]));
                assert_eq!(map.long_name.as_deref(), [Some("anisotropy of the contours"), None][number]);
                if steps > 1 {
                    let expected =
                        Time { label: ["1979-01-01", "1979-01-31T12:00", "1979-03-03"][step].into(), ..time(step) };
                    assert_eq!(map.time, Some(expected));
                }
            }
        }
        let (error, told) = problem(crate::read(&path));
        assert!(
            is(&error, ErrorKind::Ambiguous, "there are several variables") && !told.contains("cell with"),
            "{told}"
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

#[test]
fn the_header_is_as_documented() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.nc");
    write(&path, &layout(4, Ordering::Nested, true, 2), 2).unwrap();
    let file = netcdf::open(&path).unwrap();
    let text = |value: netcdf::AttributeValue| String::try_from(value).unwrap();
    let global = |name: &str| file.attribute(name).unwrap_or_else(|| panic!("{name}")).value().unwrap();
    let of = |variable: &str, name: &str| file.variable(variable)?.attribute_value(name).transpose().unwrap();
    assert_eq!(file.attributes().next().unwrap().name(), "Conventions");
    for (name, expected) in
        [("Conventions", "CF-1.13"), ("title", "Größe"), ("history", "longan map\nlonger"), ("normed", "true")]
    {
        assert_eq!(text(global(name)), expected);
    }
    assert_eq!(global("rank"), netcdf::AttributeValue::Int(-2));
    assert_eq!(global("big"), netcdf::AttributeValue::Longlong(1 << 40));
    assert_eq!(global("thresh"), netcdf::AttributeValue::Double(0.1));
    assert_eq!(global("infty"), netcdf::AttributeValue::Double(f64::NEG_INFINITY));
    assert!(file.attribute("date_obs").is_some());
    for (variable, name, expected) in [
        ("healpix", "grid_mapping_name", "healpix"),
        ("healpix", "indexing_scheme", "nested"),
        ("cell", "standard_name", "healpix_index"),
        ("time", "units", "days since 1979-01-01"),
        ("time", "calendar", "noleap"),
        ("time", "standard_name", "time"),
        ("time", "axis", "T"),
        ("anisotropy", "grid_mapping", "healpix"),
        ("V_1_2", "units", "K m-1"),
        ("mean", "long_name", "mean of the input"),
    ] {
        assert_eq!(text(of(variable, name).unwrap()), expected);
    }
    assert_eq!(of("healpix", "refinement_level"), Some(netcdf::AttributeValue::Int(2)));
    assert!(of("healpix", "healpix_nside").is_none() && of("V_1_2", "long_name").is_none());
    assert!(matches!(of("anisotropy", "_FillValue"), Some(netcdf::AttributeValue::Float(fill)) if fill.is_nan()));
    assert!(file.variable("healpix").unwrap().dimensions().is_empty());
    assert!(file.dimension("time").unwrap().is_unlimited());
    let means: Vec<f64> = file.variable("mean").unwrap().get_values(..).unwrap();
    assert_eq!(means, [0.0, 1.0]);
    let cells: Vec<i64> = file.variable("cell").unwrap().get_values(..).unwrap();
    assert!(cells.into_iter().eq(0..192));
    let stored: Vec<f32> = file.variable("anisotropy").unwrap().get_values((1, ..)).unwrap();
    let layer = cdshealpix::nested::get(2);
    for (p, found) in (0..).zip(stored) {
        let expected = value(1, 0, layer.to_ring(p) as usize) as f32;
        assert!(found == expected || found.is_nan() && expected.is_nan());
    }
}

#[test]
fn what_a_file_says_of_itself_is_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.nc");
    let layout = layout(4, Ordering::Ring, false, 1);
    write(&path, &layout, 1).unwrap();
    let tables = describe(&path).unwrap().tables;
    assert!(tables.len() == 2 && tables[0].cards == tables[1].cards);
    for Card { key, value, .. } in &layout.attributes {
        match value {
            CardValue::Logical(truth) => assert_eq!(tables[0].card(key), Some(&CardValue::Text(truth.to_string()))),
            CardValue::Text(text) if text.is_empty() => {}
            value => assert_eq!(tables[0].card(key), Some(value), "{key}"),
        }
    }
}

#[test]
fn names_that_clash() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.nc");
    let mut layout = layout(1, Ordering::Ring, false, 1);
    let names = ["time", "cell", "a/b", "a b", "2d", "", "µ", "healpix"];
    let column = |name: &&str| NetcdfColumn {
        name: (*name).into(),
        unit: String::new(),
        long_name: String::new(),
        quantity: None,
    };
    layout.columns = names.iter().map(column).collect();
    layout.numbers = vec![column(&"a b")];
    let values: Vec<Vec<f64>> = (0..names.len()).map(|c| vec![c as f64; 12]).collect();
    save(&path, false, |path| {
        let mut writer = NetcdfWriter::create(path, layout)?;
        writer.append(&values.iter().map(Vec::as_slice).collect::<Vec<_>>(), &[2.5], None)?;
        writer.finish()
    })
    .unwrap();
    let number = netcdf::open(&path).unwrap().variable("a_b__").unwrap().get_value::<f64, _>(()).unwrap();
    assert_eq!(number, 2.5);
    for (number, name) in ["time_", "cell_", "a_b", "a_b_", "v2d", "v", "v_", "healpix_"].into_iter().enumerate() {
        assert_eq!(longan_formats::read(&path, &field(name)).unwrap().values(), values[number]);
    }
}

#[test]
fn the_same_map_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = ["a", "b"].map(|name| {
        let path = folder.path().join(format!("{name}.nc"));
        write(&path, &layout(16, Ordering::Ring, false, 3), 3).unwrap();
        fs::read(path).unwrap()
    });
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn what_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.nc");
    let (error, told) = problem(write(&path, &layout(3, Ordering::Ring, false, 1), 1));
    assert!(is(&error, ErrorKind::InvalidInput, "Nside 3 is not a power of two"), "{told}");
    let append = |steps: usize, columns: &[&[f64]], times: &[Option<Time>]| {
        let result = save(&path, false, |path| {
            let mut writer = NetcdfWriter::create(path, layout(1, Ordering::Ring, false, steps))?;
            times.iter().try_for_each(|time| writer.append(columns, &[0.0], time.as_ref()))?;
            writer.finish()
        });
        problem(result).0
    };
    let values = [0.0; 12];
    let step_time =
        |error: &Error, step: usize| is(error, ErrorKind::InvalidInput, &format!("step {step} does not go"));
    assert!(step_time(&append(1, &[&values], &[None]), 1));
    assert!(step_time(&append(1, &[&values, &values], &[None, None]), 2));
    assert!(step_time(&append(2, &[&values, &values], &[None]), 1));
    assert!(step_time(&append(1, &[&values, &values], &[Some(time(0))]), 1));
    let short = append(2, &[&values, &values[1..]], &[Some(time(0))]);
    assert!(is(&short, ErrorKind::InvalidInput, "has 11 values but Nside 1 has 12 pixels"));
    // No such folder.
    let lost = NetcdfWriter::create(&folder.path().join("no/map.nc"), layout(1, Ordering::Ring, false, 1));
    assert_eq!(lost.err().unwrap().kind(), ErrorKind::Unwritable);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
