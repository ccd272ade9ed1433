//! Motion JPEG: one picture to RGB, or the reason why it is damaged.
//!
//! USB transfers lose packets, so a picture is only taken if it is whole. It has headers, the agreed size, as many
//! blocks as the size asks for, and no error on the way. Bytes before a marker are left out, tables and the end marker
//! may be missing, and segments that say nothing about pixels may be broken, because cameras send such pictures.

mod data;
mod headers;
mod tables;

use std::fmt;
use std::ops::Range;

use wstac_core::layout::FrameSize;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use self::headers::JpegReader;
use crate::reasons::LossReason;

/// The reason why a picture is refused. As text it says so about "it".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refusal {
    /// The bytes are not those of a JPEG picture.
    NoPicture,
    /// Its size is not the stream's.
    OtherSize,
    /// Its end is missing.
    Truncated,
    /// It is damaged, and how.
    Corrupt(&'static str),
    /// It is of a kind that is not decoded, and which.
    Unsupported(&'static str),
}

impl Refusal {
    /// Returns the text that says why, about "it".
    pub fn text(self) -> &'static str {
        match self {
            Self::NoPicture => "its headers are not those of a JPEG picture",
            Self::OtherSize => "it has another size than the pictures before",
            Self::Truncated => "it ends before its last block",
            Self::Corrupt(why) | Self::Unsupported(why) => why,
        }
    }

    /// Returns the reason by which the lost frame is counted.
    pub fn reason(self) -> LossReason {
        match self {
            Self::NoPicture => LossReason::NoJpeg,
            Self::OtherSize => LossReason::OtherSize,
            Self::Truncated => LossReason::TruncatedJpeg,
            Self::Corrupt(_) => LossReason::CorruptJpeg,
            Self::Unsupported(_) => LossReason::UnsupportedJpeg,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

/// Decodes the pictures of one stream into one buffer.
#[derive(Clone, Debug)]
pub struct Decoder {
    options: DecoderOptions,
    pub(crate) size: FrameSize,
    rgb: Vec<u8>,
    /// A picture as the decoder gets it.
    rewritten: Vec<u8>,
}

impl Decoder {
    /// Creates a decoder of pictures of this size.
    pub fn new(size: FrameSize) -> Self {
        let (width, height) = (usize::from(size.width()), usize::from(size.height()));
        let options = DecoderOptions::default().set_strict_mode(true).set_max_width(width).set_max_height(height);
        Self { options, size, rgb: vec![0; 3 * width * height], rewritten: Vec::new() }
    }

    /// Returns the picture as R G B bytes without padding.
    ///
    /// Bytes behind the picture's last block are ignored, because drivers pad.
    ///
    /// # Errors
    /// The picture is damaged or of another size. The text says why, about "it".
    pub fn decode(&mut self, bytes: &[u8]) -> Result<&[u8], &'static str> {
        self.picture(bytes).map_err(Refusal::text)
    }

    /// Returns the picture as [`decode`](Self::decode) does, or the kind of its refusal.
    ///
    /// # Errors
    /// The picture is damaged, of another size or of a kind that is not decoded.
    pub fn picture(&mut self, bytes: &[u8]) -> Result<&[u8], Refusal> {
        // The decoder takes three components for Y, Cb and Cr, and hands those out as they are if asked.
        let colors = if self.rewrite(bytes)? { ColorSpace::YCbCr } else { ColorSpace::RGB };
        self.decoded(colors)
    }

    /// Returns the picture as Y Cb Cr bytes without padding.
    pub(crate) fn components(&mut self, bytes: &[u8]) -> Result<&[u8], Refusal> {
        if self.rewrite(bytes)? {
            return Err(Refusal::Unsupported("its components are red, green and blue, expected Y, Cb and Cr"));
        }
        self.decoded(ColorSpace::YCbCr)
    }

    /// Checks a picture and returns whether its components are red, green and blue.
    fn rewrite(&mut self, bytes: &[u8]) -> Result<bool, Refusal> {
        JpegReader::rewrite(bytes, (self.size.width(), self.size.height()), &mut self.rewritten)
    }

    fn decoded(&mut self, colors: ColorSpace) -> Result<&[u8], Refusal> {
        let options = self.options.jpeg_set_out_colorspace(colors);
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&self.rewritten[..]), options);
        decoder.decode_into(&mut self.rgb).map_err(|_| Refusal::Corrupt("the decoder refuses it"))?;
        Ok(&self.rgb)
    }
}

/// Appends bytes without these parts of them.
fn append_without(to: &mut Vec<u8>, bytes: &[u8], extra: &[Range<usize>]) {
    let mut from = 0;
    for extra in extra {
        to.extend_from_slice(bytes.get(from..extra.start).unwrap_or_default());
        from = extra.end;
    }
    to.extend_from_slice(bytes.get(from..).unwrap_or_default());
}

