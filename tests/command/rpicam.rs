//! Tests of a Raspberry Pi's camera, with a program in the place of `rpicam-vid` that speaks as it does.

use std::path::Path;
use std::process::{Command, Output};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use wstac_tests::command::{Signal, assert_has, event, good, program, said, says, send, wstac};
use wstac_tests::folder::Folder;

/// A folder with the stand-in and a slide.
fn camera(name: &str) -> Folder {
    let folder = Folder::new(name);
    let slide = "specimen = \"Saw3\"\nspeed = 150\ndirection = 30\nlength = 60\n[sensor]\nsize = [400, 400]\n";
    good(&["scene", "render", &folder.scene("s.toml", slide), "-o", &folder.path("s.y4m")]);
    std::fs::create_dir(folder.0.join("bin")).unwrap();
    let stand_in = concat!(env!("CARGO_MANIFEST_DIR"), "/command/rpicam-vid");
    std::os::unix::fs::symlink(stand_in, folder.0.join("bin/rpicam-vid")).unwrap();
    folder
}

fn command(folder: &Folder, plan: &Value, arguments: &[&str]) -> Command {
    let mut command = program(wstac());
    command.args(arguments).current_dir(&folder.0);
    command.env("PATH", format!("{}:/usr/local/bin:/usr/bin:/bin", folder.path("bin")));
    command.env("PICTURES", folder.path("s.y4m")).env("CAMERA", plan.to_string());
    command.env("ARGUMENTS", folder.path("arguments.json"));
    command
}

fn with(folder: &Folder, plan: &Value, arguments: &[&str]) -> Output {
    command(folder, plan, arguments).output().unwrap()
}

/// Records the camera until its program ends, and returns what was said.
fn recorded(folder: &Folder, plan: &Value) -> String {
    let done = with(folder, plan, &["record", "rpicam:", "--size", "400x400", "-o", "r.mcap", "--force"]);
    says(&done, 1, &[]) + &String::from_utf8_lossy(&done.stdout)
}

#[test]
fn frames_are_those_of_the_file_with_the_cameras_own_times() {
    let folder = camera("rpicam-frames");
    let expected = event(&["run", &folder.path("s.y4m")]);
    for plan in [json!({}), json!({"pad": 112, "start_s": 1.5}), json!({"lines": ["\u{fffd} noise", "=", "ERROR"]})] {
        let text = recorded(&folder, &plan);
        let event = event(&["run", &folder.path("r.mcap")]);
        for key in ["frame", "touch_frame", "end_frame", "speed", "direction", "reliable"] {
            assert_eq!(event[key], expected[key], "{key} {plan}");
        }
        // The frames are 33,333 µs apart, from 5 s on.
        let expected = 5_000_000_000_u64 + event["touch_frame"].as_u64().unwrap() * 33_333_000;
        assert_eq!(event["time_ns"], expected, "{event}");
        let opened = "rpicam: imx219, YUV420 400x400, 30 fps; 4 controls locked\n";
        assert_has(&text, &[opened, "rpicam: rpicam-vid has ended (exit status: 0)"]);
    }
    assert_has(&recorded(&folder, &json!({"drop": [60, 61, 100]})), &["3 frames lost: dropped by the driver"]);
    let slower = "20 fps; 4 controls locked; asked for 30 fps";
    assert_has(&recorded(&folder, &json!({"period_us": 50_000})), &[slower]);
    recorded(&folder, &json!({"time": "t - max(0, n - 20) * 16_666_500"}));
    let event = event(&["run", &folder.path("r.mcap")]);
    let why = "the camera takes more frames per second than were agreed on";
    assert_eq!((&event["reliable"], &event["why"]["reliable"]), (&json!(false), &json!(why)), "{event}");
}

