//! Commands, one file each, and how they end.
//!
//! Exit status: 0 all done; 1 a file could not be read, analysed or written (others of the run may be done); 2 the
//! arguments make no sense.

mod demo;
mod info;
mod map;
mod measures;
mod options;
mod output;
mod progress;
mod simulate;
mod totals;

use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Shape on the sphere: Minkowski functionals and tensors of HEALPix maps, in moving windows.
#[derive(Parser)]
#[command(version, arg_required_else_help = true, subcommand_required = true, propagate_version = true)]
#[command(after_help = "\
Examples:
  longan map sky.fits -o sky_evq.fits                     the paper's analysis: EVQ in windows of 6 degrees
  longan map sky.fits -o out.fits --measure evq,psi2,psi2-direction --window 10 --nside-out 32
  longan map sims/*.fits -o maps/ --resume                many maps, one output each
  longan totals sky.fits --thresholds -2:2:9 --threshold-unit sigma
  longan demo                                             everything on simulated data, with a picture

Angles are in degrees, areas in steradian, lengths in radians on the unit sphere.
Exit status: 0 all done; 1 something could not be read, analysed or written; 2 wrong arguments.")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Map(map::Arguments),
    Totals(totals::Arguments),
    Info(info::Arguments),
    Measures(measures::Arguments),
    Simulate(simulate::Arguments),
    Demo(demo::Arguments),
}

/// Runs the program.
pub(crate) fn main() -> ExitCode {
    // A reader that closes the pipe early, such as `head`, is no error.
    let done = match Arguments::parse().command {
        Command::Map(arguments) => map::run(&arguments),
        Command::Totals(arguments) => totals::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Measures(arguments) => measures::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) if e.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe) => {
            ExitCode::SUCCESS
        }
        Err(e) => {
            let _ = writeln!(std::io::stderr(), "longan: {e:#}");
            ExitCode::FAILURE
        }
    }
}
