//! A simulated board: it runs a scene through the core and sends messages as firmware does.

use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::law::{ByWave, EventLaw};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::fixed::Fixed;
use wstac_core::model::Model;
use wstac_core::paper::baseline_policy::FixedBaseline;
use wstac_core::paper::trigger::{Event, TriggerConfig};
use wstac_core::pipeline::{Finished, Pipeline, Update};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::texture::texture;
use wstac_core::touch::at_once::{AtOnce, answer};
use wstac_core::touch::motion::{LiveWave, MotionConfig, Readout};
use wstac_core::touch::slip::SlipDetector;
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_core::wire::{Answers, Hello, LONGEST, Message, ModelFacts, Text, TextureAnswer, encode, sample_parts};
use wstac_host::model_file::ModelFile;
use wstac_host::source::open::{OpenOptions, open};
use wstac_host::source::{Frame, SourceEvent, StreamInfo};
use wstac_scene::source::Scenes;

/// The messages that a board has sent, one encoded frame of the link each.
pub(crate) struct Sent {
    pub(crate) frames: Vec<Vec<u8>>,
}

impl Sent {
    pub(crate) fn push(&mut self, message: &Message) {
        let sequence = self.frames.len() as u16;
        self.frames.push(encode(message, sequence, &mut [0; LONGEST]).to_vec());
    }
}

/// Returns what a board's first message says.
pub(crate) fn hello() -> Hello<'static> {
    Hello {
        firmware: Text::new("test-board"),
        version: Text::new("1.2.3"),
        size: FrameSize::new(320, 240).unwrap(),
        format: PixelFormat::Gray,
        rate: FrameRate::NOMINAL,
        trigger: TriggerConfig::default(),
        models: [None; 3],
        frame: 0,
        revision: Text::new("0123abc"),
        id: Some([1, 2, 0xA3]),
    }
}

struct Board<'m> {
    at_once: AtOnce,
    is_at_once: bool,
    law: ByWave,
    models: Vec<Model<'m>>,
    dropped: u64,
    live: LiveWave,
    slip: SlipDetector,
    /// The number of the next event.
    events: u16,
    /// Whether features, samples and motion are sent, too.
    all: bool,
    sent: Sent,
}

/// Returns everything that a board sends for a scene, from its hello to its end. With `all`, that includes features and
/// motion, and samples unless it answers `at_once`.
pub(crate) fn sent(scene: &str, models: &[ModelFile], all: bool, at_once: bool) -> Sent {
    let mut source = open(scene, &OpenOptions::default(), &[&Scenes]).unwrap();
    let info = source.info().clone();
    let green = Any::new(info.format, info.color, YcbcrMethod::Exact);
    let camera = FrameGeometry::new(green, Layout::paper(info.size).unwrap(), info.rate).unwrap();
    let trigger = TriggerConfig::default().one_event_per_touch();
    let mut pipeline = Pipeline::builder(camera).trigger(trigger).taxels::<TaxelRing>().build().unwrap();
    let mut board = Board {
        law: ByWave(MotionConfig::published(info.rate).with_readout(Readout::GLOBAL)),
        models: models.iter().map(|file| file.model().unwrap()).collect(),
        dropped: 0,
        live: LiveWave::new(MotionConfig::published(info.rate).with_readout(Readout::GLOBAL)),
        slip: SlipDetector::new(info.rate),
        events: 0,
        all,
        at_once: AtOnce::new(MotionConfig::published(info.rate)),
        // The models are over time.
        is_at_once: at_once && models.is_empty(),
        sent: Sent { frames: Vec::new() },
    };
    board.hello(&info, pipeline.trigger_config());
    loop {
        let update = match source.next_event().unwrap() {
            SourceEvent::Frame(Frame { bytes, .. }) => pipeline.push_frame(bytes).unwrap(),
            SourceEvent::Taxels(frame) => pipeline.push_taxels(&frame.sums),
            SourceEvent::Lost { frames, .. } => {
                board.dropped += frames;
                board.sent.push(&Message::Lost { frames });
                pipeline.push_lost(frames)
            }
            SourceEvent::End => break,
            _ => continue,
        };
        let is_answered = board.take(&update);
        let is_frame = update.is_frame();
        if is_answered {
            pipeline.answer_touch();
        }
        board.motion(&pipeline);
        if is_frame && pipeline.next_frame().is_multiple_of(30) {
            board.sent.push(&Message::Status { stream: pipeline.end(), dropped: board.dropped });
        }
    }
    board.finish(&pipeline.finish())
}

