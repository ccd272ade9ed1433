//! The command line: arguments and output only, one file per command.

mod arenas;
mod board;
mod calibrate;
mod characterize;
mod completions;
mod csv;
mod dataset;
mod demo;
mod devices;
mod doctor;
mod files;
mod man;
mod model;
mod monitor;
mod output;
mod plot;
mod progress;
mod record;
mod records;
mod recover;
pub(crate) mod removed;
mod run;
mod scene;
#[cfg(feature = "serve")]
mod serve;
pub(crate) mod signals;
mod source_arguments;
mod topics;
mod trade;
mod train;
mod units;
mod values;
mod view;

use std::ffi::OsString;
use std::fmt::Display;
use std::io::Write;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};

use output::{Stop, note};
use wstac_host::error::Error;
use wstac_host::suggest::nearest;
use wstac_host::visible::{self, OneLine};

/// Print tactile events of a WSTac sensor: sliding speed, direction and texture
///
/// WSTac is an elastomer with 5 × 5 whiskers that glow where they bend, and a camera behind them. This program turns
/// the camera's frames into tactile events. Its sources are a camera, a recording or a simulated sensor.
#[derive(Debug, Parser)]
#[command(name = "wstac", version, max_term_width = 80, after_long_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Start here:
  wstac demo
      compare simulated slides with the answers to them
  wstac run scene:Saw3@150,90deg
      print the event of one simulated slide
  wstac view scene:Saw3@150
      watch it: picture, taxels, traces and events in the terminal
  wstac devices
      list the cameras
  wstac doctor /dev/video0
      measure a camera and print what to change
  wstac calibrate /dev/video0 -o wstac.toml
      find the whiskers in the picture and write a configuration
  wstac characterize /dev/video0 -o my-sensor
      measure a sensor that you built, beside the truth of its slides
  wstac run /dev/video0 --config wstac.toml
      print the events of a USB camera
  wstac run /dev/video0 --model builtin
      name textures, too

Texture models of your own:
  wstac train -o my.wsm
      train on simulated slides of many sensors, and test on others
  wstac train recordings/ -o my.wsm
      train on your own recordings
  wstac model learn builtin:embedding slides/ -o my.wsm
      make a model of new textures from five slides of each
  wstac dataset -o set.npz
      make a data set for other trainers; --help lists the keys
  wstac dataset --lerobot set recordings/
      make a data set of LeRobot, for policies of robots
  wstac model import forest.onnx -o forest.wsm
      turn a trained model into a file; wstac model --help trains one

Recordings and other sources:
  wstac record /dev/video0 -o a.mcap --label specimen=Saw3
      write frames and events to a file
  wstac run clip.y4m --json
      print the events of a recording as JSON Lines
  wstac run clip.mp4
      read a video, with ffmpeg
  wstac run /dev/ttyACM0
      print the events that a board finds
  wstac board /dev/ttyACM0 --set wstac.toml
      set the layout and the trigger of a board

Figures and budgets:
  wstac plot clip.y4m -o event.svg
      draw one event as a figure for a paper
  wstac trade --budget 'M4F<60000,flash<64K,format=GREY'
      choose the most accurate configuration that a board can afford

References:
  wstac help sources
      describe every source, faults of cameras, and recovery
  wstac help answers
      say what each answer means
  wstac help config
      list every key of the configuration file with its default
  wstac help json
      list every field of the JSON lines; records in files and tables
  wstac help scene
      list every key of a scene with its default

Exit codes (docs/EXIT.md has those of single commands):
  0      done. Ctrl-C is a proper end of run, record, monitor and serve,
         and so is a reader that closes the output.
  1      a source, file, device or configuration cannot be used, has
         failed, or does not hold what the command needs
  2      wrong arguments
  128+N  signal N ended the command before it was done: 130 after
         Ctrl-C, 143 after SIGTERM, 129 after SIGHUP
";

#[derive(Debug, Subcommand)]
enum Command {
    Run(run::Arguments),
    Record(record::Arguments),
    Recover(recover::Arguments),
    Demo(demo::Arguments),
    Scene(scene::Arguments),
    Devices(devices::Arguments),
    Doctor(doctor::Arguments),
    Calibrate(calibrate::Arguments),
    Characterize(characterize::Arguments),
    Dataset(dataset::Arguments),
    Train(train::Arguments),
    Model(model::Arguments),
    Monitor(monitor::Arguments),
    Board(board::Arguments),
    View(view::Arguments),
    #[cfg(feature = "serve")]
    Serve(serve::Arguments),
    Plot(plot::Arguments),
    Trade(trade::Arguments),
    Completions(completions::Arguments),
    Man(man::Arguments),
    #[command(flatten)]
    Topic(topics::Topic),
}

