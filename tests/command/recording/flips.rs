//! Flips bits of a recording's record headers, one at a time. Two rules hold for every one of them.
//!
//! - Frames found and frames reported missing are all frames that were recorded, or the exit code is not 0.
//! - `wstac run` reads what `wstac recover` wrote with exit code 0, and a second recovery changes nothing.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use wstac_tests::command::says;
use wstac_tests::folder::Folder;
use wstac_tests::random::Random;

use super::several_damage::{check_frames, stream};
use super::{good, run, said};

/// Bytes of an operation code and a length.
const HEAD: usize = 9;
/// Bytes of a chunk's header whose compression has an empty name.
const CHUNK_HEADER: usize = 40;
/// Bytes of a message before its data.
const MESSAGE_HEADER: usize = 22;

/// Returns the places of all bytes of record headers: codes and lengths, and the headers of chunks and messages.
fn header_bytes(bytes: &[u8]) -> Vec<usize> {
    let (mut at, mut found) = (8, (0..8).collect::<Vec<_>>());
    while at + HEAD <= bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + HEAD].try_into().unwrap()) as usize;
        let header = match bytes[at] {
            6 => CHUNK_HEADER,
            5 => MESSAGE_HEADER,
            _ => 0,
        };
        found.extend(at..at + HEAD + header);
        // Records of a chunk follow its header.
        at += HEAD + if bytes[at] == 6 { CHUNK_HEADER } else { length };
        if bytes[at..] == *b"\x89MCAP0\r\n" {
            found.extend(at..bytes.len());
            break;
        }
    }
    found
}

/// Returns the number of frames and of lost frames of a run with features. The end record's `frames` has both.
pub(super) fn ended(lines: &[u8]) -> (u64, u64) {
    let text = String::from_utf8_lossy(lines);
    let end: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    assert_eq!(end["kind"], "end");
    let found = text.matches(r#""kind":"features""#).count() as u64;
    let (all, lost) = (end["frames"].as_u64().unwrap(), end["dropped"].as_u64().unwrap());
    // Frames that are counted and neither there nor reported missing make a sum that was never recorded.
    if all == found + lost { (found, lost) } else { (found, u64::MAX - all) }
}

/// The outcome of a recovery of a damaged recording.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Flips after which the recording could still be run, and after which all of it could be recovered.
    pub(super) run: AtomicUsize,
    pub(super) recovered: AtomicUsize,
    /// Frames that came back and that were reported missing.
    frames: AtomicUsize,
    missing: AtomicUsize,
}

/// Checks both rules for a damaged recording, which had this many frames and lost frames when it was recorded.
pub(super) fn check(folder: &Path, damaged: &[u8], recorded: (u64, u64), tally: &Tally) -> Result<(), String> {
    let [old, new, again] = ["old.mcap", "new.mcap", "again.mcap"].map(|name| folder.join(name));
    fs::write(&old, damaged).unwrap();
    let [old, new, again] = [&old, &new, &again].map(|path| path.to_str().unwrap());
    let all = recorded.0 + recorded.1;
    let accounts = |what: &str, (frames, dropped): (u64, u64)| {
        if frames.checked_add(dropped) == Some(all) && dropped >= recorded.1 {
            return Ok(());
        }
        Err(format!("{what} exits 0 with {frames} frames and {dropped} lost, recorded were {recorded:?}"))
    };
    let direct = run(&["run", old, "--json", "--features"]);
    match direct.status.code() {
        Some(0) => {
            accounts("run", ended(&direct.stdout))?;
            tally.run.fetch_add(1, Ordering::Relaxed);
        }
        Some(1) => {}
        code => return Err(format!("run ends with {code:?}: {}", said(&direct))),
    }
    let recovery = run(&["recover", old, "-o", new, "--force"]);
    match recovery.status.code() {
        Some(0) => {}
        Some(1) => return Ok(()),
        code => return Err(format!("recover ends with {code:?}: {}", said(&recovery))),
    }
    let replayed = run(&["run", new, "--json", "--features"]);
    if replayed.status.code() != Some(0) {
        return Err(format!("run of a recovery that exits 0 fails: {}", said(&replayed)));
    }
    let found = ended(&replayed.stdout);
    accounts("recover", found)?;
    tally.recovered.fetch_add(1, Ordering::Relaxed);
    tally.frames.fetch_add(found.0 as usize, Ordering::Relaxed);
    tally.missing.fetch_add((found.1 - recorded.1) as usize, Ordering::Relaxed);
    let second = run(&["recover", new, "-o", again, "--force"]);
    if second.status.code() != Some(0) {
        return Err(format!("a second recovery fails: {}", said(&second)));
    }
    if fs::read(new).unwrap() != fs::read(again).unwrap() {
        return Err("a second recovery is another file".to_owned());
    }
    Ok(())
}

