//! HEALPix FITS files of whole maps, one table per extension, written one after the other.
//!
//! The same input always gives the same bytes. The meaning of values and header entries is left to the caller.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use rayon::prelude::*;

use super::problem::Problem;
use crate::card::{Card, CardValue};
use crate::cfitsio::FitsWriter;
use crate::error::{self, Error};
use crate::save::save;
use longan_grid::accumulate::CHUNK;
use longan_grid::{CoordinateSystem, Healpix, Ordering, UNSEEN};

/// One column of a table.
#[derive(Clone, Debug)]
pub struct Column {
    /// The column's name.
    pub name: String,
    /// The column's unit; may be empty.
    pub unit: String,
    /// A value for each pixel in RING order (whatever the ordering of the file), NaN where masked.
    pub values: Vec<f64>,
}

/// One table.
#[derive(Clone, Debug)]
pub struct Extension {
    /// The table's name.
    pub name: String,
    /// Header entries after those of HEALPix.
    pub cards: Vec<Card>,
    /// Lines of history; long ones are wrapped.
    pub history: Vec<String>,
    /// The columns, at least one.
    pub columns: Vec<Column>,
}

/// A file of HEALPix maps on one grid.
#[derive(Clone, Debug)]
pub struct HealpixFile {
    /// The grid of all columns.
    pub grid: Healpix,
    /// The ordering to write.
    pub ordering: Ordering,
    /// The coordinate system, if known.
    pub coordinates: Option<CoordinateSystem>,
    /// Whether to write single precision.
    pub float32: bool,
    /// The tables.
    pub extensions: Vec<Extension>,
}

/// The grid and format that all tables of a file share.
#[derive(Clone, Copy, Debug)]
pub struct HealpixLayout {
    /// The grid of all columns.
    pub grid: Healpix,
    /// The ordering to write.
    pub ordering: Ordering,
    /// The coordinate system, if known.
    pub coordinates: Option<CoordinateSystem>,
    /// Whether to write single precision.
    pub float32: bool,
}

/// A file to which tables are written one by one, so that no more than one is in memory.
pub struct HealpixWriter {
    layout: HealpixLayout,
    fits: FitsWriter,
    /// The file to make.
    path: PathBuf,
    /// Where it is made before it is compressed, if it is.
    plain: Option<PathBuf>,
}

/// Values per row, as other software writes them.
const ROW: usize = 1024;

/// Writes a file through [`save()`], gzip-compressed where the path ends in `.gz`.
///
/// # Errors
/// [`ErrorKind::InvalidInput`](crate::ErrorKind::InvalidInput) where a column has the wrong length, or a keyword or a
/// name is one that FITS does not have; [`ErrorKind::Unsupported`](crate::ErrorKind::Unsupported) where the grid has no
/// NESTED ordering; or those of [`save()`]. The error names the file.
pub fn write_healpix(path: &Path, file: &HealpixFile, overwrite: bool) -> Result<(), Error> {
    let HealpixFile { grid, ordering, coordinates, float32, ref extensions } = *file;
    let layout = HealpixLayout { grid, ordering, coordinates, float32 };
    layout
        .check()
        .and_then(|()| extensions.iter().try_for_each(|e| layout.check_extension(e)))
        .map_err(|e| e.with_path(path))?;
    save(path, overwrite, |path| {
        let mut writer = HealpixWriter::create(path, layout)?;
        extensions.iter().try_for_each(|extension| writer.append(extension))?;
        writer.finish()
    })
}

impl HealpixWriter {
    /// Begins a file, which must not exist: inside of [`save()`], the one whose path it gives. It is gzip-compressed
    /// where the path ends in `.gz`.
    ///
    /// # Errors
    /// [`ErrorKind::Unsupported`](crate::ErrorKind::Unsupported) where the grid has no NESTED ordering, or
    /// [`ErrorKind::Unwritable`](crate::ErrorKind::Unwritable).
    pub fn create(path: &Path, layout: HealpixLayout) -> Result<Self, Error> {
        layout.check()?;
        let compressed = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
        let plain = compressed.then(|| path.with_extension(""));
        let mut fits = FitsWriter::create(plain.as_deref().unwrap_or(path))?;
        fits.write_primary()?;
        Ok(HealpixWriter { layout, fits, path: path.to_owned(), plain })
    }

