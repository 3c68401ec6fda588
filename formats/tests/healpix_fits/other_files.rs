//! Files that are cut short or of another kind.

use std::path::Path;

use longan_formats::{ErrorKind, describe};

use crate::*;
use longan_support::bytes::{col, f64s, file, gzip};
use longan_support::skip;

fn map() -> Vec<u8> {
    file(48, &[col("T", "D", f64s(&nested_values()))], &[("NSIDE", "2"), ("ORDERING", "'NESTED'")])
}

#[test]
fn files_cut_anywhere() {
    let bytes = map();
    let needed = 2 * 2880 + 48 * 8;
    for length in (0..bytes.len()).step_by(40).chain(needed - 2..needed + 2) {
        let result = read(&bytes[..length]);
        if length < needed {
            let (error, told) = problem(result);
            assert!(length <= 2 * 2880 || is(&error, ErrorKind::Truncated, "promises"), "{length}: {told}");
            drop(problem(describe(&scratch(&bytes[..length]).path)));
        } else {
            assert_same(result.unwrap().values(), &ring_values());
        }
    }
}

#[test]
fn gzip_streams_cut_anywhere() {
    let bytes = gzip(&map());
    assert!(bytes.len() > 200);
    for length in 2..bytes.len() {
        let (error, told) = problem_with(&bytes[..length], &Selection::default());
        // Before the inner file begins to show, nobody can tell that it is FITS.
        assert!(
            is(&error, ErrorKind::Corrupt, "the gzip stream is damaged")
                || length < 100 && is(&error, ErrorKind::Unrecognised, "longan reads"),
            "{told}"
        );
    }
    let mut damaged = bytes.clone();
    let at = damaged.len() - 6;
    damaged[at] ^= 0xff;
    assert!(is(&problem_with(&damaged, &Selection::default()).0, ErrorKind::Corrupt, "the gzip stream is damaged"));
}

#[test]
fn bytes_changed_anywhere() {
    // Headers in which any one character is wrong may be read or not, but never crash; the data are not at stake.
    let bytes = map();
    let header = 2 * 2880;
    for at in 0..header {
        if bytes[at] == b' ' && at % 7 != 0 {
            continue;
        }
        for with in [b'9', b'\'', 0xff] {
            let mut changed = bytes.clone();
            changed[at] = with;
            let _ = read(&changed).map_err(|e| problem::<()>(Err(e)));
        }
    }
}

#[test]
fn files_of_other_kinds() {
    let text_gz = gzip(b"not a FITS file");
    let cases: [(&[u8], &str); 13] = [
        (b"", "an empty file"),
        (b"PK\x03\x04aaaa", "ZIP"),
        (b"\x89PNG\r\n\x1a\n\0\0", "PNG"),
        (b"\x93NUMPY\x01\0", "NumPy"),
        (b"theta,phi,value\n1,2,3\n", "text file (perhaps CSV)"),
        (b"1 2 3\n", "a text file"),
        ("µ".as_bytes(), "a text file"),
        (b"GRIB\0\0\0\x02", "GRIB"),
        (b"BZh91AY", "bzip2"),
        (b"SIMPLE=T", "damaged FITS"),
        (b"\0\x01\x02\x03", "unknown kind"),
        (b"\x1f\x8b", "gzip-compressed file that holds no FITS"),
        (&text_gz, "gzip-compressed file that holds no FITS"),
    ];
    for (bytes, expected) in cases {
        let (error, told) = problem_with(bytes, &Selection::default());
        assert!(is(&error, ErrorKind::Unrecognised, "longan reads") && told.contains(expected), "{told}");
        assert!(told.contains("longan reads HEALPix maps in FITS files"), "{told}");
        assert!(is(&problem(describe(&scratch(bytes).path)).0, ErrorKind::Unrecognised, "longan reads"));
    }
    // Text whose last character the first look cuts in two.
    let long = "é".repeat(3000);
    assert!(problem_with(format!("a{long}").as_bytes(), &Selection::default()).1.contains("a text file"));
}

#[test]
fn no_file_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let read = |path: &Path| problem(longan_formats::read(path, &Selection::default())).0;
    assert!(is(&read(folder.path()), ErrorKind::NotAFile, "this is a folder"));
    assert!(is(&read(&folder.path().join("none.fits")), ErrorKind::NotFound, "there is no such file"));
    assert!(is(&read(&folder.path().join("none/none.fits")), ErrorKind::NotFound, "there is no such file"));
    assert!(is(&read(Path::new("")), ErrorKind::NotFound, "there is no such file"));
    // cfitsio would find this one.
    std::fs::write(folder.path().join("zipped.fits.gz"), gzip(&map())).unwrap();
    assert!(is(&read(&folder.path().join("zipped.fits")), ErrorKind::NotFound, "there is no such file"));
    #[cfg(unix)]
    assert!(is(&read(Path::new("/dev/null")), ErrorKind::NotAFile, "not a regular file"));
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_be_read() {
    use std::os::unix::fs::PermissionsExt;
    let file = scratch(&map());
    std::fs::set_permissions(&file.path, std::fs::Permissions::from_mode(0o000)).unwrap();
    if std::fs::File::open(&file.path).is_ok() {
        return skip("permissions", "this user may read everything, so a locked file is not tested");
    }
    let (error, told) = problem(longan_formats::read(&file.path, &Selection::default()));
    assert!(is(&error, ErrorKind::Io, "cannot open it"), "{told}");
}

#[test]
fn many_threads_read_at_once() {
    let file = scratch(&map());
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                for _ in 0..50 {
                    let map = longan_formats::read(&file.path, &Selection::default()).unwrap();
                    assert_same(map.values(), &ring_values());
                }
            });
        }
    });
}
