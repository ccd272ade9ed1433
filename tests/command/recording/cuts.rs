//! Tests a recording that is cut off or damaged anywhere.

use std::fs;

use wstac_tests::command::says;
use wstac_tests::folder::{Folder, text};
use wstac_tests::random::Random;

use super::flips::{outcome, small};
use super::several_damage::{Stream, stream};
use super::{good, run, said};

const FRAME: usize = 40 * 40;

/// Makes a recording of some seconds with an event and lost frames. Returns its bytes, its frames, and where each frame
/// ends in the bytes, with its checksum.
fn recording(folder: &Folder) -> (Vec<u8>, Vec<Vec<u8>>, Vec<usize>) {
    let ((bytes, _), raw) = (small(folder, &[]), folder.path("a.raw"));
    good(&["run", &format!("scene:{}", folder.path("s.toml")), "--save-raw", &raw]);
    let frames: Vec<Vec<u8>> = fs::read(&raw).unwrap().chunks_exact(FRAME).map(<[u8]>::to_vec).collect();
    let mut ends = Vec::new();
    let mut from = 0;
    for frame in &frames {
        let at = bytes[from..].windows(FRAME).position(|window| window == frame).unwrap();
        from += at + FRAME;
        let sum = bytes[from..].windows(14).position(|window| window == br#"{"kind":"sum","#).unwrap();
        from += sum + bytes[from + sum..].iter().position(|&byte| byte == b'}').unwrap() + 1;
        ends.push(from);
    }
    (bytes, frames, ends)
}

/// Recovers a recording from these bytes; `None` if they are refused. The command must report it if a part cannot be
/// read.
fn recovered_stream(folder: &Folder, bytes: &[u8]) -> Option<Stream> {
    let (cut, new) = (folder.file("cut.mcap", bytes), folder.0.join("new.mcap"));
    let _ = fs::remove_file(&new);
    let done = run(["recover", text(&cut), "-o", text(&new), "--force"]);
    let code = done.status.code();
    assert!(code == Some(0) || code == Some(1), "{code:?}: {}", said(&done));
    assert!(!folder.0.join("new.mcap.part").exists());
    if code == Some(1) && !new.exists() {
        return None;
    }
    assert_eq!(code == Some(1), said(&done).contains("has what could be recovered"), "{}", said(&done));
    // A recording that was cut off before its description cannot be read, and one without a frame is an error.
    stream(&new, None)
}

/// Returns the frames that come back, and how many are lost among them.
fn recovered(folder: &Folder, bytes: &[u8]) -> Option<(Vec<Vec<u8>>, u64)> {
    let frames = recovered_stream(folder, bytes)?.frames;
    let lost = frames.iter().filter(|frame| frame.is_none()).count() as u64;
    Some((frames.into_iter().flatten().collect(), lost))
}

#[test]
fn every_frame_that_was_written_comes_back_wherever_it_was_cut() {
    let folder = Folder::new("recording-cuts");
    let (bytes, frames, ends) = recording(&folder);
    assert!(frames.len() > 120, "{}", frames.len());
    let mut random = Random::new(7);
    let mut counts = Vec::new();
    let whole = stream(&folder.0.join("a.mcap"), None).unwrap();
    for _ in 0..60 {
        let cut = random.below(bytes.len() as u64) as usize;
        let expected = ends.iter().filter(|&&end| end <= cut).count();
        if let Some(found) = recovered_stream(&folder, &bytes[..cut]) {
            // Nor does a recovery add a fault or a lost frame: nothing is damaged.
            assert!(whole.faults.starts_with(&found.faults), "cut at {cut}: {:?}, {:?}", found.faults, whole.faults);
            assert!(whole.frames.starts_with(&found.frames), "cut at {cut}: not the frames that were recorded");
            assert_eq!(found.frames.iter().flatten().count(), expected, "cut at {cut}");
        } else {
            assert_eq!(expected, 0, "cut at {cut}");
        }
        counts.push(expected);
    }
    counts.sort_unstable();
    counts.dedup();
    assert!(counts.len() > 25, "cuts all over: {counts:?}");
}

/// Tests that one wrong letter in the description of a channel loses no other chunk: the index has the description,
/// too.
#[test]
fn a_wrong_letter_of_a_channel_loses_no_chunk_but_its_own() {
    let folder = Folder::new("recording-letter");
    let (bytes, frames, ends) = recording(&folder);
    let at = bytes.windows(7).position(|window| window == b"/camera").unwrap();
    assert!(at < ends[0], "the channel stands before its first frame");
    let mut damaged = bytes.clone();
    damaged[at + 3] ^= 1;
    let (found, lost) = recovered(&folder, &damaged).unwrap();
    assert!(!found.is_empty() && frames.ends_with(&found), "{} of {} frames", found.len(), frames.len());
    let (_, gaps) = recovered(&folder, &bytes).unwrap();
    assert_eq!(found.len() as u64 + lost, frames.len() as u64 + gaps);
}

/// Returns the places of chunks' codes.
pub(super) fn chunks(bytes: &[u8]) -> Vec<usize> {
    let (mut at, mut found) = (8, Vec::new());
    while at + 9 < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        found.extend((bytes[at] == 6).then_some(at));
        at += 9 + length;
    }
    found
}

