//! Chooses a camera's format if the user leaves it open.

use wstac_core::rate::FrameRate;

use wstac_host::camera::formats::{self, FourCc};
use wstac_host::camera::modes::{Mode, RateRange, Sizes};

/// Rates that differ by less than this fraction are the same: 30000/1001 is 30.
const SAME: f64 = 0.002;

/// The distance of an offer from the wanted format. Less is better; the first field is compared first.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Distance {
    /// Pixels that width and height are off, added up.
    size: u64,
    /// The logarithm of the factor by which it is too slow or too fast.
    rate: f64,
    /// Whether the driver leaves something of it open.
    unknown: bool,
    /// The place in the order of preference.
    preference: usize,
}

/// Returns the format to ask for, of those that are read; `None` if none is read.
///
/// It has the wanted size and, at that size, the wanted rate. Of equal formats, the preferred one is taken.
///
/// A typical case is a cheap USB camera. It has 1280x720 uncompressed at 10 frames per second, and as MJPEG at 30.
pub(super) fn choose(modes: &[Mode], size: (u32, u32), rate: FrameRate) -> Option<FourCc> {
    let offers = modes.iter().filter_map(|mode| {
        let preference = formats::preference(mode.fourcc)?;
        let open = Distance { size: 0, rate: 0.0, unknown: true, preference };
        let distances = mode.sizes.iter().map(|sizes| distance(sizes, size, rate, preference));
        let nearest = distances.min_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        Some((nearest.unwrap_or(open), mode.fourcc))
    });
    let best = offers.min_by(|(a, _), (b, _)| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    best.map(|(_, fourcc)| fourcc)
}

fn distance(sizes: &Sizes, size: (u32, u32), rate: FrameRate, preference: usize) -> Distance {
    let (width, height) = sizes.range.nearest(size);
    Distance {
        size: u64::from(width.abs_diff(size.0)) + u64::from(height.abs_diff(size.1)),
        rate: sizes.rates.iter().map(|offer| apart(*offer, rate)).min_by(f64::total_cmp).unwrap_or(0.0),
        unknown: sizes.rates.is_empty(),
        preference,
    }
}

/// Returns the distance of a rate from the nearest one of an offer; 0 if the offer has it.
fn apart(offer: RateRange, rate: FrameRate) -> f64 {
    let ratio = |a: FrameRate, b: FrameRate| (a.per_second() / b.per_second()).ln();
    let off = ratio(offer.slowest, rate).max(ratio(rate, offer.fastest)).max(0.0);
    if off < SAME { 0.0 } else { off }
}

/// Returns whether two rates are the same apart from rounding.
pub(crate) fn same(a: FrameRate, b: FrameRate) -> bool {
    apart(RateRange { slowest: a, fastest: a }, b) == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_host::camera::modes::SizeRange;

    const PAPER: (u32, u32) = (1280, 720);

    fn mode(fourcc: FourCc, sizes: &[((u32, u32), &[u32])]) -> Mode {
        let rates = |rates: &[u32]| {
            let rates = rates.iter().map(|rate| FrameRate::new(*rate, 1).unwrap());
            rates.map(|rate| RateRange { slowest: rate, fastest: rate }).collect()
        };
        let sizes =
            sizes.iter().map(|(size, at)| Sizes { range: SizeRange::one(size.0, size.1), rates: rates(at) }).collect();
        Mode { fourcc, description: String::new(), readable: true, sizes }
    }

    fn chosen(modes: &[Mode]) -> Option<FourCc> {
        choose(modes, PAPER, FrameRate::NOMINAL)
    }

    #[test]
    fn a_cheap_usb_camera_gives_mjpeg() {
        let yuyv = mode(*b"YUYV", &[((640, 480), &[30, 15]), (PAPER, &[10, 5])]);
        let mjpeg = mode(*b"MJPG", &[((640, 480), &[30]), (PAPER, &[30, 15])]);
        assert_eq!(chosen(&[yuyv.clone(), mjpeg.clone()]), Some(*b"MJPG"));
        // At a size at which both are fast enough, the format without loss is better.
        assert_eq!(choose(&[mjpeg, yuyv], (640, 480), FrameRate::NOMINAL), Some(*b"YUYV"));
    }

    #[test]
    fn among_equals_the_preferred_one() {
        let all = [*b"MJPG", *b"RGB3", *b"H264", *b"NV12", *b"YUYV"].map(|code| mode(code, &[(PAPER, &[60, 30])]));
        assert_eq!(chosen(&all), Some(*b"YUYV"));
        let unlisted = [*b"RG10", *b"UYVY", *b"GREY"].map(|code| mode(code, &[]));
        assert_eq!(chosen(&unlisted), Some(*b"GREY"));
    }

    #[test]
    fn what_is_listed_wins_over_what_is_not() {
        assert_eq!(chosen(&[mode(*b"GREY", &[]), mode(*b"YUYV", &[(PAPER, &[30])])]), Some(*b"YUYV"));
        assert_eq!(chosen(&[mode(*b"GREY", &[]), mode(*b"YUYV", &[(PAPER, &[5])])]), Some(*b"GREY"));
    }

    #[test]
    fn the_nearest_size_then_the_nearest_rate() {
        let modes = [
            mode(*b"GREY", &[((320, 240), &[30])]),
            mode(*b"YUYV", &[((1280, 800), &[60])]),
            mode(*b"MJPG", &[((1280, 800), &[25])]),
        ];
        assert_eq!(chosen(&modes), Some(*b"MJPG"));
    }

    #[test]
    fn nothing_where_nothing_is_read() {
        assert_eq!(chosen(&[]), None);
        assert_eq!(chosen(&[mode(*b"H264", &[(PAPER, &[30])])]), None);
    }

    #[test]
    fn rates_are_compared_with_tolerance() {
        let rate = |numerator, denominator| FrameRate::new(numerator, denominator).unwrap();
        assert!(same(rate(30_000, 1001), rate(30, 1)));
        assert!(same(rate(10_000_000, 333_333), rate(30, 1)));
        assert!(!same(rate(29, 1), rate(30, 1)));
        assert!(!same(rate(15, 2), rate(30, 1)));
    }
}
