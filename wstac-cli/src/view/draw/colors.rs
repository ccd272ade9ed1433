//! Colors of light, for terminals with many colors, few or none.

use ratatui::style::Color;

/// The number of colors of a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Colors {
    /// No colors, because the terminal has none or the user wants none: shades are characters.
    None,
    /// 16 colors.
    Few,
    /// 256 colors.
    Many,
    /// Colors of 24 bits.
    True,
}

/// Colors from dark to bright: black, greens like the light of the sensor, and white. Their brightness grows in even
/// steps.
const RAMP: [[u8; 3]; 6] = [[0, 0, 0], [0, 52, 28], [0, 104, 46], [22, 164, 60], [128, 216, 92], [250, 255, 214]];
/// The 16-color version of the scale.
const FEW: [Color; 5] = [Color::Black, Color::DarkGray, Color::Green, Color::LightGreen, Color::White];
/// The character version of the scale.
const CHARACTERS: [char; 10] = [' ', '.', ':', '-', '=', '+', '*', '#', '%', '@'];

impl Colors {
    /// Returns what this terminal has by `NO_COLOR`, `COLORTERM` and `TERM`.
    pub(in super::super) fn of(variable: impl Fn(&str) -> Option<String>) -> Self {
        let is = |name: &str, found: &dyn Fn(&str) -> bool| variable(name).is_some_and(|value| found(&value));
        if is("NO_COLOR", &|value| !value.is_empty()) || is("TERM", &|term| term == "dumb" || term.starts_with("vt")) {
            Self::None
        } else if is("COLORTERM", &|value| value == "truecolor" || value == "24bit")
            || is("TERM", &|term| term.ends_with("-direct"))
        {
            Self::True
        } else if is("TERM", &|term| term.contains("256color")) {
            Self::Many
        } else {
            Self::Few
        }
    }

    /// Returns the color of light from 0 to 1.
    pub(super) fn light(self, light: f32) -> Color {
        let light = if light.is_finite() { light.clamp(0.0, 1.0) } else { 0.0 };
        if self == Self::Few {
            return FEW[(light * 4.999) as usize];
        }
        let place = light * (RAMP.len() - 1) as f32;
        let below = (place as usize).min(RAMP.len() - 2);
        let mixed = |k: usize| {
            let [low, high] = [RAMP[below][k], RAMP[below + 1][k]].map(f32::from);
            (low + (high - low) * (place - below as f32)).round() as u8
        };
        self.color([mixed(0), mixed(1), mixed(2)])
    }

    /// Returns the nearest color that the terminal has.
    fn color(self, [r, g, b]: [u8; 3]) -> Color {
        if self == Self::True {
            return Color::Rgb(r, g, b);
        }
        // The cube of 256 colors has steps at 0, 95, 135, 175, 215 and 255.
        let step = |value: u8| if value < 48 { 0 } else { value.saturating_sub(35) / 40 };
        Color::Indexed(16 + 36 * step(r) + 6 * step(g) + step(b))
    }

    /// Returns a character as bright as light from 0 to 1, if there are no colors.
    pub(super) fn character(light: f32) -> char {
        CHARACTERS[(light.clamp(0.0, 1.0) * 9.999) as usize]
    }

    /// Returns the color of the outlines of taxels.
    pub(super) fn outline(self) -> Color {
        self.one_of([60, 80, 130], Color::Blue)
    }

    /// Returns the color of thresholds and problems.
    pub(super) fn warning(self) -> Color {
        self.one_of([235, 140, 60], Color::LightRed)
    }

    /// Returns the color of values above their threshold.
    pub(super) fn lit(self) -> Color {
        self.one_of([150, 230, 110], Color::LightGreen)
    }

    /// Returns the color of values below their threshold.
    pub(super) fn calm(self) -> Color {
        self.one_of([120, 150, 140], Color::Gray)
    }

    /// Returns the color of titles and units.
    pub(super) fn faint(self) -> Color {
        self.one_of([130, 130, 130], Color::DarkGray)
    }

    fn one_of(self, many: [u8; 3], few: Color) -> Color {
        match self {
            Self::None => Color::Reset,
            Self::Few => few,
            Self::Many | Self::True => self.color(many),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(variables: &[(&str, &str)]) -> Colors {
        Colors::of(|name| variables.iter().find(|(own, _)| *own == name).map(|(_, value)| (*value).to_owned()))
    }

    #[test]
    fn a_terminal_says_what_it_has() {
        assert_eq!(of(&[("TERM", "xterm-256color"), ("COLORTERM", "truecolor")]), Colors::True);
        assert_eq!(of(&[("TERM", "tmux-256color")]), Colors::Many);
        assert_eq!(of(&[("TERM", "linux")]), Colors::Few);
        assert_eq!(of(&[]), Colors::Few);
        assert_eq!(of(&[("TERM", "dumb")]), Colors::None);
        assert_eq!(of(&[("TERM", "xterm-256color"), ("NO_COLOR", "1")]), Colors::None);
        assert_eq!(of(&[("TERM", "xterm-256color"), ("NO_COLOR", "")]), Colors::Many);
    }

    #[test]
    fn more_light_is_never_darker() {
        let brightness = |light: f32| match Colors::True.light(light) {
            Color::Rgb(r, g, b) => 0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b),
            other => panic!("{other:?}"),
        };
        for step in 1..=100_u8 {
            let light = f32::from(step) / 100.0;
            assert!(brightness(light) >= brightness(light - 0.01), "at {light}");
        }
        assert_eq!([f32::NAN, -1.0].map(|light| Colors::Few.light(light)), [Color::Black; 2]);
        assert_eq!(Colors::Many.light(1.0), Color::Indexed(230));
    }
}
