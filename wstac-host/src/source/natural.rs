//! Natural order: runs of digits compare as numbers.

use std::cmp::Ordering;

/// Compares two names.
///
/// Names that differ only in leading zeros are compared as bytes, so that equal means the same.
pub(super) fn compare(a: &[u8], b: &[u8]) -> Ordering {
    let (mut rest_a, mut rest_b) = (a, b);
    loop {
        let (number_a, number_b) = (digits(rest_a), digits(rest_b));
        if number_a > 0 && number_b > 0 {
            let ((value_a, after_a), (value_b, after_b)) = (rest_a.split_at(number_a), rest_b.split_at(number_b));
            let (value_a, value_b) = (significant(value_a), significant(value_b));
            match value_a.len().cmp(&value_b.len()).then(value_a.cmp(value_b)) {
                Ordering::Equal => (rest_a, rest_b) = (after_a, after_b),
                unequal => return unequal,
            }
            continue;
        }
        match (rest_a.split_first(), rest_b.split_first()) {
            (Some((byte_a, after_a)), Some((byte_b, after_b))) if byte_a == byte_b => {
                (rest_a, rest_b) = (after_a, after_b);
            }
            (Some((byte_a, _)), Some((byte_b, _))) => return byte_a.cmp(byte_b),
            (None, None) => return a.cmp(b),
            (left, right) => return left.is_some().cmp(&right.is_some()),
        }
    }
}

/// Returns the number of digits that a name starts with.
fn digits(name: &[u8]) -> usize {
    name.iter().take_while(|byte| byte.is_ascii_digit()).count()
}

/// Returns a number's digits without leading zeros.
fn significant(digits: &[u8]) -> &[u8] {
    let zeros = digits.iter().take_while(|&&digit| digit == b'0').count();
    digits.get(zeros..).unwrap_or_default()
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
        names.sort_by(|a, b| compare(a, b));
        let names = names.map(|name| std::str::from_utf8(name).unwrap());
        // The character '-' is below the digits.
        let mut expected = sorted.to_vec();
        let dash = expected.remove(11);
        expected.insert(4, dash);
        assert_eq!(names.to_vec(), expected);
    }
}
