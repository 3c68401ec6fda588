//! Files written are valid, and read by this and other software.

use longan_formats::ErrorKind;
use std::fs;
use std::path::Path;
use std::process::Command;

use longan_formats::*;

use longan_grid::{CoordinateSystem, Healpix, Ordering};

use crate::{assert_same, grid, is, problem};

fn value(scale: f64, pixel: usize) -> f64 {
    if pixel % 7 == 3 { f64::NAN } else { scale * pixel as f64 }
}

fn column(name: &str, grid: Healpix, scale: f64) -> Column {
    Column {
        name: name.to_owned(),
        unit: if scale < 0.0 { String::new() } else { "uK".to_owned() },
        values: (0..grid.pixels()).map(|p| value(scale, p)).collect(),
    }
}

fn card(key: &str, value: CardValue) -> Card {
    Card { key: key.to_owned(), value, comment: "a comment".to_owned() }
}

fn extension(name: &str, grid: Healpix) -> Extension {
    Extension {
        name: name.to_owned(),
        cards: vec![
            card("RANK", CardValue::Integer(-2)),
            card("THRESH", CardValue::Real(0.1)),
            card("TINY", CardValue::Real(-1.2345678901234568e-300)),
            card("HUGE", CardValue::Real(1e20)),
            card("INFTY", CardValue::Real(f64::NEG_INFINITY)),
            card("NORMED", CardValue::Logical(true)),
            card("RAW", CardValue::Logical(false)),
            card("INPUT", CardValue::Text("it's Größe\n".to_owned())),
            card("EMPTY", CardValue::Text(String::new())),
            card("LONG", CardValue::Text("all work and no play ".repeat(20))),
            card("QUOTES", CardValue::Text("'".repeat(50))),
        ],
        history: vec!["longan --quiet".to_owned(), "wörter ".repeat(40)],
        columns: vec![column("A", grid, 1.0), column("B", grid, -0.5)],
    }
}

fn file(nside: usize, ordering: Ordering, float32: bool) -> HealpixFile {
    let grid = Healpix::new(nside).unwrap();
    HealpixFile {
        grid,
        ordering,
        coordinates: Some(CoordinateSystem::Galactic),
        float32,
        extensions: vec![extension("ONE", grid), extension("TWO", grid)],
    }
}

/// Every kind of file that there is, and its name.
fn files() -> Vec<(String, HealpixFile)> {
    let mut files = Vec::new();
    for (nside, ordering) in
        [1, 3, 16, 64].map(|n| (n, Ordering::Ring)).into_iter().chain([1, 2, 16, 64].map(|n| (n, Ordering::Nested)))
    {
        for float32 in [false, true] {
            for ending in ["fits", "fits.gz"] {
                let name = format!("{nside}-{ordering}-{}.{ending}", if float32 { "E" } else { "D" });
                files.push((name, file(nside, ordering, float32)));
            }
        }
    }
    files
}

#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    for (name, file) in files() {
        let path = folder.path().join(&name);
        write_healpix(&path, &file, false).unwrap();
        for (hdu, extension) in (1..).zip(&file.extensions) {
            for (number, column) in extension.columns.iter().enumerate() {
                let field = Some(Field::Number(number));
                let map = read(&path, &Selection { field, hdu: Some(hdu), ..Selection::default() }).unwrap();
                assert_same(map.values(), &column.values);
                assert_eq!((&map.name, map.ordering, map.grid()), (&column.name, file.ordering, file.grid));
                assert_eq!(map.unit.unwrap_or_default(), column.unit);
                assert_eq!(map.coordinates, Some(CoordinateSystem::Galactic));
            }
        }
        let description = describe(&path).unwrap();
        assert_eq!(description.tables.len(), 2);
        let second = TablePlace::Hdu { hdu: 2, name: Some("TWO".into()) };
        assert_eq!(description.tables[1].place, second);
        assert_eq!(fs::read(&path).unwrap().starts_with(&[0x1f, 0x8b]), name.ends_with(".gz"));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), files().len());
}

