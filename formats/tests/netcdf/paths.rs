//! File names that libnetcdf would take for something else.

use longan_formats::ErrorKind;
use std::path::{Path, PathBuf};

use crate::*;

const NAMES: [&str; 26] = [
    "a[1].nc",
    "[log]a.nc",
    "a.nc#mode=zarr",
    "a.nc#mode=bytes",
    "a#1.nc",
    "a?b.nc",
    "a.nc?t",
    "http:a.nc",
    "https:",
    "file:a.nc",
    "dods:a.nc",
    "s3:a.nc",
    "c:a.nc",
    "c",
    "-",
    "--overwrite",
    " a.nc",
    "a .nc ",
    "~",
    "~a.nc",
    "a%20b%s.nc",
    "a\"b'c`.nc",
    "a\\b.nc",
    "Größe-\u{2728}.nc",
    "new\nline.nc",
    "a&b|c;d*.nc",
];

#[test]
fn read_literally() {
    let plain = plain();
    let bytes = std::fs::read(plain.scratch().path).unwrap();
    let expected = read(&plain.scratch().path).unwrap();
    let here = std::env::current_dir().unwrap();
    let folder = tempfile::tempdir_in(&here).unwrap();
    for name in NAMES {
        let inner = folder.path().join(name);
        std::fs::create_dir(&inner).unwrap();
        let path = inner.join(name);
        std::fs::write(&path, &bytes).unwrap();
        let relative: PathBuf = path.strip_prefix(&here).unwrap().into();
        for path in [&path, &relative] {
            let map = read(path).unwrap_or_else(|e| panic!("{name:?}: {e}"));
            assert_close(map.values(), expected.values());
        }
        assert_eq!(std::fs::read_dir(&inner).unwrap().count(), 1, "nothing but {name:?} is made");
    }
}

#[test]
fn names_that_only_begin_a_path() {
    let here = std::env::current_dir().unwrap();
    for name in [" blank.nc", "http:blank.nc", "[x]blank.nc"] {
        let path = here.join(name);
        plain().write(&path);
        let read = read(Path::new(name));
        std::fs::remove_file(&path).unwrap();
        assert_eq!(read.unwrap().name, "t");
    }
}

#[cfg(unix)]
#[test]
fn names_that_are_not_utf8() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(std::ffi::OsStr::from_bytes(b"gr\xf6\xdfe.nc"));
    std::fs::copy(plain().scratch().path, &path).unwrap();
    assert_eq!(read(&path).unwrap().name, "t");
}

#[test]
fn names_that_cannot_be() {
    let (nul, told) = problem(read(Path::new("a\0.nc")));
    assert!(is(&nul, ErrorKind::Io, "cannot "), "{told}");
    assert!(is(&problem(read(Path::new("nowhere.nc"))).0, ErrorKind::NotFound, "there is no such file"));
}
