//! Two sectors of the STM32H743's flash, at 1.5 MiB: no program of this size reaches them, and no bootloader uses them.
//! The sectors behind them are others': OpenMV keeps files at the end of its camera's flash.
//!
//! They are in the other bank than the program, which runs on while a word is written.
//!
//! If the power fails while a word is written, its error correction may not fit it. Reading it is then a bus fault,
//! which would end every start. So words are read with bus faults ignored, and such a word reads as zeros: the
//! checksums of what is kept there do not fit it.

use core::arch::asm;
use core::ops::Range;
use core::ptr::read_volatile;

use embassy_stm32::flash::{Blocking, Error, FLASH_BASE, FLASH_SIZE, Flash, WRITE_SIZE};
use embassy_stm32::pac::FLASH;
use embassy_stm32::{Peri, peripherals};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

#[cfg(feature = "models")]
use crate::models::InPlace;

/// The sectors, from the start of the flash.
pub(super) const SECTORS: Range<u32> = 0x18_0000..0x1C_0000;
/// The range that may be read and written: the sectors of the settings, and those of the models in front of them.
#[cfg(not(feature = "models"))]
const ALL: Range<u32> = SECTORS;
#[cfg(feature = "models")]
const ALL: Range<u32> = <BoardFlash as InPlace>::MODELS.start..SECTORS.end;
/// The bytes of a sector.
const SECTOR: usize = 0x2_0000;
/// The keys that unlock a bank (RM0433, 4.9.2), and the parallelism of 64 bits.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
const FASTEST: u8 = 3;
const BANK: usize = 1;
/// CCR bit 8: a handler of the highest priority ignores bus faults of its loads.
const IGNORE_BUS_FAULTS: u32 = 1 << 8;

/// The flash.
pub struct BoardFlash(Flash<'static, Blocking>);

impl BoardFlash {
    /// Takes the flash.
    pub fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self(Flash::new_blocking(flash))
    }
}

impl ErrorType for BoardFlash {
    type Error = Error;
}

impl ReadNorFlash for BoardFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let end = u32::try_from(bytes.len()).ok().and_then(|length| offset.checked_add(length));
        if end.is_none_or(|end| end > ALL.end) || offset < ALL.start {
            return Err(Error::Size);
        }
        let mut at = offset as usize;
        let mut rest = bytes;
        while !rest.is_empty() {
            // The bytes of one word, which has one error correction.
            let length = rest.len().min(WRITE_SIZE - at % WRITE_SIZE);
            let (some, others) = rest.split_at_mut(length);
            read_word(at, some);
            (at, rest) = (at + length, others);
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        FLASH_SIZE
    }
}

impl NorFlash for BoardFlash {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        if from < ALL.start || to > ALL.end {
            return Err(Error::Size);
        }
        // A write leaves the parallelism at 8 bits, with which an erasure takes twice as long as with 64: longer than
        // the watchdog waits. The bank is locked, and stays unlocked for the erasure.
        let bank = FLASH.bank(BANK);
        if bank.cr().read().lock() {
            for key in KEYS {
                bank.keyr().write_value(key);
            }
        }
        bank.cr().modify(|w| w.set_psize(FASTEST));
        self.0.blocking_erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        if offset < ALL.start || bytes.len() > (ALL.end.saturating_sub(offset)) as usize {
            return Err(Error::Size);
        }
        self.0.blocking_write(offset, bytes)
    }
}

#[cfg(feature = "models")]
impl InPlace for BoardFlash {
    // The first half of the second bank: the program has the first bank, and runs on while a sector is erased.
    const MODELS: Range<u32> = 0x10_0000..SECTORS.start;

    fn in_place(&mut self, range: Range<u32>) -> Option<&'static [u8]> {
        if range.start < Self::MODELS.start || range.end > Self::MODELS.end || !range.start.is_multiple_of(4) {
            return None;
        }
        // Later loads do not ignore bus faults.
        let is_readable = |at: u32| read_word(at as usize, &mut [0]);
        if !range.clone().step_by(WRITE_SIZE).all(is_readable) {
            return None;
        }
        let length = range.end.checked_sub(range.start)? as usize;
        // SAFETY: these bytes of the flash can be read, as was seen. Who uses them writes to none of them, as the trait
        // says.
        #[allow(unsafe_code)]
        Some(unsafe { core::slice::from_raw_parts((FLASH_BASE + range.start as usize) as *const u8, length) })
    }
}

/// Reads bytes of one word, or zeros if the word's error correction does not fit it. Returns whether it does.
fn read_word(at: usize, bytes: &mut [u8]) -> bool {
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
