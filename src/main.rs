//! The `understudy` program: parses the command line and calls the command.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
