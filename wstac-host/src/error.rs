//! Errors for a person. They say what cannot be used, which part of it, what was found and what was expected.
//!
//! Programs decide by [`Error::kind`] or its predicates, never by the text.
//!
//! ```
//! use std::path::Path;
//! use wstac_host::config::Config;
//! use wstac_host::error::ErrorKind;
//!
//! let error = Config::read(Path::new("no-such-file.toml")).unwrap_err();
//! assert!(error.is_not_found());
//! assert_eq!(error.kind(), ErrorKind::NotFound);
//! assert_eq!(error.subject(), "no-such-file.toml");
//! // The cause is an `io::Error`.
//! assert!(std::error::Error::source(&error).is_some());
//! ```

use std::error::Error as StdError;
use std::{fmt, io};

use wstac_core::error::{ConfigError, FrameError};

use crate::visible;

type Cause = Box<dyn StdError + Send + Sync>;

/// The kind of an [`Error`]: what a program can do about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A file, device or address does not exist.
    NotFound,
    /// A file exists already and is not overwritten.
    AlreadyExists,
    /// Another program uses the file or device. It may work later.
    Busy,
    /// The operating system refused to read or write. Examples are a full disk and missing permissions.
    Io,
    /// A camera or board failed, is gone, or refused what was set.
    Device,
    /// A configuration, a scene or a plan has a wrong value, or does not fit the source.
    Config,
    /// A frame was not taken.
    Frame,
    /// A file or stream is damaged, or has another format.
    Format,
    /// The data can be read, but they do not hold what is needed. An example is a recording without events.
    Data,
    /// This build, or this kind of source, cannot do what is asked.
    Unsupported,
    /// An argument is wrong, or does not go with the others.
    Usage,
}

impl ErrorKind {
    /// Returns the kind's name, as C and Python have it: lower case, with `_` between words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotFound => "not_found",
            Self::AlreadyExists => "already_exists",
            Self::Busy => "busy",
            Self::Io => "io",
            Self::Device => "device",
            Self::Config => "config",
            Self::Frame => "frame",
            Self::Format => "format",
            Self::Data => "data",
            Self::Unsupported => "unsupported",
            Self::Usage => "usage",
        }
    }
}

/// Most bytes of a subject and of a message: together with `: ` between them at most [`visible::LONGEST`].
const LONGEST_SUBJECT: usize = 300;
const LONGEST_MESSAGE: usize = visible::LONGEST - LONGEST_SUBJECT - 2;

/// Returns a part of an error's text: one line that a terminal shows as it is, of at most `most` bytes.
fn part(text: &impl fmt::Display, most: usize) -> String {
    visible::shortened(&visible::line(&text.to_string()), most).into_owned()
}

/// An error that says why a source, a file or a configuration cannot be used.
///
/// Its text is `SUBJECT: MESSAGE`: one line of at most 1000 bytes, in which no character controls a terminal.
/// [`source`](StdError::source) returns the error that caused it, if there is one. Its text is part of the message
/// then.
pub struct Error {
    kind: ErrorKind,
    subject: String,
    message: String,
    cause: Option<Cause>,
}

impl Error {
    /// Creates an error.
    ///
    /// `subject` names the file, device or option; `message` names the field, what was found and what was expected.
    pub fn new(kind: ErrorKind, subject: impl fmt::Display, message: impl fmt::Display) -> Self {
        Self { kind, subject: part(&subject, LONGEST_SUBJECT), message: part(&message, LONGEST_MESSAGE), cause: None }
    }

    /// Creates an error whose message is the text of its cause.
    pub fn with_cause(kind: ErrorKind, subject: impl fmt::Display, cause: impl Into<Cause>) -> Self {
        let cause = cause.into();
        Self::new(kind, subject, &cause).caused_by(cause)
    }

    /// Creates an error of reading or writing. Its kind follows from that of the cause.
    pub fn io(subject: impl fmt::Display, cause: io::Error) -> Self {
        // A cause that is not the system's has a text of its own.
        let plain = cause.raw_os_error().and(match cause.kind() {
            io::ErrorKind::NotFound => Some("no such file or folder"),
            io::ErrorKind::NotADirectory => Some("a part of the path is no folder"),
            io::ErrorKind::IsADirectory => Some("is a folder, expected a file"),
            io::ErrorKind::PermissionDenied => Some("this user has no permission for it"),
            _ => None,
        });
        match plain {
            Some(text) => Self::new(cause.kind().into(), subject, text).caused_by(cause),
            None => Self::with_cause(cause.kind().into(), subject, cause),
        }
    }

    /// Creates an error of a configuration that the core refuses.
    pub fn config(subject: impl fmt::Display, cause: ConfigError) -> Self {
        Self::with_cause(ErrorKind::Config, subject, cause)
    }

    /// Creates an error of a frame that the core does not take.
    pub fn frame(subject: impl fmt::Display, cause: FrameError) -> Self {
        Self::with_cause(ErrorKind::Frame, subject, cause)
    }

    /// Returns the same error with a cause. Its text should be part of the message.
    #[must_use]
    pub fn caused_by(self, cause: impl Into<Cause>) -> Self {
        Self { cause: Some(cause.into()), ..self }
    }

    /// Returns the same error about another subject, which the caller knows better.
    #[must_use]
    pub fn about(self, subject: impl fmt::Display) -> Self {
        Self { subject: part(&subject, LONGEST_SUBJECT), ..self }
    }

