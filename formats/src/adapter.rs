//! The extension point for file formats: what an adapter does, and the choice of one by a file's content.
//!
//! A new format is one type that implements [`Adapter`] and one entry in [`ADAPTERS`]. What a format means is left
//! to its adapter.

use std::convert::Infallible;
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::str::FromStr;

use flate2::read::MultiGzDecoder;

use crate::healpix_fits::HealpixFits;
use crate::{CoordinateSystem, Error, Map, Ordering};

/// The field of a file that is to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Field {
    /// By its name, in any case.
    Name(String),
    /// By its place among the data columns from 0, as healpy counts; a column of pixel numbers is not counted.
    /// In a sparse table (Fermi's cubes) the plane.
    Number(usize),
}

impl FromStr for Field {
    type Err = Infallible;

    /// Digits are a number, all else is a name.
    fn from_str(text: &str) -> Result<Self, Infallible> {
        let digits = text.bytes().all(|b| b.is_ascii_digit());
        let number = text.parse().ok().filter(|_| digits);
        Ok(number.map_or_else(|| Field::Name(text.to_owned()), Field::Number))
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Field::Name(name) => write!(f, "'{}'", name.escape_debug()),
            Field::Number(number) => write!(f, "{number}"),
        }
    }
}

/// What of a file is to be read.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// The field; the first one unless given.
    pub field: Option<Field>,
    /// The HDU, 0 for the primary one; the first HEALPix table unless given.
    pub hdu: Option<usize>,
    /// The Nside (a power of two) to bring a multi-order map to; that of its finest cells unless given.
    pub nside: Option<usize>,
}

/// What a file holds.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Description {
    /// The file format.
    pub format: &'static str,
    /// The tables that hold maps, in the file's order.
    pub tables: Vec<TableDescription>,
}

/// What one table of a file holds.
#[derive(Clone, Debug, serde::Serialize)]
pub struct TableDescription {
    /// Number of the HDU, 0 for the primary one.
    pub hdu: usize,
    /// Name of the extension.
    pub name: Option<String>,
    /// Nside of the grid; of a multi-order table that of the finest cells.
    pub nside: usize,
    /// The ordering.
    pub ordering: Ordering,
    /// Whether the file does not say its ordering, so that RING is assumed.
    pub ordering_assumed: bool,
    /// The coordinate system, where the file names one.
    pub coordinates: Option<CoordinateSystem>,
    /// How values are tied to pixels.
    pub indexing: Indexing,
    /// Number of pixels (of a multi-order table: cells) that the table has values for.
    pub pixels: usize,
    /// The data columns.
    pub fields: Vec<FieldDescription>,
}

/// How a table ties values to pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Indexing {
    /// By their place in the table.
    Implicit,
    /// By a column of pixel numbers.
    Explicit,
    /// By a column of UNIQ numbers, of cells of several sizes.
    MultiOrder,
}

/// One data column.
#[derive(Clone, Debug, serde::Serialize)]
pub struct FieldDescription {
    /// Its name.
    pub name: String,
    /// Its unit, where the file names one.
    pub unit: Option<String>,
}

/// A reader of one family of files.
pub trait Adapter: Sync {
    /// The format's name, as users know it.
    fn name(&self) -> &'static str;

    /// Whether a file that begins with `head` (at least the first 512 bytes, or all of a shorter file) is of this
    /// format. The file's name plays no part.
    fn recognises(&self, head: &[u8]) -> bool;

    /// What the file holds.
    ///
    /// # Errors
    /// Where the file cannot be read or holds no map.
    fn describe(&self, path: &Path) -> Result<Description, Error>;

    /// Reads one field.
    ///
    /// # Errors
    /// Where the file cannot be read, or has not what is selected.
    fn read(&self, path: &Path, selection: &Selection) -> Result<Map, Error>;
}

/// All adapters; the first that recognises a file reads it.
static ADAPTERS: &[&dyn Adapter] = &[&HealpixFits];

/// Reads one field of a file of any known format.
///
/// # Errors
/// [`Error::File`], which names the file, around the reason.
pub fn read(path: &Path, selection: &Selection) -> Result<Map, Error> {
    adapter(path).and_then(|adapter| adapter.read(path, selection)).map_err(|e| e.of(path))
}

/// What a file of any known format holds.
///
/// # Errors
/// [`Error::File`], which names the file, around the reason.
pub fn describe(path: &Path) -> Result<Description, Error> {
    adapter(path).and_then(|adapter| adapter.describe(path)).map_err(|e| e.of(path))
}

/// The adapter for a file.
fn adapter(path: &Path) -> Result<&'static dyn Adapter, Error> {
    let metadata = std::fs::metadata(path).map_err(Error::io("open it"))?;
    if metadata.is_dir() {
        return Err(Error::Folder);
    }
    if !metadata.is_file() {
        return Err(Error::NotRegular);
    }
    let mut head = Vec::new();
    File::open(path).and_then(|file| file.take(4096).read_to_end(&mut head)).map_err(Error::io("open it"))?;
    let adapter = ADAPTERS.iter().copied().find(|adapter| adapter.recognises(&head));
    adapter.ok_or_else(|| Error::NotRecognised { found: looks_like(&head) })
}

/// The beginning of what a gzip stream holds, if `head` begins one.
pub(crate) fn gunzipped_head(head: &[u8]) -> Option<Vec<u8>> {
    if !is_gzip(head) {
        return None;
    }
    let mut inner = Vec::new();
    // The stream is cut after `head`, so an error at its end is expected.
    let _: io::Result<usize> = MultiGzDecoder::new(head).take(512).read_to_end(&mut inner);
    Some(inner)
}

/// Whether a file that begins with `head` is a gzip stream.
pub(crate) fn is_gzip(head: &[u8]) -> bool {
    head.starts_with(&[0x1f, 0x8b])
}

/// In words, what a file that begins with `head` looks like.
fn looks_like(head: &[u8]) -> &'static str {
    const MAGIC: &[(&[u8], &str)] = &[
        (b"\x89HDF\r\n\x1a\n", "an HDF5 or NetCDF-4 file"),
        (b"CDF\x01", "a NetCDF file"),
        (b"CDF\x02", "a NetCDF file"),
        (b"CDF\x05", "a NetCDF file"),
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
        return if first_line.contains(&b',') { "a text file (perhaps CSV)" } else { "a text file" };
    }
    "a file of an unknown kind"
}
