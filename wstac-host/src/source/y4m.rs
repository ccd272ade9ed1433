//! Y4M (YUV4MPEG2): a header line, then frames, each a `FRAME` line and raw planes. The format is that of mjpegtools'
//! `yuv4mpeg(5)`, with the words that ffmpeg adds to it.
//!
//! One buffer holds the bytes that were read: the frame that is handed out and at most a line of the next one. So a
//! frame takes one large read and no copy. The buffer grows as bytes arrive, not as a header claims.
//!
//! The reader is our own. The `y4m` crate allocates what a header claims, and takes a frame that is cut off for the end
//! of the stream.

mod header;
pub(super) mod input;

use std::fmt::Display;
use std::io::Read;
use std::ops::Range;
use std::os::fd::AsFd;
use std::path::Path;
use std::time::{Duration, Instant};

use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::rate::FrameRate;

use self::header::Header;
pub use self::header::header_of;
use self::input::{Got, Input};
use super::{Frame, Source, SourceEvent, StreamInfo, replaced_rate};
use crate::error::{Error, ErrorKind};

/// The word that a Y4M stream starts with.
pub const MAGIC: &[u8] = b"YUV4MPEG2";

/// Longest header or `FRAME` line, newline included, in bytes.
const LONGEST_LINE: usize = 4096;
/// Bytes that the buffer starts with: the capacity of a pipe.
const FIRST_READ: usize = 65_536;
/// Longest time that a call goes on reading a frame that arrives slowly.
const LONGEST_CALL: Duration = Duration::from_millis(500);

/// A Y4M file or stream.
pub struct Y4m {
    info: StreamInfo,
    reader: InputBuffer,
    /// Bytes of a frame, without its line.
    frame_bytes: usize,
    limited_bits: Option<u32>,
    /// Number of the frame that comes next.
    frame: u64,
    ended: bool,
}

/// Bytes that were read and not yet used.
struct InputBuffer {
    subject: String,
    input: Input,
    buffer: Vec<u8>,
    /// Bytes at the buffer's start that were read.
    filled: usize,
    /// Bytes at the buffer's start that the caller is done with.
    used: usize,
}

enum NextFrame {
    Frame(Range<usize>),
    Waiting,
    End,
}

impl Y4m {
    /// Opens a file or a named pipe. `fps` replaces the header's rate.
    ///
    /// # Errors
    /// The file cannot be read, or its header has something that this reader does not know. The error names the field,
    /// what was found and what was expected.
    pub fn open(path: &Path, fps: Option<FrameRate>) -> Result<Self, Error> {
        let subject = path.display().to_string();
        let file = crate::files::open(path).map_err(|error| Error::io(&subject, error))?;
        if file.metadata().is_ok_and(|metadata| metadata.is_dir()) {
            return Err(Error::new(ErrorKind::Format, &subject, "is a folder, expected a Y4M file"));
        }
        Self::new(subject, Input::Polled(file), fps)
    }

    /// Reads standard input.
    ///
    /// While it waits for the header, a signal that is handled ends the wait with an error.
    ///
    /// # Errors
    /// The errors of [`Y4m::open`].
    pub fn standard_input(fps: Option<FrameRate>) -> Result<Self, Error> {
        Self::from_fd("standard input", std::io::stdin(), fps)
    }

    /// Reads a descriptor, and never waits for it longer than half a second. `subject` names it in errors.
    ///
    /// # Errors
    /// The errors of [`Y4m::open`].
    pub fn from_fd(subject: &str, descriptor: impl AsFd, fps: Option<FrameRate>) -> Result<Self, Error> {
        let owned = descriptor.as_fd().try_clone_to_owned().map_err(|error| Error::io(subject, error))?;
        Self::new(subject.into(), Input::Polled(owned.into()), fps)
    }

    /// Reads anything, and may block. `subject` names it in errors.
    ///
    /// # Errors
    /// The errors of [`Y4m::open`].
    pub fn from_reader(
        subject: &str,
        reader: impl Read + Send + 'static,
        fps: Option<FrameRate>,
    ) -> Result<Self, Error> {
        Self::new(subject.into(), Input::Blocking(Box::new(reader)), fps)
    }

