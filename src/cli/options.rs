//! Options that several commands share, and how their values are read.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, ValueEnum};
use longan::formats::{self, Field, Map, Selection};
use longan::measures::{BuiltIn, UnknownMeasure, find};
use longan::{Analysis, Body, ThresholdUnit, Thresholds};

/// Which field of a file, and which pixels of it.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Input")]
pub(crate) struct Input {
    /// Field: a column's name, or its number counted from 0 as healpy does [default: the first].
    #[arg(long, value_name = "NAME|NUMBER", value_parser = field)]
    pub(crate) field: Option<Field>,
    /// Number of the FITS extension, 0 for the primary one [default: the first with a map].
    #[arg(long, value_name = "N")]
    pub(crate) hdu: Option<usize>,
    /// For multi-order (UNIQ) files: Nside to bring the map to [default: that of its finest cells].
    #[arg(long, value_name = "N")]
    pub(crate) nside: Option<usize>,
    /// Mask file, of any ordering and number type; pixels below the mask threshold are left out.
    #[arg(long, short, value_name = "FILE")]
    pub(crate) mask: Option<PathBuf>,
    /// Field of the mask file [default: the first].
    #[arg(long, value_name = "NAME|NUMBER", requires = "mask", value_parser = field)]
    pub(crate) mask_field: Option<Field>,
    /// Pixels whose mask value is below this are masked.
    #[arg(long, value_name = "X", default_value_t = 0.9, allow_negative_numbers = true, value_parser = finite)]
    pub(crate) mask_threshold: f64,
}

impl Input {
    /// The mask, if there is one.
    pub(crate) fn read_mask(&self) -> anyhow::Result<Option<Map>> {
        let selection = Selection { field: self.mask_field.clone(), ..Selection::default() };
        Ok(self.mask.as_deref().map(|path| formats::read(path, &selection)).transpose()?)
    }

    /// The field, masked.
    pub(crate) fn read(&self, path: &Path, mask: Option<&Map>) -> anyhow::Result<Map> {
        let selection = Selection { field: self.field.clone(), hdu: self.hdu, nside: self.nside };
        let mut map = formats::read(path, &selection)?;
        if let Some(mask) = mask {
            map.apply_mask(mask, self.mask_threshold).with_context(|| path.display().to_string())?;
        }
        Ok(map)
    }
}

/// Thresholds and the body that they cut out.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Body")]
pub(crate) struct BodyOptions {
    /// Thresholds: n from lo to hi, evenly or logarithmically spaced, or a list [default: -3:3:13 in sigma].
    #[arg(long, value_name = "lo:hi:n|log:lo:hi:n|a,b,c", allow_hyphen_values = true)]
    pub(crate) thresholds: Option<Thresholds>,
    /// What thresholds are counted in: standard deviations of the unmasked pixels from their mean, or the
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

/// Sides of a threshold.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum BodyOption {
    Above,
    Below,
}

/// Units of thresholds.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum UnitOption {
    Sigma,
    Value,
}

/// How the program runs.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Running")]
pub(crate) struct Running {
    /// Number of threads; results do not depend on it [default: one for each processor].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub(crate) quiet: bool,
}

impl Running {
    /// Sets the number of threads.
    pub(crate) fn start(&self) -> anyhow::Result<()> {
        if let Some(threads) = self.threads {
            rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global()?;
        }
        Ok(())
    }
}

fn field(text: &str) -> Result<Field, std::convert::Infallible> {
    text.parse()
}

/// A measure by its name.
pub(crate) fn measure(text: &str) -> Result<BuiltIn, UnknownMeasure> {
    find(text.trim())
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
