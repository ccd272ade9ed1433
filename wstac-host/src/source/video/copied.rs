//! Motion JPEG in a container: ffmpeg hands its pictures out as they are, and they are decoded as those of a camera.

use std::io::Read;
use std::process::ChildStdout;

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;

use super::Reported;
use crate::camera::mjpeg;
use crate::error::Error;
use crate::source::{Fault, FaultKind, Frame, Source, SourceEvent, StreamInfo};

/// The options with which ffmpeg copies pictures, and reports the time and the size of each before it.
pub(super) const COPY: &str = "-map 0:V:0 -c copy -copyinkf -flush_packets 1 -f framecrc pipe:2 \
                               -map 0:V:0 -c copy -copyinkf -f mjpeg pipe:1";

pub(super) struct CopiedPictures {
    info: StreamInfo,
    output: ChildStdout,
    decoder: mjpeg::Decoder,
    picture: Vec<u8>,
    has_arrived: bool,
    is_loss_reported: bool,
}

impl CopiedPictures {
    pub(super) fn new(subject: &str, output: ChildStdout, size: FrameSize, rate: FrameRate) -> Self {
        let info = StreamInfo::new(subject, size, PixelFormat::Rgb24, rate);
        let (decoder, picture) = (mjpeg::Decoder::new(size), Vec::new());
        Self { info, output, decoder, picture, has_arrived: false, is_loss_reported: false }
    }
}

impl Reported for CopiedPictures {
    fn has_frame(&mut self) -> bool {
        self.has_arrived
    }

    fn arrive(&mut self, bytes: u64) {
        self.picture.clear();
        // Its end is missing only after an error, which ffmpeg reports.
        let read = self.output.by_ref().take(bytes).read_to_end(&mut self.picture);
        self.has_arrived = read.is_ok_and(|read| read as u64 == bytes);
    }
}

impl Source for CopiedPictures {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        if !std::mem::take(&mut self.has_arrived) {
            return Ok(SourceEvent::End);
        }
        Ok(match self.decoder.picture(&self.picture) {
            Ok(rgb) => SourceEvent::Frame(Frame { encoded: Some(&self.picture), ..Frame::new(rgb) }),
            Err(why) if std::mem::replace(&mut self.is_loss_reported, true) => {
                SourceEvent::Lost { frames: 1, reason: why.reason() }
            }
            // The picture comes again after it.
            Err(why) => {
                self.has_arrived = true;
                let message =
                    format!("{}: a picture cannot be decoded: {why}; others count as lost, too", self.info.about);
                SourceEvent::Fault(Fault::new(FaultKind::Decoder, message))
            }
        })
    }
}
