//! Multi-order maps brought to one grid.

use longan_formats::{Ask, ErrorKind, GridDescription, Indexing, describe};

use crate::*;
use longan_support::bytes::{Col, col, f64s, file, i64s};

fn uniq(order: u32, pixel: i64) -> i64 {
    4i64.pow(order + 1) + pixel
}

const KEYS: &[(&str, &str)] = &[("PIXTYPE", "'HEALPIX'"), ("ORDERING", "'NUNIQ'"), ("INDXSCHM", "'EXPLICIT'")];

fn cells(cells: &[(i64, f64)]) -> Vec<u8> {
    let (uniqs, values): (Vec<_>, Vec<_>) = cells.iter().copied().unzip();
    file(cells.len(), &[col("UNIQ", "K", i64s(&uniqs)), col("PROBDENSITY", "D", f64s(&values))], KEYS)
}

fn at(nside: usize) -> Selection {
    Selection { nside: Some(nside), ..Selection::default() }
}

/// Values at Nside 2 in RING order, from (NESTED pixel, value).
fn nside_2(pixels: impl IntoIterator<Item = (usize, f64)>) -> Vec<f64> {
    let mut values = vec![f64::NAN; 48];
    for (p, value) in pixels {
        values[NEST_TO_RING_2[p]] = value;
    }
    values
}

#[test]
fn coarse_cells_are_copied_and_fine_ones_averaged() {
    let bytes = cells(&[
        // Base pixel 3, out of order.
        (uniq(0, 3), 7.0),
        (uniq(1, 0), 1.0),
        // The four quarters of pixel 1 of order 1, one of them in quarters again.
        (uniq(2, 5), 20.0),
        (uniq(2, 4), 10.0),
        (uniq(2, 6), 30.0),
        (uniq(3, 28), 1.0),
        (uniq(3, 30), 2.0),
        (uniq(3, 29), 3.0),
        (uniq(3, 31), 6.0),
        // Half of pixel 2, and of that one half masked.
        (uniq(2, 8), 5.0),
        (uniq(2, 9), f64::NAN),
        // Nothing but a masked quarter of pixel 47.
        (uniq(2, 191), longan_grid::UNSEEN),
    ]);
    let map = read_with(&bytes, &at(2)).unwrap();
    let mut expected = vec![(0, 1.0), (1, (20.0 + 10.0 + 30.0 + 3.0) / 4.0), (2, 5.0)];
    expected.extend((12..16).map(|p| (p, 7.0)));
    assert_same(map.values(), &nside_2(expected));
    assert_eq!((map.name.as_str(), map.ordering), ("PROBDENSITY", longan_grid::Ordering::Nested));

    // At Nside 1 everything is averaged by its area: the quarters weigh a quarter of pixel 0 of order 1.
    let map = read_with(&bytes, &at(1)).unwrap();
    let mean = (1.0 + (20.0 + 10.0 + 30.0 + 3.0) / 4.0 + 5.0 / 4.0) / 2.25;
    assert!((map.values()[0] - mean).abs() < 1e-14);
    assert_same(&map.values()[1..], &[vec![f64::NAN; 2], vec![7.0], vec![f64::NAN; 8]].concat());

    // Unasked, the finest cells are what they are, and the mean over the sphere stays.
    let map = read(&bytes).unwrap();
    assert_eq!(map.grid().nside(), 8);
    let count = |value: f64| map.values().iter().filter(|&&v| v == value).count();
    assert_eq!([7.0, 1.0, 20.0, 6.0, 5.0].map(count), [64, 16 + 1, 4, 1, 4]);
    assert_eq!(map.values().iter().filter(|v| v.is_nan()).count(), 768 - 64 - 32 - 4);
    // Finer than the finest cells.
    assert_eq!(read_with(&bytes, &at(16)).unwrap().values().iter().filter(|&&v| v == 6.0).count(), 4);
}

#[test]
fn fine_cells_need_no_fine_grid() {
    // The whole sphere at order 0 but for one pixel of order 29, its siblings, and those of all its ancestors.
    let mut list: Vec<_> = (0..11).map(|p| (uniq(0, p), 1.0)).collect();
    for order in 1..=29 {
        list.extend((0..3).map(|i| (uniq(order, (12 << (2 * order)) - 4 + i), 3.0)));
    }
    list.push((uniq(29, (12 << 58) - 1), 3.0));
    let bytes = cells(&list);
    let map = read_with(&bytes, &at(1)).unwrap();
    assert_same(map.values(), &[vec![1.0; 11], vec![3.0]].concat());
    let map = read_with(&bytes, &at(64)).unwrap();
    assert_eq!(map.values().iter().filter(|&&v| v == 3.0).count(), 4096);
    assert_eq!(map.values().iter().filter(|&&v| v == 1.0).count(), 11 * 4096);

    let (error, told) = problem_with(&bytes, &Selection::default());
    assert!(is(&error, ErrorKind::OutOfRange, "reaches Nside 536870912, beyond 8192"), "{told}");
    assert_eq!(error.ask(), Some(&Ask::Nside));
    assert!(matches!(grid(&problem_with(&bytes, &at(1 << 29)).0), longan_grid::Error::Memory { .. }));
    for nside in [0, 3, 100, 1 << 30] {
        let error = problem_with(&bytes, &at(nside)).0;
        assert!(is(&error, ErrorKind::OutOfRange, &format!("from 1 to 2^29, not to {nside}")));
        assert_eq!(error.ask(), Some(&Ask::Nside));
    }
}

