//! HEALPix maps in FITS files.
//!
//! [`scan`] finds tables, [`table`] understands headers, [`mod@describe`] tells what they say, [`values`] fetches the
//! numbers of a column, [`read`] puts them onto the grid, [`multi_order`] those of cells of several sizes,
//! [`mod@write`] makes files. The bytes themselves are left to [`crate::cfitsio`].

mod describe;
mod multi_order;
mod problem;
mod read;
mod scan;
mod table;
mod values;
mod write;

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;
use tempfile::NamedTempFile;

use crate::adapter::{About, Adapter, MapSeries, MemoryEstimate, Target, field_place};
use crate::cfitsio::FitsReader;
use crate::describe::Description;
use crate::error::{self, Error};
use crate::gzip::{gunzipped_head, is_gzip};
use crate::request::Selection;
use longan_grid::{Healpix, Map, Sphere, Time};

pub use write::{Column, Extension, HealpixFile, HealpixLayout, HealpixWriter, write_healpix};

/// FITS files consist of blocks of this many bytes.
const BLOCK: u64 = 2880;

/// The adapter for HEALPix maps in FITS files, plain or gzip-compressed.
pub(crate) struct HealpixFits;

impl Adapter for HealpixFits {
    fn name(&self) -> &'static str {
        "HEALPix FITS"
    }

    fn recognises(&self, head: &[u8]) -> bool {
        let inner = gunzipped_head(head);
        inner.as_deref().unwrap_or(head).starts_with(b"SIMPLE  =")
    }

    fn describe(&self, path: &Path) -> Result<Description, Error> {
        let mut fits = open(path)?;
        let tables = scan::healpix_tables(&mut fits)?
            .into_iter()
            .map(|hdu| describe::describe(&table::Table::parse(&mut fits, hdu)?, &mut fits))
            .collect::<Result<_, _>>()?;
        Ok(Description { format: self.name(), tables })
    }

    fn open(&self, path: &Path, selection: &Selection) -> Result<Box<dyn MapSeries>, Error> {
        let mut fits = open(path)?;
        let hdu = scan::choose(&mut fits, selection.hdu)?;
        let table = table::Table::parse(&mut fits, hdu)?;
        let column = table.column(selection.field.as_ref())?.clone();
        Ok(Box::new(SingleMap { fits, table, column, selection: selection.clone() }))
    }
}

/// The one map of a table.
struct SingleMap {
    fits: FitsReader,
    table: table::Table,
    column: table::Column,
    selection: Selection,
}

impl MapSeries for SingleMap {
    fn times(&self) -> &[Time] {
        &[]
    }

    fn about(&self) -> About {
        let (name, unit) = (self.column.name.clone(), self.column.unit.clone());
        let quantity = self.column.quantity.clone();
        About { name, unit, coordinates: self.table.coordinates, sphere: Sphere::Sky, quantity }
    }

    fn place(&self) -> Vec<String> {
        let mut place = vec![format!("hdu={}", self.table.hdu), field_place(&self.column.name)];
        place.extend(read::plane(&self.table, &self.selection).map(|plane| format!("plane={plane}")));
        place
    }

    fn target(&mut self) -> Result<Target, Error> {
        let grid = match self.memory() {
            Some(estimate) => Healpix::new(estimate.nside)?,
            // The finest cell decides.
            None => self.read(0)?.grid(),
        };
        Ok(Target { grid, ordering: self.table.ordering, settings: Vec::new() })
    }

    fn memory(&self) -> Option<MemoryEstimate> {
        let column = &self.column;
        let grid = match &self.table.layout {
            table::Layout::Implicit { named } => self.table.implicit(column, *named).ok()?.0,
            table::Layout::Explicit { index, .. } => self.table.explicit_grid(index).ok()?,
            table::Layout::MultiOrder { .. } => Healpix::new(self.selection.nside?).ok()?,
        };
        // A mark for each pixel that is named, or a place and a value for each cell.
        let beside = match self.table.layout {
            table::Layout::Implicit { .. } => 0,
            table::Layout::Explicit { .. } => grid.pixels() / 8,
            table::Layout::MultiOrder { .. } => self.table.rows.saturating_mul(16),
        };
        Some(MemoryEstimate::of(grid, beside))
    }

    fn read(&mut self, _: usize) -> Result<Map, Error> {
        let mut map = read::read(&mut self.fits, &self.table, &self.column, &self.selection)?;
        self.about().label(&mut map);
        Ok(map)
    }
}

/// Opens a FITS file. One that is gzip-compressed or whose last block is cut is copied to a temporary file.
fn open(path: &Path) -> Result<FitsReader, Error> {
    let mut file = File::open(path).map_err(Error::io("open it"))?;
    let size = file.metadata().map_err(Error::io("open it"))?.len();
    let mut magic = Vec::new();
    file.by_ref().take(2).read_to_end(&mut magic).map_err(Error::io("read it"))?;
    let whole = magic.as_slice().chain(BufReader::with_capacity(1 << 17, file));
    if is_gzip(&magic) {
        unpack(MultiGzDecoder::new(whole))
    } else if size.is_multiple_of(BLOCK) {
        FitsReader::open(path)
    } else {
        unpack(whole)
    }
}

/// Opens a temporary file of the same content.
fn unpack(mut from: impl Read) -> Result<FitsReader, Error> {
    let unpack_error = |cause: io::Error| -> Error {
        match cause.kind() {
            // The kinds of a decompressor, but never of the operating system.
            io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => {
                problem::Problem::Gzip { cause }.into()
            }
            _ => {
                let action = "unpack it to the temporary folder, which TMPDIR names";
                error::Problem::Io { action, cause }.into()
            }
        }
    };
    let mut copy = NamedTempFile::new().map_err(unpack_error)?;
    let size = io::copy(&mut from, &mut copy).map_err(unpack_error)?;
    copy.as_file().set_len(size.next_multiple_of(BLOCK)).map_err(unpack_error)?;
    FitsReader::open_temporary(copy, size)
}
