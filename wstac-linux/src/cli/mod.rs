//! The command line: arguments and output only, one file a command.

mod completions;
mod demo;
mod devices;
mod output;
mod run;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::error::Error;
use output::Stop;

/// Tactile events from a WSTac sensor: sliding speed and direction, from a camera, a recording or a simulation.
///
/// WSTac is an elastomer with 5 × 5 whiskers that glow where they bend, and a camera behind them. This program turns
/// the camera's frames into tactile events.
#[derive(Debug, Parser)]
#[command(name = "wstac", version, max_term_width = 100, after_long_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Start here:
  wstac demo                           simulated slides, the truth beside the answers
  wstac run scene:Saw3@150,90deg       one simulated slide
  wstac devices                        which cameras there are
  wstac run /dev/video0                events from a USB camera
  wstac run clip.y4m --json            events of a recording, as JSON Lines
  ffmpeg -i clip.mp4 -f yuv4mpegpipe - | wstac run -
";

#[derive(Debug, Subcommand)]
enum Command {
    Run(run::Arguments),
    Demo(demo::Arguments),
    Devices(devices::Arguments),
    Completions(completions::Arguments),
}

/// Runs the command line of this process. Exit code 2 for wrong arguments, 1 for a source, file or configuration that
/// cannot be used, 0 otherwise.
pub fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Devices(arguments) => devices::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments),
    };
    match result {
        // Whoever read the output has seen enough.
        Ok(()) | Err(Stop::OutputClosed) => ExitCode::SUCCESS,
        Err(Stop::Failed(error)) => fail(&error),
    }
}

fn fail(error: &Error) -> ExitCode {
    // Standard error may be closed; the exit code still tells.
    let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("wstac: {error}\n"));
    ExitCode::FAILURE
}
