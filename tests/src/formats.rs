//! Every pixel format, by name and as the type that firmware uses.

use wstac_core::green::any::{PixelFormat, YcbcrMethod};
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};

/// The four encodings of a YCbCr stream.
pub const COLORS: [YcbcrEncoding; 4] = [
    YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Limited },
    YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Full },
    YcbcrEncoding { matrix: YcbcrMatrix::Bt709, range: QuantizationRange::Limited },
    YcbcrEncoding { matrix: YcbcrMatrix::Bt709, range: QuantizationRange::Full },
];

/// Both methods from YCbCr to green.
pub const METHODS: [YcbcrMethod; 2] = [YcbcrMethod::Exact, YcbcrMethod::Linear];

/// Returns whether chroma follows all luma, so that frames cannot come in stripes.
pub fn is_planar(format: PixelFormat) -> bool {
    format.facts().planes.len() > 1
}

/// Evaluates `$body` with `$green` bound to the format's own type, for a `PixelFormat`, `YcbcrEncoding` and
/// `YcbcrMethod`.
#[macro_export]
macro_rules! with_green_type {
    ($format:expr, $color:expr, $method:expr, $green:ident => $body:expr) => {{
        use wstac_core::green::any::{PixelFormat as F, YcbcrMethod as M};
        use wstac_core::green::{bayer, gray, packed_rgb, packed_ycbcr, planar_ycbcr, rgb565, words, ycbcr};
        let (exact, linear) = (ycbcr::Exact::new($color), ycbcr::Linear::new($color));
        $crate::with_green_type!(@match ($format, $method), $green => $body;
            (F::Gray, _) => gray::Gray,
            (F::Y10, _) => words::Y10::default(),
            (F::Y12, _) => words::Y12::default(),
            (F::Y16, _) => words::Y16::default(),
            (F::Rgb24 | F::Bgr24, _) => packed_rgb::Rgb24::default(),
            (F::Rgbx32, _) => packed_rgb::Rgbx32::default(),
            (F::Xrgb32, _) => packed_rgb::Xrgb32::default(),
            (F::Rgb565, _) => rgb565::Rgb565,
            (F::Bayer8(order), _) => bayer::Bayer::<8>::new(order),
            (F::Bayer10(order), _) => bayer::Bayer::<10>::new(order),
            (F::Bayer12(order), _) => bayer::Bayer::<12>::new(order),
            (F::Yuyv, M::Exact) => packed_ycbcr::Yuyv::new(exact),
            (F::Yuyv, M::Linear) => packed_ycbcr::Yuyv::new(linear),
            (F::Uyvy, M::Exact) => packed_ycbcr::Uyvy::new(exact),
            (F::Uyvy, M::Linear) => packed_ycbcr::Uyvy::new(linear),
            (F::Nv12, M::Exact) => planar_ycbcr::Nv12::new(exact),
            (F::Nv12, M::Linear) => planar_ycbcr::Nv12::new(linear),
            (F::Yu12, M::Exact) => planar_ycbcr::Yu12::new(exact),
            (F::Yu12, M::Linear) => planar_ycbcr::Yu12::new(linear),
            (F::Yuv422p, M::Exact) => planar_ycbcr::Yuv422p::new(exact),
            (F::Yuv422p, M::Linear) => planar_ycbcr::Yuv422p::new(linear),
            (F::Yuv444p, M::Exact) => planar_ycbcr::Yuv444p::new(exact),
            (F::Yuv444p, M::Linear) => planar_ycbcr::Yuv444p::new(linear),
        )
    }};
    (@match $what:expr, $green:ident => $body:expr; $($pattern:pat => $type:expr,)*) => {
        match $what {
            $($pattern => {
                let $green = $type;
                $body
            })*
            what => panic!("{what:?} has no type, expected one of every format and method"),
        }
    };
}
