//! The header of a HEALPix table: grid, ordering, indexing, columns.
//!
//! Keywords are often missing, misspelt or wrong; where the meaning is clear they are taken, else they are an error.
//! Values are left to [`super::values`].

use std::ffi::c_int;
use std::ops::Range;

use super::problem::Problem;
use crate::cfitsio::{self, FitsReader};
use crate::error::Error;
use crate::names;
use crate::quantity::StatedQuantity;
use crate::request::Field;
use longan_grid::{CoordinateSystem, Healpix, Ordering};

/// A HEALPix table.
pub(super) struct Table {
    pub(super) hdu: usize,
    pub(super) name: Option<String>,
    pub(super) rows: usize,
    /// The data columns.
    pub(super) columns: Vec<Column>,
    pub(super) layout: Layout,
    /// Whether it holds the planes of a cube, told apart by the index (Fermi's SPARSE).
    pub(super) sparse: bool,
    /// The grid, where there is a keyword for it.
    pub(super) grid: Option<Healpix>,
    pub(super) ordering: Ordering,
    pub(super) ordering_assumed: bool,
    pub(super) coordinates: Option<CoordinateSystem>,
    /// The file's own marker for "no value here".
    pub(super) bad_data: Option<f64>,
}

/// The way in which values are tied to pixels.
pub(super) enum Layout {
    /// By their place; with the first and last pixel that the header names.
    Implicit { named: Option<(usize, usize)> },
    /// By a column of pixel numbers.
    Explicit { index: Column, grain: usize },
    /// By a column of UNIQ numbers.
    MultiOrder { index: Column },
}

/// A column of a table.
#[derive(Clone)]
pub(super) struct Column {
    /// The column's number in the file, from 1.
    pub(super) number: c_int,
    pub(super) name: String,
    pub(super) unit: Option<String>,
    pub(super) quantity: Option<StatedQuantity>,
    pub(super) kind: Kind,
    /// Values per row.
    pub(super) repeat: usize,
    /// Bytes per value.
    width: usize,
}

/// The kind of values in a column.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Real,
    Integer {
        /// Whether one value (TNULL) stands for none.
        nulls: bool,
    },
    Logical,
    Bits,
    /// Nothing that could be a map.
    Other(&'static str),
}

/// How much a table looks like HEALPix.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Likeness {
    /// The table says so.
    Marked,
    /// The table does not say so, but has as many values as a map has pixels.
    Shaped,
    /// Not at all.
    None,
}

/// Names of columns of pixel numbers.
const INDEX_NAMES: [&str; 9] =
    ["PIXEL", "PIXELS", "PIX", "IPIX", "HPIX", "HPXINDEX", "HPX_INDEX", "PIXEL_INDEX", "INDEX"];

/// Names of the column of a sparse table that counts pixels on through its planes.
const KEY_NAMES: [&str; 2] = ["KEY", "IDX"];

/// Name of the column of cell numbers in multi-order tables.
const UNIQ: &str = "UNIQ";

/// How much the current HDU, a table, looks like HEALPix.
pub(super) fn likeness(fits: &mut FitsReader) -> Result<Likeness, Error> {
    if text(fits, "PIXTYPE")?.is_some_and(|pixels| pixels.eq_ignore_ascii_case("HEALPIX")) {
        return Ok(Likeness::Marked);
    }
    for key in ["NSIDE", "ORDERING", "INDXSCHM"] {
        if fits.key(key)?.is_some() {
            return Ok(Likeness::Marked);
        }
    }
    let columns = columns(fits).unwrap_or_default();
    if columns.iter().any(|c| c.is_index() && c.name.eq_ignore_ascii_case(UNIQ)) {
        return Ok(Likeness::Marked);
    }
    let rows: usize = fits.key("NAXIS2")?.and_then(|rows| rows.parse().ok()).unwrap_or(0);
    let values = columns.first().and_then(|c| c.repeat.checked_mul(rows)).and_then(Healpix::with_pixels);
    Ok(if values.is_some() { Likeness::Shaped } else { Likeness::None })
}

