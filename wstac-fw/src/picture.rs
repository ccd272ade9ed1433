//! The picture that a host asks for, to place the taxels: it is sent in parts while frames go on being used.
//!
//! A board keeps no frame. Each stripe is in memory for the time of one stripe, and if the line has room then, a part
//! of it is copied and sent. So the parts are of many frames. What moves is not sharp in such a picture; what is
//! pressed on the sensor and held is.

use wstac_core::wire::{self, Message, PICTURE_PART, PictureEnd, PicturePart};

use crate::reader::Publisher;

/// The longest frame of a part on the line: its bytes, and what is around them.
pub const LONGEST_PART: usize = PICTURE_PART + 32;
/// The room that a line needs for a part, so that any other message has room after it.
pub const ROOM: usize = LONGEST_PART + wire::LONGEST;

/// A copy of a part of a stripe.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    stripe: usize,
    first: u32,
    length: u8,
    bytes: [u8; PICTURE_PART],
}

/// The progress of a picture of `STRIPES` stripes.
#[derive(Clone, Debug)]
pub struct Picture<const STRIPES: usize> {
    number: u8,
    stripe_bytes: usize,
    frame_bytes: usize,
    /// The number of parts of each stripe that were sent.
    sent: [u8; STRIPES],
    /// The number of parts that were sent, and that are to be sent; 0 if no picture is.
    parts: u16,
    all: u16,
    checksum: u32,
}

impl<const STRIPES: usize> Picture<STRIPES> {
    /// Creates the progress of no picture. A stripe has `stripe_bytes` bytes, at most 255 parts. Of all stripes, the
    /// first `frame_bytes` bytes are the picture.
    pub const fn new(stripe_bytes: usize, frame_bytes: usize) -> Self {
        Self { number: 0, stripe_bytes, frame_bytes, sent: [0; STRIPES], parts: 0, all: 0, checksum: 0 }
    }

    /// Begins another picture. One that is being sent is given up.
    pub fn begin(&mut self) {
        let number = self.number.wrapping_add(1);
        let all = (0..STRIPES).map(|stripe| self.bytes_of(stripe).div_ceil(PICTURE_PART) as u16).sum();
        *self = Self { number, all, ..Self::new(self.stripe_bytes, self.frame_bytes) };
    }

    /// Returns the bytes of a stripe that belong to the picture.
    fn bytes_of(&self, stripe: usize) -> usize {
        self.frame_bytes.saturating_sub(stripe * self.stripe_bytes).min(self.stripe_bytes)
    }

    /// Copies the next part of a stripe, if one is to be sent. `rows` are all of the stripe with this number.
    ///
    /// It is to be called before the stripe is known to be whole, and [`Picture::send`] when it is.
    pub fn part(&self, stripe: usize, rows: &[u8]) -> Option<Part> {
        if self.all == 0 {
            return None;
        }
        let from = usize::from(*self.sent.get(stripe)?) * PICTURE_PART;
        let rest = rows.get(..self.bytes_of(stripe))?.get(from..)?;
        let length = rest.len().min(PICTURE_PART);
        let mut part = Part {
            stripe,
            first: (stripe * self.stripe_bytes + from) as u32,
            length: length as u8,
            bytes: [0; PICTURE_PART],
        };
        part.bytes.get_mut(..length)?.copy_from_slice(rest.get(..length)?);
        (length > 0).then_some(part)
    }

