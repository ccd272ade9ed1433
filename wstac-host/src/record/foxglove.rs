//! Messages that viewers know: Foxglove's schemas in protocol buffers, and one of ROS 2.
//!
//! An MCAP file carries a schema of protocol buffers as a `FileDescriptorSet`, which [`SchemaFacts::data`] has.
//! `messages.rs` and the descriptors beside it are written by `ci/generated protobuf --write`.

#[allow(dead_code, unreachable_pub, clippy::pedantic, reason = "generated")]
mod messages;

use prost::Message;
use prost::encoding::{DecodeContext, WireType, decode_key, skip_field};
use prost_types::Timestamp;
use wstac_core::params::{FEATURES, TAXELS};

pub(crate) use self::messages::log::Level;
use self::messages::{CompressedImage, Log, RawImage};
use super::schema;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Schema {
    RawImage,
    CompressedImage,
    Log,
    /// `std_msgs/msg/Float64MultiArray`.
    Float64MultiArray,
    /// A line of `wstac run --json`.
    Record,
    /// `std_msgs/msg/UInt32MultiArray`.
    UInt32MultiArray,
}

/// Returns the text of a message of `std_msgs` that has an array of these numbers.
macro_rules! multi_array {
    ($number:literal) => {
        concat!("MultiArrayLayout layout\n", $number, "[] data\n", include_str!("foxglove/MultiArray.txt"))
    };
}

/// A schema's part of an MCAP file.
pub(crate) struct SchemaFacts {
    pub(crate) name: &'static str,
    /// The encodings of the schema and of its messages.
    pub(crate) encodings: [&'static str; 2],
    /// Its text or descriptor.
    pub(crate) data: &'static [u8],
}

impl Schema {
    /// Returns its number in every recording.
    pub(crate) fn number(self) -> u16 {
        self as u16 + 1
    }

    pub(crate) fn facts(self) -> SchemaFacts {
        const PROTOBUF: [&str; 2] = ["protobuf"; 2];
        const ROS: [&str; 2] = ["ros2msg", "cdr"];
        let (name, encodings, data): (_, _, &[u8]) = match self {
            Self::RawImage => ("foxglove.RawImage", PROTOBUF, include_bytes!("foxglove/RawImage.binpb")),
            Self::CompressedImage => {
                ("foxglove.CompressedImage", PROTOBUF, include_bytes!("foxglove/CompressedImage.binpb"))
            }
            Self::Log => ("foxglove.Log", PROTOBUF, include_bytes!("foxglove/Log.binpb")),
            Self::Float64MultiArray => ("std_msgs/msg/Float64MultiArray", ROS, multi_array!("float64").as_bytes()),
            Self::Record => ("wstac.Record", ["jsonschema", "json"], schema::record()),
            Self::UInt32MultiArray => ("std_msgs/msg/UInt32MultiArray", ROS, multi_array!("uint32").as_bytes()),
        };
        SchemaFacts { name, encodings, data }
    }
}

/// Creates a `google.protobuf.Timestamp` from nanoseconds.
fn timestamp(nanoseconds: u64) -> Timestamp {
    let second = 1_000_000_000;
    Timestamp { seconds: (nanoseconds / second) as i64, nanos: (nanoseconds % second) as i32 }
}

/// The way in which a viewer shows bytes as a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RawImageShape {
    /// Foxglove's name of the pixel format.
    pub(crate) encoding: &'static str,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Bytes from the start of a row to the start of the next.
    pub(crate) step: u32,
}

pub(crate) fn raw_image(time: u64, frame_id: &str, shape: RawImageShape, data: &[u8]) -> Vec<u8> {
    let header = RawImage {
        timestamp: Some(timestamp(time)),
        frame_id: frame_id.into(),
        width: shape.width,
        height: shape.height,
        encoding: shape.encoding.into(),
        step: shape.step,
        data: Vec::new(),
    };
    with_data(&header, RAW_DATA, data)
}

/// Encodes a `foxglove.CompressedImage` of a JPEG picture.
pub(crate) fn jpeg_image(time: u64, frame_id: &str, data: &[u8]) -> Vec<u8> {
    let header = CompressedImage {
        timestamp: Some(timestamp(time)),
        frame_id: frame_id.into(),
        format: "jpeg".into(),
        data: Vec::new(),
    };
    with_data(&header, JPEG_DATA, data)
}

