//! A pixel format that is chosen at run time, for hosts. Firmware names the one type it needs instead.

use super::ycbcr::YcbcrEncoding;
#[allow(clippy::wildcard_imports, reason = "the rows of the table name their modules")]
use super::*;

/// The method that turns YCbCr into green: a tradeoff between speed and accuracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[non_exhaustive]
pub enum YcbcrMethod {
    /// Per pixel: [`Exact`](ycbcr::Exact).
    #[default]
    Exact,
    /// Once per taxel: [`Linear`](ycbcr::Linear).
    Linear,
}

/// The facts about a pixel format that hosts need besides its green.
#[derive(Clone, Copy, Debug)]
pub struct FormatFacts {
    /// The four-character codes of V4L2, the usual one first; none if no camera has the format.
    pub codes: &'static [&'static [u8; 4]],
    /// The place in the order of preference if a camera offers several formats: the lowest number first, and of equal
    /// numbers the upper row of the table.
    pub preference: u8,
    /// The planes of a frame, one after the other.
    pub planes: &'static [Plane],
    /// The encoding of `foxglove.RawImage`; `None` if it has none, so that the bytes are shown as gray.
    pub foxglove: Option<&'static str>,
    /// The encoding of `sensor_msgs/Image`, of planes that of the first; `None` if it has none.
    pub ros: Option<&'static str>,
}

/// A plane of a frame: the bytes of all its pixels, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Columns and rows of pixels that share some bytes.
    pub unit: [u16; 2],
    /// A letter for each of those bytes: `Y`, `U` (Cb) and `V` (Cr) of YCbCr, and any other if 0 is black.
    pub bytes: &'static [u8],
}

/// Makes [`PixelFormat`] and [`Any`] of the table of formats.
macro_rules! formats {
    (@each $name:ident) => { [PixelFormat::$name] };
    (@each $name:ident $order:ident) => { bayer::BayerOrder::ALL.map(PixelFormat::$name) };
    ($d:tt |$color:ident| $(
        $(#[$about:meta])*
        $name:ident $(($order:ident: $of:ty))?: $green:ty = $make:expr
        $(, $linear:ident: $linear_green:ty = $make_linear:expr)?
        => $codes:expr, $preference:literal, [$($columns:literal x $rows:literal: $bytes:literal),+],
        $foxglove:expr, $ros:expr;
    )*) => {
        /// A pixel format by name.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        pub enum PixelFormat {
            $($(#[$about])* $name $(($of))?,)*
        }

        impl PixelFormat {
            /// Iterates over every format; over mosaics in all four orders.
            pub fn all() -> impl Iterator<Item = Self> {
                core::iter::empty()$(.chain(formats!(@each $name $($order)?)))*
            }

            /// Returns the facts about the format.
            pub const fn facts(self) -> FormatFacts {
                match self {
                    $(Self::$name $(($order))? => FormatFacts {
                        codes: $codes,
                        preference: $preference,
                        planes: &[$(Plane { unit: [$columns, $rows], bytes: $bytes }),+],
                        foxglove: $foxglove,
                        ros: $ros,
                    },)*
                }
            }
        }

        #[derive(Clone, Copy, Debug)]
        enum Format {
            $($name($green), $($linear($linear_green),)?)*
        }

        impl Any {
            /// Creates the format of this name. `color` and `method` matter only for YCbCr.
            pub const fn new(format: PixelFormat, $color: YcbcrEncoding, method: YcbcrMethod) -> Self {
                Self(match (format, method) {
                    $(
                        $((PixelFormat::$name, YcbcrMethod::Linear) => Format::$linear($make_linear),)?
                        (PixelFormat::$name $(($order))?, _) => Format::$name($make),
                    )*
                })
            }
        }

        /// Takes a value of the format that was chosen: of one with one sum, or of a linear method.
        macro_rules! each {
            ($d any:expr, |$d format:ident| $d plain:expr, $d linear:expr) => {
                match &$d any.0 {
                    $(
                        Format::$name($d format) => $d plain,
                        $(Format::$linear($d format) => $d linear,)?
                    )*
                }
            };
        }

        impl GreenChannel for Any {
            type Sum = [u32; 3];

            fn full_scale(&self) -> u32 {
                each!(self, |format| format.full_scale(), format.full_scale())
            }

            fn row_bytes(&self, width: u16) -> usize {
                each!(self, |format| format.row_bytes(width), format.row_bytes(width))
            }

            fn cell(&self) -> u16 {
                each!(self, |format| format.cell(), format.cell())
            }

            fn chroma_bytes(&self, bytes_per_row: usize, rows: u16) -> Option<usize> {
                each!(self, |format| format.chroma_bytes(bytes_per_row, rows), format.chroma_bytes(bytes_per_row, rows))
            }

            // A build for tests compiles both here, where they are optimized: inlined, they are built again, and as
            // slow as whatever calls them.
            #[cfg_attr(not(debug_assertions), inline(always))]
            fn add_run(&self, sum: &mut [u32; 3], rows: &Rows<'_>, run: Run) {
                each!(self, |format| format.add_run(&mut sum[0], rows, run), format.add_run(sum, rows, run))
            }

            #[cfg_attr(not(debug_assertions), inline(always))]
            fn add_block(&self, sum: &mut [u32; 3], rows: &Rows<'_>, run: Run, count: u16) {
                each!(
                    self,
                    |format| format.add_block(&mut sum[0], rows, run, count),
                    format.add_block(sum, rows, run, count)
                )
            }

            fn total(&self, sum: &[u32; 3], pixels: u32) -> u32 {
                each!(self, |format| format.total(&sum[0], pixels), format.total(sum, pixels))
            }
        }
    };
}

/// The names of mosaics in pictures, in the order of [`bayer::BayerOrder::ALL`].
const BAYER_8: [&str; 4] = ["bayer_rggb8", "bayer_grbg8", "bayer_gbrg8", "bayer_bggr8"];
const BAYER_16: [&str; 4] = ["bayer_rggb16", "bayer_grbg16", "bayer_gbrg16", "bayer_bggr16"];

table!(formats $);

impl PixelFormat {
    /// Returns whether the pixels are Y, Cb and Cr, so that matrix and range matter.
    pub const fn is_ycbcr(self) -> bool {
        matches!(self.facts().planes, [Plane { bytes: [b'Y', ..] | [_, b'Y', ..], .. }, ..])
    }
}

/// Any of the pixel formats.
#[derive(Clone, Copy, Debug)]
pub struct Any(Format);
