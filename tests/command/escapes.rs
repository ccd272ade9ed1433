//! Tests that nothing from outside reaches a terminal as it is: no escape sequence, no forged line, no endless message.

use std::convert::Infallible;
use std::fs::{self, File};
use std::path::Path;
use std::process::Output;

use wstac_core::wire::{Fault, Hello, Message, Text};
use wstac_host::config::Config;
use wstac_host::output::OutputOptions;
use wstac_host::record::Recorder;
use wstac_host::session::Processor;
use wstac_host::source::Source;
use wstac_host::source::mcap::McapSource;
use wstac_tests::command::run_in;
use wstac_tests::folder::{Folder, SMALL};

use crate::monitor::board::{Sent, hello};

/// A name that sets the clipboard, clears the screen, forges a line and turns the direction of writing.
const FORGED: &str = "x\x1b]52;c;aGk=\x07\x1b[2J\nevent at frame 3x\r\u{9b}31m\u{202e}y";
/// How it starts when it is escaped.
const ESCAPED: &str = r"x\u001b]52;c;aGk=\u0007\u001b[2J\u000aevent at frame 3x\u000d\u009b31m\u202ey";

/// Runs a command in a folder, and returns what is wrong with what it prints.
fn wrong(folder: &Folder, arguments: &[&str], expected: &str) -> Option<String> {
    let done = run_in(folder, arguments);
    let found = faults(&done, expected);
    (!found.is_empty()).then(|| {
        let text = String::from_utf8_lossy(&done.stdout) + String::from_utf8_lossy(&done.stderr);
        let text = text.escape_debug().to_string().chars().take(1500).collect::<String>();
        format!("{:?}: {found:?}: {text}", &arguments[..2.min(arguments.len())])
    })
}

fn faults(done: &Output, expected: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let (out, err) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    for (what, text) in [("output", &out), ("messages", &err)] {
        let bad = |c: &char| (c.is_control() && *c != '\n' && *c != '\t') || ('\u{202a}'..='\u{202e}').contains(c);
        if let Some(c) = text.chars().find(bad) {
            faults.push(format!("{what} have {c:?}"));
        }
        if text.lines().any(|line| line.starts_with("event at frame 3x")) {
            faults.push(format!("{what} have a forged line"));
        }
    }
    if done.status.code() != Some(0) && err.len() > 1100 {
        faults.push(format!("{} bytes of messages", err.len()));
    }
    if !out.contains(expected) && !err.contains(expected) {
        faults.push(format!("{expected:?} is missing"));
    }
    faults
}

/// Copies a recording with a label that `wstac record` refuses. Files of other programs, or of before, may have any.
fn copy_with_label(from: &Path, to: &Path, label: &str) {
    let mut source = McapSource::open(from, None).unwrap();
    let mut about = source.about().clone();
    about.labels.insert(label.to_owned(), label.to_owned());
    let config = Config::parse(&about.configuration).unwrap();
    let mut processor = Processor::new(source.info(), &config, OutputOptions::default()).unwrap();
    let mut recorder = Recorder::new(File::create_new(to).unwrap(), to, &about, &processor).unwrap();
    let mut goes_on = true;
    while goes_on {
        let event = source.next_event().unwrap();
        recorder.source_event(&event);
        let processed = processor.process(&event, |output| {
            recorder.output(&output, label);
            Ok::<(), Infallible>(())
        });
        goes_on = processed.unwrap() && recorder.processed(&event, &processor);
    }
    recorder.finish().unwrap();
}

/// Encodes a string for ONNX: a field of a length.
fn field(number: u8, content: &[u8]) -> Vec<u8> {
    let mut bytes = vec![number << 3 | 2];
    let mut length = content.len();
    while length >= 0x80 {
        bytes.push(length as u8 | 0x80);
        length >>= 7;
    }
    bytes.push(length as u8);
    bytes.extend(content);
    bytes
}

