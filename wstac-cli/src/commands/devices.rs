//! `wstac devices` lists the cameras.

use std::io::Write;

use super::output::{Stop, note, print_json, stdout};

/// List cameras with their formats, sizes and frame rates
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Print one JSON array instead of text
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let devices = wstac_linux::devices();
    if arguments.json {
        return print_json(&devices);
    }
    if devices.is_empty() {
        note("no camera found: no /dev/video* node captures video; try wstac demo for a simulated sensor");
    }
    let mut out = stdout();
    Ok(devices.iter().try_for_each(|device| writeln!(out, "{device}"))?)
}
