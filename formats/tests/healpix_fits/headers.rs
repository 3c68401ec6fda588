//! Headers with keywords missing, misspelt, wrong or absurd.

use longan_formats::{
    Card, CardValue, Column, ErrorKind, Extension, GridDescription, HealpixFile, describe, write_healpix,
};
use longan_grid::{CoordinateSystem, Healpix, Ordering};

use crate::*;
use longan_support::bytes::{Col, col, f64s, file, header, i64s, picture, primary, table};

/// A full map of Nside 2 with these keywords.
fn with_keys(keys: &[(&str, &str)]) -> Vec<u8> {
    file(3, &[col("T", "16D", f64s(&ring_values()))], keys)
}

/// Whether the first table of a file is said to have no ordering of its own.
fn ordering_assumed(bytes: &[u8]) -> bool {
    let grid = describe(&scratch(bytes).path).unwrap().tables[0].grid.clone();
    matches!(grid, GridDescription::Healpix { ordering_assumed: true, .. })
}

#[test]
fn nside_is_inferred() {
    for keys in [&[("PIXTYPE", "'HEALPIX'")][..], &[("ORDERING", "'RING'")], &[("NSIDE", "'   '")], &[]] {
        let map = read(&with_keys(keys)).unwrap();
        assert_same(map.values(), &ring_values());
    }
    let keys = [("PIXTYPE", "'HEALPIX'")];
    let bytes = file(47, &[col("T", "D", f64s(&ring_values()[..47]))], &keys);
    let (error, told) = problem_with(&bytes, &Selection::default());
    assert!(is(&error, ErrorKind::Incomplete, "HDU 1 has no NSIDE, and its 47 values"), "{told}");
    let columns = [col("PIXEL", "K", i64s(&[1, 2])), col("T", "D", f64s(&[1.0; 2]))];
    let (error, told) = problem_with(&file(2, &columns, &keys), &Selection::default());
    assert!(
        is(&error, ErrorKind::Incomplete, "has no NSIDE to say of which grid") && told.contains("add NSIDE"),
        "{told}"
    );
    let keys = [("ORDERING", "'NESTED'")];
    let bytes = file(108, &[col("T", "D", f64s(&[0.0; 108]))], &keys);
    let error = problem_with(&bytes, &Selection::default()).0;
    assert_eq!(grid(&error), &longan_grid::Error::NotNested { nside: 3 });
    assert_eq!(error.kind(), ErrorKind::Unsupported);
}

#[test]
fn nside_in_other_notations() {
    for nside in ["2", "'2'", "'2       '", "2.0", "2.", "'2.0'", "0.2E1", "0.2D1"] {
        assert_eq!(read(&with_keys(&[("NSIDE", nside)])).unwrap().grid().nside(), 2, "{nside}");
    }
}

#[test]
fn impossible_nsides() {
    for nside in ["0", "-2", "1000000000000", "2.5", "'two'", "T", "1E300", "99999999999999999999999999", "1073741824"]
    {
        let (error, told) = problem_with(&with_keys(&[("NSIDE", nside)]), &Selection::default());
        assert!(is(&error, ErrorKind::Invalid, "HDU 1 has NSIDE = "), "{nside}: {told}");
        let error = describe(&scratch(&with_keys(&[("NSIDE", nside)])).path).unwrap_err();
        assert!(error.path().is_some());
    }
    for (nside, expected) in [("4", 192), ("1", 12), ("536870912", 3458764513820540928_u64)] {
        let (error, told) = problem_with(&with_keys(&[("NSIDE", nside)]), &Selection::default());
        assert!(is(&error, ErrorKind::Invalid, &format!("so {expected} pixels, but column")), "{told}");
        assert!(told.contains(&format!("Nside {nside}")) && told.contains("holds 48 values"), "{told}");
    }
    // A grid that no memory holds, of which the file has two pixels.
    let columns = [col("PIXEL", "K", i64s(&[1, 2])), col("T", "D", f64s(&[1.0; 2]))];
    let (error, told) = problem_with(&file(2, &columns, &[("NSIDE", "536870912")]), &Selection::default());
    assert!(matches!(grid(&error), longan_grid::Error::Memory { nside: 536870912, .. }), "{told}");
    assert_eq!(error.kind(), ErrorKind::NoMemory);
}

