//! Records of an MCAP file, once their lengths have been found to fit.

use mcap::records::{Record, op};
use mcap::{McapError, McapResult};

/// As [`mcap::parse_record`], of what a file says of itself: schemas, channels and metadata. A damaged length is an error here; there
/// it would ask for as much memory first.
///
/// # Errors
/// Where the record is not what its code says.
pub(crate) fn parse_record(op: u8, body: &[u8]) -> McapResult<Record<'_>> {
    let fits = match op {
        op::SCHEMA => body.get(2..).and_then(text).and_then(text).and_then(text),
        op::CHANNEL => body.get(4..).and_then(text).and_then(text).and_then(texts),
        op::METADATA => text(body).and_then(texts),
        _ => Some(body),
    };
    if fits.is_none() {
        return Err(McapError::UnexpectedEof);
    }
    mcap::parse_record(op, body)
}

/// What follows a text, or bytes, with its length of 32 bits before it.
fn text(bytes: &[u8]) -> Option<&[u8]> {
    split(bytes).map(|(_, rest)| rest)
}

/// What follows pairs of texts, with the length of all of them before them.
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

    /// A text as it is in a file.
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
        for (op, body) in records {
            assert!(parse_record(op, &body).is_ok(), "{op}");
            for cut in 0..body.len() {
                assert!(parse_record(op, &body[..cut]).is_err(), "{op} {cut}");
            }
            // Every byte as the highest of a length: those that are one are refused, whatever memory there is.
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
