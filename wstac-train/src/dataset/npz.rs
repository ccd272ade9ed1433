//! Writes NumPy's `.npz`: a zip archive without compression, with one `.npy` (version 1.0) for each array.
//!
//! Equal arrays give equal bytes: every time in it is 1 January 1980.
//!
//! The project has its own writer, as it has its own reader (`model/npz.rs` gives the reasons). It writes arrays of any
//! size element by element.

mod npy;

use std::io::{self, ErrorKind, Seek, SeekFrom, Write};

use crc32fast::Hasher;
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES, TAXELS};

/// The unit of samples, as the array `scale` has it.
pub const SCALE: f64 = 1.0 / FEATURE_ONE as f64;

pub use self::npy::{Dtype, Number};

struct Member {
    name: String,
    crc: u32,
    bytes: u32,
    offset: u32,
}

impl Member {
    /// Returns the bytes that a local header and a directory entry share, from the version on.
    fn common(&self) -> Vec<u8> {
        let mut common = Vec::new();
        // Version 2.0, no flag, stored, midnight, 1 January 1980.
        for word in [20_u16, 0, 0, 0, 0x21] {
            common.extend(word.to_le_bytes());
        }
        for word in [self.crc, self.bytes, self.bytes] {
            common.extend(word.to_le_bytes());
        }
        common.extend((self.name.len() as u16).to_le_bytes());
        common.extend([0; 2]);
        common
    }
}

/// A writer of an archive.
pub struct Npz<W> {
    out: W,
    at: u64,
    members: Vec<Member>,
}

impl<W: Write + Seek> Npz<W> {
    /// Creates an archive at the start of `out`.
    pub fn new(out: W) -> Self {
        Self { out, at: 0, members: Vec::new() }
    }

