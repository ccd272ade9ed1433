//! Sums the bytes of a block of rows, which is the work for a taxel of one byte per pixel.
//!
//! The plain code is right anywhere, and a host's compiler makes packed instructions of it. A Cortex-M's compiler does
//! not. So there four bytes are added as one word, and a Cortex-M4 or M7 has an instruction for their sum.
//!
//! The table has the instructions from a frame of 400 × 400 to its features, with 62,500 bytes under taxels.
//! The Cortex-M0 gets stripes of eight rows, the others whole frames. `cost` of wstac-fw counts them.
//! `ci/firmware` checks the second column; the first is counted with [`plain`] in the place of these kernels.
//!
//! | core | plain | here |
//! | --- | ---: | ---: |
//! | Cortex-M0 | 387,019 | 230,430 |
//! | Cortex-M3 | 278,236 | 196,408 |
//! | Cortex-M4 | 278,149 | 32,420 |
//!
//! All kernels are tested to give the same sums: words here, and the kernel of each board on an emulated one (`golden`
//! of wstac-fw).

#[cfg(dsp)]
mod packed;
#[cfg(any(test, all(target_arch = "arm", not(dsp))))]
mod words;

use crate::frame::Block;
#[cfg(dsp)]
use crate::frame::Blocks;
#[cfg(dsp)]
use crate::params::COLUMNS;

/// Sums a block's bytes. The sum is below 2^32 if there are fewer than 2^24 bytes.
#[cfg(not(target_arch = "arm"))]
#[inline(always)]
pub(super) fn sum(block: Block<'_>) -> u32 {
    #[cfg(simd)]
    if let Some(sum) = super::simd::Simd::get().and_then(|simd| simd.sum::<1, 0>(block)) {
        return sum;
    }
    plain(block)
}

/// Sums a block's bytes. The sum is below 2^32 if there are fewer than 2^24 bytes.
#[cfg(target_arch = "arm")]
#[inline(always)]
pub(super) fn sum(block: Block<'_>) -> u32 {
    #[cfg(dsp)]
    use packed::{MOST_WIDTH, of_strip};
    #[cfg(not(dsp))]
    use words::{MOST_WIDTH, of_strip};

    Strip::<MOST_WIDTH>::new(block).map_or_else(|| in_strips(block, of_strip), of_strip)
}

#[cfg(any(test, not(target_arch = "arm")))]
#[inline(always)]
fn plain(block: Block<'_>) -> u32 {
    block.each_row().map(of_run).sum()
}

#[inline(always)]
fn of_run(bytes: &[u8]) -> u32 {
    bytes.iter().map(|&byte| u32::from(byte)).sum()
}

/// A block that kernels can sum. It has at least one row. All rows have the same alignment, an aligned word each, and
/// at most `MOST` bytes.
#[cfg(any(test, target_arch = "arm"))]
#[derive(Clone, Copy)]
struct Strip<'a, const MOST: usize>(Block<'a>);

#[cfg(any(test, target_arch = "arm"))]
impl<'a, const MOST: usize> Strip<'a, MOST> {
    /// The least bytes that always have an aligned word.
    const LEAST: usize = 7;

    #[inline(always)]
    fn new(block: Block<'a>) -> Option<Self> {
        let alike = block.bytes_per_row().is_multiple_of(4) || block.rows() == 1;
        let fits = alike && (Self::LEAST..=MOST).contains(&block.width()) && block.rows() > 0;
        fits.then_some(Self(block))
    }
}

/// Blocks side by side that a kernel sums at once. They lie in the band, which has at least one row. All rows have the
/// same alignment, and those of the blocks have an aligned word each and at most [`packed::MOST_WIDTH`] bytes.
#[cfg(dsp)]
pub(super) struct SideBySide<'a> {
    band: Block<'a>,
    corners: &'a [[u16; 2]; COLUMNS],
    width: usize,
}

#[cfg(dsp)]
impl<'a> SideBySide<'a> {
    /// Returns the blocks of one byte per pixel, if the kernel can sum them.
    #[inline(always)]
    pub(super) fn new(blocks: &Blocks<'a>) -> Option<Self> {
        let (band, corners, width) = blocks.of_bytes()?;
        let fits = band.bytes_per_row().is_multiple_of(4) && (Strip::<0>::LEAST..=packed::MOST_WIDTH).contains(&width);
        fits.then_some(Self { band, corners, width })
    }

    #[inline(always)]
    pub(super) fn add_to(self, sums: &mut [u32; COLUMNS]) {
        packed::add_to(self, sums);
    }
}

/// Sums any block in strips of single rows.
#[cfg(any(test, target_arch = "arm"))]
#[cold]
#[inline(never)]
fn in_strips<const MOST: usize>(block: Block<'_>, of_strip: impl Fn(Strip<'_, MOST>) -> u32) -> u32 {
    let parts = block.each_row().flat_map(|row| row.chunks(MOST));
    parts
        .map(|part| {
            Block::new(part, part.len(), part.len(), 1).and_then(Strip::new).map_or_else(|| of_run(part), &of_strip)
        })
        .sum()
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
            // Some rows have sums that do not fit 16-bit lanes.
            let width = 1 + next(if turn % 50 == 0 { 9_000 } else { 120 });
            let bytes_per_row = width + next(9);
            let (rows, offset) = (1 + next(60), next(4));
            let most = if turn % 3 == 0 { 1 } else { 256 };
            let length = offset + (rows - 1) * bytes_per_row + width;
            let bytes: std::vec::Vec<u8> = (0..length).map(|_| 255 - next(most) as u8).collect();
            let block = Block::new(&bytes[offset..], bytes_per_row, width, rows).unwrap();
            let sum = Strip::new(block).map_or_else(|| in_strips(block, words::of_strip), words::of_strip);
            assert_eq!(sum, plain(block), "{width} bytes in {rows} rows");
        }
    }
}
