//! Tests of the screen of several sensors.

use std::time::{Duration, SystemTime};

use super::*;
use wstac_host::output::Stamp;

/// Returns sensors that slide and sensors that wait, by turns.
fn sensors(names: &[&str]) -> Vec<State> {
    let states = [after("scene:Saw3@150,90deg", 56), after("scene:Tri2@120", 140)];
    names.iter().zip(states.iter().cycle()).map(|(name, state)| state.clone().named(name)).collect()
}

/// Returns what a terminal of this size shows of all sensors, or of one of them.
fn of(sensors: &[State], chosen: usize, colors: Colors, size: [u16; 2]) -> (Vec<String>, Buffer) {
    let states: Vec<_> = sensors.iter().collect();
    shown(&View { states: &states, chosen, with_help: false, colors }, size)
}

/// Returns the row and the column in characters where a text is.
fn place(lines: &[String], text: &str) -> (usize, usize) {
    let found = lines.iter().enumerate().find_map(|(row, line)| Some((row, line[..line.find(text)?].chars().count())));
    found.unwrap_or_else(|| panic!("no {text:?}:\n{}", lines.join("\n")))
}

#[test]
fn two_sensors_are_beside_each_other_on_a_wide_terminal_and_below_on_a_narrow_one() {
    let both = sensors(&["left", "right"]);
    let at = |size| {
        let (lines, _) = of(&both, 0, Colors::None, size);
        (place(&lines, "left  "), place(&lines, "right  "))
    };
    assert_eq!(at([80, 24]), ((1, 0), (1, 41)));
    assert_eq!(at([120, 40]), ((1, 0), (1, 61)));
    assert_eq!(at([40, 10]), ((1, 0), (5, 0)));
    assert_eq!(at([60, 40]), ((1, 0), (20, 0)));
}

/// 40 × 10 characters show state, motion, taxels and the last event of two sensors, with and without colors.
#[test]
fn a_small_terminal_shows_what_matters_of_two_sensors() {
    let both = sensors(&["left", "right"]);
    for colors in [Colors::None, Colors::True] {
        let (lines, buffer) = of(&both, 0, colors, [40, 10]);
        let all = lines.join("\n");
        assert!(lines[0].starts_with("wstac view  2 sensors"), "{all}");
        assert!(lines[1].starts_with("left  event 21/70  1") && lines[1].contains(" mm/s ↑ "), "{all}");
        // With motion there is no room for the frame, which is left out whole.
        assert!(lines[1].trim_end().ends_with('°'), "{all}");
        assert!(lines[5].starts_with("right  ") && lines[5].contains("frame 140"), "{all}");
        // The map at the left has all taxels, and the event at the right ends in a sign if it is too long.
        assert!(lines[3].contains("no event yet"), "{all}");
        let event = &lines[place(&lines, "→").0];
        assert!(event.contains("  35  12") && event.contains(" mm/s") && event.ends_with('…'), "{all}");
        assert!(lines[9].starts_with("q quit  Tab one") && lines[9].contains("? help"), "{all}");
        let map: Vec<_> = (2..5).flat_map(|y| (0..10).map(move |x| (x, y))).map(|at| &buffer[at]).collect();
        if colors == Colors::None {
            assert!(map.iter().all(|cell| "█▀▄·".contains(cell.symbol())), "{all}");
            assert!(buffer.content().iter().all(|cell| cell.fg == Color::Reset && cell.bg == Color::Reset));
        } else {
            let colors: std::collections::HashSet<_> = map.iter().map(|cell| (cell.fg, cell.bg)).collect();
            assert!(colors.len() > 5, "{colors:?}");
        }
    }
}

#[test]
fn lit_taxels_are_on_the_smallest_map() {
    let mut state = after("scene:Saw3@150", 70).named("left");
    let mut taxels = [0.001; 25];
    // The first row's first taxel, the second row's last, and the fifth row's middle.
    (taxels[0], taxels[9], taxels[22]) = (0.5, 0.5, 0.5);
    state.set_taxels(Some(taxels));
    let two = [state.clone(), state.clone().named("right")];
    let (lines, _) = of(&two, 0, Colors::None, [40, 10]);
    let map = |row: usize| lines[row].chars().take(10).collect::<String>();
    assert_eq!([2, 3, 4].map(map), ["▀▀······▄▄", "··········", "····▀▀····"]);
    // A frame that was lost has no taxels.
    state.set_taxels(None);
    let (lines, _) = of(&[state.clone(), state], 0, Colors::None, [40, 10]);
    assert!(lines[2].starts_with("frame lost"), "{lines:?}");
}

