//! RGB565: little-endian 16-bit words of 5 bits of red, 6 of green, 5 of blue.

use super::{Block, Encoder, Frame};

pub(in crate::sensor) const GREEN_LEVELS: u16 = 64;

/// Returns the level that 6 bits of green are read as (SPEC §1).
pub(in crate::sensor) const fn green_level(bits: u16) -> u16 {
    bits << 2 | bits >> 4
}

/// Returns the 6 bits that are read as the green nearest to `value`, 0..=255; of two equally near, the darker.
pub(in crate::sensor) fn nearest_green(value: u16) -> u16 {
    // Widened bits are 4 or 5 apart. The nearest are those of the value less half of that, or the next.
    let bits = value.saturating_sub(2) >> 2;
    let next = (bits + 1).min(GREEN_LEVELS - 1);
    if value.abs_diff(green_level(next)) < value.abs_diff(green_level(bits)) { next } else { bits }
}

/// The RGB565 encoder.
#[derive(Debug)]
pub(super) struct Rgb565;

impl Encoder for Rgb565 {
    fn encode(&self, block: &Block<'_>, frame: &mut Frame) {
        let words = frame.row(block.top, 2 * block.left, 2 * block.width).as_chunks_mut().0;
        for (word, [red, green, blue]) in words.iter_mut().zip(block.pixels()) {
            let five = |value: u16| (value * 31 + 127) / 255;
            *word = (five(red) << 11 | nearest_green(green) << 5 | five(blue)).to_le_bytes();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_other_green_is_nearer() {
        for value in 0..=255_u16 {
            let off = |bits| value.abs_diff(green_level(bits));
            let nearest = (0..GREEN_LEVELS).map(off).min().unwrap();
            assert_eq!(off(nearest_green(value)), nearest, "{value}");
        }
        assert_eq!([0, 255].map(nearest_green), [0, 63]);
    }
}
