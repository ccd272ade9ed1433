//! Blocks of cells: two pixels that share a chroma sample.

use super::{LEAST_CELLS, Simd};
use crate::frame::{Block, Run};
use crate::green::ycbcr::Conversion;

/// The cells of a block, of which each row has at least 8: the luma of two pixels and their chroma sample.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a> {
    /// Rows of luma, of all pixels of the cells. If chroma lies between luma, rows of both.
    pub(in crate::green) luma: Block<'a>,
    pub(in crate::green) chroma: Chroma<'a>,
    /// The number of pixels outside the block in the first cell of a row, and in the last: 0 or 1.
    pub(in crate::green) outside: [usize; 2],
}

/// Says where the chroma samples of cells are.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Chroma<'a> {
    /// Between luma. The first luma byte has this place in each group of four.
    Within(usize),
    /// In rows of Cb Cr pairs.
    Pairs(Block<'a>, Shared),
    /// In rows of Cb, and rows of Cr.
    Planes([Block<'a>; 2], Shared),
}

/// Says how rows of luma share rows of chroma.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shared {
    /// 2^`vertical` rows of luma share a row of chroma.
    vertical: u32,
    /// The number of rows of luma above the block that share its first row of chroma: 0 or 1.
    above: usize,
}

impl Shared {
    /// Creates the rule for a block that starts at frame row `y`.
    #[inline(always)]
    pub(in crate::green) fn new(y: u16, vertical: u32) -> Self {
        Self { vertical, above: usize::from(y) & ((1 << vertical) - 1) }
    }

    /// Returns the number of rows of chroma that this many rows of luma have.
    #[inline(always)]
    pub(in crate::green) fn rows(self, luma: u16) -> u16 {
        (luma + self.above as u16).div_ceil(1 << self.vertical)
    }

    /// Returns the row of chroma of a row of luma. Both are counted from the first row of their blocks.
    #[inline(always)]
    pub(in crate::green) fn row(self, luma: usize) -> usize {
        (luma + self.above) >> self.vertical
    }

    /// Adds up what `sum` finds in the chroma of each of `luma` rows of luma.
    #[inline(always)]
    fn sum<const N: usize>(
        self,
        chroma: Block<'_>,
        luma: usize,
        sum: impl Fn(Block<'_>) -> Option<[u32; N]>,
    ) -> Option<[u32; N]> {
        let all = sum(chroma)?;
        if self.vertical == 0 {
            return Some(all);
        }
        let one = |row: usize| sum(Block::new(chroma.row(row), chroma.width(), chroma.width(), 1)?);
        let first = if self.above == 1 { one(0)? } else { [0; N] };
        let last = if (self.above + luma) % 2 == 1 { one(chroma.rows().checked_sub(1)?)? } else { [0; N] };
        Some(core::array::from_fn(|n| (2 * all[n]).wrapping_sub(first[n]).wrapping_sub(last[n])))
    }
}

impl Cells<'_> {
    #[inline(always)]
    pub(in crate::green) fn in_row(&self) -> usize {
        self.luma.width() / if let Chroma::Within(_) = self.chroma { 4 } else { 2 }
    }

    /// Returns the place of luma in each pair of bytes if chroma lies between luma, and 0 otherwise.
    #[inline(always)]
    pub(in crate::green) fn place(&self) -> usize {
        if let Chroma::Within(place) = self.chroma { place } else { 0 }
    }

    /// Sums Y, Cb and Cr over the pixels of the block, or returns `None` if rows are too narrow for vectors, or too
    /// wide.
    #[inline(always)]
    pub(in crate::green) fn sums(&self, simd: Simd) -> Option<[u32; 3]> {
        let [left, right] = self.outside.map(|pixels| pixels as u32);
        match self.chroma {
            Chroma::Within(luma) => {
                let places = simd.places(self.luma)?;
                let [y, next, cb, cr] = [luma, luma + 2, 1 - luma, 3 - luma];
                let at = |sums: &[u32; 4], place: usize| sums.get(place).copied().unwrap_or(0);
                let of = |place| (at(&places.all, place), at(&places.first, place), at(&places.last, place));
                let luma = of(y).0 + of(next).0 - left * of(y).1 - right * of(next).2;
                let [cb, cr] = [cb, cr].map(|place| {
                    let (all, first, last) = of(place);
                    2 * all - left * first - right * last
                });
                Some([luma, cb, cr])
            }
            Chroma::Pairs(pairs, shared) => {
                let [cb, cr] = shared.sum(pairs, self.luma.rows(), |pairs| {
                    let places = simd.places(pairs)?;
                    let ([a, b, c, d], [cb, cr, ..], [.., last_cb, last_cr]) = (places.all, places.first, places.last);
                    Some([2 * (a + c) - left * cb - right * last_cb, 2 * (b + d) - left * cr - right * last_cr])
                })?;
                Some([simd.sum::<1, 0>(self.counted()?)?, cb, cr])
            }
            Chroma::Planes(planes, shared) => {
                // Chroma comes first. Its rows are narrower, and if they are too narrow then no work is lost.
                let plane = |plane: Block<'_>| {
                    let [sum] = shared.sum(plane, self.luma.rows(), |plane| {
                        let column = |at: fn(&[u8]) -> Option<&u8>| {
                            plane.each_row().map(|row| at(row).map_or(0, |&byte| u32::from(byte))).sum::<u32>()
                        };
                        let first = if left == 1 { column(<[u8]>::first) } else { 0 };
                        let last = if right == 1 { column(<[u8]>::last) } else { 0 };
                        Some([2 * simd.sum::<1, 0>(plane)? - first - last])
                    })?;
                    Some(sum)
                };
                let [cb, cr] = planes;
                let (cb, cr) = (plane(cb)?, plane(cr)?);
                Some([simd.sum::<1, 0>(self.counted()?)?, cb, cr])
            }
        }
    }

    /// Returns the luma of the pixels that count.
    fn counted(&self) -> Option<Block<'_>> {
        let ([left, right], luma) = (self.outside, self.luma);
        let width = luma.width().checked_sub(left + right)?;
        Block::new(luma.bytes().get(left..)?, luma.bytes_per_row(), width, luma.rows())
    }
}

