//! `longan totals`: Minkowski functionals of the whole sphere.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};
use serde::Serialize;

use super::options::{BodyOptions, Input, Running, decimals, print, shown};

/// Area, length, curvature and Euler characteristic of the body, at each threshold, over the whole sphere.
///
/// By Gauss-Bonnet the Euler characteristic is (area + curvature)/2 pi; it is left empty where pixels are masked.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  longan totals sky.fits
  longan totals sky.fits --thresholds -200:200:9 --format csv > totals.csv
  longan totals sky.fits --mask mask.fits --format json")]
pub(crate) struct Arguments {
    /// HEALPix file.
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
    let mask = arguments.input.read_mask()?;
    let map = arguments.input.read(path, mask.as_ref())?;
    let (thresholds, totals, masked) = arguments.body.analysis().totals(&map).with_context(|| shown(path))?;
    let whole = map.values().iter().all(|v| !v.is_nan());
    let rows: Vec<Row> = thresholds
        .values()
        .iter()
        .zip(totals)
        .map(|(&threshold, t)| Row {
            threshold,
            area_sr: t.area,
            length_rad: t.length,
            curvature_rad: t.curvature,
            euler_characteristic: whole.then(|| t.euler_characteristic().round() as i64),
            masked_area_sr: masked,
        })
        .collect();
    let mut out = String::new();
    match arguments.format {
        Format::Json => writeln!(out, "{}", serde_json::to_string_pretty(&rows)?)?,
        Format::Csv => {
            writeln!(out, "threshold,area_sr,length_rad,curvature_rad,euler_characteristic,masked_area_sr")?;
            for r in rows {
                let euler = r.euler_characteristic.map(|x| x.to_string()).unwrap_or_default();
                let numbers = [r.threshold, r.area_sr, r.length_rad, r.curvature_rad];
                let numbers = numbers.map(|x| x.to_string()).join(",");
                writeln!(out, "{numbers},{euler},{}", r.masked_area_sr)?;
            }
        }
        Format::Table => {
            let unit = map.unit.as_deref().map(|u| format!(" [{u}]")).unwrap_or_default();
            let head =
                [format!("threshold{unit}"), "area [sr]".into(), "length [rad]".into(), "curvature [rad]".into()];
            writeln!(out, "{:>16} {:>14} {:>14} {:>16} {:>8}", head[0], head[1], head[2], head[3], "Euler")?;
            for r in &rows {
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
            if masked > 0.0 {
                writeln!(out, "masked: {masked:.9} sr")?;
            }
        }
    }
    print(&out)
}
