//! Messages that viewers know: Foxglove's schemas in protocol buffers, and one of ROS 2.
//!
//! Field numbers and types are those of <https://github.com/foxglove/foxglove-sdk> (`schemas/proto/foxglove`); an MCAP
//! file carries them as a `FileDescriptorSet`, which [`Schema::data`] builds.

use wstac_core::params::{FEATURES, TAXELS};

use crate::protobuf::{Field, Fields, Message};

/// A schema that messages of a recording have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Schema {
    /// `foxglove.RawImage`.
    RawImage,
    /// `foxglove.CompressedImage`.
    CompressedImage,
    /// `foxglove.Log`.
    Log,
    /// `std_msgs/msg/Float64MultiArray`.
    Float64MultiArray,
    /// A line of `wstac run --json`.
    Record,
}

/// Types of protocol buffers' fields, by their numbers in a descriptor.
const INT64: u64 = 3;
const INT32: u64 = 5;
const FIXED32: u64 = 7;
const STRING: u64 = 9;
const MESSAGE: u64 = 11;
const BYTES: u64 = 12;
const ENUM: u64 = 14;

/// Name, number, type and, where that is a message or an enumeration, its name.
type FieldRow = (&'static str, u32, u64, &'static str);

const TIMESTAMP: &str = ".google.protobuf.Timestamp";
const RAW_IMAGE: [FieldRow; 7] = [
    ("timestamp", 1, MESSAGE, TIMESTAMP),
    ("frame_id", 7, STRING, ""),
    ("width", 2, FIXED32, ""),
    ("height", 3, FIXED32, ""),
    ("encoding", 4, STRING, ""),
    ("step", 5, FIXED32, ""),
    ("data", 6, BYTES, ""),
];
const COMPRESSED_IMAGE: [FieldRow; 4] = [
    ("timestamp", 1, MESSAGE, TIMESTAMP),
    ("frame_id", 4, STRING, ""),
    ("data", 2, BYTES, ""),
    ("format", 3, STRING, ""),
];
const LOG: [FieldRow; 6] = [
    ("timestamp", 1, MESSAGE, TIMESTAMP),
    ("level", 2, ENUM, ".foxglove.Log.Level"),
    ("message", 3, STRING, ""),
    ("name", 4, STRING, ""),
    ("file", 5, STRING, ""),
    ("line", 6, FIXED32, ""),
];
const LEVELS: [&str; 6] = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];

const FLOAT64_MULTI_ARRAY: &str = "\
MultiArrayLayout layout
float64[] data
================================================================================
MSG: std_msgs/MultiArrayLayout
MultiArrayDimension[] dim
uint32 data_offset
================================================================================
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
";

impl Schema {
    /// Its name in the file.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::RawImage => "foxglove.RawImage",
            Self::CompressedImage => "foxglove.CompressedImage",
            Self::Log => "foxglove.Log",
            Self::Float64MultiArray => "std_msgs/msg/Float64MultiArray",
            Self::Record => "wstac.Record",
        }
    }

    /// How it is written down, and how its messages are.
    pub(crate) fn encodings(self) -> (&'static str, &'static str) {
        match self {
            Self::RawImage | Self::CompressedImage | Self::Log => ("protobuf", "protobuf"),
            Self::Float64MultiArray => ("ros2msg", "cdr"),
            Self::Record => ("jsonschema", "json"),
        }
    }

    /// Its text or descriptor.
    pub(crate) fn data(self) -> Vec<u8> {
        match self {
            Self::RawImage => descriptors("RawImage", &RAW_IMAGE, &[]),
            Self::CompressedImage => descriptors("CompressedImage", &COMPRESSED_IMAGE, &[]),
            Self::Log => descriptors("Log", &LOG, &LEVELS),
            Self::Float64MultiArray => FLOAT64_MULTI_ARRAY.into(),
            Self::Record => br#"{"type":"object","properties":{"kind":{"type":"string"}}}"#.into(),
        }
    }
}

/// A `FileDescriptorSet` of one message, with the file of time stamps that it needs.
fn descriptors(name: &str, fields: &[FieldRow], levels: &[&str]) -> Vec<u8> {
    let time = descriptor("Timestamp", &[("seconds", 1, INT64, ""), ("nanos", 2, INT32, "")], &[]);
    let time = file("google/protobuf/timestamp.proto", "google.protobuf").message(4, &time).bytes(12, b"proto3");
    let message = file(&format!("foxglove/{name}.proto"), "foxglove")
        .bytes(3, b"google/protobuf/timestamp.proto")
        .message(4, &descriptor(name, fields, levels))
        .bytes(12, b"proto3");
    Message::default().message(1, &time).message(1, &message).finish()
}

fn file(name: &str, package: &str) -> Message {
    Message::default().bytes(1, name.as_bytes()).bytes(2, package.as_bytes())
}

