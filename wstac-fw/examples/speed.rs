//! Computes an event's sliding speed as well.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::paper::speed;
use wstac_fw::emulated::bench;

#[entry]
fn main() -> ! {
    bench::events(|event| bench::show(speed::speed(event, &bench::DURATIONS)))
}
