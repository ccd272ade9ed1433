//! The USB as the serial line, at full speed: that of the chip, or of an STM32H747 with a transceiver of its own.

use embassy_executor::Spawner;
use embassy_stm32::bind_interrupts;
#[cfg(feature = "h747")]
use embassy_stm32::pac::SYSCFG;
#[cfg(feature = "h743")]
use embassy_stm32::peripherals::USB_OTG_FS as Otg;
#[cfg(feature = "h747")]
use embassy_stm32::peripherals::USB_OTG_HS as Otg;
use embassy_stm32::uid;
use embassy_stm32::usb::{Config, Driver, InterruptHandler};

use super::line::UsbPins;
use crate::link::EnterBootloader;
use crate::serial::{Peripheral, Serial};
use crate::usb::{self, Device};

bind_interrupts!(
    struct UsbIrqs {
        #[cfg(feature = "h743")]
        OTG_FS => InterruptHandler<Otg>;
        #[cfg(feature = "h747")]
        OTG_HS => InterruptHandler<Otg>;
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
pub(super) fn usb(pins: UsbPins, spawner: Spawner, bootloader: Option<EnterBootloader>) -> Serial {
    let peripheral = cortex_m::singleton!(: Peripheral = usb::peripheral(bootloader));
    let arriving = cortex_m::singleton!(: [u8; ARRIVING] = [0; ARRIVING]);
    let (Some(arriving), Some(peripheral)) = (arriving, peripheral) else { panic!("USB is started once") };
    // A camera on a cable has no other supply: there is no VBUS to watch.
    let mut config = Config::default();
    config.vbus_detection = false;
    if let Ok(task) = serve(driver(pins, arriving, config)) {
        spawner.spawn(task);
    }
    Serial::new(peripheral)
}

#[cfg(feature = "h743")]
fn driver((otg, plus, minus): UsbPins, arriving: &'static mut [u8], config: Config) -> Driver<'static, Otg> {
    Driver::new_fs(otg, UsbIrqs, plus, minus, arriving, config)
}

#[cfg(feature = "h747")]
fn driver(pins: UsbPins, arriving: &'static mut [u8], config: Config) -> Driver<'static, Otg> {
    // The pads PC2_C and PC3_C are those of PC2 and PC3.
    SYSCFG.pmcr().modify(|w| {
        w.set_pc2so(false);
        w.set_pc3so(false);
    });
    let (otg, clock, dir, nxt, stp, d0, d1, d2, d3, d4, d5, d6, d7) = pins;
    Driver::new_fs_ulpi(otg, UsbIrqs, clock, dir, nxt, stp, d0, d1, d2, d3, d4, d5, d6, d7, arriving, config)
}

#[embassy_executor::task]
async fn serve(driver: Driver<'static, Otg>) -> ! {
    usb::run(driver, Device { numbers: [VENDOR, PRODUCT], serial: uid::uid_hex(), frame: None }).await
}
