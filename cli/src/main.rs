//! The program `longan`.

use std::process::ExitCode;

fn main() -> ExitCode {
    longan_cli::main()
}
