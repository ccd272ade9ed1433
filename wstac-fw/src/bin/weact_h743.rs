//! The firmware of a WeAct MiniSTM32H743 with a camera in its socket. Events go out of its USB. The boot loader is that
//! of the chip's ROM.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::Level;
use embassy_stm32::rcc::HseMode;
use wstac_fw::stm32::{self, CameraPins, Crystal, Light, SensorBus, SensorClock, SensorPower, Wiring};

/// The crystal of 25 MHz, which makes 575 MHz instead of 576.
const CRYSTAL: Crystal = Crystal::new(25_000_000, HseMode::Oscillator, 2, 46);
const BAUD: u32 = 115_200;

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let (p, has_crystal) = stm32::start(CRYSTAL, cfg!(feature = "usb"));
    let wiring = Wiring {
        // D0 to D7, VSYNC, HREF, PCLK.
        camera: CameraPins::new(p.PC6, p.PC7, p.PE0, p.PE1, p.PE4, p.PD3, p.PE5, p.PE6, p.PB7, p.PA4, p.PA6),
        dcmi: p.DCMI,
        stream: p.DMA1_CH0,
        clock: SensorClock::output(p.MCO1, p.PA8),
        bus: SensorBus::new(p.I2C1, p.PB8, p.PB9, Some(SensorPower::new(p.PA7.into(), None))),
        line: stm32::line(spawner, (p.USB_OTG_FS, p.PA12, p.PA11), None, (p.USART3, p.PB10, p.PB11, BAUD)),
        // The board has one light, which is blue. PB12 is high after a problem.
        events: Light::new(p.PE3.into(), Level::High),
        trouble: Light::new(p.PB12.into(), Level::High),
        watchdog: p.IWDG1,
        flash: p.FLASH,
    };
    stm32::run(has_crystal, wiring).await
}
