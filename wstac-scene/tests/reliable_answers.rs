//! Tests that whatever is said to be reliable is true, in scenes whose light does not follow one even motion.

use wstac_core::green::gray::Gray;
use wstac_core::law::{Answer, ByCoherence, EventLaw};
use wstac_core::layout::Layout;
use wstac_core::paper::trigger::TriggerConfig;
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{MotionConfig, Readout};
use wstac_scene::{Scene, SceneConfig, SimulatedFrame, Touch};

/// Returns the answers to all events of a scene.
fn answers(script: &SceneConfig) -> Vec<Answer> {
    let layout = Layout::paper(script.sensor.size).unwrap();
    let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap();
    let trigger = TriggerConfig::default().one_event_per_touch();
    let mut pipeline = Pipeline::builder(geometry).trigger(trigger).build().unwrap();
    let law = ByCoherence(MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL));
    let mut scene = Scene::new(script).unwrap();
    let mut answers = Vec::new();
    while let Some(shot) = scene.next_shot() {
        let update = match shot {
            SimulatedFrame::Taxels(sums) => pipeline.push_taxels(&sums),
            SimulatedFrame::Lost(frames, _) => pipeline.push_lost(u64::from(frames)),
            _ => panic!("the scene has taxels"),
        };
        answers.extend(update.event().map(|event| law.answer(&event)));
    }
    answers
}

/// Returns whether an answer's velocity is that of one of the slides, within a tenth and ten degrees.
fn is_true(answer: &Answer, script: &SceneConfig) -> bool {
    let Some(velocity) = answer.velocity() else { return true };
    script.touches.iter().filter_map(Touch::slide).any(|slide| {
        let turned = (f64::from(velocity.degrees) - slide.direction_deg + 180.0).rem_euclid(360.0) - 180.0;
        (f64::from(velocity.mm_s) / slide.speed_mm_s - 1.0).abs() < 0.1 && turned.abs() < 10.0
    })
}

/// Reads a scene of taxels, checks that its reliable answers are true, and returns all of them.
fn checked(name: &str, scene: &str) -> Vec<Answer> {
    let script = SceneConfig::from_toml(name, &format!("fidelity = \"taxel\"\n{scene}")).unwrap();
    let answers = answers(&script);
    assert!(!answers.is_empty(), "{name}: no event");
    for answer in &answers {
        assert!(!answer.reliable || is_true(answer, &script), "{name}: {answer:?}");
    }
    answers
}

const TWO_SLIDES: &str = "
[[touch]]
kind = \"slide\"
specimen = \"Saw3\"
speed = 200
length = 25
[[touch]]
kind = \"slide\"
specimen = \"Sin2\"
speed = 250
direction = 90
length = 25
";

#[test]
fn two_touches_in_one_sample_are_not_one_motion() {
    for gap in [1, 10, 20, 30, 38, 45] {
        let answers = checked("two", &format!("gap = {gap}\nlead_in = 45\nseed = 3\n{TWO_SLIDES}"));
        assert!(answers.len() == 1 && !answers[0].reliable, "gap {gap}: {answers:?}");
    }
    // In samples of their own they are what they are.
    let answers = checked("two", &format!("gap = 70\nlead_in = 45\nseed = 3\n{TWO_SLIDES}"));
    assert!(answers.len() == 2 && answers.iter().all(|answer| answer.reliable), "{answers:?}");
}

#[test]
fn a_press_before_a_slide_has_no_reliable_velocity() {
    let press = "[[touch]]\nkind = \"press\"\napproach = 800\nhold = 0.1\n";
    let slide = "[[touch]]\nkind = \"slide\"\nspecimen = \"Saw3\"\nspeed = 150\ndirection = 30\nlength = 30\n";
    for gap in [10, 20, 28, 38] {
        checked("press and slide", &format!("gap = {gap}\nlead_in = 45\nseed = 3\n{press}{slide}"));
    }
}

#[test]
fn a_slide_that_stops_has_no_reliable_velocity_of_another() {
    let stop = |at: f64, speed: f64| {
        let [stops, goes, goes_on] = [2.0, 5.0, 7.0].map(|after| at + after);
        format!("speed = [[0, {speed}], [{at}, {speed}], [{stops}, 1], [{goes}, 1], [{goes_on}, {speed}]]")
    };
    checked("Sin4", &format!("specimen = \"Sin4\"\ndirection = 210\nlength = 60\n{}", stop(30.0, 150.0)));
    // The leading edge has crossed all whiskers after 23 mm.
    for seed in 0..20 {
        let (specimen, direction) = (["Fla0", "Sin4", "Saw2", "Tri3"][seed % 4], 17 * seed);
        let profile = stop(23.0 + 2.0 * seed as f64, 60.0 + 12.0 * seed as f64);
        let slide =
            format!("specimen = \"{specimen}\"\ndirection = {direction}\nlength = 80\nseed = {seed}\n{profile}");
        checked(&format!("stop {seed}"), &slide);
    }
}

#[test]
fn a_slide_that_is_slower_than_a_sample_shows_is_not_reliable() {
    checked("1.8", "specimen = \"Saw2\"\nspeed = 1.8\ndirection = 185.6\nlength = 50\nseed = 1084623166");
    for direction in [0, 180, 270] {
        checked("5", &format!("specimen = \"Fla0\"\nspeed = 5\nlength = 20\ndirection = {direction}"));
    }
}

#[test]
fn a_block_that_passes_some_lines_only_is_not_reliable() {
    for (number, [width, offset, direction, speed]) in
        [[8, 3, 40, 80], [10, 5, 30, 120], [12, -4, 25, 100], [6, 2, 50, 70]].into_iter().enumerate()
    {
        let specimen = ["Saw3", "Sin3", "Tri3", "Saw4"][number];
        let slide = format!("specimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}\nlength = 60");
        let answers = checked("narrow", &format!("{slide}\nwidth = {width}\noffset = {offset}"));
        assert!(!answers[0].reliable, "{width} mm: {answers:?}");
    }
}

#[test]
fn lost_frames_widen_the_deviation() {
    let mut frames = [0, 0];
    let mut within = [0, 0];
    for seed in 0..60 {
        let speed = 60 + 4 * seed;
        let slide = format!("specimen = \"Saw3\"\nspeed = {speed}\ndirection = 30\nseed = {seed}\nlength = 80");
        for (number, sensor) in ["", "[sensor]\ndropped = 0.05"].into_iter().enumerate() {
            for answer in checked(&format!("lost, {seed}"), &format!("{slide}\n{sensor}")) {
                let Some(velocity) = answer.velocity().filter(|_| answer.reliable) else { continue };
                frames[number] += 1;
                within[number] += i32::from((velocity.mm_s - speed as f32).abs() <= 3.0 * velocity.mm_s_sd);
            }
        }
    }
    let [all, some] = frames;
    assert!(all > 57 && some > 40, "{frames:?}");
    assert!(within.into_iter().zip(frames).all(|(within, frames)| 20 * within >= 19 * frames), "{within:?} {frames:?}");
}

#[test]
fn ordinary_slides_are_reliable() {
    let mut reliable = 0;
    for seed in 0..60 {
        let (specimen, direction) = (["Fla0", "Sin2", "Sin4", "Saw2", "Saw4", "Tri3"][seed % 6], 37 * seed);
        let speed = 20.0 * 20.0_f64.powf(seed as f64 / 60.0);
        let slide = format!("specimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}\nseed = {seed}");
        reliable += usize::from(checked(&format!("slide {seed}"), &slide)[0].reliable);
    }
    assert!(reliable >= 59, "{reliable} of 60");
}
