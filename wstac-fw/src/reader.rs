//! Turns rows and losses into messages for the host: the core with the compiled-in configuration, as `wstac run` has it
//! on a host.

use wstac_core::error::{ConfigError, FrameError};
use wstac_core::features::Floor;
use wstac_core::law::{Answer, EventLaw};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::model::file::{INPUTS, Input};
use wstac_core::paper::early::SamplePrefix;
use wstac_core::paper::sample::Sample;
use wstac_core::paper::trigger::{ContactEnd, Event, TriggerConfig};
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::pipeline::{NextFrame, Update};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::at_once::{self, AtOnce};
#[cfg(feature = "motion")]
use wstac_core::touch::motion::LiveContact;
use wstac_core::touch::motion::{MotionConfig, Readout, ReadoutTime, RowOrder};
use wstac_core::touch::slip::SlipDetector;
use wstac_core::wire::{Answers, FrameTime, Hello, Message, ModelFacts, Outbox, Request, SAMPLE_PART, Telemetry, Text};

#[cfg(feature = "learn")]
use crate::learner::Names;
#[cfg(feature = "motion")]
use crate::live::Live as _;
use crate::meanwhile::meanwhile;
#[cfg(any(feature = "learn", feature = "models"))]
use crate::settings_store::SettingsStore;
use crate::setup;
use crate::textures::{ModelSample, Textures};

/// The number of frames from one status to the next: about one second.
const STATUS_EVERY: u64 = 30;
/// The number of detectors of slips: one if the law takes taxels. A microbit has no memory for it.
const SLIPS: usize = (<setup::Law as EventLaw>::ANSWERS_AT_ONCE && !cfg!(microbit)) as usize;

/// Takes messages. A message without room is left out.
pub trait Publisher {
    /// Takes a message.
    fn send(&mut self, message: &Message<'_>);
}

/// The former name of [`Publisher`].
pub use Publisher as Outlet;

/// The core between a camera and a link.
#[derive(Clone, Debug)]
pub struct Reader {
    pipeline: setup::BoardPipeline,
    sender: Sender,
    /// The size of the whole frames, for hosts that ask.
    size: FrameSize,
    /// The name of the firmware, for hosts that ask.
    name: &'static str,
    /// The unique number of the chip.
    id: Option<[u32; 3]>,
    /// The state of the board, as far as the caller and the requests set it.
    telemetry: Telemetry,
    dropped: u64,
    status_at: u64,
}

/// Turns the results of frames into messages.
#[derive(Clone, Debug)]
struct Sender {
    law: setup::Law,
    /// None, unless the law answers at once.
    at_once: [AtOnce; <setup::Law as EventLaw>::ANSWERS_AT_ONCE as usize],
    slip: [SlipDetector; SLIPS],
    motion: MotionConfig,
    textures: Textures,
    /// The texture model.
    #[cfg(feature = "models")]
    model: Option<&'static setup::Kind>,
    /// The events that were sent and not acknowledged.
    outbox: Outbox<'static>,
    /// The time in milliseconds, which wraps.
    now: u32,
    wants_features: bool,
    wants_samples: bool,
    wants_motion: bool,
    /// Follows what slides, frame by frame.
    #[cfg(feature = "motion")]
    live: setup::Live,
    held: Option<Held>,
}

/// An event whose sample is being sent, one part at a time. Its frames stay among the pipeline's last ones for a while.
#[derive(Clone, Debug)]
struct Held {
    answers: Answers<'static>,
    /// The frame of the sample that the next part starts with.
    next: u8,
    /// The frame behind the event's touch if it has ended, which is sent after the event.
    end: Option<u64>,
}

/// A reader of checked parts. As a function it would leave a second reader on the stack.
macro_rules! reader {
    ($pipeline:expr, $law:expr, $motion:expr, $rate:expr, $size:expr) => {
        Self {
            pipeline: $pipeline.build(),
            sender: Sender {
                law: $law,
                at_once: [AtOnce::new($motion); <setup::Law as EventLaw>::ANSWERS_AT_ONCE as usize],
                slip: [SlipDetector::new($rate); SLIPS],
                motion: $motion,
                textures: Textures::default(),
                #[cfg(feature = "models")]
                model: setup::MODEL,
                outbox: Outbox::new(),
                now: 0,
                wants_features: false,
                wants_samples: false,
                wants_motion: false,
                held: None,
                #[cfg(feature = "motion")]
                live: setup::Live::new($motion),
            },
            size: $size,
            name: env!("CARGO_PKG_NAME"),
            id: None,
            telemetry: Telemetry::default(),
            dropped: 0,
            status_at: STATUS_EVERY,
        }
    };
}

impl Reader {
    /// Creates the reader for rows of [`setup::PIXELS`] with taxels at `layout`, at this rate.
    ///
    /// `size` is that of the whole frames that the rows are from. `law` is [`setup::law`] of the rate, which a `const`
    /// computes.
    ///
    /// # Errors
    /// Returns the errors of [`FrameGeometry::with_stride`] and [`Pipeline::builder`] for the configuration.
    ///
    /// [`Pipeline::builder`]: wstac_core::pipeline::Pipeline::builder
    // It is not inlined: its parts would lie on the stack of a function that runs for ever.
    #[inline(never)]
    pub fn new(layout: Layout, size: FrameSize, rate: FrameRate, law: setup::Law) -> Result<Self, ConfigError> {
        Self::with(layout, size, rate, law, setup::FLOOR, setup::TRIGGER)
    }

