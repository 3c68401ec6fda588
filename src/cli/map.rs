//! `longan map`: Minkowski maps of one or many files.
//!
//! What is made of a file is left to [`mapping`](super::mapping).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use clap::Args;
use longan::formats;

use super::mapping::{Mapper, Mapping};
use super::options::{Running, shown};
use super::output::command;
use super::progress::Progress;
use super::sink::Kind;

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
    #[command(flatten)]
    mapping: Mapping,
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

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let measures = arguments.mapping.measures("map")?;
    let jobs = arguments.jobs()?;
    let mapper = arguments.mapping.mapper(measures)?;
    let mut failed = Vec::new();
    for (input, output) in &jobs {
        if let Err(error) = arguments.one(&mapper, input, output) {
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
            for source in std::iter::once(input.as_path()).chain(self.mapping.mask()) {
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
            formats::check_writable(output, self.overwrite)?;
        }
        Ok(jobs)
    }

    fn one(&self, mapper: &Mapper<'_>, input: &Path, output: &Path) -> anyhow::Result<()> {
        let progress = Progress::new(shown(input), self.running.quiet);
        let command = command(&self.inputs, input);
        let made = mapper.map(input, output, self.overwrite, &command, |share| progress.set(share))?;
        drop(progress);
        if self.verbose {
            made.ways.into_iter().try_for_each(|way| self.running.say(way))?;
        }
        if let Some(warning) = made.warning {
            self.running.warn(warning);
        }
        self.running.say(format_args!("{}: {}", shown(output), made.summary))
    }
}
