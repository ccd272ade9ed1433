//! A camera as a source. It gives buffers in order, counts frames that were lost between them, ends every wait, and
//! reconnects after every break.

mod reconnect;

use std::collections::VecDeque;
use std::ffi::OsStr;
use std::io;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use wstac_core::green::any::PixelFormat;

use self::reconnect::Away;
use crate::buffers::{Filled, Wait};
use crate::readout;
use crate::rpicam::{self, RpicamSource};
use crate::same::KnownCamera;
use crate::silence::{WAIT, longest_silence};
use crate::timeline::Timeline;
use crate::wall_clock::{WallClock, monotonic};
use crate::{Camera, Negotiated};
use wstac_host::camera::formats::{self, Coding};
use wstac_host::camera::mjpeg::Decoder;
use wstac_host::camera::modes::fps;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::decorate::RateWatch;
use wstac_host::source::open::{OpenOptions, SourceKind};
use wstac_host::source::{
    Fault, FaultKind, Frame, FramePolicy, Lag, LossReason, Remedy, Source, SourceEvent, StreamClock, StreamInfo,
};

/// Read errors in a row before the stream is started again.
const MOST_ERRORS: u32 = 10;
/// Buffers that are taken at a time: no driver has more.
const MOST_READY: usize = 32;

/// A camera's frames. A break of the stream does not end it: it waits for the same camera and goes on.
///
/// [`RateWatch`] around it also reports a camera that is slower than agreed on, as that of [`Cameras`] does.
#[derive(Debug)]
pub struct CameraSource {
    path: PathBuf,
    /// The options, with exactly what was negotiated. A camera that comes back is asked for it.
    options: OpenOptions,
    known: KnownCamera,
    /// The camera; `None` while it is away.
    camera: Option<Camera>,
    negotiated: Negotiated,
    info: StreamInfo,
    timeline: Timeline,
    decoder: Option<Decoder>,
    /// Whether a fault has said why a JPEG picture is refused.
    is_damage_reported: bool,
    /// The buffer whose bytes the caller has. The next call gives it back.
    lent: Option<Filled>,
    /// The next buffer. Everything before it was reported.
    next: Option<Filled>,
    /// Filled buffers behind the next one, oldest first.
    ready: VecDeque<Filled>,
    /// The error that came after the filled buffers.
    trouble: Option<io::Error>,
    /// Events to report before the next buffer.
    told: VecDeque<SourceEvent<'static>>,
    /// The break of the stream, until a buffer has come again.
    away: Option<Away>,
    /// Whether the driver says that its input has a signal.
    signal: bool,
    lag: Lag,
    /// The time when the last buffer arrived, on the monotonic clock.
    arrived: Duration,
    wall: WallClock,
    /// Waits in a row that brought no buffer.
    waits: u32,
    /// Errors in a row.
    errors: u32,
}

impl CameraSource {
    /// Opens a camera and starts it.
    ///
    /// # Errors
    /// The errors of [`Camera::open`].
    pub fn open(path: impl Into<PathBuf>, options: &OpenOptions) -> Result<Self, Error> {
        let path = path.into();
        Ok(Self::of_camera(Camera::open(&path, options)?, path, options))
    }