    // Not by `check`: what its function takes would lie on the stack beside the reader, 400 bytes more.
    fn with(
        layout: Layout,
        size: FrameSize,
        rate: FrameRate,
        law: setup::Law,
        floor: Floor,
        trigger: TriggerConfig,
    ) -> Result<Self, ConfigError> {
        let camera = FrameGeometry::with_stride(setup::GREEN, layout, rate, setup::STRIDE)?;
        let pipeline = setup::checked_with(camera, floor, trigger)?;
        let readout = Readout::of_layout(setup::READOUT, RowOrder::Down, &layout, rate);
        let (motion, law) = (setup::motion(rate)?.with_readout(readout), law.with_readout(readout));
        Ok(reader!(pipeline, law, motion, rate, size))
    }

    /// Checks another floor and trigger than those of the configuration, too. Returns the function that creates the
    /// reader: where it is to stay, without a copy on the stack.
    ///
    /// # Errors
    /// Returns the errors of [`Reader::new`].
    pub fn check(
        layout: Layout,
        size: FrameSize,
        rate: FrameRate,
        law: setup::Law,
        floor: Floor,
        trigger: TriggerConfig,
    ) -> Result<impl FnOnce() -> Self, ConfigError> {
        let camera = FrameGeometry::with_stride(setup::GREEN, layout, rate, setup::STRIDE)?;
        let pipeline = setup::checked_with(camera, floor, trigger)?;
        let readout = Readout::of_layout(setup::READOUT, RowOrder::Down, &layout, rate);
        let (motion, law) = (setup::motion(rate)?.with_readout(readout), law.with_readout(readout));
        Ok(move || reader!(pipeline, law, motion, rate, size))
    }

    /// States the time in which the camera reads the rows of a frame. A configuration that states it comes first.
    // It is not inlined: what follows slides would lie on the stack of a function that runs for ever.
    #[inline(never)]
    pub fn state_readout(&mut self, time: ReadoutTime) {
        let (time, geometry) = (setup::READOUT.unwrap_or(time), self.pipeline.geometry());
        // The time is that of the picture, and more rows may be captured.
        let layout = geometry.layout();
        let of_picture = Layout::new(self.size, layout.taxel(), *layout.corners()).unwrap_or(*layout);
        let readout = Readout::of_layout(Some(time), RowOrder::Down, &of_picture, geometry.rate());
        let sender = &mut self.sender;
        (sender.law, sender.motion) = (sender.law.with_readout(readout), sender.motion.with_readout(readout));
        #[cfg(feature = "motion")]
        {
            sender.live = setup::Live::new(sender.motion);
        }
    }

    /// Gives the firmware another name, which says in what it differs.
    pub fn set_name(&mut self, name: &'static str) {
        self.name = name;
    }

    /// Sets the unique number of the chip, which the description of the board has.
    pub fn set_id(&mut self, id: [u32; 3]) {
        self.id = Some(id);
    }

    /// Sets the microseconds since the start. Events that are not acknowledged are sent again by this time. The first
    /// call after a frame has ended gives its time.
    pub fn set_time(&mut self, uptime_us: u64) {
        // The division of large numbers takes long, and most are small: 71 minutes fit 32 bits.
        self.telemetry.uptime_ms = u32::try_from(uptime_us).map_or(uptime_us / 1000, |us| u64::from(us / 1000));
        self.sender.now = self.telemetry.uptime_ms as u32;
        let frame = self.pipeline.next_frame().checked_sub(1);
        if let Some(frame) = frame.filter(|frame| self.telemetry.last_frame.is_none_or(|last| last.frame != *frame)) {
            self.telemetry.last_frame = Some(FrameTime { frame, board_us: uptime_us });
        }
    }

