//! The same map, told in every way that files do.

use longan_formats::{ErrorKind, Indexing, describe};
use longan_grid::Ordering;
use serde_json::{Value, json};

use crate::file::{FORMATS, File, Format, Values, Variable, variable};
use crate::{NEST_TO_RING_2, assert_same, field, is, nested_values, read, ring_values};

/// A variable without dimensions that describes the grid.
fn mapping(name: &str, attributes: Value) -> Variable {
    variable(name, &[], Values::I32(vec![0]), attributes)
}

fn data(dimension: &str, values: Vec<f64>, attributes: Value) -> Variable {
    variable("t", &[(dimension, values.len())], Values::F64(values), attributes)
}

fn index(name: &str, dimension: &str, numbers: &[i32], attributes: Value) -> Variable {
    variable(name, &[(dimension, numbers.len())], Values::I32(numbers.to_vec()), attributes)
}

/// The pixels that have values in a partial map, out of order, in the numbers of a file.
fn some() -> Vec<usize> {
    (0..48).map(|i| (i * 29 + 3) % 48).filter(|p| p % 3 != 1).collect()
}

fn values(ordering: Ordering) -> Vec<f64> {
    match ordering {
        Ordering::Ring => ring_values(),
        Ordering::Nested => nested_values(),
    }
}

/// The map of which a file has [`some`] pixels.
fn partial(ordering: Ordering) -> Vec<f64> {
    let ring = ring_values();
    let mut expected = vec![f64::NAN; 48];
    for number in some() {
        let p = if ordering == Ordering::Ring { number } else { NEST_TO_RING_2[number] };
        expected[p] = ring[p];
    }
    expected
}

const SCHEMES: [(&str, Ordering); 2] = [("ring", Ordering::Ring), ("nested", Ordering::Nested)];

#[track_caller]
fn check(file: &File, formats: &[Format], expected: &[f64], ordering: Ordering, of: &str) {
    for &format in formats {
        let folder = tempfile::tempdir().unwrap();
        let path = file.write(folder.path(), format);
        let of = format!("{of} in {format:?}");
        let map = read(&path).unwrap_or_else(|e| panic!("{of}: {e}"));
        assert_same(map.values(), expected, &of);
        assert_eq!((map.name.as_str(), map.ordering), ("t", ordering), "{of}");
    }
}

fn all() -> Vec<i32> {
    (0..48).collect()
}

#[test]
fn cf() {
    for (scheme, ordering) in SCHEMES {
        let grid = || {
            mapping(
                "healpix",
                json!({"grid_mapping_name": "healpix", "indexing_scheme": scheme, "refinement_level": 1}),
            )
        };
        let named = json!({"grid_mapping": "healpix", "units": "K", "long_name": "warmth"});
        let standard = json!({"standard_name": "healpix_index", "units": "1"});
        let full = data("cell", values(ordering), named.clone());
        check(&File::of([full.clone(), grid()]), &FORMATS, &ring_values(), ordering, scheme);
        let cells = index("cell", "cell", &all(), standard.clone());
        check(&File::of([cells, grid(), full.clone()]), &FORMATS, &ring_values(), ordering, "with an index");
        // The extended form of the attribute, a dimension of any name, and an auxiliary index of 64 bits.
        let aux = variable("nr", &[("n", 48)], Values::I64((0..48).collect()), standard.clone());
        let extended = json!({"grid_mapping": "healpix: nr", "coordinates": "nr"});
        let file = File::of([data("n", values(ordering), extended), grid(), aux]);
        check(&file, &FORMATS[1..], &ring_values(), ordering, "extended");

        let numbers: Vec<i32> = some().iter().map(|&p| p as i32).collect();
        let part: Vec<f64> = some().iter().map(|&p| values(ordering)[p]).collect();
        let cells = index("cell", "cell", &numbers, standard.clone());
        let file = File::of([data("cell", part.clone(), named.clone()), grid(), cells]);
        check(&file, &FORMATS, &partial(ordering), ordering, "partial");
        // All pixels in disorder.
        let order: Vec<usize> = (0..48).map(|i| i * 5 % 48).collect();
        let cells = index("x", "n", &order.iter().map(|&p| p as i32).collect::<Vec<_>>(), standard);
        let shuffled = order.iter().map(|&p| values(ordering)[p]).collect();
        check(&File::of([cells, grid(), data("n", shuffled, named)]), &FORMATS, &ring_values(), ordering, "shuffled");
    }
}

