//! The parts that every program on a board that QEMU emulates needs: a clock that counts instructions, files of the
//! host, a UART, an end.

pub mod bench;
pub mod clock;
pub mod host;
pub mod stack;
pub mod uart;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    host::fail("the program on the board panicked\n")
}

#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    host::fail("hard fault on the board\n")
}
