//! Turns what a sensor finds into the messages that are published.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::SystemTime;

use wstac_core::params::TAXELS;
use wstac_host::error::Error;
use wstac_host::output::{FrameFeatures, Output};

use crate::arguments::Arguments;
use crate::message::Message;
use crate::orders::{Settings, copy_of};
use crate::publisher::{Counts, Publication, Queue};
use crate::ros::messages::{Header, RosMessage};
use crate::ros::picture::RosImageShape;

/// The way of a sensor's outputs to its publisher.
pub(crate) struct PublisherHandle {
    queue: Queue,
    has_records: bool,
    has_cdr_records: bool,
    has_ros: bool,
    settings: Arc<Settings>,
}

impl PublisherHandle {
    pub(crate) fn new(queue: Queue, settings: Arc<Settings>, arguments: &Arguments) -> Self {
        let (has_records, has_cdr_records) = (arguments.has_records(), arguments.has_cdr_records());
        Self { queue, has_records, has_cdr_records, has_ros: arguments.ros, settings }
    }

    pub(crate) fn settings(&self) -> &Settings {
        &self.settings
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
        let ros = self.with_header(stamp, |header| RosMessage::of(output, header)).flatten();
        let record = match self.cdr_record(ros.as_ref()) {
            None if self.has_records => Message::of(output)?,
            record => record,
        };
        self.queue.push(Publication::new(record, ros.filter(|_| self.has_ros)));
        Ok(())
    }

    /// Publishes the taxel sums that features are made of. `stamp` is the wall-clock time of the last frame, for features
    /// without their own.
    pub(crate) fn taxels(&self, features: &FrameFeatures, sums: &[u32; TAXELS], stamp: SystemTime) {
        let stamp = features.stamp.map_or(stamp, |stamp| stamp.time);
        let ros = self.with_header(stamp, |header| RosMessage::of_taxels(features.frame, sums, header));
        let record = self.cdr_record(ros.as_ref());
        let record = record.or_else(|| self.has_records.then(|| Message::of_taxels(features, sums)));
        self.queue.push(Publication::new(record, ros.filter(|_| self.has_ros)));
    }

    /// Publishes the picture of the last frame, if pictures are wanted.
    pub(crate) fn picture(&self, shape: RosImageShape, bytes: &[u8], stamp: SystemTime) {
        if self.has_ros && self.settings.picture.load(Ordering::Relaxed) {
            let frame_id = copy_of(&self.settings.frame_id);
            self.queue.push_picture(|| shape.message(bytes, stamp, &frame_id));
        }
    }

    /// Returns a message of ROS 2 as a record, if records are such messages.
    fn cdr_record(&self, message: Option<&RosMessage>) -> Option<Message> {
        message.filter(|_| self.has_cdr_records).and_then(Message::of_ros)
    }

    /// Makes a message of ROS 2 with its header, if there are any.
    fn with_header<T>(&self, stamp: SystemTime, make: impl FnOnce(Header<'_>) -> T) -> Option<T> {
        (self.has_ros || self.has_cdr_records).then(|| {
            let frame_id = copy_of(&self.settings.frame_id);
            make(Header { stamp, frame_id: &frame_id })
        })
    }
}