impl Table {
    /// Understands the header of an HDU, which is a binary table and becomes the current one.
    pub(super) fn parse(fits: &mut FitsReader, hdu: usize) -> Result<Self, Error> {
        fits.go(hdu)?;
        let (rows, width) = check_size(fits, hdu)?;
        let mut columns = columns(fits)?;
        for column in &columns {
            // What is read is sized by the columns, and cfitsio lets some absurd ones pass.
            if column.bytes() > width {
                let (key, value) = (format!("TFORM{}", column.number), column.repeat);
                return Err(bad_key(hdu, &key, value, "a number of values that fits into a row of NAXIS1 bytes").into());
            }
        }

        let scheme = text(fits, "INDXSCHM")?.map(|s| s.to_ascii_uppercase());
        let (ordering, ordering_assumed, uniq) = match text(fits, "ORDERING")? {
            None => (Ordering::Ring, true, false),
            Some(ordering) => match ordering.to_ascii_uppercase().as_str() {
                "RING" => (Ordering::Ring, false, false),
                "NEST" | "NESTED" => (Ordering::Nested, false, false),
                "NUNIQ" => (Ordering::Nested, false, true),
                _ => return Err(bad_key(hdu, "ORDERING", ordering, "RING, NESTED or NUNIQ").into()),
            },
        };

        let named = |names: &[&str]| {
            columns.iter().position(|c| c.is_index() && names.iter().any(|name| c.name.eq_ignore_ascii_case(name)))
        };
        let first_integer = || columns.iter().position(Column::is_index);
        let (index, uniq) = match (named(&[UNIQ]), scheme.as_deref()) {
            (Some(i), _) => (Some(i), true),
            (None, _) if uniq => (Some(first_integer().ok_or(Problem::NoIndexColumn { hdu })?), true),
            (None, Some("IMPLICIT")) => (None, false),
            (None, Some("EXPLICIT")) => {
                let index = named(&INDEX_NAMES).or_else(first_integer);
                (Some(index.ok_or(Problem::NoIndexColumn { hdu })?), false)
            }
            (None, Some("SPARSE")) => {
                let index = named(&KEY_NAMES).or_else(|| named(&INDEX_NAMES)).or_else(first_integer);
                (Some(index.ok_or(Problem::NoIndexColumn { hdu })?), false)
            }
            (None, None) => (named(&INDEX_NAMES), false),
            (None, Some(scheme)) => {
                return Err(bad_key(hdu, "INDXSCHM", scheme, "IMPLICIT, EXPLICIT or SPARSE").into());
            }
        };
        let index = index.map(|i| columns.remove(i));
        if rows == 0 || columns.is_empty() {
            return Err(Problem::Empty { hdu, rows, columns: columns.len() }.into());
        }

        // A multi-order table has no Nside of its own, whatever its header says.
        let grid = if uniq { None } else { grid(fits, hdu)? };
        if let (Some(grid), Ordering::Nested) = (grid, ordering) {
            grid.depth()?;
        }
        let count =
            |fits: &mut FitsReader, key| Ok::<_, Error>(whole(fits, hdu, key)?.and_then(|n| usize::try_from(n).ok()));
        let layout = match index {
            Some(index) if uniq => Layout::MultiOrder { index },
            Some(index) if grid.is_none() => {
                return Err(Problem::NsideOfIndices { hdu, column: index.name }.into());
            }
            Some(index) => Layout::Explicit { index, grain: count(fits, "GRAIN")?.unwrap_or(0) },
            None => Layout::Implicit { named: count(fits, "FIRSTPIX")?.zip(count(fits, "LASTPIX")?) },
        };
        Ok(Table {
            hdu,
            name: text(fits, "EXTNAME")?,
            rows,
            columns,
            layout,
            sparse: scheme.as_deref() == Some("SPARSE"),
            grid,
            ordering: if uniq { Ordering::Nested } else { ordering },
            ordering_assumed: ordering_assumed && !uniq,
            coordinates: text(fits, "COORDSYS")?.and_then(|system| CoordinateSystem::parse(&system)),
            bad_data: number(fits, "BAD_DATA")?,
        })
    }