#[test]
fn spellings_of_the_ordering() {
    for ordering in ["RING", "ring", "Ring    ", " RING"] {
        let bytes = with_keys(&[("ORDERING", &format!("'{ordering}'"))]);
        assert_eq!(read(&bytes).unwrap().ordering, Ordering::Ring);
        assert!(!ordering_assumed(&bytes));
    }
    for ordering in ["NESTED", "nested", "Nest", "NEST"] {
        let bytes = with_keys(&[("ORDERING", &format!("'{ordering}'"))]);
        assert_eq!(read(&bytes).unwrap().ordering, Ordering::Nested);
    }
    for ordering in ["'UNKNOWN'", "1", "'RINGS'"] {
        let (error, told) = problem_with(&with_keys(&[("ORDERING", ordering)]), &Selection::default());
        assert!(is(&error, ErrorKind::Invalid, " has ORDERING = "), "{told}");
    }
    assert!(ordering_assumed(&with_keys(&[("NSIDE", "2")])));
}

#[test]
fn coordinate_systems() {
    for (value, expected) in [
        ("'G'", Some(CoordinateSystem::Galactic)),
        ("'GAL'", Some(CoordinateSystem::Galactic)),
        ("'ecliptic'", Some(CoordinateSystem::Ecliptic)),
        ("'C'", Some(CoordinateSystem::Celestial)),
        ("'unknown'", None),
        ("''", None),
    ] {
        assert_eq!(read(&with_keys(&[("COORDSYS", value)])).unwrap().coordinates, expected, "{value}");
    }
    assert_eq!(read(&with_keys(&[])).unwrap().coordinates, None);
}

#[test]
fn keywords_that_are_wrong_but_not_needed() {
    let keys = [("NSIDE", "2"), ("NPIX", "786432"), ("FIRSTPIX", "1"), ("LASTPIX", "-1"), ("POLAR", "'.true.'")];
    assert_same(read(&with_keys(&keys)).unwrap().values(), &ring_values());
    assert_same(read(&with_keys(&[("NSIDE", "2"), ("BAD_DATA", "'none'")])).unwrap().values(), &ring_values());
}

#[test]
fn an_unknown_indexing() {
    let (error, told) = problem_with(&with_keys(&[("INDXSCHM", "'STRANGE'")]), &Selection::default());
    assert!(is(&error, ErrorKind::Invalid, " has INDXSCHM = "), "{told}");
    let (error, _) = problem_with(&with_keys(&[("INDXSCHM", "'EXPLICIT'"), ("NSIDE", "2")]), &Selection::default());
    assert!(is(&error, ErrorKind::Incomplete, "HDU 1 has INDXSCHM = EXPLICIT but no column of integers"));
}

#[test]
fn names_and_units_beyond_ascii() {
    let bytes = |unit: &[u8]| {
        let column = Col { name: "", form: "16D", bytes: f64s(&ring_values()), keys: &[("TUNIT", "'??K'")] };
        let mut bytes = file(3, &[column], &[("NSIDE", "2")]);
        let at = bytes.windows(2).position(|w| w == b"??").unwrap();
        bytes[at..at + 2].copy_from_slice(unit);
        bytes
    };
    let map = read(&bytes("µ".as_bytes())).unwrap();
    assert_eq!((map.name.as_str(), map.unit.as_deref()), ("col1", Some("µK")));
    assert_eq!(read(&bytes(b"\xb5 ")).unwrap().unit.as_deref(), Some("µ K"));
    assert_eq!(read(&bytes(b"a\n")).unwrap().unit.as_deref(), Some("a K"));
}

#[test]
fn tables_without_data() {
    let keys = [("NSIDE", "2")];
    for bytes in [
        file(0, &[col("T", "D", vec![])], &with_width(&keys, "8")),
        file(2, &[], &keys),
        file(2, &[col("PIXEL", "K", i64s(&[1, 2]))], &keys),
    ] {
        let (error, told) = problem_with(&bytes, &Selection::default());
        assert!(is(&error, ErrorKind::NoValues, "HDU 1 holds no data"), "{told}");
    }
}

fn with_width<'a>(keys: &[(&'a str, &'a str)], width: &'a str) -> Vec<(&'a str, &'a str)> {
    [keys, &[("NAXIS1", width)]].concat()
}

