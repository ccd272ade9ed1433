//! Motion JPEG: a rendered picture goes through a JPEG encoder and the decoder that cameras' pictures go through.

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use wstac_core::layout::FrameSize;

use wstac_host::camera::mjpeg::Decoder;

/// What compression makes of pictures of one size.
#[derive(Clone, Debug)]
pub(super) struct Compression {
    size: FrameSize,
    quality: u8,
    jpeg: Vec<u8>,
    decoder: Decoder,
}

impl Compression {
    /// Compression at this quality, 1..=100, with chroma for 2 × 1 pixels, as most webcams have it.
    pub(super) fn new(size: FrameSize, quality: u8) -> Self {
        Self { size, quality, jpeg: Vec::new(), decoder: Decoder::new(size) }
    }

    /// R G B bytes as they are decoded, and the picture that they come from; nothing where the picture cannot be encoded, which no size of a frame makes
    /// happen. Bytes outside of the taxels change with those inside.
    pub(super) fn through(&mut self, rgb: &[u8]) -> Option<(&[u8], &[u8])> {
        self.jpeg.clear();
        let mut encoder = Encoder::new(&mut self.jpeg, self.quality);
        encoder.set_sampling_factor(SamplingFactor::F_2_1);
        encoder.encode(rgb, self.size.width(), self.size.height(), ColorType::Rgb).ok()?;
        Some((self.decoder.decode(&self.jpeg)?, &self.jpeg))
    }
}
