//! Four-character codes of V4L2, and their pixel formats.

use wstac_core::green::any::PixelFormat;

/// A four-character code, as in `YUYV`; shorter names end in spaces, as in `Y10 `.
pub type FourCc = [u8; 4];

/// The content of a driver's buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Pixels of this format.
    Raw(PixelFormat),
    /// One JPEG picture.
    Jpeg,
}

/// The codes of JPEG pictures.
const JPEG: [FourCc; 2] = [*b"MJPG", *b"JPEG"];

/// Returns the content of buffers of this code; `None` if the code is not read.
pub fn coding(fourcc: FourCc) -> Option<Coding> {
    let raw = PixelFormat::all().find(|format| format.facts().codes.contains(&&fourcc));
    raw.map(Coding::Raw).or_else(|| JPEG.contains(&fourcc).then_some(Coding::Jpeg))
}

/// Returns a code's place in the order of preference, 0 first; `None` if the code is not read.
pub fn preference(fourcc: FourCc) -> Option<usize> {
    codes().position(|code| code == fourcc)
}

/// Returns the codes that are read, in the order of preference. Green straight from the bytes of a monochrome or YCbCr
/// camera comes first, the sensor's own mosaic later, lossy pictures last.
pub fn codes() -> impl Iterator<Item = FourCc> {
    let mut formats: Vec<_> = PixelFormat::all().map(PixelFormat::facts).collect();
    formats.sort_by_key(|facts| facts.preference);
    formats.into_iter().flat_map(|facts| facts.codes).copied().chain(&JPEG).copied()
}

/// Returns the codes that are read, for a person.
pub fn readable() -> String {
    list(codes())
}

/// Returns codes for a person: `GREY, Y10, YUYV`.
pub fn list(codes: impl IntoIterator<Item = FourCc>) -> String {
    codes.into_iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Returns a code for a person.
///
/// Spaces at its end are left out, bytes that do not print become `\xNN`, and big-endian codes (bit 31) end in `-BE`.
pub fn name(code: FourCc) -> String {
    let big_endian = code[3] & 0x80 != 0;
    let letters = [code[0], code[1], code[2], code[3] & 0x7f];
    let end = if big_endian { "-BE" } else { "" };
    format!("{}{end}", letters.escape_ascii().to_string().trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_core::green::bayer::BayerOrder::{Bggr, Gbrg, Grbg, Rggb};

    #[test]
    fn names_are_for_people() {
        assert_eq!(name(*b"Y10 "), "Y10");
        assert_eq!(name([b'Y', b'1', b'6', b' ' | 0x80]), "Y16-BE");
        assert_eq!(name([0, b'A', b'B', b'C']), "\\x00ABC");
        assert_eq!(list([*b"GREY", *b"Y10 "]), "GREY, Y10");
    }

    #[test]
    fn codes_are_unique() {
        for (index, code) in codes().enumerate() {
            assert_eq!(preference(code), Some(index), "{}", name(code));
        }
    }

    #[test]
    fn codes_are_in_the_order_of_preference() {
        let expected = "GREY, YUYV, UYVY, NV12, YU12, 422P, Y10, Y12, Y16, RGB3, BGR3, XR24, AR24, BGR4, XB24, AB24, \
                        BX24, BA24, RGB4, RX24, RA24, RGGB, GRBG, GBRG, BA81, RG10, BA10, GB10, BG10, RG12, BA12, \
                        GB12, BG12, RGBP, MJPG, JPEG";
        let known = codes().map(name).filter(|code| expected.split(", ").any(|expected| expected == code));
        assert_eq!(known.collect::<Vec<_>>().join(", "), expected);
    }

    #[test]
    fn what_is_not_read_is_said_to_be_unknown() {
        for code in [*b"H264", *b"PJPG", *b"NV21", *b"YVYU", *b"RGBR", *b"pBAA", [0; 4], [255; 4]] {
            assert_eq!(coding(code), None, "{}", name(code));
        }
    }

    /// Finds every code in the kernel's header under the name that its format has there.
    #[test]
    fn codes_are_those_of_the_kernels_header() {
        let header = std::fs::read_to_string("/usr/include/linux/videodev2.h");
        let Ok(header) = header else {
            eprintln!("no /usr/include/linux/videodev2.h here: not compared");
            return;
        };
        let code_of = |name: &str| {
            let define = format!("#define V4L2_PIX_FMT_{name} ");
            let line = header.lines().find(|line| line.starts_with(&define)).unwrap_or_else(|| panic!("no {name}"));
            let letters: Vec<u8> = line.split('\'').skip(1).step_by(2).map(|letter| letter.as_bytes()[0]).collect();
            FourCc::try_from(letters).unwrap()
        };
        let raw = |format| Some(Coding::Raw(format));
        for (name, expected) in [
            ("GREY", raw(PixelFormat::Gray)),
            ("Y10", raw(PixelFormat::Y10)),
            ("Y12", raw(PixelFormat::Y12)),
            ("Y16", raw(PixelFormat::Y16)),
            ("RGB24", raw(PixelFormat::Rgb24)),
            ("BGR24", raw(PixelFormat::Bgr24)),
            ("BGR32", raw(PixelFormat::Rgbx32)),
            ("XBGR32", raw(PixelFormat::Rgbx32)),
            ("ABGR32", raw(PixelFormat::Rgbx32)),
            ("RGBX32", raw(PixelFormat::Rgbx32)),
            ("RGBA32", raw(PixelFormat::Rgbx32)),
            ("RGB32", raw(PixelFormat::Xrgb32)),
            ("XRGB32", raw(PixelFormat::Xrgb32)),
            ("ARGB32", raw(PixelFormat::Xrgb32)),
            ("BGRX32", raw(PixelFormat::Xrgb32)),
            ("BGRA32", raw(PixelFormat::Xrgb32)),
            ("RGB565", raw(PixelFormat::Rgb565)),
            ("SRGGB8", raw(PixelFormat::Bayer8(Rggb))),
            ("SGRBG8", raw(PixelFormat::Bayer8(Grbg))),
            ("SGBRG8", raw(PixelFormat::Bayer8(Gbrg))),
            ("SBGGR8", raw(PixelFormat::Bayer8(Bggr))),
            ("SRGGB10", raw(PixelFormat::Bayer10(Rggb))),
            ("SGRBG10", raw(PixelFormat::Bayer10(Grbg))),
            ("SGBRG10", raw(PixelFormat::Bayer10(Gbrg))),
            ("SBGGR10", raw(PixelFormat::Bayer10(Bggr))),
            ("SRGGB12", raw(PixelFormat::Bayer12(Rggb))),
            ("SGRBG12", raw(PixelFormat::Bayer12(Grbg))),
            ("SGBRG12", raw(PixelFormat::Bayer12(Gbrg))),
            ("SBGGR12", raw(PixelFormat::Bayer12(Bggr))),
            ("YUYV", raw(PixelFormat::Yuyv)),
            ("UYVY", raw(PixelFormat::Uyvy)),
            ("NV12", raw(PixelFormat::Nv12)),
            ("YUV420", raw(PixelFormat::Yu12)),
            ("YUV422P", raw(PixelFormat::Yuv422p)),
            ("MJPEG", Some(Coding::Jpeg)),
            ("JPEG", Some(Coding::Jpeg)),
        ] {
            assert_eq!(coding(code_of(name)), expected, "{name}");
        }
    }
}