#[test]
fn a_wide_terminal_has_all_panels_of_each_sensor() {
    let both = sensors(&["left", "right"]);
    let (lines, _) = of(&both, 0, Colors::True, [120, 40]);
    let all = lines.join("\n");
    for text in ["picture, white: ", "taxels, % of full scale", "r1", "c5", "events  ", "frame  "] {
        assert!(count(&lines, text) >= 2, "{text}\n{all}");
    }
    // In half of 80 columns there are taxels and traces, and no picture.
    let (lines, _) = of(&both, 0, Colors::None, [80, 24]);
    let all = lines.join("\n");
    for text in ["taxels, % of full scale", "r1", "r5", "c1", "c5", "30 fps", "nominal"] {
        assert_eq!(count(&lines, text), 2, "{text}\n{all}");
    }
}

#[test]
fn sensors_without_room_are_counted_and_can_be_chosen() {
    let names: Vec<String> = (1..=20).map(|number| format!("s{number}")).collect();
    let all = sensors(&names.iter().map(String::as_str).collect::<Vec<_>>());
    let (lines, _) = of(&all, 0, Colors::None, [40, 10]);
    assert!(lines[0].starts_with("wstac view  20 sensors, 16 not shown"), "{lines:?}");
    assert_eq!(lines.iter().filter(|line| line.starts_with('s')).count(), 4, "{lines:#?}");
    // All fit into 80 × 24.
    let (lines, _) = of(&all, 0, Colors::None, [80, 24]);
    assert!(lines[0].trim_end().ends_with("20 sensors"), "{lines:?}");
    for name in &names {
        place(&lines, &format!("{name}  "));
    }
    // One that is chosen has the screen of a single source.
    let (lines, _) = of(&all, 19, Colors::None, [40, 10]);
    assert!(lines[0].starts_with("wstac view  s19 (19 of 20)  scene: Saw3") && lines[0].ends_with('…'), "{lines:?}");
    assert!(lines[1].starts_with("s19  event 21/70"), "{lines:?}");
    assert!(lines[9].starts_with("q quit  Tab next"), "{lines:?}");
    let (lines, _) = of(&all, 19, Colors::None, [80, 24]);
    assert_eq!(count(&lines, "picture, white"), 1);
}

#[test]
fn no_size_is_too_small_for_several_and_tiles_do_not_overlap() {
    let all = sensors(&["a", "b", "c", "d", "e", "f", "g"]);
    for columns in (1..130).step_by(3) {
        for rows in 1..45 {
            let area = Rect { x: 0, y: 1, width: columns, height: rows };
            for count in 1..=all.len() {
                let places = tiles::places(count, area);
                assert!(!places.is_empty() && places.len() <= count, "{count} in {area:?}");
                for (number, place) in places.iter().enumerate() {
                    assert!(area.union(*place) == area && !place.is_empty(), "{place:?} of {count} in {area:?}");
                    assert!(places[..number].iter().all(|other| !other.intersects(*place)), "{count} in {area:?}");
                }
            }
        }
    }
    for size in [[1, 1], [20, 5], [3, 60], [200, 2], [59, 19], [80, 24], [36, 30], [300, 100]] {
        for count in [2, 3, 7] {
            (0..=count).for_each(|chosen| drop(of(&all[..count], chosen, Colors::Few, size)));
        }
    }
}

#[test]
fn one_that_has_failed_says_so_beside_the_others() {
    let mut both = sensors(&["left", "right"]);
    both[0].phase = Phase::Failed("/dev/video0: no frame for 5 s".into());
    let (lines, _) = of(&both, 0, Colors::None, [40, 10]);
    let all = lines.join("\n");
    assert!(lines[1].starts_with("left  FAILED  /dev/video0: no frame for…"), "{all}");
    assert!(lines[5].starts_with("right  watching"), "{all}");
}

