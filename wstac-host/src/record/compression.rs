//! Compression of a recording's chunks.

use std::io::{self, Read};

use crate::error::{Error, ErrorKind};

/// The compression of a recording's chunks.
///
/// A chunk that was never finished, because the program was killed, can be read only as far as the compressor had
/// written it: up to a second of frames is lost. Without compression nothing is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Compression {
    /// Messages are stored as they are.
    #[default]
    None,
    /// zstd.
    Zstd,
    /// lz4.
    Lz4,
}

impl Compression {
    /// The names that files have for compressions.
    pub(super) const NAMES: [(Self, &str); 2] = [(Self::Zstd, "zstd"), (Self::Lz4, "lz4")];

    /// Returns whether this build has it: the feature `compression` adds zstd and lz4.
    pub const fn is_available(self) -> bool {
        matches!(self, Self::None) || cfg!(feature = "compression")
    }

    /// Returns its name in a file.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(compression, _)| *compression == self).map_or("", |(_, name)| name)
    }

    /// Refuses a compression that this build has not.
    pub(super) fn check(self, subject: &dyn std::fmt::Display) -> Result<(), Error> {
        if self.is_available() {
            return Ok(());
        }
        Err(Error::new(ErrorKind::Unsupported, subject, self.missing()))
    }

    /// Returns what is missing in this build.
    pub(super) fn missing(self) -> String {
        let name = self.name();
        format!(
            "has chunks that are compressed with {name}, which this build does not read or write: build with the \
             feature compression, or decompress the file with mcap decompress"
        )
    }

    /// Returns what was compressed, at most this many bytes of it, and whether that is all.
    ///
    /// Damaged bytes give what stands before the damage.
    pub(super) fn unpack(self, packed: &[u8], most: usize) -> io::Result<(Vec<u8>, bool)> {
        match self {
            Self::None => Ok((packed.to_vec(), packed.len() <= most)),
            #[cfg(feature = "compression")]
            Self::Zstd => {
                let mut decoder = zstd::stream::read::Decoder::with_buffer(packed)?;
                // Frames that want a larger window than all that is read are damaged.
                decoder.window_log_max(27)?;
                read_up_to(decoder, most)
            }
            #[cfg(feature = "compression")]
            Self::Lz4 => read_up_to(lz4::Decoder::new(packed)?, most),
            #[cfg(not(feature = "compression"))]
            _ => Err(io::Error::new(io::ErrorKind::Unsupported, self.missing())),
        }
    }
}

/// Reads to the end, to an error, or to this many bytes, and returns whether it was the end.
#[cfg_attr(not(feature = "compression"), allow(dead_code, reason = "nothing is unpacked"))]
fn read_up_to(from: impl Read, most: usize) -> io::Result<(Vec<u8>, bool)> {
    let mut all = Vec::new();
    let read = from.take(most as u64 + 1).read_to_end(&mut all);
    let is_all = read.is_ok() && all.len() <= most;
    all.truncate(most);
    match read {
        Err(error) if error.kind() == io::ErrorKind::OutOfMemory => Err(error),
        _ => Ok((all, is_all)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_build_says_what_it_lacks() {
        assert!(Compression::None.check(&"a.mcap").is_ok());
        for compression in [Compression::Zstd, Compression::Lz4] {
            let checked = compression.check(&"a.mcap");
            assert_eq!(checked.is_ok(), cfg!(feature = "compression"));
            if let Err(error) = checked {
                assert!(
                    error.kind() == ErrorKind::Unsupported
                        && error.message().contains("build with the feature compression")
                );
                assert!(compression.unpack(&[], 0).is_err());
            }
        }
    }

    #[cfg(feature = "compression")]
    #[test]
    fn what_was_cut_off_gives_what_was_whole() {
        use std::io::Write;

        let bytes: Vec<u8> = (0..1_000_000_u32).map(|at| (at / 7) as u8 ^ (at >> 9) as u8).collect();
        let mut encoder = zstd::stream::write::Encoder::new(Vec::new(), 1).unwrap();
        encoder.write_all(&bytes).unwrap();
        let packed = encoder.finish().unwrap();
        assert!(Compression::Zstd.unpack(&packed, bytes.len()).unwrap() == (bytes.clone(), true));
        for cut in [0, 5, packed.len() / 2, packed.len() - 1] {
            let (found, is_all) = Compression::Zstd.unpack(&packed[..cut], bytes.len()).unwrap();
            assert!(bytes.starts_with(&found) && (!is_all || cut == 0), "{cut}: {} bytes", found.len());
        }
        // Text that unpacks to more than may be read ends there.
        let (found, is_all) = Compression::Zstd.unpack(&packed, 100_000).unwrap();
        assert!(bytes.starts_with(&found) && found.len() <= 100_000 && !is_all);
    }
}
