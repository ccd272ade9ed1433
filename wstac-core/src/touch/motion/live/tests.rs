use std::vec::Vec;

use super::*;
use crate::features::Features;
use crate::params::SAMPLE_FRAMES;
use crate::rate::FrameRate;

/// Light of a dark line.
const DARK: f64 = 0.01;
/// The frame in which the middle line is lit.
const MIDDLE: f64 = 100.0;

fn feature(light: f64) -> i16 {
    (light.ln() * 2048.0).round() as i16
}

fn baseline() -> Baseline {
    Baseline::new([25 * i32::from(feature(DARK)); FEATURES], 25)
}

/// Light of a surface of `length` mm with a texture, `path` mm behind its leading edge: it rises over 2 mm, and again
/// every 30 mm.
fn surface(path: f64, length: f64) -> f64 {
    let ramp = (path / 2.0).clamp(0.0, 1.0);
    if path < length { ramp * (0.4 + 0.1 * (path * core::f64::consts::TAU / 30.0).sin()) } else { 0.0 }
}

/// Returns frames in which a surface of `length` mm passes rows and columns, `slowness` frames per pitch of 4 mm, with
/// a gain each.
fn frames(rows: f64, columns: f64, gains: [f64; 5], length: f64) -> Vec<Features> {
    let whole = f64::hypot(rows, columns);
    let each = |t: usize, line: usize| {
        let (slowness, k) = if line < 5 { (rows, line) } else { (columns, line - 5) };
        let since = t as f64 - MIDDLE - slowness * (k as f64 - 2.0);
        // A frame is exposed for its whole time.
        let exposed =
            (0..8).map(|part| surface((since + f64::from(part) / 8.0) / whole * 4.0, length)).sum::<f64>() / 8.0;
        gains[k] * exposed
    };
    // Light fades within two frames.
    let mut lit = [0.0; FEATURES];
    let frame = |t| {
        core::array::from_fn(|line| {
            lit[line] = 0.5 * lit[line] + 0.5 * each(t, line);
            feature(DARK + lit[line])
        })
    };
    (0..240).map(frame).collect()
}

#[test]
fn a_short_gap_is_passed_and_a_long_one_begins_anew() {
    let frames = frames(0.0, 4.0, [1.0; 5], 60.0);
    let baseline = baseline();
    for (gap, goes_on) in [(3, true), (7, true), (8, false)] {
        let mut live = LiveMotion::new(MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL));
        let mut all = frames.clone();
        let filled = all[125];
        all[126..126 + gap].fill(filled);
        let mut said = Vec::new();
        for end in (SAMPLE_FRAMES..=126).chain(127 + gap..150) {
            let recent: &[Features; SAMPLE_FRAMES] = all[end - SAMPLE_FRAMES..end].try_into().unwrap();
            said.push(live.push(end as u64, Sample::from_frames(recent), &baseline));
        }
        let before = said[126 - SAMPLE_FRAMES].unwrap().velocity.unwrap();
        assert!((before.mm_s / 30.0 - 1.0).abs() < 0.04, "{before:?}");
        let after = said[127 - SAMPLE_FRAMES].unwrap().velocity;
        assert_eq!(after.is_some(), goes_on, "{gap}: {after:?}");
        // The same frame again brings nothing.
        let recent: &[Features; SAMPLE_FRAMES] = all[149 - SAMPLE_FRAMES..149].try_into().unwrap();
        assert_eq!(live.push(149, Sample::from_frames(recent), &baseline), None);
    }
}

/// Checks that whatever features, baseline and gaps are, numbers are finite and in range.
#[test]
fn any_features_have_an_answer_in_range() {
    let mut random = wstac_random_models::numbers();
    let mut velocities = 0;
    for round in 0..300 {
        let kind = round % 6;
        let (rows, columns) = (f64::from(random() % 800) / 100.0 - 4.0, f64::from(random() % 800) / 100.0 - 4.0);
        let slide = frames(rows, columns, [1.0, 0.9, 1.2, 0.8, 1.0], 60.0);
        let mut value = |t: usize, line: usize| match kind {
            0 => random() as i16,
            1 => [i16::MIN, i16::MAX][random() as usize & 1],
            2 => -((random() % 9000) as i16),
            3 => i16::MIN + (random() % 3) as i16,
            4 => slide[t][line].saturating_add((random() % 300) as i16),
            _ => slide[t][line].saturating_add((random() % 20) as i16),
        };
        let all: Vec<Features> = (0..240).map(|t| core::array::from_fn(|line| value(t, line))).collect();
        let totals = core::array::from_fn(|_| if kind > 3 { 25 * i32::from(feature(DARK)) } else { random() as i32 });
        let baseline =
            Baseline::new(totals, [25, 1, 350, 0, u16::MAX][if kind > 3 { 0 } else { random() as usize % 5 }]);
        let mut live = LiveMotion::new(MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL));
        let mut end = SAMPLE_FRAMES;
        while end < all.len() {
            let from = end - [SAMPLE_FRAMES, 25, 1, 70][random() as usize & 3].min(end);
            let recent = Sample::new((&all[from..usize::midpoint(from, end)], &all[usize::midpoint(from, end)..end]));
            let said = live.push(end as u64, recent, &baseline);
            if let Some(LiveContact { contact, velocity: Some(velocity), .. }) = said {
                velocities += 1;
                let Velocity { mm_s, mm_s_sd, degrees, degrees_sd } = velocity;
                assert_eq!(contact, Contact::Slide);
                assert!((0.0..360.0).contains(&degrees) && mm_s > 8.0 && mm_s < 710.0, "{velocity:?}");
                assert!(mm_s_sd > 0.0 && mm_s_sd <= 0.0601 * mm_s, "{velocity:?}");
                assert!(degrees_sd > 0.0 && degrees_sd.is_finite(), "{velocity:?}");
            }
            end += if random().is_multiple_of(10) { random() as usize % 12 } else { 1 };
        }
    }
    assert!(velocities > 500, "{velocities}");
}
