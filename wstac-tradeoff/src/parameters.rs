//! The parameters before a sample: the camera's format, the pixel stride and the kernel of the logarithm.

use std::fmt;

use wstac_core::frame::Stride;
use wstac_core::green::any::YcbcrMethod;

use wstac_host::config::Kernel;
use wstac_scene::sensor::SensorFormat;

/// A camera's pixel format, and its conversion to green.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// 8 bits of gray.
    Gray,
    /// R G B, one byte each.
    Rgb24,
    /// 16-bit words of 5, 6 and 5 bits.
    Rgb565,
    /// A mosaic of 8 bits, RGGB.
    Bayer8,
    /// Y Cb Y Cr, with green computed for every pixel.
    YuyvExact,
    /// Y Cb Y Cr, with green computed once for each taxel.
    YuyvLinear,
    /// JPEG pictures, decoded to R G B; only on a host.
    Mjpeg,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 7] =
        [Self::Gray, Self::Rgb24, Self::Rgb565, Self::Bayer8, Self::YuyvExact, Self::YuyvLinear, Self::Mjpeg];

    /// Returns its name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gray => "GREY",
            Self::Rgb24 => "RGB24",
            Self::Rgb565 => "RGB565",
            Self::Bayer8 => "BAYER8",
            Self::YuyvExact => "YUYV exact",
            Self::YuyvLinear => "YUYV linear",
            Self::Mjpeg => "MJPEG",
        }
    }

    /// Returns the value of `WSTAC_PIXELS` that builds firmware for it, or `None` if there is none.
    pub fn pixels(self) -> Option<&'static str> {
        match self {
            Self::YuyvExact | Self::YuyvLinear => Some("YUYV"),
            Self::Mjpeg => None,
            other => Some(other.name()),
        }
    }

    /// Returns the four-character code of a camera that delivers it.
    pub fn code(self) -> &'static str {
        match self {
            Self::Gray => "GREY",
            Self::Rgb24 => "RGB3",
            Self::Rgb565 => "RGBP",
            Self::Bayer8 => "RGGB",
            Self::YuyvExact | Self::YuyvLinear => "YUYV",
            Self::Mjpeg => "MJPG",
        }
    }

    /// Returns the format of a simulated camera that delivers it.
    pub fn sensor(self) -> SensorFormat {
        // Every code above is valid (a test checks this).
        self.code().parse().unwrap_or_default()
    }

    /// Returns the conversion of YCbCr to green.
    pub fn method(self) -> YcbcrMethod {
        if self == Self::YuyvLinear { YcbcrMethod::Linear } else { YcbcrMethod::Exact }
    }

    /// Returns `true` if its camera has three colors under every pixel.
    ///
    /// Then [`Format::Rgb24`] of the same shot contains all that it saw.
    pub fn is_colored(self) -> bool {
        !matches!(self, Self::Gray | Self::Bayer8)
    }
}

/// All parameters between a camera and features.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The camera's format.
    pub format: Format,
    /// The pixels that are counted.
    pub stride: Stride,
    /// The kernel of the logarithm.
    pub kernel: Kernel,
}

/// All strides.
pub const STRIDES: [Stride; 4] = [Stride::One, Stride::Two, Stride::Three, Stride::Five];

/// All log kernels.
pub const KERNELS: [Kernel; 3] = [Kernel::Fixed, Kernel::Libm, Kernel::Micromath];

impl Setting {
    /// The setting of an empty configuration file, with a camera of 8 bits of gray.
    pub const DEFAULT: Self = Self { format: Format::Gray, stride: Stride::One, kernel: Kernel::Fixed };

    /// Returns every combination, format by format, stride by stride.
    pub fn all() -> Vec<Self> {
        let of_format = |format| STRIDES.into_iter().flat_map(move |stride| of_stride(format, stride));
        Format::ALL.into_iter().flat_map(of_format).collect()
    }

    /// Returns the default setting and all that differ from it in one parameter.
    pub fn one_at_a_time() -> Vec<Self> {
        let differs = |setting: &Self| {
            usize::from(setting.format != Self::DEFAULT.format)
                + usize::from(setting.stride != Self::DEFAULT.stride)
                + usize::from(setting.kernel != Self::DEFAULT.kernel)
        };
        Self::all().into_iter().filter(|setting| differs(setting) <= 1).collect()
    }
}

fn of_stride(format: Format, stride: Stride) -> impl Iterator<Item = Setting> {
    KERNELS.into_iter().map(move |kernel| Setting { format, stride, kernel })
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, stride {}, {} ln", self.format.name(), self.stride.get(), kernel_name(self.kernel))
    }
}

/// Returns a kernel's name in a configuration file.
pub fn kernel_name(kernel: Kernel) -> &'static str {
    match kernel {
        Kernel::Fixed => "fixed",
        Kernel::Libm => "libm",
        Kernel::Micromath => "micromath",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_has_a_camera() {
        for format in Format::ALL {
            assert_eq!(format.code().parse(), Ok(format.sensor()), "{format:?}");
            assert_eq!(format.sensor().is_jpeg(), format == Format::Mjpeg);
        }
    }

    #[test]
    fn all_are_different_and_one_at_a_time_are_some_of_them() {
        let all = Setting::all();
        assert_eq!(all.len(), 7 * 4 * 3);
        assert!(all.iter().enumerate().all(|(n, setting)| all.iter().skip(n + 1).all(|other| other != setting)));
        assert_eq!(Setting::one_at_a_time().len(), 7 + 3 + 2);
    }
}
