//! Features as byte strings, two bytes per number, the lower first; frame numbers, written in one place; and fields
//! that an older board does not send.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{FramePart, SAMPLE_PART};
use crate::features::Features;
use crate::params::FEATURES;

const FRAME_BYTES: usize = 2 * FEATURES;

/// Serializes a frame number as postcard does. Its varint would be unrolled at each of a dozen places. One function
/// takes 1200 bytes off a Cortex-M4's code.
#[inline(never)]
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives fields by reference")]
pub(crate) fn long<S: Serializer>(number: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u64(*number)
}

/// Serializes a number of 32 bits in the same place, which writes the same bytes.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives fields by reference")]
pub(super) fn short<S: Serializer>(number: &u32, serializer: S) -> Result<S::Ok, S::Error> {
    long(&u64::from(*number), serializer)
}

/// Serializes a number that may be missing in the same place.
#[inline(never)]
#[expect(clippy::ref_option, clippy::trivially_copy_pass_by_ref, reason = "serde gives fields by reference")]
pub(super) fn maybe<S: Serializer>(number: &Option<u32>, serializer: S) -> Result<S::Ok, S::Error> {
    number.map(u64::from).serialize(serializer)
}

/// Serializes the number of a variant, as postcard does, without a case for each.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde gives fields by reference")]
pub(super) fn variant<S: Serializer>(part: &FramePart, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u8(*part as u8)
}

/// Deserializes a field at the end of a message: `None` if the message ends before it, or if it is one that this
/// version does not know.
#[expect(clippy::unnecessary_wraps, reason = "serde takes a function that may fail")]
pub(super) fn newest<'de, D, T>(deserializer: D) -> Result<Option<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Ok(Option::deserialize(deserializer).unwrap_or(None))
}

/// Deserializes the content of a message. It is not inlined, so that its bytes do not lie on the stack of every other
/// message.
#[inline(never)]
pub(super) fn apart<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<T, D::Error> {
    T::deserialize(deserializer)
}

#[inline(never)]
fn write<S: Serializer>(frames: &[Features], serializer: S) -> Result<S::Ok, S::Error> {
    let mut bytes = [0; FRAME_BYTES * SAMPLE_PART];
    for (pair, number) in bytes.as_chunks_mut::<2>().0.iter_mut().zip(frames.as_flattened()) {
        *pair = number.to_le_bytes();
    }
    serializer.serialize_bytes(bytes.get(..FRAME_BYTES * frames.len()).unwrap_or_default())
}

fn read<'de, D: Deserializer<'de>, const N: usize>(deserializer: D) -> Result<[Features; N], D::Error> {
    let bytes = <&[u8]>::deserialize(deserializer)?;
    let mut frames = [[0; FEATURES]; N];
    if bytes.len() != FRAME_BYTES * N {
        return Err(D::Error::custom("features are of another number"));
    }
    for (number, pair) in frames.as_flattened_mut().iter_mut().zip(bytes.as_chunks::<2>().0) {
        *number = i16::from_le_bytes(*pair);
    }
    Ok(frames)
}

/// Serializes the features of one frame.
pub(super) mod one {
    use super::{Deserializer, Features, Serializer};

    pub(in super::super) fn serialize<S: Serializer>(frame: &Features, serializer: S) -> Result<S::Ok, S::Error> {
        super::write(core::slice::from_ref(frame), serializer)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Features, D::Error> {
        super::read::<D, 1>(deserializer).map(|[frame]| frame)
    }
}

/// Serializes the features of a part of a sample.
pub(super) mod part {
    use super::{Deserializer, Features, SAMPLE_PART, Serializer};

    pub(in super::super) fn serialize<S: Serializer>(
        frames: &[Features; SAMPLE_PART],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        super::write(frames, serializer)
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<[Features; SAMPLE_PART], D::Error> {
        super::read(deserializer)
    }
}