    /// The data column that a field is in, known to hold numbers.
    pub(super) fn column(&self, field: Option<&Field>) -> Result<&Column, Problem> {
        let listed = |places: &mut dyn Iterator<Item = usize>| {
            places.map(|i| format!("{i} '{}'", self.columns[i].name)).collect::<Vec<_>>().join(", ")
        };
        let by_name = |name: &str| match names::meant(self.columns.iter().map(|c| &*c.name), name)[..] {
            [] => Ok(None),
            [only] => Ok(Some(&self.columns[only])),
            ref several => Err(Problem::SeveralFields {
                hdu: self.hdu,
                field: name.escape_debug().to_string(),
                fields: listed(&mut several.iter().copied()),
            }),
        };
        let column = match field {
            None => self.columns.first(),
            Some(Field::Name(name)) => by_name(name)?,
            // Here a number names a plane.
            Some(Field::Number(_)) if self.sparse => self.columns.first(),
            Some(Field::Number(number)) => match self.columns.get(*number) {
                None => by_name(&number.to_string())?,
                column => column,
            },
        };
        let column = column.ok_or_else(|| Problem::UnknownField {
            hdu: self.hdu,
            field: field.map(Field::to_string).unwrap_or_default(),
            fields: listed(&mut (0..self.columns.len())),
        })?;
        column.check(self.hdu)?;
        Ok(column)
    }

    /// The grid of an explicit table.
    pub(super) fn explicit_grid(&self, index: &Column) -> Result<Healpix, Problem> {
        self.grid.ok_or_else(|| Problem::NsideOfIndices { hdu: self.hdu, column: index.name.clone() })
    }

    /// The grid of an implicit column, and which of its pixels the values are.
    pub(super) fn implicit(
        &self,
        column: &Column,
        named: Option<(usize, usize)>,
    ) -> Result<(Healpix, Range<usize>), Error> {
        let values = self.rows * column.repeat;
        let Some(grid) = self.grid else {
            let grid = Healpix::with_pixels(values).ok_or(Problem::NsideUnknown { hdu: self.hdu, pixels: values })?;
            if self.ordering == Ordering::Nested {
                grid.depth()?;
            }
            return Ok((grid, 0..grid.pixels()));
        };
        // The last row of a vector column may be padded.
        let holds = |pixels: usize| values >= pixels && values - pixels < column.repeat;
        if holds(grid.pixels()) {
            return Ok((grid, 0..grid.pixels()));
        }
        match named {
            Some((first, last)) if first <= last && last < grid.pixels() && holds(last - first + 1) => {
                Ok((grid, first..last + 1))
            }
            _ => Err(Problem::NsideClash {
                hdu: self.hdu,
                nside: grid.nside(),
                expected: grid.pixels(),
                column: column.name.clone(),
                found: values,
            }
            .into()),
        }
    }

    /// How many consecutive pixels follow from each pixel number in an explicit table.
    pub(super) fn run(&self, column: &Column, index: &Column, grain: usize) -> Result<usize, Problem> {
        let run = column.repeat / index.repeat;
        if run > 0 && column.repeat.is_multiple_of(index.repeat) && (grain <= 1 || grain == run) {
            return Ok(run);
        }
        Err(Problem::Run {
            hdu: self.hdu,
            column: column.name.clone(),
            values: column.repeat,
            indices: index.repeat,
            grain,
        })
    }
}

impl Column {
    /// Bytes per row.
    fn bytes(&self) -> u128 {
        match self.kind {
            Kind::Bits => self.repeat.div_ceil(8) as u128,
            Kind::Other(_) => 0,
            _ => self.repeat as u128 * self.width as u128,
        }
    }

    /// Whether it could hold pixel numbers.
    fn is_index(&self) -> bool {
        matches!(self.kind, Kind::Integer { .. }) && self.repeat > 0
    }

    pub(super) fn check(&self, hdu: usize) -> Result<(), Problem> {
        match self.kind {
            Kind::Other(found) => Err(Problem::ColumnKind { hdu, column: self.name.clone(), found }),
            _ => Ok(()),
        }
    }
}

/// The rows of the current table and their length in bytes, once it is clear that the file has all of them.
fn check_size(fits: &mut FitsReader, hdu: usize) -> Result<(usize, u128), Error> {
    let data = fits.extent()?.data;
    let mut side = |key| {
        let value = whole(fits, hdu, key)?.unwrap_or(0);
        Ok::<_, Error>(u64::try_from(value).map_err(|_| bad_key(hdu, key, value, "a size"))?)
    };
    let (width, rows) = (side("NAXIS1")?, side("NAXIS2")?);
    let needed = data as u128 + u128::from(width) * u128::from(rows);
    if needed > u128::from(fits.size()) {
        return Err(Problem::Truncated { hdu, needed, found: fits.size() }.into());
    }
    let rows = usize::try_from(rows).map_err(|_| bad_key(hdu, "NAXIS2", rows, "a size"))?;
    Ok((rows, width.into()))
}

