//! The records of a sensor, published as JSON or CDR under the keys of `docs/NETWORK.md`.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use wstac_host::error::{Error, ErrorKind};
use zenoh::bytes::Encoding;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use crate::arguments::{Arguments, Form};
use crate::message::{Message, Topic};
use crate::queue::Queue;
use crate::refused::refused;
use crate::ros::names::Type;

/// The events that are kept for those who ask.
const MOST_EVENTS: usize = 1000;
/// The requests for events of a sensor that wait at most. Further ones have no answer.
pub(crate) const MOST_ASKED: usize = 16;

/// The publishers of a sensor, one for each topic.
pub(crate) struct RecordPublishers {
    publishers: Vec<Publisher<'static>>,
    /// The events that requests are answered with.
    pub(crate) events: Arc<Mutex<Events>>,
    /// The answers to requests and the token of liveliness, which end with the publishers.
    _answers: Queryable<()>,
    _alive: LivelinessToken,
}

impl RecordPublishers {
    /// Declares the keys of a sensor. `sensor` has the namespace in front.
    ///
    /// # Errors
    /// The network refuses a key.
    pub(crate) fn new(session: &Session, sensor: &str, arguments: &Arguments) -> Result<Self, Error> {
        let refused = |error| refused(ErrorKind::Usage, format_args!("the keys {sensor}"), &error);
        let declare = |(topic, name): (Topic, &str)| {
            let (control, priority) = if topic.is_stream() {
                (CongestionControl::Drop, Priority::Data)
            } else {
                (CongestionControl::Block, Priority::DataHigh)
            };
            session
                .declare_publisher(format!("{sensor}/{name}"))
                .encoding(Encoding::APPLICATION_JSON)
                .congestion_control(control)
                .priority(priority)
                .wait()
        };
        let publishers = Topic::ALL.into_iter().map(declare).collect::<Result<_, _>>().map_err(refused)?;
        let events = Arc::new(Mutex::new(Events::default()));
        let (kept, prefix) = (Arc::clone(&events), format!("{sensor}/event"));
        let encoding = encoding_of((arguments.zenoh_encoding == Form::Cdr).then_some(Type::Event));
        // Who asks may be slow to take the answers, and Zenoh's own threads must not wait for it. The thread ends with
        // the requests.
        let (asks, asked) = Queue::new(MOST_ASKED);
        let answers = move || asked.iter().for_each(|query| answer(&query, &prefix, &kept, &encoding));
        thread::Builder::new().name("events".into()).spawn(answers).map_err(|error| Error::io("a thread", error))?;
        let answers = session
            .declare_queryable(format!("{sensor}/event/*"))
            .callback(move |query| asks.add(query))
            .wait()
            .map_err(refused)?;
        let alive = session.liveliness().declare_token(sensor.to_owned()).wait().map_err(refused)?;
        Ok(Self { publishers, events, _answers: answers, _alive: alive })
    }

    /// Publishes a message. An event has a number.
    pub(crate) fn put(&self, message: Message, number: Option<u64>) -> zenoh::Result<()> {
        let put = self.publishers[message.topic as usize].put(message.payload).encoding(encoding_of(message.kind));
        match number {
            Some(number) => put.attachment(number.to_string()).wait(),
            None => put.wait(),
        }
    }
}

/// The last events, and the number of the next one.
#[derive(Debug, Default)]
pub(crate) struct Events {
    kept: VecDeque<Vec<u8>>,
    next: u64,
}

impl Events {
    /// Keeps an event and returns its number.
    pub(crate) fn keep(&mut self, payload: &[u8]) -> u64 {
        if self.kept.len() == MOST_EVENTS {
            self.kept.pop_front();
        }
        self.kept.push_back(payload.to_vec());
        self.next += 1;
        self.next - 1
    }

    pub(crate) fn numbered(&self) -> impl Iterator<Item = (u64, &Vec<u8>)> {
        (self.next - self.kept.len() as u64..).zip(&self.kept)
    }
}

/// Returns the encoding of JSON, or of a message of ROS 2.
fn encoding_of(kind: Option<Type>) -> Encoding {
    kind.map_or(Encoding::APPLICATION_JSON, |kind| Encoding::APPLICATION_CDR.with_schema(kind.schema()))
}

/// Answers a request with the events that are kept and asked for.
fn answer(query: &Query, prefix: &str, events: &Mutex<Events>, encoding: &Encoding) {
    let events: Vec<(u64, Vec<u8>)> =
        locked(events).numbered().map(|(number, payload)| (number, payload.clone())).collect();
    for (number, payload) in events {
        let Ok(key) = zenoh::key_expr::KeyExpr::try_from(format!("{prefix}/{number}")) else { continue };
        if query.key_expr().intersects(&key) && query.reply(key, payload).encoding(encoding.clone()).wait().is_err() {
            // Whoever has asked is gone.
            break;
        }
    }
}

/// Locks what threads share, even if one that held it panicked.
pub(crate) fn locked<T>(held: &Mutex<T>) -> MutexGuard<'_, T> {
    held.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_events_are_kept_with_their_numbers() {
        let mut events = Events::default();
        for number in 0..1200_u64 {
            assert_eq!(events.keep(&number.to_le_bytes()), number);
        }
        let kept: Vec<_> = events.numbered().collect();
        assert_eq!((kept.len(), kept[0].0, kept[999].0), (1000, 200, 1199));
        assert!(kept.iter().all(|(number, payload)| **payload == number.to_le_bytes()));
    }
}
