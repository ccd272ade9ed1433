//! The meaning of Y, Cb, Cr by a driver, with V4L2's own rules for what it leaves open.

use v4l::v4l_sys as sys;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};

/// Color as `v4l2_pix_format` states it. The numbers are of the kernel's enumerations, which may be newer than this
/// program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Colorimetry {
    /// `enum v4l2_colorspace`.
    pub colorspace: u32,
    /// `enum v4l2_ycbcr_encoding`.
    pub encoding: u32,
    /// `enum v4l2_quantization`.
    pub quantization: u32,
}

impl Colorimetry {
    /// Returns the nearest color that is supported, and a note if it is not exactly the stated one.
    pub(crate) fn color(self) -> (YcbcrEncoding, Option<String>) {
        let (matrix, stands_for) = self.matrix();
        let range = match self.quantization {
            sys::v4l2_quantization_V4L2_QUANTIZATION_FULL_RANGE => QuantizationRange::Full,
            sys::v4l2_quantization_V4L2_QUANTIZATION_LIM_RANGE => QuantizationRange::Limited,
            // This is V4L2_MAP_QUANTIZATION_DEFAULT, for YCbCr.
            _ if self.colorspace == sys::v4l2_colorspace_V4L2_COLORSPACE_JPEG => QuantizationRange::Full,
            _ => QuantizationRange::Limited,
        };
        let note = stands_for.map(|stated| format!("the driver states {stated}, read as {}", matrix.name()));
        (YcbcrEncoding { matrix, range }, note)
    }

    /// Returns the nearest matrix, and the name of the stated one if it is another.
    ///
    /// BT.2020 and SMPTE 240M are nearer to BT.709: all three weigh green with 0.68 to 0.72, BT.601 with 0.59.
    fn matrix(self) -> (YcbcrMatrix, Option<String>) {
        let encoding = match self.encoding {
            // This is V4L2_MAP_YCBCR_ENC_DEFAULT.
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_DEFAULT => match self.colorspace {
                sys::v4l2_colorspace_V4L2_COLORSPACE_REC709 | sys::v4l2_colorspace_V4L2_COLORSPACE_DCI_P3 => {
                    sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_709
                }
                sys::v4l2_colorspace_V4L2_COLORSPACE_BT2020 => sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_BT2020,
                sys::v4l2_colorspace_V4L2_COLORSPACE_SMPTE240M => sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_SMPTE240M,
                _ => sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_601,
            },
            stated => stated,
        };
        match encoding {
            // The encoding xvYCC has its matrices; sYCC has that of BT.601.
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_601
            | sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_XV601
            | sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_SYCC => (YcbcrMatrix::Bt601, None),
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_709 | sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_XV709 => {
                (YcbcrMatrix::Bt709, None)
            }
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_BT2020
            | sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_BT2020_CONST_LUM => (YcbcrMatrix::Bt709, Some("BT.2020".into())),
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_SMPTE240M => (YcbcrMatrix::Bt709, Some("SMPTE 240M".into())),
            other => (YcbcrMatrix::Bt601, Some(format!("an unknown YCbCr encoding, number {other}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn color(colorspace: u32, encoding: u32, quantization: u32) -> (YcbcrMatrix, QuantizationRange, bool) {
        let (color, note) = Colorimetry { colorspace, encoding, quantization }.color();
        (color.matrix, color.range, note.is_some())
    }

    #[test]
    fn defaults_follow_the_colorspace() {
        let limited = |matrix, note| (matrix, QuantizationRange::Limited, note);
        for (colorspace, expected) in [
            (0, limited(YcbcrMatrix::Bt601, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_SMPTE170M, limited(YcbcrMatrix::Bt601, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_SMPTE240M, limited(YcbcrMatrix::Bt709, true)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_REC709, limited(YcbcrMatrix::Bt709, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_470_SYSTEM_BG, limited(YcbcrMatrix::Bt601, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_JPEG, (YcbcrMatrix::Bt601, QuantizationRange::Full, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_SRGB, limited(YcbcrMatrix::Bt601, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_BT2020, limited(YcbcrMatrix::Bt709, true)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_DCI_P3, limited(YcbcrMatrix::Bt709, false)),
            (4711, limited(YcbcrMatrix::Bt601, false)),
        ] {
            assert_eq!(color(colorspace, 0, 0), expected, "colorspace {colorspace}");
        }
    }

    #[test]
    fn what_is_stated_wins_over_the_colorspace() {
        let jpeg = sys::v4l2_colorspace_V4L2_COLORSPACE_JPEG;
        assert_eq!(color(jpeg, 2, 2), (YcbcrMatrix::Bt709, QuantizationRange::Limited, false));
        let rec709 = sys::v4l2_colorspace_V4L2_COLORSPACE_REC709;
        assert_eq!(color(rec709, 1, 1), (YcbcrMatrix::Bt601, QuantizationRange::Full, false));
    }

    #[test]
    fn numbers_of_a_newer_kernel_are_noted() {
        for number in [9, 200, u32::MAX] {
            assert_eq!(color(8, number, number), (YcbcrMatrix::Bt601, QuantizationRange::Limited, true));
        }
    }
}
