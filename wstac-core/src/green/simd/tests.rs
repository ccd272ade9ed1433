//! Compares the kernels with plain sums.

use std::cell::Cell;
use std::io::Write;
use std::vec;
use std::vec::Vec;

use super::*;
use crate::green::ycbcr::tests::COLORS;
use crate::green::ycbcr::{Conversion, Exact, Vectors};

/// Bytes of the widest vector of kernels that sum bytes.
const WIDEST: usize = 32;

std::thread_local! {
    /// Whether this thread does without AVX-512.
    pub(in crate::green) static NARROW: Cell<bool> = const { Cell::new(false) };
}

/// Runs a test with each instruction set that the machine has.
///
/// If it has none, says that nothing was compared, even if the test's output is captured.
pub(super) fn with_each_set(test: impl Fn(Simd)) {
    let Some(widest) = Simd::get() else {
        let _ = writeln!(std::io::stderr(), "no vectors here: their sums were NOT compared with the plain ones");
        return;
    };
    test(widest);
    NARROW.set(true);
    Simd::get().filter(|narrow| narrow.name() != widest.name()).into_iter().for_each(test);
    NARROW.set(false);
}

/// Pseudo-random numbers that are the same each time.
pub(super) struct Chance(pub(super) u32);

impl Chance {
    pub(super) fn below(&mut self, below: u32) -> usize {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(self.0) * u64::from(below)) >> 32) as usize
    }
}

/// Returns bytes that are often 255, their bytes per row, width and rows. The sums of some do not fit 16 bits.
fn blocks() -> impl Iterator<Item = (Vec<u8>, usize, usize, usize)> {
    let mut chance = Chance(1);
    let mut next = move |below: u32| chance.below(below);
    (0..1_500).map(move |turn| {
        let width = WIDEST + next(if turn % 50 == 0 { 9_000 } else { 300 });
        let rows = 1 + next(if turn % 50 == 1 { 700 } else { 60 });
        let pitch = width + next(9);
        let most = if turn % 3 == 0 { 1 } else { 256 };
        let bytes = (0..(rows - 1) * pitch + width).map(|_| 255 - next(most) as u8).collect();
        (bytes, pitch, width, rows)
    })
}

fn plain(block: Block<'_>, period: usize, place: usize) -> u32 {
    block.each_row().flat_map(|row| row.iter().skip(place).step_by(period)).map(|&byte| u32::from(byte)).sum()
}

#[test]
fn sums_are_the_plain_ones() {
    with_each_set(|simd| {
        for (bytes, pitch, width, rows) in blocks() {
            let block = |period| Block::new(&bytes, pitch, width / period * period, rows).unwrap();
            assert_eq!(simd.sum::<1, 0>(block(1)), Some(plain(block(1), 1, 0)), "{width} bytes in {rows} rows");
            if width < 2 * WIDEST {
                continue;
            }
            assert_eq!(simd.sum::<3, 1>(block(3)), Some(plain(block(3), 3, 1)), "{width} bytes in {rows} rows");
            assert_eq!(simd.sum::<4, 2>(block(4)), Some(plain(block(4), 4, 2)), "{width} bytes in {rows} rows");
            let Some(places) = simd.places(block(4)) else {
                assert!(width > 16 * ROOM);
                continue;
            };
            for place in 0..4 {
                assert_eq!(places.all[place], plain(block(4), 4, place), "{width} bytes in {rows} rows");
                let ends = |at: usize| block(4).each_row().map(|row| u32::from(row[at])).sum::<u32>();
                assert_eq!(places.first[place], ends(place));
                assert_eq!(places.last[place], ends(block(4).width() - 4 + place));
            }
        }
    });
}

#[test]
fn exact_green_is_that_of_the_plain_code_for_all_2_to_the_24_triples() {
    /// Cells of the test's row: a pair of the widest vectors.
    const CELLS: usize = 32;
    with_each_set(|simd| {
        for color in COLORS {
            let exact = Exact::new(color);
            for chroma in 0..=u16::MAX {
                let [cb, cr] = chroma.to_le_bytes();
                let green = |y| {
                    let mut one = 0;
                    exact.add(&mut one, y, exact.chroma(cb, cr));
                    one
                };
                // Of three lumas 1, 3 and 60 pixels. Three errors of -1, 0 or 1 cannot cancel each other.
                for first in (0_u8..=255).step_by(3) {
                    let [a, b, c] = [first, first.saturating_add(1), first.saturating_add(2)];
                    let mut bytes = [[c, cb, c, cr]; CELLS];
                    bytes[0] = [a, cb, b, cr];
                    bytes[CELLS - 1] = [b, cb, b, cr];
                    let luma = Block::new(bytes.as_flattened(), 4 * CELLS, 4 * CELLS, 1).unwrap();
                    let cells = Cells { luma, chroma: Chroma::Within(0), outside: [0, 0] };
                    let mut sum = 0;
                    exact.add_cells(&mut sum, &cells, simd);
                    assert_eq!(sum, green(a) + 3 * green(b) + 60 * green(c), "{color:?} {first} {cb} {cr}");
                }
            }
        }
    });
}

/// Returns w as the kernels find it, with this added to the offset.
fn w(factors: &Factors, chroma: [u8; 2], offset: i32) -> i32 {
    let sum = |parts: [i16; 2]| {
        let one = |n: usize| i32::from(chroma[n]) * i32::from(factors.scale[n]) * i32::from(parts[n]);
        one(0) + one(1)
    };
    (sum(factors.high) + (sum(factors.low) >> 16) + factors.offset + offset) >> 16
}

#[test]
fn factors_with_fewer_bits_make_the_same_w_and_their_offsets_have_this_much_room() {
    // In units of the offset. Exact fractions leave less than a unit on either side for two of the four.
    let room = COLORS.map(|color| {
        let exact = Exact::new(color);
        let same = |offset: &i32| {
            let all = (0..=u16::MAX).map(u16::to_le_bytes);
            all.into_iter().all(|[cb, cr]| w(&exact.factors, [cb, cr], *offset) == exact.chroma(cb, cr))
        };
        (-3..=3).filter(same).collect::<Vec<_>>()
    });
    assert_eq!(room, [vec![0], vec![0, 1], vec![-1, 0, 1], vec![0]]);
}
