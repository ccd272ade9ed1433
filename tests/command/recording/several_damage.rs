//! Damages recordings of several sensors. Whatever comes back of a sensor is where it was, and every answer is right or
//! absent.

use std::fs;
use std::path::Path;

use wstac_host::output::{Output, TactileEvent};
use wstac_host::session::Session;
use wstac_host::source::mcap::McapSource;
use wstac_host::source::{Source, SourceEvent};
use wstac_tests::command::{good, run, said};
use wstac_tests::folder::Folder;
use wstac_tests::random::Random;

use super::cuts::chunks;

/// The names of the sensors, their slides and their rates.
pub(super) const SENSORS: [(&str, &str, u32, u32); 3] =
    [("left", "Saw3", 150, 30), ("middle", "Tri4", 90, 25), ("right", "Sin2", 170, 60)];

/// Two sensors of which the first damage cannot be told apart: a file of before, whose checksums count all frames
/// together.
const BEFORE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/command/recording/before_several.mcap");

/// Records slides of all sensors, two of which lose frames.
pub(super) fn recorded(folder: &Folder, options: &[&str]) -> Vec<u8> {
    let sources = SENSORS.map(|(name, specimen, speed, fps)| {
        let dropped = if name == "middle" { 0.0 } else { 0.03 };
        let text = format!(
            "specimen = \"{specimen}\"\nspeed = {speed}\n[sensor]\nsize = [40, 40]\nfps = {fps}\ndropped = {dropped}\n"
        );
        format!("cam:{name}={}", folder.scene(&format!("{name}.toml"), text))
    });
    let file = &folder.path("whole.mcap");
    good(&[&["record", "-o", file, "--force"], &sources.each_ref().map(String::as_str)[..], options].concat());
    fs::read(file).unwrap()
}

/// The records of a sensor in a file.
pub(super) struct Stream {
    /// Its frames by their numbers; `None` stands for a lost one.
    pub(super) frames: Vec<Option<Vec<u8>>>,
    /// The kinds of its faults.
    pub(super) faults: Vec<String>,
    events: Vec<TactileEvent>,
}

/// Reads a sensor; `None` if the file cannot be read to its end, or has no configuration that can be read.
pub(super) fn stream(file: &Path, name: Option<&str>) -> Option<Stream> {
    let mut source = McapSource::open_sensor(file, name, None).ok()?;
    let (mut frames, mut faults) = (Vec::new(), Vec::new());
    loop {
        match source.next_event().ok()? {
            SourceEvent::Frame(frame) => frames.push(Some(frame.bytes.to_vec())),
            SourceEvent::Taxels(frame) => frames.push(Some(frame.sums.map(u32::to_le_bytes).concat())),
            SourceEvent::Lost { frames: lost, .. } => frames.extend((0..lost).map(|_| None)),
            SourceEvent::Fault(fault) => faults.push(fault.kind.to_string()),
            SourceEvent::End => break,
            other => panic!("{other:?}"),
        }
    }
    // Its configuration may be damaged, too, which no frame shows.
    let session = Session::builder(McapSource::open_sensor(file, name, None).unwrap()).build().ok()?;
    let events = session.filter_map(|output| match output.unwrap() {
        Output::Event(event) => Some(*event),
        _ => None,
    });
    Some(Stream { frames, faults, events: events.collect() })
}

/// Checks that a sensor's frames are those that were recorded, each at its own place.
pub(super) fn check_frames(found: &Stream, whole: &Stream) -> Result<(), String> {
    // If the start is missing, the first frame that was found stands for it.
    let first = found.frames.iter().position(Option::is_some);
    for (number, frame) in found.frames.iter().enumerate() {
        let Some(frame) = frame else { continue };
        let is_there = |at: usize| whole.frames.get(at).is_some_and(|there| there.as_ref() == Some(frame));
        let stands_for_start = Some(number) == first && (number..whole.frames.len()).any(is_there);
        if !is_there(number) && !stands_for_start {
            return Err(format!("frame {number} is another one"));
        }
    }
    Ok(())
}

