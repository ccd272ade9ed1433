//! Motion JPEG: one picture to RGB, or nothing where it is damaged.
//!
//! USB transfers lose packets, so a picture is only taken if it is whole: headers, entropy-coded data, end marker, the
//! size that was agreed on, and no error on the way.

use wstac_core::layout::FrameSize;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// An application segment that says Motion JPEG, for which a decoder fills in the standard Huffman tables. Cameras
/// leave those out to save bytes, and most leave the segment out as well.
const MOTION_JPEG: [u8; 9] = [0xff, 0xe0, 0, 7, b'A', b'V', b'I', b'1', 0];

/// Decodes the pictures of one stream into one buffer.
#[derive(Debug)]
pub struct Decoder {
    options: DecoderOptions,
    size: FrameSize,
    rgb: Vec<u8>,
    /// The picture with [`MOTION_JPEG`] put in.
    completed: Vec<u8>,
}

impl Decoder {
    /// A decoder of pictures of this size.
    pub fn new(size: FrameSize) -> Self {
        let (width, height) = (usize::from(size.width()), usize::from(size.height()));
        let options = DecoderOptions::default()
            .set_strict_mode(true)
            .set_max_width(width)
            .set_max_height(height)
            .jpeg_set_out_colorspace(ColorSpace::RGB);
        Self { options, size, rgb: vec![0; 3 * width * height], completed: Vec::new() }
    }

    /// The picture as R G B bytes without padding; nothing where it is damaged or of another size. What follows the
    /// picture's end marker is ignored: drivers pad.
    pub fn decode(&mut self, bytes: &[u8]) -> Option<&[u8]> {
        let headers = Headers::read(bytes)?;
        if headers.size != Some((self.size.width(), self.size.height())) {
            return None;
        }
        let picture = bytes.get(..headers.data + end_of_data(bytes.get(headers.data..)?)?)?;
        let picture = if headers.huffman_tables {
            picture
        } else {
            self.completed.clear();
            self.completed.extend_from_slice(&picture[..2]);
            self.completed.extend_from_slice(&MOTION_JPEG);
            self.completed.extend_from_slice(&picture[2..]);
            &self.completed
        };
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(picture), self.options);
        decoder.decode_into(&mut self.rgb).ok()?;
        Some(&self.rgb)
    }
}

/// What a picture's headers say.
struct Headers {
    /// Width and height.
    size: Option<(u16, u16)>,
    /// There are Huffman tables.
    huffman_tables: bool,
    /// Where the entropy-coded data start.
    data: usize,
}

impl Headers {
    /// Walks the segments up to the start of scan; nothing where they are no JPEG's.
    fn read(bytes: &[u8]) -> Option<Self> {
        if bytes.get(..2)? != [0xff, 0xd8] {
            return None;
        }
        let mut headers = Self { size: None, huffman_tables: false, data: 2 };
        loop {
            let rest = bytes.get(headers.data..)?;
            let [0xff, marker, ..] = *rest else { return None };
            if marker == 0xff {
                // A fill byte.
                headers.data += 1;
                continue;
            }
            let length = usize::from(u16::from_be_bytes([*rest.get(2)?, *rest.get(3)?]));
            match marker {
                0xc4 => headers.huffman_tables = true,
                // Start of frame: precision, height, width.
                0xc0..=0xc3 | 0xc5..=0xcf if marker != 0xc8 && marker != 0xcc => {
                    let [h1, h2, w1, w2] = *rest.get(5..9)?.as_array()?;
                    headers.size = Some((u16::from_be_bytes([w1, w2]), u16::from_be_bytes([h1, h2])));
                }
                _ => {}
            }
            headers.data += 2 + length.max(2);
            if marker == 0xda {
                return Some(headers);
            }
        }
    }
}

