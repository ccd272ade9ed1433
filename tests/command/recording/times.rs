//! Tests that recordings keep the times of frames, and that messages have the times of what they are about.

use std::path::Path;
use std::time::Duration;

use serde_json::Value;
use wstac_core::green::any::PixelFormat;
use wstac_host::json::{JsonLine, in_utc};
use wstac_host::output::{Output, StreamClock};
use wstac_host::source::{LossReason, StreamInfo};
use wstac_tests::command::good;
use wstac_tests::folder::Folder;

use super::stream::{Owned, fault, info, record, wall};

/// Returns when a frame was taken. The camera is slower than agreed on, and its frames come unevenly.
fn taken(frame: u64) -> u64 {
    8_000_000_000_000 + frame * 40_000_000 + frame * frame % 7 * 1_000_000
}

/// Returns outputs as the lines of `wstac run --json`.
fn lines(outputs: &[Output]) -> Vec<String> {
    outputs.iter().filter_map(JsonLine::new).map(|line| serde_json::to_string(&line).unwrap()).collect()
}

/// A stripe moves over a sensor whose camera is slower than agreed on and whose frames come unevenly.
#[test]
fn records_have_the_drivers_times_now_and_when_they_are_replayed() {
    let folder = Folder::new("recording-times");
    let info = info(PixelFormat::Gray, 64);
    let mut items = vec![fault("slow", "a fault before the first frame")];
    for frame in 0..150_u64 {
        let x = frame.checked_sub(40).filter(|x| *x < 31);
        let row: Vec<u8> = (0..64).map(|at| if x.is_some_and(|x| at / 2 == x) { 200 } else { 1 }).collect();
        let time = Some(Duration::from_nanos(taken(frame)));
        items.push(match frame {
            60 => Owned::Lost(1, LossReason::Dropped),
            _ => Owned::Frame(row.repeat(48), time, Some(frame as u32), None),
        });
        if frame == 100 {
            items.push(fault("slow", "a fault"));
        }
    }
    items.push(Owned::End);
    let (path, outputs) = record(&folder, &info, &items);
    let (mut events, mut faults) = (0, Vec::new());
    for output in &outputs {
        match output {
            Output::Features(found) if found.frame == 60 => {
                assert_eq!(found.time_ns, Some(u64::midpoint(taken(59), taken(61))));
            }
            Output::Features(found) => assert_eq!(found.time_ns, Some(taken(found.frame))),
            Output::Event(event) => {
                events += 1;
                let touch = event.touch_frame.unwrap();
                assert!((40..50).contains(&touch), "{event:?}");
                assert_eq!((event.time_ns, event.completed_ns), (Some(taken(touch)), Some(taken(event.frame + 69))));
                let since_start = (taken(touch) - taken(0)) as f64 / 1e9;
                assert!((event.time.unwrap().touch_s - since_start).abs() < 1e-9, "{event:?}");
            }
            Output::ContactEnd(end) => assert_eq!(end.time_ns, Some(taken(end.frame))),
            Output::Fault(fault) => faults.push(fault.time_ns),
            Output::End(end) => assert_eq!((end.clock, end.time_ns), (StreamClock::Driver, Some(taken(149)))),
            _ => {}
        }
    }
    assert_eq!((events, faults), (1, vec![None, Some(taken(100) + 1001 * 1_000_000 / 30)]));
    // A recording has its own times, at whatever rate it is replayed.
    let replayed = good(&["run", path.to_str().unwrap(), "--json", "--features"]);
    assert_eq!(replayed.lines().collect::<Vec<_>>(), lines(&outputs));
    let faster = good(&["run", path.to_str().unwrap(), "--json", "--features", "--fps", "32"]);
    assert_eq!(times(&faster), times(&replayed));
}

/// Returns the times of the features among these lines of JSON.
fn times(lines: &str) -> Vec<u64> {
    let lines = lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let times: Vec<_> = lines.filter(|line| line["kind"] == "features" && line["frame"] != 60).collect();
    assert_eq!(times.len(), 149);
    times.iter().map(|line| line["time_ns"].as_u64().unwrap()).collect()
}

