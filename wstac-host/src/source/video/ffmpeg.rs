//! ffmpeg as a process, and its log: times of frames, and what it could not decode.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, ErrorKind as IoErrorKind, Read};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

#[cfg(feature = "jpeg")]
use crate::camera::mjpeg::Refusal;
use crate::error::{Error, ErrorKind};

/// Most bytes that are kept of what ffmpeg reports.
const MOST_REPORTED: usize = 2000;
/// An error that concerns no picture: many cameras write such a marker.
const HARMLESS: &str = "unable to decode APP fields";
/// Most bytes of a line of ffmpeg's log that are read as one.
const LONGEST_LINE: u64 = 4096;

/// ffmpeg, and what it reports.
pub(super) struct Decoder {
    process: Child,
    reported: Arc<Mutex<Vec<u8>>>,
    reader: Option<JoinHandle<()>>,
    /// Times and damage of frames. `None` if they do not come in time.
    pub(super) reports: Option<Receiver<Report>>,
}

/// A report of ffmpeg, which comes before its frame.
#[derive(Debug, PartialEq)]
pub(super) enum Report {
    Frame {
        /// Milliseconds; not a number for a frame without a time.
        time: f64,
        is_key: bool,
    },
    /// An error in the frame, or in one that the frame is made of.
    Damage(String),
    /// Pictures that cannot be decoded, whose frames never come: the time of the last, and why the first is refused.
    #[cfg(feature = "jpeg")]
    Lost { time: f64, frames: u64, why: Refusal, is_first: bool },
}

impl Decoder {
    /// Starts ffmpeg, which reads nothing from its input. Returns its output, and the way for reports of others.
    pub(super) fn start<'a>(
        subject: &str,
        path: &Path,
        options: impl Iterator<Item = &'a str>,
        input: Stdio,
    ) -> Result<(Self, ChildStdout, Sender<Report>), Error> {
        let mut process = ffmpeg("ffmpeg", path)
            .args(options)
            .stdin(input)
            // A signal to the program must not end the decoder before the program has read what it wants.
            .process_group(0)
            .spawn()
            .map_err(|error| not_started(subject, error))?;
        let (output, errors) = (process.stdout.take(), process.stderr.take());
        let reported = Arc::new(Mutex::new(Vec::new()));
        let (sender, reports) = channel();
        let reader = errors.map(|errors| read_reports(errors, Arc::clone(&reported), sender.clone()));
        let decoder = Self { process, reported, reader, reports: Some(reports) };
        let output = output.ok_or_else(|| Error::new(ErrorKind::Io, subject, "ffmpeg has no output"))?;
        Ok((decoder, output, sender))
    }

    /// Waits until ffmpeg has ended. Returns the first error that it reported, of which the others follow; `None` if
    /// all went well.
    pub(super) fn end(&mut self) -> Option<String> {
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

/// The formats of ffmpeg that hold pictures themselves. Lists of other files are none of them.
const FORMATS: &str = "3gp,apng,asf,av1,avi,cavsvideo,dirac,dv,flv,gif,h261,h263,h264,hevc,ivf,jpeg_pipe,live_flv,m4v,\
                       matroska,mjpeg,mov,mpeg,mpegts,mpegvideo,mpjpeg,mxf,nut,obu,ogg,png_pipe,rm,vc1,webm,webp_pipe,\
                       wtv,yuv4mpegpipe";

/// Returns a command of ffmpeg that reads this file, and nothing else.
pub(super) fn ffmpeg(program: &str, path: &Path) -> Command {
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
    // A playlist could name other files or the network, whatever its own name says.
    command.args(["-protocol_whitelist", "file", "-format_whitelist", FORMATS, "-i"]).arg(input);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Returns the error of a program of ffmpeg that could not be started.
pub fn not_started(subject: &str, error: std::io::Error) -> Error {
    if error.kind() == IoErrorKind::NotFound {
        let message = "a video needs ffmpeg, which is not installed; help: sudo apt install ffmpeg";
        return Error::new(ErrorKind::Unsupported, subject, message);
    }
    Error::new(ErrorKind::Io, subject, format_args!("ffmpeg does not start: {error}")).caused_by(error)
}

/// Returns a line without the parts of ffmpeg that it comes from, whose addresses differ from run to run.
pub(super) fn without_context(line: &str) -> &str {
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
                // The output of copied pictures begins.
                has_begun |= line.contains("framecrc,");
                // Before the first frame, it looks for the rate and the size, in other streams, too, and for a key
                // frame.
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
    fn a_program_that_is_missing_is_named_with_what_to_do() {
        let error = not_started("a.mp4", std::io::Error::from(IoErrorKind::NotFound));
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        assert!(error.to_string().ends_with("not installed; help: sudo apt install ffmpeg"), "{error}");
    }
}
