//! Why frames were lost, for a person.

/// Frames lost, counted by reason.
#[derive(Default)]
pub(super) struct LossReport(Vec<(&'static str, u64)>);

impl LossReport {
    pub(super) fn add(&mut self, frames: u64, why: &'static str) {
        match self.0.iter_mut().find(|(reason, _)| *reason == why) {
            Some((_, count)) => *count = count.saturating_add(frames),
            None => self.0.push((why, frames)),
        }
    }

    /// A line a reason.
    pub(super) fn say(&self, note: impl Fn(String)) {
        for (why, count) in &self.0 {
            note(format!("{count} frame(s) lost: {why}"));
        }
    }
}
