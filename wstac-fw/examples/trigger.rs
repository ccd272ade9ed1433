//! Runs the trigger as well: an event, with its sample, if something has slid over the sensor.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_fw::emulated::bench;

#[entry]
fn main() -> ! {
    bench::events(|event| bench::show(event.frame))
}