/// A `DescriptorProto`; `levels` are the values of an enumeration `Level` in it.
fn descriptor(name: &str, fields: &[FieldRow], levels: &[&str]) -> Message {
    const OPTIONAL: u64 = 1;
    let mut message = Message::default().bytes(1, name.as_bytes());
    for &(name, number, kind, of) in fields {
        let field = Message::default().bytes(1, name.as_bytes()).varint(3, number.into()).varint(4, OPTIONAL);
        let field = field.varint(5, kind);
        message = message.message(2, &if of.is_empty() { field } else { field.bytes(6, of.as_bytes()) });
    }
    if levels.is_empty() {
        return message;
    }
    let values = (0..).zip(levels).map(|(number, name)| {
        // The first is 0, which is left out as everywhere.
        Message::default().bytes(1, name.as_bytes()).varint(2, number)
    });
    let level = values.fold(Message::default().bytes(1, b"Level"), |level, value| level.message(2, &value));
    message.message(4, &level)
}

/// A `google.protobuf.Timestamp` of nanoseconds.
fn timestamp(nanoseconds: u64) -> Message {
    let second = 1_000_000_000;
    Message::default().varint(1, nanoseconds / second).varint(2, nanoseconds % second)
}

/// How a viewer shows bytes as a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    /// Foxglove's name of the pixel format.
    pub(crate) encoding: &'static str,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Bytes from row to row.
    pub(crate) step: u32,
}

/// A `foxglove.RawImage`.
pub(crate) fn raw_image(time: u64, frame_id: &str, shape: Shape, data: &[u8]) -> Vec<u8> {
    Message::with_capacity(data.len() + 100)
        .message(1, &timestamp(time))
        .fixed32(2, shape.width)
        .fixed32(3, shape.height)
        .bytes(4, shape.encoding.as_bytes())
        .fixed32(5, shape.step)
        .bytes(7, frame_id.as_bytes())
        .bytes(6, data)
        .finish()
}

/// A `foxglove.CompressedImage` of a JPEG picture.
pub(crate) fn jpeg_image(time: u64, frame_id: &str, data: &[u8]) -> Vec<u8> {
    Message::with_capacity(data.len() + 100)
        .message(1, &timestamp(time))
        .bytes(3, b"jpeg")
        .bytes(4, frame_id.as_bytes())
        .bytes(2, data)
        .finish()
}

/// The picture in a `foxglove.RawImage` or, where `compressed`, in a `foxglove.CompressedImage`.
pub(crate) fn image_data(message: &[u8], compressed: bool) -> Result<&[u8], String> {
    let wanted = if compressed { 2 } else { 6 };
    let (mut fields, mut data) = (Fields { rest: message }, &[][..]);
    while let Some((number, field)) = fields.next()? {
        if let (true, Field::Bytes(bytes)) = (number == wanted, field) {
            data = bytes;
        }
    }
    Ok(data)
}

/// How much a line of a log matters, by Foxglove's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    /// What is looked for.
    Info = 2,
    /// What is wrong.
    Warning = 3,
}

/// A `foxglove.Log`.
pub(crate) fn log(time: u64, level: Level, message: &str) -> Vec<u8> {
    Message::default()
        .message(1, &timestamp(time))
        .varint(2, level as u64)
        .bytes(3, message.as_bytes())
        .bytes(4, b"wstac")
        .finish()
}

/// The 25 taxels, row by row, as a `foxglove.RawImage` of 5 × 5 numbers.
pub(crate) fn taxels(time: u64, taxels: &[f32; TAXELS]) -> Vec<u8> {
    let data: Vec<u8> = taxels.iter().flat_map(|taxel| taxel.to_le_bytes()).collect();
    raw_image(time, "taxels", Shape { encoding: "32FC1", width: 5, height: 5, step: 20 }, &data)
}

/// The ten features as a `std_msgs/msg/Float64MultiArray` in CDR, little-endian: no dimensions, offset 0, the numbers.
pub(crate) fn features(features: &[f64; FEATURES]) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    for word in [0, 0, FEATURES as u32, 0] {
        // The last is padding: numbers of 8 bytes are aligned.
        message.extend(word.to_le_bytes());
    }
    message.extend(features.iter().flat_map(|feature| feature.to_le_bytes()));
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_comes_out_as_it_went_in() {
        let shape = Shape { encoding: "mono8", width: 3, height: 1, step: 3 };
        let raw = raw_image(1_500_000_000, "camera", shape, &[1, 2, 3]);
        assert_eq!(image_data(&raw, false), Ok(&[1, 2, 3][..]));
        // Seconds 1, nanoseconds 500000000, as protobuf writes them.
        assert_eq!(raw[..10], [10, 8, 8, 1, 16, 0x80, 0xCA, 0xB5, 0xEE, 1]);
        assert_eq!(image_data(&jpeg_image(0, "camera", &[0xFF, 0xD8]), true), Ok(&[0xFF, 0xD8][..]));
        for length in 0..raw.len() {
            let _ = image_data(&raw[..length], false);
        }
    }

    #[test]
    fn features_are_cdr() {
        let message = features(&[-1.5; FEATURES]);
        assert_eq!(message.len(), 4 + 16 + 80);
        assert_eq!(message[12..16], 10_u32.to_le_bytes());
        assert_eq!(message[20..28], (-1.5_f64).to_le_bytes());
    }
}
