//! `longan graph`: measures against threshold, as a table and as a picture.

mod ensemble;
mod picture;
mod table;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, ensure};
use clap::Args;
use longan::gaussian::Gaussian;
use longan::measures::{Measure, split, usual};
use longan::region::RegionError;
use longan::statistics::Statistics;
use longan::totals::Totals;
use longan::{Analysis, AnalysisError, Body, Map, Region, ThresholdUnit};
use longan_formats as formats;
use longan_picture::axes::PALETTE;

use super::drawn::{Form, save};
use super::input::{Input, Mask, of};
use super::mapping::{find, no_measure};
use super::mismatch::Together;
use super::options::{
    BodyOptions, ContourOption, Running, WeightOption, between, check_apart, check_memory, nside, shown,
};
use super::plugin::Plugins;
use super::progress::Progress;
use super::{mismatch, misused, regridding};
use ensemble::Ensemble;

/// Measures of shape against threshold: a picture, and the numbers as CSV beside it.
///
/// w0, w1, w2 and euler are area, contour length, curvature and Euler characteristic of the body, over the whole unmasked
/// sphere or the region, each divided by that area: the fraction of it, rad/sr, rad/sr and 1/sr. The Euler
/// characteristic is (w0 + w2)/(2 pi); times the area it is a number, an integer where nothing is masked.
///
/// All other measures, formulas and plugins, are those of `longan map` in moving windows: their mean over the sphere, or
/// over the windows whose centre lies in the region. Windows where a measure is undefined, such as evq without contour,
/// are left out; the CSV tells how many remain. (longan:w0 is the area in a window.)
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  longan graph sky.fits -o graph.png --mask mask.fits --gaussian
  longan graph sky.fits -o graph.svg --measure w1,euler,evq,psi4 --window 10
  longan graph sky.fits -o graph.png --ensemble sims/*.fits
  longan graph 30GHz.fits 44GHz.fits -o both.png --region 120,-30,20
  longan graph rain.nc -o rain.png --thresholds log:0.1:100:31 --select time=#0
  longan graph sky.fits -o graph.csv --thresholds -200:200:81

With thresholds in sigma (the default) each map's are counted from its own mean, in its own standard deviation, those of \
an ensemble too. A field with several times has a curve for each, in an ensemble each is a simulation.")]
#[command(mut_arg("thresholds", |arg| arg.help("Thresholds: n from lo to hi, evenly or logarithmically spaced, or a list \
[default: -4:4:33 in sigma]")))]
pub(crate) struct Arguments {
    /// Files of maps: FITS, NetCDF, Zarr, CSV, PLY; drawn together.
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// File to write: a picture (.png, .svg), with a file of the same name in .csv beside it, or the numbers alone (.csv).
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Measures, separated by commas, such as w1,euler,evq, and formulas; may be repeated. `longan measures` lists all
    /// [default: w0,w1,w2,euler].
    #[arg(long, value_name = "LIST")]
    measure: Vec<String>,
    #[command(flatten)]
    plugins: Plugins,
    /// Radius of moving windows in degrees, from 0 to 180; 0: each pixel by itself.
    #[arg(long, value_name = "DEG", default_value_t = 6.0)]
    #[arg(allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 180.0))]
    window: f64,
    /// Nside whose pixels are the windows' centres [default: the smaller of 16 and the input's; for --window 0 the
    /// input's].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = nside)]
    nside_out: Option<usize>,
    /// Weight of the contour's pieces in tensors: their length (W_1) or their curvature (W_2).
    #[arg(long, value_name = "WEIGHT", default_value = "length")]
    weight: WeightOption,
    /// Windows with a larger share of masked cells than this, from 0 to 1, are left out.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0625)]
    #[arg(allow_negative_numbers = true, value_parser = |t: &str| between(t, 0.0, 1.0))]
    max_masked: f64,
    #[command(flatten)]
    contour: ContourOption,
    /// Only what lies within a radius of a point: longitude, latitude and radius in degrees. Of w0, w1, w2 and euler
    /// the shares of the pixels, of other measures the windows, whose centres lie there. Thresholds in sigma are those of
    /// the whole map.
    #[arg(long, value_name = "LON,LAT,RADIUS", allow_hyphen_values = true, value_parser = region)]
    region: Option<Region>,
    /// Add what an isotropic Gaussian field with the map's own standard deviation sigma0, and sigma1 of its gradient, has
    /// of w0, w1, w2 and euler. sigma1 is measured by finite differences between the pixels.
    #[arg(long)]
    gaussian: bool,
    /// Files of simulations, treated as the inputs: bands that hold 68 and 95 % of them at each threshold, and in the
    /// CSV their median and the share of them, in percent, that lie below the input (half of those that are equal).
    #[arg(long, value_name = "FILE", num_args = 1..)]
    ensemble: Vec<PathBuf>,
    #[command(flatten)]
    body: BodyOptions,
    #[command(flatten)]
    input: Input,
    /// Replace existing outputs.
    #[arg(long, help_heading = "Output")]
    overwrite: bool,
    #[command(flatten)]
    running: Running,
}

/// Thresholds where none are given, in standard deviations.
const THRESHOLDS: &str = "-4:4:33";

/// Simulations without which the ends of the band of 95 % are but the extremes.
const FEWEST: usize = 40;

fn region(text: &str) -> Result<Region, RegionError> {
    text.parse()
}

/// What is drawn of a map.
struct Quantity {
    name: String,
    kind: Kind,
}

enum Kind {
    /// Of the body as a whole, per area.
    Density(Density),
    /// The mean in moving windows of the measure of this number.
    Mean(usize),
}

/// Additive measures per area.
#[derive(Clone, Copy)]
struct Density {
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    of: fn(&Totals) -> f64,
}

const DENSITIES: [Density; 4] = [
    Density { name: "w0", title: "area fraction W₀/A", unit: "", of: |t| t.area },
    Density { name: "w1", title: "contour length W₁/A", unit: "rad/sr", of: |t| t.length },
    Density { name: "w2", title: "curvature W₂/A", unit: "rad/sr", of: |t| t.curvature },
    Density { name: "euler", title: "Euler characteristic χ/A", unit: "1/sr", of: Totals::euler_characteristic },
];

/// What the files are searched for.
struct Plan {
    quantities: Vec<Quantity>,
    measures: Vec<Arc<dyn Measure>>,
    analysis: Analysis,
    region: Option<Region>,
    gaussian: bool,
}

/// One map's curves.
struct Curves {
    /// Its file.
    path: PathBuf,
    /// Its time, where it has one.
    time: Option<String>,
    /// Its unit.
    unit: Option<String>,
    of_map: Statistics,
    /// Thresholds in the map's unit.
    thresholds: Vec<f64>,
    /// The area of what is not masked, in steradian; where a density is asked for.
    area: Option<f64>,
    /// For each quantity its values.
    values: Vec<Vec<Value>>,
    gaussian: Option<Gaussian>,
}

/// A value at a threshold.
#[derive(Clone, Copy)]
struct Value {
    /// NaN where it is not defined.
    value: f64,
    /// The number of windows that it is the mean of.
    windows: Option<usize>,
    /// What a Gaussian field has.
    gaussian: Option<f64>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let start = Instant::now();
    arguments.running.start()?;
    let plan = arguments.plan()?;
    let outputs = arguments.outputs()?;
    let mask = arguments.input.mask(&arguments.running)?;
    let mut together = Together::new(!arguments.input.ignore_coordsys, !plan.in_sigma());
    let curves = arguments.maps_in(&arguments.inputs, mask.as_ref(), &mut together)?;
    let simulations = arguments.maps_in(&arguments.ensemble, mask.as_ref(), &mut together)?;
    let all = curves + simulations;
    ensure!(
        outputs.picture.is_none() || curves <= PALETTE.len(),
        "{curves} maps are more than the {} that a picture tells apart; choose times with --select, or write the \
         numbers alone with -o {}",
        PALETTE.len(),
        shown(&outputs.table)
    );
    if !arguments.ensemble.is_empty() {
        ensure!(simulations > 1, "an ensemble of one simulation has no scatter; name more files after --ensemble");
        if simulations < FEWEST {
            arguments.running.warn(format_args!(
                "with {simulations} simulations the band of 95 % ends near the smallest and the largest; {FEWEST} or more \
                 fill it"
            ));
        }
    }

    let progress = Progress::new(shown(&arguments.output), arguments.running.quiet);
    let told = regridding::Said::default();
    let mut done = 0;
    let mut all_of = |files: &[PathBuf], keep: &mut dyn FnMut(Curves)| -> anyhow::Result<()> {
        for path in files {
            let mut series = arguments.input.open(path)?;
            for step in 0..series.steps() {
                let share = |share: f64| progress.set((done as f64 + share) / all as f64);
                let map = series.read(step, mask.as_ref())?;
                if step == 0 {
                    told.say(&arguments.running, path, &map);
                }
                if let Some(curves) = arguments.one(&plan, path, &map, series.steps(), share)? {
                    keep(curves);
                }
                done += 1;
                progress.set(done as f64 / all as f64);
            }
        }
        Ok(())
    };
    let mut data = Vec::new();
    all_of(&arguments.inputs, &mut |curves| data.push(curves))?;
    let mut ensemble = (simulations > 0).then(Ensemble::default);
    all_of(&arguments.ensemble, &mut |curves| ensemble.iter_mut().for_each(|ensemble| ensemble.add(&curves)))?;
    drop(progress);
    ensure!(!data.is_empty(), "{}: every map is masked or constant", shown(&arguments.inputs[0]));
    let ensemble = ensemble.map(Ensemble::sorted);

    let table = table::csv(&plan, &data, ensemble.as_ref())?;
    let picture = match &outputs.picture {
        Some((_, form)) => Some(form.bytes(&picture::draw(&plan, &data, ensemble.as_ref())?)?),
        None => None,
    };
    outputs.save(&table, picture.as_deref(), arguments.overwrite)?;
    arguments.report(&plan, &data, &outputs, start)
}

impl Arguments {
    /// What is to be done, after all checks of the arguments.
    fn plan(&self) -> anyhow::Result<Plan> {
        let catalogue = self.plugins.catalogue()?;
        let (mut quantities, mut measures) = (Vec::<Quantity>::new(), Vec::new());
        let mut texts: Vec<&str> = self.measure.iter().flat_map(|list| split(list)).collect();
        if texts.is_empty() {
            texts.extend(DENSITIES.map(|density| density.name));
        }
        for text in texts {
            let density = DENSITIES.into_iter().find(|density| density.name == usual(text));
            let quantity = match density {
                Some(density) => Quantity { name: density.name.to_owned(), kind: Kind::Density(density) },
                None => {
                    let measure = find(&catalogue, text, "graph")?;
                    let name = measure.name();
                    if name.ends_with("-direction") {
                        let problem = "directions count from the south of each place, so that a mean of them means \
                                       nothing; take a formula such as 'x = psi2.re/psi0.re'";
                        return Err(no_measure(text, problem, "graph"));
                    }
                    // Beside the measure per area of the same name.
                    let twin = DENSITIES.iter().any(|density| density.name == name);
                    measures.push(measure);
                    let name = if twin { format!("longan:{name}") } else { name };
                    Quantity { name, kind: Kind::Mean(measures.len() - 1) }
                }
            };
            if quantities.iter().any(|other| other.name.eq_ignore_ascii_case(&quantity.name)) {
                return Err(no_measure(text, format!("'{}' is given twice", quantity.name), "graph"));
            }
            quantities.push(quantity);
        }
        let densities = quantities.iter().any(|quantity| matches!(quantity.kind, Kind::Density(_)));
        if self.gaussian && !densities {
            let problem = "--gaussian is about w0, w1, w2 and euler, and none of these is asked for";
            return Err(misused("graph", problem.to_owned()));
        }
        let mut analysis = Analysis {
            windows: vec![self.window],
            nside_out: self.nside_out,
            max_masked: self.max_masked,
            min_contour: self.contour.min_contour,
            weight: self.weight.weight(),
            ..self.body.analysis()
        };
        if self.body.thresholds.is_none() {
            analysis.thresholds = THRESHOLDS.parse()?;
        }
        Ok(Plan { quantities, measures, analysis, region: self.region, gaussian: self.gaussian })
    }

    /// The files to write, once it is clear that they can be.
    fn outputs(&self) -> anyhow::Result<Outputs> {
        let output = &self.output;
        let form = Form::of(output);
        let is_table = output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
        ensure!(
            form.is_some() || is_table,
            "{}: the name does not say in which format to write; end it in .png or .svg for a picture, in .csv for the \
             numbers alone",
            shown(output)
        );
        let (picture, table) = match form {
            Some(form) => (Some((output.clone(), form)), output.with_extension("csv")),
            None => (None, output.clone()),
        };
        for path in picture.iter().map(|(path, _)| path).chain([&table]) {
            let inputs = self.inputs.iter().chain(&self.ensemble).chain(&self.input.mask);
            check_apart(path, inputs.map(PathBuf::as_path))?;
            formats::check_writable(path, self.overwrite)?;
        }
        Ok(Outputs { picture, table })
    }

    /// How many maps there are in files, once it is clear that all can be opened and go together.
    fn maps_in(&self, paths: &[PathBuf], mask: Option<&Mask>, together: &mut Together) -> anyhow::Result<usize> {
        let mut maps = 0;
        for path in paths {
            let series = self.input.open(path)?;
            let about = series.about();
            mask.map_or(Ok(()), |mask| mask.check(&about)).map_err(|problem| of(path, problem))?;
            together.add(path, &about)?;
            maps += series.steps();
        }
        Ok(maps)
    }

    /// The curves of one map; nothing, with a warning, of one among several steps that has nothing to measure.
    fn one(
        &self,
        plan: &Plan,
        path: &Path,
        map: &Map,
        steps: usize,
        told: impl FnMut(f64),
    ) -> anyhow::Result<Option<Curves>> {
        let several = self.inputs.len() + self.ensemble.len() > 1 || steps > 1;
        mismatch::warn(&self.running, path, map, &plan.analysis, several);
        let curves = match plan.curves(path, map, told) {
            Err(error) if steps > 1 && nothing_to_measure(&error) => {
                let when = map.time.as_ref().map(|time| time.label.as_str()).unwrap_or_default();
                self.running.warn(format_args!("{}: at {when}: {error}", shown(path)));
                None
            }
            curves => Some(curves.with_context(|| shown(path))?),
        };
        Ok(curves)
    }

    /// Says what was done.
    fn report(&self, plan: &Plan, data: &[Curves], outputs: &Outputs, start: Instant) -> anyhow::Result<()> {
        for curves in data {
            if let Some(Gaussian { mean, sigma0, sigma1 }) = curves.gaussian {
                self.running.say(format_args!(
                    "{}: mean {mean}, sigma0 {sigma0} of the pixels, sigma1 {sigma1} per radian from finite differences \
                     between them",
                    curves.label()
                ))?;
            }
        }
        let names: Vec<&str> = plan.quantities.iter().map(|quantity| quantity.name.as_str()).collect();
        let files = outputs.picture.iter().map(|(path, _)| path).chain([&outputs.table]);
        let files: Vec<String> = files.map(|path| shown(path)).collect();
        let thresholds = plan.analysis.thresholds.values().len();
        let seconds = start.elapsed().as_secs_f64();
        let what = format!("{} at {thresholds} thresholds", names.join(", "));
        self.running.say(format_args!("{}: {what} ({seconds:.2} s)", files.join(", ")))
    }
}

/// Whether a map is such that other steps of its file may have something to measure.
fn nothing_to_measure(error: &anyhow::Error) -> bool {
    let of_analysis = error.downcast_ref::<AnalysisError>();
    matches!(of_analysis, Some(AnalysisError::AllMasked | AnalysisError::Constant { .. })) || error.is::<Nothing>()
}

/// Why a map has no curves.
#[derive(Debug, thiserror::Error)]
enum Nothing {
    #[error("all that lies in the region is masked; choose another one")]
    Masked,
    #[error("no window's centre lies in the region; enlarge it, or choose a larger --nside-out")]
    NoWindow,
    #[error("no pixel's centre lies in the region; enlarge it")]
    NoPixel,
    #[error("the map has no scatter, or no two neighbouring pixels to find sigma1 from, for --gaussian")]
    NoGaussian,
}

impl Plan {
    /// The curves of a map: one march for all densities, and one for all windows.
    fn curves(&self, path: &Path, map: &Map, told: impl FnMut(f64)) -> anyhow::Result<Curves> {
        let analysis = &self.analysis;
        let grid = analysis.check(map.grid())?;
        let (thresholds, of_map) = analysis.thresholds_of(map)?;
        let thresholds = thresholds.values().to_vec();
        let densities = self.quantities.iter().any(|quantity| matches!(quantity.kind, Kind::Density(_)));
        let mut centres = Vec::new();
        if !self.measures.is_empty() {
            check_memory(grid, thresholds.len() * self.measures.len())?;
            centres = match &self.region {
                Some(region) => region.pixels(grid),
                None => vec![true; grid.pixels()],
            };
            ensure!(centres.contains(&true), Nothing::NoWindow);
        }
        let gaussian = match self.gaussian {
            true => Some(Gaussian::of(map).ok_or(Nothing::NoGaussian)?),
            false => None,
        };
        let expected: Vec<Totals> = match &gaussian {
            Some(gaussian) => thresholds.iter().map(|t| gaussian.per_area(*t, analysis.body)).collect(),
            None => Vec::new(),
        };
        let (mut area, mut per_area) = (None, Vec::new());
        if densities {
            let (_, regional) = analysis.totals_within(map, self.region.as_ref())?;
            ensure!(regional.unmasked + regional.masked > 0.0, Nothing::NoPixel);
            ensure!(regional.unmasked > 0.0, Nothing::Masked);
            per_area = regional.made_up().iter().map(|totals| totals.per_area(regional.unmasked)).collect();
            area = Some(regional.unmasked);
        }
        let maps = match self.measures.is_empty() {
            true => Vec::new(),
            false => analysis.sequence(map, &self.measures, told)?,
        };
        let values = |quantity: &Quantity| -> Vec<Value> {
            let of = |t: usize| match &quantity.kind {
                Kind::Density(density) => {
                    let gaussian = expected.get(t).map(density.of);
                    Value { value: (density.of)(&per_area[t]), windows: None, gaussian }
                }
                Kind::Mean(measure) => {
                    let (value, windows) = maps[t].mean(*measure, &centres);
                    Value { value, windows: Some(windows), gaussian: None }
                }
            };
            (0..thresholds.len()).map(of).collect()
        };
        Ok(Curves {
            path: path.to_owned(),
            time: map.time.as_ref().map(|time| time.label.clone()),
            unit: map.unit.clone(),
            of_map,
            area,
            values: self.quantities.iter().map(values).collect(),
            thresholds,
            gaussian,
        })
    }

    /// Whether thresholds are counted in standard deviations.
    fn in_sigma(&self) -> bool {
        self.analysis.threshold_unit == ThresholdUnit::Sigma
    }

    /// The unit of a quantity.
    fn unit(&self, quantity: &Quantity) -> &str {
        match &quantity.kind {
            Kind::Density(density) => density.unit,
            Kind::Mean(measure) => self.measures[*measure].unit(),
        }
    }

    fn body(&self) -> &'static str {
        match self.analysis.body {
            Body::Above => "above",
            Body::Below => "below",
        }
    }
}

impl Curves {
    /// A threshold in standard deviations from the mean, as it was given if so; nothing where there is no scatter.
    fn in_sigma(&self, plan: &Plan, threshold: usize) -> Option<f64> {
        let Statistics { mean, sigma, .. } = self.of_map;
        if plan.in_sigma() {
            return Some(plan.analysis.thresholds.values()[threshold]);
        }
        Some(self.thresholds[threshold] / sigma - mean / sigma).filter(|nu| nu.is_finite())
    }

    /// The map, in few words.
    fn label(&self) -> String {
        let file = shown(Path::new(self.path.file_name().unwrap_or(self.path.as_os_str())));
        match &self.time {
            Some(time) => format!("{file} {time}"),
            None => file,
        }
    }
}

/// The files to write.
struct Outputs {
    picture: Option<(PathBuf, Form)>,
    table: PathBuf,
}

impl Outputs {
    fn save(&self, table: &[u8], picture: Option<&[u8]>, overwrite: bool) -> anyhow::Result<()> {
        save(&self.table, overwrite, table)?;
        if let (Some((path, _)), Some(picture)) = (&self.picture, picture) {
            save(path, overwrite, picture)?;
        }
        Ok(())
    }
}
