//! The `wstac` command.

mod commands;
mod view;

use std::ffi::OsStr;
use std::process::ExitCode;

use wstac_host::error::Error;
use wstac_host::source::Source;
use wstac_host::source::open::{OpenOptions, SourceKind};

/// The kinds of sources that this program has besides files.
const SOURCE_KINDS: &[&dyn SourceKind] = &[&wstac_linux::source::Cameras, &wstac_scene::source::Scenes];

fn open(name: impl AsRef<OsStr>, options: &OpenOptions) -> Result<Box<dyn Source>, Error> {
    wstac_host::source::open::open(name, options, SOURCE_KINDS)
}

fn main() -> ExitCode {
    commands::main()
}

#[cfg(test)]
mod open_tests;
