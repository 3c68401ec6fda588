//! The options of a computation of Minkowski maps, and the way of one file to its Minkowski maps.
//!
//! The list of files, and the treatment of failures, is left to the commands.

use std::fmt;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use longan::measures::{Catalogue, CatalogueError, Measure, Origin, PluginOrigin, split};
use longan::statistics::Statistics;
use longan::window::{Summation, SummationCounts};
use longan::{Analysis, AnalysisError, Block, FieldRecipe, MinkowskiMaps, ThresholdUnit};
use longan_formats::{InputRecord, MemoryEstimate, Role, Target};
use longan_grid::{Healpix, Map};

use super::identity::Identity;
use super::input::{Input, Mask, Series};
use super::map_writer::{self, Kind, LayoutOptions};
use super::mismatch;
use super::misused::misused;
use super::options::{
    BodyOptions, ContourOption, Running, WeightOption, between, check_memory, decimals, nside, shown,
};
use super::parallel::Memory;
use super::plugin::Plugins;
use super::provenance::Provenance;
use super::regridding;
use super::remedies::of_mask;

/// The field that is measured, the analysis, and the layout of the result.
#[derive(Args, Clone, Debug, PartialEq)]
pub(crate) struct Mapping {
    /// Measures, separated by commas, such as evq,psi2-direction, and formulas of them, such as
    /// "axis = (w1 - psi2)/(w1 + psi2)"; may be repeated. Capitals are small letters, and _ is - outside of formulas.
    /// `longan measures` lists all measures, and `longan measures --help` explains formulas [default: evq].
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
    #[command(flatten)]
    contour: ContourOption,
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
    layout: LayoutOptions,
}

/// The measure where none is asked for.
const DEFAULT: &str = "evq";

/// Columns that a FITS table can have.
const COLUMNS_MAX: usize = 999;

impl Mapping {
    /// A mapper of files, once the mask has been opened.
    pub(crate) fn mapper<'a>(
        &'a self,
        measures: Vec<Arc<dyn Measure>>,
        memory: Memory,
        running: &'a Running,
        several: bool,
    ) -> anyhow::Result<Mapper<'a>> {
        // The state of the files is that from before they are read.
        let mut records = Vec::new();
        if let Some(mask) = self.mask() {
            records.push(InputRecord::of_data(Role::Mask, mask).map_err(of_mask)?);
        }
        let mut plugins: Vec<PathBuf> = Vec::new();
        for measure in &measures {
            if let Origin::Plugin(PluginOrigin { path, .. }) = measure.origin()
                && !plugins.contains(&path)
            {
                records.push(InputRecord::of_plugin(&path)?);
                plugins.push(path);
            }
        }
        let (mask, analysis) = (self.input.mask(running)?, self.analysis());
        Ok(Mapper { mapping: self, measures, mask, records, analysis, memory, running, several })
    }

    /// The measures asked for, as they were.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.measure.iter().flat_map(|list| split(list))
    }

    /// Which maps of files are read.
    pub(crate) fn input(&self) -> &Input {
        &self.input
    }

    /// How results are laid out.
    pub(crate) fn layout(&self) -> &LayoutOptions {
        &self.layout
    }

    /// The file of the mask.
    pub(crate) fn mask(&self) -> Option<&Path> {
        self.input.mask.as_deref()
    }

    /// The measures asked for, no two the same.
    pub(crate) fn measures(&self) -> anyhow::Result<Vec<Arc<dyn Measure>>> {
        let catalogue = self.plugins.catalogue()?;
        let mut measures: Vec<Arc<dyn Measure>> = Vec::new();
        for text in self.names() {
            let measure = find(&catalogue, text)?;
            if let Some(other) = measures.iter().find(|other| other.column().eq_ignore_ascii_case(&measure.column())) {
                let [one, other] = [measure.name(), other.name()];
                let twice = if one == other { "is given twice".into() } else { format!("has the column of '{other}'") };
                return Err(no_measure(text, format!("'{one}' {twice}")));
            }
            measures.push(measure);
        }
        if measures.len() > COLUMNS_MAX {
            let problem =
                format!("{} measures are more than the {COLUMNS_MAX} columns of a FITS table", measures.len());
            return Err(misused(problem));
        }
        if measures.is_empty() {
            measures.push(catalogue.find(&format!("longan:{DEFAULT}"))?);
        }
        Ok(measures)
    }

    /// The analysis.
    pub(crate) fn analysis(&self) -> Analysis {
        Analysis {
            windows: self.window.clone(),
            weight: self.weight.weight(),
            nside_out: self.nside_out,
            max_masked: self.max_masked,
            min_contour: self.contour.min_contour,
            by_threshold: self.sequence,
            summation: if self.exact { Summation::Exact } else { Summation::Tolerance(self.tolerance) },
            ..self.body.analysis()
        }
    }
}

