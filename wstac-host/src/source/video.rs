//! Videos: `ffmpeg` of the machine decodes a file, and its frames are read as [Y4M](super::y4m). Motion JPEG that has
//! times is decoded as that of cameras.
//!
//! A decoder of our own would be larger than this project, and ffmpeg is on most machines that have videos. `ffprobe`,
//! which comes with it, says what the numbers mean: range, matrix and rate.

mod ffmpeg;
#[cfg(feature = "jpeg")]
mod jpegs;
mod properties;

use std::ffi::OsStr;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::Stdio;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use wstac_core::rate::FrameRate;

pub use self::ffmpeg::not_started;
use self::ffmpeg::{Decoder, Report};
use self::properties::{Stated, probe};
use super::spacing::{Positions, Spacing};
use super::y4m::Y4m;
use super::{Fault, FaultKind, Source, SourceEvent, StreamInfo};
use crate::error::{Error, ErrorKind};

/// The endings of files that are taken for videos.
const ENDINGS: [&str; 48] = [
    "264", "265", "3g2", "3gp", "3gpp", "apng", "asf", "avi", "divx", "dv", "f4v", "flv", "gif", "h264", "h265",
    "hevc", "ivf", "m1v", "m2t", "m2ts", "m2v", "m4v", "mjpeg", "mjpg", "mk3d", "mkv", "mov", "mp4", "mpe", "mpeg",
    "mpg", "mts", "mxf", "nut", "obu", "ogg", "ogm", "ogv", "qt", "rm", "rmvb", "tod", "trp", "ts", "vob", "webm",
    "wmv", "wtv",
];
/// Prints the time of every frame in microseconds before the frame comes, and whether it is a key frame.
const EVERY_TIME: &str = "settb=1/1000000,showinfo=checksum=0,";
/// Gives frames the times of a stream without gaps, so that ffmpeg repeats none and leaves none out.
const EVERY_FRAME: &str = "settb=1/30,setpts=N";
/// Longest wait for the time of a frame that has come, and the number of such waits after which no time is expected.
const LONGEST_WAIT: Duration = Duration::from_millis(500);
const MOST_WAITS: u32 = 10;
/// Frames after the last report of damage before which no key frame ends the doubt: since version 7, ffmpeg decodes
/// eight frames ahead of the time that it prints, and B-frames come in another order. Pictures that are copied are as
/// far behind the log as pipes and buffers hold, some 100 KiB.
const LONGEST_AHEAD: u32 = 16;
const LONGEST_BEHIND: u32 = 128;
/// Some cameras put bytes before markers, which ffmpeg takes for errors.
const UNTIL_OF_JPEG: &str = "until a later key frame; help: ffmpeg -i FILE -c copy FOLDER/%05d.jpg, and read FOLDER: its \
                             pictures are decoded without ffmpeg";

/// A video file, decoded by ffmpeg.
pub struct Video {
    subject: String,
    info: StreamInfo,
    frames: Y4m,
    decoder: Decoder,
    /// Finds gaps between the times of frames; `None` if the file states no times.
    spacing: Option<Spacing>,
    /// Whether the time of the next frame was taken.
    has_arrived: bool,
    /// Waits for the time of the next frame.
    waits: u32,
    doubt: Doubt,
    /// The fault about its rotation, until it is reported.
    turned: Option<Fault>,
    /// Whether no picture has come.
    is_empty: bool,
    ended: bool,
}

/// Whether frames may be wrong, because of what ffmpeg could not decode.
struct Doubt {
    is_on: bool,
    /// Frames since the last report of damage.
    frames: u32,
    /// Frames after damage before which no key frame ends the doubt.
    least: u32,
    /// How long events are not reliable.
    until: &'static str,
}