/// Makes a small recording with an event and lost frames with these options, and returns its frames and lost frames,
/// too.
pub(super) fn small(folder: &Folder, options: &[&str]) -> (Vec<u8>, (u64, u64)) {
    let text = "specimen = \"Saw3\"\nspeed = 150\n[sensor]\nsize = [40, 40]\ndropped = 0.03\n";
    let (scene, file) = (folder.scene("s.toml", text), &*folder.path("a.mcap"));
    good(&[&["record", &scene, "-o", file, "--force"], options].concat());
    let recorded = ended(good(&["run", file, "--json", "--features"]).as_bytes());
    assert!(recorded.0 > 120 && recorded.1 > 2, "{recorded:?}");
    (fs::read(file).unwrap(), recorded)
}

/// Recovers a file, which must succeed, to `new.mcap`, and that once more, which must change nothing. Returns the
/// messages, and what `run` prints of the new file.
pub(super) fn recovered_twice(folder: &Folder, old: &str) -> (String, String) {
    let [new, again] = ["new.mcap", "again.mcap"].map(|name| folder.path(name));
    let messages = says(&run(["recover", old, "-o", &new, "--force"]), 0, &[]);
    good(&["recover", &new, "-o", &again, "--force"]);
    assert!(fs::read(&new).unwrap() == fs::read(&again).unwrap(), "a second recovery is another file");
    (messages, good(&["run", &new, "--json", "--features"]))
}

/// The exit codes of `run` and `recover`, and what they say.
#[derive(Debug)]
pub(super) struct Outcome {
    pub(super) run: Option<i32>,
    pub(super) recover: Option<i32>,
    pub(super) said: String,
    /// The frames and lost frames of what was recovered, if it can be read.
    pub(super) found: Option<(u64, u64)>,
}

/// Runs and recovers these bytes.
pub(super) fn outcome(folder: &Folder, bytes: &[u8]) -> Outcome {
    let [old, new] = ["x.mcap", "y.mcap"].map(|name| folder.path(name));
    fs::write(&old, bytes).unwrap();
    let _ = fs::remove_file(&new);
    let direct = run(["run", &old, "--json", "--features"]);
    let recovery = run(["recover", &old, "-o", &new]);
    let replayed = run(["run", &new, "--json", "--features"]);
    let found = replayed.status.success().then(|| ended(&replayed.stdout));
    let said = [said(&direct), said(&recovery)].concat();
    Outcome { run: direct.status.code(), recover: recovery.status.code(), said, found }
}

