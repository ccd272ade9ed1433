//! What a driver says about the meaning of Y, Cb, Cr, with V4L2's own rules for what it leaves open.

use v4l::v4l_sys as sys;
use wstac_core::green::ycbcr::{Colour, Matrix, Range};

/// Colour as `v4l2_pix_format` states it: numbers of the kernel's enumerations, which may be newer than this program.
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
    /// The nearest colour that is computed, and a note where it is not exactly the one stated.
    pub(crate) fn colour(self) -> (Colour, Option<String>) {
        let (matrix, stands_for) = self.matrix();
        let range = match self.quantization {
            sys::v4l2_quantization_V4L2_QUANTIZATION_FULL_RANGE => Range::Full,
            sys::v4l2_quantization_V4L2_QUANTIZATION_LIM_RANGE => Range::Limited,
            // V4L2_MAP_QUANTIZATION_DEFAULT, of YCbCr.
            _ if self.colorspace == sys::v4l2_colorspace_V4L2_COLORSPACE_JPEG => Range::Full,
            _ => Range::Limited,
        };
        let note = stands_for.map(|stated| {
            let used = match matrix {
                Matrix::Bt601 => "BT.601",
                Matrix::Bt709 => "BT.709",
            };
            format!("the driver states {stated}, read as {used}")
        });
        (Colour { matrix, range }, note)
    }

    /// The nearest matrix, and what it stands for where it is another. BT.2020 and SMPTE 240M are nearer to BT.709:
    /// all three weigh green with 0.68 to 0.72, BT.601 with 0.59.
    fn matrix(self) -> (Matrix, Option<String>) {
        let encoding = match self.encoding {
            // V4L2_MAP_YCBCR_ENC_DEFAULT.
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
            // xvYCC has its matrices; sYCC is BT.601's.
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_601
            | sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_XV601
            | sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_SYCC => (Matrix::Bt601, None),
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_709 | sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_XV709 => {
                (Matrix::Bt709, None)
            }
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_BT2020
            | sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_BT2020_CONST_LUM => (Matrix::Bt709, Some("BT.2020".into())),
            sys::v4l2_ycbcr_encoding_V4L2_YCBCR_ENC_SMPTE240M => (Matrix::Bt709, Some("SMPTE 240M".into())),
            other => (Matrix::Bt601, Some(format!("an unknown YCbCr encoding, number {other}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colour(colorspace: u32, encoding: u32, quantization: u32) -> (Matrix, Range, bool) {
        let (colour, note) = Colorimetry { colorspace, encoding, quantization }.colour();
        (colour.matrix, colour.range, note.is_some())
    }

    #[test]
    fn defaults_follow_the_colorspace() {
        let limited = |matrix, note| (matrix, Range::Limited, note);
        for (colorspace, expected) in [
            (0, limited(Matrix::Bt601, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_SMPTE170M, limited(Matrix::Bt601, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_SMPTE240M, limited(Matrix::Bt709, true)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_REC709, limited(Matrix::Bt709, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_470_SYSTEM_BG, limited(Matrix::Bt601, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_JPEG, (Matrix::Bt601, Range::Full, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_SRGB, limited(Matrix::Bt601, false)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_BT2020, limited(Matrix::Bt709, true)),
            (sys::v4l2_colorspace_V4L2_COLORSPACE_DCI_P3, limited(Matrix::Bt709, false)),
            (4711, limited(Matrix::Bt601, false)),
        ] {
            assert_eq!(colour(colorspace, 0, 0), expected, "colorspace {colorspace}");
        }
    }

    #[test]
    fn what_is_stated_wins_over_the_colorspace() {
        let jpeg = sys::v4l2_colorspace_V4L2_COLORSPACE_JPEG;
        assert_eq!(colour(jpeg, 2, 2), (Matrix::Bt709, Range::Limited, false));
        let rec709 = sys::v4l2_colorspace_V4L2_COLORSPACE_REC709;
        assert_eq!(colour(rec709, 1, 1), (Matrix::Bt601, Range::Full, false));
    }

    #[test]
    fn numbers_of_a_newer_kernel_are_noted() {
        for number in [9, 200, u32::MAX] {
            assert_eq!(colour(8, number, number), (Matrix::Bt601, Range::Limited, true));
        }
    }
}
