//! `wstac scene render` writes a scene's frames to a file.

use std::ffi::OsString;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use super::super::files::{NewFile, Outputs};
use super::super::output::{Stop, note};
use super::super::signals::{self, Ending, finishing};
use super::named;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::source::open::OpenOptions;
use wstac_host::source::y4m::header_of;
use wstac_host::source::{Frame, Source, SourceEvent};
use wstac_scene::source::SceneSource;
use wstac_scene::source::script;

/// Write a scene's frames to a new file
///
/// Only pixels under whiskers are computed, unless there is a [sensor.pose]; all others stay dark. Frames that the
/// simulated driver loses leave no bytes, so the file has fewer frames. MJPG is written decoded, as RGB. If the
/// command fails, it removes the incomplete file.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Saw3@150[,90deg][,60mm][,seed=N], or FILE.toml
    scene: OsString,

    /// FILE.y4m, FILE.raw, or - for Y4M on standard output
    ///
    /// Y4M has the formats GREY, Y10, Y12, Y16, YU12 and 422P. FILE.raw has frames of any format back to back, for
    /// other programs.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Overwrite an existing file
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let script = script(named(&arguments.scene), &OpenOptions::default())?;
    let mut source = SceneSource::new(&script).map_err(|error| error.about(arguments.scene.display()))?;
    let path = arguments.output.as_path();
    let info = source.info().clone();
    if info.taxels_only {
        return Err(
            Error::new(ErrorKind::Unsupported, &info.about, "has no frames, expected fidelity = \"rendered\"").into()
        );
    }
    let raw = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("raw"));
    let y4m = path == Path::new("-") || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("y4m"));
    if !raw && !y4m {
        return Err(
            Error::new(ErrorKind::Usage, path.display(), "expected a name that ends in .y4m or .raw, or -").into()
        );
    }
    let header = if raw {
        None
    } else {
        Some(header_of(&info).map_err(|message| Error::new(ErrorKind::Unsupported, &info.about, message))?)
    };
    note(&info.about);
    let outputs = Outputs::new(arguments.force).reading([named(&arguments.scene)]);
    let mut out = Output::create(path, &outputs)?;
    if let Some(header) = &header {
        out.write(header.as_bytes())?;
    }
    let (mut lost, interrupted) = (0, finishing(Ending::InTime));
    loop {
        if interrupted.load(Ordering::Relaxed) {
            return Err(Stop::Interrupted(signals::code()));
        }
        match source.next_event()? {
            SourceEvent::Frame(Frame { bytes, .. }) => {
                if header.is_some() {
                    out.write(b"FRAME\n")?;
                }
                out.write(bytes)?;
            }
            SourceEvent::Lost { frames, .. } => lost = frames.saturating_add(lost),
            SourceEvent::End => break,
            _ => {}
        }
    }
    out.finish()?;
    if lost > 0 {
        note(format_args!("{} lost: the file has none of their bytes", counted(lost, "frame")));
    }
    Ok(())
}

/// A new file, or standard output.
enum Output {
    Standard(BufWriter<std::io::Stdout>),
    /// A file that takes its name only when it is complete.
    File(NewFile, PathBuf),
}

impl Output {
    fn create(path: &Path, outputs: &Outputs) -> Result<Self, Error> {
        if path == Path::new("-") {
            return Ok(Self::Standard(BufWriter::new(std::io::stdout())));
        }
        Ok(Self::File(outputs.create(path)?, path.to_owned()))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Stop> {
        match self {
            Self::Standard(out) => Ok(out.write_all(bytes)?),
            Self::File(new, path) => new.file.write_all(bytes).map_err(|error| Error::io(path.display(), error).into()),
        }
    }

    fn finish(self) -> Result<(), Stop> {
        match self {
            Self::Standard(mut out) => Ok(out.flush()?),
            Self::File(new, _) => Ok(new.commit()?),
        }
    }
}
