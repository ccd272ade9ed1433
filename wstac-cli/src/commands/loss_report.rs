//! Why frames were lost, for a person.

use wstac_host::source::LossReason;

/// Frames lost, counted by reason.
#[derive(Default)]
pub(super) struct LossReport(Vec<(LossReason, u64)>);

impl LossReport {
    pub(super) fn add(&mut self, frames: u64, reason: &LossReason) {
        match self.0.iter_mut().find(|(known, _)| known == reason) {
            Some((_, count)) => *count = count.saturating_add(frames),
            None => self.0.push((reason.clone(), frames)),
        }
    }

    /// A line a reason.
    pub(super) fn say(&self, note: impl Fn(String)) {
        for (reason, count) in &self.0 {
            note(format!("{count} frame(s) lost: {reason}"));
        }
    }
}
