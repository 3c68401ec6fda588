//! Every layout in which a map can be stored gives the same map.

use longan_formats::{Ask, ErrorKind, GridDescription, Indexing, TablePlace, describe};
use longan_grid::{CoordinateSystem, Ordering, UNSEEN};

use crate::*;
use longan_support::bytes::{Col, col, f32s, f64s, file, gzip, i16s, i32s, i64s, primary, table};

const RING: &[(&str, &str)] = &[("PIXTYPE", "'HEALPIX'"), ("ORDERING", "'RING'"), ("NSIDE", "2")];
const NESTED: &[(&str, &str)] = &[("PIXTYPE", "'HEALPIX'"), ("ORDERING", "'NESTED'"), ("NSIDE", "2")];

fn with<'a>(keys: &[(&'a str, &'a str)], more: &[(&'a str, &'a str)]) -> Vec<(&'a str, &'a str)> {
    [keys, more].concat()
}

/// A column whose keywords say how its numbers are meant.
fn meant<'a>(form: &'a str, bytes: Vec<u8>, keys: &'a [(&'a str, &'a str)]) -> Col<'a> {
    Col { name: "T", form, bytes, keys }
}

#[test]
fn rows_of_any_length() {
    let values = ring_values();
    for (rows, form) in [(48, "1D"), (48, "D"), (24, "2D"), (3, "16D"), (1, "48D")] {
        let map = read(&file(rows, &[col("T", form, f64s(&values))], RING)).unwrap();
        assert_same(map.values(), &values);
        assert_eq!((map.grid().nside(), map.ordering, map.name.as_str()), (2, Ordering::Ring, "T"));
    }
    for (rows, form) in [(48, "1E"), (3, "16E")] {
        assert_same(read(&file(rows, &[col("T", form, f32s(&values))], RING)).unwrap().values(), &values);
    }
}

#[test]
fn nested_order() {
    for (rows, form) in [(48, "1D"), (6, "8D")] {
        let map = read(&file(rows, &[col("T", form, f64s(&nested_values()))], NESTED)).unwrap();
        assert_same(map.values(), &ring_values());
        assert_eq!(map.ordering, Ordering::Nested);
    }
}

#[test]
fn any_nside_in_ring_order() {
    for nside in [1usize, 3, 5, 100] {
        let values: Vec<f64> = (0..12 * nside * nside).map(|p| p as f64).collect();
        let keys = [("ORDERING", "'RING'"), ("NSIDE", &*nside.to_string())];
        let map = read(&file(values.len(), &[col("T", "D", f64s(&values))], &keys)).unwrap();
        assert_same(map.values(), &values);
    }
    let keys = [("ORDERING", "'NESTED'"), ("NSIDE", "3")];
    let (error, _) = problem_with(&file(108, &[col("T", "D", f64s(&[0.0; 108]))], &keys), &Selection::default());
    assert_eq!(grid(&error), &longan_grid::Error::NotNested { nside: 3 });
}

#[test]
fn more_values_than_are_read_at_once() {
    // Twelve base pixels of 2^14 values each: more than a chunk, and rows that straddle chunks.
    let nside = 128usize;
    let nested: Vec<f64> = (0..12 * nside * nside).map(|p| p as f64).collect();
    let rows = nested.len() / 3072;
    let keys = [("ORDERING", "'NESTED'"), ("NSIDE", "128")];
    let map = read(&file(rows, &[col("T", "3072E", f32s(&nested))], &keys)).unwrap();
    let mut seen = vec![false; nested.len()];
    for (p, &value) in map.values().iter().enumerate() {
        let (theta, phi) = map.grid().centre(p);
        assert_eq!(cdshealpix::nested::hash(7, phi, std::f64::consts::FRAC_PI_2 - theta) as f64, value);
        assert!(!std::mem::replace(&mut seen[value as usize], true));
    }
    let map = read(&file(rows, &[col("T", "3072E", f32s(&nested))], &[("NSIDE", "128")])).unwrap();
    assert_same(map.values(), &nested);
    let pixels: Vec<i32> = (0..nested.len() as i32).rev().collect();
    let backward: Vec<f64> = nested.iter().rev().copied().collect();
    let columns = [col("PIXEL", "J", i32s(&pixels)), col("T", "E", f32s(&backward))];
    assert_same(read(&file(nested.len(), &columns, &[("NSIDE", "128")])).unwrap().values(), &nested);
}