    fn new(subject: String, input: Input, fps: Option<FrameRate>) -> Result<Self, Error> {
        let mut reader = InputBuffer { subject, input, buffer: Vec::new(), filled: 0, used: 0 };
        let line = reader.header_line()?;
        let line_bytes = reader.buffer.get(MAGIC.len()..line).unwrap_or_default();
        let header = Header::parse(line_bytes, fps)
            .map_err(|message| Error::new(ErrorKind::Format, &reader.subject, message))?;
        reader.used = line + 1;
        let green = Any::new(header.format, header.color, YcbcrMethod::Exact);
        let bytes_per_row = green.row_bytes(header.size.width());
        // This is at most 2^14 · 2^15 bytes, or three planes of 2^28.
        let frame_bytes = green.frame_bytes(header.size, bytes_per_row);
        let ((width, height), rate) = (header.size.into(), replaced_rate::readable(header.rate));
        let remark = replaced_rate::remark(header.own_rate, fps);
        let assumed = "; no range is stated: limited, unless --range says full";
        let range = if header.is_range_assumed { assumed } else { "" };
        let (subject, format) = (&reader.subject, &header.name);
        let about = format!("{subject}: Y4M, {width}x{height} {format}, {rate} frames per second{remark}{range}");
        let info = StreamInfo {
            color: header.color,
            bytes_per_row: bytes_per_row as u32,
            ..StreamInfo::new(about, header.size, header.format, header.rate)
        };
        Ok(Self { info, reader, frame_bytes, limited_bits: header.limited_bits, frame: 0, ended: false })
    }

    /// Reads on until the next frame is whole; it is still the next one then.
    fn gather(&mut self) -> Result<NextFrame, Error> {
        let started = Instant::now();
        // Unused bytes go to the buffer's start. Once the buffer has its full size, these are at most a line.
        let InputBuffer { buffer, filled, used, .. } = &mut self.reader;
        buffer.copy_within(*used..*filled, 0);
        (*filled, *used) = (*filled - *used, 0);
        loop {
            let line = self.reader.frame_line(self.frame)?;
            if let Some(line) = line
                && self.reader.filled - line >= self.frame_bytes
            {
                return Ok(NextFrame::Frame(line..line + self.frame_bytes));
            }
            match self.reader.fill(self.frame_bytes + LONGEST_LINE)? {
                Got::Nothing | Got::Interrupted => return Ok(NextFrame::Waiting),
                Got::Bytes(0) if self.reader.filled == 0 => return Ok(NextFrame::End),
                Got::Bytes(0) => return Err(self.truncated(line)),
                Got::Bytes(_) if started.elapsed() > LONGEST_CALL => return Ok(NextFrame::Waiting),
                Got::Bytes(_) => {}
            }
        }
    }

    fn step(&mut self) -> Result<NextFrame, Error> {
        let step = self.gather()?;
        if let NextFrame::Frame(range) = &step {
            self.frame += 1;
            self.reader.used = range.end;
            if let Some(bits) = self.limited_bits {
                make_full(self.reader.buffer.get_mut(range.clone()).unwrap_or_default(), bits);
            }
        }
        Ok(step)
    }

    /// Returns whether the next frame, the end or an error is there, so that [`Source::next_event`] does not wait.
    pub(super) fn has_next(&mut self) -> bool {
        self.ended || !matches!(self.gather(), Ok(NextFrame::Waiting))
    }

    /// Returns whether the next frame is whole.
    pub(super) fn has_frame(&mut self) -> bool {
        !self.ended && matches!(self.gather(), Ok(NextFrame::Frame(_)))
    }

    /// Creates the error for a stream that ends inside a frame.
    fn truncated(&self, line: Option<usize>) -> Error {
        let found = match line {
            Some(line) => format!("has {} bytes, expected {}", self.reader.filled - line, self.frame_bytes),
            None => "ends within its FRAME line".into(),
        };
        self.reader.error(format_args!("truncated: frame {} (the first is 0) {found}", self.frame))
    }
}

