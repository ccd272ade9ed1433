//! The check that the entropy-coded data of a JPEG picture hold exactly as many blocks as its size asks for.
//!
//! If a USB packet is missing in the middle, the data still decode to the end marker, only too early. Decoders fill in
//! the rest without an error. A walk through the Huffman codes finds this without computing a single pixel.
//!
//! Some cameras, such as Logitech C270 and C910, put bytes between the last block and the next marker. The walk finds
//! them, so that the decoder never sees them.
//!
//! The check is our own, because no decoder reports data that end too early.

use std::ops::Range;

use super::Refusal;

/// Codes of up to this many bits are looked up at once.
const DIRECT_BITS: u32 = 9;

/// Most bytes between the last block before a marker and that marker, if they are no padding.
///
/// After a missing packet, blocks may end before their data do. Then there are mostly more bytes: of 18,000 pictures
/// with missing bytes, 16 here find as many as 64 do.
const MOST_EXTRA: usize = 64;
/// A coefficient of 8-bit samples has fewer bits, apart from the first of a block, whose difference has at most as
/// many.
const TOO_MANY_BITS: u8 = 11;
/// The lowest and the highest bit of each of eight bytes.
const ONES: u64 = u64::MAX / 255;
const HIGHEST_BITS: u64 = ONES << 7;
const NO_CODE: Refusal = Refusal::Corrupt("its data are no Huffman codes");
// libjpeg makes the blocks gray that are behind it.
const MISPLACED: Refusal = Refusal::Corrupt("a restart marker is missing or out of place");
const OVERLONG: Refusal = Refusal::Corrupt("it has too many bytes between its blocks and the next marker");

/// A Huffman table: the value of each code, and the count of its bits and of those that the value says follow.
#[derive(Clone)]
pub(super) struct Table {
    /// The bits of a code and its value, by the next 9 bits; 0 bits if the code is longer.
    direct: [(u8, u8); 1 << DIRECT_BITS],
    /// One past the last code of each length, left-aligned in 16 bits, and the number to add to a code for its place.
    ends: [(u32, i32); 17],
    values: [u8; 256],
}

impl Table {
    /// Creates a table from the segment's counts by length and values; `None` if they are no table.
    pub(super) fn new(counts: &[u8; 16], given: &[u8]) -> Option<Self> {
        let total: usize = counts.iter().map(|count| usize::from(*count)).sum();
        let mut values = [0; 256];
        values.get_mut(..total)?.copy_from_slice(given.get(..total)?);
        let mut table = Self { direct: [(0, 0); 1 << DIRECT_BITS], ends: [(0, 0); 17], values };
        let (mut code, mut place) = (0_u32, 0_i32);
        for (length, count) in (1..).zip(counts) {
            let first = code;
            for _ in 0..*count {
                if code >= 1 << length {
                    return None;
                }
                if length <= DIRECT_BITS {
                    let spare = DIRECT_BITS - length;
                    let from = (code << spare) as usize;
                    let value = values.get(place as usize + (code - first) as usize).copied()?;
                    table.direct.get_mut(from..from + (1 << spare))?.fill((length as u8 + (value & 15), value));
                }
                code += 1;
            }
            table.ends[length as usize] = (code << (16 - length), place - first as i32);
            place += i32::from(*count);
            code <<= 1;
        }
        Some(table)
    }

    /// Returns the value of the code that these 16 bits start with, behind the count of the code's bits and of those
    /// that the value says follow.
    #[inline(always)]
    fn find(&self, bits: u32) -> Option<(u32, u8)> {
        let (count, value) = self.direct[(bits >> (16 - DIRECT_BITS)) as usize & ((1 << DIRECT_BITS) - 1)];
        if count > 0 {
            return Some((u32::from(count), value));
        }
        for length in DIRECT_BITS + 1..=16 {
            let (end, place) = self.ends[length as usize];
            if bits < end {
                let at = (bits >> (16 - length)) as i32 + place;
                let value = *self.values.get(usize::try_from(at).ok()?)?;
                return Some((length + u32::from(value & 15), value));
            }
        }
        None
    }
}

/// A component's part of a scan.
pub(super) struct ScanPart<'a> {
    /// 8 × 8 blocks in each unit.
    pub(super) blocks: u32,
    /// Huffman tables; `None` if the pass needs none.
    pub(super) dc: Option<&'a Table>,
    pub(super) ac: Option<&'a Table>,
    /// The coefficients of each block that are not 0 yet, of a progressive picture.
    pub(super) nonzero: &'a mut [u64],
}

/// The coefficients of a block that a scan has.
#[derive(Clone, Copy)]
pub(super) enum Pass {
    /// All of them.
    Sequential,
    /// The first one: its higher bits, or one more bit.
    Dc { is_first: bool },
    /// Some others: their higher bits, or one more bit.
    Ac { from: u32, last: u32, is_first: bool },
}

/// The facts for a walk through the data of a scan.
pub(super) struct Scan<'a> {
    /// Minimum coded units in the scan.
    pub(super) units: u32,
    /// Units from one restart marker to the next; 0 without restart markers.
    pub(super) restart: u32,
    pub(super) parts: Vec<ScanPart<'a>>,
    pub(super) pass: Pass,
}

