//! A camera of a Raspberry Pi: the program `rpicam-vid` drives it, and gives frames on a pipe.
//!
//! Such a camera's video node gives raw Bayer data that no program has exposed or scaled, so `rpicam-vid` reads it.
//! Three streams come from the program: frames in YUV420, one after the other; for every frame a block of
//! `Name=value` lines (`--metadata`), with the time when its first row began; and its log. The log states what no
//! option fixes: the size that libcamera made of the one asked for, and the bytes of a frame, whose rows are padded.

mod program;

use std::collections::VecDeque;
use std::ffi::OsStr;
use std::time::Duration;

use wstac_core::green::any::PixelFormat;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_host::camera::modes::fps;
use wstac_host::camera::{CameraState, ControlSetting, LockedControl, UnlockedReason};
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::open::OpenOptions;
use wstac_host::source::{
    Fault, FaultKind, Frame, FramePolicy, Lag, LossReason, Remedy, Source, SourceEvent, StreamClock, StreamInfo,
};

use self::program::{Metadata, Program};
use crate::readout;
use crate::silence::{WAIT, longest_silence};
use crate::timeline::Timeline;
use crate::wall_clock::{WallClock, monotonic};

/// The start of such a source's name; a number of `rpicam-vid --list-cameras` may follow.
pub(crate) const START: &str = "rpicam:";
/// Longest time until the first frame.
const START_TIME: Duration = Duration::from_secs(10);
/// Most frames of the program's queue that are skipped for newer ones.
const MOST_SKIPPED: u32 = 8;
/// Most reads for the rest of a frame that has begun to come: a pipe holds 64 kB.
const MOST_READS: u32 = 1000;
/// The size that other cameras are asked for.
const SIZE: (u32, u32) = (1280, 720);
/// Largest side that is asked for.
const MOST_PIXELS: u32 = 16_384;
/// The part of a frame's time that is exposed at most, if no exposure is given; the other limit is that of the value.
const MOST_EXPOSED: f64 = 0.6;
/// Frames in a row after which their times are believed again.
const EVEN_AGAIN: u32 = 10;
/// The fault about times that do not follow each other.
const WILD: &str = "times of frames stay or jump: each is one frame, and events are not reliable until they are even";
/// Part of a rate or a control's value by which what was set may differ from what was asked for.
const NEAR: f64 = 0.02;
/// Controls that can be set: the name, the least and greatest value, the default, and what the value counts.
const CONTROLS: [(&str, i32, i32, i32, &str); 5] = [
    ("shutter", 10, 10_000_000, 20_000, "µs"),
    ("gain", 100, 10_000, 100, "hundredths"),
    ("red_gain", 1, 3200, 100, "hundredths"),
    ("blue_gain", 1, 3200, 100, "hundredths"),
    ("lens_position", 0, 3200, -1, "hundredths of a diopter"),
];

/// The frames of a Raspberry Pi's camera.
#[derive(Debug)]
pub struct RpicamSource {
    subject: String,
    program: Program,
    info: StreamInfo,
    newest: bool,
    timeline: Timeline,
    wall: WallClock,
    /// The metadata of the next frame, whose bytes the program has.
    next: Option<Metadata>,
    /// Events to report before the next frame.
    told: VecDeque<SourceEvent<'static>>,
    /// Frames that the camera took, and those in a row whose times go on.
    taken: u32,
    even: u32,
    /// The time of the last frame that came, believed or not.
    last: Option<Duration>,
    /// When the last frame came, and when that or a report of silence was.
    arrived: Duration,
    heard: Duration,
    lag: Lag,
}

