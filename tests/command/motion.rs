//! Tests of the motion in every frame, `wstac run --motion`, and of slips.

use serde_json::{Value, json};
use wstac_tests::command::{good, records};
use wstac_tests::folder::Folder;

use crate::monitor::board;

/// The part moves from frame 105 on: 45 dark frames and 2 s of rest come first.
#[test]
fn a_held_part_that_slips_is_reported_by_hosts_and_boards() {
    let folder = Folder::new("slip");
    let held = "specimen = \"Sin2\"\nhold = 2\nspeed = 60\ndirection = 270\n";
    let scene = folder.scene("slip.toml", format!("fidelity = \"taxel\"\n[[touch]]\nkind = \"slide\"\n{held}"));
    let records = |more: &[&str]| records(&[&["run", &scene, "--json", "--model", "none"], more].concat());
    let found = records(&[]);
    let slips: Vec<&Value> = found.iter().filter(|record| record["kind"] == "slip").collect();
    let [slip] = slips[..] else { panic!("{found:?}") };
    let (frame, strength) = (slip["frame"].as_u64().unwrap(), slip["strength"].as_f64().unwrap());
    assert!((105..=108).contains(&frame) && (0.1..10.0).contains(&strength), "{slip}");
    let expected = json!({
        "kind": "slip", "frame": frame, "time_ns": frame * 1_000_000_000 / 30, "onset_frame": 105,
        "held_since_frame": 45, "strength": strength,
    });
    assert_eq!(*slip, expected);
    let text = good(&["run", &scene, "--model", "none"]);
    let line = format!("slip at frame {frame}, since frame 105: held since frame 45, strength {strength:.2}");
    assert!(text.lines().any(|found| found == line), "{text}");
    let sent = folder.file("slip.bin", board::sent(&scene, &[], false, true).frames.concat());
    assert_eq!(good(&["monitor", sent.to_str().unwrap()]), text);
    let published = folder.file("published.toml", "[speed]\nlaw = \"published\"\n");
    let found = records(&["--config", published.to_str().unwrap()]);
    assert!(found.iter().all(|record| record["kind"] != "slip"), "{found:?}");
}

/// Of so slow an edge a sample shows a part, so its velocity is not reliable. That of the other end is the same.
#[test]
fn a_slow_flat_block_is_one_event() {
    let folder = Folder::new("slow-block");
    for (number, direction, speed) in [(3, 33, 11_u64), (7, 57, 11), (5, 90, 33)] {
        let slide = format!("specimen = \"Fla0\"\nspeed = {speed}\ndirection = {direction}\nlength = 105\n");
        let toml = format!(
            "fidelity = \"taxel\"\nseed = {number}\n[[touch]]\nkind = \"slide\"\n{slide}[light]\nunit = {number}\n"
        );
        let scene = folder.scene("block.toml", toml);
        let [found, of_samples] =
            [&[][..], &["--samples"]].map(|more| records(&[&["run", &scene, "--json"], more].concat()));
        let [first, second] = [&found, &of_samples].map(|found| {
            let of = |kind: &str| found.iter().filter(|record| record["kind"] == kind).collect::<Vec<_>>();
            let ([event], [end]) = (&of("event")[..], &of("contact_end")[..]) else { panic!("{found:?}") };
            assert_eq!((&event["reliable"], &end["event_frame"]), (&json!(speed == 33), &event["frame"]));
            (event["frame"].as_u64().unwrap(), end["frame"].as_u64().unwrap())
        });
        // The block and the whiskers, 16 mm, pass in so many frames, and the sample begins some frames before.
        let frames = 30 * 105 / speed..30 * (105 + 16) / speed + 20;
        assert!(frames.contains(&(first.1 - first.0)) && first == second, "{speed} mm/s: {first:?}, {second:?}");
    }
}

/// A sample of 70 frames shows the end of a slide of 105 mm at 75 mm/s.
#[test]
fn lit_frames_are_told_if_the_sample_shows_the_end() {
    for (speed, is_whole) in [(75, true), (60, false), (25, false)] {
        let scene = format!("scene:Saw3@{speed},105mm");
        let found = records(&["run", &scene, "--json", "--samples"]);
        let event = found.iter().find(|record| record["kind"] == "event").unwrap();
        assert!(event["duration_frames"].is_number() == is_whole, "{event}");
        assert!(event["end_frame"].is_number() == is_whole, "{event}");
        assert_eq!(good(&["run", &scene, "--model", "builtin:svm"]).contains(", lit "), is_whole, "{speed}");
    }
}

