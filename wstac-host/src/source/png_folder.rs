//! A folder of PNG pictures, a frame each, in natural order: `frame2.png` before `frame10.png`.
//!
//! A picture that cannot be decoded is a lost frame. One of another size or type than the first is an error, because it
//! belongs to something else.

mod picture;

use std::path::Path;

use wstac_core::rate::FrameRate;

use self::picture::{PngPicture, PngShape, Problem};
use super::orientation::Orientation;
use super::picture_files::{PNG, Pictures, first_of, list};
use super::picture_names::rate;
use super::{Frame, LossReason, Source, SourceEvent, StreamInfo};
use crate::error::Error;
use crate::plural::counted;

/// The pictures of a folder.
pub struct PngFolder {
    info: StreamInfo,
    /// The shape that all pictures must have.
    shape: PngShape,
    pub(super) pictures: Pictures,
    /// A picture as it was decoded, and as a frame if that differs.
    decoded: Vec<u8>,
    frame: Vec<u8>,
    /// A picture that is turned.
    turned: Vec<u8>,
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
        let (files, places) = list(path, PNG)?;
        let (first, (shape, orientation)) = first_of(path, &files, "PNG", |file| match PngPicture::open(file) {
            Ok(picture) => Ok(Ok((picture.shape(), picture.orientation))),
            Err(problem) => problem.damage(file).map(Err),
        })?;
        let (rate, said) = rate(places.as_ref(), fps);
        let about = format!("{}: {}, {shape}, {said}", path.display(), counted(files.len(), "PNG file"));
        let info = StreamInfo {
            bytes_per_row: shape.bytes_per_row(),
            row_order: orientation.row_order(),
            ..StreamInfo::new(about, shape.size, shape.format(), rate)
        };
        let [decoded, frame, turned] = [const { Vec::new() }; 3];
        Ok(Self { info, shape, pictures: Pictures::new((files, places), &first), decoded, frame, turned })
    }

    /// Reads a picture and returns its orientation, and whether its bytes are in `frame` rather than in `decoded`.
    fn read(&mut self, file: &Path) -> Result<(Orientation, bool), Problem> {
        let picture = PngPicture::open(file)?;
        if picture.shape() != self.shape {
            let (found, expected, model) = (picture.shape(), self.shape, &self.pictures.model);
            return Err(Problem::Refused(format!("is {found}, expected {expected} as {model}")));
        }
        Ok((picture.orientation, picture.decode(&mut self.decoded, &mut self.frame)?))
    }
}

impl Source for PngFolder {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let Some(file) = self.pictures.next() else { return Ok(SourceEvent::End) };
        let read = match self.read(&file) {
            Ok(read) => self.pictures.check_order(&file, read.0, self.info.row_order).map(|()| Ok(read)),
            Err(problem) => problem.damage(&file).map(Err),
        };
        let (turn, converted) = match self.pictures.or_end(read)? {
            Ok(read) => read,
            Err(damage) => return Ok(self.pictures.lost(&file, damage, LossReason::CorruptPicture)),
        };
        if let Some(fault) = self.pictures.turned(&file, turn) {
            return Ok(fault);
        }
        let bytes = if converted { &self.frame } else { &self.decoded };
        let (width, _) = turn.size((self.info.size.width(), self.info.size.height()));
        let pixel = (self.info.bytes_per_row / u32::from(self.info.size.width())) as usize;
        Ok(SourceEvent::Frame(Frame::new(turn.pixels(bytes, width.into(), pixel, &mut self.turned))))
    }
}

#[cfg(test)]
mod tests;
