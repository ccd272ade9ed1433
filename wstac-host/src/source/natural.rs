//! Natural order: runs of digits compare as numbers.

use super::name_times::{Part, parts};

/// Returns the bytes by which names are put in order.
///
/// A number is a zero, so that it stands among other bytes as a digit does, then the count of its digits, then these.
/// Names that differ only in leading zeros have the same.
pub(super) fn key(name: &[u8]) -> Vec<u8> {
    let of_part = |part| match part {
        Part::Text(text) => text.to_vec(),
        Part::Number(digits) => {
            let zeros = digits.iter().take_while(|&&digit| digit == b'0').count();
            let digits = digits.get(zeros..).unwrap_or_default();
            [b"0", &digits.len().to_be_bytes()[..], digits].concat()
        }
    };
    parts(name).into_iter().flat_map(of_part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_the_order_of_their_values() {
        let sorted = [
            "",
            "0",
            "00",
            "a",
            "a1",
            "a1b",
            "a2",
            "a02b",
            "a10",
            "a99999999999999999999999999999998",
            "a99999999999999999999999999999999",
            "a-1",
            "ab",
            "b",
        ];
        let mut names = sorted.map(str::as_bytes);
        names.reverse();
        names.sort_by_cached_key(|name| (key(name), *name));
        let names = names.map(|name| std::str::from_utf8(name).unwrap());
        // The character '-' is below the digits.
        let mut expected = sorted.to_vec();
        let dash = expected.remove(11);
        expected.insert(4, dash);
        assert_eq!(names.to_vec(), expected);
    }
}
