//! A camera's frame as a viewer's picture.
//!
//! The bytes are always the camera's own. If viewers have no name for a format, its bytes are shown as gray numbers. A
//! mosaic of 10 bits becomes 16-bit gray, and planes are placed one below the other. The real format is in the
//! recording's metadata.

use super::foxglove::RawImageShape;
use crate::source::StreamInfo;

pub(crate) fn shape(info: &StreamInfo) -> RawImageShape {
    let (mut width, mut height) = (u32::from(info.size.width()), u32::from(info.size.height()));
    let (facts, step) = (info.format.facts(), info.bytes_per_row);
    let encoding = match (facts.foxglove, facts.planes) {
        (Some("rgba8"), _) if is_blue_first(info) => "bgra8",
        (Some(encoding), _) => encoding,
        (None, [packed]) => {
            width = width.div_ceil(packed.unit[0].into()) * packed.bytes.len() as u32;
            "mono8"
        }
        (None, _) => {
            let rows = info.frame_bytes().checked_div(step as usize);
            height = rows.map_or(height, |rows| rows as u32);
            "mono8"
        }
    };
    RawImageShape { encoding, width, height, step }
}

/// Returns whether four-byte pixels start with blue, as the camera's own name of its format says.
fn is_blue_first(info: &StreamInfo) -> bool {
    info.camera.as_ref().is_some_and(|camera| ["XR24", "AR24", "BGR4"].contains(&camera.format.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_core::green::any::PixelFormat;
    use wstac_core::green::bayer::BayerOrder;
    use wstac_core::layout::FrameSize;
    use wstac_core::rate::FrameRate;

    fn of(format: PixelFormat, bytes_per_row: u32) -> (RawImageShape, usize) {
        let size = FrameSize::new(40, 40).unwrap();
        let info = StreamInfo { bytes_per_row, ..StreamInfo::new("", size, format, FrameRate::NOMINAL) };
        (shape(&info), info.frame_bytes())
    }

    #[test]
    fn viewers_see_as_many_bytes_as_there_are() {
        let shape = |encoding, width, height, step| RawImageShape { encoding, width, height, step };
        assert_eq!(of(PixelFormat::Gray, 40), (shape("mono8", 40, 40, 40), 1600));
        assert_eq!(of(PixelFormat::Yuyv, 80), (shape("yuyv", 40, 40, 80), 3200));
        assert_eq!(of(PixelFormat::Nv12, 40), (shape("mono8", 40, 60, 40), 2400));
        assert_eq!(of(PixelFormat::Y10, 80), (shape("mono16", 40, 40, 80), 3200));
        assert_eq!(of(PixelFormat::Bayer8(BayerOrder::Rggb), 40), (shape("bayer_rggb8", 40, 40, 40), 1600));
    }
}
