//! Counts the frames that were lost between two that arrived, by the driver's sequence numbers and timestamps alone.
//!
//! The sequence number says how many frames the driver knows of. Timestamps find those that it does not count, and the
//! slower rate of a camera that lengthens its exposure in the dark. The larger count is used:
//!
//! - Timestamps are compared with a grid of nominal periods, not with the frame before, so that jitter neither adds up
//!   nor counts. Frames are lost if a frame is `LATE` periods behind the grid, or more while the grid rests on few
//!   frames. The grid follows slowly: a camera whose own clock is up to 1 % off loses nothing.
//! - If a frame that was merely late was counted as lost, the next frames are early. A later gap is then counted less,
//!   by the sequence number, too. The count keeps to the time that passed.
//! - A jump of the sequence number or of the timestamp by more than `LONGEST_GAP` (10 s) is a wrap or a reset unless
//!   the other agrees. A wrap or a reset counts as one step. So does a sequence number that stays, or a timestamp that
//!   goes back. A sequence number that wraps from 2^32 − 1 to 0 is no jump.

use std::time::Duration;

use wstac_core::rate::FrameRate;

/// Periods behind the grid from which frames are missing. It is more than jitter of ±0.6 reaches, and less than one.
const LATE: f64 = 0.75;
/// The addition to `LATE` for the second frame. It falls with the square root of the frames that the grid rests on.
const UNCERTAINTY: f64 = 0.5;
/// Most frames that the grid rests on: a 64th of a deviation moves it.
const MEMORY: f64 = 64.0;
/// Periods ahead of the grid from which it starts again.
const EARLY: f64 = -1.5;
/// Periods too early from which a time is not believed. A camera of twice its rate is none: its rate is watched.
const SOON: f64 = -0.6;
/// The longest gap. It is longer than a source waits for a frame before it starts the stream again.
const LONGEST_GAP: Duration = Duration::from_secs(10);
/// The largest difference between the driver's time across a break and the time between the arrivals.
const UNSURE: Duration = Duration::from_secs(2);

#[derive(Clone, Debug)]
pub(crate) struct Timeline {
    /// Frames per second.
    rate: f64,
    last: Option<(u32, Option<Duration>)>,
    /// Periods that the last frame was behind the grid.
    late: f64,
    /// Frames that the grid rests on.
    frames: f64,
    /// Frames that were reported as lost since the last one.
    reported: u64,
    /// Frames that count as lost by their time alone. Those whose buffers were merely stamped late turn up later.
    guessed: f64,
}

impl Timeline {
    pub(crate) fn new(rate: FrameRate) -> Self {
        let rate = rate.per_second();
        Self { rate, last: None, late: 0.0, frames: 1.0, reported: 0, guessed: 0.0 }
    }

    /// Notes a lost frame for which there is no buffer. The gap before the next buffer includes it.
    pub(crate) fn report_lost(&mut self) {
        self.reported += u64::from(self.last.is_some());
    }

    /// Notes a buffer, good or not, and returns how many frames were lost before it, besides those already reported.
    ///
    /// `timestamp` is of the monotonic clock, and `None` if the driver has none. Nothing is lost before the first
    /// buffer.
    pub(crate) fn arrive(&mut self, sequence: u32, timestamp: Option<Duration>) -> u64 {
        let Some((last_sequence, last_timestamp)) = self.last.replace((sequence, timestamp)) else { return 0 };
        let reported = std::mem::take(&mut self.reported);
        let counted = f64::from(sequence.wrapping_sub(last_sequence));
        let elapsed = self.periods(timestamp, last_timestamp);
        let agree = elapsed.is_some_and(|elapsed| (elapsed - counted).abs() <= 2.0 + 0.1 * counted);
        let longest = self.longest_gap();
        let steps = if counted >= 1.0 && (counted <= longest || agree) { counted } else { 1.0 };
        let steps = steps.max(1.0 + reported as f64);
        let timed = elapsed.filter(|elapsed| *elapsed <= longest || agree);
        let steps = if let Some(elapsed) = timed {
            self.follow(steps, elapsed)
        } else {
            self.restart_grid();
            steps
        };
        (steps as u64).saturating_sub(1 + reported)
    }