/// The numbers of the fields that have a picture's bytes.
const RAW_DATA: u8 = 6;
const JPEG_DATA: u8 = 2;

/// Returns the tag of a field of bytes: its number, and wire type 2.
fn key(field: u8) -> u8 {
    field << 3 | 2
}

/// Encodes a message whose last field, of this number, is `data`.
///
/// The data are copied once, and not into a message of their own before.
fn with_data(header: &impl Message, field: u8, data: &[u8]) -> Vec<u8> {
    let mut message = Vec::with_capacity(data.len() + 100);
    // The vector grows as needed, so there is always room.
    header.encode(&mut message).unwrap_or_default();
    message.push(key(field));
    prost::encode_length_delimiter(data.len(), &mut message).unwrap_or_default();
    message.extend_from_slice(data);
    message
}

/// Returns the picture in a `foxglove.RawImage` or, if `compressed`, in a `foxglove.CompressedImage`; `None` if the
/// bytes are no such message.
///
/// The picture is not copied, and the other fields are passed over.
pub(crate) fn picture_of(message: &[u8], compressed: bool) -> Option<&[u8]> {
    let wanted = (if compressed { JPEG_DATA } else { RAW_DATA }).into();
    let (mut rest, mut picture) = (message, &[][..]);
    while !rest.is_empty() {
        let (field, kind) = decode_key(&mut rest).ok()?;
        let mut bytes = rest;
        skip_field(kind, field, &mut rest, DecodeContext::default()).ok()?;
        if (field, kind) == (wanted, WireType::LengthDelimited) {
            let length = prost::decode_length_delimiter(&mut bytes).ok()?;
            picture = bytes.get(..length)?;
        }
    }
    Some(picture)
}

pub(crate) fn log(time: u64, level: Level, message: &str) -> Vec<u8> {
    let log = Log {
        timestamp: Some(timestamp(time)),
        level: level.into(),
        message: message.into(),
        name: "wstac".into(),
        ..Log::default()
    };
    log.encode_to_vec()
}

/// Encodes the 25 taxels, row by row, as a `foxglove.RawImage` of 5 × 5 numbers.
pub(crate) fn taxels(time: u64, taxels: &[f32; TAXELS]) -> Vec<u8> {
    let data: Vec<u8> = taxels.iter().flat_map(|taxel| taxel.to_le_bytes()).collect();
    raw_image(time, "taxels", RawImageShape { encoding: "32FC1", width: 5, height: 5, step: 20 }, &data)
}

/// Encodes the ten features as a `std_msgs/msg/Float64MultiArray` in little-endian CDR: no dimensions, offset 0, the
/// numbers.
pub(crate) fn features(features: &[f64; FEATURES]) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    for word in [0, 0, FEATURES as u32, 0] {
        // The last word is padding, because numbers of 8 bytes are aligned.
        message.extend(word.to_le_bytes());
    }
    message.extend(features.iter().flat_map(|feature| feature.to_le_bytes()));
    message
}

/// Encodes the 25 taxel sums as a `std_msgs/msg/UInt32MultiArray` in little-endian CDR: no dimensions, offset 0, the
/// numbers.
pub(crate) fn taxel_sums(sums: &[u32; TAXELS]) -> Vec<u8> {
    let words = [0, 0, TAXELS as u32].iter().chain(sums).flat_map(|word| word.to_le_bytes());
    [0, 1, 0, 0].into_iter().chain(words).collect()
}

