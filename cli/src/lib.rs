//! The command line of longan: one file a command, which reads arguments and files, calls the libraries, writes and
//! prints. All computation is left to the libraries.
//!
//! Exit status: 0 all done; 1 a file could not be read, analysed or written (others of the run may be done); 2 the
//! arguments make no sense. A program stopped by a signal, such as Ctrl-C, ends by that signal and leaves no unfinished
//! file.

mod cards;
mod command_line;
mod compare;
mod demo;
mod graph;
mod identity;
mod info;
mod input;
mod map;
mod map_options;
mod map_writer;
mod measures;
mod minkowski_file;
mod mismatch;
mod misused;
mod options;
mod parallel;
mod picture_format;
mod plot;
mod plugin;
mod progress;
mod provenance;
mod quantity;
mod regrid;
mod regridding;
mod remedies;
mod simulate;
mod totals;

pub use minkowski_file::write_minkowski_maps;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use misused::Misused;

/// Shape on the sphere: Minkowski functionals and tensors of maps and other fields, in moving windows.
///
/// Reads HEALPix in FITS, NetCDF and Zarr, latitude-longitude grids in NetCDF and Zarr, points in CSV, surfaces in PLY.
#[derive(Parser)]
#[command(
    name = "longan",
    version,
    arg_required_else_help = true,
    subcommand_required = true,
    propagate_version = true
)]
#[command(after_help = "\
Examples:
  longan demo                            all of it on simulated data, with a picture
  longan info sky.fits                   what a file holds
  longan map sky.fits -o sky_evq.fits    EVQ in windows of 6 degrees, as in the paper
  longan map sims/*.fits -o maps/        many maps, one output each
  longan compare sky_evq.fits maps/*.fits -o deviation.fits
  longan map era5.nc -o evq.nc --variable z --select level=500
  longan plot sky_evq.fits -o evq.png    a picture of a map, PNG or SVG
  longan totals sky.fits                 area, length and Euler characteristic
  longan graph sky.fits -o graph.png     the same against threshold, drawn
  longan regrid stations.csv -o rainfall.fits --variable rain
  longan plugin new slant                a crate in Rust for a measure of your own

Angles are in degrees, areas in steradian, lengths in radians on the unit sphere.
Exit status: 0 all done; 1 something could not be read, analysed or written; 2 wrong arguments.")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Map(map::Arguments),
    Compare(compare::Arguments),
    Totals(totals::Arguments),
    Graph(graph::Arguments),
    Plot(plot::Arguments),
    Info(info::Arguments),
    Regrid(regrid::Arguments),
    Measures(measures::Arguments),
    Plugin(plugin::Arguments),
    Simulate(simulate::Arguments),
    Demo(demo::Arguments),
}

/// Runs the program with the arguments of this process.
pub fn main() -> ExitCode {
    run(std::env::args_os().collect()).into()
}

/// Runs the program, once in a process, with arguments of which the first is its name. The exit status is returned.
pub fn run(arguments: Vec<OsString>) -> u8 {
    #[cfg(unix)]
    clean_up_when_stopped();
    let mut commands = Arguments::command();
    let parsed = commands.try_get_matches_from_mut(command_line::keep(arguments));
    let (command, name) = match parsed.and_then(|matches| Ok((Arguments::from_arg_matches(&matches)?.command, matches)))
    {
        Ok((command, matches)) => (command, matches.subcommand_name().unwrap_or_default().to_owned()),
        Err(e) => {
            let _ = e.print();
            return u8::try_from(e.exit_code()).unwrap_or(2);
        }
    };
    let done = match command {
        Command::Map(arguments) => map::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Totals(arguments) => totals::run(&arguments),
        Command::Graph(arguments) => graph::run(&arguments),
        Command::Plot(arguments) => plot::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Regrid(arguments) => regrid::run(&arguments),
        Command::Measures(arguments) => measures::run(&arguments),
        Command::Plugin(arguments) => plugin::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
    };
    match done.map_err(|e| e.downcast::<Misused>()) {
        Ok(()) => 0,
        Err(Ok(Misused(problem))) => {
            let command = commands.find_subcommand_mut(&name).expect("the command that ran");
            let _ = command.error(ErrorKind::ValueValidation, problem).print();
            2
        }
        Err(Err(e)) => {
            let _ = writeln!(std::io::stderr(), "longan: {}", remedies::told(&e));
            1
        }
    }
}

/// Removes unfinished files when the program is told to end, and then ends it in the way of that signal.
#[cfg(unix)]
fn clean_up_when_stopped() {
    use signal_hook::consts::TERM_SIGNALS;
    // Without it, as before a file is written, the signals end the program by themselves.
    let Ok(mut signals) = signal_hook::iterator::Signals::new(TERM_SIGNALS) else { return };
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            longan_formats::abandon();
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    });
}
