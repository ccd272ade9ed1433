//! A camera that lengthens its exposure in the dark and lowers its frame rate for it, as webcams do.

/// Mean of the taxels below which a frame is dark, as a fraction of full scale with the black level.
///
/// It is 2 levels of 255 (a guess).
pub(crate) const DARK: f64 = 0.008;
/// Mean of the taxels from which a frame of the long exposure is bright (a guess).
///
/// It is more than four times [`DARK`] less the default black level. So a camera does not alternate in constant light.
pub(crate) const BRIGHT: f64 = 0.03;
/// Number of dark frames in a row after which the exposure becomes long: half a second at 30 frames per second (a
/// guess).
pub(crate) const DARK_FRAMES: u32 = 15;
/// Number of bright frames in a row after which the exposure becomes short again: the lag of the camera's control loop
/// (a guess).
pub(crate) const BRIGHT_FRAMES: u32 = 3;

/// The longest exposure of a frame, and so its length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Interval {
    #[default]
    Nominal,
    /// Four nominal intervals: 7.5 frames per second instead of 30.
    Long,
}

impl Interval {
    /// Returns the number of nominal frame intervals that the frame spans: 1 or 4.
    pub(crate) const fn frames(self) -> u32 {
        match self {
            Self::Nominal => 1,
            Self::Long => 4,
        }
    }
}

/// The control loop: dark frames make the exposure long, bright frames make it short.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AutoExposure {
    interval: Interval,
    /// Number of frames in a row that call for the other interval.
    count: u32,
}

impl AutoExposure {
    /// Creates a camera at its nominal rate.
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Returns the length of the next frame.
    pub(crate) fn interval(self) -> Interval {
        self.interval
    }

    /// Takes a frame into account and returns the length of the next one.
    ///
    /// `mean_level` is the mean of the last frame's taxels as a fraction of full scale, o of the SPEC, with the black
    /// level.
    pub(crate) fn next(&mut self, mean_level: f64) -> Interval {
        let (asks, frames, other) = match self.interval {
            Interval::Nominal => (mean_level < DARK, DARK_FRAMES, Interval::Long),
            Interval::Long => (mean_level >= BRIGHT, BRIGHT_FRAMES, Interval::Nominal),
        };
        self.count = if asks { self.count + 1 } else { 0 };
        if self.count >= frames {
            *self = Self { interval: other, count: 0 };
        }
        self.interval
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the interval after each of `frames` frames of this level.
    fn after(camera: &mut AutoExposure, level: f64, frames: u32) -> Vec<u32> {
        (0..frames).map(|_| camera.next(level).frames()).collect()
    }

    #[test]
    fn the_dark_makes_it_slow_and_light_fast_again() {
        let mut camera = AutoExposure::new();
        assert_eq!(after(&mut camera, 0.004, DARK_FRAMES - 1), [1; 14]);
        assert_eq!(after(&mut camera, 0.004, 100), [4; 100]);
        assert_eq!(after(&mut camera, 0.1, BRIGHT_FRAMES + 2), [4, 4, 1, 1, 1]);
    }

    #[test]
    fn only_frames_in_a_row_count() {
        let mut camera = AutoExposure::new();
        for _ in 0..10 {
            assert_eq!(after(&mut camera, 0.004, DARK_FRAMES - 1), [1; 14]);
            assert_eq!(camera.next(DARK), Interval::Nominal);
        }
        after(&mut camera, 0.0, DARK_FRAMES);
        for _ in 0..10 {
            assert_eq!(after(&mut camera, BRIGHT, BRIGHT_FRAMES - 1), [4; 2]);
            assert_eq!(camera.next(0.02), Interval::Long);
        }
    }

    #[test]
    fn light_that_stays_the_same_does_not_make_it_go_to_and_fro() {
        for light in 0..1000 {
            let (mut camera, light, black) = (AutoExposure::new(), f64::from(light) * 1e-4, 1.0 / 255.0);
            let (mut interval, mut changes) = (Interval::Nominal, 0);
            for _ in 0..200 {
                let next = camera.next(black + f64::from(interval.frames()) * light);
                changes += u32::from(next != interval);
                interval = next;
            }
            assert!(changes <= 1, "{light}: {changes} changes");
        }
    }

    #[test]
    fn what_is_no_number_changes_nothing() {
        assert_eq!(after(&mut AutoExposure::new(), f64::NAN, 100), [1; 100]);
    }
}
