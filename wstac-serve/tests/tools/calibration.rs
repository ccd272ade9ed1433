//! Calibrations that a page looks at and confirms.

use std::sync::{Arc, Mutex};

use serde_json::json;
use wstac_host::config::Config;
use wstac_host::source::{Frame, Source, SourceEvent};
use wstac_serve::{CalibrationFile, Tools};
use wstac_setup::calibrate::{Calibration, Watch};

use super::page::{LEAD_IN, Page, SCENE, Served, source};

/// The frame of the scene after which all whiskers have glowed.
const SEEN: u64 = LEAD_IN + 60;
/// The frame at which the calibrations here begin.
const BEGUN: u64 = 60;

/// Returns what `wstac calibrate` finds in the same frames.
fn calibration() -> Calibration {
    let mut source = source(SCENE);
    let mut watch = Watch::new(source.info()).unwrap();
    for number in 0..SEEN {
        let SourceEvent::Frame(Frame { bytes, .. }) = source.next_event().unwrap() else { panic!("no frame") };
        if number >= BEGUN {
            watch.take(bytes);
        }
    }
    watch.calibrate().result.unwrap()
}

/// Calibrates up to the proposal, and returns its number.
fn propose(served: &Served, page: &mut Page) -> u64 {
    served.allow(BEGUN);
    page.until_frame(BEGUN);
    page.order(&json!({"order": "calibrate"}));
    page.until("calibrating", |page| page.jobs["job"]["kind"] == "calibration");
    served.allow(SEEN);
    page.until_frame(SEEN);
    page.order(&json!({"order": "find"}));
    page.until("a proposal", |page| !page.jobs["job"]["proposal"].is_null());
    page.jobs["job"]["proposal"]["number"].as_u64().unwrap()
}

#[test]
fn a_confirmed_calibration_is_used_written_and_that_of_wstac_calibrate() {
    let written = Arc::new(Mutex::new(Vec::new()));
    let texts = Arc::clone(&written);
    let write = move |text: &str| {
        texts.lock().unwrap().push(text.to_owned());
        Ok(())
    };
    let file = CalibrationFile { name: "my.toml".to_owned(), write: Box::new(write) };
    let served = Served::new(None, &Config::default(), Tools { calibrate_to: Some(file), ..Tools::default() });
    let mut page = served.page();
    let number = propose(&served, &mut page);
    let expected = calibration();
    let proposal = page.jobs["job"]["proposal"].clone();
    assert_eq!(proposal["taxel"], json!(expected.layout.taxel()));
    assert_eq!(proposal["corners"], json!(expected.layout.corners()));
    assert_eq!(proposal["text"], expected.to_string());
    // Nothing changes before a person says so, and only for the calibration that is shown.
    assert!(page.jobs["layout"].is_null() && written.lock().unwrap().is_empty());
    let why = page.refusal(&json!({"order": "use", "proposal": number + 1}));
    assert!(why.contains("not the one that is shown"), "{why}");
    page.order(&json!({"order": "use", "proposal": number}));
    page.until("used", |page| page.jobs["layout"]["corners"] == json!(expected.layout.corners()));
    let text = page.jobs["calibrated"]["text"].as_str().unwrap();
    assert_eq!((text, &page.jobs["calibrated"]["toml"]), ("The new layout is used, and my.toml has it.", &json!(null)));
    let about = source(SCENE).info().about.clone();
    assert_eq!(*written.lock().unwrap(), [expected.to_toml(&about)]);
    // The sensor begins anew, and the numbers of its frames go on.
    assert_eq!((&page.status["phase"], &page.status["frame"]), (&json!("baseline"), &json!(SEEN)));
    // A page that comes later has the new layout from the start.
    let other = served.request("").map(drop);
    assert!(other.is_ok() && page.refusal(&json!({"order": "find"})).contains("no calibration in progress"));
    assert_eq!(served.end(), (0, vec!["wrote my.toml".to_owned()]));
}

#[test]
fn without_a_file_the_configuration_is_offered_with_what_was_set() {
    let config = Config::parse("[trigger]\nwindow = 6\n").unwrap();
    let served = Served::new(None, &config, Tools::default());
    let mut page = served.page();
    let number = propose(&served, &mut page);
    page.order(&json!({"order": "use", "proposal": number}));
    page.until("used", |page| !page.jobs["calibrated"].is_null());
    let toml = page.jobs["calibrated"]["toml"].as_str().unwrap();
    let offered = Config::parse(toml).unwrap();
    assert_eq!(offered.layout.explicit().unwrap().1, *calibration().layout.corners());
    assert_eq!(offered.trigger().unwrap().window(), 6, "{toml}");
}

#[test]
fn a_calibration_without_light_says_why_and_changes_nothing() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut page = served.page();
    page.order(&json!({"order": "calibrate"}));
    page.until("calibrating", |page| page.jobs["job"]["kind"] == "calibration");
    served.allow(LEAD_IN / 2);
    page.until_frame(LEAD_IN / 2);
    page.order(&json!({"order": "find"}));
    page.until("refused", |page| page.jobs["calibrated"]["is_error"] == true);
    let text = page.jobs["calibrated"]["text"].as_str().unwrap();
    assert!(text.contains("nothing glowed after the first 25 frames"), "{text}");
    assert!(page.jobs["job"].is_null() && page.jobs["layout"].is_null(), "{}", page.jobs);
}

/// A scene or a file may be over before somebody looks.
#[test]
fn a_calibration_can_be_confirmed_after_the_end_of_the_source() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut page = served.page();
    page.order(&json!({"order": "calibrate"}));
    page.until("calibrating", |page| page.jobs["job"]["kind"] == "calibration");
    served.allow(u64::MAX);
    page.until("over", |page| page.status["phase"] == "ended" && !page.jobs["job"]["proposal"].is_null());
    page.order(&json!({"order": "use", "proposal": 1}));
    page.until("used", |page| !page.jobs["calibrated"]["toml"].is_null());
    assert_eq!(page.status["phase"], "ended");
}