impl Board<'_> {
    fn hello(&mut self, info: &StreamInfo, trigger: &TriggerConfig) {
        let mut models = [None; 3];
        for (place, model) in models.iter_mut().zip(&self.models) {
            let classes = model.labels().len() as u8;
            *place = Some(ModelFacts::new(model.task(), classes, model.frames()));
        }
        let (size, format, rate, trigger) = (info.size, info.format, info.rate, *trigger);
        self.sent.push(&Message::Hello(Hello { size, format, rate, trigger, models, ..hello() }));
    }

    /// Returns whether the touch under way is answered.
    fn take(&mut self, update: &Update<'_>) -> bool {
        if self.all
            && let Some(frame) = update.frame()
        {
            self.sent.push(&Message::Features { frame: frame.number, features: frame.features });
        }
        if let Some(slip) = self.slip.push(update) {
            self.sent.push(&Message::Slip(slip));
        }
        if let Some(sample) = update.interrupted() {
            if let Some(end) = self.at_once.restart() {
                self.sent.push(&Message::ContactEnd(end));
            }
            self.sent.push(&Message::InterruptedSample(sample));
        }
        if let Some(event) = update.event() {
            self.event(&event);
        }
        if let Some(end) = self.at_once.end(update) {
            self.sent.push(&Message::ContactEnd(end));
        }
        if let Some(touch) = update.touch().filter(|_| self.is_at_once) {
            return self.event(&touch);
        }
        for model in &self.models {
            if let Some(prefix) = update.prefix(model.frames()) {
                let texture = texture(&prefix.flat(), model).into();
                self.sent.push(&Message::Texture { frame: prefix.frame, frames: model.frames(), texture });
            }
        }
        false
    }

    fn motion(&mut self, pipeline: &Pipeline<Any, Fixed, FixedBaseline, TaxelRing>) {
        let (next_frame, recent) = pipeline.recent();
        if let Some(baseline) = pipeline.baseline()
            && let Some(touch) = self.live.push(next_frame, recent, baseline, pipeline.taxel_ring())
            && let Some(velocity) = touch.velocity
            && self.all
        {
            self.sent.push(&Message::Motion { frame: next_frame - 1, velocity, basis: touch.basis });
        }
    }

    /// Returns whether there is an answer.
    fn event(&mut self, event: &Event<'_>) -> bool {
        let at_once = Some(&mut self.at_once);
        let Some(answer) = answer(event, &self.law, at_once, Some(&self.slip), |answer| *answer) else { return false };
        if let Some(end) = self.at_once.last_end() {
            self.sent.push(&Message::ContactEnd(end));
        }
        let mut answers = Answers::of(event, &answer);
        let models = self.models.iter().filter(|_| answers.has_texture()).collect::<Vec<_>>();
        let velocity = self.law.path_velocity(event, answers.velocity());
        for model in models {
            let mut texture = TextureAnswer::from(texture(&event.sample.flat(), model));
            if model.known_speeds().is_some_and(|speeds| speeds.exclude(velocity)) {
                texture.known = Some(false);
            }
            answers = answers.with_texture(texture);
        }
        if self.all && event.is_event() {
            sample_parts(event.frame, event.sample).for_each(|part| self.sent.push(&part));
        }
        (answers.number, self.events) = (self.events, self.events + 1);
        self.sent.push(&Message::Event(answers));
        true
    }

    fn finish(mut self, finished: &Finished<'_>) -> Sent {
        if let Some(event) = finished.event() {
            self.event(&event);
        }
        for end in self.at_once.finish(finished.contact_end()).into_iter().flatten() {
            self.sent.push(&Message::ContactEnd(end));
        }
        if let Some(sample) = finished.interrupted() {
            self.sent.push(&Message::InterruptedSample(sample));
        }
        self.sent.push(&Message::End { stream: finished.end(), dropped: self.dropped });
        self.sent
    }
}
