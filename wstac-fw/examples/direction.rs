//! An event's speed and direction: all of the pipeline but textures.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::{direction, speed};
use wstac_fw::emulated::bench;

#[entry]
fn main() -> ! {
    bench::events(|event| {
        bench::show(speed::speed(event, &bench::SPEED));
        bench::show(direction::direction(event));
    })
}
