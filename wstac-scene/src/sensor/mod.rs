//! The camera: it turns the taxels' light into noisy, quantized values in the bytes of a pixel format, or into their
//! sums.
//!
//! Equal configurations, light and random numbers give equal bytes on every machine.

pub(crate) mod auto_exposure;
mod config;
mod encode;
mod format;
mod mjpeg;
mod noise;
mod pixel;
mod pose;
mod quantized;
mod render;
mod spot;
mod taxel;
mod whole;

use serde::Deserialize;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::Layout;
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::{FrameGeometry, TaxelSums};

pub use self::config::SensorConfig;
use self::encode::{Mosaic, encoder};
pub use self::format::SensorFormat;
use self::mjpeg::Compression;
use self::pixel::Pixel;
pub use self::pose::Pose;
use self::render::Renderer;
use self::spot::Spot;
use self::taxel::TaxelSampler;
use self::whole::WholeRenderer;
use super::rng::Rng;
use wstac_host::error::{Error, ErrorKind};

/// The part of a sensor that is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Fidelity {
    /// Every pixel of every taxel.
    #[default]
    Rendered,
    /// Taxel sums drawn from their distribution, without pixels or frames.
    Taxel,
}

/// A camera that looks at 25 spots, through the paper's layout.
#[derive(Clone, Debug)]
pub struct Sensor {
    camera: FrameGeometry<Any>,
    format: PixelFormat,
    color: YcbcrEncoding,
    kind: SensorKind,
}

#[derive(Clone, Debug)]
enum SensorKind {
    /// Pictures, which go through JPEG if that is their format.
    Rendered(Box<PictureRenderer>, Option<Compression>),
    Taxel(Box<TaxelSampler>),
}

/// The part of a frame that is rendered: the pixels under whiskers if the camera looks straight on, otherwise all
/// pixels.
#[derive(Clone, Debug)]
enum PictureRenderer {
    Taxels(Renderer),
    Whole(WholeRenderer),
}

impl PictureRenderer {
    /// Returns the bytes of the next frame.
    fn expose(&mut self, light: &[f64; TAXELS]) -> &[u8] {
        match self {
            Self::Taxels(renderer) => renderer.expose(light),
            Self::Whole(renderer) => renderer.expose(light),
        }
    }
}

impl Sensor {
    /// Creates a camera with this configuration and noise.
    ///
    /// `leak` is ambient light, even over every pixel of every color, as a fraction of full scale at a gain of 1. A
    /// leak that is negative or NaN counts as 0.
    ///
    /// # Errors
    /// - [`SensorConfig::check`] fails.
    /// - The frame is too small for the layout, or its sums are too large.
    /// - Taxel sums are requested in a format that does not store green itself.
    /// - The simulator does not write frames of this format.
    ///
    /// The message names the key, the value found and the values expected.
    pub fn new(config: &SensorConfig, fidelity: Fidelity, leak: f64, rng: Rng) -> Result<Self, Error> {
        config.check().map_err(|message| Error::new(ErrorKind::Config, "scene", message))?;
        if fidelity == Fidelity::Taxel && !config.format.stores_green() {
            let expected = "one that stores green itself (GREY, Y10, Y12, Y16, RGB3, RGBP, RGGB …)";
            let message = format!("format is {}, expected {expected} with fidelity = \"taxel\"", config.format);
            return Err(Error::new(ErrorKind::Config, "scene", message));
        }
        let format = config.format.pixels();
        // A JPEG picture's own color is undone by its decoder.
        let color = if format.is_ycbcr() { config.color } else { YcbcrEncoding::default() };
        let (width, height) = config.size.into();
        let camera = Layout::paper(config.size)
            .and_then(|layout| FrameGeometry::new(Any::new(format, color, YcbcrMethod::Exact), layout, config.rate))
            .map_err(|error| {
                Error::new(ErrorKind::Config, "scene", format_args!("size is [{width}, {height}]: {error}"))
                    .caused_by(error)
            })?;
        let pixel = Pixel::new(config, camera.full_scale(), leak);
        let spot = Spot::new(camera.layout().taxel().map(usize::from), config.blur, Mosaic::of(format));
        if let (Fidelity::Taxel, Some(_)) = (fidelity, config.pose) {
            return Err(Error::new(ErrorKind::Config, "scene", "[sensor.pose] needs fidelity = \"rendered\""));
        }
        let Some(encoder) = encoder(config.format, config.color) else {
            let message = format!("format is {}, expected a format that the simulator writes", config.format);
            return Err(Error::new(ErrorKind::Unsupported, "scene", message));
        };
        let rendered = |rng| match &config.pose {
            Some(pose) => PictureRenderer::Whole(WholeRenderer::new(config, pose, &camera, &pixel, encoder, rng)),
            None => PictureRenderer::Taxels(Renderer::new(config, &camera, &pixel, &spot, encoder, rng)),
        };
        let kind = match fidelity {
            Fidelity::Taxel => SensorKind::Taxel(Box::new(TaxelSampler::new(pixel, format, &spot.green, rng))),
            Fidelity::Rendered => {
                let compression = config.format.is_jpeg().then(|| Compression::new(config.size, config.quality));
                SensorKind::Rendered(Box::new(rendered(rng)), compression)
            }
        };
        Ok(Self { camera, format, color, kind })
    }

