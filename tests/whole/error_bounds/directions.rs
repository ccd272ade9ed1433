//! From samples to durations and directions.

use std::array::from_fn;

use wstac_core::features::{FeatureScale, Features, Floor};
use wstac_core::ln::fixed::Fixed;
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::direction::{self, Heading};
use wstac_core::paper::sample::Sample;
use wstac_core::paper::speed::{self, SpeedConfig};
use wstac_core::paper::trigger::Event;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES, VALID_THRESHOLD};
use wstac_core::rate::FrameRate;
use wstac_tests::random::Random;

use super::{FEATURE, Largest, ONE};

/// The full scale of the sum of a row or column: 8 bits and 2500 pixels.
const MOST: f64 = 255.0 * 2500.0;
/// The number of frames of the baseline.
const QUIET: usize = 25;
/// The error of two values of e^x, as a fraction of the brightest light.
const EXP: f64 = 2e-8;

/// The real logarithms of a slide, and of the baseline before it.
struct Slide {
    quiet: [[f64; FEATURES]; QUIET],
    frames: [[f64; FEATURES]; SAMPLE_FRAMES],
}

/// A number, and the largest possible error of its fixed-point value.
#[derive(Clone, Copy)]
struct Bounded {
    value: f64,
    off: f64,
}

impl Slide {
    /// Returns a random slide, and its features in fixed point. Light passes over the rows and columns at different
    /// paces, above noise.
    fn by_chance(random: &mut Random) -> (Self, [Features; QUIET], [Features; SAMPLE_FRAMES]) {
        let mut uniform = |from: f64, to: f64| from + (to - from) * random.below(1 << 30) as f64 / f64::from(1 << 30);
        let (dark, width) = (uniform(0.012, 0.04), uniform(1.5, 8.0));
        let pace = [uniform(-4.0, 4.0), uniform(-4.0, 4.0)];
        let peaks: [f64; FEATURES] =
            from_fn(|line| 35.0 + (line as f64 % 5.0 - 2.0) * pace[line / 5] + uniform(-1.0, 1.0));
        let bright: [f64; FEATURES] = from_fn(|_| uniform(0.1, 1.0));
        let scale = FeatureScale::<Fixed>::new(2500, 255, 1, Floor::new(0.5, 255).unwrap()).unwrap();
        let mut sum = |line: usize, frame: Option<usize>| {
            let lit = frame.map_or(0.0, |frame| bright[line] * (-((frame as f64 - peaks[line]) / width).powi(2)).exp());
            ((dark * uniform(0.98, 1.02) + lit) * MOST) as u32
        };
        let quiet = from_fn(|_| from_fn::<_, FEATURES, _>(|line| sum(line, None)));
        let frames = from_fn(|frame| from_fn::<_, FEATURES, _>(|line| sum(line, Some(frame))));
        let real = |sum: u32| (f64::from(sum) / MOST).ln();
        let slide = Self { quiet: quiet.map(|frame| frame.map(real)), frames: frames.map(|frame| frame.map(real)) };
        (slide, quiet.map(|frame| scale.features(&frame)), frames.map(|frame| scale.features(&frame)))
    }

    /// Returns the centroid of the light of a row or column above its baseline. Returns `None` if rounding may leave no
    /// light.
    fn centroid(&self, line: usize) -> Option<Bounded> {
        let mean = self.quiet.iter().map(|frame| frame[line]).sum::<f64>() / QUIET as f64;
        let base = mean.exp();
        let light = self.frames.map(|frame| frame[line].exp());
        let brightest = light.into_iter().fold(0.0, f64::max);
        // The documentation of `direction::direction` derives this. The error of a feature is a fraction of its light,
        // and a mean is rounded down to a multiple of 2^-20.
        let share = (FEATURE / ONE).exp_m1();
        let off = light.map(|light| share * (light + base) + base / 1_048_576.0 + EXP * brightest);
        let above = light.map(|light| (light - base).max(0.0));
        let (total, most_off) = (above.iter().sum::<f64>(), off.iter().sum::<f64>());
        let centroid = above.iter().zip(0..).map(|(above, frame)| above * f64::from(frame)).sum::<f64>() / total;
        let moment: f64 = off.iter().zip(0..).map(|(off, frame)| off * (f64::from(frame) - centroid).abs()).sum();
        (total > 2.0 * most_off)
            .then(|| Bounded { value: centroid, off: moment / (total - most_off) + 1.0 / 1_048_576.0 })
    }

