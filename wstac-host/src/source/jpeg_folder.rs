//! A folder of JPEG pictures, a frame each, in natural order: `frame2.jpg` before `frame10.jpg`.
//!
//! They are decoded as the pictures of a camera that sends Motion JPEG. A picture that is damaged or cut off is a lost
//! frame, and a fault says why the first of them is. One of another size than the first is an error, because it belongs to something else.

use std::io::Read;
use std::path::{Path, PathBuf};

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::picture_files::{JPEG, list, positions, rate, without_pictures};
use super::spacing::Positions;
use super::{Fault, FaultKind, Frame, LossReason, Source, SourceEvent, StreamInfo};
use crate::camera::mjpeg::{Decoder, picture_size};
use crate::error::{Error, ErrorKind};

/// Most bytes of a file.
const MOST_BYTES: u64 = 1 << 28;
/// Bytes of memory per pixel that decoding may take: three colors, and the numbers of a progressive picture.
const BYTES_PER_PIXEL: usize = 3 + 3 * 2;

/// The JPEG pictures of a folder.
pub struct JpegFolder {
    info: StreamInfo,
    decoder: Decoder,
    /// The name of the first picture, whose size all have.
    model: String,
    files: std::vec::IntoIter<PathBuf>,
    /// The bytes of a file.
    bytes: Vec<u8>,
    /// Whether a fault has said why a picture is lost, and whether that picture was not reported lost yet.
    is_damage_reported: bool,
    owes_loss: bool,
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
        let files = list(path, JPEG)?;
        if files.is_empty() {
            return Err(without_pictures(path));
        }
        let mut bytes = Vec::new();
        let (first, size) = first_picture(path, &files, &mut bytes)?;
        let pixels = usize::from(size.width()) * usize::from(size.height());
        if let Err(error) = Vec::<u8>::new().try_reserve_exact(BYTES_PER_PIXEL * pixels) {
            let message =
                format_args!("is {}x{}, and there is no memory to decode it: {error}", size.width(), size.height());
            return Err(Error::new(ErrorKind::Io, first.display(), message));
        }
        let (rate, said) = rate(&files, fps);
        let (width, height) = (size.width(), size.height());
        let about = format!("{}: {} JPEG files, {width}x{height}, {said}", path.display(), files.len());
        let info = StreamInfo::new(about, size, PixelFormat::Rgb24, rate);
        let model = first.file_name().unwrap_or_default().display().to_string();
        let (decoder, files) = (Decoder::new(size), files.into_iter());
        Ok(Self { info, decoder, model, files, bytes, is_damage_reported: false, owes_loss: false })
    }

    /// Returns the positions of the pictures that are left, by their names; `None` if the names do not tell.
    pub(super) fn positions(&self) -> Option<(Positions, Vec<f64>)> {
        positions(self.files.as_slice())
    }

    /// Ends the source with an error about a file.
    fn fail(&mut self, file: &Path, kind: ErrorKind, message: impl std::fmt::Display) -> Error {
        self.files = Vec::new().into_iter();
        Error::new(kind, file.display(), message)
    }
}

impl Source for JpegFolder {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let lost = SourceEvent::Lost { frames: 1, reason: LossReason::CorruptPicture };
        if std::mem::take(&mut self.owes_loss) {
            return Ok(lost);
        }
        let Some(file) = self.files.next() else { return Ok(SourceEvent::End) };
        if let Err(error) = read(&file, &mut self.bytes) {
            self.files = Vec::new().into_iter();
            return Err(error);
        }
        let expected = (self.info.size.width(), self.info.size.height());
        if let Some((width, height)) = picture_size(&self.bytes).filter(|size| *size != expected) {
            let message = format!("is {width}x{height}, expected {}x{} as {}", expected.0, expected.1, self.model);
            return Err(self.fail(&file, ErrorKind::Format, message));
        }
        Ok(match self.decoder.decode(&self.bytes) {
            Ok(rgb) => SourceEvent::Frame(Frame { encoded: Some(&self.bytes), ..Frame::new(rgb) }),
            Err(_) if self.is_damage_reported => lost,
            Err(why) => {
                (self.is_damage_reported, self.owes_loss) = (true, true);
                let message = format!("{}: cannot be decoded: {why}; others count as lost, too", file.display());
                SourceEvent::Fault(Fault::new(FaultKind::Decoder, message))
            }
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

/// Returns the first picture whose headers can be read, and its size. Corrupt ones before it are frames that are lost
/// later on.
fn first_picture(folder: &Path, files: &[PathBuf], bytes: &mut Vec<u8>) -> Result<(PathBuf, FrameSize), Error> {
    for file in files {
        read(file, bytes)?;
        if let Some((width, height)) = picture_size(bytes) {
            let size = FrameSize::new(width.into(), height.into());
            let refused = |error| Error::with_cause(ErrorKind::Format, file.display(), error);
            return Ok((file.clone(), size.map_err(refused)?));
        }
    }
    let message = format_args!("no JPEG file of {} can be read, expected pictures that start with FF D8", files.len());
    Err(Error::new(ErrorKind::Format, folder.display(), message))
}

#[cfg(test)]
mod tests;
