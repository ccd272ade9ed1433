//! Standard output and standard error, which may be closed, full or a terminal.

use std::fmt::{self, Write as _};
use std::io::{self, StdoutLock, Write};

use std::path::Path;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::signals::is_readers_time_over;

use wstac_core::motion::Velocity;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::{angle, confidence, real, rounded, with_deviation};
use wstac_host::output::{DisturbedBaseline, Output, TactileEvent};
use wstac_host::plural::counted;
use wstac_host::source::LossReason;
use wstac_host::texture::{Texture, pattern_and_depth};
use wstac_host::visible;

/// Why a command ends early.
#[derive(Debug)]
pub(super) enum Stop {
    /// Nobody reads the output any more, which is no error.
    OutputClosed,
    /// Something cannot be used.
    Failed(Error),
    /// A signal with this number asked for the end before there was a result.
    Interrupted(u8),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::OutputClosed,
            _ => Self::Failed(Error::io("standard output", error)),
        }
    }
}

/// Standard output for text or JSON, without characters that control a terminal.
///
/// Whoever writes must not divide a character between two writes: `write!` never does.
pub(super) struct Visible<W>(W);

/// Returns standard output for text or JSON.
pub(super) fn stdout() -> Visible<StdoutLock<'static>> {
    Visible(io::stdout().lock())
}

