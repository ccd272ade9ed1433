//! The chip's USB as the serial line, and the boot loader in its ROM.

use embassy_executor::Spawner;
#[cfg(feature = "rp2040")]
use embassy_rp::flash::{Blocking, Flash};
use embassy_rp::usb::{Driver, InterruptHandler};
use embassy_rp::{Peri, bind_interrupts, pac, peripherals, rom_data};
use wstac_core::wire::Bootloader;

use crate::link::EnterBootloader;
use crate::serial::{Peripheral, Serial};
use crate::usb::{self, Device};

/// The numbers of Raspberry Pi for a serial line over USB: a product with a name of its own needs numbers of its own.
const VENDOR: u16 = 0x2E8A;
const PRODUCT: u16 = if cfg!(feature = "rp2040") { 0x000A } else { 0x0009 };

/// The bytes of the flash that the driver has to know, of which none is read or written.
#[cfg(feature = "rp2040")]
const SIZE: usize = 0;

/// An RP2040 does not recover from some errors of the bus in the last fifth of a frame (RP2040-E15).
const FRAME: Option<fn() -> u16> =
    if cfg!(feature = "rp2040") { Some(|| pac::USB.sof_rd().read().count()) } else { None };

static PERIPHERAL: Peripheral = usb::peripheral(Some(BOOTLOADER));

bind_interrupts!(
    struct UsbIrqs {
        USBCTRL_IRQ => InterruptHandler<peripherals::USB>;
    }
);

/// The boot loader in the ROM, which is a drive. Its watchdog is this program's, whose time ends there.
const BOOTLOADER: EnterBootloader = (Bootloader::Uf2, || {
    cortex_m::interrupt::disable();
    pac::WATCHDOG.ctrl().modify(|w| w.set_enable(false));
    rom_data::reset_to_usb_boot(0, 0);
    loop {
        cortex_m::asm::nop();
    }
});

/// Starts the line. Its serial number is that of the chip; an RP2040's is the one that the Pico SDK gives it, too.
///
/// # Panics
/// Panics at a second call.
pub fn usb(usb: Peri<'static, peripherals::USB>, flash: Peri<'_, peripherals::FLASH>, spawner: Spawner) -> Serial {
    let Some(serial) = cortex_m::singleton!(: heapless::String<16> = heapless::String::new()) else {
        panic!("USB is started once")
    };
    // This takes less flash than the formatting of a number of 64 bits.
    for byte in chip_id(flash).into_iter().flat_map(u64::to_be_bytes) {
        for digit in [byte >> 4, byte & 0xF] {
            // 16 digits fit.
            let _ = serial.push(char::from(b"0123456789ABCDEF"[usize::from(digit)]));
        }
    }
    if let Ok(task) = serve(Driver::new(usb, UsbIrqs), serial) {
        spawner.spawn(task);
    }
    Serial::new(&PERIPHERAL)
}

#[embassy_executor::task]
async fn serve(driver: Driver<'static, peripherals::USB>, serial: &'static str) -> ! {
    usb::run(driver, Device { numbers: [VENDOR, PRODUCT], serial, frame: FRAME }).await
}

/// Returns the unique number of an RP2350, or that of the flash of an RP2040, which has none.
#[cfg(feature = "rp2040")]
#[inline(never)]
pub(super) fn chip_id(flash: Peri<'_, peripherals::FLASH>) -> Option<u64> {
    let mut id = [0; 8];
    let mut flash = Flash::<_, Blocking, SIZE>::new_blocking(flash);
    flash.blocking_unique_id(&mut id).ok().map(|()| u64::from_be_bytes(id))
}

#[cfg(not(feature = "rp2040"))]
pub(super) fn chip_id(_flash: Peri<'_, peripherals::FLASH>) -> Option<u64> {
    embassy_rp::otp::get_chipid().ok()
}