#[test]
fn more_values_than_are_written_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for (ordering, float32) in [(Ordering::Ring, false), (Ordering::Nested, true)] {
        let grid = Healpix::new(128).unwrap();
        let extensions =
            vec![Extension { name: "X".into(), cards: vec![], history: vec![], columns: vec![column("A", grid, 1.0)] }];
        let file = HealpixFile { grid, ordering, coordinates: None, float32, extensions };
        let path = folder.path().join("map.fits");
        write_healpix(&path, &file, true).unwrap();
        let map = read(&path, &Selection::default()).unwrap();
        assert_same(map.values(), &file.extensions[0].columns[0].values);
        assert_eq!(map.coordinates, None);
    }
}

/// The header entries of a file of which each is one line, with its lines.
fn header_lines(path: &Path) -> Vec<String> {
    let bytes = fs::read(path).unwrap();
    let lines = bytes.chunks(80).map(|c| String::from_utf8_lossy(c).trim_end().to_owned());
    lines.take_while(|l| l.is_ascii()).collect()
}

#[test]
fn the_header_is_as_documented() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.fits");
    write_healpix(&path, &file(16, Ordering::Nested, true), false).unwrap();
    let lines = header_lines(&path);
    for expected in [
        "NAXIS2  =                    3 /",
        "TTYPE1  = 'A       '",
        "TFORM1  = '1024E   '",
        "TUNIT1  = 'uK      '",
        "EXTNAME = 'ONE     '",
        "PIXTYPE = 'HEALPIX '",
        "ORDERING= 'NESTED  '",
        "NSIDE   =                   16 /",
        "FIRSTPIX=                    0 /",
        "LASTPIX =                 3071 /",
        "INDXSCHM= 'IMPLICIT'",
        "OBJECT  = 'FULLSKY '",
        "COORDSYS= 'G       '",
        "BAD_DATA=          -1.6375E+30 /",
        "RANK    =                   -2 / a comment",
        "THRESH  =                  0.1 / a comment",
        "TINY    = -1.2345678901234568E-300 / a comment",
        "HUGE    =               1.0E20 / a comment",
        "INFTY   = '-inf    '",
        "NORMED  =                    T / a comment",
        "RAW     =                    F / a comment",
        "INPUT   = 'it''s Gr\\u{f6}\\u{df}e\\n'",
        "EMPTY   = '        '",
        "LONGSTRN= 'OGIP 1.0'",
        "LONG    = 'all work and no play",
        "CONTINUE  '",
        "HISTORY longan --quiet",
        "HISTORY w\\u{f6}rter",
    ] {
        assert!(lines.iter().any(|l| l.starts_with(expected)), "{expected} is missing in\n{}", lines.join("\n"));
    }
    assert!(!lines.iter().any(|l| l.starts_with("DATE") || l.starts_with("TUNIT2")));
    // The long text can be put together again.
    let at = lines.iter().position(|l| l.starts_with("LONG ")).unwrap();
    let mut text = String::new();
    for line in &lines[at..] {
        let value = line[10..].trim_start_matches('\'');
        let value = &value[..value.rfind('\'').unwrap()];
        match value.strip_suffix('&') {
            Some(part) => text.push_str(part),
            None => {
                text.push_str(value);
                break;
            }
        }
    }
    assert_eq!(text.trim_end(), "all work and no play ".repeat(20).trim_end());
    let wrapped: String =
        lines.iter().filter(|l| l.starts_with("HISTORY w") || l.starts_with("HISTORY \\")).map(|l| &l[8..]).collect();
    assert!(wrapped.len() > 72);
    // Rows of one value where 1024 do not fit.
    write_healpix(&path, &file(3, Ordering::Ring, false), true).unwrap();
    assert!(header_lines(&path).iter().any(|l| l.starts_with("TFORM1  = '1D      '")));
}

