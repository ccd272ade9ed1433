//! Tests what `wstac serve` refuses before it opens its address: folders and files that it could not write. Then what
//! many browsers cost.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::time::Duration;

use wstac_tests::command::{Signal, ends, good, refused, send, start, wstac};
use wstac_tests::folder::{Folder, GRAY, frames};

const SCENE: &str = "scene:Saw3@150";

fn serve(options: &[&str], parts: &[&str]) {
    refused(&[&["serve", SCENE, "--listen", "127.0.0.1:0"], options].concat(), parts);
}

#[test]
fn recordings_need_a_folder() {
    let folder = Folder::new("serve-folder");
    serve(&["--record-to", &folder.path("missing")], &["missing: does not exist, expected a folder"]);
    serve(&["--record-to", &folder.written("a.mcap", "")], &["a.mcap: is no folder, expected a folder"]);
}

#[test]
fn an_address_that_is_none_or_taken_names_the_option() {
    for given in ["80260", "+8026", "sensor:8026"] {
        let expected = "expected an address, a port or both, such as 127.0.0.1:8025";
        ends(&["serve", SCENE, "--listen", given], 2, &["--listen", expected]);
    }
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = holder.local_addr().unwrap();
    let local = format!("localhost:{}", taken.port());
    refused(&["serve", SCENE, "--listen", &local], &[&format!("--listen {taken}: is taken")]);
    drop(holder);
}

/// A page takes as many sensors as a recording: a hand has twenty.
#[test]
fn a_page_takes_twenty_sensors() {
    let with = |count: usize, expected: &str| {
        let sources: Vec<String> = (0..count).map(|number| format!("cam:s{number}={SCENE}")).collect();
        let options = ["--listen", "127.0.0.1:0", "--record-to", "missing"];
        let arguments: Vec<&str> =
            [&["serve"], &*sources.iter().map(String::as_str).collect::<Vec<_>>(), &options].concat();
        refused(&arguments, &[expected]);
    };
    with(21, "found 21 sources, expected at most 20");
    with(20, "missing: does not exist");
}

#[test]
fn a_calibration_goes_to_a_new_file() {
    let folder = Folder::new("serve-file");
    let path = |name: &str| folder.path(name);
    fs::write(path("my.toml"), "").unwrap();
    serve(&["--calibrate-to", &path("my.toml")], &["my.toml: exists already, expected a new file"]);
    serve(&["--calibrate-to", &path("missing/my.toml")], &["is in a folder that does not exist"]);
    serve(&["--calibrate-to", &path("my.mcap")], &["its name ends in .mcap, expected .toml"]);
    // Each of several sensors has a file of its own.
    fs::write(path("two-right.toml"), "").unwrap();
    let (left, right) = (format!("cam:left={SCENE}"), format!("cam:right={SCENE}"));
    let both = ["serve", &left, &right, "--listen", "127.0.0.1:0", "--calibrate-to", &path("two.toml")];
    refused(&both, &["two-right.toml: exists already"]);
    assert_eq!(fs::read_dir(&folder.0).unwrap().count(), 2, "nothing was written");
}

#[test]
fn all_sensors_of_a_recording_are_shown() {
    let folder = Folder::new("serve-both");
    let both = &*folder.path("both.mcap");
    let sources = ["left=scene:Saw3@150", "right=scene:Tri3@120"];
    good(&[&["record"], &sources[..], &["--features-only", "-o", both]].concat());
    let no_sensor = "the recording has no sensor middle, expected one of left, right before =";
    refused(&["serve", &format!("middle={both}"), "--listen", "127.0.0.1:0"], &[no_sensor]);
    for (source, expected) in [(both.to_owned(), &["left", "right"][..]), (format!("right={both}"), &["right"])] {
        let mut server = start(&["serve", &source, "--listen", "127.0.0.1:0"]);
        let lines = BufReader::new(server.stderr.take().unwrap()).lines().map(Result::unwrap);
        // The address, then a note for each sensor.
        let notes: Vec<String> = lines.skip(1).take(expected.len()).collect();
        server.kill().unwrap();
        server.wait().unwrap();
        for (note, name) in notes.iter().zip(expected) {
            assert!(note.starts_with(&format!("wstac: {name}: {both}: sensor {name}, recorded from")), "{note}");
        }
        assert_eq!(notes.len(), expected.len());
    }
}

