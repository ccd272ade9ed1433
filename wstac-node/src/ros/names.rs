//! Keys, tokens of liveliness and attachments, as rmw_zenoh of ROS 2 Jazzy has them (its design.md).

use std::time::{SystemTime, UNIX_EPOCH};

use zenoh::qos::{CongestionControl, Priority};

use super::services::Service;

/// The type of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Event,
    ContactEnd,
    TwistStamped,
    Features,
    Taxels,
    DiagnosticArray,
    Image,
    /// A message of the node, not of a sensor.
    ParameterEvent,
}

impl Type {
    /// The types of a sensor's topics, in the order of their declaration.
    pub(crate) const OF_SENSOR: [Self; 7] = [
        Self::Event,
        Self::ContactEnd,
        Self::TwistStamped,
        Self::Features,
        Self::Taxels,
        Self::DiagnosticArray,
        Self::Image,
    ];

    /// Returns the package of the definition, whose name is that of the constant, and the last part of the topic.
    fn described(self) -> (&'static str, &'static str) {
        match self {
            Self::Event => ("wstac_msgs", "event"),
            Self::ContactEnd => ("wstac_msgs", "contact_end"),
            Self::TwistStamped => ("geometry_msgs", "motion"),
            Self::Features => ("wstac_msgs", "features"),
            Self::Taxels => ("wstac_msgs", "taxels"),
            Self::DiagnosticArray => ("diagnostic_msgs", "diagnostics"),
            Self::Image => ("sensor_msgs", "picture"),
            Self::ParameterEvent => ("rcl_interfaces", "parameter_events"),
        }
    }

    /// Returns the hash of the definition (REP 2016). Nodes whose hash differs do not hear each other.
    fn hash(self) -> &'static str {
        match self {
            Self::Event => "RIHS01_c995974c11c2e5baede8481c7dcf5b215e5c107aa9b8377a233c3b391c71ce3f",
            Self::ContactEnd => "RIHS01_8002282b8eafd33849a15fce0c08b71e4350d52512a657649b2520efb42fc159",
            Self::TwistStamped => "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
            Self::Features => "RIHS01_9031d0c072062218f9d2d78eec148dad884014c6d73326796db1e7ce63bd09aa",
            Self::Taxels => "RIHS01_06c894c5e4cada9ef7e285ac9ee320a313890a2afd055d6af180d8a6e927b02f",
            Self::DiagnosticArray => "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
            Self::Image => "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
            Self::ParameterEvent => "RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204",
        }
    }

    /// Returns the topic, without the slash in front.
    fn topic(self, sensor: &str) -> String {
        match (self, self.described().1) {
            // Every node's diagnostics have one topic, and so have the changes of its parameters.
            (Self::DiagnosticArray | Self::ParameterEvent, topic) => topic.to_owned(),
            (_, last) => format!("{sensor}/{last}"),
        }
    }

    /// Returns the name as ROS 2 writes it, such as `wstac_msgs/msg/Event`.
    pub(crate) fn schema(self) -> String {
        format!("{}/msg/{self:?}", self.described().0)
    }

    /// Returns what happens to a message if a subscriber is slow: of streams, a newer one makes an older one worthless.
    pub(crate) fn control(self) -> CongestionControl {
        match self {
            Self::Event | Self::ContactEnd | Self::ParameterEvent => CongestionControl::Block,
            _ => CongestionControl::Drop,
        }
    }

    /// Returns the place of a message in a connection's queues. Pictures are large, and have one of their own.
    pub(crate) fn priority(self) -> Priority {
        if self == Self::Image { Priority::DataLow } else { Priority::Data }
    }

    /// Returns the type as DDS writes it, and its hash.
    fn typed(self) -> String {
        format!("{}::msg::dds_::{self:?}_/{}", self.described().0, self.hash())
    }

    /// Returns the key of a sensor's topic. `sensor` has the namespace in front.
    pub(crate) fn key(self, domain: u32, sensor: &str) -> String {
        format!("{domain}/{}/{}", self.topic(sensor), self.typed())
    }

    /// Returns the token that tells other nodes of a publisher. Publishers of a session have different numbers.
    pub(crate) fn token(self, domain: u32, session: &str, number: usize, node: &str, sensor: &str) -> String {
        let topic = format!("/{}", self.topic(sensor)).replace('/', "%");
        // Reliable and volatile: the default quality of service has the last ten, and that of parameters the last thousand.
        let depth = if self == Self::ParameterEvent { 1000 } else { 10 };
        format!("@ros2_lv/{domain}/{session}/0/{number}/MP/%/%/{node}/{topic}/{}/::,{depth}:,:,:,,", self.typed())
    }
}

