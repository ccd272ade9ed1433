//! Tests of the screen: a scene, or what a board sends, is played into a terminal of a given size.

use std::fs;
use std::sync::Mutex;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::style::Color;

use super::colors::{LIT, WARNING};
use super::*;
use crate::open;
use crate::view::state::About;
use crate::view::{SourceView, locked};
use wstac_core::wire::{Fault, LONGEST, Message, Telemetry, encode};
use wstac_host::config::Config;
use wstac_host::output::OutputOptions;
use wstac_host::source::open::OpenOptions;
use wstac_host::station::Station;
use wstac_host::texture::Textures;

/// Returns a board, or a scene with small frames.
fn view(name: impl AsRef<std::ffi::OsStr>, size: Option<(u32, u32)>) -> SourceView {
    let source = open(name, &OpenOptions { size, ..OpenOptions::default() }).unwrap();
    let info = source.info().clone();
    let station = Station::new(source, info, Config::default(), Textures::default(), OutputOptions::LIVE);
    SourceView::new(station.unwrap(), size.is_none())
}

/// Reads so many times, or to the end.
fn play(sensor: &mut SourceView, state: &Mutex<State>, steps: u32) {
    for _ in 0..steps {
        locked(state).wants_picture = true;
        if !sensor.step(state).unwrap() {
            return;
        }
    }
}

/// Returns the state after this many items of a scene.
fn after(name: &str, items: u32) -> State {
    let mut frames = view(name, Some((320, 180)));
    let state = Mutex::new(frames.state());
    play(&mut frames, &state, items);
    state.into_inner().unwrap()
}

