//! The state that the screen shows: data only, no drawing.

use std::collections::VecDeque;
use std::time::SystemTime;

use wstac_core::layout::{FrameSize, Layout};
use wstac_core::motion::Velocity;
use wstac_core::params::{FEATURES, TAXELS};
use wstac_core::wire::Telemetry;

use wstac_host::json::{angle, confidence, rounded};
use wstac_host::output::{DisturbedBaseline, Output, Stamp, TactileEvent};
use wstac_host::picture::Picture;
use wstac_host::source::Lag;

/// The number of feature frames that traces keep, which is more than a terminal is wide.
pub(super) const HISTORY: usize = 600;
/// The number of entries that the list of events keeps.
const ENTRIES: usize = 100;
/// The smallest light that is shown in full color, as a fraction of full scale, so that noise stays dark.
const LEAST_PEAK: f32 = 0.02;
/// The factor by which the light of full color falls per frame.
const PEAK_FALL: f32 = 0.985;

/// The state of the stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Phase {
    /// Gathering the baseline: the feature frames so far, and how many are needed. A board does not tell the latter.
    Baseline(u64, Option<u64>),
    /// Waiting for contact.
    Watching,
    /// Capturing an event's sample: the frames so far.
    Capturing(u8),
    /// The source has ended.
    Ended,
    /// The source cannot be read any further, for this reason.
    Failed(String),
}

/// The subject of an entry in the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum About {
    /// An event.
    Event,
    /// A fault, or an event that was lost.
    Trouble,
    /// An action of the user.
    Note,
}

/// A recording in progress.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Rec {
    pub(super) name: String,
    /// Frames so far.
    pub(super) frames: u64,
    /// Frames that wait for the disk.
    pub(super) waiting: u64,
}

/// A line of the list of events.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) about: About,
    pub(super) text: String,
    /// The wall-clock time, where the source knows it.
    pub(super) stamp: Option<Stamp>,
}

/// Everything that is shown.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// The name of one of several sensors.
    pub(super) name: Option<String>,
    /// A description of the source.
    pub(super) about: String,
    /// Whether it is a camera, which continues while the screen is paused.
    pub(super) live: bool,
    pub(super) size: FrameSize,
    pub(super) layout: Layout,
    /// Frames per second, as the source states.
    pub(super) nominal_fps: String,
    /// Frames per second by the driver's timestamps, if there are any.
    pub(super) fps: Option<f64>,
    pub(super) phase: Phase,
    pub(super) paused: bool,
    /// `None` before the first frame, and for sources without pixels.
    pub(super) picture: Option<Picture>,
    /// Light of the taxels as fractions of full scale; `None` if the last frame was lost.
    pub(super) taxels: Option<[f32; TAXELS]>,
    /// Light of a taxel that is shown in full color.
    pub(super) peak: f32,
    /// Features of the last frames, the newest last; `None` for lost frames.
    pub(super) traces: VecDeque<Option<[f32; FEATURES]>>,
    /// The mean of a window above which each feature fires, if there is a baseline.
    pub(super) thresholds: Option<[f32; FEATURES]>,
    /// Entries of the list, the newest first.
    pub(super) entries: VecDeque<Entry>,
    /// Number of the next feature frame.
    pub(super) frame: u64,
    /// Camera frames that were lost.
    pub(super) dropped: u64,
    pub(super) events: u64,
    /// Speed and direction of the frame before the next one, if something slides.
    pub(super) motion: Option<Velocity>,
    pub(super) lag: Lag,
    /// Whether it is a board, which sends features and its own state instead of frames.
    pub(super) is_board: bool,
    /// The state of a board, once it has come.
    pub(super) telemetry: Option<Telemetry>,
    /// The wall-clock time of the newest frame, where the source knows it.
    pub(super) stamp: Option<Stamp>,
    /// The most that a board's times may be wrong in milliseconds, once its clock is matched with this machine's.
    pub(super) clock_within_ms: Option<f64>,
    pub(super) rec: Option<Rec>,
}

impl State {
    /// Creates the state before the first frame.
    pub(super) fn new(about: String, live: bool, layout: Layout, nominal_fps: String) -> Self {
        Self {
            name: None,
            about,
            live,
            size: layout.frame(),
            layout,
            nominal_fps,
            fps: None,
            phase: Phase::Baseline(0, None),
            paused: false,
            picture: None,
            taxels: None,
            peak: LEAST_PEAK,
            traces: VecDeque::with_capacity(HISTORY),
            thresholds: None,
            entries: VecDeque::new(),
            frame: 0,
            dropped: 0,
            events: 0,
            motion: None,
            lag: Lag::default(),
            is_board: false,
            telemetry: None,
            stamp: None,
            clock_within_ms: None,
            rec: None,
        }
    }

    /// Names it as one of several sensors.
    pub(super) fn named(self, name: &str) -> Self {
        Self { name: Some(name.to_owned()), ..self }
    }

    /// Returns to the state before the first frame. A pause goes on.
    pub(super) fn start_again(&mut self) {
        let fresh = Self::new(self.about.clone(), self.live, self.layout, self.nominal_fps.clone());
        *self = Self { paused: self.paused, name: self.name.take(), ..fresh };
    }

