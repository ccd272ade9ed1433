//! Frames that are kept until a source's end.

use wstac_core::params::TAXELS;
use wstac_host::source::SourceEvent;

/// Frames and what became of them.
#[derive(Default)]
pub(crate) struct Kept {
    pub(crate) bytes: Vec<u8>,
    pub(crate) numbers: Vec<i64>,
    pub(crate) timestamps: Vec<f64>,
    pub(crate) taxels: Vec<f32>,
}

/// No memory is left for another frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoMemory;

impl Kept {
    /// Keeps a frame that could be read, and its taxels.
    pub(crate) fn take(
        &mut self,
        item: &SourceEvent<'_>,
        taxels: Option<[f32; TAXELS]>,
        frame_bytes: Option<usize>,
        number: u64,
    ) -> Result<(), NoMemory> {
        let (bytes, timestamp) = match item {
            SourceEvent::Frame { bytes, timestamp, .. } => (*bytes, *timestamp),
            SourceEvent::Taxels(_) => (&[][..], None),
            _ => return Ok(()),
        };
        let Some(taxels) = taxels else { return Ok(()) };
        self.numbers.push(number as i64);
        self.timestamps.push(timestamp.map_or(f64::NAN, |time| time.as_secs_f64()));
        self.taxels.extend(taxels);
        if let (Some(whole), false) = (frame_bytes, bytes.is_empty()) {
            self.bytes.try_reserve(whole).map_err(|_| NoMemory)?;
            // What a driver adds is no part of a frame; the last row's padding may be missing.
            let part = bytes.get(..whole).unwrap_or(bytes);
            self.bytes.extend_from_slice(part);
            self.bytes.resize(self.bytes.len() + whole - part.len(), 0);
        }
        Ok(())
    }
}