#[test]
fn cells_of_one_or_more_sizes() {
    type Number = fn(i64, u32) -> i64;
    let nuniq: Number = |pixel, level| pixel + (1 << (2 * (level + 1)));
    let zuniq: Number = |pixel, level| (2 * pixel + 1) << (2 * (29 - level));
    for (scheme, number) in [("nuniq", nuniq), ("zuniq", zuniq)] {
        let grid = || mapping("crs", json!({"grid_mapping_name": "healpix", "indexing_scheme": scheme}));
        let attributes = || json!({"grid_mapping": "crs"});
        let cells = |numbers: Vec<i64>| {
            let standard = json!({"standard_name": "healpix_index"});
            variable("cell", &[("cell", numbers.len())], Values::I64(numbers), standard)
        };
        let numbers = (0..48).map(|p| number(p, 1)).collect();
        let file = File::of([data("cell", nested_values(), attributes()), grid(), cells(numbers)]);
        check(&file, &FORMATS[1..], &ring_values(), Ordering::Nested, scheme);

        // Base pixel 0 whole, base pixel 1 in four, of which one in four again, and nothing else.
        let named = [(0, 0, 7.0), (4, 1, 1.0), (5, 1, 2.0), (6, 1, f64::NAN)];
        let finest = (28..32).map(|p| (p, 2, p as f64));
        let (mut numbers, mut values) = (Vec::new(), Vec::new());
        for (pixel, level, value) in named.into_iter().chain(finest) {
            numbers.push(number(pixel, level));
            values.push(value);
        }
        let file = File::of([data("cell", values, attributes()), grid(), cells(numbers)]);
        let folder = tempfile::tempdir().unwrap();
        for format in &FORMATS[1..] {
            let path = file.write(folder.path(), *format);
            let map = read(&path).unwrap();
            let mut expected = vec![f64::NAN; 192];
            let layer = cdshealpix::nested::get(2);
            let mut put = |pixel: u64, value| expected[layer.to_ring(pixel) as usize] = value;
            (0..16).for_each(|p| put(p, 7.0));
            (16..20).for_each(|p| put(p, 1.0));
            (20..24).for_each(|p| put(p, 2.0));
            (28..32).for_each(|p| put(p, p as f64));
            assert_same(map.values(), &expected, scheme);
            // Coarser, by the mean of what is valid.
            let selection = longan_formats::Selection { nside: Some(1), ..Default::default() };
            let map = longan_formats::read(&path, &selection).unwrap();
            let mean = (1.0 + 2.0 + 29.5) / 3.0;
            assert!((map.values()[1] - mean).abs() < 1e-14 && map.values()[0] == 7.0);
            assert!(map.values()[2..].iter().all(|v| v.is_nan()));
        }
    }
}

#[test]
fn before_cf() {
    // All combinations, each in one of the formats.
    let mut formats = FORMATS.iter().cycle();
    for (order, ordering) in [("nest", Ordering::Nested), ("nested", Ordering::Nested), ("ring", Ordering::Ring)] {
        let says = json!({"grid_mapping_name": "healpix", "healpix_nside": 2, "healpix_order": order});
        for dimension in ["cell", "value", "values"] {
            for name in ["crs", "healpix"] {
                // With one value along a dimension of its own, or without; named by the data, or not.
                formats.next();
                for grid in [
                    mapping(name, says.clone()),
                    variable(name, &[(name, 1)], Values::F32(vec![f32::NAN]), says.clone()),
                    variable(name, &[("n", 1)], Values::F64(vec![0.0]), says.clone()),
                ] {
                    for named in [json!({"grid_mapping": name}), json!({}), json!({"grid_mapping": "elsewhere"})] {
                        let file = File::of([data(dimension, values(ordering), named), grid.clone()]);
                        check(&file, &[*formats.next().unwrap()], &ring_values(), ordering, order);
                    }
                }
            }
        }
    }
    // Numbers as real ones or in digits.
    for nside in [json!(2.0), json!("2")] {
        let says = json!({"grid_mapping_name": "healpix", "healpix_nside": nside, "healpix_order": "nest"});
        let file = File::of([data("cell", nested_values(), json!({"grid_mapping": "crs"})), mapping("crs", says)]);
        check(&file, &FORMATS, &ring_values(), Ordering::Nested, "numbers");
    }
}

