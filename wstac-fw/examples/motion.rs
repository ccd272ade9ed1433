//! Computes an event's motion by coherence.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::paper::trigger::Event;
use wstac_core::touch::motion;
use wstac_fw::emulated::bench;

#[entry]
fn main() -> ! {
    bench::events(answers)
}

// It is a function of its own: within the loop over stripes, the answer would be short of registers.
#[inline(never)]
fn answers(event: &Event<'_>) {
    bench::show(motion::by_coherence(event, bench::MOTION));
}
