//! Textures that a board learns while the host watches.

use std::cell::Cell;
use std::time::{Duration, Instant};

use wstac_core::wire::{LearnedTextures, Learning, LearningStep, Message, Request, TextureName};

use super::port::Got;
use super::settings::SettableBoard;
use crate::error::Error;

/// The time between two requests for the state of learning.
const POLL: Duration = Duration::from_secs(1);
/// The longest time without any message of a board that learns. It sends its state about once per second.
const SILENT: Duration = Duration::from_secs(10);

/// The most lists with a texture that may come after it was asked to be forgotten.
const STALE: u32 = 3;

/// The result of [`SettableBoard::learn`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Learned {
    /// The board has learned the texture, and keeps it.
    Whole,
    /// The host has asked the board to stop.
    Stopped,
}

/// The news of a board while it learns.
enum Heard {
    State(Learning),
    /// The texture that is being learned, and whether the asked one is among the learned ones.
    All(Option<Learning>, bool),
}

impl SettableBoard {
    /// Returns the textures that the board has learned; `None` if its firmware does not learn.
    ///
    /// # Errors
    /// The port cannot be read, or the board does not answer.
    pub fn textures(&mut self) -> Result<Option<LearnedTextures>, Error> {
        // A firmware that does not learn answers the second request only. Others answer the first one later than that,
        // when a frame has ended: so one answer to the second is not enough.
        let has_waited = Cell::new(false);
        self.ask(&[Request::Textures, Request::Settings], |message| match message {
            Message::Textures(textures) => Some(Some(*textures)),
            Message::Settings(_) => has_waited.replace(true).then_some(None),
            _ => None,
        })
    }

    /// Lets the board learn a texture from the next slides, until it has learned it or `is_over` returns true. Each new
    /// state is passed to `told`.
    ///
    /// # Errors
    /// The board cannot learn, does not answer any more, or has started again. The port cannot be read.
    pub fn learn(
        &mut self,
        name: TextureName,
        mut told: impl FnMut(&Learning),
        is_over: impl Fn() -> bool,
    ) -> Result<Learned, Error> {
        if self.textures()?.is_none() {
            return Err(self.lacks("does not learn textures, expected a firmware with the feature learn"));
        }
        let mut last = self.ask(&[Request::Learn(name)], |message| match message {
            Message::Learning(state) if state.name == name => Some(*state),
            _ => None,
        })?;
        loop {
            told(&last);
            match last.step {
                LearningStep::Learned => return Ok(Learned::Whole),
                LearningStep::Failed(reason) => {
                    return Err(self.failed(format_args!("does not learn the texture: {reason}")));
                }
                _ => {}
            }
            match self.next_state(&last, &is_over)? {
                Some(state) => last = state,
                None => return Ok(Learned::Stopped),
            }
        }
    }

    /// Waits for a state after this one; `None` if learning was to be stopped.
    fn next_state(&mut self, last: &Learning, is_over: &impl Fn() -> bool) -> Result<Option<Learning>, Error> {
        let (mut asked, mut heard) = (Instant::now(), Instant::now());
        let mut byte = [0];
        loop {
            if is_over() {
                self.send(&Request::StopLearning);
                return Ok(None);
            }
            if asked.elapsed() > POLL {
                asked = Instant::now();
                self.send(&Request::Textures);
            }
            let got = self.port.read(&mut byte)?;
            if got == Got::Ended || heard.elapsed() > SILENT {
                return Err(self.failed("does not answer any more"));
            }
            let Got::Bytes(1) = got else { continue };
            let found = self.push(byte[0], |message| match message {
                Message::Learning(state) => Some(Heard::State(*state)),
                Message::Textures(all) => Some(Heard::All(all.learning, all.names.contains(&Some(last.name)))),
                _ => None,
            })?;
            match found {
                Some(Heard::State(state)) if state.name == last.name => return Ok(Some(state)),
                Some(Heard::All(Some(state), _)) if state.name == last.name => {
                    heard = Instant::now();
                    // A message about this slide was lost.
                    if state.slides > last.slides {
                        return Ok(Some(state));
                    }
                }
                Some(Heard::All(_, is_kept)) => {
                    // The last message was lost, or a reset has ended learning.
                    if last.slides + 1 >= last.needed && is_kept {
                        let state = Learning::new(last.name, last.needed, last.needed, LearningStep::Learned);
                        return Ok(Some(state));
                    }
                    return Err(self.failed("has stopped learning: it has started again, or learns another texture"));
                }
                _ => {}
            }
        }
    }

    /// Lets the board forget a texture that it has learned, and waits until it has.
    ///
    /// # Errors
    /// The board has no such texture, or does not forget it. The port cannot be read.
    pub fn forget_texture(&mut self, name: TextureName) -> Result<(), Error> {
        let has = |textures: &LearnedTextures| textures.names.contains(&Some(name));
        if !self.textures()?.is_some_and(|textures| has(&textures)) {
            return Err(self.failed(format_args!("has learned no texture {name}")));
        }
        // Answers to earlier requests may still come, so the board is asked several times.
        let lists = Cell::new(0);
        let left = self.ask(&[Request::ForgetTexture(name)], |message| match message {
            Message::Textures(textures) if !has(textures) => Some(false),
            Message::Textures(_) => {
                lists.set(lists.get() + 1);
                (lists.get() > STALE).then_some(true)
            }
            _ => None,
        })?;
        if left {
            return Err(self.failed("does not forget the texture: its memory failed"));
        }
        Ok(())
    }
}
