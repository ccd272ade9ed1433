//! Sends models to a flash whose power fails at every byte, and looks for the model that is used after that.

use std::boxed::Box;
use std::vec;
use std::vec::Vec;

use embedded_storage_async::nor_flash::ReadNorFlash as _;
use wstac_core::model::file::{INPUTS, Input};
use wstac_core::model::linear_svm::LinearSvm;

use super::*;
use crate::mock_flash::{Cut, Flash, SECTOR, each_cut};

/// Two places of two sectors each.
const RANGE: Range<u32> = 1024..1024 + 4 * SECTOR as u32;

impl InPlace for Flash {
    const MODELS: Range<u32> = RANGE;

    fn in_place(&mut self, range: Range<u32>) -> Option<&'static [u8]> {
        let mut words = vec![0_u32; (range.end - range.start).div_ceil(4) as usize];
        let mut bytes = vec![0; (range.end - range.start) as usize];
        block_on(self.read(range.start, &mut bytes)).ok()?;
        for (word, bytes) in words.iter_mut().zip(bytes.chunks(4)) {
            bytes.iter().rev().for_each(|byte| *word = *word << 8 | u32::from(*byte));
        }
        let bytes: &'static [u8] = Box::leak(bytes.into_boxed_slice());
        // SAFETY: any word is four bytes, and these stay for ever.
        #[allow(unsafe_code)]
        let aligned: &'static [u8] =
            unsafe { core::slice::from_raw_parts(Box::leak(words.into_boxed_slice()).as_ptr().cast(), bytes.len()) };
        assert_eq!(aligned, bytes);
        Some(aligned)
    }
}

/// Returns the file of a linear model of two classes, of which every number depends on `fill`. `number` is 1 for
/// weights of a byte, and 2 for those of two.
fn file(fill: i8, number: u16, input: u16) -> Vec<u8> {
    let mut halves: Vec<u16> = vec![0; 16];
    (halves[6], halves[7], halves[8], halves[10], halves[15]) = (1, number, 2, 70, input);
    // One row with its bias, and weights.
    halves.extend([1, 0, u16::from(fill.cast_unsigned()), 0, 0, 0]);
    halves.extend(vec![u16::from_le_bytes([fill.cast_unsigned(); 2]); INPUTS / 2 * usize::from(number)]);
    halves[12] = halves.len() as u16;
    let mut bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
    bytes.extend(b"\x03one\x03two\0\0");
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let length = (bytes.len() / 4) as u32;
    bytes[..4].copy_from_slice(b"WSM1");
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    sealed(bytes)
}

/// Returns a file with the right checksum.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = crc32(bytes[8..].iter().copied());
    bytes[4..8].copy_from_slice(&sum.to_le_bytes());
    bytes
}

fn id(file: &[u8]) -> ModelId {
    ModelId { bytes: file.len() as u32, checksum: u32::from_le_bytes(file[4..8].try_into().unwrap()) }
}

fn piece(file: &[u8], at: usize) -> Request {
    let end = file.len().min(at + MODEL_PIECE);
    Request::ModelPiece(ModelPiece::new(at as u32, &file[at..end]).unwrap())
}

/// A board with such a flash, since a start.
struct Fw {
    flash: Flash,
    models: SentModels,
    used: Option<Kind>,
}

impl Fw {
    fn start(flash: Flash) -> Self {
        let (mut flash, mut models) = (flash, SentModels::default());
        let used = models.load(&mut flash, None);
        Self { flash, models, used }
    }

    /// Asks, and returns the answer, which may take several steps.
    fn ask(&mut self, request: Request) -> BoardModel {
        self.models.request(request);
        for _ in 0..5 {
            if let Some(Message::Model(model)) = self.models.step(&mut self.flash) {
                return model;
            }
        }
        panic!("no answer to {request:?}");
    }

    /// Sends a model as a host does, and returns the last step.
    fn send(&mut self, file: &[u8]) -> ModelStep {
        let mut step = self.ask(Request::SendModel(id(file))).step;
        while let ModelStep::Wants { model, at } = step {
            assert_eq!(model, id(file));
            step = self.ask(piece(file, at as usize)).step;
        }
        step
    }

    fn checksum(&self) -> Option<u32> {
        self.used.map(|kind| kind.checksum())
    }
}

fn small(fill: i8) -> Vec<u8> {
    file(fill, 1, 0)
}

