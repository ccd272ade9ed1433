use core::ops::Range;
use std::vec::Vec;

use super::*;
use crate::green::gray::Gray;
use crate::law::{ByWave, EventLaw};
use crate::layout::{FrameSize, Layout};
use crate::paper::speed::Speed;
use crate::paper::trigger::TriggerConfig;
use crate::pipeline::Pipeline;
use crate::taxels::FrameGeometry;
use crate::touch::at_once::{AtOnce, answer};
use crate::touch::motion::MotionConfig;
use crate::touch::taxel_ring::TaxelRing;

/// Frames of 25 taxels that glow with what a touch adds, above a dark level with noise of one unit.
struct Scene {
    detector: SlipDetector,
    frame: u64,
    seed: u32,
    glow: [f32; TAXELS],
    ambient: f32,
    noise: f32,
    slips: Vec<Slip>,
}

impl Scene {
    fn new() -> Self {
        let detector = SlipDetector::new(FrameRate::NOMINAL);
        let mut scene =
            Self { detector, frame: 0, seed: 1, glow: [0.0; TAXELS], ambient: 300.0, noise: 4.0, slips: Vec::new() };
        scene.dark(30);
        scene
    }

    fn push(&mut self, light: impl Fn(usize) -> f32) {
        let taxels = core::array::from_fn(|taxel| {
            self.glow[taxel] = 0.47 * self.glow[taxel] + light(taxel);
            self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.ambient + self.glow[taxel] + (self.seed >> 24) as f32 * self.noise / 256.0) as u16
        });
        self.slips.extend(self.detector.push_taxels(self.frame, &taxels));
        self.frame += 1;
    }

    fn dark(&mut self, frames: u32) {
        for _ in 0..frames {
            self.push(|_| 0.0);
        }
    }

    /// A slip, with other light in each frame.
    fn slip(&mut self, frames: u32, light: f32) {
        for number in 0..frames as usize {
            self.push(|taxel| light * PATTERN[(7 * taxel + 3 * number) % TAXELS]);
        }
    }
}

const PATTERN: [f32; TAXELS] = [
    2.0, 5.0, 7.0, 4.0, 2.0, 6.0, 8.0, 9.0, 7.0, 5.0, 5.0, 9.0, 12.0, 9.0, 6.0, 4.0, 8.0, 9.0, 8.0, 6.0, 1.0, 5.0, 7.0,
    5.0, 3.0,
];

#[test]
fn a_noise_that_has_grown_is_learned() {
    let mut scene = Scene::new();
    scene.noise = 64.0;
    scene.dark(2500);
    for light in [1.0, 2.0] {
        scene.push(|taxel| light * (900.0 + 100.0 * PATTERN[taxel]));
    }
    scene.dark(60);
    assert!(scene.detector.held_since_frame().is_some());
    scene.slip(10, 40.0);
    assert_eq!(scene.slips.len(), 1);
}

#[test]
fn a_frame_again_or_an_earlier_one_changes_nothing() {
    let mut scene = Scene::new();
    let before = std::format!("{:?}", scene.detector);
    assert_eq!(scene.detector.push_taxels(scene.frame - 1, &[9999; TAXELS]), None);
    assert_eq!(std::format!("{:?}", scene.detector), before);
}

#[test]
fn the_dark_the_brightest_and_any_rate() {
    let mut scene = Scene::new();
    scene.dark(1_000_000);
    assert_eq!((scene.detector.held_since_frame(), scene.slips.len()), (None, 0));
    for rate in [[1, 1], [15, 2], [15, 1], [45, 1], [120, 1], [10_000, 1], [1, u32::MAX], [u32::MAX, 1]] {
        let mut detector = SlipDetector::new(FrameRate::new(rate[0], rate[1]).unwrap());
        for frame in 0..3000 {
            // Long stretches of black and of white, and frames in which each taxel is one of them.
            let taxels = core::array::from_fn(|taxel| match frame / 60 % 3 {
                0 => 0,
                1 => u16::MAX,
                _ => u16::MAX * ((frame * 7 + taxel as u64 * 11) % 3 / 2) as u16,
            });
            detector.push_taxels(frame, &taxels);
        }
        assert_eq!(detector.push_taxels(u64::MAX, &[0; TAXELS]), None);
        assert_eq!(detector.push_taxels(u64::MAX, &[0; TAXELS]), None);
    }
}

