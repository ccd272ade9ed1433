//! The headers of a JPEG picture, as far as the check for whole data needs them.

use std::ops::Range;

use super::data::{Blocks, MOST_EXTRA, Scan, Table};

/// Most components that are read: Y, Cb, Cr.
const COMPONENTS: usize = 3;

/// The content of the headers, up to the start of scan.
pub(super) struct Headers {
    /// Width and height.
    pub(super) size: (u16, u16),
    /// The start of the entropy-coded data.
    pub(super) data: usize,
    /// The bytes before markers that belong to no segment.
    pub(super) extra: Vec<Range<usize>>,
    /// Whether the picture has Huffman-coded blocks in one pass.
    sequential: bool,
    /// Identifier, horizontal and vertical sampling of each component.
    components: Vec<[u8; 3]>,
    /// Identifier and table numbers of each component of the scan.
    scanned: Vec<[u8; 2]>,
    restart: u16,
    dc: [Option<Table>; 4],
    ac: [Option<Table>; 4],
}

impl Headers {
    /// Walks the segments; `None` if they are not those of a JPEG.
    pub(super) fn read(bytes: &[u8]) -> Option<Self> {
        if bytes.get(..2)? != [0xff, 0xd8] {
            return None;
        }
        let mut headers = Self {
            size: (0, 0),
            data: 2,
            extra: Vec::new(),
            sequential: false,
            components: Vec::new(),
            scanned: Vec::new(),
            restart: 0,
            dc: [const { None }; 4],
            ac: [const { None }; 4],
        };
        loop {
            let rest = bytes.get(headers.data..)?;
            let skipped = rest.iter().take(MOST_EXTRA + 1).position(|byte| *byte == 0xff)?;
            if skipped > 0 {
                headers.extra.push(headers.data..headers.data + skipped);
                headers.data += skipped;
                continue;
            }
            let marker = *rest.get(1)?;
            if marker == 0xff || marker == 0 {
                // A fill byte, or one that is no marker.
                headers.extra.push(headers.data..headers.data + 1);
                headers.data += 1;
                continue;
            }
            let length = usize::from(u16::from_be_bytes([*rest.get(2)?, *rest.get(3)?])).max(2);
            let segment = rest.get(4..2 + length)?;
            headers.data += 2 + length;
            match marker {
                0xc4 => headers.huffman_tables(segment)?,
                0xc8 | 0xcc => {}
                0xc0..=0xcf => {
                    headers.sequential = marker <= 0xc1;
                    headers.frame(segment)?;
                }
                0xdd => headers.restart = u16::from_be_bytes([*segment.first()?, *segment.get(1)?]),
                0xda => {
                    let count = usize::from(*segment.first()?);
                    headers.scanned = segment.get(1..=2 * count)?.as_chunks::<2>().0.to_vec();
                    return Some(headers);
                }
                _ => {}
            }
        }
    }

    /// Returns whether there are any Huffman tables.
    pub(super) fn has_tables(&self) -> bool {
        self.dc.iter().chain(&self.ac).any(Option::is_some)
    }

    /// Returns the facts for a walk through the data; `None` for codings that cameras do not use.
    ///
    /// The pictures of cameras are sequential, with all components in one scan.
    pub(super) fn scan(&self) -> Option<Scan<'_>> {
        let count = self.components.len();
        if !self.sequential || count == 0 || count > COMPONENTS || self.scanned.len() != count {
            return None;
        }
        let mut components = [Blocks::default(); COMPONENTS];
        let (mut widest, mut highest) = (1, 1);
        for ((blocks, [id, across, down]), [scanned, tables]) in
            components.iter_mut().zip(&self.components).zip(&self.scanned)
        {
            if id != scanned || !(1..=4).contains(across) || !(1..=4).contains(down) {
                return None;
            }
            // A single component has one block in a unit, whatever its sampling.
            let (across, down) = if count == 1 { (1, 1) } else { (u32::from(*across), u32::from(*down)) };
            (widest, highest) = (across.max(widest), down.max(highest));
            *blocks = Blocks { count: across * down, dc: usize::from(tables >> 4), ac: usize::from(tables & 15) };
        }
        let (width, height) = (u32::from(self.size.0), u32::from(self.size.1));
        Some(Scan {
            units: width.div_ceil(8 * widest) * height.div_ceil(8 * highest),
            restart: u32::from(self.restart),
            components,
            dc: self.dc.each_ref().map(Option::as_ref),
            ac: self.ac.each_ref().map(Option::as_ref),
        })
    }

    /// Reads a start of frame: precision, height, width, components.
    fn frame(&mut self, segment: &[u8]) -> Option<()> {
        let [_, h1, h2, w1, w2, count] = *segment.first_chunk()?;
        self.size = (u16::from_be_bytes([w1, w2]), u16::from_be_bytes([h1, h2]));
        let components = segment.get(6..6 + 3 * usize::from(count))?.as_chunks().0;
        self.components = components.iter().map(|&[id, sampling, _]| [id, sampling >> 4, sampling & 15]).collect();
        Some(())
    }

    /// Reads Huffman tables: class and number, the count of codes of each length, and their values, once or more often.
    fn huffman_tables(&mut self, mut segment: &[u8]) -> Option<()> {
        while let Some((kind, rest)) = segment.split_first() {
            let (counts, values) = rest.split_first_chunk::<16>()?;
            let total = counts.iter().map(|count| usize::from(*count)).sum();
            let tables = if kind >> 4 == 0 { &mut self.dc } else { &mut self.ac };
            *tables.get_mut(usize::from(kind & 15))? = Some(Table::new(counts, values)?);
            segment = values.get(total..)?;
        }
        Some(())
    }
}
