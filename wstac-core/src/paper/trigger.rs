//! Features → events: baseline, windows, capture, gaps (SPEC §3, algorithm 1 of the paper).
//!
//! The ring is a `Deque`, because heapless's `HistoryBuf` leaves a path to a panic in the compiled code.

use heapless::Deque;

use crate::features::Features;
use crate::paper::baseline::{self, Baseline};
use crate::paper::baseline_policy::{BaselinePolicy, FixedBaseline};
use crate::paper::sample::Sample;
pub use crate::paper::trigger_config::{Rule, TriggerConfig};
use crate::params::{FEATURES, LONGEST_FILLED_GAP, SAMPLE_FRAMES};
pub use crate::touch::onset::ContactEnd;
use crate::touch::onset::TouchState;
use crate::touch::taxel_ring::TaxelRing;

/// A tactile event: a complete sample and what is known about it.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Event<'a> {
    /// The number of the first frame of the sample: t − c.
    pub frame: u64,
    /// The sample X: 70 frames of ten features in units of 2^-11. It is borrowed from the ring until the next push.
    pub sample: Sample<'a>,
    /// The number of frames of the sample that have arrived: 70, or fewer of a touch under way
    /// ([`Update::touch`](crate::pipeline::Update::touch)).
    #[cfg_attr(feature = "serde", serde(skip))]
    pub frames: u8,
    /// The baseline that the trigger compared the frames with.
    pub baseline: &'a Baseline,
    /// The number of frames of the sample that were lost, in whole or in part, and filled: 0..=70.
    pub frames_filled: u8,
    /// The number of these that hold light of the touch, or of its edges.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) touch_filled: u8,
    /// Whether the event is reliable: the baseline was quiet and without a long gap, and at most a tenth of the sample
    /// was filled.
    pub reliable: bool,
    /// The number of the first lit frame of the touch; `None` unless the trigger gives one event per touch.
    pub touch_frame: Option<u64>,
    /// The number of the first dark frame behind the touch; `None` if five dark frames have not followed it within the
    /// sample, or if the trigger gives more than one event per touch.
    pub end_frame: Option<u64>,
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) taxels: Option<&'a TaxelRing>,
}

impl<'a> Event<'a> {
    /// Creates a reliable event without filled frames, whose sample begins at `frame`.
    ///
    /// A pipeline makes events by itself. This is for samples from elsewhere, such as a file.
    #[inline]
    pub const fn new(frame: u64, sample: Sample<'a>, baseline: &'a Baseline) -> Self {
        let (touch_frame, end_frame) = (None, None);
        let (frames, frames_filled, touch_filled, reliable, taxels) = (SAMPLE_FRAMES as u8, 0, 0, true, None);
        Self { frame, sample, frames, baseline, frames_filled, touch_filled, reliable, touch_frame, end_frame, taxels }
    }

    /// Returns the event with the taxels of its sample.
    ///
    /// The ring's last frame must be that of the sample, or at most 8 frames behind it: frames that a gap has lost
    /// complete a sample only when the next one arrives.
    #[must_use]
    #[inline]
    pub const fn with_taxels(self, ring: &'a TaxelRing) -> Self {
        Self { taxels: Some(ring), ..self }
    }

    /// Returns the taxels of the sample; `None` if the pipeline keeps none
    /// ([`PipelineBuilder::taxels`](crate::pipeline::PipelineBuilder::taxels)), or if they are lost behind a long gap.
    #[inline]
    pub const fn taxels(&self) -> Option<&'a TaxelRing> {
        self.taxels
    }

    /// Returns the taxels of the sample; `None` also if one of its frames was lost, in whole or in part.
    pub fn whole_taxels(&self) -> Option<&'a TaxelRing> {
        self.taxels.filter(|ring| ring.has_whole(self.frames))
    }

    /// Returns the number of the last frame of the sample that has arrived.
    pub fn last_frame(&self) -> u64 {
        self.frame.saturating_add(u64::from(self.frames.saturating_sub(1)))
    }

    /// Returns whether all frames of the sample have arrived.
    pub const fn is_event(&self) -> bool {
        self.frames as usize == SAMPLE_FRAMES
    }

    /// Returns whether the touch goes on, and frames of its sample are to come.
    pub const fn is_under_way(&self) -> bool {
        !self.is_event() && self.end_frame.is_none()
    }

    /// Returns the duration from the first lit frame of the touch to the last, 0..=69 frames; `None` unless the trigger
    /// gives one event per touch, and the sample shows both.
    pub fn lit_frames(&self) -> Option<u8> {
        let first = self.touch_frame.filter(|first| *first >= self.frame)?;
        let last = self.end_frame?.saturating_sub(1).min(self.last_frame());
        Some(last.saturating_sub(first) as u8)
    }
}

