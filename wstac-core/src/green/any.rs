//! A pixel format that is chosen at run time, for hosts. Firmware names the one type it needs instead.

use super::GreenChannel;
use super::bayer::{Bayer, BayerOrder};
use super::gray::Gray;
use super::packed_rgb::{Rgb24, Rgbx32, Xrgb32};
use super::packed_ycbcr::{Uyvy, Yuyv};
use super::planar_ycbcr::{Nv12, Yu12, Yuv422p, Yuv444p};
use super::rgb565::Rgb565;
use super::words::{Y10, Y12, Y16};
use super::ycbcr::{Exact, Linear, YcbcrEncoding};
use crate::frame::{Rows, Run};

/// A pixel format by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum PixelFormat {
    /// One byte per pixel, taken as green.
    // Recordings keep the name.
    #[cfg_attr(feature = "serde", serde(rename = "Grey"))]
    Gray,
    /// One little-endian word of 16 bits per pixel, of which 10 count.
    Y10,
    /// One little-endian word of 16 bits per pixel, of which 12 count.
    Y12,
    /// One little-endian word of 16 bits per pixel.
    Y16,
    /// R G B in memory.
    Rgb24,
    /// B G R in memory.
    Bgr24,
    /// R G B X or B G R X in memory.
    Rgbx32,
    /// X R G B or X B G R in memory.
    Xrgb32,
    /// One little-endian word of 16 bits per pixel, with 6 bits of green.
    Rgb565,
    /// One byte per site.
    Bayer8(BayerOrder),
    /// One little-endian word of 16 bits per site, of which 10 count.
    Bayer10(BayerOrder),
    /// One little-endian word of 16 bits per site, of which 12 count.
    Bayer12(BayerOrder),
    /// Y₀ Cb Y₁ Cr in memory, for two pixels.
    Yuyv,
    /// Cb Y₀ Cr Y₁ in memory, for two pixels.
    Uyvy,
    /// A plane of Y, then one of Cb Cr pairs, each for 2 × 2 pixels.
    Nv12,
    /// Planes of Y, Cb and Cr; chroma for 2 × 2 pixels.
    Yu12,
    /// Planes of Y, Cb and Cr; chroma for 2 × 1 pixels.
    Yuv422p,
    /// Planes of Y, Cb and Cr of the same size.
    Yuv444p,
}

impl PixelFormat {
    /// Returns whether the pixels are Y, Cb and Cr, so that matrix and range matter.
    pub const fn is_ycbcr(self) -> bool {
        matches!(self, Self::Yuyv | Self::Uyvy | Self::Nv12 | Self::Yu12 | Self::Yuv422p | Self::Yuv444p)
    }
}

/// The method that turns YCbCr into green: a tradeoff between speed and accuracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[non_exhaustive]
pub enum YcbcrMethod {
    /// Per pixel: [`Exact`].
    #[default]
    Exact,
    /// Once per taxel: [`Linear`].
    Linear,
}

/// Makes [`Any`] from one line per format: the name, the type, and which elements of the common sum it uses.
macro_rules! any {
    ($($name:ident($format:ty) $sum:tt;)*) => {
        /// Any of the pixel formats.
        #[derive(Clone, Copy, Debug)]
        pub struct Any(Format);

        #[derive(Clone, Copy, Debug)]
        enum Format {
            $($name($format),)*
        }

        impl GreenChannel for Any {
            type Sum = [u32; 3];

            fn full_scale(&self) -> u32 {
                match &self.0 { $(Format::$name(format) => format.full_scale(),)* }
            }

            fn row_bytes(&self, width: u16) -> usize {
                match &self.0 { $(Format::$name(format) => format.row_bytes(width),)* }
            }

            fn cell(&self) -> u16 {
                match &self.0 { $(Format::$name(format) => format.cell(),)* }
            }

            fn chroma_bytes(&self, bytes_per_row: usize, rows: u16) -> Option<usize> {
                match &self.0 { $(Format::$name(format) => format.chroma_bytes(bytes_per_row, rows),)* }
            }

            #[inline(always)]
            fn add_run(&self, sum: &mut [u32; 3], rows: &Rows<'_>, run: Run) {
                match &self.0 { $(Format::$name(format) => format.add_run(any!(@sum $sum sum), rows, run),)* }
            }

            #[inline(always)]
            fn add_block(&self, sum: &mut [u32; 3], rows: &Rows<'_>, run: Run, count: u16) {
                match &self.0 { $(Format::$name(format) => format.add_block(any!(@sum $sum sum), rows, run, count),)* }
            }

            fn total(&self, sum: &[u32; 3], pixels: u32) -> u32 {
                match &self.0 { $(Format::$name(format) => any!(@total $sum format, sum, pixels),)* }
            }
        }
    };
    (@sum one $sum:ident) => { &mut $sum[0] };
    (@sum three $sum:ident) => { $sum };
    (@total one $format:ident, $sum:ident, $pixels:ident) => { $format.total(&$sum[0], $pixels) };
    (@total three $format:ident, $sum:ident, $pixels:ident) => { $format.total($sum, $pixels) };
}

