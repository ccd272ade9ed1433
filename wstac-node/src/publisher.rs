//! Publishes what one sensor has found, in a thread of its own.

mod handle;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use wstac_host::error::Error;
use wstac_host::output::FrameFeatures;
use wstac_host::source::{LossCounts, LossReason};
use zenoh::Session;

use crate::arguments::Arguments;
use crate::message::{Message, Times, Topic};
use crate::note;
use crate::orders::{copy_of, replace};
use crate::records::{Events, RecordPublishers, locked};
use crate::refused::in_words;
use crate::ros::messages::{Health, RosMessage};
use crate::ros::names::Type;
use crate::ros::publishers::RosPublishers;

pub(crate) use self::handle::PublisherHandle;

/// The messages that wait for the network at most: more than half a minute of a camera's.
const MOST_WAITING: usize = 4096;
/// The pictures that wait for the network at most: they are large.
const MOST_PICTURES: u64 = 4;
/// The time between two messages about the state.
const STATE: Duration = Duration::from_secs(1);

/// Publishes what comes through its queue.
pub(crate) struct Publisher {
    name: String,
    records: Option<RecordPublishers>,
    ros: Option<RosPublishers>,
    queue: (SyncSender<Publication>, Receiver<Publication>),
    counts: Arc<Counts>,
}

/// The way to a publisher.
pub(crate) struct Queue {
    sender: SyncSender<Publication>,
    pub(crate) counts: Arc<Counts>,
    events: Option<Arc<Mutex<Events>>>,
}

/// A thing that a sensor has found, in the forms that are published.
#[derive(Clone, Debug, Default)]
pub(crate) struct Publication {
    pub(crate) record: Option<Message>,
    pub(crate) ros: Option<RosMessage>,
    /// The number of an event that was kept.
    number: Option<u64>,
}

impl Publication {
    pub(crate) fn new(record: Option<Message>, ros: Option<RosMessage>) -> Self {
        Self { record, ros, number: None }
    }
}

/// The numbers of a sensor's state.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    /// Feature frames on the time line.
    pub(crate) frames: AtomicU64,
    /// The times of the last frame.
    times: Mutex<Times>,
    /// Camera frames that were lost.
    pub(crate) lost: AtomicU64,
    pub(crate) events: AtomicU64,
    /// Events that a board has found and that never arrived.
    pub(crate) lost_events: AtomicU64,
    /// Whether the end was published.
    pub(crate) has_ended: AtomicBool,
    /// Messages without room in the queue.
    skipped: AtomicU64,
    /// Camera frames that were lost, by reason.
    lost_by: Mutex<LossCounts>,
    /// The facts of a state that the source or its configuration states: the readout, and a note if no layout is given.
    pub(crate) stated: Mutex<Vec<(&'static str, Value)>>,
    /// Pictures in the queue.
    pictures: AtomicU64,
}

impl Queue {
    /// Creates a queue without a network, and its other end.
    #[cfg(test)]
    pub(crate) fn of_test() -> (Self, Receiver<Publication>) {
        let (sender, arriving) = sync_channel(MOST_WAITING);
        (Self { sender, counts: Arc::default(), events: None }, arriving)
    }

    /// Hands a picture over that `make` makes. It is left out if the network is behind.
    pub(crate) fn push_picture(&self, make: impl FnOnce() -> Option<RosMessage>) {
        if self.counts.pictures.load(Ordering::Relaxed) < MOST_PICTURES
            && let Some(picture) = make()
        {
            self.counts.pictures.fetch_add(1, Ordering::Relaxed);
            if self.sender.try_send(Publication::new(None, Some(picture))).is_err() {
                self.counts.pictures.fetch_sub(1, Ordering::Relaxed);
            }
        }
    }