    /// Returns whether a buffer's time follows that of the last one, if those that were reported are between: it
    /// neither stays, creeps, goes back nor jumps. Nothing is before the first buffer.
    pub(crate) fn is_followed_by(&self, timestamp: Option<Duration>) -> bool {
        let late = |elapsed| elapsed - (1 + self.reported) as f64;
        let follows = |elapsed| (SOON..=self.longest_gap()).contains(&late(elapsed));
        self.last.is_none_or(|(_, before)| self.periods(timestamp, before).is_some_and(follows))
    }

    /// Returns the time between two buffers in periods, below 0 if time went back.
    fn periods(&self, now: Option<Duration>, before: Option<Duration>) -> Option<f64> {
        let (now, before) = now.zip(before)?;
        let ahead = now.saturating_sub(before).as_secs_f64();
        Some((ahead - before.saturating_sub(now).as_secs_f64()) * self.rate)
    }

    fn longest_gap(&self) -> f64 {
        (LONGEST_GAP.as_secs_f64() * self.rate).max(2.0)
    }

    /// Notes the first buffer after the stream broke off and started again.
    ///
    /// It returns how many frames would have come meanwhile, besides those already reported. The driver's timestamps
    /// before and after give the number. If there are none, or they cannot be right, the time between both buffers'
    /// arrivals gives it. Sequence numbers start again. Nothing is lost before the first buffer.
    pub(crate) fn resume(&mut self, sequence: u32, timestamp: Option<Duration>, between: Duration) -> u64 {
        let reported = std::mem::take(&mut self.reported);
        self.restart_grid();
        let Some((_, before)) = self.last.replace((sequence, timestamp)) else { return 0 };
        let told = timestamp.zip(before).and_then(|(now, before)| now.checked_sub(before));
        // Buffers may have waited before they arrived, and a rest of some periods is usual.
        let unsure = UNSURE + Duration::try_from_secs_f64(10.0 / self.rate).unwrap_or(Duration::MAX).min(LONGEST_GAP);
        let passed = told.filter(|told| told.abs_diff(between) <= unsure).unwrap_or(between);
        ((passed.as_secs_f64() * self.rate).round() as u64).saturating_sub(1 + reported)
    }

    /// Returns the steps of the grid that `elapsed` periods took, at least `steps`.
    fn follow(&mut self, steps: f64, elapsed: f64) -> f64 {
        // The sequence number counts frames that time has counted already. They are not counted twice.
        let again = (steps - elapsed - self.late + 1.0 - LATE).floor().min(self.guessed).min(steps - 1.0).max(0.0);
        let steps = steps - again;
        self.guessed -= again;
        let late = self.late + elapsed - steps;
        let missing = if late >= LATE + UNCERTAINTY / self.frames.sqrt() { late.round().max(1.0) } else { 0.0 };
        self.guessed += missing;
        let late = late - missing;
        if late < EARLY {
            // Time went back, or the sequence number counts more than time allows. This frame's time is the new start.
            self.restart_grid();
        } else {
            self.frames = (self.frames + 1.0).min(MEMORY);
            self.late = late - late / self.frames;
        }
        steps + missing
    }

