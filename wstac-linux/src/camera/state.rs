//! What is known of a camera while it streams: who it is, and which of its controls stay as they are.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// A camera and its controls. Stored with every recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct CameraState {
    /// The path that it was opened by.
    pub path: PathBuf,
    /// Paths that stay the same when it is plugged in again: by its serial number first, then by its place.
    pub links: Vec<PathBuf>,
    /// What the maker calls it.
    pub card: String,
    /// The kernel's driver.
    pub driver: String,
    /// Where it is plugged in.
    pub bus: String,
    /// Four-character code of what it sends.
    pub format: String,
    /// The controls that change what grey levels mean, as they were read back.
    pub controls: Vec<LockedControl>,
}

/// A control after an attempt to lock it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LockedControl {
    /// What the driver calls it.
    pub name: String,
    /// Its number: `V4L2_CID_*`.
    pub id: u32,
    /// Its value, read back.
    pub value: i64,
    /// Whether it stays there: nothing automatic changes it, and it was read back as it was set.
    pub locked: bool,
    /// Why it is not locked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

impl CameraState {
    /// Whether a control that changes what grey levels mean may change by itself.
    pub fn is_unlocked(&self) -> bool {
        self.controls.iter().any(|control| !control.locked)
    }
}
