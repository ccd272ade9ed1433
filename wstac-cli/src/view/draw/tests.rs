//! Tests of the screen: a scene is played into a terminal of a given size.

mod several;

use std::io::Read;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::Mutex;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::style::Color;

use super::super::board::{BoardPlayer, press};
use super::super::keys::Key;
use super::super::player::{Player, locked};
use super::*;
use crate::open;
use crate::view::recording::Recordings;
use crate::view::state::Phase;
use wstac_core::wire::{Decoder, Fault, LONGEST, Message, Request, Telemetry, encode};
use wstac_host::config::Config;
use wstac_host::monitor::port::{Port, SILENT};
use wstac_host::output::OutputOptions;
use wstac_host::record;
use wstac_host::session::Processor;
use wstac_host::source::SourceEvent;
use wstac_host::source::open::OpenOptions;

/// Returns the state after this many items of a scene with small frames.
fn after(scene: &str, items: u32) -> State {
    let options = OpenOptions { size: Some((320, 180)), ..OpenOptions::default() };
    let state = play(scene, &options, None, |player, state| {
        (0..items).for_each(|_| assert!(player.step(state, true).is_ok()));
    });
    state.into_inner().unwrap()
}

/// Opens a source, hands its player and the state to `with`, and returns the state. `named` is the first recording.
fn play(
    source: &str,
    options: &OpenOptions,
    named: Option<PathBuf>,
    with: impl FnOnce(&mut Player<'_>, &Mutex<State>),
) -> Mutex<State> {
    let mut source = open(source, options).unwrap();
    let (info, config) = (source.info().clone(), Config::default());
    let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
    let mut reading = Processor::new(&info, &config, wanted).unwrap();
    let about = record::about::About::new(&info, &config, wstac_host::source::Labels::default(), Vec::new());
    let mut recordings = Recordings::new(about, named, |record| format!("{record:?}"));
    let (mut player, state) = Player::new(&mut source, &info, &mut reading, &mut recordings, false);
    let state = Mutex::new(state);
    with(&mut player, &state);
    state
}

/// Returns what a terminal of this size shows, one string per row.
fn screen(state: &State, colors: Colors, with_help: bool, size: [u16; 2]) -> (Vec<String>, Buffer) {
    shown(&View { states: &[state], chosen: 0, with_help, colors }, size)
}

/// Returns what a terminal of this size shows of one sensor or several.
fn shown(view: &View<'_>, [width, height]: [u16; 2]) -> (Vec<String>, Buffer) {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal
        .draw(|frame| {
            let area = frame.area();
            draw(view, area, frame.buffer_mut());
        })
        .unwrap();
    let buffer = terminal.backend().buffer().clone();
    let row = |y| (0..width).map(|x| buffer[(x, y)].symbol()).collect::<String>();
    ((0..height).map(row).collect(), buffer)
}

fn count(lines: &[String], text: &str) -> usize {
    lines.iter().map(|line| line.matches(text).count()).sum()
}

#[test]
fn all_panels_of_a_slide_are_there() {
    let state = after("scene:Saw3@150,90deg", 120);
    let (lines, _) = screen(&state, Colors::True, false, [80, 24]);
    let all = lines.join("\n");
    assert!(lines[0].starts_with("wstac view  scene: Saw3 at 150 mm/s, 90 degrees"), "{all}");
    for text in
        ["picture, white: ", "taxels, % of full scale", "watching", "30 fps, nominal", "frame   120", "events  1"]
    {
        assert_eq!(count(&lines, text), 1, "{text}\n{all}");
    }
    assert!(count(&lines, "▀") > 300, "{all}");
    for name in ["r1", "r5", "c1", "c5"] {
        assert_eq!(count(&lines, name), 1, "{name}\n{all}");
    }
    let event = lines.iter().find(|line| line.contains("mm/s  ")).unwrap();
    assert!(event.starts_with("     35  1") && event.contains(" ↑  90°  ±0°   lit 2"), "{all}");
    assert!(lines[23].starts_with("q quit  z re-zero  r record  space pause  ←→ seek  ,. step  ? help"), "{all}");
}

#[test]
fn what_slides_is_shown_with_its_speed_and_direction() {
    let shown = |items| {
        let (lines, _) = screen(&after("scene:Saw3@150,90deg", items), Colors::True, false, [80, 24]);
        lines.iter().find_map(|line| Some(line.split_once(" mm/s ↑ ")?.1.trim().to_owned()))
    };
    let found = shown(56).expect("the slide is under way");
    assert!(["89°", "90°", "91°"].contains(&found.as_str()), "{found}");
    assert_eq!([shown(40), shown(100)], [None, None]);
}

#[test]
fn the_baseline_then_watching_then_an_event_then_the_end() {
    let phase = |items| after("scene:Saw3@150", items).phase;
    assert_eq!(phase(10), Phase::Baseline(10, Some(25)));
    assert_eq!(phase(25), Phase::Watching);
    assert_eq!(phase(60), Phase::Capturing(25));
    assert_eq!(phase(200), Phase::Ended);
    let state = after("scene:Saw3@150", 60);
    assert!(screen(&state, Colors::True, false, [80, 24]).0.iter().any(|line| line.contains("event 25/70")));
    // The same at 20 columns.
    assert!(screen(&state, Colors::True, false, [20, 5]).0[1].starts_with("event 25/70"), "narrow");
}

#[test]
fn no_size_is_too_small_and_none_too_large() {
    let states = [after("scene:Saw3@150", 0), after("scene:Saw3@150", 70), after("scene:Saw3@150", 200)];
    for state in &states {
        for colors in [Colors::None, Colors::Few, Colors::Many, Colors::True] {
            for size in [[1, 1], [20, 5], [3, 60], [200, 2], [59, 19], [60, 20], [61, 21], [80, 24], [300, 100]] {
                let with_help = size[0] % 2 == 0;
                screen(state, colors, with_help, size);
                screen(state, colors, !with_help, size);
            }
        }
    }
}

#[test]
fn lit_taxels_are_bright_on_the_map() {
    let mut state = after("scene:Saw3@150", 70);
    let mut taxels = [0.001; 25];
    // Row 2, column 4.
    taxels[8] = 0.5;
    state.peak = 0.02;
    state.set_taxels(Some(taxels));
    let (lines, buffer) = screen(&state, Colors::True, false, [80, 24]);
    let (y, line) = lines.iter().enumerate().skip(2).find(|(_, line)| line.contains(" 50 ")).unwrap();
    let x = line.find(" 50 ").map(|at| line[..at].chars().count()).unwrap();
    let bright = buffer[(x as u16 + 1, y as u16)].bg;
    let dark = buffer[(x as u16 - 4, y as u16)].bg;
    assert_eq!(bright, Colors::True.light(1.0));
    assert!(matches!(dark, Color::Rgb(_, g, _) if g < 60), "{dark:?}");
    // Without colors, the number is still visible.
    let (lines, buffer) = screen(&state, Colors::None, false, [80, 24]);
    assert!(lines.iter().any(|line| line.contains(" 50 ")));
    assert!(buffer.content().iter().all(|cell| cell.fg == Color::Reset && cell.bg == Color::Reset));
}

#[test]
fn a_trace_above_its_threshold_looks_otherwise() {
    let mut state = after("scene:Saw3@150", 30);
    state.traces.clear();
    state.thresholds = Some([-3.0; 10]);
    for frame in 0..40 {
        let mut features = [-4.5; 10];
        features[2] = if frame >= 20 { -1.0 } else { -4.5 };
        state.add_trace((frame != 10).then_some(features));
    }
    let (lines, buffer) = screen(&state, Colors::True, false, [100, 40]);
    let row = |name: &str| lines.iter().position(|line| line.starts_with(name)).unwrap() as u16;
    let colors = |name: &str| {
        let y = row(name);
        (0..46_u16).flat_map(|x| [y - 1, y, y + 1].map(|y| buffer[(x, y)].fg)).collect::<Vec<_>>()
    };
    assert!(colors("r3").contains(&Colors::True.lit()));
    assert!(!colors("r1").contains(&Colors::True.lit()));
    assert!(colors("r1").contains(&Colors::True.warning()), "the threshold");
    let all = lines.join("\n");
    assert!(all.contains("-1.00") && all.contains("-4.50"), "{all}");
}

#[test]
fn help_and_faults_can_be_read() {
    let mut state = after("scene:Saw3@150", 30);
    let (lines, _) = screen(&state, Colors::None, true, [80, 24]);
    assert!(lines.iter().any(|line| line.starts_with("z       re-zero")), "{lines:#?}");
    state.say(About::Trouble, "     30  disconnected: the camera is gone".into());
    state.phase = Phase::Failed("/dev/video0: no frame for 5 s: check the cable".into());
    let (lines, _) = screen(&state, Colors::None, false, [80, 24]);
    let all = lines.join("\n");
    assert!(
        all.contains("FAILED") && all.contains("disconnected: the camera is gone") && all.contains("check"),
        "{all}"
    );
}

#[test]
fn re_zero_gathers_a_new_baseline() {
    let state = play("scene:Saw3@150", &OpenOptions::default(), None, |player, state| {
        (0..50).for_each(|_| assert_eq!(player.step(state, false).unwrap(), 1));
        assert!(matches!(locked(state).phase, Phase::Capturing(_)));
        player.rezero(state);
        {
            let state = locked(state);
            assert_eq!((&state.phase, state.frame, state.thresholds), (&Phase::Baseline(0, Some(25)), 50, None));
            let [zero, sample] = [0, 1].map(|entry| &state.entries[entry].text);
            assert!(zero.contains("50  re-zero") && sample.contains("35  given up after 15"), "{zero} {sample}");
        }
        (0..25).for_each(|_| assert_eq!(player.step(state, false).unwrap(), 1));
    });
    // The specimen was on the sensor, and a note says so.
    let state = locked(&state);
    assert_eq!(state.phase, Phase::Watching);
    assert!(state.entries[0].text.contains("baseline was not quiet"), "{:?}", state.entries);
}

/// A recording begins with a new baseline. One that cannot begin leaves the old one.
#[test]
fn a_recording_that_is_refused_changes_nothing() {
    let folder = std::env::temp_dir().join(format!("wstac-refused-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (name, is_refused) in [("a.mcap", false), ("none/a.mcap", true)] {
        let mut source =
            open("scene:Saw3@150", &OpenOptions { size: Some((320, 180)), ..OpenOptions::default() }).unwrap();
        let info = source.info().clone();
        let mut reading = Processor::new(&info, &Config::default(), OutputOptions::default()).unwrap();
        let labels = wstac_host::source::Labels::default();
        let about = record::about::About::new(&info, &Config::default(), labels, Vec::new());
        let mut recordings = Recordings::new(about, Some(folder.join(name)), |record| format!("{record:?}"));
        let (mut player, state) = Player::new(&mut source, &info, &mut reading, &mut recordings, false);
        let state = Mutex::new(state);
        (0..30).for_each(|_| _ = player.step(&state, true).unwrap());
        player.record(&state);
        player.step(&state, true).unwrap();
        let said = locked(&state).entries.iter().any(|entry| entry.text.contains("no such file"));
        assert_eq!(said, is_refused, "{:?}", locked(&state).entries);
        drop(player);
        assert_eq!(reading.pipeline().baseline().is_some(), is_refused, "{name}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Going back and forth shows the screen that was there, and the source's events are found again.
#[test]
fn a_frame_that_is_gone_back_to_looks_as_it_did() {
    let options = OpenOptions { size: Some((320, 180)), ..OpenOptions::default() };
    let reopen = || {
        let source = open("scene:Saw3@150,90deg", &options)?;
        let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
        let processor = Processor::new(source.info(), &Config::default(), wanted)?;
        Ok((source, processor))
    };
    let (mut source, mut reading) = reopen().unwrap();
    let info = source.info().clone();
    let about = record::about::About::new(&info, &Config::default(), wstac_host::source::Labels::default(), Vec::new());
    let mut recordings = Recordings::new(about, None, |record| format!("{record:?}"));
    let (player, state) = Player::new(&mut source, &info, &mut reading, &mut recordings, false);
    let (mut player, state) = (player.reopened_by(Some(&reopen)), Mutex::new(state));
    assert_eq!((player.frames_of(1), player.frames_of(-10)), (30, -300));
    let play_to = |player: &mut Player<'_>, frame: u64| {
        while player.frame() < frame && player.goes_on() {
            player.step(&state, true).unwrap();
        }
        screen(&locked(&state), Colors::True, false, [80, 24])
    };
    let shown: Vec<_> = [50, 100, 110, 130].map(|frame| (frame, play_to(&mut player, frame))).into();
    play_to(&mut player, 1000);
    assert!(!player.goes_on());
    for (frame, before) in shown.iter().rev() {
        assert!(player.can_go_to(*frame, &state));
        // The end was reached, or a later frame.
        assert_eq!(player.frame(), 0);
        let now = play_to(&mut player, *frame);
        assert_eq!(now.0, before.0, "frame {frame}");
        assert!(now.1 == before.1, "frame {frame}: colors");
    }
    // Forth, the source goes on.
    assert!(player.can_go_to(100, &state));
    assert_eq!(player.frame(), 50);
    assert_eq!(play_to(&mut player, 100).0, shown[1].1.0);
    // A recording that is written has no jumps.
    player.record(&state);
    assert!(!player.can_go_to(0, &state) && !player.can_go_to(120, &state));
    assert!(locked(&state).entries[0].text.starts_with("no seek in a recording"), "{:?}", locked(&state).entries);
}

#[test]
fn a_source_that_can_be_read_once_says_so() {
    let state = play("scene:Saw3@150", &OpenOptions::default(), None, |player, state| {
        (0..40).for_each(|_| assert_eq!(player.step(state, false).unwrap(), 1));
        assert!(player.can_go_to(50, state) && !player.can_go_to(30, state));
        assert_eq!(player.frame(), 40);
    });
    assert!(locked(&state).entries[0].text.starts_with("no seek back"), "{:?}", locked(&state).entries);
}

/// 40 × 10 characters show state, motion, all traces and the last event, and no line is cut off without a sign.
#[test]
fn a_small_terminal_shows_what_matters() {
    for colors in [Colors::True, Colors::None] {
        let state = after("scene:Saw3@150,90deg", 56);
        let (lines, _) = screen(&state, colors, false, [40, 10]);
        let all = lines.join("\n");
        assert!(lines[0].starts_with("wstac view  scene: Saw3") && lines[0].ends_with('…'), "{all}");
        assert!(lines[1].starts_with("event 21/70  1") && lines[1].contains("mm/s ↑ "), "{all}");
        assert!(lines[1].trim_end().ends_with("frame 56"), "{all}");
        for name in ["r1", "r2", "r3", "r4", "r5", "c1", "c2", "c3", "c4", "c5"] {
            assert_eq!(count(&lines[3..], name), 1, "{name}: {all}");
        }
        assert!(lines[9].starts_with("q quit") && lines[9].contains("? help"), "{all}");
        let state = after("scene:Saw3@150,90deg", 140);
        let (lines, _) = screen(&state, colors, false, [40, 10]);
        let all = lines.join("\n");
        assert!(all.contains("35  1") && all.contains("mm/s") && all.contains("↑  90°"), "{all}");
    }
    // A line that is too long ends in a sign, and never in half a character.
    let mut state = after("scene:Saw3@150", 30);
    state.about = "カメラ".repeat(30);
    for width in 1..60 {
        let (lines, _) = screen(&state, Colors::None, false, [width, 6]);
        assert!(lines[0].trim_end().ends_with('…'), "{width}: {lines:?}");
    }
}

#[test]
fn a_recording_starts_afresh_and_gives_the_same_events_again() {
    let path = std::env::temp_dir().join(format!("wstac-view-{}.mcap", std::process::id()));
    let options = OpenOptions { size: Some((320, 180)), ..OpenOptions::default() };
    let state = play("scene:Saw3@150,90deg", &options, Some(path.clone()), |player, state| {
        (0..5).for_each(|_| assert_eq!(player.step(state, false).unwrap(), 1));
        player.record(state);
        (0..120).for_each(|_| assert_eq!(player.step(state, false).unwrap(), 1));
        {
            let state = locked(state);
            assert_eq!(state.rec.as_ref().map(|rec| rec.frames), Some(120));
            let (lines, _) = screen(&state, Colors::True, false, [200, 24]);
            assert!(lines[0].starts_with("● REC ") && lines[0].contains(".mcap, 120 frames, "), "{lines:#?}");
            assert_eq!(count(&lines, "r end recording"), 1, "{lines:#?}");
        }
        player.rezero(state);
        assert!(locked(state).entries[0].text.starts_with("no re-zero in a recording"));
        player.record(state);
        assert_eq!(locked(state).rec, None);
        assert!(locked(state).entries[0].text.contains(": 120 frames recorded, "), "{:?}", locked(state).entries);
    });
    let replay = play(path.to_str().unwrap(), &OpenOptions::default(), None, |player, state| {
        while player.goes_on() {
            player.step(state, false).unwrap();
        }
    });
    std::fs::remove_file(&path).unwrap();
    let event = |state: &Mutex<State>, zero: u64| {
        let entries = locked(state).entries.clone();
        let text = entries.into_iter().find(|entry| entry.about == About::Event).unwrap().text;
        let (frame, rest) = text.trim_start().split_once(' ').unwrap();
        (frame.parse::<u64>().unwrap() - zero, rest.to_owned())
    };
    // The view had read five frames before the recording started.
    assert_eq!(locked(&replay).frame, 120);
    assert_eq!(event(&state, 5), event(&replay, 0));
}

#[test]
fn taxels_alone_are_recorded_as_sums() {
    let [path, file] =
        ["toml", "mcap"].map(|end| std::env::temp_dir().join(format!("wstac-view-{}.{end}", std::process::id())));
    std::fs::write(&path, "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"\n").unwrap();
    let named = Some(file.clone());
    let state = play(&format!("scene:{}", path.display()), &OpenOptions::default(), named, |player, state| {
        player.record(state);
        player.step(state, false).unwrap();
        player.end_recording(state);
    });
    std::fs::remove_file(&path).unwrap();
    let mut recorded = open(file.to_str().unwrap(), &OpenOptions::default()).unwrap();
    assert!(recorded.info().taxels_only);
    assert!(matches!(recorded.next_event().unwrap(), SourceEvent::Taxels(_)));
    std::fs::remove_file(&file).unwrap();
    assert_eq!(locked(&state).rec, None);
}

/// Returns the state after these messages of a board.
fn after_messages(messages: &[Message<'_>]) -> (BoardPlayer, Mutex<State>) {
    let (mut player, state) = (BoardPlayer::new(), Mutex::new(BoardPlayer::state("/dev/ttyACM0").unwrap()));
    for (sequence, message) in (0..).zip(messages) {
        let bytes = encode(message, sequence, &mut [0; LONGEST]).to_vec();
        assert!(player.take(&bytes, &state).unwrap());
    }
    (player, state)
}

#[test]
fn a_board_is_shown_with_its_features_and_its_own_state() {
    let mut telemetry = Telemetry::default();
    (telemetry.uptime_ms, telemetry.millihertz) = (127_000, Some(29_970));
    (telemetry.overruns, telemetry.restarts, telemetry.stack) = (Some(2), Some(0), Some(5828));
    let features = |frame| Message::Features { frame, features: [1000; 10] };
    let (_, state) =
        after_messages(&[features(30), features(33), Message::Fault(Fault::Overrun), Message::Telemetry(telemetry)]);
    let state = state.into_inner().unwrap();
    // Two frames had no features.
    assert_eq!(state.traces.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, false, true]);
    let (lines, _) = screen(&state, Colors::True, false, [80, 24]);
    let all = lines.join("\n");
    assert!(lines[0].starts_with("wstac view  board at /dev/ttyACM0"), "{all}");
    for text in [
        "a board: no picture",
        "a board: no taxels",
        "29.97 fps",
        "frame   34",
        "up for  2 min 7 s",
        "overrun 2",
        "restart 0",
        "stack   5828 bytes",
        "pixels came faster than they were taken",
        "q quit  space pause  ? help",
    ] {
        assert_eq!(count(&lines, text), 1, "{text}\n{all}");
    }
    // What belongs to a camera or a source with frames is not there.
    for text in ["frame lost", "latency", "behind", "re-zero", "record"] {
        assert_eq!(count(&lines, text), 0, "{text}\n{all}");
    }
}

#[test]
fn a_board_is_asked_for_features_and_its_keys_say_what_they_cannot_do() {
    let (mut player, state) = after_messages(&[]);
    let board = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut port = Port::open(format!("tcp:{}", board.local_addr().unwrap()), None).unwrap();
    assert!(player.step(&mut port, &state).unwrap());
    let (mut line, _) = board.accept().unwrap();
    let mut bytes = [0; LONGEST];
    let count = line.read(&mut bytes).unwrap();
    let mut decoder = Decoder::<LONGEST>::new();
    let asked: Vec<Request> =
        bytes[..count].iter().filter_map(|&byte| Some(decoder.push::<Request>(byte)?.unwrap().message)).collect();
    let wanted = [Request::Hello, Request::Features(true), Request::Samples(false), Request::Motion(true)];
    assert_eq!(asked[..4], wanted);
    // The first wait for bytes has passed.
    (1..SILENT).for_each(|_| assert!(locked(&state).entries.is_empty() && player.step(&mut port, &state).unwrap()));
    assert_eq!(locked(&state).entries[0].text, "no data for 3 s");
    drop(line);
    assert!(!player.step(&mut port, &state).unwrap());
    assert_eq!(locked(&state).phase, Phase::Ended);
    for (key, said) in [(Key::Rezero, "gathers its baseline when it starts"), (Key::Record, "sends no frames")] {
        press(key, &state);
        assert!(locked(&state).entries[0].text.contains(said));
    }
    press(Key::Pause, &state);
    // A board goes on, and the screen does not.
    let bytes = encode(&Message::Features { frame: 5, features: [0; 10] }, 0, &mut [0; LONGEST]).to_vec();
    player.take(&bytes, &state).unwrap();
    let state = state.into_inner().unwrap();
    assert!(state.frozen() && state.traces.is_empty() && state.frame == 6);
}
