//! Texture models that a host sends, in flash: a reset at any time leaves the old model or the new one.
//!
//! There are two places for a model, each of some sectors. One is in use, and another model is written to the other
//! one. A place begins with two words of 32 bytes. The first has the model's number, size and checksum. It is written
//! last, when the whole model was read again and checked, so a model that was not sent to its end is never used. The
//! second one is written to forget the model. The whole model with the highest number is used, where it lies in the
//! flash.
//!
//! The model in use is never written to, because events that are kept have the names of its classes. So another model
//! takes a new start, which waits until no event is under way.

use core::ops::Range;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::NorFlash;
use wstac_core::crc::crc32;
use wstac_core::model::file::ModelError;
use wstac_core::wire::{
    AcceptedModels, BoardModel, MODEL_PIECE, Message, ModelId, ModelPiece, ModelRefusal, ModelStep, Request,
};

use crate::setup::{self, Kind};
use crate::textures::ModelSample;

/// The bytes of a word, which is written once.
const WORD: usize = 32;
/// The bytes of a place in front of the model.
const HEAD: u32 = 2 * WORD as u32;
/// The first bytes of a place that holds a model.
const MAGIC: u32 = u32::from_le_bytes(*b"WSP1");
const _: () = assert!(MODEL_PIECE.is_multiple_of(WORD));

/// A flash whose bytes the core reads where they lie.
pub trait InPlace: NorFlash {
    /// The two places for models, one behind the other, each of whole sectors.
    const MODELS: Range<u32>;

    /// Returns bytes where they lie, from a start that is aligned to four; `None` if some cannot be read. They are not
    /// written to as long as they are used.
    fn in_place(&mut self, range: Range<u32>) -> Option<&'static [u8]>;
}

/// Memory that is aligned as flash needs it.
#[repr(align(32))]
struct AlignedPiece([u8; MODEL_PIECE]);

/// The description of the model that a place holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Head {
    /// The number of the model, one more than that of the model before.
    number: u32,
    model: ModelId,
}

impl Head {
    fn words(self) -> [u32; 4] {
        [MAGIC, self.number, self.model.bytes, self.model.checksum]
    }

    /// Returns the first word of the place.
    fn to_bytes(self) -> [u8; WORD] {
        let mut bytes = [0; WORD];
        let [first, _] = bytes.as_chunks_mut::<16>().0 else { return bytes };
        for (place, word) in first.as_chunks_mut::<4>().0.iter_mut().zip(self.words()) {
            *place = word.to_le_bytes();
        }
        let sum = crc32(first.iter().copied()).to_le_bytes();
        bytes[16..20].copy_from_slice(&sum);
        bytes
    }

    fn read(bytes: &[u8; WORD]) -> Option<Self> {
        let word = |at: usize| bytes.as_chunks::<4>().0.get(at).map(|word| u32::from_le_bytes(*word));
        let model = ModelId { bytes: word(2)?, checksum: word(3)? };
        let head = Self { number: word(1)?, model };
        (head.to_bytes() == *bytes).then_some(head)
    }
}

/// A model that is being sent.
#[derive(Clone, Copy, Debug)]
struct Transfer {
    model: ModelId,
    /// The part of the place that is still to be erased, from one byte of the flash to another.
    unerased: (u32, u32),
    /// The number of bytes that were written.
    written: u32,
}

/// Something that is to be done between frames.
#[derive(Clone, Copy, Debug)]
enum ModelTask {
    Tell,
    Write(ModelPiece),
    Forget,
}

/// The models that a host has sent, and the one that it is sending.
#[derive(Clone, Debug, Default)]
pub struct SentModels {
    /// The checksum of the model in use.
    in_use: Option<u32>,
    /// The place of the model in use, 0 or 1, if a host has sent it, and the model.
    used: Option<(u32, ModelId)>,
    /// The highest number of a model.
    number: u32,
    transfer: Option<Transfer>,
    task: Option<ModelTask>,
    last: ModelStep,
    /// Whether another model is to be used after a new start.
    has_other: bool,
}

fn place<F: InPlace>(number: u32) -> Range<u32> {
    let Range { start, end } = F::MODELS;
    let length = (end - start) / 2;
    let start = start + number * length;
    start..start + length
}

fn accepts<F: InPlace>() -> AcceptedModels {
    let place = place::<F>(0);
    accepted(place.end - place.start - HEAD)
}