    /// Writes the next table.
    ///
    /// # Errors
    /// [`ErrorKind::InvalidInput`](crate::ErrorKind::InvalidInput) where the table does not suit the layout or FITS, or
    /// [`ErrorKind::Unwritable`](crate::ErrorKind::Unwritable).
    pub fn append(&mut self, extension: &Extension) -> Result<(), Error> {
        self.layout.check_extension(extension)?;
        self.layout.write_header(&mut self.fits, extension)?;
        for (number, column) in (1..).zip(&extension.columns) {
            self.layout.write_column(&mut self.fits, number, &column.values)?;
        }
        Ok(())
    }

    /// Completes the file.
    ///
    /// # Errors
    /// [`ErrorKind::Unwritable`](crate::ErrorKind::Unwritable), or [`ErrorKind::Io`](crate::ErrorKind::Io) where the file
    /// cannot be compressed.
    pub fn finish(self) -> Result<(), Error> {
        self.fits.close()?;
        let Some(plain) = self.plain else { return Ok(()) };
        let result = compress(&plain, &self.path);
        std::fs::remove_file(&plain).and(result).map_err(Error::io("compress it"))
    }
}

/// Compresses a file without noting its name or time.
fn compress(from: &Path, to: &Path) -> io::Result<()> {
    let mut encoder = GzEncoder::new(File::create(to)?, Compression::default());
    io::copy(&mut io::BufReader::with_capacity(1 << 18, File::open(from)?), &mut encoder)?;
    encoder.finish()?.flush()
}

impl HealpixLayout {
    /// Whether there is such a file.
    fn check(&self) -> Result<(), Error> {
        if self.ordering == Ordering::Nested {
            self.grid.depth()?;
        }
        Ok(())
    }

    /// Whether this can be a table of it.
    fn check_extension(&self, extension: &Extension) -> Result<(), Error> {
        name(&extension.name)?;
        for Card { key, .. } in &extension.cards {
            let legal = |b: u8| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'-' || b == b'_';
            if key.is_empty() || key.len() > 8 || !key.bytes().all(legal) {
                return Err(Problem::CardKey { key: key.clone() }.into());
            }
        }
        for column in &extension.columns {
            name(&column.name).and(name(&column.unit))?;
            if column.values.len() != self.grid.pixels() {
                return Err(error::Problem::ColumnLength {
                    column: column.name.clone(),
                    found: column.values.len(),
                    nside: self.grid.nside(),
                    expected: self.grid.pixels(),
                }
                .into());
            }
        }
        Ok(())
    }

    /// Values per row of the table.
    fn repeat(&self) -> usize {
        if self.grid.pixels().is_multiple_of(ROW) { ROW } else { 1 }
    }

