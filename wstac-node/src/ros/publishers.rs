//! The publishers of a sensor that nodes of ROS 2 hear.

use wstac_host::error::{Error, ErrorKind};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::{Session, Wait};

use crate::arguments::Arguments;

use super::messages::RosMessage;
use super::names::{Type, attachment};

/// The publishers of a sensor, one for each type.
pub(crate) struct RosPublishers(Vec<RosPublisher>);

struct RosPublisher {
    publisher: Publisher<'static>,
    /// The bytes that distinguish it from every other publisher.
    gid: [u8; 16],
    /// The number of the last message.
    number: i64,
    /// It ends with the publisher.
    _token: LivelinessToken,
}

impl RosPublishers {
    /// Declares the topics of a sensor. `sensor` has the namespace in front, and `place` is its place among all sensors.
    ///
    /// # Errors
    /// The network refuses a key.
    pub(crate) fn new(session: &Session, arguments: &Arguments, sensor: &str, place: usize) -> Result<Self, Error> {
        let (id, domain) = (session.zid().to_string(), arguments.domain);
        let declare = |kind: Type| {
            // 0 is the node.
            let number = 1 + place * Type::ALL.len() + kind as usize;
            let publisher = session
                .declare_publisher(kind.key(domain, sensor))
                .congestion_control(kind.control())
                .priority(kind.priority())
                .wait()?;
            let token = kind.token(domain, &id, number, &arguments.node_name, sensor);
            let token = session.liveliness().declare_token(token).wait()?;
            let mut gid = session.zid().to_le_bytes();
            gid.iter_mut().zip(number.to_le_bytes()).for_each(|(byte, other)| *byte ^= other);
            Ok(RosPublisher { publisher, gid, number: 0, _token: token })
        };
        let publishers: zenoh::Result<_> = Type::ALL.into_iter().map(declare).collect();
        let refused = |error| Error::new(ErrorKind::Usage, format_args!("the topics of {sensor}"), error);
        publishers.map(Self).map_err(refused)
    }

    /// Returns the number behind those of the publishers of so many sensors.
    pub(crate) fn after(sensors: usize) -> usize {
        1 + sensors * Type::ALL.len()
    }

    /// Publishes a message.
    pub(crate) fn put(&mut self, message: RosMessage) -> zenoh::Result<()> {
        let Some(to) = self.0.get_mut(message.kind as usize) else { return Ok(()) };
        to.number += 1;
        to.publisher.put(message.payload).attachment(attachment(to.number, to.gid)).wait()
    }
}
