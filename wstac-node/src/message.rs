//! Messages of a sensor: their topics and payloads.

use std::iter;

use serde_json::json;
use wstac_core::params::TAXELS;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::JsonLine;
use wstac_host::output::Output;

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
    pub(crate) const ALL: [Self; 10] = [
        Self::Event,
        Self::ContactEnd,
        Self::Texture,
        Self::Incomplete,
        Self::Motion,
        Self::Features,
        Self::Fault,
        Self::End,
        Self::Taxels,
        Self::State,
    ];

    /// Returns the name, which is `kind` in the payload.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Event => "event",
            Self::ContactEnd => "contact_end",
            Self::Texture => "texture",
            Self::Incomplete => "incomplete",
            Self::Motion => "motion",
            Self::Features => "features",
            Self::Fault => "fault",
            Self::End => "end",
            Self::Taxels => "taxels",
            Self::State => "state",
        }
    }

    /// Returns whether a newer message makes an older one worthless, so that a slow subscriber may miss some.
    pub(crate) fn is_stream(self) -> bool {
        matches!(self, Self::Motion | Self::Features | Self::Taxels | Self::State)
    }

    fn of(output: &Output) -> Option<Self> {
        Some(match output {
            Output::Event(_) => Self::Event,
            Output::ContactEnd(_) => Self::ContactEnd,
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

    /// Returns a message of ROS 2 under the key of JSON; `None` if JSON has no such topic.
    pub(crate) fn of_ros(message: &RosMessage) -> Option<Self> {
        let topic = match message.kind {
            Type::Event => Topic::Event,
            Type::ContactEnd => Topic::ContactEnd,
            Type::TwistStamped => Topic::Motion,
            Type::Features => Topic::Features,
            Type::Taxels => Topic::Taxels,
            Type::DiagnosticArray | Type::Image | Type::ParameterEvent => return None,
        };
        Some(Self { topic, payload: message.payload.clone(), kind: Some(message.kind) })
    }

    /// Returns the message about a sensor's state: names and counts.
    pub(crate) fn of_state(counts: &[(&str, u64)]) -> Self {
        let counts = counts.iter().map(|(name, count)| ((*name).to_owned(), (*count).into()));
        let kind = ("kind".to_owned(), Topic::State.name().into());
        let payload: serde_json::Map<String, serde_json::Value> = iter::once(kind).chain(counts).collect();
        Self { topic: Topic::State, payload: json!(payload).to_string().into_bytes(), kind: None }
    }

    /// Returns the message of a frame's taxel sums.
    pub(crate) fn of_taxels(frame: u64, sums: &[u32; TAXELS]) -> Self {
        let payload = json!({"kind": Topic::Taxels.name(), "frame": frame, "sums": sums});
        Self { topic: Topic::Taxels, payload: payload.to_string().into_bytes(), kind: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_host::output::OutputOptions;
    use wstac_host::session::Session;
    use wstac_host::source::open::{OpenOptions, open};

    #[test]
    fn a_topic_is_the_kind_of_its_payload() {
        let source = open("scene:Saw3@150", &OpenOptions::default(), &[&wstac_scene::source::Scenes]).unwrap();
        let mut wanted = OutputOptions::default();
        (wanted.features, wanted.motion) = (true, true);
        let session = Session::builder(source).outputs(wanted).build().unwrap();
        let mut seen = Vec::new();
        for output in session {
            let Some(message) = Message::of(&output.unwrap()).unwrap() else { continue };
            let payload: serde_json::Value = serde_json::from_slice(&message.payload).unwrap();
            assert_eq!(payload["kind"], message.topic.name());
            if !seen.contains(&message.topic) {
                seen.push(message.topic);
            }
        }
        let expected = [Topic::Features, Topic::Motion, Topic::Event, Topic::ContactEnd, Topic::End];
        assert!(expected.iter().all(|topic| seen.contains(topic)) && seen.len() == expected.len(), "{seen:?}");
        let taxels: serde_json::Value = serde_json::from_slice(&Message::of_taxels(7, &[3; TAXELS]).payload).unwrap();
        assert_eq!(taxels, json!({"kind": "taxels", "frame": 7, "sums": vec![3; 25]}));
    }
}
