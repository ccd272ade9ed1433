//! Videos: `ffmpeg` of the machine decodes a file, and its frames are read as [Y4M](super::y4m).
//!
//! A decoder of our own would be larger than this project, and ffmpeg is on most machines that have videos. `ffprobe`,
//! which comes with it, says what the numbers mean: range, matrix and rate.

use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader, ErrorKind as IoErrorKind, Read};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::rate::FrameRate;
use wstac_core::touch::motion::RowOrder;

use super::spacing::{self, Positions, Spacing};
use super::y4m::Y4m;
use super::{Fault, FaultKind, Source, SourceEvent, StreamInfo, replaced_rate};
use crate::error::{Error, ErrorKind};

/// The endings of files that are taken for videos.
const ENDINGS: [&str; 48] = [
    "264", "265", "3g2", "3gp", "3gpp", "apng", "asf", "avi", "divx", "dv", "f4v", "flv", "gif", "h264", "h265",
    "hevc", "ivf", "m1v", "m2t", "m2ts", "m2v", "m4v", "mjpeg", "mjpg", "mk3d", "mkv", "mov", "mp4", "mpe", "mpeg",
    "mpg", "mts", "mxf", "nut", "obu", "ogg", "ogm", "ogv", "qt", "rm", "rmvb", "tod", "trp", "ts", "vob", "webm",
    "wmv", "wtv",
];
/// The pixel formats that are decoded as they are.
const KEPT: [&str; 10] =
    ["gray", "gray10le", "gray12le", "gray16le", "yuv420p", "yuv422p", "yuv444p", "yuvj420p", "yuvj422p", "yuvj444p"];
/// The starts of the names of pixel formats that have red, green and blue, and of those that have gray alone.
const RGB: [&str; 13] =
    ["0bgr", "0rgb", "abgr", "argb", "bayer", "bgr", "gbr", "pal8", "rgb", "rgba", "x2bgr", "x2rgb", "xyz"];
const GRAY: [&str; 4] = ["gray", "mono", "ya16", "ya8"];
/// The formats of ffmpeg that are streams without times: ffmpeg makes up 25 frames per second, unless the stream states
/// another rate.
const WITHOUT_TIMES: [&str; 9] = ["cavsvideo", "dirac", "h263", "h264", "hevc", "m4v", "mjpeg", "obu", "vc1"];
const MADE_UP: (u32, u32) = (25, 1);
/// Another rate for ffmpeg to make up. A rate that is 25 with it, too, is stated by the stream.
const OTHER_MADE_UP: (u32, u32) = (23, 1);
/// The highest rate that a file may state.
const MOST_PER_SECOND: f64 = 1000.0;
/// Prints the time of every frame in microseconds before the frame comes, and whether it is a key frame.
const EVERY_TIME: &str = "settb=1/1000000,showinfo=checksum=0,";
/// Gives frames the times of a stream without gaps, so that ffmpeg repeats none and leaves none out.
const EVERY_FRAME: &str = "settb=1/30,setpts=N";
/// Frames that show how far frames are apart.
const PROBED: &str = "%+#150";
/// A rate that a file states is that of its time stamps if it differs by at most this part.
const SAME_RATE: f64 = 0.003;
/// Most bytes that are kept of what ffmpeg reports.
const MOST_REPORTED: usize = 2000;
/// Longest wait for the time of a frame that has come, and the number of such waits after which no time is expected.
const LONGEST_WAIT: Duration = Duration::from_millis(500);
const MOST_WAITS: u32 = 10;
/// Frames after the last report of damage before which no key frame ends the doubt: since version 7, ffmpeg decodes
/// eight frames ahead of the time that it prints, and B-frames come in another order.
const LONGEST_AHEAD: u32 = 16;
/// An error that concerns no picture: many cameras write such a marker.
const HARMLESS: &str = "unable to decode APP fields";
/// Most bytes of a line of ffmpeg's log that are read as one.
const LONGEST_LINE: u64 = 4096;

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
    ended: bool,
}

