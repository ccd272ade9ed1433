//! The sensor's bus: I2C0, and its two lines as pins.

use embassy_rp::i2c::{self, AbortReason, Blocking, I2c, SclPin, SdaPin};
use embassy_rp::pac::{IO_BANK0, PADS_BANK0, SIO};
use embassy_rp::{Peri, peripherals};
use embedded_hal::i2c::{ErrorType, Operation};
use wstac_core::wire::BusLines;

use crate::bus;
use crate::node::Bus;
use crate::setup;

/// The cycles of half a clock, 5 µs.
const HALF: u32 = 5 * setup::MHZ;
/// The functions of a pin: I²C, and the core's own.
const I2C: u8 = 3;
const CORE: u8 = 5;

/// The bus.
pub struct RpBus {
    i2c: I2c<'static, peripherals::I2C0, Blocking>,
    /// The numbers of the pins.
    scl: u8,
    sda: u8,
}

impl RpBus {
    /// Starts the bus at 100 kHz.
    pub fn new(
        peripheral: Peri<'static, peripherals::I2C0>,
        scl: Peri<'static, impl SclPin<peripherals::I2C0>>,
        sda: Peri<'static, impl SdaPin<peripherals::I2C0>>,
    ) -> Self {
        let (clock, data) = (scl.pin(), sda.pin());
        Self { i2c: I2c::new_blocking(peripheral, scl, sda, i2c::Config::default()), scl: clock, sda: data }
    }

    /// Returns an error if something holds a line. A transfer would wait for it.
    fn check(&self) -> Result<(), i2c::Error> {
        let is_free = is_high(self.scl) && is_high(self.sda);
        if is_free { Ok(()) } else { Err(i2c::Error::Abort(AbortReason::ArbitrationLoss)) }
    }

    /// Lends the lines as pins, which are high at first.
    fn with_pins<T>(&mut self, work: impl FnOnce(u8, u8) -> T) -> T {
        let Self { scl, sda, .. } = *self;
        for pin in [scl, sda] {
            drive(pin, true);
            IO_BANK0.gpio(usize::from(pin)).ctrl().modify(|w| w.set_funcsel(CORE));
        }
        let done = work(scl, sda);
        for pin in [scl, sda] {
            IO_BANK0.gpio(usize::from(pin)).ctrl().modify(|w| w.set_funcsel(I2C));
        }
        done
    }
}

impl ErrorType for RpBus {
    type Error = i2c::Error;
}

impl embedded_hal::i2c::I2c for RpBus {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), i2c::Error> {
        self.check()?;
        self.i2c.transaction(address, operations)
    }

    fn write_read(&mut self, address: u8, write: &[u8], read: &mut [u8]) -> Result<(), i2c::Error> {
        self.check()?;
        self.i2c.blocking_write_read(address, write, read)
    }
}

impl Bus for RpBus {
    fn free(&mut self) -> bool {
        !is_high(self.sda) && self.with_pins(|scl, sda| bus::free(scl, sda, drive_and_wait, is_high))
    }

    fn lines(&mut self) -> BusLines {
        self.with_pins(|scl, sda| {
            let lines = bus::lines(scl, sda, drive_and_wait, pull, is_high);
            for pin in [scl, sda] {
                pull(pin, true);
            }
            lines
        })
    }

    // The modules have no line for it.
    async fn restart_sensor(&mut self, _: u32) {}
}

fn is_high(pin: u8) -> bool {
    SIO.gpio_in(0).read() & 1 << pin != 0
}

/// Drives a pin low, or leaves it to its pull-up: the bus has open drains.
fn drive(pin: u8, high: bool) {
    SIO.gpio_out(0).value_clr().write_value(1 << pin);
    if high {
        SIO.gpio_oe(0).value_clr().write_value(1 << pin);
    } else {
        SIO.gpio_oe(0).value_set().write_value(1 << pin);
    }
}

/// Switches the chip's resistor of a pin to this side. While the bus is used, it pulls up.
fn pull(pin: u8, up: bool) {
    PADS_BANK0.gpio(usize::from(pin)).modify(|w| {
        w.set_pue(up);
        w.set_pde(!up);
    });
}

fn drive_and_wait(pin: u8, high: bool) {
    drive(pin, high);
    cortex_m::asm::delay(HALF);
}
