//! The end of a recovery: frames that are missing behind the last sound moment, and whether all are accounted for.

use std::collections::BTreeMap;

use super::Recovery;
use crate::error::Error;
use crate::record::sums::{Stated, Tally};

impl Recovery<'_> {
    /// Enters frames that are missing at the end, and checks that all are accounted for.
    pub(super) fn settle(&mut self, stated: &Stated) -> Result<(), Error> {
        if let Some(end) = &stated.end {
            return self.settle_by(end);
        }
        let is_unread = self.found.unread.is_some_and(|unread| unread.damaged);
        if self.about.is_none() {
            if self.is_suspect || is_unread {
                self.doubt("is damaged");
            }
            return Ok(());
        }
        let recorded = self.walk.summary.as_ref().and_then(|summary| summary.messages.clone());
        if self.has_sums && self.found.whole && !stated.is_ended && (recorded.is_none() || !is_unread) {
            self.doubt("was finished, and lacks the record of how many frames it had");
        }
        let Some(recorded) = recorded else {
            let is_any = self.found.damaged > 0 || self.found.unread.is_some();
            if self.is_suspect || (self.found.whole && is_any) {
                self.doubt("is damaged, and nothing says how many frames it had");
            }
            return self.settle_unfinished();
        };
        let mut frames = BTreeMap::<u8, u64>::new();
        for (channel, count) in recorded {
            if let Some((sensor, topic)) = self.own(channel)
                && topic.is_frame()
            {
                let of_sensor = frames.entry(sensor).or_default();
                *of_sensor = of_sensor.saturating_add(count);
            }
        }
        for sensor in self.own.sensors.places() {
            let (there, recorded) = (self.out.tally.of(sensor).frames, frames.get(&sensor).copied().unwrap_or(0));
            if there > recorded {
                self.doubt(format!("has {there} frames, expected {recorded}"));
            }
            // Lost frames that were entered may be among those that the recording had lost itself.
            let entered = self.entered.get(&sensor).copied().unwrap_or(0);
            self.enter_lost(sensor, recorded.saturating_sub(there).saturating_sub(entered), None)?;
        }
        Ok(())
    }

    /// Enters what is missing of a recording whose end says how many frames it had.
    fn settle_by(&mut self, end: &Tally) -> Result<(), Error> {
        let Some(end) = end.told_apart(self.own.sensors.count()) else {
            return self.lost_of_any(end.all.all());
        };
        for sensor in self.own.sensors.places() {
            let (found, recorded) = (self.out.tally.of(sensor).all(), end.of(sensor).all());
            if found > recorded {
                self.doubt(format!("has {found} frames, expected {recorded}"));
            } else if found < recorded && !self.has_sums {
                self.doubt(format!("has {found} frames, expected {recorded}, and nothing says where they are missing"));
            }
            self.enter_lost(sensor, recorded.saturating_sub(found), None)?;
        }
        Ok(())
    }

    /// Enters what is missing of a recording that nothing counts: that was never finished, or lost its end.
    fn settle_unfinished(&mut self) -> Result<(), Error> {
        let suspects = self.suspects;
        if self.own.sensors.count() == 1 {
            return self.enter_lost(0, suspects, None);
        }
        if let Some(known) = self.known.take() {
            for sensor in self.own.sensors.places() {
                let missing = known.of(sensor).all().saturating_sub(self.out.tally.of(sensor).all());
                self.enter_lost(sensor, missing, None)?;
            }
        }
        // If everything behind a damaged place was left out, some frames are missing, however many.
        let missing = suspects.max(self.is_over.into());
        self.lost_of_any(self.out.tally.all.all().saturating_add(missing))
    }

    /// Enters frames that are missing at the end, if nothing says of which sensor: for each of them as many as are
    /// missing of all, so that no answer spans the place.
    fn lost_of_any(&mut self, recorded: u64) -> Result<(), Error> {
        let found = self.out.tally.all.all();
        if found > recorded {
            self.doubt(format!("has {found} frames, expected {recorded}"));
        }
        let missing = recorded.saturating_sub(found);
        if missing > 0 {
            self.doubt("misses frames, and nothing says of which sensor: what is behind them is left out");
        }
        for sensor in self.own.sensors.places() {
            self.enter_lost(sensor, missing, None)?;
        }
        Ok(())
    }
}