impl RpicamSource {
    /// Starts `rpicam-vid`, and waits for its first frame.
    ///
    /// # Errors
    /// The program is not installed, or ends; there is no such camera; or an option does not fit.
    pub fn open(name: &OsStr, options: &OpenOptions) -> Result<Self, Error> {
        let name = name.display().to_string();
        let number = name.strip_prefix(START).unwrap_or_default();
        // For messages: rpicam, or rpicam:1.
        let subject = name.trim_end_matches(':').to_owned();
        let rate = options.fps.unwrap_or(FrameRate::NOMINAL);
        let settings = PiSettings::new(&subject, options, rate)?;
        let mut program = Program::start(&subject, &settings.arguments(&subject, number, rate)?)?;
        let started = monotonic();
        while !program.has_frame() {
            if monotonic().saturating_sub(started) > START_TIME {
                let message = "rpicam-vid gives no frame, no length of frames or no metadata within 10 s (expected those \
                               of rpicam-apps 1.0.2 or newer)";
                return Err(Error::new(ErrorKind::Device, subject, message));
            }
            // If the program ends, the error has its last messages.
            program.read(WAIT)?;
        }
        let info = settings.describe(&subject, &program, &program.metadata(), rate)?;
        let timeline = Timeline::new(info.rate);
        let newest = options.delivery == FramePolicy::Newest;
        let (wall, told, lag, next) = (WallClock::default(), VecDeque::new(), Lag::default(), None);
        let (taken, even, last, arrived, heard) = (0, EVEN_AGAIN, None, started, monotonic());
        Ok(Self { subject, program, info, newest, timeline, wall, next, told, taken, even, last, arrived, heard, lag })
    }

    /// Makes a frame the next one, or adds events to report, or waits in vain.
    fn fetch(&mut self) -> Result<(), Error> {
        if !self.program.has_frame() {
            self.program.read(WAIT)?;
            self.check_silence();
        }
        self.told.extend(self.program.faults().map(|line| SourceEvent::Fault(Fault::new(FaultKind::Decoder, line))));
        let mut skipped = 0;
        while self.program.has_frame() {
            let metadata = self.program.take();
            let lost = self.lost_before(metadata.time);
            self.taken = self.taken.wrapping_add(1).wrapping_add(lost as u32);
            self.lose(lost, LossReason::Dropped);
            // The program writes whole frames: if the next one begins to come, all of it is there.
            if !self.newest || skipped == MOST_SKIPPED || !self.program.has_begun_next() {
                self.next = Some(metadata);
                break;
            }
            skipped += 1;
            // The rest of it comes at once, whatever else the program says meanwhile.
            for _ in 0..MOST_READS {
                if self.program.has_frame() || !self.program.read(WAIT)? {
                    break;
                }
            }
        }
        self.lag.frames = skipped;
        self.lag.most = self.lag.most.max(skipped);
        self.lag.skipped += u64::from(skipped);
        self.lose(skipped.into(), LossReason::Skipped);
        Ok(())
    }

    /// Notes a frame, and returns how many were lost before it: by its time, as the program has no numbers of frames.
    fn lost_before(&mut self, time: Option<Duration>) -> u64 {
        let (now, was_silent) = (monotonic(), self.heard > self.arrived);
        let between = now.saturating_sub(self.arrived);
        (self.arrived, self.heard) = (now, now);
        // No frame begins after it came.
        let time = time.filter(|time| *time <= now);
        let last = std::mem::replace(&mut self.last, time);
        if was_silent {
            return self.timeline.resume(0, time, between);
        }
        let mut since = Timeline::new(self.info.rate);
        since.arrive(0, last);
        // If it follows only one that was not believed, the clock was set.
        let believed = [&self.timeline, &since].into_iter().find(|of| of.is_followed_by(time)).cloned();
        self.doubt_times(believed.is_none());
        let Some(timeline) = believed else {
            // It is one frame, and the next one is compared with the last one that was believed.
            self.timeline.report_lost();
            return 0;
        };
        self.timeline = timeline;
        self.timeline.arrive(0, time)
    }

    /// Says that the times of frames do not go on, or that they do again: nothing else counts what is missing.
    fn doubt_times(&mut self, is_wild: bool) {
        let was_even = self.even >= EVEN_AGAIN;
        self.even = if is_wild { 0 } else { self.even.saturating_add(1) };
        let (kind, what) = match (was_even, self.even) {
            (true, 0) => (FaultKind::Uneven, WILD),
            (false, EVEN_AGAIN) => (FaultKind::Even, "frames come evenly again"),
            _ => return,
        };
        self.told.push_back(SourceEvent::Fault(Fault::new(kind, format!("{}: {what}", self.subject))));
    }

    fn lose(&mut self, frames: u64, reason: LossReason) {
        if frames > 0 {
            self.told.push_back(SourceEvent::Lost { frames, reason });
        }
    }

