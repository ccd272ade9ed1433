//! The order in which the messages of a recording are read: as they stand, or sorted if a tool wrote them in another one.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Seek;
use std::path::Path;

use mcap::records::op;

use super::super::sorted::Index;
use super::super::walk::WalkStep;
use super::{RecoverFailure, Recovered, Recovery, attempt, not_written};
use crate::error::Error;

/// Recovers everything that was completely written. `new` is an empty file at `path`.
///
/// The new file is there even if the result names a problem.
///
/// # Errors
/// The old file is no MCAP file or cannot be read, or the new one cannot be written.
pub fn recover(old: &Path, mut new: File, path: &Path) -> Result<Recovered, Error> {
    let (found, is_final) = attempt(old, &new, path, Order::Doubted)?;
    if is_final {
        return Ok(found);
    }
    let mut again = |order| {
        let emptied = new.set_len(0).and_then(|()| new.rewind());
        emptied.map_err(|error| not_written(path, error.into()))?;
        attempt(old, &new, path, order).map(|(found, _)| found)
    };
    let sorted = match again(Order::Sorted) {
        // To put them in order takes too much work.
        Err(error) if error.is_format() || error.is_data() => {
            let mut found = again(Order::AsItStands)?;
            found.problem.get_or_insert_with(|| error.message().to_owned());
            return Ok(found);
        }
        sorted => sorted?,
    };
    // Frames may be lost rather than moved: then the file has more of them as it stands.
    if sorted.frames < found.frames { again(Order::AsItStands) } else { Ok(sorted) }
}

/// The order in which messages are read.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// As they stand, unless that is not the order in which they were recorded.
    Doubted,
    AsItStands,
    Sorted,
}

impl Recovery<'_> {
    /// Puts the messages of the old file in order.
    pub(super) fn sort(&mut self) -> Result<(), RecoverFailure> {
        let mut index = Index::default();
        loop {
            match self.walk.next()? {
                WalkStep::Record(span) if span.op == op::MESSAGE => index.add(&mut self.walk, span)?,
                WalkStep::Record(span) => self.record(span)?,
                WalkStep::Damage(unread) => self.is_suspect |= unread.damaged,
                WalkStep::ChunkEnd => {}
                WalkStep::End { whole } => {
                    self.found.whole = whole || self.walk.is_finished()?;
                    break;
                }
            }
        }
        let owns: BTreeMap<_, _> =
            self.channels.keys().filter_map(|&channel| Some((channel, self.own(channel)?))).collect();
        let own = |channel: u16| owns.get(&channel).copied();
        self.sorted = Some(index.sort(&mut self.walk, self.sensors.count(), own)?);
        Ok(())
    }
}
