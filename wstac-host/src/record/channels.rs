//! The channels of a file that are this program's own, by the names of their topics and schemas.
//!
//! This program gives its channels fixed numbers ([`Topic::number`]). Other tools that rewrite a recording give them
//! other numbers, and some put a prefix before the names of all topics.

use std::collections::BTreeMap;

use mcap::McapResult;
use mcap::records::Record;

use super::file::{Sensors, Topic};
use super::foxglove::Schema;
use super::parse::parse_record;

/// Most topics that an error names.
const MOST_NAMES: usize = 8;

/// A channel whose topic ends like one of this program.
#[derive(Debug)]
struct KnownChannel {
    prefix: String,
    sensor: u8,
    topic: Topic,
}

#[derive(Debug, Default)]
pub(super) struct Channels {
    pub(super) sensors: Sensors,
    /// Names of the schemas.
    schemas: BTreeMap<u16, String>,
    found: BTreeMap<u16, KnownChannel>,
    /// Names of the first topics that are not this program's.
    others: Vec<String>,
    /// The start of the topics' names, and how much speaks for it; `None` if there is no topic of this program.
    prefix: Option<(u8, String)>,
    /// Another start for which as much speaks.
    second: Option<String>,
    /// Whether a channel has another number than this program gave it.
    pub(super) is_renumbered: bool,
}

impl Channels {
    pub(super) fn new(sensors: Sensors) -> Self {
        Self { sensors, ..Self::default() }
    }

    /// Takes the record of a schema or of a channel. It replaces the one of this number.
    ///
    /// # Errors
    /// The record is damaged.
    pub(super) fn define(&mut self, op: u8, body: &[u8]) -> McapResult<()> {
        match parse_record(op, body)? {
            Record::Schema { header, .. } => drop(self.schemas.insert(header.id, header.name)),
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                self.add(channel.id, &channel.topic, &schema);
            }
            _ => {}
        }
        Ok(())
    }

    /// Adds a channel, or replaces the one of this number.
    pub(super) fn add(&mut self, number: u16, name: &str, schema: &str) {
        self.found.remove(&number);
        let Some((prefix, sensor, topic)) = self.sensors.find(name, schema) else {
            let name = if schema.is_empty() { name.to_owned() } else { format!("{name} of schema {schema}") };
            if self.others.len() < MOST_NAMES && !self.others.contains(&name) {
                self.others.push(name);
            }
            return;
        };
        self.is_renumbered |= number < 256 && topic.number(sensor) != number;
        // Only this program has the schema of records. Pictures of other programs may have topics like these.
        let rank = 2 * u8::from(schema == Schema::Record.facts().name) + u8::from(prefix.is_empty());
        match &self.prefix {
            Some((best, known)) if rank == *best && prefix != known => {
                self.second.get_or_insert_with(|| prefix.to_owned());
            }
            Some((best, _)) if rank <= *best => {}
            _ => {
                self.second = None;
                self.prefix = Some((rank, prefix.to_owned()));
            }
        }
        self.found.insert(number, KnownChannel { prefix: prefix.to_owned(), sensor, topic });
    }

    /// Returns the start of the topics' names; `None` if there is no topic of this program.
    pub(super) fn prefix(&self) -> Option<&str> {
        self.prefix.as_ref().map(|(_, prefix)| prefix.as_str())
    }

    /// Returns what two starts the topics have, if nothing says which is the recording's.
    pub(super) fn ambiguity(&self) -> Option<String> {
        let (first, second) = (self.prefix()?, self.second.as_ref()?);
        Some(format!(
            "has the topics of two recordings (found those of \"{first}/\" and of \"{second}/\", expected those of one)"
        ))
    }

    /// Returns the sensor and the topic of a channel.
    pub(super) fn of(&self, number: u16) -> Option<(u8, Topic)> {
        let KnownChannel { prefix, sensor, topic } = self.found.get(&number)?;
        (Some(prefix.as_str()) == self.prefix()).then_some((*sensor, *topic))
    }

    /// Returns whether there is a topic of frames.
    pub(super) fn has_frames(&self) -> bool {
        self.found.values().any(|found| found.topic.is_frame())
    }

    /// Returns the names of topics that were found in place of frames.
    pub(super) fn names(&self) -> String {
        let own =
            self.found.values().map(|KnownChannel { prefix, topic, .. }| [prefix, topic.name_and_schema().0].concat());
        let mut names: Vec<String> = own.chain(self.others.iter().cloned()).collect();
        names.sort_unstable();
        names.dedup();
        names.truncate(MOST_NAMES);
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    }
}