/// Runs the command line of this process. docs/EXIT.md lists the exit codes.
pub(crate) fn main() -> ExitCode {
    arenas::limit();
    if let Err(error) = signals::install() {
        return fail(&Error::io("signals", error));
    }
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return refuse(&error),
    };
    let result = match arguments.command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Record(arguments) => record::run(&arguments),
        Command::Recover(arguments) => recover::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Scene(arguments) => scene::run(&arguments),
        Command::Devices(arguments) => devices::run(&arguments),
        Command::Doctor(arguments) => doctor::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Characterize(arguments) => characterize::run(&arguments),
        Command::Dataset(arguments) => dataset::run(&arguments),
        Command::Train(arguments) => train::run(&arguments),
        Command::Model(arguments) => model::run(&arguments),
        Command::Monitor(arguments) => monitor::run(&arguments),
        Command::Board(arguments) => board::run(&arguments),
        Command::View(arguments) => view::run(&arguments),
        #[cfg(feature = "serve")]
        Command::Serve(arguments) => serve::run(&arguments),
        Command::Plot(arguments) => plot::run(&arguments),
        Command::Trade(arguments) => trade::run(&arguments),
        Command::Completions(arguments) => completions::run(&arguments),
        Command::Man(arguments) => man::run(&arguments),
        Command::Topic(topic) => topics::run(topic),
    };
    // The buffer of standard output is written. If it cannot be, a message says so.
    let result = result.and_then(|()| Ok(std::io::stdout().flush()?));
    match result {
        // The reader of the output has seen enough.
        Ok(()) | Err(Stop::OutputClosed) => ExitCode::SUCCESS,
        Err(Stop::Failed(error)) => fail(&error),
        Err(Stop::Interrupted(signal)) => ExitCode::from(128 + signal),
    }
}

/// Prints help, or what is wrong with the arguments.
fn refuse(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        // Help and the version were asked for, so that it matters whether they arrive.
        return match error.print().and_then(|()| std::io::stdout().flush()).map_err(Stop::from) {
            Err(Stop::Failed(error)) => fail(&error),
            _ => ExitCode::SUCCESS,
        };
    }
    let given: Vec<_> = shown_arguments().skip(1).collect();
    let wrong = Arguments::try_parse_from(shown_arguments()).err().filter(clap::Error::use_stderr);
    let wrong = wrong.map(|error| removed::answer(&error, &given).unwrap_or_else(|| with_suggestion(error)));
    let unshown = match error.kind() {
        ErrorKind::InvalidUtf8 => "an argument is not UTF-8, expected UTF-8 except in names of files",
        _ => "wrong arguments; help: wstac --help names the right ones",
    };
    // Nobody may read it; the exit code still reports the failure.
    let _ = wrong.map_or_else(|| writeln!(std::io::stderr(), "error: {unshown}"), |error| error.print());
    ExitCode::from(2)
}

/// Returns the arguments as a message can show them: without characters that control a terminal, and short.
fn shown_arguments() -> impl Iterator<Item = String> {
    std::env::args_os().map(|given: OsString| {
        visible::shortened(&visible::line(&given.to_string_lossy()), LONGEST_ARGUMENT).into_owned()
    })
}

/// Suggests the command with the nearest name, if there is one. clap knows no letters that changed places, as in `rnu`.
fn with_suggestion(mut error: clap::Error) -> clap::Error {
    // Nobody means an unknown option as a value.
    error.remove(ContextKind::Suggested);
    let [given, topic] = [1, 2].map(|place| shown_arguments().nth(place).unwrap_or_default());
    let Some(ContextValue::String(unknown)) = error.get(ContextKind::InvalidSubcommand) else { return error };
    if given == "help" && *unknown == topic {
        return topics::unknown(&topic);
    }
    if *unknown == given && error.get(ContextKind::SuggestedSubcommand).is_none() {
        let command = Arguments::command();
        let names = command.get_subcommands().map(clap::Command::get_name);
        if let Some(name) = nearest(&given, names) {
            error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![name.to_owned()]));
        }
    }
    error
}

/// Returns an error about arguments: one line of at most 1000 bytes that a terminal shows as it is.
fn wrong_arguments(kind: ErrorKind, message: impl Display) -> clap::Error {
    let message = OneLine(message).to_string();
    clap::Error::raw(kind, format_args!("{}\n", visible::shortened(&message, visible::LONGEST - "error: \n".len())))
}

/// Most bytes of an argument in a message about it, which may have it twice.
const LONGEST_ARGUMENT: usize = 150;

fn fail(error: &Error) -> ExitCode {
    // Standard error may be closed; the exit code still reports the failure.
    note(error);
    match error.kind() {
        // An argument that clap cannot judge is wrong all the same.
        wstac_host::error::ErrorKind::Usage => ExitCode::from(2),
        _ => ExitCode::FAILURE,
    }
}

#[cfg(test)]
mod help_tests;
