//! Tests waves on touches of known motion, and on whatever a sample may hold.

use std::vec::Vec;

use super::{Basis, Wave};
use crate::params::{SAMPLE_FRAMES, TAXELS};
use crate::rate::FrameRate;
use crate::reason::Reason;
use crate::touch::motion::{MotionConfig, Readout, Velocity};

type Frame = [u16; TAXELS];

fn config() -> MotionConfig {
    MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL)
}

fn fit(frames: &[Frame]) -> Result<(Velocity, Basis), Reason> {
    let mut wave = Wave::EMPTY;
    wave.fit(frames.iter().map(Some), config())
}

/// Light of a flash that rises in a frame and fades in three.
fn flash(t: f64) -> f64 {
    (-(t / 3.0).max(0.0)).exp() / (1.0 + (-t / 0.5).exp())
}

/// Returns frames in which a flash passes whiskers with a slowness to the right and downward, in frames per pitch.
/// Each whisker has the brightness that `peak` says for its place to the right of the middle and above it.
fn slide([right, down]: [f64; 2], peak: impl Fn(f64, f64) -> f64) -> Vec<Frame> {
    let late = |x: f64, y: f64| 14.0 + 2.0 * (right.abs() + down.abs()) + x * right - y * down;
    let frame = |t: usize| {
        core::array::from_fn(|taxel| {
            let (x, y) = ((taxel % 5) as f64 - 2.0, 2.0 - (taxel / 5) as f64);
            (300.0 + 9000.0 * peak(x, y) * flash(t as f64 - late(x, y)) + (t * 7 + taxel * 3) as f64 % 3.0) as u16
        })
    };
    (0..SAMPLE_FRAMES).map(frame).collect()
}

/// Checks that a velocity is that of a motion, to 2 % and 2°.
fn check(name: &str, frames: &[Frame], mm_s: f64, degrees: f64, basis: Basis) {
    let found = fit(frames);
    let Ok((velocity, known_by)) = found else { panic!("{name}: {found:?}") };
    let turned = (f64::from(velocity.degrees) - degrees + 180.0).rem_euclid(360.0) - 180.0;
    assert!((f64::from(velocity.mm_s) / mm_s - 1.0).abs() < 0.02 && turned.abs() < 2.0, "{name}: {velocity:?}");
    assert_eq!(known_by, basis, "{name}");
}

/// Checks that a ring gives its frames in their order, and none from before a loss.
#[test]
fn a_ring_has_the_frames_of_a_wave() {
    use crate::touch::taxel_ring::{TaxelRing, TaxelStore};

    let frames = slide([1.5, 0.5], |_, _| 1.0);
    let mut ring = TaxelRing::new(u16::MAX.into());
    ring.push(&[9; TAXELS]);
    ring.lose();
    for frame in &frames {
        ring.push(&frame.map(u32::from));
    }
    assert!(ring.frames().eq(frames.iter().map(Some)));
    let mut wave = Wave::EMPTY;
    assert_eq!(wave.fit(ring.frames(), config()), fit(&frames));
    ring.lose();
    ring.push(&[9; TAXELS]);
    assert!(ring.frames().eq([Some(&[9; TAXELS])]));
    // Lost frames keep their places.
    ring.skip(3);
    ring.push(&[8; TAXELS]);
    assert!(ring.frames().eq([Some(&[9; TAXELS]), None, None, None, Some(&[8; TAXELS])]));
    ring.skip(68);
    assert!(ring.frames().take(2).eq([Some(&[8; TAXELS]), None]));
    ring.skip(u64::MAX);
    assert_eq!(ring.frames().count(), 0);
}

