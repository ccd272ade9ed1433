//! `wstac plot` draws one event as a figure.

use std::ffi::OsString;
use std::path::PathBuf;

use super::files::{Outputs, check_figure};
use super::output::{Stop, note};
use super::source_arguments::{SourceArguments, models_of, open_models};
use super::values::at_least;
use wstac_host::output::OutputOptions;
use wstac_host::session::Processor;
use wstac_host::source::FramePolicy;
use wstac_host::texture::Textures;
use wstac_plot::{draw, find};

/// Draw one event as a figure for a paper
///
/// The figure shows ten features over the event's 70 frames, when the light arrives at each taxel, the direction and
/// the speed. A caption has the numbers.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// The source of the event, as for wstac run
    source: OsString,

    /// Write the figure to this new file
    #[arg(short, long, value_name = "FILE.svg")]
    output: PathBuf,

    /// Which event, counted from 1
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = at_least(1_u64))]
    event: u64,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Name textures with this model; can be given several times
    ///
    /// Names are those of wstac run; a scene has builtin by default.
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    #[command(flatten)]
    options: SourceArguments,

    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

const HELP: &str = "\
The figure:
  It is 170 mm wide (two columns of a journal), with words of 7.5 pt or
  more. Its colors also differ in brightness. It has four panels:
  a, b   natural logarithms of the light of rows and columns; numbers
         mark the centroids that give the direction; also the thresholds
         of trigger and speed, the window that fired, and the first and
         last lit frame
  c      the time when the light arrives at each of the 25 taxels (its
         centroid), with an arrow for the direction; a dash means less
         than a tenth of the brightest taxel's light
  d      arrival along the motion: when the light reaches each taxel, and
         the line of the event's speed
  The numbers are those of wstac run --json --samples. The same source
  gives the same bytes.
  Exit code: 1 also if the source has no such event.

Examples:
  wstac plot scene:Saw3@150,90deg -o event.svg
  wstac plot /dev/video0 --model builtin -o event.svg
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    check_figure(&arguments.output)?;
    let outputs = Outputs::new(arguments.force).source(&arguments.source);
    let outputs = outputs.reading(&arguments.config).reading(&arguments.models);
    outputs.check([&arguments.output])?;
    let (mut source, info, config) =
        arguments.options.open_configured(&arguments.source, FramePolicy::Every, arguments.config.as_deref())?;
    note(&info.about);
    let given = open_models(&arguments.models)?;
    let files = models_of(given.as_deref(), &arguments.source, &info, &config)?;
    let wanted = OutputOptions { samples: true, ..OutputOptions::default() };
    let mut reading = Processor::new(&info, &config, wanted)?.with_textures(Textures::new(&files)?);
    let found = find(source.as_mut(), &info, &mut reading, &config, arguments.event)?;
    outputs.write(&arguments.output, draw(&found))?;
    note(format_args!("{} has event {} of {}", arguments.output.display(), arguments.event, info.about));
    Ok(())
}