/// Returns what a terminal of this size shows, one string per row.
fn screen(state: &State, colors: Colors, [width, height]: [u16; 2]) -> (Vec<String>, Buffer) {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal
        .draw(|frame| {
            let area = frame.area();
            draw(state, colors, area, frame.buffer_mut());
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
    let (lines, _) = screen(&state, Colors(true), [80, 24]);
    let all = lines.join("\n");
    assert!(lines[0].starts_with("wstac view  scene: Saw3 at 150 mm/s, 90 degrees"), "{all}");
    for text in
        ["picture, white: ", "taxels, % of full scale", "watching", "30 fps, nominal", "frame   120", "events  1"]
    {
        assert_eq!(count(&lines, text), 1, "{text}\n{all}");
    }
    assert!(count(&lines, "▀") > 250, "{all}");
    for name in ["r1", "r5", "c1", "c5"] {
        assert_eq!(count(&lines, name), 1, "{name}\n{all}");
    }
    let event = lines.iter().find(|line| line.starts_with("event at frame 35: slide, speed 1")).unwrap();
    assert!(event.contains(" mm/s, direction "), "{all}");
    assert!(lines[23].starts_with("q quit  z re-zero  space pause"), "{all}");
    // A tall terminal has room for the facts, too.
    assert_eq!(count(&screen(&state, Colors(true), [80, 100]).0, "frame   120"), 1);
}

#[test]
fn what_slides_is_shown_with_its_speed_and_direction() {
    let shown = |items| {
        let (lines, _) = screen(&after("scene:Saw3@150,90deg", items), Colors(true), [80, 24]);
        lines.iter().find_map(|line| Some(line.split_once(" mm/s ↑ ")?.1.trim().to_owned()))
    };
    let found = shown(56).expect("the slide is under way");
    assert!(["89°", "90°", "91°"].contains(&found.as_str()), "{found}");
    assert_eq!([shown(40), shown(100)], [None, None]);
}

#[test]
fn the_baseline_then_watching_then_an_event() {
    let doing = |items| after("scene:Saw3@150", items).doing;
    assert_eq!(doing(10), (About::Trouble, "baseline 10/25".to_owned()));
    assert_eq!(doing(25), (About::Note, "watching".to_owned()));
    assert_eq!(doing(60), (About::Event, "event 25/70".to_owned()));
    let state = after("scene:Saw3@150", 60);
    assert!(screen(&state, Colors(true), [20, 5]).0[1].starts_with("event 25/70"), "narrow");
    let entries = after("scene:Saw3@150", 200).entries;
    assert!(entries[0].1.starts_with("end after 140 frames, 0 dropped"), "{entries:?}");
}

#[test]
fn no_size_is_too_small_and_none_too_large() {
    for state in [after("scene:Saw3@150", 0), after("scene:Saw3@150", 70), after("scene:Saw3@150", 200)] {
        for colors in [Colors(false), Colors(true)] {
            for size in
                [[1, 1], [20, 5], [3, 60], [200, 2], [200, 1], [59, 19], [60, 20], [61, 21], [80, 24], [300, 100]]
            {
                screen(&state, colors, size);
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
    let (lines, buffer) = screen(&state, Colors(true), [80, 24]);
    let (y, line) = lines.iter().enumerate().skip(2).find(|(_, line)| line.contains(" 50 ")).unwrap();
    let x = line.find(" 50 ").map(|at| line[..at].chars().count()).unwrap();
    assert_eq!(buffer[(x as u16 + 1, y as u16)].bg, Color::Indexed(230));
    assert!(matches!(buffer[(x as u16 - 4, y as u16)].bg, Color::Indexed(16 | 22)));
    // Without colors, the number is still visible.
    let (lines, buffer) = screen(&state, Colors(false), [80, 24]);
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
    let (lines, buffer) = screen(&state, Colors(true), [100, 40]);
    let row = |name: &str| lines.iter().position(|line| line.starts_with(name)).unwrap() as u16;
    let colors = |name: &str| {
        let y = row(name);
        (0..46_u16).flat_map(|x| [y - 1, y, y + 1].map(|y| buffer[(x, y)].fg)).collect::<Vec<_>>()
    };
    assert!(colors("r3").contains(&Color::Indexed(LIT)));
    assert!(!colors("r1").contains(&Color::Indexed(LIT)));
    assert!(colors("r1").contains(&Color::Indexed(WARNING)), "the threshold");
    let all = lines.join("\n");
    assert!(all.contains("-1.00") && all.contains("-4.50"), "{all}");
}

#[test]
fn re_zero_gathers_a_new_baseline() {
    let mut frames = view("scene:Saw3@150", Some((320, 180)));
    let state = Mutex::new(frames.state());
    play(&mut frames, &state, 50);
    assert_eq!(locked(&state).doing.0, About::Event);
    frames.rezero(&mut locked(&state));
    {
        let state = locked(&state);
        assert_eq!((&*state.doing.1, state.frame, state.thresholds), ("baseline 0/25", 50, None));
        let [zero, sample] = [0, 1].map(|entry| &state.entries[entry].1);
        assert!(zero.contains("frame 50: a new baseline") && sample.contains("frame 35: "), "{zero} {sample}");
    }
    play(&mut frames, &state, 25);
    // The specimen was on the sensor, and a note says so.
    let state = locked(&state);
    assert_eq!(state.doing.1, "watching");
    assert!(state.entries[0].1.contains("baseline was not quiet"), "{:?}", state.entries);
}

/// 40 × 10 characters show state, motion, all traces and the last event, and no line is cut off without a sign.
#[test]
fn a_small_terminal_shows_what_matters() {
    let mut state = after("scene:Saw3@150,90deg", 56);
    let (lines, _) = screen(&state, Colors(false), [40, 10]);
    let all = lines.join("\n");
    assert!(lines[0].starts_with("wstac view  scene: Saw3") && lines[0].ends_with('…'), "{all}");
    assert!(lines[1].starts_with("event 21/70  1") && lines[1].contains("mm/s ↑ "), "{all}");
    for name in ["r1", "r2", "r3", "r4", "r5", "c1", "c2", "c3", "c4", "c5"] {
        assert_eq!(count(&lines[3..], name), 1, "{name}: {all}");
    }
    assert!(lines[9].starts_with("q quit"), "{all}");
    // A line that is too long never ends in half a character.
    state.about = "カメラ".repeat(30);
    for width in 1..60 {
        let (lines, _) = screen(&state, Colors(false), [width, 8]);
        assert!(width < 14 || lines[0].contains('…'), "{width}: {lines:?}");
    }
}

#[test]
fn a_board_is_shown_by_its_messages() {
    let (mut bytes, mut room) = (Vec::new(), [0; LONGEST]);
    let mut telemetry = Telemetry::default();
    (telemetry.uptime_ms, telemetry.millihertz) = (62_000, Some(29_970));
    let messages = [
        Message::Telemetry(telemetry),
        Message::Features { frame: 40, features: [-2048; 10] },
        Message::Features { frame: 43, features: [-1024; 10] },
        Message::Fault(Fault::Overrun),
    ];
    for (number, message) in (0..).zip(&messages) {
        bytes.extend_from_slice(encode(message, number, &mut room));
    }
    let file = std::env::temp_dir().join(format!("wstac-view-board-{}", std::process::id()));
    fs::write(&file, bytes).unwrap();
    let mut board = view(&file, None);
    let state = Mutex::new(board.state());
    play(&mut board, &state, 100);
    fs::remove_file(&file).unwrap();
    let state = state.into_inner().unwrap();
    let (lines, _) = screen(&state, Colors(false), [160, 24]);
    let all = lines.join("\n");
    assert!(lines[0].contains("up for 1 min 2 s, 29.97 frames per second"), "{all}");
    assert_eq!(count(&lines, "a board sends none"), 2, "{all}");
    assert_eq!(count(&lines, "-0.50"), 10, "{all}");
    // Two frames between the others were lost.
    let traces: Vec<_> = state.traces.iter().map(Option::is_some).collect();
    assert_eq!(traces, [true, false, false, true]);
    board.rezero(&mut State::new(String::new(), true, String::new()));
}
