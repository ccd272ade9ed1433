//! Writes values as the Common Data Representation has them: little endian, each number aligned to its size.

use std::time::{SystemTime, UNIX_EPOCH};

/// The header of a payload: plain CDR, little endian, no options.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// A payload that is being written.
#[derive(Clone, Debug)]
pub(super) struct Cdr(Vec<u8>);

impl Cdr {
    pub(super) fn new() -> Self {
        Self(HEADER.to_vec())
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }

    /// Writes the bytes of a number. Alignment counts from behind the header.
    fn aligned<const SIZE: usize>(mut self, bytes: [u8; SIZE]) -> Self {
        let length = (self.0.len() - HEADER.len()).next_multiple_of(SIZE) + HEADER.len();
        self.0.resize(length, 0);
        self.0.extend(bytes);
        self
    }

    pub(super) fn u8(self, number: u8) -> Self {
        self.aligned([number])
    }

    pub(super) fn bool(self, is_so: bool) -> Self {
        self.u8(is_so.into())
    }

    pub(super) fn u32(self, number: u32) -> Self {
        self.aligned(number.to_le_bytes())
    }

    pub(super) fn u64(self, number: u64) -> Self {
        self.aligned(number.to_le_bytes())
    }

    pub(super) fn f32(self, number: f32) -> Self {
        self.aligned(number.to_le_bytes())
    }

    pub(super) fn f64(self, number: f64) -> Self {
        self.aligned(number.to_le_bytes())
    }

    /// Writes a text with its length and a zero byte behind it.
    pub(super) fn text(self, text: &str) -> Self {
        let mut cdr = self.u32(text.len() as u32 + 1);
        cdr.0.extend(text.as_bytes());
        cdr.0.push(0);
        cdr
    }

    /// Writes `builtin_interfaces/Time`, whose seconds end in 2038.
    pub(super) fn time(self, time: SystemTime) -> Self {
        let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
        let seconds = i32::try_from(since.as_secs()).unwrap_or(i32::MAX);
        self.aligned(seconds.to_le_bytes()).u32(since.subsec_nanos())
    }

    /// Writes `std_msgs/Header`.
    pub(super) fn header(self, stamp: SystemTime, frame_id: &str) -> Self {
        self.time(stamp).text(frame_id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_behind_the_header() {
        let bytes = Cdr::new().u8(7).u32(1).u8(9).f64(1.0).text("ab").bool(true).finish();
        let expected: &[&[u8]] = &[
            &HEADER,
            &[7, 0, 0, 0],
            &[1, 0, 0, 0],
            &[9, 0, 0, 0, 0, 0, 0, 0],
            &1.0_f64.to_le_bytes(),
            &[3, 0, 0, 0],
            b"ab\0",
            &[1],
        ];
        assert_eq!(bytes, expected.concat());
    }
}