    fn of_camera(camera: Camera, path: PathBuf, options: &OpenOptions) -> Self {
        let negotiated = camera.negotiated.clone();
        let (format, decoder) = match negotiated.coding {
            Coding::Raw(format) => (format, None),
            Coding::Jpeg => (PixelFormat::Rgb24, Some(Decoder::new(negotiated.size))),
        };
        let (size, rate) = (negotiated.size, negotiated.rate);
        let mut info = StreamInfo::new(about(&camera), size, format, rate);
        info.color = negotiated.color;
        info.bytes_per_row = negotiated.bytes_per_row;
        info.camera = Some(Box::new(camera.state.clone()));
        let pixels = (size.width().into(), size.height().into());
        info.readout = readout::of_camera(camera.buffers.device(), pixels, rate, Path::new(readout::PARTS));
        if camera.buffers.has_times() {
            info.clock = StreamClock::Driver;
        }
        // A camera that was unplugged comes back with its values of power-on, so the values before are set again.
        let held = if options.keep_controls { Vec::new() } else { camera.state.settings() };
        let options = OpenOptions {
            controls: [held, options.controls.clone()].concat(),
            format: Some(negotiated.fourcc),
            size: Some((size.width().into(), size.height().into())),
            fps: Some(rate),
            ..options.clone()
        };
        Self {
            path,
            options,
            known: KnownCamera::new(&camera.state),
            camera: Some(camera),
            negotiated,
            info,
            timeline: Timeline::new(rate),
            decoder,
            is_damage_reported: false,
            lent: None,
            next: None,
            ready: VecDeque::new(),
            trouble: None,
            told: VecDeque::new(),
            away: None,
            signal: true,
            lag: Lag::default(),
            arrived: monotonic(),
            wall: WallClock::default(),
            waits: 0,
            errors: 0,
        }
    }

    /// Makes a buffer the next one, or adds events to report, or waits in vain.
    fn fetch(&mut self) -> Result<(), Error> {
        if self.camera.is_none() {
            return self.try_reconnect();
        }
        let waited = self.take_ready();
        if !self.ready.is_empty() {
            (self.waits, self.errors) = (0, 0);
            self.choose();
        } else if let Some(error) = self.trouble.take() {
            self.handle_read_error(error);
        } else if waited {
            self.check_stall();
        }
        Ok(())
    }

    /// Takes all filled buffers from the driver, and waits for one if there is none.
    ///
    /// It returns whether it waited in vain.
    fn take_ready(&mut self) -> bool {
        let Some(camera) = &mut self.camera else { return false };
        while self.trouble.is_none() && self.ready.len() < MOST_READY {
            let timeout = if self.ready.is_empty() { WAIT } else { Duration::ZERO };
            match camera.buffers.wait(timeout) {
                Ok(Wait::Filled(filled)) => self.ready.push_back(filled),
                Ok(Wait::TimedOut) => return self.ready.is_empty(),
                Ok(Wait::Interrupted) => return false,
                Err(error) => self.trouble = Some(error),
            }
        }
        false
    }

    /// Makes the oldest ready buffer the next one, or makes it the newest and gives the others back.
    fn choose(&mut self) {
        let (mut dropped, mut skipped) = (0, 0);
        while let Some(filled) = self.ready.pop_front() {
            dropped += self.arrive(&filled);
            if self.options.delivery == FramePolicy::Every || self.ready.is_empty() {
                self.next = Some(filled);
                break;
            }
            skipped += 1;
            self.give_back(filled);
        }
        let waiting = self.ready.len() as u32 + skipped as u32;
        self.lag.frames = waiting;
        self.lag.most = self.lag.most.max(waiting);
        self.lag.skipped += skipped;
        self.lose(dropped, LossReason::Dropped);
        self.lose(skipped, LossReason::Skipped);
    }

    /// Notes a buffer, good or not, and returns how many frames were lost before it.
    fn arrive(&mut self, filled: &Filled) -> u64 {
        let between = std::mem::replace(&mut self.arrived, monotonic());
        let between = self.arrived.saturating_sub(between);
        if let Some(away) = self.away.take() {
            let lost = self.timeline.resume(filled.sequence, filled.timestamp, between);
            self.told.extend(away.back(&self.info, lost).map(SourceEvent::Fault));
            self.lose(lost, away.reason());
            return 0;
        }
        self.timeline.arrive(filled.sequence, filled.timestamp)
    }

    fn lose(&mut self, frames: u64, reason: LossReason) {
        if frames > 0 {
            self.told.push_back(SourceEvent::Lost { frames, reason });
        }
    }