/// The measure of a name or formula.
pub(crate) fn find(catalogue: &Catalogue, text: &str) -> anyhow::Result<Arc<dyn Measure>> {
    catalogue.find(text).map_err(|e| match &e {
        CatalogueError::Formula(formula) => no_measure(text, format!("{e}\n\n{}", formula.marked())),
        CatalogueError::Unknown(_) => no_measure(text, format!("{e}; `longan measures` lists them all")),
        _ => no_measure(text, e.to_string()),
    })
}

/// The complaint about a text that names no measure that can be taken.
pub(crate) fn no_measure(text: &str, problem: impl fmt::Display) -> anyhow::Error {
    misused(format!("invalid value '{text}' for '--measure <LIST>': {problem}"))
}

/// A computation that is ready for files; several threads may share it.
pub(crate) struct Mapper<'a> {
    mapping: &'a Mapping,
    measures: Vec<Arc<dyn Measure>>,
    mask: Option<Mask>,
    /// The mask's file and those of plugins.
    records: Vec<InputRecord>,
    analysis: Analysis,
    memory: Memory,
    running: &'a Running,
    /// Whether several files are mapped.
    several: bool,
}

/// The outcome for one file.
pub(crate) struct Made {
    /// The Minkowski maps, in a few words.
    pub(crate) summary: String,
    /// For each window how it was summed, and why.
    pub(crate) ways: Vec<String>,
    /// How the map came to HEALPix, where that is another way than the usual one.
    pub(crate) note: Option<String>,
    /// Warnings for the user.
    pub(crate) warnings: Vec<String>,
}

