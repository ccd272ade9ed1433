//! Writes and reads values as the Common Data Representation has them: little endian, each number aligned to its size.

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

    pub(super) fn i64(self, number: i64) -> Self {
        self.aligned(number.to_le_bytes())
    }

    pub(super) fn f32(self, number: f32) -> Self {
        self.aligned(number.to_le_bytes())
    }

    pub(super) fn f64(self, number: f64) -> Self {
        self.aligned(number.to_le_bytes())
    }

    /// Writes bytes with their length.
    pub(super) fn bytes(self, bytes: &[u8]) -> Self {
        let mut cdr = self.u32(bytes.len() as u32);
        cdr.0.extend(bytes);
        cdr
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

/// A payload that is being read. Every reading is `None` if the bytes are at their end or have no such value.
#[derive(Clone, Copy, Debug)]
pub(super) struct CdrReader<'b> {
    /// The bytes behind the header.
    bytes: &'b [u8],
    at: usize,
}

impl<'b> CdrReader<'b> {
    /// Starts behind the header; `None` if it names another encoding than this program writes. Its options are for bytes
    /// that were added at the end.
    pub(super) fn new(payload: &'b [u8]) -> Option<Self> {
        let [first, second, _, _, bytes @ ..] = payload else { return None };
        ([*first, *second] == HEADER[..2]).then_some(Self { bytes, at: 0 })
    }

    /// Returns the number of bytes behind those that were read.
    pub(super) fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.at)
    }

    fn take(&mut self, count: usize) -> Option<&'b [u8]> {
        let bytes = self.bytes.get(self.at..)?.get(..count)?;
        self.at += count;
        Some(bytes)
    }

    fn aligned<const SIZE: usize>(&mut self) -> Option<[u8; SIZE]> {
        self.at = self.at.checked_next_multiple_of(SIZE)?;
        self.take(SIZE)?.try_into().ok()
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.aligned().map(u8::from_le_bytes)
    }

    pub(super) fn bool(&mut self) -> Option<bool> {
        match self.u8()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.aligned().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.aligned().map(u64::from_le_bytes)
    }

    /// Reads a text with its length and a zero byte behind it.
    pub(super) fn text(&mut self) -> Option<&'b str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.take(length)?.strip_suffix(&[0])?).ok()
    }

    /// Reads a list of values, none of which is empty.
    pub(super) fn list<T>(&mut self, mut read: impl FnMut(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        // A length that the bytes cannot have ends at their end: no room is taken for it.
        (0..self.u32()?).map(|_| read(self)).collect()
    }

    /// Passes over a list of values of so many bytes each.
    pub(super) fn skip_list(&mut self, size: usize) -> Option<()> {
        let count = self.u32()? as usize;
        if count > 0 {
            self.at = self.at.checked_next_multiple_of(size)?;
        }
        self.take(count.checked_mul(size)?).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read() {
        let bytes = Cdr::new().u8(7).text("ab").u64(9).bool(true).u32(2).text("c").text("").finish();
        let mut reader = CdrReader::new(&bytes).unwrap();
        assert_eq!(
            (reader.u8(), reader.text(), reader.u64(), reader.bool()),
            (Some(7), Some("ab"), Some(9), Some(true))
        );
        assert_eq!(reader.list(CdrReader::text), Some(vec!["c", ""]));
        assert_eq!(reader.u8(), None);
        for end in 0..bytes.len() {
            let Some(mut reader) = CdrReader::new(&bytes[..end]) else { continue };
            let mut read =
                || Some((reader.u8()?, reader.text()?, reader.u64()?, reader.bool()?, reader.list(CdrReader::text)?));
            assert_eq!(read(), None, "{end} bytes");
        }
    }

    #[test]
    fn lengths_beyond_the_end_are_refused() {
        let of = |parts: &[u32]| {
            [&HEADER[..], &parts.iter().flat_map(|part| part.to_le_bytes()).collect::<Vec<_>>()].concat()
        };
        assert_eq!(CdrReader::new(&of(&[u32::MAX, 1])).unwrap().list(CdrReader::text), None);
        assert_eq!(CdrReader::new(&of(&[u32::MAX])).unwrap().text(), None);
        assert_eq!(CdrReader::new(&of(&[0])).unwrap().text(), None);
        assert_eq!(CdrReader::new(&of(&[u32::MAX])).unwrap().skip_list(8), None);
    }

    #[test]
    fn a_header_names_the_encoding_and_has_any_options() {
        assert_eq!(CdrReader::new(&[0, 1, 0, 3, 7, 0, 0, 0]).and_then(|mut reader| reader.u8()), Some(7));
        // Big endian, the later forms of CDR, and headers that are cut off.
        for header in [&[0, 0, 0, 0][..], &[0, 3, 0, 0], &[0, 7, 0, 0], &[1, 1, 0, 0], &[0, 1, 0], &[]] {
            assert_eq!(CdrReader::new(header).map(|_| ()), None, "{header:?}");
        }
    }

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