    /// Returns what the caller knows of the board's state: its rate, overruns, restarts, stack and temperature. The
    /// reader sets all other fields.
    pub fn telemetry_mut(&mut self) -> &mut Telemetry {
        &mut self.telemetry
    }

    /// Takes the next rows of a frame.
    ///
    /// # Errors
    /// Returns the errors of [`Pipeline::push_stripe`] if the rows do not fit this layout; then nothing was taken.
    ///
    /// [`Pipeline::push_stripe`]: wstac_core::pipeline::Pipeline::push_stripe
    pub fn rows(&mut self, rows: &[u8], out: &mut impl Publisher) -> Result<(), FrameError> {
        // The update is not moved out of the result, which would copy it.
        let result = self.pipeline.push_stripe(rows);
        let update = match &result {
            Ok(update) => update,
            Err(error) => return Err(*error),
        };
        if update.is_frame() {
            let is_answered = self.sender.give(update, out);
            self.settle(is_answered);
            self.end_frame(out);
        }
        Ok(())
    }

    /// Takes note of a touch that is answered before its sample is complete.
    fn settle(&mut self, is_answered: bool) {
        if is_answered {
            self.pipeline.answer_touch();
        }
    }

    /// Takes the last rows of a frame. While the frame is in use, the camera's interrupt calls `more` with what takes
    /// rows of the next frame ([`meanwhile`]).
    ///
    /// # Errors
    /// Returns the errors of [`Reader::rows`].
    pub fn last_rows(
        &mut self,
        rows: &[u8],
        out: &mut impl Publisher,
        mut more: impl FnMut(&mut NextFrame<'_, setup::GreenChannel>) + Send,
    ) -> Result<(), FrameError> {
        let (update, mut next) = self.pipeline.push_last_stripe(rows)?;
        if update.is_frame() {
            let is_answered = meanwhile(&mut || more(&mut next), || self.sender.give(&update, out));
            self.settle(is_answered);
            self.end_frame(out);
        }
        Ok(())
    }

    fn end_frame(&mut self, out: &mut impl Publisher) {
        #[cfg(feature = "motion")]
        self.sender.give_motion(&self.pipeline, out);
        if self.pipeline.next_frame() >= self.status_at {
            self.status(out);
        }
    }

    /// Gives up the frame under way, which is lost.
    pub fn abandon_frame(&mut self, out: &mut impl Publisher) {
        self.note_lost(1, out);
        let is_answered = self.sender.give(&self.pipeline.abandon_frame(), out);
        self.settle(is_answered);
    }

    /// Takes note of frames that were lost.
    pub fn lost(&mut self, frames: u64, out: &mut impl Publisher) {
        self.note_lost(frames, out);
        let is_answered = self.sender.give(&self.pipeline.push_lost(frames), out);
        self.settle(is_answered);
    }

    /// Takes note of frames that a sensor at rest did not send. The host is not told of them.
    pub fn skip(&mut self, frames: u64, out: &mut impl Publisher) {
        let is_answered = self.sender.give(&self.pipeline.push_lost(frames), out);
        self.settle(is_answered);
    }

    /// Returns whether the last frame is lit (SPEC §3), or the baseline is not complete.
    pub fn is_lit(&self) -> bool {
        let (window, (_, recent)) = (i32::from(self.pipeline.trigger_config().window()), self.pipeline.recent());
        let (Some(bounds), Some(newest)) = (self.pipeline.thresholds(), recent.frames().last()) else { return true };
        newest.iter().zip(bounds).any(|(feature, bound)| window * i32::from(*feature) > *bound)
    }

    fn note_lost(&mut self, frames: u64, out: &mut impl Publisher) {
        self.dropped = self.dropped.saturating_add(frames);
        out.send(&Message::Lost { frames });
    }

    /// Answers a request of the host.
    pub fn answer(&mut self, request: Request, out: &mut impl Publisher) {
        match request {
            Request::Hello => self.hello(out),
            Request::Features(wanted) => self.sender.wants_features = wanted,
            Request::Samples(wanted) => self.sender.wants_samples = wanted,
            // Without the feature `motion`, none is sent.
            Request::Motion(wanted) => self.sender.wants_motion = wanted,
            #[cfg(feature = "learn")]
            Request::Textures | Request::Learn(_) | Request::StopLearning | Request::ForgetTexture(_) => {
                let model = self.sender.model();
                self.sender.textures.request(request, model, self.sender.now);
            }
            // Others are about events, or from a newer host.
            request => self.sender.outbox.answer(request),
        }
    }

    /// Takes the textures that were learned. Their names have places of their own, so that events can have them.
    #[cfg(feature = "learn")]
    pub fn load_textures(&mut self, names: &'static Names, store: &mut impl SettingsStore) {
        let model = self.sender.model().map(setup::Kind::checksum);
        self.sender.textures.load(names, model, |place| store.texture(place));
    }

    /// Keeps a texture that was learned, forgets one that is to be forgotten, and sends what the host has to know of
    /// that. It is to be called between frames, when there is room for a message.
    #[cfg(feature = "learn")]
    #[inline(never)]
    pub fn keep_textures(&mut self, store: &mut impl SettingsStore, out: &mut impl Publisher) {
        if let Some(message) = self.sender.textures.step(|place, texture| store.keep_texture(place, texture)) {
            out.send(&message);
        }
    }

    /// Uses a texture model in place of the one that is compiled in. It is to be called before the first frame.
    #[cfg(feature = "models")]
    pub fn set_model(&mut self, model: &'static setup::Kind) {
        self.sender.model = Some(model);
    }

    /// Does what is to be done about models, and sends what the host has to know of that. It is to be called between
    /// frames, when there is room for a message.
    #[cfg(feature = "models")]
    #[inline(never)]
    pub fn keep_model(&mut self, store: &mut impl SettingsStore, out: &mut impl Publisher) {
        let Sender { outbox, held, .. } = &self.sender;
        let is_rest = held.is_none() && outbox.kept() == 0 && self.pipeline.end().incomplete.is_none();
        if let Some(message) = store.keep_model(is_rest) {
            out.send(&message);
        }
    }

    /// Sends the state of the stream. Frames cause that about once per second; without frames the caller does.
    pub fn status(&mut self, out: &mut impl Publisher) {
        self.status_at = self.pipeline.next_frame().saturating_add(STATUS_EVERY);
        out.send(&Message::Status { stream: self.pipeline.end(), dropped: self.dropped });
        self.send_telemetry(out);
    }

    fn send_telemetry(&mut self, out: &mut impl Publisher) {
        let Sender { outbox, wants_features, wants_samples, wants_motion, .. } = &self.sender;
        (self.telemetry.events, self.telemetry.kept) = (outbox.next_event(), outbox.kept());
        let wanted = &mut self.telemetry.wanted;
        (wanted.features, wanted.samples, wanted.motion) = (*wants_features, *wants_samples, *wants_motion);
        wanted.kept_events = outbox.is_heard();
        out.send(&Message::Telemetry(self.telemetry));
    }

    /// Sends the description of the board.
    pub fn hello(&self, out: &mut impl Publisher) {
        let mut models = [None; 3];
        models[0] =
            self.sender.model().map(|model| ModelFacts::new(model.task(), model.labels().len() as u8, model.frames()));
        out.send(&Message::Hello(Hello {
            firmware: Text::new(self.name),
            version: Text::new(env!("CARGO_PKG_VERSION")),
            size: self.size,
            format: setup::PIXELS,
            rate: self.pipeline.geometry().rate(),
            trigger: *self.pipeline.trigger_config(),
            models,
            frame: self.pipeline.next_frame(),
            revision: Text::new(env!("WSTAC_REVISION")),
            id: self.id,
        }));
    }

    /// Sends the next part of a sample that is wanted, or the event after its last part. Returns false if there was
    /// nothing to send.
    ///
    /// Call it when there is room for a message.
    ///
    /// A part is sent while its frames are still among the last 70. One part per frame is in time. After a long gap or
    /// on a slow line the remaining parts are left out, which the host can see.
    pub fn send_held(&mut self, out: &mut impl Publisher) -> bool {
        self.sender.send_held(self.pipeline.recent(), out)
    }

    /// Sends an event again that the host has not acknowledged in time. Returns false if there was nothing to send.
    ///
    /// Call it when there is room for a message.
    // It is not inlined, so that the message does not lie on the stack of a function that runs for ever.
    #[inline(never)]
    pub fn send_again(&mut self, out: &mut impl Publisher) -> bool {
        let Some(answers) = self.sender.outbox.due(self.sender.now) else { return false };
        out.send(&Message::Event(answers));
        true
    }

    /// Ends a stream that has an end: fills or ends a gap of lost frames, and sends how the stream ended.
    pub fn finish(&mut self, out: &mut impl Publisher) {
        while self.send_held(out) {}
        let finished = self.pipeline.finish();
        let (end, interrupted, contact_end) = (finished.end(), finished.interrupted(), finished.contact_end());
        if let Some(event) = finished.event() {
            // The end of a stream completes a sample only with lost frames.
            self.sender.event(&event, out);
        }
        let ends = self.sender.at_once.first_mut().map_or([contact_end, None], |at_once| at_once.finish(contact_end));
        for end in ends {
            self.sender.contact_end(end, out);
        }
        while self.send_held(out) {}
        if let Some(interrupted) = interrupted {
            out.send(&Message::InterruptedSample(interrupted));
        }
        out.send(&Message::End { stream: end, dropped: self.dropped });
    }

    /// Returns the number of the frame under way, or of the next one.
    pub fn next_frame(&self) -> u64 {
        self.pipeline.next_frame()
    }

    /// Returns the number of camera frames lost since the start.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

impl Sender {
    #[cfg(feature = "models")]
    fn model(&self) -> Option<&'static setup::Kind> {
        self.model
    }

    // It takes none of the reader, so that the compiler knows the model.
    #[cfg(not(feature = "models"))]
    #[inline(always)]
    #[expect(clippy::unused_self, reason = "another build has the model there")]
    fn model(&self) -> Option<&'static setup::Kind> {
        setup::MODEL
    }

