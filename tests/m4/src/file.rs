//! Files of the host by semihosting, in the directory in which the emulator runs.

use core::mem::size_of_val;

use cortex_m_semihosting::syscall;

/// An open file.
pub struct File(usize);

const READ: usize = 1; // "rb"
const WRITE: usize = 5; // "wb"

impl File {
    /// Opens a file for reading. `name` ends in a zero byte.
    pub fn open(name: &[u8]) -> Self {
        Self::of(name, READ)
    }

    /// Creates a file, or empties an existing one.
    pub fn create(name: &[u8]) -> Self {
        Self::of(name, WRITE)
    }

    fn of(name: &[u8], mode: usize) -> Self {
        // SAFETY: the host reads the name, which lives until the call is over.
        let handle = unsafe { syscall!(OPEN, name.as_ptr() as usize, mode, name.len() - 1) };
        if handle == usize::MAX { crate::fail("a file of the board cannot be opened\n") } else { Self(handle) }
    }

    /// Reads numbers until `numbers` is full. Returns false if the file ends first.
    pub fn read(&self, numbers: &mut [i16]) -> bool {
        // SAFETY: the host writes within the slice; every bit pattern is a number. It answers how many bytes it did not
        // write.
        unsafe { syscall!(READ, self.0, numbers.as_mut_ptr() as usize, size_of_val(numbers)) == 0 }
    }

    /// Appends numbers in little-endian order.
    pub fn write(&self, numbers: &[u32]) {
        // SAFETY: the host reads within the slice, and answers how many bytes it did not read.
        let left = unsafe { syscall!(WRITE, self.0, numbers.as_ptr() as usize, size_of_val(numbers)) };
        if left != 0 {
            crate::fail("a file of the board cannot be written\n");
        }
    }
}

/// Writes text to the emulator's standard error.
pub fn say(text: &str) {
    for character in text.bytes() {
        // SAFETY: the host reads the one byte.
        unsafe { syscall!(WRITEC, &raw const character as usize) };
    }
}
