use std::vec::Vec;

use super::*;
use crate::features::Features;
use crate::layout::{FrameSize, Layout};
use crate::paper::baseline::Baseline;
use crate::paper::sample::Sample;
use crate::params::{FEATURES, SAMPLE_FRAMES};

/// Light of a dark line.
const DARK: f64 = 0.01;

fn event_of<'a>(frames: &'a [Features; SAMPLE_FRAMES], baseline: &'a Baseline) -> Event<'a> {
    Event::new(0, Sample::from_frames(frames), baseline)
}

fn baseline() -> Baseline {
    Baseline::new([feature(DARK); FEATURES].map(|feature| 25 * i32::from(feature)), 25)
}

fn feature(light: f64) -> i16 {
    (light.ln() * 2048.0).round() as i16
}

/// Light of a flash that rises in two frames and fades in eight, with a second one after it.
fn flash(t: f64) -> f64 {
    let one = |t: f64| if t < -20.0 { 0.0 } else { (-(t / 8.0).max(0.0)).exp() / (1.0 + (-t / 0.7).exp()) };
    0.5 * one(t) + 0.3 * one(t - 9.0)
}

/// Returns a sample whose rows and columns see the flash after each other, with a gain each.
fn sample(row: f64, column: f64, gains: [f64; 5]) -> [Features; SAMPLE_FRAMES] {
    core::array::from_fn(|t| {
        core::array::from_fn(|k| {
            let (slowness, line) = if k < 5 { (row, k) } else { (column, k - 5) };
            let at = t as f64 - 28.0 - slowness * (line as f64 - 2.0);
            feature(DARK + gains[line] * flash(at))
        })
    })
}

#[test]
fn speeds_follow_pitch_and_frame_rate() {
    let (frames, baseline) = (sample(0.0, 1.0, [1.0; 5]), baseline());
    for (pitch, rate, expected) in [(4.0, 30, 120.0), (2.0, 30, 60.0), (4.0, 25, 100.0), (4.0, 120, 120.0)] {
        let config = MotionConfig::new(pitch, FrameRate::new(rate, 1).unwrap()).unwrap().with_readout(Readout::GLOBAL);
        let velocity = by_coherence(&event_of(&frames, &baseline), config).velocity.unwrap();
        assert!((velocity.mm_s / expected - 1.0).abs() < 0.004, "{pitch} {rate}: {velocity:?}");
        // Straight to the right is 0, and not -0.0.
        assert_eq!(velocity.degrees.to_bits(), 0, "{velocity:?}");
    }
    for pitch in [0.0, -1.0, f32::NAN, f32::INFINITY, 1001.0] {
        assert!(matches!(MotionConfig::new(pitch, FrameRate::NOMINAL), Err(ConfigError::Pitch(_))));
    }
}

#[test]
fn an_event_that_is_not_reliable_has_no_reliable_velocity() {
    let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    let (frames, baseline) = (sample(0.0, 1.0, [1.0; 5]), baseline());
    let event = Event { reliable: false, ..event_of(&frames, &baseline) };
    let motion = by_coherence(&event, config);
    assert!(motion.velocity.is_some() && !motion.reliable);
}

/// Checks that lost frames widen the deviations, and that a speed that they leave in doubt is not reliable.
#[test]
fn filled_frames_widen_deviations() {
    let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    let (frames, baseline) = (sample(0.0, 0.8, [1.0; 5]), baseline());
    let of = |touch_filled| by_coherence(&Event { touch_filled, ..event_of(&frames, &baseline) }, config);
    let velocity = of(0).velocity.unwrap();
    for filled in [1, 4, 7] {
        let found = of(filled);
        let widened = found.velocity.unwrap();
        assert_eq!((widened.mm_s, widened.degrees), (velocity.mm_s, velocity.degrees));
        // 0.02 frames of 0.8 for one frame.
        let expected = (velocity.mm_s_sd / velocity.mm_s).hypot(0.025 * f32::from(filled).sqrt());
        assert!((widened.mm_s_sd / widened.mm_s / expected - 1.0).abs() < 0.01, "{filled}: {found:?}");
        assert!(widened.degrees_sd > velocity.degrees_sd);
        assert_eq!(found.reliable, filled < 6, "{filled}: {found:?}");
    }
}

/// Checks that a row whose whiskers are not where the others are is not trusted.
#[test]
fn a_line_out_of_order_is_not_reliable() {
    let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    let baseline = baseline();
    let mut frames = sample(0.6, 0.8, [1.0; 5]);
    for (t, frame) in frames.iter_mut().enumerate() {
        frame[1] = feature(DARK + flash(t as f64 - 28.0 + 0.6 + 0.4));
    }
    let motion = by_coherence(&event_of(&frames, &baseline), config);
    assert!(!motion.reliable, "{motion:?}");
}