#[test]
fn times_of_day_are_there_where_the_source_knows_them() {
    let mut state = after("scene:Saw3@150,90deg", 140);
    let (lines, _) = screen(&state, Colors::None, false, [80, 24]);
    assert_eq!(count(&lines, "UTC"), 0, "a scene has none: {lines:#?}");
    // 2023-11-14, 22:13:20.
    let stamp = |ms| Stamp {
        time: SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000) + Duration::from_millis(ms),
        within: Duration::from_millis(2),
    };
    state.stamp = Some(stamp(4_567));
    state.entries[0].stamp = Some(stamp(1_234));
    let (lines, _) = screen(&state, Colors::None, false, [80, 24]);
    let all = lines.join("\n");
    assert_eq!(count(&lines, "UTC 22:13:24.567"), 1, "{all}");
    let event = lines.iter().find(|line| line.contains("lit ")).unwrap();
    assert!(event.ends_with("  22:13:21.234"), "{all}");
    // An event that needs the row keeps it.
    let (lines, _) = screen(&state, Colors::None, false, [40, 10]);
    assert!(lines.iter().any(|line| line.contains("↑  90°")) && count(&lines, "22:13:21") == 0, "{lines:#?}");
}

/// Once a live board's clock is matched with this machine's, its frames have the time of day.
#[test]
fn a_live_board_shows_times_once_its_clock_is_matched() {
    use std::io::Write;
    use wstac_core::green::any::PixelFormat;
    use wstac_core::layout::FrameSize;
    use wstac_core::rate::FrameRate;
    use wstac_core::trigger::TriggerConfig;
    use wstac_core::wire::{FrameTime, Hello, Text};

    let (mut player, state) = after_messages(&[]);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut port = Port::open(format!("tcp:{}", listener.local_addr().unwrap()), None).unwrap();
    assert!(player.step(&mut port, &state).unwrap());
    let (mut board, _) = listener.accept().unwrap();
    let mut bytes = [0; LONGEST];
    let count = board.read(&mut bytes).unwrap();
    let mut decoder = Decoder::<LONGEST>::new();
    let requests = bytes[..count].iter().filter_map(|&byte| Some(decoder.push::<Request>(byte)?.unwrap().message));
    let asked = requests
        .into_iter()
        .find_map(|request| if let Request::Time { host_us } = request { Some(host_us) } else { None });
    let host_us = asked.expect("the board is asked for its time");
    let hello = Message::Hello(Hello {
        firmware: Text::new("board"),
        version: Text::new("1"),
        size: FrameSize::new(320, 240).unwrap(),
        format: PixelFormat::Gray,
        rate: FrameRate::NOMINAL,
        trigger: TriggerConfig::default(),
        models: [None; 3],
        frame: 40,
        revision: Text::new(""),
        id: None,
    });
    let mut telemetry = Telemetry::default();
    (telemetry.uptime_ms, telemetry.last_frame) = (1000, Some(FrameTime { frame: 40, board_us: 1_000_000 }));
    let answer = Message::Time { host_us, board_us: 1_000_000 };
    let features = Message::Features { frame: 41, features: [0; 10] };
    let before = SystemTime::now();
    for (sequence, message) in (0..).zip([hello, answer, Message::Telemetry(telemetry), features]) {
        board.write_all(encode(&message, sequence, &mut [0; LONGEST])).unwrap();
    }
    while locked(&state).frame < 42 {
        assert!(player.step(&mut port, &state).unwrap());
    }
    let state = state.into_inner().unwrap();
    let shown = state.stamp.expect("the frame has a time").time;
    let apart = shown.duration_since(before).or_else(|error| Ok::<_, ()>(error.duration())).unwrap();
    assert!(apart < Duration::from_mins(1), "{shown:?} and {before:?}");
    let (lines, _) = screen(&state, Colors::None, false, [80, 24]);
    let all = lines.join("\n");
    assert_eq!((super::count(&lines, "UTC "), super::count(&lines, "clock   ±")), (1, 1), "{all}");
}
