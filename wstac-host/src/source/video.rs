//! Videos: `ffmpeg` of the machine decodes a file, and its frames are read as [Y4M](super::y4m).
//!
//! A decoder of our own would be larger than this project, and ffmpeg is on most machines that have videos. `ffprobe`,
//! which comes with it, says what the numbers mean: range, matrix and rate.

use std::ffi::{OsStr, OsString};
use std::io::{ErrorKind as IoErrorKind, Read};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::rate::FrameRate;

use super::y4m::Y4m;
use super::{Fault, FaultKind, Source, SourceEvent, StreamInfo, replaced_rate};
use crate::error::{Error, ErrorKind};

/// The endings of files that are taken for videos.
const ENDINGS: [&str; 9] = ["avi", "m4v", "mjpeg", "mkv", "mov", "mp4", "mpg", "ts", "webm"];
/// The pixel formats that are decoded as they are. Others become 4:4:4.
const KEPT: [&str; 7] = ["gray", "yuv420p", "yuv422p", "yuv444p", "yuvj420p", "yuvj422p", "yuvj444p"];
/// Gives frames the times of a stream without gaps, so that ffmpeg repeats none and leaves none out.
const EVERY_FRAME: &str = "settb=1/30,setpts=N";
/// Most bytes that are kept of what ffmpeg reports.
const MOST_REPORTED: usize = 2000;

/// A video file, decoded by ffmpeg.
pub struct Video {
    subject: String,
    info: StreamInfo,
    frames: Y4m,
    decoder: Decoder,
    ended: bool,
}

/// ffmpeg, and what it reports.
struct Decoder {
    process: Child,
    reported: Arc<Mutex<Vec<u8>>>,
    reader: Option<JoinHandle<()>>,
}

/// The properties of a video that `ffprobe` states.
#[derive(Debug, Default, PartialEq)]
struct Stated {
    pixels: String,
    range: Option<QuantizationRange>,
    matrix: Option<YcbcrMatrix>,
    rate: Option<FrameRate>,
    is_uneven: bool,
}

/// Returns whether a file is a video by its name.
pub(super) fn is_video(path: &Path) -> bool {
    let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known))
}

impl Video {
    /// Opens a file. `fps` replaces the rate that it states.
    ///
    /// Every frame of the file is one frame, whatever its time. Where the file states no range or matrix, the frames
    /// are taken to have limited range and BT.601, and the description says so.
    ///
    /// # Errors
    /// ffmpeg is not installed, cannot read the file, or finds no picture in it.
    pub fn open(path: &Path, fps: Option<FrameRate>) -> Result<Self, Error> {
        let subject = path.display().to_string();
        let stated = probe(&subject, path)?;
        let pixels = if KEPT.contains(&stated.pixels.as_str()) { stated.pixels.as_str() } else { "yuv444p" };
        let mut process = ffmpeg("ffmpeg", path)
            .args(["-map", "0:v:0", "-vf", EVERY_FRAME, "-r", "30", "-pix_fmt", pixels, "-f", "yuv4mpegpipe", "pipe:1"])
            // A signal to the program must not end the decoder before the program has read what it wants.
            .process_group(0)
            .spawn()
            .map_err(|error| not_started(&subject, error))?;
        let (output, errors) = (process.stdout.take(), process.stderr.take());
        let reported = Arc::new(Mutex::new(Vec::new()));
        let reader = errors.map(|errors| read_reports(errors, Arc::clone(&reported)));
        let mut decoder = Decoder { process, reported, reader };
        let Some(output) = output else {
            return Err(Error::new(ErrorKind::Io, &subject, "ffmpeg has no output"));
        };
        let rate = fps.or(stated.rate);
        let frames = Y4m::from_fd(&subject, output, rate).map_err(|error| decoder.end().unwrap_or(error.to_string()));
        let frames = frames.map_err(|why| Error::new(ErrorKind::Format, &subject, why))?;
        let info = stated.describe(&subject, frames.info(), fps);
        Ok(Self { subject, info, frames, decoder, ended: false })
    }
}

