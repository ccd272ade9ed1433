//! Counts instructions. Under `-icount shift=0` one instruction is one nanosecond of the board's time, and SysTick ticks
//! once in 40 of them (25 MHz).

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// Instructions a tick.
pub const TICK: u32 = 40;
const TICKS: u32 = 1 << 24;

/// The board's timer.
pub struct Clock(SYST);

impl Clock {
    /// Starts it; the second one in a program is none.
    pub fn start() -> Option<Self> {
        let mut timer = Peripherals::take()?.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TICKS - 1);
        timer.clear_current();
        timer.enable_counter();
        Some(Self(timer))
    }

    /// Ticks while `work` runs: below 2^24 of them, that is 671 million instructions.
    #[inline(always)]
    pub fn ticks(&self, work: impl FnOnce()) -> u32 {
        let before = SYST::get_current();
        work();
        before.wrapping_sub(SYST::get_current()) % TICKS
    }
}
