//! A recording that is cut off or damaged anywhere.

use std::fs;
use std::path::Path;

use wstac_linux::source::mcap::McapSource;
use wstac_linux::source::{Item, Source};
use wstac_tests::folder::Folder;
use wstac_tests::random::Random;

use super::{run, said};

const FRAME: usize = 100 * 100;

/// A recording of some seconds with an event and lost frames; its bytes and where each of its frames ends, found by the
/// frames' own bytes.
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

/// Recovers these bytes: the frames that come back, and how many are lost among them. Nothing where it is refused.
fn recovered(folder: &Folder, bytes: &[u8]) -> Option<(Vec<Vec<u8>>, u64)> {
    let (cut, new) = (folder.0.join("cut.mcap"), folder.0.join("new.mcap"));
    fs::write(&cut, bytes).unwrap();
    let done = run(&["recover", cut.to_str().unwrap(), "-o", new.to_str().unwrap(), "--force"]);
    let code = done.status.code();
    assert!(code == Some(0) || code == Some(1), "{code:?}: {}", said(&done));
    if code == Some(1) {
        return None;
    }
    frames_of(&new)
}

fn frames_of(path: &Path) -> Option<(Vec<Vec<u8>>, u64)> {
    // One that was cut off before it said what it is has nothing to read.
    let mut source = McapSource::open(path, None).ok()?;
    let (mut frames, mut lost) = (Vec::new(), 0);
    loop {
        match source.next().unwrap() {
            Item::Frame { bytes, .. } => frames.push(bytes.to_vec()),
            Item::Lost { frames, .. } => lost += frames,
            Item::End => return Some((frames, lost)),
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

/// A frame that comes back is one that was recorded, in its order and in its place: never a wrong one.
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
