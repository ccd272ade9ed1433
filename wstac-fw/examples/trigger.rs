//! The trigger too: an event when something has slid over the sensor, with its sample.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_fw::emulated::bench;

#[entry]
fn main() -> ! {
    bench::events(|event| bench::show(event.frame))
}
