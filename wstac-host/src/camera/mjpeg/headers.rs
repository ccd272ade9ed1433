//! The segments of a JPEG picture: what a frame and its scans are, and the picture as the decoder gets it.

use super::data::{Pass, Scan, ScanPart, Table, Whole};
use super::tables::STANDARD_TABLES;
use super::{Refusal, append_without};

/// Bytes before the start marker that are left out.
const MOST_BEFORE: usize = 16;
const START: [u8; 2] = [0xff, 0xd8];
const END: [u8; 2] = [0xff, 0xd9];
/// The bit of a coefficient that is known so far: none.
const UNKNOWN: u8 = 0xff;
/// The components' identifiers of a picture that has red, green and blue without saying so.
const RGB: [u8; 3] = *b"RGB";
const NO_TABLE: Refusal = Refusal::Corrupt("it has no Huffman table for its blocks");
const SAMPLING: Refusal = Refusal::Unsupported("the sizes of its components are unusual");
const SEPARATE: Refusal = Refusal::Unsupported("its components are in separate scans, and have different sizes");
const BROKEN: Refusal = Refusal::Corrupt("one of its segments is broken");

/// A JPEG picture that is read segment by segment.
#[derive(Default)]
pub(super) struct JpegReader<'a> {
    bytes: &'a [u8],
    at: usize,
    pub(super) size: (u16, u16),
    /// The data of the Exif segment; empty if there is none.
    pub(super) exif: &'a [u8],
    is_progressive: bool,
    components: Vec<Component>,
    dc: [Option<Table>; 4],
    ac: [Option<Table>; 4],
    restart: u16,
    is_jfif: bool,
    /// The transform of colors that Adobe's segment states.
    adobe: Option<u8>,
}

#[derive(Clone)]
struct Component {
    id: u8,
    across: u8,
    down: u8,
    quantization: u8,
    /// The lowest bit of each coefficient that is known.
    bits: [u8; 64],
    /// The coefficients of each block that are not 0, of a progressive picture.
    nonzero: Vec<u64>,
}

