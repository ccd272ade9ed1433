//! Tests that several sensors are recorded to one file, and that it is read like its sensors.

use std::path::Path;

use serde_json::Value;
use wstac_tests::command::{good, run};
use wstac_tests::folder::Folder;

/// Two scenes of 30 and 25 frames per second, whose frames share a time line.
const SCENES: [(&str, &str); 2] = [("left", "fps = 30"), ("right", "fps = 25")];

/// Writes the scenes, and records both to one file. Returns the sources and the file.
fn recorded(folder: &Folder) -> (Vec<String>, String) {
    let mut sources = Vec::new();
    for ((name, rate), slide) in SCENES.iter().zip([("Saw3", 150, 90), ("Tri3", 120, 0)]) {
        let (specimen, speed, direction) = slide;
        let file = folder.0.join(format!("{name}.toml"));
        let sensor = format!("[sensor]\nsize = [80, 80]\n{rate}\n");
        let slide = format!("specimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}\n");
        std::fs::write(&file, slide + &sensor).unwrap();
        sources.push(format!("cam:{name}=scene:{}", file.display()));
    }
    let file = folder.0.join("both.mcap").display().to_string();
    good(&["record", &sources[0], &sources[1], "-o", &file, "--label", "specimen=Saw3"]);
    (sources, file)
}

/// Returns what is said about wrong arguments.
fn said(arguments: &[&str]) -> String {
    let done = run(arguments);
    assert_eq!(done.status.code(), Some(2), "{arguments:?}");
    String::from_utf8(done.stderr).unwrap()
}

/// Returns the lines of a sensor.
fn of(lines: &str, name: &str) -> Vec<Value> {
    let lines = lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    lines.filter(|line| line["sensor"] == name).collect()
}

#[test]
fn frames_of_all_sensors_are_in_the_order_of_their_times() {
    let folder = Folder::new("recording-several-order");
    let (_, file) = recorded(&folder);
    let bytes = std::fs::read(&file).unwrap();
    let (mut times, mut topics) = (Vec::new(), std::collections::BTreeMap::<String, usize>::new());
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        *topics.entry(message.channel.topic.clone()).or_default() += 1;
        if message.channel.topic.ends_with("/camera") {
            times.push((message.log_time, message.channel.topic.clone()));
        }
    }
    // 30 and 25 frames per second: five and six frames between frames that are taken at the same time.
    let start: Vec<(u64, &str)> = times.iter().take(5).map(|(time, topic)| (*time / 1000, topic.as_str())).collect();
    let [left, right] = ["/left/camera", "/right/camera"];
    assert_eq!(start, [(0, left), (0, right), (33_333, left), (40_000, right), (66_666, left)]);
    assert!(times.is_sorted_by_key(|(time, _)| *time));
    for sensor in ["left", "right"] {
        let count = |topic: &str| topics.get(&format!("/{sensor}{topic}")).copied().unwrap_or(0);
        assert!(count("/camera") > 100 && count("/camera") == count("/features"), "{topics:?}");
        // An event, the end of its touch, and the end.
        assert_eq!(count("/events/json"), 3, "{topics:?}");
    }
    assert_eq!(topics["/sums/json"], times.len() + 2);
}

#[test]
fn each_sensor_replays_as_it_was_and_all_at_once() {
    let folder = Folder::new("recording-several");
    let (sources, file) = recorded(&folder);
    let live = good(&["run", &sources[0], &sources[1], "--json", "--features"]);
    let replayed = good(&["run", &file, "--json", "--features"]);
    for (name, source) in SCENES.map(|(name, _)| name).iter().zip(&sources) {
        let expected = of(&live, name);
        assert!(expected.iter().any(|line| line["kind"] == "event"), "{live}");
        assert_eq!(of(&replayed, name), expected);
        // A single sensor has the same records without the name.
        let alone = good(&["run", &file, "--sensor", name, "--json", "--features"]);
        let plain = source.split_once('=').unwrap().1;
        assert_eq!(alone, good(&["run", plain, "--json", "--features"]));
    }
    // In the order of their times, and so the same lines every time.
    let times: Vec<_> = replayed.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()).collect();
    let features = times.iter().filter(|line| line["kind"] == "features");
    let times: Vec<_> = features.map(|line| line["time_ns"].as_u64().unwrap()).collect();
    let frame = 1_000_000_000 / 20;
    assert!(times.windows(2).all(|pair| pair[1] + frame >= pair[0]), "{times:?}");
    assert_eq!(good(&["run", &file, "--json", "--features"]), replayed);
    let whole = folder.0.join("whole.mcap");
    good(&["recover", &file, "-o", whole.to_str().unwrap()]);
    assert_eq!(of(&good(&["run", whole.to_str().unwrap(), "--json"]), "right").len(), 3);
}

