//! CRC-32 (IEEE): the checksum of messages, model files and records that survive a reset.

/// The remainders for every half byte: a small table, to save flash.
const TABLE: [u32; 16] = remainders(4);

pub(crate) const fn remainders<const N: usize>(bits: u32) -> [u32; N] {
    let mut table = [0; N];
    let mut number = 0;
    while number < N {
        let mut rest = number as u32;
        let mut bit = 0;
        while bit < bits {
            rest = if rest & 1 == 1 { rest >> 1 ^ 0xEDB8_8320 } else { rest >> 1 };
            bit += 1;
        }
        table[number] = rest;
        number += 1;
    }
    table
}

/// Returns the CRC-32 of bytes.
///
/// ```
/// assert_eq!(wstac_core::crc::crc32(*b"123456789"), 0xCBF4_3926);
/// ```
pub fn crc32(bytes: impl IntoIterator<Item = u8>) -> u32 {
    !bytes.into_iter().fold(u32::MAX, step)
}

/// Takes one more byte into a CRC-32 that starts at `u32::MAX` and is inverted at the end.
pub(crate) fn step(rest: u32, byte: u8) -> u32 {
    let rest = rest ^ u32::from(byte);
    let rest = rest >> 4 ^ TABLE[(rest & 15) as usize];
    rest >> 4 ^ TABLE[(rest & 15) as usize]
}
