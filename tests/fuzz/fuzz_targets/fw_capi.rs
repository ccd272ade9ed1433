//! Calls the C library of boards in any order, with any numbers, bytes and frames that a C program may pass without
//! breaking a rule of the header. Every call returns a status with a text, and answers are in their ranges.
#![no_main]

use std::ffi::CStr;
use std::{mem, ptr};

use arbitrary::{Arbitrary, Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use wstac_core::params::FEATURES;
use wstac_core::wire::{LONGEST, Request, encode};
use wstac_fw::answers::*;
use wstac_fw::format::*;
use wstac_fw::link::*;
use wstac_fw::model::*;
use wstac_fw::pipeline::*;
use wstac_fw::settings::*;
use wstac_fw::status::{WstacFwStatus, wstac_fw_status_text};

fuzz_target!(|data: &[u8]| {
    // The input has ended: nothing is left to try.
    let _ = program(&mut Unstructured::new(data));
});

/// Most bytes of a model, whose bytes are aligned to four.
const MOST_MODEL: usize = 4096;

/// Returns a byte that is mostly a choice.
fn choice(input: &mut Unstructured<'_>) -> Result<u8> {
    if input.ratio(1, 16)? { input.arbitrary() } else { Ok(u8::from(input.arbitrary::<bool>()?)) }
}

/// Returns a number that is mostly at most this.
fn number(input: &mut Unstructured<'_>, most: u32) -> Result<u32> {
    if input.ratio(1, 16)? { input.arbitrary() } else { input.int_in_range(0..=most) }
}

/// Returns the default, or any value.
fn any<'a, T: Arbitrary<'a>>(input: &mut Unstructured<'a>, usual: T) -> Result<T> {
    if input.ratio(1, 4)? { input.arbitrary() } else { Ok(usual) }
}

/// Checks a status.
fn check(status: WstacFwStatus) {
    // SAFETY: texts stay.
    let text = unsafe { CStr::from_ptr(wstac_fw_status_text(status as i32)) };
    assert!(text.to_bytes().len() >= 4 && text != c"no status of this library");
}

fn program(input: &mut Unstructured<'_>) -> Result<()> {
    let format: *const WstacFwFormat = *input.choose(&[
        &raw const WSTAC_FW_GREY,
        &raw const WSTAC_FW_Y10,
        &raw const WSTAC_FW_Y16,
        &raw const WSTAC_FW_RGB24,
        &raw const WSTAC_FW_XRGB32,
        &raw const WSTAC_FW_RGB565,
        &raw const WSTAC_FW_GRBG8,
        &raw const WSTAC_FW_RGGB12,
        &raw const WSTAC_FW_YUYV,
        &raw const WSTAC_FW_UYVY_LINEAR,
        &raw const WSTAC_FW_NV12,
        &raw const WSTAC_FW_YU12,
        ptr::null(),
    ])?;
    let mut corners = Vec::new();
    for _ in 0..25 {
        corners.push(WstacFwCorner { left: number(input, 30)? as u16, top: number(input, 30)? as u16 });
    }
    let options = WstacFwOptions {
        format,
        width: number(input, 60)?,
        height: number(input, 60)?,
        bytes_per_row: if input.ratio(1, 4)? { number(input, 300)? } else { 0 },
        fps_numerator: if input.ratio(1, 4)? { number(input, 120)? } else { 0 },
        fps_denominator: if input.ratio(1, 4)? { number(input, 2)? } else { 0 },
        stride: number(input, 5)?,
        bt709: choice(input)?,
        full_range: choice(input)?,
        taxel: [number(input, 10)? as u16, number(input, 10)? as u16],
        corners: if input.ratio(1, 4)? { corners.as_ptr() } else { ptr::null() },
        pitch_mm: any(input, 0.0)?,
        readout_known: choice(input)?,
        readout_ms: any(input, 0.0)?,
    };
    // SAFETY: both are numbers.
    let (mut pipeline, mut model) = unsafe { (mem::zeroed::<WstacFwPipeline>(), mem::zeroed::<WstacFwModel>()) };
    let mut model_bytes = vec![0_u32; MOST_MODEL / 4];
    let options = if input.ratio(1, 64)? { ptr::null() } else { &raw const options };
    // Calls before it are refused.
    if !input.ratio(1, 64)? {
        let size = if input.ratio(1, 64)? { number(input, 3000)? as usize } else { size_of::<WstacFwPipeline>() };
        // A size that is too large would break a rule.
        let size = size.min(size_of::<WstacFwPipeline>());
        // SAFETY: the memory and the corners are there.
        check(unsafe { wstac_fw_init(&raw mut pipeline, size, options) });
    }
    settings(&mut pipeline, input)?;
    // SAFETY: it is numbers.
    let mut link = unsafe { mem::zeroed::<WstacFwLink>() };
    // SAFETY: the memory is there.
    check(unsafe { wstac_fw_link_init(&raw mut link, size_of::<WstacFwLink>()) });
    for _ in 0..500 {
        call(&mut pipeline, input)?;
        answers(&mut pipeline, &model);
        messages(&pipeline, &mut link, input)?;
        if input.ratio(1, 32)? {
            let length = usize::from(input.arbitrary::<u16>()?) % MOST_MODEL;
            let bytes = input.bytes(length.min(input.len()))?;
            // The model is set up again, because its bytes change.
            // SAFETY: it is numbers.
            model = unsafe { mem::zeroed() };
            for (word, bytes) in model_bytes.iter_mut().zip(bytes.chunks_exact(4)) {
                *word = u32::from_ne_bytes(bytes.try_into().unwrap_or_default());
            }
            // SAFETY: the bytes stay as they are until the model is set up again.
            let status = unsafe {
                wstac_fw_model_init(
                    &raw mut model,
                    size_of::<WstacFwModel>(),
                    model_bytes.as_ptr().cast(),
                    bytes.len() & !3,
                )
            };
            check(status);
        }
    }
    Ok(())
}

fn settings(pipeline: &mut WstacFwPipeline, input: &mut Unstructured<'_>) -> Result<()> {
    // SAFETY: both are numbers, which the library writes.
    let (mut trigger, mut law) = unsafe { (mem::zeroed::<WstacFwTrigger>(), mem::zeroed::<WstacFwSpeedLaw>()) };
    // SAFETY: all memory is there.
    unsafe {
        check(wstac_fw_trigger_defaults(&raw mut trigger));
        check(wstac_fw_speed_law_defaults(&raw mut law));
    }
    trigger.window = any(input, trigger.window)?;
    trigger.multiplier = any(input, trigger.multiplier)?;
    trigger.backtrack = any(input, trigger.backtrack)?;
    trigger.margin = any(input, trigger.margin)?;
    trigger.follow = if input.ratio(1, 4)? { 1 << input.int_in_range(0..=16)? } else { any(input, 0)? };
    (trigger.literal, trigger.one_event_per_touch) = (choice(input)?, choice(input)?);
    law.above_baseline = choice(input)?;
    law.threshold = any(input, law.threshold)?;
    law.intercept = any(input, law.intercept)?;
    law.slope = any(input, law.slope)?;
    law.slowest_mm_s = any(input, law.slowest_mm_s)?;
    law.fastest_mm_s = any(input, law.fastest_mm_s)?;
    let choices = [trigger.literal, trigger.one_event_per_touch];
    // SAFETY: all memory is there.
    unsafe {
        let status = wstac_fw_set_trigger(pipeline, &raw const trigger);
        check(status);
        assert!(status != WstacFwStatus::Ok || choices.iter().all(|choice| *choice <= 1));
        let status = wstac_fw_set_speed_law(pipeline, &raw const law);
        check(status);
        assert!(status != WstacFwStatus::Ok || law.above_baseline <= 1);
        check(wstac_fw_set_floor(pipeline, any(input, 0.5)?));
    }
    Ok(())
}

fn call(pipeline: &mut WstacFwPipeline, input: &mut Unstructured<'_>) -> Result<()> {
    let kind = input.int_in_range(0..=15)?;
    // Bytes in a buffer of just their length.
    let length = if input.ratio(1, 16)? { usize::from(input.arbitrary::<u16>()?) } else { 12_000 };
    let bytes = vec![input.arbitrary::<u8>()?; length].into_boxed_slice();
    // SAFETY: all memory is there, and as long as is said.
    unsafe {
        match kind {
            0 => check(wstac_fw_push_lost(pipeline, any(input, 1)?)),
            1 => check(wstac_fw_abandon_frame(pipeline)),
            2 if input.ratio(1, 16)? => check(wstac_fw_finish(pipeline)),
            3 => check(wstac_fw_push_stripe(pipeline, bytes.as_ptr(), number(input, 900)?.min(length as u32) as usize)),
            4 => check(wstac_fw_push_frame(pipeline, ptr::null(), length)),
            5 => check(wstac_fw_push_frame(pipeline, bytes.as_ptr(), usize::MAX)),
            _ => {
                // Many frames of one gray.
                for _ in 0..input.int_in_range(0..=40)? {
                    check(wstac_fw_push_frame(pipeline, bytes.as_ptr(), length));
                }
            }
        }
    }
    Ok(())
}

/// Receives bytes of a host, most of them whole requests, and sends messages.
fn messages(pipeline: &WstacFwPipeline, link: &mut WstacFwLink, input: &mut Unstructured<'_>) -> Result<()> {
    let mut room = [0; LONGEST];
    let requests =
        [Request::Hello, Request::Samples(true), Request::KeepEvents(true), Request::Acknowledge { event: 0 }];
    let mut received = encode(input.choose(&requests)?, input.arbitrary()?, &mut room).to_vec();
    if input.ratio(1, 4)? {
        received = input.bytes(input.len().min(20))?.to_vec();
    }
    let (mut bytes, mut length) = ([0; WSTAC_FW_LINK_BYTES], 0);
    // SAFETY: all of these are numbers, which the library writes; all memory is there.
    unsafe {
        let mut wanted: WstacFwWanted = mem::zeroed();
        let status = wstac_fw_link_receive(link, received.as_ptr(), received.len(), &raw mut wanted);
        assert!(status == WstacFwStatus::Ok);
        let (mut motion, mut texture): (WstacFwMotion, WstacFwTexture) = (mem::zeroed(), mem::zeroed());
        texture.label.fill(input.arbitrary::<u8>()? as _);
        texture.label[usize::from(input.arbitrary::<u8>()?) % WSTAC_FW_LABEL_BYTES] = 0;
        let answers = WstacFwAnswers {
            motion: &raw const motion,
            speed: ptr::null(),
            direction: ptr::null(),
            texture: if input.arbitrary()? { &raw const texture } else { ptr::null() },
        };
        let part = number(input, 8)?;
        let status = wstac_fw_motion(pipeline, &raw mut motion);
        for status in [
            status,
            wstac_fw_link_event(link, pipeline, &raw const answers, bytes.as_mut_ptr(), &raw mut length),
            wstac_fw_link_sample(link, pipeline, part, bytes.as_mut_ptr(), &raw mut length),
            wstac_fw_link_features(link, pipeline, bytes.as_mut_ptr(), &raw mut length),
            wstac_fw_link_status(link, pipeline, bytes.as_mut_ptr(), &raw mut length),
            wstac_fw_link_due(link, input.arbitrary()?, bytes.as_mut_ptr(), &raw mut length),
        ] {
            check(status);
            assert!(length <= WSTAC_FW_LINK_BYTES);
        }
    }
    Ok(())
}

/// Asks for everything.
fn answers(pipeline: &mut WstacFwPipeline, model: &WstacFwModel) {
    let mut sample = [0_i16; WSTAC_FW_SAMPLE_NUMBERS];
    let mut features = [0_i16; FEATURES];
    // SAFETY: all of these are numbers, which the library writes; all memory is there.
    unsafe {
        check(wstac_fw_features(pipeline, features.as_mut_ptr(), ptr::null_mut()));
        check(wstac_fw_end(pipeline, &raw mut *mem::MaybeUninit::zeroed().assume_init_mut()));
        check(wstac_fw_take_interrupted(pipeline, &raw mut *mem::MaybeUninit::zeroed().assume_init_mut()));
        check(wstac_fw_take_contact_end(pipeline, &raw mut *mem::MaybeUninit::zeroed().assume_init_mut()));
        let mut event: WstacFwEvent = mem::zeroed();
        if wstac_fw_event(pipeline, &raw mut event) != WstacFwStatus::Ok {
            return;
        }
        assert!(event.frames_filled <= 70 && event.touch_frame >= -1 && event.end_frame >= -1);
        let (mut motion, mut speed): (WstacFwMotion, WstacFwSpeed) = (mem::zeroed(), mem::zeroed());
        let mut direction: WstacFwDirection = mem::zeroed();
        for status in [wstac_fw_motion(pipeline, &raw mut motion), wstac_fw_motion_by_edges(pipeline, &raw mut motion)]
        {
            assert!(status == WstacFwStatus::Ok && motion.mm_s.is_finite() && motion.mm_s >= 0.0);
            assert!(motion.degrees == -1.0 || (0.0..360.0).contains(&motion.degrees));
        }
        assert!(wstac_fw_speed(pipeline, &raw mut speed) == WstacFwStatus::Ok);
        assert!(speed.mm_s.is_finite() && speed.mm_s >= 0.0 && (-1..70).contains(&speed.duration_frames));
        assert!(wstac_fw_direction(pipeline, &raw mut direction) == WstacFwStatus::Ok);
        assert!([-1, 0, 90, 180, 270].contains(&direction.degrees) && direction.confidence <= 32_768);
        assert!(wstac_fw_sample(pipeline, sample.as_mut_ptr()) == WstacFwStatus::Ok);
        let mut texture: WstacFwTexture = mem::zeroed();
        let status = wstac_fw_classify(model, sample.as_ptr(), &raw const motion, &raw mut texture);
        check(status);
        if status == WstacFwStatus::Ok {
            let label = CStr::from_ptr(texture.label.as_ptr());
            assert!(label.to_bytes().len() < WSTAC_FW_LABEL_BYTES && label.to_str().is_ok());
        }
    }
}
