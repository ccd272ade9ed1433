//! What waits for a thread that may be slow: so much at most. Nobody who adds to it waits.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// The end of a queue that takes no more than fits.
pub(crate) struct Queue<T>(SyncSender<T>);

impl<T> Queue<T> {
    /// Returns a queue of so many at most, and the end that takes them out.
    pub(crate) fn new(most: usize) -> (Self, Receiver<T>) {
        let (sender, receiver) = sync_channel(most);
        (Self(sender), receiver)
    }

    /// Adds one at the end. If there is no room, or nobody takes them out any more, it is left out.
    pub(crate) fn add(&self, one: T) {
        let _ = self.0.try_send(one);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn further_requests_do_not_wait() {
        let (queue, waiting) = Queue::new(crate::records::MOST_ASKED);
        (0..1000).for_each(|number| queue.add(number));
        assert!(waiting.try_iter().eq(0..16));
        queue.add(1000);
        assert_eq!(waiting.try_recv(), Ok(1000));
        drop(waiting);
        queue.add(1001);
    }
}