/// Returns an archive with a member of this name, stored, that holds no array.
fn archive(name: &str) -> Vec<u8> {
    let half = |number: usize| (number as u16).to_le_bytes();
    let head = |start: &[u8], versions: &[u8]| {
        let mut head = start.to_vec();
        head.extend(versions);
        // Flags, method, time, date, checksum, two sizes, the length of the name, and that of what follows it.
        head.extend([0; 8].iter().chain(&[0; 12]));
        head.extend(half(name.len()).iter().chain(&[0, 0]));
        head
    };
    let mut file = head(b"PK\x03\x04", &[20, 0]);
    file.extend(name.as_bytes());
    let directory = file.len();
    file.extend(head(b"PK\x01\x02", &[20, 0, 20, 0]));
    file.extend([0; 14]);
    file.extend(name.as_bytes());
    let bytes = file.len() - directory;
    file.extend(b"PK\x05\x06\0\0\0\0\x01\0\x01\0");
    file.extend((bytes as u32).to_le_bytes().iter().chain(&(directory as u32).to_le_bytes()));
    file.extend([0, 0]);
    file
}

#[test]
fn names_and_contents_of_files_never_control_the_terminal() {
    let folder = Folder::new("escapes");
    let mut found = Vec::new();
    folder.file("small.toml", SMALL);
    let mut check = |arguments: &[&str], expected: &str| found.extend(wrong(&folder, arguments, expected));
    // Names of files that are not there, in every command.
    for arguments in [
        &["run", FORGED][..],
        &["record", FORGED, "-o", "a.mcap"],
        &["recover", FORGED, "-o", "a.mcap"],
        &["calibrate", FORGED, "-o", "a.toml"],
        &["dataset", FORGED, "-o", "a.npz"],
        &["model", "import", FORGED, "-o", "a.wsm"],
        &["model", "inspect", FORGED],
        &["model", "eval", FORGED, "a.npz"],
        &["model", "learn", FORGED, "a.npz", "-o", "a.wsm"],
        &["model", "learn", "builtin:embedding", FORGED, "-o", "a.wsm"],
        &["model", "calibrate", FORGED, "a.npz", "b.npz", "-o", "a.wsm"],
        &["model", "calibrate", "builtin:path-svm", FORGED, "b.npz", "-o", "a.wsm"],
        &["train", FORGED, "-o", "a.wsm"],
        &["plot", FORGED, "-o", "a.svg"],
        &["scene", "explain", FORGED],
        &["monitor", FORGED],
        &["doctor", FORGED],
        &["trade", "--map", "kept", "--prices", FORGED],
        &["run", "scene:small.toml", "--config", FORGED],
        &["run", "scene:Saw3@150", "--model", FORGED],
        &["run", &format!("scene:{FORGED}")],
        // Arguments that are refused.
        &["run", "-", "--fps", FORGED],
        &["run", "-", &format!("--fps={FORGED}")],
        &["run", "-", "-x", FORGED],
        &["run", "-", &format!("--{FORGED}")],
        &[FORGED],
        &["model", "import", "a", "-o", &format!("{FORGED}.rs"), "--backend", "table"],
        &["trade", "--budget", FORGED],
        &["record", "scene:Saw3@150", "-o", "a.mcap", "--label", FORGED],
    ] {
        let expected = if arguments.contains(&"-x") { "-x" } else { "x\\" };
        check(arguments, expected);
        let long = arguments.iter().map(|argument| argument.replace(FORGED, &FORGED.repeat(300))).collect::<Vec<_>>();
        check(&long.iter().map(String::as_str).collect::<Vec<_>>(), expected);
    }
    // Contents: keys and values of TOML.
    let key = serde_json::to_string(FORGED).unwrap();
    folder.file("key.toml", format!("[trigger]\n{key} = 5\n"));
    folder.file("value.toml", format!("[trigger]\nrule = {key}\n"));
    folder.file("long.toml", format!("[trigger]\n{} = 5\n", serde_json::to_string(&FORGED.repeat(3000)).unwrap()));
    for name in ["key.toml", "value.toml", "long.toml"] {
        check(&["run", "scene:Saw3@150", "--config", name], r"\u001b]52");
    }
    folder.file("s.toml", format!("speed = 150\nspecimen = {key}\n"));
    check(&["run", "scene:s.toml"], r"\u{1b}]52");
    check(&["dataset", "s.toml", "-o", "a.npz"], r"s.toml");
    folder.file("sweep.toml", format!("specimens = [{key}]\n"));
    check(&["dataset", "sweep.toml", "-o", "a.npz"], r"\u{1b}]52");
    folder.file("plan.toml", format!("specimens = [{key}]\n"));
    check(&["record", "scene:Saw3@150", "--guide", "plan.toml", "-o", "files"], r"\u{1b}]52");
    // Members of an archive, and strings of ONNX.
    folder.file("a.npz", archive(&format!("{FORGED}.npy")));
    check(&["model", "eval", "builtin:svm", "a.npz"], r"\u001b]52");
    check(&["train", "a.npz", "-o", "a.wsm"], "a.npz");
    check(&["model", "learn", "builtin:embedding", "a.npz", "-o", "a.wsm"], r"\u001b]52");
    let node = [field(1, b"X"), field(2, b"Y"), field(4, FORGED.as_bytes())].concat();
    let output = field(12, &field(1, b"Y"));
    folder.file("a.onnx", [vec![8, 8], field(7, &[field(1, &node), output].concat())].concat());
    check(&["model", "import", "a.onnx", "-o", "a.wsm"], r"\u001b]52");
    // Labels of models, of data sets and of recordings, and a forged file name in each.
    fs::copy(
        concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/seeds/model_import/xgboost.json"),
        folder.0.join("boosted.json"),
    )
    .unwrap();
    let labels = format!("{FORGED},b");
    check(&["model", "import", "boosted.json", "-o", "a.wsm", "--labels", &labels, "--note", FORGED], "a.wsm");
    check(&["model", "inspect", "a.wsm"], ESCAPED);
    check(&["model", "inspect", "a.wsm", "--json"], r"\u001b]52");
    check(&["run", "scene:small.toml", "--model", "a.wsm"], "event at frame");
    check(&["demo", "--model", "a.wsm"], "the truth of the model's classes is not known");
    let _ = fs::copy(folder.0.join("a.wsm"), folder.0.join(format!("{FORGED}.wsm")));
    check(&["run", "scene:small.toml", "--model", &format!("{FORGED}.wsm")], "event at frame");
    let label = format!("{FORGED}={FORGED}");
    let _ = fs::remove_file(folder.0.join("a.mcap"));
    let refused = "expected plain text (found the character U+001B)";
    check(&["record", "scene:Saw3@150", "-o", "a.mcap", "--label", &label], refused);
    check(&["record", "scene:small.toml", "-o", "plain.mcap"], "plain.mcap: 140 frames");
    copy_with_label(&folder.0.join("plain.mcap"), &folder.0.join("a.mcap"), FORGED);
    check(&["run", "a.mcap"], ESCAPED);
    check(&["run", "a.mcap", "--json"], r#""kind":"end""#);
    check(&["recover", "a.mcap", "-o", "b.mcap"], "b.mcap");
    let _ = fs::rename(folder.0.join("b.mcap"), folder.0.join(format!("{FORGED}.mcap")));
    for arguments in [
        &["run"][..],
        &["doctor"],
        &["calibrate", "-o", "b.toml"],
        &["dataset", "-o", "b.npz"],
        &["train", "-o", "b.wsm"],
    ] {
        check(&[arguments, &[&format!("{FORGED}.mcap")]].concat(), ESCAPED);
    }
    assert!(found.is_empty(), "{} wrong:\n{}", found.len(), found.join("\n"));
}

/// A board's firmware names itself, and says why it crashed.
#[test]
fn names_and_crashes_of_a_board_never_control_the_terminal() {
    let folder = Folder::new("escapes-board");
    let mut board = Sent { frames: Vec::new() };
    let (firmware, version) = ("x\x1b]52;c;a\x07\nevent at frame 3x", "\u{202e}1.2\r\nevent at frame 3x");
    let (firmware, version, revision) = (Text::new(firmware), Text::new(version), Text::new("\x1b[2J"));
    board.push(&Message::Hello(Hello { firmware, version, revision, ..hello() }));
    board.push(&Message::Fault(Fault::LastRun(Text::new(FORGED))));
    folder.file("board.bin", board.frames.concat());
    for more in [&[][..], &["--json"]] {
        for expected in [r"x\u001b]52;c;a\u0007\u000aevent", ESCAPED] {
            let done = wrong(&folder, &[&["monitor", "board.bin"], more].concat(), expected);
            assert!(done.is_none(), "{}", done.unwrap());
        }
    }
}
