//! A file or a scene that pages pause, go back and forth in, and that starts again at its end.

use serde_json::{Value, json};
use tempfile::tempdir;
use wstac_host::config::Config;
use wstac_serve::Tools;

use super::page::{Page, Served};

/// More frames than the scene has.
const ALL: u64 = 10_000;

fn seek(page: &mut Page, frames: i64) {
    page.order(&json!({"order": "seek", "frames": frames, "pause": false}));
}

fn until_ended(page: &mut Page) {
    page.until("the end", |page| page.status["phase"] == "ended");
}

/// Returns what the page shows of a frame, and which events it lists.
fn shown(page: &Page) -> Value {
    let status = &page.status;
    let events: Vec<_> = page.records.iter().filter(|record| record["kind"] == "event").collect();
    json!([status["frame"], status["phase"], status["taxels"], status["thresholds"], events])
}

fn until_shown(page: &mut Page, frame: u64) -> Value {
    page.until("the frame", |page| page.status["frame"] == frame);
    shown(page)
}

/// Steps and seeks show what was there when the frames came for the first time.
#[test]
fn a_frame_that_is_gone_back_to_looks_as_it_did() {
    let served = Served::film(false, Tools::default());
    let mut page = served.page();
    assert_eq!(page.about["seeks"], true);
    let mut before = Vec::new();
    for frame in [90, 130, 180] {
        served.allow(frame);
        before.push((frame, until_shown(&mut page, frame)));
    }
    served.allow(ALL);
    until_ended(&mut page);
    let all = page.status["frame"].as_u64().unwrap();
    let events = shown(&page)[4].clone();
    assert_eq!(events.as_array().unwrap().len(), 1, "{events}");
    let mut at = all;
    for (frame, before) in before.iter().rev() {
        page.order(&json!({"order": "seek", "frames": *frame as i64 - at as i64, "pause": true}));
        assert_eq!(until_shown(&mut page, *frame), *before);
        assert_eq!(page.status["paused"], true);
        at = *frame;
    }
    // Another page that comes now sees the same.
    let mut other = served.page();
    assert_eq!(until_shown(&mut other, at), before[0].1);
    page.order(&json!({"order": "seek", "frames": 1, "pause": true}));
    page.order(&json!({"order": "play", "on": false}));
    until_shown(&mut page, at + 1);
    seek(&mut page, -1_000_000_000);
    until_shown(&mut page, 1);
    page.order(&json!({"order": "play", "on": true}));
    until_ended(&mut page);
    assert_eq!(shown(&page)[4], events);
    assert_eq!(
        page.refusal(&json!({"order": "seek", "frames": 5, "pause": false})),
        "the source has ended; help: go back, or play it again"
    );
    assert_eq!(served.end().0, 0);
}

#[test]
fn a_loop_keeps_the_events_of_its_rounds() {
    let served = Served::film(true, Tools::default());
    let mut page = served.page();
    let rounds = |page: &Page| page.status["starts"].as_u64().unwrap() - page.status["backs"].as_u64().unwrap();
    let events = |page: &Page| shown(page)[4].as_array().unwrap().len() as u64;
    served.allow(ALL);
    for starts in 1..=3 {
        page.until("a start", |page| page.status["starts"].as_u64() >= Some(starts));
        assert_eq!((&page.status["loops"], page.status["phase"] == "ended"), (&json!(true), false));
    }
    page.order(&json!({"order": "loop", "on": false}));
    until_ended(&mut page);
    let once = rounds(&page) + 1;
    assert_eq!((events(&page), &page.status["loops"]), (once, &json!(false)));
    // A page that comes later has them, too.
    let mut other = served.page();
    until_ended(&mut other);
    assert_eq!(other.records, page.records);
    page.order(&json!({"order": "play", "on": true}));
    page.until("one more round", |page| rounds(page) == once);
    until_ended(&mut page);
    assert_eq!(events(&page), once + 1);
    // Switched on at the end, it goes on at once. A way back is one in the last round.
    served.allow(50);
    page.order(&json!({"order": "loop", "on": true}));
    page.until("a loop", |page| rounds(page) == once + 1 && page.status["loops"] == true);
    page.until_frame(50);
    served.allow(ALL);
    page.until("its event", |page| events(page) >= once + 2);
    page.order(&json!({"order": "loop", "on": false}));
    until_ended(&mut page);
    let all = events(&page);
    served.allow(1);
    seek(&mut page, -1_000_000_000);
    until_shown(&mut page, 1);
    assert_eq!((events(&page), &page.status["backs"]), (all - 1, &json!(1)));
    let mut other = served.page();
    until_shown(&mut other, 1);
    assert_eq!(other.records, page.records);
    assert_eq!(served.end().0, 0);
}

#[test]
fn what_can_be_read_once_or_is_recorded_has_no_way_back() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut page = served.page();
    assert_eq!(page.about["seeks"], false);
    for order in [json!({"order": "seek", "frames": -1, "pause": false}), json!({"order": "play", "on": false})] {
        assert_eq!(page.refusal(&order), "this source can be read once, expected a file or a scene");
    }
    let folder = tempdir().unwrap();
    let served = Served::film(false, Tools { record_to: Some(folder.path().to_owned()), ..Tools::default() });
    let mut page = served.page();
    served.allow(50);
    page.until_frame(50);
    page.record(&json!({}));
    let why = page.refusal(&json!({"order": "seek", "frames": -1, "pause": true}));
    assert_eq!(why, "a recording is in progress; end it first");
    assert_eq!((&page.status["frame"], &page.status["paused"]), (&json!(50), &json!(false)));
    served.allow(60);
    page.until_frame(60);
    page.stop();
    seek(&mut page, -20);
    until_shown(&mut page, 60);
}