/// The part moves 20 or 30 frames after the press, whose sample is complete after 60.
#[test]
fn a_press_in_which_a_part_slips_is_unclear_on_hosts_and_boards() {
    let folder = Folder::new("slip-of-a-press");
    for (hold, specimen) in [(0.67, "Sin2"), (1.0, "Sin2"), (1.0, "Fla0")] {
        let held = format!("specimen = \"{specimen}\"\nhold = {hold}\nspeed = 25\ndirection = 270\n");
        let scene = folder.scene("held.toml", format!("fidelity = \"taxel\"\n[[touch]]\nkind = \"slide\"\n{held}"));
        let lines = good(&["run", &scene, "--json", "--model", "builtin:svm"]);
        let lines = lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        let found: Vec<Value> = lines.filter(|line| line["kind"] == "slip" || line["kind"] == "event").collect();
        let [slip, event, ..] = &found[..] else { panic!("{found:?}") };
        assert_eq!((&slip["kind"], &event["kind"]), (&json!("slip"), &json!("event")), "{hold}, {specimen}");
        assert_eq!((&event["contact"], &event["reliable"]), (&json!("unclear"), &json!(false)), "{event}");
        assert_eq!(event["why"]["reliable"], "a held part seems to have slipped during the touch", "{event}");
        // Models over time have samples of everything, and would name a texture.
        assert_eq!((&event["texture"], &event["speed"]), (&json!(null), &json!(null)), "{event}");
        let text = good(&["run", &scene, "--model", "none"]);
        for (name, at_once) in [("early.bin", true), ("whole.bin", false)] {
            let sent = folder.file(name, board::sent(&scene, &[], false, at_once).frames.concat());
            assert_eq!(good(&["monitor", sent.to_str().unwrap()]), text, "{hold}, {specimen}, {name}");
        }
    }
}

/// Parts that are lifted, or come from the side, do not slip.
#[test]
fn other_touches_are_no_slips() {
    let folder = Folder::new("no-slip");
    let touches = [
        "kind = \"press\"",
        "kind = \"hold\"\nhold = 3",
        "kind = \"poke\"\nwhisker = [3, 3]",
        "kind = \"slide\"\nspecimen = \"Saw3\"\nspeed = 150",
        "kind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 30\ndirection = 60",
        "kind = \"slide\"\nshape = \"ball\"\ndiameter = 14\nspeed = 120\ndirection = 30",
        "kind = \"slide\"\nshape = \"ball\"\ndiameter = 9\nspeed = 70\ndirection = 200",
    ];
    let touches = touches.map(|touch| format!("[[touch]]\n{touch}\n"));
    let scene = folder.scene("others.toml", format!("fidelity = \"taxel\"\n{}", touches.concat()));
    let text = good(&["run", &scene]);
    // The release of the hold is an event of its own.
    assert_eq!(text.lines().filter(|line| line.starts_with("event at")).count(), touches.len() + 1, "{text}");
    assert!(!text.contains("slip"), "{text}");
}

/// A slow slide must not keep the follower from those behind it.
#[test]
fn every_slide_behind_a_slow_one_has_its_motions() {
    let folder = Folder::new("motion-creep");
    for slow in [12, 16, 20, 25] {
        let slides = [slow, 120, 120, 45, 120]
            .map(|speed| format!("[[touch]]\nkind = \"slide\"\nspecimen = \"Sin2\"\nspeed = {speed}\n"));
        let scene = folder.scene("creep.toml", format!("fidelity = \"taxel\"\n{}", slides.concat()));
        let lines = records(&["run", &scene, "--motion", "--json"]);
        let of = |kind: &'static str| lines.iter().filter(move |line| line["kind"] == kind);
        let touches: Vec<u64> = of("event").map(|event| event["touch_frame"].as_u64().unwrap()).collect();
        let ends: Vec<u64> = of("contact_end").map(|end| end["frame"].as_u64().unwrap()).collect();
        assert_eq!((touches.len(), ends.len()), (5, 5), "{slow} mm/s");
        for (number, (touch, end)) in touches.iter().zip(&ends).enumerate().skip(1) {
            let motions = of("motion").filter(|motion| (touch..=end).contains(&&motion["frame"].as_u64().unwrap()));
            let speed = if number == 3 { 45.0 } else { 120.0 };
            let speeds: Vec<f64> = motions.map(|motion| motion["speed"]["mm_s"].as_f64().unwrap()).collect();
            let near = speeds.iter().filter(|found| (**found / speed - 1.0).abs() < 0.05).count();
            assert!(near >= 10, "{slow} mm/s, slide {number}: {speeds:?}");
        }
    }
}