/// Flips some of the bits, by chance but always the same ones. `ci/long flips` flips 10,000.
#[test]
fn no_flipped_bit_of_a_header_loses_a_frame_in_silence() {
    let count = std::env::var("WSTAC_LONG_FLIPS").map_or(44, |count| count.parse().unwrap());
    let folder = Folder::new("recording-flips");
    let (bytes, recorded) = small(&folder, &[]);
    let headers = header_bytes(&bytes);
    let truth = stream(&folder.0.join("a.mcap"), None).unwrap();
    let mut random = Random::new(18);
    // A third of them are in codes and lengths of records outside of messages, which are few.
    let codes: Vec<usize> = headers.iter().copied().filter(|&at| at < 3000 || at + 3000 > bytes.len()).collect();
    let flips: Vec<(usize, u8)> = (0..count)
        .map(|number| {
            // The magic and the head of the first record come first.
            if number < 34 {
                return (number / 2, (number % 2 * 6) as u8);
            }
            let from = if number % 3 == 0 { &codes } else { &headers };
            (from[random.below(from.len() as u64) as usize], random.below(8) as u8)
        })
        .collect();
    let (tally, failures) = (Tally::default(), std::sync::Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for half in 0..2 {
            let (flips, tally, failures, bytes, truth) = (&flips, &tally, &failures, &bytes, &truth);
            scope.spawn(move || {
                let folder = Folder::new(&format!("recording-flips-{half}"));
                let new = folder.0.join("new.mcap");
                for &(at, bit) in flips.iter().skip(half).step_by(2) {
                    let mut damaged = bytes.clone();
                    damaged[at] ^= 1 << bit;
                    let checked = check(&folder.0, &damaged, recorded, tally).and_then(|()| match stream(&new, None) {
                        Some(found) => check_frames(&found, truth),
                        None => Ok(()),
                    });
                    if let Err(why) = checked {
                        failures.lock().unwrap().push(format!("bit {bit} of byte {at}: {why}"));
                    }
                }
            });
        }
    });
    println!("{count} flips, {tally:?}");
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{} of {count} flips:\n{}", failures.len(), failures.join("\n"));
    // An error for everything would be no recovery.
    let recovered = tally.recovered.into_inner();
    assert!(recovered * 100 >= count * 98, "{recovered} of {count} flips recovered");
    let (frames, missing) = (tally.frames.into_inner(), tally.missing.into_inner());
    assert!(missing <= recovered, "{missing} frames of {frames} missing: at most one a flip");
}

/// Recordings of every kind are the same stream. Both rules hold for bits and cuts anywhere in them, and no frame is
/// another one.
#[test]
fn damage_anywhere_is_accounted_for() {
    let folder = Folder::new("recording-flips-anywhere");
    let [whole, cut, new] = ["a.mcap", "cut.mcap", "new.mcap"].map(|name| folder.0.join(name));
    let (mut random, mut plain) = (Random::new(7), None);
    let anywhere = std::env::var("WSTAC_LONG_FLIPS").map_or(8, |count| count.parse::<usize>().unwrap() / 20);
    for options in [&[][..], &["--crop=0"], &["--features-only"], &["--compress=zstd"], &["--compress=lz4"]] {
        let (bytes, recorded) = small(&folder, options);
        let (truth, lines) =
            (stream(&whole, None).unwrap(), good(&["run", whole.to_str().unwrap(), "--json", "--features"]));
        let (size, expected) = plain.get_or_insert((bytes.len(), lines.clone()));
        let is_small = !options.concat().contains("compress") || bytes.len() < *size * 9 / 10;
        assert!(lines == *expected && is_small, "{options:?}: {} bytes", bytes.len());
        let recover = |old: &Path| run(&["recover", old.to_str().unwrap(), "-o", new.to_str().unwrap(), "--force"]);
        assert!(recover(&whole).status.success() && fs::read(&new).unwrap() == bytes, "{options:?}: another file");
        let tally = Tally::default();
        for number in 0..anywhere {
            // Bits of the description and of the first moments, and bits anywhere.
            let most = if number % 3 == 0 { 6000.min(bytes.len()) } else { bytes.len() };
            let (at, bit) = (random.below(most as u64) as usize, random.below(8));
            let mut damaged = bytes.clone();
            damaged[at] ^= 1 << bit;
            let checked = check(&folder.0, &damaged, recorded, &tally);
            let checked =
                checked.and_then(|()| stream(&new, None).map_or(Ok(()), |found| check_frames(&found, &truth)));
            checked.unwrap_or_else(|why| panic!("{options:?}, bit {bit} of {at}: {why}"));
        }
        assert!(tally.recovered.into_inner() >= anywhere * 7 / 8, "{options:?}");
        for cut_off in (1..20).step_by(4) {
            // A file that ends early is recovered up to its end, but for the last frames.
            let length = bytes.len() * cut_off / 20;
            fs::write(&cut, &bytes[..length]).unwrap();
            let Some(0) = recover(&cut).status.code() else { continue };
            let found = ended(good(&["run", new.to_str().unwrap(), "--json", "--features"]).as_bytes());
            let expected = (recorded.0 * length as u64 / bytes.len() as u64).saturating_sub(40);
            assert!(found.0 >= expected, "{options:?}: {found:?} of {recorded:?} after {cut_off} twentieths");
        }
    }
}

