//! The STM32H743: its clocks, and the peripherals that its boards use.

#[cfg(feature = "settings")]
pub(super) mod flash;
mod start;
mod thermometer;
#[cfg(feature = "usb")]
mod usb;

pub use start::{Crystal, start};
pub use thermometer::ChipThermometer;
pub(super) use thermometer::thermometer;

use embassy_executor::Spawner;
pub(super) use embassy_stm32::interrupt::typelevel::USART3 as UsartInterrupt;
pub(super) use embassy_stm32::pac::USART3 as USART;
use embassy_stm32::pac::{DBGMCU, RCC};
pub use embassy_stm32::peripherals::{IWDG1 as WatchdogPart, MCO1 as ClockOutput, USART3 as Usart};
use embassy_stm32::rcc::Mco1Source;
use embassy_stm32::usart::{RxPin, TxPin};
use embassy_stm32::{Peri, peripherals};
use wstac_core::wire::Bootloader;

use crate::link::EnterBootloader;
use crate::restart::restart;
use crate::serial::Serial;

pub(super) const MHZ: u32 = 72;
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

/// The word that OpenMV's boot loader looks at, the last one of the DTCM, and its value that keeps it waiting for a
/// program.
const MAGIC: *mut u32 = 0x2001_FFFC as *mut u32;
const STAY: u32 = 0xB007_10AD;

/// OpenMV's boot loader.
pub const OPENMV_BOOTLOADER: EnterBootloader = (Bootloader::Dfu, || {
    cortex_m::interrupt::disable();
    // SAFETY: the memory is there, and nothing runs any more that uses it.
    #[allow(unsafe_code)]
    unsafe {
        MAGIC.write_volatile(STAY);
    }
    cortex_m::asm::dsb();
    restart()
});

/// Starts the line of a board with USB: that, or a UART without the feature `usb`. A host may start the boot loader
/// over USB if the program can.
pub fn line(
    spawner: Spawner,
    (otg, plus, minus): (
        Peri<'static, peripherals::USB_OTG_FS>,
        Peri<'static, peripherals::PA12>,
        Peri<'static, peripherals::PA11>,
    ),
    bootloader: Option<EnterBootloader>,
    (usart, transmit, receive, baud): (
        Peri<'static, peripherals::USART3>,
        Peri<'static, impl TxPin<peripherals::USART3>>,
        Peri<'static, impl RxPin<peripherals::USART3>>,
        u32,
    ),
) -> Serial {
    #[cfg(feature = "usb")]
    {
        let _ = (usart, transmit, receive, baud);
        usb::usb(otg, (plus, minus), spawner, bootloader)
    }
    #[cfg(not(feature = "usb"))]
    {
        let _ = (spawner, otg, plus, minus, bootloader);
        super::usart(usart, super::Irqs, transmit, receive, baud)
    }
}
