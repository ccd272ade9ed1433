//! Rows of one pixel format → green sums (SPEC §1). No other module knows about formats.
//!
//! A format is a type with [`GreenChannel`] in a file of its own. An application that names one type links only that
//! one. [`any::Any`] chooses at run time, for hosts.

pub mod any;
#[cfg(target_arch = "x86_64")]
mod avx2;
pub mod bayer;
mod byte_sums;
pub mod gray;
#[cfg(all(simd, target_arch = "aarch64"))]
mod neon;
pub mod packed_rgb;
pub mod packed_ycbcr;
pub mod planar_ycbcr;
pub mod rgb565;
#[cfg(simd)]
mod simd;
pub mod words;
pub mod ycbcr;

use crate::frame::{Blocks, Rows, Run, Stride};
use crate::layout::FrameSize;
use crate::params::COLUMNS;

/// Returns the name of the instructions that frames are summed with on this machine.
///
/// It is `AVX-512` (with `AVX2` for most formats), `AVX2`, `NEON`, or `plain` if the machine has none of them.
pub fn instruction_set() -> &'static str {
    #[cfg(simd)]
    if let Some(simd) = simd::Simd::get() {
        return simd.name();
    }
    "plain"
}

/// A pixel format, which turns the bytes of a row into green.
pub trait GreenChannel: Copy {
    /// The type that a taxel's pixels are gathered in before they are green.
    type Sum: Copy + Default + core::fmt::Debug;

    /// Returns the green full scale G of one pixel: 255 for 8 bits, 1023, 4095, 65535.
    fn full_scale(&self) -> u32;

    /// Returns the least bytes of a row of `width` pixels (for a planar format, of its luma).
    fn row_bytes(&self, width: u16) -> usize;

    /// Returns the side of the cell that pixels are counted in. It is 2 for Bayer formats, which have one green site in
    /// each of a cell's rows, and 1 otherwise.
    fn cell(&self) -> u16 {
        1
    }

    /// Returns the bytes of the chroma planes that follow a planar format's luma; `None` for packed formats, which may
    /// come in stripes.
    fn chroma_bytes(&self, _bytes_per_row: usize, _rows: u16) -> Option<usize> {
        None
    }

    /// Returns the least bytes of `rows` rows of a packed format. Padding after the last row may be missing.
    ///
    /// A number that a 32-bit machine cannot address saturates: no slice is as long.
    #[inline]
    fn packed_bytes(&self, width: u16, rows: usize, bytes_per_row: usize) -> usize {
        let before = rows.saturating_sub(1).saturating_mul(bytes_per_row);
        before.saturating_add(if rows == 0 { 0 } else { self.row_bytes(width) })
    }

    /// Returns the least bytes of a frame. In a packed format, padding after the last row may be missing.
    #[inline]
    fn least_frame_bytes(&self, size: FrameSize, bytes_per_row: usize) -> usize {
        let rows = usize::from(size.height());
        match self.chroma_bytes(bytes_per_row, size.height()) {
            Some(chroma) => bytes_per_row.saturating_mul(rows).saturating_add(chroma),
            None => self.packed_bytes(size.width(), rows, bytes_per_row),
        }
    }

    /// Returns the bytes of a frame with the padding of all its rows.
    ///
    /// ```
    /// use wstac_core::green::GreenChannel;
    /// use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
    /// use wstac_core::green::ycbcr::YcbcrEncoding;
    /// use wstac_core::layout::FrameSize;
    ///
    /// let rgb = Any::new(PixelFormat::Rgb24, YcbcrEncoding::default(), YcbcrMethod::Exact);
    /// let size = FrameSize::new(640, 480)?;
    /// assert_eq!(rgb.row_bytes(640), 1920);
    /// assert_eq!(rgb.frame_bytes(size, 2048), 480 * 2048);
    /// assert_eq!(rgb.least_frame_bytes(size, 2048), 479 * 2048 + 1920);
    /// # Ok::<(), wstac_core::error::Error>(())
    /// ```
    #[inline]
    fn frame_bytes(&self, size: FrameSize, bytes_per_row: usize) -> usize {
        let chroma = self.chroma_bytes(bytes_per_row, size.height()).unwrap_or(0);
        bytes_per_row.saturating_mul(usize::from(size.height())).saturating_add(chroma)
    }

    /// Adds the pixels of `run` to `sum`.
    fn add_run(&self, sum: &mut Self::Sum, rows: &Rows<'_>, run: Run);

    /// Adds every pixel of `run`, whose stride is one, and of the `count` − 1 runs below it.
    #[inline(always)]
    fn add_block(&self, sum: &mut Self::Sum, rows: &Rows<'_>, run: Run, count: u16) {
        row_by_row(self, sum, rows, run, count);
    }

    /// Adds each of the blocks of taxels side by side to its sum, if there is a kernel for all of them. Returns false if
    /// there is none; then nothing was added.
    #[inline(always)]
    fn add_blocks(&self, _sums: &mut [Self::Sum; COLUMNS], _blocks: Blocks<'_>) -> bool {
        false
    }

    /// Returns the taxel sum S of `pixels` gathered pixels: 0..=G · pixels.
    fn total(&self, sum: &Self::Sum, pixels: u32) -> u32;
}

/// Adds `run` and the `count` − 1 runs below it one by one, which is the plain way of a block.
#[inline(always)]
fn row_by_row<G: GreenChannel>(green: &G, sum: &mut G::Sum, rows: &Rows<'_>, run: Run, count: u16) {
    for y in run.y..run.y + count {
        green.add_run(sum, rows, Run { y, ..run });
    }
}

/// Returns the sum of `green` of every pixel of `BYTES` bytes that the stride counts.
#[inline(always)]
fn sum_pixels<const BYTES: usize>(bytes: &[u8], stride: Stride, green: impl Fn(&[u8; BYTES]) -> u32) -> u32 {
    let pixels = bytes.as_chunks::<BYTES>().0.iter();
    match stride {
        Stride::One => pixels.map(green).sum(),
        Stride::Two => pixels.step_by(2).map(green).sum(),
        Stride::Three => pixels.step_by(3).map(green).sum(),
        Stride::Five => pixels.step_by(5).map(green).sum(),
    }
}

/// Returns a 16-bit little-endian word, which counts as full scale if it is above it.
#[inline(always)]
fn saturated_word<const BITS: u32>(bytes: [u8; 2]) -> u32 {
    u32::from(u16::from_le_bytes(bytes)).min(full_scale(BITS))
}

/// Returns the full scale of `bits` bits.
const fn full_scale(bits: u32) -> u32 {
    (1 << bits) - 1
}
