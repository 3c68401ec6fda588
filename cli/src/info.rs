//! `longan info`: what longan sees in a file.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use longan::statistics::{Statistics, statistics};
use longan_formats::{
    self as formats, Ask, At, AxisDescription, Description, DimensionDescription, Error, ErrorKind, Field,
    FieldDescription, GridDescription, Indexing, Selection, TableDescription, TablePlace,
};
use longan_grid::Healpix;
use serde::Serialize;
use serde_json::{Value, json};

use super::input::place;
use super::options::{Format, decimals, nside, print, shown};
use super::remedies;

/// Describes a file: its grids, dimensions and coordinate systems, and each field's unit, range and masked fraction.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// File of maps: FITS, NetCDF, Zarr, CSV, PLY.
    file: PathBuf,
    /// This variable or column only, by its name.
    #[arg(long = "variable", visible_alias = "field", value_name = "NAME")]
    variable: Option<String>,
    /// Place along a dimension to give numbers of, by the value of its coordinate or by its number from 0, such as
    /// level=500, time=1997-12 or time=#0; may be repeated.
    #[arg(long, value_name = "DIM=VALUE|DIM=#N", value_parser = place)]
    select: Vec<At>,
    /// For multi-order (UNIQ) files: Nside to bring the map to [default: that of its finest cells].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = nside)]
    nside: Option<usize>,
    /// How to print.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    format: Format,
}

struct Report<'a> {
    format: &'a str,
    tables: Vec<Table<'a>>,
}

struct Table<'a> {
    table: &'a TableDescription,
    fields: Vec<FieldReport<'a>>,
}

#[derive(Serialize)]
struct FieldReport<'a> {
    /// The value that --variable takes for its name: its number in its table, or that of the variable in the file.
    #[serde(skip)]
    number: usize,
    #[serde(flatten)]
    field: &'a FieldDescription,
    min: Option<f64>,
    max: Option<f64>,
    mean: Option<f64>,
    standard_deviation: Option<f64>,
    masked_fraction: Option<f64>,
    /// The time that these numbers are of, where there are several.
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<String>,
    /// The content of a table that is no map.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_a_map: Option<String>,
    /// Why there are no numbers of the place that is selected.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_selected: Option<String>,
    /// The dimensions along which a place has to be chosen before it is read.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    select: Vec<&'a str>,
}

/// Why a field is not read.
enum Unread {
    NotAMap(String),
    Select,
    /// The selected place is not there.
    Elsewhere(String),
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let description = formats::describe(&arguments.file)?;
    let report = report(arguments, &description)?;
    if report.tables.is_empty() {
        let fields = description.tables.iter().flat_map(names);
        let names: Vec<_> = fields.map(|name| format!("'{}'", name.escape_debug())).collect();
        let wanted = arguments.variable.as_deref().unwrap_or_default().escape_debug();
        bail!("{}: there is no '{wanted}'; there are {}", shown(&arguments.file), names.join(", "));
    }
    let mut out = String::new();
    match arguments.format {
        Format::Json => writeln!(out, "{}", serde_json::to_string_pretty(&json_of(&report)?)?)?,
        Format::Text => write_text(&mut out, arguments, &report)?,
    }
    print(&out)
}

fn report<'a>(arguments: &Arguments, description: &'a Description) -> anyhow::Result<Report<'a>> {
    let mut tables = Vec::new();
    for (place, table) in description.tables.iter().enumerate() {
        let mut fields = Vec::new();
        let is_wanted = |name: &str| arguments.variable.as_ref().is_none_or(|wanted| formats::is_alike(wanted, name));
        let whole = matches!(&table.place, TablePlace::Variable { variable } if is_wanted(variable));
        for (i, field) in table.fields.iter().enumerate().filter(|(_, field)| whole || is_wanted(&field.name)) {
            let read = read(arguments, table, i);
            let (values, time, unread) = match read {
                Ok((values, time)) => (Some(values), time, None),
                Err(e) => (None, None, Some(unread(e)?)),
            };
            let of_values = values.as_deref().and_then(statistics);
            let number = |f: fn(&Statistics) -> f64| of_values.as_ref().map(f);
            let unmasked = of_values.map_or(0, |s| s.unmasked);
            let masked = |all: usize| (all - unmasked) as f64 / all as f64;
            let left = |d: &&DimensionDescription| !d.time && d.len > 1;
            let (mut not_a_map, mut not_selected, mut select) = (None, None, Vec::new());
            match unread {
                None => {}
                Some(Unread::NotAMap(found)) => not_a_map = Some(found),
                Some(Unread::Elsewhere(problem)) => not_selected = Some(problem),
                Some(Unread::Select) => {
                    select = table.dimensions.iter().filter(left).map(|d| d.name.as_str()).collect()
                }
            }
            fields.push(FieldReport {
                number: if matches!(table.place, TablePlace::Variable { .. }) { place } else { i },
                field,
                min: number(|s| s.min),
                max: number(|s| s.max),
                mean: number(|s| s.mean),
                standard_deviation: number(|s| s.sigma),
                masked_fraction: values.map(|values| masked(values.len())),
                time,
                not_a_map,
                not_selected,
                select,
            });
        }
        if !fields.is_empty() || arguments.variable.is_none() {
            tables.push(Table { table, fields });
        }
    }
    Ok(Report { format: description.format, tables })
}

