//! The firmware of an Arduino Nicla Vision (STM32H747) with its GC2145. It runs behind Arduino's bootloader, which
//! stays as it is. Events go out of the header's UART, TX (PA9) and RX (PA10).
//!
//! Public sources, which agree: Zephyr's `boards/arduino/nicla_vision`, OpenMV's `boards/ARDUINO_NICLA_VISION`, and
//! MicroPython's `ports/stm32/boards/ARDUINO_NICLA_VISION`. The supply is the linear regulator in all three, and in
//! Arduino's mbed-os. A chip with the wrong one hangs until power is off.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::Level;
use embassy_stm32::i2c::I2c;
use embassy_stm32::rcc::HseMode;
use wstac_fw::setup;
use wstac_fw::stm32::{self, CameraPins, Crystal, Irqs, Light, SensorBus, SensorClock, Wiring};

/// The oscillator of 25 MHz, which makes 575 MHz instead of 576.
const CRYSTAL: Crystal = Crystal::new(25_000_000, HseMode::Bypass, 2, 46).switched_by_ph1();
const BAUD: u32 = 115_200;
const _: () = assert!(setup::REST == 0, "WSTAC_REST needs an HM01B0; help: unset it");
/// The address of the supply's chip (PF1550), and its registers that switch on 2.8 V, 1.8 V for the camera, 1.8 V, and
/// the header's level.
const SUPPLY: u8 = 0x08;
const SWITCHES: [[u8; 2]; 4] = [[0x4D, 0x01], [0x50, 0x01], [0x53, 0x01], [0x3B, 0x81]];

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let (p, has_crystal) = stm32::start(CRYSTAL, false);
    // They are on unless a program before this one has switched them off. The sensor is silent without them.
    let mut supply = I2c::new_blocking(p.I2C2, p.PF1, p.PF0, Default::default());
    for switch in SWITCHES {
        let _ = supply.blocking_write(SUPPLY, &switch);
    }
    let wiring = Wiring {
        // D0 to D7, VSYNC, HREF, PCLK.
        camera: CameraPins::new(p.PC6, p.PC7, p.PE0, p.PE1, p.PE4, p.PD3, p.PE5, p.PE6, p.PG9, p.PA4, p.PA6),
        dcmi: p.DCMI,
        stream: p.DMA1_CH0,
        clock: SensorClock::timer(p.TIM3, p.PA7),
        bus: SensorBus::new(p.I2C3, p.PA8, p.PC9, None),
        line: stm32::usart(p.USART1, Irqs, p.PA9, p.PA10, BAUD),
        // Green and red of the colored light, which shine while their pins are low.
        events: Light::new(p.PC13.into(), Level::Low),
        trouble: Light::new(p.PE3.into(), Level::Low),
        watchdog: p.IWDG1,
        flash: p.FLASH,
    };
    stm32::run(has_crystal, wiring).await
}