#[test]
fn absurd_sizes_are_errors_and_allocate_nothing() {
    for keys in [
        [("NAXIS2", "9223372036854775807")],
        [("NAXIS2", "1000000000000000")],
        [("NAXIS2", "99999999999999999999999")],
        [("NAXIS2", "-3")],
        [("NAXIS1", "9223372036854775807")],
        [("NAXIS1", "0")],
        [("NAXIS1", "127")],
        [("NAXIS1", "4")],
        [("TFORM1", "'9000000000000000000D'")],
        [("TFORM1", "'2305843009213693952D'")],
        [("TFORM1", "'-5D'")],
        [("TFORM1", "'?'")],
        [("TFORM1", "''")],
        [("TFORM1", "7")],
        [("TFIELDS", "0")],
        [("TFIELDS", "2")],
        [("TFIELDS", "-1")],
        [("TFIELDS", "1000")],
        [("TFIELDS", "2147483648")],
        [("PCOUNT", "-1")],
        [("PCOUNT", "9223372036854775807")],
        [("NAXIS", "1")],
        [("NAXIS", "999")],
        [("BITPIX", "7")],
        [("GCOUNT", "0")],
        [("XTENSION", "'NONSENSE'")],
        [("XTENSION", "'IMAGE'")],
        [("XTENSION", "'TABLE'")],
    ] {
        for more in [&[("NSIDE", "2")][..], &[], &[("INDXSCHM", "'EXPLICIT'"), ("NSIDE", "2")]] {
            let bytes = with_keys(&[&keys[..], more].concat());
            for hdu in [None, Some(1)] {
                let selection = Selection { hdu, ..Selection::default() };
                // The library may make sense of some of it, but then of the right map only.
                match read_with(&bytes, &selection) {
                    Ok(map) => assert_same(map.values(), &ring_values()),
                    Err(e) => drop(problem::<()>(Err(e))),
                }
            }
            let _ = describe(&scratch(&bytes).path).map_err(|e| problem::<()>(Err(e)));
        }
    }
    // What cfitsio would go on with, uninitialised or without bound.
    for (key, value) in [("TFIELDS", "1000"), ("TFIELDS", "-1"), ("NAXIS1", "-8"), ("NAXIS2", "-3"), ("NAXIS2", "T")] {
        let (error, told) = problem_with(&with_keys(&[(key, value), ("NSIDE", "2")]), &Selection::default());
        assert!(is(&error, ErrorKind::Invalid, &format!(" has {key} = ")), "{told}");
    }
    // A column of 2^64 bytes, to cfitsio the same as none.
    let columns = [col("T", "16D", f64s(&ring_values())), col("X", "2305843009213693952D", vec![])];
    let (error, told) = problem_with(&file(3, &columns, &[("NSIDE", "2")]), &field("X"));
    assert!(is(&error, ErrorKind::Invalid, " has TFORM2 = "), "{told}");
    // A table larger than the file, and one whose size overflows to a small number.
    for (width, rows) in [("128", "4000"), ("4294967296", "4294967296")] {
        let (error, told) =
            problem_with(&with_keys(&[("NAXIS1", width), ("NAXIS2", rows), ("NSIDE", "2")]), &Selection::default());
        let kinds = [ErrorKind::Truncated, ErrorKind::Unreadable, ErrorKind::NoMap];
        assert!(kinds.contains(&error.kind()), "{told}");
    }
}

#[test]
fn files_without_a_healpix_table() {
    let (error, told) = problem_with(&picture(64, 32), &Selection::default());
    assert!(is(&error, ErrorKind::NoMap, "there is no HEALPix table"));
    assert!(told.contains("HDU 0 is a picture of 64 × 32 pixels"), "{told}");
    let (error, told) = problem_with(&primary(), &Selection::default());
    assert!(is(&error, ErrorKind::NoMap, "there is no HEALPix table") && told.contains("HDU 0 is empty"), "{told}");
    let catalogue = table(5, &[col("MASS", "D", f64s(&[0.0; 5]))], &[("EXTNAME", "'CAT'")]);
    let bytes = [primary(), catalogue].concat();
    let (error, told) = problem_with(&bytes, &Selection::default());
    assert!(is(&error, ErrorKind::NoMap, "there is no HEALPix table"), "{told}");
    assert!(told.contains("HDU 1 is 'CAT', a table of 1 columns and 5 rows"), "{told}");
    assert!(is(&problem(describe(&scratch(&bytes).path)).0, ErrorKind::NoMap, "there is no HEALPix table"));
    let at = Selection { hdu: Some(0), ..Selection::default() };
    let (error, told) = problem_with(&picture(64, 32), &at);
    assert!(
        is(&error, ErrorKind::NotApplicable, "not a binary table") && told.contains("the tables are none"),
        "{told}"
    );
}

