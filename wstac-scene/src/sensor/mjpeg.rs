//! Motion JPEG: a rendered picture goes through a JPEG encoder and the decoder that also reads cameras' pictures.

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use wstac_core::layout::FrameSize;

use wstac_host::camera::mjpeg::Decoder;

/// The compression of pictures of one size.
#[derive(Clone, Debug)]
pub(super) struct Compression {
    size: FrameSize,
    quality: u8,
    jpeg: Vec<u8>,
    decoder: Decoder,
}

impl Compression {
    /// Creates a compression at this quality, 1..=100, with chroma for 2 × 1 pixels, as most webcams have it.
    pub(super) fn new(size: FrameSize, quality: u8) -> Self {
        Self { size, quality, jpeg: Vec::new(), decoder: Decoder::new(size) }
    }

    /// Returns the decoded R G B bytes and the picture from which they come, or `None` if the picture cannot be
    /// encoded.
    ///
    /// No size of a frame prevents encoding. Bytes outside of the taxels change with those inside.
    pub(super) fn through(&mut self, rgb: &[u8]) -> Option<(&[u8], &[u8])> {
        self.jpeg.clear();
        let mut encoder = Encoder::new(&mut self.jpeg, self.quality);
        encoder.set_sampling_factor(SamplingFactor::F_2_1);
        encoder.encode(rgb, self.size.width(), self.size.height(), ColorType::Rgb).ok()?;
        Some((self.decoder.decode(&self.jpeg).ok()?, &self.jpeg))
    }
}
