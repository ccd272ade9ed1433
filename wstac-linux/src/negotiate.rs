//! Format, size and frame rate, as a driver grants them.

use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::choose::{choose, same};
use super::device::{Device, PictureFormat};
use super::devices::modes;
use wstac_host::camera::formats::{self, Coding, FourCc};
use wstac_host::camera::modes::fps;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::source::open::OpenOptions;

const PAPER_SIZE: (u32, u32) = (1280, 720);

/// The properties of a camera's frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Negotiated {
    /// Four-character code of the buffers' content.
    pub fourcc: FourCc,
    /// The meaning of that code.
    pub coding: Coding,
    /// Width and height.
    pub size: FrameSize,
    /// The meaning of Y, Cb, Cr.
    pub color: YcbcrEncoding,
    /// Bytes from the start of a row to the start of the next; for JPEG pictures, after decoding.
    pub bytes_per_row: u32,
    /// Least bytes of a buffer that holds a frame.
    pub frame_bytes: usize,
    /// Frames per second.
    pub rate: FrameRate,
    /// Notes for a person about what the driver gives instead of what was asked for.
    pub notes: Vec<String>,
}

/// Agrees with the driver on format, size and rate.
pub(super) fn negotiate(device: &Device, options: &OpenOptions) -> Result<Negotiated, Error> {
    let size = options.size.unwrap_or(PAPER_SIZE);
    let rate = options.fps.unwrap_or(FrameRate::NOMINAL);
    let fourcc = match options.format {
        Some(fourcc) if formats::coding(fourcc).is_none() => return Err(unreadable(device, fourcc)),
        Some(fourcc) => fourcc,
        None => choose(&modes(device, size), size, rate).ok_or_else(|| nothing_readable(device))?,
    };
    let granted = device.set_format(fourcc, size).map_err(|error| device.error("the format cannot be set", error))?;
    let coding = formats::coding(granted.fourcc).ok_or_else(|| unreadable(device, granted.fourcc))?;

    let mut notes = differences(fourcc, size, &granted);
    let set = device.set_rate(rate).map_err(|error| device.error("the frame rate cannot be set", error))?;
    let known = set.or_else(|| device.signal_rate());
    let granted_rate = known.unwrap_or(rate);
    if known.is_none() {
        notes.push(format!("the driver does not tell its frame rate; taken to be {} fps", fps(rate)));
    } else if !same(granted_rate, rate) {
        notes.push(format!("asked for {} fps, the driver gives {} fps", fps(rate), fps(granted_rate)));
    }
    described(&granted, coding, granted_rate, notes)
        .map_err(|error| Error::with_cause(ErrorKind::Device, device.path.display(), error))
}

/// Describes frames of a granted format.
fn described(
    granted: &PictureFormat,
    coding: Coding,
    rate: FrameRate,
    mut notes: Vec<String>,
) -> Result<Negotiated, wstac_core::error::ConfigError> {
    let size = FrameSize::new(granted.size.0, granted.size.1)?;
    let (mut color, note) = granted.colorimetry.color();
    let (bytes_per_row, frame_bytes) = match coding {
        Coding::Raw(format) => {
            if format.is_ycbcr() {
                notes.extend(note);
            }
            let green = Any::new(format, color, YcbcrMethod::Exact);
            let least = green.row_bytes(size.width()) as u32;
            // A 0 means that the driver does not say. Some drivers count a planar format's chroma in, or leave
            // something out.
            let stated = granted.bytes_per_row;
            if stated != 0 && stated < least {
                notes.push(format!("the driver states {stated} bytes per row, fewer than a row has; read as {least}"));
            }
            let bytes_per_row = stated.max(least);
            (bytes_per_row, green.least_frame_bytes(size, bytes_per_row as usize))
        }
        Coding::Jpeg => {
            // The picture is decoded to RGB by JPEG's own rule, whatever the driver states.
            color = YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Full };
            (3 * u32::from(size.width()), 1)
        }
    };
    Ok(Negotiated { fourcc: granted.fourcc, coding, size, color, bytes_per_row, frame_bytes, rate, notes })
}

