//! A calibration that a page has started: a person looks at it and confirms it.

use serde::Serialize;
use wstac_core::params::TAXELS;
use wstac_host::error::Error;
use wstac_host::picture::Picture;
use wstac_host::source::{SourceEvent, StreamInfo};
use wstac_setup::calibrate::{Calibration, DIM, LightSpot, UNTOUCHED, Watch};

/// Frames of a calibration, as of `wstac calibrate` without `--frames`.
const MOST_FRAMES: u64 = 600;
/// Frames from one search for spots to the next.
const BETWEEN_SEARCHES: u64 = 15;

pub(super) struct Calibrating {
    watch: Watch,
    frames: u64,
    spots: Vec<Spot>,
    /// The light so far, if the page has not seen it.
    pub(super) glow: Option<Picture>,
    found: Option<(Proposal, Box<Calibration>)>,
}

/// A spot of light: its center, its radius, and whether it seemed to be a whisker.
#[derive(Clone, Debug, Serialize)]
struct Spot(f64, f64, f64, bool);

/// A calibration that a person is to confirm, as the page gets it.
#[derive(Clone, Debug, Serialize)]
struct Proposal {
    number: u64,
    centers: [[f64; 2]; TAXELS],
    dead: Option<usize>,
    taxel: [u16; 2],
    corners: [[u16; 2]; TAXELS],
    text: String,
}

/// A calibration in progress, as the page gets it.
#[derive(Debug, Serialize)]
pub(super) struct CalibrationProgress {
    /// Frames of this step so far, and the most of them.
    frames: [u64; 2],
    /// Whether the untouched frames are complete.
    is_ready: bool,
    spots: Vec<Spot>,
    proposal: Option<Proposal>,
}

/// The result of a calibration, as the page gets it.
#[derive(Debug, Serialize)]
pub(super) struct Calibrated {
    text: String,
    is_error: bool,
    /// The spots that were seen, if it was refused.
    spots: Vec<Spot>,
    /// The configuration, if it went to no file.
    toml: Option<String>,
}

impl Calibrated {
    /// Returns the result that a person has confirmed. `toml` is the configuration, if it went to no file.
    pub(super) fn confirmed(text: String, toml: Option<String>) -> Self {
        Self { text, is_error: false, spots: Vec::new(), toml }
    }
}

fn shown(spots: &[LightSpot]) -> Vec<Spot> {
    let rounded = |value: f64| (value * 10.0).round() / 10.0;
    let shown = |LightSpot { center: [x, y], radius, is_whisker, .. }: &LightSpot| {
        Spot(rounded(*x), rounded(*y), rounded(*radius), *is_whisker)
    };
    spots.iter().map(shown).collect()
}

impl Calibrating {
    /// Starts a calibration.
    ///
    /// # Errors
    /// The stream has no pixels.
    pub(super) fn start(info: &StreamInfo) -> Result<Self, Error> {
        Ok(Self { watch: Watch::new(info)?, frames: 0, spots: Vec::new(), glow: None, found: None })
    }

    /// Takes an event of the source. Returns whether it was the last one for this calibration.
    pub(super) fn take(&mut self, event: &SourceEvent<'_>) -> bool {
        if let SourceEvent::Lost { frames, .. } = event {
            self.watch.lose(*frames);
        }
        if self.found.is_some() {
            return false;
        }
        if let SourceEvent::Frame(frame) = event {
            self.watch.take(frame.bytes);
            self.frames += 1;
            if self.watch.is_ready() && self.frames.is_multiple_of(BETWEEN_SEARCHES) {
                self.spots = shown(&self.watch.spots());
                self.glow = Some(self.watch.glow());
            }
        }
        matches!(event, SourceEvent::End) || self.frames >= MOST_FRAMES
    }

    /// Finds the whiskers in what was seen. A proposal gets this number.
    ///
    /// # Errors
    /// There is no calibration; the result says why.
    pub(super) fn find(&mut self, number: u64) -> Result<(), Calibrated> {
        let outcome = self.watch.calibrate();
        self.glow = Some(self.watch.glow());
        let spots = shown(&outcome.spots());
        match outcome.result {
            Ok(found) => {
                let mut text = found.to_string();
                if found.is_dim() {
                    text = format!("{text}\n{DIM}");
                }
                let Calibration { layout, centers, dead, .. } = &found;
                let (taxel, corners) = (layout.taxel(), *layout.corners());
                let proposal = Proposal { number, centers: *centers, dead: *dead, taxel, corners, text };
                self.spots = spots;
                self.found = Some((proposal, Box::new(found)));
                Ok(())
            }
            Err(refusal) => Err(Calibrated { text: refusal.message, is_error: true, spots, toml: None }),
        }
    }

    /// Returns whether there is a proposal.
    pub(super) fn is_found(&self) -> bool {
        self.found.is_some()
    }

    /// Returns the calibration of a proposal.
    pub(super) fn proposed(&self, number: u64) -> Option<&Calibration> {
        self.found.as_ref().filter(|(proposal, _)| proposal.number == number).map(|(_, found)| &**found)
    }

    pub(super) fn progress(&self) -> CalibrationProgress {
        let (is_ready, untouched) = (self.watch.is_ready(), UNTOUCHED as u64);
        let frames =
            if is_ready { [self.frames - untouched, MOST_FRAMES - untouched] } else { [self.frames, untouched] };
        let proposal = self.found.as_ref().map(|(proposal, _)| proposal.clone());
        CalibrationProgress { frames, is_ready, spots: self.spots.clone(), proposal }
    }
}
