//! The meaning of keys.

use ratatui::crossterm::event::{Event, KeyCode, KeyEventKind, KeyModifiers};

/// A request of the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// End the program.
    Quit,
    /// Gather a new baseline.
    Rezero,
    /// Start or end a recording.
    Record,
    /// Pause or continue.
    Pause,
    /// Go back or forth by so many seconds.
    Seek(i64),
    /// Pause, and go back or forth by so many frames.
    Step(i64),
    /// Go to the first frame.
    Start,
    /// Show the next of several sensors alone, and all of them after the last.
    Next,
    /// Show the sensor before alone.
    Previous,
    /// Show the sensor with this number alone, from 1 on; if it is shown, show all again.
    Choose(usize),
    /// Show or hide the help.
    Help,
}

/// Returns what an event of the terminal means, or `None` if it means nothing.
pub(super) fn key(event: &Event) -> Option<Key> {
    let Event::Key(key) = event else { return None };
    if key.kind == KeyEventKind::Release {
        return None;
    }
    Some(match key.code {
        // In raw mode, Ctrl-C is a key and no signal.
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Key::Quit,
        KeyCode::Char('q' | 'Q') | KeyCode::Esc => Key::Quit,
        KeyCode::Char('z' | 'Z') => Key::Rezero,
        KeyCode::Char('r' | 'R') => Key::Record,
        KeyCode::Char(' ') => Key::Pause,
        KeyCode::Left => Key::Seek(-1),
        KeyCode::Right => Key::Seek(1),
        KeyCode::PageUp | KeyCode::Down => Key::Seek(-10),
        KeyCode::PageDown | KeyCode::Up => Key::Seek(10),
        KeyCode::Char('.') => Key::Step(1),
        KeyCode::Char(',') => Key::Step(-1),
        KeyCode::Home | KeyCode::Char('0') => Key::Start,
        KeyCode::Tab => Key::Next,
        KeyCode::BackTab => Key::Previous,
        KeyCode::Char(digit @ '1'..='9') => Key::Choose(digit as usize - '0' as usize),
        KeyCode::Char('?' | 'h') => Key::Help,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use ratatui::crossterm::event::KeyEvent;

    use super::*;

    #[test]
    fn keys_with_and_without_capitals() {
        let pressed = |code| key(&Event::Key(KeyEvent::new(code, KeyModifiers::NONE)));
        for (code, expected) in [('r', Key::Record), ('R', Key::Record), ('z', Key::Rezero), ('q', Key::Quit)] {
            assert_eq!(pressed(KeyCode::Char(code)), Some(expected));
        }
        assert_eq!(pressed(KeyCode::Char('x')), None);
        for (code, expected) in [
            (KeyCode::Left, Key::Seek(-1)),
            (KeyCode::Right, Key::Seek(1)),
            (KeyCode::Up, Key::Seek(10)),
            (KeyCode::Char('.'), Key::Step(1)),
            (KeyCode::Char(','), Key::Step(-1)),
            (KeyCode::Home, Key::Start),
            (KeyCode::Char('0'), Key::Start),
            (KeyCode::Tab, Key::Next),
            (KeyCode::Char('9'), Key::Choose(9)),
        ] {
            assert_eq!(pressed(code), Some(expected));
        }
    }
}
