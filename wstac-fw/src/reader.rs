//! Rows and losses in, messages for the host out: the core with what was compiled in, as `wstac run` has it on a host.

use wstac_core::early::EarlySampler;
use wstac_core::error::Error;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::model::file::INPUTS;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::rate::FrameRate;
use wstac_core::speed::SpeedConfig;
use wstac_core::stream::{FeatureFrame, FeatureStream, Loss};
use wstac_core::taxels::FrameGeometry;
use wstac_core::texture;
use wstac_core::trigger::{Event, Trigger};
use wstac_core::wire::{Answers, Hello, Message, ModelFacts, Request, SAMPLE_PART, Text};

use crate::setup;

/// Frames from one status to the next: about a second.
const STATUS_EVERY: u64 = 30;

/// Takes messages. One that it has no place for is left out.
pub trait Outlet {
    /// Takes a message.
    fn send(&mut self, message: &Message<'_>);
}

/// The core between a camera and a link.
#[derive(Clone, Debug)]
pub struct Reader {
    stream: FeatureStream<setup::GreenChannel, setup::Ln>,
    trigger: Trigger<setup::BaselinePolicy>,
    speed: SpeedConfig,
    early: Option<EarlySampler>,
    /// Size of the whole frames, for who asks.
    size: FrameSize,
    wants_features: bool,
    wants_samples: bool,
    dropped: u64,
    status_at: u64,
    held: Option<Held>,
}

/// An event whose sample is being sent, a part at a time: its frames stay among the trigger's last ones for a while.
#[derive(Clone, Debug)]
struct Held {
    answers: Answers<'static>,
    /// The sample's frame that the next part starts with.
    next: u8,
}

impl Reader {
    /// The core for rows of [`setup::PIXELS`] with taxels at `layout`, at this rate; `size` is that of the frames that they are from. `speed` is
    /// [`setup::speed`] of that rate, which a `const` works out.
    ///
    /// # Errors
    /// What [`FrameGeometry::with_stride`] and [`FeatureStream::with_floor`] say of the configuration.
    pub fn new(layout: Layout, size: FrameSize, rate: FrameRate, speed: SpeedConfig) -> Result<Self, Error> {
        let camera = FrameGeometry::with_stride(setup::GREEN, layout, rate, setup::STRIDE)?;
        Ok(Self {
            stream: FeatureStream::with_floor(camera, setup::FLOOR)?,
            trigger: Trigger::with(setup::TRIGGER, 0, setup::FOLLOWING),
            speed,
            early: setup::MODEL.map(|model| EarlySampler::new(model.frames())),
            size,
            wants_features: false,
            wants_samples: false,
            dropped: 0,
            status_at: STATUS_EVERY,
            held: None,
        })
    }

    /// Takes the next rows of a frame.
    ///
    /// # Errors
    /// Those of [`FeatureStream::push_stripe`]: the rows are not of this layout; nothing was taken.
    pub fn rows(&mut self, rows: &[u8], out: &mut impl Outlet) -> Result<(), Error> {
        if let Some(frame) = self.stream.push_stripe(rows)? {
            self.frame(frame, 0, out);
            if self.trigger.next_frame() >= self.status_at {
                self.status(out);
            }
        }
        Ok(())
    }

    /// Gives up the frame under way: it is lost.
    pub fn abandon_frame(&mut self, out: &mut impl Outlet) {
        let loss = self.stream.abandon_frame();
        self.lose(1, loss, out);
    }

    /// Takes note of frames that were lost.
    pub fn lost(&mut self, frames: u64, out: &mut impl Outlet) {
        let loss = self.stream.push_lost(frames);
        self.lose(frames, loss, out);
    }

    /// Does what the host asks for.
    pub fn answer(&mut self, request: Request, out: &mut impl Outlet) {
        match request {
            Request::Hello => self.hello(out),
            Request::Features(wanted) => self.wants_features = wanted,
            Request::Samples(wanted) => self.wants_samples = wanted,
            // Of a newer host.
            _ => {}
        }
    }

    /// Says how the stream stands. Frames bring that about once a second; without frames it is for the caller.
    pub fn status(&mut self, out: &mut impl Outlet) {
        self.status_at = self.trigger.next_frame().saturating_add(STATUS_EVERY);
        out.send(&Message::Status { stream: self.trigger.end(), dropped: self.dropped });
    }