impl Source for Video {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if self.ended {
            return Ok(SourceEvent::End);
        }
        let Self { subject, frames, decoder, ended, .. } = self;
        match frames.next_event() {
            Ok(SourceEvent::End) => {
                *ended = true;
                // What it could not decode, it has replaced or left out.
                Ok(decoder.end().map_or(SourceEvent::End, |why| {
                    SourceEvent::Fault(Fault::new(FaultKind::Decoder, format!("ffmpeg reports about {subject}: {why}")))
                }))
            }
            Err(error) => {
                *ended = true;
                let why = decoder.end().unwrap_or_else(|| error.message().to_owned());
                Err(Error::new(ErrorKind::Format, subject, why))
            }
            other => other,
        }
    }
}

impl Decoder {
    /// Waits until ffmpeg has ended. Returns the last line that it reported; `None` if all went well.
    fn end(&mut self) -> Option<String> {
        let status = self.process.wait();
        if let Some(reader) = self.reader.take() {
            // It cannot panic, and ends with the process.
            let _ = reader.join();
        }
        let reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
        let text = String::from_utf8_lossy(&reported);
        let line = text.lines().map(str::trim).rfind(|line| !line.is_empty());
        match status {
            Ok(status) if status.success() => line.map(str::to_owned),
            Ok(status) => Some(line.map_or_else(|| format!("ffmpeg failed: {status}"), str::to_owned)),
            Err(error) => Some(error.to_string()),
        }
    }
}

impl Drop for Decoder {
    fn drop(&mut self) {
        // Where it has ended, both say so, which changes nothing.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Stated {
    /// Reads what `ffprobe` prints: a line per entry, as `key=value`.
    fn parse(text: &str) -> Self {
        let value = |key: &str| {
            text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('=')).unwrap_or_default().trim()
        };
        let pixels = value("pix_fmt").to_owned();
        let range = match value("color_range") {
            "pc" | "full" | "jpeg" => Some(QuantizationRange::Full),
            "tv" | "limited" | "mpeg" => Some(QuantizationRange::Limited),
            _ if pixels.starts_with("yuvj") => Some(QuantizationRange::Full),
            _ => None,
        };
        let matrix = match value("color_space") {
            "bt709" => Some(YcbcrMatrix::Bt709),
            "bt470bg" | "smpte170m" | "fcc" => Some(YcbcrMatrix::Bt601),
            _ => None,
        };
        let rate_of = |key| {
            let (numerator, denominator) = value(key).split_once('/')?;
            FrameRate::new(numerator.parse().ok()?, denominator.parse().ok()?).ok()
        };
        let (mean, base) = (rate_of("avg_frame_rate"), rate_of("r_frame_rate"));
        Self { pixels, range, matrix, rate: mean.or(base), is_uneven: mean.is_some() && base.is_some() && mean != base }
    }

    /// Returns the description of the frames.
    fn describe(&self, subject: &str, frames: &StreamInfo, given: Option<FrameRate>) -> StreamInfo {
        let color = YcbcrEncoding {
            matrix: self.matrix.unwrap_or(frames.color.matrix),
            range: self.range.unwrap_or(frames.color.range),
        };
        let mut about = format!(
            "{subject}: video, {}x{} {}, {}:{} frames per second",
            frames.size.width(),
            frames.size.height(),
            self.pixels,
            frames.rate.numerator(),
            frames.rate.denominator()
        );
        about += &replaced_rate::remark(self.rate, given);
        if self.rate.is_none() && given.is_none() {
            about += " (assumed: state another with --fps)";
        } else if self.is_uneven && given.is_none() {
            about += " on average; its frames come unevenly";
        }
        if frames.format.is_ycbcr() && self.range.is_none() {
            about += "; no range is stated: limited, unless --range says full";
        }
        if frames.format.is_ycbcr() && self.matrix.is_none() {
            about += "; no matrix is stated: bt601, unless --matrix says bt709";
        }
        let mut info = StreamInfo::new(about, frames.size, frames.format, frames.rate);
        (info.color, info.bytes_per_row) = (color, frames.bytes_per_row);
        info
    }
}

