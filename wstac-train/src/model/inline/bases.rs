//! Conditions that a Cortex-M compares in few bytes.
//!
//! Thumb-2 compares with an immediate number in one instruction if it has 8 bits, shifted. Any other number is first
//! built in a register, a negative one with two instructions and 8 bytes. So thresholds are compared with a few *bases*
//! instead, numbers that stay in registers: x ≤ t is x − (t − base) ≤ base. With t − base in 8 bits that is 2 bytes to
//! subtract and 2 to compare.
//!
//! The bases come from memory that the compiler cannot see into; otherwise it would build t again.

use super::super::integers::Part;

/// Reach of a base: the largest number in a 2-byte subtraction.
const REACH: usize = 255;
/// Reach of a base with a 4-byte subtraction.
const FAR: i32 = 4095;
/// Smallest number of thresholds for which a base is worthwhile.
const WORTH: u32 = 4;
/// Number of int16 values.
const NUMBERS: usize = 1 << 16;

#[derive(Clone, Debug, Default)]
pub(super) struct Bases(pub(super) Vec<i32>);

impl Bases {
    /// Selects at most `most` bases, each with the most thresholds in reach that no other base reaches.
    pub(super) fn of<'a>(trees: impl Iterator<Item = &'a Vec<Part>>, most: usize) -> Self {
        let mut counts = vec![0_u32; NUMBERS];
        for part in trees.flatten() {
            if let Part::Split { threshold, .. } = *part
                && !is_short(i32::from(threshold))
            {
                counts[(i32::from(threshold) + 32_768) as usize] += 1;
            }
        }
        let mut bases = Vec::new();
        while bases.len() < most {
            let mut sums = vec![0_u32; NUMBERS + 1];
            for (number, &count) in counts.iter().enumerate() {
                sums[number + 1] = sums[number] + count;
            }
            let near = |base: usize| base.saturating_sub(REACH)..(base + REACH + 1).min(NUMBERS);
            let worth = |base: usize| sums[near(base).end] - sums[near(base).start];
            // Of equal candidates the lowest wins, so that the same model gives the same text.
            let Some(best) = (0..NUMBERS).rev().max_by_key(|&base| worth(base)) else { break };
            if worth(best) < WORTH {
                break;
            }
            counts[near(best)].fill(0);
            bases.push(best as i32 - 32_768);
        }
        Self(bases)
    }

    /// Returns the Rust condition that the input is at most the threshold, or above it.
    pub(super) fn condition(&self, input: u16, threshold: i16, above: bool) -> String {
        let sign = if above { ">" } else { "<=" };
        let (x, threshold) = (format!("i32::from(s[{input}])"), i32::from(threshold));
        let nearest = (0..).zip(&self.0).min_by_key(|(_, base)| base.abs_diff(threshold));
        let Some((number, base)) = nearest.filter(|_| !is_short(threshold)) else {
            return format!("{x} {sign} {threshold}");
        };
        match threshold - base {
            0 => format!("{x} {sign} b{number}"),
            away if away.unsigned_abs() as usize <= REACH => format!("{x}.wrapping_sub({away}) {sign} b{number}"),
            away if away.abs() <= FAR => format!("{x} {sign} b{number}.wrapping_add({away})"),
            _ => format!("{x} {sign} {threshold}"),
        }
    }
}

/// Returns `true` if one instruction compares with the threshold directly: with it, or strictly with the next number.
///
/// The compiler turns negative thresholds into sums of a number in a register; bases do this better.
fn is_short(threshold: i32) -> bool {
    threshold >= 0
        && [threshold, threshold + 1].into_iter().any(|number| {
            let number = number.cast_unsigned();
            number < 1 << 8 || u32::BITS - number.leading_zeros() - number.trailing_zeros() <= 8
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(threshold: i16) -> Part {
        Part::Split { input: 3, threshold, left: 0, right: 0 }
    }

    #[test]
    fn bases_are_where_thresholds_are() {
        let tree: Vec<Part> = (-4000..-3000).chain(1000..1100).chain(7000..7003).map(split).collect();
        let bases = Bases::of([&tree].into_iter(), 9).0;
        // All but three thresholds are within reach of a base, and another base would not be worthwhile.
        assert_eq!(bases.len(), 3);
        for part in &tree[..1100] {
            let Part::Split { threshold, .. } = *part else { unreachable!() };
            assert!(bases.iter().any(|base| base.abs_diff(i32::from(threshold)) <= 255), "{threshold}");
        }
        assert!(Bases::of([&tree].into_iter(), 2).0.len() == 2);
    }

    #[test]
    fn a_condition_takes_the_cheapest_form() {
        let bases = Bases(vec![-4000, 2001]);
        for (threshold, expected) in [
            (200, "i32::from(s[3]) <= 200"),
            // 8 bits at another place, or 8 bits with a strict comparison.
            (508, "i32::from(s[3]) <= 508"),
            (1023, "i32::from(s[3]) <= 1023"),
            (1025, "i32::from(s[3]) <= b1.wrapping_add(-976)"),
            (-1, "i32::from(s[3]) <= b1.wrapping_add(-2002)"),
            (-4000, "i32::from(s[3]) <= b0"),
            (-4255, "i32::from(s[3]).wrapping_sub(-255) <= b0"),
            (-4257, "i32::from(s[3]) <= b0.wrapping_add(-257)"),
            (2253, "i32::from(s[3]).wrapping_sub(252) <= b1"),
            (i16::MIN, "i32::from(s[3]) <= -32768"),
            (12_345, "i32::from(s[3]) <= 12345"),
        ] {
            assert_eq!(bases.condition(3, threshold, false), expected);
        }
        assert_eq!(bases.condition(0, -4001, true), "i32::from(s[0]).wrapping_sub(-1) > b0");
    }
}