/// The names of the fields of a table; that of a variable is its path.
fn names(table: &TableDescription) -> Vec<&str> {
    match &table.place {
        TablePlace::Variable { variable } => vec![variable],
        _ => table.fields.iter().map(|field| field.name.as_str()).collect(),
    }
}

/// The values of a field as the file has them, of the first of several times, and which that is.
fn read(arguments: &Arguments, table: &TableDescription, number: usize) -> Result<(Vec<f64>, Option<String>), Error> {
    let multi_order = matches!(table.grid, GridDescription::Healpix { indexing: Indexing::MultiOrder, .. });
    let (field, hdu) = match &table.place {
        TablePlace::Hdu { hdu, .. } => (Field::Number(number), Some(*hdu)),
        TablePlace::Variable { variable } => (Field::Name(variable.clone()), None),
        TablePlace::File {} => (Field::Number(number), None),
    };
    let nside = arguments.nside.filter(|_| multi_order);
    let selection = Selection { field: Some(field), hdu, nside, at: arguments.select.clone(), ..Selection::default() };
    let mut maps = formats::open(&arguments.file, &selection)?;
    let several = table.dimensions.iter().any(|dimension| dimension.time && dimension.len > 1);
    let time = maps.times().first().filter(|_| several).map(|time| time.label.clone());
    Ok((maps.values(0)?, time))
}

/// Why a field is not read where there is nothing wrong with the file; any other error remains one.
fn unread(error: Error) -> Result<Unread, Error> {
    if let Some(found) = error.found() {
        return Ok(Unread::NotAMap(found.to_owned()));
    }
    match (error.kind(), error.ask()) {
        (ErrorKind::NoMemory | ErrorKind::InvalidInput, _) => Err(error),
        (ErrorKind::Ambiguous, Some(Ask::Place { dimension: Some(_), place: None })) => Ok(Unread::Select),
        (_, Some(Ask::Place { .. })) => Ok(Unread::Elsewhere(remedies::sentence(&error))),
        _ => Err(error),
    }
}

fn json_of(report: &Report<'_>) -> serde_json::Result<Value> {
    let tables = report.tables.iter().map(|Table { table, fields }| {
        let mut json = serde_json::to_value(table)?;
        json["fields"] = serde_json::to_value(fields)?;
        Ok(json)
    });
    Ok(json!({ "format": report.format, "tables": tables.collect::<serde_json::Result<Vec<_>>>()? }))
}

fn write_text(out: &mut String, arguments: &Arguments, report: &Report<'_>) -> std::fmt::Result {
    writeln!(out, "{}: {}", shown(&arguments.file), report.format)?;
    for Table { table, fields } in &report.tables {
        match &table.place {
            TablePlace::Hdu { hdu, name } => {
                let name = name.as_deref().map(|n| format!(" '{n}'")).unwrap_or_default();
                writeln!(out, "\nHDU {hdu}{name}")?;
            }
            TablePlace::Variable { variable } => writeln!(out, "\nVariable '{variable}'")?,
            TablePlace::File {} => writeln!(out)?,
        }
        write_grid(out, &table.grid)?;
        for dimension in &table.dimensions {
            let DimensionDescription { name, len, time, values } = dimension;
            let noun = if *time { "step" } else { "value" };
            writeln!(out, "  {name:<12} {len} {noun}{}: {values}", if *len == 1 { "" } else { "s" })?;
        }
        for field in &table.fields {
            if let Some(long_name) = &field.long_name {
                writeln!(out, "  long name    {long_name}")?;
            }
        }
        writeln!(
            out,
            "  {:>3} {:<20} {:<12} {:>13} {:>13} {:>13} {:>13} {:>8}",
            "no.", "field", "unit", "min", "max", "mean", "std. dev.", "masked"
        )?;
        for f in fields {
            let unit = f.field.unit.as_deref().unwrap_or("-");
            write!(out, "  {:>3} {:<20} {unit:<12}", f.number, f.field.name)?;
            let Some(masked) = f.masked_fraction else {
                match (&f.not_a_map, &f.not_selected) {
                    (Some(found), _) => writeln!(out, " is {found}, not a map of numbers")?,
                    (_, Some(problem)) => writeln!(out, " {problem}")?,
                    (None, None) => {
                        let select: Vec<_> = f.select.iter().map(|name| format!("--select {name}=VALUE")).collect();
                        writeln!(out, " needs {}", select.join(" "))?;
                    }
                }
                continue;
            };
            let show = |x: Option<f64>| x.map_or("-".to_owned(), |x| decimals(x, 6));
            let [min, max, mean, sigma] = [f.min, f.max, f.mean, f.standard_deviation].map(show);
            let time = f.time.as_deref().map(|time| format!(" (at {time})")).unwrap_or_default();
            writeln!(out, " {min:>13} {max:>13} {mean:>13} {sigma:>13} {:>7.3}%{time}", 100.0 * masked)?;
        }
    }
    Ok(())
}

