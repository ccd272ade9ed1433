//! WSTac for C programs on hosts: `libwstac.so`. cbindgen makes its header, `include/wstac.h`, from this crate
//! (`ci/generated headers`).
//!
//! A handle is a [`Session`](wstac_host::session::Session). [`wstac_open`] opens a source; [`wstac_open_frames`] takes
//! frames that the program pushes. [`wstac_next`] returns the next record, and [`wstac_close`] frees the handle. Every
//! call checks its pointers and the state of the handle. No panic leaves a call: an error is a status and a message.
//!
//! | what | file |
//! | --- | --- |
//! | statuses, messages | `status.rs` |
//! | options of a program | `options.rs` |
//! | the session of a handle | `sensor.rs` |
//! | records for a program | `record.rs` |
//! | what both C interfaces share | `types.rs` |
#![warn(clippy::undocumented_unsafe_blocks)]

pub mod options;
pub mod record;
mod sensor;
pub mod status;
pub mod types;

use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

use self::options::{WstacFrames, WstacOptions};
use self::record::WstacRecord;
pub use self::sensor::SensorSession;
use self::status::{Failure, Said, WstacStatus, failed, kind, message, path, remember};

/// A sensor, opened by wstac_open or wstac_open_frames. It belongs to the thread that opened it. Sensors share nothing.
pub struct Wstac {
    /// `None` after a panic: then the handle can only be closed.
    sensor: Option<SensorSession>,
    /// The message of the last call that failed.
    said: Said,
}

/// Runs a call that makes a handle. If it fails, the thread keeps the message, since there is no handle.
///
/// # Safety
/// `handle` is null or memory for a pointer.
unsafe fn open(handle: *mut *mut Wstac, make: impl FnOnce() -> Result<SensorSession, Failure>) -> WstacStatus {
    if handle.is_null() {
        return remember(failed(WstacStatus::Null, "handle is null, expected the address of a pointer"));
    }
    // SAFETY: not null, memory for a pointer (the caller).
    unsafe { handle.write(ptr::null_mut()) };
    match catch_unwind(AssertUnwindSafe(make)) {
        Ok(Ok(sensor)) => {
            let made = Box::new(Wstac { sensor: Some(sensor), said: Said::default() });
            // SAFETY: as above.
            unsafe { handle.write(Box::into_raw(made)) };
            WstacStatus::Ok
        }
        Ok(Err(failure)) => remember(failure),
        Err(_) => remember(failed(WstacStatus::Panic, PANICKED)),
    }
}

/// The message of a call that has panicked.
const PANICKED: &str = "something inside has failed, which is a fault of this library: the handle can only be closed";

/// Runs a call on a handle.
///
/// # Safety
/// `handle` is null or a handle that is open, and that no other thread uses.
unsafe fn with(handle: *mut Wstac, call: impl FnOnce(&mut SensorSession) -> Result<(), Failure>) -> WstacStatus {
    if handle.is_null() {
        return remember(failed(WstacStatus::Null, "handle is null, expected an open handle"));
    }
    // SAFETY: not null, an open handle that nobody else uses (the caller).
    let wstac = unsafe { &mut *handle };
    let result = match &mut wstac.sensor {
        Some(sensor) => catch_unwind(AssertUnwindSafe(|| call(sensor))),
        None => Ok(Err(failed(WstacStatus::Panic, PANICKED))),
    };
    let result = result.unwrap_or_else(|_| {
        // The sensor may be in a broken state, and dropping it could panic again, so it is leaked.
        std::mem::forget(wstac.sensor.take());
        Err(failed(WstacStatus::Panic, PANICKED))
    });
    match result {
        Ok(()) => WstacStatus::Ok,
        Err(failure) => {
            wstac.said = failure.said;
            failure.status
        }
    }
}