/// Returns a command of ffmpeg that reads this file, and nothing else.
fn ffmpeg(program: &str, path: &Path) -> Command {
    let mut command = Command::new(program);
    let mut input = OsString::from("file:");
    input.push(path);
    if program == "ffmpeg" {
        command.arg("-nostdin");
    }
    // A playlist could name other files or the network.
    command.args(["-v", "error", "-protocol_whitelist", "file", "-i"]).arg(input);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Asks `ffprobe` for the properties of a video.
fn probe(subject: &str, path: &Path) -> Result<Stated, Error> {
    let entries = "stream=pix_fmt,color_range,color_space,avg_frame_rate,r_frame_rate";
    let mut command = ffmpeg("ffprobe", path);
    command.args(["-select_streams", "v:0", "-show_entries", entries, "-of", "default=noprint_wrappers=1"]);
    let done = command.output().map_err(|error| not_started(subject, error))?;
    let stated = Stated::parse(&String::from_utf8_lossy(&done.stdout));
    if done.status.success() && !stated.pixels.is_empty() {
        return Ok(stated);
    }
    let reported = String::from_utf8_lossy(&done.stderr);
    let last = reported.lines().map(str::trim).rfind(|line| !line.is_empty());
    let why = last.map_or_else(
        || "has no picture, expected a video".to_owned(),
        |line| {
            // ffprobe begins with the name of the file.
            let line = line.strip_prefix(&format!("file:{subject}: ")).unwrap_or(line);
            format!("ffmpeg cannot read it: {line}")
        },
    );
    Err(Error::new(ErrorKind::Format, subject, why))
}

/// Returns the error of a program that does not start.
fn not_started(subject: &str, error: std::io::Error) -> Error {
    if error.kind() == IoErrorKind::NotFound {
        let message = "a video is decoded by ffmpeg, which is not installed; help: sudo apt install ffmpeg";
        return Error::new(ErrorKind::Unsupported, subject, message);
    }
    Error::new(ErrorKind::Io, subject, format_args!("ffmpeg does not start: {error}")).caused_by(error)
}

/// Reads what a process reports, so that it never waits, and keeps the beginning.
fn read_reports(mut errors: impl Read + Send + 'static, reported: Arc<Mutex<Vec<u8>>>) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let mut buffer = [0; 1024];
        while let Ok(count @ 1..) = errors.read(&mut buffer) {
            let mut kept = reported.lock().unwrap_or_else(PoisonError::into_inner);
            let room = MOST_REPORTED.saturating_sub(kept.len()).min(count);
            kept.extend_from_slice(buffer.get(..room).unwrap_or_default());
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_video_states_is_read() {
        let text = "pix_fmt=yuv420p\ncolor_range=tv\ncolor_space=bt709\nr_frame_rate=30/1\navg_frame_rate=30/1\n";
        let stated = Stated::parse(text);
        assert_eq!(stated.range, Some(QuantizationRange::Limited));
        assert_eq!(stated.matrix, Some(YcbcrMatrix::Bt709));
        assert_eq!((stated.rate, stated.is_uneven), (FrameRate::new(30, 1).ok(), false));
        // A camera's Motion JPEG, of which the container states nothing.
        let text = "pix_fmt=yuvj422p\ncolor_range=unknown\ncolor_space=unknown\nr_frame_rate=30/1\navg_frame_rate=29970/1000\n";
        let stated = Stated::parse(text);
        assert_eq!((stated.range, stated.matrix), (Some(QuantizationRange::Full), None));
        assert_eq!((stated.rate, stated.is_uneven), (FrameRate::new(29_970, 1000).ok(), true));
        assert_eq!(Stated::parse("avg_frame_rate=0/0\nrubbish"), Stated::default());
    }

    #[test]
    fn videos_are_known_by_their_endings() {
        for (name, expected) in [("a.mp4", true), ("b.MKV", true), ("c.y4m", false), ("mp4", false), ("d.mcap", false)]
        {
            assert_eq!(is_video(Path::new(name)), expected, "{name}");
        }
    }

    #[test]
    fn a_program_that_is_missing_is_named_with_what_to_do() {
        let error = not_started("a.mp4", std::io::Error::from(IoErrorKind::NotFound));
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        assert!(error.to_string().ends_with("not installed; help: sudo apt install ffmpeg"), "{error}");
    }
}