/// The next part of a picture.
enum Segment<'a> {
    /// A definition of tables, as a whole.
    Tables(&'a [u8]),
    Frame,
    Scan(&'a [u8]),
    Other,
    End,
}

impl<'a> JpegReader<'a> {
    /// Reads the headers up to the first scan.
    pub(super) fn headers(bytes: &'a [u8]) -> Result<Self, Refusal> {
        let mut picture = Self::new(bytes)?;
        loop {
            match picture.segment()? {
                Segment::Scan(_) if !picture.components.is_empty() => return Ok(picture),
                Segment::Scan(_) | Segment::End => return Err(Refusal::NoPicture),
                _ => {}
            }
        }
    }

    fn new(bytes: &'a [u8]) -> Result<Self, Refusal> {
        let at = bytes.windows(2).take(MOST_BEFORE + 1).position(|pair| pair == START).ok_or(Refusal::NoPicture)?;
        Ok(Self { bytes, at, ..Self::default() })
    }

    /// Checks that a picture has all its blocks, and writes it as every decoder reads it: without segments that have no
    /// part in its pixels, without bytes between segments and blocks, with all tables and the end marker.
    ///
    /// Returns whether its components are red, green and blue.
    pub(super) fn rewrite(bytes: &'a [u8], size: (u16, u16), to: &mut Vec<u8>) -> Result<bool, Refusal> {
        let mut picture = Self::new(bytes)?;
        to.clear();
        to.extend_from_slice(&START);
        // Cameras leave the standard tables out to save bytes. Those that a picture has replace them.
        to.extend_from_slice(&STANDARD_TABLES);
        loop {
            match picture.segment()? {
                Segment::Tables(tables) => to.extend_from_slice(tables),
                Segment::Frame if picture.size != size => return Err(Refusal::OtherSize),
                Segment::Frame => picture.write_frame(to),
                Segment::Scan(_) | Segment::End if picture.components.is_empty() => return Err(Refusal::NoPicture),
                Segment::Scan(scan) => {
                    picture.scan(scan, to)?;
                    if picture.components.iter().all(|component| component.bits == [0; 64]) {
                        to.extend_from_slice(&END);
                        return Ok(picture.is_rgb());
                    }
                }
                Segment::Other => {}
                Segment::End => return Err(Refusal::Truncated),
            }
        }
    }

    /// Goes to the next marker, over any bytes before it. Returns `None` at the end of the bytes.
    fn marker(&mut self) -> Option<u8> {
        loop {
            self.at += self.bytes.get(self.at..)?.iter().position(|byte| *byte == 0xff)? + 1;
            match *self.bytes.get(self.at)? {
                // One more 0xff may be the marker's, and 0 makes the byte before it no marker.
                0 | 0xff => {}
                marker => {
                    self.at += 1;
                    return Some(marker);
                }
            }
        }
    }

    /// Reads the next marker and what it has.
    fn segment(&mut self) -> Result<Segment<'a>, Refusal> {
        let marker = match self.marker() {
            None | Some(0xd9) => return Ok(Segment::End),
            // These have no length: more start markers, and restart markers behind the last block.
            Some(1 | 0xd0..=0xd8) => return Ok(Segment::Other),
            Some(marker) => marker,
        };
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let length = rest.first_chunk().map_or(0, |length| usize::from(u16::from_be_bytes(*length)).max(2));
        let Some(segment) = rest.get(2..length) else { return Ok(Segment::End) };
        let whole = self.bytes.get(self.at - 2..self.at + length).unwrap_or_default();
        self.at += length;
        match marker {
            0xdb => return Ok(Segment::Tables(whole)),
            0xc4 => {
                self.huffman_tables(segment).ok_or(BROKEN)?;
                return Ok(Segment::Tables(whole));
            }
            0xdd => self.restart = u16::from_be_bytes(*segment.first_chunk().ok_or(BROKEN)?),
            0xc0..=0xc2 => {
                self.is_progressive = marker == 0xc2;
                self.frame(segment)?;
                return Ok(Segment::Frame);
            }
            0xc3 => return Err(Refusal::Unsupported("its coding is lossless")),
            0xc9..=0xcb => return Err(Refusal::Unsupported("its coding is arithmetic")),
            0xc5..=0xc7 | 0xcd..=0xcf => return Err(Refusal::Unsupported("its coding is hierarchical")),
            0xda => return Ok(Segment::Scan(segment)),
            0xe0 => self.is_jfif |= segment.starts_with(b"JFIF\0"),
            0xe1 if self.exif.is_empty() => {
                self.exif = segment.strip_prefix(b"Exif\0").and_then(|rest| rest.get(1..)).unwrap_or_default();
            }
            0xee if segment.starts_with(b"Adobe") => self.adobe = segment.get(11).copied().or(self.adobe),
            _ => {}
        }
        Ok(Segment::Other)
    }

    /// Reads a start of frame: precision, height, width, components.
    fn frame(&mut self, segment: &[u8]) -> Result<(), Refusal> {
        let Some(&[precision, h1, h2, w1, w2, count]) = segment.first_chunk() else { return Err(BROKEN) };
        if precision != 8 {
            return Err(Refusal::Unsupported("its samples have more than 8 bits"));
        }
        if !self.components.is_empty() {
            return Err(Refusal::Corrupt("it has two frames"));
        }
        self.size = (u16::from_be_bytes([w1, w2]), u16::from_be_bytes([h1, h2]));
        if self.size.0 == 0 || self.size.1 == 0 {
            return Err(Refusal::Unsupported("its headers state no size"));
        }
        let components = segment.get(6..6 + 3 * usize::from(count)).ok_or(BROKEN)?.as_chunks().0;
        let component = |&[id, sampling, quantization]: &[u8; 3]| {
            // A single component has one block in a unit, whatever it states.
            let (across, down) = if count == 1 { (1, 1) } else { (sampling >> 4, sampling & 15) };
            Component { id, across, down, quantization, bits: [UNKNOWN; 64], nonzero: Vec::new() }
        };
        self.components = components.iter().map(component).collect();
        if !matches!(count, 1 | 3) {
            return Err(Refusal::Unsupported("it has neither 1 nor 3 components, such as CMYK"));
        }
        // The decoder takes no others.
        let most = self.components.first().map_or((1, 1), |first| (first.across, first.down));
        let is_sampling = |component: &Component| {
            let (across, down) = (component.across, component.down);
            matches!(across, 1 | 2 | 4)
                && (1..=4).contains(&down)
                && most.0.is_multiple_of(across)
                && most.1.is_multiple_of(down)
        };
        if self.components.iter().all(is_sampling) { Ok(()) } else { Err(SAMPLING) }
    }

    /// Returns whether three components are red, green and blue rather than Y, Cb and Cr, as libjpeg decides it.
    fn is_rgb(&self) -> bool {
        let ids = self.components.iter().map(|component| component.id);
        self.components.len() == 3
            && !self.is_jfif
            && self.adobe.map_or_else(|| ids.eq(RGB), |transform| transform == 0)
    }

    /// Writes the start of frame, with the numbers of components as their identifiers.
    fn write_frame(&self, to: &mut Vec<u8>) {
        let count = self.components.len() as u8;
        let ([w1, w2], [h1, h2]) = (self.size.0.to_be_bytes(), self.size.1.to_be_bytes());
        let marker = if self.is_progressive { 0xc2 } else { 0xc0 };
        to.extend_from_slice(&[0xff, marker, 0, 8 + 3 * count, 8, h1, h2, w1, w2, count]);
        for (number, component) in (1..).zip(&self.components) {
            let Component { across, down, quantization, .. } = component;
            to.extend_from_slice(&[number, across << 4 | down, *quantization]);
        }
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

    /// Walks through the data of a scan, and writes its header and its data.
    fn scan(&mut self, segment: &[u8], to: &mut Vec<u8>) -> Result<(), Refusal> {
        let (count, rest) = segment.split_first().ok_or(BROKEN)?;
        if !(1..=4).contains(count) {
            return Err(BROKEN);
        }
        let (scanned, rest) = rest.split_at_checked(2 * usize::from(*count)).ok_or(BROKEN)?;
        let scanned = scanned.as_chunks::<2>().0;
        let (from, last, bits) = match rest {
            _ if !self.is_progressive => (0, 63, 0),
            &[from, last @ ..=63, bits, ..] if from <= last && (from == 0) == (last == 0) => (from, last, bits),
            _ => return Err(BROKEN),
        };
        // Otherwise, the missing ones are those of the standard.
        for (tables, standard) in [(&mut self.dc, 0), (&mut self.ac, 1)] {
            for (number, table) in tables.iter_mut().take(2).enumerate() {
                if table.is_none() {
                    *table = super::tables::standard(standard, number);
                }
            }
        }
        let (high, low) = (bits >> 4, bits & 15);
        let widest = self.components.iter().map(|component| component.across).max().map_or(1, u32::from);
        let highest = self.components.iter().map(|component| component.down).max().map_or(1, u32::from);
        // Of components in scans of their own, the decoder misplaces the rows if some have fewer.
        if !self.is_progressive && scanned.len() < self.components.len() && (scanned.len() > 1 || highest > 1) {
            return Err(SEPARATE);
        }
        let (width, height) = (u32::from(self.size.0), u32::from(self.size.1));
        let is_single = scanned.len() == 1;
        to.extend_from_slice(&[0xff, 0xdd, 0, 4]);
        to.extend_from_slice(&self.restart.to_be_bytes());
        to.extend_from_slice(&[0xff, 0xda, 0, 6 + 2 * count, *count]);
        let mut units = (width.div_ceil(8 * widest), height.div_ceil(8 * highest));
        let mut parts = Vec::new();
        let mut components = (1_u8..).zip(&mut self.components);
        for [id, tables] in scanned {
            // The components of a scan have the frame's order.
            let (number, component) = components.find(|(_, component)| component.id == *id).ok_or(BROKEN)?;
            let (across, down) = (u32::from(component.across), u32::from(component.down));
            if is_single {
                // A single component has one block in a unit, and none past its edges.
                let blocks = |side: u32, sampling: u32, most: u32| (side * sampling).div_ceil(8 * most);
                units = (blocks(width, across, widest), blocks(height, down, highest));
            }
            for known in component.bits.get_mut(usize::from(from)..=usize::from(last)).unwrap_or_default() {
                if *known != if high == 0 { UNKNOWN } else { high } || (high != 0 && low + 1 != high) {
                    return Err(Refusal::Corrupt("its scans have another order than the standard's"));
                }
                *known = low;
            }
            if from > 0 {
                component.nonzero.resize((units.0 * units.1) as usize, 0);
            }
            parts.push(ScanPart {
                blocks: if is_single { 1 } else { across * down },
                dc: self.dc.get(usize::from(tables >> 4)).and_then(Option::as_ref),
                ac: self.ac.get(usize::from(tables & 15)).and_then(Option::as_ref),
                nonzero: &mut component.nonzero,
            });
            to.extend_from_slice(&[number, *tables]);
        }
        to.extend_from_slice(&[from, last, bits]);
        let pass = match (self.is_progressive, from) {
            (false, _) => Pass::Sequential,
            (true, 0) => Pass::Dc { is_first: high == 0 },
            (true, _) if is_single => Pass::Ac { from: from.into(), last: last.into(), is_first: high == 0 },
            (true, _) => return Err(BROKEN),
        };
        let is_complete = |part: &ScanPart<'_>| match pass {
            Pass::Sequential => part.dc.is_some() && part.ac.is_some(),
            Pass::Dc { is_first } => part.dc.is_some() || !is_first,
            Pass::Ac { .. } => part.ac.is_some(),
        };
        if !parts.iter().all(is_complete) {
            return Err(NO_TABLE);
        }
        let data = self.bytes.get(self.at..).unwrap_or_default();
        let mut scan = Scan { units: units.0 * units.1, restart: self.restart.into(), parts, pass };
        let Whole { extra, end } = scan.walk(data)?;
        append_without(to, data.get(..end).unwrap_or_default(), &extra);
        self.at += end;
        Ok(())
    }
}
