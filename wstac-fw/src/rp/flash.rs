//! Two sectors of the flash of a board with an RP2040 or RP2350, at the end of its first 2 MiB, and with the feature
//! `models` half a MiB in the middle. Programs end in front of them (`build/link.rs`).
//!
//! The program runs from the same flash, which nobody can read while it is written. So the core waits in RAM then, with
//! interrupts off: less than a millisecond for a page, 45 ms for a sector by the data sheet of the W25Q16JV, and 400 ms
//! at worst. Frames of an erasure are lost, and the link says so.

use core::ops::Range;

use embassy_rp::flash::{Blocking, ERASE_SIZE, Error, Flash, WRITE_SIZE};
use embassy_rp::{Peri, peripherals};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

#[cfg(feature = "models")]
use crate::models::InPlace;

/// The size of the Pico's flash. That of the Pico 2 is twice as large.
const SIZE: usize = 0x20_0000;
/// The sectors, from the start of the flash.
pub(super) const SECTORS: Range<u32> = 0x1F_E000..0x20_0000;
/// The ranges that may be written: the sectors of the settings, and those of the models in front of them.
#[cfg(not(feature = "models"))]
const WRITABLE: [Range<u32>; 1] = [SECTORS];
#[cfg(feature = "models")]
const WRITABLE: [Range<u32>; 2] = [SECTORS, <RpFlash as InPlace>::MODELS];

/// The flash.
pub struct RpFlash(Flash<'static, peripherals::FLASH, Blocking, SIZE>);

impl RpFlash {
    /// Takes the flash.
    pub fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self(Flash::new_blocking(flash))
    }
}

impl ErrorType for RpFlash {
    type Error = Error;
}

impl ReadNorFlash for RpFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        self.0.blocking_read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

/// Whether this may write from one byte up to another one: a wrong number must not end the program that runs.
fn is_writable(from: u32, to: u32) -> bool {
    WRITABLE.iter().any(|range| from >= range.start && to <= range.end)
}

impl NorFlash for RpFlash {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        if !is_writable(from, to) {
            return Err(Error::OutOfBounds);
        }
        self.0.blocking_erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let end = u32::try_from(bytes.len()).ok().and_then(|length| offset.checked_add(length));
        if end.is_none_or(|end| !is_writable(offset, end)) {
            return Err(Error::OutOfBounds);
        }
        self.0.blocking_write(offset, bytes)
    }
}

#[cfg(feature = "models")]
impl InPlace for RpFlash {
    const MODELS: Range<u32> = 0x10_0000..0x18_0000;

    fn in_place(&mut self, range: Range<u32>) -> Option<&'static [u8]> {
        use embassy_rp::flash::FLASH_BASE;

        if range.start < Self::MODELS.start || range.end > Self::MODELS.end || !range.start.is_multiple_of(4) {
            return None;
        }
        let length = range.end.checked_sub(range.start)? as usize;
        // SAFETY: these bytes are flash, which is memory of bytes. Who uses them writes to none of them, as the trait
        // says.
        #[allow(unsafe_code)]
        Some(unsafe { core::slice::from_raw_parts(FLASH_BASE.cast::<u8>().add(range.start as usize), length) })
    }
}