/// Opens a source, as `wstac run SOURCE` does.
///
/// A source is "/dev/videoN", "rpicam:", "scene:Saw3@150,90deg", a Y4M file, a folder of PNGs or JPEGs, a recording
/// (.mcap), a board such as "/dev/ttyACM0", or "-".
/// `source` need not be UTF-8; `options` may be null. If the call fails, the handle is null, and
/// wstac_error_message(NULL) returns the message.
///
/// # Safety
/// `source` is null or a string that ends in 0; `options` is null or options; `handle` is null or memory for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_open(
    source: *const c_char,
    options: *const WstacOptions,
    handle: *mut *mut Wstac,
) -> WstacStatus {
    let make = || {
        // SAFETY: the caller's.
        let source = unsafe { path("source", source) }?;
        // SAFETY: the caller's.
        let options = unsafe { options::read(options) }?;
        SensorSession::open(source, &options)
    };
    // SAFETY: the caller's.
    unsafe { open(handle, make) }
}

/// Opens a sensor whose frames the program pushes.
///
/// `options` may be null. Options that choose a source are refused.
///
/// # Safety
/// `frames` is null or a description; `options` is null or options; `handle` is null or memory for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_open_frames(
    frames: *const WstacFrames,
    options: *const WstacOptions,
    handle: *mut *mut Wstac,
) -> WstacStatus {
    let make = || {
        // SAFETY: the caller's.
        let frames = unsafe { frames.as_ref() }.ok_or_else(|| failed(WstacStatus::Null, "frames is null"))?;
        // SAFETY: the caller's.
        let options = unsafe { options::read(options) }?;
        // SAFETY: the caller's.
        let info = unsafe { frames.info() }?;
        SensorSession::of_frames(&info, &options)
    };
    // SAFETY: the caller's.
    unsafe { open(handle, make) }
}

/// Writes the next record.
///
/// A source is read until there is a record. A camera without a frame gives WSTAC_KIND_WAITING within a second. With
/// frames that the program pushes, WSTAC_KIND_WAITING means: push more. WSTAC_KIND_END is the last record.
///
/// If a source cannot be read any further, the call returns WSTAC_STATUS_SOURCE, and the record is the end record.
/// Otherwise the record is written only with WSTAC_STATUS_OK. What a record points to is valid until the next
/// wstac_next or wstac_close of the handle.
///
/// # Safety
/// `handle` is null or an open handle; `record` is null or memory for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_next(handle: *mut Wstac, record: *mut WstacRecord) -> WstacStatus {
    let next = |sensor: &mut SensorSession| {
        if record.is_null() {
            return Err(failed(WstacStatus::Null, "record is null, expected memory for one"));
        }
        let (given, error) = sensor.next()?;
        // SAFETY: not null, memory for a record (the caller).
        unsafe { record.write(given) };
        error.map_or(Ok(()), Err)
    };
    // SAFETY: the caller's.
    unsafe { with(handle, next) }
}

/// Takes a frame of `length` bytes, laid out as described to wstac_open_frames. wstac_next returns the records that
/// follow.
///
/// A frame with too few bytes is refused and not taken. Call wstac_push_lost to keep its place in time. So is a frame
/// with too many, which has another size than described: a row and 4096 bytes of padding at its end are allowed. At
/// most WSTAC_MOST_RECORDS records wait: then no frame is taken until wstac_next has returned some.
///
/// # Safety
/// `handle` is null or an open handle; `bytes` is null or `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_push_frame(handle: *mut Wstac, bytes: *const u8, length: usize) -> WstacStatus {
    let push = |sensor: &mut SensorSession| {
        if bytes.is_null() {
            return Err(failed(WstacStatus::Null, "bytes is null, expected a frame's"));
        }
        if isize::try_from(length).is_err() {
            return Err(failed(WstacStatus::Frame, format_args!("length is {length}, expected what memory can hold")));
        }
        // SAFETY: not null, `length` bytes (the caller).
        sensor.push_frame(unsafe { std::slice::from_raw_parts(bytes, length) })
    };
    // SAFETY: the caller's.
    unsafe { with(handle, push) }
}

/// Keeps the place of lost frames in time, unless WSTAC_MOST_RECORDS records wait. A short gap is filled; a long one
/// interrupts the sample.
///
/// # Safety
/// `handle` is null or an open handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_push_lost(handle: *mut Wstac, frames: u64) -> WstacStatus {
    // SAFETY: the caller's.
    unsafe { with(handle, |sensor| sensor.push_lost(frames)) }
}

