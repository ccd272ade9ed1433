//! Locking of controls: automatic ones off first, then the values, then everything is read back.

use std::io;

use v4l::v4l_sys as sys;

use super::plan::{SWITCHES, Switch, VALUES};
use super::{Control, ControlSetting, Controls};
use wstac_host::camera::{LockedControl, UnlockedReason};

struct Attempt {
    id: u32,
    name: String,
    /// The value that it was to have; `None` if that could not even be read.
    target: Option<i32>,
    refused: Option<io::Error>,
    /// The reason why it is not locked although it has this value.
    open: Option<UnlockedReason>,
    /// Whether it goes on changing what it governs.
    automatic: bool,
}

/// Locks the controls that change what gray levels mean, and sets those that a user names.
///
/// It returns all of them as they were read back. `keep` leaves those that no user names as they are. A value that the
/// driver refuses is no error: the list says so.
///
/// # Errors
/// A setting names no control, or is out of its range. The error names the control, what was found and what there is.
pub(crate) fn lock(
    device: &impl Controls,
    settings: &[ControlSetting],
    keep: bool,
) -> Result<Vec<LockedControl>, String> {
    let listed = device.list();
    let wanted = checked(&listed, settings)?;
    let asked = |id| wanted.iter().rev().find(|(control, _)| control.id == id).map(|(_, value)| *value);
    let mut attempts = Vec::new();
    for switch in &SWITCHES {
        let Some(control) = listed.iter().find(|control| control.id == switch.id) else { continue };
        attempts.push(match asked(switch.id) {
            None if keep => Attempt { automatic: is_automatic(device, switch), ..kept(device, control) },
            asked => switched(device, control, switch, asked),
        });
    }
    // These are what nothing automatic governs any more: the numbers, and other controls that a user names.
    let values = VALUES.iter().map(|value| (value.id, value.governed_by));
    for (id, governed_by) in values.chain(wanted.iter().map(|(control, _)| (control.id, &[][..]))) {
        let Some(control) = listed.iter().find(|control| control.id == id) else { continue };
        if attempts.iter().any(|attempt| attempt.id == id) {
            continue;
        }
        let governor = attempts.iter().find(|switch| switch.automatic && governed_by.contains(&switch.id));
        let open = governor.map(|governor| other(format!("{} is automatic", governor.name)));
        attempts.push(match asked(id) {
            None if keep => kept(device, control),
            asked => Attempt { open, ..set(device, control, asked) },
        });
    }
    let after = device.list();
    Ok(attempts.into_iter().map(|attempt| judged(device, attempt, &after)).collect())
}

/// Reapplies locked controls, because a camera may forget them when its stream starts.
pub(crate) fn hold(device: &impl Controls, controls: &mut [LockedControl]) {
    let is = |control: &LockedControl| device.get(control.id).is_ok_and(|value| i64::from(value) == control.value);
    for control in controls.iter().filter(|control| control.locked && !is(control)) {
        // The code below checks whether it helped. A value of 32 bits is what was read.
        let _ = device.set(control.id, control.value as i32);
    }
    for control in controls.iter_mut().filter(|control| control.locked) {
        if !is(control) {
            control.locked = false;
            control.why = Some(UnlockedReason::ChangedAtStart);
            control.value = device.get(control.id).map_or(control.value, i64::from);
        }
    }
}

/// Returns the controls that settings name, with their values.
fn checked<'c>(listed: &'c [Control], settings: &[ControlSetting]) -> Result<Vec<(&'c Control, i32)>, String> {
    let all = || {
        let ranges =
            listed.iter().map(|control| format!("{} {} to {}", control.name, control.range.0, control.range.1));
        let ranges = ranges.collect::<Vec<_>>().join(", ");
        if ranges.is_empty() { "the camera has no controls".to_owned() } else { format!("the camera has {ranges}") }
    };
    let one = |setting: &ControlSetting| {
        let ControlSetting { name, value } = setting;
        let control = listed.iter().find(|control| control.name == *name);
        let control = control.ok_or_else(|| format!("control {name} is not there, {}", all()))?;
        let (least, most) = control.range;
        if !(least..=most).contains(value) {
            return Err(format!("control {name} is {value}, expected {least} to {most}; {}", all()));
        }
        if control.step > 1 && (i64::from(*value) - i64::from(least)) % i64::from(control.step) != 0 {
            return Err(format!("control {name} is {value}, expected {least} to {most} in steps of {}", control.step));
        }
        Ok((control, *value))
    };
    settings.iter().map(one).collect()
}

