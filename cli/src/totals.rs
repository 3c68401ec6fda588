//! `longan totals`: Minkowski functionals of the whole sphere.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};
use longan::totals::Totals;
use longan::{AnalysisError, Map, Thresholds};
use serde::Serialize;

use super::input::Input;
use super::mismatch;
use super::options::{BodyOptions, Running, decimals, print, shown};
use super::progress::Progress;
use super::regridding;

/// Area, length, curvature and Euler characteristic of the body, at each threshold, over the whole sphere.
///
/// By Gauss-Bonnet the Euler characteristic is (area + curvature)/2 pi; it is left empty where pixels are masked. Area and
/// length are those of the unmasked cells, and so is the curvature, made up for the cells' edges beside masked ones. A field
/// with several times has all rows for each.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  longan totals sky.fits
  longan totals sky.fits --thresholds -200:200:9 --format csv > totals.csv
  longan totals sky.fits --mask mask.fits --format json
  longan totals era5.nc --variable z --select level=500 --format csv > totals.csv")]
pub(crate) struct Arguments {
    /// File of a map: FITS, NetCDF, Zarr, CSV, PLY.
    #[arg(value_name = "INPUT")]
    input_file: PathBuf,
    /// How to print.
    #[arg(long, value_name = "FORMAT", default_value = "table")]
    format: Format,
    #[command(flatten)]
    body: BodyOptions,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    running: Running,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Format {
    Table,
    Csv,
    Json,
}

#[derive(Serialize)]
struct Row {
    /// The date of the map, where it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<String>,
    threshold: f64,
    area_sr: f64,
    length_rad: f64,
    curvature_rad: f64,
    euler_characteristic: Option<i64>,
    masked_area_sr: f64,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let path = &arguments.input_file;
    let mask = arguments.input.mask(&arguments.running)?;
    let mut series = arguments.input.open(path)?;
    let steps = series.steps();
    let progress = Progress::new(shown(path), arguments.running.quiet);
    let (mut all, mut unit) = (Vec::new(), None);
    for step in 0..steps {
        let map = series.read(step, mask.as_ref())?;
        if step == 0 {
            regridding::Notices::default().say(&arguments.running, path, &map);
        }
        let time = map.time.as_ref().map(|time| time.label.clone());
        let analysis = arguments.body.analysis();
        mismatch::warn(&arguments.running, path, &map, &analysis, steps > 1);
        let rows = match analysis.totals(&map) {
            // Of a step that has nothing to measure there are no rows.
            Err(e @ (AnalysisError::AllMasked | AnalysisError::Constant { .. })) if steps > 1 => {
                arguments.running.warn(format_args!("{}: at {}: {e}", shown(path), time.unwrap_or_default()));
                Vec::new()
            }
            totals => rows(&map, totals.with_context(|| shown(path))?, time),
        };
        unit = map.unit;
        all.extend(rows);
        progress.set((step + 1) as f64 / steps as f64);
    }
    drop(progress);
    let mut out = String::new();
    match arguments.format {
        Format::Json => writeln!(out, "{}", serde_json::to_string_pretty(&all)?)?,
        Format::Csv => write_csv(&mut out, &all)?,
        Format::Table => {
            for (i, rows) in all.chunk_by(|a, b| a.time == b.time).enumerate() {
                if let Some(time) = rows[0].time.as_ref().filter(|_| steps > 1) {
                    writeln!(out, "{}{time}", if i == 0 { "" } else { "\n" })?;
                }
                write_table(&mut out, rows, unit.as_deref())?;
            }
        }
    }
    print(&out)
}

fn rows(map: &Map, (thresholds, totals, masked): (Thresholds, Vec<Totals>, f64), time: Option<String>) -> Vec<Row> {
    let whole = map.values().iter().all(|v| !v.is_nan());
    let row = |(&threshold, t): (&f64, Totals)| Row {
        time: time.clone(),
        threshold,
        area_sr: t.area,
        length_rad: t.length,
        curvature_rad: t.curvature,
        euler_characteristic: whole.then(|| t.euler_characteristic().round() as i64),
        masked_area_sr: masked,
    };
    thresholds.values().iter().zip(totals).map(row).collect()
}

/// Where maps have times, a column of them comes first.
fn write_csv(out: &mut String, rows: &[Row]) -> std::fmt::Result {
    let timed = rows.iter().any(|r| r.time.is_some());
    let head = "threshold,area_sr,length_rad,curvature_rad,euler_characteristic,masked_area_sr";
    writeln!(out, "{}{head}", if timed { "time," } else { "" })?;
    for r in rows {
        let time = r.time.as_ref().map(|time| format!("{time},")).unwrap_or_default();
        let euler = r.euler_characteristic.map(|x| x.to_string()).unwrap_or_default();
        let numbers = [r.threshold, r.area_sr, r.length_rad, r.curvature_rad].map(|x| x.to_string()).join(",");
        writeln!(out, "{time}{numbers},{euler},{}", r.masked_area_sr)?;
    }
    Ok(())
}

fn write_table(out: &mut String, rows: &[Row], unit: Option<&str>) -> std::fmt::Result {
    let unit = unit.map(|u| format!(" [{u}]")).unwrap_or_default();
    let head = [format!("threshold{unit}"), "area [sr]".into(), "length [rad]".into(), "curvature [rad]".into()];
    writeln!(out, "{:>16} {:>14} {:>14} {:>16} {:>8}", head[0], head[1], head[2], head[3], "Euler")?;
    for r in rows {
        let euler = r.euler_characteristic.map(|x| x.to_string()).unwrap_or_default();
        let line = format!(
            "{:>16} {:>14.9} {:>14.7} {:>16.7} {euler:>8}",
            decimals(r.threshold, 7),
            r.area_sr,
            r.length_rad,
            r.curvature_rad
        );
        writeln!(out, "{}", line.trim_end())?;
    }
    match rows[0].masked_area_sr {
        masked if masked > 0.0 => writeln!(out, "masked: {masked:.9} sr"),
        _ => Ok(()),
    }
}