/// Tests that a wrong length of a chunk loses no frame, whether there is an index or not.
#[test]
fn a_damaged_length_loses_nothing() {
    let folder = Folder::new("recording-length");
    let (bytes, frames, ends) = recording(&folder);
    let chunks = chunks(&bytes);
    assert!(chunks.len() > 3, "{chunks:?}");
    for (length, without_index) in [(4096, false), (4096, true), (!0 >> 20, false), (!0 >> 20, true)] {
        let mut damaged = bytes.clone();
        // The length ends in the middle of a frame, or far behind the end of the file.
        damaged[chunks[1] + 1..chunks[1] + 9].copy_from_slice(&u64::to_le_bytes(length));
        if without_index {
            damaged.truncate(*ends.last().unwrap());
        }
        let (found, _) = recovered(&folder, &damaged).unwrap();
        assert!(found == frames, "{length} {without_index}: {} of {} frames", found.len(), frames.len());
    }
    // All that is known of a chunk's length is wrong, and there is no index: its records are found by their shapes.
    let mut damaged = bytes[..*ends.last().unwrap()].to_vec();
    damaged[chunks[1]..chunks[1] + 49].fill(0xEE);
    let (found, _) = recovered(&folder, &damaged).unwrap();
    assert!(found == frames, "{} of {} frames", found.len(), frames.len());
}

/// Tests that a damaged start, which is no MCAP file's, loses nothing.
#[test]
fn a_damaged_start_loses_nothing() {
    let folder = Folder::new("recording-start");
    let (bytes, frames, ends) = recording(&folder);
    for (from, to) in [(0, 1), (0, 8), (8, 9), (9, 17), (8, 60), (40, 44)] {
        for length in [bytes.len(), *ends.last().unwrap()] {
            let mut damaged = bytes[..length].to_vec();
            damaged[from..to].fill(0xEE);
            let (found, _) = recovered(&folder, &damaged).unwrap();
            assert!(found == frames, "{from} to {to}: {} of {} frames", found.len(), frames.len());
        }
    }
    // A file that is none stays as it is, and so does the file of the new name.
    let (cut, new) = (folder.file("cut.mcap", [0xEE; 10_000]), folder.file("new.mcap", "mine"));
    says(&run(["recover", text(&cut), "-o", text(&new), "--force"]), 1, &["expected an MCAP file"]);
    assert_eq!(fs::read(&new).unwrap(), b"mine");
    assert!(!folder.0.join("new.mcap.part").exists());
}

/// The parts of a finished recording.
pub(super) struct Parts {
    /// Everything before the first chunk.
    start: Vec<u8>,
    /// The chunks, each with its index of messages.
    pub(super) chunks: Vec<Vec<u8>>,
    /// The record at the end of a recording.
    end: Vec<u8>,
}