#[test]
fn every_type_of_number() {
    let values = ring_values();
    let signed = |v: f64| v as i64;
    let bytes = |f: &dyn Fn(i64) -> Vec<u8>| values.iter().flat_map(|&v| f(signed(v))).collect::<Vec<u8>>();
    let columns = [
        meant("I", bytes(&|v| (v as i16).to_be_bytes().to_vec()), &[]),
        meant("J", bytes(&|v| (v as i32).to_be_bytes().to_vec()), &[]),
        meant("K", bytes(&|v| v.to_be_bytes().to_vec()), &[]),
        // Signed bytes and scaled numbers.
        meant("B", bytes(&|v| vec![(v + 128) as u8]), &[("TZERO", "-128")]),
        meant("B", bytes(&|v| vec![((v + 30) / 2) as u8]), &[("TSCAL", "2.0"), ("TZERO", "-30.0")]),
        meant("E", bytes(&|v| (v as f32 / 4.0).to_be_bytes().to_vec()), &[("TSCAL", "4.0")]),
    ];
    for column in columns {
        let form = column.form;
        let map = read(&file(48, &[column], RING)).unwrap();
        for (p, (f, e)) in map.values().iter().zip(&values).enumerate() {
            assert_eq!(f, e, "type {form}, pixel {p}");
        }
    }
}

#[test]
fn unsigned_integers() {
    let values: Vec<f64> = (0..48).map(|p| 30000.0 + 100.0 * f64::from(p)).collect();
    let shift = |v: f64, half: i128| (v as i128 - half) as i64;
    let columns = [
        meant(
            "I",
            values.iter().flat_map(|&v| (shift(v, 1 << 15) as i16).to_be_bytes()).collect(),
            &[("TZERO", "32768")],
        ),
        meant(
            "J",
            values.iter().flat_map(|&v| (shift(v, 1 << 31) as i32).to_be_bytes()).collect(),
            &[("TZERO", "2147483648")],
        ),
        meant(
            "K",
            values.iter().flat_map(|&v| shift(v, 1 << 63).to_be_bytes()).collect(),
            &[("TZERO", "9223372036854775808")],
        ),
    ];
    for column in columns {
        assert_same(read(&file(48, &[column], RING)).unwrap().values(), &values);
    }
}

#[test]
fn truth_values_and_bits() {
    let truth: Vec<f64> = (0..48).map(|p| f64::from(u8::from(p % 3 == 0 || p == 47))).collect();
    let letters = |rows: usize| {
        let bytes = truth.iter().map(|&t| if t == 1.0 { b'T' } else { b'F' }).collect();
        (rows, col("MASK", if rows == 48 { "L" } else { "16L" }, bytes))
    };
    let bits = |per_row: usize, form: &'static str| {
        let pack = |row: &[f64]| {
            let byte = |bits: &[f64]| bits.iter().enumerate().map(|(i, &b)| (b as u8) << (7 - i)).sum::<u8>();
            row.chunks(8).map(byte).collect::<Vec<u8>>()
        };
        (48 / per_row, col("MASK", form, truth.chunks(per_row).flat_map(pack).collect()))
    };
    for (rows, column) in [letters(48), letters(3), bits(1, "X"), bits(6, "6X"), bits(12, "12X"), bits(48, "48X")] {
        let form = column.form;
        let map = read(&file(rows, &[column], RING)).unwrap();
        assert_eq!(map.values(), truth, "{form}");
    }
    let mut bytes = vec![b'F'; 48];
    bytes[5] = 0;
    let map = read(&file(48, &[col("MASK", "L", bytes)], RING)).unwrap();
    assert_eq!(
        map.values().iter().map(|v| v.is_nan()).collect::<Vec<_>>(),
        (0..48).map(|p| p == 5).collect::<Vec<_>>()
    );
}

