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
    }
}
