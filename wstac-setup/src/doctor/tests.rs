//! Numbers compared with the truth: simulated sensors of known noise, black level and leak, and synthetic streams.

use std::sync::atomic::AtomicUsize;
use std::time::Duration;

use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;

use super::measure::{Limit, SETTLING, measure};
use super::*;
use wstac_host::camera::CameraState;
use wstac_host::config::Config;
use wstac_host::output::{Output, OutputOptions};
use wstac_host::session::Processor;
use wstac_host::source::{Fault, Frame, LossReason, ReadoutTime, Source, SourceEvent, SummedFrame};
use wstac_scene::SceneConfig;
use wstac_scene::rng::Rng;
use wstac_scene::source::SceneSource;

static RUNNING: AtomicUsize = AtomicUsize::new(0);
const ALL: Limit = Limit { settling: 0, seconds: f64::INFINITY, frames: None };
const OF_A_CAMERA: Limit = Limit { settling: SETTLING, ..ALL };

/// Measures a source with the default configuration.
fn measured(source: &mut impl Source, limit: Limit) -> Result<(StreamInfo, Measured), Error> {
    let info = source.info().clone();
    let measured = measure(source, &info, &Config::default(), limit, &RUNNING)?;
    Ok((info, measured))
}

/// Returns a scene of 150 dark frames with as many rows and columns, and their measurement.
fn scene(side: u16, sensor: &str, leak: f64) -> (StreamInfo, Measured) {
    let toml = format!(
        "specimen = \"Fla0\"\nspeed = 200\nlead_in = 150\nseed = 5\nnoise = 1.0\n[light]\nleak = {leak}\n[sensor]\nsize = [{side}, {side}]\n{sensor}"
    );
    let mut source = SceneSource::new(&SceneConfig::from_toml("test", &toml).unwrap()).unwrap();
    let limit = Limit { frames: Some(source.truth()[0].start_frame()), ..ALL };
    measured(&mut source, limit).unwrap()
}

fn report(info: &StreamInfo, measured: &Measured, black: Option<f64>) -> Report {
    let known = Known { black, asked_fps: None };
    examine(info, &Config::default(), measured, known, (None, Vec::new()), None).unwrap()
}

fn kinds(report: &Report) -> Vec<&'static str> {
    report.verdict.iter().map(|finding| finding.kind).collect()
}

fn assert_near(what: &str, found: f64, truth: f64, tolerance: f64) {
    assert!((found - truth).abs() <= tolerance, "{what}: {found}, expected {truth} within {tolerance}");
}

#[test]
fn noise_black_level_and_leak_are_the_scenes() {
    // 25 500 electrons at full scale: 100 for each level. Leak adds 510 of them, read noise has a variance of 100² or
    // 40².
    for (format, read, leak, step) in [
        ("GREY", 100.0, 0.02, 1.0),
        ("GREY", 60.0, 0.0, 1.0),
        ("Y10", 100.0, 0.02, 255.0 / 1023.0),
        ("Y12", 40.0, 0.02, 255.0 / 4095.0),
        ("Y16", 100.0, 0.0, 255.0 / 65_535.0),
        ("RGGB", 100.0, 0.02, 1.0),
        ("RG10", 100.0, 0.02, 255.0 / 1023.0),
        ("RGB3", 100.0, 0.02, 1.0),
    ] {
        let (info, measured) =
            scene(400, &format!("format = \"{format}\"\nblack_level = 6.0\nread_noise = {read:?}"), leak);
        let told = report(&info, &measured, Some(6.0));
        let pixel = ((25_500.0 * leak + read * read) / 1e4 + step * step / 12.0_f64).sqrt();
        let green = if format.starts_with("RG") && format != "RGB3" { 1250.0_f64 } else { 2500.0 };
        let what = |name| format!("{format}, read noise {read}, leak {leak}: {name}");
        assert_near(&what("pixel noise"), told.noise.pixel.unwrap(), pixel, 0.03 * pixel);
        assert_near(&what("taxel noise"), told.noise.taxel, pixel / green.sqrt(), 0.15 * pixel / green.sqrt());
        assert_near(&what("mean"), told.levels.mean, 6.0 + 255.0 * leak, 0.02);
        assert_near(&what("leak"), told.levels.leak.unwrap(), 255.0 * leak, 0.02);
        assert_eq!(told.rate.frames, measured.moments.len() as u64);
        assert!(told.drift.minutes_to_trigger.is_none(), "{}: {:?}", what("drift"), told.drift);
        // Without a given value, the darkest pixels stand for black: those outside of taxels, which are rounded.
        let untold = report(&info, &measured, None);
        assert_near(&what("darkest"), untold.levels.black.unwrap(), 6.0 + 255.0 * leak, 0.5 * step + 0.02);
        assert!(!untold.levels.black_is_given);
    }
}