impl<W: Write> Write for Visible<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // A pipe that can be written takes this much at once, and what waits in the buffer.
        for part in visible::lines(&String::from_utf8_lossy(bytes)).as_bytes().chunks(2048) {
            wait_for_reader()?;
            self.0.write_all(part)?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// Waits until standard output can be written. After a signal, a reader that takes nothing is waited for no longer.
fn wait_for_reader() -> io::Result<()> {
    let out = io::stdout();
    let longest = Timespec { tv_sec: 0, tv_nsec: 100_000_000 };
    loop {
        match poll(&mut [PollFd::new(&out, PollFlags::OUT)], Some(&longest)) {
            Ok(0) | Err(rustix::io::Errno::INTR) if is_readers_time_over() => {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            Ok(0) | Err(rustix::io::Errno::INTR) => {}
            // Writing says what is wrong.
            Ok(_) | Err(_) => return Ok(()),
        }
    }
}

/// Counts of lost frames by reason.
#[derive(Default)]
pub(super) struct LossReport(Vec<(LossReason, u64)>);

impl LossReport {
    pub(super) fn add(&mut self, frames: u64, reason: &LossReason) {
        match self.0.iter_mut().find(|(known, _)| known == reason) {
            Some((_, count)) => *count = count.saturating_add(frames),
            None => self.0.push((reason.clone(), frames)),
        }
    }

    /// Reports one line per reason.
    pub(super) fn say(&self, note: impl Fn(String)) {
        for (reason, count) in &self.0 {
            note(format!("{} lost: {reason}", counted(*count, "frame")));
        }
    }
}

/// Refuses to overwrite a file without `force`, and always refuses a path that is no file or in no folder.
pub(super) fn check_new(path: &Path, force: bool) -> Result<(), Error> {
    let refused = |kind, message: &str| Err(Error::new(kind, path.display(), message));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if folder.is_some_and(|folder| !folder.is_dir()) {
        return refused(ErrorKind::NotFound, "is in a folder that does not exist, expected an existing one");
    }
    // Checks the path itself: links are refused, wherever they lead.
    match path.symlink_metadata() {
        Err(_) => Ok(()),
        Ok(there) if there.is_dir() => refused(ErrorKind::Io, "is a folder, expected a new file"),
        Ok(there) if !there.is_file() => refused(ErrorKind::Io, "is a device, a pipe or a link, expected a new file"),
        Ok(_) if force => Ok(()),
        Ok(_) => refused(ErrorKind::AlreadyExists, "exists already, expected a new file, or --force to overwrite it"),
    }
}

/// Writes a note of one line to standard error, which may be closed.
pub(super) fn note(message: impl fmt::Display) {
    // A single write, because several threads may write notes.
    let _ = io::stderr().write_all(format!("wstac: {}\n", visible::OneLine(message)).as_bytes());
}

/// Returns a record as one line of text.
pub(super) fn text_of(record: &Output) -> String {
    let mut line = String::new();
    // Writing to a string does not fail.
    let _ = text(&mut line, record);
    line
}

/// Writes a record as one line of text.
pub(super) fn text(line: &mut String, record: &Output) -> fmt::Result {
    match record {
        Output::Features(features) => {
            write!(line, "frame {}  features", features.frame)?;
            features.features.iter().try_for_each(|feature| write!(line, " {:8.4}", real(*feature)))
        }
        Output::Motion(motion) => {
            let Velocity { mm_s, mm_s_sd, degrees, degrees_sd, .. } = motion.velocity;
            write!(line, "frame {}  speed {} mm/s", motion.frame, with_deviation(rounded(mm_s), mm_s_sd))?;
            write!(line, ", direction {}° ± {}°", angle(degrees), short(degrees_sd))
        }
        Output::Event(event) => text_of_event(line, event),
        Output::EarlyTexture(early) => {
            write!(line, "at frame {}: texture ", early.frame.saturating_add(early.frames.into()))?;
            text_of_texture(line, &early.texture)?;
            write!(line, ", from the first {} of the event at frame {}", counted(early.frames, "frame"), early.frame)
        }
        Output::Interrupted(sample) => write!(
            line,
            "incomplete event at frame {}: a gap ended it after {} of 70 frames",
            sample.frame, sample.frames
        ),
        Output::ContactEnd(end) => {
            write!(line, "end of contact at frame {}, of the event at frame {}", end.frame, end.event_frame)
        }
        Output::Fault(report) => {
            write!(line, "at frame {}: {}: {}", report.frame, report.fault.kind, report.fault)
        }
        Output::Lost(lost) => {
            write!(line, "at frame {}: {} lost: {}", lost.frame, counted(lost.frames, "frame"), lost.reason)
        }
        Output::BaselineDisturbed { frame } => write!(line, "at frame {frame}: {DisturbedBaseline}"),
        Output::End(end) => {
            write!(line, "end after {}, {} dropped", counted(end.frames, "frame"), end.dropped)?;
            if !end.baseline_complete {
                line.write_str("; too short for the baseline")?;
            }
            end.incomplete.map_or(Ok(()), |sample| {
                write!(line, "; an event at frame {} was incomplete: {} of 70 frames", sample.frame, sample.frames)
            })
        }
        _ => line.write_str("an output of a newer library"),
    }
}

fn text_of_event(line: &mut String, event: &TactileEvent) -> fmt::Result {
    write!(line, "event at frame {}: ", event.frame)?;
    match event.contact {
        Some(contact) if event.speed.is_err() => write!(line, "{contact}")?,
        Some(contact) => {
            write!(line, "{contact}, ")?;
            text_of_motion(line, event)?;
        }
        None => text_of_motion(line, event)?,
    }
    if let Ok(texture) = &event.texture {
        line.write_str(", texture ")?;
        text_of_texture(line, texture)?;
    }
    if event.frames_filled > 0 {
        write!(line, ", {} of 70 frames filled", event.frames_filled)?;
    }
    if !event.reliable {
        line.write_str(", not reliable")?;
        if let Some(doubt) = event.doubt {
            write!(line, ": {doubt}")?;
        }
    }
    Ok(())
}

/// Writes speed and direction, or why there is none.
fn text_of_motion(line: &mut String, event: &TactileEvent) -> fmt::Result {
    match (event.speed, event.speed_at_most) {
        (Ok(speed), _) => {
            let mm_s = rounded(speed.mm_s);
            match speed.sd {
                Some(sd) => write!(line, "speed {} mm/s", with_deviation(mm_s, sd))?,
                None => write!(line, "speed {mm_s:.0} mm/s")?,
            }
            if speed.extrapolated {
                line.write_str(" (extrapolated)")?;
            }
        }
        (Err(why), Some(most)) => {
            let extrapolated = if most.extrapolated { "extrapolated; " } else { "" };
            write!(line, "speed at most {:.0} mm/s ({extrapolated}{})", rounded(most.mm_s), why.as_str())?;
        }
        (Err(why), None) => write!(line, "no speed ({})", why.as_str())?,
    }
    match event.direction.degrees {
        Ok(degrees) => {
            write!(line, ", direction {}°", angle(degrees))?;
            match (confidence(event.direction), event.direction.sd) {
                (Some(confidence), _) => write!(line, " (confidence {confidence:.2})"),
                (None, Some(sd)) => write!(line, " ± {}°", short(sd)),
                (None, None) => Ok(()),
            }
        }
        Err(why) => write!(line, ", no direction ({})", why.as_str()),
    }
}

/// Returns a standard deviation with one decimal below 10, and without above.
fn short(sd: f32) -> String {
    if sd < 9.95 { format!("{sd:.1}") } else { format!("{sd:.0}") }
}

fn text_of_texture(line: &mut String, texture: &Texture) -> fmt::Result {
    // The name of a specimen has both. Another model may disagree with it.
    let of_name = texture.specimen.as_deref().map(pattern_and_depth);
    let (pattern, depth) = of_name.unwrap_or_default();
    let mut words: Vec<String> = texture.specimen.iter().chain(&texture.class).cloned().collect();
    words.extend(texture.pattern.clone().filter(|_| texture.pattern != pattern));
    words.extend(texture.depth_mm.filter(|_| texture.depth_mm != depth).map(|depth| format!("{depth} mm deep")));
    match (texture.known, texture.confidence) {
        (Some(false), _) => line.write_str("unknown"),
        // Rounded down: nothing is certain.
        (_, Some(confidence)) => {
            write!(line, "{} (confidence {:.2})", words.join(", "), (100.0 * confidence).floor() / 100.0)
        }
        (_, None) => line.write_str(&words.join(", ")),
    }
}
