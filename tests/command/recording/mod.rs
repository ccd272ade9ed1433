//! Tests `wstac record`, `wstac recover` and recordings as sources. A recording replays the same stream, whatever
//! happens to the file.

mod before;
mod compressed;
mod cuts;
mod flips;
mod guide;
mod limits;
mod moved;
mod parts;
mod several;
mod several_damage;
mod several_end;
mod stream;
mod taken_away;
mod times;
mod touched;

use std::fs;
use std::io::Write;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};

use wstac_tests::command::{Signal, assert_has, ends, good, prints, program, run, run_script, said, says, send, wstac};
use wstac_tests::folder::{Folder, text};

/// Writes a scene of a slide that loses frames, in this format, and returns its name for `wstac`.
fn scene(folder: &Folder, format: &str) -> String {
    let text = format!(
        "specimen = \"Saw3\"\nspeed = 150\nseed = 5\n[sensor]\nsize = [240, 180]\nformat = \"{format}\"\ndropped = 0.03\n"
    );
    folder.scene(&format!("{format}.toml"), text)
}

/// `wstac run` prints the same for a recording as it prints without one, byte for byte. While recording, the same
/// events are printed.
#[test]
fn every_kind_of_format_replays_to_the_byte() {
    let folder = Folder::new("recording-formats");
    for format in ["GREY", "YUYV", "NV12", "Y10", "Y16", "RGGB", "RGBP", "MJPG"] {
        let (scene, file) = (scene(&folder, format), &*folder.path(&format!("{format}.mcap")));
        let model = ["--model", "builtin:svm", "--json"];
        let live = good(&[&["run", &scene, "--features"], &model[..]].concat());
        let recorded = good(&[&["record", &scene, "-o", file, "--label", "specimen=Saw3"], &model[..]].concat());
        let replayed = good(&[&["run", file, "--features"], &model[..]].concat());
        assert!(live.contains(r#""kind":"event""#) && !live.contains(r#""dropped":0,"#), "{format}: {live}");
        assert!(live == replayed, "{format}: the replay differs from the run");
        let events =
            |lines: &str| lines.lines().filter(|line| !line.contains("features")).collect::<Vec<_>>().join("\n");
        assert_eq!(events(&live), events(&recorded), "{format}");
        if !["GREY", "MJPG"].contains(&format) {
            continue;
        }
        // A recording of a recording is equal to it.
        let again = &*folder.path("again.mcap");
        assert_eq!(good(&[&["record", file, "-o", again, "--force"], &model[..]].concat()), recorded, "{format}");
        assert!(live == good(&[&["run", again, "--features"], &model[..]].concat()), "{format}: again");
    }
}

#[test]
fn the_configuration_is_the_recordings_own_unless_another_is_given() {
    let folder = Folder::new("recording-configuration");
    let (scene, file) = (scene(&folder, "GREY"), &*folder.path("a.mcap"));
    let config = "[trigger]\nwindow = 8\nbacktrack = 12\n[features]\nln = \"libm\"\n";
    let config = &*folder.written("c.toml", config);
    good(&["record", &scene, "-o", file, "--config", config]);
    let live = |more: &[&str]| good(&[&["run", &scene, "--json", "--features", "--model", "none"], more].concat());
    assert_eq!(good(&["run", file, "--json", "--features"]), live(&["--config", config]));
    fs::write(config, "").unwrap();
    assert_eq!(good(&["run", file, "--json", "--features", "--config", config]), live(&[]));
    assert_ne!(live(&[]), good(&["run", file, "--json", "--features"]));
}

#[test]
fn nothing_is_written_over_and_nothing_useless_is_written() {
    let folder = Folder::new("recording-new");
    let (file, scene) = (folder.0.join("a.mcap"), "scene:Saw3@150");
    let name = file.to_str().unwrap();
    // The code is 2 for arguments that are wrong whatever the files are.
    let bad = |code: i32, arguments: &[&str], part: &str| ends(arguments, code, &[part]);
    let twice = ["--label", "speed=1", "--label", "speed=2"];
    bad(2, &[&["record", scene, "-o", name][..], &twice].concat(), "speed is \"1\" and \"2\"");
    // Labels that a data set would refuse are refused before anything is recorded.
    bad(2, &["record", scene, "-o", name, "--label", "speed=fast"], "--label: label speed is \"fast\", expected mm/s");
    bad(2, &["record", scene, "-o", name, "--label", "direction=360"], "expected whole degrees, 0 to 359");
    let taxels = folder.scene("t.toml", "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"\n");
    bad(1, &["record", &taxels, "-o", name], "expected fidelity = \"rendered\"");
    bad(2, &["record", "scene:None@1", "-o", name], "None");
    assert!(!file.exists());
    fs::write(&file, "mine").unwrap();
    ends(&["record", scene, "-o", name, "--label", "speed"], 2, &[]);
    good(&["record", scene, "-o", name, "--force", "--frames", "10"]);
    prints(&["run", name, "--json"], &[r#""frames":10,"#]);
    // A picture of the source is not overwritten either; outputs.rs tries other sources.
    let pictures = Folder::new("recording-new-pictures");
    let picture = pictures.written("1.png", "a picture");
    bad(2, &["record", text(&pictures.0), "-o", &picture, "--force"], "is an input of the command");
    assert_eq!(fs::read(picture).unwrap(), b"a picture");
}

/// A recovery without a description is readable as MCAP, but not as a recording, and the program says so. A description
/// that is damaged in one place is still there.
#[test]
fn a_recovery_without_a_description_is_said() {
    let folder = Folder::new("recording-description");
    let (name, new) = (&*folder.path("a.mcap"), &*folder.path("new.mcap"));
    good(&["record", "scene:Saw3@150", "--size", "40x40", "-o", name, "--frames", "10"]);
    let mut bytes = fs::read(name).unwrap();
    let places: Vec<usize> = (0..10_000).filter(|&at| bytes[at..].starts_with(b"\"size\":[")).collect();
    assert_eq!(places.len(), 2, "it is there twice");
    for (damaged, code) in [(1, 0), (2, 1)] {
        bytes[places[damaged - 1] + 9] ^= 1;
        fs::write(name, &bytes).unwrap();
        let done = run(&["recover", name, "-o", new, "--force"]);
        let said = says(&done, code, &["new.mcap: 10 frames, 0 events"]);
        ends(&["run", new, "--json"], code, &[]);
        assert_eq!(said.contains("has a damaged description"), code == 1, "{said}");
    }
    // A damaged frame is the reason why the baseline is not complete.
    bytes[places[0] + 9] ^= 1;
    let middle = bytes.len() / 2;
    bytes[middle..middle + 9].fill(0x55);
    fs::write(name, &bytes).unwrap();
    let done = run(&["run", name]);
    let printed = said(&done) + &String::from_utf8_lossy(&done.stdout);
    assert!(printed.contains("has a chunk whose bytes") && !printed.contains("baseline"), "{printed}");
}

/// Textures need the models again, so the message names them.
#[test]
fn models_of_a_recording_are_named_where_none_is_given() {
    let folder = Folder::new("recording-models");
    let name = &*folder.path("a.mcap");
    good(&["record", "scene:Saw3@150", "--size", "80x60", "-o", name, "--model", "builtin:svm"]);
    let without = run(&["run", name, "--json"]);
    assert_has(&said(&without), &["recorded with model ", ": --model gives its textures"]);
    assert!(!String::from_utf8_lossy(&without.stdout).contains("Saw"));
    let with = run(&["run", name, "--json", "--model", "builtin:svm"]);
    assert!(!said(&with).contains("recorded with model"), "{}", said(&with));
    assert!(String::from_utf8_lossy(&with.stdout).contains("Saw"));
}

#[test]
fn limits_end_a_recording() {
    let folder = Folder::new("recording-limits");
    let name = &*folder.path("a.mcap");
    let with = |more: &[&str]| {
        good(&[&["record", "scene:Saw3@150", "--size", "40x40", "-o", name, "--force", "--json"], more].concat())
    };
    assert!(with(&["--duration", "1.5"]).contains(r#""frames":45,"#));
    let one = with(&["--events", "1"]);
    assert_eq!(one.matches(r#""kind":"event""#).count(), 1);
    assert!(!one.contains(r#""frames":140,"#), "{one}");
    // It has the whole sample.
    let again = good(&["run", name, "--json", "--samples"]);
    let (line, sample) = again.split_once(r#","sample":"#).unwrap();
    assert!(one.starts_with(line) && sample.matches('[').count() == 11, "{again}");
}

/// The recording continues to its end even if nobody reads its output.
#[test]
fn a_closed_output_does_not_end_a_recording() {
    let folder = Folder::new("recording-closed");
    let file = folder.0.join("a.mcap");
    let mut command = program(wstac());
    command.args(["record", "scene:Saw3@150", "--size", "40x40", "--json", "-o"]).arg(&file).stdout(Stdio::piped());
    let mut child = command.stderr(Stdio::null()).spawn().unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    prints(&["run", file.to_str().unwrap(), "--json"], &[r#""frames":140,"#]);
}

/// Starts to record a pipe, and waits until these frames are in the file. The pipe stays open.
fn piped(file: &Path, frames: usize) -> (Child, ChildStdin) {
    let mut command = program(wstac());
    command.args(["record", "-", "-o"]).arg(file);
    piped_to(command, file, frames, |bytes| has_frames(bytes, frames))
}

/// Returns whether a recording of `piped_to` has this many frames, and the checksum of the last. They are written as
/// they come, so they are in the file before it has an end.
fn has_frames(bytes: &[u8], frames: usize) -> bool {
    let (last, sum) = (vec![frames as u8 - 1; 8000], br#"{"kind":"sum","#);
    let found = bytes.windows(last.len()).position(|window| window == last);
    found.is_some_and(|at| bytes[at..].windows(sum.len()).any(|window| window == sum))
}

/// Starts a recorder of standard input, gives it these frames, and waits until they are in the file.
fn piped_to(mut command: Command, file: &Path, frames: usize, is_there: impl Fn(&[u8]) -> bool) -> (Child, ChildStdin) {
    command.stdin(Stdio::piped());
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(b"YUV4MPEG2 W100 H80 F30:1 Cmono\n").unwrap();
    for frame in 0..frames {
        stdin.write_all(b"FRAME\n").unwrap();
        stdin.write_all(&vec![frame as u8; 8000]).unwrap();
    }
    stdin.write_all(b"FRAME\nhalf").unwrap();
    while !fs::read(file).is_ok_and(|bytes| is_there(&bytes)) {
        std::thread::sleep(std::time::Duration::from_millis(20));
        assert!(child.try_wait().unwrap().is_none(), "it ended");
    }
    (child, stdin)
}

#[test]
fn a_killed_recording_comes_back() {
    let folder = Folder::new("recording-killed");
    let (name, new) = (&*folder.path("a.mcap"), &*folder.path("whole.mcap"));
    let (mut child, _open) = piped(name.as_ref(), 40);
    child.kill().unwrap();
    child.wait().unwrap();
    ends(&["run", name], 1, &["was not finished: wstac recover"]);
    ends(&["recover", name, "-o", new], 0, &["whole.mcap: 40 frames, 0 events"]);
    prints(&["run", new, "--json"], &[r#"{"kind":"end","frames":40,"dropped":0,"#]);
}

/// An old recording stays until the new one is whole, and a new one that was killed can be recovered.
#[test]
fn force_replaces_a_recording_at_its_end() {
    let folder = Folder::new("recording-force");
    let (name, beside, new_name) =
        (&*folder.written("a.mcap", "old"), folder.0.join("a.mcap.new"), &*folder.path("new.mcap"));
    let forced = |frames| {
        let mut command = program(wstac());
        command.args(["record", "-", "--force", "-o", name]);
        piped_to(command, &beside, frames, |bytes| has_frames(bytes, frames))
    };
    let (mut child, _open) = forced(40);
    assert_eq!(fs::read(name).unwrap(), b"old");
    // Another recorder does not destroy its work.
    let another = ["record", "scene:Saw3@150", "--force", "-o", name, "--frames", "10"];
    ends(&another, 1, &["a.mcap: another wstac is writing it"]);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(fs::read(name).unwrap(), b"old");
    good(&["recover", text(&beside), "-o", new_name]);
    prints(&["run", new_name, "--json"], &[r#"{"kind":"end","frames":40,"dropped":0,"#]);
    fs::remove_file(&beside).unwrap();
    let (mut child, _open) = forced(30);
    send(&child, Signal::INT);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    prints(&["run", name, "--json"], &[r#"{"kind":"end","frames":30,"dropped":0,"#]);
    assert!(!beside.exists());
}

/// Returns the bytes that a file takes on the disk.
fn on_disk(path: &Path) -> u64 {
    path.metadata().unwrap().blocks() * 512
}

/// Room that is reserved for a recording's end is given back: by every recording that ends, by a recovery for its new
/// file, and by a recovery for the old one, whose program was killed.
#[test]
fn no_room_stays_reserved() {
    let folder = Folder::new("recording-room");
    let [whole, killed, new] = ["whole.mcap", "killed.mcap", "new.mcap"].map(|name| folder.0.join(name));
    let [whole_name, killed_name, new_name] = [&whole, &killed, &new].map(|path| text(path));
    good(&["record", "scene:Saw3@150", "-o", whole_name, "--size", "100x100"]);
    let (mut child, _open) = piped(&killed, 40);
    // While it is recorded, nobody takes its room.
    let reserved = on_disk(&killed);
    assert!(run(&["recover", killed_name, "-o", new_name]).status.success());
    assert_eq!(on_disk(&killed), reserved);
    child.kill().unwrap();
    child.wait().unwrap();
    let before = fs::read(&killed).unwrap();
    good(&["recover", killed_name, "-o", new_name, "--force"]);
    assert!(fs::read(&killed).unwrap() == before, "the recording is as it was");
    for path in [&whole, &killed, &new] {
        let (size, used) = (path.metadata().unwrap().len(), on_disk(path));
        assert!(size > 100_000 && used < size + (1 << 20), "{}: {size} bytes, {used} on the disk", path.display());
    }
    // The file system must be able to reserve room, or nothing was tested.
    println!("{} bytes were reserved for a recording of {}", reserved, before.len());
}

/// A recording that cannot start leaves no file, and no advice to recover one. One with little room has what fits.
#[test]
fn a_recording_that_cannot_start_leaves_no_file() {
    let folder = Folder::new("recording-start");
    let before = folder.names();
    let limited = |blocks: u32, options: &str| {
        let script = format!("ulimit -f {blocks}; exec \"$0\" record scene:Saw3@150 --size 60x40 -o a.mcap {options}");
        let done = run_script(&folder, &script);
        let said = says(&done, 1, &[]);
        assert!(!said.contains(".wstac-"), "{said}");
        said
    };
    for (blocks, options) in [(0, ""), (1, "--force"), (1, "--compress lz4")] {
        let text = limited(blocks, options);
        assert!(text.contains("a.mcap: ") && text.contains("nothing was recorded"), "{text}");
        assert!(!text.contains("wstac recover"), "{text}");
        assert_eq!(folder.names(), before, "{options}");
    }
    ends(&["record", "scene:Saw3@150", "--size", "9000x9000", "-o", &folder.path("a.mcap")], 1, &["frames of 77 MB"]);
    assert_eq!(folder.names(), before);
    // A recording of before stays.
    let old = &folder.written("a.mcap", "old");
    limited(0, "--force");
    assert_eq!((folder.names(), fs::read(old).unwrap()), (vec!["a.mcap".to_owned()], b"old".to_vec()));
    fs::remove_file(old).unwrap();
    let text = limited(200, "");
    let (_, after) = text.split_once("the recording ends after ").unwrap();
    let frames: u64 = after.split(' ').next().unwrap().parse().unwrap();
    assert!((40..70).contains(&frames), "{text}");
    let found = flips::ended(good(&["run", old, "--json", "--features"]).as_bytes());
    assert_eq!(found, (frames, 0));
}

#[test]
fn what_is_no_recording_is_said() {
    let folder = Folder::new("recording-foreign");
    let refused = |bytes: &[u8], part: &str| ends(&["run", &folder.written("a.mcap", bytes)], 1, &[part]);
    refused(b"", "expected an MCAP file");
    refused(b"YUV4MPEG2 ", "expected an MCAP file");
    refused(b"\x89MCAP0\r\n", "was not finished");
    // A complete file of another program: header, data end, footer.
    let mut foreign = b"\x89MCAP0\r\n\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0".to_vec();
    foreign.extend(b"\x0F\x04\0\0\0\0\0\0\0\0\0\0\0\x02\x14\0\0\0\0\0\0\0");
    foreign.extend([0; 20]);
    foreign.extend(b"\x89MCAP0\r\n");
    refused(&foreign, "without the metadata of a recording");
}
