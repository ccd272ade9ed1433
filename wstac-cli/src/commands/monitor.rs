//! `wstac monitor` prints a board's events.

use std::ffi::OsString;

use super::output::Stop;
use super::values::at_least;

/// Print the tactile events that a board finds
///
/// It is another name of wstac run BOARD, which stays for one release. A board with the firmware of WSTac sends its
/// events over a serial line. Standard error reports what the board is and what was lost. Ctrl-C ends the command.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
#[expect(clippy::struct_excessive_bools, reason = "each is an argument of its own")]
pub(super) struct Arguments {
    /// Serial device, tcp:HOST:PORT, - or a file
    ///
    /// A serial device is a path such as /dev/ttyACM0. - is standard input. A file has bytes that a board sent.
    port: OsString,

    /// Print JSON Lines instead of text
    #[arg(long)]
    json: bool,

    /// Also request and print the ten features of every frame
    #[arg(long)]
    features: bool,

    /// Also request and print the sample of every event (with --json)
    ///
    /// A sample has 10 × 70 numbers.
    #[arg(long, requires = "json")]
    samples: bool,

    /// Also request and print speed and direction of every frame while something slides
    ///
    /// A board sends them if its firmware was built with the feature motion.
    #[arg(long)]
    motion: bool,

    /// Also report the state of the board about once per second
    ///
    /// Standard error says how long the board runs, its frame rate, overruns, restarts, stack and temperature, as far
    /// as the board knows them.
    #[arg(long)]
    status: bool,

    /// Bits per second of a serial device; 115200 by default
    #[arg(long, value_name = "N", value_parser = at_least(1_u32))]
    baud: Option<u32>,
}

const HELP: &str = "\
Output:
  Records are those of wstac run (see wstac help json). Exit code: 1 if the
  port cannot be used or carries no message, 2 for wrong arguments,
  otherwise 0.

To record what a board sends:
  stty -F /dev/ttyACM0 raw 115200; cat /dev/ttyACM0 > board.bin
  wstac run board.bin
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let Arguments { json, features, samples, motion, status, baud, .. } = *arguments;
    let mut source = OsString::from("board:");
    source.push(&arguments.port);
    let mut run = super::run::Arguments::default();
    (run.sources, run.json, run.status, run.baud) = (vec![source], json, status, baud);
    (run.features, run.samples, run.motion) = (features, samples, motion);
    super::run::run(&run)
}
