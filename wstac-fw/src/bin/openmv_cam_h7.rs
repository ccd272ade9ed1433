//! The firmware of an OpenMV Cam H7 with its OV7725 or MT9M114. Events go out of its USB. It runs behind the camera's
//! bootloader, which stays as it is.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::Level;
use embassy_stm32::rcc::HseMode;
use wstac_fw::setup;
use wstac_fw::stm32::{self, CameraPins, Crystal, Light, SensorBus, SensorClock, SensorPower, Wiring};

/// The crystal of 12 MHz.
const CRYSTAL: Crystal = Crystal::new(12_000_000, HseMode::Oscillator, 1, 48);
const BAUD: u32 = 115_200;
const _: () = assert!(setup::REST == 0, "WSTAC_REST needs an HM01B0; help: unset it");

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let (p, has_crystal) = stm32::start(CRYSTAL, cfg!(feature = "usb"));
    let wiring = Wiring {
        // D0 to D7, VSYNC, HREF, PCLK.
        camera: CameraPins::new(p.PC6, p.PC7, p.PE0, p.PE1, p.PE4, p.PB6, p.PE5, p.PE6, p.PB7, p.PA4, p.PA6),
        dcmi: p.DCMI,
        stream: p.DMA1_CH0,
        clock: SensorClock::output(p.MCO1, p.PA8),
        bus: SensorBus::new(p.I2C1, p.PB8, p.PB9, Some(SensorPower::new(p.PD7.into(), Some(p.PA10.into())))),
        line: stm32::line(
            spawner,
            (p.USB_OTG_FS, p.PA12, p.PA11),
            Some(stm32::OPENMV_BOOTLOADER),
            (p.USART3, p.PB10, p.PB11, BAUD),
        ),
        // Green and red of the colored light, which shine while their pins are low.
        events: Light::new(p.PC1.into(), Level::Low),
        trouble: Light::new(p.PC0.into(), Level::Low),
        watchdog: p.IWDG1,
        flash: p.FLASH,
    };
    stm32::run(has_crystal, wiring).await
}
