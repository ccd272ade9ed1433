//! One PNG file to the bytes of a frame.

use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use png::{BitDepth, ColorType, Decoder, Limits, Reader, Transformations};
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::FrameSize;

use super::super::orientation::Orientation;
use crate::error::{Error, ErrorKind};

/// Most bytes that a decoded picture may take.
const MOST_DECODED: usize = 1 << 30;
/// Most bytes that the decoder may take for itself: a row of the widest picture, and the metadata that it keeps.
const MOST_OVERHEAD: usize = 1 << 24;

/// The reason why a picture is no frame.
#[derive(Debug)]
pub(super) enum Problem {
    /// The picture cannot be read, and the frame is lost.
    Corrupt(String),
    /// The picture can be read, but is not what is expected. The text says what was found and what was expected.
    Refused(String),
    /// The file cannot be opened.
    Io(std::io::Error),
}

impl Problem {
    /// Returns why a file is corrupt, or the error that ends its folder.
    pub(super) fn damage(self, file: &Path) -> Result<String, Error> {
        match self {
            Self::Corrupt(why) => Ok(why),
            Self::Refused(message) => Err(Error::new(ErrorKind::Format, file.display(), message)),
            Self::Io(error) => Err(Error::io(file.display(), error)),
        }
    }
}

impl From<png::DecodingError> for Problem {
    fn from(error: png::DecodingError) -> Self {
        Self::Corrupt(error.to_string())
    }
}

/// Size and type of a picture, after palettes are looked up and samples of less than 8 bits are widened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PngShape {
    pub(super) size: FrameSize,
    color: ColorType,
    is_deep: bool,
}

impl PngShape {
    /// Returns the format of the frames. Alpha is dropped, and of 16-bit colors green is taken.
    pub(super) fn format(self) -> PixelFormat {
        match self.color {
            _ if self.is_deep => PixelFormat::Y16,
            ColorType::Grayscale | ColorType::GrayscaleAlpha => PixelFormat::Gray,
            ColorType::Rgb | ColorType::Indexed => PixelFormat::Rgb24,
            ColorType::Rgba => PixelFormat::Rgbx32,
        }
    }

    pub(super) fn bytes_per_row(self) -> u32 {
        let green = Any::new(self.format(), YcbcrEncoding::default(), YcbcrMethod::Exact);
        green.row_bytes(self.size.width()) as u32
    }
}

impl fmt::Display for PngShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let color = match self.color {
            ColorType::Grayscale => "gray",
            ColorType::GrayscaleAlpha => "gray with alpha",
            ColorType::Rgb | ColorType::Indexed => "RGB",
            ColorType::Rgba => "RGBA",
        };
        let bits = if self.is_deep { 16 } else { 8 };
        write!(f, "{}x{} {bits}-bit {color}", self.size.width(), self.size.height())
    }
}

/// A picture whose header was read.
pub(super) struct PngPicture {
    reader: Reader<BufReader<File>>,
    shape: PngShape,
    bytes: usize,
    pub(super) orientation: Orientation,
}

impl PngPicture {
    /// Reads a file's header, and checks its size before anything that large is allocated.
    pub(super) fn open(path: &Path) -> Result<Self, Problem> {
        let file = crate::files::open_seekable(path).map_err(Problem::Io)?;
        let mut decoder = Decoder::new_with_limits(BufReader::new(file), Limits { bytes: MOST_OVERHEAD });
        decoder.set_ignore_text_chunk(true);
        decoder.set_ignore_iccp_chunk(true);
        decoder.set_transformations(Transformations::EXPAND);
        let (width, height) = decoder.read_header_info()?.size();
        let size = FrameSize::new(width, height).map_err(|error| Problem::Refused(error.to_string()))?;
        let reader = decoder.read_info()?;
        let (color, depth) = reader.output_color_type();
        let shape = PngShape { size, color, is_deep: depth == BitDepth::Sixteen };
        match reader.output_buffer_size() {
            Some(bytes) if bytes <= MOST_DECODED => {
                let exif = reader.info().exif_metadata.as_deref();
                let orientation = exif.map_or_else(Orientation::default, Orientation::of_exif);
                Ok(Self { reader, shape, bytes, orientation })
            }
            _ => Err(Problem::Refused(format!("is {shape}, expected at most {MOST_DECODED} bytes decoded"))),
        }
    }

    /// Returns the shape of the frame: of the picture after its turn.
    pub(super) fn shape(&self) -> PngShape {
        PngShape { size: self.orientation.frame_size(self.shape.size), ..self.shape }
    }

    /// Decodes the picture and returns whether its frame is in `frame` rather than in `decoded`.
    pub(super) fn decode(mut self, decoded: &mut Vec<u8>, frame: &mut Vec<u8>) -> Result<bool, Problem> {
        resize(decoded, self.bytes)?;
        let output = self.reader.next_frame(decoded)?;
        if (output.width, output.height) != self.shape.size.into() {
            return Err(Problem::Corrupt("its first frame is smaller than itself".into()));
        }
        let pixels = usize::from(self.shape.size.width()) * usize::from(self.shape.size.height());
        let bytes = match (self.shape.color, self.shape.is_deep) {
            (ColorType::GrayscaleAlpha, false) => 1,
            (_, false) => return Ok(false),
            (_, true) => 2,
        };
        let samples = self.shape.color.samples();
        let kept = if samples < 3 { 0 } else { bytes };
        resize(frame, bytes * pixels)?;
        for (to, from) in frame.chunks_exact_mut(bytes).zip(decoded.chunks_exact(bytes * samples)) {
            // Words of PNG are big-endian.
            to.iter_mut().rev().zip(from.iter().skip(kept)).for_each(|(to, from)| *to = *from);
        }
        Ok(true)
    }
}

fn resize(buffer: &mut Vec<u8>, size: usize) -> Result<(), Problem> {
    let no_room = |error| Problem::Refused(format!("no memory for its {size} bytes: {error}"));
    buffer.try_reserve_exact(size.saturating_sub(buffer.len())).map_err(no_room)?;
    buffer.resize(size, 0);
    Ok(())
}
