//! The `wstac` command.

mod commands;
mod view;

use std::process::ExitCode;

use wstac::open_source as open;

fn main() -> ExitCode {
    commands::main()
}

#[cfg(test)]
mod open_tests;
