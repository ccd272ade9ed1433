//! RGB24, BGR24 and the 32-bit orders: one byte for each color.

use super::{Block, Encoder, Frame};
use wstac_host::camera::formats::FourCc;

/// Value of the byte that holds no color: opaque.
const NO_COLOR: u8 = 255;

/// Pixels of `BYTES` bytes.
#[derive(Debug)]
pub(super) struct PackedRgb<const BYTES: usize> {
    /// Positions of the bytes of red, green and blue.
    places: [usize; 3],
}

impl PackedRgb<3> {
    pub(super) const RGB: Self = Self { places: [0, 1, 2] };
    pub(super) const BGR: Self = Self { places: [2, 1, 0] };
}

impl PackedRgb<4> {
    /// Returns the order in memory of a 32-bit code, as V4L2 defines it.
    pub(super) fn of(code: FourCc) -> Self {
        let places = match &code {
            b"XB24" | b"AB24" => [0, 1, 2],
            b"BX24" | b"BA24" | b"RGB4" => [1, 2, 3],
            b"RX24" | b"RA24" => [3, 2, 1],
            // XR24, AR24, BGR4: B G R X.
            _ => [2, 1, 0],
        };
        Self { places }
    }
}

impl<const BYTES: usize> Encoder for PackedRgb<BYTES> {
    fn encode(&self, block: &Block<'_>, frame: &mut Frame) {
        let pixels = frame.row(block.top, BYTES * block.left, BYTES * block.width).as_chunks_mut::<BYTES>().0;
        for (bytes, colors) in pixels.iter_mut().zip(block.pixels()) {
            *bytes = [NO_COLOR; BYTES];
            for (place, color) in self.places.into_iter().zip(colors) {
                if let Some(byte) = bytes.get_mut(place) {
                    *byte = color as u8;
                }
            }
        }
    }
}
