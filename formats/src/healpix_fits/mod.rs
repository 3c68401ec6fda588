//! HEALPix maps in FITS files.
//!
//! [`table`] understands headers, [`read`] fetches values, [`multi_order`] brings cells of several sizes to one grid,
//! [`write`] makes files. The bytes themselves are left to [`crate::cfitsio`].

mod multi_order;
mod read;
mod scan;
mod table;
mod write;

use std::fs::File;
use std::io::{BufReader, Cursor, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use crate::adapter::{gunzipped_head, is_gzip};
use crate::cfitsio::{BLOCK, Fits};
use crate::{Adapter, Description, Error, Map, Selection};

pub use write::{Card, CardValue, Column, Extension, HealpixFile, write_healpix};

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
            .map(|hdu| table::Table::parse(&mut fits, hdu)?.describe(&mut fits))
            .collect::<Result<_, _>>()?;
        Ok(Description { format: self.name(), tables })
    }

    fn read(&self, path: &Path, selection: &Selection) -> Result<Map, Error> {
        let mut fits = open(path)?;
        let hdu = scan::choose(&mut fits, selection.hdu)?;
        let table = table::Table::parse(&mut fits, hdu)?;
        read::read(&mut fits, &table, selection)
    }
}

/// Opens a FITS file: in memory where it is a gzip stream or its last block is cut, neither of which cfitsio reads
/// reliably from disk.
fn open(path: &Path) -> Result<Fits, Error> {
    let mut file = File::open(path).map_err(Error::io("open it"))?;
    let mut bytes = Vec::new();
    file.by_ref().take(2).read_to_end(&mut bytes).map_err(Error::io("read it"))?;
    if is_gzip(&bytes) {
        let stream = BufReader::with_capacity(1 << 18, Cursor::new(bytes).chain(file));
        let mut bytes = Vec::new();
        MultiGzDecoder::new(stream).read_to_end(&mut bytes).map_err(|cause| Error::Gzip { cause })?;
        Fits::open_memory(bytes)
    } else if file.metadata().map_err(Error::io("read it"))?.len().is_multiple_of(BLOCK as u64) {
        Fits::open(path)
    } else {
        file.read_to_end(&mut bytes).map_err(Error::io("read it"))?;
        Fits::open_memory(bytes)
    }
}
