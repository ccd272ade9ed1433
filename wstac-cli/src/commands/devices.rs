//! `wstac devices` lists the cameras.

use std::io::Write;

use super::output::{Stop, note};
use wstac_host::error::{Error, ErrorKind};

/// List cameras with their formats, sizes and frame rates
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Print one JSON array instead of text
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let devices = wstac_linux::devices();
    let mut out = super::output::stdout();
    if arguments.json {
        let json = serde_json::to_string(&devices)
            .map_err(|error| Error::with_cause(ErrorKind::Io, "standard output", error))?;
        return Ok(writeln!(out, "{json}")?);
    }
    if devices.is_empty() {
        note("no camera found: no /dev/video* node captures video; try wstac demo for a simulated sensor");
    }
    for device in devices {
        writeln!(out, "{device}")?;
    }
    Ok(())
}
