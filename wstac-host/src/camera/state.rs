//! The state of a camera while it streams: its identity, and which of its controls are locked.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

pub use crate::reasons::UnlockedReason;

/// A camera and its controls. They are stored with every recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct CameraState {
    /// The path that it was opened by.
    pub path: PathBuf,
    /// Paths that stay the same when it is plugged in again: by its serial number first, then by its place.
    pub links: Vec<PathBuf>,
    /// The maker's name for it.
    pub card: String,
    /// The kernel's driver.
    pub driver: String,
    /// The place where it is plugged in.
    pub bus: String,
    /// Four-character code of its frames.
    pub format: String,
    /// The controls that change what gray levels mean, as they were read back.
    pub controls: Vec<LockedControl>,
}

/// A control's name, as `v4l2-ctl -l` spells it, and the value that it is to have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControlSetting {
    /// Its name, such as `exposure_time_absolute`.
    pub name: String,
    /// Its value, in the driver's own unit.
    pub value: i32,
}

/// A control after an attempt to lock it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LockedControl {
    /// The driver's name for it, as `v4l2-ctl -l` spells it.
    pub name: String,
    /// Its identifier: `V4L2_CID_*`.
    pub id: u32,
    /// Its value, read back.
    pub value: i64,
    /// Whether it keeps its value: nothing automatic changes it, and it was read back as it was set.
    pub locked: bool,
    /// The reason why it is not locked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<UnlockedReason>,
}

impl CameraState {
    /// Returns whether a control that changes what gray levels mean may change by itself.
    pub fn is_unlocked(&self) -> bool {
        self.controls.iter().any(|control| !control.locked)
    }
    /// Returns the settings that restore the locked controls after the camera was unplugged.
    pub fn settings(&self) -> Vec<ControlSetting> {
        let locked = self.controls.iter().filter(|control| control.locked);
        let setting = |control: &LockedControl| {
            Some(ControlSetting { name: control.name.clone(), value: i32::try_from(control.value).ok()? })
        };
        locked.filter_map(setting).collect()
    }

    /// Describes the state of the controls for a person: `12 controls locked`, and which are not, and why.
    pub fn about_controls(&self) -> String {
        let (locked, open): (Vec<_>, Vec<_>) = self.controls.iter().partition(|control| control.locked);
        if self.controls.is_empty() {
            return "no controls to lock".into();
        }
        let text = format!("{} controls locked", locked.len());
        let why = |control: &&LockedControl| {
            format!("{} ({})", control.name, control.why.as_ref().map_or("unknown", UnlockedReason::name))
        };
        let open: Vec<_> = open.iter().map(why).collect();
        if open.is_empty() { text } else { format!("{text}, NOT locked: {}", open.join(", ")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn control(name: &str, locked: bool, why: Option<&str>) -> LockedControl {
        LockedControl { name: name.into(), id: 1, value: 7, locked, why: why.map(UnlockedReason::from) }
    }

    #[test]
    fn controls_in_words_and_as_settings() {
        let mut state = CameraState::default();
        assert_eq!(state.about_controls(), "no controls to lock");
        state.controls = vec![control("gain", true, None), control("hue", true, None)];
        assert_eq!(state.about_controls(), "2 controls locked");
        assert!(!state.is_unlocked());
        state.controls.push(control("auto_exposure", false, Some("read-only")));
        assert_eq!(state.about_controls(), "2 controls locked, NOT locked: auto_exposure (read-only)");
        assert!(state.is_unlocked());
        let settings = state.settings();
        assert_eq!(settings.iter().map(|s| (&*s.name, s.value)).collect::<Vec<_>>(), [("gain", 7), ("hue", 7)]);
    }
}