#[test]
fn whatever_means_no_value_is_masked() {
    let mut stored = ring_values();
    let near = UNSEEN * (1.0 + 9e-6);
    for (p, bad) in [UNSEEN, near, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -999.0, -999.001].into_iter().enumerate()
    {
        stored[p] = bad;
    }
    let mut expected = ring_values();
    expected[..5].fill(f64::NAN);
    expected[5..7].copy_from_slice(&stored[5..7]);
    let columns = || [col("T", "D", f64s(&stored))];
    assert_same(read(&file(48, &columns(), RING)).unwrap().values(), &expected);

    // The file's own marker, in addition.
    expected[5..7].fill(f64::NAN);
    assert_same(read(&file(48, &columns(), &with(RING, &[("BAD_DATA", "-999.0")]))).unwrap().values(), &expected);
    assert_same(read(&file(48, &columns(), &with(RING, &[("BAD_DATA", "-9.99D+2")]))).unwrap().values(), &expected);

    // The same in single precision and in NESTED order.
    let map = read(&file(48, &[col("T", "E", f32s(&stored))], &with(RING, &[("BAD_DATA", "-999.0")]))).unwrap();
    assert_eq!(map.values().iter().filter(|v| v.is_nan()).count(), 7);
    let nested: Vec<f64> = NEST_TO_RING_2.iter().map(|&p| stored[p]).collect();
    let map = read(&file(48, &[col("T", "D", f64s(&nested))], &with(NESTED, &[("BAD_DATA", "-999.0")]))).unwrap();
    assert_same(map.values(), &expected);

    // Just beyond the tolerance is a value.
    stored[1] = UNSEEN * (1.0 + 1.1e-5);
    let map = read(&file(48, &[col("T", "D", f64s(&stored))], RING)).unwrap();
    assert_eq!(map.values()[1], stored[1]);
}

#[test]
fn null_integers_are_masked_before_scaling() {
    let stored: Vec<i16> = (0..48).map(|p| if p % 5 == 0 { -32768 } else { p }).collect();
    let keys = [("TNULL", "-32768"), ("TSCAL", "0.5"), ("TZERO", "1.0")];
    let map = read(&file(48, &[meant("I", i16s(&stored), &keys)], RING)).unwrap();
    let expected: Vec<f64> = (0..48).map(|p| if p % 5 == 0 { f64::NAN } else { 0.5 * f64::from(p) + 1.0 }).collect();
    assert_same(map.values(), &expected);
    let map = read(&file(48, &[meant("I", i16s(&stored), &keys[1..])], RING)).unwrap();
    assert_eq!(map.values()[0], -16383.0);
}

#[test]
fn several_columns_of_different_types() {
    let (a, b) = (ring_values(), vec![7.0; 48]);
    let columns = [
        Col { name: "I_STOKES", form: "16D", bytes: f64s(&a), keys: &[("TUNIT", "'uK'")] },
        col("HITS", "16J", i32s(&[3; 48])),
        col("217", "16E", f32s(&b)),
        col("i_stokes", "16E", f32s(&[1.0; 48])),
    ];
    let bytes = file(3, &columns, RING);
    assert_same(read(&bytes).unwrap().values(), &a);
    let map = read_with(&bytes, &field("1")).unwrap();
    assert_same(map.values(), &[3.0; 48]);
    assert_eq!((map.name.as_str(), map.unit), ("HITS", None));
    assert_same(read_with(&bytes, &field("hits")).unwrap().values(), &[3.0; 48]);
    // A name of digits is found where there is no such number.
    assert_same(read_with(&bytes, &field("217")).unwrap().values(), &b);
    // An exact match wins, and without one a name of several is none.
    assert_same(read_with(&bytes, &field("i_stokes")).unwrap().values(), &[1.0; 48]);
    let map = read_with(&bytes, &field("I_STOKES")).unwrap();
    assert_same(map.values(), &a);
    assert_eq!(map.unit.as_deref(), Some("uK"));
    let (error, told) = problem_with(&bytes, &field("I-Stokes"));
    assert!(is(&error, ErrorKind::Ambiguous, "of HDU 1; choose one by its number"));
    assert_eq!(error.ask(), Some(&Ask::Variable));
    assert!(told.contains("0 'I_STOKES', 3 'i_stokes'") && !told.contains("HITS"), "{told}");

    for unknown in ["Q_STOKES", "4", ""] {
        let (error, told) = problem_with(&bytes, &field(unknown));
        assert!(is(&error, ErrorKind::Unknown, "HDU 1 has no field"));
        assert_eq!(error.ask(), Some(&Ask::Variable));
        assert!(told.contains("0 'I_STOKES', 1 'HITS', 2 '217', 3 'i_stokes'"), "{told}");
    }
}

