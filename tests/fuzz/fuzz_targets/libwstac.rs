//! Calls the C library in any order, with any numbers, strings and frames that a C program may pass without breaking a
//! rule of the header. Every call returns a status; strings end; records have the kinds that the header names.
#![no_main]

use std::ffi::{CStr, CString, c_char};
use std::{mem, ptr};

use arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use wstac_c::options::{WstacFrames, WstacOptions};
use wstac_c::record::{WstacKind, WstacRecord};
use wstac_c::status::WstacStatus;
use wstac_c::{
    Wstac, wstac_close, wstac_error_message, wstac_error_text, wstac_finish, wstac_next, wstac_open, wstac_open_frames,
    wstac_push_frame, wstac_push_lost,
};

fuzz_target!(|data: &[u8]| {
    // The input has ended: nothing is left to try.
    let _ = program(&mut Unstructured::new(data));
});

/// Returns bytes in a buffer of just their length.
fn bytes(input: &mut Unstructured<'_>) -> Result<Box<[u8]>> {
    let length = usize::from(input.arbitrary::<u16>()?);
    Ok(vec![input.arbitrary()?; length].into())
}

fn string(input: &mut Unstructured<'_>, usual: &[&CStr]) -> Result<CString> {
    if input.ratio(7, 8)? {
        return Ok((*input.choose(usual)?).to_owned());
    }
    let bytes: Vec<u8> = input.arbitrary()?;
    let text: Vec<u8> = bytes.into_iter().filter(|byte| *byte != 0).collect();
    // A name that fuzzing finds must not be a device of this machine.
    Ok(CString::new([b"fuzz-".as_slice(), &text].concat()).expect("no zeros"))
}

fn program(input: &mut Unstructured<'_>) -> Result<()> {
    let format = string(input, &[c"GREY", c"YUYV", c"NV12", c"RGB3", c"BA10", c"Y16 ", c"422P"])?;
    let models = [string(input, &[c"builtin:boosted", c"none.wsm"])?, string(input, &[c"builtin:svm"])?];
    let models: Vec<*const c_char> = models.iter().map(|name| name.as_ptr()).chain([ptr::null()]).collect();
    let config = string(input, &[c"none.toml"])?;
    let text = string(input, &[c"[trigger]\nwindow = 7\n", c"[sensor]\nreadout_ms = 0\n", c""])?;
    let choice = |input: &mut Unstructured<'_>| {
        Ok(if input.ratio(1, 16)? { input.arbitrary()? } else { u8::from(input.arbitrary::<bool>()?) })
    };
    let number = |input: &mut Unstructured<'_>, most: u32| {
        if input.ratio(1, 16)? { input.arbitrary() } else { input.int_in_range(0..=most) }
    };
    let options = WstacOptions {
        config: if input.ratio(1, 16)? { config.as_ptr() } else { ptr::null() },
        models: if input.ratio(1, 4)? { models.as_ptr() } else { ptr::null() },
        fps_numerator: if input.ratio(1, 16)? { number(input, 60)? } else { 0 },
        fps_denominator: if input.ratio(1, 16)? { number(input, 2)? } else { 0 },
        format: if input.ratio(1, 16)? { format.as_ptr() } else { ptr::null() },
        width: if input.ratio(1, 16)? { number(input, 100)? } else { 0 },
        height: if input.ratio(1, 16)? { number(input, 100)? } else { 0 },
        features: choice(input)?,
        motion: choice(input)?,
        every_frame: if input.ratio(1, 16)? { choice(input)? } else { 0 },
        keep_controls: if input.ratio(1, 16)? { choice(input)? } else { 0 },
        sensor: if input.ratio(1, 16)? { format.as_ptr() } else { ptr::null() },
        at_once: choice(input)?,
        config_text: if input.ratio(1, 8)? { text.as_ptr() } else { ptr::null() },
    };
    let options = if input.ratio(1, 4)? { ptr::null() } else { &raw const options };
    let mut handle: *mut Wstac = ptr::null_mut();
    // SAFETY: strings end in 0, lists in null, and all are there.
    let status = unsafe {
        if input.ratio(1, 8)? {
            let source =
                string(input, &[c"scene:Saw3@1000", c"scene:Saw3@150,seed=7", c"", c"none.y4m", c"scene:none.toml"])?;
            wstac_open(source.as_ptr(), options, &raw mut handle)
        } else {
            let frames = WstacFrames {
                width: number(input, 60)?,
                height: number(input, 60)?,
                format: format.as_ptr(),
                bytes_per_row: if input.arbitrary()? { 0 } else { number(input, 300)? },
                fps_numerator: if input.arbitrary()? { 0 } else { number(input, 120)? },
                fps_denominator: if input.arbitrary()? { 0 } else { number(input, 2)? },
                bt709: choice(input)?,
                full_range: choice(input)?,
            };
            wstac_open_frames(&raw const frames, options, &raw mut handle)
        }
    };
    assert_eq!(status == WstacStatus::Ok, !handle.is_null());
    check_message(ptr::null());
    if handle.is_null() {
        return Ok(());
    }
    let mut ended = Ok(());
    for _ in 0..2000 {
        ended = call(handle, input);
        if ended.is_err() {
            break;
        }
        check_message(handle);
    }
    // SAFETY: the handle is open, and not used again.
    unsafe { wstac_close(handle) };
    ended
}

