//! `longan compare`: a Minkowski map of data against those of simulations.
//!
//! [`provenance_reader`] reads headers and finds what does not go together, [`cache`] makes Minkowski maps of raw maps,
//! [`scatter`] looks at one pixel, [`report`] tells people and programs. The comparison itself is left to
//! [`longan::compare`].

mod cache;
mod provenance_reader;
mod report;
mod scatter;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, bail, ensure};
use clap::Args;
use longan::ThresholdUnit;
use longan::compare::{Comparison, ComparisonError, Outcome, Outlier};
use longan::measures::{Measure, Quantity};
use longan::smoothing::Smoothing;
use longan_formats::{self as formats, Card};
use longan_grid::Healpix;
use ndarray::Array1;

use super::cards::{creator, integer, numbered, real, text};
use super::command_line::command;
use super::input::Input;
use super::map_options::Mapping;
use super::map_writer::{self, Kind, MapColumn, Step, Table};
use super::mismatch::Together;
use super::misused::misused;
use super::options::{Format, Running, between, check_apart, check_memory, print, shown, whole};
use super::parallel::Jobs;
use super::progress::Progress;
use super::quantity::stated;
use provenance_reader::{Column, MadeFrom};
use report::{OfMeasure, Region, Report};
use scatter::{At, Scatter};

/// Inputs whose spacings differ by less than this factor, as where a few points are missing, count as equally fine.
const SAME_RATIO: f64 = 1.1;

