//! `longan graph`: measures against threshold, as a table and as a picture.

mod picture;
mod table;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, ensure};
use clap::Args;
use longan::gaussian::Gaussian;
use longan::graph::{Curves, Density, Graph, GraphError, Ordinate, standard_thresholds};
use longan::measures::split;
use longan::region::RegionError;
use longan::{Analysis, Map, Region, ThresholdUnit};
use longan_formats as formats;
use longan_picture::axes::PALETTE;

use super::input::{Input, Mask};
use super::map_options::{find, no_measure};
use super::mismatch::Together;
use super::misused::misused;
use super::options::{
    BodyOptions, ContourOption, Running, WeightOption, between, check_apart, check_memory, nside, shown,
};
use super::picture_format::{Form, save};
use super::plugin::Plugins;
use super::progress::Progress;
use super::{mismatch, regridding};

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

/// Simulations without which the ends of the band of 95 % are but the extremes.
const FEWEST: usize = 40;

fn region(text: &str) -> Result<Region, RegionError> {
    text.parse()
}

/// The curves of one map, and its description.
struct MapCurves {
    /// The file of the map.
    path: PathBuf,
    /// The time of the map, where it has one.
    time: Option<String>,
    /// The unit of the map.
    unit: Option<String>,
    curves: Curves,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let start = Instant::now();
    arguments.running.start()?;
    let graph = arguments.graph()?;
    let outputs = arguments.outputs()?;
    let mask = arguments.input.mask(&arguments.running)?;
    let mut together = Together::new(!arguments.input.ignore_coordsys, !in_sigma(&graph));
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
    let told = regridding::Notices::default();
    let mut done = 0;
    let mut all_of =
        |files: &[PathBuf], keep: &mut dyn FnMut(MapCurves) -> Result<(), GraphError>| -> anyhow::Result<()> {
            for path in files {
                let mut series = arguments.input.open(path)?;
                for step in 0..series.steps() {
                    let share = |share: f64| progress.set((done as f64 + share) / all as f64);
                    let map = series.read(step, mask.as_ref())?;
                    if step == 0 {
                        told.say(&arguments.running, path, &map);
                    }
                    if let Some(curves) = arguments.one(&graph, path, &map, series.steps(), share)? {
                        keep(curves)?;
                    }
                    done += 1;
                    progress.set(done as f64 / all as f64);
                }
            }
            Ok(())
        };
    let mut data = Vec::new();
    all_of(&arguments.inputs, &mut |curves| {
        data.push(curves);
        Ok(())
    })?;
    let mut ensemble = (simulations > 0).then(|| graph.ensemble());
    all_of(&arguments.ensemble, &mut |map| ensemble.iter_mut().try_for_each(|ensemble| ensemble.add(&map.curves)))?;
    drop(progress);
    ensure!(!data.is_empty(), "{}: every map is masked or constant", shown(&arguments.inputs[0]));

    let table = table::csv(&graph, &data, ensemble.as_ref())?;
    let picture = match &outputs.picture {
        Some((_, form)) => Some(form.bytes(&picture::draw(&graph, &data, ensemble.as_ref())?)?),
        None => None,
    };
    outputs.save(&table, picture.as_deref(), arguments.overwrite)?;
    arguments.report(&graph, &data, &outputs, start)
}

impl Arguments {
    /// The graph that the arguments ask for.
    fn graph(&self) -> anyhow::Result<Graph> {
        let catalogue = self.plugins.catalogue()?;
        let mut texts: Vec<&str> = self.measure.iter().flat_map(|list| split(list)).collect();
        if texts.is_empty() {
            texts.extend(Density::ALL.map(Density::name));
        }
        let mut graph = Graph::default();
        (graph.region, graph.gaussian) = (self.region, self.gaussian);
        for text in texts {
            let ordinate = match Density::named(text) {
                Some(density) => Ordinate::Density(density),
                None => Ordinate::Mean(find(&catalogue, text)?),
            };
            graph.add(ordinate).map_err(|problem| no_measure(text, problem))?;
        }
        if self.gaussian && graph.ordinates().iter().all(|ordinate| ordinate.measure().is_some()) {
            let problem = "--gaussian is about w0, w1, w2 and euler, and none of these is asked for";
            return Err(misused(problem.to_owned()));
        }
        graph.analysis = Analysis {
            windows: vec![self.window],
            nside_out: self.nside_out,
            max_masked: self.max_masked,
            min_contour: self.contour.min_contour,
            weight: self.weight.weight(),
            by_threshold: true,
            ..self.body.analysis()
        };
        if self.body.thresholds.is_none() {
            graph.analysis.thresholds = standard_thresholds();
        }
        Ok(graph)
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
            mask.map_or(Ok(()), |mask| mask.check(path, &about))?;
            together.add(path, &about)?;
            maps += series.steps();
        }
        Ok(maps)
    }

    /// The curves of one map; nothing, with a warning, of one among several steps that has nothing to measure.
    fn one(
        &self,
        graph: &Graph,
        path: &Path,
        map: &Map,
        steps: usize,
        mut told: impl FnMut(f64),
    ) -> anyhow::Result<Option<MapCurves>> {
        let several = self.inputs.len() + self.ensemble.len() > 1 || steps > 1;
        mismatch::warn(&self.running, path, map, &graph.analysis, several);
        let time = map.time.as_ref().map(|time| time.label.clone());
        let mut curves = || {
            let grid = graph.check(map.grid())?;
            let means = graph.ordinates().iter().filter(|ordinate| ordinate.measure().is_some()).count();
            check_memory(grid, graph.analysis.thresholds.values().len() * means)?;
            let told = |share| {
                told(share);
                ControlFlow::Continue(())
            };
            Ok(graph.curves(map, told)?)
        };
        match curves() {
            Err(error) if steps > 1 && has_nothing(&error) => {
                self.running.warn(format_args!("{}: at {}: {error}", shown(path), time.unwrap_or_default()));
                Ok(None)
            }
            curves => {
                let curves = curves.with_context(|| shown(path))?;
                Ok(Some(MapCurves { path: path.to_owned(), time, unit: map.unit.clone(), curves }))
            }
        }
    }

    /// Says what was done.
    fn report(&self, graph: &Graph, data: &[MapCurves], outputs: &Outputs, start: Instant) -> anyhow::Result<()> {
        for map in data {
            if let Some(Gaussian { mean, sigma0, sigma1 }) = map.curves.gaussian {
                self.running.say(format_args!(
                    "{}: mean {mean}, sigma0 {sigma0} of the pixels, sigma1 {sigma1} per radian from finite differences \
                     between them",
                    map.label()
                ))?;
            }
        }
        let names: Vec<String> = graph.ordinates().iter().map(Ordinate::name).collect();
        let files = outputs.picture.iter().map(|(path, _)| path).chain([&outputs.table]);
        let files: Vec<String> = files.map(|path| shown(path)).collect();
        let thresholds = graph.analysis.thresholds.values().len();
        let seconds = start.elapsed().as_secs_f64();
        let what = format!("{} at {thresholds} thresholds", names.join(", "));
        self.running.say(format_args!("{}: {what} ({seconds:.2} s)", files.join(", ")))
    }
}

/// Whether a map has nothing to measure, while other steps of its file may have.
fn has_nothing(error: &anyhow::Error) -> bool {
    error.downcast_ref().is_some_and(GraphError::is_of_map)
}

/// Whether thresholds are counted in standard deviations.
fn in_sigma(graph: &Graph) -> bool {
    graph.analysis.threshold_unit == ThresholdUnit::Sigma
}

impl MapCurves {
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