    /// Sends the results of a push. Returns whether the touch under way is answered.
    fn give(&mut self, update: &Update<'_>, out: &mut impl Publisher) -> bool {
        if self.wants_features
            && let Some(frame) = update.frame()
        {
            out.send(&Message::Features { frame: frame.number, features: frame.features });
        }
        if let Some(slip) = self.slip.first_mut().and_then(|slip| slip.push(update)) {
            out.send(&Message::Slip(slip));
        }
        if let Some(interrupted) = update.interrupted() {
            let end = self.at_once.first_mut().and_then(AtOnce::restart);
            self.contact_end(end, out);
            out.send(&Message::InterruptedSample(interrupted));
        }
        // An event or a touch under way: there is room for one on the stack.
        let mut touch = update.event();
        let is_event = touch.is_some();
        // Samples over time, and those of ten sums, are of whole events.
        if <setup::Law as EventLaw>::ANSWERS_AT_ONCE
            && !is_event
            && !self.wants_samples
            && self.held.is_none()
            && !self.textures.are_learned()
            && (self.model().is_none() || <setup::ModelSample as ModelSample>::INPUT == Input::TaxelPath)
        {
            touch = update.touch();
        }
        let is_answered = touch.is_some_and(|touch| self.event(&touch, out)) && !is_event;
        let end = self.at_once.first_mut().map_or_else(|| update.contact_end(), |at_once| at_once.end(update));
        self.contact_end(end, out);
        if is_answered {
            return true;
        }
        if <setup::ModelSample as ModelSample>::HAS_PREFIXES
            && !is_event
            && let Some(model) = self.model()
            && let Some(prefix) = update.prefix(model.frames())
        {
            early_texture(&prefix, model, &mut self.textures, out);
        }
        false
    }