/// Checks a sensor's frames, and that its answers are right, or said to be not reliable.
fn check(found: &Stream, whole: &Stream) -> Result<(), String> {
    check_frames(found, whole)?;
    for event in &found.events {
        // Of 60 frames per second, two are one frame of features.
        let mut before = found.frames.iter().zip(&whole.frames).take(2 * (event.frame as usize + 70));
        let is_all_there = before.all(|(found, whole)| found == whole);
        let same = whole.events.iter().find(|truth| truth.frame == event.frame);
        if is_all_there && same != Some(event) {
            return Err(format!("nothing is lost before {event:?}, which is none of {:?}", whole.events));
        }
        // A gap within a touch ends its event, and what is left of the touch may be one of its own.
        let truth = same.or_else(|| whole.events.iter().min_by_key(|truth| truth.frame.abs_diff(event.frame)));
        let Some(truth) = truth.filter(|truth| truth.frame.abs_diff(event.frame) < 70) else {
            return Err(format!("an event at frame {} that never was", event.frame));
        };
        let (speed, of_truth) = (event.speed.map(|speed| speed.mm_s), truth.speed.map(|speed| speed.mm_s));
        // A speed has its standard deviation, which is larger where frames were filled.
        let (Ok(speed), Ok(of_truth), true) = (speed, of_truth, event.reliable) else { continue };
        let sd = event.speed.ok().and_then(|speed| speed.sd).unwrap_or(0.0);
        if (speed - of_truth).abs() > (4.0 * sd).max(0.01 * of_truth) {
            return Err(format!("{speed} ± {sd} mm/s, expected {of_truth}"));
        }
    }
    Ok(())
}

/// Damages bytes in one of several ways.
fn damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    let at = random.below(bytes.len() as u64) as usize;
    let most = 1 << (4 + random.below(14));
    let length = (random.below(most) as usize).min(bytes.len() - at);
    match random.below(8) {
        0 => damaged[at] ^= 1 << random.below(8),
        1 => damaged[at..at + length].fill(0),
        2 => damaged[at..at + length].copy_from_slice(&random.bytes(length)),
        3 => drop(damaged.drain(at..at + length)),
        4 => {
            let again = damaged[at..at + length].to_vec();
            drop(damaged.splice(at..at, again));
        }
        5 => sector_moved(&mut damaged, random),
        6 => message_moved(&mut damaged, random),
        _ => {
            // Cut off, and damaged before.
            damaged.truncate(at.max(1000));
            let place = random.below(damaged.len() as u64) as usize;
            damaged[place] ^= 0x55;
        }
    }
    damaged
}

/// Puts one sector of the disk in place of another.
pub(super) fn sector_moved(bytes: &mut [u8], random: &mut Random) {
    let [from, to] = [0; 2].map(|_| random.below(bytes.len() as u64 / 512) as usize * 512);
    bytes.copy_within(from..from + 512, to);
}

/// Puts a message of a chunk before another chunk, whole or with a damaged byte, in place of other bytes or between
/// them.
pub(super) fn message_moved(bytes: &mut Vec<u8>, random: &mut Random) {
    let (chunks, start) = (chunks(bytes), random.below(bytes.len() as u64) as usize);
    // A message of 10 to 65,000 bytes, of one of the first channels.
    let is_message = |window: &[u8]| window[0] == 5 && window[3..9] == [0; 6] && window[9] < 40 && window[10] == 0;
    let Some(from) = bytes[start..].windows(31).position(is_message).map(|at| start + at) else { return };
    let length = 9 + usize::from(u16::from_le_bytes([bytes[from + 1], bytes[from + 2]]));
    let (Some(record), false) = (bytes.get(from..from + length), chunks.is_empty()) else { return };
    let (mut record, at) = (record.to_vec(), chunks[random.below(chunks.len() as u64) as usize]);
    if random.below(2) == 0 {
        record[31.min(length - 1)..][random.below((length - 31.min(length - 1)) as u64) as usize] ^= 0x10;
    }
    let replaced = if random.below(2) == 0 { record.len().min(at) } else { 0 };
    drop(bytes.splice(at - replaced..at, record));
}

