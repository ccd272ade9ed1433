//! Records of an MCAP file, parsed after their lengths were found to fit.

use mcap::records::{Record, op};
use mcap::{McapError, McapResult};

/// Parses a schema, a channel or metadata as [`mcap::parse_record`] does.
///
/// A damaged length is an error here. That function would first allocate as much memory as it asks for.
///
/// # Errors
/// The record is not of the kind that its code says.
pub(crate) fn parse_record(op: u8, body: &[u8]) -> McapResult<Record<'_>> {
    if !matches!(op, op::SCHEMA | op::CHANNEL | op::METADATA) || fits(op, body) {
        return mcap::parse_record(op, body);
    }
    Err(McapError::UnexpectedEof)
}

/// Returns whether the lengths in a header, a schema, a channel or metadata fit the record, with nothing behind them.
pub(crate) fn fits(op: u8, body: &[u8]) -> bool {
    let rest = match op {
        op::HEADER => text(body).and_then(text),
        op::SCHEMA => body.get(2..).and_then(text).and_then(text).and_then(text),
        op::CHANNEL => body.get(4..).and_then(text).and_then(text).and_then(texts),
        op::METADATA => text(body).and_then(texts),
        _ => None,
    };
    rest.is_some_and(<[u8]>::is_empty)
}

/// Returns the bytes behind a text, or behind bytes, whose length of 32 bits comes first.
fn text(bytes: &[u8]) -> Option<&[u8]> {
    split(bytes).map(|(_, rest)| rest)
}

/// Returns the bytes behind pairs of texts. The length of all of them comes first.
fn texts(bytes: &[u8]) -> Option<&[u8]> {
    let (mut pairs, rest) = split(bytes)?;
    while !pairs.is_empty() {
        pairs = text(pairs).and_then(text)?;
    }
    Some(rest)
}

fn split(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a text as it is in a file.
    fn bytes_of(text: &str) -> Vec<u8> {
        [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
    }

    #[test]
    fn whole_records_are_read_and_lengths_that_do_not_fit_are_errors() {
        let map = [bytes_of("specimen"), bytes_of("Saw3")].concat();
        let map = [&(map.len() as u32).to_le_bytes()[..], &map].concat();
        let records = [
            (op::SCHEMA, [vec![1, 0], bytes_of("a schema"), bytes_of("protobuf"), bytes_of("data")].concat()),
            (op::CHANNEL, [vec![1, 0, 1, 0], bytes_of("/camera"), bytes_of("protobuf"), map.clone()].concat()),
            (op::METADATA, [bytes_of("wstac.labels"), map].concat()),
        ];
        let header = [bytes_of(""), bytes_of("wstac 0.2.0")].concat();
        assert!(fits(op::HEADER, &header) && !fits(op::HEADER, &header[1..]));
        assert!(!fits(op::HEADER, &[&header[..], &[0; 64]].concat()));
        for (op, body) in records {
            assert!(parse_record(op, &body).is_ok(), "{op}");
            for cut in 0..body.len() {
                assert!(parse_record(op, &body[..cut]).is_err(), "{op} {cut}");
            }
            // Every byte in turn is the highest of a length. Bytes of a real length are refused, however much memory
            // there is.
            for at in 0..body.len() {
                let mut damaged = body.clone();
                damaged[at] = 0xF0;
                let _ = parse_record(op, &damaged);
            }
            let mut long = body.clone();
            let first = if op == op::METADATA { 0 } else { 2 * usize::from(op == op::CHANNEL) + 2 };
            long[first + 3] = 0xF0;
            assert!(matches!(parse_record(op, &long), Err(McapError::UnexpectedEof)), "{op}");
        }
    }
}
