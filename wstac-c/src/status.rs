//! Statuses and messages of calls.

use std::cell::RefCell;
use std::ffi::{CStr, CString, OsStr, c_char};
use std::fmt;
use std::os::unix::ffi::OsStrExt;

use wstac_host::error::Error;

/// Status of a call.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WstacStatus {
    /// Done.
    Ok = 0,
    /// A pointer is null.
    Null = 1,
    /// A string is not UTF-8.
    Text = 2,
    /// An option or a description of frames is wrong, or does not apply to what is opened.
    Option = 3,
    /// The configuration cannot be read, or does not fit the source.
    Config = 4,
    /// A model cannot be used.
    Model = 5,
    /// The source cannot be opened, or cannot be read any further.
    Source = 6,
    /// A frame has too few bytes, or too many for its size.
    Frame = 7,
    /// The call does not fit the handle or its state.
    State = 8,
    /// Something inside has failed: the handle can only be closed.
    Panic = 9,
}

const TEXTS: [(WstacStatus, &CStr); 10] = [
    (WstacStatus::Ok, c"done"),
    (WstacStatus::Null, c"a pointer is null"),
    (WstacStatus::Text, c"a string is not UTF-8"),
    (WstacStatus::Option, c"an option is wrong"),
    (WstacStatus::Config, c"the configuration cannot be used"),
    (WstacStatus::Model, c"a model cannot be used"),
    (WstacStatus::Source, c"the source cannot be used"),
    (WstacStatus::Frame, c"a frame has too few bytes"),
    (WstacStatus::State, c"the call does not fit the handle or its state"),
    (WstacStatus::Panic, c"something inside has failed: the handle can only be closed"),
];

pub(super) fn in_words(status: i32) -> &'static CStr {
    TEXTS.iter().find(|(known, _)| *known as i32 == status).map_or(c"no status of this library", |(_, text)| text)
}

#[derive(Debug)]
pub(super) struct Failure {
    pub(super) status: WstacStatus,
    pub(super) said: Said,
}

/// The message of a failure, and the name of its kind: empty if the status says all.
#[derive(Debug, Default)]
pub(super) struct Said {
    pub(super) message: CString,
    pub(super) kind: CString,
}

pub(super) fn failed(status: WstacStatus, message: impl fmt::Display) -> Failure {
    Failure { status, said: Said { message: c_string(message), kind: CString::default() } }
}

/// Returns the failure of an error that has a kind.
pub(super) fn failed_by(status: WstacStatus, error: &Error) -> Failure {
    Failure { status, said: Said { message: c_string(error), kind: c_string(error.kind().name()) } }
}

/// Returns a string for C, without the zeros that are in it.
pub(super) fn c_string(text: impl fmt::Display) -> CString {
    let mut bytes = text.to_string().into_bytes();
    bytes.retain(|byte| *byte != 0);
    CString::new(bytes).unwrap_or_default()
}

thread_local! {
    /// The message of the last call of this thread that failed without a handle.
    static LAST: RefCell<Said> = RefCell::default();
}

/// Keeps the message of a failure for this thread.
pub(super) fn remember(failure: Failure) -> WstacStatus {
    // At the end of a thread its message may be gone already. The status is enough then.
    let _ = LAST.try_with(|last| last.replace(failure.said));
    failure.status
}

/// Returns the message that is kept for this thread.
pub(super) fn message() -> *const c_char {
    let gone = c"the thread is ending, and its message is gone";
    LAST.try_with(|last| last.borrow().message.as_ptr()).unwrap_or(gone.as_ptr())
}

/// Returns the kind of error that is kept for this thread.
pub(super) fn kind() -> *const c_char {
    LAST.try_with(|last| last.borrow().kind.as_ptr()).unwrap_or(c"".as_ptr())
}

/// Returns a caller's path, which need not be UTF-8.
///
/// # Errors
/// It is null.
///
/// # Safety
/// `path` is null or a string that ends in 0 and that nobody changes meanwhile.
pub(super) unsafe fn path<'a>(name: &str, path: *const c_char) -> Result<&'a OsStr, Failure> {
    if path.is_null() {
        return Err(failed(WstacStatus::Null, format_args!("{name} is null, expected text")));
    }
    // SAFETY: not null, ends in 0 (the caller).
    Ok(OsStr::from_bytes(unsafe { CStr::from_ptr(path) }.to_bytes()))
}

/// Returns a caller's string.
///
/// # Errors
/// It is null or not UTF-8.
///
/// # Safety
/// `text` is null or a string that ends in 0 and that nobody changes meanwhile.
pub(super) unsafe fn text<'a>(name: &str, text: *const c_char) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(failed(WstacStatus::Null, format_args!("{name} is null, expected text")));
    }
    // SAFETY: not null, ends in 0 (the caller).
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map_err(|_| failed(WstacStatus::Text, format_args!("{name} is {text:?}, expected UTF-8")))
}

/// Returns the text at a pointer; `None` if it is null.
///
/// # Safety
/// As for [`text`].
pub(super) unsafe fn text_if_any<'a>(name: &str, place: *const c_char) -> Result<Option<&'a str>, Failure> {
    // SAFETY: the caller vouches for it.
    if place.is_null() { Ok(None) } else { unsafe { text(name, place) }.map(Some) }
}