#[test]
fn every_answer_of_every_sensor_is_right_or_absent() {
    let count = std::env::var("WSTAC_LONG_DAMAGE").map_or(15, |count| count.parse().unwrap());
    let folder = Folder::new("recording-several-damage");
    let [old, new, again] = &["old.mcap", "new.mcap", "again.mcap"].map(|name| folder.path(name));
    let (mut random, mut whole_ones, mut lost_ones, mut events) = (Random::new(31), 0, 0, 0);
    for options in [&[][..], &["--features-only"], &["--compress", "zstd"]] {
        let mut is_repeated = false;
        let bytes = recorded(&folder, options);
        let truth = SENSORS.map(|(name, ..)| stream(&folder.0.join("whole.mcap"), Some(name)).unwrap());
        assert!(truth.iter().all(|stream| stream.events.len() == 1 && stream.frames.len() > 100));
        assert!(truth[0].frames.iter().any(Option::is_none), "the simulated driver lost frames");
        for number in 0..count {
            fs::write(old, damaged(&bytes, &mut random)).unwrap();
            let done = run(&["recover", old, "-o", new, "--force"]);
            let code = done.status.code();
            assert!(matches!(code, Some(0 | 1)), "{options:?} {number}: {}", said(&done));
            for ((name, ..), truth) in SENSORS.iter().zip(&truth) {
                let Some(found) = stream(new.as_ref(), Some(name)) else {
                    assert_eq!(code, Some(1), "{options:?} {number}: {}", said(&done));
                    continue;
                };
                let context = || format!("{options:?} {number}, {name}: {}", said(&done));
                check(&found, truth).unwrap_or_else(|why| panic!("{why}: {}", context()));
                // Nothing is missing in silence.
                let is_whole = code == Some(0) && said(&done).contains("was finished properly");
                assert!(!is_whole || found.frames.len() == truth.frames.len(), "{}", context());
                whole_ones += usize::from(is_whole);
                lost_ones += usize::from(found.frames != truth.frames);
                events += found.events.len();
            }
            // A recovery of a recovery changes nothing.
            if code == Some(0) && !std::mem::replace(&mut is_repeated, true) {
                good(&["recover", new, "-o", again, "--force"]);
                assert!(fs::read(new).unwrap() == fs::read(again).unwrap(), "{options:?}");
            }
            let _ = fs::remove_file(new);
        }
        assert!(is_repeated, "{options:?}: no damage was recovered");
    }
    println!("{whole_ones} streams whole, {lost_ones} with losses, {events} events");
    assert!(whole_ones > 3 * count && lost_ones > count && events > 3 * count, "{whole_ones} {lost_ones} {events}");
}

/// A file that does not tell the sensors apart is read, and recovered as far as nothing is missing.
#[test]
fn a_file_of_before_is_recovered_up_to_the_first_damage() {
    let folder = Folder::new("recording-several-before");
    let (new, new_name) = (folder.0.join("new.mcap"), &*folder.path("new.mcap"));
    let bytes = fs::read(BEFORE).unwrap();
    let truth = ["left", "right"].map(|name| stream(Path::new(BEFORE), Some(name)).unwrap());
    assert_eq!(truth.each_ref().map(|stream| (stream.frames.len(), stream.events.len())), [(140, 1), (137, 1)]);
    // Whole, it has the same frames with counts of each.
    good(&["recover", BEFORE, "-o", new_name]);
    for (name, truth) in ["left", "right"].iter().zip(&truth) {
        let found = stream(&new, Some(name)).unwrap();
        assert!(found.frames == truth.frames && found.events == truth.events, "{name}");
    }
    let (mut random, mut is_cut) = (Random::new(5), 0);
    for number in 0..20 {
        let old = folder.written("old.mcap", damaged(&bytes, &mut random));
        let done = run(["recover", &old, "-o", new_name, "--force"]);
        for (name, truth) in ["left", "right"].iter().zip(&truth) {
            let Some(found) = stream(&new, Some(name)) else { continue };
            check(&found, truth).unwrap_or_else(|why| panic!("{number}, {name}: {why}: {}", said(&done)));
        }
        is_cut += u32::from(said(&done).contains("nothing says of which sensor"));
        let _ = fs::remove_file(&new);
    }
    assert!(is_cut > 5, "{is_cut}");
}
