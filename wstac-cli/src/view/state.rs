//! The state that the screen shows: data only, no drawing.

use std::collections::VecDeque;

use wstac_core::layout::Layout;
use wstac_core::params::{FEATURES, TAXELS};
use wstac_core::touch::motion::Velocity;
use wstac_host::json::real;
use wstac_host::output::Output;
use wstac_host::picture::Picture;
use wstac_host::source::Lag;
use wstac_host::text::text_of;

/// The number of feature frames that traces keep, which is more than a terminal is wide.
const HISTORY: usize = 600;
/// The number of lines that the list of events keeps.
const ENTRIES: usize = 100;
/// The smallest light that is shown in full color, as a fraction of full scale, so that noise stays dark.
const LEAST_PEAK: f32 = 0.02;
/// The factor by which the light of full color falls per frame.
const PEAK_FALL: f32 = 0.985;

/// The subject of a text, which gives it its color.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum About {
    Event,
    Trouble,
    /// Something that is as usual, or an action of the user.
    #[default]
    Note,
}

/// Everything that is shown.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    /// A description of the source.
    pub(super) about: String,
    /// Whether it is a camera or a board, which continues while the screen is paused.
    pub(super) live: bool,
    /// `None` for a board, which sends no pictures.
    pub(super) layout: Option<Layout>,
    /// Frames per second: measured, or as the source states.
    pub(super) rate: String,
    pub(super) doing: (About, String),
    pub(super) paused: bool,
    /// Why there is no picture and no map.
    pub(super) missing: &'static str,
    pub(super) picture: Option<Picture>,
    pub(super) wants_picture: bool,
    /// Light of the taxels as fractions of full scale; `None` if the last frame was lost.
    pub(super) taxels: Option<[f32; TAXELS]>,
    /// Light of a taxel that is shown in full color.
    pub(super) peak: f32,
    /// Features of the last frames, the newest last; `None` for lost frames.
    pub(super) traces: VecDeque<Option<[f32; FEATURES]>>,
    /// The mean of a window above which each feature fires, if there is a baseline.
    pub(super) thresholds: Option<[f32; FEATURES]>,
    /// The list of events, the newest first.
    pub(super) entries: VecDeque<(About, String)>,
    /// Number of the next feature frame.
    pub(crate) frame: u64,
    /// Camera frames that were lost.
    pub(crate) dropped: u64,
    pub(crate) events: u64,
    /// Speed and direction of the frame before the next one, if something slides.
    pub(super) motion: Option<Velocity>,
    pub(super) lag: Lag,
}

impl State {
    /// Creates the state before the first frame.
    pub(super) fn new(about: String, live: bool, rate: String) -> Self {
        let (missing, wants_picture, peak) = ("no frame yet", true, LEAST_PEAK);
        Self { about, live, rate, missing, wants_picture, peak, ..Self::default() }
    }

    /// Adds the features of a frame, or `None` for a lost frame. Motion is that of the frame before until it is taken.
    pub(super) fn add_trace(&mut self, features: Option<[f32; FEATURES]>) {
        self.motion = None;
        self.traces.truncate(HISTORY - 1);
        self.traces.push_front(features);
    }

    pub(super) fn add_gaps(&mut self, frames: u64) {
        (0..frames.min(HISTORY as u64)).for_each(|_| self.add_trace(None));
    }

    pub(super) fn set_taxels(&mut self, taxels: Option<[f32; TAXELS]>) {
        self.taxels = taxels;
        let most = taxels.iter().flatten().fold(LEAST_PEAK, |most, light| most.max(*light));
        self.peak = (self.peak * PEAK_FALL).max(most);
    }

    /// Adds a line to the list.
    pub(super) fn say(&mut self, about: About, text: String) {
        self.entries.truncate(ENTRIES - 1);
        self.entries.push_front((about, text));
    }

    /// Takes an output of the stream. Its words are those of `wstac run`.
    pub(super) fn take(&mut self, output: &Output) {
        match output {
            Output::Features(frame) => self.add_trace(Some(frame.features.map(|feature| real(feature) as f32))),
            Output::Motion(motion) => self.motion = Some(motion.velocity),
            Output::Event(_) => {
                self.events += 1;
                self.say(About::Event, text_of(output));
            }
            Output::End(end) => {
                self.dropped = end.dropped;
                self.say(About::Note, text_of(output));
            }
            Output::Slip(_) | Output::Interrupted(_) | Output::Fault(_) | Output::BaselineDisturbed { .. } => {
                self.say(About::Trouble, text_of(output));
            }
            _ => {}
        }
    }
}
