//! What parts of the signal path take on a board that QEMU emulates, beside what else could do the same: a line of JSON each to the
//! console, logarithms into the file `ln` (tests/firmware/signal_path.py).
#![no_std]
#![no_main]

mod frames;
mod ln;
mod sums;

use core::fmt::Write;

use cortex_m_rt::entry;
use wstac_core::error::Error;
use wstac_fw::emulated::clock::Clock;
use wstac_fw::emulated::host::{self, Console};

/// Rows that come at a time.
const ROWS: usize = 8;
/// The widest frame.
const WIDEST: usize = 800;
/// Bytes of a stripe of the widest frame.
const STRIPE: usize = ROWS * WIDEST;

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
    // Bytes by chance: nothing depends on them.
    let mut seed = 1_u32;
    for byte in stripe.iter_mut() {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *byte = (seed >> 24) as u8;
    }
    ln::measure(&clock);
    sums::measure(&clock, stripe)?;
    frames::measure(&clock, stripe)
}

/// Says how many instructions something took.
fn say(what: &str, of: &str, instructions: f64) {
    let _ = writeln!(Console, "{{\"what\":\"{what}\",\"of\":\"{of}\",\"instructions\":{instructions}}}");
}
