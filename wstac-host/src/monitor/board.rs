//! Turns a board's messages into reports.

use std::fmt::Write;

use wstac_core::features::Features;
use wstac_core::paper::trigger::{InterruptedSample, StreamEnd, TriggerConfig};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::wire::{
    Answers, BusLines, Fault, FrameNumbers, FramePart, FrameTime, Hello, Message, ModelFacts, RegisterValues, Request,
    SAMPLE_PART, Telemetry, TextureAnswer, Wanted,
};

use super::Report;
use super::clock::BoardClock;
use super::delivery::{Arrival, Delivery};
use crate::frame_clock::FrameClock;
use crate::output::{
    ContactEndReport, DisturbedBaseline, EarlyTexture, FrameFeatures, InterruptedReport, MotionReport, Output,
    OutputOptions, RecordTimes, SlipReport, StreamClock, StreamSummary, TactileEvent,
};
use crate::plural::counted;
use crate::texture::Texture;

// Sensors that a firmware may find and not drive.
const OV7670: u16 = 0x7673;
const MT9M114: u16 = 0x2481;

/// The state of a board, as its messages show it.
#[derive(Clone, Debug, Default)]
pub(super) struct BoardState {
    wanted: OutputOptions,
    sample: Parts,
    /// The stream's state as the messages show it. It serves an end that the board does not report.
    progress: StreamSummary,
    /// The frames of its baseline, until it says itself whether that is complete.
    baseline_frames: Option<u16>,
    /// The times of its frames; `None` before it has described itself: then its rate is known.
    clock: Option<FrameClock>,
    pub(super) own_clock: BoardClock,
    /// Whether it has named a texture model.
    has_model: bool,
    delivery: Delivery,
    lost_events: u64,
    /// States of the board that came before its clock was matched.
    unmatched: u8,
    uptime_ms: u64,
    /// The number of times that requests were repeated that the board has not taken.
    repeats: u8,
    baseline_said: bool,
    pub(super) ended: bool,
}

/// The most times that requests are repeated in a row. A board may be unable to receive.
const MOST_REPEATS: u8 = 10;
/// The states, one per second, after which a board counts as one whose clock cannot be matched.
const MOST_UNMATCHED: u8 = 3;

impl BoardState {
    pub(super) fn new(wanted: OutputOptions) -> Self {
        Self { wanted, baseline_frames: Some(TriggerConfig::default().baseline_frames()), ..Self::default() }
    }

    /// Returns the requests for the outputs that are wanted. A board that starts does not know them.
    pub(super) fn requests(&self) -> [Request; 4] {
        let OutputOptions { features, samples, motion, .. } = self.wanted;
        [Request::Features(features), Request::Samples(samples), Request::Motion(motion), Request::KeepEvents(true)]
    }

    fn has_taken_requests(&self, taken: Wanted) -> bool {
        let OutputOptions { features, samples, motion, .. } = self.wanted;
        (taken.features, taken.samples, taken.motion, taken.kept_events) == (features, samples, motion, true)
    }

    /// Forgets what was known of a board that has started again, but this.
    fn restart(&mut self, progress: StreamSummary, clock: Option<FrameClock>) {
        let mut own_clock = std::mem::take(&mut self.own_clock);
        own_clock.answers.clear();
        *self = Self { progress, clock, own_clock, lost_events: self.lost_events, ..Self::new(self.wanted) };
    }

    /// Returns the state of the stream, which is the end record of a board that gives none.
    pub(super) fn finish(&self) -> StreamSummary {
        let progress = StreamSummary { lost_events: self.lost_events, ..self.progress };
        self.clock.as_ref().map_or(progress, |clock| progress.by_clock(clock))
    }

    /// Returns the times of a frame by its number, as far as they are known.
    fn times(&self, frame: u64) -> RecordTimes {
        RecordTimes::new(frame, self.clock.as_ref())
    }

    /// Notes that this many frames have passed.
    fn reach(&mut self, frames: u64) {
        self.progress.frames = self.progress.frames.max(frames);
    }

    /// Notes a sample that was being captured until this many frames had passed, or that begins there. The baseline is
    /// complete then.
    fn contact(&mut self, frames: u64, incomplete: Option<InterruptedSample>) {
        self.reach(frames);
        self.progress.baseline_complete = true;
        self.progress.incomplete = incomplete;
    }