/// Returns the width and the height of a picture by its headers, and its Exif data, which are empty if it has none.
pub(crate) fn picture_facts(bytes: &[u8]) -> Result<((u16, u16), &[u8]), Refusal> {
    JpegReader::headers(bytes).map(|picture| (picture.size, picture.exif))
}

#[cfg(test)]
mod tests {
    use super::*;
    use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

    const SIDE: (u16, u16) = (200, 120);

    fn size() -> FrameSize {
        FrameSize::new(SIDE.0.into(), SIDE.1.into()).unwrap()
    }

    /// Returns a soft green slope with some texture, R G B.
    fn picture() -> Vec<u8> {
        let pixel = |x: u16, y: u16| {
            let texture = (x / 8 + y / 8) % 2 * 20;
            [x / 2, u16::midpoint(x, y) + texture, y / 2].map(|color| color as u8)
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

    fn jpeg_with_restarts() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 95);
        encoder.set_restart_interval(10);
        encoder.encode(&picture(), SIDE.0, SIDE.1, ColorType::Rgb).unwrap();
        bytes
    }

    /// Returns the start and the length of the first segment with this marker.
    fn segment(bytes: &[u8], marker: u8) -> Option<(usize, usize)> {
        let mut at = 2;
        loop {
            let length = 2 + usize::from(u16::from_be_bytes([bytes[at + 2], bytes[at + 3]]));
            if bytes[at + 1] == marker {
                return Some((at, length));
            }
            if bytes[at + 1] == 0xda {
                return None;
            }
            at += length;
        }
    }

    /// Asserts that green is within a few levels of what was encoded.
    fn assert_is_the_picture(rgb: Result<&[u8], &'static str>) {
        let rgb = rgb.expect("a good picture is decoded");
        let original = picture();
        assert_eq!(rgb.len(), original.len());
        let worst = (1..rgb.len()).step_by(3).map(|at| rgb[at].abs_diff(original[at])).max();
        assert!(worst < Some(16), "off by {worst:?}");
    }

    #[test]
    fn padding_after_the_end_is_ignored() {
        for padding in [&[0; 1000][..], &[0xff; 7], &[0xff, 0xd8, 1, 2, 3]] {
            let bytes = [&jpeg(SamplingFactor::F_2_1), padding].concat();
            assert_is_the_picture(Decoder::new(size()).decode(&bytes));
        }
    }

    #[test]
    fn a_picture_that_ends_early_is_refused() {
        for whole in [jpeg(SamplingFactor::F_2_1), jpeg_with_restarts()] {
            let mut decoder = Decoder::new(size());
            for length in 0..whole.len() - 2 {
                assert!(decoder.decode(&whole[..length]).is_err(), "{length} of {} bytes", whole.len());
            }
            let expected = decoder.decode(&whole).unwrap().to_vec();
            // All blocks are there, and a part of the end marker or none.
            for length in [whole.len() - 2, whole.len() - 1] {
                assert_eq!(decoder.decode(&whole[..length]), Ok(&expected[..]));
            }
        }
    }

    /// Returns the start of the first scan's data.
    fn data(bytes: &[u8]) -> usize {
        let (at, length) = segment(bytes, 0xda).unwrap();
        at + length
    }

    /// Returns the places of the markers behind the headers.
    fn markers(bytes: &[u8]) -> Vec<usize> {
        let start = data(bytes);
        (start..bytes.len() - 1).filter(|at| bytes[*at] == 0xff && bytes[at + 1] != 0).collect()
    }

    #[test]
    fn bytes_before_a_marker_are_left_out() {
        for whole in [jpeg(SamplingFactor::F_2_1), jpeg(SamplingFactor::F_1_1), jpeg_with_restarts()] {
            let mut decoder = Decoder::new(size());
            let expected = decoder.decode(&whole).unwrap().to_vec();
            let extras = [&[0][..], &[0xff], &[0xff; 20], &[0x5a], &[0xff, 0], &[7, 0xff, 0, 0xff], &[0x5a; 40]];
            for extra in extras {
                let mut every = whole.clone();
                for at in markers(&whole).into_iter().rev() {
                    let one = [&whole[..at], extra, &whole[at..]].concat();
                    assert_eq!(decoder.decode(&one), Ok(&expected[..]), "{extra:?} before the marker at {at}");
                    every.splice(at..at, extra.iter().copied());
                }
                assert_eq!(decoder.decode(&every), Ok(&expected[..]), "{extra:?} before every marker");
                assert_eq!(decoder.decode(&every[..every.len() - 2]), Ok(&expected[..]), "{extra:?}, no end marker");
            }
        }
    }