/// A sample that ended before it was complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct InterruptedSample {
    /// The number of its first frame.
    pub frame: u64,
    /// The number of its frames that had arrived: 1..=69.
    pub frames: u8,
}

impl InterruptedSample {
    /// Creates a sample that ended after `frames` frames, of which `frame` is the first.
    pub const fn new(frame: u64, frames: u8) -> Self {
        Self { frame, frames }
    }
}

/// The state of a stream, or how it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct StreamEnd {
    /// The number of frames on the time line, lost ones included.
    pub frames: u64,
    /// Whether the stream was long enough for the baseline.
    pub baseline_complete: bool,
    /// Whether the baseline's five windows lay within the trigger's own margin, without a long gap.
    pub baseline_quiet: bool,
    /// The sample that was under way.
    pub incomplete: Option<InterruptedSample>,
}

impl StreamEnd {
    /// Creates the end of a stream of this many frames that has no complete baseline.
    pub const fn new(frames: u64) -> Self {
        Self { frames, baseline_complete: false, baseline_quiet: false, incomplete: None }
    }
}

/// The present task of the trigger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Gathering the baseline.
    Baseline,
    /// In a window of which `seen` frames have arrived.
    Watch { seen: u8 },
    /// Capturing the sample that starts at frame `first`; `left` frames of it are to come. Its touch may be answered
    /// already.
    Capture { first: u64, left: u8, is_answered: bool },
    /// Between a sample's end and the next window's start, `left` frames away.
    Rest { left: u8 },
    /// Behind a sample whose touch has not ended.
    Hold,
}

/// Finds events in a stream of features: baseline, windows and capture.
///
/// `B` is the baseline policy: [`FixedBaseline`] or a
/// [`TrackingBaseline`](crate::paper::baseline_policy::TrackingBaseline).
#[derive(Clone, Debug)]
pub struct Trigger<B = FixedBaseline> {
    state: TriggerState,
    following: B,
}

/// All of a trigger except the baseline policy. Updates borrow it, whatever the policy is.
#[derive(Clone, Debug)]
pub(crate) struct TriggerState {
    config: TriggerConfig,
    /// The last frames. When a sample is complete, they are its frames.
    ring: Deque<Features, SAMPLE_FRAMES>,
    /// The frames of the ring that were filled, one bit each: bit 0 is the newest.
    filled: [u64; 2],
    /// The number of the next frame. At `u64::MAX` it stays there.
    frame: u64,
    phase: Phase,
    window_sums: [i32; FEATURES],
    baseline: Baseline,
    quiet: bool,
    /// The lowest and highest window sums of the baseline. Once it is complete, the second element holds the
    /// thresholds.
    bounds: [[i32; FEATURES]; 2],
    /// Frames lost since the last that arrived. Their meaning is known when the gap ends.
    lost: u64,
    /// The frames that wait behind a returned event: frames to fill, then one that arrived.
    backlog: Option<(u8, Features, bool)>,
    interrupted: Option<InterruptedSample>,
    touch: TouchState,
}

/// Frames before a touch and behind it that belong to its edges.
const EDGE_FRAMES: u64 = 2;
/// The lowest and highest of no window sums.
const NO_BOUNDS: [[i32; FEATURES]; 2] = [[i32::MAX; FEATURES], [i32::MIN; FEATURES]];

impl Trigger {
    /// Creates a trigger at frame 0, before its baseline.
    pub fn new(config: TriggerConfig) -> Self {
        Self::starting_at(config, 0)
    }

