//! The settings of a board that a host can change. The board checks them, and keeps them over a reset.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::error::ConfigError;
use crate::features::Floor;
use crate::layout::{FrameSize, Layout};
use crate::paper::trigger::TriggerConfig;
use crate::params::TAXELS;

/// The number of bytes of the longest request, for the decoder of a board that takes settings.
pub const LONGEST_REQUEST: usize = 204;

/// The settings of a board.
///
/// The layout is not checked before it reaches the board, so that the board can refuse it and say why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Settings {
    /// Width and height of the frames that the layout is for.
    pub frame: [u16; 2],
    /// Width and height of a taxel.
    pub taxel: [u16; 2],
    /// Left and top of each taxel, row by row.
    pub corners: [[u16; 2]; TAXELS],
    /// The darkness floor.
    pub floor: Floor,
    /// The parameters that events are found with.
    pub trigger: TriggerConfig,
    /// The exposure in lines of the camera; `None` for that of the firmware.
    pub exposure: Option<u16>,
}

impl Settings {
    /// Creates settings with this layout.
    pub const fn new(layout: &Layout, floor: Floor, trigger: TriggerConfig, exposure: Option<u16>) -> Self {
        let frame = layout.frame();
        let (taxel, corners) = (layout.taxel(), *layout.corners());
        Self { frame: [frame.width(), frame.height()], taxel, corners, floor, trigger, exposure }
    }

    /// Returns the layout in frames of this size.
    ///
    /// # Errors
    /// Returns [`Refusal::Frame`] if it is for frames of another size, and [`Refusal::Layout`] if it is none.
    pub fn layout(&self, size: FrameSize) -> Result<Layout, Refusal> {
        let expected = [size.width(), size.height()];
        if self.frame != expected {
            return Err(Refusal::Frame { found: self.frame, expected });
        }
        Layout::new(size, self.taxel, self.corners).map_err(Refusal::Layout)
    }
}

/// The settings that a board uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SettingsInUse {
    /// The settings.
    pub settings: Settings,
    /// Whether a host has set them. If not, they were compiled in.
    pub set: bool,
}

impl SettingsInUse {
    /// Creates the settings that a board uses.
    pub const fn new(settings: Settings, set: bool) -> Self {
        Self { settings, set }
    }
}

/// The reason why a board does not take settings. It goes on with those that it has.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Refusal {
    /// The layout is for frames of another size.
    Frame {
        /// Width and height found.
        found: [u16; 2],
        /// Width and height expected.
        expected: [u16; 2],
    },
    /// The layout, the floor or the trigger cannot be used.
    Layout(ConfigError),
    /// The exposure is not from 1 line to what a frame has.
    Exposure {
        /// Lines found.
        found: u16,
        /// Most lines expected.
        most: u16,
    },
    /// The memory for settings does not take them.
    Memory,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame { found: [width, height], expected: [wide, high] } => {
                write!(f, "[layout] is for frames of {width} x {height} pixels, expected {wide} x {high}")
            }
            Self::Layout(error) => error.fmt(f),
            Self::Exposure { found, most } => write!(f, "the exposure is {found} lines, expected 1 to {most}"),
            Self::Memory => f.write_str("the board's memory for settings failed"),
        }
    }
}

impl core::error::Error for Refusal {}

#[cfg(test)]
mod tests {
    use std::string::ToString;

    use super::super::tests::{check_read, check_requests};
    use super::super::{Decoder, LONGEST, Message, Request, encode};
    use super::*;
    use crate::paper::trigger::Rule;

    fn settings() -> Settings {
        let layout = Layout::paper(FrameSize::new(16_384, 16_384).unwrap()).unwrap();
        let trigger = TriggerConfig::new(20, 65_535.0, 50, Rule::Signed, 65_535.0).unwrap().one_event_per_touch();
        let corners = [[u16::MAX; 2]; 25];
        Settings { corners, ..Settings::new(&layout, Floor::new(1.0, u32::MAX).unwrap(), trigger, Some(u16::MAX)) }
    }

    #[test]
    fn settings_of_another_frame_or_without_a_layout_are_refused() {
        let size = FrameSize::new(320, 240).unwrap();
        let layout = Layout::paper(size).unwrap();
        let right = Settings::new(&layout, Floor::new(1.0, 255).unwrap(), TriggerConfig::default(), None);
        assert_eq!(right.layout(size), Ok(layout));
        let other = FrameSize::new(240, 320).unwrap();
        let refused = right.layout(other).unwrap_err();
        assert_eq!(refused.to_string(), "[layout] is for frames of 320 x 240 pixels, expected 240 x 320");
        let mut outside = right;
        outside.corners[24] = [320, 0];
        assert!(matches!(outside.layout(size), Err(Refusal::Layout(ConfigError::TaxelOutside { taxel: 24, .. }))));
        assert_eq!(Refusal::Exposure { found: 0, most: 500 }.to_string(), "the exposure is 0 lines, expected 1 to 500");
        assert_eq!(Refusal::Memory.to_string(), "the board's memory for settings failed");
    }

    #[test]
    fn the_longest_settings_fit_a_request_and_are_read_as_they_were_written() {
        let bytes = encode(&Request::Set(settings()), u16::MAX, &mut [0; LONGEST]).to_vec();
        let mut decoder = Decoder::<LONGEST_REQUEST>::new();
        let mut found = bytes.iter().filter_map(|&byte| decoder.push::<Request>(byte).map(Result::unwrap));
        assert_eq!(found.next().unwrap().message, Request::Set(settings()));
        assert!(bytes.len() > LONGEST_REQUEST - 8, "{}", bytes.len());
    }

    #[test]
    fn answers_are_read_as_they_were_written() {
        let refused = settings().layout(FrameSize::new(320, 240).unwrap()).unwrap_err();
        check_read(&Message::Settings(SettingsInUse::new(settings(), true)));
        for answer in [Ok(()), Err(refused), Err(Refusal::Memory)] {
            check_read(&Message::Set(answer));
        }
    }

    #[test]
    fn the_numbers_of_these_messages_are_the_last_ones() {
        let requests = [Request::Time { host_us: 0 }, Request::Settings, Request::Set(settings()), Request::Forget];
        let last = check_requests(&requests);
        assert_eq!(last, [last[0], last[0] + 1, last[0] + 2, last[0] + 3]);
    }
}
