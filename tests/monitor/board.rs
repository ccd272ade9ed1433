//! A board in a program: a scene through the core into messages, as firmware sends them.

use wstac_core::early::EarlySampler;
use wstac_core::features::Features;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::layout::Layout;
use wstac_core::model::Model;
use wstac_core::speed::SpeedConfig;
use wstac_core::stream::{FeatureFrame, FeatureStream};
use wstac_core::taxels::FrameGeometry;
use wstac_core::texture::texture;
use wstac_core::trigger::{Event, Trigger, TriggerConfig};
use wstac_core::wire::{Answers, Hello, LONGEST, Message, ModelFacts, Text, encode, sample_parts};
use wstac_host::model_file::ModelFile;
use wstac_host::source::open::{OpenOptions, open};
use wstac_host::source::{SourceEvent, StreamInfo};
use wstac_scene::source::Scenes;

/// What a board sends: a frame of the link each.
pub(crate) struct Sent {
    pub(crate) frames: Vec<Vec<u8>>,
}

impl Sent {
    pub(crate) fn push(&mut self, message: &Message) {
        let sequence = self.frames.len() as u16;
        self.frames.push(encode(message, sequence, &mut [0; LONGEST]).to_vec());
    }
}

struct Board<'m> {
    trigger: Trigger,
    speed: SpeedConfig,
    models: Vec<(Model<'m>, EarlySampler)>,
    dropped: u64,
    /// Features and samples are wanted.
    all: bool,
    sent: Sent,
}

/// Everything that a board sends of a scene, from its hello to its end; `all`: with features and samples.
pub(crate) fn sent(scene: &str, models: &[ModelFile], all: bool) -> Sent {
    let mut source = open(scene, &OpenOptions::default(), &[&Scenes]).unwrap();
    let info = source.info().clone();
    let green = Any::new(info.format, info.color, YcbcrMethod::Exact);
    let camera = FrameGeometry::new(green, Layout::paper(info.size).unwrap(), info.rate).unwrap();
    let mut stream: FeatureStream<_, wstac_core::ln::fixed::Fixed> = FeatureStream::new(camera, 0.5).unwrap();
    let models = models.iter().map(|file| file.model().unwrap());
    let mut board = Board {
        trigger: Trigger::new(TriggerConfig::default()),
        speed: SpeedConfig::published(info.rate),
        models: models.map(|model| (model, EarlySampler::new(model.frames()))).collect(),
        dropped: 0,
        all,
        sent: Sent { frames: Vec::new() },
    };
    board.hello(&info);
    loop {
        let frame = match source.next_event().unwrap() {
            SourceEvent::Frame { bytes, .. } => stream.push_frame(bytes).unwrap(),
            SourceEvent::Taxels(sums) => stream.push_taxels(&sums),
            SourceEvent::Lost { frames, .. } => {
                board.dropped += frames;
                board.sent.push(&Message::Lost { frames });
                let loss = stream.push_lost(frames);
                match loss.has_missing_frames {
                    Some(frame) => board.take(frame, loss.frames),
                    None => board.trigger.push_lost(loss.frames),
                }
                None
            }
            SourceEvent::Fault(_) | SourceEvent::Waiting => None,
            SourceEvent::End => break,
        };
        if let Some(frame) = frame {
            board.take(frame, 0);
        }
    }
    board.finish()
}

impl Board<'_> {
    fn hello(&mut self, info: &StreamInfo) {
        let mut models = [None; 3];
        for (place, (model, _)) in models.iter_mut().zip(&self.models) {
            let classes = model.labels().len() as u8;
            *place = Some(ModelFacts { task: model.task(), classes, frames: model.frames() });
        }
        self.sent.push(&Message::Hello(Hello {
            firmware: Text::new("test-board"),
            version: Text::new("1.2.3"),
            size: info.size,
            format: info.format,
            rate: info.rate,
            trigger: *self.trigger.config(),
            models,
            frame: 0,
        }));
    }

    fn take(&mut self, frame: FeatureFrame, lost_after: u64) {
        if self.all {
            let message = Message::Features { frame: self.trigger.next_frame(), features: frame.features };
            self.sent.push(&message);
        }
        let event = self.trigger.push_then_lose(frame.features, frame.has_missing_frames, lost_after);
        let event = event.map(|event| Kept::new(&event));
        if let Some(sample) = self.trigger.take_interrupted() {
            self.sent.push(&Message::InterruptedSample(sample));
        }
        match event {
            Some(event) => self.event(&event),
            None => self.beginnings(),
        }
        if self.trigger.next_frame().is_multiple_of(30) {
            self.sent.push(&Message::Status { stream: self.trigger.end(), dropped: self.dropped });
        }
    }

    fn beginnings(&mut self) {
        for (model, early) in &mut self.models {
            if let Some(beginning) = early.take(&self.trigger) {
                let texture = texture(&beginning.flat(), model).into();
                self.sent.push(&Message::Texture { frame: beginning.frame, frames: model.frames(), texture });
            }
        }
    }

    fn event(&mut self, kept: &Kept) {
        let event = kept.event();
        let mut answers = Answers::new(&event, &self.speed);
        for (model, _) in &self.models {
            answers = answers.with_texture(texture(&event.sample.flat(), model));
        }
        if self.all {
            sample_parts(event.frame, event.sample).for_each(|part| self.sent.push(&part));
        }
        self.sent.push(&Message::Event(answers));
    }

    fn finish(mut self) -> Sent {
        let event = self.trigger.finish().map(|event| Kept::new(&event));
        if let Some(event) = event {
            self.event(&event);
        }
        if let Some(sample) = self.trigger.take_interrupted() {
            self.sent.push(&Message::InterruptedSample(sample));
        }
        self.sent.push(&Message::End { stream: self.trigger.end(), dropped: self.dropped });
        self.sent
    }
}

/// An event that does not hold the trigger.
struct Kept {
    frame: u64,
    frames: [Features; 70],
    baseline: wstac_core::baseline::Baseline,
    frames_filled: u8,
    reliable: bool,
}

impl Kept {
    fn new(event: &Event) -> Self {
        Self {
            frame: event.frame,
            frames: *event.sample.flat().as_chunks().0.as_array().unwrap(),
            baseline: *event.baseline,
            frames_filled: event.frames_filled,
            reliable: event.reliable,
        }
    }

    fn event(&self) -> Event<'_> {
        Event {
            frame: self.frame,
            sample: wstac_core::sample::Sample::from_frames(&self.frames),
            baseline: &self.baseline,
            frames_filled: self.frames_filled,
            reliable: self.reliable,
        }
    }
}
