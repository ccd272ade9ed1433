//! OmniVision's serial camera control bus over any I²C, with registers of eight bits.
//!
//! It is I²C without the repeated start, and acknowledge has no meaning for a sensor's own bytes. A read is a write of
//! the register's address, a stop, and a read. An absent sensor shows as an address without acknowledge.

use embedded_hal::i2c::I2c;

/// One sensor on a bus.
#[derive(Debug)]
pub struct Sccb<'b, B> {
    bus: &'b mut B,
    address: u8,
}

impl<'b, B: I2c> Sccb<'b, B> {
    /// Creates the bus to the sensor at this 7-bit address.
    pub fn new(bus: &'b mut B, address: u8) -> Self {
        Self { bus, address }
    }

    /// Reads a register.
    ///
    /// # Errors
    /// Returns the errors of the bus, such as no acknowledge.
    pub fn read(&mut self, register: u8) -> Result<u8, B::Error> {
        let mut value = [0];
        self.bus.write(self.address, &[register])?;
        self.bus.read(self.address, &mut value)?;
        let [value] = value;
        Ok(value)
    }

    /// Writes a register.
    ///
    /// # Errors
    /// Returns the errors of the bus, such as no acknowledge.
    pub fn write(&mut self, register: u8, value: u8) -> Result<(), B::Error> {
        self.bus.write(self.address, &[register, value])
    }
}
