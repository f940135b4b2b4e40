//! The `understudy` program: parses the command line and calls the command.

mod cli;
mod environment;

use std::process::ExitCode;

fn main() -> ExitCode {
    environment::quiet_libraries();
    cli::run()
}
