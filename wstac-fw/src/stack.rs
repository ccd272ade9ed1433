//! The greatest depth of the stack, while the program runs. The runtime paints the stack before anything runs.

use core::ptr::read_volatile;

/// The word that cortex-m-rt paints with.
const PAINT: u32 = 0xCCCC_CCCC;
/// The words below the deepest known one that are looked at: 4 KiB. A variable of a program may stay unwritten, and so
/// painted.
const LOOKED_AT: usize = 1024;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// The deepest word of the stack that is known to have been written.
///
/// Only the words below it are looked at each time, which takes some 5,000 instructions. A function whose unwritten
/// variables take more than 4 KiB may hide what lies below them.
#[derive(Debug)]
pub struct StackDepth {
    deepest: *const u32,
}

impl StackDepth {
    /// Begins at the start of the stack.
    pub(crate) fn new() -> Self {
        Self { deepest: &raw const _stack_start }
    }

    /// Returns the bytes from the start of the stack to its deepest word that has been written.
    #[allow(unsafe_code)]
    pub fn bytes(&mut self) -> u32 {
        let end = &raw const _stack_end;
        let mut word = self.deepest;
        let mut painted = 0;
        while word > end && painted < LOOKED_AT {
            word = word.wrapping_sub(1);
            // SAFETY: the linker's symbols bound memory of the stack, and the word lies between them.
            if unsafe { read_volatile(word) } == PAINT {
                painted += 1;
            } else {
                (self.deepest, painted) = (word, 0);
            }
        }
        (&raw const _stack_start as usize - self.deepest as usize) as u32
    }
}
