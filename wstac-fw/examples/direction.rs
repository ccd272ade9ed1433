//! Computes an event's speed and direction: all of the pipeline except textures.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::paper::trigger::Event;
use wstac_core::{paper::direction, paper::speed};
use wstac_fw::emulated::bench;

#[entry]
fn main() -> ! {
    bench::events(answers)
}

// It is a function of its own: within the loop over stripes, both answers would be short of registers.
#[inline(never)]
fn answers(event: &Event<'_>) {
    bench::show(speed::speed(event, &bench::DURATIONS));
    bench::show(direction::direction(event));
}
