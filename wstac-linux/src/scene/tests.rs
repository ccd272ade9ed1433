use wstac_core::direction::{self, Heading};
use wstac_core::green::grey::Grey;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::speed::{self, SpeedConfig};
use wstac_core::taxels::Camera;
use wstac_core::trigger::TriggerConfig;

use super::specimen::Specimen;
use super::*;

const HEADINGS: [Heading; 4] = [Heading::Right, Heading::Up, Heading::Left, Heading::Down];

/// Small frames: a seventh of the pixels, the same light.
const SMALL: (u32, u32) = (280, 280);

struct Answer {
    frame: u64,
    reliable: bool,
    speed: f64,
    heading: Heading,
    confidence: f32,
}

fn one(slide: Slide, seed: u64, size: (u32, u32)) -> Script {
    let text = format!("{}@{},{}deg,seed={seed}", slide.specimen, slide.speed_mm_s, slide.heading.degrees());
    Script { size: FrameSize::new(size.0, size.1).unwrap(), ..Script::parse_short(&text).unwrap() }
}

/// The events of a scene, through the whole core.
fn events(script: &Script) -> Vec<Answer> {
    let camera = Camera::new(Grey, Layout::paper(script.size).unwrap(), script.rate).unwrap();
    let mut pipeline: Pipeline = Pipeline::new(camera, 0.5, TriggerConfig::default()).unwrap();
    let config = SpeedConfig::paper(script.rate);
    let (mut scene, mut answers) = (Scene::new(script).unwrap(), Vec::new());
    while let Some(frame) = scene.next_frame() {
        let Some(event) = pipeline.push_frame(frame).unwrap() else { continue };
        let direction = direction::direction(&event);
        answers.push(Answer {
            frame: event.frame,
            reliable: event.reliable,
            speed: f64::from(speed::speed(&event, &config).unwrap().mm_s),
            heading: direction.heading.unwrap(),
            confidence: direction.confidence(),
        });
    }
    assert!(pipeline.finish().is_none());
    assert!(pipeline.end().incomplete.is_none());
    answers
}

/// One event, the right way, the right speed: for every specimen, way and speed of the paper's range.
#[test]
fn every_slide_is_one_event_with_the_right_answers() {
    let (mut worst, mut least) = (0.0_f64, 1.0_f32);
    for specimen in Specimen::ALL {
        for speed_mm_s in [100.0, 150.0, 200.0] {
            for (seed, heading) in (0..).zip(HEADINGS) {
                let slide = Slide { specimen, speed_mm_s, heading };
                let script = one(slide, seed, SMALL);
                let start = Scene::new(&script).unwrap().truth()[0].start_frame();
                let answers = events(&script);
                let [answer] = &answers[..] else { panic!("{slide:?} is {} events", answers.len()) };
                let error = answer.speed / speed_mm_s - 1.0;
                assert!(answer.reliable, "{slide:?}");
                assert!((answer.frame + 5..=answer.frame + 15).contains(&start), "{slide:?} {}", answer.frame);
                assert_eq!(answer.heading, heading, "{slide:?}");
                worst = worst.max(error.abs());
                least = least.min(answer.confidence);
            }
        }
    }
    assert!(worst < 0.12 && least > 0.5, "speed error {worst:.3}, confidence {least:.2}");
}

fn hash(script: &Script) -> u64 {
    let mut scene = Scene::new(script).unwrap();
    let (mut hash, mut frames) = (0xCBF2_9CE4_8422_2325, 0);
    while let Some(frame) = scene.next_frame() {
        // FNV-1a.
        hash = frame.iter().fold(hash, |hash: u64, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3));
        frames += 1;
    }
    assert_eq!(frames, scene.frames());
    hash
}

/// Made on x86-64; any other machine must make the same bytes.
#[test]
fn a_seed_gives_the_same_bytes_everywhere() {
    let slide = Slide { specimen: "Sin3".parse().unwrap(), speed_mm_s: 170.0, heading: Heading::Left };
    let small = |seed| hash(&one(slide, seed, (60, 40)));
    assert_eq!(small(7), 0xF61E_640A_6991_9482);
    assert_eq!(small(7), small(7));
    assert_ne!(small(7), small(8));
}

#[test]
fn slides_of_a_script_are_an_event_each() {
    let text =
        "[[slide]]\nspecimen = \"Saw3\"\nspeed = 120\n[[slide]]\nspecimen = \"Fla0\"\nspeed = 200\ndirection = 270";
    let script = Script { size: FrameSize::new(160, 120).unwrap(), ..Script::from_toml("s", text).unwrap() };
    let (answers, scene) = (events(&script), Scene::new(&script).unwrap());
    assert_eq!(answers.len(), 2);
    for (answer, truth) in answers.iter().zip(scene.truth()) {
        assert_eq!(answer.heading, truth.slide.heading);
        assert!((answer.frame..answer.frame + 20).contains(&truth.start_frame()));
        assert!((answer.speed / truth.slide.speed_mm_s - 1.0).abs() < 0.12);
    }
}

#[test]
fn other_frame_rates_see_the_same_slide() {
    for (numerator, denominator) in [(25, 1), (60_000, 1001), (120, 1)] {
        let slide = Slide { specimen: "Tri3".parse().unwrap(), speed_mm_s: 150.0, heading: Heading::Up };
        let rate = FrameRate::new(numerator, denominator).unwrap();
        let script = Script { rate, ..one(slide, 3, (100, 100)) };
        let answers = events(&script);
        assert_eq!(answers.len(), 1, "{rate:?}");
        assert_eq!(answers[0].heading, Heading::Up);
        assert!((answers[0].speed / 150.0 - 1.0).abs() < 0.12, "{rate:?}: {}", answers[0].speed);
    }
}