    /// Sends speed and direction of the newest frame if they are wanted and something slides.
    #[cfg(feature = "motion")]
    fn give_motion(&mut self, pipeline: &setup::BoardPipeline, out: &mut impl Publisher) {
        if !self.wants_motion {
            return;
        }
        if let Some(LiveContact { velocity: Some(velocity), basis, .. }) = self.live.newest(pipeline) {
            out.send(&Message::Motion { frame: pipeline.recent().0.saturating_sub(1), velocity, basis });
        }
    }

    /// Sends an event, or a touch under way that is certain, or keeps it until its sample is sent. An event that is
    /// still kept is older: it is sent first, without the rest of its sample. Returns whether there is an answer.
    fn event(&mut self, event: &Event<'_>, out: &mut impl Publisher) -> bool {
        if event.is_event() {
            self.send_held_event(out);
        }
        if !hold(&mut self.held, event, self.at_once.first_mut(), self.slip.first(), &self.law) {
            return false;
        }
        if let Some(model) = self.model() {
            let Self { held, law, motion, textures, now, .. } = self;
            if !add_texture(held, event, (law, *motion), model, (textures, *now)) {
                self.held = None;
                return false;
            }
        }
        // It comes behind the end of a touch before it that was not certain.
        let end = self.at_once.first_mut().and_then(AtOnce::last_end);
        self.contact_end(end, out);
        if !self.wants_samples {
            self.send_held_event(out);
        }
        true
    }

