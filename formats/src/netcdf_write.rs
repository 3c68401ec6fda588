//! HEALPix maps as CF NetCDF, one step in time after the other.
//!
//! The same input always gives the same bytes. Pixels are numbered in a coordinate variable as wide as the map, which
//! CF recommends and other software looks for. The meaning of values and attributes is left to the caller.

use std::collections::HashSet;
use std::fmt::Display;
use std::path::Path;

use netcdf::{AttributeValue, Extent, FileMut, NcTypeDescriptor, VariableMut};
use rayon::prelude::*;

use crate::card::{Card, CardValue};
use crate::error::{self, Error, ErrorKind, Reason, Use};
use crate::libnetcdf;
use crate::quantity::StatedQuantity;
use crate::text::spaced;
use longan_grid::accumulate::CHUNK;
use longan_grid::{Healpix, Ordering, Time};

/// Maps that a NetCDF file cannot hold.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error(
        "Nside {nside} is not a power of two, which HEALPix in NetCDF needs (its refinement level is log2 Nside); write FITS"
    )]
    RefinementLevel { nside: usize },
    #[error(
        "step {step} does not go with the file's columns and axis of time; give each step all columns and its time, or a file without such an axis one step"
    )]
    StepTime { step: usize },
}

impl Reason for Problem {
    fn kind(&self) -> ErrorKind {
        ErrorKind::InvalidInput
    }
}

/// The grid, columns and attributes that all steps of a file share.
#[derive(Clone, Debug)]
pub struct NetcdfLayout {
    /// The grid of all columns.
    pub grid: Healpix,
    /// The ordering to write.
    pub ordering: Ordering,
    /// Whether to write single precision.
    pub float32: bool,
    /// The columns, each a data variable.
    pub columns: Vec<NetcdfColumn>,
    /// The numbers that each step has one of, each a variable without pixels.
    pub numbers: Vec<NetcdfColumn>,
    /// The attributes of the file, whose names are the keys in lower case; their comments are not written.
    pub attributes: Vec<Card>,
    /// The unit and the calendar of time, where there is an axis of it.
    pub time: Option<TimeAxis>,
}

/// One column, or one number, of all steps.
#[derive(Clone, Debug)]
pub struct NetcdfColumn {
    /// The name. Characters other than letters of ASCII, digits and '_' are written as '_', since CF has no other names.
    pub name: String,
    /// The unit; may be empty.
    pub unit: String,
    /// A description in words; may be empty.
    pub long_name: String,
    /// The quantity, if known.
    pub quantity: Option<StatedQuantity>,
}

/// The axis of time, in the words of CF.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimeAxis {
    /// The unit, such as `days since 1979-01-01`.
    pub units: String,
    /// The calendar, such as `standard`.
    pub calendar: String,
}

/// A file to which steps are written one by one, so that no more than one is in memory.
pub struct NetcdfWriter {
    layout: NetcdfLayout,
    file: FileMut,
    /// The names of the data variables.
    names: Vec<String>,
    /// The names of the variables of numbers.
    numbers: Vec<String>,
    /// Number of steps written.
    steps: usize,
}

/// Name of the variable that describes the grid.
const GRID: &str = "healpix";
/// Name of the dimension of pixels, and of their numbers.
const CELL: &str = "cell";
/// Name of the dimension of steps, and of their times.
const TIME: &str = "time";

/// Level of deflate: more takes far longer and makes measured fields hardly smaller.
const DEFLATE: i32 = 1;

/// Values in one chunk of a variable: 1 to 2 MiB, the size for which libnetcdf is tuned.
const VALUES_PER_CHUNK: usize = 1 << 18;

impl NetcdfWriter {
    /// Begins a file; inside of [`save()`](crate::save()), the one whose path it gives.
    ///
    /// # Errors
    /// [`ErrorKind::InvalidInput`] where Nside is not a power of two, or [`ErrorKind::Unwritable`].
    pub fn create(path: &Path, layout: NetcdfLayout) -> Result<Self, Error> {
        let grid = layout.grid;
        let level = grid.depth().map_err(|_| Problem::RefinementLevel { nside: grid.nside() })?;
        // libnetcdf takes some relative paths for addresses on the net.
        let path = std::path::absolute(path).map_err(Error::io("write it"))?;
        libnetcdf::quiet();
        let file = netcdf::create(path).map_err(refused("create it"))?;
        let mut names = names(layout.columns.iter().chain(&layout.numbers));
        let numbers = names.split_off(layout.columns.len());
        let mut writer = NetcdfWriter { names, numbers, layout, file, steps: 0 };
        writer.define(level).map_err(refused("write its header"))?;
        writer.number_pixels().map_err(refused("number its pixels"))?;
        Ok(writer)
    }

