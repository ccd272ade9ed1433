//! Colors of light, for terminals with 256 colors and for those without.

use ratatui::style::Color;

use crate::view::state::About;

/// Whether there are colors: those of 256 that every terminal with more than 16 has. Without, shades are characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct Colors(pub(super) bool);

/// Colors from dark to bright: black, greens like the light of the sensor, and white.
const RAMP: [u8; 12] = [16, 22, 22, 28, 28, 34, 40, 76, 112, 155, 193, 230];
/// The color of values above their threshold.
pub(super) const LIT: u8 = 119;
/// The color of thresholds and problems.
pub(super) const WARNING: u8 = 208;
/// The color of values below their threshold.
pub(super) const CALM: u8 = 108;
/// The color of titles and units.
pub(super) const FAINT: u8 = 244;
/// The character version of the scale.
const CHARACTERS: [char; 10] = [' ', '.', ':', '-', '=', '+', '*', '#', '%', '@'];

impl Colors {
    /// Returns what this terminal has by `NO_COLOR`, `COLORTERM` and `TERM`.
    pub(in super::super) fn of(variable: impl Fn(&str) -> Option<String>) -> Self {
        let is = |name: &str, found: &dyn Fn(&str) -> bool| variable(name).is_some_and(|value| found(&value));
        let many = is("TERM", &|term| term.contains("256color") || term.ends_with("-direct"))
            || is("COLORTERM", &|value| value == "truecolor" || value == "24bit");
        Self(many && !is("NO_COLOR", &|value| !value.is_empty()))
    }

    /// Returns the color of light from 0 to 1.
    pub(super) fn light(self, light: f32) -> Color {
        self.one(RAMP[(light.clamp(0.0, 1.0) * 11.999) as usize])
    }

    /// Returns a character as bright as light from 0 to 1, if there are no colors.
    pub(super) fn character(light: f32) -> char {
        CHARACTERS[(light.clamp(0.0, 1.0) * 9.999) as usize]
    }

    /// Returns the color of a text.
    pub(super) fn about(self, about: About) -> Color {
        match about {
            About::Event => self.one(LIT),
            About::Trouble => self.one(WARNING),
            About::Note => self.one(CALM),
        }
    }

    /// Returns a color by its index: that of a kind of text, or a step of the scale.
    pub(super) fn one(self, index: u8) -> Color {
        if self.0 { Color::Indexed(index) } else { Color::Reset }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_terminal_says_what_it_has() {
        for (variables, has_colors) in [
            (&[("TERM", "xterm-256color"), ("COLORTERM", "truecolor")][..], true),
            (&[("TERM", "tmux-256color")], true),
            (&[("TERM", "xterm-256color"), ("NO_COLOR", "")], true),
            (&[("TERM", "xterm-256color"), ("NO_COLOR", "1")], false),
            (&[("TERM", "linux")], false),
            (&[], false),
        ] {
            let of = |name: &str| variables.iter().find(|(own, _)| *own == name).map(|(_, value)| (*value).to_owned());
            assert_eq!(Colors::of(of), Colors(has_colors), "{variables:?}");
        }
        assert_eq!([f32::NAN, -1.0, 2.0].map(|light| Colors(true).light(light)), [16, 16, 230].map(Color::Indexed));
    }
}