    /// Hands a thing over. It is skipped and counted if the network is behind. Events are kept even then.
    pub(crate) fn push(&self, mut found: Publication) {
        let event = found.record.as_ref().filter(|record| record.topic == Topic::Event);
        found.number = event.zip(self.events.as_ref()).map(|(event, events)| locked(events).keep(&event.payload));
        if (found.record.is_some() || found.ros.is_some()) && self.sender.try_send(found).is_err() {
            self.counts.skipped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Publisher {
    /// Declares the keys of a sensor, which has this place among all sensors.
    ///
    /// # Errors
    /// The network refuses a key.
    pub(crate) fn new(session: &Session, arguments: &Arguments, name: &str, place: usize) -> Result<Self, Error> {
        let sensor = format!("{}/{name}", arguments.namespace);
        let records =
            arguments.has_records().then(|| RecordPublishers::new(session, &sensor, arguments)).transpose()?;
        let ros = arguments.ros.then(|| RosPublishers::new(session, arguments, &sensor, place)).transpose()?;
        Ok(Self { name: name.to_owned(), records, ros, queue: sync_channel(MOST_WAITING), counts: Arc::default() })
    }

    pub(crate) fn queue(&self) -> Queue {
        let events = self.records.as_ref().map(|records| Arc::clone(&records.events));
        Queue { sender: self.queue.0.clone(), counts: Arc::clone(&self.counts), events }
    }

    /// Publishes until the queue's other ends are gone.
    pub(crate) fn run(self) {
        let Self { name, records, mut ros, queue: (own, arriving), counts } = self;
        // Only readers keep the queue open.
        drop(own);
        let mut refused = 0_u64;
        let mut put = |found: Publication| {
            if found.ros.as_ref().is_some_and(|message| message.kind == Type::Image) {
                counts.pictures.fetch_sub(1, Ordering::Relaxed);
            }
            let record = found.record.zip(records.as_ref()).map(|(record, to)| to.put(record, found.number));
            let ros = found.ros.zip(ros.as_mut()).map(|(message, to)| to.put(message));
            for error in [record, ros].into_iter().flatten().filter_map(Result::err) {
                if refused == 0 {
                    note(format_args!("{name}: a message was not published: {}", in_words(&error.to_string())));
                }
                refused += 1;
            }
        };
        let mut due = Instant::now() + STATE;
        let mut before = [0; 2];
        loop {
            match arriving.recv_timeout(due.saturating_duration_since(Instant::now())) {
                Ok(found) => put(found),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if Instant::now() >= due {
                due = Instant::now() + STATE;
                put(counts.state(&name, &mut before));
            }
        }
        put(counts.state(&name, &mut before));
        if refused > 0 {
            note(format_args!("{name}: {refused} messages were not published"));
        }
    }
}

impl Counts {
    /// Counts the frame of features, which is the last one now.
    pub(crate) fn take_frame(&self, features: &FrameFeatures) {
        self.frames.store(features.frame + 1, Ordering::Relaxed);
        replace(&self.times, Times::of(features));
    }

    /// Counts camera frames that were lost.
    pub(crate) fn lose(&self, frames: u64, reason: &LossReason) {
        self.lost.fetch_add(frames, Ordering::Relaxed);
        locked(&self.lost_by).add(frames, reason);
    }

    /// Returns the state of a sensor. `before` are its frames and its losses when it was asked for last.
    fn state(&self, sensor: &str, before: &mut [u64; 2]) -> Publication {
        let counts = [&self.frames, &self.lost, &self.events, &self.lost_events, &self.skipped];
        let counts = counts.map(|count| count.load(Ordering::Relaxed));
        let [frames, dropped, _, lost_events, skipped] = counts;
        let names = ["frames", "dropped", "events", "lost_events", "skipped"];
        let mut facts: Vec<_> = names.into_iter().zip(counts.map(Value::from)).collect();
        let lost_by = copy_of(&self.lost_by);
        facts.extend((!lost_by.is_empty()).then(|| ("dropped_by", json!(lost_by))));
        facts.extend(copy_of(&self.stated));
        let now = [frames, dropped + lost_events + skipped];
        let [frames_before, lost_before] = std::mem::replace(before, now);
        let health = match now {
            [_, lost] if lost != lost_before => Health::Loses,
            _ if self.has_ended.load(Ordering::Relaxed) => Health::Ended,
            [frames, _] if frames == frames_before => Health::Silent,
            _ => Health::Well,
        };
        Publication::new(
            Some(Message::of_state(&facts, &copy_of(&self.times))),
            Some(RosMessage::of_state(sensor, health, &facts)),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_has_losses_by_reason_and_what_is_stated() {
        let counts = Counts::default();
        counts.lose(3, &LossReason::Short);
        replace(&counts.stated, vec![("readout_ms", Value::Null), ("note", "default-layout".into())]);
        let state = counts.state("left", &mut [0; 2]).record.unwrap();
        let state: Value = serde_json::from_slice(&state.payload).unwrap();
        assert_eq!((&state["dropped"], &state["dropped_by"]), (&3.into(), &json!({"shorter than a frame": 3})));
        assert_eq!((state.get("readout_ms"), &state["note"]), (Some(&Value::Null), &"default-layout".into()));
    }

    #[test]
    fn a_full_queue_skips_and_counts() {
        let (sender, arriving) = sync_channel(2);
        let queue = Queue { sender, counts: Arc::default(), events: Some(Arc::default()) };
        let event = Message { topic: Topic::Event, payload: b"{}".to_vec(), kind: None };
        (0..5).for_each(|_| queue.push(Publication::new(Some(event.clone()), None)));
        let state = queue.counts.state("left", &mut [0; 2]).record.unwrap();
        let state: Value = serde_json::from_slice(&state.payload).unwrap();
        assert_eq!(state["skipped"], 3);
        let numbers: Vec<_> = arriving.try_iter().map(|found| found.number).collect();
        assert_eq!(numbers, [Some(0), Some(1)]);
        // Those that were skipped are kept.
        assert_eq!(locked(queue.events.as_ref().unwrap()).numbered().count(), 5);
    }
}
