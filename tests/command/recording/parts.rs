//! Tests recordings of a part of the picture, and of no picture: they give the same sums and events as whole ones.

use std::fs;

use wstac_host::output::OutputOptions;
use wstac_host::session::Processor;
use wstac_host::source::mcap::McapSource;
use wstac_host::source::{Source, SourceEvent, config_of};
use wstac_tests::command::{ends, good};
use wstac_tests::folder::Folder;

use super::cuts::{built, parts_of};
use super::flips::{outcome, small};
use super::scene;

/// Makes a recording with these options, and returns its path.
fn recorded(folder: &Folder, scene: &str, name: &str, options: &[&str]) -> String {
    let file = folder.path(name);
    good(&[&["record", scene, "-o", &file, "--force"], options].concat());
    file
}

/// Returns the taxel sums of every frame of a recording.
fn sums(file: &str) -> Vec<[u32; 25]> {
    let mut source = McapSource::open(file.as_ref(), None).unwrap();
    let config = config_of(source.info(), None).unwrap();
    let mut processor = Processor::new(source.info(), &config, OutputOptions::default()).unwrap();
    let mut all = Vec::new();
    loop {
        let event = source.next_event().unwrap();
        let is_frame = matches!(event, SourceEvent::Frame(_) | SourceEvent::Taxels(_));
        if matches!(event, SourceEvent::End) {
            return all;
        }
        processor.process(&event, |_| Ok::<(), ()>(())).unwrap();
        all.extend(processor.taxel_sums().filter(|_| is_frame));
    }
}

