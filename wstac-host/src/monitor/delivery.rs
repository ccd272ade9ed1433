//! Tells events that are new from those that arrive again, and counts those that never arrive.

use std::collections::{BTreeSet, VecDeque};

/// The number of events that are remembered. A board keeps fewer.
const REMEMBERED: usize = 16;
/// The most numbers that are waited for. A greater gap is lost at once.
const MOST_MISSING: u16 = 256;

/// The events of a board that have arrived, by their numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Delivery {
    /// The number after the newest event that is known of; `None` before the first.
    next: Option<u16>,
    /// Number and frame of the last events.
    arrived: VecDeque<(u16, u64)>,
    /// The numbers of older events that did not arrive.
    missing: BTreeSet<u16>,
}

/// The result of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Arrival {
    /// Whether the event has not arrived before.
    pub(super) is_new: bool,
    /// The number of other events that are now known to be lost.
    pub(super) lost: u64,
}

impl Delivery {
    /// Takes an event with its number, its frame, and how far the oldest event that the board keeps is behind it.
    pub(super) fn take(&mut self, number: u16, frame: u64, kept: u8) -> Arrival {
        if self.arrived.contains(&(number, frame)) {
            return Arrival { is_new: false, lost: self.give_up(number, kept) };
        }
        let is_behind = self.next.is_none_or(|next| number.wrapping_sub(next) > u16::MAX / 2);
        let mut lost = 0;
        if !is_behind {
            lost = self.expect(number);
        } else if !self.missing.remove(&number) {
            // It is the first event that is seen here, or the board has started again and its hello was lost. Only what
            // the board still keeps is waited for.
            *self = Self::default();
            self.missing.extend((1..=u16::from(kept)).map(|back| number.wrapping_sub(back)));
            self.next = Some(number);
        }
        if self.next == Some(number) {
            self.next = Some(number.wrapping_add(1));
        }
        self.arrived.push_back((number, frame));
        if self.arrived.len() > REMEMBERED {
            self.arrived.pop_front();
        }
        Arrival { is_new: true, lost: lost + self.give_up(number, kept) }
    }

    /// Takes the number of the board's next event, and how far the oldest event that the board keeps is behind it.
    /// Returns the number of events that are now known to be lost.
    pub(super) fn take_state(&mut self, next: u16, kept: u8) -> u64 {
        let Some(expected) = self.next else {
            // Events from now on are waited for.
            self.next = Some(next);
            self.missing.extend((1..=u16::from(kept)).map(|back| next.wrapping_sub(back)));
            return 0;
        };
        if next.wrapping_sub(expected) > u16::MAX / 2 {
            // It is older than what was seen since, or the board has started again, which its uptime shows.
            return 0;
        }
        self.expect(next) + self.give_up(next, kept)
    }

    /// Notes that all events before `number` have been sent. Returns how many are lost because they are too many.
    fn expect(&mut self, number: u16) -> u64 {
        let expected = self.next.unwrap_or(number);
        let gap = number.wrapping_sub(expected);
        let waited = gap.min(MOST_MISSING);
        self.missing.extend((1..=waited).map(|back| number.wrapping_sub(back)));
        self.next = Some(number);
        u64::from(gap - waited)
    }

    /// Gives up the missing events that are more than `kept` behind `number`, and returns how many those are.
    fn give_up(&mut self, number: u16, kept: u8) -> u64 {
        let before = self.missing.len();
        self.missing.retain(|&missing| {
            let behind = number.wrapping_sub(missing);
            behind <= u16::from(kept) || behind > u16::MAX / 2
        });
        (before - self.missing.len()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AGAIN: Arrival = Arrival { is_new: false, lost: 0 };

    fn new(lost: u64) -> Arrival {
        Arrival { is_new: true, lost }
    }

    #[test]
    fn an_event_that_arrives_again_is_not_new() {
        let mut delivery = Delivery::default();
        assert_eq!(delivery.take(u16::MAX, 70, 0), new(0));
        assert_eq!(delivery.take(u16::MAX, 70, 0), AGAIN);
        assert_eq!(delivery.take(0, 170, 1), new(0));
        assert_eq!(delivery.take(u16::MAX, 70, 0), AGAIN);
        assert_eq!(delivery.take(0, 170, 0), AGAIN);
        assert_eq!(delivery.take(1, 270, 0), new(0));
    }

    #[test]
    fn a_late_event_is_new_once_and_nothing_is_lost() {
        let mut delivery = Delivery::default();
        assert_eq!(delivery.take(4, 70, 0), new(0));
        // Event 5 is kept, and comes after event 6.
        assert_eq!(delivery.take(6, 270, 1), new(0));
        assert_eq!(delivery.take(5, 170, 0), new(0));
        assert_eq!(delivery.take(5, 170, 0), AGAIN);
        assert_eq!(delivery.take_state(7, 0), 0);
    }

    #[test]
    fn events_that_the_board_keeps_no_longer_are_lost() {
        let mut delivery = Delivery::default();
        // Events before the first one are not missed, unless they are kept.
        assert_eq!(delivery.take(10, 70, 2), new(0));
        assert_eq!(delivery.take(13, 370, 1), new(3));
        // Event 12 is given up, and the last one never arrives.
        assert_eq!(delivery.take_state(15, 1), 1);
        assert_eq!(delivery.take_state(15, 0), 1);
        assert_eq!(delivery.take_state(15, 0), 0);
        // More than is waited for.
        assert_eq!(delivery.take(2000, 9000, 0), new(1985));
        assert_eq!(delivery.take(2001, 9100, 0), new(0));
    }

    #[test]
    fn a_board_that_starts_again_unseen_has_new_events() {
        let mut delivery = Delivery::default();
        for number in 0..20 {
            assert_eq!(delivery.take(number, u64::from(number) * 100, 0), new(0));
        }
        assert_eq!(delivery.take(0, 35, 0), new(0));
        assert_eq!(delivery.take(0, 35, 0), AGAIN);
        assert_eq!(delivery.take(1, 135, 0), new(0));
    }

    #[test]
    fn a_state_before_the_first_event_shows_a_loss() {
        let mut delivery = Delivery::default();
        assert_eq!(delivery.take_state(3, 1), 0);
        assert_eq!(delivery.take_state(4, 0), 2);
        assert_eq!(delivery.take(4, 70, 0), new(0));
    }
}
