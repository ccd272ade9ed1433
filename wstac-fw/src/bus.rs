//! Frees a sensor's bus.
//!
//! A reset in the middle of a read leaves the sensor with a bit on the data line. If it is low, no transfer can begin:
//! the sensor waits for clocks that never come. Nine clocks and a stop free it.

use wstac_core::wire::BusLines;

/// The bits of a byte and its acknowledge, of which the sensor may have sent any.
const CLOCKS: u32 = 9;

/// Clocks out what the sensor has left to send, and sends a stop. Returns whether the data is high then.
///
/// Both lines are pins with open drains, left to their pull-ups before. `drive` drives one low, or leaves it to its
/// pull-up, and waits for half a clock.
pub fn free<P: Copy>(clock: P, data: P, drive: impl Fn(P, bool), is_high: impl Fn(P) -> bool) -> bool {
    for _ in 0..CLOCKS {
        drive(clock, false);
        drive(clock, true);
        if is_high(data) {
            break;
        }
    }
    // A stop: data rises while the clock is high.
    drive(clock, false);
    drive(data, false);
    drive(clock, true);
    drive(data, true);
    is_high(data)
}

/// Returns what holds the lines while nothing is sent.
///
/// Both lines are pins with open drains, and `drive` is that of [`free`]. `pull` switches the chip's own resistor of a
/// pin to this side, up if it is true.
pub fn lines<P: Copy>(
    clock: P,
    data: P,
    drive: impl Fn(P, bool),
    pull: impl Fn(P, bool),
    is_high: impl Fn(P) -> bool,
) -> BusLines {
    let pulled = |up| {
        for (pin, high) in [(clock, up), (data, up), (data, true), (clock, true)] {
            pull(pin, up);
            // An input of an RP2350 that was high stays so, unless something stronger pulls it down (RP2350-E9).
            drive(pin, high);
        }
        (is_high(clock), is_high(data))
    };
    match pulled(true) {
        (false, false) => BusLines::BothLow,
        (false, true) => BusLines::ClockLow,
        (true, false) => BusLines::DataLow,
        (true, true) if pulled(false) == (true, true) => BusLines::PulledUp,
        (true, true) => BusLines::NotPulledUp,
    }
}
