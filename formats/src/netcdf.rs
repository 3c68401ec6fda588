//! NetCDF files as a [`Dataset`]: NetCDF 3 in its three variants, NetCDF 4, and HDF5 files that are like it.
//!
//! The calls are left to [`crate::libnetcdf`], what names and attributes mean to [`crate::cf`], what a map is to
//! [`crate::interpret`]. [`classic`] sees to it that a file which is cut short is noticed.

mod classic;

use std::ops::Range;
use std::path::Path;
use std::rc::Rc;

use netcdf_sys as sys;

use crate::dataset::{Array, Attribute, Dataset, Kind, Variable};
use crate::libnetcdf::{NetcdfReader, Part, VariableHead};
use crate::{Adapter, Description, Error, Maps, Selection, interpret};

/// A NetCDF file.
pub(crate) struct NetcdfFile {
    reader: NetcdfReader,
    /// The groups' paths and attributes.
    groups: Vec<(String, Vec<(String, Attribute)>)>,
    variables: Vec<Variable>,
    /// What libnetcdf knows of the variables, in the same order.
    heads: Vec<VariableHead>,
}

/// The adapter for NetCDF files, whatever their grid.
pub(crate) struct Netcdf;

impl Adapter for Netcdf {
    fn name(&self) -> &'static str {
        "NetCDF"
    }

    fn recognises(&self, head: &[u8]) -> bool {
        recognises(head)
    }

    fn describe(&self, path: &Path) -> Result<Description, Error> {
        let tables = interpret::describe(&NetcdfFile::open(path)?)?;
        Ok(Description { format: self.name(), tables })
    }

    fn open(&self, path: &Path, selection: &Selection) -> Result<Box<dyn Maps>, Error> {
        interpret::open(Rc::new(NetcdfFile::open(path)?), selection)
    }
}

/// Whether a file that begins with `head` is NetCDF, or HDF5, which NetCDF 4 is.
fn recognises(head: &[u8]) -> bool {
    // A block of the user's may precede HDF5: 512 bytes, or twice that, and so on.
    let starts = std::iter::successors(Some(512), |start| Some(start * 2)).take_while(|&start| start < head.len());
    let hdf5 = |start: usize| head[start.min(head.len())..].starts_with(b"\x89HDF\r\n\x1a\n");
    classic::recognises(head) || hdf5(0) || starts.into_iter().any(hdf5)
}

impl NetcdfFile {
    /// Opens a file.
    ///
    /// # Errors
    /// Where it cannot be read or is cut short.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        classic::check(path)?;
        let reader = NetcdfReader::open(path)?;
        let (mut groups, mut variables, mut heads) = (Vec::new(), Vec::new(), Vec::new());
        for (id, group) in reader.groups()? {
            for head in reader.variables(id)? {
                variables.push(Variable {
                    name: head.name.clone(),
                    group: group.clone(),
                    kind: kind(head.kind),
                    dimensions: head.dimensions[..head.dimensions.len() - characters(&head)].to_vec(),
                    attributes: reader.variable_attributes(head.id)?,
                });
                heads.push(head);
            }
            groups.push((group, reader.group_attributes(id)?));
        }
        Ok(NetcdfFile { reader, groups, variables, heads })
    }
}

impl Dataset for NetcdfFile {
    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn group_attributes(&self, group: &str) -> &[(String, Attribute)] {
        self.groups.iter().find(|(path, _)| path == group).map_or(&[], |(_, attributes)| attributes)
    }

    fn read(&self, variable: &Variable, ranges: &[Range<usize>]) -> Result<Array, Error> {
        let number = self.variables.iter().position(|v| v.name == variable.name && v.group == variable.group);
        let kind = || Error::VariableKind { variable: variable.path(), found: "neither numbers nor text" };
        let head = &self.heads[number.ok_or_else(kind)?];
        let mut part = Part {
            start: ranges.iter().map(|range| range.start).collect(),
            count: ranges.iter().map(ExactSizeIterator::len).collect(),
        };
        match variable.kind {
            Kind::Real32 | Kind::Real64 => self.reader.read_real(head, &part).map(Array::Real),
            Kind::Integer { bits: 64, signed: false } => {
                let values = self.reader.read_unsigned(head, &part)?;
                let whole =
                    |value| i64::try_from(value).map_err(|_| Error::LargeNumber { variable: variable.path(), value });
                values.into_iter().map(whole).collect::<Result<_, _>>().map(Array::Whole)
            }
            Kind::Integer { .. } => self.reader.read_whole(head, &part).map(Array::Whole),
            Kind::Text if head.kind == sys::NC_CHAR => {
                let width = head.dimensions.last().map_or(1, |dimension| dimension.len);
                if characters(head) == 1 {
                    part.start.push(0);
                    part.count.push(width);
                }
                self.reader.read_characters(head, &part, width).map(Array::Text)
            }
            Kind::Text => self.reader.read_strings(head, &part).map(Array::Text),
            Kind::Other => Err(kind()),
        }
    }
}

/// What a type of NetCDF holds.
fn kind(kind: sys::nc_type) -> Kind {
    let integer = |bits, signed| Kind::Integer { bits, signed };
    match kind {
        sys::NC_FLOAT => Kind::Real32,
        sys::NC_DOUBLE => Kind::Real64,
        sys::NC_BYTE => integer(8, true),
        sys::NC_UBYTE => integer(8, false),
        sys::NC_SHORT => integer(16, true),
        sys::NC_USHORT => integer(16, false),
        sys::NC_INT => integer(32, true),
        sys::NC_UINT => integer(32, false),
        sys::NC_INT64 => integer(64, true),
        sys::NC_UINT64 => integer(64, false),
        sys::NC_CHAR | sys::NC_STRING => Kind::Text,
        _ => Kind::Other,
    }
}

/// How many dimensions, 0 or 1, run along the characters of a text.
fn characters(head: &VariableHead) -> usize {
    usize::from(head.kind == sys::NC_CHAR && !head.dimensions.is_empty())
}