/// Makes full range of gray of limited range.
fn make_full(bytes: &mut [u8], bits: u32) {
    let (shift, most) = (bits - 8, (1_u64 << bits) - 1);
    let full =
        |level: u64| ((2 * level.saturating_sub(16 << shift) * most + (219 << shift)) / (438 << shift)).min(most);
    for level in bytes.chunks_exact_mut(bits.div_ceil(8) as usize) {
        let made = full(level.iter().rev().fold(0, |all, byte| (all << 8) | u64::from(*byte)));
        level.iter_mut().zip(made.to_le_bytes()).for_each(|(byte, made)| *byte = made);
    }
}

impl Source for Y4m {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if self.ended {
            return Ok(SourceEvent::End);
        }
        let step = self.step();
        self.ended = matches!(step, Err(_) | Ok(NextFrame::End));
        Ok(match step? {
            NextFrame::Frame(range) => {
                SourceEvent::Frame(Frame::new(self.reader.buffer.get(range).unwrap_or_default()))
            }
            NextFrame::Waiting => SourceEvent::Waiting,
            NextFrame::End => SourceEvent::End,
        })
    }
}

impl InputBuffer {
    fn error(&self, message: impl Display) -> Error {
        Error::new(ErrorKind::Format, &self.subject, message)
    }

    /// Reads until the header's newline, and returns where that is.
    fn header_line(&mut self) -> Result<usize, Error> {
        loop {
            if let Some(at) = self.line(MAGIC, "", "\"YUV4MPEG2 \" as every Y4M does", "header line")? {
                return Ok(at);
            }
            let found = self.filled;
            match self.fill(FIRST_READ)? {
                Got::Bytes(0) if found == 0 => return Err(self.error("is empty, expected a Y4M header")),
                Got::Bytes(0) => return Err(self.error(format_args!("ends within its header, after {found} bytes"))),
                Got::Interrupted => {
                    return Err(Error::new(ErrorKind::Io, &self.subject, "interrupted before its header was complete"));
                }
                Got::Bytes(_) | Got::Nothing => {}
            }
        }
    }

    /// Returns the length of the `FRAME` line at the buffer's start, newline included; `None` until all of it is there.
    fn frame_line(&self, frame: u64) -> Result<Option<usize>, Error> {
        let (of, name) = (format_args!("frame {frame} "), format_args!("FRAME line of frame {frame}"));
        Ok(self.line(b"FRAME", of, "\"FRAME\"", name)?.map(|at| at + 1))
    }

    /// Returns the place of the newline of a line that begins with a word; `None` until it is there.
    fn line(
        &self,
        word: &[u8],
        of: impl Display,
        expected: impl Display,
        name: impl Display,
    ) -> Result<Option<usize>, Error> {
        let bytes = self.buffer.get(..self.filled).unwrap_or_default();
        let start = bytes.get(..word.len()).unwrap_or(bytes);
        let next = bytes.get(word.len());
        if !word.starts_with(start) || next.is_some_and(|next| ![b' ', b'\n'].contains(next)) {
            let start = bytes.get(..bytes.len().min(word.len() + 1)).unwrap_or_default().escape_ascii();
            return Err(self.error(format_args!("{of}starts with \"{start}\", expected {expected}")));
        }
        let newline = bytes.iter().take(LONGEST_LINE).position(|&byte| byte == b'\n');
        if newline.is_none() && bytes.len() >= LONGEST_LINE {
            return Err(self.error(format_args!("{name} has no end in {LONGEST_LINE} bytes")));
        }
        Ok(newline)
    }

    /// Reads once, into a buffer of up to `most` bytes.
    fn fill(&mut self, most: usize) -> Result<Got, Error> {
        let size = self.buffer.len();
        if self.filled == size {
            let more = (2 * size).max(FIRST_READ).min(most).saturating_sub(size);
            let no_room = |error| {
                Error::new(ErrorKind::Io, &self.subject, format_args!("no memory for its frames: {error}"))
                    .caused_by(error)
            };
            self.buffer.try_reserve_exact(more).map_err(no_room)?;
            self.buffer.resize(size + more, 0);
        }
        let room = self.buffer.get_mut(self.filled..).unwrap_or_default();
        let got = self.input.read(room).map_err(|error| Error::io(&self.subject, error))?;
        if let Got::Bytes(count) = got {
            self.filled += count;
        }
        Ok(got)
    }
}

#[cfg(test)]
mod tests;