#[test]
fn the_same_map_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for ending in ["fits", "fits.gz"] {
        let bytes = ["a", "b"].map(|name| {
            let path = folder.path().join(format!("{name}.{ending}"));
            write_healpix(&path, &file(16, Ordering::Ring, false), false).unwrap();
            fs::read(path).unwrap()
        });
        assert!(bytes[0] == bytes[1]);
    }
}

#[test]
fn tables_one_by_one_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for (name, file) in files() {
        let (whole, parts) = (folder.path().join(&name), folder.path().join(format!("parts-{name}")));
        write_healpix(&whole, &file, false).unwrap();
        let HealpixFile { grid, ordering, coordinates, float32, extensions } = file;
        save(&parts, false, |path| {
            let mut writer = HealpixWriter::create(path, HealpixLayout { grid, ordering, coordinates, float32 })?;
            for extension in &extensions {
                writer.append(extension)?;
            }
            writer.finish()
        })
        .unwrap();
        assert!(fs::read(whole).unwrap() == fs::read(parts).unwrap(), "{name}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2 * files().len());

    // A table that cannot be written leaves no file behind.
    let path = folder.path().join("bad.fits");
    let file = file(3, Ordering::Ring, false);
    let layout = HealpixLayout { grid: file.grid, ordering: file.ordering, coordinates: None, float32: false };
    let (error, _) = problem(save(&path, false, |path| {
        let mut writer = HealpixWriter::create(path, layout)?;
        writer.append(&file.extensions[0])?;
        let mut short = file.extensions[1].clone();
        short.columns[1].values.pop();
        writer.append(&short)?;
        writer.finish()
    }));
    assert!(is(&error, ErrorKind::InvalidInput, "has 107 values but Nside 3 has 108 pixels"));
    assert!(!path.exists());
}

#[test]
fn what_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.fits");
    let error_of = |change: &dyn Fn(&mut HealpixFile)| {
        let mut file = file(3, Ordering::Ring, false);
        change(&mut file);
        problem(write_healpix(&path, &file, false)).0
    };
    let nested = error_of(&|f| f.ordering = Ordering::Nested);
    assert_eq!(grid(&nested), &longan_grid::Error::NotNested { nside: 3 });
    let short = error_of(&|f| f.extensions[1].columns[0].values.truncate(7));
    assert!(is(&short, ErrorKind::InvalidInput, "has 7 values but Nside 3 has 108 pixels"));
    for key in ["", "lower", "NINE_LONG", "SP ACE", "GRÖSSE", "A\n"] {
        let error = error_of(&|f| f.extensions[0].cards.push(card(key, CardValue::Integer(1))));
        assert!(is(&error, ErrorKind::InvalidInput, &format!("{key:?} is not a FITS keyword")));
    }
    let long = "x".repeat(69);
    assert!(is(
        &error_of(&|f| f.extensions[0].columns[1].unit = long.clone()),
        ErrorKind::InvalidInput,
        "longer than the 68 characters"
    ));
    assert!(is(
        &error_of(&|f| f.extensions[0].columns[1].name = long.clone()),
        ErrorKind::InvalidInput,
        "longer than the 68 characters"
    ));
    assert!(is(
        &error_of(&|f| f.extensions[1].name = "'".repeat(35)),
        ErrorKind::InvalidInput,
        "longer than the 68 characters"
    ));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);

    fs::write(&path, "old").unwrap();
    assert!(is(
        &problem(write_healpix(&path, &file(1, Ordering::Ring, false), false)).0,
        ErrorKind::Exists,
        "the file exists"
    ));
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
}

