//! Measures parts of the signal path on a board that QEMU emulates, next to other software for the same task. Prints
//! one JSON object per line on the console, and writes logarithms to the file `ln`. `tests/firmware/signal_path.py`
//! reads both.
#![no_std]
#![no_main]

mod ln;
mod sums;

use core::fmt::Write;

use cortex_m_rt::entry;
use wstac_core::error::Error;
use wstac_fw::emulated::clock::Clock;
use wstac_fw::emulated::host::{self, Console};

/// The number of rows per stripe.
const ROWS: usize = 8;
/// The bytes that stripes are parts of.
const STRIPE: usize = ROWS * 800;

#[entry]
fn main() -> ! {
    match run() {
        Ok(()) => host::done(),
        Err(_) => host::fail("a camera cannot be set up\n"),
    }
}

fn run() -> Result<(), Error> {
    let Some(clock) = Clock::start() else { return Ok(()) };
    let Some(stripe) = cortex_m::singleton!(: [u8; STRIPE] = [0; STRIPE]) else { return Ok(()) };
    // The bytes are arbitrary, because the cost does not depend on them.
    let mut seed = 1_u32;
    for byte in stripe.iter_mut() {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *byte = (seed >> 24) as u8;
    }
    ln::measure(&clock);
    sums::measure(&clock, stripe)
}

/// Prints how many instructions something took.
fn say(what: &str, of: &str, instructions: f64) {
    let _ = writeln!(Console, "{{\"what\":\"{what}\",\"of\":\"{of}\",\"instructions\":{instructions}}}");
}
