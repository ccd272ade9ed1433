//! Errors for a person. They say what cannot be used, which part of it, what was found and what was expected.

use std::fmt;

/// An error that says why a source, a file or a configuration cannot be used.
pub struct Error {
    subject: String,
    message: String,
}

impl Error {
    /// Creates an error.
    ///
    /// `subject` names the file, device or option; `message` names the field, what was found and what was expected.
    pub fn new(subject: impl fmt::Display, message: impl fmt::Display) -> Self {
        Self { subject: subject.to_string(), message: message.to_string() }
    }

    /// Returns the same error about another subject, which the caller knows better.
    #[must_use]
    pub fn about(self, subject: impl fmt::Display) -> Self {
        Self { subject: subject.to_string(), ..self }
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

impl std::error::Error for Error {}
