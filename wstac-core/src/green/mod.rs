//! Rows of one pixel format → green sums (SPEC §1). No other module knows about formats.
//!
//! A format is a type with [`GreenChannel`] in a file of its own, and a row of the table in this file. An application
//! that names one type links only that one. [`any::Any`] chooses at run time, for hosts.

/// The table of pixel formats, for a macro that takes its rows, behind a `$` for macros of its own.
///
/// A row has the name of a format, its type and value, for YCbCr also those of the linear method, and then its facts
/// ([`any::FormatFacts`]). A new row is the last one, because messages of boards have the number of a row.
macro_rules! table {
    ($take:ident $dollar:tt) => {
        $take! { $dollar |color|
            /// One byte per pixel, taken as green.
            // Recordings keep the name.
            #[cfg_attr(feature = "serde", serde(rename = "Grey"))]
            Gray: gray::Gray = gray::Gray
                => &[b"GREY"], 0, [1 x 1: b"G"], Some("mono8"), Some("mono8");
            /// One little-endian word of 16 bits per pixel, of which 10 count.
            Y10: words::Y10 = words::Words
                => &[b"Y10 "], 2, [1 x 1: b"Gg"], Some("mono16"), Some("mono16");
            /// One little-endian word of 16 bits per pixel, of which 12 count.
            Y12: words::Y12 = words::Words
                => &[b"Y12 "], 2, [1 x 1: b"Gg"], Some("mono16"), Some("mono16");
            /// One little-endian word of 16 bits per pixel.
            Y16: words::Y16 = words::Words
                => &[b"Y16 "], 2, [1 x 1: b"Gg"], Some("mono16"), Some("mono16");
            /// R G B in memory.
            Rgb24: packed_rgb::Rgb24 = packed_rgb::PackedRgb
                => &[b"RGB3"], 3, [1 x 1: b"RGB"], Some("rgb8"), Some("rgb8");
            /// B G R in memory.
            Bgr24: packed_rgb::Rgb24 = packed_rgb::PackedRgb
                => &[b"BGR3"], 3, [1 x 1: b"BGR"], Some("bgr8"), Some("bgr8");
            /// R G B X or B G R X in memory.
            // V4L2 names XR24 after the word's bytes from the highest down: in memory, it is B G R X.
            Rgbx32: packed_rgb::Rgbx32 = packed_rgb::PackedRgb
                => &[b"XR24", b"AR24", b"BGR4", b"XB24", b"AB24"], 3, [1 x 1: b"RGBX"], Some("rgba8"), None;
            /// X R G B or X B G R in memory.
            Xrgb32: packed_rgb::Xrgb32 = packed_rgb::PackedRgb
                => &[b"BX24", b"BA24", b"RGB4", b"RX24", b"RA24"], 3, [1 x 1: b"XRGB"], None, None;
            /// One little-endian word of 16 bits per pixel, with 6 bits of green.
            Rgb565: rgb565::Rgb565 = rgb565::Rgb565
                => &[b"RGBP"], 5, [1 x 1: b"Gg"], Some("mono16"), None;
            /// One byte per site.
            Bayer8(order: bayer::BayerOrder): bayer::Bayer<8> = bayer::Bayer::new(order)
                => order.of([&[b"RGGB"], &[b"GRBG"], &[b"GBRG"], &[b"BA81"]]), 4, [1 x 1: b"G"],
                Some(order.of(BAYER_8)), Some(order.of(BAYER_8));
            /// One little-endian word of 16 bits per site, of which 10 count.
            Bayer10(order: bayer::BayerOrder): bayer::Bayer<10> = bayer::Bayer::new(order)
                => order.of([&[b"RG10"], &[b"BA10"], &[b"GB10"], &[b"BG10"]]), 4, [1 x 1: b"Gg"],
                Some("mono16"), Some(order.of(BAYER_16));
            /// One little-endian word of 16 bits per site, of which 12 count.
            Bayer12(order: bayer::BayerOrder): bayer::Bayer<12> = bayer::Bayer::new(order)
                => order.of([&[b"RG12"], &[b"BA12"], &[b"GB12"], &[b"BG12"]]), 4, [1 x 1: b"Gg"],
                Some("mono16"), Some(order.of(BAYER_16));
            /// Y₀ Cb Y₁ Cr in memory, for two pixels.
            Yuyv: packed_ycbcr::Yuyv<ycbcr::Exact> = packed_ycbcr::Yuyv::new(ycbcr::Exact::new(color)),
            YuyvLinear: packed_ycbcr::Yuyv<ycbcr::Linear> = packed_ycbcr::Yuyv::new(ycbcr::Linear::new(color))
                => &[b"YUYV"], 1, [2 x 1: b"YUYV"], Some("yuyv"), Some("yuv422_yuy2");
            /// Cb Y₀ Cr Y₁ in memory, for two pixels.
            Uyvy: packed_ycbcr::Uyvy<ycbcr::Exact> = packed_ycbcr::Uyvy::new(ycbcr::Exact::new(color)),
            UyvyLinear: packed_ycbcr::Uyvy<ycbcr::Linear> = packed_ycbcr::Uyvy::new(ycbcr::Linear::new(color))
                => &[b"UYVY"], 1, [2 x 1: b"UYVY"], Some("uyvy"), Some("yuv422");
            /// A plane of Y, then one of Cb Cr pairs, each for 2 × 2 pixels.
            Nv12: planar_ycbcr::Nv12<ycbcr::Exact> = planar_ycbcr::Nv12::new(ycbcr::Exact::new(color)),
            Nv12Linear: planar_ycbcr::Nv12<ycbcr::Linear> = planar_ycbcr::Nv12::new(ycbcr::Linear::new(color))
                => &[b"NV12"], 1, [1 x 1: b"Y", 2 x 2: b"UV"], None, Some("mono8");
            /// Planes of Y, Cb and Cr; chroma for 2 × 2 pixels.
            Yu12: planar_ycbcr::Yu12<ycbcr::Exact> = planar_ycbcr::Yu12::new(ycbcr::Exact::new(color)),
            Yu12Linear: planar_ycbcr::Yu12<ycbcr::Linear> = planar_ycbcr::Yu12::new(ycbcr::Linear::new(color))
                => &[b"YU12"], 1, [1 x 1: b"Y", 2 x 2: b"U", 2 x 2: b"V"], None, Some("mono8");
            /// Planes of Y, Cb and Cr; chroma for 2 × 1 pixels.
            Yuv422p: planar_ycbcr::Yuv422p<ycbcr::Exact> = planar_ycbcr::Yuv422p::new(ycbcr::Exact::new(color)),
            Yuv422pLinear: planar_ycbcr::Yuv422p<ycbcr::Linear> = planar_ycbcr::Yuv422p::new(ycbcr::Linear::new(color))
                => &[b"422P"], 1, [1 x 1: b"Y", 2 x 1: b"U", 2 x 1: b"V"], None, Some("mono8");
            /// Planes of Y, Cb and Cr of the same size.
            Yuv444p: planar_ycbcr::Yuv444p<ycbcr::Exact> = planar_ycbcr::Yuv444p::new(ycbcr::Exact::new(color)),
            Yuv444pLinear: planar_ycbcr::Yuv444p<ycbcr::Linear> = planar_ycbcr::Yuv444p::new(ycbcr::Linear::new(color))
                => &[], 1, [1 x 1: b"Y", 1 x 1: b"U", 1 x 1: b"V"], None, Some("mono8");
        }
    };
}

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

    /// Adds each of the blocks of taxels side by side to its sum, if there is a kernel for all of them. Returns false
    /// if there is none; then nothing was added.
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

const fn full_scale(bits: u32) -> u32 {
    (1 << bits) - 1
}