/// The bytes of `ONE` cells; `TWO` and `FOUR` are twice and four times as many.
#[derive(Clone, Copy)]
pub(in crate::green) enum Bytes<'a, const ONE: usize, const TWO: usize, const FOUR: usize> {
    /// Luma and chroma within each other.
    Packed(&'a [u8; FOUR]),
    /// Luma, and Cb Cr pairs.
    Pairs(&'a [u8; TWO], &'a [u8; TWO]),
    /// Luma, Cb and Cr.
    Planes(&'a [u8; TWO], [&'a [u8; ONE]; 2]),
}

/// A row of cells. All of its code is inlined, so that kernels keep their vectors in registers.
pub(in crate::green) trait Row<'a, const ONE: usize, const TWO: usize, const FOUR: usize>:
    Copy
{
    /// Returns the row of this number, whose luma lies in these bytes.
    fn new(cells: &Cells<'a>, luma: &'a [u8], number: usize) -> Option<Self>;

    /// Returns the bytes of `ONE` cells, of which `index` times as many come before them.
    fn cells(self, index: usize) -> Option<Bytes<'a, ONE, TWO, FOUR>>;

    /// Returns the bytes of the last `ONE` cells.
    fn last(self) -> Bytes<'a, ONE, TWO, FOUR>;
}

/// A row of bytes as vectors of `N`.
#[derive(Clone, Copy)]
pub(in crate::green) struct Vectors<'a, const N: usize> {
    whole: &'a [[u8; N]],
    /// The last `N` bytes, which repeat bytes of the vector before unless the row is whole vectors.
    last: &'a [u8; N],
}

impl<'a, const N: usize> Vectors<'a, N> {
    #[inline(always)]
    fn of(row: &'a [u8]) -> Option<Self> {
        Some(Self { whole: row.as_chunks().0, last: row.last_chunk()? })
    }
}