/// Whether frames may be wrong, because of what ffmpeg could not decode.
#[derive(Debug, Default, PartialEq)]
struct Doubt {
    is_on: bool,
    /// Frames since the last report of damage.
    frames: u32,
    /// Whether its codec calls every frame a key frame, although most are made of those before.
    lacks_keys: bool,
}

/// ffmpeg, and what it reports.
struct Decoder {
    process: Child,
    reported: Arc<Mutex<Vec<u8>>>,
    reader: Option<JoinHandle<()>>,
    /// Times and damage of frames. `None` if they do not come in time.
    reports: Option<Receiver<Report>>,
}

/// A report of ffmpeg, which comes before its frame.
#[derive(Debug, PartialEq)]
enum Report {
    Frame {
        /// Milliseconds; not a number for a frame without a time.
        time: f64,
        is_key: bool,
    },
    /// An error in the frame, or in one that the frame is made of.
    Damage(String),
}

/// The properties of a video that `ffprobe` states.
#[derive(Debug, Default, PartialEq)]
struct Stated {
    pixels: String,
    range: Option<QuantizationRange>,
    matrix: Option<YcbcrMatrix>,
    rate: Option<FrameRate>,
    /// The usual time between frames in milliseconds, by their time stamps, and whether the rate follows from it alone.
    step: Option<f64>,
    is_by_times: bool,
    /// Whether the frames are to be turned or mirrored, which ffmpeg does, and where their rows then follow each other.
    is_turned: bool,
    row_order: RowOrder,
    /// Whether ffmpeg may have made the rate up.
    is_made_up: bool,
    doubt: Doubt,
}

/// Returns whether a file is a video by its name.
pub(super) fn is_video(path: &Path) -> bool {
    let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known))
}

impl Video {
    /// Opens a file. `fps` replaces the rate that it states.
    ///
    /// The time stamps of the frames say where frames are missing, which are lost frames, or come unevenly. Where the file
    /// states no range or matrix, the frames are taken to have limited range and BT.601, and the description says so. Of
    /// red, green and blue, green is taken as it is.
    ///
    /// From a frame that ffmpeg cannot decode without errors on, nothing is reliable until a later key frame. Errors
    /// before the first frame say only that the file was cut.
    ///
    /// # Errors
    /// ffmpeg is not installed, cannot read the file, or finds no picture in it, or the file states an absurd rate.
    pub fn open(path: &Path, fps: Option<FrameRate>) -> Result<Self, Error> {
        let subject = path.display().to_string();
        let stated = probe(&subject, path)?;
        let rate = fps.or(stated.rate);
        if let Some(rate) = rate.filter(|rate| fps.is_none() && rate.per_second() > MOST_PER_SECOND) {
            let message = format_args!(
                "states {:.0} frames per second, expected at most {MOST_PER_SECOND}; state the rate with --fps",
                rate.per_second()
            );
            return Err(Error::new(ErrorKind::Format, &subject, message));
        }
        let (conversion, pixels) = stated.conversion();
        let filters = format!("{EVERY_TIME}{conversion}{EVERY_FRAME}");
        let mut process = ffmpeg("ffmpeg", path)
            // Cover pictures are no video.
            .args(["-map", "0:V:0", "-vf", &filters, "-r", "30", "-pix_fmt", pixels])
            // Gray of more than 8 bits has a name in Y4M that ffmpeg does not take for official.
            .args(["-strict", "-1", "-f", "yuv4mpegpipe", "pipe:1"])
            // A signal to the program must not end the decoder before the program has read what it wants.
            .process_group(0)
            .spawn()
            .map_err(|error| not_started(&subject, error))?;
        let (output, errors) = (process.stdout.take(), process.stderr.take());
        let reported = Arc::new(Mutex::new(Vec::new()));
        let (sender, reports) = channel();
        let reader = errors.map(|errors| read_reports(errors, Arc::clone(&reported), sender));
        let mut decoder = Decoder { process, reported, reader, reports: Some(reports) };
        let Some(output) = output else {
            return Err(Error::new(ErrorKind::Io, &subject, "ffmpeg has no output"));
        };
        let frames = Y4m::from_fd(&subject, output, rate).map_err(|error| decoder.end().unwrap_or(error.to_string()));
        let frames = frames.map_err(|why| Error::new(ErrorKind::Format, &subject, why))?;
        let info = stated.describe(&subject, frames.info(), fps);
        let spacing = stated.step.map(|step| Spacing::new(subject.clone(), Positions::Times, step));
        let turned = stated.is_turned.then(|| format!("{subject}: turned, as its rotation says"));
        let turned = turned.map(|message| Fault::new(FaultKind::Turned, message));
        let (doubt, has_arrived, waits, ended) = (stated.doubt, false, 0, false);
        Ok(Self { subject, info, frames, decoder, spacing, has_arrived, waits, doubt, turned, ended })
    }
}