/// The even pixels of the map, in an order of no kind.
fn half() -> (Vec<i64>, Vec<f64>, Vec<f64>) {
    let pixels: Vec<i64> = (0..24).map(|i| (i * 7 % 24) * 2).collect();
    let values = pixels.iter().map(|&p| ring_values()[p as usize]).collect();
    let expected = ring_values().iter().enumerate().map(|(p, &v)| if p % 2 == 0 { v } else { f64::NAN }).collect();
    (pixels, values, expected)
}

#[test]
fn planes_of_a_sparse_table() {
    // Plane 0 holds every second pixel, plane 1 the same shifted by one and all of value 5.
    let (pixels, values, expected) = half();
    let keys: Vec<i64> = pixels.iter().copied().chain(pixels.iter().map(|p| 48 + p + 1)).collect();
    let both: Vec<f64> = values.iter().copied().chain([5.0; 24]).collect();
    let sparse = with(RING, &[("INDXSCHM", "'SPARSE'")]);
    for (rows, key_form, value_form) in [(48, "K", "D"), (1, "48K", "48D")] {
        for name in ["KEY", "IDX", "PIX"] {
            let columns = [col(name, key_form, i64s(&keys)), col("VALUE", value_form, f64s(&both))];
            let bytes = file(rows, &columns, &sparse);
            assert_same(read(&bytes).unwrap().values(), &expected);
            let other = read_with(&bytes, &field("1")).unwrap();
            let odd: Vec<f64> = (0..48).map(|p| if p % 2 == 1 { 5.0 } else { f64::NAN }).collect();
            assert_same(other.values(), &odd);
        }
    }
}

#[test]
fn pixels_named_by_an_index_column() {
    let (pixels, values, expected) = half();
    let explicit = with(RING, &[("INDXSCHM", "'EXPLICIT'"), ("OBJECT", "'PARTIAL'")]);
    for name in ["PIXEL", "pixel", "PIX", "Pixels", "IPIX", "HPXINDEX", "INDEX"] {
        for keys in [&explicit[..], RING] {
            let columns =
                [col(name, "K", i64s(&pixels)), col("T", "D", f64s(&values)), col("N", "D", f64s(&[1.0; 24]))];
            let bytes = file(24, &columns, keys);
            let map = read(&bytes).unwrap();
            assert_same(map.values(), &expected);
            assert_eq!(map.name, "T");
            // The index column is not counted.
            assert_eq!(read_with(&bytes, &field("1")).unwrap().name, "N");
        }
    }
    // Any name will do where the header says that there are indices; the first integers are they.
    let columns = [
        col("T", "D", f64s(&values)),
        col("WHERE", "J", i32s(&pixels.iter().map(|&p| p as i32).collect::<Vec<_>>())),
        col("HITS", "J", i32s(&[0; 24])),
    ];
    assert_same(read(&file(24, &columns, &explicit)).unwrap().values(), &expected);
    // Several pixels in a row, and unsigned numbers of them.
    let shifted: Vec<i16> = pixels.iter().map(|&p| (p - 32768) as i16).collect();
    let index = Col { name: "PIXEL", form: "6I", bytes: i16s(&shifted), keys: &[("TZERO", "32768")] };
    assert_same(read(&file(4, &[index, col("T", "6D", f64s(&values))], RING)).unwrap().values(), &expected);
}

