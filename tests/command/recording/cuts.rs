//! Tests a recording that is cut off or damaged anywhere.

use std::fs;
use std::path::Path;

use wstac_host::source::mcap::McapSource;
use wstac_host::source::{Frame, Source, SourceEvent};
use wstac_tests::folder::Folder;
use wstac_tests::random::Random;

use super::{run, said};

const FRAME: usize = 100 * 100;

/// Makes a recording of some seconds with an event and lost frames. Returns its bytes, its frames, and where each frame
/// ends in the bytes.
fn recording(folder: &Folder) -> (Vec<u8>, Vec<Vec<u8>>, Vec<usize>) {
    let (scene, file, raw) = (folder.0.join("s.toml"), folder.0.join("a.mcap"), folder.0.join("a.raw"));
    let text = "specimen = \"Saw3\"\nspeed = 150\n[sensor]\nsize = [100, 100]\ndropped = 0.03\n";
    fs::write(&scene, text).unwrap();
    let scene = format!("scene:{}", scene.display());
    assert!(run(&["run", &scene, "--save-raw", raw.to_str().unwrap()]).status.success());
    assert!(run(&["record", &scene, "-o", file.to_str().unwrap()]).status.success());
    let bytes = fs::read(&file).unwrap();
    let frames: Vec<Vec<u8>> = fs::read(&raw).unwrap().chunks_exact(FRAME).map(<[u8]>::to_vec).collect();
    let mut ends = Vec::new();
    let mut from = 0;
    for frame in &frames {
        let at = bytes[from..].windows(FRAME).position(|window| window == frame).unwrap();
        from += at + FRAME;
        ends.push(from);
    }
    (bytes, frames, ends)
}

/// Recovers a recording from these bytes. Returns the frames that come back, and how many are lost among them. Returns
/// `None` if the bytes are refused. The command must report it if a part cannot be read.
fn recovered(folder: &Folder, bytes: &[u8]) -> Option<(Vec<Vec<u8>>, u64)> {
    let _ = fs::remove_file(folder.0.join("new.mcap"));
    let (cut, new) = (folder.0.join("cut.mcap"), folder.0.join("new.mcap"));
    fs::write(&cut, bytes).unwrap();
    let done = run(&["recover", cut.to_str().unwrap(), "-o", new.to_str().unwrap(), "--force"]);
    let code = done.status.code();
    assert!(code == Some(0) || code == Some(1), "{code:?}: {}", said(&done));
    assert!(!folder.0.join("new.mcap.part").exists());
    if code == Some(1) && !new.exists() {
        return None;
    }
    assert_eq!(code == Some(1), said(&done).contains("could not be read; "), "{}", said(&done));
    frames_of(&new)
}

fn frames_of(path: &Path) -> Option<(Vec<Vec<u8>>, u64)> {
    // A recording that was cut off before its description cannot be read.
    let mut source = McapSource::open(path, None).ok()?;
    let (mut frames, mut lost) = (Vec::new(), 0);
    loop {
        match source.next_event().unwrap() {
            SourceEvent::Frame(Frame { bytes, .. }) => frames.push(bytes.to_vec()),
            SourceEvent::Lost { frames, .. } => lost += frames,
            SourceEvent::End => return Some((frames, lost)),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn every_frame_that_was_written_comes_back_wherever_it_was_cut() {
    let folder = Folder::new("recording-cuts");
    let (bytes, frames, ends) = recording(&folder);
    assert!(frames.len() > 120, "{}", frames.len());
    let mut random = Random::new(7);
    let mut counts = Vec::new();
    for _ in 0..100 {
        let cut = random.below(bytes.len() as u64) as usize;
        let expected = ends.iter().filter(|&&end| end <= cut).count();
        let found = recovered(&folder, &bytes[..cut]).map_or(Vec::new(), |(frames, _)| frames);
        assert!(found == frames[..expected], "cut at {cut}: {} frames, expected {expected}", found.len());
        counts.push(expected);
    }
    counts.sort_unstable();
    counts.dedup();
    assert!(counts.len() > 40, "cuts all over: {counts:?}");
    println!("100 cuts: every complete frame came back, 0 to {} of {}", counts.last().unwrap(), frames.len());
}

/// Tests that every frame that comes back was recorded, in its order and place. No frame may be wrong.
#[test]
fn damage_never_becomes_a_wrong_frame() {
    let folder = Folder::new("recording-damage");
    let (bytes, frames, _) = recording(&folder);
    let (_, lost) = recovered(&folder, &bytes).unwrap();
    let total = frames.len() as u64 + lost;
    let mut whole = 0;
    let mut random = Random::new(11);
    for _ in 0..60 {
        let mut damaged = bytes.clone();
        let at = random.below(bytes.len() as u64) as usize;
        damaged[at] ^= 1 << random.below(8);
        let Some((found, lost)) = recovered(&folder, &damaged) else { continue };
        let mut from = frames.iter();
        assert!(found.iter().all(|frame| from.any(|whole| whole == frame)), "byte {at}: a frame that never was");
        assert!(found.len() as u64 + lost <= total, "byte {at}");
        whole += u32::from(found.len() as u64 + lost == total);
    }
    assert!(whole > 50, "frames that are damaged keep their place: {whole} of 60");
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

/// Tests that damage after which nobody can read on is reported.
#[test]
fn a_damaged_length_is_said() {
    let folder = Folder::new("recording-length");
    let (bytes, frames, ends) = recording(&folder);
    // Finds the header of the second chunk: the code 6, then a length after which another record starts.
    let is_chunk = |at: usize| {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        bytes[at] == 6 && bytes.get(at + 9 + length) == Some(&7) && bytes[at + 37..at + 41] == [0; 4]
    };
    let second = (ends[0]..bytes.len() - 60).find(|&at| is_chunk(at)).unwrap();
    let mut damaged = bytes.clone();
    // The length becomes 4 KiB shorter, so it ends in the middle of a frame.
    let length = u64::from_le_bytes(bytes[second + 1..second + 9].try_into().unwrap()) - 4096;
    damaged[second + 1..second + 9].copy_from_slice(&length.to_le_bytes());
    let (cut, new) = (folder.0.join("cut.mcap"), folder.0.join("new.mcap"));
    fs::write(&cut, damaged).unwrap();
    fs::write(&new, "mine").unwrap();
    let (old, name) = (cut.to_str().unwrap(), new.to_str().unwrap());
    let done = run(&["recover", old, "-o", name, "--force"]);
    assert_eq!(done.status.code(), Some(1), "{}", said(&done));
    assert!(said(&done).contains("is damaged: ") && said(&done).contains("could not be read; "), "{}", said(&done));
    let (found, _) = frames_of(&new).unwrap();
    let before = ends.iter().filter(|&&end| end <= second).count();
    assert!(found.len() == before && found == frames[..before], "{} frames, expected {before}", found.len());
    // If nothing can be read at all, the file of that name stays as it is.
    let mut compressed = bytes.clone();
    compressed[second + 37] = 4;
    fs::write(&cut, compressed).unwrap();
    fs::write(&new, "mine").unwrap();
    let done = run(&["recover", old, "-o", name, "--force"]);
    assert_eq!(done.status.code(), Some(1), "{}", said(&done));
    assert!(said(&done).contains("compressed chunk"), "{}", said(&done));
    assert_eq!(fs::read(&new).unwrap(), b"mine");
    assert!(!folder.0.join("new.mcap.part").exists());
}