    /// Returns the kind of the error.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Returns the name of the file, device or option that cannot be used.
    pub fn subject(&self) -> &str {
        &self.subject
    }

    /// Returns what is wrong with the subject.
    pub fn message(&self) -> &str {
        &self.message
    }
}

/// Writes a predicate of each kind.
macro_rules! predicates {
    ($($(#[$about:meta])* $name:ident = $kind:ident,)*) => {
        impl Error {
            $($(#[$about])*
            pub fn $name(&self) -> bool {
                self.kind == ErrorKind::$kind
            })*
        }
    };
}

predicates! {
    /// Returns whether a file, device or address does not exist.
    is_not_found = NotFound,
    /// Returns whether a file exists already and is not overwritten.
    is_already_exists = AlreadyExists,
    /// Returns whether another program uses the file or device.
    is_busy = Busy,
    /// Returns whether the operating system refused to read or write.
    ///
    /// Missing, existing and busy files have predicates of their own.
    is_io = Io,
    /// Returns whether a camera or board failed, is gone, or refused what was set.
    is_device = Device,
    /// Returns whether a configuration, a scene or a plan has a wrong value, or does not fit the source.
    is_config = Config,
    /// Returns whether a frame was not taken.
    is_frame = Frame,
    /// Returns whether a file or stream is damaged, or has another format.
    is_format = Format,
    /// Returns whether the data can be read, but do not hold what is needed.
    is_data = Data,
    /// Returns whether this build, or this kind of source, cannot do what is asked.
    is_unsupported = Unsupported,
    /// Returns whether an argument is wrong, or does not go with the others.
    is_usage = Usage,
}

impl From<io::ErrorKind> for ErrorKind {
    fn from(kind: io::ErrorKind) -> Self {
        match kind {
            io::ErrorKind::NotFound => Self::NotFound,
            io::ErrorKind::AlreadyExists => Self::AlreadyExists,
            io::ErrorKind::ResourceBusy => Self::Busy,
            io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => Self::Format,
            io::ErrorKind::Unsupported => Self::Unsupported,
            _ => Self::Io,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.subject, self.message)
    }
}

/// Writes the error as for a person: this is what `unwrap`, and a `main` that returns the error, print.
impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl StdError for Error {
    fn source(&self) -> Option<&(dyn StdError + 'static)> {
        self.cause.as_deref().map(|cause| cause as &(dyn StdError + 'static))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_from_outside_are_one_short_line() {
        let error = Error::new(ErrorKind::Format, "a\x1b[2J\n.mcap", "key \"\x1b]0;x\x07\nevent at frame 1\"");
        assert_eq!(error.to_string(), r#"a\u001b[2J\u000a.mcap: key "\u001b]0;x\u0007\u000aevent at frame 1""#);
        assert_eq!(error.about("b\r").subject(), r"b\u000d");
        let long = Error::new(ErrorKind::Format, "é".repeat(5000), "\x1b".repeat(5000));
        assert!(long.to_string().len() <= 1000 && long.to_string().len() > 990, "{}", long.to_string().len());
        assert!(long.about("ü".repeat(5000)).to_string().len() <= 1000);
    }

    #[test]
    fn kinds_subjects_texts_and_causes_are_kept() {
        let missing = Error::io("a.y4m", io::Error::from_raw_os_error(libc::ENOENT));
        assert_eq!(
            (missing.kind(), missing.to_string().as_str()),
            (ErrorKind::NotFound, "a.y4m: no such file or folder")
        );
        assert!(missing.is_not_found() && !missing.is_io());
        for (code, text) in
            [(libc::EISDIR, "is a folder, expected a file"), (libc::EACCES, "this user has no permission for it")]
        {
            let error = Error::io("a.y4m", io::Error::from_raw_os_error(code));
            assert_eq!((error.message(), error.source().is_some()), (text, true));
        }
        let cause = missing.source().and_then(|cause| cause.downcast_ref::<io::Error>()).unwrap();
        assert_eq!(cause.kind(), io::ErrorKind::NotFound);

        let refused = Error::config("wstac.toml", ConfigError::Window(71)).about("other.toml");
        assert!(refused.is_config());
        assert_eq!((refused.subject(), refused.message()), ("other.toml", "window is 71 frames, expected 1 to 70"));
        assert_eq!(refused.source().unwrap().downcast_ref(), Some(&ConfigError::Window(71)));

        let short = FrameError::FrameTooShort { found: 1, expected: 2 };
        let frame = Error::frame("camera", short);
        assert_eq!((frame.kind(), frame.source().unwrap().downcast_ref()), (ErrorKind::Frame, Some(&short)));
        assert_eq!(frame.to_string(), "camera: frame has 1 byte, expected at least 2");

        let plain = Error::new(ErrorKind::Usage, "--label", "is empty, expected a name");
        assert!(plain.is_usage() && plain.source().is_none());
        assert_eq!(format!("{plain:?}"), "--label: is empty, expected a name");
        for (io, kind) in [
            (io::ErrorKind::PermissionDenied, ErrorKind::Io),
            (io::ErrorKind::ResourceBusy, ErrorKind::Busy),
            (io::ErrorKind::UnexpectedEof, ErrorKind::Format),
            (io::ErrorKind::AlreadyExists, ErrorKind::AlreadyExists),
        ] {
            assert_eq!(Error::io("x", io.into()).kind(), kind, "{io}");
        }
    }
}