#[test]
fn color_formats_have_the_same_level() {
    // RGB565 has steps of four levels.
    for (format, tolerance) in [("YUYV", 1.0), ("NV12", 1.0), ("MJPG", 1.0), ("RGBP", 2.1)] {
        let (info, measured) =
            scene(200, &format!("format = \"{format}\"\nblack_level = 16.0\nread_noise = 100.0"), 0.02);
        let report = report(&info, &measured, Some(16.0));
        assert_near(format, report.levels.mean, 21.1, tolerance);
        assert_near(format, report.levels.saturated.unwrap(), 0.0, 0.0);
    }
}

#[test]
fn taxel_sums_alone_give_noise_and_levels() {
    let toml = "specimen = \"Fla0\"\nspeed = 200\nlead_in = 300\nnoise = 1.0\nfidelity = \"taxel\"\n[sensor]\nblack_level = 6.0\nread_noise = 100.0";
    let mut source = SceneSource::new(&SceneConfig::from_toml("test", toml).unwrap()).unwrap();
    let (info, measured) = measured(&mut source, Limit { frames: Some(300), ..ALL }).unwrap();
    let report = report(&info, &measured, Some(6.0));
    assert_eq!((report.noise.pixel, report.levels.saturated), (None, None));
    let truth = (1.0 + 1.0 / 12.0_f64).sqrt() / 90.0;
    assert_near("taxel noise", report.noise.taxel, truth, 0.15 * truth);
    assert_near("leak", report.levels.leak.unwrap(), 0.0, 0.02);
}

#[test]
fn saturation_and_clipped_black_are_shares_of_pixels() {
    let (info, measured) = scene(400, "format = \"GREY\"\nblack_level = 0.0\nread_noise = 0.0", 1.0);
    let full = report(&info, &measured, Some(0.0));
    let expected = Some(full.levels.saturated.unwrap().max(0.6));
    assert_eq!(full.levels.saturated, expected, "outside of taxels there is no noise");
    assert!(["saturated", "leak", "always_lit"].iter().all(|kind| kinds(&full).contains(kind)), "{full}");
    let (info, measured) = scene(400, "format = \"GREY\"\nblack_level = 0.0\nread_noise = 20.0", 0.0);
    let dark = report(&info, &measured, None);
    // A pixel of 0.2 levels of noise passes half a level once in 161 frames: 39 % of the pixels never do in 150.
    assert_near("clipped", dark.levels.clipped.unwrap(), 0.64 + 0.36 * 0.39, 0.03);
    assert!(kinds(&dark).contains(&"clipped"));
}

/// A stream of even pictures, with the events between them.
struct Played {
    info: StreamInfo,
    items: std::vec::IntoIter<Shown>,
    bytes: Vec<u8>,
    random: Rng,
    time: f64,
    sequence: u32,
    step_s: f64,
}

enum Shown {
    /// Mean level of all pixels, each rounded up or down at random.
    Level(f64),
    Sums([u32; TAXELS]),
    Lost(u64),
    Fault(&'static str, &'static str),
    Waiting,
}

fn played(format: PixelFormat, items: Vec<Shown>, camera: bool) -> Played {
    let mut info = StreamInfo::new("played", FrameSize::new(400, 400).unwrap(), format, FrameRate::NOMINAL);
    info.taxels_only = matches!(items.first(), Some(Shown::Sums(_)));
    info.camera = camera.then(Box::<CameraState>::default);
    Played {
        info,
        items: items.into_iter(),
        bytes: vec![0; 160_000],
        random: Rng::new(1, 0),
        time: 50.0,
        sequence: 7,
        step_s: 1.0 / 30.0,
    }
}