impl Doubt {
    /// Takes a report of damage. Returns true if doubt begins.
    fn begin(&mut self) -> bool {
        self.frames = 0;
        !std::mem::replace(&mut self.is_on, true)
    }

    /// Takes a frame. Returns true if doubt ends before it.
    fn end(&mut self, is_key: bool) -> bool {
        self.frames = self.frames.saturating_add(1);
        let ends = self.is_on && is_key && !self.lacks_keys && self.frames > LONGEST_AHEAD;
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
        let Self { subject, frames, decoder, spacing, has_arrived, waits, doubt, ended, .. } = self;
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
                    if doubt.end(is_key) && !spacing.as_ref().is_some_and(Spacing::is_uneven) {
                        return fault(FaultKind::Even, "frames are decoded without errors again");
                    }
                }
                Ok(Report::Damage(why)) => {
                    // At the end, no frame is made of what was damaged.
                    if !frames.has_frame() || !doubt.begin() {
                        return Ok(SourceEvent::Waiting);
                    }
                    let message = format!("ffmpeg reports \"{why}\"; events are not reliable until a later key frame");
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
            Ok(SourceEvent::End) => {
                *ended = true;
                spacing.iter_mut().for_each(Spacing::finish);
                // ffmpeg has replaced or left out the frames that it could not decode.
                Ok(decoder.end().map_or(SourceEvent::Waiting, |why| {
                    SourceEvent::Fault(Fault::new(FaultKind::Decoder, format!("ffmpeg reports about {subject}: {why}")))
                }))
            }
            Err(error) => {
                *ended = true;
                let why = decoder.end().unwrap_or_else(|| error.message().to_owned());
                Err(Error::new(ErrorKind::Format, subject, why))
            }
            other => {
                *has_arrived = !matches!(other, Ok(SourceEvent::Frame(_)));
                other
            }
        }
    }
}

impl Decoder {
    /// Waits until ffmpeg has ended. Returns the first error that it reported, of which the others follow; `None` if all
    /// went well.
    fn end(&mut self) -> Option<String> {
        let status = self.process.wait();
        if let Some(reader) = self.reader.take() {
            // It cannot panic, and ends with the process.
            let _ = reader.join();
        }
        let reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
        let text = String::from_utf8_lossy(&reported);
        let line = text.lines().map(str::trim).find(|line| !line.is_empty());
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
        Self::parse_with(text, MADE_UP)
    }