    /// Writes the next step: for each column a value for each pixel in RING order (whatever the ordering of the file),
    /// NaN where masked, its numbers, and its time where the file has an axis of it.
    ///
    /// # Errors
    /// [`ErrorKind::InvalidInput`] where the step does not suit the layout, or [`ErrorKind::Unwritable`].
    pub fn append(&mut self, columns: &[&[f64]], numbers: &[f64], time: Option<&Time>) -> Result<(), Error> {
        let (grid, axis) = (self.layout.grid, self.layout.time.is_some());
        let all = columns.len() == self.names.len() && numbers.len() == self.numbers.len();
        if axis != time.is_some() || !all || !axis && self.steps > 0 {
            return Err(Problem::StepTime { step: self.steps + 1 }.into());
        }
        for (values, name) in columns.iter().zip(&self.names) {
            if values.len() != grid.pixels() {
                let (found, nside, expected) = (values.len(), grid.nside(), grid.pixels());
                return Err(error::Problem::ColumnLength { column: name.clone(), found, nside, expected }.into());
            }
        }
        if let Some(time) = time {
            self.put(TIME, &[time.value], [self.steps.into()]).map_err(refused("write a time"))?;
        }
        for (place, number) in numbers.iter().enumerate() {
            let name = self.numbers[place].clone();
            let written = match time {
                Some(_) => self.put(&name, &[*number], [self.steps.into()]),
                None => self.put::<_, 0>(&name, &[*number], []),
            };
            written.map_err(refused(format_args!("write '{name}'")))?;
        }
        for (number, values) in columns.iter().enumerate() {
            let written = if self.layout.float32 {
                self.write(number, values, |value| value as f32)
            } else {
                self.write(number, values, |value| value)
            };
            written.map_err(refused(format_args!("write '{}'", self.names[number])))?;
        }
        self.steps += 1;
        Ok(())
    }

    /// Completes the file.
    ///
    /// # Errors
    /// [`ErrorKind::Unwritable`].
    pub fn finish(self) -> Result<(), Error> {
        self.file.close().map_err(refused("finish it"))
    }

    /// Defines dimensions, variables and attributes.
    fn define(&mut self, level: u8) -> netcdf::Result<()> {
        let NetcdfWriter { layout, file, names, numbers, .. } = self;
        let pixels = layout.grid.pixels();
        let mut given = HashSet::from(["Conventions".to_owned()]);
        file.add_attribute("Conventions", "CF-1.13")?;
        for Card { key, value, .. } in &layout.attributes {
            let key = unlike(&given, legal(&key.to_lowercase()));
            file.add_attribute(&key, attribute(value))?;
            given.insert(key);
        }
        if layout.time.is_some() {
            file.add_unlimited_dimension(TIME)?;
        }
        file.add_dimension(CELL, pixels)?;

        let mut grid = file.add_variable::<i32>(GRID, &[])?;
        grid.put_attribute("grid_mapping_name", "healpix")?;
        grid.put_attribute("refinement_level", i32::from(level))?;
        let scheme = match layout.ordering {
            Ordering::Ring => "ring",
            Ordering::Nested => "nested",
        };
        grid.put_attribute("indexing_scheme", scheme)?;

        let chunk = pixels.min(VALUES_PER_CHUNK);
        let mut cell = file.add_variable::<i64>(CELL, &[CELL])?;
        cell.set_chunking(&[chunk])?;
        cell.set_compression(DEFLATE, true)?;
        cell.put_attribute("standard_name", "healpix_index")?;
        cell.put_attribute("long_name", "number of the HEALPix pixel")?;
        cell.put_attribute("units", "1")?;

        let (mut dimensions, mut chunks) = (vec![CELL], vec![chunk]);
        if let Some(axis) = &layout.time {
            let mut time = file.add_variable::<f64>(TIME, &[TIME])?;
            time.put_attribute("standard_name", "time")?;
            time.put_attribute("axis", "T")?;
            for (attribute, text) in [("units", &axis.units), ("calendar", &axis.calendar)] {
                if !text.is_empty() {
                    time.put_attribute(attribute, text.as_str())?;
                }
            }
            dimensions.insert(0, TIME);
            chunks.insert(0, 1);
        }
        let steps = if layout.time.is_some() { &[TIME][..] } else { &[] };
        for (number, name) in layout.numbers.iter().zip(numbers) {
            describe(&mut file.add_variable::<f64>(name, steps)?, number)?;
        }
        for (column, name) in layout.columns.iter().zip(names) {
            let mut variable = if layout.float32 {
                let mut variable = file.add_variable::<f32>(name, &dimensions)?;
                variable.set_fill_value(f32::NAN)?;
                variable
            } else {
                let mut variable = file.add_variable::<f64>(name, &dimensions)?;
                variable.set_fill_value(f64::NAN)?;
                variable
            };
            variable.set_chunking(&chunks)?;
            variable.set_compression(DEFLATE, true)?;
            describe(&mut variable, column)?;
            variable.put_attribute("grid_mapping", GRID)?;
        }
        Ok(())
    }

