//! The parts that every program on the emulated board needs: files of the host, a clock that counts instructions, and
//! an end.
#![no_std]

pub mod clock;
pub mod file;

use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};

/// Ends the emulator with success.
pub fn done() -> ! {
    loop {
        debug::exit(EXIT_SUCCESS);
    }
}

/// Prints the reason and ends the emulator with a failure.
pub fn fail(why: &str) -> ! {
    file::say(why);
    loop {
        debug::exit(EXIT_FAILURE);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    fail("the program on the board panicked\n")
}

#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    fail("hard fault on the board\n")
}
