//! `longan map`: Minkowski maps of one or many files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail, ensure};
use clap::{Args, ValueEnum};
use longan::formats::{self, Healpix, Map, Ordering};
use longan::measures::{BuiltIn, Measure};
use longan::statistics::statistics;
use longan::{Analysis, Weight};

use super::options::{BodyOptions, Input, Running, between, measure};
use super::output::Provenance;
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
  longan map sky.fits -o out.fits --thresholds -100,0,100 --sequence
  longan map rain.fits -o out.fits --thresholds log:0.1:100:7 --window 4 --nside-out 64
  longan map sims/*.fits -o maps/ --resume

The output opens in healpy: healpy.read_map('evq.fits'). Masked and undefined pixels are UNSEEN.")]
pub(crate) struct Arguments {
    /// HEALPix files.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// File to write; for several inputs a folder, which gets a file of the same name for each.
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Measures, separated by commas; `longan measures` explains them all.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "evq", value_parser = measure)]
    measure: Vec<BuiltIn>,
    /// Radius of the window in degrees; 0: each pixel by itself, at the map's own Nside.
    #[arg(long, value_name = "DEG", default_value_t = 6.0, value_parser = |t: &str| between(t, 0.0, 180.0))]
    window: f64,
    /// Nside of the output [default: the smaller of 16 and the input's].
    #[arg(long, value_name = "N")]
    nside_out: Option<usize>,
    /// Weight of the contour's pieces in tensors: their length (W_1) or their curvature (W_2).
    #[arg(long, value_name = "WEIGHT", default_value = "length")]
    weight: WeightOption,
    /// Write one extension for each threshold instead of the mean over thresholds.
    #[arg(long)]
    sequence: bool,
    /// Windows with a larger share of masked cells than this are masked.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0625, value_parser = |t: &str| between(t, 0.0, 1.0))]
    max_masked: f64,
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
    /// With several inputs: skip those whose output exists.
    #[arg(long, help_heading = "Output", conflicts_with = "overwrite")]
    resume: bool,
    #[command(flatten)]
    running: Running,
}

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
    let jobs = arguments.jobs()?;
    let mask = arguments.input.read_mask()?;
    let mut failed = Vec::new();
    for (input, output) in &jobs {
        if let Err(error) = arguments.one(input, output, mask.as_ref()) {
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
            bail!("{n} of {} inputs failed, the others are done:{}", jobs.len(), reasons.concat())
        }
    }
}

impl Arguments {
    /// Inputs and their outputs, those that are finished left out, after all checks that need no reading.
    fn jobs(&self) -> anyhow::Result<Vec<(&Path, PathBuf)>> {
        let into_folder = self.inputs.len() > 1 || self.output.is_dir() || self.output.to_string_lossy().ends_with('/');
        if into_folder && !self.output.is_dir() {
            std::fs::create_dir_all(&self.output)
                .with_context(|| format!("cannot make the output folder '{}'", self.output.display()))?;
        }
        let mut inputs = BTreeMap::new();
        let mut jobs = Vec::new();
        for input in &self.inputs {
            let output = match input.file_name() {
                Some(name) if into_folder => self.output.join(name),
                None if into_folder => bail!("the input '{}' is not a file", input.display()),
                _ => self.output.clone(),
            };
            if let Some(other) = inputs.insert(output.clone(), input) {
                bail!(
                    "the inputs '{}' and '{}' have the same name, so both would be written to '{}'",
                    other.display(),
                    input.display(),
                    output.display()
                );
            }
            if let (Ok(from), Ok(to)) = (input.canonicalize(), output.canonicalize()) {
                ensure!(from != to, "the output would replace the input '{}'; choose another", input.display());
            }
            if self.resume && output.exists() {
                continue;
            }
            formats::check_writable(&output, self.overwrite)?;
            jobs.push((input.as_path(), output));
        }
        Ok(jobs)
    }

    fn analysis(&self) -> Analysis {
        Analysis {
            window: self.window,
            weight: match self.weight {
                WeightOption::Length => Weight::Length,
                WeightOption::Curvature => Weight::Curvature,
            },
            nside_out: self.nside_out,
            max_masked: self.max_masked,
            ..self.body.analysis()
        }
    }

    fn one(&self, path: &Path, output: &Path, mask: Option<&Map>) -> anyhow::Result<()> {
        let start = Instant::now();
        let map = self.input.read(path, mask)?;
        let analysis = self.analysis();
        let about = || path.display().to_string();
        let ordering = self.ordering_for(&map, analysis.check(map.grid()).with_context(about)?)?;
        let progress = Progress::new(path.display().to_string(), self.running.quiet);
        let maps = if self.sequence {
            analysis.sequence(&map, &self.measure, |share| progress.set(share))
        } else {
            analysis.minkowski_maps(&map, &self.measure, |share| progress.set(share)).map(|maps| vec![maps])
        }
        .with_context(about)?;
        drop(progress);
        let summary = self.summary(&maps[0].values[0], maps[0].grid);
        let provenance =
            Provenance { path, map: &map, input: &self.input, analysis: &analysis, command: self.command(path) };
        let file = provenance.file(maps, &self.measure, ordering, self.float32);
        formats::write_healpix(output, &file, self.overwrite)?;
        if !self.running.quiet {
            println!("{}: {summary} ({:.2} s)", output.display(), start.elapsed().as_secs_f64());
        }
        Ok(())
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

    /// What the first column holds, in a few words.
    fn summary(&self, values: &[f64], grid: Healpix) -> String {
        let name = self.measure[0].column();
        let all = format!("{} of Nside {}", name, grid.nside());
        match statistics(values) {
            None => format!("{all} is masked or undefined everywhere"),
            Some(s) => format!(
                "{all} from {:.4} to {:.4}, mean {:.4}, {} of {} pixels masked",
                s.min,
                s.max,
                s.mean,
                values.len() - s.unmasked,
                values.len()
            ),
        }
    }

    /// The command that makes this output: as given, with this input only.
    fn command(&self, input: &Path) -> String {
        let others: Vec<_> = self.inputs.iter().filter(|i| *i != input).map(|i| i.as_os_str()).collect();
        let words = std::env::args_os().skip(1).filter(|word| !others.contains(&word.as_os_str()));
        let words: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
        let quoted = shlex::try_join(words.iter().map(String::as_str)).unwrap_or_else(|_| words.join(" "));
        format!("longan {quoted}")
    }
}
