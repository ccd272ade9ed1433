//! The options that `wstac-node` no longer has, and what to use instead.

use clap::Error;
use clap::error::{ContextKind, ContextValue};

/// Options that were removed, and what to use instead. The table "From 0.3" of CHANGELOG.md has the same rows, which
/// `ci/node` asks `wstac-node` for.
const REMOVED: [(&str, &str); 6] = [
    ("--ros", "the package wstac_ros publishes sensors in ROS 2 with any middleware (docs/ROS.md)"),
    ("--picture", "set the parameter SENSOR.picture of wstac_ros (docs/ROS.md)"),
    ("--domain", "set ROS_DOMAIN_ID, which every node of ROS 2 reads (docs/ROS.md)"),
    ("--node-name", "start wstac_ros with --ros-args -r __node:=NAME (docs/ROS.md)"),
    ("--files", "give wstac_ros a file of parameters (docs/ROS.md)"),
    ("--zenoh", "leave it out: JSON is always published"),
];

/// Returns what to use instead of a removed option, if that is what clap does not know.
pub(crate) fn answer(unknown: &Error) -> Option<String> {
    let Some(ContextValue::String(name)) = unknown.get(ContextKind::InvalidArg) else { return None };
    let (option, instead) = REMOVED.iter().find(|(option, _)| option == name)?;
    let line = format!("wstac-node {option}");
    Some(format!("{line}: was removed; help: {instead}"))
}
