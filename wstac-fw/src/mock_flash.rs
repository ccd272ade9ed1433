//! A flash in memory whose power fails.

use core::ops::Range;
use std::vec;
use std::vec::Vec;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// The bytes of a word and of a sector. A word may be written once, as with error correction.
pub(crate) const WORD: usize = 32;
pub(crate) const SECTOR: usize = 1024;

/// The content of a word after the power failed while it was written.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cut {
    /// The bytes before the cut.
    Bytes,
    /// Some of the bits.
    Bits,
    /// Nothing that can be read: the driver gives zeros.
    Unreadable,
}

/// Returns all cuts of the power while this many bytes are written. Within an erasure and between words, all are alike.
pub(crate) fn each_cut(needed: usize) -> impl Iterator<Item = (usize, Cut)> {
    let all = (0..needed).flat_map(|left| [Cut::Bytes, Cut::Bits, Cut::Unreadable].map(|cut| (left, cut)));
    all.filter(|(left, cut)| left % WORD != 0 || matches!(cut, Cut::Bytes))
}

/// A flash whose power fails after so many bytes. An erased sector counts as so many bytes, too.
#[derive(Clone)]
pub(crate) struct Flash {
    pub(crate) bytes: Vec<u8>,
    pub(crate) written: Vec<bool>,
    /// The bytes of which anything may be written or erased.
    range: Range<u32>,
    pub(crate) left: usize,
    cut: Cut,
    /// Whether the power has failed. Then nothing can be done until the next start.
    is_off: bool,
    /// The number of words that were written over.
    pub(crate) again: u32,
}

#[derive(Debug)]
pub(crate) struct PowerFailed;

impl NorFlashError for PowerFailed {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    /// Creates an erased flash with a sector more than this range, of which anything may be written or erased.
    pub(crate) fn new(range: Range<u32>) -> Self {
        let size = range.end as usize + SECTOR;
        let (bytes, written) = (vec![0xFF; size], vec![false; size / WORD]);
        Self { bytes, written, range, left: usize::MAX, cut: Cut::Bytes, is_off: false, again: 0 }
    }

    /// Returns the flash with power for `left` more bytes.
    pub(crate) fn until(&self, left: usize, cut: Cut) -> Self {
        Self { left, cut, is_off: false, ..self.clone() }
    }

    fn is_on(&self) -> Result<(), PowerFailed> {
        if self.is_off { Err(PowerFailed) } else { Ok(()) }
    }

    fn fail(&mut self) -> Result<(), PowerFailed> {
        self.is_off = true;
        Err(PowerFailed)
    }

    /// Returns the flash after a reset, with power.
    pub(crate) fn again(&self) -> Self {
        self.until(usize::MAX, Cut::Bytes)
    }
}

impl ErrorType for Flash {
    type Error = PowerFailed;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerFailed> {
        self.is_on()?;
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerFailed> {
        self.is_on()?;
        let (from, to) = (from as usize, to as usize);
        let Range { start, end } = self.range;
        assert!(from >= start as usize && to <= end as usize && from.is_multiple_of(SECTOR));
        if self.left < to - from {
            // A part is erased, and the next words are anything.
            let end = from + self.left / WORD * WORD;
            self.bytes[from..end].fill(0xFF);
            self.bytes[end..to].iter_mut().step_by(3).for_each(|byte| *byte |= 0x5A);
            return self.fail();
        }
        self.left -= to - from;
        self.bytes[from..to].fill(0xFF);
        self.written[from / WORD..to / WORD].fill(false);
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerFailed> {
        self.is_on()?;
        assert!((offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD));
        for (at, word) in (offset as usize..).step_by(WORD).zip(bytes.chunks(WORD)) {
            assert!(self.range.contains(&(at as u32)), "a write elsewhere");
            if self.left == 0 {
                return self.fail();
            }
            let place = &mut self.bytes[at..at + WORD];
            if std::mem::replace(&mut self.written[at / WORD], true) {
                // After a cut, the mark of a full sector may be written again. Its error correction does not fit it
                // then, so the driver reads zeros, which are the mark.
                assert!(word.iter().all(|byte| *byte == 0), "the word at {at:#x} is written over");
                self.again += 1;
                place.fill(0);
                self.left = self.left.saturating_sub(WORD);
                continue;
            }
            if self.left < WORD {
                match self.cut {
                    Cut::Bytes => place[..self.left].copy_from_slice(&word[..self.left]),
                    Cut::Bits => {
                        place.iter_mut().zip(word).enumerate().for_each(|(k, (byte, new))| {
                            *byte &= *new | [0x0F, 0xA5, 0xFF, 0x3C][(k + self.left) % 4];
                        });
                    }
                    Cut::Unreadable => place.fill(0),
                }
                return self.fail();
            }
            place.copy_from_slice(word);
            self.left -= WORD;
        }
        Ok(())
    }
}
