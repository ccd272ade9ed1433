//! A timer's output as the sensor's clock.

use embassy_stm32::gpio::{AfType, Flex, OutputType, Speed};
use embassy_stm32::pac::TIM3;
use embassy_stm32::pac::timer::vals::OcmGp;
use embassy_stm32::timer::{Ch2, TimerPin};
use embassy_stm32::{Peri, peripherals, rcc};

use super::MHZ;
use crate::stm32::SensorClock;

/// The timer's clocks for one of the sensor.
const CLOCKS: u16 = (MHZ / 24) as u16;

impl SensorClock {
    /// Puts 24 MHz out of channel 2 of TIM3, high for half of the time.
    pub fn timer(
        _timer: Peri<'static, peripherals::TIM3>,
        pin: Peri<'static, impl TimerPin<peripherals::TIM3, Ch2>>,
    ) -> Self {
        rcc::enable_and_reset::<peripherals::TIM3>();
        TIM3.arr().write(|w| w.set_arr(CLOCKS - 1));
        TIM3.ccr(1).write(|w| w.set_ccr(CLOCKS / 2));
        TIM3.ccmr_output(0).write(|w| w.set_ocm(1, OcmGp::PWM_MODE1));
        TIM3.ccer().write(|w| w.set_cce(1, true));
        TIM3.cr1().write(|w| w.set_cen(true));
        let function = pin.af_num();
        let mut pin = Flex::new(pin);
        pin.set_as_af_unchecked(function, AfType::output(OutputType::PushPull, Speed::High));
        // A dropped pin would be disconnected.
        core::mem::forget(pin);
        Self(())
    }
}
