//! Frees a sensor's bus.
//!
//! A reset in the middle of a read leaves the sensor with a bit on the data line. If it is low, no transfer can begin:
//! the sensor waits for clocks that never come. Nine clocks and a stop free it.

/// The bits of a byte and its acknowledge, of which the sensor may have sent any.
const CLOCKS: u32 = 9;

/// Clocks out what the sensor has left to send, and sends a stop. Returns whether the data is high then.
///
/// Both lines are pins with open drains, left to their pull-ups before. `drive_clock` and `drive_data` drive them low, or
/// leave them to their pull-ups, and wait for half a clock.
pub fn free(drive_clock: impl Fn(bool), drive_data: impl Fn(bool), is_data_high: impl Fn() -> bool) -> bool {
    for _ in 0..CLOCKS {
        drive_clock(false);
        drive_clock(true);
        if is_data_high() {
            break;
        }
    }
    // A stop: data rises while the clock is high.
    drive_clock(false);
    drive_data(false);
    drive_clock(true);
    drive_data(true);
    is_data_high()
}