/// Leaves a control as it is, and reports the value that is read.
fn kept(device: &impl Controls, control: &Control) -> Attempt {
    Attempt { target: device.get(control.id).ok(), open: Some(UnlockedReason::Kept), ..nothing_of(control) }
}

/// Switches something automatic off, or sets it as a user asked.
fn switched(device: &impl Controls, control: &Control, switch: &Switch, asked: Option<i32>) -> Attempt {
    let (least, most) = control.range;
    let current = device.get(control.id).ok();
    let has_off = (least..=most).contains(&switch.off);
    let target = asked.or(if has_off { Some(switch.off) } else { current });
    // A switch that is off already need not be set, and perhaps cannot be set.
    let refused = if current == target { None } else { target.and_then(|target| device.set(control.id, target).err()) };
    let (now, automatic) = (device.get(control.id).ok(), is_automatic(device, switch));
    if !automatic && asked.is_none() {
        return Attempt { target: now, ..nothing_of(control) };
    }
    let open = match asked {
        Some(_) => (automatic && now == target).then_some(UnlockedReason::SetAutomatic),
        None if has_off => Some(refused.as_ref().map_or(UnlockedReason::StillOn, |error| {
            let reasons = [UnlockedReason::OnReadOnly, UnlockedReason::OnGrabbed, UnlockedReason::OnInactive];
            refusal(error, "cannot be switched off", control, reasons)
        })),
        None => Some(other(format!("cannot be off, which is {}: the camera has {least} to {most}", switch.off))),
    };
    Attempt { target, refused: refused.filter(|_| open.is_none()), open, automatic, ..nothing_of(control) }
}

/// Returns whether a switch changes what it governs, or cannot be read.
fn is_automatic(device: &impl Controls, switch: &Switch) -> bool {
    !device.get(switch.id).is_ok_and(|value| value == switch.off || switch.fixed.contains(&value))
}

fn nothing_of(control: &Control) -> Attempt {
    let name = control.name.clone();
    Attempt { id: control.id, name, target: None, refused: None, open: None, automatic: false }
}

/// Returns why a control refused a value, of the reasons for one that is read-only, grabbed or inactive.
fn refusal(error: &io::Error, what: &str, control: &Control, reasons: [UnlockedReason; 3]) -> UnlockedReason {
    let flags = [sys::V4L2_CTRL_FLAG_READ_ONLY, sys::V4L2_CTRL_FLAG_GRABBED, sys::V4L2_CTRL_FLAG_INACTIVE];
    let known = flags.into_iter().zip(reasons).find(|(flag, _)| control.has(*flag));
    known.map_or_else(|| other(format!("{what}: {error}")), |(_, reason)| reason)
}

/// Creates a reason with numbers or the driver's words.
fn other(words: String) -> UnlockedReason {
    UnlockedReason::Other(words.into())
}

/// Sets a number to the value that a user asks for, or to its present one, so that it stays.
fn set(device: &impl Controls, control: &Control, asked: Option<i32>) -> Attempt {
    let target = asked.or_else(|| device.get(control.id).ok());
    let refused = target.and_then(|target| device.set(control.id, target).err());
    Attempt { target, refused, ..nothing_of(control) }
}

/// Reads a control back and returns its state.
fn judged(device: &impl Controls, attempt: Attempt, after: &[Control]) -> LockedControl {
    let Attempt { id, name, target, refused, open, .. } = attempt;
    let (value, error) = match device.get(id) {
        Ok(value) => (Some(value), None),
        Err(error) => (None, Some(error)),
    };
    let now = after.iter().find(|control| control.id == id);
    let has = |flag| now.is_some_and(|control| control.has(flag));
    let why = if let Some(error) = error {
        Some(other(format!("cannot be read: {error}")))
    } else if open.is_some() {
        open
    } else if let (Some(error), Some(now)) = (&refused, now) {
        let reasons = [UnlockedReason::ReadOnly, UnlockedReason::Grabbed, UnlockedReason::Governed];
        Some(refusal(error, "cannot be set", now, reasons))
    } else if value != target {
        let found = |value: Option<i32>| value.map_or_else(|| "nothing".to_owned(), |value| value.to_string());
        Some(other(format!("set to {}, but reads back {}", found(target), found(value))))
    } else if has(sys::V4L2_CTRL_FLAG_VOLATILE) {
        Some(UnlockedReason::Volatile)
    } else if has(sys::V4L2_CTRL_FLAG_INACTIVE) {
        Some(UnlockedReason::Inactive)
    } else {
        None
    };
    let value = value.or(target).map_or(0, i64::from);
    LockedControl { name, id, value, locked: why.is_none(), why }
}