    /// Sends the kept event, and the end of its touch if that is known.
    // It is not inlined, so that the message does not lie on the stack while answers are computed.
    #[inline(never)]
    fn send_held_event(&mut self, out: &mut impl Publisher) {
        if let Some(held) = self.held.take() {
            out.send(&Message::Event(self.outbox.push(held.answers, self.now)));
            if let Some(end) = held.end {
                out.send(&Message::ContactEnd(ContactEnd::new(end, held.answers.frame)));
            }
        }
    }

    /// Sends the end of a touch, or keeps it until its event is sent.
    fn contact_end(&mut self, end: Option<ContactEnd>, out: &mut impl Publisher) {
        match (end, &mut self.held) {
            (Some(end), Some(held)) if held.answers.frame == end.event_frame => held.end = Some(end.frame),
            (Some(end), _) => out.send(&Message::ContactEnd(end)),
            (None, _) => {}
        }
    }

    /// Sends the next part of the kept sample, of which the last frames are `recent`, or the event.
    fn send_held(&mut self, (end, recent): (u64, Sample<'_>), out: &mut impl Publisher) -> bool {
        let Some(held) = &mut self.held else { return false };
        let first = (held.answers.frame + u64::from(held.next) + SAMPLE_FRAMES as u64).checked_sub(end);
        match first {
            Some(first) if usize::from(held.next) < SAMPLE_FRAMES => {
                let mut features = [[0; FEATURES]; SAMPLE_PART];
                for (place, numbers) in features.iter_mut().zip(recent.frames().skip(first as usize)) {
                    place.copy_from_slice(numbers);
                }
                out.send(&Message::SamplePart { frame: held.answers.frame, first: held.next, features });
                held.next += SAMPLE_PART as u8;
            }
            _ => self.send_held_event(out),
        }
        true
    }
}

/// Sends the answer of a model that needs no more frames, for the sample under way.
// It is not inlined: its copy of the sample would lie on the stack all the time.
#[inline(never)]
fn early_texture(
    prefix: &SamplePrefix<'_>,
    model: &'static setup::Kind,
    textures: &mut Textures,
    out: &mut impl Publisher,
) {
    let mut numbers = [0; INPUTS];
    prefix.copy_to(&mut numbers);
    let texture = textures.answer(&numbers, model);
    out.send(&Message::Texture { frame: prefix.frame, frames: model.frames(), texture });
}

/// Keeps an event's answers, without its texture, if it has some.
// It is not inlined either, and it writes to their place: another copy would lie on the stack of the law.
#[inline(never)]
fn hold(
    held: &mut Option<Held>,
    event: &Event<'_>,
    at_once: Option<&mut AtOnce>,
    slip: Option<&SlipDetector>,
    law: &setup::Law,
) -> bool {
    let keep = |answer: &Answer| {
        let _ = held.insert(Held { answers: Answers::of(event, answer), next: 0, end: None });
    };
    at_once::answer(event, law, at_once, slip, keep).is_some()
}

/// Adds the texture of an event that is kept, if it has one. Returns false if the model needs more of the path of a
/// touch under way.
// It is not inlined, so that the copy of the sample does not lie on the stack of the law.
#[inline(never)]
fn add_texture(
    held: &mut Option<Held>,
    event: &Event<'_>,
    (law, motion): (&setup::Law, MotionConfig),
    model: &'static setup::Kind,
    (textures, now): (&mut Textures, u32),
) -> bool {
    let Some(held) = held else { return true };
    textures.look(&held.answers, now);
    if held.answers.has_texture() {
        let velocity = law.path_velocity(event, held.answers.velocity());
        let of = <setup::ModelSample as ModelSample>::texture;
        if let Some(mut texture) = of(event, velocity, motion, model, textures) {
            if model.known_speeds().is_some_and(|speeds| speeds.exclude(velocity)) {
                texture.known = Some(false);
            }
            held.answers = held.answers.with_texture(texture);
        } else if event.is_under_way() && event.taxels().is_some() {
            return false;
        }
    }
    textures.leave();
    true
}

#[cfg(test)]
mod tests;
