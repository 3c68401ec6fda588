//! `longan map`: Minkowski maps of one or many files.
//!
//! The way of one file to its Minkowski maps is left to [`map_options`](super::map_options).

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;

use anyhow::{Context, bail, ensure};
use clap::Args;
use longan_formats::{self as formats, CardValue, Error, ErrorKind, TableDescription};

use super::command_line::command;
use super::identity::Identity;
use super::map_options::{Made, Mapper, Mapping};
use super::map_writer::Kind;
use super::options::{Running, check_apart, shown};
use super::parallel::Jobs;
use super::progress::{Progress, rate};
use super::remedies::told;

/// Minkowski map of a field on the sphere: measures of shape in windows about the pixels of a coarser grid.
///
/// Without options this is the analysis of Collischon et al. (2024): the eigenvalue quotient EVQ in windows of 6
/// degrees, averaged over 13 thresholds from -3 to 3 standard deviations, at Nside 16.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  longan map sky.fits -o evq.fits
  longan map sky.fits -o out.fits --measure evq,evq-direction,psi4,rank4-mid --mask mask.fits
  longan map sky.fits -o out.fits --measure 'axis = (w1 - psi2)/(w1 + psi2)' --measure evq
  longan map sky.fits -o out.fits --thresholds -100,0,100 --sequence
  longan map rain.fits -o out.fits --thresholds log:0.1:100:7 --window 4 --nside-out 64
  longan map sky.fits -o out.fits --nside-out 512 --window 4,6,10 --verbose
  longan map sims/*.fits -o maps/ --resume
  longan map sims/*.fits -o maps/ --resume --shard 3/20 --jobs 4 --memory 8G
  longan map era5.nc -o evq.nc --variable z --select level=500 --select time=1997-12
  longan map stations.csv -o evq.fits --variable rain --gather gaussian:5
  longan map cell.ply -o evq.fits --variable signal --window 15

FITS opens in healpy: healpy.read_map('evq.fits'); masked and undefined pixels are UNSEEN. NetCDF opens in xarray; \
they are NaN there. A field with several times makes an extension each, in NetCDF an axis of time.

Of several inputs each is mapped whatever becomes of the others. An output is there only when it is complete: after any \
end of a run, the same command with --resume does the rest, and all files are then as if nothing had happened.")]
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
    /// Skip inputs whose output exists, to go on with an interrupted run. An output that was made with other options, or
    /// of another input, is refused.
    #[arg(long, help_heading = "Output", conflicts_with = "overwrite")]
    resume: bool,
    /// Take part I, from 1, of N of the inputs: of their sorted list the I-th and every N-th after it, so that N runs
    /// with the same inputs share them.
    #[arg(long, value_name = "I/N", help_heading = "Running")]
    shard: Option<Shard>,
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    running: Running,
    /// Say how the windows were summed, and why.
    #[arg(long, short, conflicts_with = "quiet")]
    verbose: bool,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let measures = arguments.mapping.measures()?;
    let mapping = &arguments.mapping;
    mapping.input().check_units(&arguments.inputs, mapping.analysis().threshold_unit)?;
    let tasks = arguments.tasks()?;
    let mapper = mapping.mapper(measures, arguments.jobs.memory(), &arguments.running, arguments.inputs.len() > 1)?;
    let tasks = arguments.unfinished(tasks, &mapper)?;
    let progress = match &tasks[..] {
        [(input, _)] => Progress::new(shown(input), arguments.running.quiet),
        tasks => Progress::of_parts(tasks.len(), arguments.running.quiet),
    };
    let start = Instant::now();
    let results = arguments.jobs.run(&tasks, |(input, output)| arguments.one(&mapper, &progress, input, output));
    drop(progress);
    let mut failed: Vec<anyhow::Error> = results.into_iter().filter_map(Result::err).collect();
    if tasks.len() == 1 {
        return failed.pop().map_or(Ok(()), Err);
    }
    let (done, time) = (tasks.len() - failed.len(), start.elapsed());
    if done > 0 {
        let seconds = time.as_secs_f64();
        arguments.running.say(format_args!("{done} maps in {seconds:.2} s, {}", rate(done, time)))?;
    }
    match failed.len() {
        0 => Ok(()),
        n => {
            let reasons: Vec<String> = failed.iter().map(|e| format!("\n  {}", told(e))).collect();
            let others = if done > 0 { ", the others are done" } else { "" };
            bail!("{n} of {} inputs failed{others}:{}", tasks.len(), reasons.concat())
        }
    }
}

impl Arguments {
    /// Inputs of this shard and their outputs, after all checks that need no reading of inputs.
    fn tasks(&self) -> anyhow::Result<Vec<(&Path, PathBuf)>> {
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
        let mut tasks = Vec::new();
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
            check_apart(&output, std::iter::once(input.as_path()).chain(self.mapping.mask()))?;
            tasks.push((input.as_path(), output));
        }
        if into_folder {
            std::fs::create_dir_all(out).with_context(|| format!("{}: cannot make this folder", shown(out)))?;
        }
        if let Some(shard) = self.shard {
            tasks = shard.of(tasks);
            if tasks.is_empty() {
                let all = self.inputs.len();
                self.running
                    .say(format_args!("shard {shard} has none of the {all} inputs, so there is nothing to do"))?;
            }
        }
        for (_, output) in &tasks {
            Kind::of(output)?;
            match formats::check_writable(output, self.overwrite) {
                Err(e) if self.resume && is_exists(&e) => (),
                checked => checked?,
            }
        }
        Ok(tasks)
    }

    /// The tasks whose output is not there yet.
    fn unfinished<'a>(
        &self,
        tasks: Vec<(&'a Path, PathBuf)>,
        mapper: &Mapper<'_>,
    ) -> anyhow::Result<Vec<(&'a Path, PathBuf)>> {
        if !self.resume {
            return Ok(tasks);
        }
        let all = tasks.len();
        let (finished, rest): (Vec<_>, _) = tasks.into_iter().partition(|(_, output)| output.is_file());
        for (input, output) in &finished {
            self.check_finished(mapper, input, output)?;
            formats::tidy(output);
        }
        if !finished.is_empty() {
            let finished = finished.len();
            self.running.say(format_args!("{finished} of {all} outputs exist, and stay as they are"))?;
        }
        Ok(rest)
    }

    /// Refuses an output that was not made of this input as this run would make it.
    fn check_finished(&self, mapper: &Mapper<'_>, input: &Path, output: &Path) -> anyhow::Result<()> {
        let table = formats::describe(output).ok().and_then(|description| description.tables.into_iter().next());
        let stated = table.as_ref().map(Identity::stated).transpose().with_context(|| shown(output))?;
        let (Some(table), Some(made)) = (table, stated.flatten()) else {
            bail!(
                "{}: this does not say how it was made, so --resume cannot go by it: another program or an older release \
                 of longan made it; remove it, choose another folder, or replace it with --overwrite instead of --resume",
                shown(output)
            )
        };
        let (made_by, wanted) = (made_by(&table).unwrap_or_default(), printable(&command(&self.inputs, input)));
        let difference = match mapper.identity(input) {
            Ok(now) => made.difference(&now).map(|difference| format!("it {difference}")),
            // Of an input that is gone nothing else can be made.
            Err(_) if !input.exists() => (made_by != wanted)
                .then(|| format!("{} is gone, so that only the same command goes on with it", shown(input))),
            Err(error) => return Err(error),
        };
        match difference {
            None => Ok(()),
            Some(difference) => bail!(
                "{}: this was made by `{made_by}`, and not as by `{wanted}`: {difference}; choose another folder, or replace \
                 it with --overwrite instead of --resume",
                shown(output)
            ),
        }
    }

    fn one(&self, mapper: &Mapper<'_>, progress: &Progress, input: &Path, output: &Path) -> anyhow::Result<()> {
        let part = progress.part();
        let meanwhile = || {
            self.check_finished(mapper, input, output)?;
            self.running.say(format_args!("{}: made by another run meanwhile", shown(output)))
        };
        // Of what this run began with, much may have been done by others.
        if self.resume && output.is_file() {
            drop(part);
            return progress.aside(meanwhile);
        }
        let command = command(&self.inputs, input);
        let made = match mapper.map(input, output, self.overwrite, &command, |share| part.set(share)) {
            Err(e) if self.resume && e.downcast_ref().is_some_and(is_exists) => None,
            made => Some(made?),
        };
        drop(part);
        made.iter().flat_map(|made| &made.warnings).for_each(|warning| self.running.warn(warning));
        progress.aside(|| {
            let Some(Made { summary, mut ways, note, .. }) = made else { return meanwhile() };
            if !self.verbose {
                ways.clear();
            }
            // One text, so that lines about other maps do not come in between.
            let note = note.map(|note| format!("; {note}")).unwrap_or_default();
            ways.push(format!("{}: {summary}{note}", shown(output)));
            self.running.say(ways.join("\n"))
        })
    }
}

/// Whether the reason for an error is that the output exists.
fn is_exists(error: &Error) -> bool {
    error.kind() == ErrorKind::Exists
}

/// The command that made an output of `longan map`, as its header says.
fn made_by(table: &TableDescription) -> Option<String> {
    let command = table.card("COMMAND").or_else(|| table.card("HISTORY"))?;
    let CardValue::Text(text) = command else { return None };
    // Other programs may have added lines to a history.
    text.lines().find(|line| line.starts_with("longan map ")).map(printable)
}

/// A text as the headers of FITS hold it.
fn printable(text: &str) -> String {
    let plain = |c: char| match c {
        ' '..='~' => c.to_string(),
        _ => c.escape_default().to_string(),
    };
    text.trim_end().chars().map(plain).collect()
}

/// A part of a list.
#[derive(Clone, Copy, Debug)]
struct Shard {
    /// From 1.
    number: usize,
    of: usize,
}

impl Shard {
    /// The part of a list that is this one's, the same whatever the order of the list.
    fn of<T: Ord>(self, mut list: Vec<T>) -> Vec<T> {
        list.sort();
        list.into_iter().skip(self.number - 1).step_by(self.of).collect()
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        let shard = numbers.map(|(number, of)| Shard { number, of });
        shard
            .filter(|shard| (1..=shard.of).contains(&shard.number))
            .ok_or_else(|| "not of the form I/N with I from 1 to N, such as 3/20".to_owned())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}