/// Returns a finished recording whose index has another length of the first chunk, and a right checksum.
fn with_indexed_length(bytes: &[u8], length: u64) -> Vec<u8> {
    let footer = bytes.len() - 37;
    let start = u64::from_le_bytes(bytes[footer + 9..footer + 17].try_into().unwrap()) as usize;
    let mut at = start;
    while bytes[at] != 8 {
        at += HEAD + u64::from_le_bytes(bytes[at + 1..at + HEAD].try_into().unwrap()) as usize;
    }
    let mut damaged = bytes.to_vec();
    damaged[at + HEAD + 24..at + HEAD + 32].copy_from_slice(&length.to_le_bytes());
    let sum = wstac_core::crc::crc32(damaged[start..footer + HEAD + 16].iter().copied());
    damaged[footer + HEAD + 16..footer + HEAD + 20].copy_from_slice(&sum.to_le_bytes());
    damaged
}

/// An index has a checksum of its own, and may still say anything.
#[test]
fn a_length_in_the_index_is_not_believed() {
    let folder = Folder::new("recording-index");
    let (bytes, recorded) = small(&folder, &[]);
    for length in [u64::MAX, u64::MAX - 2000, 1 << 63, 1 << 40, 60, 0] {
        let outcome = outcome(&folder, &with_indexed_length(&bytes, length));
        assert!(matches!(outcome.run, Some(0 | 1)), "{length}: {}", outcome.said);
        assert_eq!(outcome.recover, Some(0), "{length}: {}", outcome.said);
        assert_eq!(outcome.found, Some(recorded), "{length}: {}", outcome.said);
    }
}

/// Every recording that the fuzzer starts with is read as far as it is whole.
///
/// With `WSTAC_WRITE_SEEDS=1` it makes those of today's recordings anew.
#[test]
fn seeds_of_the_fuzzer_are_recordings() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/recording");
    let folder = Folder::new("recording-seeds");
    if std::env::var_os("WSTAC_WRITE_SEEDS").is_some() {
        let made = |name: &str, options: &[&str]| {
            let file = folder.0.join(name);
            let short = ["record", "scene:Saw3@150", "--size", "24x24", "--frames", "4", "-o", file.to_str().unwrap()];
            good(&[&short[..], options].concat());
            fs::read(&file).unwrap()
        };
        let plain = made("plain", &[]);
        for (name, bytes) in [
            ("zstd", made("zstd", &["--compress=zstd"])),
            ("lz4", made("lz4", &["--compress=lz4"])),
            ("index", with_indexed_length(&plain, u64::MAX)),
        ] {
            fs::write(seeds.join(name), [&[0][..], &bytes].concat()).unwrap();
        }
    }
    let mut names = Vec::new();
    for entry in fs::read_dir(&seeds).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let bytes = fs::read(&path).unwrap();
        assert!(bytes.len() <= 16_384, "{name}: the fuzzer takes at most 16 KiB");
        let outcome = outcome(&folder, &bytes[1..]);
        assert_eq!(outcome.run, Some(i32::from(name == "cut")), "{name}: {}", outcome.said);
        assert_eq!(outcome.recover, Some(0), "{name}: {}", outcome.said);
        assert!(outcome.found.is_some_and(|(frames, _)| frames > 0), "{name}: {outcome:?}");
        names.push(name);
    }
    names.sort();
    assert_eq!(names, ["crop", "cut", "grey", "index", "lz4", "sums", "yuv", "zstd"]);
}
