//! Counts instructions. With `-icount shift=0`, one instruction is one nanosecond of the board's time. SysTick runs at
//! 25 MHz, so it ticks every 40 instructions.

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// The instructions per tick.
pub const TICK: u32 = 40;
const TICKS: u32 = 1 << 24;

/// Counts ticks with the board's timer.
pub struct Clock(SYST);

impl Clock {
    /// Starts the timer. Returns `None` if the program has started it already.
    pub fn start() -> Option<Self> {
        let mut timer = Peripherals::take()?.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TICKS - 1);
        timer.clear_current();
        timer.enable_counter();
        Some(Self(timer))
    }

    /// Returns the ticks while `work` runs. It must take less than 2^24 ticks, which are 671 million instructions.
    #[inline(always)]
    pub fn ticks(&self, work: impl FnOnce()) -> u32 {
        let before = SYST::get_current();
        work();
        before.wrapping_sub(SYST::get_current()) % TICKS
    }
}