    /// Reads it where ffmpeg makes up this rate for a stream without times.
    fn parse_with(text: &str, made_up: (u32, u32)) -> Self {
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
        let row_order = row_order(text).unwrap_or_default();
        let is_rotated = value("rotation").parse::<f64>().is_ok_and(|degrees| degrees != 0.0);
        let is_turned = is_rotated || row_order != RowOrder::Down;
        let rate_of = |key| {
            let (numerator, denominator) = value(key).split_once('/')?;
            FrameRate::new(numerator.parse().ok()?, denominator.parse().ok()?).ok()
        };
        let (mean, base) = (rate_of("avg_frame_rate"), rate_of("r_frame_rate"));
        let (pixels, stated) = (pixels, mean.or(base));
        let doubt = Doubt { lacks_keys: matches!(value("codec_name"), "apng" | "gif"), ..Doubt::default() };
        let format = value("format_name");
        if format.ends_with("_pipe") || WITHOUT_TIMES.contains(&format) {
            let rate = stated.filter(|rate| <(u32, u32)>::from(*rate) != made_up);
            let is_made_up = rate.is_none() && WITHOUT_TIMES.contains(&format);
            let known = Self { pixels, range, matrix, rate, is_turned, row_order, ..Self::default() };
            return Self { is_made_up, doubt, ..known };
        }
        let times = text.lines().filter_map(|line| line.strip_prefix("best_effort_timestamp_time="));
        let times: Vec<f64> = times.filter_map(|time| Some(1000.0 * time.trim().parse::<f64>().ok()?)).collect();
        let step = spacing::step(&times);
        // The mean of a file whose frames come unevenly is the rate of none of them, and ffmpeg guesses the other.
        let is_same =
            |rate: &FrameRate| step.is_none_or(|step| (rate.per_second() * step / 1000.0 - 1.0).abs() < SAME_RATE);
        let by_header = mean.filter(is_same).or(base.filter(is_same));
        let by_times = step.and_then(spacing::rate_of);
        let is_by_times = by_header.is_none() && by_times.is_some();
        // Time stamps that never grow say nothing of the frames' places, so that all of them come unevenly.
        let are_equal = step.is_none() && times.len() > 1;
        let step = step.or_else(|| by_header.filter(|_| are_equal).map(|rate| 1000.0 / rate.per_second()));
        let rate = by_header.or(by_times);
        Self { pixels, range, matrix, rate, step, is_by_times, is_turned, row_order, is_made_up: false, doubt }
    }

    /// Returns the filter that makes pixels that are read, and their format.
    ///
    /// ffmpeg makes limited range of anything unless its options say otherwise.
    fn conversion(&self) -> (String, &'static str) {
        let pixels = self.pixels.as_str();
        let starts = |names: &[&str]| names.iter().any(|name| pixels.starts_with(name));
        let is_deep = ["10", "12", "14", "16", "48", "64", "9", "f32"].iter().any(|bits| pixels.contains(bits));
        if let Some(kept) = KEPT.iter().find(|kept| **kept == pixels) {
            return (String::new(), kept);
        }
        match (starts(&RGB), starts(&GRAY), is_deep) {
            (true, _, false) => ("format=gbrp,extractplanes=g,".into(), "gray"),
            (true, _, true) => ("format=gbrp16le,extractplanes=g,".into(), "gray16le"),
            (_, true, false) => (String::new(), "gray"),
            (_, true, true) => (String::new(), "gray16le"),
            _ => {
                let range = if self.range == Some(QuantizationRange::Full) { "full" } else { "limited" };
                (format!("scale=in_range={range}:out_range={range},"), "yuv444p")
            }
        }
    }

    fn describe(&self, subject: &str, frames: &StreamInfo, given: Option<FrameRate>) -> StreamInfo {
        let color = YcbcrEncoding {
            matrix: self.matrix.unwrap_or(frames.color.matrix),
            range: self.range.unwrap_or(frames.color.range),
        };
        let mut about = format!(
            "{subject}: video, {}x{} {}, {} frames per second",
            frames.size.width(),
            frames.size.height(),
            self.pixels,
            replaced_rate::readable(frames.rate)
        );
        about += &replaced_rate::remark(self.rate, given);
        if self.rate.is_none() && given.is_none() {
            about += " (assumed: state another with --fps)";
        } else if self.is_by_times && given.is_none() {
            about += " by its time stamps";
        }
        if frames.format.is_ycbcr() && self.range.is_none() {
            about += "; no range is stated: limited, unless --range says full";
        }
        if frames.format.is_ycbcr() && self.matrix.is_none() {
            about += "; no matrix is stated: bt601, unless --matrix says bt709";
        }
        let mut info = StreamInfo::new(about, frames.size, frames.format, frames.rate);
        (info.color, info.bytes_per_row, info.row_order) = (color, frames.bytes_per_row, self.row_order);
        info
    }
}

