//! The speed law fitted to labeled slides (SPEC §4), by least squares in the duration.

pub mod data;

use wstac_core::speed::Law;

use self::data::Slides;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::statistics::{Line, rms};

/// Longest and shortest duration of an event that is not cut off and not a single frame, in frames of its sample.
pub const DURATIONS: [u8; 2] = [67, 1];

/// A fitted law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The line through durations over log10 v.
    pub line: Line,
    /// The law as the core computes it, in 32 bits.
    pub law: Law,
    /// Error of the speeds that the law reads off the durations: the root mean square of relative errors.
    ///
    /// It is `None` if the law has no speed for one of the durations.
    pub speed_error: Option<f64>,
}

impl Fit {
    /// Fits the law to slides; `subject` names their origin.
    ///
    /// # Errors
    /// - There are fewer than three different speeds.
    /// - All durations are equal.
    /// - The durations do not fall with speed.
    pub fn new(slides: &Slides, subject: &str) -> Result<Self, Error> {
        let wrong = |message: String| Err(Error::new(ErrorKind::Data, subject, message));
        let speeds = slides.speeds().len();
        if speeds < 3 {
            let (used, speeds) = (counted(slides.used.len(), "slide"), counted(speeds, "different speed"));
            let left_out = slides.left_out();
            return wrong(format!("{used} at {speeds} ({left_out} left out), expected at least 3 different speeds"));
        }
        let points: Vec<_> = slides.used.iter().map(|slide| [slide.speed_mm_s.log10(), slide.frames]).collect();
        let Some(line) = Line::fit(&points) else {
            return wrong("all slides last equally long, expected durations that fall with speed".into());
        };
        if line.slope >= 0.0 {
            return wrong("durations do not fall with speed, expected that they do".into());
        }
        let law = Law { intercept: line.intercept as f32, slope: -line.slope as f32 };
        let errors = slides.used.iter().map(|slide| {
            let read = f64::from(law.speed(slide.frames as f32)?);
            Some(read / slide.speed_mm_s - 1.0)
        });
        let speed_error = errors.collect::<Option<Vec<f64>>>().and_then(rms);
        Ok(Self { line, law, speed_error })
    }

    /// Returns the law in words: frames at 30 per second, v in mm/s.
    pub fn words(&self) -> String {
        format!("D = {:.2} − {:.2} log10 v", self.line.intercept, -self.line.slope)
    }

    /// Returns the law's duration for a speed, in frames at 30 per second.
    pub fn frames(&self, mm_s: f64) -> f64 {
        self.line.intercept + self.line.slope * mm_s.log10()
    }

    /// Returns the slowest and the fastest speed of the law for an event that is not cut off.
    ///
    /// Each frame is `nominal_frames` long at 30 per second.
    pub fn answers(&self, nominal_frames: f64) -> Option<[f64; 2]> {
        let [longest, shortest] = DURATIONS;
        let at = |frames: u8| self.law.speed((f64::from(frames) * nominal_frames) as f32).map(f64::from);
        Some([at(longest)?, at(shortest)?])
    }
}

#[cfg(test)]
mod tests {
    use super::data::Labeled;
    use super::*;

    fn slides(of: impl Fn(f64) -> f64) -> Slides {
        let used =
            (10..=20).map(|n| f64::from(10 * n)).map(|speed_mm_s| Labeled { speed_mm_s, frames: of(speed_mm_s) });
        Slides { used: used.collect(), ..Slides::default() }
    }

    #[test]
    fn a_law_is_found_again() {
        let paper = slides(|v| 151.06 - 56.29 * v.log10());
        let fit = Fit::new(&paper, "it").unwrap();
        assert_eq!(fit.law, Law::PUBLISHED);
        assert!(fit.line.r2 > 1.0 - 1e-12 && fit.line.deviation < 1e-9 && fit.speed_error.unwrap() < 1e-5);
        assert!((fit.frames(150.0) - 28.57).abs() < 0.01, "{fit:?}");
    }

    #[test]
    fn answers_end_where_events_are_cut_off_or_a_single_frame() {
        let fit = Fit::new(&slides(|v| 150.0 - 50.0 * v.log10()), "it").unwrap();
        let is_at = |answers: [f64; 2], frames: [f64; 2]| {
            answers
                .iter()
                .zip(frames)
                .all(|(mm_s, frames)| (mm_s / 10_f64.powf((150.0 - frames) / 50.0) - 1.0).abs() < 1e-5)
        };
        assert!(is_at(fit.answers(1.0).unwrap(), [67.0, 1.0]));
        // At 15 frames per second one frame counts as two.
        assert!(is_at(fit.answers(2.0).unwrap(), [134.0, 2.0]));
    }

    #[test]
    fn what_is_no_law_is_refused() {
        let two = Slides { used: slides(|v| 3000.0 / v).used[..2].to_vec(), ..Slides::default() };
        let same = Slides { used: vec![Labeled { speed_mm_s: 100.0, frames: 38.0 }; 9], ..Slides::default() };
        for (slides, part) in [
            (Slides::default(), "0 slides at 0 different speeds"),
            (two, "2 slides at 2 different speeds"),
            (same, "9 slides at 1 different speed ("),
            (slides(|_| 30.0), "equally long"),
            (slides(|v| v), "do not fall"),
        ] {
            let message = Fit::new(&slides, "it.npz").unwrap_err().to_string();
            assert!(message.starts_with("it.npz: ") && message.contains(part), "{message}");
        }
    }
}