/// Returns whether a file is a video by its name.
pub(super) fn is_video(path: &Path) -> bool {
    let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Returns whether a file begins as MP4, Matroska, AVI or GIF do.
pub(super) fn starts_as_video(path: &Path) -> bool {
    let mut start = [0; 12];
    let is_read = crate::files::open(path).is_ok_and(|mut file| file.read_exact(&mut start).is_ok());
    is_read
        && (&start[4..8] == b"ftyp"
            || start.starts_with(b"RIFF") && start.ends_with(b"AVI ")
            || [*b"\x1AE\xDF\xA3", *b"GIF8"].iter().any(|magic| start.starts_with(magic)))
}

impl Video {
    /// Opens a file. `fps` replaces the rate that it states.
    ///
    /// The time stamps of the frames say where frames are missing, which are lost frames, or come unevenly. Where the
    /// file states no range or matrix, the frames are taken to have limited range and BT.601, and the description says
    /// so. Of red, green and blue, green is taken as it is. Gray that states limited range is made full.
    ///
    /// From a frame that ffmpeg cannot decode without errors on, nothing is reliable until a later key frame. Errors
    /// before the first frame say only that the file was cut. Of Motion JPEG that ffmpeg only copies, a picture that
    /// cannot be decoded is a lost frame, and an error of the file makes 128 frames behind it not reliable.
    ///
    /// # Errors
    /// ffmpeg is not installed, cannot read the file, or finds no picture in it.
    pub fn open(path: &Path, fps: Option<FrameRate>) -> Result<Self, Error> {
        let subject = path.display().to_string();
        let stated = probe(&subject, path)?;
        let rate = fps.or(stated.rate);
        #[cfg(feature = "jpeg")]
        let copied = stated.size_of_jpegs().map_or(Ok(None), |size| jpegs::start(&subject, path, size))?;
        #[cfg(not(feature = "jpeg"))]
        let copied = stated.size_of_jpegs().and(None::<(_, OwnedFd)>);
        let doubt = Doubt::new(&stated.codec, copied.is_some());
        let (mut decoder, output) = copied.map_or_else(|| decoded(&subject, path, &stated), Ok)?;
        let frames = Y4m::from_fd(&subject, output, rate).map_err(|error| decoder.end().unwrap_or(error.to_string()));
        let frames = frames.map_err(|why| without_frames(&subject, &why))?;
        let info = stated.describe(&subject, frames.info(), fps);
        let spacing = stated.step.map(|step| Spacing::new(subject.clone(), Positions::Times, step));
        let turned = stated.is_turned.then(|| format!("{subject}: turned, as its rotation says"));
        let turned = turned.map(|message| Fault::new(FaultKind::Turned, message));
        let (has_arrived, waits, is_empty, ended) = (false, 0, true, false);
        Ok(Self { subject, info, frames, decoder, spacing, has_arrived, waits, doubt, turned, is_empty, ended })
    }
}

fn without_frames(subject: &str, why: &str) -> Error {
    Error::new(ErrorKind::Format, subject, format_args!("no frame can be decoded: {why}"))
}

/// Starts ffmpeg as the decoder of a file, which writes Y4M to the output that is returned.
fn decoded(subject: &str, path: &Path, stated: &Stated) -> Result<(Decoder, OwnedFd), Error> {
    let (conversion, pixels) = stated.conversion();
    let filters = format!("{EVERY_TIME}{conversion}{EVERY_FRAME}");
    // Cover pictures are no video. Gray of more than 8 bits has a name in Y4M that ffmpeg does not take for official.
    let options = ["-map", "0:V:0", "-vf", &filters, "-r", "30", "-pix_fmt", pixels, "-strict", "-1", "-f"];
    let options = options.into_iter().chain(["yuv4mpegpipe", "pipe:1"]);
    let (decoder, output, _) = Decoder::start(subject, path, options, Stdio::null())?;
    Ok((decoder, output.into()))
}

impl Doubt {
    fn new(codec: &str, is_copied: bool) -> Self {
        let (least, until) = match codec {
            "mjpeg" if is_copied => (LONGEST_BEHIND, "for the next 128 frames"),
            "mjpeg" => (LONGEST_AHEAD, UNTIL_OF_JPEG),
            // They call every frame a key frame, although most are made of those before.
            "apng" | "gif" => (u32::MAX, "from there on"),
            _ => (LONGEST_AHEAD, "until a later key frame"),
        };
        Self { is_on: false, frames: 0, least, until }
    }

    /// Takes a report of damage. Returns true if doubt begins.
    fn begin(&mut self) -> bool {
        self.frames = 0;
        !std::mem::replace(&mut self.is_on, true)
    }

    /// Takes a frame. Returns true if doubt ends before it.
    fn end(&mut self, is_key: bool) -> bool {
        self.frames = self.frames.saturating_add(1);
        let ends = self.is_on && is_key && self.frames > self.least;
        self.is_on &= !ends;
        ends
    }
}

impl Source for Video {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if let Some(fault) = self.turned.take() {
            return Ok(SourceEvent::Fault(fault));
        }
        let Self { subject, frames, decoder, spacing, has_arrived, waits, doubt, is_empty, ended, .. } = self;
        let fault = |kind, message: &str| Ok(SourceEvent::Fault(Fault::new(kind, format!("{subject}: {message}"))));
        if let Some(reports) = decoder.reports.as_ref().filter(|_| !*has_arrived && !*ended) {
            if !frames.has_next() {
                return Ok(SourceEvent::Waiting);
            }
            // ffmpeg reports what it could not decode, and the time, before the frame.
            match reports.recv_timeout(LONGEST_WAIT) {
                Ok(Report::Frame { time, is_key }) => {
                    (*has_arrived, *waits) = (true, 0);
                    if let Some(spacing) = spacing {
                        spacing.arrive(time);
                    }
                    // A key frame mends no times.
                    if doubt.end(is_key) && !spacing.as_ref().is_some_and(|spacing| spacing.is_uneven) {
                        return fault(FaultKind::Even, "frames are decoded without errors again");
                    }
                }
                #[cfg(feature = "jpeg")]
                Ok(Report::Lost { time, frames, why, is_first }) => {
                    let Some(spacing) = spacing else { return Ok(SourceEvent::Waiting) };
                    spacing.lose(frames - 1);
                    spacing.arrive(time);
                    if is_first {
                        let message = format!("a picture cannot be decoded: {why}; others count as lost, too");
                        spacing.fault(FaultKind::Decoder, &message);
                    }
                    spacing.ready.push_back(SourceEvent::Lost { frames, reason: why.reason() });
                    return Ok(SourceEvent::Waiting);
                }
                Ok(Report::Damage(why)) => {
                    // At the end, no frame is made of what was damaged.
                    if !frames.has_frame() || !doubt.begin() {
                        return Ok(SourceEvent::Waiting);
                    }
                    let message = format!("ffmpeg reports \"{why}\"; events are not reliable {}", doubt.until);
                    return fault(FaultKind::Uneven, &message);
                }
                Err(RecvTimeoutError::Timeout) if *waits < MOST_WAITS => {
                    *waits += 1;
                    return Ok(SourceEvent::Waiting);
                }
                Err(_) => {
                    decoder.reports = None;
                    // At the end, no time is missing.
                    if frames.has_frame() {
                        *spacing = None;
                        let message = "ffmpeg reports no time of a frame; events are not reliable from there on";
                        return fault(FaultKind::Uneven, message);
                    }
                }
            }
        }
        match spacing.as_mut().and_then(Spacing::next_event) {
            // Even times mend no frame.
            Some(SourceEvent::Fault(fault)) if doubt.is_on && fault.kind == FaultKind::Even => {
                return Ok(SourceEvent::Waiting);
            }
            Some(event) => return Ok(event),
            None => {}
        }
        if *ended {
            return Ok(SourceEvent::End);
        }
        match frames.next_event() {
            Ok(SourceEvent::End) if !*is_empty => {
                *ended = true;
                spacing.iter_mut().for_each(Spacing::finish);
                // ffmpeg has replaced or left out the frames that it could not decode.
                Ok(decoder.end().map_or(SourceEvent::Waiting, |why| {
                    SourceEvent::Fault(Fault::new(FaultKind::Decoder, format!("ffmpeg reports about {subject}: {why}")))
                }))
            }
            other @ (Err(_) | Ok(SourceEvent::End)) => {
                *ended = true;
                let why = other.err().map_or("it has no picture".to_owned(), |error| error.message().to_owned());
                let why = decoder.end().unwrap_or(why);
                Err(if *is_empty { without_frames(subject, &why) } else { Error::new(ErrorKind::Format, subject, why) })
            }
            other => {
                *has_arrived = !matches!(other, Ok(SourceEvent::Frame(_)));
                *is_empty &= *has_arrived;
                match (other, spacing) {
                    (Ok(event), Some(spacing)) => Ok(spacing.placed(event)),
                    (other, _) => other,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubt_ends_at_a_key_frame_long_after_damage() {
        let mut doubt = Doubt::new("h264", false);
        assert!(!doubt.end(true) && doubt.begin() && !doubt.begin());
        assert!((0..8).all(|_| !doubt.end(true)) && !doubt.begin());
        assert!((0..LONGEST_AHEAD).all(|_| !doubt.end(true)));
        assert!(!doubt.end(false) && doubt.is_on);
        assert!(doubt.end(true) && !doubt.is_on && doubt.begin());
        for (codec, is_copied, least) in [("mjpeg", true, 128), ("mjpeg", false, 16), ("gif", false, u32::MAX)] {
            assert_eq!(Doubt::new(codec, is_copied).least, least, "{codec}");
        }
    }

    #[test]
    fn videos_are_known_by_their_endings() {
        for (name, expected) in
            [("a.mp4", true), ("b.MKV", true), ("e.m2ts", true), ("c.y4m", false), ("mp4", false), ("d.mcap", false)]
        {
            assert_eq!(is_video(Path::new(name)), expected, "{name}");
        }
    }
}