/// Returns the outputs of a slide of 150 frames, the file that it was recorded to, and its messages: topic, log time,
/// publish time and content.
fn messages(folder: &Folder, info: &StreamInfo, times: bool) -> (Vec<Output>, String, Vec<Message>) {
    let frame = |frame: u64| {
        let row = |at: u64| if frame.checked_sub(40).is_some_and(|x| x < 31 && at / 2 == x) { 200 } else { 1 };
        let row: Vec<u8> = (0..64).map(row).collect();
        Owned::Frame(row.repeat(48), times.then(|| Duration::from_nanos(taken(frame))), None, None)
    };
    let items: Vec<Owned> = (0..150).map(frame).chain([Owned::End]).collect();
    let (path, outputs) = record(folder, info, &items);
    let messages = read(&path);
    (outputs, path.to_str().unwrap().to_owned(), messages)
}

/// A message of a recording.
struct Message {
    topic: String,
    log_ns: u64,
    publish_ns: u64,
    data: Vec<u8>,
}

impl Message {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.data).unwrap()
    }
}

/// Reads a recording as any program with the library of MCAP does, in the order of the file.
fn read(path: &Path) -> Vec<Message> {
    let file = std::fs::read(path).unwrap();
    let message = |message: mcap::Message<'_>| Message {
        topic: message.channel.topic.clone(),
        log_ns: message.log_time,
        publish_ns: message.publish_time,
        data: message.data.into_owned(),
    };
    mcap::MessageStream::new(&file).unwrap().map(|found| message(found.unwrap())).collect()
}

/// Viewers place an event at its first touch, and everything of a frame at the frame.
#[test]
fn messages_have_the_times_of_what_they_are_about() {
    let folder = Folder::new("recording-messages");
    for times in [true, false] {
        let mut info = info(PixelFormat::Gray, 64);
        info.clock = if times { StreamClock::Driver } else { StreamClock::Frames };
        let (outputs, path, messages) = messages(&folder, &info, times);
        let expected = |frame: u64| if times { taken(frame) } else { frame * 1_001_000_000 / 30 };
        for topic in ["/camera", "/taxels", "/features"] {
            let found = messages.iter().filter(|message| message.topic == topic).map(|message| message.log_ns);
            assert_eq!(found.collect::<Vec<_>>(), (0..150).map(expected).collect::<Vec<_>>(), "{topic}");
        }
        assert!(messages.iter().all(|message| message.log_ns == message.publish_ns));
        let of_records: Vec<_> = messages.iter().filter(|message| message.topic == "/events/json").collect();
        let kinds: Vec<_> = of_records.iter().map(|message| message.json()["kind"].clone()).collect();
        assert_eq!(kinds, ["event", "contact_end", "end"]);
        for message in &of_records {
            assert_eq!(message.json()["time_ns"], message.log_ns, "{}", message.json());
        }
        let event = of_records[0].json();
        assert_eq!(event["time_ns"], expected(event["touch_frame"].as_u64().unwrap()));
        assert_eq!(event["completed_ns"], expected(event["frame"].as_u64().unwrap() + 69));
        let in_words = messages.iter().filter(|message| message.topic == "/events").map(|message| message.log_ns);
        assert_eq!(in_words.collect::<Vec<_>>(), of_records.iter().map(|message| message.log_ns).collect::<Vec<_>>());
        // The wall clock is there once, and again after it was set.
        let clock = messages.iter().filter(|message| message.topic == "/clock/json").count();
        assert_eq!(clock, if times { 2 } else { 0 });
        // It replays as it was, stamps included.
        let replayed = good(&["run", &path, "--json", "--features"]);
        assert_eq!(replayed.lines().collect::<Vec<_>>(), lines(&outputs));
        let Some(Output::End(end)) = outputs.last() else { panic!("an end") };
        assert_eq!((end.clock, end.time_ns, end.stamp.is_some()), (info.clock, Some(expected(149)), times));
        let stamp = |frame: u64| times.then(|| wall(Duration::from_nanos(taken(frame))));
        for output in &outputs {
            assert!(!matches!(output, Output::Features(found) if found.stamp != stamp(found.frame)), "{output:?}");
        }
        let first: Value = serde_json::from_str(replayed.lines().next().unwrap()).unwrap();
        let (time, within) = (stamp(0).map_or(Value::Null, |stamp| in_utc(stamp.time).into()), times.then_some(0.5));
        assert_eq!((&first["stamp"], first["stamp_within_ms"].as_f64()), (&time, within));
    }
}