#[test]
fn an_index_is_not_taken_for_one_where_it_cannot_be() {
    // A map of the spectral index, and a full map that lists its pixels beside it.
    let columns = [col("INDEX", "D", f64s(&ring_values()))];
    assert_eq!(read(&file(48, &columns, RING)).unwrap().name, "INDEX");
    let backward: Vec<i64> = (0..48).rev().collect();
    let columns = [col("PIXEL", "K", i64s(&backward)), col("T", "D", f64s(&ring_values()))];
    let bytes = file(48, &columns, &with(RING, &[("INDXSCHM", "'IMPLICIT'")]));
    assert_same(read_with(&bytes, &field("T")).unwrap().values(), &ring_values());
    assert_eq!(read_with(&bytes, &field("0")).unwrap().name, "PIXEL");
}

#[test]
fn indices_in_nested_order() {
    let pixels: Vec<i64> = (0..48).step_by(3).collect();
    let values: Vec<f64> = pixels.iter().map(|&p| nested_values()[p as usize]).collect();
    let columns = [col("PIXEL", "K", i64s(&pixels)), col("T", "D", f64s(&values))];
    let map = read(&file(16, &columns, NESTED)).unwrap();
    let mut expected = vec![f64::NAN; 48];
    for p in (0..48).step_by(3) {
        expected[NEST_TO_RING_2[p]] = ring_values()[NEST_TO_RING_2[p]];
    }
    assert_same(map.values(), &expected);
}

#[test]
fn runs_of_pixels_from_an_index() {
    let starts = [40, 8, 16];
    let run = |p: i64| (p..p + 4).map(|p| nested_values()[p as usize]).collect::<Vec<_>>();
    let values: Vec<f64> = starts.iter().flat_map(|&p| run(p)).collect();
    let mut expected = vec![f64::NAN; 48];
    for p in starts.iter().flat_map(|&p| p as usize..p as usize + 4) {
        expected[NEST_TO_RING_2[p]] = nested_values()[p];
    }
    let columns = || [col("PIXEL", "K", i64s(&starts)), col("T", "4D", f64s(&values))];
    for grain in [&[][..], &[("GRAIN", "4")], &[("GRAIN", "1")]] {
        let keys = with(NESTED, &with(&[("INDXSCHM", "'EXPLICIT'")], grain));
        assert_same(read(&file(3, &columns(), &keys)).unwrap().values(), &expected);
    }
    let (error, told) = problem_with(&file(3, &columns(), &with(NESTED, &[("GRAIN", "8")])), &Selection::default());
    assert!(is(&error, ErrorKind::Invalid, "for 1 pixel numbers (GRAIN 8)") && told.contains("has 4 values"), "{told}");
    let columns = [col("PIXEL", "3K", i64s(&starts)), col("T", "4D", f64s(&values[..4]))];
    let (error, _) = problem_with(&file(1, &columns, NESTED), &Selection::default());
    assert!(is(&error, ErrorKind::Invalid, "for 3 pixel numbers") && error.to_string().contains("has 4 values"));
}

#[test]
fn wrong_indices_are_errors() {
    let values = f64s(&[1.0, 2.0, f64::NAN]);
    for (pixels, outside) in [([0, 48, 5], 48), ([0, -1, 5], -1), ([0, 5, i64::MAX], i128::from(i64::MAX))] {
        let columns = [col("PIXEL", "K", i64s(&pixels)), col("T", "D", values.clone())];
        let (error, told) = problem_with(&file(3, &columns, RING), &Selection::default());
        assert!(
            is(&error, ErrorKind::Invalid, &format!("to pixel {outside}, but Nside 2 has pixels 0 to 47")),
            "{told}"
        );
    }
    // Twice the same pixel, even where one of its values is masked.
    let columns = [col("PIXEL", "K", i64s(&[5, 3, 5])), col("T", "D", values.clone())];
    let (error, told) = problem_with(&file(3, &columns, RING), &Selection::default());
    assert!(is(&error, ErrorKind::Invalid, "gives pixel 5 more than one value"), "{told}");
    // Runs that overlap or leave the grid.
    let columns = [col("PIXEL", "K", i64s(&[0, 2])), col("T", "3D", f64s(&[0.0; 6]))];
    let (error, _) = problem_with(&file(2, &columns, RING), &Selection::default());
    assert!(is(&error, ErrorKind::Invalid, "gives pixel 2 more than one value"));
    let columns = [col("PIXEL", "K", i64s(&[0, 46])), col("T", "3D", f64s(&[0.0; 6]))];
    let (error, _) = problem_with(&file(2, &columns, RING), &Selection::default());
    assert!(is(&error, ErrorKind::Invalid, "gives a value to pixel 48, but"));
}

