//! Tests `wstac monitor`: it prints what a board sends exactly as `wstac run` prints the same frames. The board is
//! behind a serial line, TCP, a pipe or a file.

pub(crate) mod board;
mod learning;
mod models;
mod pictures;
mod settings;

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener};
use std::os::fd::AsRawFd;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::Value;
use wstac_core::paper::trigger::{InterruptedSample, StreamEnd};
use wstac_core::wire::{Decoder, Fault, LONGEST, Message, Request, Text, encode};
use wstac_host::model_file::ModelFile;
use wstac_tests::command::{Signal, assert_has, good, printed, refused, run, said, says, send, start};
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
                    let message = received.unwrap().message;
                    // The board's clock is asked for at any time.
                    if !matches!(message, Request::Time { .. }) {
                        assert_eq!(message, *request);
                        next = left.next();
                    }
                }
            }
            _ => std::thread::yield_now(),
        }
    }
}

/// Returns what a board sends that says these messages.
pub(crate) fn bytes_of(messages: &[Message]) -> Vec<u8> {
    let mut sent = board::Sent { frames: Vec::new() };
    for message in messages {
        sent.push(message);
    }
    sent.frames.concat()
}

const ALL: [Request; 5] =
    [Request::Hello, Request::Features(true), Request::Samples(true), Request::Motion(true), Request::KeepEvents(true)];

/// Returns records without what the link does not say: why frames were lost, and accelerations.
fn as_by_link(records: &str) -> String {
    let mut said = records.to_owned();
    for start in ["\"dropped_by\":{", "\"acceleration\":{"] {
        while let Some(at) = said.find(start) {
            let length = said[at..].find("},").unwrap() + 2;
            said.replace_range(at..at + length, "");
        }
    }
    said
}

/// Returns the lines of `wstac run`, and every message that a board sends for the same scene, with features,
/// samples and motion.
fn both(scene: &str) -> (Vec<String>, Vec<Vec<u8>>) {
    let lines = as_by_link(&good(&[&["run", scene, "--model", "none"][..], &WANTED].concat()));
    (lines.lines().map(str::to_owned).collect(), board::sent(scene, &[], true, false).frames)
}

/// The most starts of a board until their requests fill a connection that nobody reads.
const MOST_STARTS: u32 = 20_000_000;

/// What the link does not say, as JSON and as text: at which speeds the model of a board holds.
const MODEL_DOUBTS: [&str; 2] = [
    r#""texture":"the speed is outside of those that the model knows: 100 to 200 mm/s","#,
    " (the model knows 100 to 200 mm/s)",
];

const WANTED: [&str; 4] = ["--json", "--features", "--samples", "--motion"];