/// The columns of the current table.
fn columns(fits: &mut FitsReader) -> Result<Vec<Column>, Error> {
    (1..=fits.columns()?)
        .map(|number| {
            let (code, repeat, width) = fits.column_type(number)?;
            let kind = match code {
                _ if repeat == 0 => Kind::Other("empty"),
                1 => Kind::Bits,
                11 | 21 | 41 | 81 => Kind::Integer { nulls: fits.key(&format!("TNULL{number}"))?.is_some() },
                14 => Kind::Logical,
                42 | 82 => Kind::Real,
                16 => Kind::Other("text"),
                83 | 163 => Kind::Other("complex numbers"),
                i32::MIN..=0 => Kind::Other("arrays of varying length"),
                _ => Kind::Other("of an unknown type"),
            };
            Ok(Column {
                number,
                name: text(fits, &format!("TTYPE{number}"))?.unwrap_or_else(|| format!("col{number}")),
                unit: text(fits, &format!("TUNIT{number}"))?,
                quantity: quantity(fits, number)?,
                kind,
                repeat: usize::try_from(repeat).unwrap_or(0),
                width: usize::try_from(width).unwrap_or(0),
            })
        })
        .collect()
}

/// The quantity of a column, where the header states one.
fn quantity(fits: &mut FitsReader, number: c_int) -> Result<Option<StatedQuantity>, Error> {
    let Some(quantity) = text(fits, &format!("TQTY{number}"))? else { return Ok(None) };
    let symmetry = text(fits, &format!("TSYM{number}"))?.and_then(|symmetry| symmetry.parse().ok());
    Ok(Some(StatedQuantity { quantity, symmetry }))
}

/// The grid that the keyword NSIDE names.
fn grid(fits: &mut FitsReader, hdu: usize) -> Result<Option<Healpix>, Error> {
    let Some(nside) = whole(fits, hdu, "NSIDE")? else { return Ok(None) };
    let grid = usize::try_from(nside).ok().and_then(|nside| Healpix::new(nside).ok());
    Ok(Some(grid.ok_or_else(|| bad_key(hdu, "NSIDE", nside, "between 1 and 2^29"))?))
}

/// An impossible value of a keyword.
pub(super) fn bad_key(hdu: usize, key: &str, value: impl ToString, expected: &'static str) -> cfitsio::Problem {
    cfitsio::Problem::Keyword { hdu, key: key.to_owned(), value: value.to_string(), expected }
}

/// A keyword's text, `None` where it is absent or blank. A number is the text of its digits.
pub(super) fn text(fits: &mut FitsReader, key: &str) -> Result<Option<String>, Error> {
    Ok(fits.key(key)?.and_then(|raw| {
        let text = unquoted(&raw).unwrap_or(raw);
        let text = text.trim();
        (!text.is_empty()).then(|| text.to_owned())
    }))
}

/// The text between quotes; nothing where there are none.
pub(super) fn unquoted(raw: &str) -> Option<String> {
    raw.strip_prefix('\'').map(|quoted| quoted.strip_suffix('\'').unwrap_or(quoted).replace("''", "'"))
}

/// A keyword's number, `None` where it is absent or no number. Some files write numbers as text.
pub(super) fn number(fits: &mut FitsReader, key: &str) -> Result<Option<f64>, Error> {
    Ok(text(fits, key)?.and_then(|text| text.replace(['D', 'd'], "E").parse().ok()))
}

/// A keyword's whole number, `None` where it is absent.
pub(super) fn whole(fits: &mut FitsReader, hdu: usize, key: &str) -> Result<Option<i64>, Error> {
    let Some(text) = text(fits, key)? else { return Ok(None) };
    if let Ok(value) = text.parse() {
        return Ok(Some(value));
    }
    match number(fits, key)? {
        Some(value) if value.fract() == 0.0 && value.abs() < 2f64.powi(53) => Ok(Some(value as i64)),
        _ => Err(bad_key(hdu, key, text, "a whole number").into()),
    }
}
