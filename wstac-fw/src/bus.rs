//! Frees a sensor's bus.
//!
//! A reset in the middle of a read leaves the sensor with a bit on the data line. If it is low, no transfer can begin:
//! the sensor waits for clocks that never come. Nine clocks and a stop free it.

/// The bits of a byte and its acknowledge, of which the sensor may have sent any.
const CLOCKS: u32 = 9;

/// The two lines of a bus as pins with open drains.
pub trait Lines {
    /// Drives the clock low, or leaves it to its pull-up, and waits for half a clock.
    fn drive_clock(&self, high: bool);

    /// Drives the data low, or leaves it to its pull-up, and waits for half a clock.
    fn drive_data(&self, high: bool);

    /// Returns whether the data is high.
    fn is_data_high(&self) -> bool;
}

/// Clocks out what the sensor has left to send, and sends a stop. Returns whether the data is high then. Both lines must
/// be left to their pull-ups before.
pub fn free(lines: &impl Lines) -> bool {
    for _ in 0..CLOCKS {
        lines.drive_clock(false);
        lines.drive_clock(true);
        if lines.is_data_high() {
            break;
        }
    }
    // A stop: data rises while the clock is high.
    lines.drive_clock(false);
    lines.drive_data(false);
    lines.drive_clock(true);
    lines.drive_data(true);
    lines.is_data_high()
}
