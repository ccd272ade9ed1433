//! Tests that several sensors are recorded to one file, and that it is read like its sensors.

use std::fs::{self, File};
use std::path::Path;
use std::time::Duration;

use serde_json::Value;
use wstac_core::green::any::PixelFormat;
use wstac_host::config::Config;
use wstac_host::output::OutputOptions;
use wstac_host::record::about::About;
use wstac_host::record::{Compression, RecordedSensor, SharedRecording};
use wstac_host::session::Processor;
use wstac_host::source::mcap::McapSource;
use wstac_host::source::{LossReason, Source, StreamInfo};
use wstac_tests::command::{ends, good, prints, records};
use wstac_tests::folder::{Folder, SMALL};

use super::stream::{Owned, info, record};

/// Two scenes of 30 and 25 frames per second, whose frames share a time line.
const SCENES: [(&str, &str); 2] = [("left", "fps = 30"), ("right", "fps = 25")];

/// Writes the scenes, and records both to one file. Returns the sources and the file.
fn recorded(folder: &Folder) -> (Vec<String>, String) {
    let mut sources = Vec::new();
    for ((name, rate), slide) in SCENES.iter().zip([("Saw3", 150, 90), ("Tri3", 120, 0)]) {
        let (specimen, speed, direction) = slide;
        let sensor = format!("[sensor]\nsize = [40, 40]\n{rate}\n");
        let slide = format!("specimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}\n");
        sources.push(format!("cam:{name}={}", folder.scene(&format!("{name}.toml"), slide + &sensor)));
    }
    let file = folder.path("both.mcap");
    good(&["record", &sources[0], &sources[1], "-o", &file, "--label", "specimen=Saw3"]);
    (sources, file)
}

/// Returns the records of a sensor.
fn of<'a>(records: &'a [Value], name: &str) -> Vec<&'a Value> {
    records.iter().filter(|record| record["sensor"] == name).collect()
}

#[test]
fn frames_of_all_sensors_are_in_the_order_of_their_times() {
    let folder = Folder::new("recording-several-order");
    let (_, file) = recorded(&folder);
    let bytes = fs::read(&file).unwrap();
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
    let asked = ["--json", "--features", "--model", "builtin"];
    let live = records(&[&["run", &sources[0], &sources[1]], &asked[..]].concat());
    let replayed = records(&[&["run", &file], &asked[..]].concat());
    for (name, source) in SCENES.map(|(name, _)| name).iter().zip(&sources) {
        let expected = of(&live, name);
        assert!(expected.iter().any(|line| line["kind"] == "event"), "{live:?}");
        assert_eq!(of(&replayed, name), expected);
        // A single sensor has the same records without the name.
        let alone = good(&[&["run", &file, "--sensor", name], &asked[..]].concat());
        let plain = source.split_once('=').unwrap().1;
        assert_eq!(alone, good(&[&["run", plain], &asked[..]].concat()));
    }
    // In the order of their times, and so the same lines every time.
    let features = replayed.iter().filter(|line| line["kind"] == "features");
    let times: Vec<_> = features.map(|line| line["time_ns"].as_u64().unwrap()).collect();
    assert!(times.is_sorted(), "{times:?}");
    assert_eq!(records(&[&["run", &file], &asked[..]].concat()), replayed);
    let whole = &folder.path("whole.mcap");
    good(&["recover", &file, "-o", whole]);
    assert_eq!(of(&records(&["run", whole, "--json"]), "right").len(), 3);
}

