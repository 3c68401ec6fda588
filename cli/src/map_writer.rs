//! Files of maps, in the format that their name asks for, written step by step.
//!
//! The content of maps is left to the commands, the bytes to [`longan_formats`].

use std::path::Path;

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use longan_formats::{
    self as formats, Card, CardValue, Column, Error, Extension, HealpixLayout, HealpixWriter, NetcdfColumn,
    NetcdfLayout, NetcdfWriter, StatedQuantity, TimeAxis,
};
use longan_grid::{CoordinateSystem, Healpix, Map, Ordering, Time};

use super::cards::text;
use super::options::shown;

/// How maps are laid out in files.
#[derive(Args, Clone, Debug, Default, PartialEq)]
#[command(next_help_heading = "Output")]
pub(crate) struct LayoutOptions {
    /// Ordering of the output [default: the input's].
    #[arg(long, value_name = "ORDERING")]
    ordering: Option<OrderingOption>,
    /// Write single precision.
    #[arg(long)]
    float32: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum OrderingOption {
    Ring,
    #[value(alias = "nest")]
    Nested,
}

/// The formats of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Fits,
    Netcdf,
}

/// Names that end in these are of files that only other programs write.
const INPUTS: [&str; 10] = ["csv", "tsv", "txt", "dat", "ply", "zarr", "h5", "hdf5", "he5", "cdf"];

/// Those of them that hold grids, so that NetCDF suits what is made of them.
const GRIDS: [&str; 5] = ["zarr", "h5", "hdf5", "he5", "cdf"];

/// The end of a file's name after its last dot, in lower case.
fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

impl Kind {
    /// The format that a file's name asks for: NetCDF by `.nc` or `.nc4`, FITS by `.fits`, `.fits.gz` or no extension.
    pub(crate) fn of(path: &Path) -> anyhow::Result<Self> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match extension(path).as_str() {
            "nc" | "nc4" => Ok(Kind::Netcdf),
            "" => Ok(Kind::Fits),
            _ if name.contains(".fit") => Ok(Kind::Fits),
            _ => bail!(
                "{}: the name does not say in which format to write; end it in .fits or .fits.gz for FITS, in .nc or \
                 .nc4 for NetCDF",
                shown(path)
            ),
        }
    }

    /// The name of the output for an input: the input's, or where files of that name are not written, one like it.
    pub(crate) fn name_for(input: &Path) -> std::ffi::OsString {
        let name = input.file_name().unwrap_or_default();
        if Kind::of(input).is_ok() {
            return name.to_owned();
        }
        let extension = extension(input);
        let is = |list: &[&str]| list.contains(&extension.as_str());
        let mut output = if is(&INPUTS) { input.file_stem().unwrap_or(name) } else { name }.to_owned();
        output.push(if is(&GRIDS) { ".nc" } else { ".fits" });
        output
    }
}

/// The content of one step of a file.
pub(crate) struct Step {
    /// The time of the step, where it has one.
    pub(crate) time: Option<Time>,
    /// The maps.
    pub(crate) tables: Vec<Table>,
    /// The attributes of the file as a whole where tables have no headers of their own; of the first step only.
    pub(crate) attributes: Vec<Card>,
    /// Numbers that each step has, where tables have no headers of their own.
    pub(crate) numbers: Vec<(NetcdfColumn, f64)>,
}

/// Maps that share a header.
pub(crate) struct Table {
    pub(crate) name: String,
    pub(crate) cards: Vec<Card>,
    pub(crate) columns: Vec<MapColumn>,
}

/// A map, in RING order.
pub(crate) struct MapColumn {
    pub(crate) name: String,
    pub(crate) unit: String,
    /// A description in words; may be empty.
    pub(crate) long_name: String,
    /// The quantity, if known.
    pub(crate) quantity: Option<StatedQuantity>,
    pub(crate) values: Vec<f64>,
}

/// The grid and format that all steps of a file share.
#[derive(Clone, Copy)]
pub(crate) struct Layout {
    pub(crate) grid: Healpix,
    pub(crate) ordering: Ordering,
    pub(crate) coordinates: Option<CoordinateSystem>,
    pub(crate) float32: bool,
    pub(crate) steps: usize,
}

impl LayoutOptions {
    /// The layout of maps that are made from one of an ordering, in words.
    pub(crate) fn settings(&self, ordering: Ordering) -> Vec<String> {
        let ordering = match self.ordering_for(ordering) {
            Ordering::Ring => "ring",
            Ordering::Nested => "nested",
        };
        std::iter::once(ordering).chain(self.float32.then_some("float32")).map(str::to_owned).collect()
    }

    /// The ordering of maps that are made from one of an ordering.
    fn ordering_for(&self, input: Ordering) -> Ordering {
        match self.ordering {
            Some(OrderingOption::Ring) => Ordering::Ring,
            Some(OrderingOption::Nested) => Ordering::Nested,
            None => input,
        }
    }

    /// The layout of a file of maps on a grid that are made from a map.
    pub(crate) fn layout(&self, map: &Map, grid: Healpix, kind: Kind, steps: usize) -> anyhow::Result<Layout> {
        let ordering = self.ordering_for(map.ordering);
        let nside = grid.nside();
        if ordering == Ordering::Nested && !grid.has_nested() {
            bail!("an output Nside of {nside} is not a power of two, which NESTED needs; add --ordering ring");
        }
        if kind == Kind::Netcdf && !grid.has_nested() {
            bail!("an output Nside of {nside} is not a power of two, which HEALPix in NetCDF needs; write FITS");
        }
        Ok(Layout { grid, ordering, coordinates: map.coordinates, float32: self.float32, steps })
    }
}

