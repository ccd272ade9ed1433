//! The pixel formats that a board can be built for. Their rows can be summed as they arrive.

use std::env;

use wstac_core::green::any::YcbcrMethod;

/// A format, with its name in `WSTAC_PIXELS` and its Rust types.
pub struct Pixels {
    /// The name of the format.
    pub name: &'static str,
    /// The bytes of a pixel; for YUYV, of half a cell.
    bytes: u8,
    /// The green full scale of a pixel.
    pub full_scale: u32,
    /// The name of the format on the link.
    format: &'static str,
    kind: &'static str,
    value: &'static str,
}

/// All formats; the first is the default.
const PIXELS: [Pixels; 6] = [
    Pixels { name: "GREY", bytes: 1, full_scale: 255, format: "Gray", kind: "gray::Gray", value: "gray::Gray" },
    Pixels { name: "Y16", bytes: 2, full_scale: 65_535, format: "Y16", kind: "words::Y16", value: "words::Words" },
    Pixels {
        name: "RGB24",
        bytes: 3,
        full_scale: 255,
        format: "Rgb24",
        kind: "packed_rgb::Rgb24",
        value: "packed_rgb::PackedRgb",
    },
    Pixels {
        name: "RGB565",
        bytes: 2,
        full_scale: 255,
        format: "Rgb565",
        kind: "rgb565::Rgb565",
        value: "rgb565::Rgb565",
    },
    Pixels {
        name: "BAYER8",
        bytes: 1,
        full_scale: 255,
        format: "Bayer8(wstac_core::green::bayer::BayerOrder::Rggb)",
        kind: "bayer::Bayer<8>",
        value: "bayer::Bayer::new(wstac_core::green::bayer::BayerOrder::Rggb)",
    },
    Pixels { name: "YUYV", bytes: 2, full_scale: 255, format: "Yuyv", kind: "", value: "" },
];

impl Pixels {
    /// Returns the format of this name, or GREY if there is no name. The error lists what was expected.
    pub fn named(name: Option<&str>) -> Result<&'static Self, String> {
        let name = name.unwrap_or(PIXELS[0].name);
        if env::var_os("CARGO_FEATURE_NODE").is_some() && name != "GREY" {
            return Err(format!(
                "WSTAC_PIXELS={name}: expected GREY for boards with a camera, which capture luma alone"
            ));
        }
        let found = PIXELS.iter().find(|pixels| pixels.name == name);
        let names: Vec<_> = PIXELS.iter().map(|pixels| pixels.name).collect();
        found.ok_or_else(|| format!("WSTAC_PIXELS={name}: expected one of {} (BAYER8 is RGGB)", names.join(", ")))
    }

    /// Returns the format's items of `setup.rs`. For YUYV, `yuv` is the configured method to green.
    pub fn source(&self, yuv: YcbcrMethod) -> String {
        let color = "wstac_core::green::ycbcr::YcbcrEncoding { matrix: wstac_core::green::ycbcr::YcbcrMatrix::Bt601, \
                      range: wstac_core::green::ycbcr::QuantizationRange::Limited }";
        let (kind, value) = if self.name == "YUYV" {
            let way = format!("wstac_core::green::ycbcr::{yuv:?}");
            (format!("packed_ycbcr::Yuyv<{way}>"), format!("packed_ycbcr::Yuyv::new({way}::new({color}))"))
        } else {
            (self.kind.to_owned(), self.value.to_owned())
        };
        format!(
            "/// The type that turns the camera's pixels into green.
pub type GreenChannel = wstac_core::green::{kind};
/// The value of [`GreenChannel`]. YCbCr is BT.601 with limited range, as cameras send it.
pub const GREEN: GreenChannel = wstac_core::green::{value};
/// The pixel format that the link reports.
pub const PIXELS: PixelFormat = PixelFormat::{};
/// The bytes of a pixel in a row.
pub const PIXEL_BYTES: usize = {};
",
            self.format, self.bytes,
        )
    }
}