/// Returns the models that a board takes whose places have room for so many bytes.
pub fn accepted(most: u32) -> AcceptedModels {
    AcceptedModels { kind: setup::KIND, input: <setup::ModelSample as ModelSample>::INPUT, most }
}

/// Returns what a place holds; `None` if that is no whole model, or one that was forgotten.
fn head<F: InPlace>(flash: &mut F, number: u32) -> Option<Head> {
    let mut words = [[0; WORD]; 2];
    block_on(flash.read(place::<F>(number).start, words.as_flattened_mut())).ok()?;
    let [first, forgotten] = words;
    Head::read(&first).filter(|_| forgotten == [0xFF; WORD])
}

/// Checks the whole model at a place, and returns it.
// It is not inlined, so that the models that are checked do not lie on the stack of what calls it.
#[inline(never)]
fn checked<F: InPlace>(flash: &mut F, number: u32, model: ModelId) -> Result<Kind, ModelRefusal> {
    let start = place::<F>(number).start + HEAD;
    let most = accepts::<F>().most;
    if model.bytes == 0 || model.bytes > most {
        return Err(ModelRefusal::Size { found: model.bytes, most });
    }
    let bytes = flash.in_place(start..start + model.bytes).ok_or(ModelRefusal::Damaged)?;
    let kind = Kind::from_bytes(bytes).map_err(|error| match error {
        ModelError::Kind { .. } => ModelRefusal::Kind(setup::KIND),
        _ => ModelRefusal::Damaged,
    })?;
    let input = <setup::ModelSample as ModelSample>::INPUT;
    if kind.input() != input {
        return Err(ModelRefusal::Input(input));
    }
    if kind.checksum() == model.checksum { Ok(kind) } else { Err(ModelRefusal::Damaged) }
}

/// Writes whole words, and returns whether they can be read again.
fn write<F: InPlace>(flash: &mut F, at: u32, bytes: &[u8]) -> bool {
    let mut words = AlignedPiece([0xFF; MODEL_PIECE]);
    let length = bytes.len().next_multiple_of(WORD);
    let Some(words) = words.0.get_mut(..length) else { return false };
    let Some(place) = words.get_mut(..bytes.len()) else { return false };
    place.copy_from_slice(bytes);
    if block_on(flash.write(at, words)).is_err() {
        return false;
    }
    let mut found = [0; WORD];
    (at..)
        .step_by(WORD)
        .zip(words.as_chunks::<WORD>().0)
        .all(|(at, word)| block_on(flash.read(at, &mut found)).is_ok() && found == *word)
}

impl SentModels {
    /// Returns the newest whole model that a host has sent; `None` if there is none. Then the one that is compiled in
    /// is used, which has this checksum.
    pub fn load<F: InPlace>(&mut self, flash: &mut F, compiled_in: Option<u32>) -> Option<Kind> {
        let mut heads = [0, 1].map(|place| (place, head(flash, place)));
        heads.sort_unstable_by_key(|(_, head)| core::cmp::Reverse(head.map(|head| head.number)));
        self.number = heads.iter().find_map(|(_, head)| Some((*head)?.number)).unwrap_or(0);
        self.in_use = compiled_in;
        for (place, head) in heads {
            if let Some(Head { model, .. }) = head
                && let Ok(kind) = checked(flash, place, model)
            {
                (self.in_use, self.used) = (Some(model.checksum), Some((place, model)));
                return Some(kind);
            }
        }
        None
    }

    /// Takes a request about models.
    pub fn request(&mut self, request: Request) {
        let task = match request {
            // Nothing else is done before the new start.
            _ if self.has_other => ModelTask::Tell,
            Request::SendModel(model) => {
                self.begin(model);
                ModelTask::Tell
            }
            Request::ModelPiece(piece) => ModelTask::Write(piece),
            Request::ForgetModel => ModelTask::Forget,
            Request::Model => self.task.unwrap_or(ModelTask::Tell),
            _ => return,
        };
        self.task = Some(task);
    }

    /// Begins to take a model, or goes on.
    fn begin(&mut self, model: ModelId) {
        if self.transfer.is_some_and(|transfer| transfer.model == model) {
            return;
        }
        self.transfer = None;
        if self.used.is_some_and(|(_, used)| used == model) {
            self.last = ModelStep::Kept(model);
            return;
        }
        // The range is known when it is erased, and the size is checked then.
        self.transfer = Some(Transfer { model, unerased: (0, u32::MAX), written: 0 });
    }

