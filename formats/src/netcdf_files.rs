//! NetCDF files as a [`Dataset`]: NetCDF 3 in its three variants, NetCDF 4, and HDF5 files that are like it.
//!
//! The calls are left to [`crate::libnetcdf`], the meaning of names and attributes to [`crate::cf`], the maps to
//! [`crate::interpret`]. [`classic`] sees to it that a file which is cut short is noticed.

mod classic;

use std::cell::RefCell;
use std::ops::Range;
use std::path::Path;
use std::rc::Rc;

use netcdf_sys as sys;

use crate::adapter::{Adapter, MapSeries};
use crate::dataset::{self, Array, Attribute, Dataset, Dimension, Kind, Variable};
use crate::describe::Description;
use crate::error::{Error, ErrorKind, Reason};
use crate::interpret;
use crate::libnetcdf::{NetcdfReader, Part, VariableHead};
use crate::request::Selection;

/// A number beyond those of 64 bits with a sign.
#[derive(Debug, thiserror::Error)]
#[error("variable '{variable}' holds {value}, beyond 2^63 - 1; store it as a signed or a real number")]
struct LargeNumber {
    variable: String,
    value: u64,
}

impl Reason for LargeNumber {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Unsupported
    }
}

/// Steps of chunked variables are read together up to this many bytes: 512 MiB.
const BLOCK_MAX: usize = 1 << 29;

/// A NetCDF file.
pub(crate) struct NetcdfFile {
    reader: NetcdfReader,
    /// The groups' paths and attributes.
    groups: Vec<(String, Vec<(String, Attribute)>)>,
    variables: Vec<Variable>,
    /// The heads of the variables as libnetcdf knows them, in the same order.
    heads: Vec<VariableHead>,
    /// The steps that were read last, where chunks hold several.
    kept: RefCell<Option<Block>>,
}

/// Steps of a variable that are read together, so that the chunks that hold them are decompressed but once.
#[derive(Debug, PartialEq)]
struct Block {
    /// The variable's place among all.
    variable: usize,
    ranges: Vec<Range<usize>>,
    values: Array,
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

    fn open(&self, path: &Path, selection: &Selection) -> Result<Box<dyn MapSeries>, Error> {
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
        Ok(NetcdfFile { reader, groups, variables, heads, kept: RefCell::new(None) })
    }

