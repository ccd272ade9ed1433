//! The parts of a picture's name, and the times that they tell.

/// Digits of a date and a time of day.
const DATE: usize = 14;
pub(super) const NS_PER_S: i128 = 1_000_000_000;

/// The digits of a fraction that is behind no point; 7 are .NET's.
pub(super) const OF_FRACTION: &[usize] = &[3, 6, 7, 9];

/// Returns the time of a date that a name begins with, year to second, and the fraction of the second, in parts of
/// 10⁻⁹. Of `261127_104158` the century is left out, if its digits are at least `short`.
pub(super) fn date(name: &[Part<'_>], of_fraction: &[usize], short: &[u8]) -> Option<i128> {
    let (mut digits, mut at) = (Vec::new(), 0);
    if let [Part::Number(day), Part::Text(_), Part::Number(time), ..] = name
        && (day.len(), time.len()) == (6, 6)
        && *day >= short
    {
        digits.extend_from_slice(b"20");
    }
    while digits.len() < DATE {
        digits.extend_from_slice(name.get(at)?.digits()?);
        at += 2;
    }
    if digits.len() == DATE {
        digits.extend_from_slice(name.get(at)?.digits()?);
        at += 2;
    }
    let field = |from: usize, to: usize, range: std::ops::RangeInclusive<i128>| {
        number(digits.get(from..to)?).filter(|field| range.contains(field))
    };
    let (year, month, day) = (field(0, 4, 1900..=2099)?, field(4, 6, 1..=12)?, field(6, 8, 1..=31)?);
    let (hour, minute, second) = (field(8, 10, 0..=23)?, field(10, 12, 0..=59)?, field(12, 14, 0..=60)?);
    let fraction = fraction(digits.get(DATE..)?, name.get(at.wrapping_sub(3)), of_fraction)?;
    // The year begins in March, so that a leap day is its last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day;
    let seconds = ((24 * days + hour) * 60 + minute) * 60 + second;
    Some(seconds * NS_PER_S + fraction)
}

/// Returns the digits of a fraction behind this part, in parts of 10⁻⁹. Behind another text than a point, only so many
/// digits are one.
fn fraction(digits: &[u8], behind: Option<&Part<'_>>, counts: &[usize]) -> Option<i128> {
    let has_point = matches!(behind, Some(Part::Text(b"." | b",")));
    nanoseconds(digits).filter(|_| counts.contains(&digits.len()) || (digits.len() >= 2 && has_point))
}

/// Returns the time of day that a decimal such as 104158.520 means; `None` if it means none.
pub(super) fn of_clock(decimal: i128) -> Option<i128> {
    let (whole, fraction) = (decimal / NS_PER_S, decimal % NS_PER_S);
    let [hour, minute, second] = [whole / 10_000, whole / 100 % 100, whole % 100];
    (hour < 24 && minute < 60 && second < 60).then(|| ((hour * 60 + minute) * 60 + second) * NS_PER_S + fraction)
}

/// Returns the time of day that a name begins with: hours, minutes, seconds and their fraction, in parts of 10⁻⁹.
pub(super) fn time_of_day(name: &[Part<'_>]) -> Option<i128> {
    name.first()?.digits()?;
    let digits: Vec<&[u8]> = name.iter().filter_map(Part::digits).take(4).collect();
    let joined = digits.concat();
    let fraction = fraction(joined.get(6..)?, name.get((2 * digits.len()).wrapping_sub(3)), OF_FRACTION)?;
    let field = |from: usize, most: i128| number(joined.get(from..from + 2)?).filter(|field| *field <= most);
    let seconds = (field(0, 23)? * 60 + field(2, 59)?) * 60 + field(4, 59)?;
    // Fields of two digits each, in one number or in several.
    let is_clock = digits.iter().rev().skip(1).all(|part| part.len() % 2 == 0);
    Some(seconds * NS_PER_S + fraction).filter(|_| is_clock)
}

/// Returns the time of whole seconds and their fraction that a name begins with, in parts of 10⁻⁹.
pub(super) fn seconds(name: &[Part<'_>]) -> Option<i128> {
    let [seconds, Part::Text(between), fraction, ..] = name else { return None };
    let fraction = fraction.digits()?;
    let is_decimal =
        *between == b"." || (matches!(*between, b"_" | b"-" | b"s") && matches!(fraction.len(), 3 | 6 | 9));
    number(seconds.digits()?)?.checked_mul(NS_PER_S)?.checked_add(nanoseconds(fraction).filter(|_| is_decimal)?)
}

/// A part of a name.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Part<'a> {
    /// Digits.
    Number(&'a [u8]),
    Text(&'a [u8]),
}

impl<'a> Part<'a> {
    pub(super) fn digits(&self) -> Option<&'a [u8]> {
        if let Self::Number(digits) = self { Some(digits) } else { None }
    }
}

pub(super) fn parts(name: &[u8]) -> Vec<Part<'_>> {
    let is_number = |part: &[u8]| part.first().is_some_and(u8::is_ascii_digit);
    name.chunk_by(|a, b| a.is_ascii_digit() == b.is_ascii_digit())
        .map(|part| if is_number(part) { Part::Number(part) } else { Part::Text(part) })
        .collect()
}

/// Returns the digits of a fraction as parts of 10⁻⁹.
fn nanoseconds(fraction: &[u8]) -> Option<i128> {
    let digits: Vec<u8> = fraction.iter().copied().chain(std::iter::repeat(b'0')).take(9).collect();
    number(&digits)
}

/// Returns a decimal such as a time of a name in parts of 10⁻⁹, whose fraction has zeros in front up to so many digits;
/// `None` if the name is anything else.
pub(super) fn decimal(name: &[u8], width: usize) -> Option<i128> {
    let dot = name.iter().position(|byte| *byte == b'.')?;
    let (whole, fraction) = (name.get(..dot)?, name.get(dot + 1..)?);
    if fraction.is_empty() || !fraction.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let zeros = vec![b'0'; width.saturating_sub(fraction.len())];
    number(whole)?.checked_mul(NS_PER_S)?.checked_add(nanoseconds(&[&zeros, fraction].concat())?)
}

/// Returns the value of digits; `None` if there are none, other bytes or too many digits.
pub(super) fn number(digits: &[u8]) -> Option<i128> {
    str::from_utf8(digits).ok().filter(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))?.parse().ok()
}
