//! Helpers of the tests of extremes.

use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::trigger::Trigger;

use crate::OwnedEvent;

/// A dark feature.
pub const DARK: i16 = -8000;
/// A bright feature.
pub const BRIGHT: i16 = 3000;

/// Returns a frame size.
///
/// # Panics
/// If there is no such size.
pub fn size(width: u32, height: u32) -> FrameSize {
    FrameSize::new(width, height).unwrap()
}

/// Returns a layout of 25 taxels of the same place and size.
///
/// # Panics
/// If it leaves the frame.
pub fn stacked(frame: FrameSize, taxel: [u16; 2], corner: [u16; 2]) -> Layout {
    Layout::new(frame, taxel, [corner; 25]).unwrap()
}

/// Returns features with ln `share` (of full scale) in every line, rounded to the nearest.
pub fn feature(share: f64) -> i16 {
    (share.ln() * 2048.0).round() as i16
}

/// Pushes one frame and returns its result.
pub fn push(trigger: &mut Trigger, level: i16) -> Option<OwnedEvent> {
    trigger.push([level; 10], false).map(OwnedEvent::from)
}
