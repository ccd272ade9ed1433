//! The firmware of a Nucleo-H743ZI2 with a parallel camera: frames in stripes by DMA, events out of the debugger's
//! serial line. The wiring is in `README.md`.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::Level;
use embassy_stm32::rcc::HseMode;
use wstac_fw::stm32::{self, CameraPins, Crystal, Irqs, Light, SensorBus, SensorClock, Wiring};

/// The debugger's clock of 8 MHz.
const CRYSTAL: Crystal = Crystal::new(8_000_000, HseMode::Bypass, 1, 72);
const BAUD: u32 = 115_200;

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let (p, has_crystal) = stm32::start(CRYSTAL, false);
    let wiring = Wiring {
        // D0 to D7, VSYNC, HREF, PCLK.
        camera: CameraPins::new(p.PC6, p.PC7, p.PC8, p.PC9, p.PE4, p.PD3, p.PE5, p.PE6, p.PB7, p.PA4, p.PA6),
        dcmi: p.DCMI,
        stream: p.DMA1_CH0,
        clock: SensorClock::output(p.MCO1, p.PA8),
        bus: SensorBus::new(p.I2C1, p.PB8, p.PB9, None),
        line: stm32::usart(p.USART3, Irqs, p.PD8, p.PD9, BAUD),
        events: Light::new(p.PB0.into(), Level::High),
        trouble: Light::new(p.PB14.into(), Level::High),
        watchdog: p.IWDG1,
        flash: p.FLASH,
    };
    stm32::run(has_crystal, wiring).await
}