#[test]
fn times_that_do_not_follow_are_said_once_and_doubted() {
    let folder = camera("rpicam-times");
    let said =
        "rpicam: times of frames stay or jump: each is one frame, and events are not reliable until they are even";
    let is_told = |text: &str| text.matches(said).count() == 1 && !text.contains("lost: ");
    let back = ["t if n < 50 else 1", "9_000_000_000 - n", "t + 120_000_000_000 * (n > 49)"];
    for time in ["0", "5_000_000_000", "5_000_000_000 + n", "t // 1000", "t // 3"].iter().chain(&back) {
        let text = recorded(&folder, &json!({"time": time}));
        assert!(is_told(&text) && text.contains("not reliable: the frames of"), "{time}: {text}");
    }
    // Doubt ends with even times. A time in the future is none of a frame that has come.
    let ahead = "start - 11_000_000_000 + t + 9_000_000_000 * (n == 5)";
    for time in [ahead, "t - 100_000_000 * (n == 5)", "t - 33_333_000 * (n - 3) * (n in (4, 5, 6))"] {
        let text = recorded(&folder, &json!({"time": time}));
        let is_even = text.contains("rpicam: frames come evenly again") && !text.contains("not reliable: ");
        assert!(is_told(&text) && is_even, "{time}: {text}");
    }
}

#[test]
fn the_color_space_is_the_one_that_the_program_states() {
    let folder = camera("rpicam-color");
    let features = |source: &str| good(&["run", source, "--features", "--json"]);
    let values = |text: &str| -> Vec<String> {
        text.lines().filter_map(|line| Some(line.split_once("\"f\":")?.1.to_owned())).collect()
    };
    let file = values(&features(&folder.path("s.y4m")));
    assert!(file.len() > 60);
    for (color, is_full) in [("sYCC", true), ("SMPTE170M", false), ("Rec709", false)] {
        recorded(&folder, &json!({"color": color}));
        assert_eq!(values(&features(&folder.path("r.mcap"))) == file, is_full, "{color}");
    }
    let done = with(&folder, &json!({"color": "sRGB/Linear"}), &["run", "rpicam:"]);
    says(&done, 1, &["gives the color space \"sRGB/Linear\", expected sYCC"]);
}

#[test]
fn controls_are_locked_and_can_be_set() {
    let folder = camera("rpicam-controls");
    let arguments = |options: &[&str]| -> Value {
        let done = with(&folder, &json!({"frames": 3}), &[&["run", "rpicam:1"], options].concat());
        says(&done, 1, &["rpicam-vid has ended"]);
        serde_json::from_slice(&std::fs::read(folder.0.join("arguments.json")).unwrap()).unwrap()
    };
    let plain = arguments(&[]);
    let of = |names: [&str; 4]| names.map(|name| &plain[name]);
    assert_eq!(of(["camera", "width", "height", "framerate"]), ["1", "1280", "720", "30.0000"]);
    assert_eq!(of(["shutter", "gain", "awbgains", "denoise"]), ["20000", "1.00", "1.00,1.00", "off"]);
    let settings = ["--control", "shutter=8000", "--control", "gain=250", "--control", "lens_position=1200"];
    let set = arguments(&[&settings[..], &["--fps", "60", "--size", "640x480"]].concat());
    assert_eq!([&set["shutter"], &set["gain"], &set["lens-position"], &set["width"]], ["8000", "2.50", "12.00", "640"]);
    // The exposure fits into a frame.
    assert_eq!(arguments(&["--fps", "100"])["shutter"], "6000");
    let kept = arguments(&["--keep-controls"]);
    assert!(kept.get("shutter").is_none() && kept.get("awbgains").is_none(), "{kept}");
    for (options, expected) in [
        (&["--control", "exposure=3"][..], "control exposure is 3, expected one of shutter 10 to 10000000 (µs), gain"),
        (&["--control", "gain=99"], "control gain is 99, expected one of"),
        (&["--size", "641x480"], "size is 641x480, expected even numbers"),
        (&["--format", "YUYV"], "format is YUYV, expected YU12"),
        (&["--keep-controls", "--control", "gain=100"], "cannot be set with --keep-controls"),
        (&["rpicam:-n"], "camera is \"-n\", expected a number"),
    ] {
        let camera = if options[0].starts_with("--") { &["run", "rpicam:"][..] } else { &["run"] };
        assert_has(&said(&with(&folder, &json!({}), &[camera, options].concat())), &[expected]);
    }
}

