//! `longan info`: what longan sees in a file.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use longan::formats::{self, Description, Field, FieldDescription, Indexing, Selection, TableDescription};
use longan::statistics::{Statistics, statistics};
use serde::Serialize;

/// What a file holds: Nside, ordering, coordinate system, and each field's unit, range and masked fraction.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// HEALPix file.
    file: PathBuf,
    /// How to print.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    format: Format,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    Text,
    Json,
}

#[derive(Serialize)]
struct Report<'a> {
    format: &'a str,
    tables: Vec<Table<'a>>,
}

#[derive(Serialize)]
struct Table<'a> {
    #[serde(flatten)]
    table: &'a TableDescription,
    /// Takes the place of the description's bare fields.
    #[serde(rename = "statistics")]
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
    masked_fraction: f64,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let description = formats::describe(&arguments.file)?;
    let report = report(arguments, &description)?;
    let mut out = std::io::stdout().lock();
    match arguments.format {
        Format::Json => {
            serde_json::to_writer_pretty(&mut out, &report)?;
            writeln!(out)?;
        }
        Format::Text => print(&mut out, arguments, &report)?,
    }
    Ok(())
}

fn report<'a>(arguments: &Arguments, description: &'a Description) -> anyhow::Result<Report<'a>> {
    let mut tables = Vec::new();
    for table in &description.tables {
        let mut fields = Vec::new();
        for (number, field) in table.fields.iter().enumerate() {
            let selection = Selection { field: Some(Field::Number(number)), hdu: Some(table.hdu), nside: None };
            let map = formats::read(&arguments.file, &selection)?;
            let of_map = statistics(map.values());
            let number = |f: fn(&Statistics) -> f64| of_map.as_ref().map(f);
            fields.push(FieldReport {
                field,
                min: number(|s| s.min),
                max: number(|s| s.max),
                mean: number(|s| s.mean),
                standard_deviation: number(|s| s.sigma),
                masked_fraction: 1.0 - of_map.map_or(0.0, |s| s.unmasked as f64 / map.values().len() as f64),
            });
        }
        tables.push(Table { table, fields });
    }
    Ok(Report { format: description.format, tables })
}

fn print(out: &mut impl Write, arguments: &Arguments, report: &Report<'_>) -> std::io::Result<()> {
    writeln!(out, "{}: {}", arguments.file.display(), report.format)?;
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
            let show = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.6e}"));
            writeln!(
                out,
                "  {i:>3} {:<20} {:<12} {:>13} {:>13} {:>13} {:>13} {:>7.3}%",
                f.field.name,
                f.field.unit.as_deref().unwrap_or("-"),
                show(f.min),
                show(f.max),
                show(f.mean),
                show(f.standard_deviation),
                100.0 * f.masked_fraction
            )?;
        }
    }
    Ok(())
}

/// Side of a square of a pixel's area, in degrees.
fn spacing(nside: usize) -> f64 {
    (std::f64::consts::PI / 3.0).sqrt().to_degrees() / nside as f64
}