    /// Says what the board is.
    pub fn hello(&self, out: &mut impl Outlet) {
        let mut models = [None; 3];
        models[0] = setup::MODEL.map(|model| ModelFacts {
            task: model.task(),
            classes: model.labels().len() as u8,
            frames: model.frames(),
        });
        out.send(&Message::Hello(Hello {
            firmware: Text::new(env!("CARGO_PKG_NAME")),
            version: Text::new(env!("CARGO_PKG_VERSION")),
            size: self.size,
            format: setup::PIXELS,
            rate: self.stream.camera().rate(),
            trigger: setup::TRIGGER,
            models,
            frame: self.trigger.next_frame(),
        }));
    }

    /// Sends the next part of a sample that is wanted, or the event after its last part; call it when there is room for a
    /// message. Nothing to send is false.
    ///
    /// A part goes out while its frames are still among the last 70. One part a frame is in time; after a long gap or on a slow
    /// line the rest of the parts is left out, which the host can see.
    pub fn send_held(&mut self, out: &mut impl Outlet) -> bool {
        let Some(held) = &mut self.held else { return false };
        let (end, recent) = self.trigger.recent();
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
            _ => {
                out.send(&Message::Event(held.answers));
                self.held = None;
            }
        }
        true
    }

    /// Settles what is pending at the end of a stream that has one, and says how it ended.
    pub fn finish(&mut self, out: &mut impl Outlet) {
        while self.send_held(out) {}
        if let Some(answers) = self.trigger.finish().map(|event| answers(&event, &self.speed)) {
            self.event(answers, out);
            while self.send_held(out) {}
        }
        if let Some(interrupted) = self.trigger.take_interrupted() {
            out.send(&Message::Incomplete(interrupted));
        }
        out.send(&Message::End { stream: self.trigger.end(), dropped: self.dropped });
    }

    /// Camera frames lost since the start.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    fn lose(&mut self, frames: u64, loss: Loss, out: &mut impl Outlet) {
        self.dropped = self.dropped.saturating_add(frames);
        out.send(&Message::Lost { frames });
        match loss.has_missing_frames {
            Some(frame) => self.frame(frame, loss.frames, out),
            None => self.trigger.push_lost(loss.frames),
        }
    }

    fn frame(&mut self, frame: FeatureFrame, lost_after: u64, out: &mut impl Outlet) {
        if self.wants_features {
            out.send(&Message::Features { frame: self.trigger.next_frame(), features: frame.features });
        }
        let event = self.trigger.push_then_lose(frame.features, frame.has_missing_frames, lost_after);
        let answers = event.map(|event| answers(&event, &self.speed));
        if let Some(interrupted) = self.trigger.take_interrupted() {
            out.send(&Message::Incomplete(interrupted));
        }
        match answers {
            Some(answers) => self.event(answers, out),
            None => self.beginning(out),
        }
    }

    /// Sends an event, or keeps it until its sample is sent. One that is still kept is older: it goes out first, without the rest of its
    /// sample.
    fn event(&mut self, answers: Answers<'static>, out: &mut impl Outlet) {
        if let Some(older) = self.held.take() {
            out.send(&Message::Event(older.answers));
        }
        if self.wants_samples {
            self.held = Some(Held { answers, next: 0 });
        } else {
            out.send(&Message::Event(answers));
        }
    }

    /// Says what a model that needs no more frames makes of the sample under way.
    // A frame of its own: its copy of the sample would lie on the stack all the time.
    #[inline(never)]
    fn beginning(&mut self, out: &mut impl Outlet) {
        let (Some(model), Some(early)) = (setup::MODEL, &mut self.early) else { return };
        if let Some(beginning) = early.take(&self.trigger) {
            let mut numbers = [0; INPUTS];
            beginning.copy_to(&mut numbers);
            let texture = texture::texture(&numbers, model).into();
            out.send(&Message::Texture { frame: beginning.frame, frames: model.frames(), texture });
        }
    }
}

/// An event's answers, its texture included.
// As above.
#[inline(never)]
fn answers(event: &Event<'_>, speed: &SpeedConfig) -> Answers<'static> {
    let answers = Answers::new(event, speed);
    match setup::MODEL {
        Some(model) => {
            let mut numbers = [0; INPUTS];
            event.sample.copy_to(&mut numbers);
            answers.with_texture(texture::texture(&numbers, model))
        }
        None => answers,
    }
}

#[cfg(test)]
mod tests;
