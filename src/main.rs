//! The command line of longan. It reads arguments and files, calls the library, writes and prints; what it computes
//! stands in the library.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
