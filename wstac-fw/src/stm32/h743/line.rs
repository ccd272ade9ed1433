//! The line of a board with an STM32H743 and USB, and OpenMV's boot loader.

use embassy_executor::Spawner;
use embassy_stm32::usart::{RxPin, TxPin};
use embassy_stm32::{Peri, peripherals};
use wstac_core::wire::Bootloader;

use crate::link::EnterBootloader;
use crate::restart::restart;
use crate::serial::Serial;

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
        super::usb::usb(otg, (plus, minus), spawner, bootloader)
    }
    #[cfg(not(feature = "usb"))]
    {
        let _ = (spawner, otg, plus, minus, bootloader);
        crate::stm32::usart(usart, crate::stm32::Irqs, transmit, receive, baud)
    }
}
