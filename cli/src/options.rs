//! Options that several commands share, and how their values are read.

use std::collections::HashSet;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::Context;
use clap::{Args, ValueEnum};
use longan::{Analysis, Body, ThresholdUnit, Thresholds, Weight};
use longan_grid::Healpix;

use super::progress::beside;

/// Thresholds and the body that they cut out.
#[derive(Args, Clone, Debug, PartialEq)]
#[command(next_help_heading = "Body")]
pub(crate) struct BodyOptions {
    /// Thresholds: n from lo to hi, evenly or logarithmically spaced, or a list [default: -3:3:13 in sigma].
    #[arg(long, value_name = "lo:hi:n|log:lo:hi:n|a,b,c", allow_hyphen_values = true)]
    pub(crate) thresholds: Option<Thresholds>,
    /// Unit of the thresholds: standard deviations of the unmasked pixels from their mean, or the
    /// map's unit [default: value where --thresholds is given, else sigma].
    #[arg(long, value_name = "UNIT")]
    pub(crate) threshold_unit: Option<UnitOption>,
    /// Which side of a threshold is the body: values at or above it, or below it.
    #[arg(long, value_name = "SIDE", default_value = "above")]
    pub(crate) body: BodyOption,
}

impl BodyOptions {
    /// An analysis of this body, all else being as in the paper.
    pub(crate) fn analysis(&self) -> Analysis {
        let default = Analysis::default();
        let unit = match self.threshold_unit {
            Some(UnitOption::Sigma) => ThresholdUnit::Sigma,
            Some(UnitOption::Value) => ThresholdUnit::Value,
            None if self.thresholds.is_some() => ThresholdUnit::Value,
            None => ThresholdUnit::Sigma,
        };
        Analysis {
            thresholds: self.thresholds.clone().unwrap_or(default.thresholds),
            threshold_unit: unit,
            body: match self.body {
                BodyOption::Above => Body::Above,
                BodyOption::Below => Body::Below,
            },
            ..default
        }
    }
}

/// Which windows have enough contour.
#[derive(Args, Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContourOption {
    /// Windows with less contour than this, in window radii, the mean over the thresholds, have no measures that are
    /// ratios or directions (those without unit or in degrees, formulas among them): hardly any contour gives them at
    /// random. 0, as in the paper, leaves out none; docs/choosing.md shows what other lengths do.
    #[arg(long, value_name = "LENGTH", default_value_t = 0.0)]
    #[arg(allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 1e9))]
    pub(crate) min_contour: f64,
}

/// How reports are printed: for people, or for programs.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Format {
    Text,
    Json,
}

/// Sides of a threshold.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(crate) enum BodyOption {
    Above,
    Below,
}

/// Weights of the contour's pieces.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(crate) enum WeightOption {
    Length,
    Curvature,
}

impl WeightOption {
    /// The weight.
    pub(crate) fn weight(self) -> Weight {
        match self {
            WeightOption::Length => Weight::Length,
            WeightOption::Curvature => Weight::Curvature,
        }
    }
}

/// Units of thresholds.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(crate) enum UnitOption {
    Sigma,
    Value,
}

/// How the program runs.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Running")]
pub(crate) struct Running {
    /// Number of threads, up to 1024; results do not depend on it [default: one for each processor].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
    /// The topics that this run has warned of.
    #[arg(skip)]
    warned: Arc<Mutex<HashSet<Topic>>>,
}

/// A topic of which a run warns once, however many maps there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Topic {
    /// A map of Stokes Q or U.
    Stokes,
    /// Thresholds that hardly suit the map.
    Thresholds,
    /// A mask of another Nside than the map.
    MaskNside,
}

