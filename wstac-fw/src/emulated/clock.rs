//! Counts instructions.
//!
//! Under `-icount shift=0` an instruction takes a nanosecond of the board's time. The number of instructions per tick
//! of SysTick depends on the board's clock. So it is measured with a known number of instructions.

use core::arch::asm;

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

const TICKS: u32 = 1 << 24;
/// The iterations of a loop of two instructions.
const KNOWN: u32 = 1 << 20;

/// A counter of instructions, on the board's timer.
pub struct Clock {
    /// The ticks of 2 · `KNOWN` instructions.
    known: u32,
}

impl Clock {
    /// Starts a timer that no code reads. When it wraps, the emulator checks whether bytes have arrived; otherwise it
    /// sleeps on its sockets.
    pub fn tick() {
        if let Some(mut board) = Peripherals::take() {
            board.SYST.set_clock_source(SystClkSource::Core);
            board.SYST.set_reload(1 << 14);
            board.SYST.clear_current();
            board.SYST.enable_counter();
        }
    }

    /// Starts the clock. Returns `None` the second time in a program.
    pub fn start() -> Option<Self> {
        let mut timer = Peripherals::take()?.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TICKS - 1);
        timer.clear_current();
        timer.enable_counter();
        let mut clock = Self { known: 0 };
        clock.known = clock
            .ticks(|| {
                // SAFETY: the code counts a register down.
                unsafe { asm!("2: subs {0}, #1", "bne 2b", inout(reg) KNOWN => _) };
            })
            .0;
        Some(clock)
    }

    /// Returns the ticks while `work` runs, below 2^24 of them, and the result of `work`.
    #[inline(always)]
    pub fn ticks<T>(&self, work: impl FnOnce() -> T) -> (u32, T) {
        let before = SYST::get_current();
        let result = work();
        (before.wrapping_sub(SYST::get_current()) % TICKS, result)
    }

    /// Returns the instructions of this many ticks.
    pub fn instructions(&self, ticks: u64) -> u64 {
        (ticks * u64::from(2 * KNOWN)).checked_div(u64::from(self.known)).unwrap_or(0)
    }
}