/// Returns the 25 taxel sums of a message that [`taxel_sums`] made; `None` if it is none.
pub(crate) fn read_taxel_sums(message: &[u8]) -> Option<[u32; TAXELS]> {
    let (start, numbers) = message.split_at_checked(16)?;
    let (words, []) = numbers.as_chunks::<4>() else { return None };
    let sums: [u32; TAXELS] = words.iter().map(|word| u32::from_le_bytes(*word)).collect::<Vec<_>>().try_into().ok()?;
    taxel_sums(&sums).starts_with(start).then_some(sums)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_out_as_it_went_in() {
        let shape = RawImageShape { encoding: "mono8", width: 3, height: 1, step: 3 };
        let raw = raw_image(1_500_000_000, "camera", shape, &[1, 2, 3]);
        assert_eq!(picture_of(&raw, false), Some(&[1, 2, 3][..]));
        let jpeg = jpeg_image(0, "camera", &[0xFF, 0xD8]);
        assert_eq!(picture_of(&jpeg, true), Some(&[0xFF, 0xD8][..]));
        for length in 0..raw.len() {
            // A message that is cut off between two fields is one without the fields behind.
            assert!(picture_of(&raw[..length], false).is_none_or(<[u8]>::is_empty), "{length}");
        }
        // Fields in any order, and fields that this program does not know.
        let data = [&[0x32, 3][..], &[1, 2, 3]].concat();
        for other in [&[0x7D, 1, 2, 3, 4][..], &[0x79, 1, 2, 3, 4, 5, 6, 7, 8], &[0x78, 0xFF, 1], &[0x7A, 1, 9]] {
            assert_eq!(picture_of(&[other, &data, other].concat(), false), Some(&[1, 2, 3][..]));
        }
        assert_eq!([&[0; 8][..], &[0x7B], &[0x7C]].map(|message| picture_of(message, false)), [None; 3]);
    }

    /// Checks that recordings are the same byte for byte, with any encoder.
    #[test]
    fn messages_are_these_bytes() {
        let shape = RawImageShape { encoding: "mono8", width: 3, height: 1, step: 3 };
        // The bytes are seconds 1, nanoseconds 500000000; then width, height, encoding, step, place; then the data.
        let raw = b"\x0A\x08\x08\x01\x10\x80\xCA\xB5\xEE\x01\x15\x03\0\0\0\x1D\x01\0\0\0\x22\x05mono8\x2D\x03\0\0\0\x3A\x06camera\x32\x03\x01\x02\x03";
        assert_eq!(raw_image(1_500_000_000, "camera", shape, &[1, 2, 3]), raw);
        let jpeg = b"\x0A\0\x1A\x04jpeg\x22\x06camera\x12\x82\x01".iter().copied().chain([0xFF; 130]);
        assert_eq!(jpeg_image(0, "camera", &[0xFF; 130]), jpeg.collect::<Vec<u8>>());
        assert_eq!(log(7, Level::Warning, "lost"), b"\x0A\x02\x10\x07\x10\x03\x1A\x04lost\x22\x05wstac");
        let hashes =
            [Schema::RawImage, Schema::CompressedImage, Schema::Log].map(|schema| crc32fast::hash(schema.facts().data));
        assert_eq!(hashes, [0x3F14_7E59, 0x8EE8_A511, 0x9A3B_DD9C]);
    }

    #[test]
    fn taxel_sums_are_cdr() {
        let sums = core::array::from_fn(|k| u32::MAX - k as u32);
        let message = taxel_sums(&sums);
        assert_eq!((message.len(), &message[12..16]), (4 + 12 + 100, &25_u32.to_le_bytes()[..]));
        assert_eq!(read_taxel_sums(&message), Some(sums));
        for length in 0..message.len() {
            assert_eq!(read_taxel_sums(&message[..length]), None, "{length}");
        }
        assert_eq!(read_taxel_sums(&[&message[..], &[0; 4]].concat()), None);
        for at in 0..16 {
            let mut damaged = message.clone();
            damaged[at] ^= 1;
            assert_eq!(read_taxel_sums(&damaged), None, "{at}");
        }
    }

    #[test]
    fn schemas_of_arrays_are_those_of_ros() {
        let text = String::from_utf8(Schema::Float64MultiArray.facts().data.to_vec()).unwrap();
        assert_eq!(crc32fast::hash(text.as_bytes()), 0x7C5B_3D1C);
        assert_eq!(Schema::UInt32MultiArray.facts().data, text.replacen("float64[]", "uint32[]", 1).as_bytes());
    }

    #[test]
    fn features_are_cdr() {
        let message = features(&[-1.5; FEATURES]);
        assert_eq!(message.len(), 4 + 16 + 80);
        assert_eq!(message[12..16], 10_u32.to_le_bytes());
        assert_eq!(message[20..28], (-1.5_f64).to_le_bytes());
    }
}
