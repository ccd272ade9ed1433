//! The effect of MJPEG: the same still scene, compressed and not.

use serde::Serialize;

use super::measure::Measured;
use super::still::Still;
use super::tidy;
use wstac_host::camera::formats::{self, Coding, FourCc};
use wstac_host::camera::modes::Mode;
use wstac_host::config::Config;

/// One of the two measurements.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Side {
    /// Four-character code.
    pub format: String,
    /// Number of measured frames.
    pub frames: u64,
    /// Mean of all taxels.
    pub mean: f64,
    /// Noise of a taxel's mean, rms.
    pub taxel_noise: f64,
    /// Noise of a pixel, rms.
    pub pixel_noise: Option<f64>,
}

/// The comparison, in gray levels of 255.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MjpegReport {
    /// Uncompressed.
    pub raw: Side,
    /// Compressed.
    pub jpeg: Side,
    /// Error of the worst taxel's mean when it is compressed.
    pub worst_taxel_off: f64,
    /// Smallest step of the mean of a block of 8 x 8 pixels; `None` if the pictures do not state it.
    pub dc_step: Option<f64>,
    /// Number of corrupt pictures during the measurement.
    pub corrupt: u64,
    /// Largest light that compression may remove or add: the worst taxel's offset, or half a step if that is more.
    pub error: f64,
    /// Level from which each of five taxels counts as lit: `[speed] threshold`, 2.4 by default.
    pub lit: f64,
}

impl Side {
    /// Takes the compared numbers from a measurement.
    fn new(format: &str, measured: &Measured) -> Self {
        let still = Still::new(measured);
        Self {
            format: format.to_owned(),
            frames: measured.moments.len() as u64,
            mean: tidy(super::still::mean(still.means())),
            taxel_noise: tidy(still.noise()),
            pixel_noise: measured.pixels.map(|pixels| tidy(pixels.noise)),
        }
    }
}

/// Compares two measurements of one scene, each with the four-character code of its format.
pub fn compare(raw: (&str, &Measured), jpeg: (&str, &Measured), config: &Config) -> MjpegReport {
    let means = |measured| Still::new(measured).means();
    let off = means(raw.1).iter().zip(means(jpeg.1)).map(|(raw, jpeg)| (jpeg - raw).abs()).fold(0.0, f64::max);
    let dc_step = jpeg.1.dc_step;
    MjpegReport {
        raw: Side::new(raw.0, raw.1),
        jpeg: Side::new(jpeg.0, jpeg.1),
        worst_taxel_off: tidy(off),
        dc_step,
        corrupt: jpeg.1.lost.iter().filter(|(why, _)| why.is_of_jpeg()).map(|(_, frames)| frames).sum(),
        error: tidy(off.max(dc_step.unwrap_or(0.0) / 2.0)),
        lit: tidy(255.0 * config.speed.threshold / 5.0),
    }
}

/// Returns the format for the comparison: the best uncompressed one for a compressed one, and vice versa, at the same
/// size.
pub fn counterpart(modes: &[Mode], format: &str, size: (u32, u32)) -> Option<FourCc> {
    let is_jpeg = |fourcc| formats::coding(fourcc) == Some(Coding::Jpeg);
    let own = modes.iter().find(|mode| formats::name(mode.fourcc) == format)?.fourcc;
    let fits = |mode: &&Mode| {
        let same = |sizes: &wstac_host::camera::modes::Sizes| sizes.range.nearest(size) == size;
        mode.readable && is_jpeg(mode.fourcc) != is_jpeg(own) && (mode.sizes.is_empty() || mode.sizes.iter().any(same))
    };
    modes.iter().filter(fits).map(|mode| mode.fourcc).min_by_key(|fourcc| formats::preference(*fourcc))
}

/// Returns the step of a block's mean that a JPEG picture's first quantization table leaves, or `None` without such a
/// table.
///
/// The mean is an eighth of the DC coefficient.
pub fn dc_step(picture: &[u8]) -> Option<f64> {
    let mut rest = picture.strip_prefix(&[0xff, 0xd8])?;
    loop {
        let [0xff, marker, high, low, ..] = *rest else { return None };
        let length = usize::from(u16::from_be_bytes([high, low])).max(2);
        let segment = rest.get(4..2 + length)?;
        match marker {
            0xdb => {
                let (kind, table) = segment.split_first()?;
                // The upper half of the byte selects numbers of 16 bits instead of 8. The first table is that of luma.
                let first =
                    if kind >> 4 == 0 { u16::from(*table.first()?) } else { u16::from_be_bytes(*table.first_chunk()?) };
                return Some(f64::from(first) / 8.0);
            }
            0xda => return None,
            _ => rest = rest.get(2 + length..)?,
        }
    }
}

#[cfg(test)]
mod tests {
    use jpeg_encoder::{ColorType, Encoder};

    use super::*;
    use wstac_host::camera::modes::{SizeRange, Sizes};

    #[test]
    fn the_step_is_that_of_the_pictures_own_table() {
        // The standard's table starts with 16 at a quality of 50, with 5 at 85, with 1 at 100.
        for (quality, step) in [(50, 2.0), (85, 0.625), (100, 0.125)] {
            let mut picture = Vec::new();
            Encoder::new(&mut picture, quality).encode(&[9; 256], 16, 16, ColorType::Luma).unwrap();
            assert_eq!(dc_step(&picture), Some(step), "quality {quality}");
            for length in 0..picture.len() {
                let found = dc_step(&picture[..length]);
                assert!(found.is_none() || found == Some(step));
            }
        }
        assert_eq!(dc_step(&[0xff, 0xd8, 0xff, 0xdb, 0, 5, 0x10, 1, 0]), Some(32.0));
        assert_eq!(dc_step(b"no picture"), None);
    }

    #[test]
    fn the_counterpart_has_the_same_size() {
        let mode = |fourcc: FourCc, sizes: &[(u32, u32)]| {
            let sizes = sizes.iter().map(|size| Sizes { range: SizeRange::one(size.0, size.1), rates: Vec::new() });
            let readable = formats::coding(fourcc).is_some();
            Mode { fourcc, description: String::new(), readable, sizes: sizes.collect() }
        };
        let modes = [
            mode(*b"MJPG", &[(640, 480), (1280, 720)]),
            mode(*b"H264", &[(1280, 720)]),
            mode(*b"NV12", &[(1280, 720)]),
            mode(*b"YUYV", &[(640, 480), (1280, 720)]),
            mode(*b"GREY", &[(640, 480)]),
        ];
        assert_eq!(counterpart(&modes, "MJPG", (1280, 720)), Some(*b"YUYV"));
        assert_eq!(counterpart(&modes, "MJPG", (640, 480)), Some(*b"GREY"));
        assert_eq!(counterpart(&modes, "NV12", (1280, 720)), Some(*b"MJPG"));
        assert_eq!(counterpart(&modes[2..], "NV12", (1280, 720)), None);
        assert_eq!(counterpart(&modes, "MJPG", (320, 240)), None);
    }
}
