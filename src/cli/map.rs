//! `longan map`: Minkowski maps of one or many files.

use std::collections::{BTreeMap, HashSet};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, bail, ensure};
use clap::{Args, ValueEnum};
use longan::formats::{self, Healpix, Map, Ordering};
use longan::measures::{CatalogueError, Measure, find, split};
use longan::statistics::statistics;
use longan::window::{Summation, Ways};
use longan::{Analysis, MinkowskiMaps, Weight};

use super::misused;
use super::options::{BodyOptions, Input, Running, between, check_memory, decimals, nside, shown};
use super::output::Provenance;
use super::plugin::Plugins;
use super::progress::Progress;

/// Minkowski map of a HEALPix map: measures of shape in windows about the pixels of a coarser grid.
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

The output opens in healpy: healpy.read_map('evq.fits'). Masked and undefined pixels are UNSEEN.")]
pub(crate) struct Arguments {
    /// HEALPix files.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// File to write; for several inputs a folder, which gets a file of the same name for each.
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
    /// 4,6,10, make an extension each.
    #[arg(long, value_name = "DEG,...", default_value = "6", value_delimiter = ',')]
    #[arg(allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 180.0))]
    window: Vec<f64>,
    /// Nside of the output [default: the smaller of 16 and the input's; for --window 0 the input's].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = nside)]
    nside_out: Option<usize>,
    /// Weight of the contour's pieces in tensors: their length (W_1) or their curvature (W_2).
    #[arg(long, value_name = "WEIGHT", default_value = "length")]
    weight: WeightOption,
    /// Write one extension for each threshold instead of the mean over thresholds.
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
    /// Ordering of the output [default: the input's].
    #[arg(long, value_name = "ORDERING", help_heading = "Output")]
    ordering: Option<OrderingOption>,
    /// Write single precision.
    #[arg(long, help_heading = "Output")]
    float32: bool,
    /// Replace existing outputs.
    #[arg(long, help_heading = "Output")]
    overwrite: bool,
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

#[derive(Clone, Copy, Debug, ValueEnum)]
enum OrderingOption {
    Ring,
    #[value(alias = "nest")]
    Nested,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let measures = arguments.measures()?;
    let jobs = arguments.jobs()?;
    let mask = arguments.input.read_mask()?;
    let mut failed = Vec::new();
    for (input, output) in &jobs {
        if let Err(error) = arguments.one(input, output, mask.as_ref(), &measures) {
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
            measures.push(Arc::new(find("evq")?));
        }
        Ok(measures)
    }

    /// Inputs and their outputs, those that are finished left out, after all checks that need no reading.
    fn jobs(&self) -> anyhow::Result<Vec<(&Path, PathBuf)>> {
        let out = &self.output;
        let into_folder = self.inputs.len() > 1 || out.is_dir() || out.to_string_lossy().ends_with('/');
        ensure!(
            !into_folder || !out.is_file(),
            "{}: this is a file where a folder is needed; choose another name",
            shown(out)
        );
        let mut inputs = BTreeMap::new();
        let mut jobs = Vec::new();
        for input in &self.inputs {
            let output = match input.file_name() {
                Some(name) if into_folder => out.join(name),
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
            formats::check_writable(output, self.overwrite)?;
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

    fn one(&self, path: &Path, output: &Path, mask: Option<&Map>, measures: &[Arc<dyn Measure>]) -> anyhow::Result<()> {
        let start = Instant::now();
        let map = self.input.read(path, mask)?;
        let analysis = self.analysis();
        let about = || shown(path);
        let grid = analysis.check(map.grid()).with_context(about)?;
        let ordering = self.ordering_for(&map, grid).with_context(about)?;
        let extensions = analysis.windows.len() * if self.sequence { analysis.thresholds.values().len() } else { 1 };
        check_memory(grid, extensions * measures.len()).with_context(about)?;
        let progress = Progress::new(about(), self.running.quiet);
        let maps = if self.sequence {
            analysis.sequence(&map, measures, |share| progress.set(share))
        } else {
            analysis.minkowski_maps(&map, measures, |share| progress.set(share))
        }
        .with_context(about)?;
        drop(progress);
        if self.verbose {
            maps.iter().try_for_each(|maps| self.running.say(explained(maps)))?;
        }
        let summary = summary(&measures[0].column(), &maps[0].values[0], maps[0].grid);
        let provenance =
            Provenance { path, map: &map, input: &self.input, analysis: &analysis, command: self.command(path) };
        let file = provenance.file(maps, measures, ordering, self.float32);
        formats::write_healpix(output, &file, self.overwrite)?;
        self.running.say(format_args!("{}: {summary} ({:.2} s)", shown(output), start.elapsed().as_secs_f64()))
    }

    fn ordering_for(&self, map: &Map, grid: Healpix) -> anyhow::Result<Ordering> {
        let ordering = match self.ordering {
            Some(OrderingOption::Ring) => Ordering::Ring,
            Some(OrderingOption::Nested) => Ordering::Nested,
            None => map.ordering,
        };
        if ordering == Ordering::Nested && !grid.has_nested() {
            bail!("an output Nside of {} is not a power of two, which NESTED needs; add --ordering ring", grid.nside());
        }
        Ok(ordering)
    }

    /// The command that makes this output: as given, with this input only.
    fn command(&self, input: &Path) -> String {
        let others: HashSet<_> = self.inputs.iter().filter(|i| *i != input).map(|i| i.as_os_str()).collect();
        let words: Vec<_> = std::env::args_os().collect();
        // A mask may be an input too.
        let kept = |pair: &&[OsString]| ["-m", "--mask"].iter().any(|m| pair[0] == *m) || !others.contains(&*pair[1]);
        let words: Vec<_> = words.windows(2).filter(kept).map(|pair| pair[1].to_string_lossy()).collect();
        let quoted = shlex::try_join(words.iter().map(AsRef::as_ref)).unwrap_or_else(|_| words.join(" "));
        format!("longan {quoted}")
    }
}

/// What the first column holds, in a few words.
fn summary(column: &str, values: &[f64], grid: Healpix) -> String {
    let all = format!("{column} of Nside {}", grid.nside());
    let Some(s) = statistics(values) else { return format!("{all} is masked or undefined everywhere") };
    let [min, max, mean] = [s.min, s.max, s.mean].map(|x| decimals(x, 4));
    let (without, pixels) = (values.len() - s.unmasked, values.len());
    format!("{all} from {min} to {max}, mean {mean}, {without} of {pixels} pixels masked or undefined")
}

/// How the windows of a map were summed, and why.
fn explained(maps: &MinkowskiMaps) -> String {
    let Ways { direct, missed, prefix, error, terms } = maps.ways;
    let mut ways = Vec::new();
    let all = (direct + missed + prefix).max(1) as f64;
    let mut way = |pairs: usize, how: String| {
        if pairs > 0 {
            ways.push(format!("{} % {how}", decimals(100.0 * pairs as f64 / all, 1)));
        }
    };
    way(prefix, format!("from prefix sums with up to {terms} terms, psi_s to {error:.1e} of W1"));
    way(direct, "pixel by pixel, which costs less there or was asked for".to_owned());
    way(missed, "pixel by pixel, since no fit met the tolerance".to_owned());
    let pairs = "of all pairs of an output pixel and an input ring";
    format!("window of {} degrees, {pairs}: {}", maps.window, ways.join("; "))
}
