//! The choice of an adapter by a file's content, and the ways into the crate that follow from it.
//!
//! The name of a file plays no part.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use longan_grid::Map;

use crate::adapter::{Adapter, MapSeries};
use crate::csv_points::PointsCsv;
use crate::describe::Description;
use crate::error::{self, Ask, Error, ErrorKind, Reason};
use crate::gzip::is_gzip;
use crate::healpix_fits::HealpixFits;
use crate::netcdf_files::Netcdf;
use crate::ply_surfaces::SurfacePly;
use crate::request::Selection;
use crate::zarr::{self, ZarrStore};

/// A file that no adapter reads, or of which more than one map could be meant.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error(
        "this is {found}, but longan reads HEALPix maps in FITS files, plain or gzip-compressed, fields in NetCDF files and Zarr stores, points in CSV files with columns such as lon, lat, and surfaces in PLY files; convert it first"
    )]
    NotRecognised { found: &'static str },
    #[error("there is a map for each of {steps} times; choose one")]
    Steps { steps: usize },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::NotRecognised { .. } => ErrorKind::Unrecognised,
            Problem::Steps { .. } => ErrorKind::Ambiguous,
        }
    }

    fn ask(&self) -> Option<Ask> {
        matches!(self, Problem::Steps { .. }).then_some(Ask::Place { dimension: None, place: None })
    }
}

/// All adapters of files; the first that recognises a file reads it.
static ADAPTERS: &[&dyn Adapter] = &[&HealpixFits, &Netcdf, &SurfacePly, &PointsCsv];

/// Finds the selected field of a file of any known format.
///
/// # Errors
/// Where the file cannot be read, or does not have the selected field. The error names the file.
pub fn open(path: &Path, selection: &Selection) -> Result<Box<dyn MapSeries>, Error> {
    adapter(path).and_then(|adapter| adapter.open(path, selection)).map_err(|e| e.with_path(path))
}

/// Reads one map of a file of any known format.
///
/// # Errors
/// Those of [`open`]; [`ErrorKind::Ambiguous`] where there is one map for each of several times. The error names the file.
pub fn read(path: &Path, selection: &Selection) -> Result<Map, Error> {
    let mut maps = open(path, selection)?;
    let steps = maps.times().len();
    if steps > 1 { Err(Problem::Steps { steps }.into()) } else { maps.read(0) }.map_err(|e| e.with_path(path))
}

/// Describes a file of any known format.
///
/// # Errors
/// Where the file cannot be read or holds no map. The error names the file.
pub fn describe(path: &Path) -> Result<Description, Error> {
    adapter(path).and_then(|adapter| adapter.describe(path)).map_err(|e| e.with_path(path))
}
/// Whether a path is a folder that is read as if it were a file: a Zarr store.
pub fn is_store(path: &Path) -> bool {
    path.is_dir() && zarr::is_zarr(path)
}

/// The adapter for a file, or for a folder that is a store.
fn adapter(path: &Path) -> Result<&'static dyn Adapter, Error> {
    let metadata = std::fs::metadata(path).map_err(Error::io("open it"))?;
    if metadata.is_dir() {
        return if zarr::is_zarr(path) { Ok(&ZarrStore) } else { Err(error::Problem::Folder.into()) };
    }
    if !metadata.is_file() {
        return Err(error::Problem::NotRegular.into());
    }
    let mut head = Vec::new();
    File::open(path).and_then(|file| file.take(4096).read_to_end(&mut head)).map_err(Error::io("open it"))?;
    let adapter = ADAPTERS.iter().copied().find(|adapter| adapter.recognises(&head));
    adapter.ok_or_else(|| Problem::NotRecognised { found: looks_like(&head) }.into())
}

/// A guess, in words, at the format of a file that begins with `head`.
fn looks_like(head: &[u8]) -> &'static str {
    const MAGIC: &[(&[u8], &str)] = &[
        (b"GRIB", "a GRIB file"),
        (b"PK\x03\x04", "a ZIP archive (or NumPy .npz)"),
        (b"\x93NUMPY", "a NumPy .npy array"),
        (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"%PDF", "a PDF document"),
        (b"BZh", "a bzip2-compressed file"),
        (b"\x28\xb5\x2f\xfd", "a Zstandard-compressed file"),
        (b"\xfd7zXZ\x00", "an xz-compressed file"),
        (b"SIMPLE", "a damaged FITS file (it does not begin with 'SIMPLE  =')"),
    ];
    if head.is_empty() {
        return "an empty file";
    }
    if is_gzip(head) {
        return "a gzip-compressed file that holds no FITS file";
    }
    if let Some((_, found)) = MAGIC.iter().find(|(magic, _)| head.starts_with(magic)) {
        return found;
    }
    // A character may be cut at the end of `head`.
    let utf8 = std::str::from_utf8(head).map_or_else(|e| e.error_len().is_none(), |_| true);
    if utf8 && head.iter().all(|&b| b >= b' ' || b"\t\r\n".contains(&b)) {
        let first_line = head.split(|&b| b == b'\n').next().unwrap_or_default();
        let csv = "a text file (perhaps CSV) without columns of longitude and latitude, or of x, y and z";
        return if first_line.contains(&b',') { csv } else { "a text file" };
    }
    "a file of an unknown kind"
}
