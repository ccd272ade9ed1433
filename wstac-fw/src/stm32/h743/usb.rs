//! The USB of full speed at PA11 and PA12 as the serial line.

use embassy_executor::Spawner;
use embassy_stm32::peripherals::{PA11, PA12, USB_OTG_FS};
use embassy_stm32::uid;
use embassy_stm32::usb::{Config, Driver, InterruptHandler};
use embassy_stm32::{Peri, bind_interrupts};

use crate::link::EnterBootloader;
use crate::serial::{Peripheral, Serial};
use crate::usb::{self, Device};

bind_interrupts!(
    struct UsbIrqs {
        OTG_FS => InterruptHandler<USB_OTG_FS>;
    }
);

/// The numbers of STMicroelectronics for a serial line over USB: a product with a name of its own needs numbers of its
/// own.
const VENDOR: u16 = 0x0483;
const PRODUCT: u16 = 0x5740;
/// The bytes for packets that arrive: those of the control endpoint and of the line.
const ARRIVING: usize = 128;

/// Starts the line of a board with this boot loader, if the program can start one.
///
/// # Panics
/// Panics at a second call.
pub(super) fn usb(
    otg: Peri<'static, USB_OTG_FS>,
    data: (Peri<'static, PA12>, Peri<'static, PA11>),
    spawner: Spawner,
    bootloader: Option<EnterBootloader>,
) -> Serial {
    let peripheral = cortex_m::singleton!(: Peripheral = usb::peripheral(bootloader));
    let arriving = cortex_m::singleton!(: [u8; ARRIVING] = [0; ARRIVING]);
    let (Some(arriving), Some(peripheral)) = (arriving, peripheral) else { panic!("USB is started once") };
    // A camera on a cable has no other supply: there is no VBUS to watch.
    let mut config = Config::default();
    config.vbus_detection = false;
    if let Ok(task) = serve(Driver::new_fs(otg, UsbIrqs, data.0, data.1, arriving, config)) {
        spawner.spawn(task);
    }
    Serial::new(peripheral)
}

#[embassy_executor::task]
async fn serve(driver: Driver<'static, USB_OTG_FS>) -> ! {
    usb::run(driver, Device { numbers: [VENDOR, PRODUCT], serial: uid::uid_hex(), frame: None }).await
}