#[test]
fn pipelines_hand_over_whole_feature_frames() {
    let rate = FrameRate::new(60, 1).unwrap();
    let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap(), rate).unwrap();
    let mut pipeline = Pipeline::builder(geometry).taxels::<TaxelRing>().build().unwrap();
    let (mut detector, mut slips, mut held) = (SlipDetector::new(rate), Vec::new(), Vec::new());
    for frame in 0..200_u32 {
        let light = |taxel: usize| match frame {
            80..84 => 4000.0 * PATTERN[taxel],
            140..160 => 400.0 * PATTERN[(7 * taxel + frame as usize / 2) % TAXELS],
            _ => 0.0,
        };
        // A lost camera frame leaves half a feature frame.
        let update = if frame == 101 {
            pipeline.push_lost(1)
        } else {
            pipeline.push_taxels(&core::array::from_fn(|taxel| 9000 + light(taxel) as u32))
        };
        assert_eq!(update.newest_taxels().is_some(), frame % 2 == 1 && frame != 101, "{frame}");
        slips.extend(detector.push(&update));
        held.extend(detector.held_since_frame());
    }
    assert_eq!((slips.len(), slips[0].onset_frame, held[0]), (1, 70, 40));
    // Without a store of taxels there is nothing to watch.
    let mut pipeline = Pipeline::builder(geometry).build().unwrap();
    assert!((0..9).all(|_| pipeline.push_taxels(&[9; TAXELS]).newest_taxels().is_none()));
}

/// Follows a press, a slip in some frames, and a second press 16 frames behind it if `is_again`. Returns the onsets of
/// slips, and what `take` finds in the frames' updates.
fn follow<T>(
    slip: Range<u32>,
    light: f32,
    is_again: bool,
    mut take: impl FnMut(&Update<'_>, &ByWave, &SlipDetector) -> Option<T>,
) -> (Vec<u64>, Vec<T>) {
    let rate = FrameRate::NOMINAL;
    let geometry = FrameGeometry::new(Gray, Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap(), rate).unwrap();
    let trigger = TriggerConfig::default().one_event_per_touch();
    let mut pipeline = Pipeline::builder(geometry).trigger(trigger).taxels::<TaxelRing>().build().unwrap();
    let law = ByWave(MotionConfig::published(rate));
    let (mut detector, mut onsets, mut taken) = (SlipDetector::new(rate), Vec::new(), Vec::new());
    for frame in 0..300_u32 {
        let glow = |taxel: usize| match frame {
            40..42 => 10_000.0 * PATTERN[taxel],
            _ if slip.contains(&frame) => light * PATTERN[(7 * taxel + 3 * frame as usize) % TAXELS],
            _ if is_again && [16, 17].map(|later| slip.end + later).contains(&frame) => 10_000.0 * PATTERN[taxel],
            _ => 0.0,
        };
        let update = pipeline.push_taxels(&core::array::from_fn(|taxel| 9000 + glow(taxel) as u32));
        onsets.extend(detector.push(&update).map(|slip| slip.onset_frame));
        taken.extend(take(&update, &law, &detector));
    }
    (onsets, taken)
}

#[test]
fn all_but_a_reliable_slide_is_unclear_if_a_slip_begins_in_its_touch() {
    let why = Reason::NoSlide(Contact::Unclear);
    let unclear = Answer {
        contact: Some(Contact::Unclear),
        doubt: Some(Reason::Slips),
        ..Answer::new(Err(why), Direction::by_arrival(Err(why)), false)
    };
    let (onsets, presses) = follow(70..80, 400.0, false, |update, law, detector| {
        let event = update.event()?;
        let before = law.answer(&event);
        assert_eq!((event.touch_frame, before.contact, before.reliable), (Some(40), Some(Contact::Press), true));
        let speed = Speed { mm_s: 121.0, sd: Some(10.0), extrapolated: false };
        let slide = Answer { contact: Some(Contact::Slide), speed: Ok(speed), ..before };
        let doubted = Answer { reliable: false, doubt: Some(Reason::NotCrossed), ..slide };
        let corrected = |detector: &SlipDetector, touch_frame, mut answer| {
            detector.correct(&Event { touch_frame: Some(touch_frame), ..event }, &mut answer);
            answer
        };
        let unclear = Answer { duration: before.duration, ..unclear };
        for (touch_frame, expected) in [(40, unclear), (70, unclear), (71, before)] {
            assert_eq!(corrected(detector, touch_frame, before), expected, "a touch from frame {touch_frame} on");
        }
        assert_eq!(corrected(detector, 40, doubted), unclear);
        assert_eq!(corrected(detector, 40, slide), slide);
        assert_eq!(corrected(&SlipDetector::new(FrameRate::NOMINAL), 0, before), before, "no slip");
        Some(())
    });
    assert_eq!((&onsets[..], presses.len()), (&[70][..], 1));
}

#[test]
fn a_press_soon_after_a_touch_with_a_slip_has_its_answer() {
    let mut at_once = AtOnce::new(MotionConfig::published(FrameRate::NOMINAL));
    let (_, found) = follow(44..96, 4000.0, true, |update, law, slip| {
        let of = |event: Event<'_>| {
            let of = |answer: &Answer| (event.touch_frame, answer.contact, answer.doubt);
            answer(&event, law, Some(&mut at_once), Some(slip), of)
        };
        let found = update.event().and_then(of);
        at_once.end(update);
        found
    });
    let first = (Some(40), Some(Contact::Unclear), Some(Reason::Slips));
    assert_eq!(found, [first, (Some(112), Some(Contact::Press), None)]);
}
