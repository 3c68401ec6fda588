//! `longan regrid`: the map alone, as HEALPix.

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use longan::statistics::{Statistics, statistics};
use longan_formats as formats;
use longan_grid::Map;

use super::cards::text;
use super::command_line::command;
use super::input::Input;
use super::map_writer::{self, Kind, LayoutOptions, MapColumn, Step, Table};
use super::options::{Running, check_apart, decimals, shown};
use super::progress::Progress;
use super::provenance::{input_cards, mask_cards};
use super::regridding;

/// The map of a file as HEALPix, whatever it was, with nothing measured.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  longan regrid era5.nc -o z500.nc --variable z --select level=500
  longan regrid era5.nc -o z500.fits --variable z --select level=500 --nside 64 --method bilinear
  longan regrid stations.csv -o rainfall.fits --variable rain --nside 32 --reach 10
  longan regrid sky.fits -o sky.nc")]
pub(crate) struct Arguments {
    /// File of a map: FITS, NetCDF, Zarr, CSV, PLY.
    #[arg(value_name = "INPUT")]
    input_file: PathBuf,
    /// File to write, FITS (.fits, .fits.gz) or NetCDF (.nc).
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    layout: LayoutOptions,
    /// Replace existing outputs.
    #[arg(long, help_heading = "Output")]
    overwrite: bool,
    #[command(flatten)]
    running: Running,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let start = Instant::now();
    let Arguments { input_file: path, output, input, layout, overwrite, running } = arguments;
    let kind = Kind::of(output)?;
    check_apart(output, std::iter::once(path).chain(&input.mask).map(PathBuf::as_path))?;
    formats::check_writable(output, *overwrite)?;
    let mask = input.mask(running)?;
    let mut series = input.open(path)?;
    let steps = series.steps();
    let mut first = Some(series.read(0, mask.as_ref())?);
    let map = first.iter().next().context("a map")?;
    let (name, grid) = (map.name.clone(), map.grid());
    let note = regridding::note(map).map(|note| format!("; {note}")).unwrap_or_default();
    let warning = regridding::warning(path, map);
    let layout = layout.layout(map, grid, kind, steps).with_context(|| shown(path))?;
    let progress = Progress::new(shown(path), running.quiet);
    let mut summary = Summary::default();
    let made = |step| {
        let map = match first.take() {
            Some(map) => map,
            None => series.read(step, mask.as_ref())?,
        };
        progress.set((step + 1) as f64 / steps as f64);
        summary.add(map.values());
        Ok(of(path, map, input))
    };
    map_writer::write(output, kind, layout, *overwrite, (0..steps).map(made))?;
    drop(progress);
    if let Some(warning) = warning {
        running.warn(warning);
    }
    let of = if steps > 1 { format!("{steps} steps of ") } else { String::new() };
    let seconds = start.elapsed().as_secs_f64();
    let nside = grid.nside();
    running.say(format_args!("{}: {of}{name} of Nside {nside} {summary} ({seconds:.2} s){note}", shown(output)))
}

/// The step of a file with a map.
fn of(path: &Path, map: Map, input: &Input) -> Step {
    let mut cards = input_cards(path, &map);
    cards.extend(mask_cards(input));
    let command = command(&[], path);
    let mut attributes = vec![text("TITLE", map.long_name.clone().unwrap_or(map.name.clone()), "")];
    attributes.extend(cards.iter().cloned());
    attributes.push(text("HISTORY", command.clone(), ""));
    cards.push(text("COMMAND", command, "command that made this file"));
    let time = map.time.clone();
    let column = MapColumn {
        name: map.name.clone(),
        unit: map.unit.clone().unwrap_or_default(),
        long_name: map.long_name.clone().unwrap_or_default(),
        quantity: None,
        values: map.into_values(),
    };
    let table = Table { name: "MAP".to_owned(), cards, columns: vec![column] };
    Step { time, tables: vec![table], attributes, numbers: Vec::new() }
}

/// A summary of maps in a few words.
#[derive(Default)]
struct Summary {
    /// Of all maps so far.
    of_all: Option<Statistics>,
    pixels: usize,
}

impl Summary {
    /// Takes one more map into account.
    fn add(&mut self, values: &[f64]) {
        self.pixels += values.len();
        let Some(new) = statistics(values) else { return };
        self.of_all = Some(match self.of_all {
            None => new,
            Some(old) => {
                let unmasked = old.unmasked + new.unmasked;
                let mean = (old.mean * old.unmasked as f64 + new.mean * new.unmasked as f64) / unmasked as f64;
                Statistics { unmasked, mean, min: old.min.min(new.min), max: old.max.max(new.max), ..new }
            }
        });
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(s) = self.of_all else { return f.write_str("is masked or undefined everywhere") };
        let [min, max, mean] = [s.min, s.max, s.mean].map(|x| decimals(x, 4));
        let (without, pixels) = (self.pixels - s.unmasked, self.pixels);
        write!(f, "from {min} to {max}, mean {mean}, {without} of {pixels} pixels masked or undefined")
    }
}
