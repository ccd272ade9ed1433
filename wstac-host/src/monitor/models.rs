//! Texture models that are sent to a board in pieces.

use std::cell::Cell;
use std::fmt::Display;
use std::time::Duration;

use wstac_core::model::Model;
use wstac_core::wire::{
    BoardModel, MODEL_PIECE, Message, ModelId, ModelKind, ModelPiece, ModelRefusal, ModelStep, Request,
};

use super::settings::SettableBoard;
use crate::error::{Error, ErrorKind};
use crate::model_file::ModelFile;

/// The longest wait until a board that keeps another model uses it. It waits until no event is under way.
const LONGEST_START: Duration = Duration::from_secs(30);
/// The time between two looks at a board that starts again.
const RESTART: Duration = Duration::from_millis(500);
/// The number of times that a model is sent if the board starts again meanwhile.
const TRIES: u32 = 3;

const NO_MODELS: &str = "takes no models, expected a firmware with the feature models";

/// The name of a model's kind, as `WSTAC_MODELS` of the firmware and `wstac board --json` spell it.
pub const fn kind_name(kind: ModelKind) -> &'static str {
    match kind {
        ModelKind::LinearSvm => "linear_svm",
        ModelKind::Forest => "forest",
        ModelKind::Boosted => "boosted",
        ModelKind::Network => "network",
    }
}

/// Returns the name of the model with this checksum if it comes with the program.
pub fn built_in_name(checksum: u32) -> Option<&'static str> {
    let has_sum = |file: Result<ModelFile, Error>| file.is_ok_and(|file| file.words().get(1) == Some(&checksum));
    ModelFile::built_in().find_map(|(name, file)| has_sum(file).then_some(name))
}

/// Checks a file before it is sent to a board in this state.
///
/// # Errors
/// The file is no valid model, or the board would refuse it.
pub fn check_model(file: &ModelFile, board: &BoardModel) -> Result<ModelId, Error> {
    let (model, accepts) = (file.model()?, &board.accepts);
    let kind = match model {
        Model::LinearSvm(_) => ModelKind::LinearSvm,
        Model::Forest(_) => ModelKind::Forest,
        Model::Boosted(_) => ModelKind::Boosted,
        Model::Network(_) => ModelKind::Network,
    };
    let bytes = u32::try_from(4 * file.words().len()).unwrap_or(u32::MAX);
    let refusal = if accepts.most == 0 {
        ModelRefusal::NoMemory
    } else if kind != accepts.kind {
        ModelRefusal::Kind(accepts.kind)
    } else if model.input() != accepts.input {
        ModelRefusal::Input(accepts.input)
    } else if bytes > accepts.most {
        ModelRefusal::Size { found: bytes, most: accepts.most }
    } else if model.layout() > board.layout.unwrap_or(1) {
        let layout = model.layout();
        let message = format_args!(
            "it is WSM{layout}, and the firmware reads WSM1: build the firmware of this version, or import a linear \
             model with --weights int16"
        );
        return Err(refused(file, &message));
    } else {
        return Ok(ModelId { bytes, checksum: model.checksum() });
    };
    Err(refused(file, &refusal))
}

fn refused(file: &ModelFile, refusal: &impl Display) -> Error {
    Error::new(ErrorKind::Data, file.about(), format_args!("the board does not take it: {refusal}"))
}

impl SettableBoard {
    /// Returns the board's model and those that it takes; `None` if its firmware takes none.
    ///
    /// # Errors
    /// The port cannot be read, or the board does not answer.
    pub fn model(&mut self) -> Result<Option<BoardModel>, Error> {
        // As for textures: the first request is answered later, between frames.
        let has_waited = Cell::new(false);
        self.ask(&[Request::Model, Request::Settings], |message| match message {
            Message::Model(model) => Some(Some(*model)),
            Message::Settings(_) => has_waited.replace(true).then_some(None),
            _ => None,
        })
    }

    /// Sends a model to the board, and waits until it has started again with it. The number of bytes that the board has
    /// is passed to `told`, with the number of all.
    ///
    /// # Errors
    /// The file is no model. The board takes no models, refuses this one, does not answer, or does not use it after
    /// that. The port cannot be read.
    pub fn send_model(&mut self, file: &ModelFile, mut told: impl FnMut(u32, u32)) -> Result<(), Error> {
        let state = self.model()?.ok_or_else(|| self.lacks(NO_MODELS))?;
        let model = check_model(file, &state)?;
        let bytes: Vec<u8> = file.words().iter().flat_map(|word| word.to_le_bytes()).collect();
        for _ in 0..TRIES {
            let mut step = self.ask_model(Request::SendModel(model), |step| match *step {
                ModelStep::Wants { model: other, .. } | ModelStep::Kept(other) => other == model,
                ModelStep::Refused(_) => true,
                _ => false,
            })?;
            loop {
                match step {
                    ModelStep::Wants { model: other, at } if other == model => {
                        told(at, model.bytes);
                        let rest = bytes.get(at as usize..).unwrap_or_default();
                        let Some(piece) = ModelPiece::new(at, rest.get(..MODEL_PIECE).unwrap_or(rest)) else {
                            return Err(self.failed("asks for bytes behind the end of the model"));
                        };
                        // An answer to an earlier piece, or to this one a second time, says nothing new.
                        step = self.ask_model(Request::ModelPiece(piece), |step| {
                            !matches!(*step, ModelStep::Wants { model: other, at: next } if other == model && next <= at)
                        })?;
                    }
                    ModelStep::Kept(kept) if kept == model => {
                        told(model.bytes, model.bytes);
                        return self.await_model(|state| state.in_use == Some(model.checksum) && state.sent);
                    }
                    ModelStep::Refused(refusal) => return Err(refused(file, &refusal)),
                    // It has started again, and knows nothing of the model.
                    _ => break,
                }
            }
        }
        Err(self.failed("starts again and again while a model is sent"))
    }

    /// Lets the board forget the models that were sent, and waits until it has started again without them.
    ///
    /// # Errors
    /// The board takes no models, does not forget them, or does not answer. The port cannot be read.
    pub fn forget_model(&mut self) -> Result<(), Error> {
        self.model()?.ok_or_else(|| self.lacks(NO_MODELS))?;
        let is_end = |step: &ModelStep| matches!(step, ModelStep::Forgotten | ModelStep::Refused(ModelRefusal::Memory));
        match self.ask_model(Request::ForgetModel, is_end)? {
            ModelStep::Forgotten => self.await_model(|state| !state.sent),
            _ => Err(self.failed("does not forget the model: its memory failed")),
        }
    }

    /// Sends a request until an answer has a step that `is_answer` takes.
    fn ask_model(&mut self, request: Request, is_answer: impl Fn(&ModelStep) -> bool) -> Result<ModelStep, Error> {
        self.ask(&[request], |message| match message {
            Message::Model(BoardModel { step, .. }) if is_answer(step) => Some(*step),
            _ => None,
        })
    }

    /// Waits until the board has started again, which `is_done` tells.
    fn await_model(&mut self, is_done: impl Fn(&BoardModel) -> bool) -> Result<(), Error> {
        let late = "keeps the model, and has not started again: it does when no touch is under way";
        self.wait_for((LONGEST_START, RESTART), late, |board| Ok(board.model()?.is_some_and(|state| is_done(&state))))
    }
}
