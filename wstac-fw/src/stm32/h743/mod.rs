//! The STM32H743, and the Cortex-M7 of an STM32H747: its clocks, and the peripherals that its boards use.
//!
//! The Cortex-M4 of an STM32H747 stays off unless an option of the chip starts it (BCM4), which boards of Arduino do
//! not set (ARMmbed/mbed-os#13826).

#[cfg(feature = "settings")]
pub(super) mod flash;
mod line;
mod start;
mod thermometer;
#[cfg(feature = "h747")]
mod timer;
#[cfg(feature = "usb")]
mod usb;

pub use line::{OPENMV_BOOTLOADER, line};
pub use start::{Crystal, start};
pub use thermometer::ChipThermometer;
pub(super) use thermometer::thermometer;

#[cfg(feature = "h747")]
pub(super) use embassy_stm32::interrupt::typelevel::USART1 as UsartInterrupt;
#[cfg(feature = "h743")]
pub(super) use embassy_stm32::interrupt::typelevel::USART3 as UsartInterrupt;
#[cfg(feature = "h747")]
pub(super) use embassy_stm32::pac::USART1 as USART;
#[cfg(feature = "h743")]
pub(super) use embassy_stm32::pac::USART3 as USART;
use embassy_stm32::pac::{DBGMCU, RCC};
#[cfg(feature = "h747")]
pub use embassy_stm32::peripherals::USART1 as Usart;
#[cfg(feature = "h743")]
pub use embassy_stm32::peripherals::USART3 as Usart;
pub use embassy_stm32::peripherals::{IWDG1 as WatchdogPart, MCO1 as ClockOutput};
use embassy_stm32::rcc::Mco1Source;

/// The core's clock. A timer of an STM32H747's boards divides it into 24 MHz with equal halves.
pub(super) const MHZ: u32 = if cfg!(feature = "h747") { 96 } else { 72 };
/// The clock of 24 MHz for the sensor.
pub(super) const SENSOR_CLOCK: Mco1Source = Mco1Source::PLL1_Q;

/// Lets the watchdog wait while a debugger halts the core.
pub(super) fn stop_watchdog_in_debugger() {
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
}

/// Returns whether the watchdog has caused this start, and forgets it.
pub(super) fn take_hung() -> bool {
    let hung = RCC.rsr().read().iwdg1rstf();
    RCC.rsr().modify(|w| w.set_rmvf(true));
    hung
}
