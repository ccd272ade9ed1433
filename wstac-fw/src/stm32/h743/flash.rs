//! What an STM32H743 needs around reads and changes of its flash's second bank.
//!
//! Reading a word whose error correction does not fit it is a bus fault, which would end every start. So words are
//! read with bus faults ignored.

use core::arch::asm;
use core::ptr::read_volatile;

use embassy_stm32::flash::FLASH_BASE;
use embassy_stm32::pac::FLASH;

/// The bytes of a sector.
pub(crate) const SECTOR: usize = 0x2_0000;
/// The keys that unlock a bank (RM0433, 4.9.2), and the parallelism of 64 bits.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
const FASTEST: u8 = 3;
const BANK: usize = 1;
/// CCR bit 8: a handler of the highest priority ignores bus faults of its loads.
const IGNORE_BUS_FAULTS: u32 = 1 << 8;

/// Changes the flash.
///
/// A write leaves the parallelism at 8 bits, with which an erasure takes twice as long as with 64: longer than the
/// watchdog waits. The bank is locked, and stays unlocked for the erasure.
pub(crate) fn change<T>(erases: bool, work: impl FnOnce() -> T) -> T {
    if erases {
        let bank = FLASH.bank(BANK);
        if bank.cr().read().lock() {
            for key in KEYS {
                bank.keyr().write_value(key);
            }
        }
        bank.cr().modify(|w| w.set_psize(FASTEST));
    }
    work()
}

/// Reads bytes of one word, or zeros if the word's error correction does not fit it. Returns whether it does.
pub(crate) fn read_word(at: usize, bytes: &mut [u8]) -> bool {
    let flash = FLASH.bank(BANK);
    // SAFETY: the register is the core's, and only this bit of it is changed, for as long as no other code runs.
    #[allow(unsafe_code)]
    let control = unsafe { &(*cortex_m::peripheral::SCB::PTR).ccr };
    // SAFETY: no handler runs between the two instructions that change the priority, so none finds faults ignored. The
    // addresses are in the flash, which is memory of bytes, as the caller has checked.
    #[allow(unsafe_code)]
    unsafe {
        control.modify(|bits| bits | IGNORE_BUS_FAULTS);
        asm!("cpsid f", options(nostack));
        for (place, address) in bytes.iter_mut().zip(FLASH_BASE + at..) {
            *place = read_volatile(address as *const u8);
        }
        asm!("dsb", "cpsie f", options(nostack));
        control.modify(|bits| bits & !IGNORE_BUS_FAULTS);
    }
    let is_damaged = flash.sr().read().dbeccerr();
    if is_damaged {
        flash.ccr().write(|w| w.set_clr_dbeccerr(true));
        bytes.fill(0);
    }
    !is_damaged
}
