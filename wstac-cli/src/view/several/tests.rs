//! Tests of sensors that are read at once, without a terminal.

use std::sync::MutexGuard;
use std::time::{Duration, Instant};

use super::*;
use crate::open;
use wstac_host::config::Config;
use wstac_host::output::OutputOptions;
use wstac_host::source::SourceEvent;
use wstac_host::source::open::OpenOptions;

/// The time limit of every wait on a busy machine.
const PATIENCE: Duration = Duration::from_mins(1);

fn processor(info: &StreamInfo) -> Processor {
    let wanted = OutputOptions { features: true, motion: true, ..OutputOptions::default() };
    Processor::new(info, &Config::default(), wanted).unwrap()
}

/// Opens a scene with small frames.
fn scene(name: &'static str, start: f64) -> Opened<'static> {
    let options = OpenOptions { size: Some((160, 90)), ..OpenOptions::default() };
    let reopen = move || {
        let source = open(name, &options)?;
        let processor = processor(source.info());
        Ok((source, processor))
    };
    let (source, processor) = reopen().unwrap();
    let info = source.info().clone();
    Opened::Frames(Box::new(Frames { source, info, processor, reopen: Some(Box::new(reopen)), live: false, start }))
}

/// A live source that gives frames until it is silent or fails.
struct Stalling {
    info: StreamInfo,
    frames: u32,
    fails: bool,
}

impl Source for Stalling {
    fn info(&self) -> &StreamInfo {
        &self.info
    }

    fn next_event(&mut self) -> Result<SourceEvent<'_>, Error> {
        static DARK: [u8; 160 * 90] = [1; 160 * 90];
        match self.frames.checked_sub(1) {
            Some(left) => {
                self.frames = left;
                Ok(SourceEvent::Frame(wstac_host::source::Frame::new(&DARK)))
            }
            None if self.fails => Err(Error::new(ErrorKind::Data, "the camera", "is gone")),
            None => {
                thread::sleep(Duration::from_millis(200));
                Ok(SourceEvent::Waiting)
            }
        }
    }
}

fn stalling(fails: bool) -> Opened<'static> {
    use wstac_core::{green::any::PixelFormat, layout::FrameSize, rate::FrameRate};
    let info = StreamInfo::new("a camera", FrameSize::new(160, 90).unwrap(), PixelFormat::Gray, FrameRate::NOMINAL);
    let processor = processor(&info);
    let source = Box::new(Stalling { info: info.clone(), frames: 30, fails });
    Opened::Frames(Box::new(Frames { source, info, processor, reopen: None, live: true, start: 0.0 }))
}

/// The keys of a user, and what the sensors show.
struct User<'a> {
    shared: &'a Shared,
    keys: &'a Sender<Key>,
}

impl User<'_> {
    fn press(&self, key: Key) {
        self.keys.send(key).unwrap();
    }

    fn state(&self, sensor: usize) -> MutexGuard<'_, State> {
        locked(self.shared.state(sensor))
    }

    fn frames(&self) -> Vec<u64> {
        (0..self.shared.sensors.len()).map(|sensor| self.state(sensor).frame).collect()
    }

    /// Waits until something is so.
    fn until(&self, what: &str, is_so: impl Fn(&Self) -> bool) {
        let end = Instant::now() + PATIENCE;
        while !is_so(self) {
            assert!(Instant::now() < end, "{what}: {:?}", self.frames());
            thread::sleep(Duration::from_millis(5));
        }
    }
}

/// Reads sensors while `user` acts, and returns how they failed.
fn with(sensors: Vec<Opened<'_>>, [fast, repeats]: [bool; 2], user: impl FnOnce(&User<'_>)) -> Vec<Option<String>> {
    let named = |(number, opened)| Sensor { name: format!("s{number}"), opened };
    let sensors: Vec<_> = sensors.into_iter().enumerate().map(named).collect();
    let shared = Shared::new(sensors.iter().map(|sensor| sensor.state().unwrap()));
    let (sender, keys) = channel();
    let failures = thread::scope(|scope| {
        let shared = &shared;
        let reading = scope.spawn(move || read(sensors, shared, &keys, fast, repeats));
        // Also after a failed assertion, so that the test ends.
        let end = super::super::EndBoth(shared);
        user(&User { shared, keys: &sender });
        drop(end);
        reading.join().unwrap()
    });
    failures.into_iter().map(|failure| failure.map(|error| error.to_string())).collect()
}

