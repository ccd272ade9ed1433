//! The orientation that a picture's Exif data state, and pixels turned by it.

use wstac_core::layout::FrameSize;
use wstac_core::touch::motion::RowOrder;

/// The directory entry of the orientation, and its type of 16 bits.
const ORIENTATION: u32 = 0x0112;
const SHORT: u32 = 3;
/// How pixels are turned, by orientation from 1 on.
const TURNS: [&str; 8] = [
    "left as they are",
    "mirrored",
    "turned by 180 degrees",
    "turned by 180 degrees and mirrored",
    "turned by 90 degrees clockwise and mirrored",
    "turned by 90 degrees clockwise",
    "turned by 90 degrees counterclockwise and mirrored",
    "turned by 90 degrees counterclockwise",
];

/// An orientation, 0 to 7: one less than Exif's number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Orientation(u8);

impl Orientation {
    /// Reads Exif data, which begin with a header of TIFF. Without an orientation, pixels stay as they are.
    pub(super) fn of_exif(data: &[u8]) -> Self {
        Self::find(data).unwrap_or_default()
    }

    fn find(data: &[u8]) -> Option<Self> {
        let number = |at: usize, bytes: usize| {
            let field = data.get(at..at.checked_add(bytes)?)?;
            let join = |sum: u32, byte: &u8| sum << 8 | u32::from(*byte);
            match data.get(..2)? {
                b"II" => Some(field.iter().rev().fold(0, join)),
                b"MM" => Some(field.iter().fold(0, join)),
                _ => None,
            }
        };
        let directory = number(4, 4)? as usize;
        for entry in 0..number(directory, 2)? as usize {
            let at = directory + 2 + 12 * entry;
            if number(at, 2)? == ORIENTATION {
                let value = number(at + 8, 2).filter(|_| number(at + 2, 2) == Some(SHORT))?;
                return (1..=8).contains(&value).then(|| Self(value as u8 - 1));
            }
        }
        None
    }

    /// Returns how pixels are turned; `None` if they stay as they are.
    pub(super) fn turn(self) -> Option<&'static str> {
        TURNS.get(usize::from(self.0)).copied().filter(|_| self.0 > 0)
    }

    /// Returns the width and height of a picture after its turn.
    pub(super) fn size<T>(self, (width, height): (T, T)) -> (T, T) {
        if self.0 < 4 { (width, height) } else { (height, width) }
    }

    /// Returns where the stored rows follow each other after the turn.
    pub(super) fn row_order(self) -> RowOrder {
        match self.0 {
            0 | 1 => RowOrder::Down,
            2 | 3 => RowOrder::Up,
            4 | 7 => RowOrder::Right,
            _ => RowOrder::Left,
        }
    }

    /// Returns the size of a frame after its turn.
    pub(super) fn frame_size(self, size: FrameSize) -> FrameSize {
        let (width, height) = self.size((size.width(), size.height()));
        // Both sides have the same limits.
        FrameSize::new(width.into(), height.into()).unwrap_or(size)
    }

    /// Returns the pixels of a picture with `width` pixels of `bytes` bytes a row, turned. `to` takes them if they
    /// change.
    pub(super) fn pixels<'a>(self, from: &'a [u8], width: usize, bytes: usize, to: &'a mut Vec<u8>) -> &'a [u8] {
        if self.0 == 0 {
            return from;
        }
        let height = from.len() / (width * bytes).max(1);
        to.clear();
        let (columns, rows) = self.size((width, height));
        for row in 0..rows {
            for column in 0..columns {
                let x = if matches!(self.0, 1 | 2 | 5 | 6) { columns - 1 - column } else { column };
                let y = if matches!(self.0, 2 | 3 | 6 | 7) { rows - 1 - row } else { row };
                let (x, y) = self.size((x, y));
                let at = (y * width + x) * bytes;
                to.extend_from_slice(from.get(at..at + bytes).unwrap_or_default());
            }
        }
        to
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_turned_as_exif_says() {
        let stored = [1, 2, 3, 4, 5, 6];
        for (orientation, expected) in (1..).zip([
            [1, 2, 3, 4, 5, 6],
            [3, 2, 1, 6, 5, 4],
            [6, 5, 4, 3, 2, 1],
            [4, 5, 6, 1, 2, 3],
            [1, 4, 2, 5, 3, 6],
            [4, 1, 5, 2, 6, 3],
            [6, 3, 5, 2, 4, 1],
            [3, 6, 2, 5, 1, 4],
        ]) {
            let little = [b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0", &[orientation, 0, 0, 0][..]].concat();
            let big = [b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0", &[orientation, 0, 0][..]].concat();
            let turn = Orientation::of_exif(&little);
            assert_eq!(turn, Orientation::of_exif(&big));
            assert_eq!(turn.turn().is_none(), orientation == 1);
            assert_eq!(turn.size((3, 2)), if orientation < 5 { (3, 2) } else { (2, 3) });
            assert_eq!(turn.pixels(&stored, 3, 1, &mut Vec::new()), expected, "{orientation}");
            let at = |value| expected.iter().position(|pixel| *pixel == value).unwrap();
            // The first row has 1, the second 4.
            let order = match at(4) as isize - at(1) as isize {
                3 => RowOrder::Down,
                -3 => RowOrder::Up,
                1 => RowOrder::Right,
                _ => RowOrder::Left,
            };
            assert_eq!(turn.row_order(), order, "{orientation}");
            let pairs: Vec<u8> = stored.iter().flat_map(|value| [*value, 0]).collect();
            let turned: Vec<u8> = turn.pixels(&pairs, 3, 2, &mut Vec::new()).iter().step_by(2).copied().collect();
            assert_eq!(turned, expected, "{orientation}");
        }
    }

    #[test]
    fn broken_exif_data_turn_nothing() {
        let whole = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0";
        assert_eq!(Orientation::of_exif(whole).0, 5);
        let far = b"MM\0*\xff\xff\xff\xff\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06";
        let other = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x09\0";
        let starts = (0..whole.len()).map(|length| &whole[..length]);
        for data in starts.chain([&far[..], other, b"none of it at all"]) {
            assert_eq!(Orientation::of_exif(data), Orientation::default(), "{data:?}");
        }
    }
}