    /// Handles an error of the driver instead of a buffer.
    fn handle_read_error(&mut self, error: io::Error) {
        self.errors += 1;
        if error.raw_os_error() == Some(libc::EIO) && self.errors < MOST_ERRORS {
            // The frame of this moment is lost, wherever it is. The next one's sequence number may count it, too.
            self.timeline.report_lost();
            return self.lose(1, LossReason::Unreadable);
        }
        let device = self.camera.as_ref().map(|camera| camera.buffers.device());
        if let Some(text) = device.map(|device| device.error("cannot be read any further", error).to_string()) {
            self.part(&text);
        }
    }

    /// Notes a wait that brought nothing, and starts the stream again after too many.
    fn check_stall(&mut self) {
        self.waits += 1;
        // Waits are counted instead of a clock's time, because a program that was stopped for a while is no stuck
        // camera.
        let silence = WAIT * self.waits;
        if silence < longest_silence(self.info.rate) {
            return;
        }
        self.look_for_signal();
        if !self.signal {
            // A stream that is started again would be just as silent. The time line starts again all the same.
            self.waits = 0;
            self.away.get_or_insert_with(Away::without_signal);
            return;
        }
        let path = self.path.display();
        let seconds = silence.as_secs();
        self.part(&format!("{path}: no frame for {seconds} s: check the cable and the hub's power"));
    }

    /// Reports if the driver says that the input's signal has gone or come back.
    fn look_for_signal(&mut self) {
        let Some(camera) = &self.camera else { return };
        let signal = !camera.buffers.device().no_signal();
        if signal == std::mem::replace(&mut self.signal, signal) {
            return;
        }
        let path = self.path.display();
        self.told.push_back(SourceEvent::Fault(if signal {
            Fault::new(FaultKind::Signal, format!("{path}: the input has its signal again"))
        } else {
            let message = format!("{path}: the driver says that the input has no signal or power");
            Fault { kind: FaultKind::NoSignal, message, remedy: Some(Remedy::AwaitSignal) }
        }));
    }

    fn give_back(&mut self, filled: Filled) {
        if let Some(camera) = &mut self.camera {
            camera.buffers.give_back(filled);
        }
    }
}

impl Source for CameraSource {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if let Some(lent) = self.lent.take() {
            self.give_back(lent);
        }
        if self.next.is_none() && self.told.is_empty() {
            self.fetch()?;
            if self.next.is_some() {
                self.look_for_signal();
            }
        }
        if let Some(told) = self.told.pop_front() {
            return Ok(told);
        }
        let (Some(filled), Some(camera)) = (self.next.take(), &self.camera) else { return Ok(SourceEvent::Waiting) };
        // The next call gives it back in every case.
        let filled = self.lent.insert(filled);
        if filled.damaged {
            return Ok(SourceEvent::Lost { frames: 1, reason: LossReason::Damaged });
        }
        if !self.signal {
            return Ok(SourceEvent::Lost { frames: 1, reason: LossReason::NoSignal });
        }
        let (bytes, timestamp) = (camera.buffers.bytes(filled), filled.timestamp);
        let sequence = Some(filled.sequence);
        if bytes.len() < self.negotiated.frame_bytes {
            return Ok(SourceEvent::Lost { frames: 1, reason: LossReason::Short });
        }
        self.lag.latency = timestamp.and_then(|timestamp| monotonic().checked_sub(timestamp));
        let lag = self.lag;
        let stamp = timestamp.and_then(|timestamp| self.wall.stamp(timestamp));
        let Some(decoder) = &mut self.decoder else {
            return Ok(SourceEvent::Frame(Frame { timestamp, stamp, sequence, lag, ..Frame::new(bytes) }));
        };
        Ok(match decoder.picture(bytes) {
            Ok(decoded) => {
                let encoded = Some(bytes);
                SourceEvent::Frame(Frame { timestamp, stamp, sequence, encoded, lag, ..Frame::new(decoded) })
            }
            Err(why) if !std::mem::replace(&mut self.is_damage_reported, true) => {
                self.told.push_back(SourceEvent::Lost { frames: 1, reason: why.reason() });
                let message =
                    format!("{}: a JPEG picture is refused: {why}; others count as lost, too", self.path.display());
                SourceEvent::Fault(Fault::new(FaultKind::Decoder, message))
            }
            Err(why) => SourceEvent::Lost { frames: 1, reason: why.reason() },
        })
    }
}

