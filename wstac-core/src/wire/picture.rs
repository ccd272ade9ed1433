//! Pictures in parts: the host asks for one, and the board sends it while it goes on using frames.

use serde::{Deserialize, Serialize};

use crate::crc;

/// The largest number of bytes of a picture in one message.
pub const PICTURE_PART: usize = 160;

/// Bytes of a picture, as they came from the camera.
///
/// A board keeps no frame, so each part is of the frame that was there when the line had room. Parts come in any order,
/// and each byte of the picture in one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PicturePart<'a> {
    /// The number of the picture, one more with every request.
    pub picture: u8,
    /// The number of the frame that the bytes are of.
    #[serde(serialize_with = "super::numbers::long")]
    pub frame: u64,
    /// The place of the first byte in the picture.
    pub first: u32,
    /// The bytes, at most [`PICTURE_PART`].
    pub bytes: &'a [u8],
}

impl<'a> PicturePart<'a> {
    /// Creates a part. Bytes after the first [`PICTURE_PART`] are left out.
    pub fn new(picture: u8, frame: u64, first: u32, bytes: &'a [u8]) -> Self {
        Self { picture, frame, first, bytes: bytes.get(..PICTURE_PART).unwrap_or(bytes) }
    }

    /// Returns the CRC-32 of the place, in four bytes with the lowest first, and of the bytes.
    pub fn checksum(&self) -> u32 {
        crc::crc32(self.first.to_le_bytes().into_iter().chain(self.bytes.iter().copied()))
    }
}

/// The end of a picture: all its parts were sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct PictureEnd {
    /// The number of the picture.
    pub picture: u8,
    /// The number of its parts.
    pub parts: u16,
    /// The sum of the parts' checksums, modulo 2^32. It does not depend on their order.
    pub checksum: u32,
}

impl PictureEnd {
    /// Creates the end of a picture with so many parts and this sum of their checksums.
    pub const fn new(picture: u8, parts: u16, checksum: u32) -> Self {
        Self { picture, parts, checksum }
    }
}