#[test]
fn jumps_and_steps_move_all_files_on_one_time_line() {
    // The second one starts 0.5 s later, which are 15 frames.
    let sensors = vec![scene("scene:Saw3@150,90deg", 0.0), scene("scene:Tri2@120", 0.5)];
    with(sensors, [false, false], |user| {
        user.press(Key::Pause);
        user.until("the pause", |user| user.state(0).paused && user.state(1).paused);
        for (key, expected) in [
            (Key::Start, [0, 0]),
            (Key::Seek(2), [60, 45]),
            (Key::Step(1), [61, 46]),
            (Key::Step(-1), [60, 45]),
            (Key::Seek(-1), [30, 15]),
            (Key::Step(-1), [29, 14]),
        ] {
            user.press(key);
            user.until("a jump", |user| user.frames() == expected);
        }
        user.press(Key::Seek(100));
        user.until("the end", |user| (0..2).all(|sensor| user.state(sensor).phase == Phase::Ended));
        assert!((0..2).all(|sensor| user.state(sensor).events == 1));
        let end = user.frames();
        // The last one ends at the end of the time line, and the other one has less to go back.
        user.press(Key::Seek(-1));
        user.until("back from the end", |user| user.frames() == [end[1] + 15 - 30, end[1] - 30]);
    });
}

#[test]
fn files_are_played_together_and_start_again_together() {
    let sensors = vec![scene("scene:Saw3@150,90deg", 0.0), scene("scene:Tri2@300", 0.0)];
    with(sensors, [true, true], |user| {
        let (mut again, mut last) = ([0_u32; 2], [0; 2]);
        let end = Instant::now() + PATIENCE;
        while again[0].min(again[1]) < 3 {
            assert!(Instant::now() < end, "started {again:?} times again");
            for sensor in 0..2 {
                let frame = user.state(sensor).frame;
                again[sensor] += u32::from(frame < last[sensor]);
                last[sensor] = frame;
            }
            assert!(again[0].abs_diff(again[1]) <= 1, "started {again:?} times again");
        }
    });
}

#[test]
fn a_sensor_that_stalls_or_fails_does_not_stop_the_others() {
    let sensors = vec![stalling(false), scene("scene:Saw3@150,90deg", 0.0), stalling(true)];
    let failures = with(sensors, [true, false], |user| {
        user.until("the end of the scene", |user| user.state(1).phase == Phase::Ended);
        assert_eq!(user.state(1).events, 1);
        user.until("the failure", |user| matches!(user.state(2).phase, Phase::Failed(_)));
        assert_eq!(user.state(0).frame, 30);
        // z is for the sensor that is shown alone.
        user.shared.chosen.store(1, Ordering::Relaxed);
        user.press(Key::Rezero);
        user.until("z", |user| user.state(0).entries.front().is_some_and(|entry| entry.text.contains("re-zero")));
        assert!(user.state(1).entries.iter().all(|entry| !entry.text.contains("re-zero")));
        user.press(Key::Record);
        user.until("r", |user| user.state(0).entries[0].text.starts_with("no recording of several"));
    });
    assert_eq!(failures, [None, None, Some("the camera: is gone".to_owned())]);
}

#[test]
fn live_sensors_have_no_way_back() {
    with(vec![stalling(false), stalling(false)], [false, false], |user| {
        user.until("frames", |user| user.frames() == [30, 30]);
        user.press(Key::Seek(-1));
        user.until("the note", |user| {
            (0..2)
                .all(|sensor| user.state(sensor).entries.front().is_some_and(|entry| entry.text.starts_with("no seek")))
        });
        user.press(Key::Pause);
        user.until("the pause", |user| (0..2).all(|sensor| user.state(sensor).frozen()));
    });
}
