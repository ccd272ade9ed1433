//! Which controls are locked, and which changed while nobody touched them.

use serde::Serialize;

use crate::camera::LockedControl;
use crate::camera::controls::ControlValue;

/// A control from the start of the measurement to its end.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ControlReport {
    /// Its name, as `v4l2-ctl -l` spells it.
    pub name: String,
    /// Its value at the start.
    pub value: Option<i64>,
    /// Its value at the end.
    pub value_at_end: Option<i64>,
    /// Whether it is locked; nothing of a control that does not matter.
    pub locked: Option<bool>,
    /// Why it is not locked.
    pub why: Option<String>,
    /// Whether it changed meanwhile, or the driver says that the hardware changes it.
    pub drifts: bool,
}

/// The controls that matter, in the order of locking, then all others that changed.
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
    let others = before.iter().filter(|control| locked.iter().all(|lock| lock.name != control.name));
    reports.extend(others.map(|control| report(&control.name, None)).filter(|report| report.drifts));
    reports
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_is_found_wherever_it_is() {
        let value = |name: &str, value, volatile| ControlValue { name: name.into(), value: Some(value), volatile };
        let lock = |name: &str, locked: bool| LockedControl { name: name.into(), locked, ..LockedControl::default() };
        let before = [value("gain", 3, false), value("hue", 1, false), value("zoom", 5, false), value("tint", 7, true)];
        let after = [value("gain", 9, false), value("hue", 1, false), value("zoom", 5, false), value("tint", 7, true)];
        let reports = compare(&[lock("hue", true), lock("gain", false)], &before, &after);
        let found: Vec<_> = reports.iter().map(|c| (&*c.name, c.locked, c.drifts, c.value_at_end)).collect();
        let expected =
            [("hue", Some(true), false, Some(1)), ("gain", Some(false), true, Some(9)), ("tint", None, true, Some(7))];
        assert_eq!(found, expected);
    }
}
