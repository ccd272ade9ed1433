//! The two lines of the sensor's bus, PB8 and PB9 of the STM32H743, beside the I²C interface that drives them.
//!
//! A reset in the middle of a read leaves the sensor with a bit on the data line. If it is low, no transfer can begin:
//! the sensor waits for clocks that never come. Nine clocks and a stop free it.

use embassy_stm32::pac::gpio::vals::{Moder, Ot};
use embassy_stm32::pac::{GPIOB, I2C1};

/// The pins of clock and data.
const SCL: usize = 8;
const SDA: usize = 9;
/// The cycles of half a clock: 5 µs at 96 MHz.
const HALF: u32 = 480;
/// The bits of a byte and its acknowledge, of which the sensor may have sent any.
const CLOCKS: u32 = 9;

/// Frees the bus if the sensor holds the data line. Returns whether it did and let go.
///
/// The interface must have been set up.
pub fn free() -> bool {
    if is_high(SDA) {
        return false;
    }
    for pin in [SCL, SDA] {
        drive(pin, true);
        GPIOB.otyper().modify(|w| w.set_ot(pin, Ot::OPEN_DRAIN));
        GPIOB.moder().modify(|w| w.set_moder(pin, Moder::OUTPUT));
    }
    for _ in 0..CLOCKS {
        clock(false);
        clock(true);
        if is_high(SDA) {
            break;
        }
    }
    // A stop: data rises while the clock is high.
    clock(false);
    drive(SDA, false);
    wait();
    clock(true);
    drive(SDA, true);
    wait();
    let is_free = is_high(SDA);
    for pin in [SCL, SDA] {
        GPIOB.moder().modify(|w| w.set_moder(pin, Moder::ALTERNATE));
    }
    // The interface forgets what it has seen of these clocks.
    I2C1.cr1().modify(|w| w.set_pe(false));
    wait();
    I2C1.cr1().modify(|w| w.set_pe(true));
    is_free
}

fn is_high(pin: usize) -> bool {
    GPIOB.idr().read().idr(pin) == embassy_stm32::pac::gpio::vals::Idr::HIGH
}

fn clock(high: bool) {
    drive(SCL, high);
    wait();
}

fn drive(pin: usize, high: bool) {
    GPIOB.bsrr().write(|w| if high { w.set_bs(pin, true) } else { w.set_br(pin, true) });
}

fn wait() {
    cortex_m::asm::delay(HALF);
}
