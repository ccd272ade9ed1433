//! The loops beside what they say they sum.

use std::io::Write;
use std::vec::Vec;

use super::*;
use crate::green::ycbcr::{Conversion, Exact, GUARDS, QuantizationRange, Vectors, YcbcrEncoding, YcbcrMatrix};

/// AVX2, if the machine has it. Where it has not there is nothing to compare, and this says so even where a test's output is kept back.
pub(super) fn machine_has() -> Option<Avx2> {
    let avx2 = Avx2::get();
    if avx2.is_none() {
        let _ = writeln!(std::io::stderr(), "no AVX2 here: its sums were NOT compared with the plain ones");
    }
    avx2
}

/// Numbers that look like chance and are the same each time.
pub(super) struct Chance(pub(super) u32);

impl Chance {
    pub(super) fn below(&mut self, below: u32) -> usize {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(self.0) * u64::from(below)) >> 32) as usize
    }
}

/// Bytes that are often the highest, and a width, rows and bytes from row to row: some beyond what 16 bits hold the sums of.
fn blocks() -> impl Iterator<Item = (Vec<u8>, usize, usize, usize)> {
    let mut chance = Chance(1);
    let mut next = move |below: u32| chance.below(below);
    (0..1_500).map(move |turn| {
        let width = VECTOR + next(if turn % 50 == 0 { 9_000 } else { 300 });
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
    let Some(avx2) = machine_has() else { return };
    for (bytes, pitch, width, rows) in blocks() {
        let block = |period| Block::new(&bytes, pitch, width / period * period, rows).unwrap();
        assert_eq!(avx2.sum::<1, 0>(block(1)), Some(plain(block(1), 1, 0)), "{width} bytes in {rows} rows");
        if width < 2 * VECTOR {
            continue;
        }
        assert_eq!(avx2.sum::<3, 1>(block(3)), Some(plain(block(3), 3, 1)), "{width} bytes in {rows} rows");
        assert_eq!(avx2.sum::<4, 2>(block(4)), Some(plain(block(4), 4, 2)), "{width} bytes in {rows} rows");
        let Some(places) = avx2.places(block(4)) else {
            assert!(width > places::MOST_WIDTH);
            continue;
        };
        for place in 0..4 {
            assert_eq!(places.all[place], plain(block(4), 4, place), "{width} bytes in {rows} rows");
            let ends = |at: usize| block(4).each_row().map(|row| u32::from(row[at])).sum::<u32>();
            assert_eq!(places.first[place], ends(place));
            assert_eq!(places.last[place], ends(block(4).width() - 4 + place));
        }
    }
}

#[test]
fn exact_green_is_that_of_the_plain_way_for_all_2_to_the_24_triples() {
    let Some(avx2) = machine_has() else { return };
    for matrix in [YcbcrMatrix::Bt601, YcbcrMatrix::Bt709] {
        for range in [QuantizationRange::Limited, QuantizationRange::Full] {
            let exact = Exact::new(YcbcrEncoding { matrix, range });
            for chroma in 0..=u16::MAX {
                let [cb, cr] = chroma.to_le_bytes();
                let green = |y| {
                    let mut one = 0;
                    exact.add(&mut one, y, exact.chroma(cb, cr));
                    one
                };
                // Of three lumas 1, 3 and 12 pixels: no three errors of one up or down, or none, cancel each other.
                for first in (0_u8..=255).step_by(3) {
                    let [a, b, c] = [first, first.saturating_add(1), first.saturating_add(2)];
                    let mut bytes = [[c, cb, c, cr]; exact::CELLS];
                    bytes[0] = [a, cb, b, cr];
                    bytes[1] = [b, cb, b, cr];
                    let luma = Block::new(bytes.as_flattened(), VECTOR, VECTOR, 1).unwrap();
                    let cells = Cells { luma, chroma: Chroma::Within(0), beside: [0, 0] };
                    let mut sum = 0;
                    exact.add_cells(&mut sum, &cells, avx2);
                    assert_eq!(sum, green(a) + 3 * green(b) + 12 * green(c), "{matrix:?} {range:?} {first} {cb} {cr}");
                }
            }
        }
    }
}

#[test]
fn factors_of_30_bits_make_the_same_w_with_any_guard_from_least_to_most() {
    let colors = [YcbcrMatrix::Bt601, YcbcrMatrix::Bt709].map(|matrix| {
        [QuantizationRange::Limited, QuantizationRange::Full].map(|range| Exact::new(YcbcrEncoding { matrix, range }))
    });
    let same = |guard: &i64| {
        colors.as_flattened().iter().all(|exact| {
            let factors = exact.factors_with(*guard);
            (0..=u16::MAX).map(u16::to_le_bytes).all(|[cb, cr]| factors.w(cb, cr) == exact.chroma(cb, cr))
        })
    };
    let found: Vec<i64> = (-200..400).filter(same).collect();
    assert_eq!(found, GUARDS.collect::<Vec<_>>());
}
