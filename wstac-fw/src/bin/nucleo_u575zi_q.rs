//! The firmware of a Nucleo-U575ZI-Q with a parallel camera, on little power: frames in stripes by DMA, events out of
//! the debugger's serial line. The wiring is in `README.md`.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::Level;
use wstac_fw::stm32::{self, CameraPins, Irqs, Light, SensorBus, SensorClock, Wiring};

const BAUD: u32 = 115_200;

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let (p, has_crystal) = stm32::start();
    let wiring = Wiring {
        // D0 to D7, VSYNC, HREF, PCLK.
        camera: CameraPins::new(p.PC6, p.PC7, p.PC8, p.PC9, p.PE4, p.PD3, p.PE5, p.PE6, p.PB7, p.PA4, p.PA6),
        dcmi: p.DCMI,
        stream: p.GPDMA1_CH0,
        clock: SensorClock::output(p.MCO, p.PA8),
        bus: SensorBus::new(p.I2C1, p.PB8, p.PB9, None),
        line: stm32::usart(p.USART1, Irqs, p.PA9, p.PA10, BAUD),
        // The green and the blue light are at pins of the camera. PB0 changes with an event.
        events: Light::new(p.PB0.into(), Level::High),
        trouble: Light::new(p.PG2.into(), Level::High),
        watchdog: p.IWDG,
        flash: p.FLASH,
    };
    stm32::run(has_crystal, wiring).await
}