/// Takes a finished recording apart.
pub(super) fn parts_of(bytes: &[u8]) -> Parts {
    let mut parts = Parts { start: bytes[..8].to_vec(), chunks: Vec::new(), end: Vec::new() };
    let mut at = 8;
    while bytes[at] != 15 {
        let length = 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        let record = &bytes[at..at + length];
        match (bytes[at], parts.chunks.last_mut()) {
            (6, _) => parts.chunks.push(record.to_vec()),
            (7, Some(chunk)) => chunk.extend(record),
            (_, Some(_)) => parts.end.extend(record),
            (_, None) => parts.start.extend(record),
        }
        at += length;
    }
    parts
}

/// Makes a finished recording without an index of these chunks.
pub(super) fn built(parts: &Parts, chunks: &[usize], has_end: bool) -> Vec<u8> {
    let chunks = chunks.iter().flat_map(|number| parts.chunks[*number].clone()).collect::<Vec<_>>();
    let end = if has_end { &parts.end[..] } else { &[] };
    let data_end = [&[15, 4][..], &[0; 11]].concat();
    let footer = [&[2, 20][..], &[0; 27], b"\x89MCAP0\r\n"].concat();
    [&parts.start, &chunks, end, &data_end, &footer].concat()
}

/// Bytes that cannot be read are no incomplete end.
#[test]
fn a_damaged_end_is_not_an_incomplete_one() {
    let folder = Folder::new("recording-tail");
    for options in [&[][..], &["--compress=lz4"], &["--compress=zstd"]] {
        let (bytes, recorded) = small(&folder, options);
        let at = bytes.len() * 3 / 4;
        let damaged = outcome(&folder, &[&bytes[..at], &vec![0x55; bytes.len() - at]].concat());
        assert_eq!((damaged.run, damaged.recover), (Some(1), Some(1)), "{options:?}: {}", damaged.said);
        assert!(damaged.said.contains("nothing says how many frames it had"), "{options:?}: {}", damaged.said);
        assert!(damaged.found.is_some_and(|found| found.0 > recorded.0 / 2), "{options:?}: {damaged:?}");
        let cut = outcome(&folder, &bytes[..at]);
        assert_eq!((cut.run, cut.recover), (Some(1), Some(0)), "{options:?}: {}", cut.said);
        assert!(cut.said.contains("was not finished") && !cut.said.contains("damaged"), "{options:?}: {}", cut.said);
        // Between two records stands an attachment, and a record that MCAP may have one day.
        let (start, end) = bytes[..at].split_at(17 + usize::from(bytes[9]));
        let others = b"\x09\x05\0\0\0\0\0\0\0notes\x10\x01\0\0\0\0\0\0\0x";
        let other = outcome(&folder, &[start, others, end].concat());
        assert!(other.recover == Some(0) && other.found == cut.found, "{options:?}: {}", other.said);
        assert!(
            other.said.contains("2 records left out") && !other.said.contains("could not be read"),
            "{}",
            other.said
        );
    }
}

/// A frame that was not completely written was never recorded.
#[test]
fn an_incomplete_frame_is_no_damaged_one() {
    let folder = Folder::new("recording-incomplete");
    for options in [&[][..], &["--features-only"], &["--compress=lz4"]] {
        let (bytes, _) = small(&folder, options);
        let start = chunks(&bytes)[0];
        for cut in (start + 10..start + 8000).step_by(1900) {
            let outcome = outcome(&folder, &bytes[..cut]);
            let is_none = outcome.said.contains("has no frame that can be recovered");
            assert_eq!(outcome.recover, Some(i32::from(is_none)), "{options:?} {cut}: {}", outcome.said);
            assert!(!outcome.said.contains("damaged") && !outcome.said.contains(" 0 bytes"), "{}", outcome.said);
            let found = (!is_none).then_some(0);
            assert_eq!(outcome.found.map(|found| found.1), found, "{options:?} {cut}: {outcome:?}");
        }
    }
}
