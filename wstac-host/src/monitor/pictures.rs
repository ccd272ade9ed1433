//! The pictures of a board's camera as frames, to place the taxels.
//!
//! A board sends a picture in parts while it goes on using frames. At 115,200 bits per second, a picture of 320 × 240
//! bytes takes about eight seconds, and its parts are of many frames. So it shows sharply what does not move.

use std::collections::VecDeque;
use std::ffi::OsStr;
use std::time::{Duration, Instant};

use wstac_core::wire::{Hello, Message, PICTURE_PART, PictureEnd, PicturePart, Request};

use super::board::fault_in_words;
use super::port::Got;
use super::settings::SettableBoard;
use crate::error::Error;
use crate::source::{Fault, FaultKind, Frame, Source, SourceEvent, StreamInfo};

/// The time without a part after which a picture is asked for again.
const SILENT: Duration = Duration::from_secs(2);
/// The longest wait for a board that describes itself.
const HELLO: Duration = Duration::from_secs(5);
/// The largest number of bytes of a picture: an end counts no more parts.
const LARGEST: usize = PICTURE_PART * u16::MAX as usize;
/// A board that is asked for one picture after another.
#[derive(Debug)]
pub struct BoardPictures {
    board: SettableBoard,
    info: StreamInfo,
    picture: Assembly,
    /// The picture that was returned last. Parts of the next one may have arrived before it was.
    returned: Vec<u8>,
    /// The messages that were read while one picture was waited for, as events.
    events: VecDeque<Event>,
    /// Whether a picture is asked for next.
    wants_picture: bool,
    /// The time of the last part, or of the last request.
    heard: Instant,
}

/// Something that a source reports.
#[derive(Debug)]
enum Event {
    Picture(Vec<u8>),
    Fault(Fault),
}

impl BoardPictures {
    /// Opens a port as `wstac monitor` does, and waits until the board describes itself.
    ///
    /// # Errors
    /// The port cannot be opened or read, no board answers, or it speaks another version of the link.
    pub fn open(port: &OsStr, baud: Option<u32>) -> Result<Self, Error> {
        let (mut board, heard) = (SettableBoard::open(port, baud)?, Instant::now());
        let info = board.ask_within(HELLO, &[Request::Hello], info_in)?;
        let info = info.ok_or_else(|| board.failed("has no description of a board, expected a board"))?;
        let bytes = info.frame_bytes();
        if bytes > LARGEST {
            return Err(board.lacks(format_args!("has pictures of {bytes} bytes, expected at most {LARGEST}")));
        }
        Ok(Self {
            board,
            info,
            picture: Assembly::new(bytes),
            returned: Vec::new(),
            events: VecDeque::new(),
            wants_picture: true,
            heard,
        })
    }

    fn take(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let Self { board, picture, events, wants_picture, heard, .. } = self;
        for &byte in bytes {
            board.push(byte, |message| {
                match *message {
                    Message::PicturePart(ref part) => {
                        picture.part(part);
                        *heard = Instant::now();
                    }
                    Message::PictureEnd(end) => {
                        *wants_picture = true;
                        events.push_back(match picture.end(end) {
                            Some(picture) => Event::Picture(picture),
                            None => fault_of_board("a part of a picture was lost on the line; it is asked for again"),
                        });
                    }
                    Message::Fault(ref fault) => events.push_back(fault_of_board(fault_in_words(fault))),
                    _ => {}
                }
                None::<()>
            })?;
        }
        Ok(())
    }
}

impl Source for BoardPictures {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let mut room = [0; 4096];
        if self.events.is_empty() {
            if self.wants_picture || self.heard.elapsed() > SILENT {
                self.wants_picture = false;
                self.heard = Instant::now();
                self.board.send(&Request::Picture);
            }
            match self.board.port.read(&mut room)? {
                Got::Bytes(count) => self.take(room.get(..count).unwrap_or_default())?,
                Got::Ended => return Ok(SourceEvent::End),
                Got::Gone => {
                    let message = format!("{} is gone; waiting for it", self.board.port.name());
                    return Ok(SourceEvent::Fault(Fault::new(FaultKind::Disconnected, message)));
                }
                Got::Back => {
                    self.wants_picture = true;
                    let message = format!("{} is back", self.board.port.name());
                    return Ok(SourceEvent::Fault(Fault::new(FaultKind::Reconnected, message)));
                }
                Got::Nothing => {}
            }
        }
        match self.events.pop_front() {
            Some(Event::Picture(picture)) => {
                self.returned = picture;
                Ok(SourceEvent::Frame(Frame::new(&self.returned)))
            }
            Some(Event::Fault(fault)) => Ok(SourceEvent::Fault(fault)),
            None => Ok(SourceEvent::Waiting),
        }
    }
}

/// Returns what a board reports about itself, or its line.
fn fault_of_board(message: impl Into<String>) -> Event {
    Event::Fault(Fault::new(FaultKind::from("board"), message))
}

