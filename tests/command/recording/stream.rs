//! Tests that a camera's stream is recorded and read back with everything that a camera can deliver.

use std::fs::File;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_host::camera::{CameraState, LockedControl};
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::output::{Output, OutputOptions, StreamClock};
use wstac_host::record::Recorder;
use wstac_host::record::about::About;
use wstac_host::session::Processor;
use wstac_host::source::mcap::McapSource;
use wstac_host::source::{Fault, Frame, LossReason, Source, SourceEvent, Stamp, StreamInfo};
use wstac_tests::command::run;
use wstac_tests::folder::Folder;

/// A source event that does not borrow its source.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Owned {
    Frame(Vec<u8>, Option<Duration>, Option<u32>, Option<Vec<u8>>),
    Lost(u64, LossReason),
    Fault(Fault),
    End,
}

impl Owned {
    fn of(item: &SourceEvent<'_>) -> Self {
        match item {
            SourceEvent::Frame(Frame { bytes, timestamp, sequence, encoded, .. }) => {
                Self::Frame(bytes.to_vec(), *timestamp, *sequence, encoded.map(<[u8]>::to_vec))
            }
            SourceEvent::Lost { frames, reason } => Self::Lost(*frames, reason.clone()),
            SourceEvent::Fault(fault) => Self::Fault(fault.clone()),
            SourceEvent::End => Self::End,
            _ => panic!("not in these streams"),
        }
    }

    fn item(&self) -> SourceEvent<'_> {
        match self {
            Self::Frame(bytes, timestamp, sequence, encoded) => SourceEvent::Frame(Frame {
                timestamp: *timestamp,
                stamp: timestamp.map(wall),
                sequence: *sequence,
                encoded: encoded.as_deref(),
                ..Frame::new(bytes)
            }),
            Self::Lost(frames, reason) => SourceEvent::Lost { frames: *frames, reason: reason.clone() },
            Self::Fault(fault) => SourceEvent::Fault(fault.clone()),
            Self::End => SourceEvent::End,
        }
    }
}

/// Returns the wall-clock time of a driver's time: somebody sets the clock at 8003 s. Times from 100,000 s on are of a
/// machine that was started earlier.
pub(super) fn wall(timestamp: Duration) -> Stamp {
    let zero = match timestamp.as_secs() {
        0..8003 => 1_790_000_000,
        8003..100_000 => 1_790_000_010,
        _ => 1_780_000_000,
    };
    let time = SystemTime::UNIX_EPOCH + Duration::new(zero, 123_456_789) + timestamp;
    Stamp { time, within: Duration::from_micros(500) }
}

pub(super) fn info(format: PixelFormat, bytes_per_row: u32) -> StreamInfo {
    let control = |name: &str, locked| LockedControl {
        name: name.into(),
        id: 0x009a_0902,
        value: 157,
        locked,
        why: (!locked).then(|| "the driver refuses".into()),
    };
    let camera = CameraState {
        path: "/dev/video7".into(),
        links: vec!["/dev/v4l/by-id/usb-Maker_Camera_0001-video-index0".into()],
        card: "Camera".into(),
        driver: "uvcvideo".into(),
        bus: "usb-1".into(),
        format: "MJPG".into(),
        controls: vec![control("Exposure", true), control("Gain", false)],
    };
    let (size, rate) = (FrameSize::new(64, 48).unwrap(), FrameRate::new(30_000, 1001).unwrap());
    let mut info = StreamInfo::new("a camera", size, format, rate);
    info.bytes_per_row = bytes_per_row;
    info.camera = Some(Box::new(camera));
    info.clock = StreamClock::Driver;
    info
}

/// Records these events. Returns the file and the outputs meanwhile.
pub(super) fn record(folder: &Folder, info: &StreamInfo, items: &[Owned]) -> (PathBuf, Vec<Output>) {
    let (path, config) = (folder.0.join("a.mcap"), Config::default());
    let _ = std::fs::remove_file(&path);
    let mut processor =
        Processor::new(info, &config, OutputOptions { features: true, ..OutputOptions::default() }).unwrap();
    let about = About::new(info, &config, [("specimen".into(), "Saw3".into())].into(), Vec::new()).unwrap();
    let mut outputs = Vec::new();
    let mut recorder = Recorder::new(File::create_new(&path).unwrap(), &path, &about, &processor).unwrap();
    for item in items {
        let item = item.item();
        recorder.source_event(&item);
        processor
            .process(&item, |output| {
                recorder.output(&output, "");
                outputs.push(output);
                Ok::<(), Error>(())
            })
            .unwrap();
        assert!(recorder.processed(&item, &processor));
    }
    let written = recorder.finish().unwrap();
    assert_eq!(written.frames, items.iter().filter(|item| matches!(item, Owned::Frame(..))).count() as u64);
    assert_eq!(written.bytes, path.metadata().unwrap().len());
    (path, outputs)
}

