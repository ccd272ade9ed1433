//! A folder of PNG pictures, a frame each, in natural order: `frame2.png` before `frame10.png`.
//!
//! A picture that cannot be decoded is a lost frame. One of another size or type than the first is an error, because it
//! belongs to something else.

mod picture;

use std::path::{Path, PathBuf};

use wstac_core::rate::FrameRate;

use self::picture::{PngPicture, PngShape, Problem};
use super::orientation::Orientation;
use super::picture_files::{PNG, list, positions, rate, without_pictures};
use super::spacing::Positions;
use super::{Fault, FaultKind, Frame, LossReason, Source, SourceEvent, StreamInfo};
use crate::error::{Error, ErrorKind};

/// The pictures of a folder.
pub struct PngFolder {
    info: StreamInfo,
    /// The shape that all pictures must have, and the name of the first picture, which has it.
    shape: PngShape,
    model: String,
    files: std::vec::IntoIter<PathBuf>,
    /// A picture as it was decoded, and as a frame if that differs.
    decoded: Vec<u8>,
    frame: Vec<u8>,
    /// A picture that is turned.
    turned: Vec<u8>,
    /// A file of which only a fault was reported yet.
    again: Option<PathBuf>,
    /// Whether a fault has said that a picture is lost or turned.
    is_damage_said: bool,
    is_turn_said: bool,
}

impl PngFolder {
    /// Lists a folder and reads the header of its first picture.
    ///
    /// Hidden files, and files with another extension than `.png`, are passed over. The rate is 30 frames per second
    /// unless `fps` gives another.
    ///
    /// # Errors
    /// The folder cannot be listed or holds no picture, or its first picture's size or type is not supported.
    pub fn open(path: &Path, fps: Option<FrameRate>) -> Result<Self, Error> {
        let files = list(path, PNG)?;
        if files.is_empty() {
            return Err(without_pictures(path));
        }
        let (first, shape, orientation) = first_picture(path, &files)?;
        let (rate, said) = rate(&files, fps);
        let about = format!("{}: {} PNG files, {shape}, {said}", path.display(), files.len());
        let info = StreamInfo {
            bytes_per_row: shape.bytes_per_row(),
            row_order: orientation.row_order(),
            ..StreamInfo::new(about, shape.size, shape.format(), rate)
        };
        let model = first.file_name().unwrap_or_default().display().to_string();
        let (files, again) = (files.into_iter(), None);
        let [decoded, frame, turned] = [const { Vec::new() }; 3];
        let (is_damage_said, is_turn_said) = (false, false);
        Ok(Self { info, shape, model, files, decoded, frame, turned, again, is_damage_said, is_turn_said })
    }

    /// Returns the positions of the pictures that are left, by their names; `None` if the names do not tell.
    pub(super) fn positions(&self) -> Option<(Positions, Vec<f64>)> {
        positions(self.files.as_slice())
    }

    /// Reads a picture and returns its orientation, and whether its bytes are in `frame` rather than in `decoded`.
    fn read(&mut self, file: &Path) -> Result<(Orientation, bool), Problem> {
        let picture = PngPicture::open(file)?;
        if picture.shape() != self.shape {
            return Err(Problem::Refused(format!("is {}, expected {} as {}", picture.shape(), self.shape, self.model)));
        }
        Ok((picture.orientation, picture.decode(&mut self.decoded, &mut self.frame)?))
    }
}

impl Source for PngFolder {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let Some(file) = self.again.take().or_else(|| self.files.next()) else { return Ok(SourceEvent::End) };
        let said = |kind, message| Ok(SourceEvent::Fault(Fault::new(kind, format!("{}: {message}", file.display()))));
        match self.read(&file) {
            Ok((turn, _)) if turn.row_order() != self.info.row_order => {
                let message = format!("has its rows in another direction than {}, by their Exif data", self.model);
                self.files = Vec::new().into_iter();
                Err(Error::new(ErrorKind::Format, file.display(), message))
            }
            Ok((turn, converted)) => {
                let bytes = if converted { &self.frame } else { &self.decoded };
                if let Some(turn) = turn.turn()
                    && !std::mem::replace(&mut self.is_turn_said, true)
                {
                    let event =
                        said(FaultKind::Turned, format!("{turn}, as its Exif data say; others are turned, too"));
                    self.again = Some(file);
                    return event;
                }
                let (width, _) = turn.size((self.info.size.width(), self.info.size.height()));
                let pixel = (self.info.bytes_per_row / u32::from(self.info.size.width())) as usize;
                Ok(SourceEvent::Frame(Frame::new(turn.pixels(bytes, width.into(), pixel, &mut self.turned))))
            }
            Err(Problem::Corrupt(why)) if !std::mem::replace(&mut self.is_damage_said, true) => {
                let event = said(FaultKind::Decoder, format!("cannot be decoded: {why}; others count as lost, too"));
                self.again = Some(file);
                event
            }
            Err(Problem::Io(error)) => {
                self.files = Vec::new().into_iter();
                Err(Error::io(file.display(), error))
            }
            Err(Problem::Corrupt(_)) => Ok(SourceEvent::Lost { frames: 1, reason: LossReason::CorruptPicture }),
            Err(Problem::Refused(message)) => {
                self.files = Vec::new().into_iter();
                Err(Error::new(ErrorKind::Format, file.display(), message))
            }
        }
    }
}

/// Returns the first picture whose header can be read. Corrupt pictures before it are frames that are lost later on.
fn first_picture(folder: &Path, files: &[PathBuf]) -> Result<(PathBuf, PngShape, Orientation), Error> {
    let mut why = String::new();
    for file in files {
        match PngPicture::open(file) {
            Ok(picture) => return Ok((file.clone(), picture.shape(), picture.orientation)),
            Err(Problem::Refused(message)) => return Err(Error::new(ErrorKind::Format, file.display(), message)),
            Err(Problem::Io(error)) => return Err(Error::io(file.display(), error)),
            Err(Problem::Corrupt(message)) if why.is_empty() => {
                why = format!("{}: {message}", file.file_name().unwrap_or_default().display());
            }
            Err(Problem::Corrupt(_)) => {}
        }
    }
    Err(Error::new(
        ErrorKind::Format,
        folder.display(),
        format_args!("no PNG file of {} can be read; {why}", files.len()),
    ))
}

#[cfg(test)]
mod tests;
