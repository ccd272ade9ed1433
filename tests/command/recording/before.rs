//! Tests a recording of version 0.2.0, which has no checksums of frames. `before.mcap` is one of 140 frames, of which
//! the simulated driver lost 3.

use std::fs;

use wstac_tests::command::{ends, good};
use wstac_tests::folder::{Folder, text};

use super::cuts::chunks;
use super::flips::{ended, recovered_twice};
use super::moved::with_configuration;

const BEFORE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/command/recording/before.mcap");

/// Recovers these bytes, twice. Returns the frames, the lost frames, and what `wstac run` and the recovery print.
fn recovered(folder: &Folder, bytes: &[u8]) -> (u64, u64, String, String) {
    let (said, lines) = recovered_twice(folder, text(&folder.file("old.mcap", bytes)));
    let (frames, lost) = ended(lines.as_bytes());
    (frames, lost, lines, said)
}

/// Returns the number of the first frame of the only event, and whether it is reliable.
fn event(lines: &str) -> (u64, bool) {
    let line = lines.lines().find(|line| line.contains(r#""kind":"event""#)).unwrap();
    let event: serde_json::Value = serde_json::from_str(line).unwrap();
    (event["frame"].as_u64().unwrap(), event["reliable"].as_bool().unwrap())
}

#[test]
fn a_recording_of_before_is_read_and_recovered() {
    let folder = Folder::new("recording-before");
    let bytes = fs::read(BEFORE).unwrap();
    let lines = good(&["run", BEFORE, "--json", "--features"]);
    assert_eq!((ended(lines.as_bytes()), event(&lines)), ((137, 3), (35, true)));
    // A recovery has the same stream, with checksums.
    let (frames, lost, recovered_lines, said) = recovered(&folder, &bytes);
    assert_eq!((frames, lost), (137, 3), "{said}");
    assert!(recovered_lines == lines && !said.contains("without a checksum"), "{said}");
    // An unfinished recording has none, and a message says so.
    let cut = &bytes[..chunks(&bytes)[3] + 12_000];
    let (frames, lost, _, said) = recovered(&folder, cut);
    assert_eq!((frames, lost), (102, 3), "{said}");
    assert!(said.contains("15 frames without a checksum"), "{said}");
}

/// The times of frames give the places of those that are lost.
#[test]
fn damage_of_a_recording_of_before_keeps_the_time_line() {
    let folder = Folder::new("recording-before-damage");
    let bytes = fs::read(BEFORE).unwrap();
    let chunks = chunks(&bytes);
    let with = |at: usize, bit: u32| {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << bit;
        recovered(&folder, &damaged)
    };
    // All frames of the first chunk: the event is where it was, but for a part of a window, and it is not reliable,
    // because its baseline was not seen.
    let (frames, lost, lines, said) = with(chunks[0] + 9000, 0);
    assert_eq!((frames, frames + lost), (107, 140), "{said}");
    let (frame, reliable) = event(&lines);
    assert!(frame.abs_diff(35) < 7 && !reliable, "frame {frame}, reliable: {reliable}");
    // All frames of the third. Two that the driver had lost are among them.
    let (frames, lost, _, said) = with(chunks[2] + 9000, 0);
    assert_eq!((frames, frames + lost), (109, 140), "{said}");
    // A code, a length and the sizes of a chunk: the index and the other two have them.
    for (at, bit) in [(0, 7), (0, 0), (2, 5), (25, 3), (41, 3)] {
        let (frames, lost, _, said) = with(chunks[1] + at, bit);
        assert_eq!((frames, lost), (137, 3), "byte {at}: {said}");
    }
    // The magic, and the length of the first record.
    for (at, bit) in [(1, 1), (9, 6), (12, 7)] {
        let (frames, lost, _, said) = with(at, bit);
        assert_eq!((frames, lost), (137, 3), "byte {at}: {said}");
    }
}

/// A law that was removed does not keep frames and taxel sums from being read and recovered.
#[test]
fn a_recording_with_the_removed_law_is_read_with_another() {
    let folder = Folder::new("recording-before-law");
    let path = |name: &str| folder.0.join(name).display().to_string();
    let published = folder.file("published.toml", "[speed]\nlaw = \"published\"\n").display().to_string();
    let arrival = folder.file("arrival.toml", "[trigger]\nwindow = 5\n").display().to_string();
    let [whole, old, new] = ["whole.mcap", "old.mcap", "new.mcap"].map(path);
    let of_before = |text: &str| {
        assert!(text.contains("law = \"published\""), "{text}");
        text.replace("law = \"published\"", "law = \"physical\"")
    };
    for more in [&[][..], &["--features-only"]] {
        let record = ["record", "scene:Saw3@150", "--size", "80x60", "--config", &published, "-o", &whole, "--force"];
        good(&[&record, more].concat());
        fs::write(&old, with_configuration(&fs::read(&whole).unwrap(), &of_before)).unwrap();
        good(&["recover", &old, "-o", &new, "--force"]);
        let lines = |file: &str| good(&["run", file, "--json", "--features", "--config", &arrival]);
        for file in [&old, &new] {
            let expected = "[speed] has law = \"physical\", which was removed (expected law = \"arrival\"";
            ends(&["run", file], 1, &[expected, "--config"]);
            assert!(lines(file) == lines(&whole), "{more:?} {file}");
        }
    }
}
