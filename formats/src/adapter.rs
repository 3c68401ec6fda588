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

use crate::csv::PointsCsv;
use crate::healpix_fits::HealpixFits;
use crate::netcdf::Netcdf;
use crate::ply::SurfacePly;
use crate::zarr::{self, ZarrStore};
use crate::{Card, CardValue, Error};
use longan_grid::{CoordinateSystem, Healpix, Map, Ordering, Regrid, Regridded};
use longan_grid::{Sphere, Time};

/// The field of a file that is to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Field {
    /// By its name, in any case, and with `-` for `_`.
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
    /// The Nside to bring the field to: of a multi-order map (a power of two; that of its finest cells unless given), or
    /// of a field on another grid (that closest to its spacing unless given).
    pub nside: Option<usize>,
    /// Places along the dimensions other than those of the sphere.
    pub at: Vec<At>,
    /// How fields on other grids are brought to HEALPix.
    pub regrid: Regrid,
}

/// A place along a dimension.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct At {
    /// Name of the dimension, or of its coordinate.
    pub dimension: String,
    /// The place.
    pub place: Place,
}

/// How a place along a dimension is named.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// By the value of its coordinate, such as `500` or, for times, `1997-12`.
    Value(String),
    /// By its number from 0.
    Index(usize),
}

/// What maps take, as it shows before one is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// Their Nside; where that depends on how close points are, one that suits their number.
    pub nside: usize,
    /// About how many bytes one of them takes, with all that it takes to read it.
    pub bytes: usize,
}

impl Room {
    /// That of maps of a grid, and of this many bytes beside one of them.
    pub(crate) fn of(grid: Healpix, beside: usize) -> Self {
        Room { nside: grid.nside(), bytes: grid.pixels().saturating_mul(size_of::<f64>()).saturating_add(beside) }
    }

    /// That of maps made of points, of which each takes this many bytes.
    pub(crate) fn of_points(nside: Option<usize>, points: usize, bytes: usize) -> Option<Self> {
        let nside = nside.unwrap_or_else(|| (points as f64 / 12.0).sqrt().ceil().max(1.0) as usize);
        Some(Room::of(Healpix::new(nside).ok()?, points.saturating_mul(bytes)))
    }
}

/// What maps are, as it shows before one is read.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// The field's name, as the file has it.
    pub name: String,
    /// Its unit, as the file has it.
    pub unit: Option<String>,
    /// The coordinate system, where the file names one.
    pub coordinates: Option<CoordinateSystem>,
    /// What the sphere is.
    pub sphere: Sphere,
}

impl About {
    /// Says it of a map.
    pub(crate) fn label(self, map: &mut Map) {
        let About { name, unit, coordinates, sphere } = self;
        (map.name, map.unit, map.coordinates, map.sphere) = (name, unit, coordinates, sphere);
    }
}

/// The maps that a selection names: one, or one for each step in time, all on one grid.
pub trait Maps {
    /// The times of the steps; one map without a time has none and counts as one step.
    fn times(&self) -> &[Time];

    /// What they are.
    fn about(&self) -> About;

    /// What they take; nothing where that does not show before one is read.
    fn room(&self) -> Option<Room>;

    /// How the maps come to HEALPix, where their field is on another grid or at points. A map that is read has it too.
    ///
    /// # Errors
    /// Where settings are missing or impossible.
    fn regridded(&self) -> Result<Option<Regridded>, Error> {
        Ok(None)
    }

    /// Reads one map. What the steps share, such as weights, is computed once.
    ///
    /// # Errors
    /// Where the file cannot be read.
    fn read(&mut self, step: usize) -> Result<Map, Error>;

    /// Reads the values of one map as the file has them, whatever their grid, but unpacked; NaN where missing.
    ///
    /// # Errors
    /// Where the file cannot be read.
    fn values(&mut self, step: usize) -> Result<Vec<f64>, Error> {
        self.read(step).map(Map::into_values)
    }
}

/// What a file holds.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Description {
    /// The file format.
    pub format: &'static str,
    /// The tables or variables that hold maps, in the file's order.
    pub tables: Vec<TableDescription>,
}

/// What one table or variable of a file holds.
#[derive(Clone, Debug, serde::Serialize)]
pub struct TableDescription {
    /// Where it is in the file.
    #[serde(flatten)]
    pub place: TablePlace,
    /// The grid.
    #[serde(flatten)]
    pub grid: GridDescription,
    /// The dimensions other than those of the sphere.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dimensions: Vec<DimensionDescription>,
    /// The data columns, or the one field of a variable.
    pub fields: Vec<FieldDescription>,
    /// What the file says of it: the header entries of a FITS table, whose own numbering of columns and sizes is among
    /// them, or the attributes of a variable's groups, with their names in capitals. Comments are left out.
    #[serde(skip)]
    pub cards: Vec<Card>,
}

impl TableDescription {
    /// The value of a header entry.
    pub fn card(&self, key: &str) -> Option<&CardValue> {
        self.cards.iter().find(|card| card.key == key).map(|card| &card.value)
    }
}

/// Where a table or variable is in its file.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(untagged)]
pub enum TablePlace {
    /// In an HDU of a FITS file.
    Hdu {
        /// Number of the HDU, 0 for the primary one.
        hdu: usize,
        /// Name of the extension.
        name: Option<String>,
    },
    /// In a variable of its own.
    Variable {
        /// The path of the variable: its name, after its group's.
        variable: String,
    },
    /// The whole of a file that has but one.
    File {},
}