    /// Returns the slope of the least-squares line through five centroids.
    fn slope(&self, first: usize) -> Option<Bounded> {
        let mut slope = Bounded { value: 0.0, off: 0.0 };
        for index in 0..5 {
            let (weight, centroid) = ((index as f64 - 2.0) / 10.0, self.centroid(first + index)?);
            slope.value += weight * centroid.value;
            slope.off += weight.abs() * centroid.off;
        }
        Some(slope)
    }
}

/// Compares confidences with those of the real light, within the bound of each sample. Headings must be equal if the
/// bound leaves no choice.
#[test]
fn directions_are_within_their_bound() {
    let mut random = Random::new(17);
    let (mut clear, mut unclear, mut other) = (Largest::default(), Largest::default(), 0);
    for _ in 0..4000 {
        let (slide, quiet, frames) = Slide::by_chance(&mut random);
        let (Some(row), Some(column)) = (slide.slope(0), slide.slope(5)) else { continue };
        let totals = from_fn(|line| quiet.iter().map(|frame| i32::from(frame[line])).sum());
        let baseline = Baseline::new(totals, QUIET as u16);
        let sample = Sample::from_frames(&frames);
        let event = Event::new(0, sample, &baseline);
        let direction = direction::direction(&event);
        let (a, b) = (row.value.abs(), column.value.abs());
        let least = a + b - row.off - column.off;
        if least <= 0.0 {
            continue;
        }
        let confidence = (a - b).abs() / (a + b);
        let off = 2.0 * (a * column.off + b * row.off) / ((a + b) * least) + 1.0 / 32_768.0;
        let found = direction.confidence().unwrap();
        let moved = (f64::from(found) - confidence).abs();
        let what = format_args!("confidence {found} for {confidence}");
        // Slow axes are mostly chance, so slides with a direction are printed separately.
        if confidence > 0.2 + off {
            clear.see(moved, off, what);
            let heading = match (a > b, row.value > 0.0, column.value > 0.0) {
                (true, true, _) => Heading::Down,
                (true, false, _) => Heading::Up,
                (false, _, true) => Heading::Right,
                (false, _, false) => Heading::Left,
            };
            other += u32::from(direction.heading() != Some(heading));
        } else {
            unclear.see(moved, off, what);
            other += u32::from(confidence < 0.2 - off && direction.degrees.is_ok());
        }
    }
    let slides = clear.count + unclear.count;
    println!("{slides} slides, {other} with another heading where the bound leaves no choice");
    assert!(clear.count > 2000 && unclear.count > 100 && other == 0);
    clear.print("confidence of a direction", 1.0, "of 1");
    unclear.print("confidence where there is none", 1.0, "of 1");
}

/// Compares the first and the last valid frame with those of the real light. They may differ only if a frame is within
/// a feature's error of the threshold.
#[test]
fn durations_are_within_their_bound() {
    let mut random = Random::new(23);
    let (mut moved, mut slides) = (0, 0);
    for _ in 0..4000 {
        let (slide, quiet, frames) = Slide::by_chance(&mut random);
        let totals = from_fn(|line| quiet.iter().map(|frame| i32::from(frame[line])).sum());
        let baseline = Baseline::new(totals, QUIET as u16);
        let sample = Sample::from_frames(&frames);
        let event = Event::new(0, sample, &baseline);
        let found = speed::duration(&event, &SpeedConfig::published(FrameRate::NOMINAL)).unwrap();
        let valid = |more: f64| -> Vec<u8> {
            let above = |frame: &[f64; FEATURES]| frame.iter().any(|f| *f > VALID_THRESHOLD.ln() + more / ONE);
            (0_u8..).zip(&slide.frames).filter(|(_, frame)| above(frame)).map(|(number, _)| number).collect()
        };
        let ends = |frames: &[u8]| (*frames.first().unwrap(), *frames.last().unwrap());
        let (surely, maybe) = (ends(&valid(FEATURE)), ends(&valid(-FEATURE)));
        assert!((maybe.0..=surely.0).contains(&found.first) && (surely.1..=maybe.1).contains(&found.last), "{found:?}");
        moved += u32::from((found.first, found.last) != ends(&valid(0.0)));
        slides += 1;
    }
    println!(
        "{moved} of {slides} durations are not those of the real light: a frame was within a feature's error of the threshold"
    );
}