pub(super) fn info_in(message: &Message<'_>) -> Option<StreamInfo> {
    let Message::Hello(Hello { firmware, version, size, format, rate, .. }) = message else { return None };
    let (width, height) = (size.width(), size.height());
    let about = format!("pictures of {firmware} {version}, {width}x{height} {format:?}");
    Some(StreamInfo::new(about, *size, *format, *rate))
}

/// The parts of a picture that have arrived.
#[derive(Debug)]
struct Assembly {
    bytes: Vec<u8>,
    /// Which bytes have arrived.
    arrived: Vec<bool>,
    number: Option<u8>,
    parts: u16,
    checksum: u32,
    /// Whether a part came twice, or from outside the picture.
    is_wrong: bool,
}

impl Assembly {
    fn new(length: usize) -> Self {
        let (bytes, arrived) = (vec![0; length], vec![false; length]);
        Self { bytes, arrived, number: None, parts: 0, checksum: 0, is_wrong: false }
    }

    /// Takes a part. The first one of another picture gives up the last.
    fn part(&mut self, part: &PicturePart<'_>) {
        if self.number != Some(part.picture) {
            *self = Self { number: Some(part.picture), ..Self::new(self.bytes.len()) };
        }
        self.parts = self.parts.saturating_add(1);
        self.checksum = self.checksum.wrapping_add(part.checksum());
        let first = part.first as usize;
        let places = first..first.saturating_add(part.bytes.len());
        let (bytes, arrived) = (self.bytes.get_mut(places.clone()), self.arrived.get_mut(places));
        let (Some(bytes), Some(arrived)) = (bytes, arrived) else {
            self.is_wrong = true;
            return;
        };
        self.is_wrong |= arrived.contains(&true) || arrived.is_empty();
        bytes.copy_from_slice(part.bytes);
        arrived.fill(true);
    }

    /// Returns the picture if every byte of it has arrived once, and the checksums are right.
    fn end(&mut self, end: PictureEnd) -> Option<Vec<u8>> {
        let is_whole = self.number == Some(end.picture)
            && self.parts == end.parts
            && self.checksum == end.checksum
            && !self.is_wrong
            && !self.arrived.contains(&false);
        let picture = std::mem::take(&mut self.bytes);
        *self = Self::new(picture.len());
        is_whole.then_some(picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: usize = 1000;

    fn picture() -> Vec<u8> {
        (0..LENGTH).map(|at| (at * 7 % 251) as u8).collect()
    }

    /// Returns the parts of the picture with this number, in an order of their own, and the end.
    fn parts(number: u8, picture: &[u8]) -> (Vec<PicturePart<'_>>, PictureEnd) {
        let mut parts: Vec<_> = picture
            .chunks(160)
            .enumerate()
            .map(|(at, bytes)| PicturePart::new(number, 9, 160 * at as u32, bytes))
            .collect();
        parts.rotate_left(2);
        let checksum = parts.iter().fold(0, |sum: u32, part| sum.wrapping_add(part.checksum()));
        let end = PictureEnd::new(number, parts.len() as u16, checksum);
        (parts, end)
    }

    fn taken(assembly: &mut Assembly, parts: &[PicturePart<'_>], end: PictureEnd) -> Option<Vec<u8>> {
        for part in parts {
            assembly.part(part);
        }
        assembly.end(end)
    }

    #[test]
    fn a_picture_is_its_parts_in_any_order() {
        let (picture, mut assembly) = (picture(), Assembly::new(LENGTH));
        for number in [254, 255, 0] {
            let (parts, end) = parts(number, &picture);
            assert_eq!(taken(&mut assembly, &parts, end).as_ref(), Some(&picture));
        }
    }

    #[test]
    fn a_part_that_is_missing_twice_there_changed_or_outside_costs_the_picture() {
        let picture = picture();
        let (parts, end) = parts(3, &picture);
        let (first, changed) = (parts[0], [7; 160]);
        let cases: [(&str, Vec<PicturePart<'_>>); 6] = [
            ("missing", parts[1..].to_vec()),
            ("twice", [&parts[..], &parts[..1]].concat()),
            ("twice, another missing", [&parts[..1], &parts[..1], &parts[2..]].concat()),
            ("changed", [&[PicturePart::new(3, first.frame, first.first, &changed)], &parts[1..]].concat()),
            ("outside", [&parts[..], &[PicturePart::new(3, 9, LENGTH as u32 - 1, &changed)]].concat()),
            (
                "of another picture",
                [&[PicturePart::new(4, first.frame, first.first, first.bytes)], &parts[1..]].concat(),
            ),
        ];
        for (name, found) in cases {
            let mut assembly = Assembly::new(LENGTH);
            assert_eq!(taken(&mut assembly, &found, end), None, "{name}");
            // The next one is not spoiled by it.
            let (again, end) = tests::parts(4, &picture);
            assert_eq!(taken(&mut assembly, &again, end).as_ref(), Some(&picture), "after {name}");
        }
        // An end without parts, and that of a picture that was given up.
        let mut assembly = Assembly::new(LENGTH);
        assert_eq!(assembly.end(end), None);
        for part in &parts {
            assembly.part(part);
        }
        assert_eq!(assembly.end(PictureEnd::new(2, end.parts, end.checksum)), None);
    }
}