    /// Creates a trigger before its baseline whose first frame has the number `frame`. It is for recordings that do not
    /// start at 0.
    pub fn starting_at(config: TriggerConfig, frame: u64) -> Self {
        Self::with(config, frame, FixedBaseline)
    }
}

impl<B: BaselinePolicy> Trigger<B> {
    /// Creates a trigger before its baseline whose first frame has the number `frame`, with a baseline policy.
    pub fn with(config: TriggerConfig, frame: u64, following: B) -> Self {
        Self {
            state: TriggerState {
                config,
                ring: Deque::new(),
                filled: [0; 2],
                frame,
                phase: Phase::Baseline,
                window_sums: [0; FEATURES],
                baseline: Baseline::empty(),
                quiet: true,
                bounds: NO_BOUNDS,
                lost: 0,
                backlog: None,
                interrupted: None,
                touch: TouchState::NONE,
            },
            following,
        }
    }

    pub(crate) fn state(&self) -> &TriggerState {
        &self.state
    }

    /// Returns the trigger's parameters.
    pub fn config(&self) -> &TriggerConfig {
        &self.state.config
    }

    /// Returns the baseline once its 5m frames have arrived. A tracking baseline is returned as it is now.
    pub fn baseline(&self) -> Option<&Baseline> {
        (self.state.phase != Phase::Baseline).then_some(&self.state.baseline)
    }

    /// Returns the highest window sum of each feature that does not fire, in units of 2^-11, once the baseline is
    /// complete.
    pub fn thresholds(&self) -> Option<&[i32; FEATURES]> {
        (self.state.phase != Phase::Baseline).then_some(&self.state.bounds[1])
    }

    /// Returns the number that the next pushed frame gets. Lost frames count, too.
    pub fn next_frame(&self) -> u64 {
        self.state.next_frame()
    }

    /// Returns the last frames that were taken, at most 70 with lost ones filled, and the number of the frame after the
    /// last of them.
    ///
    /// An event's sample is among them for a while: a link sends it in parts, without a copy.
    pub fn recent(&self) -> (u64, Sample<'_>) {
        (self.state.frame, Sample::new(self.state.ring.as_slices()))
    }

