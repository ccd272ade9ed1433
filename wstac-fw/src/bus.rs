//! Frees a sensor's bus.
//!
//! A reset in the middle of a read leaves the sensor with a bit on the data line. If it is low, no transfer can begin:
//! the sensor waits for clocks that never come. Nine clocks and a stop free it.

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