    /// Takes a message and adds everything that follows from it to `reports`.
    ///
    /// `first` says whether it is the first message of a board that has just started.
    pub(super) fn take(&mut self, message: &Message<'_>, first: bool, reports: &mut Vec<Report>) {
        match message {
            Message::Hello(hello) => self.hello(hello, first, reports),
            Message::Features { frame, features } => {
                self.reach(frame.saturating_add(1));
                self.progress.baseline_complete |=
                    self.baseline_frames.is_some_and(|of| self.progress.frames >= of.into());
                let RecordTimes { time_ns, stamp, .. } = self.times(*frame);
                let (frame, features, sums) = (*frame, *features, None);
                let record = Output::Features(FrameFeatures { frame, time_ns, stamp, features, sums });
                reports.extend(self.wanted.features.then_some(Report::Output(record)));
            }
            Message::SamplePart { frame, first, features } => {
                self.sample.take(*frame, *first, features);
            }
            Message::Event(answers) => self.event(answers, reports),
            Message::Texture { frame, frames, texture } => {
                let so_far = InterruptedSample::new(*frame, *frames);
                self.contact(frame.saturating_add(u64::from(*frames)), Some(so_far));
                let texture = texture_of(texture);
                let (frame, frames, RecordTimes { time_ns, stamp, .. }) = (*frame, *frames, self.times(*frame));
                let early = EarlyTexture { frame, time_ns, stamp, frames, texture };
                reports.push(Report::Output(Output::EarlyTexture(early)));
            }
            Message::InterruptedSample(sample) => {
                self.contact(sample.frame.saturating_add(u64::from(sample.frames)), None);
                reports.push(Report::Output(Output::Interrupted(InterruptedReport::new(*sample, self.clock.as_ref()))));
            }
            Message::Motion { frame, velocity, basis } => {
                self.reach(frame.saturating_add(1));
                let record = Output::Motion(MotionReport::new(*frame, *velocity, *basis, self.clock.as_ref()));
                reports.extend(self.wanted.motion.then_some(Report::Output(record)));
            }
            Message::ContactEnd(end) => {
                self.reach(end.frame);
                reports.push(Report::Output(Output::ContactEnd(ContactEndReport::new(*end, self.clock.as_ref()))));
            }
            Message::Slip(slip) => {
                self.reach(slip.frame.saturating_add(1));
                reports.push(Report::Output(Output::Slip(SlipReport::new(*slip, self.clock.as_ref()))));
            }
            Message::Lost { frames } => {
                self.progress.dropped = self.progress.dropped.saturating_add(*frames);
                reports.push(Report::Note(format!("{} lost by the board", counted(*frames, "frame"))));
            }
            Message::Fault(fault) => reports.push(Report::Note(format!("the board: {}", fault_in_words(fault)))),
            Message::Status { stream, dropped } => self.status(stream, *dropped, reports),
            Message::End { stream, dropped } => {
                self.status(stream, *dropped, reports);
                self.ended = true;
                reports.push(Report::Output(Output::End(self.finish())));
            }
            Message::Telemetry(telemetry) => self.telemetry(telemetry, reports),
            Message::Time { host_us, board_us } => {
                self.own_clock.answered(*host_us, *board_us);
            }
            // The decoder does not know the messages of a newer core either, so no others arrive here.
            _ => {}
        }
    }

    fn hello(&mut self, hello: &Hello<'_>, first: bool, reports: &mut Vec<Report>) {
        let again = self.clock.is_some();
        // The times of frames stay known while the same board runs on.
        let mut new = FrameClock::new(hello.rate, StreamClock::Board);
        if self.own_clock.now.is_none() {
            new.count_frames();
        }
        if !self.clock.as_ref().is_some_and(|clock| clock.has_rate_of(&new)) {
            self.clock = Some(new.clone());
        }
        if hello.frame == 0 {
            // At frame 0, a board that was asked sends the same as one that starts. If frames were seen before, they
            // are gone: that proves a start whose first message was lost.
            let back = self.progress.frames > 0;
            if first || back {
                self.restart(StreamSummary::default(), Some(new));
            }
            if back || (first && again) {
                reports.push(Report::Note("the board has started again".to_owned()));
            }
            // It does no harm to send the request once too often.
            reports.extend(self.requests().map(Report::Request));
        }
        self.has_model = hello.models.iter().any(Option::is_some);
        self.baseline_frames = self.baseline_frames.and(Some(hello.trigger.baseline_frames()));
        self.reach(hello.frame);
        reports.extend((!again).then(|| Report::Note(hello_in_words(hello))));
    }

    fn event(&mut self, answers: &Answers<'_>, reports: &mut Vec<Report>) {
        reports.push(Report::Request(Request::Acknowledge { event: answers.number }));
        let Arrival { is_new, lost } = self.delivery.take(answers.number, answers.frame, answers.kept);
        self.lose(lost, reports);
        if !is_new {
            return;
        }
        self.contact(answers.last_frame().saturating_add(1), None);
        let in_words = |answer: &TextureAnswer<'_>| (answer.task, texture_of(answer));
        let texture = Texture::of_all(answers.textures.iter().flatten().map(in_words).collect());
        let sample = self.sample.of(answers.frame).filter(|_| self.wanted.samples);
        if self.wanted.samples && sample.is_none() {
            reports.push(Report::Note(format!("the sample of the event at frame {} did not arrive", answers.frame)));
        }
        let event = TactileEvent::from_answers(answers, texture, self.has_model, sample, self.clock.as_ref());
        reports.push(Report::Output(Output::Event(Box::new(event))));
    }