impl Running {
    /// Sets the number of threads.
    pub(crate) fn start(&self) -> anyhow::Result<()> {
        if let Some(threads) = self.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
            pool.build_global().with_context(|| format!("cannot start {threads} threads"))?;
        }
        Ok(())
    }

    /// Prints a line, unless nothing is to be printed.
    pub(crate) fn say(&self, line: impl Display) -> anyhow::Result<()> {
        if self.quiet { Ok(()) } else { print(&format!("{line}\n")) }
    }

    /// Prints a warning, of one line, to standard error, unless nothing is to be printed. All warnings come this way, and
    /// no warning from within [`Progress::aside`](super::progress::Progress::aside).
    pub(crate) fn warn(&self, line: impl Display) {
        self.tell("warning", line);
    }

    /// Prints a line to standard error of what is no loss but good to know, unless nothing is to be printed.
    pub(crate) fn note(&self, line: impl Display) {
        self.tell("note", line);
    }

    fn tell(&self, kind: &str, line: impl Display) {
        if !self.quiet {
            // There is no other place to complain to.
            let _ = beside(|| writeln!(io::stderr(), "{kind}: {line}"));
        }
    }

    /// Prints a warning, but once in a run for each topic.
    pub(crate) fn warn_once(&self, topic: Topic, line: impl Display) {
        if self.warned.lock().unwrap_or_else(PoisonError::into_inner).insert(topic) {
            self.warn(line);
        }
    }
}

/// Prints a text. A reader that closes the pipe early, such as `head`, is no error; a full disk is.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        printed => printed.context("cannot print"),
    }
}

/// A number with this many decimals, as a power of ten where they would hide it or it is large.
pub(crate) fn decimals(x: f64, decimals: usize) -> String {
    match x.abs() {
        0.0 | 1e-3..1e6 => format!("{x:.decimals$}"),
        _ => format!("{x:.decimals$e}"),
    }
}

/// Whether two paths lead to the same file, or, where one leads nowhere from here, to files of the same name.
pub(crate) fn is_same_file(one: &Path, other: &Path) -> bool {
    match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => one.file_name() == other.file_name(),
    }
}

/// Refuses an output that would replace one of the inputs.
pub(crate) fn check_apart<'a>(output: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> anyhow::Result<()> {
    for input in inputs {
        if let (Ok(from), Ok(to)) = (input.canonicalize(), output.canonicalize()) {
            anyhow::ensure!(from != to, "{}: the output would replace this input; choose another", shown(input));
        }
    }
    Ok(())
}

/// A path on one line.
pub(crate) fn shown(path: &Path) -> String {
    path.display().to_string().replace(char::is_control, "\u{fffd}")
}

/// Refuses `count` maps of this grid where there is not the memory for them.
pub(crate) fn check_memory(grid: Healpix, count: usize) -> anyhow::Result<()> {
    let room = grid.pixels().checked_mul(count).map(|values| Vec::<f64>::new().try_reserve_exact(values));
    anyhow::ensure!(
        room.is_some_and(|room| room.is_ok()),
        "an output of Nside {} needs more memory than there is; choose a smaller one",
        grid.nside()
    );
    Ok(())
}

/// A whole number from 0.
pub(crate) fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| "not a whole number from 0".to_owned())
}

/// An Nside.
pub(crate) fn nside(text: &str) -> Result<usize, String> {
    let nside = text.parse().map_err(|_| "not a whole number from 1 to 2^29".to_owned())?;
    Healpix::new(nside).map(Healpix::nside).map_err(|e| e.to_string())
}

/// A finite number.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| "not a finite number".to_owned())
}

/// A number between two bounds, both included.
pub(crate) fn between(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let x = finite(text)?;
    if (low..=high).contains(&x) { Ok(x) } else { Err(format!("not between {low} and {high}")) }
}

/// An angle in degrees, above 0 and at most 90.
pub(crate) fn acute(text: &str) -> Result<f64, String> {
    between(text, 0.0, 90.0).ok().filter(|x| *x > 0.0).ok_or_else(|| "not above 0 and at most 90".to_owned())
}
