//! Sectors of the chip's flash at 1.5 MiB: no program of this size reaches them, and no bootloader uses them. Those
//! behind them are others': OpenMV keeps files at the end of its camera's flash.
//!
//! They are in the other bank than the program, which runs on while a word is written.
//!
//! If the power fails while a word is written, its error correction may not fit it. Such a word reads as zeros: the
//! checksums of what is kept there do not fit it. How the chip reports it is in `read_word` of its module.

use core::ops::Range;

use embassy_stm32::flash::{Blocking, Error, FLASH_SIZE, Flash, WRITE_SIZE};
use embassy_stm32::{Peri, peripherals};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use super::chip::flash::{SECTOR, change, read_word};
#[cfg(feature = "models")]
use crate::models::InPlace;

/// The sectors of the settings, from the start of the flash.
pub(super) const SECTORS: Range<u32> = 0x18_0000..0x18_0000 + 2 * SECTOR as u32;
/// The range that may be read and written: the sectors of the settings, and those of the models in front of them.
#[cfg(not(feature = "models"))]
const ALL: Range<u32> = SECTORS;
#[cfg(feature = "models")]
const ALL: Range<u32> = <BoardFlash as InPlace>::MODELS.start..SECTORS.end;

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
        change(true, || self.0.blocking_erase(from, to))
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        if offset < ALL.start || bytes.len() > (ALL.end.saturating_sub(offset)) as usize {
            return Err(Error::Size);
        }
        change(false, || self.0.blocking_write(offset, bytes))
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
        // Later loads do not care for damaged words.
        let is_readable = |at: u32| read_word(at as usize, &mut [0]);
        if !range.clone().step_by(WRITE_SIZE).all(is_readable) {
            return None;
        }
        let length = range.end.checked_sub(range.start)? as usize;
        let first = embassy_stm32::flash::FLASH_BASE + range.start as usize;
        // SAFETY: these bytes of the flash can be read, as was seen. Who uses them writes to none of them, as the trait
        // says.
        #[allow(unsafe_code)]
        Some(unsafe { core::slice::from_raw_parts(first as *const u8, length) })
    }
}
