//! The reason why the firmware stopped. It is kept over the reset that follows, and the next start reports it.
//!
//! The record is in memory that the start-up code does not change. It survives a reset. After power was off the memory
//! holds arbitrary bytes, so the record is valid only with its magic number and checksum.
//!
//! It also counts the starts since power was on.

#[cfg(feature = "node")]
use core::sync::atomic::{Ordering, compiler_fence};

use wstac_core::crc::crc32;

/// The bytes of text that are kept.
const MOST: usize = 96;
/// The magic number at the start of the record.
const MAGIC: u32 = 0x5753_7461;

/// A text with a magic number and a checksum that prove that it is one.
///
/// It is whole words of 64 bits, which memory with error correction writes at once.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(8))]
pub struct CrashRecord {
    magic: u32,
    checksum: u32,
    restarts: u32,
    length: u32,
    text: [u8; MOST],
}

const _: () = assert!(size_of::<CrashRecord>().is_multiple_of(8));

impl CrashRecord {
    /// Creates an empty record.
    pub(crate) const fn new() -> Self {
        Self { magic: MAGIC, checksum: 0, restarts: 0, length: 0, text: [0; MOST] }
    }

    /// Returns the record without its text. An invalid one begins to count anew.
    #[must_use]
    pub fn without_text(&self) -> Self {
        let mut record = Self::new();
        record.restarts = if self.is_valid() { self.restarts } else { 0 };
        record.checksum = record.sum();
        record
    }

    /// Returns the record after one more start. An invalid one begins to count.
    #[must_use]
    pub fn started(&self) -> Self {
        let mut record = if self.is_valid() { *self } else { Self::new() };
        record.restarts = if self.is_valid() { self.restarts.saturating_add(1) } else { 0 };
        record.checksum = record.sum();
        record
    }

    /// Returns the number of starts since power was on, without the first.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    fn is_valid(&self) -> bool {
        self.magic == MAGIC && self.checksum == self.sum() && self.length as usize <= MOST
    }

    /// Returns the record with more text. Text that does not fit is left out.
    pub fn add(&mut self, text: &str) {
        for &byte in text.as_bytes() {
            if let Some(place) = self.text.get_mut(self.length as usize) {
                *place = byte;
                self.length += 1;
            }
        }
        self.checksum = self.sum();
    }

    /// Returns the record with a number in base `base`, 2 to 16, added.
    pub fn add_number(&mut self, number: u32, base: u32) {
        let mut digits = [b'0'; 32];
        let mut rest = number;
        let mut first = digits.len();
        for (at, digit) in digits.iter_mut().enumerate().rev() {
            let value = rest % base.clamp(2, 16);
            *digit = b"0123456789ABCDEF".get(value as usize).copied().unwrap_or(b'?');
            rest /= base.clamp(2, 16);
            first = at;
            if rest == 0 {
                break;
            }
        }
        self.add(digits.get(first..).and_then(|digits| str::from_utf8(digits).ok()).unwrap_or_default());
    }

    /// Returns the text if the record is valid and has one.
    pub fn text(&self) -> Option<&str> {
        if !self.is_valid() || self.length == 0 {
            return None;
        }
        let bytes = self.text.get(..self.length as usize)?;
        // A text that was cut in the middle of a character ends before it.
        match str::from_utf8(bytes) {
            Ok(text) => Some(text),
            Err(error) => bytes.get(..error.valid_up_to()).and_then(|bytes| str::from_utf8(bytes).ok()),
        }
    }

    /// Returns the CRC-32 (IEEE) of the count, the length and the text.
    fn sum(&self) -> u32 {
        crc32(self.restarts.to_le_bytes().into_iter().chain(self.length.to_le_bytes()).chain(self.text))
    }
}

#[cfg(feature = "node")]
mod kept {
    //! The place of the record, and the handlers that write to it.

    use core::mem::MaybeUninit;
    use core::panic::PanicInfo;
    use core::ptr::{addr_of, addr_of_mut};

    #[cfg(feature = "stm32")]
    use cortex_m::peripheral::SCB;
    use cortex_m_rt::{ExceptionFrame, exception};

    use super::{CrashRecord, Ordering, compiler_fence};
    use crate::restart::restart;

    /// The bytes of a panic's path that are kept.
    const PATH: usize = 40;

    /// The record, which the start-up code does not touch.
    #[unsafe(link_section = ".uninit.crash_record")]
    static mut KEPT: MaybeUninit<CrashRecord> = MaybeUninit::uninit();

    /// Memory with error correction writes whole words of 64 bits. It keeps the last write of a part of one in a
    /// buffer, which a reset clears. Only another such write elsewhere empties it, so two are made after the record.
    #[unsafe(link_section = ".uninit.crash_record")]
    static mut FLUSH: [MaybeUninit<u64>; 2] = [const { MaybeUninit::uninit() }; 2];

    /// Counts this start. The text of the last run, or that it hung, stays until [`erase`].
    pub fn begin(hung: bool) {
        let mut record = kept().started();
        if hung && record.text().is_none() {
            record.add("the program hung, and the watchdog ended it");
        }
        keep(record);
    }

    /// Erases the text, because it was sent.
    pub fn erase() {
        keep(kept().without_text());
    }