    /// Takes the features of the next frame. Returns an event if they complete a sample.
    ///
    /// `has_missing_frames` says that some, but not all, of the camera frames in them were lost.
    pub fn push(&mut self, features: Features, has_missing_frames: bool) -> Option<Event<'_>> {
        self.push_then_lose(features, has_missing_frames, 0)
    }

    /// Takes the features of the next frame, then `lost_after` lost frames, as [`Trigger::push`] and
    /// [`Trigger::push_lost`] do.
    pub fn push_then_lose(
        &mut self,
        features: Features,
        has_missing_frames: bool,
        lost_after: u64,
    ) -> Option<Event<'_>> {
        let first = self.advance(features, has_missing_frames, lost_after)?;
        Some(self.state.event(first))
    }

    /// Takes the features of the next frame, then `lost_after` lost frames. Returns the first frame of the sample that
    /// they complete.
    pub(crate) fn advance(&mut self, features: Features, has_missing_frames: bool, lost_after: u64) -> Option<u64> {
        self.clear_backlog();
        let lost = core::mem::replace(&mut self.state.lost, lost_after);
        if lost > u64::from(LONGEST_FILLED_GAP) {
            self.skip(lost);
        } else {
            for left in (0..lost as u8).rev() {
                if let Some(first) = self.fill() {
                    self.state.backlog = Some((left, features, has_missing_frames));
                    return Some(first);
                }
            }
        }
        self.step(features, has_missing_frames)
    }

    /// Takes note of `frames` lost frames, which keep their place in time. Up to 7 in a row are filled with the last
    /// features; more end what was under way.
    pub fn push_lost(&mut self, frames: u64) {
        // Before the first frame there is no time to keep.
        if !self.state.ring.is_empty() {
            self.state.lost = self.state.lost.saturating_add(frames);
        }
    }

    /// Returns the sample that a long gap has interrupted, once.
    ///
    /// Only the last one is kept: ask after every push.
    pub fn take_interrupted(&mut self) -> Option<InterruptedSample> {
        self.state.interrupted.take()
    }

    /// Returns the end of an event's touch, once.
    pub fn take_contact_end(&mut self) -> Option<ContactEnd> {
        let end = self.state.contact_end();
        self.state.touch.forget_end();
        end
    }

    /// Forgets what the last push brought: an interrupted sample and the end of a touch.
    pub(crate) fn forget_last(&mut self) {
        self.state.interrupted = None;
        self.state.touch.forget_end();
    }

    /// Takes note that the touch under way is answered: its sample is no event any more.
    pub(crate) fn answer_touch(&mut self) {
        if let Phase::Capture { is_answered, .. } = &mut self.state.phase {
            *is_answered = self.state.config.is_per_touch();
        }
    }

    /// Ends a stream: fills or ends a gap of lost frames. Returns an event if lost frames at the very end complete a
    /// sample.
    pub fn finish(&mut self) -> Option<Event<'_>> {
        let first = self.settle()?;
        Some(self.state.event(first))
    }

    /// Fills or ends a gap of lost frames at the end of a stream. Returns the first frame of the sample that it
    /// completes.
    pub(crate) fn settle(&mut self) -> Option<u64> {
        self.clear_backlog();
        let lost = core::mem::take(&mut self.state.lost);
        if lost > u64::from(LONGEST_FILLED_GAP) {
            self.skip(lost);
            return None;
        }
        let mut complete = None;
        for _ in 0..lost {
            // A gap of 7 frames completes at most one sample. The frames that follow it would shift the ring under the
            // event.
            if complete.is_some() {
                self.state.frame = self.state.frame.saturating_add(1);
            } else {
                complete = self.fill();
            }
        }
        self.state.hold_answered();
        complete
    }

    /// Gathers a new baseline from the next frame on. Returns the sample that was being captured and ends here.
    pub fn rezero(&mut self) -> Option<InterruptedSample> {
        if let Some(tracking) = self.following.tracking() {
            tracking.restart();
        }
        self.state.reset(self.state.config)
    }

    /// Gathers a new baseline with other parameters and another policy. Returns the sample that was being captured and
    /// ends here.
    pub(crate) fn reset(&mut self, config: TriggerConfig, following: B) -> Option<InterruptedSample> {
        self.following = following;
        self.state.reset(config)
    }

    /// Counts frames from 0 again, and keeps the baseline if it is complete.
    pub(crate) fn rewind(&mut self) {
        let TriggerState { baseline, quiet, bounds, phase, config, .. } = self.state;
        self.rezero();
        self.state.frame = 0;
        if phase != Phase::Baseline {
            (self.state.baseline, self.state.quiet, self.state.bounds) = (baseline, quiet, bounds);
            self.state.phase = match config.backtrack() {
                0 => Phase::Watch { seen: 0 },
                left => Phase::Rest { left },
            };
        }
    }

    /// Returns the state of the stream; after [`Trigger::finish`], how it ended.
    pub fn end(&self) -> StreamEnd {
        self.state.end()
    }

    /// Returns the number of a frame before which nothing is left to report: samples, touches and ends of touches that
    /// are reported later begin at this frame or behind it.
    ///
    /// The number never goes back. A program that needs only a part of a stream can stop reading by it.
    pub fn settled_frame(&self) -> u64 {
        self.state.settled_frame()
    }

    /// Takes the frames that wait behind a returned event. They cannot hold a second event: the next is 70 frames away.
    fn clear_backlog(&mut self) {
        if let Some((fills, features, has_missing_frames)) = self.state.backlog.take() {
            for _ in 0..fills {
                self.fill();
            }
            self.step(features, has_missing_frames);
        }
    }

    /// Repeats the last features for one lost frame.
    fn fill(&mut self) -> Option<u64> {
        let last = *self.state.ring.back()?;
        self.step(last, true)
    }

    /// Ends what was under way, and moves time on by a gap of `lost` frames.
    fn skip(&mut self, lost: u64) {
        let mut left = lost;
        self.state.interrupted = self.state.under_way().or(self.state.interrupted);
        while self.state.phase == Phase::Baseline && left > 0 {
            self.state.quiet = false;
            self.fill();
            left -= 1;
        }
        if self.state.phase != Phase::Baseline {
            self.state.skip_windows(left);
        }
    }

    /// Takes one frame in its place in time. Returns the first frame of the sample that it completes.
    fn step(&mut self, features: Features, filled: bool) -> Option<u64> {
        let Self { state, following } = self;
        state.remember(features, filled);
        let now = state.frame;
        state.frame = state.frame.saturating_add(1);
        state.follow_touch(now, &features);
        match &mut state.phase {
            Phase::Baseline => {
                state.baseline.add(&features);
                baseline::add(&mut state.window_sums, &features);
                if state.baseline.frames().is_multiple_of(u16::from(state.config.window())) {
                    state.end_baseline_window();
                }
                None
            }
            Phase::Watch { seen } => {
                *seen += 1;
                let complete = *seen == state.config.window();
                baseline::add(&mut state.window_sums, &features);
                if !complete {
                    return None;
                }
                let fired = state.window_sums.iter().zip(&state.bounds[1]).any(|(sum, threshold)| sum > threshold);
                if !fired {
                    let [_, thresholds] = &mut state.bounds;
                    if let Some(tracking) = following.tracking() {
                        tracking.quiet(&state.window_sums, &mut state.baseline, thresholds, &state.config);
                    }
                    state.start_windows();
                    return None;
                }
                if let Some(tracking) = following.tracking() {
                    tracking.fired(&state.config);
                }
                let arrived = state.config.backtrack() + state.config.window();
                let first = now - u64::from(arrived - 1);
                state.capture(first, SAMPLE_FRAMES as u8 - arrived, false)
            }
            Phase::Capture { first, left, is_answered } => {
                let (first, left, is_answered) = (*first, *left - 1, *is_answered);
                state.capture(first, left, is_answered)
            }
            Phase::Rest { left } => {
                *left -= 1;
                if *left == 0 {
                    state.start_windows();
                }
                None
            }
            Phase::Hold => {
                if !state.touch.is_held() {
                    state.start_windows();
                }
                None
            }
        }
    }
}

