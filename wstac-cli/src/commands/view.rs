//! `wstac view`: a source on a terminal.

use std::io::IsTerminal;
use std::path::PathBuf;

use super::output::{Stop, note, text_of};
use super::source_arguments::SourceArguments;
use crate::view::{self, Recordings};
use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;
use wstac_host::output::OutputOptions;
use wstac_host::record::about::About;
use wstac_host::session::Processor;
use wstac_host::source::FramePolicy;
use wstac_host::source::Labels;
use wstac_host::texture::Textures;
use wstac_linux::source::is_camera;

/// Watch a source in the terminal: picture, taxels, traces, events
///
/// Over ssh, too. A camera's newest frame is shown; a file or a scene is played at its own rate. The first 25 frames are the
/// baseline: nothing may touch the sensor during them, nor after z.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// What to watch: as for wstac run
    source: String,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model, as wstac run does; once for each model
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Play a file or a scene as fast as it can be, not at its own rate
    #[arg(long)]
    fast: bool,

    /// Name the recording that the key r starts; later ones are FILE-2.mcap and so on [default: wstac-1.mcap and so on]
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<PathBuf>,

    #[command(flatten)]
    options: SourceArguments,
}

const HELP: &str = "\
Keys:
  q, Esc, Ctrl-C   quit
  z                re-zero: gather a new baseline (an event under way is given up)
  r                record from the next frame on, with a new baseline; once more: end the recording
  space            pause; a camera is read on while the screen stands still
  ?                help

What is shown:
  picture   the frame in green light, as bright as the brightest taxel of late; taxels outlined
  taxels    5 x 5, each in percent of full scale
  facts     what the trigger does; frames a second by the driver's timestamps (of a file: as it
            says); camera frames dropped; of a camera also latency (from the driver's timestamp
            to the reading), frames that wait behind, and frames skipped for newer ones
  traces    ten features, five rows and five columns, a dot a frame, on one scale of natural
            logarithms; dashes are where the trigger fires, if a window's mean is above them
  events    first frame, speed (* extrapolated, \u{2264} cut off), direction and its confidence,
            frames lit, texture where there is a model; faults

Recordings are as those of wstac record, in new files, never over another. wstac run FILE.mcap gives
their events again, so z is refused meanwhile. The first line has the file, its frames, and how many
wait for the disk. A camera's frames that were skipped for newer ones are lost in the recording, too;
for every frame: wstac record. q, a signal, the source's end and its failure end a recording properly.
A full disk ends the recording, not the view; the screen says so, and standard error at the end.

From 20 x 5 characters up; a picture needs 60 x 20. Colors are what COLORTERM and TERM say: 24 bits,
256, or 16; with NO_COLOR set there are none, and shades are characters.
A file that is at its end stays on the screen until q. Records for programs: wstac run --json.
Exit code: 0 after a key; 128 + N after signal N; 1 where the source or the terminal cannot be used,
and where the source failed while it was watched.
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    if !std::io::stdout().is_terminal() {
        let message = "is no terminal, expected one to draw on; wstac run prints events to files and pipes";
        return Err(Error::new("standard output", message).into());
    }
    // There is no --force here: a key is pressed too easily.
    if let Some(path) = arguments.record.as_ref().filter(|path| path.symlink_metadata().is_ok()) {
        return Err(Error::new(path.display(), "exists already, expected a new file").into());
    }
    let (mut source, info, config) =
        arguments.options.open_configured(&arguments.source, FramePolicy::Newest, arguments.config.as_deref())?;
    let files = ModelFile::open_all(&arguments.models)?;
    let wanted = OutputOptions { features: true, samples: false };
    let mut reading = Processor::new(&info, &config, wanted)?.with_textures(Textures::new(&files)?);
    let options = view::Options { live: is_camera(&arguments.source), fast: arguments.fast };
    let models = files.iter().map(|file| file.about().to_owned()).collect();
    let about = About::new(&info, &config, Labels::default(), models);
    let mut recordings = Recordings::new(about, arguments.record.clone(), text_of);
    let ending = view::run(source.as_mut(), &info, &mut reading, &mut recordings, options);
    recordings.said().iter().for_each(note);
    let ending = ending?;
    note(format_args!("{} frames, {} dropped, {} events", ending.frames, ending.dropped, ending.events));
    match ending.signal {
        Some(signal) => Err(Stop::Interrupted(signal)),
        None => Ok(()),
    }
}