fn differences(fourcc: FourCc, size: (u32, u32), granted: &PictureFormat) -> Vec<String> {
    let mut notes = Vec::new();
    if granted.fourcc != fourcc {
        let (wanted, given) = (formats::name(fourcc), formats::name(granted.fourcc));
        notes.push(format!("asked for {wanted}, the driver gives {given}"));
    }
    if granted.size != size {
        let given = granted.size;
        notes.push(format!("asked for {}x{}, the driver gives {}x{}", size.0, size.1, given.0, given.1));
    }
    if !granted.progressive {
        notes.push("the frames are interlaced: their lines are not of one moment".into());
    }
    notes
}

fn unreadable(device: &Device, fourcc: FourCc) -> Error {
    let message = format!("the format {} is not read; {}", formats::name(fourcc), what_there_is(device));
    Error::new(ErrorKind::Unsupported, device.path.display(), message)
}

fn nothing_readable(device: &Device) -> Error {
    Error::new(
        ErrorKind::Unsupported,
        device.path.display(),
        format!("offers no format that is read; {}", what_there_is(device)),
    )
}

fn what_there_is(device: &Device) -> String {
    let offered = formats::list(device.formats().into_iter().map(|(fourcc, _)| fourcc));
    let offered = if offered.is_empty() { "nothing".into() } else { offered };
    format!("read are {}; the camera offers {offered}", formats::readable())
}

#[cfg(test)]
mod tests {
    use super::super::color::Colorimetry;
    use wstac_core::green::any::PixelFormat;

    use super::*;

    fn granted(fourcc: FourCc, bytes_per_row: u32) -> PictureFormat {
        let colorimetry = Colorimetry { colorspace: 10, encoding: 0, quantization: 0 };
        PictureFormat { fourcc, size: (641, 361), bytes_per_row, colorimetry, progressive: true }
    }

    fn negotiated(fourcc: FourCc, bytes_per_row: u32) -> Negotiated {
        let coding = formats::coding(fourcc).unwrap();
        described(&granted(fourcc, bytes_per_row), coding, FrameRate::NOMINAL, Vec::new()).unwrap()
    }

    #[test]
    fn frames_have_the_bytes_that_the_core_needs() {
        for (fourcc, bytes_per_row, row, frame) in [
            (*b"GREY", 0, 641, 641 * 361),
            (*b"GREY", 704, 704, 704 * 360 + 641),
            (*b"YUYV", 1284, 1284, 1284 * 361),
            (*b"RGB3", 2000, 2000, 2000 * 360 + 1923),
            (*b"NV12", 642, 642, 642 * (361 + 181)),
            (*b"YU12", 642, 642, 642 * 361 + 2 * 321 * 181),
            (*b"422P", 642, 642, 642 * 361 + 2 * 321 * 361),
            (*b"RG10", 1282, 1282, 1282 * 361),
        ] {
            let negotiated = negotiated(fourcc, bytes_per_row);
            let found = (negotiated.bytes_per_row, negotiated.frame_bytes);
            assert_eq!(found, (row, frame), "{}", formats::name(fourcc));
        }
    }

    #[test]
    fn a_row_that_is_too_short_is_noted() {
        let short = negotiated(*b"Y10 ", 641);
        assert_eq!((short.bytes_per_row, short.notes.len()), (1282, 1));
    }

    #[test]
    fn color_is_noted_where_it_matters() {
        assert!(negotiated(*b"YUYV", 0).notes[0].contains("BT.2020"));
        assert!(negotiated(*b"GREY", 0).notes.is_empty());
        assert!(negotiated(*b"MJPG", 0).notes.is_empty());
    }

    #[test]
    fn what_differs_is_told() {
        let notes = differences(*b"YUYV", (1280, 720), &PictureFormat { progressive: false, ..granted(*b"GREY", 0) });
        assert_eq!(notes[0], "asked for YUYV, the driver gives GREY");
        assert_eq!(notes[1], "asked for 1280x720, the driver gives 641x361");
        assert!(notes[2].contains("interlaced"));
        assert!(differences(*b"GREY", (641, 361), &granted(*b"GREY", 0)).is_empty());
    }

    #[test]
    fn a_size_beyond_all_bounds_is_an_error() {
        let huge = PictureFormat { size: (100_000, 1), ..granted(*b"GREY", 0) };
        let coding = Coding::Raw(PixelFormat::Gray);
        assert!(described(&huge, coding, FrameRate::NOMINAL, Vec::new()).is_err());
        let empty = PictureFormat { size: (0, 0), ..huge };
        assert!(described(&empty, coding, FrameRate::NOMINAL, Vec::new()).is_err());
    }
}