impl Mapper<'_> {
    /// The identity of what would be made of a file now.
    ///
    /// # Errors
    /// Where the file cannot be read, or not as it is asked for.
    pub(crate) fn identity(&self, path: &Path) -> anyhow::Result<Identity> {
        let record = InputRecord::of_data(Role::Map, path)?;
        self.identity_of(&mut self.mapping.input.open(path)?, record)
    }

    /// The identity of what is made of the maps of a file in a state.
    fn identity_of(&self, series: &mut Series, record: InputRecord) -> anyhow::Result<Identity> {
        let Target { grid, ordering, settings } = series.target()?;
        let mut recipe = self.analysis.recipe(grid, &self.measures)?;
        recipe.field = FieldRecipe {
            place: series.place(),
            regridding: settings,
            mask: self.mask.as_ref().map(|mask| mask.settings.clone()).unwrap_or_default(),
            layout: self.mapping.layout.settings(ordering),
        };
        let inputs = std::iter::once(record).chain(self.records.iter().cloned()).collect();
        Ok(Identity { recipe, inputs })
    }

    /// Maps one file to one file. `command` goes into its header; `progress` is told the share done, from 0 to 1.
    pub(crate) fn map(
        &self,
        path: &Path,
        output: &Path,
        overwrite: bool,
        command: &str,
        progress: impl Fn(f64),
    ) -> anyhow::Result<Made> {
        let Mapper { mapping, measures, mask, analysis, memory, running, several, .. } = self;
        let record = InputRecord::of_data(Role::Map, path)?;
        let mut series = mapping.input.open(path)?;
        let _taken =
            memory.take(series.memory().and_then(|estimate| self.bytes(estimate))).with_context(|| shown(path))?;
        let start = Instant::now();
        let steps = series.steps();
        let map = series.read(0, mask.as_ref())?;
        let about = || shown(path);
        let kind = Kind::of(output)?;
        let grid = analysis.check(map.grid()).with_context(about)?;
        let layout = mapping.layout.layout(&map, grid, kind, steps).with_context(about)?;
        let tables = self.tables();
        check_memory(grid, tables * measures.len()).with_context(about)?;
        let identity = &self.identity_of(&mut series, record)?;
        let note = regridding::note(&map);
        let mut warnings: Vec<String> = regridding::warning(path, &map).into_iter().collect();
        let mut first = Some(map);
        let mut summary = Summary::new(measures[0].as_ref());
        let mut ways = Vec::new();
        let mut empty = Vec::new();
        let made = |step| {
            let map = match first.take() {
                Some(map) => map,
                None => series.read(step, mask.as_ref())?,
            };
            mismatch::warn(running, path, &map, analysis, *several || steps > 1);
            let told = |share| {
                progress((step as f64 + share) / steps as f64);
                ControlFlow::Continue(())
            };
            let maps = match analysis.minkowski_maps(&map, measures, told) {
                // One step without shape does not end a series.
                Err(AnalysisError::AllMasked | AnalysisError::Constant { .. }) if steps > 1 => {
                    empty.push(map.time.as_ref().map(|time| time.label.clone()).unwrap_or_default());
                    analysis.undefined(&map, measures).with_context(about)?
                }
                maps => {
                    let when = map.time.as_ref().filter(|_| steps > 1).map(|time| format!(": at {}", time.label));
                    maps.with_context(|| format!("{}{}", shown(path), when.unwrap_or_default()))?
                }
            };
            if step == 0 {
                ways = maps.blocks.iter().map(explained).collect();
            }
            summary.add(&maps, &map, analysis);
            let input = Some(&mapping.input);
            let command = command.to_owned();
            Ok(Provenance { path, map: &map, input, analysis, identity, command }.step(&maps, measures))
        };
        map_writer::write(output, kind, layout, overwrite, (0..steps).map(made))?;
        warnings.extend(empty.first().map(|one| {
            let (about, n) = (about(), empty.len());
            let others = if n > 1 { format!(" and {} other steps", n - 1) } else { String::new() };
            format!("{about}: the map at {one}{others} is masked or constant, so the result is masked there")
        }));
        let of = if steps > 1 { format!("{steps} steps of ") } else { String::new() };
        let all = format!("{of}{} of Nside {}", measures[0].column(), grid.nside());
        let seconds = start.elapsed().as_secs_f64();
        Ok(Made { summary: format!("{all} {summary} ({seconds:.2} s)"), ways, note, warnings })
    }

    /// About how many bytes it takes to map a file, where that shows before it is read.
    fn bytes(&self, estimate: MemoryEstimate) -> Option<usize> {
        let grid = Healpix::new(estimate.nside).ok()?;
        let mask = if self.mask.is_some() { grid.pixels().saturating_mul(size_of::<f64>()) } else { 0 };
        // Where there is an error, mapping says so.
        let maps = self.analysis.memory(grid, &self.measures).ok()?;
        Some(estimate.bytes.saturating_add(mask).saturating_add(maps))
    }

    /// The number of Minkowski maps of each measure that a step makes.
    pub(crate) fn tables(&self) -> usize {
        let thresholds = if self.mapping.sequence { self.analysis.thresholds.values().len() } else { 1 };
        self.analysis.windows.len() * thresholds
    }
}

/// A summary of Minkowski maps in a few words: thresholds, values, and windows without any.
struct Summary {
    /// Whether the measure is an angle, of which there is no median.
    is_angle: bool,
    /// Least and largest value.
    range: Option<[f64; 2]>,
    /// Least and largest median of a map.
    medians: Option<[f64; 2]>,
    /// Least and largest threshold in standard deviations, and in the map's unit.
    thresholds: [Option<[f64; 2]>; 2],
    /// How many thresholds there are.
    of: usize,
    unit: String,
    windows: usize,
    masked: usize,
    /// Windows that are not masked but have no value.
    empty: usize,
    min_contour: f64,
}

/// A range widened by a number.
fn widened(range: Option<[f64; 2]>, x: f64) -> Option<[f64; 2]> {
    Some(range.map_or([x, x], |[low, high]| [low.min(x), high.max(x)]))
}

