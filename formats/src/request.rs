//! The request of a caller: which field of a file is read, from which place, and how it comes to HEALPix.
//!
//! Whether a file has what is requested is left to its adapter.

use std::convert::Infallible;
use std::fmt;
use std::str::FromStr;

use longan_grid::Regrid;

use crate::error::{Ask, ErrorKind, Reason};

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

/// The field of a file that is read, and how it is brought to HEALPix.
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
    /// The way by which fields on other grids are brought to HEALPix.
    pub regrid: Regrid,
}

/// A place along a dimension.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct At {
    /// Name of the dimension or of its coordinate.
    pub dimension: String,
    /// The place.
    pub place: Place,
}

/// The name of a place along a dimension.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// By the value of its coordinate, such as `500` or, for times, `1997-12`.
    Value(String),
    /// By its number from 0.
    Index(usize),
}

/// A request that no file of a format can meet.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    #[error("there is no HDU {hdu} in a file of this format; leave the HDU out")]
    NoHdus { hdu: usize },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        ErrorKind::NotApplicable
    }

    fn ask(&self) -> Option<Ask> {
        Some(Ask::Hdu)
    }
}

impl Selection {
    /// Fails where an HDU is asked for, of which only FITS files have any.
    pub(crate) fn without_hdu(&self) -> Result<(), Problem> {
        self.hdu.map_or(Ok(()), |hdu| Err(Problem::NoHdus { hdu }))
    }
}
