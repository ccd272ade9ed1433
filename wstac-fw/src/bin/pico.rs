//! The firmware of a Raspberry Pi Pico or Pico 2 with an HM01B0: frames in stripes by the PIO, events out of its
//! USB. The wiring is in `README.md`.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_rp::gpio::{Level, Output};
#[cfg(not(feature = "usb"))]
use wstac_fw::rp::RpIrqs;
use wstac_fw::rp::{self, RpBus, RpWiring};
use wstac_fw::stripes::pio::Wires;

/// The data wires of the camera, from GP6 upwards: 1 unless `WSTAC_DATA_WIRES` says 4 or 8.
const DATA_WIRES: u8 = match option_env!("WSTAC_DATA_WIRES") {
    None => 1,
    Some(wires) => match wires.as_bytes() {
        b"" | b"1" => 1,
        b"4" => 4,
        b"8" => 8,
        _ => panic!("WSTAC_DATA_WIRES: expected 1, 4 or 8"),
    },
};
const _: () = assert!(rp::keeps_up(DATA_WIRES), "WSTAC_DATA_WIRES is too low for WSTAC_FPS or WSTAC_MHZ; help: use 8");
#[cfg(not(feature = "usb"))]
const BAUD: u32 = 115_200;

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    #[cfg_attr(not(feature = "usb"), expect(unused_mut, reason = "USB lends a part"))]
    let mut p = rp::start();
    rp::sensor_clock(p.PIN_21);
    let wiring = RpWiring {
        camera: Wires { data: 6, count: DATA_WIRES, pclk: 14, href: 15, vsync: 16 },
        pio: p.PIO0,
        channels: (p.DMA_CH0, p.DMA_CH1),
        // Clock and data.
        bus: RpBus::new(p.I2C0, p.PIN_5, p.PIN_4),
        #[cfg(feature = "usb")]
        line: rp::usb(p.USB, p.FLASH.reborrow(), _spawner),
        #[cfg(not(feature = "usb"))]
        line: rp::uart0(p.UART0, RpIrqs, p.PIN_0, p.PIN_1, BAUD),
        events: Output::new(p.PIN_25, Level::Low),
        trouble: Output::new(p.PIN_22, Level::Low),
        watchdog: p.WATCHDOG,
        flash: p.FLASH,
    };
    rp::run(wiring).await
}
