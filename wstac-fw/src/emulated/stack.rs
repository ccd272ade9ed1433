//! The greatest depth of the stack. The runtime paints the stack before anything runs.

use core::ptr::read_volatile;

/// The word that cortex-m-rt paints with.
const PAINT: u32 = 0xCCCC_CCCC;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Returns the bytes from the stack's start to its deepest word that has been written.
pub fn deepest() -> usize {
    let (start, mut word) = (&raw const _stack_start, &raw const _stack_end);
    // SAFETY: the linker's symbols bound memory of the stack, and the program ends below its start.
    while word < start && unsafe { read_volatile(word) } == PAINT {
        word = word.wrapping_add(1);
    }
    start as usize - word as usize
}