/// A recording that was cut off keeps every frame that was written, of all sensors.
#[test]
fn a_recording_that_was_cut_off_is_recovered() {
    let folder = Folder::new("recording-several-cut");
    let (_, file) = recorded(&folder);
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    let cut = run(&["run", &file]);
    assert_eq!(cut.status.code(), Some(1));
    assert!(String::from_utf8(cut.stderr).unwrap().contains("was not finished"));
    let whole = folder.0.join("whole.mcap");
    let whole = whole.to_str().unwrap();
    good(&["recover", &file, "-o", whole]);
    let lines = good(&["run", whole, "--json"]);
    let frames = SCENES.map(|(name, _)| of(&lines, name).last().unwrap()["frames"].as_u64().unwrap());
    assert!(frames.iter().all(|frames| (40..100).contains(frames)), "{frames:?}");
    // The same time has passed.
    assert!((frames[0] as f64 / 30.0 - frames[1] as f64 / 25.0).abs() < 0.05, "{frames:?}");
}

#[test]
fn where_one_sensor_is_needed_the_error_names_the_option() {
    let folder = Folder::new("recording-several-errors");
    let (sources, file) = recorded(&folder);
    let figure = folder.0.join("a.svg").display().to_string();
    let plot = ["plot", &file, "-o", &figure];
    let expected = "has the sensors left, right, expected one of them: --sensor left";
    assert!(said(&plot).contains(expected), "{}", said(&plot));
    good(&[&plot[..], &["--sensor", "right"]].concat());
    assert!(Path::new(&figure).exists());
    let wrong = said(&["run", &file, "--sensor", "middle"]);
    assert!(wrong.contains("has no sensor \"middle\", expected one of left, right"), "{wrong}");
    let empty = said(&["run", &file, "--sensor", ""]);
    assert!(empty.contains("has no sensor \"\", expected one of left, right"), "{empty}");
    let plain = said(&["run", "scene:Saw3@150", "--sensor", "left"]);
    assert!(plain.contains("sensor is \"left\", expected only with a recording of several sensors"), "{plain}");
    let missing = run(&["run", "missing.mcap", "--sensor", "left"]);
    assert_eq!(missing.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("no such file"), "{missing:?}");
    let again = folder.0.join("b.mcap").display().to_string();
    let unnamed = said(&["record", &sources[0], "scene:Saw3@150", "-o", &again]);
    assert!(unnamed.contains("expected a name for each"), "{unnamed}");
    assert!(!Path::new(&again).exists());
}

#[test]
fn a_data_set_has_the_samples_of_all_sensors() {
    let folder = Folder::new("recording-several-set");
    let both = folder.0.join("both.mcap").display().to_string();
    let set = folder.0.join("set.npz").display().to_string();
    let sources = ["cam:left=scene:Saw3@150", "cam:right=scene:Saw3@120"];
    good(&[&["record"], &sources[..], &["-o", &both, "--label", "specimen=Saw3"]].concat());
    let done = run(&["dataset", &both, "-o", &set]);
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(said.contains("set.npz: 2 samples of 2 recordings"), "{said}");
    // Shards have the same ones.
    let shards = ["1/2", "2/2"].map(|shard| {
        let file = folder.0.join(shard.replace('/', "-")).display().to_string();
        good(&["dataset", &both, "--shard", shard, "-o", &file]);
        file
    });
    let merged = folder.0.join("merged.npz").display().to_string();
    good(&["dataset", "merge", &shards[0], &shards[1], "-o", &merged]);
    assert!(std::fs::read(&set).unwrap() == std::fs::read(&merged).unwrap());
}

#[test]
fn sensors_whose_rates_differ_are_no_data_set() {
    let folder = Folder::new("recording-several-rates");
    let (_, file) = recorded(&folder);
    let set = folder.0.join("set.npz").display().to_string();
    let done = run(&["dataset", &file, "-o", &set]);
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(said.contains("both.mcap:right: its rate of frames differs from that of"), "{said}");
}