/// A Minkowski map of data among those of simulations: how far it deviates, where, and how often that happens.
///
/// For each measure, such as EVQ, and each pixel: EVQ_MEAN and EVQ_STD, mean and standard deviation (n - 1) of the
/// simulations; EVQ_SIGMA, the data less that mean, in these standard deviations; EVQ_LOCAL_PERCENTILE, the share of
/// simulations with a lower value at the pixel, and EVQ_GLOBAL_PERCENTILE, that of all pixels of all simulations with a
/// lower value, both from 0 to 100, an equal value counting one half; EVQ_COUNT, the number of simulations that are not
/// masked there.
///
/// The report gives the places that deviate most, at least a window's diameter apart, and p, the probability that one of
/// so many maps has as large a deviation anywhere: the data's rank among the largest |sigma| of all maps, each compared
/// with all others. This takes a second reading of the simulations; no more than one of them is in memory.
#[derive(Args, Debug)]
#[command(mut_args(|arg| if WITHOUT_WORK.contains(&arg.get_id().as_str()) { arg } else { arg.requires("work") }))]
#[command(after_help = "\
Examples:
  longan map sky.fits sims/*.fits -o maps/ --measure evq,rank4-mid
  longan compare maps/sky.fits maps/sim*.fits -o deviation.fits
  longan compare maps/sky.fits maps/sim*.fits -o deviation.nc --smooth 10 --regions 20 --level 2.5
  longan compare maps/sky.fits maps/sim*.fits -o deviation.fits --format json > report.json
  longan compare maps/sky.fits maps/sim*.fits -o deviation.fits --scatter 264,-17 evq,rank4-mid
  longan compare sky.fits sims/*.fits -o deviation.fits --work work/ --window 10 --mask mask.fits

Inputs are Minkowski maps of longan, all made in the same way, of any ordering; their masks may differ. Of several windows \
and thresholds in a file each is compared: EVQ_WINDOW_4_THRESHOLD_1 is the first threshold of EVQ in windows of 4 \
degrees, and --measure evq is all of them. With --work they \
are maps of any kind, of which Minkowski maps are made first, by the options of `longan map`, in that folder; those that \
it holds already, made by the same options, are not made again. Direction measures are angles and are not compared.")]
pub(crate) struct Arguments {
    /// File of the data: a Minkowski map; with --work a map.
    #[arg(value_name = "DATA")]
    data: PathBuf,
    /// Files of simulations, at least two, of the same kind.
    #[arg(required = true, value_name = "SIMULATIONS")]
    simulations: Vec<PathBuf>,
    /// File to write, FITS (.fits, .fits.gz) or NetCDF (.nc).
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Folder for Minkowski maps of the inputs, which are made there as `longan map` makes them.
    #[arg(long, value_name = "DIR")]
    work: Option<PathBuf>,
    /// Smooth all maps first by a Gaussian of this full width at half maximum in degrees, at least two pixels; masked
    /// pixels stay masked and do not count.
    #[arg(long, value_name = "FWHM", allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 180.0))]
    smooth: Option<f64>,
    /// How to print the report.
    #[arg(long, value_name = "FORMAT", default_value = "text", help_heading = "Report")]
    format: Format,
    /// Largest number of places to report, for each measure.
    #[arg(long, value_name = "N", default_value_t = 10, allow_negative_numbers = true, value_parser = whole::<usize>)]
    #[arg(help_heading = "Report")]
    regions: usize,
    /// Report places that deviate by this many standard deviations or more.
    #[arg(long, value_name = "SIGMA", default_value_t = 3.0, allow_negative_numbers = true, help_heading = "Report")]
    #[arg(value_parser = |t: &str| between(t, 0.0, 1e9))]
    level: f64,
    /// Also write the values of two measures at the pixel that contains this point (longitude and latitude in degrees),
    /// in the data and all simulations, as a table and a picture.
    #[arg(long, value_names = ["LON,LAT", "MEASURE,MEASURE"], num_args = 2, allow_hyphen_values = true)]
    #[arg(help_heading = "Report")]
    scatter: Vec<String>,
    /// Name of the picture, .png or .svg; the table has the same name with .csv [default: that of the output, with
    /// _scatter.png].
    #[arg(long, value_name = "FILE", requires = "scatter", help_heading = "Report")]
    scatter_output: Option<PathBuf>,
    #[command(flatten)]
    mapping: Mapping,
    /// Replace existing outputs.
    #[arg(long, help_heading = "Output")]
    overwrite: bool,
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    running: Running,
}

/// Options that make sense without --work. All others say how Minkowski maps are made.
const WITHOUT_WORK: [&str; 20] = [
    "data",
    "simulations",
    "output",
    "work",
    "smooth",
    "format",
    "regions",
    "level",
    "scatter",
    "scatter_output",
    "overwrite",
    "measure",
    "hdu",
    "select",
    "ignore_coordsys",
    "ordering",
    "float32",
    "threads",
    "quiet",
    "help",
];

/// Takes the maps of one simulation.
type Take<'a> = dyn FnMut(&[Vec<f64>]) -> Result<(), ComparisonError> + 'a;

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let scatter = arguments.checked()?;
    let kind = Kind::of(&arguments.output)?;
    let files = match &arguments.work {
        Some(folder) => {
            let inputs: Vec<&Path> = arguments.inputs().collect();
            let measures = arguments.mapping.measures()?;
            let column =
                |measure: &Arc<dyn Measure>| Column::to_be(measure.column(), measure.unit(), measure.quantity());
            let columns: Vec<Column> = measures.iter().map(column).collect();
            columns.iter().try_for_each(Column::check)?;
            arguments.check_together(&inputs)?;
            let made = |inputs: &[&Path]| {
                let (mapping, jobs, running) = (&arguments.mapping, &arguments.jobs, &arguments.running);
                cache::minkowski_maps(folder, inputs, mapping, measures.clone(), jobs, running)
            };
            if let Some(scatter) = &scatter {
                // Whether the place is masked shows before all simulations are measured.
                scatter.check_among(&columns)?;
                let data = made(&inputs[..1])?.pop().context("data")?;
                scatter.check(&data)?;
            }
            made(&inputs)?
        }
        None => arguments.made_from()?,
    };
    let (data, simulations) = files.split_first().context("data")?;
    let ignore_coordsys = arguments.mapping.input().ignore_coordsys;
    simulations.iter().try_for_each(|simulation| data.check(simulation, ignore_coordsys))?;
    if let Some(difference) = simulations.iter().find_map(|simulation| data.masked_otherwise(simulation)) {
        arguments.running.warn(format_args!("{difference}; simulations should have gone through what the data has"));
    }
    let columns = arguments.columns(&files)?;
    let pair = scatter.as_ref().map(|scatter| scatter.pair(&columns)).transpose()?;
    let grid = Healpix::new(data.recipe.nside_out)?;
    check_memory(grid, 12 * columns.len())?;
    let smoothing = arguments.smooth.map(|fwhm| Smoothing::new(grid, fwhm)).transpose()?;
    arguments.warn_of_resolution(data, simulations);
    let first = data.read(&columns[0])?;
    let layout = arguments.mapping.layout().layout(&first, grid, kind, 1).with_context(|| shown(&data.path))?;
    let read = |file: &MadeFrom| -> anyhow::Result<Vec<Vec<f64>>> {
        let maps = columns.iter().map(|column| Ok(file.read(column)?.into_values()));
        let maps = maps.collect::<anyhow::Result<Vec<_>>>()?;
        let Some(smoothing) = &smoothing else { return Ok(maps) };
        let maps: Vec<&[f64]> = maps.iter().map(Vec::as_slice).collect();
        smoothing.apply(&maps).with_context(|| shown(&file.path))
    };
    let of_data = read(data)?;
    let comparisons = of_data.iter().map(Comparison::new).collect::<Result<Vec<_>, _>>();
    let mut comparisons = comparisons.with_context(|| shown(&data.path))?;
    let at_point = |maps: &[Vec<f64>]| Some(scatter.as_ref()?.point(grid, pair?.map(|i| maps[i].as_slice())));
    let mut points: Vec<[f64; 2]> = at_point(&of_data).into_iter().collect();
    if let (Some(scatter), Some(pair)) = (&scatter, pair) {
        scatter.check_point(&data.path, grid, points[0], pair.map(|i| &columns[i]))?;
    }
    let progress = Progress::new(shown(&arguments.data), arguments.running.quiet);
    let pass = |done: usize, take: &mut Take<'_>| {
        for (i, simulation) in simulations.iter().enumerate() {
            take(&read(simulation)?).with_context(|| shown(&simulation.path))?;
            progress.set((done + i + 1) as f64 / (2 * simulations.len()) as f64);
        }
        anyhow::Ok(())
    };
    pass(0, &mut |maps| {
        points.extend(at_point(maps));
        comparisons.iter_mut().zip(maps).try_for_each(|(comparison, map)| comparison.first(map))
    })?;
    if let Some(scatter) = &scatter {
        scatter.check_simulations(grid, &points[1..])?;
    }
    pass(simulations.len(), &mut |maps| {
        comparisons.iter_mut().zip(maps).try_for_each(|(comparison, map)| comparison.second(map))
    })?;
    drop(progress);

    let mut report = Report {
        data: shown(&arguments.data),
        simulations: simulations.len(),
        nside: data.recipe.nside_out,
        smoothing_fwhm_deg: arguments.smooth,
        level_sigma: arguments.level,
        measures: Vec::new(),
        output: shown(&arguments.output),
        scatter: Vec::new(),
    };
    let mut maps = Vec::new();
    for (column, comparison) in columns.iter().zip(comparisons) {
        let (of, mut columns) = arguments.of_measure(column, comparison.finish()?);
        report.measures.push(of);
        maps.append(&mut columns);
    }
    let step = arguments.step(data, &report, maps);
    map_writer::write(&arguments.output, kind, layout, arguments.overwrite, [Ok(step)])?;
    if let (Some(scatter), Some(pair)) = (&scatter, pair) {
        let files: Vec<&Path> = arguments.inputs().collect();
        report.scatter = scatter.write(&files, &points, pair.map(|i| &columns[i]), arguments.overwrite)?;
    }
    if arguments.running.quiet {
        return Ok(());
    }
    match arguments.format {
        Format::Text => print(&report.text()),
        Format::Json => print(&format!("{}\n", serde_json::to_string_pretty(&report)?)),
    }
}

impl Arguments {
    /// All files, the data first.
    fn inputs(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.data).chain(&self.simulations).map(PathBuf::as_path)
    }

    /// Checks the arguments themselves, before anything is read; the scatter plot asked for.
    fn checked(&self) -> anyhow::Result<Option<Scatter>> {
        if let [only] = &self.simulations[..] {
            return Err(misused(format!(
                "'{}' is the only simulation, and a standard deviation needs at least two",
                shown(only)
            )));
        }
        let scatter = match &self.scatter[..] {
            [at, pair] => {
                let output = self.scatter_output.clone().unwrap_or_else(|| {
                    let name = self.output.file_name().unwrap_or_default().to_string_lossy();
                    let stem = name.trim_end_matches(".gz");
                    let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
                    self.output.with_file_name(format!("{stem}_scatter.png"))
                });
                let at: At = at.parse().map_err(|problem| wrong("--scatter", at, problem))?;
                Some(Scatter::new(at, pair, output).map_err(|problem| wrong("--scatter", pair, problem))?)
            }
            _ => None,
        };
        let mut seen = HashSet::new();
        let data = self.data.canonicalize().unwrap_or_else(|_| self.data.clone());
        let outputs: Vec<&Path> =
            std::iter::once(self.output.as_path()).chain(scatter.iter().flat_map(Scatter::outputs)).collect();
        Kind::of(&self.output)?;
        outputs.iter().try_for_each(|output| check_apart(output, self.inputs().chain(self.mapping.mask())))?;
        outputs.iter().try_for_each(|output| formats::check_writable(output, self.overwrite))?;
        for path in &self.simulations {
            let simulation = path.canonicalize().unwrap_or_else(|_| path.clone());
            if simulation == data {
                self.running.warn(format_args!("{}: the data is among the simulations", shown(path)));
            } else if !seen.insert(simulation) {
                self.running.warn(format_args!("{}: this simulation is given twice, and counts twice", shown(path)));
            }
        }
        Ok(scatter)
    }

    /// Warns where the maps measured had another resolution, or came to HEALPix in another way.
    fn warn_of_resolution(&self, data: &MadeFrom, simulations: &[MadeFrom]) {
        if let Some(other) = simulations.iter().find(|other| other.recipe.nside != data.recipe.nside) {
            self.running.warn(format_args!(
                "{} was measured at Nside {}, and {} at Nside {}; shapes depend on the resolution",
                shown(&data.path),
                data.recipe.nside,
                shown(&other.path),
                other.recipe.nside
            ));
        }

        if let Some(other) = simulations.iter().find(|other| other.way().is_empty() != data.way().is_empty()) {
            let way = |file: &MadeFrom| {
                if file.way().is_empty() { "does not say".to_owned() } else { format!("says '{}'", file.way()) }
            };
            self.running.warn(format_args!(
                "of how its input came to HEALPix, {} {}, and {} {}; shapes depend on it",
                shown(&data.path),
                way(data),
                shown(&other.path),
                way(other)
            ));
        }
        let apart = |other: &&MadeFrom| match (data.ratio, other.ratio) {
            (Some(one), Some(other)) => (one / other).ln().abs() > SAME_RATIO.ln(),
            _ => false,
        };
        if let Some(other) = simulations.iter().find(apart) {
            self.running.warn(format_args!(
                "the input of {} has another spacing than that of {}; shapes depend on the resolution",
                shown(&data.path),
                shown(&other.path)
            ));
        }
    }

    /// Refuses maps that do not go together, before they are measured.
    fn check_together(&self, inputs: &[&Path]) -> anyhow::Result<()> {
        let (mapping, input) = (&self.mapping, self.mapping.input());
        let in_value = mapping.analysis().threshold_unit == ThresholdUnit::Value;
        let mut together = Together::new(!input.ignore_coordsys, in_value);
        inputs.iter().try_for_each(|path| together.add(path, &input.open(path)?.about()))
    }

    /// The provenance of all files, each of which holds Minkowski maps.
    fn made_from(&self) -> anyhow::Result<Vec<MadeFrom>> {
        let Input { hdu, select: at, .. } = self.mapping.input();
        let all =
            self.inputs().map(|path| Ok((path, MadeFrom::of(path, *hdu, at)?))).collect::<anyhow::Result<Vec<_>>>()?;
        if let Some((path, _)) = all.iter().find(|(_, made)| made.is_none()) {
            match all.iter().find(|(_, made)| made.is_some()) {
                Some((other, _)) => bail!(
                    "{} is a Minkowski map of longan, but {} is none; compare one kind with itself",
                    shown(other),
                    shown(path)
                ),
                None => bail!(
                    "{}: this is no Minkowski map of longan; make them with `longan map`, or on the way with --work DIR",
                    shown(path)
                ),
            }
        }
        Ok(all.into_iter().filter_map(|(_, made)| made).collect())
    }

    /// The columns to compare: those asked for, or those that all files have.
    fn columns(&self, files: &[MadeFrom]) -> anyhow::Result<Vec<Column>> {
        let data = &files[0];
        let lacking = |column: &Column| files.iter().find(|file| !file.has(column));
        let asked: Vec<&str> = if self.work.is_some() { Vec::new() } else { self.mapping.names().collect() };
        let mut columns = Vec::new();
        for name in &asked {
            let missing = |file: &MadeFrom| {
                format!("{}: there is no measure '{name}'; there are {}", shown(&file.path), file.listed())
            };
            let mut called = data.columns.iter().filter(|column| column.is_called(name)).peekable();
            ensure!(called.peek().is_some(), missing(data));
            for column in called {
                if let Some(file) = lacking(column) {
                    bail!(missing(file));
                }
                column.check()?;
                if !columns.contains(column) {
                    columns.push(column.clone());
                }
            }
        }
        if !asked.is_empty() {
            return Ok(columns);
        }
        let mut left_out = Vec::new();
        for column in &data.columns {
            match lacking(column) {
                Some(file) => {
                    left_out.push(format!("{}: {} has only {}", column.name, shown(&file.path), file.listed()));
                }
                None if !column.quantity.has_mean() => {
                    left_out.push(format!("{}: it is an angle, of which there is no mean or order", column.name));
                }
                None => columns.push(column.clone()),
            }
        }
        if !columns.is_empty() {
            left_out.iter().for_each(|what| self.running.warn(format_args!("left out is {what}")));
        }
        if columns.is_empty() {
            let other = data.columns.iter().find_map(lacking);
            match other {
                Some(other) => bail!(
                    "{} has the measures {}, but {} has {}; compare maps of the same measures",
                    shown(&data.path),
                    data.listed(),
                    shown(&other.path),
                    other.listed()
                ),
                None => {
                    bail!("{}: there are only angles, {}; compare other measures", shown(&data.path), data.listed())
                }
            }
        }
        Ok(columns)
    }

    /// The report of a measure, and its maps.
    fn of_measure(&self, column: &Column, outcome: Outcome<'_>) -> (OfMeasure, Vec<MapColumn>) {
        let window = column.window.unwrap_or(0.0);
        let outliers = outcome.outliers(2.0 * window, self.level, self.regions);
        let of = OfMeasure {
            measure: column.name.clone(),
            unit: column.unit.clone(),
            window_deg: window,
            largest_sigma: outcome.largest,
            simulations_as_large: outcome.rank.map(|rank| rank.as_large),
            p_value: outcome.rank.map(|rank| rank.p_value()),
            regions: outliers.iter().map(region).collect(),
        };
        let found = outcome.deviation;
        let map = |suffix: &str, unit: &str, words: &str, quantity: Quantity, values: Array1<f64>| MapColumn {
            name: format!("{}_{suffix}", column.name),
            unit: unit.to_owned(),
            long_name: format!("{words} of {}", column.name),
            quantity: Some(stated(quantity)),
            values: values.into_raw_vec_and_offset().0,
        };
        let (lower_here, lower) =
            ("share of simulations with a lower value here", "share of pixels of all simulations with a lower value");
        let maps = vec![
            map("MEAN", &column.unit, "mean over simulations", column.quantity, found.mean),
            map("STD", &column.unit, "standard deviation over simulations (n - 1)", column.quantity, found.std),
            map(
                "SIGMA",
                "",
                "data less mean, in standard deviations, of simulations",
                Quantity::Deviation,
                found.sigma,
            ),
            map("LOCAL_PERCENTILE", "percent", lower_here, Quantity::Percentile, found.local_percentile),
            map("GLOBAL_PERCENTILE", "percent", lower, Quantity::Percentile, found.global_percentile),
            map("COUNT", "", "number of unmasked simulations", Quantity::Count, found.count),
        ];
        (of, maps)
    }

    /// The maps and headers to write.
    fn step(&self, data: &MadeFrom, report: &Report, columns: Vec<MapColumn>) -> Step {
        let command = command(&self.simulations, &self.simulations[0]);
        let mut cards: Vec<Card> = vec![
            creator(),
            text("DATAFILE", self.data.to_string_lossy(), "Minkowski map compared, or map it is made of"),
            integer("NSIMS", self.simulations.len(), "number of simulations"),
            text("SIMFIRST", self.simulations[0].to_string_lossy(), "the first of them"),
            real("SMOOTH", self.smooth.unwrap_or(0.0), "[deg] FWHM of the smoothing, 0: none"),
            text("TIES", "half", "an equal value counts one half in percentiles"),
        ];
        cards.extend(data.repeated.iter().cloned());
        for (n, of) in (1..).zip(&report.measures) {
            cards.push(text(&numbered("MEASURE", n), of.measure.clone(), "measure compared"));
            if let (Some(largest), Some(p)) = (of.largest_sigma, of.p_value) {
                cards.push(real(&numbered("LARGEST", n), largest, "its largest deviation in sigma"));
                cards.push(real(&numbered("PVALUE", n), p, "probability of one as large anywhere"));
            }
        }
        let mut attributes = vec![text("TITLE", format!("{} among simulations", shown(&self.data)), "")];
        attributes.extend(cards.iter().cloned());
        attributes.push(text("HISTORY", command.clone(), ""));
        cards.push(text("COMMAND", command, "command that made this file, but for simulations"));
        let table = Table { name: "DEVIATION".to_owned(), cards, columns };
        Step { time: None, tables: vec![table], attributes, numbers: Vec::new() }
    }
}

/// The row of an outlier.
fn region(outlier: &Outlier) -> Region {
    Region {
        lon_deg: outlier.peak.lon,
        lat_deg: outlier.peak.lat,
        pixel: outlier.peak.pixel,
        value: outlier.value,
        mean: outlier.mean,
        standard_deviation: outlier.std,
        sigma: outlier.peak.sigma,
        local_percentile: outlier.local_percentile,
        global_percentile: outlier.global_percentile,
        simulations: outlier.simulations,
    }
}

/// A complaint about the value of an option.
fn wrong(option: &str, value: &str, problem: String) -> anyhow::Error {
    misused(format!("invalid value '{value}' for '{option} <LON,LAT> <MEASURE,MEASURE>': {problem}"))
}
