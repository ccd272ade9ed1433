//! A camera as a source: its buffers in order, what was lost between them, and an end to every wait.

use std::time::Duration;

use wstac_core::green::any::PixelFormat;
use wstac_core::rate::FrameRate;

use super::{Item, Source, StreamInfo};
use crate::camera::buffers::{Filled, Wait};
use crate::camera::formats::{self, Coding};
use crate::camera::mjpeg::{CORRUPT, Decoder};
use crate::camera::modes::fps;
use crate::camera::timeline::Timeline;
use crate::camera::{Camera, CameraRequest};
use crate::error::Error;

/// Longest wait for a frame before the caller may look for signals.
const WAIT: Duration = Duration::from_millis(500);
/// How long no frame may come before the camera is given up, and how many periods of a very slow one.
const LONGEST_SILENCE: Duration = Duration::from_secs(5);
const SILENT_PERIODS: f64 = 3.0;
/// Read errors in a row before the camera is given up.
const MOST_ERRORS: u32 = 10;

/// A camera's frames.
#[derive(Debug)]
pub struct CameraSource {
    camera: Camera,
    info: StreamInfo,
    timeline: Timeline,
    decoder: Option<Decoder>,
    /// The buffer whose bytes the caller has: the next call gives it back.
    lent: Option<Filled>,
    /// A buffer that has arrived after a gap: the gap was told, the buffer is next.
    next: Option<Filled>,
    /// Waits in a row that brought nothing.
    waits: u32,
    /// Errors in a row.
    errors: u32,
}

impl CameraSource {
    /// Opens a camera and starts it.
    ///
    /// # Errors
    /// Those of [`Camera::open`].
    pub fn open(request: &CameraRequest) -> Result<Self, Error> {
        let camera = Camera::open(request)?;
        let negotiated = &camera.negotiated;
        let (format, decoder) = match negotiated.coding {
            Coding::Raw(format) => (format, None),
            Coding::Jpeg => (PixelFormat::Rgb24, Some(Decoder::new(negotiated.size))),
        };
        let info = StreamInfo {
            size: negotiated.size,
            format,
            colour: negotiated.colour,
            bytes_per_row: negotiated.bytes_per_row,
            rate: negotiated.rate,
            taxels_only: false,
            about: about(&camera),
            camera: Some(Box::new(camera.state.clone())),
        };
        let timeline = Timeline::new(negotiated.rate);
        Ok(Self { camera, info, timeline, decoder, lent: None, next: None, waits: 0, errors: 0 })
    }

    /// Waits for a buffer and keeps it as the next one.
    fn wait(&mut self) -> Result<Arrival, Error> {
        match self.camera.buffers.wait(WAIT) {
            Ok(Wait::Filled(filled)) => {
                (self.waits, self.errors) = (0, 0);
                let lost = self.timeline.arrive(filled.sequence, filled.timestamp);
                self.next = Some(filled);
                Ok(Arrival::Buffer { lost })
            }
            Ok(Wait::Interrupted) => Ok(Arrival::Nothing),
            Ok(Wait::TimedOut) => {
                self.waits += 1;
                // Waits are counted, not a clock's time: a program that was stopped for a while is not a stuck camera.
                let silence = WAIT * self.waits;
                if silence < longest_silence(self.info.rate) { Ok(Arrival::Nothing) } else { Err(self.stuck(silence)) }
            }
            Err(error) => {
                self.errors += 1;
                if error.raw_os_error() != Some(libc::EIO) || self.errors >= MOST_ERRORS {
                    return Err(self.camera.buffers.device().error("cannot be read any further", &error));
                }
                // The frame of this moment, wherever it is; the next one's sequence number may count it, too.
                self.timeline.report_lost();
                Ok(Arrival::Unreadable)
            }
        }
    }

    fn stuck(&self, silence: Duration) -> Error {
        let device = self.camera.buffers.device();
        let seconds = silence.as_secs();
        let hint = if device.no_signal() {
            "the driver says that the input has no signal or power"
        } else {
            "check the cable, the hub's power and, for a video input, its signal"
        };
        Error::new(device.path().display(), format!("no frame for {seconds} s: {hint}"))
    }
}

/// From when on a camera of this rate is stuck.
fn longest_silence(rate: FrameRate) -> Duration {
    let periods = SILENT_PERIODS * f64::from(rate.denominator()) / f64::from(rate.numerator());
    Duration::try_from_secs_f64(periods).map_or(Duration::MAX, |periods| periods.max(LONGEST_SILENCE))
}

/// What a wait brought.
enum Arrival {
    /// A buffer, and how many frames were lost before it.
    Buffer { lost: u64 },
    /// One frame that could not be read.
    Unreadable,
    /// Nothing yet.
    Nothing,
}

impl Source for CameraSource {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next(&mut self) -> Result<Item<'_>, Error> {
        if let Some(lent) = self.lent.take() {
            self.camera.buffers.give_back(lent);
        }
        if self.next.is_none() {
            match self.wait()? {
                Arrival::Buffer { lost: 0 } => {}
                Arrival::Buffer { lost } => return Ok(Item::Lost { frames: lost, why: "dropped by the driver" }),
                Arrival::Unreadable => return Ok(Item::Lost { frames: 1, why: "the driver could not read it" }),
                Arrival::Nothing => return Ok(Item::Waiting),
            }
        }
        // Whatever becomes of it, the next call gives it back.
        let Some(filled) = self.next.take() else { return Ok(Item::Waiting) };
        let filled = self.lent.insert(filled);
        if filled.damaged {
            return Ok(Item::Lost { frames: 1, why: "marked as damaged by the driver" });
        }
        let (bytes, timestamp) = (self.camera.buffers.bytes(filled), filled.timestamp);
        let sequence = Some(filled.sequence);
        if bytes.len() < self.camera.negotiated.frame_bytes {
            return Ok(Item::Lost { frames: 1, why: "shorter than a frame" });
        }
        let Some(decoder) = &mut self.decoder else {
            return Ok(Item::Frame { bytes, timestamp, sequence, encoded: None });
        };
        Ok(match decoder.decode(bytes) {
            Some(decoded) => Item::Frame { bytes: decoded, timestamp, sequence, encoded: Some(bytes) },
            None => Item::Lost { frames: 1, why: CORRUPT },
        })
    }
}

/// `/dev/video0: Camera, YUYV 1280x720, 30 fps; 12 controls locked`, then the notes.
fn about(camera: &Camera) -> String {
    let negotiated = &camera.negotiated;
    let mut about = format!(
        "{}: {}, {} {}x{}, {} fps",
        camera.buffers.device().path().display(),
        camera.state.card,
        formats::name(negotiated.fourcc),
        negotiated.size.width(),
        negotiated.size.height(),
        fps(negotiated.rate),
    );
    for note in std::iter::once(&camera.state.about_controls()).chain(&negotiated.notes) {
        about.push_str("; ");
        about.push_str(note);
    }
    about
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_cameras_may_be_silent_for_longer() {
        let silence = |numerator, denominator| longest_silence(FrameRate::new(numerator, denominator).unwrap());
        assert_eq!(silence(30, 1), Duration::from_secs(5));
        assert_eq!(silence(1, 1), Duration::from_secs(5));
        assert_eq!(silence(1, 60), Duration::from_mins(3));
        assert!(silence(1, u32::MAX) > Duration::from_secs(u32::MAX.into()));
    }
}
