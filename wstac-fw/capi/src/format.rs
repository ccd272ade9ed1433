//! Pixel formats, which a C program names by address, so that it has only the code of those that it names.

use core::mem::offset_of;

use wstac_core::features::Floor;
use wstac_core::frame::{Rows, Run};
use wstac_core::green::GreenChannel;
use wstac_core::green::any::PixelFormat;
use wstac_core::green::bayer::{Bayer, BayerOrder};
use wstac_core::green::gray::Gray;
use wstac_core::green::packed_rgb::{Rgb24, Rgbx32, Xrgb32};
use wstac_core::green::packed_ycbcr::{Uyvy, Yuyv};
use wstac_core::green::planar_ycbcr::{Nv12, Yu12};
use wstac_core::green::rgb565::Rgb565;
use wstac_core::green::words::{Y10, Y12, Y16};
use wstac_core::green::ycbcr::{Exact, Linear, YcbcrEncoding};
use wstac_core::params::DEFAULT_FLOOR_LEVELS;

use crate::status::WstacFwStatus;

/// The type that a taxel is gathered in. Most formats use only the first number.
type Sum = [u32; 3];

/// A pixel format: one of the WSTAC_FW_ constants below. A program links the code of those that it names.
pub struct WstacFwFormat {
    mark: u32,
    /// The format's name. Where one constant stands for several formats, it is the first of them.
    pub(crate) pixels: PixelFormat,
    /// The default floor of the format's pixels.
    pub(crate) floor: Floor,
    full_scale: fn() -> u32,
    row_bytes: fn(u16) -> usize,
    cell: fn() -> u16,
    chroma_bytes: fn(usize, u16) -> Option<usize>,
    add_run: fn(YcbcrEncoding, &mut Sum, &Rows<'_>, Run),
    add_block: fn(YcbcrEncoding, &mut Sum, &Rows<'_>, Run, u16),
    total: fn(YcbcrEncoding, &Sum, u32) -> u32,
}

/// The mark that distinguishes a format from anything else that a pointer may point to.
const MARK: u32 = u32::from_le_bytes(*b"WSfm");

/// Returns the default floor at a format's full scale.
const fn floor(full_scale: u32) -> Floor {
    match Floor::new(DEFAULT_FLOOR_LEVELS, full_scale) {
        Ok(floor) => floor,
        Err(_) => panic!("the default floor is below every full scale: decided at compile time"),
    }
}

/// Makes a format's table: its full scale, which numbers of the sum it uses, and the format itself for a color.
macro_rules! format {
    ($pixels:expr, $full_scale:literal, $numbers:tt, |$color:ident| $green:expr) => {{
        fn green($color: YcbcrEncoding) -> impl GreenChannel<Sum = format!(@sum $numbers)> {
            $green
        }
        WstacFwFormat {
            mark: MARK,
            pixels: $pixels,
            floor: floor($full_scale),
            full_scale: || green(YcbcrEncoding::default()).full_scale(),
            row_bytes: |width| green(YcbcrEncoding::default()).row_bytes(width),
            cell: || green(YcbcrEncoding::default()).cell(),
            chroma_bytes: |bytes_per_row, rows| green(YcbcrEncoding::default()).chroma_bytes(bytes_per_row, rows),
            add_run: |color, sum, rows, run| green(color).add_run(format!(@mut $numbers sum), rows, run),
            add_block: |color, sum, rows, run, count| {
                green(color).add_block(format!(@mut $numbers sum), rows, run, count);
            },
            total: |color, sum, pixels| green(color).total(format!(@ref $numbers sum), pixels),
        }
    }};
    (@sum one) => { u32 };
    (@sum three) => { Sum };
    (@mut one $sum:ident) => { &mut $sum[0] };
    (@mut three $sum:ident) => { $sum };
    (@ref one $sum:ident) => { &$sum[0] };
    (@ref three $sum:ident) => { $sum };
}

/// 8 bits of gray.
#[unsafe(no_mangle)]
pub static WSTAC_FW_GREY: WstacFwFormat = format!(PixelFormat::Gray, 255, one, |_color| Gray);
/// 10 bits of gray in 16-bit little-endian words.
#[unsafe(no_mangle)]
pub static WSTAC_FW_Y10: WstacFwFormat = format!(PixelFormat::Y10, 1023, one, |_color| Y10::default());
/// 12 bits of gray in 16-bit little-endian words.
#[unsafe(no_mangle)]
pub static WSTAC_FW_Y12: WstacFwFormat = format!(PixelFormat::Y12, 4095, one, |_color| Y12::default());
/// 16 bits of gray, little-endian.
#[unsafe(no_mangle)]
pub static WSTAC_FW_Y16: WstacFwFormat = format!(PixelFormat::Y16, 65535, one, |_color| Y16::default());
/// Three bytes, green in the middle: R G B and B G R.
#[unsafe(no_mangle)]
pub static WSTAC_FW_RGB24: WstacFwFormat = format!(PixelFormat::Rgb24, 255, one, |_color| Rgb24::default());
/// Four bytes, green second: R G B X and B G R X.
#[unsafe(no_mangle)]
pub static WSTAC_FW_RGBX32: WstacFwFormat = format!(PixelFormat::Rgbx32, 255, one, |_color| Rgbx32::default());
/// Four bytes, green third: X R G B and X B G R.
#[unsafe(no_mangle)]
pub static WSTAC_FW_XRGB32: WstacFwFormat = format!(PixelFormat::Xrgb32, 255, one, |_color| Xrgb32::default());
/// RGB of 5, 6 and 5 bits in 16-bit little-endian words.
#[unsafe(no_mangle)]
pub static WSTAC_FW_RGB565: WstacFwFormat = format!(PixelFormat::Rgb565, 255, one, |_color| Rgb565);
/// Bayer mosaic of 8 bits whose even rows have green second: RGGB and BGGR.
#[unsafe(no_mangle)]
pub static WSTAC_FW_RGGB8: WstacFwFormat =
    format!(PixelFormat::Bayer8(BayerOrder::Rggb), 255, one, |_color| Bayer::<8>::new(BayerOrder::Rggb));
/// Bayer mosaic of 8 bits whose even rows have green first: GRBG and GBRG.
#[unsafe(no_mangle)]
pub static WSTAC_FW_GRBG8: WstacFwFormat =
    format!(PixelFormat::Bayer8(BayerOrder::Grbg), 255, one, |_color| Bayer::<8>::new(BayerOrder::Grbg));
/// Bayer mosaic of 10 bits in 16-bit little-endian words whose even rows have green second: RGGB and BGGR.
#[unsafe(no_mangle)]
pub static WSTAC_FW_RGGB10: WstacFwFormat =
    format!(PixelFormat::Bayer10(BayerOrder::Rggb), 1023, one, |_color| Bayer::<10>::new(BayerOrder::Rggb));
/// Bayer mosaic of 10 bits in 16-bit little-endian words whose even rows have green first: GRBG and GBRG.
#[unsafe(no_mangle)]
pub static WSTAC_FW_GRBG10: WstacFwFormat =
    format!(PixelFormat::Bayer10(BayerOrder::Grbg), 1023, one, |_color| Bayer::<10>::new(BayerOrder::Grbg));
/// Bayer mosaic of 12 bits in 16-bit little-endian words whose even rows have green second: RGGB and BGGR.
#[unsafe(no_mangle)]
pub static WSTAC_FW_RGGB12: WstacFwFormat =
    format!(PixelFormat::Bayer12(BayerOrder::Rggb), 4095, one, |_color| Bayer::<12>::new(BayerOrder::Rggb));
/// Bayer mosaic of 12 bits in 16-bit little-endian words whose even rows have green first: GRBG and GBRG.
#[unsafe(no_mangle)]
pub static WSTAC_FW_GRBG12: WstacFwFormat =
    format!(PixelFormat::Bayer12(BayerOrder::Grbg), 4095, one, |_color| Bayer::<12>::new(BayerOrder::Grbg));
/// Y Cb Y Cr, green exact to the pixel.
#[unsafe(no_mangle)]
pub static WSTAC_FW_YUYV: WstacFwFormat = format!(PixelFormat::Yuyv, 255, one, |color| Yuyv::new(Exact::new(color)));
/// Y Cb Y Cr, green once per taxel, as with `[green] yuv = "linear"`. It takes fewer instructions.
#[unsafe(no_mangle)]
pub static WSTAC_FW_YUYV_LINEAR: WstacFwFormat =
    format!(PixelFormat::Yuyv, 255, three, |color| Yuyv::new(Linear::new(color)));
/// Cb Y Cr Y, green exact to the pixel.
#[unsafe(no_mangle)]
pub static WSTAC_FW_UYVY: WstacFwFormat = format!(PixelFormat::Uyvy, 255, one, |color| Uyvy::new(Exact::new(color)));
/// Cb Y Cr Y, green once per taxel, as with `[green] yuv = "linear"`. It takes fewer instructions.
#[unsafe(no_mangle)]
pub static WSTAC_FW_UYVY_LINEAR: WstacFwFormat =
    format!(PixelFormat::Uyvy, 255, three, |color| Uyvy::new(Linear::new(color)));
/// A plane of Y, then rows of Cb Cr for every 2 x 2 pixels. Whole frames only.
#[unsafe(no_mangle)]
pub static WSTAC_FW_NV12: WstacFwFormat = format!(PixelFormat::Nv12, 255, one, |color| Nv12::new(Exact::new(color)));
/// Planes of Y, of Cb and of Cr, the latter two for every 2 x 2 pixels. Whole frames only.
#[unsafe(no_mangle)]
pub static WSTAC_FW_YU12: WstacFwFormat = format!(PixelFormat::Yu12, 255, one, |color| Yu12::new(Exact::new(color)));

impl WstacFwFormat {
    /// Returns the format that a program names. It is one of this library's constants, which its mark confirms before
    /// the rest of it is read.
    ///
    /// # Errors
    /// Returns a status if it is null, not aligned, or not a format.
    ///
    /// # Safety
    /// `format` is null, or as many readable bytes as a format has.
    pub(crate) unsafe fn checked<'a>(format: *const Self) -> Result<&'a Self, WstacFwStatus> {
        if format.is_null() {
            return Err(WstacFwStatus::Null);
        }
        let mark = format.wrapping_byte_add(offset_of!(Self, mark)).cast::<u32>();
        // An unaligned address is not a format. Only the mark is read: any other field may be invalid for its type.
        // SAFETY: the caller says that these bytes are readable, and any bytes are a u32.
        if !format.is_aligned() || unsafe { mark.read_volatile() } != MARK {
            return Err(WstacFwStatus::Format);
        }
        // SAFETY: its mark says that it is a constant of this library.
        Ok(unsafe { &*format })
    }
}

/// The format that a program has chosen.
#[derive(Clone, Copy)]
pub(crate) struct Chosen {
    pub(crate) format: &'static WstacFwFormat,
    pub(crate) color: YcbcrEncoding,
}

impl GreenChannel for Chosen {
    type Sum = Sum;

    fn full_scale(&self) -> u32 {
        (self.format.full_scale)()
    }

    fn row_bytes(&self, width: u16) -> usize {
        (self.format.row_bytes)(width)
    }

    fn cell(&self) -> u16 {
        // It is never 0, which would be a divisor. Only this tells the compiler so.
        (self.format.cell)().max(1)
    }

    fn chroma_bytes(&self, bytes_per_row: usize, rows: u16) -> Option<usize> {
        (self.format.chroma_bytes)(bytes_per_row, rows)
    }

    fn add_run(&self, sum: &mut Sum, rows: &Rows<'_>, run: Run) {
        (self.format.add_run)(self.color, sum, rows, run);
    }

    fn add_block(&self, sum: &mut Sum, rows: &Rows<'_>, run: Run, count: u16) {
        (self.format.add_block)(self.color, sum, rows, run, count);
    }

    fn total(&self, sum: &Sum, pixels: u32) -> u32 {
        (self.format.total)(self.color, sum, pixels)
    }
}
