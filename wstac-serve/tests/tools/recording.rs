//! Recordings that a page starts and ends.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use tempfile::{TempDir, tempdir};
use wstac_host::config::Config;
use wstac_host::json::JsonLine;
use wstac_host::output::Output;
use wstac_host::session::Session;
use wstac_host::source::Source as _;
use wstac_host::source::mcap::McapSource;
use wstac_serve::Tools;

use super::page::{LEAD_IN, Page, Served};

/// A frame of the scene after its event.
const AFTER: u64 = LEAD_IN + 90;

fn served(name: Option<&str>) -> (TempDir, Served) {
    let folder = tempdir().unwrap();
    let tools = Tools { record_to: Some(folder.path().to_owned()), ..Tools::default() };
    let served = Served::new(name, &Config::default(), tools);
    (folder, served)
}

/// Returns the records of a recording as `wstac run --json` prints them.
fn replayed(path: &Path) -> Vec<Value> {
    let outputs = Session::open(path).unwrap().map(|output| output.unwrap());
    outputs.filter_map(|output| JsonLine::new(&output).map(|line| serde_json::to_value(line).unwrap())).collect()
}

fn labels(path: &Path) -> Value {
    let source = McapSource::open(path, None).unwrap();
    serde_json::to_value(&source.info().recorded.as_ref().unwrap().labels).unwrap()
}

fn events(records: &[Value]) -> Vec<&Value> {
    records.iter().filter(|record| record["kind"] == "event").collect()
}

/// The first frame of recordings of the slide, at 1.4 s. Times of other frames are rounded in another way when they are
/// counted from there.
const FIRST: u64 = 42;

/// Records the scene's slide.
fn record_slide(served: &Served, page: &mut Page, labels: &Value) {
    served.allow(FIRST);
    page.until_frame(FIRST);
    page.record(labels);
    served.allow(AFTER);
    page.until_frame(AFTER);
    page.stop();
}

#[test]
fn a_recording_has_its_labels_and_gives_the_same_event_again() {
    let (folder, served) = served(None);
    let mut page = served.page();
    let given = json!({"specimen": " Saw3 ", "speed": "150", "direction": "90"});
    record_slide(&served, &mut page, &given);
    let path = folder.path().join("wstac-1.mcap");
    assert_eq!(labels(&path), json!({"specimen": "Saw3", "speed": "150", "direction": "90"}));
    let line = format!("{}: {} frames, 1 event, ", path.display(), AFTER - FIRST);
    let text = page.jobs["recorded"]["text"].as_str().unwrap();
    assert!(text.starts_with(&line) && page.jobs["recorded"]["is_error"] == false, "{}", page.jobs);
    // Frames and times count from the recording's first frame there, and go on upon the page; nothing else differs.
    let replayed = replayed(&path);
    let (mut again, shown) = (events(&replayed)[0].clone(), events(&page.records)[0]);
    for name in ["frame", "touch_frame"] {
        again[name] = (again[name].as_u64().unwrap() + FIRST).into();
    }
    for name in ["time_ns", "completed_ns"] {
        again[name] = (again[name].as_u64().unwrap() + 1_400_000_000).into();
    }
    for name in ["time_s", "completed_s"] {
        let shift = shown[name].as_f64().unwrap() - again[name].as_f64().unwrap();
        assert!((shift - 1.4).abs() < 1e-6, "{shown}");
        again[name] = shown[name].clone();
    }
    assert_eq!((&again, events(&replayed).len()), (shown, 1));
    let (failures, told) = served.end();
    assert!(failures == 0 && told.len() == 1 && told[0].starts_with(&line), "{told:?}");
}

#[test]
fn no_recording_is_overwritten_and_a_named_sensor_labels_its_own() {
    let (folder, served) = served(Some("left"));
    let taken = folder.path().join("left-1.mcap");
    fs::write(&taken, "somebody's").unwrap();
    let mut page = served.page();
    record_slide(&served, &mut page, &json!({"specimen": ""}));
    page.record(&json!({}));
    page.stop();
    assert_eq!(fs::read(&taken).unwrap(), b"somebody's");
    assert_eq!(labels(&folder.path().join("left-2.mcap")), json!({"sensor": "left"}));
    assert!(McapSource::open(folder.path().join("left-3.mcap").as_path(), None).is_ok(), "one without frames");
    drop(served);
}