/// Checks extremes: refused, or right.
#[test]
fn extremes_are_refused_or_right() {
    let all = |light: fn(usize, usize) -> u16| -> Vec<Frame> {
        (0..SAMPLE_FRAMES).map(|t| core::array::from_fn(|taxel| light(t, taxel))).collect()
    };
    let refused = [
        ("black", all(|_, _| 0)),
        ("saturated", all(|_, _| u16::MAX)),
        ("a step to saturation", all(|t, _| if t < 20 { 0 } else { u16::MAX })),
        ("a step to darkness", all(|t, _| if t < 20 { u16::MAX } else { 0 })),
        ("one frame of light", all(|t, _| if t == 20 { u16::MAX } else { 9 })),
        ("one frame of a whisker", all(|t, taxel| if t == 20 && taxel == 3 { u16::MAX } else { 9 })),
        ("equal series", all(|t, _| if t % 3 == 0 && t > 15 { 40_000 } else { 9 })),
        ("every second frame", all(|t, _| if t > 11 && t % 2 == 0 { u16::MAX } else { 0 })),
        ("a chess board", all(|t, taxel| if t > 11 && (t + taxel) % 2 == 0 { u16::MAX } else { 0 })),
        ("one lit whisker", all(|t, taxel| if taxel == 12 && t > 20 && t < 30 { 30_000 } else { 9 })),
        ("light until the end", all(|t, taxel| if t > 60 + taxel / 5 { 30_000 } else { 9 })),
    ];
    for (name, frames) in refused {
        assert!(fit(&frames).is_err(), "{name}: {:?}", fit(&frames));
    }
    for lost in [0, 70] {
        assert_eq!(Wave::EMPTY.clone().fit(core::iter::repeat_n(None, lost), config()), Err(Reason::FewWhiskers));
    }
    // Whiskers of one column, whose motion across it nothing tells.
    let column = slide([0.0, 1.0], |x, _| f64::from(x == 0.0));
    let (velocity, _) = fit(&column).expect("a velocity");
    assert!((velocity.mm_s - 120.0).abs() < 3.0 && (velocity.degrees - 270.0).abs() < 3.0, "{velocity:?}");
    // One whisker is 2^15 times as bright as the others.
    let bright = slide([1.0, 0.0], |x, y| if (x, y) == (0.0, 0.0) { 7.2 } else { 7.2 / 32_768.0 });
    assert!(fit(&bright).is_err());
    let saturated = slide([1.0, 0.3], |_, _| 7.0);
    check("bright", &saturated, 120.0 / 1.0_f64.hypot(0.3), (-0.3_f64).atan2(1.0).to_degrees(), Basis::Edge);
    let mut answered = 0;
    for mm_s in [10.0, 15.0, 350.0, 600.0] {
        if let Ok((velocity, _)) = fit(&slide([120.0 / mm_s, 0.0], |_, y| (-y * y / 2.0).exp())) {
            answered += 1;
            assert!((f64::from(velocity.mm_s) / mm_s - 1.0).abs() < 0.05, "{mm_s}: {velocity:?}");
        }
    }
    // At 10 and 600 mm/s these flashes are too far apart, and too few.
    assert!(answered >= 2, "{answered} answers");
}

/// Checks that whatever a sample holds, sums fit and numbers are in range. Overflow is a panic in tests.
#[test]
fn any_sample_has_an_answer_in_range() {
    let mut random = wstac_random_models::numbers();
    let (mut wave, mut answered) = (Wave::EMPTY, 0);
    for round in 0..3000 {
        let kind = round % 6;
        let slowness = [random() % 4000, random() % 4000].map(|part| f64::from(part) / 500.0 - 4.0);
        let smooth = slide(slowness, |x, y| (-(x * x + y * y) / 3.0).exp());
        let level = 1 << (random() % 17);
        let frames: Vec<Option<Frame>> = (0..random() as usize % 75)
            .map(|t| {
                let frame: Frame = core::array::from_fn(|taxel| match kind {
                    0 => random() as u16,
                    1 => [0, u16::MAX][random() as usize & 1],
                    2 if t < 5 => 9,
                    2 => (random() % level) as u16,
                    3 => [9, u16::MAX][usize::from(t > 8 && random().is_multiple_of(9))],
                    4 => [0, u16::MAX][usize::from(t > 6 && (t / (1 + round / 900) + taxel * (round % 5)) % 2 == 0)],
                    _ => smooth.get(t).map_or(0, |frame| frame[taxel]) + (random() % 40) as u16,
                });
                (!random().is_multiple_of(20)).then_some(frame)
            })
            .collect();
        let readout = if round % 4 == 0 { Readout::unknown(FrameRate::NOMINAL) } else { Readout::GLOBAL };
        let Ok((velocity, _)) = wave.fit(frames.iter().map(Option::as_ref), config().with_readout(readout)) else {
            continue;
        };
        answered += 1;
        let Velocity { mm_s, mm_s_sd, degrees, degrees_sd } = velocity;
        assert!((0.0..360.0).contains(&degrees) && mm_s > 8.0 && mm_s < 710.0, "{round}: {velocity:?}");
        assert!(
            mm_s_sd > 0.0 && mm_s_sd <= 0.1 * mm_s && degrees_sd > 0.0 && degrees_sd < 11.0,
            "{round}: {velocity:?}"
        );
        // Noise alone is no wave.
        assert!(kind > 1, "{round}: {velocity:?}");
    }
    assert!(answered > 50, "{answered} answers");
}
