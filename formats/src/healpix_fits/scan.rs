//! The HDUs of a FITS file, and which of them are HEALPix tables.
//!
//! The header of a HEALPix table is left to [`super::table`].

use super::problem::Problem;
use super::table::{self, Likeness};
use crate::cfitsio::{Extent, FitsReader, HduKind};
use crate::error::Error;

/// One HDU at a glance.
struct Hdu {
    number: usize,
    kind: HduKind,
    likeness: Likeness,
    /// A description in words.
    summary: String,
}

/// The number of the HDU to read: the one asked for, else the first HEALPix table.
pub(super) fn choose(fits: &mut FitsReader, asked: Option<usize>) -> Result<usize, Error> {
    let Some(number) = asked else {
        return healpix_tables(fits).map(|tables| tables[0]);
    };
    let (hdus, damage) = scan(fits)?;
    let tables = || {
        let tables: Vec<_> = hdus
            .iter()
            .filter(|h| h.kind == HduKind::Table)
            .map(|h| format!("HDU {} ({})", h.number, h.summary))
            .collect();
        if tables.is_empty() { "none".to_owned() } else { tables.join(", ") }
    };
    match hdus.iter().find(|h| h.number == number) {
        Some(hdu) if hdu.kind == HduKind::Table => Ok(number),
        Some(hdu) => Err(Problem::NotATable { hdu: number, found: hdu.summary.clone(), tables: tables() }.into()),
        None => Err(damage.unwrap_or_else(|| Problem::NoSuchHdu { hdu: number, tables: tables() }.into())),
    }
}

/// The numbers of all HDUs that are HEALPix tables, at least one.
///
/// Tables that merely have as many values as a map has pixels count only where no table says that it is one.
pub(super) fn healpix_tables(fits: &mut FitsReader) -> Result<Vec<usize>, Error> {
    let (hdus, damage) = scan(fits)?;
    for likeness in [Likeness::Marked, Likeness::Shaped] {
        let tables: Vec<_> = hdus.iter().filter(|h| h.likeness == likeness).map(|h| h.number).collect();
        if !tables.is_empty() {
            return Ok(tables);
        }
    }
    let found: Vec<_> = hdus.iter().map(|h| format!("HDU {} is {}", h.number, h.summary)).collect();
    Err(damage.unwrap_or_else(|| Problem::NoHealpix { found: found.join(", ") }.into()))
}

/// All HDUs up to the end of the file or the first that cannot be read, and why it cannot.
fn scan(fits: &mut FitsReader) -> Result<(Vec<Hdu>, Option<Error>), Error> {
    let mut hdus = Vec::new();
    // Headers with absurd sizes could lead in circles, so each HDU has to begin where the last one has ended.
    let mut end = 0;
    while u64::try_from(end).is_ok_and(|end| end < fits.size()) {
        let number = hdus.len();
        match glance(fits, number) {
            Ok((hdu, extent)) if extent.header >= end && extent.end >= extent.data && extent.data > extent.header => {
                hdus.push(hdu);
                end = extent.end;
            }
            Ok(_) => break,
            Err(e) if hdus.is_empty() => return Err(e),
            Err(e) => return Ok((hdus, Some(e))),
        }
    }
    Ok((hdus, None))
}

fn glance(fits: &mut FitsReader, number: usize) -> Result<(Hdu, Extent), Error> {
    let kind = fits.go(number)?;
    let extent = fits.extent()?;
    let mut likeness = Likeness::None;
    let summary = match kind {
        HduKind::Image => {
            let axes = table::whole(fits, number, "NAXIS")?.unwrap_or(0);
            let sides: Vec<_> = (1..=axes.min(9))
                .map(|i| Ok(fits.key(&format!("NAXIS{i}"))?.unwrap_or_default()))
                .collect::<Result<_, Error>>()?;
            match axes {
                0 => "empty".to_owned(),
                1 => format!("an array of {} numbers", sides[0]),
                _ => format!("a picture of {} pixels, which is no HEALPix map", sides.join(" × ")),
            }
        }
        HduKind::TextTable => "a table of text".to_owned(),
        HduKind::Table => {
            likeness = table::likeness(fits)?;
            let name = table::text(fits, "EXTNAME")?.map_or(String::new(), |name| format!("'{name}', "));
            let mut count = |key| Ok::<_, Error>(fits.key(key)?.unwrap_or_default());
            format!("{name}a table of {} columns and {} rows", count("TFIELDS")?, count("NAXIS2")?)
        }
    };
    Ok((Hdu { number, kind, likeness, summary }, extent))
}
