//! What stands in for a board in the examples, whose sizes are measured: pixels come from somewhere, answers go somewhere.

use core::hint::black_box;

use crate::setup;

/// Bytes of a stripe: eight rows of 400 pixels.
pub const STRIPE: usize = 8 * 400 * setup::PIXEL_BYTES;

/// The next stripe, in RAM as a DMA would leave it.
pub fn stripe() -> &'static [u8] {
    static mut PIXELS: [u8; STRIPE] = [0; STRIPE];
    // SAFETY: it has so many bytes, and nobody writes them.
    black_box(unsafe { core::slice::from_raw_parts((&raw const PIXELS).cast(), STRIPE) })
}

/// Takes an answer.
pub fn show<T>(answer: T) {
    black_box(answer);
}
