//! Rows and losses in, messages for the host out: the core with what was compiled in, as `wstac run` has it on a host.

use wstac_core::early::SamplePrefix;
use wstac_core::error::Error;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::model::file::INPUTS;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::pipeline::{Pipeline, Update};
use wstac_core::rate::FrameRate;
use wstac_core::sample::Sample;
use wstac_core::speed::SpeedConfig;
use wstac_core::taxels::FrameGeometry;
use wstac_core::texture;
use wstac_core::trigger::Event;
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
    pipeline: Pipeline<setup::GreenChannel, setup::Ln, setup::BaselinePolicy>,
    sender: Sender,
    /// Size of the whole frames, for who asks.
    size: FrameSize,
    dropped: u64,
    status_at: u64,
}

/// Makes messages of what frames bring.
#[derive(Clone, Debug)]
struct Sender {
    speed: SpeedConfig,
    wants_features: bool,
    wants_samples: bool,
    held: Option<Held>,
}

/// An event whose sample is being sent, a part at a time: its frames stay among the pipeline's last ones for a while.
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
    /// What [`FrameGeometry::with_stride`] and [`Pipeline::builder`] say of the configuration.
    // A function of its own: what it is made of would lie on the stack of what runs for ever.
    #[inline(never)]
    pub fn new(layout: Layout, size: FrameSize, rate: FrameRate, speed: SpeedConfig) -> Result<Self, Error> {
        let camera = FrameGeometry::with_stride(setup::GREEN, layout, rate, setup::STRIDE)?;
        let pipeline = setup::checked(camera)?;
        Ok(Self {
            pipeline: pipeline.build(),
            sender: Sender { speed, wants_features: false, wants_samples: false, held: None },
            size,
            dropped: 0,
            status_at: STATUS_EVERY,
        })
    }

    /// Takes the next rows of a frame.
    ///
    /// # Errors
    /// Those of [`Pipeline::push_stripe`]: the rows are not of this layout; nothing was taken.
    pub fn rows(&mut self, rows: &[u8], out: &mut impl Outlet) -> Result<(), Error> {
        let update = self.pipeline.push_stripe(rows)?;
        if update.is_frame() {
            self.sender.give(&update, out);
            if self.pipeline.next_frame() >= self.status_at {
                self.status(out);
            }
        }
        Ok(())
    }

    /// Gives up the frame under way: it is lost.
    pub fn abandon_frame(&mut self, out: &mut impl Outlet) {
        self.note_lost(1, out);
        self.sender.give(&self.pipeline.abandon_frame(), out);
    }

    /// Takes note of frames that were lost.
    pub fn lost(&mut self, frames: u64, out: &mut impl Outlet) {
        self.note_lost(frames, out);
        self.sender.give(&self.pipeline.push_lost(frames), out);
    }

    fn note_lost(&mut self, frames: u64, out: &mut impl Outlet) {
        self.dropped = self.dropped.saturating_add(frames);
        out.send(&Message::Lost { frames });
    }

    /// Does what the host asks for.
    pub fn answer(&mut self, request: Request, out: &mut impl Outlet) {
        match request {
            Request::Hello => self.hello(out),
            Request::Features(wanted) => self.sender.wants_features = wanted,
            Request::Samples(wanted) => self.sender.wants_samples = wanted,
            // Of a newer host.
            _ => {}
        }
    }

    /// Says how the stream stands. Frames bring that about once a second; without frames it is for the caller.
    pub fn status(&mut self, out: &mut impl Outlet) {
        self.status_at = self.pipeline.next_frame().saturating_add(STATUS_EVERY);
        out.send(&Message::Status { stream: self.pipeline.end(), dropped: self.dropped });
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
            rate: self.pipeline.geometry().rate(),
            trigger: setup::TRIGGER,
            models,
            frame: self.pipeline.next_frame(),
        }));
    }

    /// Sends the next part of a sample that is wanted, or the event after its last part; call it when there is room for a
    /// message. Nothing to send is false.
    ///
    /// A part goes out while its frames are still among the last 70. One part a frame is in time; after a long gap or on a slow
    /// line the rest of the parts is left out, which the host can see.
    pub fn send_held(&mut self, out: &mut impl Outlet) -> bool {
        self.sender.send_held(self.pipeline.recent(), out)
    }

    /// Settles what is pending at the end of a stream that has one, and says how it ended.
    pub fn finish(&mut self, out: &mut impl Outlet) {
        while self.send_held(out) {}
        let finished = self.pipeline.finish();
        let (end, interrupted) = (finished.end(), finished.interrupted());
        if let Some(event) = finished.event() {
            self.sender.event(&event, out);
            while self.send_held(out) {}
        }
        if let Some(interrupted) = interrupted {
            out.send(&Message::Incomplete(interrupted));
        }
        out.send(&Message::End { stream: end, dropped: self.dropped });
    }

    /// Camera frames lost since the start.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

impl Sender {
    /// Sends what a push brought.
    fn give(&mut self, update: &Update<'_>, out: &mut impl Outlet) {
        if self.wants_features
            && let Some(frame) = update.frame()
        {
            out.send(&Message::Features { frame: frame.number, features: frame.features });
        }
        if let Some(interrupted) = update.interrupted() {
            out.send(&Message::Incomplete(interrupted));
        }
        match update.event() {
            Some(event) => self.event(&event, out),
            None => {
                if let Some(model) = setup::MODEL
                    && let Some(prefix) = update.prefix(model.frames())
                {
                    early_texture(&prefix, model, out);
                }
            }
        }
    }

    /// Sends an event, or keeps it until its sample is sent. One that is still kept is older: it goes out first, without the rest of its
    /// sample.
    fn event(&mut self, event: &Event<'_>, out: &mut impl Outlet) {
        let answers = answers(event, &self.speed);
        if let Some(older) = self.held.take() {
            out.send(&Message::Event(older.answers));
        }
        if self.wants_samples {
            self.held = Some(Held { answers, next: 0 });
        } else {
            out.send(&Message::Event(answers));
        }
    }

    /// Sends the next part of the sample that is kept, of which the last frames are `recent`, or the event.
    fn send_held(&mut self, (end, recent): (u64, Sample<'_>), out: &mut impl Outlet) -> bool {
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
            _ => {
                out.send(&Message::Event(held.answers));
                self.held = None;
            }
        }
        true
    }
}

/// Says what a model that needs no more frames makes of the sample under way.
// A frame of its own: its copy of the sample would lie on the stack all the time.
#[inline(never)]
fn early_texture(prefix: &SamplePrefix<'_>, model: &setup::Kind, out: &mut impl Outlet) {
    let mut numbers = [0; INPUTS];
    prefix.copy_to(&mut numbers);
    let texture = texture::texture(&numbers, model).into();
    out.send(&Message::Texture { frame: prefix.frame, frames: model.frames(), texture });
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
