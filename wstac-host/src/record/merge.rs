//! Brings the moments of several sensors into the order of their times.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::file::Message;

/// The time between two looks at sensors of which none gives anything.
const NAP: Duration = Duration::from_millis(10);

/// The queue of a sensor.
pub(super) struct Input {
    queue: Receiver<Vec<Message>>,
    /// How many moments are in the queue.
    waiting: Arc<AtomicU64>,
    /// Its next moment, once it has come.
    head: Option<Vec<Message>>,
    has_ended: bool,
    /// Whether the others have waited in vain, and wait no longer.
    is_late: bool,
}

impl Input {
    pub(super) fn new(queue: Receiver<Vec<Message>>, waiting: Arc<AtomicU64>) -> Self {
        Self { queue, waiting, head: None, has_ended: false, is_late: false }
    }

    /// Takes the next moment, and waits for it: until then, or without an end. `is_waiting` is set meanwhile.
    fn fill(&mut self, until: Option<Instant>, is_waiting: &AtomicBool) {
        if self.head.is_some() || self.has_ended {
            return;
        }
        let next = match self.queue.try_recv() {
            Err(TryRecvError::Empty) if until.is_none() || !self.is_late => {
                is_waiting.store(true, Ordering::Relaxed);
                let next = match until.map(|until| until.saturating_duration_since(Instant::now())) {
                    None => self.queue.recv().map_err(|_| true),
                    Some(rest) => {
                        self.queue.recv_timeout(rest).map_err(|error| error == RecvTimeoutError::Disconnected)
                    }
                };
                is_waiting.store(false, Ordering::Relaxed);
                next
            }
            next => next.map_err(|error| error == TryRecvError::Disconnected),
        };
        match next {
            Ok(moment) => {
                self.waiting.fetch_sub(1, Ordering::Relaxed);
                (self.head, self.is_late) = (Some(moment), false);
            }
            Err(has_ended) => (self.has_ended, self.is_late) = (has_ended, true),
        }
    }

    /// Returns the time of the next moment. Messages about earlier frames may be among its own.
    fn time(&self) -> Option<u64> {
        self.head.as_ref()?.iter().map(|message| message.time).max()
    }
}

/// The moments of all sensors in the order of their times.
pub(super) struct Merge {
    inputs: Vec<Input>,
    patience: Option<Duration>,
    is_waiting: Arc<AtomicBool>,
}

impl Merge {
    /// Creates the merger of these queues. `patience` is how long all sensors that give nothing hold up the others
    /// together; `None` if they wait for them until they end. `is_waiting` is set while it waits: then no disk is slow.
    pub(super) fn new(inputs: Vec<Input>, patience: Option<Duration>, is_waiting: Arc<AtomicBool>) -> Self {
        Self { inputs, patience, is_waiting }
    }
}

impl Iterator for Merge {
    type Item = Vec<Message>;

    fn next(&mut self) -> Option<Vec<Message>> {
        loop {
            let until = self.patience.map(|patience| Instant::now() + patience);
            for input in &mut self.inputs {
                input.fill(until, &self.is_waiting);
            }
            // Of those with the same time, the first sensor comes first.
            let next = self.inputs.iter_mut().filter(|input| input.head.is_some()).min_by_key(|input| input.time());
            if let Some(next) = next {
                return next.head.take();
            }
            if self.inputs.iter().all(|input| input.has_ended) {
                return None;
            }
            sleep(NAP);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{SyncSender, sync_channel};

    use super::*;
    use crate::record::file::Topic;

    fn moment(sensor: u8, time: u64) -> Vec<Message> {
        vec![Message { sensor, topic: Topic::Features, time, taken: time, sequence: 0, data: Vec::new() }]
    }

    fn queues(count: usize, patience: Option<Duration>) -> (Vec<SyncSender<Vec<Message>>>, Merge) {
        let (senders, inputs) = (0..count)
            .map(|_| {
                let (sender, queue) = sync_channel(100);
                (sender, Input::new(queue, Arc::new(AtomicU64::new(100))))
            })
            .unzip();
        (senders, Merge::new(inputs, patience, Arc::default()))
    }

    fn of(moment: &[Message]) -> (u8, u64) {
        (moment[0].sensor, moment[0].time)
    }

    #[test]
    fn moments_come_in_the_order_of_their_times() {
        let (senders, merge) = queues(3, None);
        for (sensor, times) in [(0, [0, 30, 60, 90]), (1, [10, 30, 40, 45]), (2, [100, 110, 120, 130])] {
            for time in times {
                senders[sensor].send(moment(sensor as u8, time)).unwrap();
            }
        }
        drop(senders);
        let found: Vec<_> = merge.map(|moment| of(&moment)).collect();
        let both = [(0, 0), (1, 10), (0, 30), (1, 30), (1, 40), (1, 45), (0, 60), (0, 90)];
        assert_eq!(found, [&both[..], &[(2, 100), (2, 110), (2, 120), (2, 130)]].concat());
    }

    #[test]
    fn a_sensor_that_is_silent_does_not_hold_up_the_others_for_ever() {
        let (senders, mut merge) = queues(2, Some(Duration::from_millis(20)));
        for time in [10, 20, 30] {
            senders[0].send(moment(0, time)).unwrap();
        }
        assert_eq!(of(&merge.next().unwrap()), (0, 10));
        assert_eq!(of(&merge.next().unwrap()), (0, 20));
        // It is back, and late.
        senders[1].send(moment(1, 15)).unwrap();
        assert_eq!([1, 2].map(|_| of(&merge.next().unwrap())), [(1, 15), (0, 30)]);
        drop(senders);
        assert!(merge.next().is_none());
    }

    /// A hub that loses its power takes all of its cameras away at once.
    #[test]
    fn all_sensors_that_are_silent_are_waited_for_together() {
        let patience = Duration::from_millis(300);
        let (senders, mut merge) = queues(11, Some(patience));
        for time in [10, 20, 30] {
            senders[10].send(moment(10, time)).unwrap();
        }
        let (is_waiting, started) = (Arc::clone(&merge.is_waiting), Instant::now());
        let watching = std::thread::spawn(move || {
            while !is_waiting.load(Ordering::Relaxed) && started.elapsed() < Duration::from_mins(1) {
                sleep(Duration::from_millis(1));
            }
            started.elapsed()
        });
        for time in [10, 20, 30] {
            assert_eq!(of(&merge.next().unwrap()), (10, time));
        }
        let took = started.elapsed();
        assert!(took >= patience && took < 5 * patience, "{took:?}");
        assert!(watching.join().unwrap() < took, "it is seen that the merge waits");
        assert!(!merge.is_waiting.load(Ordering::Relaxed));
        drop(senders);
    }
}
