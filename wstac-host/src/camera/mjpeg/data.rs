//! The check that the entropy-coded data of a baseline JPEG picture hold exactly as many blocks as its size asks for.
//!
//! If a USB packet is missing in the middle, the data still decode to the end marker, only too early. Decoders fill in
//! the rest without an error. A walk through the Huffman codes finds this without computing a single pixel.
//!
//! The check is our own, because no decoder reports data that end too early.

/// Most components of a picture that a camera sends: Y, Cb, Cr.
const COMPONENTS: usize = 3;
/// Codes of up to this many bits are looked up at once.
const DIRECT_BITS: u32 = 9;

/// A Huffman table: lengths and values of its codes.
#[derive(Clone)]
pub(super) struct Table {
    /// Length (0 if longer) and value of a code, by the next [`DIRECT_BITS`] bits.
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
                    table.direct.get_mut(from..from + (1 << spare))?.fill((length as u8, value));
                }
                code += 1;
            }
            table.ends[length as usize] = (code << (16 - length), place - first as i32);
            place += i32::from(*count);
            code <<= 1;
        }
        Some(table)
    }

    /// Returns the length and value of the code that these 16 bits start with.
    fn find(&self, bits: u32) -> Option<(u32, u8)> {
        let (length, value) = self.direct[(bits >> (16 - DIRECT_BITS)) as usize & ((1 << DIRECT_BITS) - 1)];
        if length > 0 {
            return Some((u32::from(length), value));
        }
        for length in DIRECT_BITS + 1..=16 {
            let (end, place) = self.ends[length as usize];
            if bits < end {
                let at = (bits >> (16 - length)) as i32 + place;
                return Some((length, *self.values.get(usize::try_from(at).ok()?)?));
            }
        }
        None
    }
}

/// A component's part of a minimum coded unit.
#[derive(Clone, Copy, Default)]
pub(super) struct Blocks {
    /// 8 × 8 blocks in each unit.
    pub(super) count: u32,
    /// Numbers of its Huffman tables.
    pub(super) dc: usize,
    pub(super) ac: usize,
}

/// The facts about a picture that the walk needs.
pub(super) struct Scan<'a> {
    /// Minimum coded units.
    pub(super) units: u32,
    /// Units from one restart marker to the next; 0 without restart markers.
    pub(super) restart: u32,
    /// Components in their order.
    pub(super) components: [Blocks; COMPONENTS],
    /// Huffman tables by number.
    pub(super) dc: [Option<&'a Table>; 4],
    pub(super) ac: [Option<&'a Table>; 4],
}

impl Scan<'_> {
    /// Returns whether `data` hold exactly the picture's blocks.
    ///
    /// They start behind the start of scan and end before the end marker.
    pub(super) fn is_whole(&self, data: &[u8]) -> bool {
        self.walk(data).is_some()
    }

    fn walk(&self, data: &[u8]) -> Option<()> {
        let mut bits = Bits { data, at: 0, window: 0, held: 0, missing: 0 };
        let mut next_restart = 0;
        for unit in 0..self.units {
            if self.restart > 0 && unit > 0 && unit % self.restart == 0 {
                bits.restart(next_restart)?;
                next_restart = (next_restart + 1) % 8;
            }
            for blocks in &self.components {
                for _ in 0..blocks.count {
                    let (dc, ac) = ((*self.dc.get(blocks.dc)?)?, (*self.ac.get(blocks.ac)?)?);
                    bits.block(dc, ac)?;
                }
            }
            bits.in_bounds()?;
        }
        bits.at_end()
    }
}

/// Bits of entropy-coded data without stuffed zeros.
struct Bits<'a> {
    data: &'a [u8],
    at: usize,
    /// The next bits in its highest places.
    window: u64,
    held: u32,
    /// Bits in the window that lie past a marker or the end.
    missing: u32,
}

impl Bits<'_> {
    fn fill(&mut self) {
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
    }

    fn skip(&mut self, count: u32) {
        self.window <<= count;
        self.held -= count;
    }

    /// Returns the value of the next code. It also skips as many bits behind it as the low four bits of the value say.
    fn symbol(&mut self, table: &Table) -> Option<u8> {
        if self.held < 32 {
            self.fill();
        }
        let (length, value) = table.find((self.window >> 48) as u32)?;
        self.skip(length + u32::from(value & 15));
        Some(value)
    }

    fn block(&mut self, dc: &Table, ac: &Table) -> Option<()> {
        // A difference of 8-bit samples has at most 11 bits.
        if self.symbol(dc)? > 11 {
            return None;
        }
        let mut place = 1;
        while place < 64 {
            let value = self.symbol(ac)?;
            let (zeros, size) = (u32::from(value >> 4), value & 15);
            place += match (zeros, size) {
                (0, 0) => return Some(()),
                (15, 0) => 16,
                (_, 0) => return None,
                _ => zeros + 1,
            };
        }
        (place == 64).then_some(())
    }

    /// Returns `None` if bits were read that do not exist.
    fn in_bounds(&self) -> Option<()> {
        (self.held >= self.missing).then_some(())
    }

    /// Returns `None` unless only padding is left.
    ///
    /// Padding is ones or zeros in the last byte, or more of them, as some encoders write.
    fn at_end(&self) -> Option<()> {
        let left = self.held.checked_sub(self.missing)?;
        let bits = self.window.checked_shr(64 - left).unwrap_or(0);
        let padding = bits == 0 || bits == (1 << left) - 1;
        let rest = self.data.get(self.at..)?;
        (padding && (left < 8 || rest.is_empty()) && rest.iter().all(|byte| matches!(byte, 0 | 0xff))).then_some(())
    }

    /// Continues behind the restart marker of this number; `None` if it is not here.
    fn restart(&mut self, number: u8) -> Option<()> {
        let left = self.held.checked_sub(self.missing)?;
        let fill = self.data.get(self.at..)?.iter().take_while(|byte| **byte == 0xff).count();
        let marker = *self.data.get(self.at + fill)?;
        if left >= 8 || fill == 0 || marker != 0xd0 + number {
            return None;
        }
        self.at += fill + 1;
        (self.window, self.held, self.missing) = (0, 0, 0);
        Some(())
    }
}