/// Describes a camera: `/dev/video0: Camera, YUYV 1280x720, 30 fps; 12 controls locked`, then the notes.
fn about(camera: &Camera) -> String {
    let negotiated = &camera.negotiated;
    let mut about =
        format!("{}: {}, {}", camera.buffers.device().path.display(), camera.state.card, stream(negotiated));
    for note in std::iter::once(&camera.state.about_controls()).chain(&negotiated.notes) {
        about.push_str("; ");
        about.push_str(note);
    }
    about
}

/// Describes a stream: `YUYV 1280x720, 30 fps`.
fn stream(negotiated: &Negotiated) -> String {
    let (name, size) = (formats::name(negotiated.fourcc), negotiated.size);
    format!("{name} {}x{}, {} fps", size.width(), size.height(), fps(negotiated.rate))
}

/// Cameras as sources by name: `/dev/videoN` or any character device, and `rpicam:` for a Raspberry Pi's.
#[derive(Clone, Copy, Debug)]
pub struct Cameras;

impl SourceKind for Cameras {
    fn expected(&self) -> &'static str {
        "/dev/videoN, rpicam:"
    }

    fn open(&self, name: &OsStr, options: &OpenOptions) -> Option<Result<Box<dyn Source>, Error>> {
        if is_rpicam(name) {
            let opened = RpicamSource::open(name, options);
            return Some(opened.map(|source| Box::new(RateWatch::new(source)) as Box<dyn Source>));
        }
        if is_device(name) {
            let opened = CameraSource::open(name, options);
            return Some(opened.map(|source| Box::new(RateWatch::new(source)) as Box<dyn Source>));
        }
        let is_missing = name.as_encoded_bytes().starts_with(b"/dev/video")
            && Path::new(name).metadata().is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
        let message = "no such camera; wstac devices lists those that there are";
        is_missing.then(|| Err(Error::new(ErrorKind::NotFound, name.display(), message)))
    }
}

/// Returns whether a source's name stands for a camera, which makes its frames now and at its own pace.
#[must_use]
pub fn is_camera(name: impl AsRef<OsStr>) -> bool {
    is_rpicam(name.as_ref()) || is_device(name.as_ref())
}

fn is_rpicam(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(rpicam::START.as_bytes())
}

/// Returns whether a name stands for a camera that has a device node, whose driver can be asked.
#[must_use]
pub fn is_device(name: impl AsRef<OsStr>) -> bool {
    Path::new(name.as_ref()).metadata().is_ok_and(|metadata| metadata.file_type().is_char_device())
}

#[cfg(test)]
mod tests {
    use jpeg_encoder::{ColorType, Encoder};
    use wstac_core::green::ycbcr::YcbcrEncoding;
    use wstac_core::layout::FrameSize;
    use wstac_core::rate::FrameRate;
    use wstac_host::camera::CameraState;
    use wstac_host::output::Output;
    use wstac_host::session::{Poll, Session};

    use super::*;
    use crate::buffers::Stream;
    use crate::device::Device;

    const SIDE: u16 = 200;

    /// A device whose driver gives these pictures, and then nothing.
    #[derive(Debug)]
    struct Pictures {
        device: Device,
        sent: Vec<Vec<u8>>,
        given: usize,
        back: usize,
    }

    impl Stream for Pictures {
        fn device(&self) -> &Device {
            &self.device
        }

        fn has_times(&self) -> bool {
            false
        }

        fn wait(&mut self, _: Duration) -> io::Result<Wait> {
            let index = self.given;
            let Some(picture) = self.sent.get(index).filter(|_| index == self.back) else {
                return Ok(Wait::TimedOut);
            };
            self.given += 1;
            let sequence = index as u32;
            Ok(Wait::Filled(Filled { index, bytes: picture.len(), sequence, timestamp: None, damaged: false }))
        }

        fn bytes(&self, filled: &Filled) -> &[u8] {
            &self.sent[filled.index]
        }