#[test]
fn part_of_the_sky_between_two_pixels() {
    let keys = [("FIRSTPIX", "10"), ("LASTPIX", "19")];
    let mut expected = vec![f64::NAN; 48];
    expected[10..20].copy_from_slice(&ring_values()[10..20]);
    let bytes = file(10, &[col("T", "D", f64s(&ring_values()[10..20]))], &with(RING, &keys));
    assert_same(read(&bytes).unwrap().values(), &expected);
    let mut padded = ring_values()[10..20].to_vec();
    padded.extend([99.0; 2]);
    let bytes = file(3, &[col("T", "4D", f64s(&padded))], &with(RING, &keys));
    assert_same(read(&bytes).unwrap().values(), &expected);

    let mut expected = vec![f64::NAN; 48];
    for p in 10..20 {
        expected[NEST_TO_RING_2[p]] = nested_values()[p];
    }
    let bytes = file(10, &[col("T", "D", f64s(&nested_values()[10..20]))], &with(NESTED, &keys));
    assert_same(read(&bytes).unwrap().values(), &expected);
}

#[test]
fn the_last_row_may_be_padded() {
    let mut padded = ring_values();
    padded.extend([1e9; 7]);
    let bytes = file(5, &[col("T", "11D", f64s(&padded))], RING);
    assert_same(read(&bytes).unwrap().values(), &ring_values());
    // A whole row too many is not padding.
    let bytes = file(7, &[col("T", "8D", f64s(&[0.0; 56]))], RING);
    let (error, _) = problem_with(&bytes, &Selection::default());
    assert!(is(&error, ErrorKind::Invalid, "has Nside 2, so 48 pixels, but"));
    assert!(error.to_string().contains("holds 56 values"));
}

#[test]
fn gzip_streams() {
    let bytes = file(3, &[col("T", "16D", f64s(&ring_values()))], RING);
    assert_same(read(&gzip(&bytes)).unwrap().values(), &ring_values());
    // Of several members, as bgzip and `cat a.gz b.gz` make them.
    let members = [gzip(&bytes[..4000]), gzip(&bytes[4000..])].concat();
    assert_same(read(&members).unwrap().values(), &ring_values());
}

#[test]
fn a_file_without_its_last_padding() {
    let bytes = file(3, &[col("T", "16D", f64s(&ring_values()))], RING);
    let end = 3 * 2880 - 2880 + 48 * 8;
    for bytes in [bytes[..end].to_vec(), gzip(&bytes[..end]), [&bytes[..], b"junk\n"].concat()] {
        assert_same(read(&bytes).unwrap().values(), &ring_values());
    }
    for bytes in [bytes[..end - 1].to_vec(), gzip(&bytes[..end - 1])] {
        let (error, told) = problem_with(&bytes, &Selection::default());
        assert!(is(&error, ErrorKind::Truncated, "HDU 1 promises"));
        assert!(told.contains(&end.to_string()) && told.contains(&(end - 1).to_string()), "{told}");
    }
}

#[test]
fn columns_that_are_no_maps() {
    let t = || col("T", "D", f64s(&ring_values()));
    for (form, width, found) in
        [("4A", 4, "text"), ("C", 8, "complex"), ("M", 16, "complex"), ("PD(9)", 8, "varying"), ("0D", 0, "empty")]
    {
        let bytes = file(48, &[t(), col("OTHER", form, vec![0; 48 * width])], RING);
        assert_same(read(&bytes).unwrap().values(), &ring_values());
        let (error, told) = problem_with(&bytes, &field("OTHER"));
        assert!(is(&error, ErrorKind::NotNumbers, "column 'OTHER' of HDU 1 is "), "{form}: {told}");
        assert!(
            error.found().is_some_and(|found| told.contains(&format!("HDU 1 is {found}, which"))),
            "{form}: {told}"
        );
        assert!(told.contains(found), "{told}");
    }
}

