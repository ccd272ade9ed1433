//! How deep the stack has been: the runtime paints it before anything runs.

use core::ptr::read_volatile;

/// What cortex-m-rt paints with.
const PAINT: u32 = 0xCCCC_CCCC;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Bytes from the stack's start to its deepest word that has been written.
pub fn deepest() -> usize {
    let (start, mut word) = (&raw const _stack_start, &raw const _stack_end);
    // SAFETY: the linker's symbols bound memory that is the stack's, and the program ends below its start.
    while word < start && unsafe { read_volatile(word) } == PAINT {
        word = word.wrapping_add(1);
    }
    start as usize - word as usize
}
