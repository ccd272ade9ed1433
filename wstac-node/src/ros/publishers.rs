//! The publishers that nodes of ROS 2 hear.

use wstac_host::error::{Error, ErrorKind};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::{Session, Wait};

use crate::arguments::Arguments;
use crate::refused::refused;

use super::messages::RosMessage;
use super::names::{Type, attachment};

/// The publishers of a sensor, one for each type.
pub(crate) struct RosPublishers(Vec<RosPublisher>);

impl RosPublishers {
    /// Declares the topics of a sensor. `sensor` has the namespace in front, and `place` is its place among all sensors.
    ///
    /// # Errors
    /// The network refuses a key.
    pub(crate) fn new(session: &Session, arguments: &Arguments, sensor: &str, place: usize) -> Result<Self, Error> {
        let declare = |kind: Type| {
            // 0 is the node.
            let number = 1 + place * Type::OF_SENSOR.len() + kind as usize;
            RosPublisher::new(session, arguments, kind, sensor, number)
        };
        let publishers: zenoh::Result<_> = Type::OF_SENSOR.into_iter().map(declare).collect();
        let about = |error| refused(ErrorKind::Usage, format_args!("the topics of {sensor}"), &error);
        publishers.map(Self).map_err(about)
    }

    /// Returns the number behind those of the publishers of so many sensors.
    pub(crate) fn after(sensors: usize) -> usize {
        1 + sensors * Type::OF_SENSOR.len()
    }

    pub(crate) fn put(&mut self, message: RosMessage) -> zenoh::Result<()> {
        match self.0.get_mut(message.kind as usize) {
            Some(publisher) => publisher.put(message.payload),
            None => Ok(()),
        }
    }
}

/// A publisher that nodes of ROS 2 hear.
pub(super) struct RosPublisher {
    publisher: Publisher<'static>,
    /// The bytes that distinguish it from every other publisher.
    gid: [u8; 16],
    /// The number of the last message.
    number: i64,
    /// The token that tells other nodes of the publisher, and ends with it.
    _token: LivelinessToken,
}

impl RosPublisher {
    /// Declares a topic, of a sensor or of the node. `number` is that of the publisher among all entities of the session.
    ///
    /// # Errors
    /// The network refuses the key.
    pub(super) fn new(
        session: &Session,
        arguments: &Arguments,
        kind: Type,
        sensor: &str,
        number: usize,
    ) -> zenoh::Result<Self> {
        let (id, domain) = (session.zid().to_string(), arguments.domain);
        let publisher = session
            .declare_publisher(kind.key(domain, sensor))
            .congestion_control(kind.control())
            .priority(kind.priority())
            .wait()?;
        let token = kind.token(domain, &id, number, &arguments.node_name, sensor);
        let token = session.liveliness().declare_token(token).wait()?;
        let mut gid = session.zid().to_le_bytes();
        gid.iter_mut().zip(number.to_le_bytes()).for_each(|(byte, other)| *byte ^= other);
        Ok(Self { publisher, gid, number: 0, _token: token })
    }

    pub(super) fn put(&mut self, payload: Vec<u8>) -> zenoh::Result<()> {
        self.number += 1;
        self.publisher.put(payload).attachment(attachment(self.number, self.gid)).wait()
    }
}
