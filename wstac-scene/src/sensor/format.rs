//! The pixel format of a simulated camera, by its four-character code.

use std::fmt;
use std::str::FromStr;

use wstac_core::green::any::PixelFormat;

use wstac_host::camera::formats::{self, Coding, FourCc};

/// One of the four-character codes that cameras can deliver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorFormat {
    code: FourCc,
    coding: Coding,
}

impl SensorFormat {
    /// 8 bits of gray, the default.
    pub const GREY: Self = Self { code: *b"GREY", coding: Coding::Raw(PixelFormat::Gray) };

    /// Returns the format of a code, or `None` if no camera is read in it.
    pub fn new(code: FourCc) -> Option<Self> {
        formats::coding(code).map(|coding| Self { code, coding })
    }

    /// Returns its code.
    pub fn code(self) -> FourCc {
        self.code
    }

    /// Returns the pixel format of the delivered bytes; for a JPEG picture, that of the decoded bytes.
    pub fn pixels(self) -> PixelFormat {
        match self.coding {
            Coding::Raw(format) => format,
            Coding::Jpeg => PixelFormat::Rgb24,
        }
    }

    /// Returns `true` if frames go through a JPEG picture.
    pub fn is_jpeg(self) -> bool {
        self.coding == Coding::Jpeg
    }

    /// Returns `true` if its bytes hold green itself, so that a taxel's sum can be computed without them.
    pub fn stores_green(self) -> bool {
        !self.is_jpeg() && !self.pixels().is_ycbcr()
    }
}

impl Default for SensorFormat {
    fn default() -> Self {
        Self::GREY
    }
}

impl fmt::Display for SensorFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&formats::name(self.code))
    }
}

impl FromStr for SensorFormat {
    type Err = String;

    /// Returns the format of a code; spaces at its end may be left out. An error names the text found and the codes
    /// expected.
    fn from_str(text: &str) -> Result<Self, String> {
        let code = FourCc::try_from(format!("{text:<4}").as_bytes()).ok();
        let unknown = || format!("format is {text:?}, expected one of {}", formats::readable());
        code.and_then(Self::new).ok_or_else(unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_read_with_and_without_their_spaces() {
        for text in ["Y10", "Y10 "] {
            let format: SensorFormat = text.parse().unwrap();
            assert_eq!((format.code(), format.pixels()), (*b"Y10 ", PixelFormat::Y10));
            assert_eq!(format.to_string(), "Y10");
        }
        assert_eq!("GREY".parse(), Ok(SensorFormat::GREY));
        for text in ["", "gray", "GREYS", "YÜY", "H264"] {
            let message = text.parse::<SensorFormat>().unwrap_err();
            assert!(message.contains(&format!("{text:?}")) && message.contains("YUYV"), "{message}");
        }
    }

    #[test]
    fn green_is_stored_by_all_but_ycbcr_and_jpeg() {
        let stores = |text: &str| text.parse::<SensorFormat>().unwrap().stores_green();
        assert!(["GREY", "Y16", "RGB3", "XR24", "RGBP", "RG10"].into_iter().all(stores));
        assert!(!["YUYV", "NV12", "422P", "MJPG", "JPEG"].into_iter().any(stores));
    }
}
