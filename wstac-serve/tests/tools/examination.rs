//! The doctor's advice on the page.

use std::sync::atomic::AtomicUsize;

use serde_json::json;
use wstac_host::config::Config;
use wstac_host::source::Source;
use wstac_serve::Tools;
use wstac_setup::doctor::measure::{Limit, measure};
use wstac_setup::doctor::{Known, examine};

use super::page::{LEAD_IN, SCENE, Served, source};

#[test]
fn the_advice_is_that_of_wstac_doctor() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut page = served.page();
    page.order(&json!({"order": "examine"}));
    page.until("examining", |page| page.jobs["job"]["kind"] == "examination");
    served.allow(u64::MAX);
    page.until("examined", |page| !page.jobs["examined"].is_null());
    // The slide comes within the ten seconds.
    let mut source = source(SCENE);
    let (info, config) = (source.info().clone(), Config::default());
    let limit = Limit { settling: 0, seconds: 10.0, frames: None };
    let measured = measure(&mut source, &info, &config, limit, &AtomicUsize::new(0)).unwrap();
    let report = examine(&info, &config, &measured, Known::default(), (None, Vec::new()), None).unwrap();
    assert_eq!(page.jobs["examined"]["text"], report.to_string());
    assert_eq!(page.jobs["examined"]["verdict"], serde_json::to_value(&report.verdict).unwrap());
    assert_eq!(page.jobs["examined"]["verdict"][0]["kind"], "touched");
}

#[test]
fn an_examination_can_be_ended_and_needs_enough_frames() {
    let served = Served::new(None, &Config::default(), Tools::default());
    let mut page = served.page();
    page.order(&json!({"order": "examine"}));
    page.until("examining", |page| page.jobs["job"]["kind"] == "examination");
    served.allow(30);
    page.until("on its way", |page| page.jobs["job"]["seconds"][0].as_f64() >= Some(0.9));
    page.stop();
    assert!(page.jobs["examined"].is_null(), "{}", page.jobs);
    // Of the rest of the scene, eight frames: too few.
    served.allow(LEAD_IN);
    page.until_frame(LEAD_IN);
    let mut all = 0;
    let mut scene = source(SCENE);
    while !matches!(scene.next_event().unwrap(), wstac_host::source::SourceEvent::End) {
        all += 1;
    }
    served.allow(all - 8);
    page.until_frame(all - 8);
    page.order(&json!({"order": "examine"}));
    page.until("examining", |page| page.jobs["job"]["kind"] == "examination");
    served.allow(u64::MAX);
    page.until("examined", |page| !page.jobs["examined"].is_null());
    let error = page.jobs["examined"]["error"].as_str().unwrap();
    assert!(error.contains("gave 8 frames, expected at least 10"), "{error}");
}