/// Ends a stream of pushed frames, or a source before its end. wstac_next returns what is pending, then the end record.
///
/// # Safety
/// `handle` is null or an open handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_finish(handle: *mut Wstac) -> WstacStatus {
    // SAFETY: the caller's.
    unsafe { with(handle, SensorSession::finish) }
}

/// Closes a handle and frees everything that belongs to it, strings of records included. Null is allowed, as in free.
///
/// # Safety
/// `handle` is null or an open handle, which is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_close(handle: *mut Wstac) {
    if handle.is_null() {
        return;
    }
    // SAFETY: `open` made it of a box, and nobody uses it again (the caller).
    let wstac = unsafe { Box::from_raw(handle) };
    // A panic must not leave the library. Memory that was not yet freed is leaked.
    let _ = catch_unwind(AssertUnwindSafe(|| drop(wstac)));
}

/// Returns the message of the last call on this handle that failed: what was found and what was expected.
///
/// For null, it is the message of the last call of this thread that failed without a handle. The message is UTF-8,
/// never null, and valid until the next call on the handle (for null: of this thread).
///
/// # Safety
/// `handle` is null or an open handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_error_message(handle: *const Wstac) -> *const c_char {
    // SAFETY: null, or an open handle (the caller).
    unsafe { handle.as_ref() }.map_or_else(message, |wstac| wstac.said.message.as_ptr())
}

/// Returns the kind of the error whose message wstac_error_message returns for the same handle: not_found,
/// already_exists, busy, io, device, config, frame, format, data, unsupported or usage.
///
/// It is empty if the status says all. The string is never null, and valid as long as the message.
///
/// # Safety
/// `handle` is null or an open handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_error_kind(handle: *const Wstac) -> *const c_char {
    // SAFETY: null, or an open handle (the caller).
    unsafe { handle.as_ref() }.map_or_else(kind, |wstac| wstac.said.kind.as_ptr())
}

/// Returns what nothing states of a handle's source, such as where its taxels are, and what follows for the answers.
///
/// It is UTF-8 for a person, one sentence per line. It is empty if all is stated, if the handle is null, or after
/// WSTAC_STATUS_PANIC. The string is valid until wstac_close.
///
/// # Safety
/// `handle` is null or an open handle, which no other thread uses meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_notes(handle: *const Wstac) -> *const c_char {
    // SAFETY: null, or an open handle (the caller).
    unsafe { sensor(handle) }.map_or(c"".as_ptr(), |sensor| sensor.notes.as_ptr())
}

/// Returns the milliseconds in which the camera reads its rows, as motion is computed with it.
///
/// It is negative if the bottom row comes first, and 0 for a global shutter. It is NAN if nothing states it, if the
/// handle is null, or after WSTAC_STATUS_PANIC.
///
/// # Safety
/// `handle` is null or an open handle, which no other thread uses meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn wstac_readout_ms(handle: *const Wstac) -> f64 {
    // SAFETY: null, or an open handle (the caller).
    unsafe { sensor(handle) }.map_or(f64::NAN, |sensor| sensor.readout_ms)
}

/// Returns the sensor of a handle; `None` for null and after a panic.
///
/// # Safety
/// `handle` is null or an open handle.
unsafe fn sensor<'a>(handle: *const Wstac) -> Option<&'a SensorSession> {
    // SAFETY: null, or an open handle (the caller).
    unsafe { handle.as_ref() }?.sensor.as_ref()
}

/// Returns a status in words: a static string in English. A number that is no status has a string, too.
#[unsafe(no_mangle)]
pub extern "C" fn wstac_error_text(status: i32) -> *const c_char {
    status::in_words(status).as_ptr()
}

/// Returns the version of the library that is loaded, such as "0.3.0", as WSTAC_VERSION_TEXT has that of the header.
#[unsafe(no_mangle)]
pub extern "C" fn wstac_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

#[cfg(test)]
mod tests;
