use std::ffi::CStr;
use std::time::{Duration, SystemTime};

use wstac_host::config::Config;
use wstac_host::output::OutputOptions;
use wstac_host::session::{Poll, Session};
use wstac_host::source::{Frame, SourceEvent, Stamp};

use super::record::{Given, WstacKind};
use super::*;

fn said(handle: *const Wstac) -> String {
    // SAFETY: tests' handles are open, or null.
    let message = unsafe { CStr::from_ptr(wstac_error_message(handle)) };
    message.to_str().unwrap().to_owned()
}

/// A handle of frames of 10 × 10 GREY.
fn frames() -> *mut Wstac {
    opened(&described(10, 10, c"GREY", 0), ptr::null()).unwrap()
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
    let description = WstacFrames { fps_numerator: 25, fps_denominator: 1, ..described(10, 10, c"GREY", 0) };
    // SAFETY: the format is a string that stays.
    let info = unsafe { description.info() }.unwrap();
    let builder = Session::of_frames(info).config(Config::parse(config).unwrap());
    let mut session = builder.outputs(OutputOptions { samples: true, ..OutputOptions::default() }).build().unwrap();
    for number in 0..120 {
        let bytes = [if (40..60).contains(&number) { 200 } else { 3 }; 100];
        let time = SystemTime::UNIX_EPOCH + Duration::from_millis(1_000_000 + 40 * number);
        let stamp = Some(Stamp { time, within: Duration::from_micros(500) });
        session.push(&SourceEvent::Frame(Frame { stamp, ..Frame::new(&bytes) }));
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
    assert_eq!(text_of(record.stamp), text_of(event.stamp));
    // Pushed frames have no times: those between the touch and the last frame are sure to 2 % alone.
    let since_ms = (event.completed_s - event.touch_s) * 1000.0;
    let within = 0.5 + 0.02 * since_ms;
    assert!((record.stamp_within_ms - within).abs() < 2.0, "{} of {within}", record.stamp_within_ms);
    assert_eq!((record.time_ns, event.completed_ns), (1_600_000_000, (record.frame as i64 + 69) * 40_000_000));
    assert!(event.speed_sd_mm_s.is_nan() && event.direction_sd_deg.is_nan() && event.direction_confidence.is_nan());
    assert!(text_of(event.why_no_speed).is_some_and(|why| why.contains("press")));
    let end = next(&mut session, &mut given).unwrap();
    assert_eq!((end.kind, end.frame, end.event_frame), (WstacKind::ContactEnd, 60, record.frame));
    assert_eq!((end.time_s.to_bits(), end.time_ns), (2.4_f64.to_bits(), 2_400_000_000));
    assert_eq!(text_of(end.stamp).as_deref(), Some("1970-01-01T00:16:42.400Z"));
    assert!(next(&mut session, &mut given).is_none());
}

#[test]
fn a_board_is_a_source() {
    let board = concat!(env!("CARGO_MANIFEST_DIR"), "/../wstac-host/examples/board.bin");
    // SAFETY: null is the default.
    let options = unsafe { options::read(ptr::null()) }.ok().unwrap();
    let mut sensor = SensorSession::open(board.as_ref(), &options).ok().unwrap();
    let mut next = || sensor.next().ok().map(|(record, _)| record);
    assert!(std::iter::from_fn(&mut next).any(|record| record.kind == WstacKind::Event));
    // Records that wait come before the end, whose frames are those that the board has sent.
    sensor.finish().ok().unwrap();
    let last = std::iter::from_fn(|| sensor.next().ok().map(|(record, _)| record)).last().unwrap();
    assert!(last.kind == WstacKind::End && last.end.baseline_complete && last.frame >= 105, "{}", last.frame);
}

#[test]
fn a_law_of_durations_has_neither_times_nor_ends() {
    let (mut session, mut given) = (pressed("[speed]\nlaw = \"published\""), Given::default());
    let record = next(&mut session, &mut given).unwrap();
    let event = &record.event;
    assert_eq!((record.kind, event.touch_frame, event.end_frame), (WstacKind::Event, -1, -1));
    assert!(event.contact.is_null() && event.stamp.is_null());
    // Its time is that of the sample's first frame.
    assert_eq!(record.time_ns, record.frame as i64 * 40_000_000);
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

/// Frames of this size, row length and format.
fn described(width: u32, height: u32, format: &CStr, bytes_per_row: u32) -> WstacFrames {
    let (fps_numerator, fps_denominator, bt709, full_range) = (0, 0, 0, 0);
    let format = format.as_ptr();
    WstacFrames { width, height, format, bytes_per_row, fps_numerator, fps_denominator, bt709, full_range }
}

fn opened(frames: &WstacFrames, options: *const WstacOptions) -> Result<*mut Wstac, (WstacStatus, String)> {
    let mut handle = ptr::null_mut();
    // SAFETY: all are there.
    let status = unsafe { wstac_open_frames(frames, options, &raw mut handle) };
    if status == WstacStatus::Ok { Ok(handle) } else { Err((status, said(ptr::null()))) }
}

/// Whatever the length of a row is, a frame is taken if it has all its bytes, and refused if one is missing. The bytes
/// are in a buffer of exactly that length, so that the checks of the tests' allocator see a byte too far.
#[test]
fn a_frame_is_read_within_its_length_whatever_its_rows_are() {
    let mut taken = 0;
    for format in
        [c"GREY", c"Y10 ", c"Y16 ", c"RGB3", c"XR24", c"RGBP", c"RGGB", c"BA10", c"YUYV", c"NV12", c"YU12", c"422P"]
    {
        for (width, height) in [(10, 10), (11, 13), (16, 12)] {
            for bytes_per_row in [0, 1, 9, 10, 11, 20, 21, 31, 44, 45, 64, 4097, 1 << 20, u32::MAX] {
                let frames = described(width, height, format, bytes_per_row);
                let handle = match opened(&frames, ptr::null()) {
                    Ok(handle) => handle,
                    Err((status, message)) => {
                        // What describes the frames is no configuration; a layout that does not fit them is one.
                        let is_of_frames = message.contains("bytes_per_row") && status == WstacStatus::Option;
                        assert!(is_of_frames || status == WstacStatus::Config, "{status:?}: {message}");
                        continue;
                    }
                };
                // SAFETY: the handle is open.
                let push = |bytes: &[u8]| unsafe { wstac_push_frame(handle, bytes.as_ptr(), bytes.len()) };
                assert_eq!(push(&[]), WstacStatus::Frame);
                let expected: usize = said(handle).rsplit(' ').next().unwrap().parse().unwrap();
                let rows = height as usize - 1;
                assert!(expected >= rows * bytes_per_row.max(width) as usize, "{format:?} {bytes_per_row}: {expected}");
                if expected < 1 << 24 {
                    let bytes = vec![7; expected].into_boxed_slice();
                    assert_eq!(push(&bytes), WstacStatus::Ok, "{}", said(handle));
                    assert_eq!(push(&bytes[..expected - 1]), WstacStatus::Frame);
                    // The rest of the last row and of a page of memory may follow, and no more.
                    let row = bytes_per_row.max(width) as usize;
                    assert_eq!(push(&vec![7; expected + row + 4096]), WstacStatus::Ok, "{}", said(handle));
                    assert_eq!(push(&vec![7; expected + 4 * row + 4097]), WstacStatus::Frame);
                    assert!(said(handle).ends_with("is it of another size?"), "{}", said(handle));
                    taken += 1;
                }
                // SAFETY: a length that no memory has is refused before a byte is read.
                let status = unsafe { wstac_push_frame(handle, [0].as_ptr(), usize::MAX) };
                assert_eq!(status, WstacStatus::Frame);
                // SAFETY: as above; it is not used again.
                unsafe { wstac_close(handle) };
            }
        }
    }
    assert!(taken > 100, "{taken}");
}

/// A program that only pushes is stopped before its records take all memory.
#[test]
fn records_that_nobody_takes_are_bounded() {
    let mut options = zeros();
    options.features = 1;
    let handle = opened(&described(10, 10, c"GREY", 0), &raw const options).unwrap();
    let bytes = [3; 100];
    // SAFETY: the handle is open.
    let push = || unsafe { wstac_push_frame(handle, bytes.as_ptr(), bytes.len()) };
    let taken = (0..5000).take_while(|_| push() == WstacStatus::Ok).count();
    assert!((1000..=record::WSTAC_MOST_RECORDS).contains(&taken), "{taken}");
    assert!(said(handle).contains("1024 records wait, expected wstac_next"), "{}", said(handle));
    // SAFETY: as above.
    assert_eq!(unsafe { wstac_push_lost(handle, 1) }, WstacStatus::State);
    let mut record = std::mem::MaybeUninit::uninit();
    // SAFETY: as above, and there is room for a record.
    assert_eq!(unsafe { wstac_next(handle, record.as_mut_ptr()) }, WstacStatus::Ok);
    assert_eq!(push(), WstacStatus::Ok);
    // The end is always taken.
    // SAFETY: as above.
    assert_eq!(unsafe { wstac_finish(handle) }, WstacStatus::Ok);
    // SAFETY: as above; it is not used again.
    unsafe { wstac_close(handle) };
}

fn zeros() -> WstacOptions {
    // SAFETY: zeros are the defaults of all fields.
    unsafe { std::mem::zeroed() }
}

#[test]
fn a_configuration_may_be_a_text() {
    let frames = described(400, 400, c"GREY", 0);
    let options = |text: &CStr| WstacOptions { config_text: text.as_ptr(), ..zeros() };
    let wrong = options(c"[trigger]\nwindow = 99\n");
    let (status, message) = opened(&frames, &raw const wrong).unwrap_err();
    assert!(status == WstacStatus::Config && message.contains("window"), "{message}");
    let stated = options(c"[sensor]\nreadout_ms = 7\n");
    let handle = opened(&frames, &raw const stated).unwrap();
    // SAFETY: the handle is open, and not used after it is closed.
    let readout_ms = unsafe { wstac_readout_ms(handle) };
    assert!((readout_ms - 7.0).abs() < 1e-3, "{readout_ms}");
    // SAFETY: as above.
    unsafe { wstac_close(handle) };
    let both = WstacOptions { config: c"my.toml".as_ptr(), ..options(c"") };
    let (status, message) = opened(&frames, &raw const both).unwrap_err();
    assert!(status == WstacStatus::Option && message.ends_with("both given: give one of them"), "{message}");
}

/// C programs can have any byte in a `bool`.
#[test]
fn a_choice_that_is_no_bool_is_refused() {
    for byte in [2, 0x80, 0xFF] {
        for field in 0..3 {
            let mut options = zeros();
            *[&mut options.features, &mut options.every_frame, &mut options.keep_controls][field] = byte;
            let (status, message) = opened(&described(10, 10, c"GREY", 0), &raw const options).unwrap_err();
            assert_eq!(status, WstacStatus::Option);
            assert!(message.ends_with(&format!(" is {byte}, expected 0 or 1")), "{message}");
        }
        for field in 0..2 {
            let mut frames = described(10, 10, c"GREY", 0);
            *[&mut frames.bt709, &mut frames.full_range][field] = byte;
            let (status, message) = opened(&frames, ptr::null()).unwrap_err();
            assert_eq!(status, WstacStatus::Option);
            assert!(message.contains(&format!(" is {byte}, expected 0 or 1")), "{message}");
        }
    }
}

/// A list of models without its null is not read without end.
#[test]
fn a_list_of_models_has_an_end() {
    let names = [c"builtin:svm".as_ptr(); 40];
    let options = WstacOptions { models: names.as_ptr(), ..zeros() };
    let (status, message) = opened(&described(10, 10, c"GREY", 0), &raw const options).unwrap_err();
    assert!(status == WstacStatus::Option && message.contains("more than 16 names"), "{message}");
}

/// A thread may call from the destructor of its own data, after the library's data of the thread are gone.
#[test]
fn a_call_at_the_end_of_a_thread_is_a_status() {
    struct Late;
    impl Drop for Late {
        fn drop(&mut self) {
            for _ in 0..2 {
                // SAFETY: null is a handle that is refused.
                let status = unsafe { wstac_push_lost(ptr::null_mut(), 1) };
                assert_eq!(status, WstacStatus::Null);
                assert!(!said(ptr::null()).is_empty());
            }
        }
    }
    thread_local!(static LATE: Late = const { Late });
    let thread = std::thread::spawn(|| {
        // The first one is dropped last.
        LATE.with(|_| ());
        // SAFETY: as above.
        unsafe { wstac_push_lost(ptr::null_mut(), 1) }
    });
    assert_eq!(thread.join().unwrap(), WstacStatus::Null);
}

/// Names of files need not be UTF-8.
#[test]
fn names_of_files_are_bytes() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let name = OsStr::from_bytes(b"wstac-caf\xe9.y4m");
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, [&b"YUV4MPEG2 W10 H10 F30:1 Cmono\nFRAME\n"[..], &[3; 100]].concat()).unwrap();
    let source = std::ffi::CString::new(path.as_os_str().as_bytes()).unwrap();
    let mut handle = ptr::null_mut();
    // SAFETY: all are there.
    let status = unsafe { wstac_open(source.as_ptr(), ptr::null(), &raw mut handle) };
    assert_eq!(status, WstacStatus::Ok, "{}", said(ptr::null()));
    // SAFETY: the handle is open, and not used again.
    unsafe { wstac_close(handle) };
    let missing = std::ffi::CString::new(&b"none-\xe9.wsm"[..]).unwrap();
    let names = [missing.as_ptr(), ptr::null()];
    let options = WstacOptions { models: names.as_ptr(), config: ptr::null(), ..zeros() };
    let (status, message) = opened(&described(10, 10, c"GREY", 0), &raw const options).unwrap_err();
    assert!(status == WstacStatus::Model && message.starts_with("none-\u{fffd}.wsm: no such file"), "{message}");
    let options = WstacOptions { config: missing.as_ptr(), ..zeros() };
    assert_eq!(opened(&described(10, 10, c"GREY", 0), &raw const options).unwrap_err().0, WstacStatus::Config);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn a_record_of_features_has_its_taxel_sums() {
    // Two camera frames make a feature frame. The last one lacks its second.
    let mut frames = described(10, 10, c"GREY", 0);
    (frames.fps_numerator, frames.fps_denominator) = (60, 1);
    let options = WstacOptions { features: 1, ..zeros() };
    let handle = opened(&frames, &raw const options).unwrap();
    for level in [3, 5, 20] {
        // SAFETY: the handle is open.
        assert_eq!(unsafe { wstac_push_frame(handle, [level; 100].as_ptr(), 100) }, WstacStatus::Ok);
    }
    // SAFETY: as above.
    assert_eq!(unsafe { wstac_push_lost(handle, 1) }, WstacStatus::Ok);
    for sum in [8, 40] {
        let mut record = std::mem::MaybeUninit::uninit();
        // SAFETY: the handle is open, and there is room for a record, which is read when it is there.
        let record = unsafe {
            assert_eq!(wstac_next(handle, record.as_mut_ptr()), WstacStatus::Ok);
            record.assume_init()
        };
        let pixels = record.taxel_sums[0] / sum;
        assert!(record.kind == WstacKind::Features && pixels > 0);
        assert_eq!(record.taxel_sums, [sum * pixels; 25]);
    }
    // SAFETY: the handle is open; it is not used again.
    unsafe { wstac_close(handle) };
}

/// A program that was built with another size of a structure cannot use the library. Whoever changes a size gives the
/// library another name: `INTERFACE` in `build.rs`, once per version.
#[test]
#[cfg(target_pointer_width = "64")]
fn structures_have_the_sizes_of_the_library_that_has_this_name() {
    let requests = [size_of::<WstacOptions>(), size_of::<WstacFrames>()];
    let records = [size_of::<WstacRecord>(), size_of::<record::WstacEvent>(), size_of::<record::WstacTexture>()];
    let found = (env!("WSTAC_INTERFACE"), requests, records, size_of::<record::WstacEnd>());
    assert_eq!(found, ("0.4", [64, 32], [568, 248, 48], 40));
}