/// Returns where the stored rows follow each other, by the matrix that `ffprobe` prints: its second line is their step to the
/// right and down.
fn row_order(text: &str) -> Option<RowOrder> {
    let line = text.lines().find_map(|line| line.trim().strip_prefix("00000001:"))?;
    let mut steps = line.split_ascii_whitespace().map(str::parse::<i64>);
    let (right, down) = (steps.next()?.ok()?, steps.next()?.ok()?);
    Some(match (right.abs() > down.abs(), right > 0, down < 0) {
        (true, true, _) => RowOrder::Right,
        (true, false, _) => RowOrder::Left,
        (false, _, true) => RowOrder::Up,
        (false, _, false) => RowOrder::Down,
    })
}

/// Returns a command of ffmpeg that reads this file, and nothing else.
fn ffmpeg(program: &str, path: &Path) -> Command {
    let mut command = Command::new(program);
    let mut input = OsString::from("file:");
    input.push(path);
    if program == "ffmpeg" {
        // The times of frames are information. Each line states its level. Times are not to be mended.
        command.args(["-nostdin", "-hide_banner", "-nostats", "-v", "repeat+level+info", "-copyts"]);
        // Several threads report damage many frames ahead of its frame, each time as many as happens. It would be
        // ignored before the first frame, and doubt could end before the frame comes. Large videos take longer.
        command.args(["-threads", "1"]);
    } else {
        command.args(["-v", "error"]);
    }
    // The log is read.
    command.env("AV_LOG_FORCE_NOCOLOR", "1").env_remove("AV_LOG_FORCE_COLOR");
    // A playlist could name other files or the network.
    command.args(["-protocol_whitelist", "file", "-i"]).arg(input);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Asks `ffprobe` for the properties of a video.
fn probe(subject: &str, path: &Path) -> Result<Stated, Error> {
    let entries = "format=format_name:stream=codec_name,pix_fmt,color_range,color_space,avg_frame_rate,r_frame_rate:\
                   stream_side_data=rotation,displaymatrix:frame=best_effort_timestamp_time";
    let ask = |options: &[&str]| {
        let mut command = ffmpeg("ffprobe", path);
        command.args(["-select_streams", "V:0", "-read_intervals", PROBED, "-show_entries", entries]);
        command.args(["-of", "default=noprint_wrappers=1"]).args(options);
        command.output().map_err(|error| not_started(subject, error))
    };
    let done = ask(&[])?;
    let mut stated = Stated::parse(&String::from_utf8_lossy(&done.stdout));
    if stated.is_made_up {
        let again = ask(&["-framerate", "23"])?;
        stated.rate = Stated::parse_with(&String::from_utf8_lossy(&again.stdout), OTHER_MADE_UP).rate;
    }
    if done.status.success() && !stated.pixels.is_empty() {
        return Ok(stated);
    }
    let reported = String::from_utf8_lossy(&done.stderr);
    // The last line only says that the data are invalid.
    let first = reported.lines().map(without_context).find(|line| !line.is_empty());
    let why = first.map_or_else(
        || "has no picture, expected a video".to_owned(),
        |line| {
            // ffprobe begins with the name of the file.
            let line = line.strip_prefix(&format!("file:{subject}: ")).unwrap_or(line);
            format!("ffmpeg cannot read it: {line}")
        },
    );
    Err(Error::new(ErrorKind::Format, subject, why))
}

fn not_started(subject: &str, error: std::io::Error) -> Error {
    if error.kind() == IoErrorKind::NotFound {
        let message = "a video is decoded by ffmpeg, which is not installed; help: sudo apt install ffmpeg";
        return Error::new(ErrorKind::Unsupported, subject, message);
    }
    Error::new(ErrorKind::Io, subject, format_args!("ffmpeg does not start: {error}")).caused_by(error)
}

/// Returns a line without the parts of ffmpeg that it comes from, whose addresses differ from run to run.
fn without_context(line: &str) -> &str {
    let mut line = line.trim();
    let has_address = |context: &str| context.split_once('@').is_some_and(|(_, at)| at.trim_start().starts_with("0x"));
    while let Some((context, rest)) = line.strip_prefix('[').and_then(|line| line.split_once("] "))
        && has_address(context)
    {
        line = rest;
    }
    line
}

/// Returns an error that ffmpeg reports in a line of its log.
fn error_in(line: &str) -> Option<&str> {
    let line = without_context(line);
    ["[error] ", "[fatal] ", "[panic] "].iter().find_map(|level| line.strip_prefix(level))
}

/// Returns what ffmpeg could not decode, by a line of its log: an error, or what it has replaced.
fn damage_in(line: &str) -> Option<&str> {
    let text = without_context(line);
    let is_replaced = text.starts_with("[info] concealing ") && text.len() < line.trim().len();
    let is_corrupt = ["corrupt decoded frame", "corrupt input packet"].iter().any(|what| text.contains(what));
    let replaced = text.split_once("] ").map(|(_, text)| text);
    let replaced = replaced.filter(|_| is_replaced || (is_corrupt && text.starts_with("[warning] ")));
    error_in(line).or(replaced).filter(|why| !why.starts_with(HARMLESS))
}

/// Returns the frame that ffmpeg reports in a line of its log: `n:0 pts:33333 pts_time:… iskey:1 …`.
fn frame_in(line: &str) -> Option<Report> {
    let text = without_context(line);
    let text = text.strip_prefix("[info]").filter(|_| text.len() < line.trim().len())?;
    let (_, rest) = text.trim_start().strip_prefix("n:")?.split_once(" pts:")?;
    let (time, key) = (rest.split_ascii_whitespace().next()?, rest.split_once(" iskey:")?.1);
    let time = time.parse::<i64>().map_or(f64::NAN, |time| time as f64 / 1000.0);
    Some(Report::Frame { time, is_key: key.starts_with('1') })
}

/// Reads what a process reports, so that it never waits: keeps the beginning of errors, and sends what concerns frames.
fn read_reports(
    errors: impl Read + Send + 'static,
    reported: Arc<Mutex<Vec<u8>>>,
    reports: Sender<Report>,
) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let (mut errors, mut bytes) = (BufReader::new(errors), Vec::new());
        let mut has_begun = false;
        while let Ok(1..) = errors.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut bytes) {
            let line = String::from_utf8_lossy(&bytes);
            if let Some(frame) = frame_in(&line) {
                has_begun = true;
                // After the end of the source nobody asks.
                let _ = reports.send(frame);
            } else {
                if let Some(error) = error_in(&line) {
                    let mut kept = reported.lock().unwrap_or_else(PoisonError::into_inner);
                    let room = MOST_REPORTED.saturating_sub(kept.len());
                    kept.extend(error.bytes().chain([b'\n']).take(room));
                }
                // Before the first frame, it looks for the rate and the size, in other streams, too, and for a key frame.
                if let Some(why) = damage_in(&line).filter(|_| has_begun) {
                    let _ = reports.send(Report::Damage(why.to_owned()));
                }
            }
            bytes.clear();
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
        assert_eq!(stated.rate, FrameRate::new(30, 1).ok());
        // A camera's Motion JPEG, of which the container states nothing.
        let text = "pix_fmt=yuvj422p\ncolor_range=unknown\ncolor_space=unknown\nr_frame_rate=30/1\navg_frame_rate=29970/1000\n";
        let stated = Stated::parse(text);
        assert_eq!((stated.range, stated.matrix), (Some(QuantizationRange::Full), None));
        // A quarter clockwise, upside down, mirrored from top to bottom, and as it is.
        for (rows, order) in [
            ("-65536 0", RowOrder::Left),
            ("0 -65536", RowOrder::Up),
            ("65536 0", RowOrder::Right),
            ("0 65536", RowOrder::Down),
        ] {
            let stated = Stated::parse(&format!("displaymatrix=\n00000000: 0 1 0\n00000001:  {rows}  0\n\n"));
            assert_eq!((stated.row_order, stated.is_turned), (order, order != RowOrder::Down), "{rows}");
        }
        assert!(Stated::parse("rotation=-90\n").is_turned && !Stated::parse("rotation=0\n").is_turned);
        assert_eq!(stated.rate, FrameRate::new(29_970, 1000).ok());
        assert_eq!(Stated::parse("avg_frame_rate=0/0\nrubbish"), Stated::default());
    }

    #[test]
    fn the_rate_is_that_of_the_time_stamps() {
        let times = |step: f64| {
            (0..20).map(move |frame| format!("best_effort_timestamp_time={:.3}\n", f64::from(frame) * step))
        };
        let rate_of = |format: &str, mean: &str, base: &str, step: f64| {
            let head = format!("format_name={format}\navg_frame_rate={mean}\nr_frame_rate={base}\n");
            let stated = Stated::parse(&(times(step).collect::<String>() + &head));
            (stated.rate.map(<(u32, u32)>::from), stated.is_by_times)
        };
        assert_eq!(rate_of("mov,mp4", "30/1", "30/1", 1.0 / 30.0), (Some((30, 1)), false));
        assert_eq!(rate_of("mov,mp4", "26/1", "30/1", 1.0 / 30.0), (Some((30, 1)), false));
        assert_eq!(rate_of("matroska,webm", "0/0", "1000/1", 0.04), (Some((25, 1)), true));
        assert_eq!(rate_of("matroska,webm", "0/0", "1000/1", 0.035), (Some((1_000_000, 35_000)), true));
        assert_eq!(rate_of("avi", "25/1", "25/1", 0.04), (Some((25, 1)), false));
        // ffmpeg makes times up.
        assert_eq!(rate_of("jpeg_pipe", "25/1", "25/1", 0.04), (None, false));
        assert_eq!(rate_of("h264", "25/1", "25/1", 0.04), (None, false));
        assert_eq!(rate_of("h264", "30/1", "30/1", 0.04), (Some((30, 1)), false));
    }

    #[test]
    fn time_stamps_that_do_not_grow_are_uneven() {
        let head = "format_name=mov,mp4\navg_frame_rate=30/1\nr_frame_rate=30/1\n";
        let stated = Stated::parse(&("best_effort_timestamp_time=0.5\n".repeat(20) + head));
        assert_eq!(stated.rate, FrameRate::new(30, 1).ok());
        let mut spacing = Spacing::new(String::new(), Positions::Times, stated.step.expect("a step"));
        for _ in 0..20 {
            spacing.arrive(500.0);
        }
        let mut events = std::iter::from_fn(|| spacing.next_event());
        assert!(events.any(|event| matches!(event, SourceEvent::Fault(fault) if fault.kind == FaultKind::Uneven)));
        // A picture has no second frame to compare with.
        assert_eq!(Stated::parse(&format!("best_effort_timestamp_time=0.5\n{head}")).step, None);
    }

    #[test]
    fn pixels_keep_their_range() {
        let conversion = |pixels: &str, range| {
            let stated = Stated { pixels: pixels.into(), range, ..Stated::default() };
            let (filter, pixels) = stated.conversion();
            filter + pixels
        };
        for (pixels, expected) in [
            ("gray", "gray"),
            ("ya8", "gray"),
            ("gray16be", "gray16le"),
            ("gray10le", "gray10le"),
            ("yuvj422p", "yuvj422p"),
            ("gbrp", "format=gbrp,extractplanes=g,gray"),
            ("bgr0", "format=gbrp,extractplanes=g,gray"),
            ("rgb48be", "format=gbrp16le,extractplanes=g,gray16le"),
            ("nv12", "scale=in_range=limited:out_range=limited,yuv444p"),
        ] {
            assert_eq!(conversion(pixels, None), expected, "{pixels}");
        }
        let full = conversion("yuv422p10le", Some(QuantizationRange::Full));
        assert_eq!(full, "scale=in_range=full:out_range=full,yuv444p");
    }

    #[test]
    fn the_log_of_ffmpeg_is_read() {
        let frame = |time| {
            let line =
                "[Parsed_showinfo_1 @ 0x560dd031a040] [info] n:   7 pts:PTS pts_time:0.2 fmt:gray iskey:1 type:I";
            frame_in(&line.replace("PTS", time))
        };
        assert_eq!(frame(" 233333"), Some(Report::Frame { time: 233.333, is_key: true }));
        assert!(matches!(frame("   NOPTS"), Some(Report::Frame { time, .. }) if time.is_nan()));
        assert_eq!(frame_in("[Parsed_showinfo_1 @ 0x5] [info] config in time_base: 1/1000000, frame_rate: 30/1"), None);
        assert_eq!(frame_in("[info]     title           : [info] n:   7 pts:3 iskey:1"), None);
        assert_eq!(error_in("[h264 @ 0x560dd031a040] [error] no frame!\n"), Some("no frame!"));
        assert_eq!(error_in("[fatal] no such filter"), Some("no such filter"));
        assert_eq!(error_in("[info]     title           : [error] none"), None);
        for (line, expected) in [
            ("[h264 @ 0x560dd031a040] [error] no frame!", Some("no frame!")),
            (
                "[h264 @ 0x5] [info] concealing 75 DC, 75 AC, 75 MV errors",
                Some("concealing 75 DC, 75 AC, 75 MV errors"),
            ),
            ("[warning] a.mp4: corrupt decoded frame in stream 0", Some("a.mp4: corrupt decoded frame in stream 0")),
            ("[mjpeg @ 0x5] [error] unable to decode APP fields: Invalid data", None),
            ("[vist#0:0/h264 @ 0x5] [dec:h264 @ 0x6] [warning] corrupt decoded frame", Some("corrupt decoded frame")),
            (
                "[vist#0:0/h264 @ 0x5] [dec:h264 @ 0x6] [error] Error submitting packet to decoder: Invalid data",
                Some("Error submitting packet to decoder: Invalid data"),
            ),
            ("[mjpeg @ 0x5] [warning] EOI missing, emulating", None),
            ("[info] concealing 75 DC", None),
            ("[info]     title           : corrupt decoded frame", None),
        ] {
            assert_eq!(damage_in(line), expected, "{line}");
        }
    }

    #[test]
    fn what_ffmpeg_could_not_decode_comes_before_its_frame() {
        let log = "[h264 @ 0x5] [error] non-existing PPS 0 referenced\n\
                   [Parsed_showinfo_1 @ 0x5] [info] n: 0 pts: 0 pts_time:0 iskey:1 type:I\n[h264 @ 0x5] [error] no frame!\n\
                   [Parsed_showinfo_1 @ 0x5] [info] n: 1 pts: 1000 pts_time:0.001 iskey:0 type:P\n";
        let (sender, reports) = channel();
        read_reports(log.as_bytes(), Arc::default(), sender).join().expect("it ends");
        let expected = [
            Report::Frame { time: 0.0, is_key: true },
            Report::Damage("no frame!".into()),
            Report::Frame { time: 1.0, is_key: false },
        ];
        assert_eq!(reports.iter().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn doubt_ends_at_a_key_frame_long_after_damage() {
        let mut doubt = Doubt::default();
        assert!(!doubt.end(true) && doubt.begin() && !doubt.begin());
        assert!((0..8).all(|_| !doubt.end(true)) && !doubt.begin());
        assert!((0..LONGEST_AHEAD).all(|_| !doubt.end(true)));
        assert!(!doubt.end(false) && doubt.is_on);
        assert!(doubt.end(true) && !doubt.is_on && doubt.begin());
        for (codec, ends) in [("gif", false), ("apng", false), ("h264", true)] {
            let stated = Stated::parse(&format!("codec_name={codec}\n"));
            let mut doubt = Doubt { is_on: true, frames: LONGEST_AHEAD, ..stated.doubt };
            assert_eq!(doubt.end(true), ends, "{codec}");
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

    #[test]
    fn a_program_that_is_missing_is_named_with_what_to_do() {
        let error = not_started("a.mp4", std::io::Error::from(IoErrorKind::NotFound));
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        assert!(error.to_string().ends_with("not installed; help: sudo apt install ffmpeg"), "{error}");
    }
}