/// Lost frames have times once the next frame has come. The other sensor waits for it.
#[test]
fn records_are_in_the_order_of_their_times_if_one_sensor_loses_frames() {
    let folder = Folder::new("recording-several-losses");
    let sources = [("left", 3, 0.75), ("right", 4, 0.0)].map(|(name, seed, dropped)| {
        let text = format!("seed = {seed}\n{SMALL}dropped = {dropped}\n");
        format!("cam:{name}={}", folder.scene(&format!("{name}.toml"), text))
    });
    let file = folder.path("both.mcap");
    good(&["record", &sources[0], &sources[1], "-o", &file]);
    let asked = ["--json", "--features", "--motion"];
    let lines = records(&[&["run", &file], &asked[..]].concat());
    let live = lines.iter().filter(|line| line["kind"] == "features" || line["kind"] == "motion");
    let times: Vec<_> = live.map(|line| (line["time_ns"].as_u64().unwrap(), line["sensor"].clone())).collect();
    let back = times.windows(2).filter(|pair| pair[1].0 < pair[0].0).collect::<Vec<_>>();
    assert!(back.is_empty() && times.len() > 160, "{back:?}");
    let lost = of(&lines, "left").last().unwrap()["dropped"].as_u64().unwrap();
    assert!(lost > 60 && of(&lines, "right").last().unwrap()["dropped"] == 0, "{lost}");
    for name in ["left", "right"] {
        let alone = good(&[&["run", &file, "--sensor", name], &asked[..]].concat());
        assert_eq!(of(&lines, name).len(), alone.lines().count());
    }
}

/// A recording that was cut off keeps every frame that was written, of all sensors.
#[test]
fn a_recording_that_was_cut_off_is_recovered() {
    let folder = Folder::new("recording-several-cut");
    let (_, file) = recorded(&folder);
    let bytes = fs::read(&file).unwrap();
    fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    ends(&["run", &file], 1, &["was not finished"]);
    let whole = &folder.path("whole.mcap");
    good(&["recover", &file, "-o", whole]);
    let lines = records(&["run", whole, "--json"]);
    let frames = SCENES.map(|(name, _)| of(&lines, name).last().unwrap()["frames"].as_u64().unwrap());
    assert!(frames.iter().all(|frames| (40..100).contains(frames)), "{frames:?}");
    // The same time has passed.
    assert!((frames[0] as f64 / 30.0 - frames[1] as f64 / 25.0).abs() < 0.05, "{frames:?}");
}

#[test]
fn where_one_sensor_is_needed_the_error_names_the_option() {
    let folder = Folder::new("recording-several-errors");
    let (sources, file) = recorded(&folder);
    let figure = folder.path("a.svg");
    let plot = ["plot", &file, "-o", &figure];
    let expected = "has the sensors left, right, expected one of them: --sensor left";
    ends(&plot, 2, &[expected]);
    good(&[&plot[..], &["--sensor", "right"]].concat());
    assert!(Path::new(&figure).exists());
    for name in ["middle", ""] {
        let expected = format!("has no sensor \"{name}\", expected one of left, right");
        ends(&["run", &file, "--sensor", name], 2, &[&expected]);
    }
    let expected = "sensor is \"left\", expected only with a recording of several sensors";
    ends(&["run", "scene:Saw3@150", "--sensor", "left"], 2, &[expected]);
    ends(&["run", "missing.mcap", "--sensor", "left"], 1, &["no such file"]);
    let again = folder.path("b.mcap");
    ends(&["record", &sources[0], "scene:Saw3@150", "-o", &again], 2, &["several sources need names"]);
    assert!(!Path::new(&again).exists());
    // A part of all of them, and one alone.
    good(&["record", &file, "-o", &again, "--frames", "40"]);
    prints(&["run", &again], &["left: end after 40 frames", "right: end after 40 frames"]);
    good(&["record", &format!("left={file}"), "-o", &folder.path("left.mcap")]);
    let picture = folder.path("both.png");
    let expected = "both.png: its name ends in .png, expected .mcap";
    ends(&["record", &sources[0], &sources[1], "-o", &picture], 2, &[expected]);
    assert!(!Path::new(&picture).exists());
}

#[test]
fn sensors_are_a_data_set_if_their_rates_are_equal() {
    let folder = Folder::new("recording-several-set");
    let (_, file) = recorded(&folder);
    let [both, set] = ["same.mcap", "set.npz"].map(|name| folder.path(name));
    ends(&["dataset", &file, "-o", &set], 1, &["both.mcap:right: its rate of frames differs from that of"]);
    let sources = ["cam:left=scene:Saw3@150", "cam:right=scene:Saw3@120", "--features-only", "--size", "40x40"];
    good(&[&["record"], &sources[..], &["-o", &both, "--label", "specimen=Saw3"]].concat());
    ends(&["dataset", &both, "-o", &set], 0, &["set.npz: 2 samples of 2 recordings"]);
}

