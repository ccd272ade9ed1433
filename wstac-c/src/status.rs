//! What a call comes back with: a status, and a message.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::fmt;

/// What a call comes back with.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WstacStatus {
    /// Done.
    Ok = 0,
    /// A pointer is null.
    Null = 1,
    /// A text is not UTF-8.
    Text = 2,
    /// An option, or a description of frames, is wrong, or does not go with what is opened.
    Option = 3,
    /// The configuration cannot be read, or does not fit the source.
    Config = 4,
    /// A model cannot be used.
    Model = 5,
    /// The source cannot be opened, or not be read any further.
    Source = 6,
    /// A frame has too few bytes.
    Frame = 7,
    /// The call does not fit what the handle is, or what it has done.
    State = 8,
    /// Something inside has failed: the handle can only be closed.
    Panic = 9,
}

/// Every status in words.
const TEXTS: [(WstacStatus, &CStr); 10] = [
    (WstacStatus::Ok, c"done"),
    (WstacStatus::Null, c"a pointer is null"),
    (WstacStatus::Text, c"a text is not UTF-8"),
    (WstacStatus::Option, c"an option is wrong"),
    (WstacStatus::Config, c"the configuration cannot be used"),
    (WstacStatus::Model, c"a model cannot be used"),
    (WstacStatus::Source, c"the source cannot be used"),
    (WstacStatus::Frame, c"a frame has too few bytes"),
    (WstacStatus::State, c"the call does not fit what the handle is or has done"),
    (WstacStatus::Panic, c"something inside has failed: the handle can only be closed"),
];

/// A status in words.
pub(super) fn in_words(status: i32) -> &'static CStr {
    TEXTS.iter().find(|(known, _)| *known as i32 == status).map_or(c"no status of this library", |(_, text)| text)
}

/// Why a call failed.
#[derive(Debug)]
pub(super) struct Failure {
    pub(super) status: WstacStatus,
    pub(super) message: CString,
}

/// A failure that says this.
pub(super) fn failed(status: WstacStatus, message: impl fmt::Display) -> Failure {
    Failure { status, message: c_string(message) }
}

/// Text for C: what is behind a 0, which no text of ours has, is left out.
pub(super) fn c_string(text: impl fmt::Display) -> CString {
    let mut bytes = text.to_string().into_bytes();
    bytes.retain(|byte| *byte != 0);
    CString::new(bytes).unwrap_or_default()
}

thread_local! {
    /// What the last call of this thread said that failed without a handle.
    static LAST: RefCell<CString> = RefCell::default();
}

/// Keeps a failure's message for this thread.
pub(super) fn remember(failure: Failure) -> WstacStatus {
    LAST.with(|last| last.replace(failure.message));
    failure.status
}

/// The message that is kept for this thread.
pub(super) fn message() -> *const c_char {
    LAST.with(|last| last.borrow().as_ptr())
}

/// A caller's text.
///
/// # Errors
/// Where it is null or not UTF-8.
///
/// # Safety
/// Null, or text that ends in 0 and that nobody changes meanwhile.
pub(super) unsafe fn text<'a>(name: &str, text: *const c_char) -> Result<&'a str, Failure> {
    if text.is_null() {
        return Err(failed(WstacStatus::Null, format_args!("{name} is null, expected text")));
    }
    // SAFETY: not null, ends in 0 (the caller).
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map_err(|_| failed(WstacStatus::Text, format_args!("{name} is {text:?}, expected UTF-8")))
}
