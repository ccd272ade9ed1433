//! Watches a sensor while its frames are used: a brown-out makes it forget its settings, and automatic controls change
//! registers by themselves.

use embedded_hal::i2c::I2c;

use super::{CameraSensor, Port, SensorError};
use crate::sccb::Registers;

/// The settings that are read back per frame, in turn. All of a table are read within 30 frames.
const PER_FRAME: usize = 2;

/// The position in a table whose settings are read back.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watch {
    next: usize,
}

impl Watch {
    /// Reads back the switches of automatic controls, and the next two settings.
    ///
    /// # Errors
    /// Returns [`SensorError::NotTaken`] if the sensor has another value, or [`SensorError::Bus`].
    pub fn check<B: I2c>(&mut self, sensor: &CameraSensor, bus: &mut B) -> Result<(), SensorError<B::Error>> {
        let mut port = Port(Registers::new(bus, sensor.address, sensor.addressing));
        if let Some(setting) = sensor.table().find(|setting| setting.register == sensor.switches) {
            port.verify(setting)?;
        }
        let mut settings = sensor.table().skip(self.next);
        for _ in 0..PER_FRAME {
            let Some(setting) = settings.next() else {
                self.next = 0;
                break;
            };
            self.next += 1;
            port.verify(setting)?;
        }
        Ok(())
    }
}
