//! `longan demo`: the main job on simulated data, with numbers that a reader can check.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use longan::gaussian::Gaussian;
use longan::measures::{BuiltIn, find};
use longan::simulate::{Edge, Waves, scene, shapes};
use longan::{Analysis, Body, Healpix, Map, MinkowskiMaps, ThresholdUnit, go_on};
use longan_formats as formats;
use longan_picture::{Options, Panel, panels};

use super::identity::Identity;
use super::map_writer::Step;
use super::options::{Running, shown};
use super::picture_format::save;
use super::provenance::Provenance;
use super::simulate::{self, step, waves_cards};

/// Simulates maps, measures them, prints numbers that you can check, and writes maps and a picture.
#[derive(Args, Debug)]
pub(crate) struct Arguments {
    /// Folder to write to.
    #[arg(value_name = "FOLDER", default_value = "longan-demo")]
    folder: PathBuf,
    /// Replace existing files.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    running: Running,
}

/// Nside of the bodies' map, and of the field's.
const NSIDE: [usize; 2] = [512, 256];
/// Nside of their Minkowski maps.
const NSIDE_OUT: usize = 64;
/// Correlation angle of the field in degrees, and its seed.
const FIELD: (f64, u64) = (2.0, 1);

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let folder = &arguments.folder;
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot make this folder", shown(folder)))?;
    let path = |name: &str| folder.join(name);
    for name in ["shapes.fits", "shapes_evq.fits", "waves.fits", "waves_evq.fits", "waves_evq.png"] {
        formats::check_writable(&path(name), arguments.overwrite)?;
    }
    let write = |name: &str, grid: Healpix, step: Step| simulate::write(&path(name), grid, arguments.overwrite, step);
    let say = |line: String| arguments.running.say(line);
    let evq = [find("evq")?];

    let bodies = shapes(Healpix::new(NSIDE[0])?, &scene(), Edge::Binary);
    write("shapes.fits", bodies.grid(), step(&bodies, Vec::new()))?;
    let analysis = Analysis {
        thresholds: "0.5".parse()?,
        threshold_unit: ThresholdUnit::Value,
        nside_out: Some(NSIDE_OUT),
        ..Analysis::default()
    };
    let maps = analysis.minkowski_maps(&bodies, &evq, go_on)?;
    say(format!("Bodies of 4 to 6 degrees at Nside {}, EVQ in a window of 6 degrees about their middle:", NSIDE[0]))?;
    for (name, longitude, sides) in [("square", -135.0, 1), ("2:1 rectangle", -90.0, 2), ("3:1 rectangle", -45.0, 3)] {
        let pixel = maps.grid.pixel_at(std::f64::consts::FRAC_PI_2, f64::to_radians(longitude));
        say(format!("  {name:<14} {:.3}   (ratio of its sides: {sides})", maps["evq"][pixel]))?;
    }
    let (_, totals, _) = analysis.totals(&bodies)?;
    say(format!("  Euler characteristic {:.6}   (seven bodies, no holes)", totals[0].euler_characteristic()))?;
    write("shapes_evq.fits", maps.grid, minkowski(&maps, &bodies, "shapes.fits", &analysis, &evq)?)?;

    let (correlation, seed) = FIELD;
    let waves = Waves::new(correlation, seed)?;
    let field = waves.map(Healpix::new(NSIDE[1])?);
    write("waves.fits", field.grid(), step(&field, waves_cards(&waves, correlation, seed)))?;
    let analysis = Analysis { nside_out: Some(NSIDE_OUT), ..Analysis::default() };
    let start = Instant::now();
    let maps = analysis.minkowski_maps(&field, &evq, go_on)?;
    let seconds = start.elapsed().as_secs_f64();
    let (thresholds, totals, _) = analysis.totals(&field)?;
    say(format!("\nGaussian field of correlation angle {correlation} degrees at Nside {}:", NSIDE[1]))?;
    say("  threshold   length [rad]   expected   Euler characteristic".to_owned())?;
    // The mean of the ensemble.
    let gaussian = Gaussian { mean: 0.0, sigma0: waves.sigma0(), sigma1: waves.sigma1() };
    for (threshold, t) in thresholds.values().iter().zip(&totals).step_by(2) {
        let expected = 4.0 * std::f64::consts::PI * gaussian.per_area(*threshold, Body::Above).length;
        let euler = t.euler_characteristic();
        say(format!("  {threshold:>9.4} {:>14.4} {expected:>10.4} {euler:>18.6}", t.length))?;
    }
    say(format!("  Minkowski map of Nside {NSIDE_OUT}: {seconds:.2} s"))?;

    write("waves_evq.fits", maps.grid, minkowski(&maps, &field, "waves.fits", &analysis, &evq)?)?;
    let top = Options {
        title: "Gaussian field".to_owned(),
        label: "value in σ".to_owned(),
        width: 1000,
        ..Options::default()
    };
    let bottom = Options {
        title: "Its Minkowski map: EVQ in windows of 6°".to_owned(),
        label: "eigenvalue quotient".to_owned(),
        width: 1000,
        ..Options::default()
    };
    let both = [Panel { values: field.values(), options: top }, Panel { values: &maps["evq"], options: bottom }];
    let png = panels(&both, 1)?.png()?;
    save(&path("waves_evq.png"), arguments.overwrite, &png)?;
    say(format!("\nMaps and the picture waves_evq.png are in {}", shown(folder)))
}

/// The step of a file with Minkowski maps.
fn minkowski(
    maps: &MinkowskiMaps,
    map: &Map,
    name: &str,
    analysis: &Analysis,
    measures: &[BuiltIn],
) -> anyhow::Result<Step> {
    let identity = &Identity { recipe: analysis.recipe(map.grid(), measures)?, inputs: Vec::new() };
    let command = "longan demo".to_owned();
    Ok(Provenance { path: name.as_ref(), map, input: None, analysis, identity, command }.step(maps, measures))
}
