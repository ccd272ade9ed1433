//! Turns what a sensor finds into the messages that are published.

use std::sync::atomic::Ordering;
use std::time::SystemTime;

use wstac_core::params::TAXELS;
use wstac_host::error::Error;
use wstac_host::output::{FrameFeatures, Output};

use crate::arguments::{Arguments, Form};
use crate::message::Message;
use crate::publisher::{Counts, Queue};
use crate::ros::messages::{Header, RosMessage};

/// The way of a sensor's outputs to its publisher.
pub(crate) struct PublisherHandle {
    queue: Queue,
    /// The coordinate frame of messages of ROS 2, if records are such messages.
    frame_id: Option<String>,
}

impl PublisherHandle {
    pub(crate) fn new(queue: Queue, name: &str, arguments: &Arguments) -> Self {
        let frame_id = (arguments.zenoh_encoding == Form::Cdr).then(|| format!("{name}_frame"));
        Self { queue, frame_id }
    }

    pub(crate) fn counts(&self) -> &Counts {
        &self.queue.counts
    }

    /// Publishes an output. `stamp` is the wall-clock time of the last frame, for an output without its own.
    ///
    /// # Errors
    /// The output cannot be written as JSON.
    pub(crate) fn output(&self, output: &Output, stamp: SystemTime) -> Result<(), Error> {
        let counts = self.counts();
        match output {
            Output::Features(features) => counts.take_frame(features),
            Output::Event(_) => _ = counts.events.fetch_add(1, Ordering::Relaxed),
            Output::End(_) => counts.has_ended.store(true, Ordering::Relaxed),
            _ => {}
        }
        let stamp = output.stamp().map_or(stamp, |stamp| stamp.time);
        let message = match self.header(stamp).and_then(|header| RosMessage::of(output, header)) {
            Some(message) => Some(Message::of_ros(message)),
            None => Message::of(output)?,
        };
        if let Some(message) = message {
            self.queue.push(message);
        }
        Ok(())
    }

    /// Publishes the taxel sums that features are made of. `stamp` is the wall-clock time of the last frame, for
    /// features without their own.
    pub(crate) fn taxels(&self, features: &FrameFeatures, sums: &[u32; TAXELS], stamp: SystemTime) {
        let stamp = features.stamp.map_or(stamp, |stamp| stamp.time);
        let ros = |header| Message::of_ros(RosMessage::of_taxels(features.frame, sums, header));
        self.queue.push(self.header(stamp).map_or_else(|| Message::of_taxels(features, sums), ros));
    }

    /// Returns the header of a message of ROS 2, if records are such messages.
    fn header(&self, stamp: SystemTime) -> Option<Header<'_>> {
        self.frame_id.as_deref().map(|frame_id| Header { stamp, frame_id })
    }
}