#[test]
fn every_line_is_that_of_run() {
    let (folder, scene) = scene("monitor-lines");
    let (early, late) = (model(&folder, "early", 30, 29, "Fla,Saw"), Path::new("builtin:svm").to_owned());
    let files = [&late, &early].map(|file| ModelFile::open(file).unwrap());
    let with_models = ["--model", path(&late), "--model", path(&early)];
    for (files, models) in [(&[][..], &["--model", "none"][..]), (&files, &with_models)] {
        for (all, wanted) in [(false, &["--json"][..]), (true, &WANTED), (false, &[]), (true, &["--features"])] {
            let of_host = as_by_link(&good(&[&["run", &scene], models, wanted].concat()));
            let json = wanted.first() == Some(&"--json");
            assert!(files.is_empty() || of_host.contains(MODEL_DOUBTS[usize::from(!json)]), "{of_host}");
            let expected = MODEL_DOUBTS.iter().fold(of_host, |lines, doubt| lines.replace(doubt, ""));
            let at_once = !wanted.contains(&"--samples");
            let file = folder.file("board.bin", board::sent(&scene, files, all, at_once).frames.concat());
            assert_eq!(good(&[&["monitor", path(&file)], wanted].concat()), expected);
            // A board is a source of wstac run, too.
            let of_run = run(&[&["run", &format!("board:{}", path(&file))], wanted].concat());
            assert_eq!(printed(&of_run), expected);
            let hints = said(&of_run).matches("no model was given: wstac board --model builtin sends one").count();
            assert_eq!(hints, usize::from(files.is_empty()), "{}", said(&of_run));
            // Output that was not requested is not printed, even if the board sends it.
            let file = folder.file("board.bin", board::sent(&scene, files, true, at_once).frames.concat());
            assert_eq!(good(&[&["monitor", path(&file)], wanted].concat()), expected);
            // The scene covers everything that could go wrong: events, lost frames and textures.
            assert!(expected.lines().count() > 2, "{expected}");
            assert!(
                !json || expected.contains(r#""kind":"event""#) && !expected.contains(r#""dropped":0"#),
                "{expected}"
            );
            let has_motion = expected.contains(r#""kind":"motion""#);
            assert_eq!(has_motion, wanted.contains(&"--motion"), "{expected}");
            assert_eq!(json && expected.contains(r#""kind":"texture""#), json && !files.is_empty(), "{expected}");
        }
    }
}

#[test]
fn a_file_of_what_a_board_sent_is_a_source() {
    let examples = concat!(env!("CARGO_MANIFEST_DIR"), "/../wstac-host/examples");
    let model = ModelFile::open(Path::new("builtin:svm")).unwrap();
    let sent = board::sent(&format!("scene:{examples}/board.toml"), &[model], true, false).frames.concat();
    let makes = "cargo run -p wstac-tests --example board_bytes scene:wstac-host/examples/board.toml builtin:svm";
    assert!(std::fs::read(format!("{examples}/board.bin")).unwrap() == sent, "board.bin has other bytes than {makes}");
    let folder = Folder::new("monitor-file");
    let shown = "event at frame 35: slide, speed 150.1 ± 1.3 mm/s, direction 90.0 ± 0.1°, by the edge, texture Saw3 (no confidence)";
    // Of any name, with what a chip says when it starts, and from the middle of a message on.
    let noise = [b"boot: \xFF\x01\x80 115200 8N1\r\n", &sent[..]].concat();
    for bytes in [&sent, &noise, &sent[7..]] {
        let out = good(&["run", path(&folder.file("capture", bytes))]);
        assert!(out.starts_with(shown), "{out}");
    }
    refused(&["run", path(&folder.file("capture", &sent[..30]))], &["expected /dev/videoN"]);
}

/// Returns a record without times: those of a live board are of its own clock.
fn timeless(line: impl AsRef<str>) -> Value {
    let mut record: Value = serde_json::from_str(line.as_ref()).unwrap();
    for name in ["time_ns", "completed_ns", "time_s", "completed_s"] {
        record.as_object_mut().unwrap().remove(name);
    }
    record
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
    let expected = lines.iter().map(timeless).collect::<Vec<_>>();
    assert_eq!(printed(&done).lines().map(timeless).collect::<Vec<_>>(), expected);
    let described = "test-board 1.2.3: 100x100 Gray at 60 frames per second, baseline of 25 frames";
    let stderr = says(&done, 0, &[described]);
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
    // The host repeats its requests when a board starts. If they or acknowledgments stayed unread, the connection would
    // end as broken.
    wait_for(&mut board, &ALL[1..]);
    board.shutdown(Shutdown::Write).unwrap();
    let done = monitor.wait_with_output().unwrap();
    let out = printed(&done);
    let end = lines.pop().unwrap();
    let (events, own_end) = out.trim_end().rsplit_once('\n').unwrap();
    // This board never says its time, so there are none.
    assert!(!out.contains(r#""time_ns":1"#) && out.contains(r#""time_ns":null"#), "{out}");
    assert_eq!(events.lines().map(timeless).collect::<Vec<_>>(), lines.iter().map(timeless).collect::<Vec<_>>());
    assert_eq!(timeless(own_end), timeless(end));
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
    let names = ["time_ns", "completed_ns", "time_s", "completed_s"];
    for start in [1, 1000, bytes.len() / 2, bytes.len() - 900] {
        let file = folder.file("board.bin", &bytes[start..]);
        let done = run(&[&["monitor", path(&file)], &WANTED[..]].concat());
        let out = printed(&done);
        let found: Vec<_> = out.lines().collect();
        // An event has no sample if the host connected after the sample's start, and no record has times if the hello
        // is lost. If it is not lost, all times are those of the whole stream.
        let described = said(&done).contains("test-board 1.2.3");
        let whole = |line: &str| {
            let mut record: Value = serde_json::from_str(line).unwrap();
            let fields = record.as_object_mut().unwrap();
            fields.retain(|key, _| key != "sample" && (described || !names.contains(&&**key)));
            record
        };
        for name in names {
            let count = |value: &str| out.matches(&format!(r#""{name}":{value}"#)).count();
            let (times, none) = (count(""), count("null"));
            assert_eq!(none, if described { 0 } else { times }, "{name}: {out}");
            // Every record has it, whatever the rest of the stream is.
            assert!(name != "time_ns" || times == found.len(), "{out}");
        }
        let tail = &lines[lines.len() - found.len()..];
        assert!(found.len() > 1, "{out}");
        assert!(found.iter().zip(tail).all(|(line, expected)| whole(line) == whole(expected)), "{out}");
        // The end is the same to the letter, besides its time if that is not known.
        let end = lines.last().unwrap();
        let time = format!(r#""time_ns":{}"#, serde_json::from_str::<Value>(end).unwrap()["time_ns"]);
        let expected = if described { end.clone() } else { end.replace(&time, r#""time_ns":null"#) };
        assert_eq!(*found.last().unwrap(), expected);
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
    let (status, fault) =
        (Message::Status { stream, dropped: 5 }, Message::Fault(Fault::LastRun(Text::new("a panic"))));
    board.write_all(&bytes_of(&[status, fault, Message::Lost { frames: 2 }])).unwrap();
    for part in ["baseline was not quiet", "it started again because of: a panic", "2 frames lost by the board"] {
        assert_has(&stderr.next().unwrap(), &[part]);
    }
    send(&monitor, Signal::INT);
    let mut out = String::new();
    monitor.stdout.take().unwrap().read_to_string(&mut out).unwrap();
    let incomplete = r#"{"frame":280,"frames":20}"#;
    let end = r#"{"kind":"end","frames":300,"dropped":7,"baseline":"complete","incomplete":"#;
    assert_eq!(out, format!("{end}{incomplete},\"time_ns\":null,\"clock\":\"frames\"}}\n"));
    assert_eq!(monitor.wait().unwrap().code(), Some(0));
}

#[test]
fn a_board_that_ends_before_its_baseline_is_said_to_be_too_short() {
    let folder = Folder::new("monitor-short");
    let notes = |messages: &[Message]| {
        said(&run(&["run", &format!("board:{}", folder.written("short.bin", bytes_of(messages)))]))
    };
    let why = "no event: the source ended before the baseline was complete";
    assert!(notes(&[Message::End { stream: StreamEnd::new(7), dropped: 0 }]).contains(why));
    // One that never says how it is has sent enough frames, or not.
    let features = [22, 23, 24].map(|frame| Message::Features { frame, features: [0; 10] });
    assert_eq!([2, 3].map(|count| notes(&features[..count]).contains(why)), [true, false]);
}

/// A monitor of a board that starts again and again, and does not read the requests for that, until the connection has
/// no room for more of them and the monitor says so.
struct Unread {
    monitor: Child,
    /// The lines of standard error.
    said: Receiver<String>,
    board: File,
    /// The next sequence number.
    sequence: u16,
}

impl Unread {
    fn new(arguments: &[&str]) -> Self {
        let (mut board, line) = pty();
        let name = path(&line).to_owned();
        let mut monitor = start(&[&["monitor", &name, "--json"], arguments].concat());
        // It has opened the line then.
        wait_for(&mut board, &[Request::Hello]);
        let stderr = BufReader::new(monitor.stderr.take().unwrap());
        let (sender, said) = channel();
        std::thread::spawn(move || stderr.lines().map(Result::unwrap).try_for_each(|line| sender.send(line)));
        let mut unread = Self { monitor, said, board, sequence: 0 };
        unread.send(&Message::Hello(board::hello()));
        assert!(unread.next_line().contains("test-board 1.2.3"));
        let expected = format!("wstac: {name} does not read requests; they are sent when it does");
        for _ in 0..MOST_STARTS {
            unread.send(&Message::Hello(board::hello()));
            std::thread::yield_now();
            match unread.said.try_recv() {
                Ok(line) if line == expected => return unread,
                // The sequence number wraps.
                Ok(line) => assert_eq!(line, "wstac: the board has started again"),
                Err(_) => {}
            }
        }
        panic!("the connection has room for all requests: this shows less than it should");
    }

    fn send(&mut self, message: &Message) {
        self.board.write_all(encode(message, self.sequence, &mut [0; LONGEST])).expect("the monitor reads");
        self.sequence = self.sequence.wrapping_add(1);
    }

    fn next_line(&self) -> String {
        self.said.recv_timeout(Duration::from_mins(2)).unwrap()
    }

    /// Sends a signal that ends the monitor.
    fn interrupt(&self) {
        send(&self.monitor, Signal::INT);
    }
}

#[test]
fn a_peer_that_does_not_read_is_still_read() {
    let mut unread = Unread::new(&[]);
    let mut stdout = BufReader::new(unread.monitor.stdout.take().unwrap()).lines().map(Result::unwrap);
    unread.send(&Message::InterruptedSample(InterruptedSample::new(35, 7)));
    assert_eq!(stdout.next().unwrap(), r#"{"kind":"incomplete","frame":35,"time_ns":null,"frames":7}"#);
    // A signal ends it, with its last record.
    unread.interrupt();
    assert!(stdout.next().unwrap().starts_with(r#"{"kind":"end","frames":42,"#));
    assert_eq!(unread.monitor.wait().unwrap().code(), Some(0));
}

#[test]
fn a_wrong_port_is_named_before_long() {
    // One writes text, and one sends back what it is sent.
    for (echoes, found) in [(false, "text"), (true, "its own requests")] {
        let (mut port, line) = pty();
        let mut run = start(&["run", path(&line)]);
        let writer = std::thread::spawn(move || {
            let mut bytes = [0; 64];
            // Ten seconds: then the command says that nothing comes.
            for _ in 0..200 {
                let sent = if echoes {
                    port.read(&mut bytes).and_then(|count| port.write_all(&bytes[..count]))
                } else {
                    port.write_all(b"[    0.123456] usb 1-1: new device\r\n")
                };
                // The command has not opened the line yet, or has ended.
                let _ = sent;
                std::thread::sleep(Duration::from_millis(50));
            }
        });
        let first = BufReader::new(run.stderr.take().unwrap()).lines().next().unwrap().unwrap();
        let expected =
            format!("{} has no messages (found {found}, expected those of a board); help: check ", path(&line));
        assert_has(&first, &[&expected]);
        send(&run, Signal::INT);
        run.wait().unwrap();
        writer.join().unwrap();
    }
}

#[test]
fn a_peer_that_reads_again_gets_the_requests() {
    let mut unread = Unread::new(&["--features"]);
    // Every request that arrives is whole and in its place.
    let mut board = unread.board.try_clone().unwrap();
    let requests = std::thread::spawn(move || {
        let (mut decoder, mut found, mut byte) = (Decoder::<16>::new(), Vec::new(), [0]);
        // Until the monitor has closed the line.
        while let Ok(1) = board.read(&mut byte) {
            if let Some(received) = decoder.push::<Request>(byte[0]) {
                let received = received.unwrap();
                assert_eq!(received.lost, 0);
                found.push(received.message);
            }
        }
        found
    });
    assert!(unread.next_line().ends_with("reads requests again"));
    unread.interrupt();
    assert_eq!(unread.monitor.wait().unwrap().code(), Some(0));
    let requests = requests.join().unwrap();
    assert_eq!(requests[0], Request::Features(true));
    assert!(requests[1..].contains(&Request::Features(true)) && requests.len() > 100, "{requests:?}");
}

#[test]
fn what_is_no_board_of_this_version_is_refused() {
    let folder = Folder::new("monitor-refused");
    let refused = |bytes: &[u8], expected: &str| {
        refused(&["monitor", path(&folder.file("board.bin", bytes)), "--json"], &[expected]);
    };
    refused(&[], "has no messages (found no bytes, expected those of a board)");
    refused(&[0xAA; 100], "has no messages (found other bytes, expected those of a board)");
    refused(b"\x05noise\0".repeat(30).as_slice(), "(found other bytes, expected those of a board)");
    // A message of version 5, and one of version 2, with arbitrary content and a correct CRC.
    let newer = [0, 8, 5, 5, 6, 0x89, 0x4A, 0x9E, 0x6D, 0];
    refused(&newer, "speaks version 5 of the link, expected 4: it is newer than this wstac");
    let older = [0, 8, 2, 5, 6, 0x0C, 0x5C, 0xD1, 0x68, 0];
    refused(&older, "speaks version 2 of the link, expected 4: it is older than this wstac");
    for (arguments, status) in [
        (&["monitor"][..], 2),
        (&["monitor", "-", "--baud", "0"], 2),
        (&["monitor", "-", "--samples"], 2),
        (&["monitor", "-", "--baud", "9600"], 2),
        (&["monitor", "/"], 2),
        (&["monitor", "/no/such/device"], 1),
        (&["monitor", "tcp:nowhere"], 2),
        (&["monitor", "tcp:127.0.0.1"], 2),
    ] {
        assert_eq!(run(arguments).status.code(), Some(status), "{arguments:?}");
    }
}
