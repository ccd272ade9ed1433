//! The line of a board with USB, and OpenMV's boot loader.

use embassy_executor::Spawner;
use embassy_stm32::usart::{RxPin, TxPin};
use embassy_stm32::{Peri, peripherals};
use wstac_core::wire::Bootloader;

use crate::link::EnterBootloader;
use crate::restart::restart;
use crate::serial::Serial;
use crate::stm32::Usart;

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

/// A board's USB of full speed: D+ and D−.
#[cfg(feature = "h743")]
pub(super) type UsbPins =
    (Peri<'static, peripherals::USB_OTG_FS>, Peri<'static, peripherals::PA12>, Peri<'static, peripherals::PA11>);

/// A board's USB with a transceiver of its own (ULPI): clock, DIR, NXT, STP, and D0 to D7.
#[cfg(feature = "h747")]
pub(super) type UsbPins = (
    Peri<'static, peripherals::USB_OTG_HS>,
    Peri<'static, peripherals::PA5>,
    Peri<'static, peripherals::PC2>,
    Peri<'static, peripherals::PC3>,
    Peri<'static, peripherals::PC0>,
    Peri<'static, peripherals::PA3>,
    Peri<'static, peripherals::PB0>,
    Peri<'static, peripherals::PB1>,
    Peri<'static, peripherals::PB10>,
    Peri<'static, peripherals::PB11>,
    Peri<'static, peripherals::PB12>,
    Peri<'static, peripherals::PB13>,
    Peri<'static, peripherals::PB5>,
);

/// Starts the line of a board with USB: that, or a UART without the feature `usb`. A host may start the boot loader
/// over USB if the program can.
pub fn line(
    spawner: Spawner,
    pins: UsbPins,
    bootloader: Option<EnterBootloader>,
    (usart, transmit, receive, baud): (
        Peri<'static, Usart>,
        Peri<'static, impl TxPin<Usart>>,
        Peri<'static, impl RxPin<Usart>>,
        u32,
    ),
) -> Serial {
    #[cfg(feature = "usb")]
    {
        let _ = (usart, transmit, receive, baud);
        super::usb::usb(pins, spawner, bootloader)
    }
    #[cfg(not(feature = "usb"))]
    {
        let _ = (spawner, pins, bootloader);
        crate::stm32::usart(usart, crate::stm32::Irqs, transmit, receive, baud)
    }
}
