//! Text from outside that may go to a terminal: names and labels of files, boards, cameras and people.
//!
//! No character of it moves the cursor, changes a color, sets the clipboard, begins a line or turns the direction of
//! writing: those that would are escaped, such as `\u001b`. Inside of JSON an escape means the same character.

use std::borrow::Cow;
use std::fmt::{self, Write};

/// Most bytes of the text of an [`Error`](crate::error::Error).
pub const LONGEST: usize = 1000;

/// Returns whether a character controls a terminal: C0, delete and C1, breaks of lines and paragraphs, and those that
/// turn the direction of writing.
fn is_control(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Returns whether a character belongs to plain text: it neither controls a terminal nor is invisible. The joiners that
/// some scripts need are plain.
pub fn is_plain(c: char) -> bool {
    // The format characters of Unicode (Cf) besides those that control.
    let is_format = matches!(
        u32::from(c),
        0xAD | 0x600..=0x605 | 0x6DD | 0x70F | 0x890..=0x891 | 0x8E2 | 0x180E | 0x200B | 0x2060..=0x206F | 0xFEFF
            | 0xFFF9..=0xFFFB | 0x110BD | 0x110CD | 0x13430..=0x1343F | 0x1BCA0..=0x1BCA3 | 0x1D173..=0x1D17A
            | 0xE0000..=0xE007F
    );
    !is_control(c) && !is_format
}

/// Returns a text of several lines in which no character controls a terminal. Line feeds and tabs stay.
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, |c| is_control(c) && c != '\n' && c != '\t')
}

/// Returns a text that is one line and in which no character controls a terminal. Line feeds are escaped, too.
pub fn line(text: &str) -> Cow<'_, str> {
    escaped(text, is_control)
}

fn escaped(text: &str, controls: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&controls) {
        return text.into();
    }
    let mut clean = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if controls(c) {
            // Writing to a string does not fail.
            let _ = write!(clean, "\\u{:04x}", u32::from(c));
        } else {
            clean.push(c);
        }
    }
    clean.into()
}

/// Returns a text of at most `most` bytes: its start, `…`, and a fourth of the room for its end.
pub fn shortened(text: &str, most: usize) -> Cow<'_, str> {
    if text.len() <= most {
        return text.into();
    }
    let room = most.saturating_sub('…'.len_utf8());
    let (start, end) = (text.floor_char_boundary(room - room / 4), text.ceil_char_boundary(text.len() - room / 4));
    format!("{}…{}", &text[..start], &text[end..]).into()
}

/// Displays a text as [`line()`] returns it.
#[derive(Clone, Copy, Debug)]
pub struct OneLine<T>(pub T);

impl<T: fmt::Display> fmt::Display for OneLine<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Width and precision of the caller hold for the whole text.
        f.pad(&line(&self.0.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_controls_a_terminal_is_escaped() {
        let forged = "a\x1b]52;c;aGk=\x07\nevent at frame 3\r\u{9b}2J\x7f\u{202e}\u{2066}\u{2028}\u{85}\tz";
        assert_eq!(
            line(forged),
            r"a\u001b]52;c;aGk=\u0007\u000aevent at frame 3\u000d\u009b2J\u007f\u202e\u2066\u2028\u0085\u0009z"
        );
        assert_eq!(lines("a\n\tb\r"), "a\n\tb\\u000d");
        // Letters of every kind stay.
        for text in ["", "Saw3, 90° · ½ é ß 工 עברית ‑ … 👍🏽"] {
            assert!(matches!(line(text), Cow::Borrowed(same) if same == text));
        }
        assert_eq!(format!("{:>4}|{:<3}|{}", OneLine("é"), OneLine("ab"), OneLine("\n")), "   é|ab |\\u000a");
        // JSON reads the same character.
        assert_eq!(serde_json::from_str::<String>(&lines("\"a\u{9b}\u{202e}\"")).unwrap(), "a\u{9b}\u{202e}");
    }

    #[test]
    fn long_texts_keep_their_start_and_their_end() {
        assert_eq!(shortened("abcdef", 6), "abcdef");
        assert_eq!(shortened("0123456789abcdefghij", 11), "012345…ij");
        for most in 3..40 {
            let short = shortened("äöüäöüäöüäöüäöüäöüäöü", most);
            assert!(short.len() <= most && short.contains('…'), "{most}: {short}");
        }
    }
}