impl Source for Played {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        let Some(item) = self.items.next() else { return Ok(SourceEvent::End) };
        let steps = match item {
            Shown::Lost(frames) => frames,
            Shown::Level(_) | Shown::Sums(_) => 1,
            Shown::Fault(..) | Shown::Waiting => 0,
        };
        self.time += steps as f64 * self.step_s;
        self.sequence = self.sequence.wrapping_add(steps as u32);
        Ok(match item {
            Shown::Lost(frames) => SourceEvent::Lost { frames, reason: LossReason::Dropped },
            Shown::Sums(sums) => SourceEvent::Taxels(SummedFrame::new(sums)),
            Shown::Fault(kind, message) => SourceEvent::Fault(Fault::from_text(kind.into(), message)),
            Shown::Waiting => SourceEvent::Waiting,
            Shown::Level(level) => {
                for byte in &mut self.bytes {
                    *byte = (level + self.random.uniform()).clamp(0.0, 255.0) as u8;
                }
                let timestamp = Some(Duration::from_secs_f64(self.time));
                SourceEvent::Frame(Frame { timestamp, sequence: Some(self.sequence), ..Frame::new(&self.bytes) })
            }
        })
    }
}

/// Measures even pictures of these levels.
fn even(levels: impl IntoIterator<Item = f64>) -> (StreamInfo, Measured) {
    let frames = levels.into_iter().map(Shown::Level).collect();
    measured(&mut played(PixelFormat::Gray, frames, false), ALL).unwrap()
}

/// Returns the report of such pictures.
fn report_of(levels: impl IntoIterator<Item = f64>) -> Report {
    let (info, measured) = even(levels);
    report(&info, &measured, None)
}

#[test]
fn the_first_frames_of_a_camera_are_left_out_and_all_of_its_recording_are_measured() {
    for (limit, frames) in [(OF_A_CAMERA, 35), (ALL, 50)] {
        let mut source = played(PixelFormat::Gray, (0..50).map(|_| Shown::Level(1.4)).collect(), true);
        assert_eq!(measured(&mut source, limit).unwrap().1.moments.len(), frames);
    }
}

#[test]
fn a_sensor_in_order_has_nothing_to_change() {
    let report = report_of([1.4; 150]);
    assert!(report.healthy && report.verdict.is_empty(), "{report}");
    assert_near("rate", report.rate.measured.unwrap(), 30.0, 1e-3);
    assert!(report.to_string().ends_with("Nothing to change."));
}

#[test]
fn what_an_unknown_readout_costs_is_told_of_cameras_only() {
    let (info, measured) = even([1.4; 150]);
    let camera = CameraReport { device: DeviceInfo::default(), format: "GREY".into() };
    let mut config = Config::default();
    let of = |config: &Config| {
        examine(&info, config, &measured, Known::default(), (Some(camera.clone()), Vec::new()), None).unwrap()
    };
    let report = of(&config);
    assert_eq!(kinds(&report), ["readout"], "{report}");
    // The camera is as good as it can be, so nothing is to be changed.
    let text = report.to_string();
    assert!(report.healthy && text.contains("\nNothing to change.\n- readout unknown"), "{text}");
    config.sensor.readout = ReadoutTime::from_ms(12.0);
    assert!(of(&config).verdict.is_empty());
}

#[test]
fn drift_is_measured_and_told_in_minutes() {
    // 18 levels per minute, from 20 levels to 23.
    let report = report_of((0..300).map(|t| 20.0 + 18.0 / 1800.0 * f64::from(t)));
    assert_near("drift", report.drift.levels_per_minute, 18.0, 0.1);
    assert_near("drift of the worst taxel", report.drift.worst_taxel, 18.0, 0.3);
    let minutes = report.drift.minutes_to_trigger.unwrap();
    assert_near("minutes", minutes, report.signal.five_taxels / 18.0, 0.01);
    assert_near("signal", report.signal.five_taxels, 21.5 * (0.2_f64.exp() - 1.0), 0.05);
    assert!(kinds(&report).contains(&"drift"), "{report}");
}