/// Bytes up to and with the end marker. In entropy-coded data every 0xff is followed by 0 or by a restart marker, so
/// nothing else looks like it.
fn end_of_data(data: &[u8]) -> Option<usize> {
    data.windows(2).position(|pair| pair == [0xff, 0xd9]).map(|end| end + 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

    const SIDE: (u16, u16) = (200, 120);

    fn size() -> FrameSize {
        FrameSize::new(SIDE.0.into(), SIDE.1.into()).unwrap()
    }

    /// A soft green slope with some texture, R G B.
    fn picture() -> Vec<u8> {
        let pixel = |x: u16, y: u16| {
            let texture = (x / 8 + y / 8) % 2 * 20;
            [x / 2, (x + y) / 2 + texture, y / 2].map(|colour| colour as u8)
        };
        (0..SIDE.1).flat_map(|y| (0..SIDE.0).flat_map(move |x| pixel(x, y))).collect()
    }

    fn jpeg(sampling: SamplingFactor) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 95);
        encoder.set_sampling_factor(sampling);
        encoder.encode(&picture(), SIDE.0, SIDE.1, ColorType::Rgb).unwrap();
        bytes
    }

    /// Where the first segment with this marker starts and how long it is.
    fn segment(bytes: &[u8], marker: u8) -> Option<(usize, usize)> {
        let mut at = 2;
        while bytes[at + 1] != 0xda {
            let length = 2 + usize::from(u16::from_be_bytes([bytes[at + 2], bytes[at + 3]]));
            if bytes[at + 1] == marker {
                return Some((at, length));
            }
            at += length;
        }
        None
    }

    fn without_huffman_tables(mut bytes: Vec<u8>) -> Vec<u8> {
        while let Some((at, length)) = segment(&bytes, 0xc4) {
            bytes.drain(at..at + length);
        }
        bytes
    }

    /// Green is within a few levels of what was encoded.
    fn assert_is_the_picture(rgb: Option<&[u8]>) {
        let rgb = rgb.expect("a good picture is decoded");
        let original = picture();
        assert_eq!(rgb.len(), original.len());
        let worst = (1..rgb.len()).step_by(3).map(|at| rgb[at].abs_diff(original[at])).max();
        assert!(worst < Some(16), "off by {worst:?}");
    }

    #[test]
    fn good_pictures_are_decoded() {
        for sampling in [SamplingFactor::F_1_1, SamplingFactor::F_2_1, SamplingFactor::F_2_2] {
            assert_is_the_picture(Decoder::new(size()).decode(&jpeg(sampling)));
        }
    }

    #[test]
    fn huffman_tables_may_be_left_out() {
        let bytes = without_huffman_tables(jpeg(SamplingFactor::F_2_1));
        assert_eq!(segment(&bytes, 0xc4), None);
        assert_is_the_picture(Decoder::new(size()).decode(&bytes));
    }

    #[test]
    fn padding_after_the_end_is_ignored() {
        for padding in [&[0; 1000][..], &[0xff; 7], &[0xff, 0xd8, 1, 2, 3]] {
            let bytes = [&jpeg(SamplingFactor::F_2_1), padding].concat();
            assert_is_the_picture(Decoder::new(size()).decode(&bytes));
        }
    }

    #[test]
    fn a_picture_that_ends_early_is_none() {
        let (whole, mut decoder) = (jpeg(SamplingFactor::F_2_1), Decoder::new(size()));
        for length in 0..whole.len() {
            assert!(decoder.decode(&whole[..length]).is_none(), "{length} of {} bytes", whole.len());
        }
        assert_is_the_picture(decoder.decode(&whole));
    }

    #[test]
    fn another_size_is_none() {
        let bytes = jpeg(SamplingFactor::F_2_1);
        for (width, height) in [(SIDE.0 + 1, SIDE.1), (SIDE.0, SIDE.1 - 1), (SIDE.1, SIDE.0), (1280, 720)] {
            let other = FrameSize::new(width.into(), height.into()).unwrap();
            assert!(Decoder::new(other).decode(&bytes).is_none());
        }
    }

    #[test]
    fn damage_and_garbage_do_no_harm() {
        let (whole, mut decoder) = (jpeg(SamplingFactor::F_2_1), Decoder::new(size()));
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as usize
        };
        for _ in 0..3000 {
            let mut damaged = whole.clone();
            for _ in 0..=random() % 8 {
                let at = random() % damaged.len();
                damaged[at] = random() as u8;
            }
            let _ = decoder.decode(&damaged);
        }
        for length in 0..300 {
            let mut garbage: Vec<u8> = (0..length).map(|_| random() as u8).collect();
            assert!(decoder.decode(&garbage).is_none());
            garbage.splice(0..0, [0xff, 0xd8]);
            assert!(decoder.decode(&garbage).is_none());
        }
        assert_is_the_picture(decoder.decode(&whole));
    }
}
