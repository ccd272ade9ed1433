//! Turns what a sensor finds into the messages that are published.

use std::sync::atomic::Ordering;
use std::time::SystemTime;

use wstac_core::params::TAXELS;
use wstac_host::error::Error;
use wstac_host::output::Output;

use crate::arguments::Arguments;
use crate::message::Message;
use crate::publisher::{Counts, Found, Queue};
use crate::ros::messages::{Header, RosMessage};
use crate::ros::picture::Shape;

/// The way of a sensor's outputs to its publisher.
pub(crate) struct Outlet {
    queue: Queue,
    has_records: bool,
    /// The coordinate frame, if nodes of ROS 2 are told.
    frame_id: Option<String>,
}

impl Outlet {
    /// Creates the outlet of the sensor with this name.
    pub(crate) fn new(queue: Queue, name: &str, arguments: &Arguments) -> Self {
        let frame_id = arguments.ros.then(|| format!("{name}_frame"));
        Self { queue, has_records: arguments.has_records(), frame_id }
    }

    /// Returns the numbers of the sensor's state.
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
            Output::Features(features) => counts.frames.store(features.frame + 1, Ordering::Relaxed),
            Output::Event(_) => _ = counts.events.fetch_add(1, Ordering::Relaxed),
            Output::End(_) => counts.has_ended.store(true, Ordering::Relaxed),
            _ => {}
        }
        let record = if self.has_records { Message::of(output)? } else { None };
        let stamp = output.stamp().map_or(stamp, |stamp| stamp.time);
        let ros = self.header(stamp).and_then(|header| RosMessage::of(output, header));
        self.queue.push(Found::new(record, ros));
        Ok(())
    }

    /// Publishes the taxel sums of the last frame.
    pub(crate) fn taxels(&self, sums: &[u32; TAXELS], stamp: SystemTime) {
        let frame = self.counts().frames.load(Ordering::Relaxed).saturating_sub(1);
        let record = self.has_records.then(|| Message::of_taxels(frame, sums));
        let ros = self.header(stamp).map(|header| RosMessage::of_taxels(frame, sums, header));
        self.queue.push(Found::new(record, ros));
    }

    /// Publishes the picture of the last frame.
    pub(crate) fn picture(&self, shape: Shape, bytes: &[u8], stamp: SystemTime) {
        if let Some(frame_id) = &self.frame_id {
            self.queue.push_picture(|| shape.message(bytes, stamp, frame_id));
        }
    }

    /// Returns the header of messages of ROS 2, if there are any.
    fn header(&self, stamp: SystemTime) -> Option<Header<'_>> {
        self.frame_id.as_deref().map(|frame_id| Header { stamp, frame_id })
    }
}
