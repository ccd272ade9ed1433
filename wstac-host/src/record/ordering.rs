//! Turns of the sensors of one recording: the source's events are taken in the order of their times, so that the same
//! sources make the same recording, wherever it ends.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// The state of a sensor in the turns of all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TurnState {
    /// The sensor reads its source, or is having its turn: the others wait for whatever comes next of it.
    Busy,
    /// The sensor has an event of this time, and waits.
    Waiting {
        time: u64,
        /// Whether the event is the sensor's end.
        is_end: bool,
    },
    /// The sensor has ended, and nobody waits for it.
    Ended,
}

#[derive(Debug)]
struct States {
    of: Vec<TurnState>,
    /// Whether the recording ends: no sensor takes an event any more, other than its own end.
    is_over: bool,
}

#[derive(Debug)]
struct Turns {
    states: Mutex<States>,
    changed: Condvar,
}

/// The part of a sensor in the turns of all. Dropping it ends the sensor.
#[derive(Debug)]
pub(super) struct Turn {
    turns: Arc<Turns>,
    sensor: usize,
}

pub(super) fn turns(sensors: usize) -> Vec<Turn> {
    let states = Mutex::new(States { of: vec![TurnState::Busy; sensors], is_over: false });
    let turns = Arc::new(Turns { states, changed: Condvar::new() });
    (0..sensors).map(|sensor| Turn { turns: Arc::clone(&turns), sensor }).collect()
}

impl Turns {
    fn lock(&self) -> MutexGuard<'_, States> {
        // A sensor whose thread has panicked has ended, and the others go on.
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state of a sensor, which the others may wait for.
    fn set(&self, sensor: usize, state: TurnState) -> MutexGuard<'_, States> {
        let mut states = self.lock();
        states.of[sensor] = state;
        self.changed.notify_all();
        states
    }
}

impl States {
    /// Returns whether a sensor's event of this time is the next of all. Of those with the same time, the first sensor
    /// comes first.
    fn is_next(&self, sensor: usize, time: u64) -> bool {
        self.of.iter().enumerate().all(|(other, state)| match state {
            _ if other == sensor => true,
            TurnState::Busy => false,
            // The end of the recording is about to wake it up.
            TurnState::Waiting { is_end: false, .. } if self.is_over => false,
            TurnState::Waiting { time: of_other, .. } => (time, sensor) < (*of_other, other),
            TurnState::Ended => true,
        })
    }
}

impl Turn {
    /// Waits until an event of this time is the next of all sensors. Returns whether it is to be taken; it is not if
    /// the recording ends before it. The end of a sensor is always taken.
    pub(super) fn wait(&self, time: u64, is_end: bool) -> bool {
        let mut states = self.turns.set(self.sensor, TurnState::Waiting { time, is_end });
        loop {
            let is_taken = !states.is_over || is_end;
            if !is_taken || states.is_next(self.sensor, time) {
                states.of[self.sensor] = TurnState::Busy;
                return is_taken;
            }
            states = self.turns.changed.wait(states).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Ends the recording: nothing is taken that comes behind this turn.
    pub(super) fn end_all(&self) {
        self.turns.lock().is_over = true;
        self.turns.changed.notify_all();
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        drop(self.turns.set(self.sensor, TurnState::Ended));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::thread;
    use std::time::Duration;

    use super::*;

    /// Added to the time of a sensor's end.
    const END: u64 = 1000;

    /// Lets sensors with these times take turns in threads of their own, until the sensor and the time that end all.
    fn taken(all: &[&[u64]], last: Option<(usize, u64)>) -> Vec<(usize, u64)> {
        let (sender, order) = channel();
        thread::scope(|scope| {
            for (turn, times) in turns(all.len()).into_iter().zip(all) {
                let sender = sender.clone();
                scope.spawn(move || {
                    let mut now = 0;
                    for &time in *times {
                        // Sources take their time, each another one.
                        thread::sleep(Duration::from_micros(time % 7 * 100));
                        if !turn.wait(time, false) {
                            break;
                        }
                        now = time;
                        sender.send((turn.sensor, time)).unwrap();
                        if last == Some((turn.sensor, time)) {
                            turn.end_all();
                            break;
                        }
                    }
                    // The end comes behind the last event that was taken.
                    assert!(turn.wait(now, true));
                    sender.send((turn.sensor, now + END)).unwrap();
                });
            }
        });
        drop(sender);
        order.iter().collect()
    }

    #[test]
    fn events_are_taken_in_the_order_of_their_times() {
        let times: [&[u64]; 3] = [&[0, 30, 60, 60, 90], &[0, 40, 60, 80], &[50]];
        let start = [(0, 0), (1, 0), (0, 30), (1, 40), (2, 50), (2, 50 + END), (0, 60), (0, 60), (1, 60)];
        let all = [&start[..], &[(1, 80), (1, 80 + END), (0, 90), (0, 90 + END)]].concat();
        // Whatever the threads do, the recording ends at the same place, and the ends come in their order.
        let cut = [&start[..], &[(0, 60 + END), (1, 60 + END)]].concat();
        let early = [(0, 0), (1, 0), (0, 30), (1, END), (2, END), (0, 30 + END)];
        for _ in 0..50 {
            assert_eq!(taken(&times, None), all);
            assert_eq!(taken(&times, Some((1, 60))), cut);
            assert_eq!(taken(&times, Some((0, 30))), early);
        }
    }

    #[test]
    fn a_sensor_that_has_ended_is_not_waited_for() {
        assert_eq!(taken(&[&[], &[1, 2]], None), [(0, END), (1, 1), (1, 2), (1, 2 + END)]);
        let mut parts = turns(2);
        drop(parts.pop());
        assert!(parts[0].wait(5, false));
    }
}
