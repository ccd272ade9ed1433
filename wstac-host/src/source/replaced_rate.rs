//! The words in a source's description if its frame rate was replaced.

use wstac_core::rate::FrameRate;

/// Returns a remark for the description of a source whose own rate differs from the given one.
/// It is empty otherwise.
///
/// Speeds scale with the rate, so that a wrong one gives wrong speeds that look right.
pub(super) fn remark(own: Option<FrameRate>, given: Option<FrameRate>) -> String {
    match (own, given) {
        (Some(own), Some(given)) if own.per_second().total_cmp(&given.per_second()).is_ne() => {
            format!(" as --fps says; without it, {}", readable(own))
        }
        _ => String::new(),
    }
}

/// Returns a rate for a person: as a fraction, or as a decimal if its numbers are large.
pub(super) fn readable(rate: FrameRate) -> String {
    if rate.numerator() >= 1_000_000 {
        return format!("{:.2}", rate.per_second());
    }
    format!("{}:{}", rate.numerator(), rate.denominator())
}