#[test]
fn xdggs() {
    let levels =
        [("level", 1), ("nside", 2), ("order", 1), ("resolution", 1), ("depth", 1)].map(|(name, n)| (name, json!(n)));
    let schemes = [
        ("indexing_scheme", json!("nested"), Ordering::Nested),
        ("indexing_scheme", json!("ring"), Ordering::Ring),
        ("nest", json!(true), Ordering::Nested),
        ("nest", json!(false), Ordering::Ring),
        ("nothing", json!(0), Ordering::Nested),
    ];
    let mut formats = FORMATS.iter().cycle();
    for (level, number) in &levels {
        for (scheme, value, ordering) in &schemes {
            let says = json!({"grid_name": "healpix", *level: number, *scheme: value, "ellipsoid": "WGS84"});
            let numbers: Vec<i32> = some().iter().map(|&p| p as i32).collect();
            let part: Vec<f64> = some().iter().map(|&p| values(*ordering)[p]).collect();
            let file = File::of([index("cell_ids", "cells", &numbers, says), data("cells", part, json!({}))]);
            check(&file, &[*formats.next().unwrap()], &partial(*ordering), *ordering, &format!("{level} {scheme}"));
        }
    }
    // What its "cf" writer makes: the data name another variable than there is.
    let says = json!({"grid_mapping_name": "healpix", "refinement_level": 1, "indexing_scheme": "ring"});
    let cells = index("cell_ids", "cells", &all(), json!({"standard_name": "healpix_index", "units": "1"}));
    let named = json!({"grid_mapping": "healpix"});
    let file = File::of([mapping("crs", says), cells, data("cells", ring_values(), named)]);
    check(&file, &FORMATS, &ring_values(), Ordering::Ring, "dangling");
}

#[test]
fn the_convention_of_zarr() {
    for (scheme, ordering) in SCHEMES {
        for (coordinate, dimension) in [(Some("cell_ids"), "cells"), (None, "anything")] {
            let mut file = File::of([data(dimension, values(ordering), json!({}))]);
            let mut dggs = json!({
                "name": "healpix", "refinement_level": 1, "indexing_scheme": scheme, "spatial_dimension": dimension,
                "compression": "none", "ellipsoid": {"name": "wgs84"},
            });
            if let Some(coordinate) = coordinate {
                dggs["coordinate"] = json!(coordinate);
                file.variables.push(index(coordinate, dimension, &all(), json!({})));
            }
            file.attributes.insert("dggs".into(), dggs);
            let declared = json!([{"uuid": "7b255807-140c-42ca-97f6-7a1cfecdbc38", "name": "dggs"}]);
            file.attributes.insert("zarr_conventions".into(), declared);
            check(&file, &[Format::Zarr2, Format::Zarr3], &ring_values(), ordering, scheme);
        }
    }
}

#[test]
fn several_fields_and_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let says = json!({"grid_mapping_name": "healpix", "refinement_level": 1, "indexing_scheme": "ring"});
    let along = |name: &str, attributes: Value| {
        variable(name, &[("cell", 48)], Values::F64(ring_values().iter().map(|v| v + 1.0).collect()), attributes)
    };
    let file = File::of([
        mapping("crs", says),
        along("lat", json!({"units": "degrees_north"})),
        along("lon", json!({"units": "degrees_east"})),
        data("cell", ring_values(), json!({"grid_mapping": "crs", "units": "K", "long_name": "warmth"})),
        along("q", json!({"grid_mapping": "crs", "units": "kg"})),
        along("count", json!({"grid_mapping": "crs"})),
    ]);
    for format in FORMATS {
        let path = file.write(folder.path(), format);
        let (error, told) = crate::problem(read(&path));
        assert!(is(&error, ErrorKind::Ambiguous, "there are several variables"));
        assert!(told.contains("q with cell (48) in kg") && !told.contains("lat "), "{told}");
        let map = longan_formats::read(&path, &field("T")).unwrap();
        assert_same(map.values(), &ring_values(), "t");
        assert_eq!((map.unit.as_deref(), map.long_name.as_deref()), (Some("K"), Some("warmth")));
        let map = longan_formats::read(&path, &field("q")).unwrap();
        assert_eq!((map.values()[0], map.unit.as_deref(), map.time), (-29.0, Some("kg"), None));
        let (error, told) = crate::problem(longan_formats::read(&path, &field("u")));
        assert!(is(&error, ErrorKind::Unknown, "those on a HEALPix grid are") && told.contains("'u'"), "{told}");

        let description = describe(&path).unwrap();
        assert_eq!(description.tables.len(), 3);
        let longan_formats::GridDescription::Healpix { nside: 2, indexing, pixels: 48, .. } =
            description.tables[0].grid
        else {
            panic!("{description:?}")
        };
        assert_eq!(indexing, Indexing::Implicit);
    }
}
