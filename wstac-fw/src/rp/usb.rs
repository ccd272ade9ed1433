//! The chip's USB as the serial line, and the boot loader in its ROM.

use embassy_executor::Spawner;
use embassy_rp::usb::{Driver, InterruptHandler};
use embassy_rp::{Peri, bind_interrupts, pac, peripherals, rom_data};
use wstac_core::wire::Bootloader;

use crate::link::EnterBootloader;
use crate::serial::{Peripheral, Serial};
use crate::usb;

/// The numbers of Raspberry Pi for a serial line over USB: a product with a name of its own needs numbers of its own.
const VENDOR: u16 = 0x2E8A;
const PRODUCT: u16 = if cfg!(feature = "rp2040") { 0x000A } else { 0x0009 };

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

/// Starts the line.
pub fn usb(usb: Peri<'static, peripherals::USB>, spawner: Spawner) -> Serial {
    if let Ok(task) = serve(Driver::new(usb, UsbIrqs)) {
        spawner.spawn(task);
    }
    Serial::new(&PERIPHERAL)
}

#[embassy_executor::task]
async fn serve(driver: Driver<'static, peripherals::USB>) -> ! {
    usb::run(driver, VENDOR, PRODUCT).await
}
