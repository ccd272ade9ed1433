//! Messages of a sensor: their topics and payloads.

use serde_json::{Value, json};
use wstac_core::params::TAXELS;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::{JsonLine, StampFields};
use wstac_host::output::{FrameFeatures, Output, Stamp};

use crate::ros::messages::RosMessage;
use crate::ros::names::Type;

/// A message that is to be published.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) topic: Topic,
    /// A JSON object, or a message of ROS 2 in CDR.
    pub(crate) payload: Vec<u8>,
    /// The type of a message of ROS 2.
    pub(crate) kind: Option<Type>,
}

/// The last name of a message's key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Topic {
    Event,
    ContactEnd,
    Slip,
    Texture,
    Incomplete,
    Motion,
    Features,
    Fault,
    End,
    Taxels,
    State,
}

impl Topic {
    /// All topics, in the order of their declaration.
    pub(crate) const ALL: [(Self, &str); 11] = [
        (Self::Event, "event"),
        (Self::ContactEnd, "contact_end"),
        (Self::Slip, "slip"),
        (Self::Texture, "texture"),
        (Self::Incomplete, "incomplete"),
        (Self::Motion, "motion"),
        (Self::Features, "features"),
        (Self::Fault, "fault"),
        (Self::End, "end"),
        (Self::Taxels, "taxels"),
        (Self::State, "state"),
    ];

    /// Returns the name, which is `kind` in the payload.
    pub(crate) fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// Returns whether a newer message makes an older one worthless, so that a slow subscriber may miss some.
    pub(crate) fn is_stream(self) -> bool {
        matches!(self, Self::Motion | Self::Features | Self::Taxels | Self::State)
    }

    fn of(output: &Output) -> Option<Self> {
        Some(match output {
            Output::Event(_) => Self::Event,
            Output::ContactEnd(_) => Self::ContactEnd,
            Output::Slip(_) => Self::Slip,
            Output::EarlyTexture(_) => Self::Texture,
            Output::Interrupted(_) => Self::Incomplete,
            Output::Motion(_) => Self::Motion,
            Output::Features(_) => Self::Features,
            Output::Fault(_) => Self::Fault,
            Output::End(_) => Self::End,
            _ => return None,
        })
    }
}

impl Message {
    /// Returns the message of an output; `None` for lost frames and a disturbed baseline, which are no records.
    ///
    /// # Errors
    /// The output cannot be written as JSON.
    pub(crate) fn of(output: &Output) -> Result<Option<Self>, Error> {
        let Some((topic, line)) = Topic::of(output).zip(JsonLine::new(output)) else { return Ok(None) };
        let payload =
            serde_json::to_vec(&line).map_err(|error| Error::with_cause(ErrorKind::Data, topic.name(), error))?;
        Ok(Some(Self { topic, payload, kind: None }))
    }

    /// Returns a message of ROS 2 under the key of JSON.
    pub(crate) fn of_ros(message: RosMessage) -> Self {
        let topic = match message.kind {
            Type::Event => Topic::Event,
            Type::ContactEnd => Topic::ContactEnd,
            Type::Slip => Topic::Slip,
            Type::TwistStamped => Topic::Motion,
            Type::Features => Topic::Features,
            Type::Taxels => Topic::Taxels,
        };
        Self { topic, payload: message.payload, kind: Some(message.kind) }
    }

    /// Returns the message about a sensor's state: names and values, and the times of the last frame.
    pub(crate) fn of_state(facts: &[(&str, Value)], times: &Times) -> Self {
        let facts = facts.iter().map(|(name, value)| ((*name).to_owned(), value.clone()));
        Self::timed(Topic::State, times, facts.collect())
    }

    pub(crate) fn of_taxels(features: &FrameFeatures, sums: &[u32; TAXELS]) -> Self {
        let fields = [("frame", json!(features.frame)), ("sums", json!(sums))];
        let fields = fields.map(|(name, value)| (name.to_owned(), value)).into_iter().collect();
        Self::timed(Topic::Taxels, &Times::of(features), fields)
    }

    /// Returns a message of this program's own kinds.
    fn timed(topic: Topic, times: &Times, fields: serde_json::Map<String, Value>) -> Self {
        let StampFields { stamp, stamp_within_ms } = StampFields::new(times.stamp);
        let mut payload = fields;
        payload.insert("kind".to_owned(), topic.name().into());
        payload.insert("time_ns".to_owned(), times.time_ns.into());
        let stamps = [("stamp", stamp.map(Into::into)), ("stamp_within_ms", stamp_within_ms.map(Into::into))];
        payload.extend(stamps.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))));
        Self { topic, payload: json!(payload).to_string().into_bytes(), kind: None }
    }
}

/// The times of a frame, as its features have them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Times {
    time_ns: Option<u64>,
    stamp: Option<Stamp>,
}

impl Times {
    pub(crate) fn of(features: &FrameFeatures) -> Self {
        Self { time_ns: features.time_ns, stamp: features.stamp }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;
    use wstac_host::output::OutputOptions;
    use wstac_host::session::Session;
    use wstac_host::source::open::OpenOptions;

    #[test]
    fn a_topic_is_the_kind_of_its_payload() {
        let source = wstac::open_source("scene:Saw3@150", &OpenOptions::default()).unwrap();
        let mut wanted = OutputOptions::default();
        (wanted.features, wanted.motion) = (true, true);
        let session = Session::builder(source).outputs(wanted).build().unwrap();
        let (mut seen, mut last) = (Vec::new(), None);
        for output in session {
            let output = output.unwrap();
            if let Output::Features(features) = &output {
                last = Some(*features);
            }
            let Some(message) = Message::of(&output).unwrap() else { continue };
            let payload: Value = serde_json::from_slice(&message.payload).unwrap();
            assert_eq!(payload["kind"], message.topic.name());
            if !seen.contains(&message.topic) {
                seen.push(message.topic);
            }
        }
        let expected = [Topic::Features, Topic::Motion, Topic::Event, Topic::ContactEnd, Topic::End];
        assert!(expected.iter().all(|topic| seen.contains(topic)) && seen.len() == expected.len(), "{seen:?}");
        // They have the times of the features that they belong to.
        let mut features = last.unwrap();
        features.stamp = Some(Stamp { time: UNIX_EPOCH, within: Duration::from_millis(2) });
        let read = |message: Message| serde_json::from_slice::<Value>(&message.payload).unwrap();
        let times = json!({"time_ns": features.time_ns, "stamp": "1970-01-01T00:00:00.000Z", "stamp_within_ms": 2.0});
        assert!(times["time_ns"].is_u64());
        for (message, fields) in [
            (
                Message::of_taxels(&features, &[3; TAXELS]),
                json!({"kind": "taxels", "frame": features.frame, "sums": vec![3; 25]}),
            ),
            (Message::of_state(&[("frames", 9.into())], &Times::of(&features)), json!({"kind": "state", "frames": 9})),
        ] {
            let mut expected = fields.as_object().unwrap().clone();
            expected.extend(times.as_object().unwrap().clone());
            assert_eq!(read(message), json!(expected));
        }
        let early = read(Message::of_state(&[], &Times::default()));
        assert_eq!(early, json!({"kind": "state", "time_ns": null}), "before the first frame");
    }
}
