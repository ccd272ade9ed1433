use std::ffi::CStr;
use std::time::{Duration, SystemTime};

use wstac_host::config::Config;
use wstac_host::output::OutputOptions;
use wstac_host::session::{Poll, Session};
use wstac_host::source::{Frame, SourceEvent};

use super::record::{Given, WstacKind};
use super::*;

fn said(handle: *const Wstac) -> String {
    // SAFETY: tests' handles are open, or null.
    let message = unsafe { CStr::from_ptr(wstac_error_message(handle)) };
    message.to_str().unwrap().to_owned()
}

/// A handle of frames of 10 × 10 GREY.
fn frames() -> *mut Wstac {
    let description = WstacFrames {
        width: 10,
        height: 10,
        format: c"GREY".as_ptr(),
        bytes_per_row: 0,
        fps_numerator: 0,
        fps_denominator: 0,
        bt709: false,
        full_range: false,
    };
    let mut handle = ptr::null_mut();
    // SAFETY: all are there.
    let status = unsafe { wstac_open_frames(&raw const description, ptr::null(), &raw mut handle) };
    assert_eq!(status, WstacStatus::Ok, "{}", said(ptr::null()));
    handle
}

/// Returns the text that a record points to.
fn text_of(text: *const c_char) -> Option<String> {
    // SAFETY: null, or a text of the record that was given last.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }.to_str().unwrap().to_owned())
}

/// Returns the next record; `None` if there is none yet.
fn next(session: &mut Session, given: &mut Given) -> Option<WstacRecord> {
    match session.poll().unwrap() {
        Poll::Output(output) => given.record(output),
        _ => None,
    }
}

/// Returns a session of 10 × 10 GREY at 25 frames per second, after a press of 20 frames in front of a camera that
/// knows the time.
fn pressed(config: &str) -> Session {
    let description = WstacFrames {
        width: 10,
        height: 10,
        format: c"GREY".as_ptr(),
        bytes_per_row: 0,
        fps_numerator: 25,
        fps_denominator: 1,
        bt709: false,
        full_range: false,
    };
    // SAFETY: the format is a string that stays.
    let info = unsafe { description.info() }.unwrap();
    let builder = Session::of_frames(info).config(Config::parse(config).unwrap());
    let mut session = builder.outputs(OutputOptions { samples: true, ..OutputOptions::default() }).build().unwrap();
    for number in 0..120 {
        let bytes = [if (40..60).contains(&number) { 200 } else { 3 }; 100];
        let stamp = SystemTime::UNIX_EPOCH + Duration::from_millis(1_000_000 + 40 * number);
        session.push(&SourceEvent::Frame(Frame { stamp: Some(stamp), ..Frame::new(&bytes) }));
    }
    session
}

#[test]
fn an_event_has_the_times_of_its_touch_and_an_end() {
    let (mut session, mut given) = (pressed(""), Given::default());
    let record = next(&mut session, &mut given).unwrap();
    let event = &record.event;
    assert_eq!((record.kind, text_of(event.contact).as_deref()), (WstacKind::Event, Some("press")));
    assert_eq!((event.touch_frame, event.end_frame, event.duration_frames), (40, 60, 19));
    assert_eq!(event.touch_s.to_bits(), 1.6_f64.to_bits());
    // The sample's last frame, of 70.
    let completed_s = (record.frame + 69) as f64 * 0.04;
    assert!((event.completed_s - completed_s).abs() < 1e-9, "{}", event.completed_s);
    // 1000 s and the time of the first lit frame.
    assert_eq!(text_of(event.stamp).as_deref(), Some("1970-01-01T00:16:41.600Z"));
    assert!(event.speed_sd_mm_s.is_nan() && event.direction_sd_deg.is_nan() && event.direction_confidence.is_nan());
    assert!(text_of(event.why_no_speed).is_some_and(|why| why.contains("press")));
    let end = next(&mut session, &mut given).unwrap();
    assert_eq!((end.kind, end.frame, end.event_frame), (WstacKind::ContactEnd, 60, record.frame));
    assert_eq!(end.time_s.to_bits(), 2.4_f64.to_bits());
    assert!(next(&mut session, &mut given).is_none());
}

#[test]
fn a_law_of_durations_has_neither_times_nor_ends() {
    let (mut session, mut given) = (pressed("[speed]\nlaw = \"published\""), Given::default());
    let record = next(&mut session, &mut given).unwrap();
    let event = &record.event;
    assert_eq!((record.kind, event.touch_frame, event.end_frame), (WstacKind::Event, -1, -1));
    assert!(event.contact.is_null() && event.stamp.is_null());
    assert!(event.touch_s.is_nan() && event.completed_s.is_nan() && event.speed_sd_mm_s.is_nan());
    assert!((0.0..=1.0).contains(&event.direction_confidence) && event.direction_sd_deg.is_nan());
    assert!(next(&mut session, &mut given).is_none());
}

#[test]
fn a_panic_does_not_leave_and_ends_the_handle() {
    let handle = frames();
    // SAFETY: the handle is open.
    let status = unsafe { with(handle, |_| panic!("on purpose")) };
    assert_eq!(status, WstacStatus::Panic);
    assert!(said(handle).contains("can only be closed"), "{}", said(handle));
    // SAFETY: as above.
    assert_eq!(unsafe { wstac_push_lost(handle, 1) }, WstacStatus::Panic);
    // SAFETY: as above; it is not used again.
    unsafe { wstac_close(handle) };
}

#[test]
fn a_panic_while_opening_is_a_status() {
    let mut handle = ptr::null_mut();
    // SAFETY: the place is there.
    let status = unsafe { open(&raw mut handle, || panic!("on purpose")) };
    assert_eq!((status, handle.is_null()), (WstacStatus::Panic, true));
}

#[test]
fn statuses_have_texts() {
    let text = |status| {
        // SAFETY: texts stay.
        unsafe { CStr::from_ptr(wstac_error_text(status)) }.to_str().unwrap()
    };
    let texts: std::collections::HashSet<_> = (0..=9).map(text).collect();
    assert_eq!(texts.len(), 10);
    for unknown in [-1, 10, i32::MIN, i32::MAX] {
        assert_eq!(text(unknown), "no status of this library");
    }
}
