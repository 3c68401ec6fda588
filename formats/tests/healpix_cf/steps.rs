//! Other dimensions, time, and packed numbers.

use longan_formats::{Ask, At, ErrorKind, Place, Selection, open};
use serde_json::json;

use crate::file::{FORMATS, File, Values, variable};
use crate::{assert_same, is, problem, ring_values};

fn at(dimension: &str, place: Place) -> Selection {
    Selection { at: vec![At { dimension: dimension.to_owned(), place }], ..Selection::default() }
}

/// A value for each step, level and pixel.
fn value(step: usize, level: usize, pixel: usize) -> i16 {
    if (pixel + step).is_multiple_of(13) { -999 } else { (step * 1000 + level * 100 + pixel) as i16 }
}

#[test]
fn steps_and_levels_in_any_order() {
    let (steps, levels, pixels) = (3, 2, 48);
    let lengths = [("time", steps), ("level", levels), ("cell", pixels)];
    for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0], [2, 0, 1]] {
        let dimensions = order.map(|d| lengths[d]);
        let mut values = Vec::new();
        for a in 0..dimensions[0].1 {
            for b in 0..dimensions[1].1 {
                for c in 0..dimensions[2].1 {
                    let mut place = [0; 3];
                    for (d, i) in order.iter().zip([a, b, c]) {
                        place[*d] = i;
                    }
                    values.push(value(place[0], place[1], place[2]));
                }
            }
        }
        let packed = json!({"grid_mapping": "crs", "scale_factor": -0.5, "add_offset": 3.0, "_FillValue": -999});
        let grid = json!({"grid_mapping_name": "healpix", "refinement_level": 1, "indexing_scheme": "ring"});
        let time = json!({"units": "days since 1997-12-30", "calendar": "noleap", "standard_name": "time"});
        let file = File::of([
            variable("q", &dimensions, Values::I16(values), packed),
            variable("crs", &[], Values::I32(vec![0]), grid),
            variable("time", &[("time", steps)], Values::F64(vec![1.0, 2.0, 3.25]), time),
            variable("level", &[("level", levels)], Values::I32(vec![500, 850]), json!({"units": "hPa"})),
        ]);
        let folder = tempfile::tempdir().unwrap();
        for format in FORMATS {
            let path = file.write(folder.path(), format);
            let mut maps = open(&path, &at("level", Place::Value("850".into()))).unwrap();
            let labels: Vec<_> = maps.times().iter().map(|time| time.label.clone()).collect();
            assert_eq!(labels, ["1997-12-31", "1998-01-01", "1998-01-02T06:00"]);
            for step in [2, 0, 1] {
                let map = maps.read(step).unwrap();
                let unpacked = |p| match value(step, 1, p) {
                    -999 => f64::NAN,
                    stored => -0.5 * f64::from(stored) + 3.0,
                };
                let expected: Vec<_> = (0..pixels).map(unpacked).collect();
                assert_same(map.values(), &expected, &format!("{format:?} {order:?} {step}"));
                assert_eq!(map.time.unwrap().label, labels[step]);
            }
            let (error, _) = problem(open(&path, &Selection::default()));
            assert!(is(&error, ErrorKind::Ambiguous, "has several values along 'level'"));
            let level = Ask::Place { dimension: Some("level".to_owned()), place: None };
            assert_eq!(error.ask(), Some(&level));
            let (error, _) = problem(open(&path, &at("cell", Place::Index(0))));
            assert!(is(&error, ErrorKind::NotApplicable, "runs over the sphere"));
        }
    }
}

#[test]
fn what_means_no_value() {
    let values: Vec<f32> = ring_values().iter().map(|&v| v as f32).collect();
    let mut marked = values.clone();
    (marked[0], marked[1], marked[2], marked[3]) = (1e20, -1.6375e30, f32::INFINITY, -1.5);
    let mut expected = ring_values();
    expected[..3].fill(f64::NAN);
    expected[3] = -1.5;
    let grid = json!({"grid_mapping_name": "healpix", "refinement_level": 1, "indexing_scheme": "ring"});
    let filled = json!({"grid_mapping": "crs", "_FillValue": 1e20});
    let file = File::of([
        variable("t", &[("cell", 48)], Values::F32(marked), filled),
        variable("crs", &[], Values::I32(vec![0]), grid),
    ]);
    let folder = tempfile::tempdir().unwrap();
    for format in FORMATS {
        let map = crate::read(&file.write(folder.path(), format)).unwrap();
        assert_same(map.values(), &expected, &format!("{format:?}"));
    }
}
