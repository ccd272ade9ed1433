//! Tests slow drift (docs/DRIFT.md): a baseline that follows it next to a fixed one.

use std::fmt::Write;

use wstac_core::paper::baseline_policy::TrackingBaseline;
use wstac_core::paper::trigger::{Rule, Trigger, TriggerConfig};
use wstac_host::config::Config;
use wstac_host::output::{Output, TactileEvent};
use wstac_host::session::Session;
use wstac_scene::source::SceneSource;
use wstac_scene::{Scene, SceneConfig, Truth};

/// The number of slides in the hour.
const SLIDES: u32 = 30;
/// The number of frames of an hour at 30 per second.
const HOUR: u64 = 108_000;

/// Returns an hour of 30 slides of every direction and of 100 to 190 mm/s, with light that leaks in and grows by this
/// much per minute.
fn hour(leak_per_minute: f64) -> SceneConfig {
    let mut text = format!("fidelity = \"taxel\"\ngap = 3575\n[light]\nleak_per_minute = {leak_per_minute}\n");
    for slide in 0..SLIDES {
        let specimen = ["Fla0", "Sin3", "Saw2", "Tri4"][slide as usize % 4];
        let (speed, direction) = (100 + 10 * (slide % 10), 90 * (slide % 4));
        let _ = writeln!(text, "[[slide]]\nspecimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}");
    }
    SceneConfig::from_toml("an hour", &text).unwrap()
}

/// Returns the truth of a scene, its events, and its number of frames.
fn read(script: &SceneConfig, config: &str) -> (Vec<Truth>, Vec<TactileEvent>, u64) {
    let session = Session::builder(SceneSource::new(script).unwrap()).config(Config::parse(config).unwrap());
    let (mut events, mut frames) = (Vec::new(), 0);
    for output in session.build().unwrap() {
        match output.unwrap() {
            Output::Event(event) => events.push(*event),
            Output::End(end) => frames = end.frames,
            _ => {}
        }
    }
    (Scene::new(script).unwrap().truth().to_vec(), events, frames)
}

/// Finds the event of each slide: the first window that sees it fires, and its sample starts at most 15 frames before
/// the touch and at most 10 after it.
fn of_slides(truth: &[Truth], events: &[TactileEvent]) -> Vec<Option<TactileEvent>> {
    let is_of = |truth: &Truth, event: &TactileEvent| {
        let start = truth.start_frame();
        (start.saturating_sub(15)..=start + 10).contains(&event.frame)
    };
    truth.iter().map(|truth| events.iter().find(|event| is_of(truth, event)).cloned()).collect()
}

const ABOVE: &str = "[speed]\nlaw = \"published\"\nthreshold_on = \"above_baseline\"\n";
const FOLLOW: &str = "[trigger]\nfollow = 512\n[speed]\nlaw = \"published\"\nthreshold_on = \"above_baseline\"\n";

#[test]
fn an_hour_of_drift_makes_a_kept_baseline_fire_and_a_followed_one_not() {
    // From one gray level of black to four.
    let (drifting, still) = (hour(0.0002), hour(0.0));
    let (truth, kept, frames) = read(&drifting, ABOVE);
    assert!(frames >= HOUR, "{frames} frames");
    let (_, followed, _) = read(&drifting, FOLLOW);
    let (_, expected, _) = read(&still, ABOVE);
    let (_, followed_still, _) = read(&still, FOLLOW);

    let found = |events: &[TactileEvent]| of_slides(&truth, events).iter().flatten().count();
    let false_ones = |events: &[TactileEvent]| events.len() - found(events);
    for (name, events) in [
        ("drift, kept", &kept),
        ("drift, followed", &followed),
        ("no drift, kept", &expected),
        ("no drift, followed", &followed_still),
    ] {
        println!(
            "{name}: {} events in {frames} frames, {} slides found, {} false",
            events.len(),
            found(events),
            false_ones(events)
        );
    }
    assert_eq!((found(&expected), false_ones(&expected)), (30, 0));
    assert_eq!((found(&followed), false_ones(&followed)), (30, 0));
    assert_eq!((found(&followed_still), false_ones(&followed_still)), (30, 0));
    assert!(false_ones(&kept) > 100, "{} false events", false_ones(&kept));

    let (mut same, mut off) = (0, 0);
    for (drift, still) in
        of_slides(&truth, &followed).iter().flatten().zip(of_slides(&truth, &expected).iter().flatten())
    {
        assert_eq!(drift.direction.degrees, still.direction.degrees, "at frame {}", drift.frame);
        assert!(drift.direction.degrees.is_ok() && drift.reliable, "at frame {}", drift.frame);
        let (a, b) = (drift.lit_frames.unwrap(), still.lit_frames.unwrap());
        assert!(a.abs_diff(b) <= 1, "at frame {}: {a} frames, {b} without drift", drift.frame);
        if a == b { same += 1 } else { off += 1 }
    }
    println!("durations as without drift: {same}, a frame off: {off}");
    assert!(same >= 24, "{same} of 30 durations are the same");
}

/// No golden vector has light that falls by more than the margin.
#[test]
fn a_baseline_moves_by_no_more_than_the_margin_in_its_time_constant() {
    let config = TriggerConfig::new(5, 1.0, 10, Rule::Signed, 0.2).unwrap();
    let mut trigger = Trigger::with(config, 0, TrackingBaseline::new(16).unwrap());
    let push = |trigger: &mut Trigger<_>, level: i16, frames: u32| {
        for _ in 0..frames {
            trigger.push([level; 10], false);
        }
        trigger.baseline().unwrap().totals()[0]
    };
    let mut before = push(&mut trigger, -8000, 25);
    // Something covers the light, which falls by 6000 units per frame. The margin is 409.6 units per frame, 10240 of a
    // total.
    for _ in 0..100 {
        let now = push(&mut trigger, -14_000, 5);
        assert!((0..=10_240 / 16 + 1).contains(&(before - now)), "{before} to {now}");
        before = now;
    }
}

#[test]
fn time_constants_are_powers_of_two() {
    for windows in [0, 1, 8, 15, 17, 100, 65_536, u32::MAX] {
        let message = TrackingBaseline::new(windows).unwrap_err().to_string();
        assert!(message.starts_with(&format!("follow is {windows} window")), "{message}");
    }
    assert_eq!([16, 32_768].map(|windows| TrackingBaseline::new(windows).unwrap().windows()), [16, 32_768]);
}
