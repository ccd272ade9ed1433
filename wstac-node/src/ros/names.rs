//! Keys, tokens of liveliness and attachments, as rmw_zenoh of ROS 2 Jazzy has them (its design.md).

use std::time::{SystemTime, UNIX_EPOCH};

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
}

impl Type {
    /// All types, in the order of their declaration.
    pub(crate) const ALL: [Self; 7] = [
        Self::Event,
        Self::ContactEnd,
        Self::TwistStamped,
        Self::Features,
        Self::Taxels,
        Self::DiagnosticArray,
        Self::Image,
    ];

    /// Returns the package and the name.
    fn name(self) -> (&'static str, &'static str) {
        match self {
            Self::Event => ("wstac_msgs", "Event"),
            Self::ContactEnd => ("wstac_msgs", "ContactEnd"),
            Self::TwistStamped => ("geometry_msgs", "TwistStamped"),
            Self::Features => ("wstac_msgs", "Features"),
            Self::Taxels => ("wstac_msgs", "Taxels"),
            Self::DiagnosticArray => ("diagnostic_msgs", "DiagnosticArray"),
            Self::Image => ("sensor_msgs", "Image"),
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
        }
    }

    /// Returns the topic, without the slash in front.
    fn topic(self, sensor: &str) -> String {
        let last = match self {
            Self::Event => "event",
            Self::ContactEnd => "contact_end",
            Self::TwistStamped => "motion",
            Self::Features => "features",
            Self::Taxels => "taxels",
            Self::Image => "picture",
            // Every node's diagnostics have one topic.
            Self::DiagnosticArray => return "diagnostics".to_owned(),
        };
        format!("{sensor}/{last}")
    }

    /// Returns the type as DDS writes it, and its hash.
    fn typed(self) -> String {
        let (package, name) = self.name();
        format!("{package}::msg::dds_::{name}_/{}", self.hash())
    }

    /// Returns the key of a sensor's topic. `sensor` has the namespace in front.
    pub(crate) fn key(self, domain: u32, sensor: &str) -> String {
        format!("{domain}/{}/{}", self.topic(sensor), self.typed())
    }

    /// Returns the token that tells other nodes of a publisher. Publishers of a session have different numbers.
    pub(crate) fn token(self, domain: u32, session: &str, number: usize, sensor: &str) -> String {
        let topic = format!("/{}", self.topic(sensor)).replace('/', "%");
        // Reliable, volatile, the last ten: the default quality of service.
        format!("@ros2_lv/{domain}/{session}/0/{number}/MP/%/%/{NODE}/{topic}/{}/::,10:,:,:,,", self.typed())
    }
}

/// The name of the node.
const NODE: &str = "wstac_node";

/// Returns the token that tells other nodes of this one.
pub(crate) fn node_token(domain: u32, session: &str) -> String {
    format!("@ros2_lv/{domain}/{session}/0/0/NN/%/%/{NODE}")
}

/// Returns what goes along with a message: its number, the time now, and the publisher's 16 bytes.
pub(crate) fn attachment(number: i64, publisher: [u8; 16]) -> Vec<u8> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64);
    [&number.to_le_bytes()[..], &now.to_le_bytes(), &[16], &publisher].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_and_a_token_name_topic_type_and_hash() {
        let key = Type::Event.key(3, "wstac/left");
        assert!(key.starts_with("3/wstac/left/event/wstac_msgs::msg::dds_::Event_/RIHS01_c995"), "{key}");
        let token = Type::Event.token(3, "abc", 7, "wstac/left");
        assert!(
            token.starts_with("@ros2_lv/3/abc/0/7/MP/%/%/wstac_node/%wstac%left%event/wstac_msgs::msg::"),
            "{token}"
        );
        assert!(token.ends_with("/::,10:,:,:,,"), "{token}");
        assert!(Type::ALL.iter().enumerate().all(|(number, kind)| *kind as usize == number));
    }

    #[test]
    fn an_attachment_has_33_bytes() {
        let bytes = attachment(5, [9; 16]);
        assert_eq!(
            (bytes.len(), &bytes[..8], bytes[16], &bytes[17..]),
            (33, &5_i64.to_le_bytes()[..], 16, &[9; 16][..])
        );
    }
}
