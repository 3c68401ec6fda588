//! `longan simulate`: maps whose shape is known.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Args, Subcommand, ValueEnum};
use longan::simulate::{Body, Edge, Shape, Waves, scene, shapes};
use longan_formats::{self as formats, Card};
use longan_grid::{Healpix, Map, Ordering};

use super::cards::{creator, integer, real, text};
use super::map_writer::{self, Kind, Layout, MapColumn, Step, Table};
use super::options::{Running, acute, between, check_memory, finite, nside, shown, whole};

/// A map whose shape is known: bodies of simple outline, or a Gaussian random field.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  longan simulate shapes -o shapes.fits
  longan simulate shapes -o cap.fits --shape cap --centre 30,45 --size 6 --edge smooth --nside 256
  longan simulate waves -o field.fits --correlation 3 --seed 7")]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Debug)]
enum What {
    Shapes(ShapesArguments),
    Waves(WavesArguments),
}

/// Where the map goes.
#[derive(Args, Debug)]
struct Output {
    /// File to write, FITS (.fits, .fits.gz) or NetCDF (.nc).
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Nside of the map.
    #[arg(long, value_name = "N", default_value_t = 512, allow_negative_numbers = true, value_parser = nside)]
    nside: usize,
    /// Replace an existing output.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    running: Running,
}

/// Bodies of the paper's outlines: 1 inside and 0 outside, or the distance to the edge.
///
/// Without --shape all of them, 45 degrees apart along the equator from longitude -135: square (4 degrees wide), 2:1
/// and 3:1 rectangle, cross, triangle, parallelogram and cap (all 6 degrees).
#[derive(Args, Debug)]
struct ShapesArguments {
    /// One body of this outline only.
    #[arg(long, value_name = "NAME", value_parser = Shape::ALL.map(Shape::name))]
    shape: Option<String>,
    /// Centre of that body: longitude and latitude in degrees.
    #[arg(long, value_name = "LON,LAT", default_value = "0,0", requires = "shape")]
    #[arg(allow_hyphen_values = true, value_parser = point)]
    centre: (f64, f64),
    /// Its size in degrees: the longer side, or the diameter.
    #[arg(long, value_name = "DEG", default_value_t = 6.0, requires = "shape")]
    #[arg(allow_negative_numbers = true, value_parser = acute)]
    size: f64,
    /// Angle by which it is turned from north towards east, in degrees.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, requires = "shape")]
    #[arg(allow_negative_numbers = true, value_parser = finite)]
    angle: f64,
    /// Binary: 1 or 0 by the pixel's centre, to be contoured at 0.5. Smooth: the distance to the edge in degrees,
    /// positive inside, to be contoured at 0.
    #[arg(long, value_name = "EDGE", default_value = "binary")]
    edge: EdgeOption,
    #[command(flatten)]
    output: Output,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EdgeOption {
    Binary,
    Smooth,
}

/// An isotropic Gaussian random field, the sum of random plane waves in space, taken on the sphere.
///
/// Its mean is 0 and its standard deviation sigma0 is 1. Two points at a chord r correlate as exp(-r^2/(2 l^2)) with
/// l the correlation angle, so sigma1 = sqrt(2)/l is the standard deviation of the gradient.
#[derive(Args, Debug)]
struct WavesArguments {
    /// Correlation angle in degrees.
    #[arg(long, value_name = "DEG", default_value_t = 3.0, allow_negative_numbers = true, value_parser = acute)]
    correlation: f64,
    /// Seed; the same gives the same field.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = whole::<u64>)]
    seed: u64,
    #[command(flatten)]
    output: Output,
}

fn point(text: &str) -> Result<(f64, f64), String> {
    let (lon, lat) = text.split_once(',').ok_or("not of the form LON,LAT")?;
    Ok((between(lon.trim(), -360.0, 360.0)?, between(lat.trim(), -90.0, 90.0)?))
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    match &arguments.what {
        What::Shapes(arguments) => arguments.run(),
        What::Waves(arguments) => arguments.run(),
    }
}

impl ShapesArguments {
    fn run(&self) -> anyhow::Result<()> {
        let edge = match self.edge {
            EdgeOption::Binary => Edge::Binary,
            EdgeOption::Smooth => Edge::Smooth,
        };
        let (bodies, what) = match &self.shape {
            Some(name) => {
                let shape: Shape = name.parse()?;
                let (lon, lat) = self.centre;
                let what = format!("{name} of {} deg at {lon},{lat}, turned by {} deg", self.size, self.angle);
                (vec![Body::new(shape, lon, lat, self.size, self.angle)?], what)
            }
            None => (scene(), "all shapes along the equator".to_owned()),
        };
        let contour = real("CONTOUR", if edge == Edge::Binary { 0.5 } else { 0.0 }, "threshold of the outline");
        self.output.write(|grid| shapes(grid, &bodies, edge), vec![text("SHAPES", what, "bodies"), contour])
    }
}

impl WavesArguments {
    fn run(&self) -> anyhow::Result<()> {
        let waves = Waves::new(self.correlation, self.seed)?;
        let cards = waves_cards(&waves, self.correlation, self.seed);
        self.output.write(|grid| waves.map(grid), cards)?;
        let running = &self.output.running;
        if let Some(warning) = waves.warning(Healpix::new(self.output.nside)?) {
            running.warn(warning);
        }
        running.say(format_args!("sigma0 = {}, sigma1 = {} per radian", waves.sigma0(), waves.sigma1()))
    }
}

/// The header entries of a simulated field.
pub(crate) fn waves_cards(waves: &Waves, correlation: f64, seed: u64) -> Vec<Card> {
    vec![
        real("CORRANG", correlation, "[deg] correlation angle"),
        integer("SEED", seed as usize, "seed"),
        real("SIGMA0", waves.sigma0(), "standard deviation of the field"),
        real("SIGMA1", waves.sigma1(), "[1/rad] standard deviation of its gradient"),
    ]
}

/// The step of a file that holds a map.
pub(crate) fn step(map: &Map, mut cards: Vec<Card>) -> Step {
    cards.insert(0, creator());
    let column = MapColumn {
        name: map.name.to_uppercase(),
        unit: map.unit.clone().unwrap_or_default(),
        long_name: String::new(),
        quantity: None,
        values: map.values().to_vec(),
    };
    let attributes = cards.clone();
    let table = Table { name: "SIMULATION".to_owned(), cards, columns: vec![column] };
    Step { time: None, tables: vec![table], attributes, numbers: Vec::new() }
}

/// Writes one step in RING order.
pub(crate) fn write(path: &Path, grid: Healpix, overwrite: bool, step: Step) -> anyhow::Result<()> {
    let layout = Layout { grid, ordering: Ordering::Ring, coordinates: None, float32: false, steps: 1 };
    map_writer::write(path, Kind::of(path)?, layout, overwrite, [Ok(step)])
}

impl Output {
    fn write(&self, make: impl FnOnce(Healpix) -> Map, cards: Vec<Card>) -> anyhow::Result<()> {
        self.running.start()?;
        Kind::of(&self.output)?;
        formats::check_writable(&self.output, self.overwrite)?;
        let grid = Healpix::new(self.nside)?;
        check_memory(grid, 2).with_context(|| shown(&self.output))?;
        let map = make(grid);
        write(&self.output, grid, self.overwrite, step(&map, cards))?;
        self.running.say(format_args!("{}: {} at Nside {}", shown(&self.output), map.name, self.nside))
    }
}