    /// Does what is to be done between frames, and returns the message about it. An erasure of a sector takes a second
    /// or two.
    // It is not inlined, so that a piece does not lie on the stack of a function that runs for ever.
    #[inline(never)]
    pub fn step<F: InPlace>(&mut self, flash: &mut F) -> Option<Message<'static>> {
        if let Some(transfer) = self.transfer
            && transfer.unerased.0 < transfer.unerased.1
        {
            if let Err(refusal) = self.erase(flash, transfer) {
                self.refuse(refusal);
            }
            return None;
        }
        match self.task.take()? {
            ModelTask::Tell => {}
            ModelTask::Write(piece) => {
                if let Err(refusal) = self.write(flash, &piece) {
                    self.refuse(refusal);
                }
            }
            ModelTask::Forget => self.forget(flash),
        }
        Some(Message::Model(BoardModel::new(self.in_use, self.used.is_some(), accepts::<F>(), self.last)))
    }

    fn refuse(&mut self, refusal: ModelRefusal) {
        (self.transfer, self.last) = (None, ModelStep::Refused(refusal));
    }

    /// Returns the place that is not in use.
    fn free(&self) -> u32 {
        self.used.map_or(0, |(used, _)| 1 - used)
    }

    /// Erases the next sector that a model needs.
    fn erase<F: InPlace>(&mut self, flash: &mut F, transfer: Transfer) -> Result<(), ModelRefusal> {
        let (Transfer { model, unerased, .. }, most) = (transfer, accepts::<F>().most);
        if model.bytes == 0 || model.bytes > most {
            return Err(ModelRefusal::Size { found: model.bytes, most });
        }
        let begin = place::<F>(self.free()).start;
        let needed = (HEAD + model.bytes).next_multiple_of(F::ERASE_SIZE as u32);
        // The first sector is first: without its head, the place holds no model.
        let start = unerased.0.max(begin);
        let end = start + F::ERASE_SIZE as u32;
        block_on(flash.erase(start, end)).map_err(|_| ModelRefusal::Memory)?;
        self.transfer = Some(Transfer { unerased: (end, begin + needed), ..transfer });
        self.last = ModelStep::Wants { model, at: 0 };
        Ok(())
    }

    /// Writes a piece if it is the next one. After the last one, the model is checked, and is whole with its head.
    fn write<F: InPlace>(&mut self, flash: &mut F, piece: &ModelPiece) -> Result<(), ModelRefusal> {
        let free = self.free();
        let Some(transfer) = &mut self.transfer else { return Ok(()) };
        let (model, bytes) = (transfer.model, piece.bytes());
        let end = transfer.written + bytes.len() as u32;
        let is_last = end == model.bytes;
        if piece.at() != transfer.written || end > model.bytes || bytes.len() != MODEL_PIECE && !is_last {
            return Ok(());
        }
        let begin = place::<F>(free).start;
        if !write(flash, begin + HEAD + transfer.written, bytes) {
            return Err(ModelRefusal::Memory);
        }
        transfer.written = end;
        self.last = ModelStep::Wants { model, at: end };
        if is_last {
            checked(flash, free, model)?;
            let whole = Head { number: self.number + 1, model };
            if !write(flash, begin, &whole.to_bytes()) || head(flash, free) != Some(whole) {
                return Err(ModelRefusal::Memory);
            }
            (self.transfer, self.last, self.has_other) = (None, ModelStep::Kept(model), true);
        }
        Ok(())
    }

    /// Forgets all models that were sent: first the one that is not in use, which would be used otherwise.
    fn forget<F: InPlace>(&mut self, flash: &mut F) {
        self.transfer = None;
        for number in [self.free(), 1 - self.free()] {
            if head(flash, number).is_some() {
                write(flash, place::<F>(number).start + WORD as u32, &[0; WORD]);
            }
            if head(flash, number).is_some() {
                self.refuse(ModelRefusal::Memory);
                return;
            }
        }
        (self.last, self.has_other) = (ModelStep::Forgotten, self.used.is_some());
    }

    /// Returns whether another model is to be used, which takes a new start.
    pub fn has_other(&self) -> bool {
        self.has_other
    }
}

#[cfg(test)]
mod tests;
