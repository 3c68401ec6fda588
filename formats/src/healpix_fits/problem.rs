//! Problems with the tables of a FITS file, each in one sentence.

use std::io;

use crate::error::{Ask, ErrorKind, Reason};

/// A problem with a FITS file or one of its tables.
#[derive(Debug, thiserror::Error)]
pub(super) enum Problem {
    #[error("the gzip stream is damaged or cut short ({cause}); fetch the file again")]
    Gzip { cause: io::Error },
    #[error(
        "HDU {hdu} promises {needed} bytes but the file ends after {found}; it is cut short or its header is wrong, so fetch it again"
    )]
    Truncated { hdu: usize, needed: u128, found: u64 },
    #[error("there is no HEALPix table in this FITS file ({found}); choose a file that has one")]
    NoHealpix { found: String },
    #[error("there is no HDU {hdu}; the tables are {tables}")]
    NoSuchHdu { hdu: usize, tables: String },
    #[error("HDU {hdu} is {found}, not a binary table; the tables are {tables}")]
    NotATable { hdu: usize, found: String, tables: String },
    #[error(
        "HDU {hdu} has Nside {nside}, so {expected} pixels, but column '{column}' holds {found} values; correct NSIDE, FIRSTPIX and LASTPIX"
    )]
    NsideClash { hdu: usize, nside: usize, expected: usize, column: String, found: usize },
    #[error("HDU {hdu} has no NSIDE, and its {pixels} values are not 12 Nside² for any Nside; add NSIDE to the header")]
    NsideUnknown { hdu: usize, pixels: usize },
    #[error(
        "HDU {hdu} numbers its pixels in column '{column}' but has no NSIDE to say of which grid; add NSIDE to the header"
    )]
    NsideOfIndices { hdu: usize, column: String },
    #[error(
        "HDU {hdu} has INDXSCHM = EXPLICIT but no column of integers that could be pixel numbers; correct the header"
    )]
    NoIndexColumn { hdu: usize },
    #[error("HDU {hdu} holds no data: {rows} rows and {columns} data columns; choose another HDU")]
    Empty { hdu: usize, rows: usize, columns: usize },
    #[error("HDU {hdu} has no field {field}; its fields are {fields}")]
    UnknownField { hdu: usize, field: String, fields: String },
    #[error("'{field}' could be any of the fields {fields} of HDU {hdu}; choose one by its number")]
    SeveralFields { hdu: usize, field: String, fields: String },
    #[error("column '{column}' of HDU {hdu} is {found}, which is not a map of numbers; choose another field")]
    ColumnKind { hdu: usize, column: String, found: &'static str },
    #[error(
        "a row of HDU {hdu} has {values} values in column '{column}' for {indices} pixel numbers (GRAIN {grain}); correct TFORM or GRAIN"
    )]
    Run { hdu: usize, column: String, values: usize, indices: usize, grain: usize },
    #[error(
        "HDU {hdu} gives a value to pixel {pixel}, but Nside {nside} has pixels 0 to {last}; correct NSIDE or the pixel numbers"
    )]
    PixelRange { hdu: usize, pixel: i128, nside: usize, last: usize },
    #[error("HDU {hdu} gives pixel {pixel} more than one value; remove the duplicates")]
    Duplicate { hdu: usize, pixel: usize },
    #[error(
        "HDU {hdu} has UNIQ = {uniq} in row {row} (from 1), which is not 4^(order+1) + pixel for any order up to 29; correct the table"
    )]
    Uniq { hdu: usize, uniq: i128, row: usize },
    #[error("the cells UNIQ = {first} and {second} of HDU {hdu} overlap; remove one of them")]
    Overlap { hdu: usize, first: u64, second: u64 },
    #[error(
        "the multi-order map of HDU {hdu} reaches Nside {finest}, beyond {limit}; choose the resolution to bring it to"
    )]
    TooFine { hdu: usize, finest: usize, limit: usize },
    #[error(
        "HDU {hdu} is not a multi-order map, so it cannot be read at Nside {nside}; leave the Nside out, or degrade the map first (for example with healpy.ud_grade)"
    )]
    NotMultiOrder { hdu: usize, nside: usize },
    #[error("{key:?} is not a FITS keyword, which has one to eight of A-Z, 0-9, '-' and '_'")]
    CardKey { key: String },
    #[error("the name or unit '{text}' is longer than the 68 characters that FITS allows; shorten it")]
    LongName { text: String },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        match self {
            Problem::Gzip { .. } => ErrorKind::Corrupt,
            Problem::Truncated { .. } => ErrorKind::Truncated,
            Problem::NoHealpix { .. } => ErrorKind::NoMap,
            Problem::NoSuchHdu { .. } | Problem::UnknownField { .. } => ErrorKind::Unknown,
            Problem::NotATable { .. } | Problem::NotMultiOrder { .. } => ErrorKind::NotApplicable,
            Problem::NsideUnknown { .. } | Problem::NsideOfIndices { .. } | Problem::NoIndexColumn { .. } => {
                ErrorKind::Incomplete
            }
            Problem::Empty { .. } => ErrorKind::NoValues,
            Problem::SeveralFields { .. } => ErrorKind::Ambiguous,
            Problem::ColumnKind { .. } => ErrorKind::NotNumbers,
            Problem::NsideClash { .. }
            | Problem::Run { .. }
            | Problem::PixelRange { .. }
            | Problem::Duplicate { .. }
            | Problem::Uniq { .. }
            | Problem::Overlap { .. } => ErrorKind::Invalid,
            Problem::TooFine { .. } => ErrorKind::OutOfRange,
            Problem::CardKey { .. } | Problem::LongName { .. } => ErrorKind::InvalidInput,
        }
    }

    fn ask(&self) -> Option<Ask> {
        match self {
            Problem::NoSuchHdu { .. } | Problem::NotATable { .. } | Problem::Empty { .. } => Some(Ask::Hdu),
            Problem::UnknownField { .. } | Problem::SeveralFields { .. } | Problem::ColumnKind { .. } => {
                Some(Ask::Variable)
            }
            Problem::TooFine { .. } | Problem::NotMultiOrder { .. } => Some(Ask::Nside),
            _ => None,
        }
    }

    fn found(&self) -> Option<String> {
        match self {
            Problem::ColumnKind { found, .. } => Some((*found).to_owned()),
            _ => None,
        }
    }
}
