//! Tests the simulated sensor through the command: every specimen, direction and speed, and `wstac scene`.

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;

use serde_json::Value;
use wstac_tests::command::{
    Signal, assert_has, good, prints, program, records, refused, run, said, send, start, wstac,
};
use wstac_tests::folder::Folder;

/// Tests every published specimen: each slide is an event of its own, its direction within 5° and its speed within 5 %.
/// `ci/long answers` tests many more.
#[test]
fn every_direction_is_right() {
    let specimens = ["Fla0", "Sin2", "Sin3", "Sin4", "Saw2", "Saw3", "Saw4", "Tri2", "Tri3", "Tri4"];
    for (seed, specimen) in specimens.into_iter().enumerate() {
        let (speed, degrees) = ([100.0, 150.0, 200.0][seed % 3], [0.0, 90.0, 180.0, 270.0][seed % 4]);
        let source = format!("scene:{specimen}@{speed},{degrees}deg,seed={seed}");
        let events = good(&["run", &source, "--json", "--size", "160x120"]);
        let event: Value = serde_json::from_str(events.lines().next().unwrap()).unwrap();
        let number = |of: &str, name: &str| event[of][name].as_f64().unwrap_or(f64::NAN);
        let turned = (number("direction", "deg") - degrees + 180.0).rem_euclid(360.0) - 180.0;
        let off = number("speed", "mm_s") / speed - 1.0;
        let is_right = turned.abs() < 5.0 && off.abs() < 0.05 && event["contact"] == "slide";
        // An event, the end of its touch, and the end.
        assert!(events.lines().count() == 3 && is_right, "{source}: {events}");
    }
}