        fn give_back(&mut self, _: Filled) {
            self.back += 1;
        }
    }

    /// Returns a camera that gives these pictures.
    fn camera(pictures: Vec<Vec<u8>>) -> CameraSource {
        let path = PathBuf::from("/dev/null");
        let negotiated = Negotiated {
            fourcc: *b"MJPG",
            coding: Coding::Jpeg,
            size: FrameSize::new(SIDE.into(), SIDE.into()).unwrap(),
            color: YcbcrEncoding::default(),
            bytes_per_row: 3 * u32::from(SIDE),
            frame_bytes: 1,
            rate: FrameRate::NOMINAL,
            notes: Vec::new(),
        };
        let buffers = Box::new(Pictures { device: Device::open(&path).unwrap(), sent: pictures, given: 0, back: 0 });
        let camera = Camera { state: CameraState::default(), negotiated, buffers };
        CameraSource::of_camera(camera, path, &OpenOptions::default())
    }

    /// Returns a picture with restart markers, and the place of its data.
    fn picture() -> (Vec<u8>, usize) {
        let pixels: Vec<u8> =
            (0..u32::from(SIDE) * u32::from(SIDE)).flat_map(|at| [20, (at / 160) as u8, 40]).collect();
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 90);
        encoder.set_restart_interval(10);
        encoder.encode(&pixels, SIDE, SIDE, ColorType::Rgb).unwrap();
        let start = bytes.windows(2).position(|pair| pair == [0xff, 0xda]).unwrap() + 14;
        (bytes, start)
    }

    #[test]
    fn pictures_of_real_cameras_are_read_and_others_are_counted_by_reason() {
        let (clean, start) = picture();
        let before_markers = |extra: &[u8]| {
            let mut bytes = clean.clone();
            for at in (start..clean.len() - 1).rev().filter(|at| clean[*at] == 0xff && clean[at + 1] != 0) {
                bytes.splice(at..at, extra.iter().copied());
            }
            bytes
        };
        let frame = clean.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
        let with = |at: usize, byte: u8| {
            let mut bytes = clean.clone();
            bytes[frame + at] = byte;
            bytes
        };
        let read = [
            clean.clone(),
            before_markers(&[0]),
            before_markers(&[0xff, 0xff]),
            clean[..clean.len() - 2].to_vec(),
            [&clean[..2], &clean].concat(),
            [&clean[..], &[0; 700]].concat(),
        ];
        let refused = [
            clean[..clean.len() / 2].to_vec(),
            b"none".to_vec(),
            with(1, 0xc9),
            with(6, 100),
            before_markers(&[9; 80]),
        ];
        let count = read.len();
        let mut source = camera([&read[..], &refused].concat());
        let mut session = Session::of_frames(source.info().clone()).build().unwrap();
        let (mut frames, mut faults) = (Vec::new(), Vec::new());
        loop {
            let event = source.next_event().unwrap();
            match &event {
                SourceEvent::Frame(frame) => frames.push(frame.bytes.to_vec()),
                SourceEvent::Fault(fault) => faults.push(fault.message.clone()),
                SourceEvent::Waiting => break,
                _ => {}
            }
            session.push(&event);
        }
        assert_eq!(frames.len(), count);
        assert!(frames.iter().all(|frame| *frame == frames[0]));
        let expected =
            ["/dev/null: a JPEG picture is refused: it ends before its last block; others count as lost, too"];
        assert_eq!(faults, expected);
        session.push(&SourceEvent::End);
        let end = loop {
            match session.poll().unwrap() {
                Poll::Output(Output::End(end)) => break end,
                Poll::Over => panic!("no end"),
                _ => {}
            }
        };
        let mut reasons: Vec<_> = end.dropped_by.iter().collect();
        reasons.sort_unstable();
        let expected = [
            ("JPEG picture of a kind that is not decoded", 1),
            ("JPEG picture that ends before its last block", 1),
            ("corrupt JPEG picture", 1),
            ("no JPEG picture", 1),
            ("picture of another size", 1),
        ];
        assert_eq!(reasons, expected);
    }
}