#[test]
fn falling_light_never_fires_and_is_told_all_the_same() {
    let report = report_of((0..300).map(|t| 23.0 - 18.0 / 1800.0 * f64::from(t)));
    assert_near("drift", report.drift.levels_per_minute, -18.0, 0.1);
    assert_eq!(report.drift.minutes_to_trigger, None);
    let found = report.verdict.iter().find(|finding| finding.kind == "drift").map(|finding| finding.found.as_str());
    assert!(found.unwrap().contains("gets darker by 1") && !report.to_string().contains("none that shows"), "{report}");
}

#[test]
fn a_slow_camera_losses_and_a_touch_are_told() {
    let mut items: Vec<_> = (0..120).map(|t| Shown::Level(if t < 80 { 1.4 } else { 40.4 })).collect();
    items.insert(30, Shown::Lost(4));
    let mut source = played(PixelFormat::Gray, items, true);
    source.step_s = 1.0 / 7.5;
    let (info, measured) = measured(&mut source, OF_A_CAMERA).unwrap();
    let report = report(&info, &measured, None);
    assert_near("rate", report.rate.measured.unwrap(), 7.5, 1e-3);
    assert_eq!(report.rate.lost[&LossReason::Dropped], 4);
    // The first 15 of 120 frames are the camera's settling. Frame 84 − 15 is the first lit one; the window from 70 on
    // fires.
    assert_eq!((report.rate.frames, measured.touched), (105, Some(60)));
    assert!(["touched", "slow", "lost"].iter().all(|kind| kinds(&report).contains(kind)), "{report}");
    // Frames that the program itself has skipped are no fault of the cable.
    let mut skipped = measured.clone();
    skipped.lost = [(LossReason::Skipped, 4)].into();
    let skipped = examine(&info, &Config::default(), &skipped, Known::default(), (None, Vec::new()), None).unwrap();
    let advice = skipped.verdict.iter().find(|finding| finding.kind == "lost").map(|finding| &*finding.advice);
    assert!(advice.is_some_and(|advice| advice.starts_with("leave the machine to this program")), "{skipped}");
    let controls = vec![ControlReport {
        name: "auto_exposure".into(),
        value: Some(3),
        value_at_end: Some(2),
        locked: Some(false),
        why: Some("left as it was".into()),
        drifts: true,
    }];
    let camera = (None, controls);
    let known = Known { asked_fps: Some(60.0), black: None };
    let report = examine(&info, &Config::default(), &measured, known, camera, None).unwrap();
    assert!(kinds(&report).contains(&"unlocked") && kinds(&report).contains(&"drifting_control"), "{report}");
}

#[test]
fn a_picture_that_never_changes_is_told() {
    assert!(kinds(&report_of([255.0; 60])).contains(&"frozen"));
}

#[test]
fn the_smallest_signal_is_where_the_trigger_fires() {
    let even = |level: f64, full: f64| [(level / 255.0 * full * 2500.0).round() as u32; TAXELS];
    for (format, full) in [(PixelFormat::Y16, 65_535.0), (PixelFormat::Gray, 255.0)] {
        for text in [
            "",
            "[trigger]\nmargin = 0.5",
            "[trigger]\nmargin = 0.05\nwindow = 3",
            "[trigger]\nrule = \"literal\"\nmultiplier = 0.9",
        ] {
            // The darkest is below the floor of an 8-bit format.
            for level in [0.1, 2.0, 12.0, 100.0] {
                let config = Config::parse(text).unwrap();
                let rest: Vec<_> = (0..60).map(|_| Shown::Sums(even(level, full))).collect();
                let mut source = played(format, rest, false);
                let info = source.info.clone();
                let measured = measure(&mut source, &info, &config, ALL, &RUNNING).unwrap();
                let signal = signal::signal(&Still::new(&measured), &config, &measured).unwrap();
                let fires = |lit: &[usize], gain: f64| {
                    let mut sums = even(level, full);
                    for taxel in lit {
                        sums[*taxel] += (gain / 255.0 * full * 2500.0) as u32;
                    }
                    let mut processor = Processor::new(&info, &config, OutputOptions::default()).unwrap();
                    let mut fired = false;
                    for t in 0..200 {
                        let item = SourceEvent::Taxels(SummedFrame::new(if t < 60 { even(level, full) } else { sums }));
                        let give = |record| {
                            fired |= matches!(record, Output::Event(_));
                            Ok::<(), Error>(())
                        };
                        processor.process(&item, give).unwrap();
                    }
                    fired
                };
                let what = format!("{format:?} {text:?} {level}: {signal:?}");
                if signal.one_taxel == 0.0 {
                    assert!(text.contains("literal") && fires(&[], 0.0), "{what}");
                    continue;
                }
                assert!(!fires(&[7], 0.98 * signal.one_taxel) && fires(&[7], 1.02 * signal.one_taxel), "{what}");
                let row = [10, 11, 12, 13, 14];
                assert!(!fires(&row, 0.98 * signal.five_taxels) && fires(&row, 1.02 * signal.five_taxels), "{what}");
                assert_eq!((signal.noise_margin, signal.false_triggers_per_hour), (None, 0.0));
            }
        }
    }
}