#[test]
fn a_rendered_file_gives_the_events_of_its_scene() {
    let folder = Folder::new("scene-rendered");
    let scene = "specimen = \"Saw3\"\nspeed = 150\ndirection = 180\n[sensor]\nsize = [80, 60]\nformat = \"422P\"";
    let scene = &folder.written("s.toml", scene);
    let y4m = &folder.written("s.y4m", "");
    run(&["scene", "render", scene, "-o", y4m, "--force"]);
    let live = good(&["run", &format!("scene:{scene}"), "--json", "--features", "--model", "none"]);
    // A file says first that it has no layout.
    let found = good(&["run", y4m, "--json", "--features", "--readout", "0"]);
    assert_eq!(
        found.split_once('\n').map(|(note, found)| (note.contains("default-layout"), found)),
        Some((true, &*live))
    );
    assert!(live.contains("\"deg\":180"));
    let taxel = folder.file("t.toml", "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"");
    refused(&["scene", "render", taxel.to_str().unwrap(), "-o", "x.y4m"], &["expected fidelity = \"rendered\""]);
    refused(&["scene", "render", scene, "-o", "x.avi"], &[".y4m, .raw or .mp4"]);
    let yuyv = folder.file("y.toml", "specimen = \"Saw3\"\nspeed = 150\n[sensor]\nformat = \"YUYV\"");
    refused(&["scene", "render", yuyv.to_str().unwrap(), "-o", "x.y4m"], &["format is YUYV, expected GREY, Y10"]);
    // Without ffmpeg there is no video, and no file.
    let mut render = program(wstac());
    let done =
        render.args(["scene", "render", scene, "-o", &folder.path("s.mp4")]).env("PATH", &folder.0).output().unwrap();
    assert!(said(&done).contains("ffmpeg, which is not installed; help: sudo apt"), "{}", said(&done));
    assert!(done.status.code() == Some(1) && !folder.0.join("s.mp4").exists());
}

#[test]
fn a_video_that_ffmpeg_refuses_says_so() {
    let folder = Folder::new("scene-refused");
    let ffmpeg = folder.file("ffmpeg", "#!/bin/sh\nexit 3\n");
    std::fs::set_permissions(ffmpeg, Permissions::from_mode(0o755)).unwrap();
    let render = |size: &str| {
        let scene = folder.file("s.toml", format!("specimen = \"Saw3\"\nspeed = 150\n[sensor]\nsize = {size}"));
        let arguments = ["scene", "render", scene.to_str().unwrap(), "-o", &folder.path("s.mp4")];
        let done = program(wstac()).args(arguments).env("PATH", &folder.0).output().unwrap();
        assert!(done.status.code() == Some(1) && !folder.0.join("s.mp4").exists());
        said(&done)
    };
    // It ends before it has read anything: the pipe breaks, which is not the cause.
    let message = render("[80, 60]");
    assert!(message.contains("s.mp4: ffmpeg failed: exit status: 3"), "{message}");
    let message = render("[81, 61]");
    let expected = "frames of 81x61, expected an even width and height for a video; help: set [sensor] size = [82, 62]";
    assert!(message.contains(expected), "{message}");
}

/// An interrupted command leaves what was there, and nothing else.
#[test]
fn an_interrupted_rendering_keeps_the_old_file() {
    let folder = Folder::new("scene-interrupted");
    let path = folder.file("a.y4m", "mine");
    let arguments = ["scene", "render", "Saw3@1", "-o", path.to_str().unwrap(), "--force"];
    let mut child = start(&arguments);
    while folder.names().len() < 2 {
        assert!(child.try_wait().unwrap().is_none(), "it ended");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    // The signal is handled from the first frame on.
    std::thread::sleep(std::time::Duration::from_millis(300));
    send(&child, Signal::INT);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!((folder.names(), std::fs::read(&path).unwrap()), (vec!["a.y4m".to_owned()], b"mine".to_vec()));
}

#[test]
fn taxel_sums_need_the_papers_layout() {
    let folder = Folder::new("scene-layout");
    let scene = folder.scene("c.toml", "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"");
    prints(&["run", &scene, "--json"], &["\"deg\":0"]);
    let config = folder.file("c2.toml", "[green]\nstride = 2");
    refused(&["run", &scene, "--config", config.to_str().unwrap()], &["leave [layout] and stride out"]);
    refused(&["run", &scene, "--save-raw", &folder.path("never-written.raw")], &["rendered"]);
}

/// Tests the published figure 2c.
#[test]
fn strain_of_a_single_whisker_is_printed_and_peaks_at_the_base() {
    let whisker = "[whisker]\npresent = \"middle\"\noverlap_mm = 0.4";
    let folder = Folder::new("scene-whisker");
    let scene = &folder.written("2c.toml", format!("specimen = \"Sphere\"\nspeed = 100\n{whisker}"));
    let printed = good(&["scene", "strain", scene]);
    assert!(printed.ends_with("at 0.00 mm, the base, after 5.00 ms\n"), "{printed}");
    let csv = good(&["scene", "strain", scene, "--csv", "--moments", "4", "--parts", "3"]);
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!((lines.len(), lines[0]), (6, "time_ms,overlap_mm,aside_mm,0.00_mm,1.67_mm,3.33_mm,5.00_mm"));
    // One whisker is a stream like any other. The trigger decides whether it is an event.
    prints(&["run", &format!("scene:{scene}"), "--json"], &["\"kind\":\"end\""]);
}

#[test]
fn a_scene_explains_itself() {
    let explained = good(&["scene", "explain", "Saw3@150", "--no-cost"]);
    assert_has(&explained, &["Saw3 at 150 mm/s", "Modeled:", "afterglow", "without cost", "MJPEG", "Never modeled"]);
    // Effects that are off are listed below those that are on.
    let off = explained.find("without cost").unwrap();
    assert!(explained.find("  rubbing").unwrap() < off && explained.find("  leak").unwrap() > off);
    let folder = Folder::new("scene-dark");
    let dark = folder.file("d.toml", "specimen = \"Saw3\"\nspeed = 150\n[light]\nleak = 0.1\nrubbing_ms = 0");
    let explained = good(&["scene", "explain", dark.to_str().unwrap(), "--no-cost"]);
    let off = explained.find("without cost").unwrap();
    assert!(explained.find("  rubbing").unwrap() > off && explained.find("  leak").unwrap() < off);
}

/// A camera that reads its rows for the whole frame: its answer is right if that is known, and not called reliable if
/// not.
#[test]
fn a_rolling_shutter_is_taken_into_account() {
    let text = "specimen = \"Saw3\"\nspeed = 200\ndirection = 60\n[sensor]\nsize = [80, 60]\nreadout_ms = 33";
    let folder = Folder::new("scene-rolling");
    let scene = folder.file("rolling.toml", text);
    let source = format!("scene:{}", scene.display());
    let [y4m, recording, config] = ["r.y4m", "r.mcap", "r.cfg"].map(|name| folder.path(name));
    run(&["scene", "render", scene.to_str().unwrap(), "-o", &y4m, "--force"]);
    run(&["record", &source, "-o", &recording, "--force"]);
    std::fs::write(&config, "[sensor]\nreadout_ms = 33\n").unwrap();
    let answer = |arguments: &[&str]| {
        let records = records(&[&["run", "--json"], arguments].concat());
        let event = records.iter().find(|record| record["kind"] == "event").unwrap();
        let number = |of: &str, name: &str| event[of][name].as_f64().unwrap_or(f64::NAN);
        let is_right =
            (number("speed", "mm_s") / 200.0 - 1.0).abs() < 0.03 && (number("direction", "deg") - 60.0).abs() < 2.0;
        (event["reliable"] == true, is_right, records.last().unwrap()["readout_ms"].clone())
    };
    for known in [&[&*source][..], &[&recording], &[&y4m, "--readout", "33"], &[&y4m, "--config", &config]] {
        assert_eq!(answer(known), (true, true, 33.0.into()), "{known:?}");
    }
    let (is_reliable, _, unknown) = answer(&[&y4m]);
    assert_eq!((is_reliable, unknown), (false, Value::Null));
    // The user's word counts, also where it is wrong.
    assert!(!answer(&[&recording, "--readout", "0"]).1);
}
