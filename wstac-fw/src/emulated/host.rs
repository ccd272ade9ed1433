//! The host, by semihosting: files in the directory that the emulator runs in, standard output, and the end of the
//! program.

use core::fmt::{self, Write};
use core::mem::size_of_val;

use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::{nr, syscall, syscall1};

/// An open file of the host.
pub struct File(usize);

const READ: usize = 1; // "rb"
const WRITE: usize = 5; // "wb"

impl File {
    /// Opens a file to read. `name` ends in a zero byte.
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
        if handle == usize::MAX {
            // SAFETY: the host reads the name, which ends in a zero byte.
            unsafe { syscall1(nr::WRITE0, name.as_ptr() as usize) };
            fail(": the board cannot open this file in the folder that the emulator was started in\n");
        }
        Self(handle)
    }

    /// Reads until `bytes` is full. Returns false if the file ends before.
    pub fn read(&self, bytes: &mut [u8]) -> bool {
        // SAFETY: the host writes within the slice. It returns how many bytes it did not write.
        unsafe { syscall!(READ, self.0, bytes.as_mut_ptr() as usize, bytes.len()) == 0 }
    }

    /// Appends numbers, little-endian.
    pub fn write(&self, numbers: &[i16]) {
        // SAFETY: the host reads within the slice, and returns how many bytes it did not read.
        let left = unsafe { syscall!(WRITE, self.0, numbers.as_ptr() as usize, size_of_val(numbers)) };
        if left != 0 {
            fail("a file of the board cannot be written\n");
        }
    }
}

/// The host's console.
pub struct Console;

impl Write for Console {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.bytes() {
            // SAFETY: the host reads the one byte.
            unsafe { syscall1(nr::WRITEC, &raw const character as usize) };
        }
        Ok(())
    }
}

/// Ends the emulator with success.
pub fn done() -> ! {
    loop {
        debug::exit(EXIT_SUCCESS);
    }
}

/// Prints the reason and ends the emulator with a failure.
pub fn fail(why: &str) -> ! {
    let _ = Console.write_str(why);
    loop {
        debug::exit(EXIT_FAILURE);
    }
}