impl Service {
    /// Returns the hash of the definition (REP 2016): that of the service, not of its parts.
    fn hash(self) -> &'static str {
        match self {
            Self::RestartBaseline | Self::StopRecording => {
                "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"
            }
            Self::LoadConfig | Self::LoadModel => {
                "RIHS01_33a86df6af22aa64707d9ee4183df36286910e6c13df3b93ec03fccb21122e95"
            }
            Self::StartRecording => "RIHS01_23c4988b917980d780083b1d62353b5d2cccf931d96e0879aee412e583f1d9b8",
            Self::DescribeParameters => "RIHS01_845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff",
            Self::GetParameters => "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
            Self::GetParameterTypes => "RIHS01_da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca",
            Self::ListParameters => "RIHS01_3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d",
            Self::SetParameters => "RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0",
            Self::SetParametersAtomically => "RIHS01_0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd",
        }
    }

    /// Returns the type as DDS writes it, and its hash. Its name is that of the constant, unless others share it.
    fn typed(self) -> String {
        let (package, name) = match self {
            Self::RestartBaseline | Self::StopRecording => ("std_srvs", "Trigger".to_owned()),
            Self::LoadConfig | Self::LoadModel => ("wstac_msgs", "LoadFile".to_owned()),
            Self::StartRecording => ("wstac_msgs", format!("{self:?}")),
            _ => ("rcl_interfaces", format!("{self:?}")),
        };
        format!("{package}::srv::dds_::{name}_/{}", self.hash())
    }

    /// Returns the key of a service. `service` is its name without the slash in front.
    pub(crate) fn key(self, domain: u32, service: &str) -> String {
        format!("{domain}/{service}/{}", self.typed())
    }

    /// Returns the token that tells other nodes of a service. Entities of a session have different numbers.
    pub(crate) fn token(self, domain: u32, session: &str, number: usize, node: &str, service: &str) -> String {
        let name = format!("/{service}").replace('/', "%");
        format!("@ros2_lv/{domain}/{session}/0/{number}/SS/%/%/{node}/{name}/{}/::,10:,:,:,,", self.typed())
    }
}

/// Returns the token that tells other nodes of this one.
pub(crate) fn node_token(domain: u32, session: &str, node: &str) -> String {
    format!("@ros2_lv/{domain}/{session}/0/0/NN/%/%/{node}")
}

/// Returns what goes along with a message: its number, the time now, and the 16 bytes of the publisher or of the client
/// that is answered.
pub(crate) fn attachment(number: i64, publisher: [u8; 16]) -> Vec<u8> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64);
    [&number.to_le_bytes()[..], &now.to_le_bytes(), &[16], &publisher].concat()
}

/// Returns the number and the 16 bytes of the client that came along with a request.
pub(crate) fn attached(bytes: &[u8]) -> Option<(i64, [u8; 16])> {
    let number = bytes.first_chunk().map(|number| i64::from_le_bytes(*number))?;
    match bytes.get(16..)? {
        [16, client @ ..] => Some((number, client.try_into().ok()?)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_and_a_token_name_topic_type_and_hash() {
        let key = Type::Event.key(3, "wstac/left");
        assert!(key.starts_with("3/wstac/left/event/wstac_msgs::msg::dds_::Event_/RIHS01_c995"), "{key}");
        let token = Type::Event.token(3, "abc", 7, "wstac_node", "wstac/left");
        assert!(
            token.starts_with("@ros2_lv/3/abc/0/7/MP/%/%/wstac_node/%wstac%left%event/wstac_msgs::msg::"),
            "{token}"
        );
        assert!(token.ends_with("/::,10:,:,:,,"), "{token}");
        let of_node = Type::ParameterEvent;
        assert!(
            of_node.key(3, "").starts_with("3/parameter_events/rcl_interfaces::msg::dds_::ParameterEvent_/RIHS01_")
        );
        assert!(of_node.token(3, "abc", 7, "wstac_node", "").ends_with("/::,1000:,:,:,,"));
        assert!(Type::OF_SENSOR.iter().enumerate().all(|(number, kind)| *kind as usize == number));
    }

    #[test]
    fn a_service_is_named_as_in_the_design_of_rmw_zenoh() {
        let (kind, name) = (Service::RestartBaseline, "wstac/left/restart_baseline");
        assert!(kind.key(2, name).starts_with("2/wstac/left/restart_baseline/std_srvs::srv::dds_::Trigger_/RIHS01_"));
        let token = kind.token(2, "abc", 10, "wstac_node", name);
        assert!(token.starts_with("@ros2_lv/2/abc/0/10/SS/%/%/wstac_node/%wstac%left%restart_baseline/std_srvs::"));
        assert!(token.ends_with("2062c5f/::,10:,:,:,,"), "{token}");
    }

    #[test]
    fn an_attachment_has_33_bytes() {
        let bytes = attachment(5, [9; 16]);
        assert_eq!(
            (bytes.len(), &bytes[..8], bytes[16], &bytes[17..]),
            (33, &5_i64.to_le_bytes()[..], 16, &[9; 16][..])
        );
        assert_eq!(attached(&bytes), Some((5, [9; 16])));
        assert_eq!((attached(&bytes[..32]), attached(&[0; 33]), attached(&[])), (None, None, None));
    }
}