    fn number_pixels(&mut self) -> netcdf::Result<()> {
        let pixels = self.layout.grid.pixels();
        for start in (0..pixels).step_by(CHUNK) {
            let end = (start + CHUNK).min(pixels);
            let numbers: Vec<i64> = (start as i64..end as i64).collect();
            self.put(CELL, &numbers, [(start..end).into()])?;
        }
        Ok(())
    }

    /// Writes a column of a step, as the file's type.
    fn write<T: NcTypeDescriptor + Send>(
        &mut self,
        number: usize,
        values: &[f64],
        convert: impl Fn(f64) -> T + Sync,
    ) -> netcdf::Result<()> {
        // That there is a NESTED ordering is known from the beginning.
        let depth = self.layout.grid.depth().ok().filter(|_| self.layout.ordering == Ordering::Nested);
        let layer = depth.map(cdshealpix::nested::get);
        let name = self.names[number].clone();
        let mut stored = Vec::new();
        for start in (0..values.len()).step_by(VALUES_PER_CHUNK) {
            let end = (start + VALUES_PER_CHUNK).min(values.len());
            let place = |pixel: usize| layer.map_or(pixel, |layer| layer.to_ring(pixel as u64) as usize);
            (start..end).into_par_iter().map(|pixel| convert(values[place(pixel)])).collect_into_vec(&mut stored);
            match &self.layout.time {
                Some(_) => self.put(&name, &stored, [self.steps.into(), (start..end).into()])?,
                None => self.put(&name, &stored, [(start..end).into()])?,
            }
        }
        Ok(())
    }

    fn put<T: NcTypeDescriptor, const N: usize>(
        &mut self,
        variable: &str,
        values: &[T],
        extents: [Extent; N],
    ) -> netcdf::Result<()> {
        let missing = || netcdf::Error::NotFound(variable.to_owned());
        self.file.variable_mut(variable).ok_or_else(missing)?.put_values(values, extents)
    }
}

/// For `map_err`: a refusal of the NetCDF library.
fn refused(action: impl Display) -> impl FnOnce(netcdf::Error) -> Error {
    move |error| {
        let (action, message) = (action.to_string(), spaced(error));
        libnetcdf::Problem::Refused { action, message, use_of: Use::Writing }.into()
    }
}

/// Writes unit and description of a variable.
fn describe(variable: &mut VariableMut<'_>, column: &NetcdfColumn) -> netcdf::Result<()> {
    for (name, text) in [("units", &column.unit), ("long_name", &column.long_name)] {
        if !text.is_empty() {
            variable.put_attribute(name, text.as_str())?;
        }
    }
    for Card { key, value, .. } in column.quantity.iter().flat_map(StatedQuantity::attributes) {
        variable.put_attribute(&key, attribute(&value))?;
    }
    Ok(())
}

/// The names of the variables: legal, and each but once.
fn names<'c>(columns: impl Iterator<Item = &'c NetcdfColumn>) -> Vec<String> {
    let mut taken = HashSet::from([GRID, CELL, TIME].map(str::to_owned));
    let name = |column: &NetcdfColumn| {
        let name = unlike(&taken, legal(&column.name));
        taken.insert(name.clone());
        name
    };
    columns.map(name).collect()
}

/// A name of letters, digits and '_' that begins with a letter.
fn legal(name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("v{name}") }
}

/// The name, with as many '_' behind it as make it differ from those that are taken.
fn unlike(taken: &HashSet<String>, mut name: String) -> String {
    while taken.contains(&name) {
        name.push('_');
    }
    name
}

fn attribute(value: &CardValue) -> AttributeValue {
    match value {
        CardValue::Text(text) => text.replace('\0', " ").into(),
        CardValue::Real(number) => (*number).into(),
        // Most software takes whole numbers of 32 bits better.
        CardValue::Integer(number) => i32::try_from(*number).map_or_else(|_| (*number).into(), Into::into),
        CardValue::Logical(truth) => truth.to_string().into(),
    }
}
