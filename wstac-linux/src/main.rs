//! The `wstac` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    wstac_linux::cli::main()
}