impl<'a, const ONE: usize, const TWO: usize, const FOUR: usize> Row<'a, ONE, TWO, FOUR> for Vectors<'a, FOUR> {
    #[inline(always)]
    fn new(_: &Cells<'a>, luma: &'a [u8], _: usize) -> Option<Self> {
        Vectors::of(luma)
    }

    #[inline(always)]
    fn cells(self, index: usize) -> Option<Bytes<'a, ONE, TWO, FOUR>> {
        self.whole.get(index).map(Bytes::Packed)
    }

    #[inline(always)]
    fn last(self) -> Bytes<'a, ONE, TWO, FOUR> {
        Bytes::Packed(self.last)
    }
}

/// A row of luma, and one of Cb Cr pairs.
pub(in crate::green) type WithPairs<'a, const TWO: usize> = [Vectors<'a, TWO>; 2];

impl<'a, const ONE: usize, const TWO: usize, const FOUR: usize> Row<'a, ONE, TWO, FOUR> for WithPairs<'a, TWO> {
    #[inline(always)]
    fn new(cells: &Cells<'a>, luma: &'a [u8], number: usize) -> Option<Self> {
        let Chroma::Pairs(pairs, shared) = cells.chroma else { return None };
        Some([Vectors::of(luma)?, Vectors::of(pairs.row(shared.row(number)))?])
    }

    #[inline(always)]
    fn cells(self, index: usize) -> Option<Bytes<'a, ONE, TWO, FOUR>> {
        let [luma, pairs] = self;
        Some(Bytes::Pairs(luma.whole.get(index)?, pairs.whole.get(index)?))
    }

    #[inline(always)]
    fn last(self) -> Bytes<'a, ONE, TWO, FOUR> {
        let [luma, pairs] = self;
        Bytes::Pairs(luma.last, pairs.last)
    }
}

/// A row of luma, and one of Cb and of Cr.
pub(in crate::green) type WithPlanes<'a, const ONE: usize, const TWO: usize> =
    (Vectors<'a, TWO>, [Vectors<'a, ONE>; 2]);

impl<'a, const ONE: usize, const TWO: usize, const FOUR: usize> Row<'a, ONE, TWO, FOUR> for WithPlanes<'a, ONE, TWO> {
    #[inline(always)]
    fn new(cells: &Cells<'a>, luma: &'a [u8], number: usize) -> Option<Self> {
        let Chroma::Planes([cb, cr], shared) = cells.chroma else { return None };
        let number = shared.row(number);
        Some((Vectors::of(luma)?, [Vectors::of(cb.row(number))?, Vectors::of(cr.row(number))?]))
    }

    #[inline(always)]
    fn cells(self, index: usize) -> Option<Bytes<'a, ONE, TWO, FOUR>> {
        let (luma, [cb, cr]) = self;
        Some(Bytes::Planes(luma.whole.get(index)?, [cb.whole.get(index)?, cr.whole.get(index)?]))
    }

    #[inline(always)]
    fn last(self) -> Bytes<'a, ONE, TWO, FOUR> {
        let (luma, [cb, cr]) = self;
        Bytes::Planes(luma.last, [cb.last, cr.last])
    }
}

/// Adds the pixels of a block whose stride is one, and returns whether it did.
///
/// `parts` finds the luma and chroma of cells, given the first cell of a row and the number of cells.
/// Narrow blocks, and machines without the instructions, are left to the plain code.
#[inline(always)]
pub(in crate::green) fn add_block<'a, C: Conversion>(
    conversion: &C,
    sum: &mut C::Sum,
    run: Run,
    parts: impl FnOnce(usize, usize) -> Option<(Block<'a>, Chroma<'a>)>,
) -> bool {
    let (x, end) = (usize::from(run.x), usize::from(run.x) + usize::from(run.width));
    let (first, cells) = (x / 2, end.div_ceil(2) - x / 2);
    if cells < LEAST_CELLS {
        return false;
    }
    let Some(simd) = Simd::get() else { return false };
    let Some((luma, chroma)) = parts(first, cells) else { return false };
    conversion.add_cells(sum, &Cells { luma, chroma, outside: [x % 2, end % 2] }, simd)
}