    /// Takes a frame and returns its bytes.
    ///
    /// `light` is each taxel's mean light over the exposure, as a fraction of full scale at a gain of 1. Bytes outside
    /// of taxels stay as dark as a pixel without noise, unless the camera has a [`Pose`]. Those of JPEG pictures may
    /// differ a little. With [`Fidelity::Taxel`] there are no bytes.
    pub fn expose(&mut self, light: &[f64; TAXELS]) -> &[u8] {
        self.expose_encoded(light).0
    }

    /// Takes a frame like [`expose`](Self::expose) and also returns the decoded JPEG picture, if the format is JPEG.
    pub fn expose_encoded(&mut self, light: &[f64; TAXELS]) -> (&[u8], Option<&[u8]>) {
        let SensorKind::Rendered(picture, compression) = &mut self.kind else { return (&[], None) };
        let bytes = picture.expose(light);
        let compressed = compression.as_mut().and_then(|compression| compression.through(bytes));
        compressed.map_or((bytes, None), |(decoded, jpeg)| (decoded, Some(jpeg)))
    }

    /// Takes a frame like [`expose`](Self::expose) and returns its taxel sums S, of every pixel.
    ///
    /// With [`Fidelity::Rendered`] they are those of the rendered bytes. With [`Fidelity::Taxel`] they are drawn from
    /// the distribution of such sums. Their mean is within 0.02 of a level of 255 for each pixel, their variance within
    /// 15 %.
    pub fn sums(&mut self, light: &[f64; TAXELS]) -> [u32; TAXELS] {
        if let SensorKind::Taxel(sums) = &mut self.kind {
            return sums.next(light);
        }
        let mut accumulators = TaxelSums::new(self.camera);
        // A frame is never short: it has the length that the camera states.
        accumulators.push_frame(self.expose(light)).unwrap_or([0; TAXELS])
    }

    /// Returns the pixel format of the delivered bytes; for JPEG pictures, that of the decoded bytes.
    pub fn format(&self) -> PixelFormat {
        self.format
    }

    /// Returns the meaning of YCbCr numbers; the default if there are none.
    pub fn color(&self) -> YcbcrEncoding {
        self.color
    }

    /// Returns the positions of the taxels, snapped to cells for Bayer formats.
    pub fn layout(&self) -> &Layout {
        self.camera.layout()
    }

    /// Returns the number of pixels counted in a taxel, A.
    pub fn pixels(&self) -> u32 {
        self.camera.pixels()
    }

    /// Returns the green full scale of one pixel, G.
    pub fn full_scale(&self) -> u32 {
        self.camera.full_scale()
    }

    /// Returns the frame rate.
    pub fn rate(&self) -> FrameRate {
        self.camera.rate()
    }

    /// Returns the bytes from row to row; for planar formats, those of luma.
    pub fn bytes_per_row(&self) -> usize {
        self.camera.bytes_per_row()
    }
}

#[cfg(test)]
mod tests;
