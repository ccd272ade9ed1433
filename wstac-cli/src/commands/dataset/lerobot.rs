//! `wstac dataset --lerobot` runs the Python package, which writes the set.
//!
//! Parquet in Rust would be eight crates more, and who trains policies has Python with pyarrow.

use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::Arguments;
use crate::commands::output::Stop;
use wstac_host::error::{Error, ErrorKind};

/// What only a set of episodes has.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options of --lerobot")]
pub(super) struct Options {
    /// Join the arm's state and action, as this file says
    #[arg(long, value_name = "ARM.toml", requires = "lerobot", conflicts_with = "output")]
    arm: Option<PathBuf>,

    /// Task of recordings without the label task
    #[arg(long, value_name = "TEXT", requires = "lerobot", conflicts_with = "output")]
    task: Option<OsString>,

    /// Scale the pictures
    #[arg(long, value_name = "WxH", requires = "lerobot", conflicts_with = "output")]
    size: Option<OsString>,

    /// Sensor of recordings of several
    #[arg(long, value_name = "NAME", requires = "lerobot", conflicts_with = "output")]
    sensor: Option<OsString>,
}

/// Becomes the program of the package.
pub(super) fn run(arguments: &Arguments, folder: &Path) -> Result<(), Stop> {
    if arguments.sources.is_empty() {
        let message = "has no recordings, expected at least one recording, folder or scene";
        return Err(Error::new(ErrorKind::Usage, "--lerobot", message).into());
    }
    let python = std::env::var_os("WSTAC_PYTHON").unwrap_or_else(|| "python3".into());
    // A file wstac.py in the folder where this runs is not the package (from Python 3.11).
    let start = || {
        let mut command = Command::new(&python);
        command.env("PYTHONSAFEPATH", "1");
        command
    };
    let tried = start().args(["-c", "import wstac.lerobot"]).output();
    let name = python.display();
    let why = match &tried {
        Ok(tried) if tried.status.success() => None,
        Ok(tried) => {
            let said = String::from_utf8_lossy(&tried.stderr);
            let error = said.lines().rev().find(|line| line.contains("Error: "));
            Some(error.or(said.lines().last()).unwrap_or("failed").to_owned())
        }
        Err(error) => Some(error.to_string()),
    };
    if let Some(why) = why {
        let message = format_args!(
            "{why}; help: install the wheel with [lerobot] (docs/SETS.md), or name its Python by WSTAC_PYTHON"
        );
        return Err(Error::new(ErrorKind::Usage, name, message).into());
    }
    let options = &arguments.of_episodes;
    let paths = [("--arm", &options.arm), ("--config", &arguments.config)];
    let texts = [("--task", &options.task), ("--size", &options.size), ("--sensor", &options.sensor)];
    let paths = paths.into_iter().filter_map(|(name, path)| Some((name, path.as_ref()?.as_os_str())));
    let texts = texts.into_iter().filter_map(|(name, text)| Some((name, text.as_deref()?)));
    let mut command = start();
    command.args(["-m", "wstac.lerobot"]);
    for (name, value) in paths.chain(texts) {
        // One word, so that a value may begin with a hyphen.
        let mut option = OsString::from(name);
        option.push("=");
        option.push(value);
        command.arg(option);
    }
    let error = command.arg("--").arg(folder).args(&arguments.sources).exec();
    Err(Error::new(ErrorKind::Io, name, error).into())
}
