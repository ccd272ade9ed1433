//! The order in which the messages of a recording are read: as they stand, or sorted if a tool wrote them in another
//! one.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Seek;
use std::path::Path;

use mcap::records::op;

use super::super::sorted::Index;
use super::super::walk::WalkStep;
use super::{Recovered, Recovery, attempt, not_written};
use crate::error::{Error, ErrorKind};

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
    in_better_order(found.frames, |order| {
        let emptied = new.set_len(0).and_then(|()| new.rewind());
        emptied.map_err(|error| not_written(path, error.into()))?;
        attempt(old, &new, path, order).map(|(found, _)| found)
    })
}

/// Recovers a file in order by another `attempt`, or as it stands where that is better. `found` frames were found
/// before.
fn in_better_order(found: u64, mut attempt: impl FnMut(Order) -> Result<Recovered, Error>) -> Result<Recovered, Error> {
    match attempt(Order::Sorted) {
        // To put them in order takes too much work.
        Err(error) if matches!(error.kind(), ErrorKind::Format | ErrorKind::Data) => {
            let mut found = attempt(Order::AsItStands)?;
            found.problem.get_or_insert_with(|| error.message().to_owned());
            Ok(found)
        }
        // Frames may be lost rather than moved: then the file has more of them as it stands.
        Ok(sorted) if sorted.frames < found => attempt(Order::AsItStands),
        sorted => sorted,
    }
}

/// The order in which messages are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// As they stand, unless that is not the order in which they were recorded.
    Doubted,
    AsItStands,
    Sorted,
}

impl Recovery<'_> {
    /// Puts the messages of the old file in order.
    pub(super) fn sort(&mut self) -> Result<(), Error> {
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
        self.sorted = Some(index.sort(&mut self.walk, self.own.sensors.count(), own)?);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_put_in_order_is_recovered_as_it_stands() {
        // The frames in order, or why there are none; a problem of the file as it stands; what comes back.
        let recovered = |sorted: Result<u64, ErrorKind>, problem: Option<&str>| {
            let mut orders = Vec::new();
            let result = in_better_order(100, |order| {
                orders.push(order);
                match (order, sorted) {
                    (Order::Sorted, Err(kind)) => Err(Error::new(kind, "a.mcap", "too far out of order")),
                    (Order::Sorted, Ok(frames)) => Ok(Recovered { frames, ..Recovered::default() }),
                    _ => Ok(Recovered { frames: 7, problem: problem.map(str::to_owned), ..Recovered::default() }),
                }
            });
            (orders, result.map(|found| (found.frames, found.problem)).map_err(|error| error.kind()))
        };
        let (sorted, both) = (vec![Order::Sorted], vec![Order::Sorted, Order::AsItStands]);
        assert_eq!(recovered(Ok(100), None), (sorted.clone(), Ok((100, None))));
        assert_eq!(recovered(Ok(99), None), (both.clone(), Ok((7, None))));
        let why = |text: &str| Ok((7, Some(text.to_owned())));
        assert_eq!(recovered(Err(ErrorKind::Format), None), (both.clone(), why("too far out of order")));
        assert_eq!(recovered(Err(ErrorKind::Format), Some("cut")), (both, why("cut")));
        // Another attempt fails alike.
        assert_eq!(recovered(Err(ErrorKind::Io), None), (sorted, Err(ErrorKind::Io)));
    }
}
