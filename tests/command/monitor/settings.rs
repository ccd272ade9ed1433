//! Tests `wstac board`: it asks a board for its settings, sets them, and reads them back.

use std::io::{Read, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, spawn};
use std::time::Duration;

use serde_json::Value;
use wstac_core::features::Floor;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::trigger::TriggerConfig;
use wstac_core::wire::{
    Bootloader, Decoder, Fault, LONGEST_REQUEST, Message, Refusal, Request, Settings, SettingsInUse,
};
use wstac_tests::command::{ends, printed, run, says};
use wstac_tests::folder::Folder;

use super::board::{Sent, hello};
use super::{path, pty};

const SIZE: [u32; 2] = [320, 240];

fn size() -> FrameSize {
    FrameSize::new(SIZE[0], SIZE[1]).unwrap()
}

pub(super) fn compiled_in() -> Settings {
    let trigger = TriggerConfig::default().one_event_per_touch();
    Settings::new(&Layout::paper(size()).unwrap(), Floor::new(1.0, 255).unwrap(), trigger, None)
}

/// A board behind a line: it answers in a thread of its own until it is dropped.
pub(super) struct Board {
    pub(super) line: PathBuf,
    over: &'static AtomicBool,
    thread: Option<JoinHandle<()>>,
}

impl Board {
    fn new() -> Self {
        Self::that(serves())
    }

    /// Creates a board that answers requests in this way.
    pub(super) fn that(mut answer: impl FnMut(Request, &mut Sent) + Send + 'static) -> Self {
        let (mut end, line) = pty();
        let over: &AtomicBool = Box::leak(Box::new(AtomicBool::new(false)));
        let thread = spawn(move || {
            let (mut decoder, mut sent, mut done) = (Decoder::<LONGEST_REQUEST>::new(), Sent { frames: Vec::new() }, 0);
            while !over.load(Ordering::Relaxed) {
                let mut byte = [0];
                // A hangup of the line shows as an error that does not end.
                let Ok(1) = end.read(&mut byte) else {
                    std::thread::sleep(Duration::from_millis(1));
                    continue;
                };
                let Some(Ok(received)) = decoder.push::<Request>(byte[0]) else { continue };
                answer(received.message, &mut sent);
                end.write_all(&sent.frames[done..].concat()).unwrap();
                done = sent.frames.len();
            }
        });
        Self { line, over, thread: Some(thread) }
    }

    pub(super) fn run(&self, arguments: &[&str]) -> std::process::Output {
        run(&[&["board", path(&self.line)], arguments].concat())
    }

    /// Runs the command, which must succeed, and returns its object.
    pub(super) fn json(&self, arguments: &[&str]) -> Value {
        serde_json::from_str(&printed(&self.run(&[arguments, &["--json"]].concat()))).unwrap()
    }

    /// Runs the command, which the board or the command must refuse with messages that have this part.
    #[track_caller]
    pub(super) fn refuses(&self, arguments: &[&str], part: &str) {
        says(&self.run(arguments), 1, &[part]);
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        self.thread.take().map(JoinHandle::join);
    }
}

/// Answers requests as the firmware does. What is set is used after the next request, as after a restart.
fn serves() -> impl FnMut(Request, &mut Sent) + Send + 'static {
    let (mut used, mut kept) = (None::<Settings>, None::<Settings>);
    move |request, sent| match request {
        Request::Hello => sent.push(&Message::Hello(hello())),
        Request::Settings => {
            let in_use = SettingsInUse::new(used.unwrap_or_else(compiled_in), used.is_some());
            sent.push(&Message::Settings(in_use));
            used = kept;
        }
        Request::Set(settings) => {
            let answer = check(&settings);
            kept = if answer.is_ok() { Some(settings) } else { kept };
            sent.push(&Message::Set(answer));
        }
        Request::Forget => {
            kept = None;
            sent.push(&Message::Set(Ok(())));
        }
        // Its firmware does not learn, and takes no models.
        Request::Textures | Request::Model => {}
        other => panic!("{other:?}"),
    }
}

fn check(settings: &Settings) -> Result<(), Refusal> {
    settings.layout(size())?;
    match settings.exposure {
        Some(found) if found > 500 => Err(Refusal::Exposure { found, most: 500 }),
        _ => Ok(()),
    }
}

/// Returns a configuration with a layout whose last taxel has this left side.
fn config(folder: &Folder, name: &str, last: u16) -> PathBuf {
    let mut corners: Vec<_> = (0..25).map(|k| [40 + 45 * (k % 5), 12 + 44 * (k / 5)]).collect();
    corners[24][0] = last;
    let layout = format!("[layout]\nframe = [320, 240]\ntaxel = [24, 28]\ncorners = {corners:?}\n");
    folder.file(name, format!("{layout}[trigger]\nmargin = 0.75\n"))
}

