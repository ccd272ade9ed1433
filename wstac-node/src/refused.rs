//! Zenoh's refusals, in words for people.

use wstac_host::error::{Error, ErrorKind};

pub(crate) fn refused(kind: ErrorKind, subject: impl std::fmt::Display, error: &zenoh::Error) -> Error {
    Error::new(kind, subject, in_words(&error.to_string()))
}

/// Returns a message of Zenoh without the places in its source code: they are those of the machine that built this
/// program, and tell a user nothing.
pub(crate) fn in_words(message: &str) -> String {
    let mut parts = message.split(" at ");
    let mut words = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match place(part) {
            Some(length) => words.push_str(&part[length..]),
            None => words.extend([" at ", part]),
        }
    }
    words
}

/// Returns the length of a place in source code at the start of a text, such as `/src/a.rs:12` or `a.rs:12:5`.
fn place(text: &str) -> Option<usize> {
    let file = text.find(".rs:")?;
    if text[..file].contains(char::is_whitespace) {
        return None;
    }
    let numbers = &text[file + ".rs:".len()..];
    let end = numbers.find(|letter: char| !letter.is_ascii_digit() && letter != ':').unwrap_or(numbers.len());
    let length = numbers[..end].trim_end_matches(':').len();
    (length > 0).then_some(file + ".rs:".len() + length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_in_source_code_are_left_out() {
        for (message, words) in [
            ("cannot listen at /home/me/.cargo/zenoh-1.10.2/src/net.rs:123.", "cannot listen."),
            (
                "a at /x/y.rs:1. - Caused by b at c.rs:22:5. - Caused by Address in use (os error 98)",
                "a. - Caused by b. - Caused by Address in use (os error 98)",
            ),
            ("nobody is at tcp/127.0.0.1:7447 at home", "nobody is at tcp/127.0.0.1:7447 at home"),
            ("at /a b.rs:1", "at /a b.rs:1"),
            ("key at é.rs:", "key at é.rs:"),
            ("", ""),
        ] {
            assert_eq!(in_words(message), words);
        }
    }
}