    #[test]
    fn bytes_before_a_marker_of_the_headers_are_left_out() {
        for whole in [jpeg(SamplingFactor::F_2_1), jpeg_with_restarts()] {
            let mut decoder = Decoder::new(size());
            let expected = decoder.decode(&whole).unwrap().to_vec();
            let (data, mut at, mut starts) = (data(&whole), 2, Vec::new());
            while at < data {
                starts.push(at);
                at += 2 + usize::from(u16::from_be_bytes([whole[at + 2], whole[at + 3]]));
            }
            assert!(starts.len() > 4 && at == data, "{starts:?}, {at} of {data}");
            for extra in [&[0][..], &[0xff], &[0x5a], &[0xff, 0], &[1, 2, 3, 0xff, 0], &[0; 16]] {
                let mut every = whole.clone();
                for &at in starts.iter().rev() {
                    let one = [&whole[..at], extra, &whole[at..]].concat();
                    assert_eq!(decoder.decode(&one), Ok(&expected[..]), "{extra:?} before the segment at {at}");
                    every.splice(at..at, extra.iter().copied());
                }
                assert_eq!(decoder.decode(&every), Ok(&expected[..]), "{extra:?} before every segment");
                assert_eq!(picture_facts(&every).map(|(size, _)| size), Ok(SIDE));
            }
            for before in [&[0][..], &[0xff], &[0x5a; 16], &[0xff, 0xd8], &[0xff, 0xd8, 0xff, 0xd8, 0xff]] {
                let expected = Ok(&expected[..]);
                assert_eq!(decoder.decode(&[before, &whole].concat()), expected, "{before:?} before the start");
            }
            let far = [&[0x5a; 17], &whole[..]].concat();
            assert_eq!(decoder.picture(&far), Err(Refusal::NoPicture));
        }
    }

    #[test]
    fn a_refused_picture_says_why() {
        let (whole, restarts, mut decoder) = (jpeg(SamplingFactor::F_2_1), jpeg_with_restarts(), Decoder::new(size()));
        let mut progressive = Vec::new();
        let mut encoder = Encoder::new(&mut progressive, 95);
        encoder.set_progressive(true);
        encoder.encode(&picture(), SIDE.0, SIDE.1, ColorType::Rgb).unwrap();
        let mut without = restarts.clone();
        without.drain(markers(&restarts)[0]..markers(&restarts)[0] + 2);
        let start_of_frame = segment(&whole, 0xc0).unwrap().0;
        let with = |at: usize, byte: u8| {
            let mut other = whole.clone();
            other[start_of_frame + at] = byte;
            other
        };
        for (bytes, expected) in [
            (b"none".to_vec(), "its headers are not those of a JPEG picture"),
            (whole[..whole.len() - 9].to_vec(), "it ends before its last block"),
            (without, "a restart marker is missing"),
            ([&whole[..whole.len() - 2], &[0x5a; 65], &[0xff, 0xd9]].concat(), "it has too many bytes"),
            (progressive[..progressive.len() - 9].to_vec(), "it ends before its last block"),
            (with(4, 12), "its samples have more than 8 bits"),
            (with(1, 0xc9), "its coding is arithmetic"),
            (with(1, 0xc3), "its coding is lossless"),
            (with(1, 0xcd), "its coding is hierarchical"),
            (with(6, SIDE.1 as u8 - 1), "it has another size than the pictures before"),
            (with(8, SIDE.0 as u8 + 1), "it has another size than the pictures before"),
            (with(6, 0), "its headers state no size"),
            (with(9, 2), "it has neither 1 nor 3 components"),
        ] {
            let why = decoder.decode(&bytes).unwrap_err();
            assert!(why.starts_with(expected), "{why}, expected {expected}");
        }
        assert_is_the_picture(decoder.decode(&restarts));
    }

    #[test]
    fn a_picture_with_a_packet_missing_is_refused() {
        let (whole, mut decoder) = (jpeg(SamplingFactor::F_2_1), Decoder::new(size()));
        let start = data(&whole);
        let mut missed = 0;
        let cuts: Vec<_> = (start..whole.len() - 600).step_by(97).collect();
        for &at in &cuts {
            let cut = [&whole[..at], &whole[at + 512..]].concat();
            missed += usize::from(decoder.decode(&cut).is_ok());
        }
        assert_eq!(missed, 0, "of {}", cuts.len());
    }

    #[test]
    fn damage_and_garbage_do_no_harm() {
        let (whole, mut decoder) = (jpeg(SamplingFactor::F_2_1), Decoder::new(size()));
        let mut random = fastrand::Rng::with_seed(1);
        for _ in 0..3000 {
            let mut damaged = whole.clone();
            for _ in 0..random.u8(1..=8) {
                let at = random.usize(..damaged.len());
                damaged[at] = random.u8(..);
            }
            let _ = decoder.decode(&damaged);
        }
        for length in 0..300 {
            let mut garbage: Vec<u8> = (0..length).map(|_| random.u8(..)).collect();
            assert!(decoder.decode(&garbage).is_err());
            garbage.splice(0..0, [0xff, 0xd8]);
            assert!(decoder.decode(&garbage).is_err());
        }
        assert_is_the_picture(decoder.decode(&whole));
    }
}