#[test]
fn cards_of_all_kinds_do_no_harm() {
    let text = |t: &str| format!("{t:<80}").into_bytes();
    let mut bytes = with_keys(&[("NSIDE", "2")]);
    // In place of the END of the table's header: comments, blanks and values without meaning.
    let at = 2880 + bytes[2880..].chunks(80).position(|c| c.starts_with(b"END ")).unwrap() * 80;
    let cards =
        ["COMMENT = NSIDE", "", "HIERARCH ESO NSIDE = 4", "NSIDE2  =", "HISTORY NSIDE   = 8", "FOO     = 'a", "END"];
    for (i, card) in cards.iter().enumerate() {
        bytes[at + 80 * i..at + 80 * (i + 1)].copy_from_slice(&text(card));
    }
    assert_same(read(&bytes).unwrap().values(), &ring_values());
}

#[test]
fn headers_without_an_end() {
    let bytes = with_keys(&[("NSIDE", "2")]);
    let mut endless = bytes.clone();
    for chunk in endless.chunks_mut(80) {
        if chunk.starts_with(b"END ") {
            chunk[..3].copy_from_slice(b"XXX");
        }
    }
    assert!(is(&problem_with(&endless, &Selection::default()).0, ErrorKind::Truncated, "the file ends before it"));
    let primary = header(&[("SIMPLE", "T".to_owned())]);
    drop(problem_with(&primary, &Selection::default()));
}

#[test]
fn what_a_file_says_of_itself_is_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.fits");
    let long = "O'Neill's ".repeat(40).trim_end().to_owned();
    let card = |key: &str, value| Card { key: key.to_owned(), value, comment: "a comment".to_owned() };
    let cards = vec![
        card("WINDOW", CardValue::Real(6.0)),
        card("THR1", CardValue::Real(-1.25e-7)),
        card("NTHRESH", CardValue::Integer(13)),
        card("BODY", CardValue::Text("above".into())),
        card("COMMAND", CardValue::Text(long)),
        card("SHARP", CardValue::Logical(true)),
        card("EMPTY", CardValue::Text(String::new())),
        card("AFTER", CardValue::Integer(-1)),
    ];
    let extension = |name: &str, cards| Extension {
        name: name.to_owned(),
        cards,
        history: vec!["what happened".to_owned()],
        columns: vec![Column { name: "EVQ".into(), unit: "mK".into(), values: ring_values() }],
    };
    let file = HealpixFile {
        grid: Healpix::new(2).unwrap(),
        ordering: Ordering::Ring,
        coordinates: None,
        float32: false,
        extensions: vec![extension("A", cards.clone()), extension("B", cards[..1].to_vec())],
    };
    write_healpix(&path, &file, false).unwrap();
    let tables = describe(&path).unwrap().tables;
    for Card { key, value, .. } in &cards {
        assert_eq!(tables[0].card(key), Some(value), "{key}");
    }
    assert_eq!(tables[1].card("WINDOW"), Some(&CardValue::Real(6.0)));
    assert_eq!(tables[1].card("BODY"), None);
    assert_eq!((tables[0].fields[0].name.as_str(), tables[0].fields[0].unit.as_deref()), ("EVQ", Some("mK")));
}

#[test]
fn lines_that_make_no_sense_are_passed_over() {
    let mut bytes = with_keys(&[("NSIDE", "2"), ("OPENED", "'never closed"), ("WORD", "word"), ("DOUBLE", "1.5D1")]);
    let line = bytes.windows(6).position(|w| w == b"OPENED").unwrap();
    bytes[line + 40..line + 44].copy_from_slice(b"\xff\x01\0\xb5");
    let table = describe(&scratch(&bytes).path).unwrap().tables.remove(0);
    assert_eq!(table.card("DOUBLE"), Some(&CardValue::Real(15.0)));
    assert_eq!(table.card("WORD"), Some(&CardValue::Text("word".into())));
}