    /// Reads a part of a variable.
    fn part(&self, variable: &Variable, head: &VariableHead, ranges: &[Range<usize>]) -> Result<Array, Error> {
        let mut part = Part {
            start: ranges.iter().map(|range| range.start).collect(),
            count: ranges.iter().map(ExactSizeIterator::len).collect(),
        };
        match variable.kind {
            Kind::Real32 | Kind::Real64 => self.reader.read_real(head, &part).map(Array::Real),
            Kind::Integer { bits: 64, signed: false } => {
                let values = self.reader.read_unsigned(head, &part)?;
                let whole = |value| i64::try_from(value).map_err(|_| LargeNumber { variable: variable.path(), value });
                Ok(Array::Whole(values.into_iter().map(whole).collect::<Result<_, _>>()?))
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
            Kind::Other => Err(no_field(variable).into()),
        }
    }
}

fn no_field(variable: &Variable) -> dataset::Problem {
    dataset::Problem::VariableKind { variable: variable.path(), found: "neither numbers nor text" }
}

/// The dimension along which more than these ranges is to be read, and from where to where: that of steps where the
/// chunks hold several, as many of them as fit into `most` values.
fn block(
    chunks: &[usize],
    dimensions: &[Dimension],
    ranges: &[Range<usize>],
    most: usize,
) -> Option<(usize, Range<usize>)> {
    let along = ranges.iter().zip(chunks).position(|(range, &chunk)| range.len() == 1 && chunk > 1)?;
    let one = ranges.iter().try_fold(1usize, |product, range| product.checked_mul(range.len()))?;
    let most = most.checked_div(one).unwrap_or(0);
    let (step, chunk) = (ranges[along].start, chunks[along]);
    let steps = most.min(chunk);
    let first = step - step % chunk;
    let start = step - (step - first) % steps.max(1);
    let end = (start + steps).min(first + chunk).min(dimensions[along].len);
    (steps > 1).then_some((along, start..end))
}

impl Block {
    /// One step of it, along a dimension.
    fn step(&self, along: usize, step: usize) -> Array {
        let inner = self.ranges[along + 1..].iter().map(ExactSizeIterator::len).product();
        let len = self.ranges[along].len();
        let step = step - self.ranges[along].start;
        match &self.values {
            Array::Real(values) => Array::Real(cut(values, inner, len, step)),
            Array::Whole(values) => Array::Whole(cut(values, inner, len, step)),
            Array::Text(values) => Array::Text(cut(values, inner, len, step)),
        }
    }
}

/// One of `len` places along a dimension, within which the others have `inner` values.
fn cut<T: Clone>(values: &[T], inner: usize, len: usize, place: usize) -> Vec<T> {
    values.chunks_exact(inner).skip(place).step_by(len).flatten().cloned().collect()
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
        let number = number.ok_or_else(|| no_field(variable))?;
        let head = &self.heads[number];
        let chunks = head.chunks.as_deref().filter(|_| variable.kind != Kind::Text);
        let block = chunks.and_then(|chunks| block(chunks, &variable.dimensions, ranges, BLOCK_MAX / size_of::<f64>()));
        let Some((along, range)) = block else { return self.part(variable, head, ranges) };
        let step = ranges[along].start;
        let mut together = ranges.to_vec();
        together[along] = range;
        let mut kept = self.kept.borrow_mut();
        if kept.as_ref().is_none_or(|block| block.variable != number || block.ranges != together) {
            // The old block makes room for the new one.
            *kept = None;
            match self.part(variable, head, &together) {
                Ok(values) => *kept = Some(Block { variable: number, ranges: together, values }),
                Err(error) if error.kind() == ErrorKind::NoMemory => {}
                Err(error) => return Err(error),
            }
        }
        match kept.as_ref() {
            Some(block) => Ok(block.step(along, step)),
            None => self.part(variable, head, ranges),
        }
    }
}

/// The kind of values of a type of NetCDF.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_a_chunk_are_read_together() {
        let dimensions: Vec<_> = [10, 4, 6].map(|len| Dimension { name: "d".to_owned(), len }).to_vec();
        let along = |chunks: [usize; 3], ranges: [Range<usize>; 3], most| block(&chunks, &dimensions, &ranges, most);
        let step = |step: usize| [step..step + 1, 0..4, 0..6];
        for (chunk, at, most, expected) in [
            (1, 3, 1000, None),
            (4, 3, 1000, Some((0, 0..4))),
            (4, 5, 1000, Some((0, 4..8))),
            (4, 9, 1000, Some((0, 8..10))),
            // Room for 3, 2 and 1 steps.
            (8, 2, 24 * 3, Some((0, 0..3))),
            (8, 7, 24 * 3, Some((0, 6..8))),
            (8, 9, 24 * 2, Some((0, 8..10))),
            (8, 9, 24 * 2 - 1, None),
            (8, 9, 0, None),
        ] {
            assert_eq!(along([chunk, 2, 3], step(at), most), expected, "{chunk} {at} {most}");
        }
        assert_eq!(along([4, 4, 6], [0..10, 0..4, 0..6], 1000), None);
        assert_eq!(along([1, 4, 6], [3..4, 1..2, 0..6], 1000), Some((1, 0..4)));
    }

    #[test]
    fn a_step_is_cut_out() {
        let values = Array::Whole((0..2 * 3 * 2).collect());
        let block = Block { variable: 0, ranges: vec![0..2, 4..7, 0..2], values };
        assert_eq!(block.step(1, 5), Array::Whole(vec![2, 3, 8, 9]));
        assert_eq!(Block { ranges: vec![4..10, 0..2], ..block }.step(0, 4), Array::Whole(vec![0, 1]));
    }
}