/// Makes recordings of a camera that begin at these seconds of its driver's clock.
fn of_camera<const N: usize>(folder: &Folder, starts_s: [u64; N]) -> [String; N] {
    starts_s.map(|start| {
        let time = |frame: u64| Some(Duration::from_secs(start) + Duration::from_millis(33 * frame));
        let frames = (0..40).map(|frame| Owned::Frame(vec![1; 64 * 48], time(frame), Some(frame as u32), None));
        let items: Vec<_> = frames.chain([Owned::Lost(1, LossReason::Dropped), Owned::End]).collect();
        let (path, _) = record(folder, &info(PixelFormat::Gray, 64), &items);
        let named = folder.path(&format!("{start}.mcap"));
        fs::rename(path, &named).unwrap();
        named
    })
}

/// Times of the monotonic clock can be compared only as long as the machine runs.
#[test]
fn recordings_of_different_starts_of_a_machine_share_no_file() {
    let folder = Folder::new("recording-several-starts");
    // Somebody sets the wall clock by 10 s between the first two.
    let [first, later, other] = of_camera(&folder, [8000, 8010, 100_000]);
    let both = folder.path("both.mcap");
    let record = |right: &str| {
        ["record", &format!("cam:left={first}"), &format!("cam:right={right}"), "-o", &both].map(str::to_owned)
    };
    let wrong = record(&other);
    let expected = "both.mcap: the clocks of left and right started 10000000 s apart, expected recordings of one machine that was not";
    ends(&wrong.each_ref().map(String::as_str), 2, &[expected]);
    assert!(!Path::new(&both).exists());
    good(&record(&later).each_ref().map(String::as_str));
    let frames = |name| of(&records(&["run", &both, "--json"]), name).last().unwrap()["frames"].clone();
    assert_eq!(["left", "right"].map(frames), [41, 41]);
}

#[test]
fn a_recording_that_is_recorded_again_keeps_its_labels() {
    let folder = Folder::new("recording-again");
    let [one, both] = ["one.mcap", "both.mcap"].map(|name| folder.path(name));
    let labels = ["--label", "specimen=Saw3", "--label", "speed=150"];
    good(&[&["record", "scene:Saw3@150", "--size", "40x40", "--frames", "5", "-o", &one], &labels[..]].concat());
    good(&["record", &format!("left={one}"), &format!("right={one}"), "--label", "speed=100", "-o", &both]);
    for sensor in ["left", "right"] {
        ends(&["run", &both, "--sensor", sensor], 0, &["specimen=Saw3", "speed=100"]);
    }
}

#[test]
fn a_camera_and_a_recording_share_no_file() {
    let folder = Folder::new("recording-several-live");
    let [file] = of_camera(&folder, [8000]);
    let (live, config) = (info(PixelFormat::Gray, 64), Config::default());
    let recorded = McapSource::open(Path::new(&file), None).unwrap().info().clone();
    let path = folder.0.join("both.mcap");
    let start = |infos: [&StreamInfo; 2]| {
        let sensors = infos.map(|info| {
            let about = About::new(info, &config, [].into(), Vec::new()).unwrap();
            (about, Processor::new(info, &config, OutputOptions::default()).unwrap())
        });
        let named = ["left", "right"].iter().zip(&sensors);
        let sensors =
            named.map(|(name, (about, processor))| RecordedSensor { name, about, processor, wall_zero: None });
        let file = File::create_new(&path).unwrap();
        let started = SharedRecording::start(file, &path, &sensors.collect::<Vec<_>>(), Compression::None);
        started.map(drop).map_err(|error| error.to_string())
    };
    let error = start([&recorded, &live]).unwrap_err();
    let expected = "right is read now, and left was recorded, expected cameras together, or recordings together";
    assert!(error.ends_with(expected) && !path.exists(), "{error}");
    for infos in [[&live; 2], [&recorded; 2]] {
        start(infos).unwrap();
        fs::remove_file(&path).unwrap();
    }
}