/// Writes a file, all or nothing, of one step or several, which are made one after the other.
///
/// # Errors
/// Those of the steps, and those of writing.
pub(crate) fn write(
    path: &Path,
    kind: Kind,
    layout: Layout,
    overwrite: bool,
    steps: impl IntoIterator<Item = anyhow::Result<Step>>,
) -> anyhow::Result<()> {
    // The file that is asked for is named, not the temporary one.
    let named = |error: Error| error.with_path(path);
    formats::save(path, overwrite, |temporary| match kind {
        Kind::Fits => {
            let Layout { grid, ordering, coordinates, float32, steps: count } = layout;
            let of_file = HealpixLayout { grid, ordering, coordinates, float32 };
            let mut writer = HealpixWriter::create(temporary, of_file).map_err(named)?;
            for step in steps {
                let Step { time, tables, .. } = step?;
                for table in tables {
                    writer.append(&extension_of(table, time.as_ref(), count)).map_err(named)?;
                }
            }
            Ok(writer.finish().map_err(named)?)
        }
        Kind::Netcdf => {
            let mut steps = steps.into_iter();
            let mut first = steps.next().context("there is no step to write")??;
            let mut writer = NetcdfWriter::create(temporary, netcdf_layout(layout, &mut first)).map_err(named)?;
            append(&mut writer, &first).map_err(named)?;
            drop(first);
            for step in steps {
                append(&mut writer, &step?).map_err(named)?;
            }
            Ok(writer.finish().map_err(named)?)
        }
    })
}

/// A table of a FITS file.
fn extension_of(table: Table, time: Option<&Time>, steps: usize) -> Extension {
    let Table { mut name, mut cards, columns } = table;
    if let Some(time) = time {
        if steps > 1 {
            name = format!("{name} {}", time.label);
        }
        cards.extend(time_cards(time));
    }
    let quantities = (1..).zip(&columns).filter_map(|(number, column)| Some(column.quantity.as_ref()?.cards(number)));
    cards.extend(quantities.flatten());
    let column = |MapColumn { name, unit, values, .. }: MapColumn| Column { name, unit, values };
    Extension { name, cards, history: Vec::new(), columns: columns.into_iter().map(column).collect() }
}

/// The entries of a FITS header for a time: as the file had it, and its date where FITS has such dates.
fn time_cards(time: &Time) -> Vec<Card> {
    let real = Card { key: "TIME".into(), value: CardValue::Real(time.value), comment: "time of the input".into() };
    let mut cards = vec![real, text("TIMEUNIT", time.units.clone(), "its unit")];
    if !time.calendar.is_empty() {
        cards.push(text("CALENDAR", time.calendar.clone(), "its calendar"));
    }
    let earthly = ["standard", "gregorian", "proleptic_gregorian"].contains(&time.calendar.as_str());
    let dated = time.label.get(..10).is_some_and(|date| date.as_bytes()[4] == b'-' && date.as_bytes()[7] == b'-');
    if earthly && dated {
        // FITS wants seconds after minutes.
        let seconds = if time.label.len() == "1997-12-01T06:00".len() { ":00" } else { "" };
        cards.push(text("DATE-OBS", format!("{}{seconds}", time.label), "date of the input"));
    }
    cards
}

/// The layout of a NetCDF file whose steps are like this one.
fn netcdf_layout(layout: Layout, first: &mut Step) -> NetcdfLayout {
    let several = first.tables.len() > 1;
    let column = |table: &Table, column: &MapColumn| NetcdfColumn {
        name: if several { format!("{}_{}", column.name, table.name) } else { column.name.clone() },
        unit: column.unit.clone(),
        long_name: column.long_name.clone(),
        quantity: column.quantity.clone(),
    };
    let of_table = |table| -> Vec<_> { Table::columns(table).iter().map(|c| column(table, c)).collect() };
    let mut attributes = std::mem::take(&mut first.attributes);
    if let Some(coordinates) = layout.coordinates {
        attributes.push(text("coordsys", format!("{coordinates:?}").to_lowercase(), ""));
    }
    attributes.retain(|card| !matches!(&card.value, CardValue::Text(text) if text.is_empty()));
    let axis = |time: &Time| TimeAxis { units: time.units.clone(), calendar: time.calendar.clone() };
    NetcdfLayout {
        grid: layout.grid,
        ordering: layout.ordering,
        float32: layout.float32,
        columns: first.tables.iter().flat_map(of_table).collect(),
        numbers: first.numbers.iter().map(|(number, _)| number.clone()).collect(),
        attributes,
        time: first.time.as_ref().map(axis),
    }
}

fn append(writer: &mut NetcdfWriter, step: &Step) -> Result<(), Error> {
    let columns: Vec<&[f64]> = step.tables.iter().flat_map(Table::columns).map(|c| &*c.values).collect();
    let numbers: Vec<f64> = step.numbers.iter().map(|(_, number)| *number).collect();
    writer.append(&columns, &numbers, step.time.as_ref())
}

impl Table {
    fn columns(&self) -> &[MapColumn] {
        &self.columns
    }
}