    /// Notes that no frame has come for long. The program itself starts a camera again that gives nothing.
    fn check_silence(&mut self) {
        let silence = monotonic().saturating_sub(self.heard);
        if !self.program.has_frame() && silence >= longest_silence(self.info.rate) {
            self.heard = monotonic();
            let message = format!("{}: no frame for {} s: check the cable", self.subject, silence.as_secs());
            let fault = Fault { remedy: Some(Remedy::Retry), ..Fault::new(FaultKind::Disconnected, message) };
            self.told.push_back(SourceEvent::Fault(fault));
        }
    }
}

impl Source for RpicamSource {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if self.next.is_none() && self.told.is_empty() {
            self.fetch()?;
        }
        if let Some(told) = self.told.pop_front() {
            return Ok(told);
        }
        let Some(Metadata { time: timestamp, .. }) = self.next.take() else { return Ok(SourceEvent::Waiting) };
        self.lag.latency = timestamp.and_then(|timestamp| monotonic().checked_sub(timestamp));
        let stamp = timestamp.and_then(|timestamp| self.wall.stamp(timestamp));
        let (lag, sequence) = (self.lag, Some(self.taken));
        Ok(SourceEvent::Frame(Frame { timestamp, stamp, sequence, lag, ..Frame::new(&self.program.came.frame) }))
    }
}

/// The settings of the camera.
struct PiSettings {
    size: (u32, u32),
    /// The value of each of [`CONTROLS`].
    values: [i32; CONTROLS.len()],
    kept: bool,
}

impl PiSettings {
    fn new(subject: &str, options: &OpenOptions, rate: FrameRate) -> Result<Self, Error> {
        let wrong = |message: String| Err(Error::new(ErrorKind::Usage, subject, message));
        if let Some(format) = options.format.filter(|format| format != b"YU12") {
            return wrong(format!("format is {}, expected YU12, which rpicam-vid gives", format.escape_ascii()));
        }
        let size = options.size.unwrap_or(SIZE);
        let is_size = |side: u32| side.is_multiple_of(2) && (2..=MOST_PIXELS).contains(&side);
        if !is_size(size.0) || !is_size(size.1) {
            return wrong(format!("size is {}x{}, expected even numbers from 2 to {MOST_PIXELS}", size.0, size.1));
        }
        let mut values = CONTROLS.map(|(_, _, _, value, _)| value);
        let exposed = (MOST_EXPOSED * 1e6 / rate.per_second()) as i32;
        values[0] = values[0].min(exposed).max(CONTROLS[0].1);
        if let Some(ControlSetting { name, .. }) = options.controls.first().filter(|_| options.keep_controls) {
            return wrong(format!("control {name} cannot be set with --keep-controls"));
        }
        for ControlSetting { name, value } in &options.controls {
            let place =
                CONTROLS.iter().position(|(known, least, most, ..)| known == name && (least..=most).contains(&value));
            let Some(place) = place else {
                let known = CONTROLS.map(|(name, least, most, _, unit)| format!("{name} {least} to {most} ({unit})"));
                return wrong(format!("control {name} is {value}, expected one of {}", known.join(", ")));
            };
            values[place] = *value;
        }
        Ok(Self { size, values, kept: options.keep_controls })
    }

    fn arguments(&self, subject: &str, number: &str, rate: FrameRate) -> Result<String, Error> {
        if !number.is_empty() && !number.parse::<u8>().is_ok_and(|parsed| parsed.to_string() == number) {
            let message = format!("camera is {number:?}, expected a number of rpicam-hello --list-cameras or none");
            return Err(Error::new(ErrorKind::Usage, subject, message));
        }
        let camera = if number.is_empty() { "0" } else { number };
        let (width, height) = self.size;
        // It runs until it is ended, without a window. A Raspberry Pi 5 would mix the frame with those before as
        // denoising.
        let mut arguments = vec![format!(
            "--timeout=0 --nopreview --verbose=2 --camera={camera} --width={width} --height={height} --framerate={:.4} \
             --codec=yuv420 --denoise=off --flush --output=- --metadata={} --metadata-format=txt",
            rate.per_second(),
            program::METADATA
        )];
        if !self.kept {
            let [_, gain, red, blue, lens] = self.values.map(|value| f64::from(value) / 100.0);
            let gains = format!("--gain={gain:.2} --awbgains={red:.2},{blue:.2}");
            arguments.push(format!("--shutter={} {gains} --autofocus-mode=manual", self.values[0]));
            arguments.extend((lens >= 0.0).then(|| format!("--lens-position={lens:.2}")));
        }
        Ok(arguments.join(" "))
    }