/// The end of the server, as by SIGINT, ends the file properly. A page that goes away changes nothing.
#[test]
fn a_recording_survives_its_page_and_the_end_of_the_server() {
    let (folder, served) = served(None);
    let mut page = served.page();
    page.record(&json!({"specimen": "Saw3"}));
    served.allow(50);
    page.until_frame(50);
    drop(page);
    served.allow(AFTER);
    let mut other = served.page();
    other.until("read", |page| page.jobs["job"]["frames"] == AFTER);
    let (failures, told) = served.end();
    assert!(failures == 0 && told[0].contains(&format!("{AFTER} frames, 1 event")), "{told:?}");
    let records = replayed(&folder.path().join("wstac-1.mcap"));
    assert_eq!(events(&records).len(), 1);
    assert!(records.iter().any(|record| record["kind"] == "end" && record["frames"] == AFTER), "{records:?}");
}

#[test]
fn the_end_of_the_source_ends_a_recording() {
    let (folder, served) = served(None);
    let mut page = served.page();
    page.record(&json!({}));
    served.allow(u64::MAX);
    page.until("over", |page| page.status["phase"] == "ended" && !page.jobs["recorded"].is_null());
    let all = page.status["frame"].as_u64().unwrap();
    let ends = |output: &Output| matches!(output, Output::End(end) if end.frames == all);
    let outputs: Vec<Output> = Session::open(folder.path().join("wstac-1.mcap")).unwrap().map(Result::unwrap).collect();
    assert!(outputs.last().is_some_and(ends), "{outputs:?}");
    assert!(page.refusal(&json!({"order": "record"})).contains("the source has ended"));
}

/// A recording that cannot start changes nothing: not the baseline, and no number or time of what follows.
#[test]
fn a_refused_recording_changes_nothing() {
    let (folder, served) = served(None);
    let mut page = served.page();
    served.allow(LEAD_IN - 2);
    page.until_frame(LEAD_IN - 2);
    let before = page.status.clone();
    folder.close().unwrap();
    let why = page.refusal(&json!({"order": "record"}));
    assert!(why.contains("wstac-1.mcap: no such file or folder"), "{why}");
    assert_eq!((page.status["phase"].as_str(), &page.status["thresholds"]), (Some("watching"), &before["thresholds"]));
    served.allow(AFTER);
    page.until("an event", |page| !events(&page.records).is_empty());
    let source = super::page::source(super::page::SCENE);
    let undisturbed = Session::builder(source).build().unwrap().map(Result::unwrap);
    let expected = undisturbed.filter(|output| matches!(output, Output::Event(_)));
    let expected: Vec<Value> =
        expected.map(|output| serde_json::to_value(JsonLine::new(&output).unwrap()).unwrap()).collect();
    assert_eq!(events(&page.records), expected.iter().collect::<Vec<_>>());
    assert_eq!(served.end().0, 0);
}

/// Whatever is recorded, the page's frames and times go on.
#[test]
fn the_times_of_the_page_go_on_through_recordings() {
    let (_folder, served) = served(None);
    let mut page = served.page();
    for frame in [30, 50] {
        served.allow(frame);
        page.until_frame(frame);
        page.record(&json!({}));
        page.stop();
    }
    served.allow(AFTER);
    page.until("an event", |page| !events(&page.records).is_empty());
    let event = events(&page.records)[0];
    let at = |name: &str| event[name].as_u64().unwrap();
    let expected = at("touch_frame") as f64 / 30.0;
    assert!((at("time_ns") as f64 / 1e9 - expected).abs() < 1e-6, "{event}");
    assert!((event["time_s"].as_f64().unwrap() - expected).abs() < 1e-3, "{event}");
    drop(served);
}
