//! The settings in use, of a program whose settings are compiled in.

use embassy_stm32::{Peri, peripherals};
use wstac_core::features::Floor;
use wstac_core::layout::Layout;
use wstac_core::rate::FrameRate;
use wstac_core::trigger::TriggerConfig;
use wstac_core::wire::Request;

use crate::link::Link;
use crate::setup;

/// The settings in use.
pub struct Keeper(Layout);

impl Keeper {
    /// Takes the settings that are compiled in.
    pub fn new(_: Peri<'static, peripherals::FLASH>, layout: Layout, _: FrameRate) -> Self {
        Self(layout)
    }

    /// Returns the layout, the darkness floor and the trigger.
    pub fn parameters(&self) -> (Layout, Floor, TriggerConfig) {
        (self.0, setup::FLOOR, setup::TRIGGER)
    }

    /// Returns no exposure: it is that of the sensor's table.
    pub fn exposure(&self) -> Option<u16> {
        None
    }

    /// Answers no request.
    pub fn answer(&mut self, _: Request, _: &mut Link) {}

    /// Never starts again.
    pub fn restart_if_wanted(&self, _: &Link) {}
}