fn write_grid(out: &mut String, grid: &GridDescription) -> std::fmt::Result {
    match grid {
        GridDescription::Healpix { nside, ordering, ordering_assumed, coordinates, indexing, pixels: stored } => {
            let assumed = if *ordering_assumed { " (assumed, the file does not say)" } else { "" };
            let pixels = 12 * nside * nside;
            let indexing = match indexing {
                Indexing::Implicit => "all pixels in order".to_owned(),
                Indexing::Explicit => format!("{stored} of {pixels} pixels, by their numbers"),
                Indexing::MultiOrder => format!("{stored} cells of several sizes (UNIQ)"),
            };
            let coordinates = coordinates.map_or("not stated".to_owned(), |c| format!("{c:?}").to_lowercase());
            writeln!(out, "  Nside        {nside} ({pixels} pixels, one every {:.4} deg)", spacing(*nside))?;
            writeln!(out, "  ordering     {ordering}{assumed}")?;
            writeln!(out, "  coordinates  {coordinates}")?;
            writeln!(out, "  indexing     {indexing}")
        }
        GridDescription::LatLon { latitudes, longitudes, global } => {
            let extent = if *global { "global" } else { "regional" };
            writeln!(out, "  grid         {} latitudes x {} longitudes, {extent}", latitudes.count, longitudes.count)?;
            for (name, axis) in [("latitudes", latitudes), ("longitudes", longitudes)] {
                let AxisDescription { first, last, spacing, .. } = axis;
                let spacing = match spacing {
                    Some(spacing) => format!(", one every {spacing:.4} deg"),
                    None => ", unevenly spaced".to_owned(),
                };
                writeln!(out, "  {name:<12} {first} to {last} deg{spacing}")?;
            }
            Ok(())
        }
        GridDescription::Points { points, coordinates, spacing, nside, covered } => {
            writeln!(out, "  points       {points}")?;
            if let Some(coordinates) = coordinates {
                writeln!(out, "  coordinates  {}", format!("{coordinates:?}").to_lowercase())?;
            }
            match (spacing, nside, covered) {
                (Some(spacing), Some(nside), Some(covered)) => {
                    writeln!(out, "  spacing      {spacing:.4} deg, typically")?;
                    writeln!(out, "  Nside        {nside}, unless --nside is given")?;
                    writeln!(out, "  covers       {:.2}% of the sphere, unless --reach is given", 100.0 * covered)
                }
                _ => writeln!(out, "  spacing      unknown, as all are at one place; give --nside and --reach"),
            }
        }
        GridDescription::Surface { vertices, triangles, centre: [x, y, z], nside, covered, folded } => {
            writeln!(out, "  surface      {vertices} vertices, {triangles} triangles")?;
            writeln!(out, "  centre       {x:.6}, {y:.6}, {z:.6}, unless --centre is given")?;
            writeln!(out, "  Nside        {nside}, unless --nside is given")?;
            let [covered, folded] = [covered, folded].map(|share| 100.0 * share);
            writeln!(out, "  covers       {covered:.2}% of the sphere, {folded:.2}% more than once")
        }
    }
}

/// Side of a square of a pixel's area, in degrees.
fn spacing(nside: usize) -> f64 {
    Healpix::new(nside).map_or(f64::NAN, |grid| grid.pixel_side().to_degrees())
}
