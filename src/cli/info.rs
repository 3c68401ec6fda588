//! `longan info`: what longan sees in a file.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use longan::formats::{self, Description, Error, Field, FieldDescription, Indexing, Selection, TableDescription};
use longan::statistics::{Statistics, statistics};
use serde::Serialize;
use serde_json::{Value, json};

use super::options::{Format, decimals, nside, print, shown};

/// What a file holds: Nside, ordering, coordinate system, and each field's unit, range and masked fraction.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// HEALPix file.
    file: PathBuf,
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
    #[serde(flatten)]
    field: &'a FieldDescription,
    min: Option<f64>,
    max: Option<f64>,
    mean: Option<f64>,
    standard_deviation: Option<f64>,
    masked_fraction: Option<f64>,
    /// What it holds where that is no map.
    #[serde(skip_serializing_if = "Option::is_none")]
    not_a_map: Option<&'static str>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let description = formats::describe(&arguments.file)?;
    let report = report(arguments, &description)?;
    let mut out = String::new();
    match arguments.format {
        Format::Json => writeln!(out, "{}", serde_json::to_string_pretty(&json_of(&report)?)?)?,
        Format::Text => write_text(&mut out, arguments, &report)?,
    }
    print(&out)
}

fn report<'a>(arguments: &Arguments, description: &'a Description) -> anyhow::Result<Report<'a>> {
    let mut tables = Vec::new();
    for table in &description.tables {
        let mut fields = Vec::new();
        for (number, field) in table.fields.iter().enumerate() {
            let nside = arguments.nside.filter(|_| table.indexing == Indexing::MultiOrder);
            let selection =
                Selection { field: Some(Field::Number(number)), hdu: Some(table.hdu), nside, ..Selection::default() };
            let (map, not_a_map) = match formats::read(&arguments.file, &selection) {
                Ok(map) => (Some(map), None),
                Err(e) => (None, Some(kind(e)?)),
            };
            let of_map = map.as_ref().and_then(|map| statistics(map.values()));
            let number = |f: fn(&Statistics) -> f64| of_map.as_ref().map(f);
            let unmasked = of_map.map_or(0, |s| s.unmasked);
            let masked = |pixels: usize| (pixels - unmasked) as f64 / pixels as f64;
            fields.push(FieldReport {
                field,
                min: number(|s| s.min),
                max: number(|s| s.max),
                mean: number(|s| s.mean),
                standard_deviation: number(|s| s.sigma),
                masked_fraction: map.map(|map| masked(map.values().len())),
                not_a_map,
            });
        }
        tables.push(Table { table, fields });
    }
    Ok(Report { format: description.format, tables })
}

/// What a column holds that holds no numbers; any other error remains one.
fn kind(error: Error) -> Result<&'static str, Error> {
    match &error {
        Error::File { problem, .. } => match **problem {
            Error::ColumnKind { found, .. } => Ok(found),
            _ => Err(error),
        },
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
        let name = table.name.as_deref().map(|n| format!(" '{n}'")).unwrap_or_default();
        let assumed = if table.ordering_assumed { " (assumed, the file does not say)" } else { "" };
        let pixels = 12 * table.nside * table.nside;
        let indexing = match table.indexing {
            Indexing::Implicit => "all pixels in order".to_owned(),
            Indexing::Explicit => format!("{} of {pixels} pixels, by their numbers", table.pixels),
            Indexing::MultiOrder => format!("{} cells of several sizes (UNIQ)", table.pixels),
        };
        let coordinates = table.coordinates.map_or("not said".to_owned(), |c| format!("{c:?}").to_lowercase());
        writeln!(out, "\nHDU {}{name}", table.hdu)?;
        writeln!(out, "  Nside        {} ({pixels} pixels, one every {:.4} deg)", table.nside, spacing(table.nside))?;
        writeln!(out, "  ordering     {}{assumed}", table.ordering)?;
        writeln!(out, "  coordinates  {coordinates}")?;
        writeln!(out, "  indexing     {indexing}")?;
        writeln!(
            out,
            "  {:>3} {:<20} {:<12} {:>13} {:>13} {:>13} {:>13} {:>8}",
            "no.", "field", "unit", "min", "max", "mean", "std. dev.", "masked"
        )?;
        for (i, f) in fields.iter().enumerate() {
            let unit = f.field.unit.as_deref().unwrap_or("-");
            write!(out, "  {i:>3} {:<20} {unit:<12}", f.field.name)?;
            let Some(masked) = f.masked_fraction else {
                writeln!(out, " is {}, not a map of numbers", f.not_a_map.unwrap_or_default())?;
                continue;
            };
            let show = |x: Option<f64>| x.map_or("-".to_owned(), |x| decimals(x, 6));
            let [min, max, mean, sigma] = [f.min, f.max, f.mean, f.standard_deviation].map(show);
            writeln!(out, " {min:>13} {max:>13} {mean:>13} {sigma:>13} {:>7.3}%", 100.0 * masked)?;
        }
    }
    Ok(())
}

/// Side of a square of a pixel's area, in degrees.
fn spacing(nside: usize) -> f64 {
    (std::f64::consts::PI / 3.0).sqrt().to_degrees() / nside as f64
}
