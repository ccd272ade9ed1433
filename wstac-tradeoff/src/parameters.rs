//! The parameters besides the texture model: the camera's format, the pixel stride, the kernel of the logarithm, and
//! the law from an event to its answers.

use std::fmt;

use wstac_core::frame::Stride;
use wstac_core::green::any::YcbcrMethod;

use wstac_core::model::file::Input;

use wstac_host::config::{Config, Estimator, Kernel};
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

    /// Returns its name in tables and files, the value of `WSTAC_PIXELS` that builds firmware for it, the
    /// four-character code of a camera that delivers it, and the bytes of a pixel on a board.
    fn facts(self) -> (&'static str, Option<&'static str>, &'static str, i64) {
        match self {
            Self::Gray => ("GREY", Some("GREY"), "GREY", 1),
            Self::Rgb24 => ("RGB24", Some("RGB24"), "RGB3", 3),
            Self::Rgb565 => ("RGB565", Some("RGB565"), "RGBP", 2),
            Self::Bayer8 => ("BAYER8", Some("BAYER8"), "RGGB", 1),
            Self::YuyvExact => ("YUYV exact", Some("YUYV"), "YUYV", 2),
            Self::YuyvLinear => ("YUYV linear", Some("YUYV"), "YUYV", 2),
            Self::Mjpeg => ("MJPEG", None, "MJPG", 0),
        }
    }

    /// Returns its name in tables and files.
    pub fn name(self) -> &'static str {
        self.facts().0
    }

    /// Returns the value of `WSTAC_PIXELS` that builds firmware for it, or `None` if there is none.
    pub fn pixels(self) -> Option<&'static str> {
        self.facts().1
    }

    /// Returns the four-character code of a camera that delivers it.
    pub fn code(self) -> &'static str {
        self.facts().2
    }

    /// Returns the bytes of RAM for a stripe of eight rows of 400 pixels, in addition to the firmware's.
    ///
    /// Returns `None` if no board reads the format.
    pub fn stripe_bytes(self) -> Option<i64> {
        self.pixels().map(|_| 8 * 400 * self.facts().3)
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

/// The law from an event to speed and direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnswerLaw {
    /// Arrival times of 25 taxels by a wave.
    Wave,
    /// Arrival times by coherence.
    Coherence,
    /// Arrival times by rising edges.
    Edges,
    /// Durations: the published law, or that of the study's configuration.
    Published,
}

impl AnswerLaw {
    /// All laws.
    pub const ALL: [Self; 4] = [Self::Wave, Self::Coherence, Self::Edges, Self::Published];

    /// Returns its name in tables and files, and its estimator of arrival times.
    fn facts(self) -> (&'static str, Option<Estimator>) {
        match self {
            Self::Wave => ("wave", Some(Estimator::Wave)),
            Self::Coherence => ("coherence", Some(Estimator::Coherence)),
            Self::Edges => ("edges", Some(Estimator::Edges)),
            Self::Published => ("published", None),
        }
    }

    /// Returns its name in tables and files.
    pub fn name(self) -> &'static str {
        self.facts().0
    }

    /// Returns the estimator of arrival times; `None` for the law of durations.
    pub fn estimator(self) -> Option<Estimator> {
        self.facts().1
    }

    /// Returns the law of a configuration.
    pub fn of(config: &Config) -> Self {
        let is_own = |law: &Self| law.estimator() == config.speed.estimator();
        Self::ALL.into_iter().find(is_own).unwrap_or(Self::Published)
    }

    /// Returns whether the study weighs models of this input with the law.
    ///
    /// Models of the path need arrival times. Models over time are of the published protocol, and so is the law of
    /// durations.
    pub fn is_with(self, input: Input) -> bool {
        (self == Self::Published) == (input == Input::Frames)
    }
}

/// All parameters but the texture model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The camera's format.
    pub format: Format,
    /// The pixels that are counted.
    pub stride: Stride,
    /// The kernel of the logarithm.
    pub kernel: Kernel,
    /// The law from an event to its answers.
    pub law: AnswerLaw,
}

/// All strides.
pub const STRIDES: [Stride; 4] = [Stride::One, Stride::Two, Stride::Three, Stride::Five];

/// All log kernels.
pub const KERNELS: [Kernel; 3] = [Kernel::Fixed, Kernel::Libm, Kernel::Micromath];

impl Setting {
    /// The setting that others are compared with: a camera of 8 bits of gray, and all else by default.
    pub const DEFAULT: Self =
        Self { format: Format::Gray, stride: Stride::One, kernel: Kernel::Fixed, law: AnswerLaw::Wave };
    /// The default setting with the published law.
    pub const PUBLISHED: Self = Self { law: AnswerLaw::Published, ..Self::DEFAULT };

    /// Returns whether this is the default setting of a model of this input, or of no model: with the wave, or with
    /// the published law for models over time.
    pub fn is_default_of(self, input: Option<Input>) -> bool {
        self == if input == Some(Input::Frames) { Self::PUBLISHED } else { Self::DEFAULT }
    }

    /// Returns every combination, format by format, stride by stride, logarithm by logarithm.
    pub fn all() -> Vec<Self> {
        let of_format = |format| STRIDES.into_iter().flat_map(move |stride| of_stride(format, stride));
        Format::ALL.into_iter().flat_map(of_format).collect()
    }

    /// Returns the names of format, stride, logarithm and law in maps and budgets.
    pub(super) fn names(self) -> [String; 4] {
        let Self { format, stride, kernel, law } = self;
        [format.name().to_owned(), stride.get().to_string(), kernel_name(kernel).to_owned(), law.name().to_owned()]
    }

    /// Returns a configuration with this setting's logarithm and law. Format and stride are those of the frames.
    pub(super) fn configured(self, base: &Config) -> Config {
        let mut config = base.clone();
        config.features.ln = self.kernel;
        config.speed = config.speed.with_estimator(self.law.estimator());
        config
    }
}

fn of_stride(format: Format, stride: Stride) -> impl Iterator<Item = Setting> {
    let of_kernel = move |kernel| AnswerLaw::ALL.into_iter().map(move |law| Setting { format, stride, kernel, law });
    KERNELS.into_iter().flat_map(of_kernel)
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [format, stride, ln, law] = self.names();
        write!(f, "{format}, stride {stride}, {ln} ln, law {law}")
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
    fn a_law_is_that_of_its_configuration() {
        for base in ["", "[speed]\nestimator = \"edges\"\n", "[speed]\nlaw = \"published\"\nslope = 200.0\n"] {
            for law in AnswerLaw::ALL {
                let mut config = Config::parse(base).unwrap();
                config.speed = config.speed.with_estimator(law.estimator());
                assert_eq!(AnswerLaw::of(&config), law, "{base}");
            }
        }
        let own = Config::parse("[speed]\nlaw = \"published\"\nslope = 60.0\n").unwrap();
        assert_eq!(own.speed.with_estimator(None).law(), own.speed.law());
        assert_eq!(AnswerLaw::of(&Config::default()), Setting::DEFAULT.law);
    }

    #[test]
    fn all_are_different() {
        let all = Setting::all();
        assert_eq!(all.len(), 7 * 4 * 3 * 4);
        assert!(all.iter().enumerate().all(|(n, setting)| all.iter().skip(n + 1).all(|other| other != setting)));
    }
}
