//! Records as messages of ROS 2, for `--zenoh-encoding cdr`: a node of ROS 2 can publish their bytes as they are.
//!
//! `cdr` writes numbers and texts, `messages` writes whole messages, and `names` has their types.

mod cdr;
pub(crate) mod messages;
pub(crate) mod names;
