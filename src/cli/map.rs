//! `longan map`: Minkowski maps of one or many files.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, bail, ensure};
use clap::{Args, ValueEnum};
use longan::formats::{self, Error, Healpix, Map};
use longan::measures::{CatalogueError, Measure, split};
use longan::statistics::{Statistics, statistics};
use longan::window::{Summation, Ways};
use longan::{Analysis, AnalysisError, MinkowskiMaps, Weight};

use super::input::{self, Input, Mask};
use super::misused;
use super::options::{BodyOptions, Running, between, check_memory, decimals, nside, shown};
use super::output::{Provenance, command};
use super::plugin::Plugins;
use super::progress::Progress;
use super::sink::{self, Kind, OutputOptions};

/// Minkowski map of a field on the sphere: measures of shape in windows about the pixels of a coarser grid.
///
/// Without options this is the analysis of Collischon et al. (2024): the eigenvalue quotient EVQ in windows of 6
/// degrees, averaged over 13 thresholds from -3 to 3 standard deviations, at Nside 16.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  longan map sky.fits -o evq.fits
  longan map sky.fits -o out.fits --measure evq,evq-direction,psi4,rank4-mid --mask mask.fits
  longan map sky.fits -o out.fits --measure 'beta = (w1 - psi2)/(w1 + psi2)' --measure evq
  longan map sky.fits -o out.fits --thresholds -100,0,100 --sequence
  longan map rain.fits -o out.fits --thresholds log:0.1:100:7 --window 4 --nside-out 64
  longan map sky.fits -o out.fits --nside-out 512 --window 4,6,10 --verbose
  longan map sims/*.fits -o maps/ --resume
  longan map era5.nc -o evq.nc --variable z --select level=500 --select time=1997-12
  longan map stations.csv -o evq.fits --variable rain --gather gaussian:5
  longan map cell.ply -o evq.fits --variable signal --window 15

FITS opens in healpy: healpy.read_map('evq.fits'); masked and undefined pixels are UNSEEN. NetCDF opens in xarray;
they are NaN there. A field with several times makes an extension each, in NetCDF an axis of time.")]
pub(crate) struct Arguments {
    /// Files of maps: FITS, NetCDF, Zarr, CSV, PLY.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// File to write, FITS (.fits, .fits.gz) or NetCDF (.nc); for several inputs a folder, which gets a file of the same
    /// name for each (.fits in place of .csv or .ply, .nc in place of .zarr or .h5).
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Measures, separated by commas, such as evq,psi2-direction, and formulas of them, such as
    /// "beta = (w1 - psi2)/(w1 + psi2)"; may be repeated. `longan measures` lists all measures, and
    /// `longan measures --help` explains formulas [default: evq].
    #[arg(long, value_name = "LIST")]
    measure: Vec<String>,
    #[command(flatten)]
    plugins: Plugins,
    /// Radius of the window in degrees, from 0 to 180; 0: each pixel by itself, at the map's own Nside. Several, such as
    /// 4,6,10, make an extension each, in NetCDF variables such as EVQ_WINDOW_4.
    #[arg(long, value_name = "DEG,...", default_value = "6", value_delimiter = ',')]
    #[arg(allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 180.0))]
    window: Vec<f64>,
    /// Nside of the output [default: the smaller of 16 and the input's; for --window 0 the input's].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = nside)]
    nside_out: Option<usize>,
    /// Weight of the contour's pieces in tensors: their length (W_1) or their curvature (W_2).
    #[arg(long, value_name = "WEIGHT", default_value = "length")]
    weight: WeightOption,
    /// Write one extension, in NetCDF variables such as EVQ_THRESHOLD_1, for each threshold instead of the mean over
    /// thresholds.
    #[arg(long)]
    sequence: bool,
    /// Windows with a larger share of masked cells than this, from 0 to 1, are masked.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0625)]
    #[arg(allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 1.0))]
    max_masked: f64,
    /// Largest error of psi_s, as a share of the window's contour length, where many and large windows are summed
    /// from prefix sums; areas, lengths and curvatures are exact always.
    #[arg(long, value_name = "X", default_value_t = 1e-7)]
    #[arg(allow_negative_numbers = true, value_parser = |t: &str| between(t, 1e-12, 0.1))]
    tolerance: f64,
    /// Sum every window pixel by pixel, however long it takes.
    #[arg(long, conflicts_with = "tolerance")]
    exact: bool,
    #[command(flatten)]
    body: BodyOptions,
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    output_options: OutputOptions,
    /// Skip inputs whose output exists, to go on with an interrupted run.
    #[arg(long, help_heading = "Output", conflicts_with = "overwrite")]
    resume: bool,
    #[command(flatten)]
    running: Running,
    /// Say how the windows were summed, and why.
    #[arg(long, short, conflicts_with = "quiet")]
    verbose: bool,
}

/// Columns that a FITS table can have.
const COLUMNS_MAX: usize = 999;

#[derive(Clone, Copy, Debug, ValueEnum)]
enum WeightOption {
    Length,
    Curvature,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let measures = arguments.measures()?;
    let jobs = arguments.jobs()?;
    let mut mask = arguments.input.mask()?;
    let mut failed = Vec::new();
    for (input, output) in &jobs {
        if let Err(error) = arguments.one(input, output, mask.as_mut(), &measures) {
            if jobs.len() == 1 {
                return Err(error);
            }
            failed.push(error);
        }
    }
    match failed.len() {
        0 => Ok(()),
        n => {
            let reasons: Vec<String> = failed.iter().map(|e| format!("\n  {e:#}")).collect();
            let others = if n < jobs.len() { ", the others are done" } else { "" };
            bail!("{n} of {} inputs failed{others}:{}", jobs.len(), reasons.concat())
        }
    }
}

impl Arguments {
    /// The measures asked for, no two the same.
    fn measures(&self) -> anyhow::Result<Vec<Arc<dyn Measure>>> {
        let catalogue = self.plugins.catalogue()?;
        let wrong = |text: &str, problem: String| {
            misused("map", format!("invalid value '{text}' for '--measure <LIST>': {problem}"))
        };
        let mut measures: Vec<Arc<dyn Measure>> = Vec::new();
        for text in self.measure.iter().flat_map(|list| split(list)) {
            let measure = catalogue.find(text).map_err(|e| match &e {
                CatalogueError::Formula(formula) => wrong(text, format!("{e}\n\n{}", formula.marked())),
                _ => wrong(text, e.to_string()),
            })?;
            if let Some(other) = measures.iter().find(|other| other.column().eq_ignore_ascii_case(&measure.column())) {
                let [one, other] = [measure.name(), other.name()];
                let twice = if one == other { "is given twice".into() } else { format!("has the column of '{other}'") };
                return Err(wrong(text, format!("'{one}' {twice}")));
            }
            measures.push(measure);
        }
        if measures.len() > COLUMNS_MAX {
            let problem =
                format!("{} measures are more than the {COLUMNS_MAX} columns of a FITS table", measures.len());
            return Err(misused("map", problem));
        }
        if measures.is_empty() {
            measures.push(catalogue.find("longan:evq")?);
        }
        Ok(measures)
    }

    /// Inputs and their outputs, those that are finished left out, after all checks that need no reading.
    fn jobs(&self) -> anyhow::Result<Vec<(&Path, PathBuf)>> {
        let out = &self.output;
        let into_folder = self.inputs.len() > 1 || out.is_dir() || out.to_string_lossy().ends_with('/');
        ensure!(
            !formats::is_store(out),
            "{}: this is a Zarr store, not a folder for outputs; choose another name",
            shown(out)
        );
        ensure!(
            !into_folder || !out.is_file(),
            "{}: this is a file where a folder is needed; choose another name",
            shown(out)
        );
        let mut inputs = BTreeMap::new();
        let mut jobs = Vec::new();
        for input in &self.inputs {
            let output = match input.file_name() {
                Some(_) if into_folder => out.join(Kind::name_for(input)),
                None if into_folder => bail!("{}: this is not a file; name files", shown(input)),
                _ => out.clone(),
            };
            if let Some(other) = inputs.insert(output.clone(), input) {
                bail!(
                    "the inputs {} and {} would both be written to {}; map them into different folders",
                    shown(other),
                    shown(input),
                    shown(&output)
                );
            }
            for source in std::iter::once(input).chain(&self.input.mask) {
                if let (Ok(from), Ok(to)) = (source.canonicalize(), output.canonicalize()) {
                    ensure!(from != to, "{}: the output would replace this input; choose another", shown(source));
                }
            }
            jobs.push((input.as_path(), output));
        }
        if into_folder {
            std::fs::create_dir_all(out).with_context(|| format!("{}: cannot make this folder", shown(out)))?;
        }
        if self.resume {
            jobs.retain(|(_, output)| !output.is_file());
            let (finished, all) = (self.inputs.len() - jobs.len(), self.inputs.len());
            if finished > 0 {
                self.running.say(format_args!("{finished} of {all} outputs exist, and stay as they are"))?;
            }
        }
        for (_, output) in &jobs {
            Kind::of(output)?;
            formats::check_writable(output, self.output_options.overwrite)?;
        }
        Ok(jobs)
    }

    fn analysis(&self) -> Analysis {
        Analysis {
            windows: self.window.clone(),
            weight: match self.weight {
                WeightOption::Length => Weight::Length,
                WeightOption::Curvature => Weight::Curvature,
            },
            nside_out: self.nside_out,
            max_masked: self.max_masked,
            summation: if self.exact { Summation::Exact } else { Summation::Tolerance(self.tolerance) },
            ..self.body.analysis()
        }
    }

    fn one(
        &self,
        path: &Path,
        output: &Path,
        mut mask: Option<&mut Mask>,
        measures: &[Arc<dyn Measure>],
    ) -> anyhow::Result<()> {
        let start = Instant::now();
        let mut series = self.input.open(path)?;
        let steps = series.steps();
        let map = series.read(0, mask.as_deref_mut())?;
        let analysis = self.analysis();
        let about = || shown(path);
        let kind = Kind::of(output)?;
        let grid = analysis.check(map.grid()).with_context(about)?;
        let layout = self.output_options.layout(&map, grid, kind, steps).with_context(about)?;
        let tables = analysis.windows.len() * if self.sequence { analysis.thresholds.values().len() } else { 1 };
        check_memory(grid, tables * measures.len()).with_context(about)?;
        let progress = Progress::new(about(), self.running.quiet);
        let command = command(&self.inputs, path);
        let mut first = Some(map);
        let mut summary = Summary::default();
        let mut ways = Vec::new();
        let mut empty = Vec::new();
        sink::write(output, kind, layout, self.output_options.overwrite, |step| {
            let map = match first.take() {
                Some(map) => map,
                None => series.read(step, mask.as_deref_mut())?,
            };
            let told = |share| progress.set((step as f64 + share) / steps as f64);
            let maps = match self.sequence {
                true => analysis.sequence(&map, measures, told),
                false => analysis.minkowski_maps(&map, measures, told),
            };
            let maps = match maps {
                Err(AnalysisError::AllMasked | AnalysisError::Constant { .. }) if steps > 1 => {
                    empty.push(map.time.as_ref().map(|time| time.label.clone()).unwrap_or_default());
                    undefined(&analysis, &map, grid, tables, measures.len())
                }
                maps => maps.map_err(|e| {
                    let when = map.time.as_ref().filter(|_| steps > 1).map(|time| format!("at {}: ", time.label));
                    input::of(path, Error::NoResult { reason: format!("{}{e}", when.unwrap_or_default()) })
                })?,
            };
            if step == 0 {
                ways = maps.iter().map(explained).collect();
            }
            summary.add(&maps[0].values[0]);
            let input = Some(&self.input);
            Ok(Provenance { path, map: &map, input, analysis: &analysis, command: command.clone() }
                .step(maps, measures))
        })?;
        drop(progress);
        if self.verbose {
            ways.into_iter().try_for_each(|way| self.running.say(way))?;
        }
        if let Some(one) = empty.first() {
            let (about, n) = (about(), empty.len());
            let others = if n > 1 { format!(" and {} other steps", n - 1) } else { String::new() };
            self.running.warn(format_args!(
                "{about}: the map at {one}{others} is masked or constant, so the result is masked there"
            ));
        }
        let of = if steps > 1 { format!("{steps} steps of ") } else { String::new() };
        let all = format!("{of}{} of Nside {}", measures[0].column(), grid.nside());
        let seconds = start.elapsed().as_secs_f64();
        self.running.say(format_args!("{}: {all} {summary} ({seconds:.2} s)", shown(output)))
    }
}

/// The result for a map that has no shape to measure: nothing but masked pixels.
fn undefined(analysis: &Analysis, map: &Map, grid: Healpix, tables: usize, measures: usize) -> Vec<MinkowskiMaps> {
    let nothing = Statistics { unmasked: 0, min: f64::NAN, max: f64::NAN, mean: f64::NAN, sigma: f64::NAN };
    let each = tables / analysis.windows.len();
    let of = |window: &f64| MinkowskiMaps {
        grid,
        window: *window,
        thresholds: analysis.thresholds.clone(),
        of_map: statistics(map.values()).unwrap_or(nothing),
        values: vec![vec![f64::NAN; grid.pixels()]; measures],
        ways: Ways::default(),
    };
    analysis.windows.iter().flat_map(|window| std::iter::repeat_n(of(window), each)).collect()
}

/// What maps hold, in a few words.
#[derive(Default)]
pub(crate) struct Summary {
    /// Of all maps so far.
    of_all: Option<Statistics>,
    pixels: usize,
}

impl Summary {
    /// Takes one more map into account.
    pub(crate) fn add(&mut self, values: &[f64]) {
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

/// How the windows of a map were summed, and why.
fn explained(maps: &MinkowskiMaps) -> String {
    let Ways { direct, missed, prefix, error, terms } = maps.ways;
    let mut ways = Vec::new();
    let all = (direct + missed + prefix).max(1) as f64;
    let mut way = |pairs: usize, how: String| {
        let percent = 100.0 * pairs as f64 / all;
        match pairs {
            0 => (),
            _ if percent < 0.1 => ways.push(format!("less than 0.1 % {how}")),
            _ => ways.push(format!("{percent:.1} % {how}")),
        }
    };
    way(prefix, format!("from prefix sums with up to {terms} terms, psi_s to {error:.1e} of W1"));
    way(direct, "pixel by pixel, which costs less there or was asked for".to_owned());
    way(missed, "pixel by pixel, since no fit met the tolerance".to_owned());
    let pairs = "of all pairs of an output pixel and an input ring";
    format!("window of {} degrees, {pairs}: {}", maps.window, ways.join("; "))
}
