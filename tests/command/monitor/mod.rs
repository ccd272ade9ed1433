//! Tests `wstac monitor`: it prints what a board sends exactly as `wstac run` prints the same frames. The board is
//! behind a serial line, TCP, a pipe or a file.

pub(crate) mod board;
mod pictures;
mod settings;

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::os::fd::AsRawFd;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use serde_json::Value;
use wstac_core::trigger::{InterruptedSample, StreamEnd};
use wstac_core::wire::{Decoder, Fault, LONGEST, Message, Request, Text};
use wstac_host::model_file::ModelFile;
use wstac_tests::command::{good, printed, refusal, run, said, start};
use wstac_tests::folder::Folder;
use wstac_tests::trained::model;

/// Two slides with lost frames, from a camera at twice the nominal rate.
const SCENE: &str = "seed = 3
[sensor]
size = [100, 100]
fps = 60
dropped = 0.05
[[slide]]
specimen = \"Saw3\"
speed = 150
[[slide]]
specimen = \"Sin2\"
speed = 60
direction = 90
";

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Returns a folder with the scene file, and the scene's name for `wstac`.
fn scene(name: &str) -> (Folder, String) {
    let folder = Folder::new(name);
    let scene = format!("scene:{}", path(&folder.file("scene.toml", SCENE)));
    (folder, scene)
}

/// Opens a pseudo-terminal. Returns the board's end, and the path of the host's end.
fn pty() -> (File, PathBuf) {
    // No child inherits a file opened like this, so the line is gone when it is dropped.
    let board = File::options().read(true).write(true).open("/dev/ptmx").unwrap();
    let mut name = [0_u8; 64];
    // SAFETY: the descriptor is open, and the place for the name as long as is said.
    let made = unsafe {
        libc::unlockpt(board.as_raw_fd()) | libc::ptsname_r(board.as_raw_fd(), name.as_mut_ptr().cast(), name.len())
    };
    assert_eq!(made, 0);
    let name = name.split(|&byte| byte == 0).next().unwrap();
    (board, PathBuf::from(text(name)))
}

/// Waits for these requests. Until the host has opened the line, reads fail.
fn wait_for(board: &mut impl Read, expected: &[Request]) {
    let mut decoder = Decoder::<16>::new();
    let mut left = expected.iter();
    let mut next = left.next();
    while let Some(request) = next {
        let mut byte = [0];
        match board.read(&mut byte) {
            Ok(1) => {
                if let Some(received) = decoder.push::<Request>(byte[0]) {
                    assert_eq!(received.unwrap().message, *request);
                    next = left.next();
                }
            }
            _ => std::thread::yield_now(),
        }
    }
}

const ALL: [Request; 4] = [Request::Hello, Request::Features(true), Request::Samples(true), Request::Motion(true)];

/// Returns the lines of `wstac run`, and every message that a board sends for the same scene, with features,
/// samples and motion.
fn both(scene: &str) -> (Vec<String>, Vec<Vec<u8>>) {
    let lines = good(&[&["run", scene][..], &WANTED].concat());
    (lines.lines().map(str::to_owned).collect(), board::sent(scene, &[], true).frames)
}

const WANTED: [&str; 4] = ["--json", "--features", "--samples", "--motion"];