    /// Describes the stream by what the program states.
    fn describe(
        &self,
        subject: &str,
        program: &Program,
        metadata: &Metadata,
        asked: FrameRate,
    ) -> Result<StreamInfo, Error> {
        let wrong = |message: String| Error::new(ErrorKind::Device, subject, message);
        let (width, height) = program.came.log.size.unwrap_or(self.size);
        let size = FrameSize::new(width, height).map_err(|error| wrong(error.to_string()))?;
        // It asks libcamera for the color space of JPEG: BT.601 in full range.
        let (matrix, range) = match program.came.log.color.as_deref() {
            None | Some("sYCC" | "JPEG") => (YcbcrMatrix::Bt601, QuantizationRange::Full),
            Some("SMPTE170M") => (YcbcrMatrix::Bt601, QuantizationRange::Limited),
            Some("Rec709") => (YcbcrMatrix::Bt709, QuantizationRange::Limited),
            Some(other) => return Err(wrong(format!("rpicam-vid gives the color space {other:?}, expected sYCC"))),
        };
        if metadata.time.is_none() {
            return Err(wrong("the metadata of rpicam-vid lack the SensorTimestamp of a frame".into()));
        }
        let measured = metadata.period.and_then(|period| FrameRate::new(1_000_000, period).ok());
        let is_off = |rate: &FrameRate| (rate.per_second() / asked.per_second() - 1.0).abs() > NEAR;
        let slower = measured.filter(is_off);
        let rate = slower.unwrap_or(asked);
        let state = self.state(subject, program, metadata);
        let (card, controls) = (&state.card, state.about_controls());
        let mut about = vec![format!("{subject}: {card}, YUV420 {width}x{height}, {} fps; {controls}", fps(rate))];
        about.extend(slower.map(|_| format!("asked for {} fps", fps(asked))));
        let (asked_width, asked_height) = self.size;
        about.extend(((width, height) != self.size).then(|| format!("asked for {asked_width}x{asked_height}")));
        let mut info = StreamInfo::new(about.join("; "), size, PixelFormat::Yu12, rate);
        info.color = YcbcrEncoding { matrix, range };
        // Rows of Y are padded, and those of Cb and Cr by half of that.
        let bytes = program.came.log.frame_bytes;
        info.bytes_per_row = u32::try_from(2 * bytes / (3 * height as usize)).unwrap_or(u32::MAX);
        if info.bytes_per_row < width || info.frame_bytes() != bytes {
            return Err(wrong(format!("a frame of rpicam-vid has {bytes} bytes, expected {width}x{height} in YUV420")));
        }
        if let (Some(mode), Some(period)) = (program.came.log.mode, metadata.period) {
            info.readout = readout::of_sensor(&state.card, mode, (width, height), f64::from(period) / 1000.0);
        }
        (info.clock, info.camera) = (StreamClock::Driver, Some(Box::new(state)));
        Ok(info)
    }

    fn state(&self, subject: &str, program: &Program, metadata: &Metadata) -> CameraState {
        let read = [metadata.exposure, metadata.gain, metadata.red, metadata.blue, metadata.lens];
        let controls = CONTROLS.iter().zip(self.values).zip(read).filter_map(|(((name, ..), value), read)| {
            let read = read?;
            // The sensor has steps: a row for the exposure.
            let step = if *name == CONTROLS[0].0 { 70.0 } else { 1.0 };
            let is_near = (read - f64::from(value)).abs() <= step + NEAR * f64::from(value);
            let why = match (self.kept, is_near || value < 0) {
                (true, _) => Some(UnlockedReason::Kept),
                (_, true) => None,
                (_, false) => Some(UnlockedReason::from(&*format!("set to {value}, but reads back {read:.0}"))),
            };
            Some(LockedControl { name: (*name).into(), id: 0, value: read.round() as i64, locked: why.is_none(), why })
        });
        CameraState {
            path: (if subject.contains(':') { subject.to_owned() } else { START.to_owned() }).into(),
            links: Vec::new(),
            card: program.came.log.sensor.clone().unwrap_or_else(|| "camera".into()),
            driver: program.name.into(),
            bus: program.came.log.place.clone().unwrap_or_default(),
            format: "YU12".into(),
            controls: controls.collect(),
        }
    }
}