#[test]
fn a_model_is_used_after_the_next_start_and_forgotten_models_are_not() {
    let mut fw = Fw::start(Flash::new(RANGE));
    assert_eq!(fw.checksum(), None);
    let state = fw.ask(Request::Model);
    assert_eq!((state.in_use, state.sent, state.step), (None, false, ModelStep::Rest));
    assert_eq!(state.accepts, AcceptedModels { kind: setup::KIND, input: Input::Frames, most: 2048 - 64 });
    // Each goes to the place that is not in use, many times.
    for fill in 1..20 {
        let file = small(fill);
        let before = fw.checksum();
        assert_eq!(fw.send(&file), ModelStep::Kept(id(&file)));
        // Until the new start, the model of before is in use, and nothing else is taken.
        assert!(fw.models.has_other());
        assert_eq!(fw.ask(Request::SendModel(id(&small(99)))).in_use, before);
        fw = Fw::start(fw.flash.again());
        assert_eq!(fw.checksum(), Some(id(&file).checksum));
        let state = fw.ask(Request::Model);
        assert_eq!((state.in_use, state.sent), (fw.checksum(), true));
        // It answers as the file does where it lies.
        let words: Vec<u32> = file.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        let expected = LinearSvm::from_words(&words).unwrap();
        for number in [-700, 0, 700] {
            let sample = [number; INPUTS];
            assert_eq!(fw.used.unwrap().classify(&sample), expected.classify(&sample));
        }
    }
    // The one in use is kept already.
    assert_eq!(fw.ask(Request::SendModel(id(&small(19)))).step, ModelStep::Kept(id(&small(19))));
    assert!(!fw.models.has_other());
    assert_eq!(fw.ask(Request::ForgetModel).step, ModelStep::Forgotten);
    assert!(fw.models.has_other());
    let mut fw = Fw::start(fw.flash.again());
    assert_eq!(fw.checksum(), None);
    // Nothing is left to be forgotten.
    assert_eq!((fw.ask(Request::ForgetModel).step, fw.models.has_other()), (ModelStep::Forgotten, false));
    assert_eq!(fw.send(&small(5)), ModelStep::Kept(id(&small(5))));
    assert_eq!(Fw::start(fw.flash.again()).checksum(), Some(id(&small(5)).checksum));
}

#[test]
fn the_compiled_in_model_is_named_until_one_is_sent() {
    let (mut flash, mut models) = (Flash::new(RANGE), SentModels::default());
    assert!(models.load(&mut flash, Some(7)).is_none());
    let mut fw = Fw { flash, models, used: None };
    let state = fw.ask(Request::Model);
    assert_eq!((state.in_use, state.sent), (Some(7), false));
}

#[test]
fn pieces_that_are_lost_repeated_or_of_another_file_do_no_harm() {
    let mut fw = Fw::start(Flash::new(RANGE));
    let (file, other) = (small(3), small(4));
    // A piece before anything is known of the file.
    assert_eq!(fw.ask(piece(&file, 0)).step, ModelStep::Rest);
    let wants = |at: usize| ModelStep::Wants { model: id(&file), at: at as u32 };
    assert_eq!(fw.ask(Request::SendModel(id(&file))).step, wants(0));
    assert_eq!(fw.ask(piece(&file, MODEL_PIECE)).step, wants(0));
    assert_eq!(fw.ask(piece(&file, 0)).step, wants(MODEL_PIECE));
    assert_eq!(fw.ask(piece(&file, 0)).step, wants(MODEL_PIECE));
    // A host that was gone goes on, and a question in between loses no piece.
    assert_eq!(fw.ask(Request::SendModel(id(&file))).step, wants(MODEL_PIECE));
    fw.models.request(piece(&file, MODEL_PIECE));
    assert_eq!(fw.ask(Request::Model).step, wants(2 * MODEL_PIECE));
    // A short piece in the middle, and one beyond the end.
    let short = ModelPiece::new(2 * MODEL_PIECE as u32, &file[..7]).unwrap();
    assert_eq!(fw.ask(Request::ModelPiece(short)).step, wants(2 * MODEL_PIECE));
    // Another file begins anew.
    let begun = ModelStep::Wants { model: id(&other), at: 0 };
    assert_eq!(fw.ask(Request::SendModel(id(&other))).step, begun);
    assert_eq!(fw.send(&other), ModelStep::Kept(id(&other)));
    // The last piece again, whose answer was lost.
    let last = other.len() / MODEL_PIECE * MODEL_PIECE;
    assert_eq!(fw.ask(piece(&other, last)).step, ModelStep::Kept(id(&other)));
    assert_eq!(Fw::start(fw.flash.again()).checksum(), Some(id(&other).checksum));
}

