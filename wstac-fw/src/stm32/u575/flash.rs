//! What an STM32U575 needs around reads and changes of its flash.
//!
//! Reading a word whose error correction does not fit it interrupts the core, which cannot be masked.

use core::ptr::read_volatile;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::exception;
use embassy_stm32::flash::FLASH_BASE;
use embassy_stm32::pac::pwr::vals::Vos;
use embassy_stm32::pac::{FLASH, ICACHE, PWR};

use crate::crash_record::restart_unhandled;

/// The bytes of a page.
pub(crate) const SECTOR: usize = 0x2000;

/// The number that the processor gives to this interrupt.
const NMI: i16 = -14;

/// Whether a damaged word was read.
static IS_DAMAGED: AtomicBool = AtomicBool::new(false);

#[allow(unsafe_code)]
#[exception]
unsafe fn NonMaskableInt() {
    if !FLASH.eccr().read().eccd() {
        restart_unhandled(NMI);
    }
    clear_errors();
    IS_DAMAGED.store(true, Ordering::Relaxed);
}

/// Changes the flash with a higher supply: in range 4, it can only be read. Copies of it are dropped.
pub(crate) fn change<T>(_erases: bool, work: impl FnOnce() -> T) -> T {
    set_range(Vos::RANGE1);
    let done = work();
    set_range(super::RANGE);
    forget_copies();
    done
}

fn set_range(range: Vos) {
    PWR.vosr().modify(|w| w.set_vos(range));
    while !PWR.vosr().read().vosrdy() {}
}

fn forget_copies() {
    ICACHE.cr().modify(|w| w.set_cacheinv(true));
    while ICACHE.sr().read().busyf() {}
}

/// Clears both flags by writing 1: the flash notices no error while one of them is set.
fn clear_errors() {
    FLASH.eccr().modify(|w| {
        w.set_eccc(true);
        w.set_eccd(true);
    });
}

/// Reads bytes of one word, or zeros if the word's error correction does not fit it. Returns whether it does.
pub(crate) fn read_word(at: usize, bytes: &mut [u8]) -> bool {
    clear_errors();
    IS_DAMAGED.store(false, Ordering::Relaxed);
    for (place, address) in bytes.iter_mut().zip(FLASH_BASE + at..) {
        // SAFETY: the addresses are in the flash, which is memory of bytes, as the caller has checked.
        #[allow(unsafe_code)]
        let byte = unsafe { read_volatile(address as *const u8) };
        *place = byte;
    }
    cortex_m::asm::dsb();
    let is_damaged = FLASH.eccr().read().eccd() || IS_DAMAGED.load(Ordering::Relaxed);
    if is_damaged {
        // A copy would be read without an interrupt.
        forget_copies();
        bytes.fill(0);
    }
    !is_damaged
}