/// Every command that reads recordings answers as it does for a recording of whole pictures.
#[test]
fn a_part_and_sums_give_the_same_to_the_byte() {
    let folder = Folder::new("recording-parts");
    let new = |name: &str| folder.path(name);
    for format in ["GREY", "YUYV", "NV12", "Y10", "RGGB", "MJPG"] {
        let scene = scene(&folder, format);
        let whole = recorded(&folder, &scene, "whole.mcap", &["--label", "specimen=Saw3"]);
        let part = recorded(&folder, &scene, "part.mcap", &["--label", "specimen=Saw3", "--crop"]);
        let without = recorded(&folder, &scene, "sums.mcap", &["--label", "specimen=Saw3", "--features-only"]);
        let lines =
            |file: &str| good(&["run", file, "--json", "--features", "--samples", "--model", "builtin:taxel-path-svm"]);
        let (expected, of_frames) = (lines(&whole), sums(&whole));
        assert!(expected.contains(r#""kind":"event""#) && of_frames.len() > 100, "{format}");
        // Data sets and figures have the names of recordings, so all get the same.
        let made = |command: &str, file: &str, name: &str| {
            let (one, output) = (new("one.mcap"), new(name));
            fs::copy(file, &one).unwrap();
            good(&[command, &one, "-o", &output, "--force"]);
            fs::read(output).unwrap()
        };
        let (arrays, figure) =
            (|file: &str| made("dataset", file, "set.npz"), |file: &str| made("plot", file, "event.svg"));
        for file in [&part, &without] {
            assert!(lines(file) == expected, "{format} {file}: the events differ");
            assert!(sums(file) == of_frames, "{format} {file}: the sums differ");
        }
        let size = |file: &str| fs::metadata(file).unwrap().len();
        assert!(size(&without) < size(&part) / 5, "{format}");
        assert!(format == "MJPG" || size(&part) < size(&whole), "{format}: {}", size(&part));
        if !["GREY", "MJPG"].contains(&format) {
            continue;
        }
        let set = arrays(&whole);
        assert!(arrays(&part) == set && arrays(&without) == set, "{format}: the data sets differ");
        let drawn = figure(&whole);
        assert!(figure(&part) == drawn && figure(&without) == drawn, "{format}: the figures differ");
        // A recording of such a recording is equal to it.
        let again = recorded(&folder, &part, "again.mcap", &["--label", "specimen=Saw3"]);
        assert!(lines(&again) == expected && size(&again) < size(&part) + 1000, "{format}");
        let again = recorded(&folder, &without, "again.mcap", &["--features-only"]);
        assert!(lines(&again) == expected, "{format}");
        let narrower = recorded(&folder, &part, "again.mcap", &["--crop=2"]);
        assert!(lines(&narrower) == expected && size(&narrower) < size(&part), "{format}");
    }
}

/// A part has the places of the camera's own frames, so that a calibration of it is one of the camera.
#[test]
fn a_calibration_of_a_part_is_one_of_the_camera() {
    let folder = Folder::new("recording-parts-calibrate");
    let text = "specimen = \"Fla0\"\nspeed = 150\n[sensor]\nsize = [320, 180]\n";
    let scene = folder.scene("s.toml", text);
    let whole = recorded(&folder, &scene, "whole.mcap", &[]);
    let part = recorded(&folder, &scene, "part.mcap", &["--crop"]);
    let calibrated = |file: &str, name: &str| {
        let output = folder.path(name);
        good(&["calibrate", file, "-o", &output, "--force"]);
        fs::read_to_string(output).unwrap()
    };
    let (of_whole, of_part) = (calibrated(&whole, "whole.toml"), calibrated(&part, "part.toml"));
    let keys = |text: &str| text.lines().filter(|line| !line.starts_with('#')).collect::<Vec<_>>().join("\n");
    assert!(keys(&of_whole).contains("frame = [320, 180]"), "{of_whole}");
    assert_eq!(keys(&of_whole), keys(&of_part));
    // It fits the recording, too, and gives the same events there.
    let config = folder.path("part.toml");
    let lines = |file: &str| good(&["run", file, "--json", "--features", "--config", &config]);
    assert!(lines(&whole) == lines(&part));
}

#[test]
fn what_needs_other_pixels_is_refused() {
    let folder = Folder::new("recording-parts-refused");
    let scene = scene(&folder, "YUYV");
    let part = recorded(&folder, &scene, "part.mcap", &["--crop=0"]);
    let sums = recorded(&folder, &scene, "sums.mcap", &["--features-only", "--label", "specimen=Saw3"]);
    let config = |name: &str, text: &str| folder.written(name, text);
    let corners: Vec<String> = (0..25).map(|k| format!("[{}, {}]", 20 + 30 * (k % 5), 10 + 30 * (k / 5))).collect();
    let layout = config("l.toml", &format!("[layout]\ntaxel = [20, 20]\ncorners = [{}]", corners.join(", ")));
    let stride = config("s.toml", "[green]\nstride = 2\n");
    let linear = config("y.toml", "[green]\nyuv = \"linear\"\n");
    let trigger = config("t.toml", "[trigger]\nwindow = 6\n[features]\nln = \"libm\"\nfloor_levels = 1\n");
    let (new, no_pictures) = (&*folder.path("new"), "not those of the recording, which has no pictures");
    for (arguments, parts) in [
        (
            &["run", &part, "--config", &layout][..],
            &["[layout] taxel 0 lies outside of what was recorded", "--crop"][..],
        ),
        (&["run", &sums, "--config", &layout], &[no_pictures, "--features-only"]),
        (&["run", &sums, "--config", &stride], &[no_pictures]),
        (&["run", &sums, "--config", &linear], &[no_pictures]),
        (&["dataset", &sums, "-o", new, "--config", &stride], &["not those of the recording"]),
        (&["run", &sums, "--matrix", "bt601"], &["recorded without pictures", "--matrix and --range"]),
        (&["run", &sums, "--save-raw", new], &["has no frames for --save-raw", "a recording with pictures"]),
        (&["calibrate", &sums, "-o", new], &["gives taxel sums", "a recording with pictures"]),
        (&["record", &sums, "-o", new], &["gives taxel sums and no frames", "or --features-only"]),
    ] {
        // Wrong arguments have a code of their own.
        ends(arguments, if arguments.contains(&"--matrix") { 2 } else { 1 }, parts);
    }
    assert!(!folder.0.join("new").exists());
    // What needs no pixels goes on, with the same answers.
    let whole = recorded(&folder, &scene, "whole.mcap", &[]);
    let lines = |file: &str| good(&["run", file, "--json", "--features", "--config", &trigger]);
    assert!(lines(&sums) == lines(&whole) && lines(&part) == lines(&whole));
    ends(&["doctor", &sums], 0, &[]);
    ends(&["record", &scene, "-o", new, "--crop", "--features-only"], 2, &[]);
    // A simulated sensor without pixels can be recorded so.
    let taxels = folder.scene("x.toml", "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"\n");
    let file = recorded(&folder, &taxels, "taxels.mcap", &["--features-only"]);
    let live = good(&["run", &taxels, "--json", "--features", "--model", "none"]);
    assert!(live.contains(r#""kind":"event""#) && good(&["run", &file, "--json", "--features"]) == live);
}

/// Every checksum has its place in the stream, and the record at the end the number of frames. So nothing of a
/// recording can be gone in silence, and what comes twice or stands elsewhere is taken once, in its place.
#[test]
fn chunks_that_are_gone_moved_or_repeated_are_noticed() {
    let folder = Folder::new("recording-parts-moved");
    for options in [&["--features-only"][..], &[], &["--crop=0"], &["--compress=lz4"]] {
        let (bytes, recorded) = small(&folder, options);
        let parts = parts_of(&bytes);
        let all: Vec<usize> = (0..parts.chunks.len()).collect();
        assert!(all.len() > 3, "{options:?}: {all:?}");
        let total = recorded.0 + recorded.1;
        let whole = outcome(&folder, &built(&parts, &all, true));
        assert_eq!((whole.run, whole.recover, whole.found), (Some(0), Some(0), Some(recorded)), "{}", whole.said);
        let without = |gone: usize| all.iter().copied().filter(|number| *number != gone).collect::<Vec<_>>();
        let swapped: Vec<usize> = [&[0, 2, 1], &all[3..]].concat();
        for (what, order) in [
            ("the second is gone", without(1)),
            ("the last is gone", without(all.len() - 1)),
            ("two are swapped", swapped),
            ("the second comes twice", [&[0, 1, 1], &all[2..]].concat()),
            ("the second comes once more at the end", [&all[..], &[1]].concat()),
        ] {
            let outcome = outcome(&folder, &built(&parts, &order, true));
            let is_gone = order.len() < all.len();
            // A channel may be described in the chunk that stands behind its messages now.
            let is_refused = is_gone || (what.contains("swapped") && outcome.said.contains("which nothing describes"));
            assert_eq!(outcome.run, Some(i32::from(is_refused)), "{options:?}, {what}: {}", outcome.said);
            assert_eq!(outcome.recover, Some(0), "{options:?}, {what}: {}", outcome.said);
            let found = outcome.found.unwrap();
            assert_eq!(found.0 + found.1, total, "{options:?}, {what}: {found:?} of {recorded:?}");
            assert_eq!(found.0 < recorded.0, is_gone, "{options:?}, {what}");
            let is_repeated = order.len() > all.len();
            assert_eq!(outcome.said.contains("left out: there already"), is_repeated, "{}", outcome.said);
        }
        // Chunks that were moved come back from a file that is damaged elsewhere, too.
        let (mut damaged, last) = (parts_of(&bytes), all.len() - 1);
        damaged.chunks[last][1000] ^= 1;
        let [there, moved] = [all.clone(), [&[0, last - 1], &all[1..last - 1], &[last]].concat()]
            .map(|order| outcome(&folder, &built(&damaged, &order, true)));
        assert_eq!((moved.recover, moved.found), (Some(0), there.found), "{options:?}: {} {}", there.said, moved.said);
        // A recording that was finished has a record that says how many frames it had.
        let outcome = outcome(&folder, &built(&parts, &all, false));
        assert_eq!((outcome.run, outcome.recover), (Some(1), Some(1)), "{options:?}: {}", outcome.said);
        assert!(outcome.said.matches("how many frames it had").count() == 2, "{}", outcome.said);
    }
}