#[test]
fn a_model_that_is_damaged_foreign_or_too_large_is_refused_and_the_old_one_stays() {
    let mut fw = Fw::start(Flash::new(RANGE));
    let old = small(1);
    fw.send(&old);
    let flash = fw.flash.again();
    let mut damaged = small(2);
    damaged[700] ^= 4;
    let mut forest = small(2);
    forest[12] = 3;
    let mut mistaken = small(2);
    mistaken[16] = 200;
    let size = |found| ModelRefusal::Size { found, most: 2048 - 64 };
    for (file, refusal) in [
        (damaged, ModelRefusal::Damaged),
        (sealed(mistaken), ModelRefusal::Damaged),
        (sealed(forest), ModelRefusal::Kind(setup::KIND)),
        (file(2, 1, 1), ModelRefusal::Input(Input::Frames)),
        (file(2, 1, 3), ModelRefusal::Input(Input::Frames)),
        (small(2)[..300].to_vec(), ModelRefusal::Damaged),
        (vec![0xFF; 400], ModelRefusal::Damaged),
        ([&small(2)[..], &[0; 4]].concat(), ModelRefusal::Damaged),
    ] {
        let mut fw = Fw::start(flash.again());
        assert_eq!(fw.send(&file), ModelStep::Refused(refusal));
        assert!(!fw.models.has_other());
        // A late piece changes nothing.
        assert_eq!(fw.ask(piece(&file, 0)).step, ModelStep::Refused(refusal));
        let mut fw = Fw::start(fw.flash.again());
        assert_eq!(fw.checksum(), Some(id(&old).checksum));
        assert_eq!(fw.send(&small(7)), ModelStep::Kept(id(&small(7))));
    }
    for found in [0, 2048 - 63, u32::MAX] {
        let mut fw = Fw::start(flash.again());
        let id = ModelId { bytes: found, checksum: 1 };
        assert_eq!(fw.ask(Request::SendModel(id)).step, ModelStep::Refused(size(found)));
        assert_eq!(Fw::start(fw.flash.again()).checksum(), fw.checksum());
    }
    // A flash that fails.
    let mut fw = Fw::start(flash.again());
    fw.flash.left = SECTOR + 40;
    assert_eq!(fw.send(&small(2)), ModelStep::Refused(ModelRefusal::Memory));
    assert_eq!(Fw::start(fw.flash.again()).checksum(), Some(id(&old).checksum));
}

/// Cuts the power at every byte of a change, and tests that the model of before or that of after it is used, and that
/// the change can be made then.
fn cut_everywhere(flash: &Flash, old: Option<u32>, new: Option<u32>, change: impl Fn(&mut Fw)) -> (u32, u32) {
    let power = 1_000_000;
    let mut whole = Fw::start(flash.until(power, Cut::Bytes));
    change(&mut whole);
    let needed = power - whole.flash.left;
    assert_eq!((whole.checksum(), Fw::start(whole.flash.again()).checksum()), (old, new));
    let (mut olds, mut news) = (0, 0);
    for (left, cut) in each_cut(needed) {
        let mut failed = Fw::start(flash.until(left, cut));
        change(&mut failed);
        let mut next = Fw::start(failed.flash.again());
        let found = next.checksum();
        assert!(found == old || found == new, "{cut:?} after {left} of {needed} bytes: {found:?}");
        (olds, news) = (olds + u32::from(found == old), news + u32::from(found == new));
        if left % 7 == 0 && found == old {
            change(&mut next);
            assert_eq!(Fw::start(next.flash.again()).checksum(), new, "{cut:?} after {left} bytes");
        }
    }
    (olds, news)
}

#[test]
fn power_may_fail_at_every_byte_of_a_model() {
    let mut flash = Flash::new(RANGE);
    let mut old = None;
    // Of one sector and of two, into either place.
    for file in [small(1), small(-2), file(3, 2, 0), small(4)] {
        let new = Some(id(&file).checksum);
        let (olds, _) = cut_everywhere(&flash, old, new, |fw| {
            fw.send(&file);
        });
        assert!(olds > 3000, "{olds}");
        let mut fw = Fw::start(flash.again());
        fw.send(&file);
        (flash, old) = (fw.flash.again(), new);
    }
    let (olds, news) = cut_everywhere(&flash, old, None, |fw| {
        fw.ask(Request::ForgetModel);
    });
    assert!(olds > 50 && news > 50, "{olds} {news}");
}

#[test]
fn an_older_model_does_not_come_back_when_the_newer_one_is_forgotten() {
    let mut fw = Fw::start(Flash::new(RANGE));
    for fill in [1, 2] {
        fw.send(&small(fill));
        fw = Fw::start(fw.flash.again());
    }
    fw.ask(Request::ForgetModel);
    assert_eq!(Fw::start(fw.flash.again()).checksum(), None);
}

#[test]
fn a_model_that_decays_gives_way_to_the_one_before() {
    let mut fw = Fw::start(Flash::new(RANGE));
    for fill in [1, 2] {
        fw.send(&small(fill));
        fw = Fw::start(fw.flash.again());
    }
    // The second one is at the second place.
    fw.flash.bytes[RANGE.start as usize + 2 * SECTOR + 300] ^= 1;
    let mut fw = Fw::start(fw.flash.again());
    assert_eq!(fw.checksum(), Some(id(&small(1)).checksum));
    assert_eq!(fw.send(&small(3)), ModelStep::Kept(id(&small(3))));
    assert_eq!(Fw::start(fw.flash.again()).checksum(), Some(id(&small(3)).checksum));
}
