//! `wstac scene render` writes a scene's frames to a file.

use std::ffi::OsString;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::super::files::{NewFile, Outputs, ends};
use super::super::output::{Stop, note};
use super::super::signals::{self, Ending, finishing};
use super::named;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::source::open::OpenOptions;
use wstac_host::source::video::not_started;
use wstac_host::source::y4m::header_of;
use wstac_host::source::{Frame, Source, SourceEvent};
use wstac_scene::source::{SceneSource, script};

/// Write a scene's frames to a new file
///
/// Only pixels under whiskers are computed, unless there is a [sensor.pose]; all others stay dark. Frames that the
/// simulated driver loses leave no bytes, so the file has fewer frames. MJPG is written decoded, as RGB. If the
/// command fails, it removes the incomplete file.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Saw3@150[,90deg][,60mm][,seed=N], or FILE.toml
    scene: OsString,

    /// FILE.y4m, FILE.raw, FILE.mp4, or - for standard output
    ///
    /// Y4M has the formats GREY, Y10, Y12, Y16, YU12 and 422P. FILE.raw has frames of any format back to back, for
    /// other programs. FILE.mp4 is H.264 of what Y4M has, in 8 bits and with losses; ffmpeg, which must be installed,
    /// makes it.
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
        let message = "has no frames, expected fidelity = \"rendered\"";
        return Err(Error::new(ErrorKind::Unsupported, &info.about, message).into());
    }
    let (raw, y4m, mp4) = (ends(path, "raw"), path == Path::new("-") || ends(path, "y4m"), ends(path, "mp4"));
    if !raw && !y4m && !mp4 {
        let message = "expected a name that ends in .y4m, .raw or .mp4, or -";
        return Err(Error::new(ErrorKind::Usage, path.display(), message).into());
    }
    let sides = [info.size.width(), info.size.height()];
    let even = sides.map(|side| side.next_multiple_of(2));
    if mp4 && even != sides {
        let message = format_args!(
            "has frames of {}x{}, expected an even width and height for a video; help: set [sensor] size = [{}, {}], or \
             write FILE.y4m",
            sides[0], sides[1], even[0], even[1]
        );
        return Err(Error::new(ErrorKind::Unsupported, &info.about, message).into());
    }
    let header = (!raw).then(|| header_of(&info)).transpose();
    let header = header.map_err(|message| Error::new(ErrorKind::Unsupported, &info.about, message))?;
    note(&info.about);
    let outputs = Outputs::new(arguments.force).reading([named(&arguments.scene)]);
    let mut out = Output::create(path, &outputs, mp4)?;
    if let Some(header) = &header {
        out.write(header.as_bytes())?;
    }
    finishing(Ending::InTime);
    let mut lost = 0;
    loop {
        signals::check()?;
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
    File(NewFile),
    /// The same, which ffmpeg writes.
    Video(NewFile, Child),
}

/// What makes a video of Y4M on standard input. Its output needs no way back in the file.
const FFMPEG: &str = "-nostdin -v error -f yuv4mpegpipe -i pipe:0 -c:v libx264 -crf 8 -pix_fmt yuv420p -f mp4 \
                      -movflags frag_keyframe+empty_moov pipe:1";

impl Output {
    fn create(path: &Path, outputs: &Outputs, is_video: bool) -> Result<Self, Error> {
        if path == Path::new("-") {
            return Ok(Self::Standard(BufWriter::new(std::io::stdout())));
        }
        let new = outputs.create(path)?;
        if !is_video {
            return Ok(Self::File(new));
        }
        let mut ffmpeg = Command::new("ffmpeg");
        let ffmpeg = ffmpeg.args(FFMPEG.split_ascii_whitespace()).stdin(Stdio::piped()).stdout(new.file.file()?);
        let started = ffmpeg.spawn().map_err(|error| not_started(&path.display().to_string(), error))?;
        Ok(Self::Video(new, started))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Stop> {
        match self {
            Self::Standard(out) => Ok(out.write_all(bytes)?),
            Self::File(NewFile { file, path, .. }) => {
                file.write_all(bytes).map_err(|error| Error::io(path.display(), error).into())
            }
            Self::Video(NewFile { path, .. }, ffmpeg) => {
                let written = ffmpeg.stdin.as_mut().map_or(Ok(()), |input| input.write_all(bytes));
                written.or_else(|error| {
                    // It reads no more because it has ended, and its exit code says more than the pipe.
                    ended(ffmpeg, path)?;
                    Err(Error::io(path.display(), error).into())
                })
            }
        }
    }

    fn finish(self) -> Result<(), Stop> {
        match self {
            Self::Standard(mut out) => Ok(out.flush()?),
            Self::File(new) => Ok(new.commit()?),
            Self::Video(new, mut ffmpeg) => {
                ended(&mut ffmpeg, &new.path)?;
                Ok(new.commit()?)
            }
        }
    }
}

/// Ends the input of ffmpeg, after which it writes the rest, and waits until it has ended.
fn ended(ffmpeg: &mut Child, path: &Path) -> Result<(), Error> {
    drop(ffmpeg.stdin.take());
    let status = ffmpeg.wait().map_err(|error| Error::io(path.display(), error))?;
    if status.success() {
        return Ok(());
    }
    Err(Error::new(ErrorKind::Io, path.display(), format_args!("ffmpeg failed: {status}")))
}