impl TriggerState {
    /// Resets the state, except that frame numbers go on. It works field by field, since a whole new state would lie on
    /// the stack first.
    fn reset(&mut self, config: TriggerConfig) -> Option<InterruptedSample> {
        let StreamEnd { frames, incomplete, .. } = self.end();
        let Self {
            config: own_config,
            ring,
            filled,
            frame,
            phase,
            window_sums,
            baseline,
            quiet,
            bounds,
            lost,
            backlog,
            interrupted,
            touch,
        } = self;
        *own_config = config;
        ring.clear();
        *filled = [0; 2];
        *frame = frames;
        *phase = Phase::Baseline;
        *window_sums = [0; FEATURES];
        *baseline = Baseline::empty();
        *quiet = true;
        *bounds = NO_BOUNDS;
        *lost = 0;
        *backlog = None;
        *interrupted = None;
        *touch = TouchState::NONE;
        incomplete
    }

    /// Returns the number that the next pushed frame gets.
    // It is not inlined: it is called in many places, and takes 50 bytes in each on a Cortex-M0.
    #[inline(never)]
    pub(crate) fn next_frame(&self) -> u64 {
        let backlog = self.backlog.map_or(0, |(fills, ..)| u64::from(fills) + 1);
        self.frame.saturating_add(backlog).saturating_add(self.lost)
    }

    /// Returns the number of a frame before which nothing is left to report.
    fn settled_frame(&self) -> u64 {
        let backtrack = u64::from(self.config.backtrack());
        // The first frame of the sample that fires next, or of the one that is under way.
        let (window, sample) = match self.phase {
            Phase::Capture { first, .. } => (self.frame, first),
            Phase::Watch { seen } => {
                let window = self.frame.saturating_sub(seen.into());
                (window, window.saturating_sub(backtrack))
            }
            // The next window is behind the rest, which is as long as the backtrack. A gap may end it early.
            Phase::Baseline | Phase::Rest { .. } | Phase::Hold => (self.frame, self.frame.saturating_sub(backtrack)),
        };
        if !self.config.is_per_touch() {
            return sample;
        }
        let is_captured = matches!(self.phase, Phase::Capture { .. });
        sample.min(self.touch.settled_frame(window, is_captured))
    }