    /// Adds an array; `write` writes its elements, the last index fastest.
    ///
    /// # Errors
    /// - The file cannot be written.
    /// - `write` writes more or less than the array.
    /// - The archive becomes larger than 4 GiB.
    pub fn array(
        &mut self,
        name: &str,
        dtype: Dtype,
        shape: &[usize],
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<()> {
        let header = npy::header(dtype, shape);
        let bytes = header.len() as u64 + dtype.bytes() * shape.iter().map(|&n| n as u64).product::<u64>();
        let name = format!("{name}.npy");
        let mut member = Member { name, crc: 0, bytes: small(bytes)?, offset: small(self.at)? };
        self.out.write_all(b"PK\x03\x04")?;
        self.out.write_all(&member.common())?;
        self.out.write_all(member.name.as_bytes())?;
        let mut data = Checked { out: &mut self.out, crc: Hasher::new(), bytes: 0 };
        data.write_all(&header)?;
        write(&mut data)?;
        let written = data.bytes;
        member.crc = data.crc.finalize();
        if written != bytes {
            let message = format!("{} is {written} bytes, expected {bytes}", member.name);
            return Err(io::Error::new(ErrorKind::InvalidData, message));
        }
        // The checksum precedes the data: 14 bytes from the header's start.
        self.out.seek(SeekFrom::Start(self.at + 14))?;
        self.out.write_all(&member.crc.to_le_bytes())?;
        self.at += 30 + member.name.len() as u64 + bytes;
        self.out.seek(SeekFrom::Start(self.at))?;
        self.members.push(member);
        Ok(())
    }

    /// Adds an array of numbers, of one dimension.
    ///
    /// # Errors
    /// [`array`](Self::array) fails.
    pub fn numbers<T: Number>(&mut self, name: &str, numbers: impl ExactSizeIterator<Item = T>) -> io::Result<()> {
        self.array(name, T::DTYPE, &[numbers.len()], |out| out.write_all(&bytes_of(numbers)))
    }

    /// Adds an array of integers if `whole` says that all numbers are, and of float64 otherwise.
    pub(super) fn whole_numbers(
        &mut self,
        name: &str,
        whole: bool,
        numbers: impl ExactSizeIterator<Item = f64>,
    ) -> io::Result<()> {
        if whole { self.numbers(name, numbers.map(|number| number as i64)) } else { self.numbers(name, numbers) }
    }

    /// Adds an array of one number, without dimension.
    ///
    /// # Errors
    /// [`array`](Self::array) fails.
    pub fn number<T: Number>(&mut self, name: &str, number: T) -> io::Result<()> {
        self.array(name, T::DTYPE, &[], |out| out.write_all(&bytes_of([number].into_iter())))
    }

    /// Adds an array of samples, feature after feature.
    ///
    /// # Errors
    /// [`array`](Self::array) fails.
    pub fn samples(
        &mut self,
        name: &str,
        mut samples: impl ExactSizeIterator<Item = impl AsRef<[i16]>>,
    ) -> io::Result<()> {
        self.array(name, Dtype::Int16, &[samples.len(), rows_of(name), SAMPLE_FRAMES], |out| {
            samples.try_for_each(|sample| out.write_all(&bytes_of(sample.as_ref().iter().copied())))
        })
    }

    /// Adds an array of strings, of one dimension.
    ///
    /// # Errors
    /// [`array`](Self::array) fails.
    pub fn strings(&mut self, name: &str, strings: impl ExactSizeIterator<Item = String> + Clone) -> io::Result<()> {
        let points = strings.clone().map(|string| string.chars().count()).max().unwrap_or(0).max(1);
        self.array(name, Dtype::Unicode(points), &[strings.len()], |out| {
            for string in strings {
                let padded = string.chars().map(u32::from).chain(std::iter::repeat(0)).take(points);
                out.write_all(&padded.flat_map(u32::to_le_bytes).collect::<Vec<u8>>())?;
            }
            Ok(())
        })
    }

    /// Finishes the archive.
    ///
    /// # Errors
    /// [`array`](Self::array) fails.
    pub fn finish(mut self) -> io::Result<W> {
        let directory = self.at;
        let mut entries = Vec::new();
        for member in &self.members {
            // Made by version 2.0 on Unix.
            entries.extend(b"PK\x01\x02\x14\x03");
            entries.extend(member.common());
            // No comment, first disk, no internal attributes; an ordinary file that others may read.
            entries.extend([0; 6]);
            entries.extend((0o100_644_u32 << 16).to_le_bytes());
            entries.extend(member.offset.to_le_bytes());
            entries.extend(member.name.as_bytes());
        }
        let count = (self.members.len() as u16).to_le_bytes();
        let bytes = small(entries.len() as u64)?.to_le_bytes();
        entries.extend(b"PK\x05\x06\0\0\0\0");
        entries.extend(count.into_iter().chain(count).chain(bytes).chain(small(directory)?.to_le_bytes()));
        entries.extend([0; 2]);
        self.out.write_all(&entries)?;
        self.out.flush()?;
        Ok(self.out)
    }
}

fn bytes_of<T: Number>(numbers: impl Iterator<Item = T>) -> Vec<u8> {
    let mut bytes = Vec::new();
    numbers.for_each(|number| number.append_to(&mut bytes));
    bytes
}

/// Checks that a plain zip archive can hold a number of bytes.
fn small(bytes: u64) -> io::Result<u32> {
    u32::try_from(bytes)
        .map_err(|_| io::Error::new(ErrorKind::FileTooLarge, "larger than 4 GiB, expected fewer slides"))
}

/// A writer that counts and checks the bytes that it passes on.
struct Checked<'a, W> {
    out: &'a mut W,
    crc: Hasher,
    bytes: u64,
}

impl<W: Write> Write for Checked<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.crc.update(&bytes[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Returns the rows of 70 numbers in a sample of an array.
pub(crate) fn rows_of(array: &str) -> usize {
    if array == "X_taxels" { TAXELS } else { FEATURES }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    #[test]
    fn an_array_of_another_length_is_refused() {
        let mut npz = Npz::new(Cursor::new(Vec::new()));
        let error = npz.array("a", Dtype::Int64, &[2], |out| out.write_all(&[0; 8])).unwrap_err();
        assert!(error.to_string().contains("a.npy is 136 bytes, expected 144"), "{error}");
        let error = npz.array("a", Dtype::Int64, &[1 << 29], |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("4 GiB"), "{error}");
    }
}