    /// Returns the record.
    #[allow(unsafe_code)]
    #[inline(never)]
    pub fn kept() -> CrashRecord {
        // SAFETY: any bytes are a record, because it consists of numbers. No other code writes to it now: the handlers
        // do not return, and all others run one after another.
        unsafe { addr_of!(KEPT).cast::<CrashRecord>().read_volatile() }
    }

    #[allow(unsafe_code)]
    fn keep(record: CrashRecord) {
        // SAFETY: any bytes are a valid record, and no other code uses it now. The flushing words are numbers, too.
        unsafe {
            addr_of_mut!(KEPT).cast::<CrashRecord>().write_volatile(record);
            cortex_m::asm::dsb();
            for word in 0..2 {
                addr_of_mut!(FLUSH).cast::<u64>().add(word).cast::<u32>().write_volatile(0);
                cortex_m::asm::dsb();
            }
        }
        compiler_fence(Ordering::SeqCst);
    }

    /// Keeps this text as the reason and restarts.
    fn restart_because(record: CrashRecord) -> ! {
        keep(record);
        restart()
    }

    #[panic_handler]
    fn panic(info: &PanicInfo<'_>) -> ! {
        cortex_m::interrupt::disable();
        let mut words = kept().without_text();
        words.add("panic");
        // The place comes first, with the end of its path. Text that is too long is cut.
        if let Some(place) = info.location() {
            let file = place.file();
            words.add(" at ");
            words.add(file.get(file.len().saturating_sub(PATH)..).unwrap_or(file));
            words.add(":");
            words.add_number(place.line(), 10);
        }
        if let Some(message) = info.message().as_str() {
            words.add(": ");
            words.add(message);
        }
        restart_because(words)
    }

    #[allow(unsafe_code)]
    #[exception]
    unsafe fn DefaultHandler(number: i16) -> ! {
        restart_unhandled(number)
    }

    /// Keeps the number of an interrupt as the reason and restarts.
    pub(crate) fn restart_unhandled(number: i16) -> ! {
        let mut words = kept().without_text();
        words.add("an interrupt without a handler: ");
        words.add_number(u32::from(number.unsigned_abs()), 10);
        restart_because(words)
    }

    #[allow(unsafe_code)]
    #[exception]
    unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
        let mut words = kept().without_text();
        words.add("hard fault at 0x");
        words.add_number(frame.pc(), 16);
        words.add(", called from 0x");
        words.add_number(frame.lr(), 16);
        // A Cortex-M0+ does not say what the fault was.
        #[cfg(feature = "stm32")]
        {
            words.add(", fault status 0x");
            // SAFETY: the register says what the fault was; reading it changes nothing.
            words.add_number(unsafe { (*SCB::PTR).cfsr.read() }, 16);
        }
        restart_because(words)
    }
}

#[cfg(all(feature = "u575", feature = "settings"))]
pub(crate) use kept::restart_unhandled;
#[cfg(feature = "node")]
pub use kept::{begin, erase, kept};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_as_they_were() {
        let mut words = CrashRecord::new();
        words.add("at 0x");
        words.add_number(0xBEEF_0000, 16);
        words.add(" line ");
        words.add_number(0, 10);
        words.add_number(u32::MAX, 10);
        assert_eq!(words.text(), Some("at 0xBEEF0000 line 04294967295"));
    }

    #[test]
    fn too_many_are_cut_between_characters() {
        let mut words = CrashRecord::new();
        for _ in 0..MOST {
            words.add("½a");
        }
        let text = words.text().unwrap();
        assert!((MOST - 2..=MOST).contains(&text.len()) && "½a".repeat(MOST).starts_with(text), "{text}");
    }

    #[test]
    fn what_was_not_written_is_not_believed() {
        let mut words = CrashRecord::new();
        words.add("overflow");
        for byte in 0..size_of::<CrashRecord>() {
            let mut bytes = words;
            // Any bit of the record is changed.
            let flip = |value: u32| value ^ 1 << (byte % 4 * 8);
            match byte {
                0..4 => bytes.magic = flip(bytes.magic),
                4..8 => bytes.checksum = flip(bytes.checksum),
                8..12 => bytes.restarts = flip(bytes.restarts),
                12..16 => bytes.length = flip(bytes.length),
                _ => bytes.text[byte - 16] ^= 0x10,
            }
            assert_eq!(bytes.text(), None, "byte {byte}");
        }
        assert_eq!(CrashRecord { length: u32::MAX, ..words }.text(), None);
        // An empty record that was never added to has no checksum.
        assert_eq!(CrashRecord::new().text(), None);
    }

    #[test]
    fn starts_are_counted_with_and_without_a_text() {
        // After power was off, the bytes are arbitrary.
        let off = CrashRecord { magic: 0, restarts: 77, ..CrashRecord::new() };
        let first = off.started();
        assert_eq!((first.restarts(), first.text()), (0, None));
        let mut crashed = first.started().without_text();
        crashed.add("panic");
        let next = crashed.started();
        assert_eq!((next.restarts(), next.text()), (2, Some("panic")));
        let erased = next.without_text();
        assert_eq!((erased.restarts(), erased.text()), (2, None));
        assert_eq!(erased.started().restarts(), 3);
    }
}