/// Records these events. Returns the events that are read back, and the description of the recorded stream.
fn again(folder: &Folder, info: &StreamInfo, items: &[Owned]) -> (Vec<Owned>, StreamInfo) {
    let (path, _) = record(folder, info, items);
    let mut source = McapSource::open(&path, None).unwrap();
    assert_eq!(source.about().info.camera, info.camera);
    assert_eq!(source.about().labels["specimen"], "Saw3");
    let mut found = Vec::new();
    while found.last() != Some(&Owned::End) {
        found.push(Owned::of(&source.next_event().unwrap()));
    }
    (found, source.info().clone())
}

pub(super) fn fault(kind: &str, message: &str) -> Owned {
    Owned::Fault(Fault::from_text(kind.into(), message))
}

#[test]
fn a_camera_comes_again_with_its_times_gaps_and_faults() {
    let folder = Folder::new("recording-stream");
    // Rows with padding after them.
    let info = info(PixelFormat::Gray, 80);
    let mut items = vec![Owned::Lost(2, LossReason::Dropped), fault("slow", "7.5 frames per second \"only\"")];
    for frame in 0..200_u32 {
        let bytes: Vec<u8> = (0..80 * 48_u32).map(|at| (at * 7 + frame * 13) as u8).collect();
        // The counter wraps, and the clock goes back once.
        let time = 5_000_000_000 + u64::from(frame) * 33_366_667 - if frame == 90 { 2_000_000_000 } else { 0 };
        items.push(Owned::Frame(bytes, Some(Duration::from_nanos(time)), Some(frame.wrapping_sub(100)), None));
        match frame {
            30 | 31 => items.push(Owned::Lost(1, LossReason::Damaged)),
            60 => items.push(fault("disconnected", "cable")),
            61 => items.push(Owned::Lost(1_000_000_000_000, LossReason::Dropped)),
            62 => items.push(fault("reconnected", "é")),
            _ => {}
        }
    }
    items.push(Owned::End);
    let (found, said) = again(&folder, &info, &items);
    assert!(found == items, "the stream differs");
    let about = said.about.clone();
    assert!(about.ends_with("recorded from a camera, specimen=Saw3"), "{about}");
    let recorded = said.recorded.clone().expect("a recording says what it was made with");
    assert_eq!((recorded.labels["specimen"].as_str(), recorded.models.len()), ("Saw3", 0));
    assert!(recorded.configuration.contains("[trigger]"), "{}", recorded.configuration);
    let mut same = said;
    (same.about, same.recorded) = (info.about.clone(), None);
    assert_eq!(same, info);
}

/// Nothing that a recording says moves the cursor of a terminal or ends the program.
#[test]
fn words_and_counts_of_a_recording_are_harmless() {
    let folder = Folder::new("recording-harmless");
    let evil = "\u{1b}[31m\u{7}\u{9b}2J";
    let mut items = Vec::new();
    for frame in 0..40_u8 {
        items.push(Owned::Frame(vec![frame % 2; 64 * 48], None, None, None));
        if frame == 20 {
            items.extend([Owned::Lost(1, LossReason::from(evil)), fault(evil, evil)]);
        }
    }
    items.push(Owned::Lost(u64::MAX, LossReason::Dropped));
    items.extend([items[0].clone(), Owned::Lost(1, LossReason::Dropped), Owned::End]);
    assert!(again(&folder, &info(PixelFormat::Gray, 64), &items).0.len() == items.len());
    let (named, new) = (&*folder.path(&format!("{evil}.mcap")), &*folder.path("new"));
    std::fs::rename(folder.0.join("a.mcap"), named).unwrap();
    let shows = |c: char| c.is_control() && c != '\n';
    for arguments in [
        &["run", named][..],
        &["run", named, "--json"],
        &["doctor", named],
        &["doctor", named, "--json"],
        &["record", named, "-o", new],
        &["recover", named, "-o", new, "--force"],
    ] {
        let done = run(arguments);
        let all = String::from_utf8([done.stdout, done.stderr].concat()).unwrap();
        assert_eq!(done.status.code(), Some(0), "{arguments:?}: {all}");
        assert!(!all.contains(shows), "{arguments:?}: {all:?}");
    }
}

/// The exact bytes of the camera's JPEG are read back, and decode to the same picture.
#[test]
fn pictures_stay_as_the_camera_sent_them() {
    let folder = Folder::new("recording-jpeg");
    let info = info(PixelFormat::Rgb24, 192);
    let mut decoder = wstac_host::camera::mjpeg::Decoder::new(info.size);
    let mut items = Vec::new();
    for frame in 0..5_u32 {
        let rgb: Vec<u8> = (0..192 * 48_u32).map(|at| (at / 90 + 20 * frame) as u8).collect();
        let mut jpeg = Vec::new();
        let encoder = jpeg_encoder::Encoder::new(&mut jpeg, 85);
        encoder.encode(&rgb, 64, 48, jpeg_encoder::ColorType::Rgb).unwrap();
        // Drivers add padding.
        jpeg.extend([0; 100]);
        let bytes = decoder.decode(&jpeg).unwrap().to_vec();
        items.push(Owned::Frame(bytes, Some(Duration::from_millis(u64::from(frame))), Some(frame), Some(jpeg)));
    }
    items.push(Owned::End);
    assert!(again(&folder, &info, &items).0 == items, "the stream differs");
}