/// Runs a script.
fn run(python: &str, script: &str) {
    let output = Command::new(python).arg("-c").arg(script).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn fitsverify_has_nothing_to_say() {
    let folder = tempfile::tempdir().unwrap();
    let Some(fitsverify) = longan_support::fitsverify() else { return };
    for (name, file) in files() {
        let path = folder.path().join(&name);
        write_healpix(&path, &file, false).unwrap();
        let output = Command::new(fitsverify).arg("-q").arg(&path).output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && said.starts_with("verification OK"), "{said}");
    }
}

#[test]
fn healpy_reads_the_same() {
    let Some(python) = longan_support::python_with("healpy") else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut script = "import healpy, numpy, sys\n".to_owned();
    for (name, file) in files() {
        let path = folder.path().join(&name);
        write_healpix(&path, &file, false).unwrap();
        for hdu in [1, 2] {
            script += &format!(
                "maps, header = healpy.read_map({path:?}, field=None, hdu={hdu}, h=True, dtype=numpy.float64)\n\
                 header = dict(header)\n\
                 assert header['NSIDE'] == {} and header['ORDERING'] == '{}' and header['COORDSYS'] == 'G'\n\
                 assert header['THRESH'] == 0.1 and header['TINY'] == -1.2345678901234568e-300\n\
                 for m, scale in zip(maps, (1.0, -0.5), strict=True):\n\
                 \x20   p = numpy.arange({})\n\
                 \x20   bad = p % 7 == 3\n\
                 \x20   assert numpy.array_equal(m[~bad], scale * p[~bad])\n\
                 \x20   assert (healpy.ma(m).mask == bad).all()\n",
                file.grid.nside(),
                file.ordering,
                file.grid.pixels(),
            );
        }
    }
    run(&python, &script);
}

#[test]
fn files_of_healpy_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let script = format!(
        "import healpy, numpy, os\n\
         os.chdir({:?})\n\
         m = numpy.arange(12 * 32**2) * 0.25\n\
         n = -m\n\
         for nest in (False, True):\n\
         \x20   for idl in (False, True):\n\
         \x20       name = f'{{int(nest)}}{{int(idl)}}.fits'\n\
         \x20       healpy.write_map(name, [m, n], nest=nest, fits_IDL=idl, dtype=numpy.float64, coord='G')\n\
         \x20   m2 = healpy.reorder(m, r2n=True) if nest else m\n\
         \x20   p = numpy.where(numpy.arange(m.size) % 3 == 0, m2, healpy.UNSEEN)\n\
         \x20   healpy.write_map(f'{{int(nest)}}p.fits.gz', p, nest=nest, partial=True, dtype=numpy.float32)\n\
         \x20   numpy.save(f'{{int(nest)}}', 0)\n",
        folder.path()
    );
    let Some(python) = longan_support::python_with("healpy") else { return };
    run(&python, &script);
    // healpy.write_map does not reorder: the values are in the order that the file names.
    let grid = Healpix::new(32).unwrap();
    let map: Vec<f64> = (0..grid.pixels()).map(|p| p as f64 * 0.25).collect();
    let layer = cdshealpix::nested::get(5);
    for nest in [false, true] {
        let stored_at = |p: usize| if nest { layer.from_ring(p as u64) as usize } else { p };
        let expected: Vec<f64> = (0..grid.pixels()).map(|p| map[stored_at(p)]).collect();
        for idl in [0, 1] {
            let path = folder.path().join(format!("{}{idl}.fits", u8::from(nest)));
            assert_same(read(&path, &Selection::default()).unwrap().values(), &expected);
            let second = Selection { field: Some(Field::Number(1)), ..Selection::default() };
            assert_same(read(&path, &second).unwrap().values(), &expected.iter().map(|v| -v).collect::<Vec<_>>());
        }
        let partial = read(&folder.path().join(format!("{}p.fits.gz", u8::from(nest))), &Selection::default()).unwrap();
        let expected: Vec<f64> =
            (0..grid.pixels()).map(|p| if stored_at(p) % 3 == 0 { map[p] } else { f64::NAN }).collect();
        assert_same(partial.values(), &expected);
    }
}
