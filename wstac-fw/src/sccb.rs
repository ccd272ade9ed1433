//! The registers of a sensor over any I²C.
//!
//! OmniVision's serial camera control bus has registers with addresses of eight bits. It is I²C without the repeated
//! start, and acknowledge has no meaning for a sensor's own bytes. A read is a write of the register's address, a stop,
//! and a read. Other sensors have addresses of 16 bits and a repeated start. Each byte has an address, also in values
//! of two bytes.
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
    /// Sixteen on I²C, and values of two bytes from even addresses on, the high one first.
    Wide,
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

    /// Returns whether registers have two bytes.
    pub fn is_wide(&self) -> bool {
        self.addressing == Addressing::Wide
    }

    /// Reads a register.
    ///
    /// # Errors
    /// Returns the errors of the bus, such as no acknowledge.
    pub fn read(&mut self, register: u16) -> Result<u8, B::Error> {
        let mut values = [0; 2];
        let [high, low] = register.to_be_bytes();
        // Of a register of two bytes, both are read.
        let is_wide = self.addressing == Addressing::Wide;
        let (even, read) = if is_wide { (low & !1, &mut values[..]) } else { (low, &mut values[..1]) };
        if self.addressing == Addressing::Byte {
            self.bus.write(self.address, &[low])?;
            self.bus.read(self.address, read)?;
        } else {
            self.bus.write_read(self.address, &[high, even], read)?;
        }
        Ok(if even == low { values[0] } else { values[1] })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// Returns the errors of the bus, such as no acknowledge.
    pub fn write(&mut self, register: u16, value: u8) -> Result<(), B::Error> {
        let [high, low] = register.to_be_bytes();
        match self.addressing {
            Addressing::Byte => self.bus.write(self.address, &[low, value]),
            Addressing::Word | Addressing::Wide => self.bus.write(self.address, &[high, low, value]),
        }
    }

    /// Writes a value of two bytes, the high one first.
    ///
    /// # Errors
    /// Returns the errors of the bus, such as no acknowledge.
    pub fn write_both(&mut self, register: u16, [first, second]: [u8; 2]) -> Result<(), B::Error> {
        let [high, low] = register.to_be_bytes();
        self.bus.write(self.address, &[high, low, first, second])
    }
}