/// The grid of a table or variable.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum GridDescription {
    /// HEALPix.
    Healpix {
        /// Nside of the grid; of a multi-order table that of the finest cells.
        nside: usize,
        /// The ordering.
        ordering: Ordering,
        /// Whether the file does not say its ordering, so that RING is assumed.
        ordering_assumed: bool,
        /// The coordinate system, where the file names one.
        coordinates: Option<CoordinateSystem>,
        /// How values are tied to pixels.
        indexing: Indexing,
        /// Number of pixels (of a multi-order table: cells) that the table has values for.
        pixels: usize,
    },
    /// Latitudes and longitudes.
    LatLon {
        /// The latitudes, in degrees.
        latitudes: AxisDescription,
        /// The longitudes, in degrees.
        longitudes: AxisDescription,
        /// Whether the cells cover the sphere.
        global: bool,
    },
    /// Points anywhere.
    Points {
        /// Their number.
        points: usize,
        /// The coordinate system, where the file names one.
        coordinates: Option<CoordinateSystem>,
        /// The typical distance between them, in degrees.
        spacing: Option<f64>,
        /// The Nside that is used unless one is given.
        nside: Option<usize>,
        /// The share of the sphere that is as near to a point as it must be, unless a reach is given.
        covered: Option<f64>,
    },
    /// A surface of triangles.
    Surface {
        /// The number of vertices.
        vertices: usize,
        /// The number of triangles.
        triangles: usize,
        /// The point that it is seen from unless one is given.
        centre: [f64; 3],
        /// The Nside that is used unless one is given.
        nside: usize,
        /// The share of the sphere in which it is seen from there.
        covered: f64,
        /// The share of the sphere in which it is seen more than once.
        folded: f64,
    },
}

/// The values of a coordinate.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct AxisDescription {
    /// How many they are.
    pub count: usize,
    /// The first.
    pub first: f64,
    /// The last.
    pub last: f64,
    /// The distance from one to the next, where it is always the same.
    pub spacing: Option<f64>,
}

/// A dimension other than those of the sphere.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct DimensionDescription {
    /// Its name.
    pub name: String,
    /// Its length.
    pub len: usize,
    /// Whether it is time, so that there is a map for each place.
    pub time: bool,
    /// The values of its coordinate and their unit, abbreviated.
    pub values: String,
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
    /// What it is in words, where the file says it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub long_name: Option<String>,
}

/// A reader of one family of files.
pub trait Adapter: Sync {
    /// The format's name, as users know it.
    fn name(&self) -> &'static str;

    /// Whether a file that begins with `head` (at least the first 512 bytes, or all of a shorter file) is of this
    /// format. The file's name plays no part.
    fn recognises(&self, head: &[u8]) -> bool;

    /// Whether such files may hold fields that come to HEALPix in one of several ways.
    fn has_ways(&self) -> bool {
        true
    }

    /// What the file holds.
    ///
    /// # Errors
    /// Where the file cannot be read or holds no map.
    fn describe(&self, path: &Path) -> Result<Description, Error>;

    /// Finds what is selected, so that its maps can be read.
    ///
    /// # Errors
    /// Where the file cannot be read, or has not what is selected.
    fn open(&self, path: &Path, selection: &Selection) -> Result<Box<dyn Maps>, Error>;
}

/// All adapters of files; the first that recognises a file reads it.
static ADAPTERS: &[&dyn Adapter] = &[&HealpixFits, &Netcdf, &SurfacePly, &PointsCsv];

/// Finds what is selected of a file of any known format.
///
/// # Errors
/// [`Error::File`], which names the file, around the reason.
pub fn open(path: &Path, selection: &Selection) -> Result<Box<dyn Maps>, Error> {
    adapter(path).and_then(|adapter| adapter.open(path, selection)).map_err(|e| e.of(path))
}

/// Reads one map of a file of any known format.
///
/// # Errors
/// [`Error::File`], which names the file, around the reason; [`Error::Steps`] where there is one map for each of several
/// times.
pub fn read(path: &Path, selection: &Selection) -> Result<Map, Error> {
    let mut maps = open(path, selection)?;
    let steps = maps.times().len();
    if steps > 1 { Err(Error::Steps { steps }) } else { maps.read(0) }.map_err(|e| e.of(path))
}

/// What a file of any known format holds.
///
/// # Errors
/// [`Error::File`], which names the file, around the reason.
pub fn describe(path: &Path) -> Result<Description, Error> {
    adapter(path).and_then(|adapter| adapter.describe(path)).map_err(|e| e.of(path))
}

/// Whether a file, from its first bytes, may hold fields that come to HEALPix in one of several ways, as
/// [`Maps::regridded`] tells.
///
/// # Errors
/// [`Error::File`], which names the file, around the reason.
pub fn has_ways(path: &Path) -> Result<bool, Error> {
    adapter(path).map(|adapter| adapter.has_ways()).map_err(|e| e.of(path))
}

/// Whether a path is a folder that is read as if it were a file: a Zarr store.
pub fn is_store(path: &Path) -> bool {
    path.is_dir() && zarr::is_zarr(path)
}

/// The adapter for a file, or for a folder that is a store.
fn adapter(path: &Path) -> Result<&'static dyn Adapter, Error> {
    let metadata = std::fs::metadata(path).map_err(Error::io("open it"))?;
    if metadata.is_dir() {
        return if zarr::is_zarr(path) { Ok(&ZarrStore) } else { Err(Error::Folder) };
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