    fn restart_grid(&mut self) {
        self.late = 0.0;
        self.frames = 1.0;
        self.guessed = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLISECONDS: f64 = 1e-3;

    fn timeline() -> Timeline {
        Timeline::new(FrameRate::NOMINAL)
    }

    /// Returns the time `periods` of 1/30 s after an arbitrary start.
    fn at(periods: f64) -> Duration {
        Duration::from_secs_f64(1234.5 + periods / 30.0)
    }

    /// Returns what each of these (sequence, periods) lost before it.
    fn lost(timeline: &mut Timeline, frames: impl IntoIterator<Item = (u32, f64)>) -> Vec<u64> {
        frames.into_iter().map(|(sequence, periods)| timeline.arrive(sequence, Some(at(periods)))).collect()
    }

    /// Returns a repeatable random number, uniform in −1..1.
    fn noise(random: &mut fastrand::Rng) -> f64 {
        2.0 * random.f64() - 1.0
    }

    #[test]
    fn a_single_loss_is_counted_where_it_is() {
        for missing in [1, 2, 10, 500] {
            let frames = (0..600).filter(|t| *t != missing);
            let losses = lost(&mut timeline(), frames.clone().map(|t| (t, f64::from(t))));
            let expected: Vec<u64> = frames.map(|t| u64::from(t == missing + 1)).collect();
            assert_eq!(losses, expected, "frame {missing}");
        }
    }

    #[test]
    fn drops_that_the_sequence_does_not_count_are_seen_by_time() {
        let frames = (0..600).filter(|t| ![50, 200, 201, 400].contains(t));
        let losses = lost(&mut timeline(), frames.zip(0..).map(|(t, sequence)| (sequence, f64::from(t))));
        assert_eq!((losses[50], losses[199], losses[397]), (1, 2, 1));
        assert_eq!(losses.iter().sum::<u64>(), 4);
    }

    #[test]
    fn jitter_of_six_tenths_neither_invents_nor_swallows() {
        for seed in 0..200 {
            let mut random = fastrand::Rng::with_seed(seed);
            let quiet: Vec<_> = (0..2000).map(|t| (t, f64::from(t) + 0.6 * noise(&mut random))).collect();
            assert_eq!(lost(&mut timeline(), quiet.clone()).iter().sum::<u64>(), 0, "seed {seed}");
            // The sequence number counts a drop in spite of jitter.
            let losses = lost(&mut timeline(), quiet.iter().copied().filter(|(t, _)| t % 100 != 50));
            assert_eq!(losses.iter().sum::<u64>(), 20, "seed {seed}");
        }
    }

    #[test]
    fn drops_that_only_time_shows_are_counted_under_jitter_as_well() {
        for seed in 0..200 {
            let mut random = fastrand::Rng::with_seed(seed);
            let frames = (0..2000_u32).filter(|t| t % 200 != 100).zip(0..);
            let jittery = frames.map(|(t, sequence)| (sequence, f64::from(t) + 0.2 * noise(&mut random)));
            assert_eq!(lost(&mut timeline(), jittery).iter().sum::<u64>(), 10, "seed {seed}");
        }
    }

    #[test]
    fn one_frame_counted_too_many_is_made_up_for() {
        // A frame that is 1.2 periods late looks like a loss. The total is right again after a real loss.
        let late = |t: u32| f64::from(t) + if t == 100 { 1.2 } else { 0.0 };
        let frames = (0..200).filter(|t| *t != 105).zip(0..);
        assert_eq!(lost(&mut timeline(), frames.map(|(t, sequence)| (sequence, late(t)))).iter().sum::<u64>(), 1);
    }

    #[test]
    fn what_time_and_then_the_sequence_number_count_is_counted_once() {
        // A busy machine stamps a buffer almost four periods late. The next sequence number counts them all.
        let frames = [(0, 0.0), (1, 1.0), (2, 2.0), (3, 6.7), (14, 14.0), (15, 15.0), (16, 16.0)];
        let losses = lost(&mut timeline(), frames);
        assert_eq!(losses.iter().sum::<u64>(), 16 - 6, "{losses:?}");
        // Frames that only time shows stay lost.
        let frames = [(0, 0.0), (1, 1.0), (2, 6.0), (3, 7.0), (6, 10.0), (7, 11.0)];
        assert_eq!(lost(&mut timeline(), frames), [0, 0, 4, 0, 2, 0]);
    }

    #[test]
    fn a_camera_that_slows_down_leaves_gaps() {
        // The rate is 30 frames per second, then 7.5, then 20.
        let mut time = 0.0;
        let frames = (0..300).map(|t| {
            time += [1.0, 4.0, 1.5][t as usize / 100];
            (t, time)
        });
        let losses = lost(&mut timeline(), frames);
        assert!(losses[..100].iter().all(|lost| *lost == 0));
        assert!(losses[100..200].iter().all(|lost| *lost == 3));
        let slower: u64 = losses[200..].iter().sum();
        assert!((48..=52).contains(&slower), "{slower} lost of 150");
    }

    #[test]
    fn a_clock_that_is_one_percent_off_loses_nothing() {
        assert_eq!(timeline().resume(7, Some(at(0.0)), Duration::from_secs(100)), 0, "before the first frame");
        for period in [0.99, 1.0, 1.01] {
            let losses = lost(&mut timeline(), (0..20_000).map(|t| (t, f64::from(t) * period)));
            assert_eq!(losses.iter().sum::<u64>(), 0, "period {period}");
        }
    }

    #[test]
    fn the_sequence_number_wraps() {
        let first = u32::MAX - 2;
        let frames = [0, 1, 2, 3, 5].map(|t: u32| (first.wrapping_add(t), f64::from(t)));
        assert_eq!(lost(&mut timeline(), frames), [0, 0, 0, 0, 1]);
    }

    #[test]
    fn a_reset_of_the_sequence_number_is_one_step() {
        assert_eq!(lost(&mut timeline(), (0..50).map(|t| (0, f64::from(t)))), [0; 50], "one that stays");
        for to in [0, 5, 0x8000_0000] {
            let frames = [(98, 0.0), (99, 1.0), (to, 2.0), (to + 1, 3.0)];
            assert_eq!(lost(&mut timeline(), frames), [0; 4], "to {to}");
        }
        // Time still shows what was lost meanwhile.
        assert_eq!(lost(&mut timeline(), [(98, 0.0), (99, 1.0), (0, 6.0), (1, 7.0)]), [0, 0, 4, 0]);
    }

    #[test]
    fn a_timestamp_that_jumps_counts_nothing() {
        for jump in [-1e4, -1.0, 1e4, 1e9] {
            let time = |t: u32| f64::from(t) + if t >= 20 { jump } else { 0.0 };
            let mut timeline = timeline();
            for t in 0..40_u32 {
                let timestamp = Duration::try_from_secs_f64(1e6 + time(t) / 30.0).ok();
                assert_eq!(timeline.arrive(t, timestamp), 0, "jump {jump}, frame {t}");
            }
        }
    }

    #[test]
    fn without_timestamps_the_sequence_number_decides() {
        let mut timeline = timeline();
        assert_eq!([0, 1, 4, 5, 0, 1].map(|sequence| timeline.arrive(sequence, None)), [0, 0, 2, 0, 0, 0]);
    }

    #[test]
    fn a_long_gap_counts_if_both_agree() {
        let gap = 3_000_u32;
        let frames = [(0, 0.0), (1, 1.0), (1 + gap, 1.0 + f64::from(gap)), (2 + gap, 2.0 + f64::from(gap))];
        assert_eq!(lost(&mut timeline(), frames), [0, 0, u64::from(gap) - 1, 0]);
    }

    #[test]
    fn what_was_reported_is_not_counted_again() {
        // Two frames were reported. The sequence number counts three, or none of them.
        for (sequence, periods, more) in [(5, 5.0, 1), (2, 4.0, 0), (2, 2.0, 0)] {
            let mut timeline = timeline();
            assert_eq!(lost(&mut timeline, [(0, 0.0), (1, 1.0)]), [0, 0]);
            timeline.report_lost();
            timeline.report_lost();
            assert_eq!(timeline.arrive(sequence, Some(at(periods))), more);
        }
    }

    #[test]
    fn a_break_counts_the_time_that_passed() {
        // The driver's clock says three seconds. The arrivals were a little apart from that.
        for (after, between, lost_frames) in [
            (Some(at(99.0)), Duration::from_secs(3), 89),
            (Some(at(99.0)), Duration::from_secs(4), 89),
            // There is no time, one that went back, or one of another clock: the arrivals count.
            (None, Duration::from_secs(3), 89),
            (Some(at(-5.0)), Duration::from_secs(3), 89),
            (Some(at(1e9)), Duration::from_secs(3), 89),
            // No loss is invented if no time passed.
            (Some(at(10.0)), Duration::from_millis(30), 0),
            (Some(at(9.0)), Duration::ZERO, 0),
        ] {
            let mut timeline = timeline();
            lost(&mut timeline, (0..10).map(|t| (t, f64::from(t))));
            assert_eq!(timeline.resume(0, after, between), lost_frames, "{after:?} {between:?}");
            // The grid starts again there.
            let next = after.map(|after| after + Duration::from_secs_f64(1.0 / 30.0));
            assert_eq!(timeline.arrive(1, next), 0);
        }
    }

    #[test]
    fn what_was_reported_before_a_break_is_not_counted_again() {
        let mut timeline = timeline();
        lost(&mut timeline, [(0, 0.0), (1, 1.0)]);
        (0..10).for_each(|_| timeline.report_lost());
        assert_eq!(timeline.resume(0, Some(at(31.0)), Duration::from_secs(1)), 19);
    }

    #[test]
    fn fast_and_very_slow_cameras_keep_time() {
        for rate in [(1000, 1), (1, 60)] {
            let rate = FrameRate::new(rate.0, rate.1).unwrap();
            let period = f64::from(rate.denominator()) / f64::from(rate.numerator());
            let mut timeline = Timeline::new(rate);
            for t in 0..200_u32 {
                let timestamp = Duration::from_secs_f64(f64::from(t) * period + 0.1 * MILLISECONDS);
                assert_eq!(timeline.arrive(t, Some(timestamp)), 0);
            }
        }
    }
}