fn call(handle: *mut Wstac, input: &mut Unstructured<'_>) -> Result<()> {
    // SAFETY: the handle is open, and buffers are as long as is said.
    let status = unsafe {
        match input.int_in_range(0..=7)? {
            0 => wstac_push_lost(handle, input.arbitrary()?),
            1 => wstac_finish(handle),
            2 => {
                let bytes = bytes(input)?;
                wstac_push_frame(handle, bytes.as_ptr(), bytes.len())
            }
            3 | 4 => {
                // Many frames of one gray.
                let bytes = bytes(input)?;
                for _ in 0..input.int_in_range(0..=100)? {
                    wstac_push_frame(handle, bytes.as_ptr(), bytes.len());
                }
                WstacStatus::Ok
            }
            _ => {
                let mut record = mem::zeroed::<WstacRecord>();
                let status = wstac_next(handle, &raw mut record);
                if status == WstacStatus::Ok {
                    check(&record);
                }
                status
            }
        }
    };
    assert_ne!(status, WstacStatus::Panic);
    // SAFETY: texts stay.
    assert!(!unsafe { CStr::from_ptr(wstac_error_text(status as i32)) }.is_empty());
    Ok(())
}

/// Reads everything that a record points to.
fn check(record: &WstacRecord) {
    let texts = [
        record.texture.specimen,
        record.texture.pattern,
        record.texture.other,
        record.fault,
        record.message,
        record.event.why_no_speed,
        record.event.why_no_direction,
        record.event.why_not_reliable,
        record.event.why_texture,
    ];
    for text in texts.into_iter().filter(|text| !text.is_null()) {
        // SAFETY: a string of the library, which is valid until the next call.
        assert!(unsafe { CStr::from_ptr(text) }.to_str().is_ok());
    }
    if record.kind == WstacKind::Event {
        assert!(!record.event.sample.is_null());
        // SAFETY: an event has a sample of 70 frames.
        let sample = unsafe { std::slice::from_raw_parts(record.event.sample, 70) };
        std::hint::black_box(sample.as_flattened().iter().map(|value| i32::from(*value)).sum::<i32>());
    }
}

fn check_message(handle: *const Wstac) {
    // SAFETY: null or an open handle.
    let message = unsafe { CStr::from_ptr(wstac_error_message(handle)) };
    assert!(message.to_str().is_ok_and(|message| message.len() <= 1000 && !message.contains('\n')));
}