/// The entropy-coded data of a scan that has all its blocks.
#[derive(Debug, Default)]
pub(super) struct Whole {
    /// The parts of the data that belong to no block, in their order.
    pub(super) extra: Vec<Range<usize>>,
    /// The end of the last block.
    pub(super) end: usize,
}

impl Scan<'_> {
    /// Walks through `data`, which start behind the start of scan.
    ///
    /// # Errors
    /// The data do not hold exactly the scan's blocks.
    pub(super) fn walk(&mut self, data: &[u8]) -> Result<Whole, Refusal> {
        let mut bits = Bits { data, at: 0, window: 0, held: 0, missing: 0, from: 0, zero_blocks: 0 };
        let mut whole = Whole::default();
        for unit in 0..self.units {
            if self.restart > 0 && unit > 0 && unit % self.restart == 0 {
                whole.extra.extend(bits.restart()?);
            }
            for part in &mut self.parts {
                for _ in 0..part.blocks {
                    bits.pass(self.pass, part, unit).ok_or(NO_CODE)?;
                }
            }
            bits.in_bounds().ok_or(Refusal::Truncated)?;
        }
        // Some cameras put one more restart marker behind the last block.
        let may_restart = self.restart > 0 && self.units.is_multiple_of(self.restart);
        whole.end = bits.end(may_restart)?;
        Ok(whole)
    }
}

/// Bits of entropy-coded data without stuffed zeros.
#[derive(Clone, Copy)]
struct Bits<'a> {
    data: &'a [u8],
    at: usize,
    /// The next bits in its highest places.
    window: u64,
    held: u32,
    /// Bits in the window that lie past a marker or the end.
    missing: u32,
    /// The start of the data behind the last restart marker.
    from: usize,
    /// Blocks to come whose coefficients of this pass are all 0 so far.
    zero_blocks: u32,
}

