//! Controls: which are locked, and which changed although nobody touched them.

use serde::Serialize;

use wstac_host::camera::{ControlValue, LockedControl, UnlockedReason};

/// A control from the start of the measurement to its end.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ControlReport {
    /// Its name, as `v4l2-ctl -l` spells it.
    pub name: String,
    /// Its value at the start.
    pub value: Option<i64>,
    /// Its value at the end.
    pub value_at_end: Option<i64>,
    /// `true` if it is locked; `None` for a control that does not matter.
    pub locked: Option<bool>,
    /// Why it is not locked.
    pub why: Option<UnlockedReason>,
    /// Whether it changed meanwhile, or the driver says that the hardware changes it.
    pub drifts: bool,
}

/// Returns the controls that matter, in the order of locking, then all others that can be set and changed.
pub fn compare(locked: &[LockedControl], before: &[ControlValue], after: &[ControlValue]) -> Vec<ControlReport> {
    let value_of = |values: &[ControlValue], name: &str| values.iter().find(|control| control.name == name).cloned();
    let report = |name: &str, lock: Option<&LockedControl>| {
        let (start, end) = (value_of(before, name), value_of(after, name));
        let is_volatile = start.iter().chain(&end).any(|control| control.volatile);
        let value = |control: Option<ControlValue>| control.and_then(|control| control.value).map(i64::from);
        let (start, end) = (value(start), value(end));
        ControlReport {
            name: name.to_owned(),
            value: start,
            value_at_end: end,
            locked: lock.map(|lock| lock.locked),
            why: lock.and_then(|lock| lock.why.clone()),
            drifts: is_volatile || start != end,
        }
    };
    let mut reports: Vec<_> = locked.iter().map(|lock| report(&lock.name, Some(lock))).collect();
    let is_known = |control: &&ControlValue| locked.iter().any(|lock| lock.name == control.name);
    let others = before.iter().filter(|control| !control.read_only && !is_known(control));
    reports.extend(others.map(|control| report(&control.name, None)).filter(|report| report.drifts));
    reports
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_is_found_wherever_it_is() {
        let value = |name: &str, value, volatile| {
            let read_only = name == "temperature";
            ControlValue { name: name.into(), value: Some(value), volatile, read_only }
        };
        let lock = |name: &str, locked: bool| LockedControl { name: name.into(), locked, ..LockedControl::default() };
        let before = [("gain", 3), ("hue", 1), ("zoom", 5), ("tint", 7), ("temperature", 30)];
        let after = [("gain", 9), ("hue", 1), ("zoom", 5), ("tint", 7), ("temperature", 31)];
        let [before, after] = [before, after].map(|all| all.map(|(name, number)| value(name, number, name == "tint")));
        let reports = compare(&[lock("hue", true), lock("gain", false)], &before, &after);
        let found: Vec<_> = reports.iter().map(|c| (&*c.name, c.locked, c.drifts, c.value_at_end)).collect();
        let expected =
            [("hue", Some(true), false, Some(1)), ("gain", Some(false), true, Some(9)), ("tint", None, true, Some(7))];
        assert_eq!(found, expected);
    }
}