#[test]
fn mjpeg_is_held_against_the_uncompressed_picture() {
    let sensor = |format: &str, quality| {
        format!("format = \"{format}\"\nblack_level = 6.0\nread_noise = 60.0\nquality = {quality}")
    };
    let config = Config::default();
    let (_, raw) = scene(200, &sensor("GREY", 85), 0.0);
    let (_, mut good) = scene(200, &sensor("MJPG", 95), 0.0);
    good.lost.insert(LossReason::CorruptJpeg, 3);
    let fine = mjpeg::compare(("GREY", &raw), ("MJPG", &good), &config);
    assert!(fine.worst_taxel_off < 0.5 && fine.corrupt == 3 && fine.error < 0.5 * fine.lit, "{fine:?}");
    assert_near("lit", fine.lit, 2.4225, 1e-4);
    let (info, bad) = scene(200, &sensor("MJPG", 5), 0.0);
    let coarse = mjpeg::compare(("GREY", &raw), ("MJPG", &bad), &config);
    assert!(coarse.worst_taxel_off > 1.5, "{coarse:?}");
    assert!(coarse.jpeg.pixel_noise < coarse.raw.pixel_noise, "what is quantized away is no noise: {coarse:?}");
    let known = Known::default();
    let report = examine(&info, &config, &bad, known, (None, Vec::new()), Some(coarse)).unwrap();
    assert!(kinds(&report).contains(&"mjpeg") && report.to_string().contains("--format GREY"), "{report}");
}

#[test]
fn too_few_frames_are_an_error() {
    let mut source = played(PixelFormat::Gray, (0..9).map(|_| Shown::Level(3.0)).collect(), false);
    let error = measured(&mut source, ALL).unwrap_err().to_string();
    assert_eq!(error, "played: gave 9 frames, expected at least 10 to measure");
    let nothing: Vec<_> = (0..100).map(|_| Shown::Lost(30)).collect();
    let mut source = played(PixelFormat::Gray, nothing, true);
    let limit = Limit { seconds: 10.0, ..OF_A_CAMERA };
    let error = measured(&mut source, limit).unwrap_err().to_string();
    assert!(error.contains("gave 0 frames (600 dropped by the driver)") && source.items.len() > 60, "{error}");
}

#[test]
fn a_camera_that_goes_away_is_an_error_however_early() {
    let gone = "/dev/video0: no frame for 2 s: check the cable; waiting for the same camera, Ctrl-C ends";
    for (kind, message, why) in [
        ("disconnected", gone, "/dev/video0: no frame for 2 s: check the cable"),
        ("no-signal", "/dev/video0: no signal; waiting for it", "/dev/video0: no signal"),
    ] {
        // Without a frame, while the camera settles, and later.
        for frames in [0, 3, 40] {
            let mut items: Vec<_> = (0..frames).map(|_| Shown::Level(1.4)).collect();
            items.extend([Shown::Waiting, Shown::Fault("slow", "slow"), Shown::Fault(kind, message)]);
            items.extend((0..100).map(|_| Shown::Waiting));
            let mut source = played(PixelFormat::Gray, items, true);
            let error = measured(&mut source, OF_A_CAMERA).unwrap_err().to_string();
            assert_eq!(error, format!("played: broke off while it was measured: {why}"), "{frames} frames");
            assert_eq!(source.items.len(), 100, "it was waited for");
        }
    }
}