    /// Returns whether the screen is paused.
    pub(super) fn frozen(&self) -> bool {
        self.paused && self.live
    }

    /// Adds the features of a frame, or `None` for a lost frame. Motion is that of the frame before until it is taken.
    pub(super) fn add_trace(&mut self, features: Option<[f32; FEATURES]>) {
        self.motion = None;
        if self.traces.len() == HISTORY {
            self.traces.pop_front();
        }
        self.traces.push_back(features);
    }

    /// Shows the taxels of a frame.
    pub(super) fn set_taxels(&mut self, taxels: Option<[f32; TAXELS]>) {
        self.taxels = taxels;
        let most = taxels.iter().flatten().fold(LEAST_PEAK, |most, light| most.max(*light));
        self.peak = (self.peak * PEAK_FALL).max(most);
    }

    /// Adds a line to the list.
    pub(super) fn say(&mut self, about: About, text: String) {
        self.enter(Entry { about, text, stamp: None });
    }

    fn enter(&mut self, entry: Entry) {
        self.entries.truncate(ENTRIES - 1);
        self.entries.push_front(entry);
    }

    /// Takes an output of the stream, except features.
    pub(super) fn take(&mut self, record: &Output) {
        match record {
            Output::Motion(motion) => self.motion = Some(motion.velocity),
            Output::Event(event) => {
                self.events += 1;
                self.enter(Entry { about: About::Event, text: line(event), stamp: event.stamp });
            }
            Output::Interrupted(sample) => self.say(
                About::Trouble,
                format!("{:>7}  ended by lost frames after {} of 70 frames", sample.frame, sample.frames),
            ),
            Output::Fault(fault) => {
                self.say(About::Trouble, format!("{:>7}  {}: {}", fault.frame, fault.fault.kind, fault.fault));
            }
            Output::End(end) => {
                self.phase = Phase::Ended;
                self.dropped = end.dropped;
                if let Some(sample) = end.incomplete {
                    let text = format!("{:>7}  the source ended after {} of 70 frames", sample.frame, sample.frames);
                    self.say(About::Trouble, text);
                }
            }
            Output::BaselineDisturbed { frame } => {
                self.say(About::Trouble, format!("{frame:>7}  {DisturbedBaseline}"));
            }
            _ => {}
        }
    }
}

/// Returns the time of day of a stamp in UTC, to the millisecond.
pub(super) fn time_of_day(stamp: Stamp) -> String {
    let since = stamp.time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let seconds = since.as_secs() % 86_400;
    let (hours, minutes) = (seconds / 3600, seconds / 60 % 60);
    format!("{hours:02}:{minutes:02}:{:02}.{:03}", seconds % 60, since.subsec_millis())
}

/// Returns the arrow that is nearest to an angle in degrees.
pub(super) fn arrow(degrees: f32) -> char {
    let eighths = (degrees / 45.0).round() as usize;
    ['→', '↗', '↑', '↖', '←', '↙', '↓', '↘'][eighths % 8]
}

/// Returns an event in one line: frame, speed, direction, texture, duration and doubts.
fn line(event: &TactileEvent) -> String {
    let speed = match (event.speed, event.speed_at_most) {
        (Ok(speed), _) => format!("{:.0} mm/s{}", rounded(speed.mm_s), if speed.extrapolated { "*" } else { "" }),
        (Err(_), Some(most)) => format!("≤ {:.0} mm/s", rounded(most.mm_s)),
        (Err(_), None) => "no speed".to_owned(),
    };
    let direction = match (event.direction.degrees, event.contact) {
        (Ok(degrees), _) => format!("{} {:>3.0}°", arrow(degrees), angle(degrees).round() % 360.0),
        (Err(_), Some(contact)) => contact.to_string(),
        (Err(_), None) => "unclear".to_owned(),
    };
    let trust = match (confidence(event.direction), event.direction.sd) {
        (Some(confidence), _) => format!("{confidence:.2}"),
        (None, Some(sd)) => format!("±{sd:.0}°"),
        (None, None) => String::new(),
    };
    let texture = event.texture.iter().flat_map(|texture| {
        let depth = texture.depth_mm.map(|depth| format!("{depth} mm"));
        let parts = || texture.pattern.iter().cloned().chain(depth);
        match &texture.specimen {
            _ if texture.known == Some(false) => vec!["unknown".to_owned()],
            Some(specimen) => vec![specimen.clone()],
            None => texture.class.iter().cloned().chain(parts()).collect(),
        }
    });
    let texture = texture.collect::<Vec<_>>().join(" ");
    let lit = event.lit_frames.map_or(String::new(), |frames| format!("lit {frames:>2}"));
    let doubt = match event.doubt {
        _ if event.reliable => String::new(),
        Some(doubt) => format!("  not reliable: {doubt}"),
        None => "  not reliable".to_owned(),
    };
    let text = format!("{:>7}  {speed:<10} {direction:<7} {trust:<4}  {lit:<6}  {texture}{doubt}", event.frame);
    text.trim_end().to_owned()
}