    pub(crate) fn end(&self) -> StreamEnd {
        StreamEnd {
            frames: self.next_frame(),
            baseline_complete: self.phase != Phase::Baseline,
            baseline_quiet: self.quiet,
            incomplete: self.under_way(),
        }
    }

    /// Returns the sample that is being captured, unless its touch is answered.
    pub(crate) fn under_way(&self) -> Option<InterruptedSample> {
        match self.phase {
            Phase::Capture { first, left, is_answered: false } => {
                Some(InterruptedSample { frame: first, frames: SAMPLE_FRAMES as u8 - left })
            }
            _ => None,
        }
    }

    /// Returns the sample that the last gap has interrupted.
    pub(crate) fn interrupted(&self) -> Option<InterruptedSample> {
        self.interrupted
    }

    /// Returns the features that were pushed last, and whether some of their frames are missing.
    pub(crate) fn newest(&self) -> Option<(&Features, bool)> {
        match &self.backlog {
            Some((_, features, has_missing_frames)) => Some((features, *has_missing_frames)),
            None => self.ring.back().map(|features| (features, self.filled[0] & 1 == 1)),
        }
    }

    pub(crate) fn last(&self, frames: u8) -> Sample<'_> {
        Sample::last(self.ring.as_slices(), usize::from(frames))
    }

    /// Returns whether a ring of all frames until now holds the touch of the event whose sample begins with this frame.
    pub(crate) fn is_recent(&self, frame: u64) -> bool {
        let behind = self.next_frame().saturating_sub(frame.saturating_add(SAMPLE_FRAMES as u64));
        behind <= u64::from(LONGEST_FILLED_GAP) + 1
    }

    /// Returns the event whose sample the ring holds.
    pub(crate) fn event(&self, frame: u64) -> Event<'_> {
        self.event_of(frame, SAMPLE_FRAMES as u8)
    }

    /// Returns the touch whose sample is being captured, if there is one event per touch, and it is not answered.
    pub(crate) fn touch(&self) -> Option<Event<'_>> {
        let is_asked = self.config.is_per_touch() && self.lost == 0;
        let InterruptedSample { frame, frames } = self.under_way().filter(|_| is_asked)?;
        Some(self.event_of(frame, frames))
    }

    /// Returns the event of which this many frames have arrived, the last ones of the ring.
    fn event_of(&self, frame: u64, frames: u8) -> Event<'_> {
        let before = SAMPLE_FRAMES as u64 - u64::from(frames);
        let is_per_touch = self.config.is_per_touch();
        let touch_frame = is_per_touch.then(|| self.touch.first());
        let end_frame = if is_per_touch { self.touch.end() } else { None };
        let frames_filled = self.filled_in(before, u64::MAX);
        // A filled frame next to an edge moves it, too.
        let first = touch_frame.unwrap_or(0).saturating_sub(frame).saturating_sub(EDGE_FRAMES);
        let end = end_frame.map_or(u64::MAX, |end| end.saturating_sub(frame).saturating_add(before + EDGE_FRAMES));
        let touch_filled = self.filled_in(before + first, end);
        Event {
            frame,
            sample: self.last(frames),
            frames,
            baseline: &self.baseline,
            frames_filled,
            touch_filled,
            reliable: self.quiet && u32::from(frames_filled) <= LONGEST_FILLED_GAP,
            touch_frame,
            end_frame,
            taxels: None,
        }
    }

    /// Returns how many of the frames `first..end` of the ring were filled.
    // It is not inlined: small code counts here.
    #[inline(never)]
    fn filled_in(&self, first: u64, end: u64) -> u8 {
        let [low, high] = self.filled;
        let bits = (0..SAMPLE_FRAMES as u32).rev().map(|bit| if bit < 64 { low >> bit } else { high >> (bit - 64) });
        (0..).zip(bits).filter(|(number, bits)| bits & 1 == 1 && (first..end).contains(number)).count() as u8
    }

    /// Returns the end of an event's touch that the last push brought.
    pub(crate) fn contact_end(&self) -> Option<ContactEnd> {
        self.touch.ended()
    }

    /// Follows the light of a touch, if there is to be one event per touch.
    fn follow_touch(&mut self, now: u64, features: &Features) {
        if !self.config.is_per_touch() || self.phase == Phase::Baseline {
            return;
        }
        // A window of such frames would fire.
        let window = i32::from(self.config.window());
        let is_lit = features.iter().zip(&self.bounds[1]).any(|(feature, most)| i32::from(*feature) * window > *most);
        let is_captured = matches!(self.phase, Phase::Capture { .. });
        self.touch.advance(now, is_lit, is_captured);
    }

    /// Holds a touch that is answered, until its light has left.
    fn hold_answered(&mut self) {
        if let Phase::Capture { first, is_answered: true, .. } = self.phase {
            self.touch.hold(first);
        }
    }

    /// Returns how many frames of the sample that is being captured have arrived, answered or not.
    pub(crate) fn captured_frames(&self) -> Option<u8> {
        if let Phase::Capture { left, .. } = self.phase { Some(SAMPLE_FRAMES as u8 - left) } else { None }
    }

    /// Moves time on by `left` frames of a long gap after the baseline.
    fn skip_windows(&mut self, left: u64) {
        self.hold_answered();
        // If there are more frames than the ring holds, only the last of them can be seen again.
        for _ in 0..left.min(SAMPLE_FRAMES as u64) {
            if let Some(&last) = self.ring.back() {
                self.remember(last, true);
            }
        }
        self.frame = self.frame.saturating_add(left);
        self.phase = match self.phase {
            // Before t + l, a window's backtrack would reach into the sample that was returned.
            Phase::Rest { left: rest } if left < u64::from(rest) => Phase::Rest { left: rest - left as u8 },
            Phase::Rest { .. } | Phase::Hold | Phase::Capture { .. } if self.touch.is_held() => Phase::Hold,
            _ => Phase::Watch { seen: 0 },
        };
        self.window_sums = [0; FEATURES];
    }

    /// Starts to watch windows, unless the touch of the last event has not ended.
    fn start_windows(&mut self) {
        self.window_sums = [0; FEATURES];
        self.phase = if self.touch.is_held() { Phase::Hold } else { Phase::Watch { seen: 0 } };
    }

    fn remember(&mut self, features: Features, filled: bool) {
        if self.ring.is_full() {
            self.ring.pop_front();
        }
        // There is room now, so it is taken.
        let _ = self.ring.push_back(features);
        let [low, high] = self.filled;
        self.filled = [low << 1 | u64::from(filled), high << 1 | low >> 63];
    }

    /// Continues to capture the sample that starts at `first` and of which `left` frames are to come.
    fn capture(&mut self, first: u64, left: u8, is_answered: bool) -> Option<u64> {
        if left > 0 {
            self.phase = Phase::Capture { first, left, is_answered };
            return None;
        }
        if self.config.is_per_touch() {
            self.touch.hold(first);
        }
        // The next window starts at t + l, which is c frames after the sample's end.
        match self.config.backtrack() {
            0 => self.start_windows(),
            left => self.phase = Phase::Rest { left },
        }
        (!is_answered).then_some(first)
    }

    fn end_baseline_window(&mut self) {
        let [lowest, highest] = &mut self.bounds;
        for ((low, high), sum) in lowest.iter_mut().zip(highest.iter_mut()).zip(self.window_sums) {
            *low = sum.min(*low);
            *high = sum.max(*high);
        }
        self.window_sums = [0; FEATURES];
        if self.baseline.frames() == self.config.baseline_frames() {
            self.quiet &= self.baseline.is_quiet(lowest, highest, &self.config);
            self.bounds[1] = self.baseline.thresholds(&self.config);
            self.phase = Phase::Watch { seen: 0 };
        }
    }
}

/// Pushes a frame that is not lost and settles what is pending. Returns whether that completed an event.
///
/// No program needs it. A function without type parameters makes the compiler translate the default trigger's methods
/// with this crate instead of with each program. Without it they would cost 34 bytes and 6 instructions per frame more
/// on a Cortex-M4.
pub fn push_and_finish(trigger: &mut Trigger, features: Features) -> bool {
    trigger.push_then_lose(features, false, 0).is_some() || trigger.finish().is_some()
}
