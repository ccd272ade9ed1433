//! Frames as `sensor_msgs/Image`.

use std::time::SystemTime;

use wstac_host::source::StreamInfo;

use super::cdr::Cdr;
use super::messages::{Header, RosMessage};
use super::names::Type;

/// The way in which the frames of a source are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RosImageShape {
    /// A name of `sensor_msgs/image_encodings`.
    encoding: &'static str,
    width: u32,
    height: u32,
    /// Bytes from a row to the next.
    step: u32,
}

impl RosImageShape {
    /// Returns the shape of a source's pictures; `None` if it has none, or if ROS 2 has no name for their format.
    pub(crate) fn of(info: &StreamInfo) -> Option<Self> {
        let encoding = info.format.facts().ros.filter(|_| !info.taxels_only)?;
        let (width, height) = (u32::from(info.size.width()), u32::from(info.size.height()));
        Some(Self { encoding, width, height, step: info.bytes_per_row })
    }

    /// Returns a frame's message; `None` if the frame is too short.
    pub(crate) fn message(self, bytes: &[u8], stamp: SystemTime, frame_id: &str) -> Option<RosMessage> {
        let Self { encoding, width, height, step } = self;
        let bytes = bytes.get(..step as usize * height as usize)?;
        let header = Header { stamp, frame_id };
        let cdr = Cdr::new().header(header.stamp, header.frame_id).u32(height).u32(width).text(encoding);
        // Formats of 16 bits are those of V4L2, with the low byte first.
        let payload = cdr.bool(false).u32(step).bytes(bytes).finish();
        Some(RosMessage { kind: Type::Image, payload })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_core::green::any::PixelFormat;
    use wstac_core::green::bayer::BayerOrder;
    use wstac_core::layout::FrameSize;
    use wstac_core::rate::FrameRate;

    #[test]
    fn a_picture_has_the_rows_of_its_frame() {
        let size = FrameSize::new(40, 30).unwrap();
        let of = |format, bytes_per_row| {
            let mut info = StreamInfo::new("", size, format, FrameRate::NOMINAL);
            info.bytes_per_row = bytes_per_row;
            RosImageShape::of(&info)
        };
        let nv12 = of(PixelFormat::Nv12, 48).unwrap();
        assert_eq!(nv12, RosImageShape { encoding: "mono8", width: 40, height: 30, step: 48 });
        assert_eq!(of(PixelFormat::Bayer10(BayerOrder::Bggr), 80).unwrap().encoding, "bayer_bggr16");
        assert_eq!(of(PixelFormat::Rgb565, 80), None);
        // Header, sizes and texts are 64 bytes for a frame with an empty name.
        let message = nv12.message(&[7; 48 * 45], SystemTime::UNIX_EPOCH, "").unwrap();
        assert!(message.payload.ends_with(&[7; 48 * 30]) && message.payload.len() < 48 * 30 + 64);
        assert_eq!(nv12.message(&[7; 48 * 30 - 1], SystemTime::UNIX_EPOCH, ""), None);
    }
}
