//! Speed laws fitted to labeled slides (SPEC §4), by least squares in the duration.

pub mod data;

use wstac_core::speed::Law;

use self::data::Slides;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::statistics::{Line, rms};

/// Longest and shortest duration of an event that is not cut off and not a single frame, in frames of its sample.
pub const DURATIONS: [u8; 2] = [67, 1];

/// The kind of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawKind {
    /// D = intercept − slope · log10 v.
    Published,
    /// D = 30 · track / v + afterglow.
    Physical,
}

impl LawKind {
    /// Returns its name in the configuration.
    pub fn name(self) -> &'static str {
        match self {
            Self::Published => "published",
            Self::Physical => "physical",
        }
    }

    /// Returns the quantity in which the duration is linear.
    fn transformed(self, mm_s: f64) -> f64 {
        match self {
            Self::Published => mm_s.log10(),
            Self::Physical => 30.0 / mm_s,
        }
    }
}

/// A fitted law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The kind of the law.
    pub kind: LawKind,
    /// The line through durations over log10 v, or over 30/v.
    pub line: Line,
    /// The law as the core computes it, in 32 bits.
    pub law: Law,
    /// Error of the speeds that the law reads off the durations: the root mean square of relative errors.
    ///
    /// It is `None` if the law has no speed for one of the durations.
    pub speed_error: Option<f64>,
}

impl Fit {
    /// Fits a law to slides; `subject` names their origin.
    ///
    /// # Errors
    /// - There are fewer than three different speeds.
    /// - All durations are equal.
    /// - The durations do not fall with speed.
    pub fn new(kind: LawKind, slides: &Slides, subject: &str) -> Result<Self, Error> {
        let wrong = |message: String| Err(Error::new(ErrorKind::Data, subject, message));
        let speeds = slides.speeds().len();
        if speeds < 3 {
            let (used, speeds) = (counted(slides.used.len(), "slide"), counted(speeds, "different speed"));
            let left_out = slides.left_out();
            return wrong(format!("{used} at {speeds} ({left_out} left out), expected at least 3 different speeds"));
        }
        let points: Vec<_> =
            slides.used.iter().map(|slide| [kind.transformed(slide.speed_mm_s), slide.frames]).collect();
        let Some(line) = Line::fit(&points) else {
            return wrong("all slides last equally long, expected durations that fall with speed".into());
        };
        let law = match kind {
            LawKind::Published => Law::Published { intercept: line.intercept as f32, slope: -line.slope as f32 },
            LawKind::Physical => Law::Physical { track: line.slope as f32, afterglow: line.intercept as f32 },
        };
        let falls = if kind == LawKind::Published { line.slope < 0.0 } else { line.slope > 0.0 };
        if !falls {
            return wrong(format!("durations do not fall with speed (law {}), expected that they do", kind.name()));
        }
        let errors = slides.used.iter().map(|slide| {
            let read = f64::from(law.speed(slide.frames as f32)?);
            Some(read / slide.speed_mm_s - 1.0)
        });
        let speed_error = errors.collect::<Option<Vec<f64>>>().and_then(rms);
        Ok(Self { kind, line, law, speed_error })
    }

    /// Returns the law in words: frames at 30 per second, v in mm/s.
    pub fn words(&self) -> String {
        let (sign, rest) =
            if self.line.intercept < 0.0 { ("−", -self.line.intercept) } else { ("+", self.line.intercept) };
        match self.kind {
            LawKind::Published => format!("D = {:.2} − {:.2} log10 v", self.line.intercept, -self.line.slope),
            LawKind::Physical => format!("D = 30 · {:.2} / v {sign} {rest:.2}", self.line.slope),
        }
    }

    /// Returns the law's duration for a speed, in frames at 30 per second.
    pub fn frames(&self, mm_s: f64) -> f64 {
        self.line.intercept + self.line.slope * self.kind.transformed(mm_s)
    }

    /// Returns the slowest and the fastest speed of the law for an event that is not cut off.
    ///
    /// Each frame is `nominal_frames` long at 30 per second. A physical law has no speed for events shorter than its
    /// afterglow. Then the fastest speed is that of the shortest duration above it.
    pub fn answers(&self, nominal_frames: f64) -> Option<[f64; 2]> {
        let [longest, shortest] = DURATIONS;
        let at = |frames: u8| self.law.speed((f64::from(frames) * nominal_frames) as f32).map(f64::from);
        let fastest = (shortest..=longest).find_map(at)?;
        Some([at(longest)?, fastest])
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
        let fit = Fit::new(LawKind::Published, &paper, "it").unwrap();
        assert_eq!(fit.law, Law::PUBLISHED);
        assert!(fit.line.r2 > 1.0 - 1e-12 && fit.line.deviation < 1e-9 && fit.speed_error.unwrap() < 1e-5);
        // The core's own constants of the physical law are least squares on the paper's.
        let physical = Fit::new(LawKind::Physical, &paper, "it").unwrap();
        assert!((physical.line.slope - 113.4).abs() < 0.05, "{physical:?}");
        assert!((physical.line.intercept - 5.36).abs() < 0.005, "{physical:?}");
        assert!((physical.frames(150.0) - (30.0 * 113.4 / 150.0 + 5.36)).abs() < 0.02);
    }

    #[test]
    fn answers_end_where_events_are_cut_off_and_where_the_law_has_its_pole() {
        let fit = Fit::new(LawKind::Physical, &slides(|v| 3000.0 / v + 5.5), "it").unwrap();
        let [slowest, fastest] = fit.answers(1.0).unwrap();
        assert!((slowest - 3000.0 / 61.5).abs() < 1e-3 && (fastest - 3000.0 / 0.5).abs() < 1.0, "{slowest} {fastest}");
        // At 15 frames per second one frame counts as two.
        let [slowest, fastest] = fit.answers(2.0).unwrap();
        assert!((slowest - 3000.0 / 128.5).abs() < 1e-3 && (fastest - 3000.0 / 0.5).abs() < 1.0, "{slowest} {fastest}");
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
            for kind in [LawKind::Published, LawKind::Physical] {
                let message = Fit::new(kind, &slides, "it.npz").unwrap_err().to_string();
                assert!(message.starts_with("it.npz: ") && message.contains(part), "{message}");
            }
        }
    }
}
