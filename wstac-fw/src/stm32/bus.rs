//! The sensor's bus: an I2C, its two lines as pins, and the lines that switch the sensor.

use embassy_stm32::gpio::{AnyPin, Level, Output, PinNumber, Speed};
use embassy_stm32::i2c::{self, I2c, Master, SclPin, SdaPin};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::{Idr, Moder, Ot, Pupdr};
use embassy_stm32::pac::i2c::I2c as Interface;
use embassy_stm32::pac::{GPIOA, GPIOB, GPIOC, GPIOD, GPIOE, GPIOF, GPIOG, GPIOH, I2C1, I2C3};
use embassy_stm32::{Peri, peripherals};
use embassy_time::{Duration, Timer};
use embedded_hal::i2c::{ErrorType, Operation};
use wstac_core::wire::BusLines;

use super::chip::MHZ;
use crate::bus;
use crate::node::Bus;

/// The ports of pins, by number.
const PORTS: [Gpio; 8] = [GPIOA, GPIOB, GPIOC, GPIOD, GPIOE, GPIOF, GPIOG, GPIOH];
/// The time that a sensor is held in reset.
const RESET: Duration = Duration::from_millis(10);
/// The cycles of half a clock: 6.7 µs.
const HALF: u32 = MHZ * 20 / 3;

/// An I2C with which a sensor's bus can be.
pub trait SensorInterface: i2c::Instance {
    /// Its registers.
    const REGISTERS: Interface;
}

impl SensorInterface for peripherals::I2C1 {
    const REGISTERS: Interface = I2C1;
}

impl SensorInterface for peripherals::I2C3 {
    const REGISTERS: Interface = I2C3;
}

/// The bus.
pub struct SensorBus {
    i2c: I2c<'static, Blocking, Master>,
    registers: Interface,
    scl: Pin,
    sda: Pin,
    power: Option<SensorPower>,
}

/// The lines that switch a sensor: it runs while the first is low and the second, if there is one, is high.
pub struct SensorPower {
    power_down: Output<'static>,
    reset: Option<Output<'static>>,
}

impl SensorPower {
    /// Takes the lines, and switches the sensor off.
    pub fn new(power_down: Peri<'static, AnyPin>, reset: Option<Peri<'static, AnyPin>>) -> Self {
        Self {
            power_down: Output::new(power_down, Level::High, Speed::Low),
            reset: reset.map(|reset| Output::new(reset, Level::Low, Speed::Low)),
        }
    }
}

impl SensorBus {
    /// Starts the bus at 100 kHz.
    pub fn new<I: SensorInterface>(
        peripheral: Peri<'static, I>,
        scl: Peri<'static, impl SclPin<I>>,
        sda: Peri<'static, impl SdaPin<I>>,
        power: Option<SensorPower>,
    ) -> Self {
        let (clock, data) = (Pin::of(scl.port(), scl.pin()), Pin::of(sda.port(), sda.pin()));
        let mut config = i2c::Config::default();
        // Three transfers are made between two stripes. One of six bytes takes 570 µs.
        config.timeout = Duration::from_micros(700);
        let i2c = I2c::new_blocking(peripheral, scl, sda, config);
        Self { i2c, registers: I::REGISTERS, scl: clock, sda: data, power }
    }

    /// Lends the lines as pins with open drains, which are high at first.
    fn with_pins<T>(&mut self, work: impl FnOnce(Pin, Pin) -> T) -> T {
        let Self { scl, sda, .. } = *self;
        for pin in [scl, sda] {
            pin.drive(true);
            pin.port.otyper().modify(|w| w.set_ot(pin.number, Ot::OPEN_DRAIN));
            pin.port.moder().modify(|w| w.set_moder(pin.number, Moder::OUTPUT));
        }
        let done = work(scl, sda);
        for pin in [scl, sda] {
            pin.port.moder().modify(|w| w.set_moder(pin.number, Moder::ALTERNATE));
        }
        // The interface forgets what it has seen of these clocks.
        self.registers.cr1().modify(|w| w.set_pe(false));
        wait();
        self.registers.cr1().modify(|w| w.set_pe(true));
        done
    }
}

impl ErrorType for SensorBus {
    type Error = i2c::Error;
}

impl embedded_hal::i2c::I2c for SensorBus {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), i2c::Error> {
        self.i2c.transaction(address, operations)
    }

    fn read(&mut self, address: u8, bytes: &mut [u8]) -> Result<(), i2c::Error> {
        self.i2c.blocking_read(address, bytes)
    }

    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), i2c::Error> {
        self.i2c.blocking_write(address, bytes)
    }
}

impl Bus for SensorBus {
    fn free(&mut self) -> bool {
        !self.sda.is_high() && self.with_pins(|scl, sda| bus::free(scl, sda, Pin::drive_and_wait, Pin::is_high))
    }

    fn lines(&mut self) -> BusLines {
        let pull = |pin: Pin, up| pin.pull(if up { Pupdr::PULL_UP } else { Pupdr::PULL_DOWN });
        self.with_pins(|scl, sda| {
            let lines = bus::lines(scl, sda, Pin::drive_and_wait, pull, Pin::is_high);
            for pin in [scl, sda] {
                pin.pull(Pupdr::FLOATING);
            }
            lines
        })
    }

    async fn restart_sensor(&mut self, wakes_ms: u32) {
        if let Some(SensorPower { power_down, reset }) = &mut self.power {
            let mut set = |level| reset.as_mut().into_iter().for_each(|reset| reset.set_level(level));
            set(Level::Low);
            power_down.set_low();
            Timer::after(RESET).await;
            set(Level::High);
            Timer::after_millis(wakes_ms.into()).await;
        }
    }
}

#[derive(Clone, Copy)]
struct Pin {
    port: Gpio,
    number: usize,
}

impl Pin {
    fn of(port: PinNumber, pin: PinNumber) -> Self {
        Self { port: PORTS[usize::from(port) % PORTS.len()], number: pin.into() }
    }

    fn is_high(self) -> bool {
        self.port.idr().read().idr(self.number) == Idr::HIGH
    }

    fn drive(self, high: bool) {
        self.port.bsrr().write(|w| if high { w.set_bs(self.number, true) } else { w.set_br(self.number, true) });
    }

    fn pull(self, side: Pupdr) {
        self.port.pupdr().modify(|w| w.set_pupdr(self.number, side));
    }

    fn drive_and_wait(self, high: bool) {
        self.drive(high);
        wait();
    }
}

fn wait() {
    cortex_m::asm::delay(HALF);
}
