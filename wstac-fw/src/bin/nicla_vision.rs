//! The firmware of an Arduino Nicla Vision (STM32H747) with its GC2145. Events go out of its USB. It runs behind
//! Arduino's bootloader, which stays as it is.
//!
//! Public sources, which agree: Zephyr's `boards/arduino/nicla_vision`, OpenMV's `boards/ARDUINO_NICLA_VISION`, and
//! MicroPython's `ports/stm32/boards/ARDUINO_NICLA_VISION`. The supply is the linear regulator in all three, and in
//! Arduino's mbed-os. A chip with the wrong one hangs until power is off. The transceiver's reset,
//! and what the bootloader leaves and requires, come from Arduino's `mcuboot-arduino-stm32h7`.
#![no_std]
#![no_main]

use core::mem;

use embassy_executor::Spawner;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::i2c;
use embassy_stm32::rcc::HseMode;
use wstac_fw::setup;
use wstac_fw::stm32::{self, CameraPins, Crystal, Light, SensorBus, SensorClock, Wiring};

/// The oscillator of 25 MHz, which makes 575 MHz instead of 576.
const CRYSTAL: Crystal = Crystal::new(25_000_000, HseMode::Bypass, 2, 46).switched_by_ph1();
const BAUD: u32 = 115_200;
const _: () = assert!(setup::REST == 0, "WSTAC_REST needs an HM01B0; help: unset it");
/// The address of the supply's chip (PF1550), and its registers that switch on 2.8 V, 1.8 V for the camera, 1.8 V, and
/// the header's level.
const SUPPLY: u8 = 0x08;
const SWITCHES: [[u8; 2]; 4] = [[0x4D, 0x01], [0x50, 0x01], [0x53, 0x01], [0x3B, 0x81]];

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let (p, has_crystal) = stm32::start(CRYSTAL, cfg!(feature = "usb"));
    // They are on unless a program before this one has switched them off. The sensor is silent without them.
    let mut config = i2c::Config::default();
    (config.scl_pullup, config.sda_pullup) = (true, true);
    let mut supply = i2c::I2c::new_blocking(p.I2C2, p.PF1, p.PF0, config);
    for switch in SWITCHES {
        let _ = supply.blocking_write(SUPPLY, &switch);
    }
    // The transceiver of USB runs.
    mem::forget(Output::new(p.PA2, Level::High, Speed::Low));
    let usb = (p.USB_OTG_HS, p.PA5, p.PC2, p.PC3, p.PC0, p.PA3, p.PB0, p.PB1, p.PB10, p.PB11, p.PB12, p.PB13, p.PB5);
    let wiring = Wiring {
        // D0 to D7, VSYNC, HREF, PCLK.
        camera: CameraPins::new(p.PC6, p.PC7, p.PE0, p.PE1, p.PE4, p.PD3, p.PE5, p.PE6, p.PG9, p.PA4, p.PA6),
        dcmi: p.DCMI,
        stream: p.DMA1_CH0,
        clock: SensorClock::timer(p.TIM3, p.PA7),
        bus: SensorBus::new(p.I2C3, p.PA8, p.PC9, None),
        line: stm32::line(spawner, usb, None, (p.USART1, p.PA9, p.PA10, BAUD)),
        // Green and red of the colored light, which shine while their pins are low.
        events: Light::new(p.PC13.into(), Level::Low),
        trouble: Light::new(p.PE3.into(), Level::Low),
        watchdog: p.IWDG1,
        flash: p.FLASH,
    };
    stm32::run(has_crystal, wiring).await
}
