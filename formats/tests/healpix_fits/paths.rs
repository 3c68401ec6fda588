//! File names that cfitsio would take for something else.

use std::path::{Path, PathBuf};

use longan_formats::{ErrorKind, HealpixFile, write_healpix};
use longan_grid::{Healpix, Ordering};

use crate::*;
use longan_support::bytes::{col, f64s, file, gzip};

fn map(value: f64) -> Vec<u8> {
    file(12, &[col("T", "D", f64s(&[value; 12]))], &[("NSIDE", "1")])
}

const NAMES: [&str; 34] = [
    "a[1].fits",
    "a.fits[1]",
    "a.fits[col x=1]",
    "a.fits[bin x]",
    "map(copy).fits",
    "map.fits(copy)",
    "map.fits(mem:)",
    "map.fits+1",
    "a+b.fits",
    "!a.fits",
    "-",
    "-a.fits",
    "--overwrite",
    " a.fits",
    "  ",
    "a .fits ",
    "@a.fits",
    "a@b.fits",
    "~",
    "~a.fits",
    "~nobody-of-this-name",
    "mem:a",
    "stdin:",
    "http:a.fits",
    "a;b.fits",
    "a&b|c.fits",
    "a*?.fits",
    "a%20b%s%n.fits",
    "a\"b'c`.fits",
    "a\\b.fits",
    "Größe-\u{2728}.fits",
    "new\nline.fits",
    "map.fits.Z",
    "map.bz2.fits",
];

/// The same names as paths of every kind: in a folder of such a name, relative, and absolute.
fn each_path(mut test: impl FnMut(&Path)) {
    let folder = tempfile::tempdir_in(std::env::current_dir().unwrap()).unwrap();
    for name in NAMES {
        let inner = folder.path().join(name);
        std::fs::create_dir(&inner).unwrap();
        test(&inner.join(name));
        let relative: PathBuf = inner.join(name).strip_prefix(std::env::current_dir().unwrap()).unwrap().into();
        test(&relative);
    }
}

#[test]
fn read_literally() {
    each_path(|path| {
        std::fs::write(path, map(4.0)).unwrap();
        let map_read = longan_formats::read(path, &Selection::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_same(map_read.values(), &[4.0; 12]);
        std::fs::write(path, gzip(&map(5.0))).unwrap();
        let map_read = longan_formats::read(path, &Selection::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_same(map_read.values(), &[5.0; 12]);
        assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1, "nothing but {path:?} is made");
        std::fs::remove_file(path).unwrap();
    });
}

#[test]
fn written_literally() {
    let columns = vec![longan_formats::Column { name: "T".into(), unit: String::new(), values: vec![6.0; 12] }];
    let extension = longan_formats::Extension { name: "X".into(), cards: vec![], history: vec![], columns };
    let file = HealpixFile {
        grid: Healpix::new(1).unwrap(),
        ordering: Ordering::Ring,
        coordinates: None,
        float32: false,
        extensions: vec![extension],
    };
    each_path(|path| {
        write_healpix(path, &file, false).unwrap_or_else(|e| panic!("{e}"));
        let files: Vec<_> =
            std::fs::read_dir(path.parent().unwrap()).unwrap().map(|f| f.unwrap().file_name()).collect();
        assert_eq!(files, [path.file_name().unwrap()]);
        assert_same(longan_formats::read(path, &Selection::default()).unwrap().values(), &[6.0; 12]);
        std::fs::remove_file(path).unwrap();
    });
}

#[test]
fn names_that_only_begin_a_path() {
    // A relative name in the current folder, which is where a leading blank or tilde would be seen.
    let here = std::env::current_dir().unwrap();
    for name in [" blank.fits", "~nobody-of-this-name.fits", "!bang.fits", "-dash.fits"] {
        let path = here.join(name);
        std::fs::write(&path, map(4.0)).unwrap();
        let read = longan_formats::read(Path::new(name), &Selection::default());
        std::fs::remove_file(&path).unwrap();
        assert_same(read.unwrap().values(), &[4.0; 12]);
    }
}

#[cfg(unix)]
#[test]
fn names_that_are_not_utf8() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(std::ffi::OsStr::from_bytes(b"gr\xf6\xdfe.fits"));
    std::fs::write(&path, map(4.0)).unwrap();
    assert_same(longan_formats::read(&path, &Selection::default()).unwrap().values(), &[4.0; 12]);
}

#[test]
fn paths_that_cannot_be() {
    let folder = tempfile::tempdir().unwrap();
    let mut long = folder.path().to_owned();
    while long.as_os_str().len() < 1000 {
        long.push("x".repeat(100));
        std::fs::create_dir(&long).unwrap();
    }
    let path = long.join("map.fits");
    std::fs::write(&path, map(4.0)).unwrap();
    let (error, told) = problem(longan_formats::read(&path, &Selection::default()));
    let length = path.as_os_str().len();
    assert!(is(&error, ErrorKind::Unsupported, &format!("the path has {length} bytes")), "{told}");
    // One that just fits.
    let short = "x".repeat(1000 - long.parent().unwrap().as_os_str().len() - 1 - ".fits".len());
    let fitting = long.parent().unwrap().join(short[..short.len().min(240)].to_owned() + ".fits");
    std::fs::write(&fitting, map(4.0)).unwrap();
    assert_same(longan_formats::read(&fitting, &Selection::default()).unwrap().values(), &[4.0; 12]);

    let (nul, told) = problem(longan_formats::read(Path::new("a\0.fits"), &Selection::default()));
    assert!(is(&nul, ErrorKind::Io, "cannot "), "{told}");
}
