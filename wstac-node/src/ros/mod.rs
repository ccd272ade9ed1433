//! Messages of ROS 2, and the keys and tokens by which its nodes find them on Zenoh.
//!
//! `cdr` writes numbers and texts, `messages` and `picture` write whole messages, `names` writes keys as rmw_zenoh does, `publishers`
//! sends, and `services` answers, with `parameters` and `requests`.

mod cdr;
pub(crate) mod messages;
pub(crate) mod names;
mod parameters;
pub(crate) mod picture;
pub(crate) mod publishers;
mod requests;
pub(crate) mod services;
