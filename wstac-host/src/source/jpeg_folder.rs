//! A folder of JPEG pictures, a frame each, in natural order: `frame2.jpg` before `frame10.jpg`.
//!
//! They are decoded as the pictures of a camera that sends Motion JPEG. A picture that is damaged or cut off is a lost
//! frame, and a fault says why the first of them is. One of another size than the first is an error, because it belongs
//! to something else. Pictures are turned as their Exif data say.

use std::io::Read;
use std::path::Path;

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::orientation::Orientation;
use super::picture_files::{JPEG, Pictures, first_of, list};
use super::picture_names::rate;
use super::{Frame, Source, SourceEvent, StreamInfo};
use crate::camera::mjpeg::{Decoder, Refusal, picture_facts};
use crate::error::{Error, ErrorKind};
use crate::plural::counted;

/// Most bytes of a file.
pub(super) const MOST_BYTES: u64 = 1 << 28;
/// Bytes of memory per pixel that decoding may take: three colors, and the numbers of a progressive picture.
const BYTES_PER_PIXEL: usize = 3 + 3 * 2;

const HELP: &str = "; help: mogrify -path NEW -format png *.jpg makes PNG files of them in the folder NEW";

/// The JPEG pictures of a folder.
pub struct JpegFolder {
    info: StreamInfo,
    decoder: Decoder,
    pub(super) pictures: Pictures,
    /// The bytes of a file.
    bytes: Vec<u8>,
    /// A picture that is turned.
    turned: Vec<u8>,
}

impl JpegFolder {
    /// Lists a folder and reads the headers of its first picture.
    ///
    /// Hidden files, and files with another extension than `.jpg` or `.jpeg`, are passed over. The rate is 30 frames
    /// per second unless `fps` gives another.
    ///
    /// # Errors
    /// The folder cannot be listed or holds no picture, or the size of its first picture is not supported.
    pub fn open(path: &Path, fps: Option<FrameRate>) -> Result<Self, Error> {
        let (files, places) = list(path, JPEG)?;
        let mut bytes = Vec::new();
        let (first, (size, orientation)) = first_of(path, &files, "JPEG", |file| {
            read(file, &mut bytes)?;
            let ((width, height), exif) = match picture_facts(&bytes) {
                Ok(facts) => facts,
                Err(why) => return Ok(Err(in_words(why))),
            };
            let size = FrameSize::new(width.into(), height.into());
            let size = size.map_err(|error| Error::with_cause(ErrorKind::Format, file.display(), error))?;
            Ok(Ok((size, Orientation::of_exif(exif))))
        })?;
        let decoder = Decoder::new(size);
        let size = orientation.frame_size(size);
        let pixels = usize::from(size.width()) * usize::from(size.height());
        if let Err(error) = Vec::<u8>::new().try_reserve_exact(BYTES_PER_PIXEL * pixels) {
            let message =
                format_args!("is {}x{}, and there is no memory to decode it: {error}", size.width(), size.height());
            return Err(Error::new(ErrorKind::Io, first.display(), message));
        }
        let (rate, said) = rate(places.as_ref(), fps);
        let (width, height) = (size.width(), size.height());
        let about = format!("{}: {}, {width}x{height}, {said}", path.display(), counted(files.len(), "JPEG file"));
        let row_order = orientation.row_order();
        let info = StreamInfo { row_order, ..StreamInfo::new(about, size, PixelFormat::Rgb24, rate) };
        Ok(Self { info, decoder, pictures: Pictures::new((files, places), &first), bytes, turned: Vec::new() })
    }

    /// Returns the orientation of the picture that was read, and prepares the decoder. It finds damaged headers itself.
    fn orientation(&mut self, file: &Path) -> Result<Orientation, Error> {
        let Ok((size, exif)) = picture_facts(&self.bytes) else { return Ok(Orientation::default()) };
        let turn = Orientation::of_exif(exif);
        let ((width, height), expected) = (turn.size(size), self.info.size);
        if (width, height) != (expected.width(), expected.height()) {
            let (expected, model) = (format_args!("{}x{}", expected.width(), expected.height()), &self.pictures.model);
            let message = format_args!("is {width}x{height}, expected {expected} as {model}");
            return Err(Error::new(ErrorKind::Format, file.display(), message));
        }
        self.pictures.check_order(file, turn, self.info.row_order)?;
        // Pictures of one size may have been turned from two.
        let stored = turn.frame_size(expected);
        if self.decoder.size != stored {
            self.decoder = Decoder::new(stored);
        }
        Ok(turn)
    }
}

impl Source for JpegFolder {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let Some(file) = self.pictures.next() else { return Ok(SourceEvent::End) };
        let turn = read(&file, &mut self.bytes).and_then(|()| self.orientation(&file));
        let turn = self.pictures.or_end(turn)?;
        let (width, jpeg) = (usize::from(self.decoder.size.width()), &self.bytes[..]);
        Ok(match self.decoder.picture(jpeg) {
            Ok(rgb) => match self.pictures.turned(&file, turn) {
                Some(fault) => fault,
                None if turn == Orientation::default() => {
                    SourceEvent::Frame(Frame { encoded: Some(jpeg), ..Frame::new(rgb) })
                }
                // A recording has the pixels: its pictures are not turned.
                None => SourceEvent::Frame(Frame::new(turn.pixels(rgb, width, 3, &mut self.turned))),
            },
            Err(why) => self.pictures.lost(&file, in_words(why), why.reason()),
        })
    }
}

fn read(file: &Path, bytes: &mut Vec<u8>) -> Result<(), Error> {
    let unread = |error| Error::io(file.display(), error);
    bytes.clear();
    let open = crate::files::open_seekable(file).map_err(unread)?;
    let size = open.metadata().map_err(unread)?.len();
    if size > MOST_BYTES {
        let message = format_args!("has {size} bytes, expected at most {MOST_BYTES} of a picture");
        return Err(Error::new(ErrorKind::Format, file.display(), message));
    }
    open.take(MOST_BYTES).read_to_end(bytes).map_err(unread)?;
    Ok(())
}

/// Returns why a picture is refused, and what helps if other programs decode it.
fn in_words(why: Refusal) -> String {
    let help = matches!(why, Refusal::Unsupported(_)).then_some(HELP);
    format!("{why}{}", help.unwrap_or_default())
}

#[cfg(test)]
mod tests;