#[test]
fn settings_are_shown_set_read_back_and_forgotten() {
    let folder = Folder::new("board-settings");
    let board = Board::new();
    let first = board.json(&[]);
    assert_eq!((&first["kind"], &first["set"], &first["exposure"]), (&"board".into(), &false.into(), &Value::Null));
    assert_eq!(first["taxel"], serde_json::json!([30, 30]));
    let file = config(&folder, "my.toml", 220);
    let set = board.json(&["--set", path(&file), "--exposure", "240"]);
    assert_eq!((&set["set"], &set["exposure"], &set["margin"]), (&true.into(), &240.into(), &0.75.into()));
    assert_eq!((&set["taxel"], &set["corners"][24]), (&serde_json::json!([24, 28]), &serde_json::json!([220, 188])));
    // What is not given stays.
    let exposed = board.json(&["--exposure", "100"]);
    assert_eq!((&exposed["exposure"], &exposed["corners"]), (&100.into(), &set["corners"]));
    // The text is a configuration, which sets the same again.
    let text = printed(&board.run(&[]));
    assert!(text.ends_with("# The exposure is 100 lines.\n"), "{text}");
    let again = folder.file("again.toml", &text);
    assert_eq!(board.json(&["--set", path(&again)]), exposed);
    assert_eq!(board.json(&["--forget"]), first);
}

#[test]
fn what_a_board_refuses_changes_nothing() {
    let folder = Folder::new("board-refusals");
    let board = Board::new();
    let file = config(&folder, "my.toml", 220);
    let set = board.json(&["--set", path(&file)]);
    board.refuses(&["--exposure", "501"], "refuses the settings: the exposure is 501 lines, expected 1 to 500");
    // A configuration without a frame says nothing about its size, so the host cannot check its taxels.
    let text = std::fs::read_to_string(config(&folder, "bad.toml", 310)).unwrap();
    for (text, part) in [
        (&*text.replace("frame = [320, 240]\n", ""), "refuses the settings: taxel"),
        (&text.replace("320, 240", "640, 480"), "[layout] is for frames of 640 x 480 pixels, expected 320 x 240"),
        ("[speed]\nlaw = \"published\"\n", "[speed] law is not the board's"),
    ] {
        board.refuses(&["--set", &folder.written("refused.toml", text)], part);
    }
    assert_eq!(board.json(&[]), set);
}

#[test]
fn a_board_that_does_not_learn_says_so() {
    let board = Board::new();
    assert_eq!(board.json(&[]).get("textures"), None);
    board.refuses(&["--learn", "carpet"], "does not learn textures, expected a firmware with the feature learn");
}

#[test]
fn a_port_without_such_a_board_is_refused() {
    let folder = Folder::new("board-none");
    for (bytes, found) in
        [(&[7; 99][..], "other bytes"), (b"[    0.0] Booting\n", "text"), (&[0; 99], "zeros"), (&[], "no bytes")]
    {
        let file = folder.file("noise.bin", bytes);
        let expected = format!("noise.bin: has no messages (found {found}, expected those of a board); help: check ");
        ends(&["board", path(&file)], 1, &[&expected]);
    }
    // A board that answers other requests only.
    let older = Board::that(|request, sent| {
        if request == Request::Settings {
            sent.push(&Message::Fault(Fault::SensorBack));
        }
    });
    older.refuses(&[], "does not answer, expected a board whose settings can be set");
}

#[test]
fn a_board_starts_its_boot_loader_or_says_that_it_has_none() {
    let started = |answer: Option<Option<Bootloader>>| {
        let mut serves = serves();
        let board = Board::that(move |request, sent| match request {
            // An older firmware does not know this request.
            Request::Bootloader => answer.into_iter().for_each(|found| sent.push(&Message::Bootloader(found))),
            other => serves(other, sent),
        });
        board.run(&["--bootloader"])
    };
    for (answer, code, words) in [
        (Some(Some(Bootloader::Uf2)), 0, "becomes a drive: copy the .uf2"),
        (Some(Some(Bootloader::Dfu)), 0, "waits for: dfu-util "),
        (Some(None), 1, "has no boot loader that takes"),
        (None, 1, "does not know of a boot loader; help:"),
    ] {
        says(&started(answer), code, &[words]);
    }
    // A board that was just opened says hello, too, and the first request is lost.
    let mut asked = 0;
    let board = Board::that(move |request, sent| {
        asked += usize::from(request == Request::Bootloader);
        match request {
            Request::Bootloader if asked > 1 => sent.push(&Message::Bootloader(Some(Bootloader::Uf2))),
            Request::Hello => (asked..3).for_each(|_| sent.push(&Message::Hello(hello()))),
            _ => {}
        }
    });
    says(&board.run(&["--bootloader"]), 0, &[]);
}