    fn telemetry(&mut self, telemetry: &Telemetry, reports: &mut Vec<Report>) {
        if telemetry.uptime_ms < self.uptime_ms {
            // The board has started again, and its first message was lost. The status before this message was new.
            self.restart(self.progress, self.clock.as_ref().map(FrameClock::renewed));
            reports.push(Report::Note("the board has started again".to_owned()));
        }
        self.uptime_ms = telemetry.uptime_ms;
        self.match_clock(telemetry.last_frame);
        let lost = self.delivery.take_state(telemetry.events, telemetry.kept);
        self.lose(lost, reports);
        if self.has_taken_requests(telemetry.wanted) {
            self.repeats = 0;
        } else if self.repeats < MOST_REPEATS {
            self.repeats += 1;
            reports.extend(self.requests().map(Report::Request));
        }
        reports.push(Report::Telemetry(*telemetry, self.own_clock.matched()));
    }

    /// Takes the time of the last frame. Until the clocks are matched, frames have no times; if they cannot be matched,
    /// frames are counted.
    fn match_clock(&mut self, last: Option<FrameTime>) {
        let Some(clock) = &mut self.clock else { return };
        let time = last.and_then(|last| Some((last.frame, self.own_clock.of_board(last.board_us)?)));
        if let Some((frame, (monotonic, stamp))) = time {
            clock.frame_arrives(frame, Some(monotonic), Some(stamp));
        } else if let Some(last) = last {
            clock.wall_clock(last.frame, None);
        }
        self.unmatched = self.unmatched.saturating_add(1);
        if self.unmatched >= MOST_UNMATCHED {
            clock.count_frames();
        }
    }

    fn status(&mut self, stream: &StreamEnd, dropped: u64, reports: &mut Vec<Report>) {
        (self.progress, self.baseline_frames) = (StreamSummary::new(*stream, dropped), None);
        if !stream.baseline_complete || stream.baseline_quiet || std::mem::replace(&mut self.baseline_said, true) {
            return;
        }
        reports.push(Report::Note(DisturbedBaseline.to_string()));
    }

    fn lose(&mut self, lost: u64, reports: &mut Vec<Report>) {
        self.lost_events += lost;
        reports.extend((lost > 0).then_some(Report::LostEvents(lost)));
    }

    /// Returns whether the board has described itself.
    pub(super) fn is_described(&self) -> bool {
        self.clock.is_some()
    }
}

/// The parts of one sample that have arrived.
#[derive(Clone, Debug)]
struct Parts {
    /// Number of the sample's first frame.
    frame: u64,
    frames: [Features; SAMPLE_FRAMES],
    arrived: [bool; SAMPLE_FRAMES / SAMPLE_PART],
}

impl Default for Parts {
    fn default() -> Self {
        Self { frame: 0, frames: [[0; FEATURES]; SAMPLE_FRAMES], arrived: [false; SAMPLE_FRAMES / SAMPLE_PART] }
    }
}

impl Parts {
    /// Takes the part of the sample at `frame` that starts with its frame `first`. It ignores a part that no sample
    /// has.
    fn take(&mut self, frame: u64, first: u8, part: &[Features; SAMPLE_PART]) {
        if frame != self.frame {
            *self = Self { frame, ..Self::default() };
        }
        let number = usize::from(first) / SAMPLE_PART;
        let places = self.frames.as_chunks_mut().0;
        if usize::from(first).is_multiple_of(SAMPLE_PART)
            && let (Some(place), Some(arrived)) = (places.get_mut(number), self.arrived.get_mut(number))
        {
            *place = *part;
            *arrived = true;
        }
    }

    /// Returns the sample at `frame` if all of it has arrived.
    fn of(&self, frame: u64) -> Option<&[Features; SAMPLE_FRAMES]> {
        (frame == self.frame && self.arrived.iter().all(|&arrived| arrived)).then_some(&self.frames)
    }
}

