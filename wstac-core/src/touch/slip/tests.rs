use std::vec::Vec;

use super::*;
use crate::green::gray::Gray;
use crate::layout::{FrameSize, Layout};
use crate::pipeline::Pipeline;
use crate::taxels::FrameGeometry;
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

    /// The light of a press, and of its release.
    fn flash(&mut self) {
        self.push(|taxel| 300.0 + 20.0 * PATTERN[taxel]);
        self.push(|taxel| 700.0 + 40.0 * PATTERN[taxel]);
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
fn what_is_held_slips_once_and_again_after_a_rest() {
    let mut scene = Scene::new();
    assert_eq!(scene.detector.held_since_frame(), None);
    scene.flash();
    scene.dark(90);
    assert_eq!((scene.detector.held_since_frame(), scene.slips.len()), (Some(30), 0));
    scene.slip(40, 8.0);
    scene.dark(30);
    let slip = scene.slips[0];
    assert_eq!((scene.slips.len(), slip.onset_frame, slip.held_since_frame), (1, 122, 30));
    assert!(slip.frame <= 125 && (0.01..0.2).contains(&slip.strength), "{slip:?}");
    assert!(scene.detector.held_since_frame().is_some_and(|since| (162..180).contains(&since)));
    scene.slip(20, 8.0);
    assert_eq!((scene.slips.len(), scene.slips[1].onset_frame), (2, 192));
}

#[test]
fn what_has_slid_off_is_held_no_longer() {
    let off = || {
        let mut scene = Scene::new();
        scene.flash();
        scene.dark(60);
        scene.slip(20, 8.0);
        scene.dark(60);
        scene
    };
    // A slide, a short press, a slow one, and a press that is held and lifted.
    let mut scene = off();
    for number in 0..10 {
        scene.push(|taxel| if taxel % COLUMNS == number / 2 { 900.0 } else { 0.0 });
    }
    scene.dark(60);
    assert_eq!((scene.detector.held_since_frame(), scene.slips.len()), (None, 1));
    for dark in [4, 60] {
        let mut scene = off();
        scene.flash();
        scene.dark(dark);
        scene.flash();
        scene.dark(60);
        assert_eq!((scene.detector.held_since_frame(), scene.slips.len()), (None, 1), "{dark}");
    }
    let mut scene = off();
    for _ in 0..10 {
        scene.push(|taxel| 20.0 * PATTERN[taxel]);
    }
    scene.dark(60);
    assert_eq!(scene.slips.len(), 1);
    // A second and a third grasp.
    let mut scene = off();
    for count in 2..4 {
        let since = scene.frame;
        scene.flash();
        scene.dark(60);
        assert_eq!(scene.detector.held_since_frame(), Some(since));
        scene.slip(20, 8.0);
        scene.dark(60);
        assert_eq!(scene.slips.len(), count);
    }
}

#[test]
fn a_slip_ends_in_noise_that_has_grown() {
    let mut scene = Scene::new();
    scene.flash();
    scene.dark(60);
    scene.slip(20, 2.0);
    scene.noise = 40.0;
    scene.dark(3000);
    assert_eq!(scene.slips.len(), 1);
    assert_ne!(scene.detector.held_since_frame(), Some(30));
}

#[test]
fn the_strength_is_above_0() {
    let mut scene = Scene::new();
    let lit = [6, 7, 8, 11, 12];
    scene.push(|taxel| if lit.contains(&taxel) { 4000.0 } else { 0.0 });
    scene.dark(60);
    scene.ambient -= 19.0;
    for _ in 0..8 {
        scene.push(|taxel| if lit[..3].contains(&taxel) { 60.0 } else { 0.0 });
    }
    assert!(matches!(scene.slips[..], [slip] if slip.strength > 0.0), "{:?}", scene.slips);
}

#[test]
fn a_release_ends_the_hold() {
    let mut scene = Scene::new();
    for _ in 0..3 {
        scene.flash();
        scene.dark(60);
        assert!(scene.detector.held_since_frame().is_some());
        scene.flash();
        scene.dark(60);
        assert_eq!((scene.detector.held_since_frame(), scene.slips.len()), (None, 0));
    }
}

#[test]
fn nothing_slips_that_was_not_pressed_on() {
    let mut scene = Scene::new();
    // From the left to the right, then over all.
    for number in 0..10 {
        scene.push(|taxel| if taxel % COLUMNS == number / 2 { 900.0 } else { 0.0 });
    }
    scene.dark(60);
    scene.slip(40, 60.0);
    scene.dark(60);
    // One whisker.
    for _ in 0..2 {
        scene.push(|taxel| if taxel == 7 { 900.0 } else { 0.0 });
        scene.dark(40);
    }
    assert_eq!((scene.detector.held_since_frame(), scene.slips.len()), (None, 0));
}

#[test]
fn ambient_light_and_creep_are_no_slip() {
    let mut scene = Scene::new();
    scene.ambient = 900.0;
    scene.dark(60);
    scene.flash();
    scene.dark(60);
    for ambient in [500.0, 2000.0, 30_000.0, 60_000.0, 100.0] {
        scene.ambient = ambient;
        scene.dark(40);
    }
    for _ in 0..300 {
        scene.ambient += 3.0;
        scene.dark(1);
    }
    // The pattern of the press, as a tremor has.
    for number in 0..300 {
        scene.push(|taxel| (number % 3) as f32 * (0.3 + 0.02 * PATTERN[taxel]));
    }
    assert_eq!((scene.detector.held_since_frame(), scene.slips.len()), (Some(90), 0));
    scene.slip(10, 20.0);
    assert_eq!(scene.slips.len(), 1);
}

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
fn lost_frames() {
    for (lost, held) in [(1, true), (7, true), (8, false)] {
        let mut scene = Scene::new();
        scene.flash();
        scene.dark(40);
        scene.frame += lost;
        scene.dark(40);
        assert_eq!(scene.detector.held_since_frame().is_some(), held, "{lost}");
        scene.slip(10, 20.0);
        assert_eq!(scene.slips.len(), usize::from(held), "{lost}");
    }
    // A frame again, or an earlier one.
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