    /// Sends a part of frame `frame`, and the end after the last part. The line must have [`ROOM`].
    // It is not inlined, so that the message does not lie on the stack while frames are used.
    #[inline(never)]
    pub fn send(&mut self, part: &Part, frame: u64, out: &mut impl Publisher) {
        let bytes = part.bytes.get(..usize::from(part.length)).unwrap_or_default();
        let message = PicturePart::new(self.number, frame, part.first, bytes);
        self.checksum = self.checksum.wrapping_add(message.checksum());
        out.send(&Message::PicturePart(message));
        if let Some(sent) = self.sent.get_mut(part.stripe) {
            *sent += 1;
        }
        self.parts += 1;
        if self.parts == self.all {
            out.send(&Message::PictureEnd(PictureEnd::new(self.number, self.parts, self.checksum)));
            self.all = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec;
    use std::vec::Vec;

    use super::*;

    /// The bytes of a stripe: two parts, and a short one.
    const STRIPE: usize = 2 * PICTURE_PART + 16;

    /// Puts the parts of pictures together, and keeps the ends.
    struct Host {
        picture: Vec<Option<u8>>,
        checksum: u32,
        ends: Vec<PictureEnd>,
        numbers: Vec<u8>,
        longest: usize,
    }

    impl Host {
        fn new() -> Self {
            Self { picture: vec![None; 3 * STRIPE], checksum: 0, ends: Vec::new(), numbers: Vec::new(), longest: 0 }
        }
    }

    impl Publisher for Host {
        fn send(&mut self, message: &Message<'_>) {
            let mut buffer = [0; wire::LONGEST];
            self.longest = self.longest.max(wire::encode(message, u16::MAX, &mut buffer).len());
            match message {
                Message::PicturePart(part) => {
                    self.checksum = self.checksum.wrapping_add(part.checksum());
                    self.numbers.push(part.picture);
                    for (place, byte) in self.picture[part.first as usize..].iter_mut().zip(part.bytes) {
                        assert_eq!(place.replace(*byte), None, "a byte was sent before");
                    }
                }
                Message::PictureEnd(end) => self.ends.push(*end),
                other => panic!("{other:?}"),
            }
        }
    }

    /// Returns the bytes of a stripe of a frame.
    fn rows(frame: u8, stripe: usize) -> Vec<u8> {
        (0..STRIPE).map(|at| (at * 7 + stripe * 31) as u8 ^ frame).collect()
    }

    #[test]
    fn nothing_is_sent_unasked_and_each_byte_once_when_asked() {
        let mut picture = Picture::<3>::new(STRIPE, 3 * STRIPE);
        assert!(picture.part(0, &rows(0, 0)).is_none());
        for number in 1..=2 {
            picture.begin();
            let mut host = Host::new();
            let mut expected = vec![None; 3 * STRIPE];
            // The line has room at some stripes only, so parts come in another order, and of many frames.
            for step in 0..60_usize {
                let (frame, stripe) = (step / 3, step % 3);
                if step * step % 7 == 3 {
                    continue;
                }
                if let Some(part) = picture.part(stripe, &rows(frame as u8, stripe)) {
                    let at = part.first as usize..part.first as usize + usize::from(part.length);
                    for (place, byte) in
                        expected[at.clone()].iter_mut().zip(&rows(frame as u8, stripe)[at.start % STRIPE..])
                    {
                        *place = Some(*byte);
                    }
                    picture.send(&part, frame as u64, &mut host);
                }
            }
            assert!(host.picture.iter().all(Option::is_some));
            assert_eq!(host.picture, expected);
            assert_eq!(host.ends, [PictureEnd::new(number, 9, host.checksum)]);
            assert_eq!(host.numbers, vec![number; 9]);
            assert!(picture.part(0, &rows(0, 0)).is_none());
        }
    }

    #[test]
    fn a_part_that_is_not_sent_is_copied_again() {
        let mut picture = Picture::<1>::new(STRIPE, STRIPE);
        picture.begin();
        let broken = picture.part(0, &rows(1, 0)).unwrap();
        let again = picture.part(0, &rows(2, 0)).unwrap();
        assert_eq!(broken.first, again.first);
        assert_eq!(again.bytes[..], rows(2, 0)[..PICTURE_PART]);
        // A stripe of another picture, or rows that are missing, have no part.
        assert!(picture.part(1, &rows(2, 0)).is_none());
        let mut host = Host::new();
        picture.send(&again, u64::MAX, &mut host);
        assert!(picture.part(0, &rows(2, 0)[..PICTURE_PART]).is_none());
    }

    #[test]
    fn the_longest_part_leaves_room_for_any_message() {
        let part = PicturePart::new(u8::MAX, u64::MAX, u32::MAX, &[u8::MAX; PICTURE_PART]);
        let mut buffer = [0; wire::LONGEST];
        assert!(wire::encode(&Message::PicturePart(part), u16::MAX, &mut buffer).len() <= LONGEST_PART);
    }
}
