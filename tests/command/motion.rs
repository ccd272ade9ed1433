//! Tests of the motion in every frame, `wstac run --motion`.

use serde_json::Value;
use wstac_tests::command::good;
use wstac_tests::folder::Folder;

/// A slow slide must not keep the follower from those behind it.
#[test]
fn every_slide_behind_a_slow_one_has_its_motions() {
    let folder = Folder::new("motion-creep");
    for slow in [12, 16, 20, 25] {
        let slides = [slow, 120, 120, 45, 120]
            .map(|speed| format!("[[touch]]\nkind = \"slide\"\nspecimen = \"Sin2\"\nspeed = {speed}\n"));
        let scene = folder.scene("creep.toml", format!("fidelity = \"taxel\"\n{}", slides.concat()));
        let lines = good(&["run", &scene, "--motion", "--json"]);
        let lines: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
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
