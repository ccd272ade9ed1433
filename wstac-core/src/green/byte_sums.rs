//! Sums of bytes over a block of rows: what a taxel of one byte a pixel comes down to.
//!
//! The plain way is right anywhere, and a host's compiler makes packed instructions of it. A Cortex-M's does not, so there four bytes
//! are added as one word, and a Cortex-M4 or M7 has an instruction for their sum. A frame of 400 × 400, 62,500 bytes under taxels, takes
//! from pixels to features (`ci/firmware`):
//!
//! | core | plain | here |
//! | --- | ---: | ---: |
//!
//! All ways are tested to give the same sums.

#[cfg(dsp)]
mod packed;
#[cfg(any(test, all(target_arch = "arm", not(dsp))))]
mod words;

use crate::frame::Block;

#[cfg(dsp)]
pub(super) use packed::sum;
#[cfg(not(any(dsp, target_arch = "arm")))]
pub(super) use plain as sum;
#[cfg(all(target_arch = "arm", not(dsp)))]
pub(super) use words::sum;

/// The sum of a block's bytes; below 2^32 if there are fewer than 2^24 of them.
#[inline(always)]
pub(super) fn plain(block: Block<'_>) -> u32 {
    block.each_row().map(of_run).sum()
}

#[inline(always)]
fn of_run(bytes: &[u8]) -> u32 {
    bytes.iter().map(|&byte| u32::from(byte)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_bytes_have_the_same_sums() {
        let mut seed = 1_u32;
        let mut next = |below: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(seed) * u64::from(below)) >> 32) as usize
        };
        for turn in 0..3_000 {
            // Widths beyond what 16-bit lanes hold, too.
            let width = 1 + next(if turn % 50 == 0 { 9_000 } else { 120 });
            let bytes_per_row = width + next(9);
            let (rows, offset) = (1 + next(60), next(4));
            let most = if turn % 3 == 0 { 1 } else { 256 };
            let length = offset + (rows - 1) * bytes_per_row + width;
            let bytes: std::vec::Vec<u8> = (0..length).map(|_| 255 - next(most) as u8).collect();
            let block = Block::new(&bytes[offset..], bytes_per_row, width, rows).unwrap();
            assert_eq!(words::sum(block), plain(block), "{block:?}");
        }
    }
}