impl Bits<'_> {
    #[inline(always)]
    fn fill(&mut self) {
        // Eight bytes at once if none of them is 0xff. A part of a byte that comes too early is the same later on.
        if let Some(bytes) = self.data.get(self.at..).and_then(|rest| rest.first_chunk()) {
            let word = u64::from_be_bytes(*bytes);
            if word & !word.wrapping_add(ONES) & HIGHEST_BITS == 0 {
                let count = (64 - self.held) / 8;
                self.window |= word >> self.held;
                self.held += 8 * count;
                self.at += count as usize;
                return;
            }
        }
        *self = self.filled_bytewise();
    }

    /// Takes and returns a copy, so that the bits of a loop over codes stay in registers.
    #[cold]
    #[inline(never)]
    fn filled_bytewise(mut self) -> Self {
        while self.held <= 56 {
            let byte = match self.data.get(self.at..) {
                Some([0xff, 0, ..]) => {
                    self.at += 2;
                    0xff
                }
                // This is a marker or the end. Bits that are read from here on do not exist.
                Some([0xff, ..] | []) | None => {
                    self.missing += 8;
                    0
                }
                Some([byte, ..]) => {
                    self.at += 1;
                    *byte
                }
            };
            self.window |= u64::from(byte) << (56 - self.held);
            self.held += 8;
        }
        self
    }

    fn skip(&mut self, count: u32) {
        self.window <<= count;
        self.held -= count;
    }

    /// Returns the value of the next code. It also skips as many bits behind it as the low four bits of the value say.
    #[inline(always)]
    fn symbol(&mut self, table: &Table) -> Option<u8> {
        if self.held < 32 {
            self.fill();
        }
        let (count, value) = table.find((self.window >> 48) as u32)?;
        self.skip(count);
        Some(value)
    }

    /// Returns the next bits, at most 16.
    fn take(&mut self, count: u32) -> u32 {
        if self.held < 32 {
            self.fill();
        }
        let value = self.window.checked_shr(64 - count).unwrap_or(0) as u32;
        self.skip(count);
        value
    }

    /// Walks over a block, of which `part` has the tables.
    fn pass(&mut self, pass: Pass, part: &mut ScanPart<'_>, unit: u32) -> Option<()> {
        match pass {
            Pass::Sequential => self.block(part.dc?, part.ac?),
            Pass::Dc { is_first: true } => (self.symbol(part.dc?)? <= TOO_MANY_BITS).then_some(()),
            Pass::Dc { is_first: false } => {
                self.take(1);
                Some(())
            }
            Pass::Ac { from, last, is_first } => {
                let nonzero = part.nonzero.get_mut(unit as usize)?;
                if is_first {
                    self.first_bits(part.ac?, from, last, nonzero)
                } else {
                    self.next_bit(part.ac?, from, last, nonzero)
                }
            }
        }
    }

    fn first_bits(&mut self, ac: &Table, from: u32, last: u32, nonzero: &mut u64) -> Option<()> {
        if self.zero_blocks > 0 {
            self.zero_blocks -= 1;
            return Some(());
        }
        let mut place = from;
        while place <= last {
            let value = self.symbol(ac)?;
            let (zeros, size) = (u32::from(value >> 4), value & 15);
            if size == 0 && zeros < 15 {
                self.zero_blocks = (1 << zeros) - 1 + self.take(zeros);
                return Some(());
            }
            place += zeros;
            if size > 0 {
                *nonzero |= 1_u64.checked_shl(place).filter(|_| place <= last)?;
            }
            place += 1;
        }
        Some(())
    }

    /// Walks over one more bit of a block's coefficients. Those that are not 0 have a bit each between the codes.
    fn next_bit(&mut self, ac: &Table, from: u32, last: u32, nonzero: &mut u64) -> Option<()> {
        let mut place = from;
        while self.zero_blocks == 0 && place <= last {
            let value = self.symbol(ac)?;
            let (mut zeros, size) = (u32::from(value >> 4), value & 15);
            if size > 1 {
                return None;
            }
            if size == 0 && zeros < 15 {
                self.zero_blocks = (1 << zeros) + self.take(zeros);
                break;
            }
            while place <= last {
                if *nonzero >> place & 1 != 0 {
                    self.take(1);
                } else if zeros == 0 {
                    break;
                } else {
                    zeros -= 1;
                }
                place += 1;
            }
            if size == 1 {
                *nonzero |= 1_u64.checked_shl(place).filter(|_| place <= last)?;
            }
            place += 1;
        }
        if self.zero_blocks > 0 {
            self.zero_blocks -= 1;
            for place in place..=last {
                self.take((*nonzero >> place & 1) as u32);
            }
        }
        Some(())
    }

    fn block(&mut self, dc: &Table, ac: &Table) -> Option<()> {
        if self.symbol(dc)? > TOO_MANY_BITS {
            return None;
        }
        let mut place = 1;
        while place < 64 {
            let value = self.symbol(ac)?;
            place += match (u32::from(value >> 4), value & 15) {
                (zeros, 1..TOO_MANY_BITS) => zeros + 1,
                (0, 0) => break,
                (15, 0) => 16,
                _ => return None,
            };
        }
        (place <= 64).then_some(())
    }

    /// Returns `None` if bits were read that do not exist.
    fn in_bounds(&self) -> Option<()> {
        (self.held >= self.missing).then_some(())
    }

    /// Returns where the last block ends, before the end marker, another one or the end of the data.
    ///
    /// Padding is ones or zeros in the last byte, or more of them, as some encoders write.
    fn end(&self, may_restart: bool) -> Result<usize, Refusal> {
        let left = self.held.checked_sub(self.missing).ok_or(Refusal::Truncated)?;
        let (extra, marker) = self.extra(left)?;
        let is_padding = |left: u32| {
            let bits = self.window.checked_shr(64 - left).unwrap_or(0);
            bits == 0 || bits == (1 << left) - 1
        };
        if matches!(marker, Some(0xd0..=0xd7)) && !may_restart {
            return Err(MISPLACED);
        }
        if !is_padding(left % 8) {
            return Err(OVERLONG);
        }
        Ok(extra.start)
    }

    /// Continues behind the restart marker. Returns the bytes before it that belong to no block, if there are any.
    ///
    /// Any number is fine: if data between markers are missing, then so are blocks at the end.
    fn restart(&mut self) -> Result<Option<Range<usize>>, Refusal> {
        let left = self.held.checked_sub(self.missing).ok_or(Refusal::Truncated)?;
        let (extra, marker) = self.extra(left)?;
        if !matches!(marker, Some(0xd0..=0xd7)) {
            return Err(MISPLACED);
        }
        self.at = extra.end + 2;
        (self.window, self.held, self.missing, self.zero_blocks) = (0, 0, 0, 0);
        self.from = self.at;
        Ok((!extra.is_empty()).then_some(extra))
    }

    /// Returns the bytes between the last block and the next marker or the end, and the marker. `left` are the bits
    /// that were taken and belong to no block.
    fn extra(&self, left: u32) -> Result<(Range<usize>, Option<u8>), Refusal> {
        let mut end = self.at;
        for _ in 0..left / 8 {
            let taken = self.data.get(self.from..end).unwrap_or_default();
            end -= if taken.ends_with(&[0xff, 0]) { 2 } else { taken.len().min(1) };
        }
        let mut next = self.at;
        let marker = loop {
            match self.data.get(next..) {
                Some([0xff, 0, ..]) => next += 2,
                Some([0xff, marker @ 1..=0xfe, ..]) => break Some(*marker),
                Some([_, ..]) => next += 1,
                Some([]) | None => break None,
            }
        };
        let extra = end..next.min(self.data.len());
        let bytes = self.data.get(extra.clone()).unwrap_or_default();
        if bytes.len() > MOST_EXTRA && bytes.iter().any(|byte| !matches!(byte, 0 | 0xff)) {
            return Err(if matches!(marker, Some(0xd0..=0xd7)) { MISPLACED } else { OVERLONG });
        }
        Ok((extra, marker))
    }
}
