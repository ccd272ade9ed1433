//! Adds up the taxel sums of the camera frames that make one feature frame.

use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;

/// The taxel sums of the feature frame under way.
#[derive(Clone, Debug)]
pub(super) struct FrameSums {
    /// Camera frames of a feature frame.
    whole: u64,
    /// Camera frames of it that have arrived.
    present: u64,
    sums: [u32; TAXELS],
}

impl FrameSums {
    /// Creates the sums of cameras of this rate.
    pub(super) fn new(rate: FrameRate) -> Self {
        Self { whole: rate.frames_added().into(), present: 0, sums: [0; TAXELS] }
    }

    /// Adds the taxel sums of a camera frame.
    pub(super) fn add(&mut self, sums: &[u32; TAXELS]) {
        self.present += 1;
        self.sums.iter_mut().zip(sums).for_each(|(all, sum)| *all = all.saturating_add(*sum));
    }

    /// Forgets the feature frame under way: the next camera frame is the first of one.
    pub(super) fn restart(&mut self) {
        (self.present, self.sums) = (0, [0; TAXELS]);
    }

    /// Ends the feature frame under way and returns its sums; `None` if no camera frame of it has arrived.
    ///
    /// As in features, the mean of the camera frames that arrived stands for each that did not.
    pub(super) fn complete(&mut self) -> Option<[u32; TAXELS]> {
        let (sums, present) = (self.sums, self.present);
        self.restart();
        let whole = |sum: u32| (2 * u64::from(sum) * self.whole + present) / (2 * present);
        (present > 0).then(|| sums.map(|sum| u32::try_from(whole(sum)).unwrap_or(u32::MAX)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_added_and_lost_ones_are_like_the_others() {
        let mut sums = FrameSums::new(FrameRate::new(120, 1).unwrap());
        let of = |sum: u32| [sum; TAXELS];
        assert_eq!(sums.complete(), None);
        for sum in 1..=4 {
            sums.add(&of(sum));
        }
        assert_eq!(sums.complete(), Some(of(10)));
        for sum in [7, 8, 8] {
            sums.add(&of(sum));
        }
        assert_eq!(sums.complete(), Some(of(31)), "4 * 23 / 3, rounded");
        sums.add(&of(u32::MAX));
        assert_eq!(sums.complete(), Some(of(u32::MAX)));
        sums.add(&of(5));
        sums.restart();
        assert_eq!(sums.complete(), None);
        let mut one = FrameSums::new(FrameRate::NOMINAL);
        one.add(&of(9));
        assert_eq!(one.complete(), Some(of(9)));
    }
}