any! {
    Gray(Gray) one;
    Y10(Y10) one;
    Y12(Y12) one;
    Y16(Y16) one;
    Rgb24(Rgb24) one;
    Rgbx32(Rgbx32) one;
    Xrgb32(Xrgb32) one;
    Rgb565(Rgb565) one;
    Bayer8(Bayer<8>) one;
    Bayer10(Bayer<10>) one;
    Bayer12(Bayer<12>) one;
    Yuyv(Yuyv<Exact>) one;
    YuyvLinear(Yuyv<Linear>) three;
    Uyvy(Uyvy<Exact>) one;
    UyvyLinear(Uyvy<Linear>) three;
    Nv12(Nv12<Exact>) one;
    Nv12Linear(Nv12<Linear>) three;
    Yu12(Yu12<Exact>) one;
    Yu12Linear(Yu12<Linear>) three;
    Yuv422p(Yuv422p<Exact>) one;
    Yuv422pLinear(Yuv422p<Linear>) three;
    Yuv444p(Yuv444p<Exact>) one;
    Yuv444pLinear(Yuv444p<Linear>) three;
}

impl Any {
    /// Creates the format of this name. `color` and `method` matter only for YCbCr.
    pub const fn new(format: PixelFormat, color: YcbcrEncoding, method: YcbcrMethod) -> Self {
        let (exact, linear) = (Exact::new(color), Linear::new(color));
        Self(match (format, method) {
            (PixelFormat::Gray, _) => Format::Gray(Gray),
            (PixelFormat::Y10, _) => Format::Y10(super::words::Words),
            (PixelFormat::Y12, _) => Format::Y12(super::words::Words),
            (PixelFormat::Y16, _) => Format::Y16(super::words::Words),
            (PixelFormat::Rgb24 | PixelFormat::Bgr24, _) => Format::Rgb24(super::packed_rgb::PackedRgb),
            (PixelFormat::Rgbx32, _) => Format::Rgbx32(super::packed_rgb::PackedRgb),
            (PixelFormat::Xrgb32, _) => Format::Xrgb32(super::packed_rgb::PackedRgb),
            (PixelFormat::Rgb565, _) => Format::Rgb565(Rgb565),
            (PixelFormat::Bayer8(order), _) => Format::Bayer8(Bayer::new(order)),
            (PixelFormat::Bayer10(order), _) => Format::Bayer10(Bayer::new(order)),
            (PixelFormat::Bayer12(order), _) => Format::Bayer12(Bayer::new(order)),
            (PixelFormat::Yuyv, YcbcrMethod::Exact) => Format::Yuyv(Yuyv::new(exact)),
            (PixelFormat::Yuyv, YcbcrMethod::Linear) => Format::YuyvLinear(Yuyv::new(linear)),
            (PixelFormat::Uyvy, YcbcrMethod::Exact) => Format::Uyvy(Uyvy::new(exact)),
            (PixelFormat::Uyvy, YcbcrMethod::Linear) => Format::UyvyLinear(Uyvy::new(linear)),
            (PixelFormat::Nv12, YcbcrMethod::Exact) => Format::Nv12(Nv12::new(exact)),
            (PixelFormat::Nv12, YcbcrMethod::Linear) => Format::Nv12Linear(Nv12::new(linear)),
            (PixelFormat::Yu12, YcbcrMethod::Exact) => Format::Yu12(Yu12::new(exact)),
            (PixelFormat::Yu12, YcbcrMethod::Linear) => Format::Yu12Linear(Yu12::new(linear)),
            (PixelFormat::Yuv422p, YcbcrMethod::Exact) => Format::Yuv422p(Yuv422p::new(exact)),
            (PixelFormat::Yuv422p, YcbcrMethod::Linear) => Format::Yuv422pLinear(Yuv422p::new(linear)),
            (PixelFormat::Yuv444p, YcbcrMethod::Exact) => Format::Yuv444p(Yuv444p::new(exact)),
            (PixelFormat::Yuv444p, YcbcrMethod::Linear) => Format::Yuv444pLinear(Yuv444p::new(linear)),
        })
    }
}