#[test]
fn the_hdu_to_read() {
    let keys = with(RING, &[("EXTNAME", "'SKY'")]);
    let sky = |value: f64| table(48, &[col("T", "D", f64s(&[value; 48]))], &keys);
    let catalogue = table(12, &[col("MASS", "D", f64s(&[0.0; 12]))], &[("EXTNAME", "'CATALOGUE'")]);
    let bytes = [primary(), catalogue, sky(1.0), sky(2.0)].concat();
    let at = |hdu| Selection { hdu: Some(hdu), ..Selection::default() };
    // A table that only happens to have twelve rows does not come before one that says it is HEALPix.
    assert_same(read(&bytes).unwrap().values(), &[1.0; 48]);
    assert_same(read_with(&bytes, &at(3)).unwrap().values(), &[2.0; 48]);
    assert_same(read_with(&bytes, &at(1)).unwrap().values(), &[0.0; 12]);
    let (error, told) = problem_with(&bytes, &at(0));
    assert!(is(&error, ErrorKind::NotApplicable, "HDU 0 is ") && error.ask() == Some(&Ask::Hdu));
    assert!(told.contains("HDU 0 is empty") && told.contains("HDU 2 ('SKY'"), "{told}");
    let (error, told) = problem_with(&bytes, &at(4));
    assert!(is(&error, ErrorKind::Unknown, "there is no HDU 4") && error.ask() == Some(&Ask::Hdu));
    assert!(told.contains("HDU 1 ('CATALOGUE', a table of 1 columns and 12 rows)"), "{told}");

    let description = describe(&scratch(&bytes).path).unwrap();
    let hdus = description.tables.iter().map(|t| match t.place {
        TablePlace::Hdu { hdu, .. } => hdu,
        _ => panic!("{:?}", t.place),
    });
    assert_eq!(hdus.collect::<Vec<_>>(), [2, 3]);
}

#[test]
fn what_a_file_is_said_to_hold() {
    let (pixels, values, _) = half();
    let columns = [
        col("PIXEL", "K", i64s(&pixels)),
        Col { name: "T", form: "D", bytes: f64s(&values), keys: &[("TUNIT", "'K_CMB'")] },
        col("S", "D", f64s(&values)),
    ];
    let whole = table(3, &[col("T", "16D", f64s(&ring_values()))], &[("PIXTYPE", "'HEALPIX'")]);
    let part = table(24, &columns, &with(NESTED, &[("COORDSYS", "'C'"), ("EXTNAME", "'CUT'")]));
    let path = scratch(&[primary(), whole, part].concat());
    let description = describe(&path.path).unwrap();
    assert_eq!(description.format, "HEALPix FITS");
    let [whole, part] = &description.tables[..] else { panic!("two tables") };
    assert_eq!(whole.place, TablePlace::Hdu { hdu: 1, name: None });
    assert_eq!(part.place, TablePlace::Hdu { hdu: 2, name: Some("CUT".into()) });
    let grid = |ordering, ordering_assumed, coordinates, indexing, pixels| GridDescription::Healpix {
        nside: 2,
        ordering,
        ordering_assumed,
        coordinates,
        indexing,
        pixels,
    };
    assert_eq!(whole.grid, grid(Ordering::Ring, true, None, Indexing::Implicit, 48));
    let celestial = Some(CoordinateSystem::Celestial);
    assert_eq!(part.grid, grid(Ordering::Nested, false, celestial, Indexing::Explicit, 24));
    let fields: Vec<_> = part.fields.iter().map(|f| (f.name.as_str(), f.unit.as_deref())).collect();
    assert_eq!(fields, [("T", Some("K_CMB")), ("S", None)]);
}
