//! Camera sensors: what makes each give QVGA at 30 frames a second in a fixed light response, as tables; and the one way in
//! which they are identified and set up.
//!
//! Automatic exposure, gain and white balance, and a gamma curve, would change the features without any touch: every table
//! switches the automatic controls off first and then sets values, and makes gamma a straight line.

pub mod ov7690;
pub mod ov7725;

use core::fmt;

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;
use wstac_core::layout::FrameSize;

use crate::sccb::Sccb;

/// A register and what is written to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Register.
    pub register: u8,
    /// Its value.
    pub value: u8,
}

/// A setting.
const fn set(register: u8, value: u8) -> Setting {
    Setting { register, value }
}

/// Everything that is particular about a sensor.
#[derive(Clone, Copy, Debug)]
pub struct Sensor {
    /// What people call it.
    pub name: &'static str,
    /// 7-bit address on the bus.
    pub address: u8,
    /// The two identity registers, high byte first, and what they hold.
    pub identity: [Setting; 2],
    /// Starts it anew with every register at its default; no acknowledge or value follows.
    pub reset: Setting,
    /// Milliseconds that it needs after that.
    pub reset_ms: u32,
    /// Format, size and rate, then the locks; each is read back.
    pub settings: &'static [&'static [Setting]],
    /// Milliseconds from the last setting to frames that show it.
    pub settle_ms: u32,
    /// Size of its frames.
    pub size: FrameSize,
    /// Signals of its parallel port.
    pub signals: Signals,
}

/// Polarities and order of a parallel port. A camera interface has to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "four lines, each one way or the other")]
pub struct Signals {
    /// VSYNC is high between frames.
    pub vsync_high_between_frames: bool,
    /// HREF is high during a line's pixels.
    pub href_high_in_lines: bool,
    /// Data is to be taken at the rising edge of PCLK.
    pub sample_at_rising_edge: bool,
    /// The first of two bytes is a pixel's luma; the second one is else.
    pub luma_first: bool,
}

/// Why a sensor could not be set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorError<E> {
    /// The bus failed at this register; no acknowledge is a sensor that is not there.
    Bus {
        /// Register that was to be read or written.
        register: u8,
        /// What the bus says.
        error: E,
    },
    /// It is another sensor.
    Identity {
        /// High and low byte found.
        found: u16,
        /// High and low byte expected.
        expected: u16,
    },
    /// A register does not hold what was written to it.
    NotTaken {
        /// The register.
        register: u8,
        /// Value found.
        found: u8,
        /// Value expected.
        expected: u8,
    },
}

impl<E: fmt::Debug> fmt::Display for SensorError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus { register, error } => write!(f, "the bus failed at register {register:#04x}: {error:?}"),
            Self::Identity { found, expected } => write!(f, "the sensor is {found:#06x}, expected {expected:#06x}"),
            Self::NotTaken { register, found, expected } => {
                write!(f, "register {register:#04x} holds {found:#04x}, expected {expected:#04x}")
            }
        }
    }
}

impl Sensor {
    /// Its identity: high and low byte.
    pub fn id(&self) -> u16 {
        let [high, low] = self.identity;
        u16::from_be_bytes([high.value, low.value])
    }

    /// Whether this sensor is there.
    ///
    /// # Errors
    /// [`SensorError::Bus`], [`SensorError::Identity`].
    pub fn identify<B: I2c>(&self, bus: &mut B) -> Result<(), SensorError<B::Error>> {
        let mut port = Port(Sccb::new(bus, self.address));
        let [high, low] = self.identity;
        let found = u16::from_be_bytes([port.read(high.register)?, port.read(low.register)?]);
        if found == self.id() { Ok(()) } else { Err(SensorError::Identity { found, expected: self.id() }) }
    }

    /// Identifies it, resets it and writes its settings, each read back.
    ///
    /// # Errors
    /// All of [`SensorError`]; the sensor may be left half set up, and the next try begins with a reset again.
    pub fn set_up<B: I2c>(&self, bus: &mut B, delay: &mut impl DelayNs) -> Result<(), SensorError<B::Error>> {
        self.identify(bus)?;
        let mut port = Port(Sccb::new(bus, self.address));
        port.write(self.reset)?;
        delay.delay_ms(self.reset_ms);
        for setting in self.settings.iter().copied().flatten() {
            port.write(*setting)?;
            let found = port.read(setting.register)?;
            if found != setting.value {
                return Err(SensorError::NotTaken { register: setting.register, found, expected: setting.value });
            }
        }
        Ok(())
    }
}

/// A bus whose errors name the register.
struct Port<'b, B>(Sccb<'b, B>);

impl<B: I2c> Port<'_, B> {
    fn read(&mut self, register: u8) -> Result<u8, SensorError<B::Error>> {
        self.0.read(register).map_err(|error| SensorError::Bus { register, error })
    }

    fn write(&mut self, Setting { register, value }: Setting) -> Result<(), SensorError<B::Error>> {
        self.0.write(register, value).map_err(|error| SensorError::Bus { register, error })
    }
}

/// 320 × 240.
const QVGA: FrameSize = match FrameSize::new(320, 240) {
    Ok(size) => size,
    Err(_) => panic!("a valid size: decided at compile time"),
};

#[cfg(test)]
mod tests;