#[test]
fn what_goes_wrong_is_said_with_its_reason() {
    let folder = camera("rpicam-wrong");
    let crash = json!({"frames": 40, "status": -6, "last_lines": ["[1:2] [3] ERROR V4L2 v4l2_device.cpp:9 lost"]});
    for (plan, expected) in [
        (json!({"fail": "no cameras available"}), "rpicam-vid has ended (exit status: 255): no cameras available"),
        (json!({"fail": "\u{1b}[2Jgone\u{7}"}), "\\u001b[2Jgone\\u0007"),
        (json!({"frames": 0}), "rpicam-vid has ended (exit status: 0): it reports no error"),
        (crash, "has ended (signal: 6 (SIGABRT)"),
        (json!({"frames": 40, "half": true, "status": 3}), "has ended (exit status: 3)"),
        (json!({"stated": 240_002}), "a frame of rpicam-vid has 240002 bytes, expected 400x400 in YUV420"),
        (json!({"without": ["time"]}), "the metadata of rpicam-vid lack the SensorTimestamp"),
        (json!({"size": [400, 410]}), "expected 400x410 in YUV420"),
    ] {
        let done = with(&folder, &plan, &["run", "rpicam:"]);
        assert!(!says(&done, 1, &[expected]).contains('\u{1b}'), "{plan}");
    }
    let lost = json!({"last_lines": ["ERROR: *** \u{9b}lost ***"]});
    assert_has(&recorded(&folder, &lost), &["(exit status: 0): \\u009blost"]);
    let done = command(&folder, &json!({}), &["run", "rpicam:"]).env("PATH", folder.path("bin")).output().unwrap();
    says(&done, 1, &["sh: no such file"]);
    std::fs::remove_file(folder.0.join("bin/rpicam-vid")).unwrap();
    let done = with(&folder, &json!({}), &["run", "rpicam:"]);
    says(&done, 1, &["not installed; help: sudo apt install rpicam-apps"]);
}

#[test]
fn the_program_ends_with_ours() {
    let folder = camera("rpicam-ends");
    let signals = [Signal::INT, Signal::TERM, Signal::HUP, Signal::KILL];
    for (number, signal) in signals.iter().chain(&signals).enumerate() {
        let (has_frames, signal) = (number < signals.len(), *signal);
        let plan = if has_frames { json!({"loop": true}) } else { json!({"start_s": 1000}) };
        let (notes, number) = (folder.0.join("notes"), folder.0.join("process"));
        let _ = std::fs::remove_file(&number);
        let mut command = command(&folder, &plan, &["run", "rpicam:"]);
        let mut child = command.stderr(std::fs::File::create(&notes).unwrap()).spawn().unwrap();
        let started = Instant::now();
        let waited = |condition: &dyn Fn() -> bool| {
            while !condition() {
                assert!(started.elapsed() < Duration::from_mins(5), "{has_frames} {signal:?}");
                thread::sleep(Duration::from_millis(10));
            }
        };
        let process = || std::fs::read_to_string(&number).unwrap_or_default();
        waited(&|| process().ends_with('\n'));
        waited(&|| !has_frames || std::fs::read_to_string(&notes).unwrap().contains("imx219"));
        // The shell that ends it starts right behind it.
        let shell = format!("(sh) S {} ", child.id());
        waited(&|| {
            let mut all = std::fs::read_dir("/proc").unwrap().map(|entry| entry.unwrap().path().join("stat"));
            all.any(|stat| std::fs::read_to_string(stat).is_ok_and(|stat| stat.contains(&shell)))
        });
        send(&child, signal);
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(0).filter(|_| has_frames && signal != Signal::KILL));
        waited(&|| !Path::new(&format!("/proc/{}", process().trim())).exists());
    }
}