#[test]
fn more_cells_than_are_read_at_once() {
    let pixels = 12 * 128 * 128;
    let all: Vec<_> = (0..pixels).rev().map(|p| (uniq(7, p), p as f64)).collect();
    let map = read_with(&cells(&all), &at(2)).unwrap();
    assert_same(map.values(), &nside_2((0..48).map(|p| (p, 4096.0 * p as f64 + 2047.5))));
    let same = read(&cells(&all)).unwrap();
    assert_eq!(same.values()[0], 16383.0); // The northernmost corner of base pixel 0.
    let mut sorted = same.values().to_vec();
    sorted.sort_by(f64::total_cmp);
    assert_same(&sorted, &(0..pixels).map(|p| p as f64).collect::<Vec<_>>());
}

#[test]
fn recognised_by_column_or_keyword() {
    let values = || col("P", "D", f64s(&[1.0; 12]));
    let numbers: Vec<i64> = (0..12).map(|p| uniq(0, p)).collect();
    // By the column alone, by the keyword alone, and with NSIDE there though it means nothing.
    let by_column = file(12, &[col("uniq", "K", i64s(&numbers)), values()], &[]);
    let by_keyword = file(12, &[values(), col("CELL", "K", i64s(&numbers))], &[("ORDERING", "'nuniq'")]);
    let with_nside = file(12, &[col("UNIQ", "K", i64s(&numbers)), values()], &[("NSIDE", "512"), ("MOCORDER", "9")]);
    for bytes in [by_column, by_keyword, with_nside] {
        assert_same(read(&bytes).unwrap().values(), &[1.0; 12]);
        let table = &describe(&scratch(&bytes).path).unwrap().tables[0];
        let is_multi_order =
            matches!(table.grid, GridDescription::Healpix { indexing: Indexing::MultiOrder, nside: 1, pixels: 12, .. });
        assert!(is_multi_order, "{:?}", table.grid);
        assert_eq!(table.fields.len(), 1);
    }
    // Unsigned, as LIGO's older files have it.
    let shifted: Vec<i64> = numbers.iter().map(|&n| n.wrapping_add(i64::MIN)).collect();
    let column = Col { name: "UNIQ", form: "K", bytes: i64s(&shifted), keys: &[("TZERO", "9223372036854775808")] };
    assert_same(read(&file(12, &[column, values()], KEYS)).unwrap().values(), &[1.0; 12]);
}

#[test]
fn wrong_cells_are_errors() {
    for (wrong, row) in [(3, 2), (0, 2), (-5, 2), (uniq(29, 12 << 58), 2), (i64::MAX, 2)] {
        let (error, told) = problem_with(&cells(&[(uniq(0, 3), 1.0), (wrong, 2.0)]), &Selection::default());
        assert!(is(&error, ErrorKind::Invalid, &format!("has UNIQ = {wrong} in row {row} (from 1)")), "{told}");
    }
    for (a, b) in [
        (uniq(0, 3), uniq(0, 3)),
        (uniq(0, 3), uniq(1, 12)),
        (uniq(0, 3), uniq(1, 13)),
        (uniq(0, 3), uniq(1, 15)),
        (uniq(1, 12), uniq(0, 3)),
        (uniq(5, 3000), uniq(29, 3000 << 48)),
    ] {
        for (a, b) in [(a, b), (b, a)] {
            let (error, told) = problem_with(&cells(&[(uniq(0, 1), 1.0), (a, 1.0), (b, f64::NAN)]), &at(1));
            let either = [(a, b), (b, a)].map(|(a, b)| format!("the cells UNIQ = {a} and {b} of HDU 1 overlap"));
            assert!(either.iter().any(|part| is(&error, ErrorKind::Invalid, part)), "{told}");
        }
    }
    let columns = [col("UNIQ", "K", i64s(&[uniq(0, 0), uniq(0, 1)])), col("P", "2D", f64s(&[0.0; 4]))];
    let error = problem_with(&file(2, &columns, KEYS), &Selection::default()).0;
    assert!(is(&error, ErrorKind::Invalid, "has 2 values in column"));
}

#[test]
fn a_resolution_asked_of_other_maps() {
    let implicit = file(3, &[col("T", "16D", f64s(&ring_values()))], &[("NSIDE", "2")]);
    let columns = [col("PIXEL", "K", i64s(&[1, 2])), col("T", "D", f64s(&[1.0; 2]))];
    for bytes in [implicit, file(2, &columns, &[("NSIDE", "2")])] {
        let (error, told) = problem_with(&bytes, &at(1));
        assert!(is(&error, ErrorKind::NotApplicable, "cannot be read at Nside 1; leave the Nside out"), "{told}");
        assert_eq!(error.ask(), Some(&Ask::Nside));
    }
}
