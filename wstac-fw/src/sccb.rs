//! The registers of a sensor over any I²C.
//!
//! OmniVision's serial camera control bus has registers with addresses of eight bits. It is I²C without the repeated
//! start, and acknowledge has no meaning for a sensor's own bytes. A read is a write of the register's address, a stop,
//! and a read. Other sensors have addresses of 16 bits and a repeated start.
//!
//! An absent sensor shows as an address without acknowledge.

use embedded_hal::i2c::I2c;

/// The bits of the addresses of a sensor's registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Addressing {
    /// Eight, on a bus without a repeated start (SCCB).
    Byte,
    /// Sixteen, the high byte first, on I²C.
    Word,
}

/// The registers of one sensor on a bus.
#[derive(Debug)]
pub struct Registers<'b, B> {
    bus: &'b mut B,
    address: u8,
    addressing: Addressing,
}

impl<'b, B: I2c> Registers<'b, B> {
    /// Creates the registers of the sensor at this 7-bit address.
    pub fn new(bus: &'b mut B, address: u8, addressing: Addressing) -> Self {
        Self { bus, address, addressing }
    }

    /// Returns the 7-bit address of the sensor.
    pub fn address(&self) -> u8 {
        self.address
    }

    /// Reads a register.
    ///
    /// # Errors
    /// Returns the errors of the bus, such as no acknowledge.
    pub fn read(&mut self, register: u16) -> Result<u8, B::Error> {
        let mut value = [0];
        let [high, low] = register.to_be_bytes();
        match self.addressing {
            Addressing::Byte => {
                self.bus.write(self.address, &[low])?;
                self.bus.read(self.address, &mut value)?;
            }
            Addressing::Word => self.bus.write_read(self.address, &[high, low], &mut value)?,
        }
        let [value] = value;
        Ok(value)
    }

    /// Writes a register.
    ///
    /// # Errors
    /// Returns the errors of the bus, such as no acknowledge.
    pub fn write(&mut self, register: u16, value: u8) -> Result<(), B::Error> {
        let [high, low] = register.to_be_bytes();
        match self.addressing {
            Addressing::Byte => self.bus.write(self.address, &[low, value]),
            Addressing::Word => self.bus.write(self.address, &[high, low, value]),
        }
    }
}
