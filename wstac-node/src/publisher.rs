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
use crate::records::{Events, RecordPublishers, locked};
use crate::refused::in_words;

pub(crate) use self::handle::PublisherHandle;

/// The messages that wait for the network at most: more than half a minute of a camera's.
const MOST_WAITING: usize = 4096;
/// The time between two messages about the state.
const STATE: Duration = Duration::from_secs(1);

/// Publishes what comes through its queue.
pub(crate) struct Publisher {
    name: String,
    records: RecordPublishers,
    queue: (SyncSender<Publication>, Receiver<Publication>),
    counts: Arc<Counts>,
}

/// The way to a publisher.
pub(crate) struct Queue {
    sender: SyncSender<Publication>,
    pub(crate) counts: Arc<Counts>,
    events: Arc<Mutex<Events>>,
}

/// A message, and the number of an event that was kept.
pub(crate) type Publication = (Message, Option<u64>);

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
}

impl Queue {
    /// Hands a message over. It is skipped and counted if the network is behind. Events are kept even then.
    pub(crate) fn push(&self, message: Message) {
        let number = (message.topic == Topic::Event).then(|| locked(&self.events).keep(&message.payload));
        if self.sender.try_send((message, number)).is_err() {
            self.counts.skipped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Publisher {
    /// Declares the keys of a sensor.
    ///
    /// # Errors
    /// The network refuses a key.
    pub(crate) fn new(session: &Session, arguments: &Arguments, name: &str) -> Result<Self, Error> {
        let sensor = format!("{}/{name}", arguments.namespace);
        let records = RecordPublishers::new(session, &sensor, arguments)?;
        Ok(Self { name: name.to_owned(), records, queue: sync_channel(MOST_WAITING), counts: Arc::default() })
    }

    pub(crate) fn queue(&self) -> Queue {
        let events = Arc::clone(&self.records.events);
        Queue { sender: self.queue.0.clone(), counts: Arc::clone(&self.counts), events }
    }

    /// Publishes until the queue's other ends are gone.
    pub(crate) fn run(self) {
        let Self { name, records, queue: (own, arriving), counts } = self;
        // Only readers keep the queue open.
        drop(own);
        let mut refused = 0_u64;
        let mut put = |(message, number): Publication| {
            if let Err(error) = records.put(message, number) {
                if refused == 0 {
                    note(format_args!("{name}: a message was not published: {}", in_words(&error.to_string())));
                }
                refused += 1;
            }
        };
        let mut due = Instant::now() + STATE;
        loop {
            match arriving.recv_timeout(due.saturating_duration_since(Instant::now())) {
                Ok(found) => put(found),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            if Instant::now() >= due {
                due = Instant::now() + STATE;
                put((counts.state(), None));
            }
        }
        put((counts.state(), None));
        if refused > 0 {
            note(format_args!("{name}: {refused} messages were not published"));
        }
    }
}

impl Counts {
    /// Counts the frame of features, which is the last one now.
    pub(crate) fn take_frame(&self, features: &FrameFeatures) {
        self.frames.store(features.frame + 1, Ordering::Relaxed);
        *locked(&self.times) = Times::of(features);
    }

    /// Counts camera frames that were lost.
    pub(crate) fn lose(&self, frames: u64, reason: &LossReason) {
        self.lost.fetch_add(frames, Ordering::Relaxed);
        locked(&self.lost_by).add(frames, reason);
    }

    /// Returns the state of a sensor.
    fn state(&self) -> Message {
        let counts = [&self.frames, &self.lost, &self.events, &self.lost_events, &self.skipped];
        let counts = counts.map(|count| Value::from(count.load(Ordering::Relaxed)));
        let names = ["frames", "dropped", "events", "lost_events", "skipped"];
        let mut facts: Vec<_> = names.into_iter().zip(counts).collect();
        let lost_by = *locked(&self.lost_by);
        facts.extend((!lost_by.is_empty()).then(|| ("dropped_by", json!(lost_by))));
        facts.extend(locked(&self.stated).iter().cloned());
        Message::of_state(&facts, &locked(&self.times))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_has_losses_by_reason_and_what_is_stated() {
        let counts = Counts::default();
        counts.lose(3, &LossReason::Short);
        *locked(&counts.stated) = vec![("readout_ms", Value::Null), ("note", "default-layout".into())];
        let state = counts.state();
        let state: Value = serde_json::from_slice(&state.payload).unwrap();
        assert_eq!((&state["dropped"], &state["dropped_by"]), (&3.into(), &json!({"shorter than a frame": 3})));
        assert_eq!((state.get("readout_ms"), &state["note"]), (Some(&Value::Null), &"default-layout".into()));
    }

    #[test]
    fn a_full_queue_skips_and_counts() {
        let (sender, arriving) = sync_channel(2);
        let queue = Queue { sender, counts: Arc::default(), events: Arc::default() };
        let event = Message { topic: Topic::Event, payload: b"{}".to_vec(), kind: None };
        (0..5).for_each(|_| queue.push(event.clone()));
        let state = queue.counts.state();
        let state: Value = serde_json::from_slice(&state.payload).unwrap();
        assert_eq!(state["skipped"], 3);
        let numbers: Vec<_> = arriving.try_iter().map(|(_, number)| number).collect();
        assert_eq!(numbers, [Some(0), Some(1)]);
        // Those that were skipped are kept.
        assert_eq!(locked(&queue.events).numbered().count(), 5);
    }
}