fn hello_in_words(hello: &Hello<'_>) -> String {
    let rate = match (hello.rate.numerator(), hello.rate.denominator()) {
        (frames, 1) => frames.to_string(),
        (numerator, denominator) => format!("{numerator}/{denominator}"),
    };
    let Hello { firmware, version, size, format, trigger, .. } = hello;
    let (width, height, baseline) = (size.width(), size.height(), trigger.baseline_frames());
    let mut words = format!(
        "{firmware} {version}: {width}x{height} {format:?} at {rate} frames per second, baseline of {baseline} frames"
    );
    // Writing to a string does not fail.
    if !hello.revision.is_empty() {
        let _ = write!(words, ", revision {}", hello.revision);
    }
    if let Some([low, middle, high]) = hello.id {
        let _ = write!(words, ", chip {high:08x}{middle:08x}{low:08x}");
    }
    for ModelFacts { task, classes, .. } in hello.models.iter().flatten() {
        let _ = write!(words, ", model of {classes} classes ({})", task.name());
    }
    words
}

pub(super) fn fault_in_words(fault: &Fault<'_>) -> String {
    match fault {
        Fault::Overrun => "pixels came faster than they were taken".to_owned(),
        Fault::LostSync => "a frame did not begin or end when it should have".to_owned(),
        Fault::SensorSilent => {
            "the camera sends no pixels; help: check PCLK, VSYNC, HREF, then XCLK and power".to_owned()
        }
        Fault::SensorGone { lines } => {
            let [why, first] = lines_in_words(*lines);
            format!("the camera does not answer{why}; help: check {first}")
        }
        Fault::SensorUnknown { id } => {
            format!("the camera says it is {}, which the firmware does not know", identity_in_words(*id))
        }
        Fault::SensorBack => "the camera sends frames".to_owned(),
        Fault::SensorRefuses { register, values: None } => {
            format!("the camera does not keep what register {register:#04x} is set to")
        }
        Fault::SensorRefuses { register, values: Some(RegisterValues { address, found, expected }) } => format!(
            "the camera does not keep what register {register:#04x} is set to (address {address:#04x}, found {found:#04x}, \
             expected {expected:#04x}); help: check the sensor's type, the supply voltage, then the pull-ups of SDA and SCL"
        ),
        Fault::SensorDiffers { part, address, register, found, expected } => {
            let [what, first] = part_in_words(*part);
            let [found, expected] = [found, expected].map(numbers_in_words);
            format!(
                "the camera at {address:#04x} sends {what} (found {found}; expected {expected}); help: check {first}, \
                 then register {register:#04x}"
            )
        }
        Fault::LastRun(reason) => format!("it started again because of: {reason}"),
        _ => "a fault of a newer firmware".to_owned(),
    }
}

fn identity_in_words(id: u16) -> String {
    let name = match id {
        OV7670 => "OV7670",
        MT9M114 => "MT9M114",
        _ => return format!("{id:#06x}"),
    };
    format!("{id:#06x} (an {name}, which has at most 30 frames per second; help: build the firmware with WSTAC_FPS=30)")
}

/// Returns why a camera may not answer whose bus has such lines, and what to check first.
fn lines_in_words(lines: Option<BusLines>) -> [&'static str; 2] {
    match lines {
        Some(BusLines::PulledUp) => {
            [": its bus is free", "the sensor's XCLK, its type, then whether SDA and SCL are swapped, PWDN and RESET"]
        }
        Some(BusLines::NotPulledUp) => {
            [": nothing pulls SDA and SCL up", "that it is connected, its power, then the pull-ups of SDA and SCL"]
        }
        Some(BusLines::DataLow) => [": SDA is held low", "SDA for a short circuit, then the camera's power"],
        Some(BusLines::ClockLow) => [": SCL is held low", "SCL for a short circuit, then the camera's power"],
        Some(BusLines::BothLow) => {
            [": SDA and SCL are held low", "the camera's power, then both lines for short circuits"]
        }
        _ => ["", "that it is connected, its power, SDA, SCL, their pull-ups and XCLK"],
    }
}

/// Returns what a camera sends whose frames are wrong in this part, and what to check first.
fn part_in_words(part: FramePart) -> [&'static str; 2] {
    match part {
        FramePart::Size => ["frames of another size", "the wires HREF, VSYNC and PCLK and the number of data wires"],
        FramePart::Format => ["bytes in another order, or with color", "the data wires and the sensor's type"],
        FramePart::Pattern => ["bits in another order, or without those of a wire", "the data wires and PCLK"],
        FramePart::Rate => ["frames at another rate", "the sensor's clock, 24 MHz"],
        _ => ["other frames", "the wires"],
    }
}

fn numbers_in_words(numbers: &FrameNumbers) -> String {
    let FrameNumbers { lines, words, millihertz } = numbers;
    format!("{lines} lines, {words} words, {:.2} per second", f64::from(*millihertz) / 1000.0)
}

fn texture_of(answer: &TextureAnswer<'_>) -> Texture {
    Texture::of_answer(answer.task, answer.label.to_string(), answer.confidence, answer.known)
}
