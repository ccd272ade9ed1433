//! Texture models, from the bytes of their files.

use core::ffi::c_char;

use wstac_core::model::Model;
use wstac_core::model::file::{INPUTS, Input, Task};
use wstac_core::model::labels::LONGEST_LABEL;
use wstac_core::texture::texture;

use crate::answers::{WstacFwContact, WstacFwMotion};
use crate::memory::{Memory, borrowed, bytes, fits, give, place, set_up, value};
use crate::status::{WstacFwStatus, status};

/// The number of bytes of a model.
pub const WSTAC_FW_MODEL_SIZE: usize = 136;
/// The number of bytes of a class's name, with the 0 behind it.
pub const WSTAC_FW_LABEL_BYTES: usize = 64;

const _: () = assert!(WSTAC_FW_LABEL_BYTES == LONGEST_LABEL + 1);

/// A texture model, in memory that the program provides.
///
/// wstac_fw_model_init sets it up. It reads the file's bytes where they lie. Nothing has to be freed.
#[repr(C)]
pub struct WstacFwModel {
    /// Private to the library.
    opaque: [u64; 17],
}

const _: () = assert!(size_of::<WstacFwModel>() == WSTAC_FW_MODEL_SIZE);
const _: () = assert!(fits::<WstacFwModel, Model<'static>>(if cfg!(target_pointer_width = "32") { 68 } else { 0 }));

// SAFETY: it consists of numbers, as large and aligned as asserted above.
unsafe impl Memory for WstacFwModel {
    type Value = Model<'static>;
    const MARK: u32 = u32::from_le_bytes(*b"WSmd");
}

/// The task of a model: what it tells apart.
#[repr(i32)]
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum WstacFwTask {
    /// A task that is not stated.
    Other = 0,
    /// Specimens: pattern and depth.
    Specimen = 1,
    /// Patterns.
    Pattern = 2,
    /// Depths in mm.
    Depth = 3,
}

/// The answer of a model for a sample.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct WstacFwTexture {
    /// The task of the model: what it tells apart.
    pub task: WstacFwTask,
    /// The number of the class, from 0.
    pub class_number: u8,
    /// The name of the class in UTF-8, such as Saw3, with a 0 at its end.
    pub label: [c_char; WSTAC_FW_LABEL_BYTES],
    /// The probability that the class is right, in units of 2^-15; -1 for a model without a calibration.
    pub confidence: i32,
    /// 1 if the sample is like those of the training, and 0 if it is not: then the class is probably wrong. -1 if the
    /// model does not tell.
    pub known: i8,
}

/// Checks all of a model file's bytes and sets the model up in `size` bytes of memory: sizeof(WstacFwModel).
///
/// The bytes must be aligned to four. They are not copied: they must stay where and as they are as long as the model is
/// used, usually in flash. A model of another input than frames is refused: wstac_fw_sample has ten features over time.
///
/// # Safety
/// `model` is null or that memory; `bytes` is null or `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_model_init(
    model: *mut WstacFwModel,
    size: usize,
    bytes: *const u8,
    length: usize,
) -> WstacFwStatus {
    let make = || {
        // SAFETY: there are `length` bytes that stay (the caller).
        let bytes = unsafe { self::bytes(bytes, length) }?;
        let model = Model::from_bytes(bytes)?;
        // Other samples than that of wstac_fw_sample would get wrong answers.
        if model.input() == Input::Frames { Ok(model) } else { Err(WstacFwStatus::ModelInput) }
    };
    // SAFETY: the caller guarantees it.
    status(unsafe { set_up(model, size, make) })
}

/// Writes a model's answer for a sample of 700 numbers, as wstac_fw_sample provides it, of a touch that moves so.
///
/// The motion is that of wstac_fw_motion. If the model's file states the speeds of its training, it knows no texture at
/// another speed. Null is for a speed that is not known.
///
/// # Safety
/// `model` is null or a model's memory, `sample` is null or 700 numbers, `motion` is null or a motion, and `to` is null
/// or memory for a texture.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_fw_classify(
    model: *const WstacFwModel,
    sample: *const i16,
    motion: *const WstacFwMotion,
    to: *mut WstacFwTexture,
) -> WstacFwStatus {
    let classify = || {
        // SAFETY: the caller guarantees it.
        let model = unsafe { value(model) }?;
        // SAFETY: the caller guarantees it; an array is aligned as its numbers.
        let sample = unsafe { borrowed(sample.cast::<[i16; INPUTS]>()) }?;
        let to = place(to)?;
        let mut found = texture(sample, model);
        // SAFETY: the caller guarantees it.
        if let Ok(motion) = unsafe { borrowed(motion) }
            && motion.contact == WstacFwContact::Slide as i32
            && model.known_speeds().is_some_and(|speeds| !speeds.has(motion.mm_s))
        {
            found.known = Some(false);
        }
        let mut label = [0; WSTAC_FW_LABEL_BYTES];
        // The 0 at the end stays: a name is shorter.
        for (to, byte) in label.iter_mut().zip(found.label.bytes()).take(LONGEST_LABEL) {
            *to = byte as c_char;
        }
        let confidence = found.confidence.map_or(-1, i32::from);
        let known = found.known.map_or(-1, i8::from);
        let task = match found.task {
            Task::Specimen => WstacFwTask::Specimen,
            Task::Pattern => WstacFwTask::Pattern,
            Task::Depth => WstacFwTask::Depth,
            _ => WstacFwTask::Other,
        };
        // SAFETY: the caller guarantees it.
        unsafe { give(to, WstacFwTexture { task, class_number: found.class, label, confidence, known }) }
    };
    status(classify())
}