/// Checks that whatever a sample and a baseline hold, numbers are finite and in range.
#[test]
fn any_sample_has_an_answer_in_range() {
    let config = MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL);
    let mut random = wstac_random_models::numbers();
    for round in 0..4000 {
        let kind = round % 5;
        let frames: [Features; SAMPLE_FRAMES] = core::array::from_fn(|t| {
            core::array::from_fn(|k| match kind {
                0 => random() as i16,
                1 => [i16::MIN, i16::MAX][random() as usize & 1],
                2 => -((random() % 9000) as i16),
                3 => i16::MIN + (random() % 3) as i16,
                _ => feature(DARK + flash(t as f64 - 20.0 - k as f64 * f64::from(round % 7))) + (random() % 300) as i16,
            })
        });
        let totals = core::array::from_fn(|_| if kind == 4 { 25 * i32::from(feature(DARK)) } else { random() as i32 });
        let baseline = Baseline::new(totals, [25, 1, 350, 0][random() as usize & 3]);
        let event = event_of(&frames, &baseline);
        for motion in [by_coherence(&event, config), by_edges(&event, config)] {
            assert!((0.0..=1.0).contains(&motion.coherence), "{motion:?}");
            assert_eq!(motion.velocity.is_some(), motion.contact == Contact::Slide);
            let Some(velocity) = motion.velocity else { continue };
            let Velocity { mm_s, mm_s_sd, degrees, degrees_sd } = velocity;
            assert!((0.0..360.0).contains(&degrees) && mm_s > 0.0, "{motion:?}");
            let all: Vec<f32> = [mm_s, mm_s_sd, degrees_sd].into();
            assert!(all.iter().all(|number| number.is_finite() && *number >= 0.0), "{motion:?}");
        }
    }
}

/// Checks the delays of layouts that fill a part of the picture or are turned, and of several camera frames per feature
/// frame.
#[test]
fn delays_follow_the_layout_and_the_rate() {
    let of = |layout: &Layout, ms: Option<f32>, rate| {
        Readout::of_layout(ms.and_then(ReadoutTime::from_ms), RowOrder::Down, layout, rate).delays()
    };
    let near = |found: [f32; 2], expected: [f32; 2]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4), "{found:?}, expected {expected:?}");
    };
    let paper = |width, height| Layout::paper(FrameSize::new(width, height).unwrap()).unwrap();
    let wide = paper(1280, 720);
    near(of(&wide, Some(20.0), FrameRate::NOMINAL), [0.12, 0.0]);
    // The taxels are in the middle half of the height.
    near(of(&paper(400, 800), Some(20.0), FrameRate::NOMINAL), [0.06, 0.0]);
    // Four camera frames are one feature frame, and an unknown readout is within one of them.
    let fast = FrameRate::new(120, 1).unwrap();
    near(of(&wide, Some(8.0), fast), [0.048, 0.0]);
    near(of(&wide, None, fast), [0.025, 0.0]);
    near(Readout::unknown(fast).delays(), [0.025, 0.0]);
    // The whole sensor is turned by a quarter: what counts as a row are the picture's columns.
    let corners = core::array::from_fn(|taxel| [300 - 60 * (taxel / 5) as u16, 60 * (taxel % 5) as u16]);
    let turned = Layout::new(FrameSize::new(400, 600).unwrap(), [50, 50], corners).unwrap();
    near(of(&turned, Some(20.0), FrameRate::NOMINAL), [0.0, 0.06]);
    let time = ReadoutTime::from_ms(20.0);
    near(Readout::of_layout(time, RowOrder::Right, &turned, FrameRate::NOMINAL).delays(), [-0.09, 0.0]);
    for (ms, is_possible) in [(-1000.0, true), (1000.0, true), (1000.1, false), (f32::NAN, false), (-1001.0, false)] {
        assert_eq!(ReadoutTime::from_ms(ms).map(ReadoutTime::ms), is_possible.then_some(ms), "{ms}");
    }
}

/// Of a pitch of 4 mm: 1,200 mm/s are 0.1 frames per pitch at 30 frames per second, and 0.033 at 10.
#[test]
fn a_press_is_faster_than_any_slide_at_every_rate() {
    for (rate, slowness) in [(30, 0.1), (10, 0.1 / 3.0), (15, 0.05), (40, 0.1), (60, 0.1)] {
        let config = MotionConfig::published(FrameRate::new(rate, 1).unwrap()).with_readout(Readout::GLOBAL);
        let at = |slowness: f32| contact_at([slowness, 0.0], slowness, config);
        assert_eq!((at(0.99 * slowness), at(1.01 * slowness)), (Ok(Contact::Press), Err(Reason::TooFast)), "{rate}");
    }
}