#[test]
fn what_is_not_stated_is_said_once() {
    let folder = Folder::new("serve-notes");
    let video = &*folder.written("slide.y4m", [GRAY, &frames(3, 1)].concat());
    let mut server = start(&["serve", video, "--listen", "127.0.0.1:0"]);
    let mut lines = BufReader::new(server.stderr.take().unwrap()).lines().map(Result::unwrap);
    let host = lines.next().unwrap().trim_start_matches("http://").trim_end_matches('/').to_owned();
    let notes: Vec<String> = lines.skip(1).take(2).collect();
    assert!(notes[0].starts_with("wstac: no [layout] is given") && notes[1].starts_with("wstac: readout unknown"));
    // The page has them, too.
    let mut page = [0; 600];
    socket(&host).read_exact(&mut page).unwrap();
    let page = String::from_utf8_lossy(&page);
    assert!(page.contains(r#""notes":["no [layout] is given"#) && page.contains("readout unknown"), "{page}");
    server.kill().unwrap();
    server.wait().unwrap();
}

/// Opens the connection of a page.
fn socket(host: &str) -> TcpStream {
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
    let upgrade = "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    write!(stream, "GET /socket HTTP/1.1\r\nHost: {host}\r\n{upgrade}\r\n\r\n").unwrap();
    stream
}

/// 60 browsers that acknowledge everything and read nothing: in 256 MB the page stays, for others too, and a recording
/// goes on to its end.
#[test]
fn pages_that_read_nothing_take_little_memory() {
    let folder = Folder::new("serve-memory");
    let long = "specimen = \"Saw3\"\nspeed = 150\nlead_in = 100000\n[sensor]\nsize = [320, 240]";
    let source = folder.scene("long.toml", long);
    let wstac = wstac().display().to_string();
    let limited = "ulimit -v 262144; exec \"$@\"";
    let mut command = Command::new("sh");
    command.args(["-c", limited, "sh", &wstac, "serve", &source, "--listen", "127.0.0.1:0", "--record-to"]);
    let mut server = command.arg(&folder.0).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(server.stderr.take().unwrap()).lines().map(Result::unwrap);
    let address = lines.next().unwrap();
    let host = address.trim_start_matches("http://").trim_end_matches('/');
    // A frame of a text from a browser, whose mask is zero.
    let frame = |text: &str| [&[0x81, 0x80 | text.len() as u8, 0, 0, 0, 0], text.as_bytes()].concat();
    let mut stalled: Vec<TcpStream> = (0..60).map(|_| socket(host)).collect();
    stalled[0].write_all(&frame("order 0 {\"order\":\"record\"}")).unwrap();
    let resident = || {
        let status = fs::read_to_string(format!("/proc/{}/status", server.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() / 1024
    };
    let orders = [frame("ok"), frame(&format!("order 0 {}", "x".repeat(100)))].concat().repeat(50);
    for _ in 0..20 {
        for stream in &mut stalled {
            stream.set_nonblocking(true).unwrap();
            // The server may not take it, because nobody takes its answers.
            let _ = stream.write(&orders);
        }
        std::thread::sleep(Duration::from_millis(100));
        assert!(resident() < 150, "{} MB", resident());
    }
    let (mut reader, mut bytes) = (socket(host), vec![0; 20_000]);
    reader.read_exact(&mut bytes).unwrap();
    let greeting = String::from_utf8_lossy(&bytes);
    assert!(greeting.contains("{\"sensors\":") && greeting.contains("{\"update\":0"), "{greeting}");
    send(&server, Signal::INT);
    assert_eq!(server.wait().unwrap().code(), Some(0));
    let said: Vec<String> = lines.collect();
    assert!(said.last().is_some_and(|line| line.contains("wstac-1.mcap: ") && line.contains(" frames, ")), "{said:?}");
}