impl Summary {
    fn new(measure: &dyn Measure) -> Self {
        Summary {
            is_angle: !measure.quantity().has_mean(),
            range: None,
            medians: None,
            thresholds: [None; 2],
            of: 0,
            unit: String::new(),
            windows: 0,
            masked: 0,
            empty: 0,
            min_contour: 0.0,
        }
    }

    /// Takes the first measure of Minkowski maps of a map into account.
    fn add(&mut self, maps: &MinkowskiMaps, map: &Map, analysis: &Analysis) {
        self.min_contour = analysis.min_contour;
        self.of = analysis.thresholds.values().len();
        self.unit = map.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
        let Statistics { mean, sigma, .. } = maps.of_map;
        // A map that is masked everywhere has thresholds in its own unit only where they were given so.
        let known = analysis.threshold_unit == ThresholdUnit::Value || sigma > 0.0;
        for block in &maps.blocks {
            let mut values: Vec<f64> = block.values.row(0).iter().copied().filter(|value| !value.is_nan()).collect();
            self.windows += maps.grid.pixels();
            self.masked += block.masked;
            self.empty += maps.grid.pixels() - block.masked - values.len();
            for &threshold in block.thresholds.values().iter().filter(|_| known) {
                self.thresholds[1] = widened(self.thresholds[1], threshold);
                if sigma > 0.0 {
                    self.thresholds[0] = widened(self.thresholds[0], (threshold - mean) / sigma);
                }
            }
            if values.is_empty() {
                continue;
            }
            let n = values.len();
            let (below, &mut upper, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
            // Of an even number of values the middle ones are two.
            let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let median = if n.is_multiple_of(2) { 0.5 * (lower + upper) } else { upper };
            self.range = values.iter().fold(self.range, |range, &value| widened(range, value));
            self.medians = widened(self.medians, median);
        }
    }

    /// The thresholds in both units.
    fn at(&self) -> String {
        let words = |range: Option<[f64; 2]>, unit: &str| {
            let [low, high] = range?.map(short);
            Some(if low == high { format!("{low}{unit}") } else { format!("{low} to {high}{unit}") })
        };
        let [sigma, value] = [words(self.thresholds[0], " sigma"), words(self.thresholds[1], &self.unit)];
        let of = if self.of == 1 { "at".to_owned() } else { format!("at {} thresholds,", self.of) };
        match (sigma, value) {
            (Some(sigma), Some(value)) => format!(", {of} {sigma} = {value}"),
            (None, Some(value)) => format!(", {of} {value}"),
            _ => String::new(),
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = |range: [f64; 2]| range.map(|x| decimals(x, 4));
        match self.range.map(words) {
            Some([low, high]) => write!(f, "from {low} to {high}")?,
            None => f.write_str("is masked or undefined everywhere")?,
        }
        match self.medians.filter(|_| !self.is_angle).map(words) {
            Some([low, high]) if low == high => write!(f, ", median {low}")?,
            Some([low, high]) => write!(f, ", medians from {low} to {high}")?,
            None => (),
        }
        f.write_str(&self.at())?;
        let all = self.windows;
        match self.masked {
            0 => (),
            masked => {
                write!(f, "; {masked} of {all} windows lost to the mask (a larger --max-masked would bring them back)")?
            }
        }
        match self.empty {
            0 => Ok(()),
            empty if self.min_contour > 0.0 => write!(
                f,
                "; {empty} of {all} windows with too little contour (a smaller --min-contour, a larger --window or \
                 thresholds nearer the median would bring them back)"
            ),
            empty => write!(
                f,
                "; {empty} of {all} windows without contour (a larger --window or thresholds nearer the median would bring \
                 them back)"
            ),
        }
    }
}

/// A number with up to four decimals.
fn short(x: f64) -> String {
    let text = decimals(x, 4);
    if text.contains('e') { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}

/// How the windows of a map were summed, and why.
fn explained(block: &Block) -> String {
    let SummationCounts { direct, missed, prefix, error, terms } = block.counts;
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
    format!("window of {} degrees, {pairs}: {}", block.window, ways.join("; "))
}
