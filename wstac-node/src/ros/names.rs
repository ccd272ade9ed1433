//! The types of messages of ROS 2.

/// The type of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Type {
    Event,
    ContactEnd,
    Slip,
    TwistStamped,
    Features,
    Taxels,
}

impl Type {
    /// Returns the name as ROS 2 writes it, such as `wstac_msgs/msg/Event`.
    pub(crate) fn schema(self) -> String {
        let package = if self == Self::TwistStamped { "geometry_msgs" } else { "wstac_msgs" };
        format!("{package}/msg/{self:?}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_has_package_and_kind() {
        assert_eq!(Type::TwistStamped.schema(), "geometry_msgs/msg/TwistStamped");
        assert_eq!(Type::ContactEnd.schema(), "wstac_msgs/msg/ContactEnd");
        assert_eq!(Type::Slip.schema(), "wstac_msgs/msg/Slip");
    }
}