    fn write_header(&self, fits: &mut FitsWriter, extension: &Extension) -> Result<(), Error> {
        let form = format!("{}{}", self.repeat(), if self.float32 { 'E' } else { 'D' });
        let texts = extension.columns.iter().map(|c| Ok((name(&c.name)?, name(&c.unit)?)));
        let texts: Vec<_> = texts.collect::<Result<_, Error>>()?;
        let columns: Vec<_> = texts.iter().map(|(name, unit)| [name.as_str(), form.as_str(), unit.as_str()]).collect();
        fits.write_table(&name(&extension.name)?, self.grid.pixels() / self.repeat(), &columns)?;

        fits.write_text("PIXTYPE", "HEALPIX", "HEALPix pixelisation")?;
        fits.write_text("ORDERING", &self.ordering.to_string(), "pixel ordering scheme, RING or NESTED")?;
        fits.write_key("NSIDE", &self.grid.nside().to_string(), "resolution parameter of HEALPix")?;
        fits.write_key("FIRSTPIX", "0", "first pixel (from 0)")?;
        fits.write_key("LASTPIX", &(self.grid.pixels() - 1).to_string(), "last pixel (from 0)")?;
        fits.write_text("INDXSCHM", "IMPLICIT", "indexing, IMPLICIT or EXPLICIT")?;
        fits.write_text("OBJECT", "FULLSKY", "sky coverage, FULLSKY or PARTIAL")?;
        if let Some(system) = self.coordinates {
            fits.write_text("COORDSYS", system.letter(), "Galactic, Ecliptic or Celestial")?;
        }
        fits.write_key("BAD_DATA", "-1.6375E+30", "value of masked pixels")?;

        let long = |card: &Card| matches!(&card.value, CardValue::Text(text) if quoted_len(&ascii(text)) > 68);
        if extension.cards.iter().any(long) {
            fits.write_long_text_notice()?;
        }
        for Card { key, value, comment } in &extension.cards {
            let comment = ascii(comment);
            match value {
                CardValue::Text(text) => fits.write_text(key, &ascii(text), &comment)?,
                CardValue::Real(value) if !value.is_finite() => fits.write_text(key, &value.to_string(), &comment)?,
                CardValue::Real(value) => fits.write_key(key, &real(*value), &comment)?,
                CardValue::Integer(value) => fits.write_key(key, &value.to_string(), &comment)?,
                CardValue::Logical(value) => fits.write_key(key, if *value { "T" } else { "F" }, &comment)?,
            }
        }
        for line in &extension.history {
            fits.write_history(&ascii(line))?;
        }
        Ok(())
    }

    fn write_column(&self, fits: &mut FitsWriter, number: std::ffi::c_int, values: &[f64]) -> Result<(), Error> {
        let layer = match self.ordering {
            Ordering::Ring => None,
            Ordering::Nested => Some(cdshealpix::nested::get(self.grid.depth()?)),
        };
        let value_at = |pixel: usize| {
            let value = values[layer.map_or(pixel, |layer| layer.to_ring(pixel as u64) as usize)];
            if value.is_nan() { UNSEEN } else { value }
        };
        let (mut doubles, mut singles) = (Vec::new(), Vec::new());
        for start in (0..values.len()).step_by(CHUNK) {
            let pixels = (start..(start + CHUNK).min(values.len())).into_par_iter();
            let from = (start / self.repeat(), start % self.repeat());
            if self.float32 {
                pixels.map(|pixel| value_at(pixel) as f32).collect_into_vec(&mut singles);
                fits.write_f32(number, from, &mut singles)?;
            } else {
                pixels.map(value_at).collect_into_vec(&mut doubles);
                fits.write_f64(number, from, &mut doubles)?;
            }
        }
        Ok(())
    }
}

/// The shortest digits that give the same number again, with a decimal point.
fn real(value: f64) -> String {
    let digits = format!("{value:?}").to_uppercase();
    match digits.split_once('E') {
        Some((mantissa, exponent)) if !mantissa.contains('.') => format!("{mantissa}.0E{exponent}"),
        _ => digits,
    }
}

/// Text as a header can hold it.
fn ascii(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c == ' ' || c.is_ascii_graphic() {
            out.push(c);
        } else {
            out.extend(c.escape_default());
        }
    }
    out
}

/// Length between its quotes, where quotes in the text are doubled.
fn quoted_len(text: &str) -> usize {
    text.len() + text.matches('\'').count()
}

/// A name or unit as a header can hold it.
fn name(text: &str) -> Result<String, Problem> {
    let text = ascii(text);
    if quoted_len(&text) > 68 { Err(Problem::LongName { text }) } else { Ok(text) }
}
