//! The settings in use, and the flash with those that are used after the next start.

use embassy_stm32::{Peri, peripherals};
use wstac_core::features::Floor;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::rate::FrameRate;
use wstac_core::trigger::TriggerConfig;
use wstac_core::wire::{Message, Refusal, Request, Settings, SettingsInUse};

use crate::flash::{BoardFlash, SECTORS};
use crate::link::Link;
use crate::reader::Outlet;
use crate::sensor::LONGEST_EXPOSURE;
use crate::{settings, setup};

/// The cycles for the last two bytes of the line.
const LAST_BYTES: u32 = 20_000;

/// The settings in use, and their memory.
pub struct Keeper {
    flash: BoardFlash,
    size: FrameSize,
    rate: FrameRate,
    settings: Settings,
    layout: Layout,
    /// Whether a host has set them.
    is_set: bool,
    wants_restart: bool,
}

impl Keeper {
    /// Takes the settings that a host has set, if there are any that this program can use, or those compiled in.
    pub fn new(flash: Peri<'static, peripherals::FLASH>, layout: Layout, rate: FrameRate) -> Self {
        let (mut flash, size) = (BoardFlash::new(flash), layout.frame());
        let usable =
            |settings: Settings| Some((settings, settings::check(&settings, size, rate, LONGEST_EXPOSURE).ok()?));
        let kept = settings::load(&mut flash, SECTORS).and_then(usable);
        let compiled_in = (Settings::new(&layout, setup::FLOOR, setup::TRIGGER, None), layout);
        let (settings, layout) = kept.unwrap_or(compiled_in);
        Self { flash, size, rate, settings, layout, is_set: kept.is_some(), wants_restart: false }
    }

    /// Returns the layout, the darkness floor and the trigger.
    pub fn parameters(&self) -> (Layout, Floor, TriggerConfig) {
        (self.layout, self.settings.floor, self.settings.trigger)
    }

    /// Returns the exposure in lines, if it is not that of the sensor's table.
    pub fn exposure(&self) -> Option<u16> {
        self.settings.exposure
    }

    /// Answers requests about settings.
    pub fn answer(&mut self, request: Request, line: &mut Link) {
        let answer = match request {
            Request::Settings => {
                line.send(&Message::Settings(SettingsInUse::new(self.settings, self.is_set)));
                return;
            }
            Request::Set(settings) => self.keep(&settings),
            Request::Forget => settings::keep(&mut self.flash, SECTORS, None),
            _ => return,
        };
        if let Err(refusal) = answer {
            defmt::error!("settings are refused: {}", refusal);
        }
        self.wants_restart |= answer.is_ok();
        line.send(&Message::Set(answer));
    }

    fn keep(&mut self, settings: &Settings) -> Result<(), Refusal> {
        settings::check(settings, self.size, self.rate, LONGEST_EXPOSURE)?;
        settings::keep(&mut self.flash, SECTORS, Some(settings))
    }

    /// Starts again if other settings are kept, and the host has been told.
    pub fn restart_if_wanted(&self, line: &Link) {
        if self.wants_restart && line.is_drained() {
            cortex_m::asm::delay(LAST_BYTES);
            cortex_m::peripheral::SCB::sys_reset();
        }
    }
}