#[test]
fn every_line_is_that_of_run() {
    let (folder, scene) = scene("monitor-lines");
    let (early, late) = (model(&folder, "early", 30, 29, "Fla,Saw"), Path::new("builtin:svm").to_owned());
    let files = [&late, &early].map(|file| ModelFile::open(file).unwrap());
    let with_models = ["--model", path(&late), "--model", path(&early)];
    for (files, models) in [(&[][..], &[][..]), (&files, &with_models)] {
        for (all, wanted) in [(false, &["--json"][..]), (true, &WANTED), (false, &[]), (true, &["--features"])] {
            let expected = good(&[&["run", &scene], models, wanted].concat());
            let file = folder.file("board.bin", board::sent(&scene, files, all).frames.concat());
            assert_eq!(good(&[&["monitor", path(&file)], wanted].concat()), expected);
            // Output that was not requested is not printed, even if the board sends it.
            let file = folder.file("board.bin", board::sent(&scene, files, true).frames.concat());
            assert_eq!(good(&[&["monitor", path(&file)], wanted].concat()), expected);
            // The scene covers everything that could go wrong: events, lost frames and textures.
            let json = wanted.first() == Some(&"--json");
            assert!(expected.lines().count() > 2, "{expected}");
            assert!(
                !json || expected.contains(r#""kind":"event""#) && !expected.contains(r#""dropped":0"#),
                "{expected}"
            );
            let has_motion = expected.contains(r#""kind":"motion""#);
            assert_eq!(has_motion, wanted.contains(&"--motion"), "{expected}");
            assert_eq!(json && expected.contains(r#""kind":"texture""#), json && !models.is_empty(), "{expected}");
        }
    }
}

#[test]
fn a_serial_line_is_asked_and_read() {
    let (_folder, scene) = scene("monitor-line");
    let (lines, frames) = both(&scene);
    let (mut board, name) = pty();
    let monitor = start(&[&["monitor", path(&name), "--baud", "921600"], &WANTED[..]].concat());
    wait_for(&mut board, &ALL);
    board.write_all(b"boot: \xFF\x01\x80 115200 8N1\r\n").unwrap();
    board.write_all(&frames.concat()).unwrap();
    let done = monitor.wait_with_output().unwrap();
    assert_eq!(printed(&done).lines().collect::<Vec<_>>(), lines);
    let stderr = said(&done);
    assert!(
        stderr.contains("test-board 1.2.3: 100x100 Gray at 60 frames per second, baseline of 25 frames"),
        "{stderr}"
    );
    assert!(!stderr.contains("damaged") && !stderr.contains("messages lost"), "{stderr}");
    // The host repeats its requests when a board starts.
    wait_for(&mut board, &ALL[1..]);
}

#[test]
fn a_tcp_connection_is_asked_and_read_to_its_end() {
    let (_folder, scene) = scene("monitor-tcp");
    let (mut lines, mut frames) = both(&scene);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let name = format!("tcp:{}", listener.local_addr().unwrap());
    let monitor = start(&[&["monitor", &name], &WANTED[..]].concat());
    let (mut board, _) = listener.accept().unwrap();
    wait_for(&mut board, &ALL);
    // The board's own end is left out: the last status before it covers all frames.
    frames.pop();
    board.write_all(&frames.concat()).unwrap();
    // The host repeats its requests when a board starts. If they stayed unread, the connection would end as broken.
    wait_for(&mut board, &ALL[1..]);
    drop(board);
    let done = monitor.wait_with_output().unwrap();
    let out = printed(&done);
    let end = lines.pop().unwrap();
    let (events, own_end) = out.trim_end().rsplit_once('\n').unwrap();
    assert_eq!(events.lines().collect::<Vec<_>>(), lines);
    assert_eq!(own_end, end);
}

#[test]
fn garbage_and_damage_cost_what_they_hit_and_no_more() {
    let (folder, scene) = scene("monitor-damage");
    let (mut lines, mut frames) = both(&scene);
    // Feature frames 40, 42 and 50 are damaged. Each is a line of its own, and the hello comes before all of them.
    let at = |frames: &[Vec<u8>], number: u64| {
        let is = |bytes: &Vec<u8>| {
            let mut decoder = Decoder::<LONGEST>::new();
            bytes.iter().any(|&byte| {
                matches!(decoder.push::<Message>(byte), Some(Ok(found))
                    if matches!(found.message, Message::Features { frame, .. } if frame == number))
            })
        };
        frames.iter().position(is).unwrap()
    };
    let (first, second, third) = (at(&frames, 40), at(&frames, 42), at(&frames, 50));
    frames[first][9] ^= 0x40;
    frames[second].truncate(12);
    frames[third].clear();
    let garbage: Vec<u8> = (0..3000_u32).map(|n| ((n * 7919) >> 3) as u8).collect();
    let quiet = at(&frames, 55);
    frames.insert(quiet, garbage);
    lines
        .retain(|line| ![40, 42, 50].iter().any(|n| line.starts_with(&format!(r#"{{"kind":"features","frame":{n},"#))));
    let file = folder.file("board.bin", [&b"garbage\0\x01\0"[..], &frames.concat()].concat());
    let done = run(&[&["monitor", path(&file)], &WANTED[..]].concat());
    assert_eq!(printed(&done).lines().collect::<Vec<_>>(), lines);
    let stderr = said(&done);
    assert_eq!(stderr.matches("wstac: 1 damaged message, 1 message lost\n").count(), 2, "{stderr}");
    assert_eq!(stderr.matches("wstac: 1 message lost\n").count(), 1, "{stderr}");
    // Two damaged messages, and the garbage.
    assert_eq!(stderr.matches("damaged").count(), 3, "{stderr}");
}

#[test]
fn a_host_may_come_in_the_middle() {
    let (folder, scene) = scene("monitor-middle");
    let (lines, frames) = both(&scene);
    let bytes = frames.concat();
    for start in [1, 1000, bytes.len() / 2, bytes.len() - 900] {
        let file = folder.file("board.bin", &bytes[start..]);
        let done = run(&[&["monitor", path(&file)], &WANTED[..]].concat());
        let out = printed(&done);
        let found: Vec<_> = out.lines().collect();
        // An event has no sample if the host connected after the sample's start, and no times if the hello is lost.
        let whole = |line: &str| {
            let mut record: Value = serde_json::from_str(line).unwrap();
            let fields = record.as_object_mut().unwrap();
            fields.retain(|key, _| !["sample", "time_s", "completed_s"].contains(&&key[..]));
            record
        };
        let (times, none) = (out.matches(r#""time_s":"#).count(), out.matches(r#""time_s":null"#).count());
        assert_eq!(none, if said(&done).contains("test-board 1.2.3") { 0 } else { times }, "{out}");
        let tail = &lines[lines.len() - found.len()..];
        assert!(
            found.len() > 1 && found.iter().zip(tail).all(|(line, expected)| whole(line) == whole(expected)),
            "{out}"
        );
        assert_eq!(found.last(), lines.last().map(String::as_str).as_ref());
        assert!(!said(&done).contains("damaged"), "{}", said(&done));
    }
}

#[test]
fn a_device_that_is_gone_is_waited_for() {
    let folder = Folder::new("monitor-gone");
    let link = folder.0.join("device");
    let (mut board, name) = pty();
    symlink(name, &link).unwrap();
    let mut monitor = start(&["monitor", path(&link), "--json"]);
    let mut stderr = BufReader::new(monitor.stderr.take().unwrap()).lines().map(Result::unwrap);
    let requests = [Request::Hello, Request::Features(false), Request::Samples(false)];
    wait_for(&mut board, &requests);
    drop(board);
    let device = path(&link);
    assert_eq!(stderr.next().unwrap(), format!("wstac: {device} is gone; waiting for it"));
    let (mut board, name) = pty();
    let new = folder.0.join("new");
    symlink(name, &new).unwrap();
    std::fs::rename(new, &link).unwrap();
    assert_eq!(stderr.next().unwrap(), format!("wstac: {device} is back"));
    wait_for(&mut board, &requests);
    let mut stream = StreamEnd::new(300);
    stream.baseline_complete = true;
    stream.incomplete = Some(InterruptedSample::new(280, 20));
    let mut sent = board::Sent { frames: Vec::new() };
    sent.push(&Message::Status { stream, dropped: 5 });
    sent.push(&Message::Fault(Fault::LastRun(Text::new("a panic"))));
    sent.push(&Message::Lost { frames: 2 });
    board.write_all(&sent.frames.concat()).unwrap();
    assert!(stderr.next().unwrap().contains("the baseline was not quiet"));
    assert!(stderr.next().unwrap().contains("it started again because of: a panic"));
    assert!(stderr.next().unwrap().contains("2 frames lost by the board"));
    // SAFETY: sends a signal to the child, which has not been waited for.
    assert_eq!(unsafe { libc::kill(monitor.id() as i32, libc::SIGINT) }, 0);
    let mut out = String::new();
    monitor.stdout.take().unwrap().read_to_string(&mut out).unwrap();
    let incomplete = r#"{"frame":280,"frames":20}"#;
    let end = r#"{"kind":"end","frames":300,"dropped":7,"baseline":"complete","incomplete":"#;
    assert_eq!(out, format!("{end}{incomplete}}}\n"));
    assert_eq!(monitor.wait().unwrap().code(), Some(0));
}

#[test]
fn what_is_no_board_of_this_version_is_refused() {
    let folder = Folder::new("monitor-refused");
    let refused = |bytes: &[u8], expected: &str| {
        let stderr = refusal(&["monitor", path(&folder.file("board.bin", bytes)), "--json"]);
        assert!(stderr.contains(expected), "{stderr}");
    };
    refused(&[], "has no message");
    refused(&[0x55; 100], "has no message");
    refused(b"\x05noise\0".repeat(30).as_slice(), "is it the right port");
    // A message of version 4, and one of version 2, with arbitrary content and a correct CRC.
    let newer = [0, 8, 4, 5, 6, 0xBE, 0x20, 0x5C, 0x6C, 0];
    refused(&newer, "speaks version 4 of the link, expected 3: it is newer than this wstac");
    let older = [0, 8, 2, 5, 6, 0x0C, 0x5C, 0xD1, 0x68, 0];
    refused(&older, "speaks version 2 of the link, expected 3: it is older than this wstac");
    for (arguments, status) in [
        (&["monitor"][..], 2),
        (&["monitor", "-", "--baud", "0"], 2),
        (&["monitor", "-", "--samples"], 2),
        (&["monitor", "-", "--baud", "9600"], 2),
        (&["monitor", "/"], 2),
        (&["monitor", "/no/such/device"], 1),
        (&["monitor", "tcp:nowhere"], 1),
    ] {
        assert_eq!(run(arguments).status.code(), Some(status), "{arguments:?}");
    }
}
