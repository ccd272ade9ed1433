//! The board's clock beside this machine's: their distance, how sure it is, and how fast they drift apart.
//!
//! The board answers [`Request::Time`] with its own time. The answer was made between the request and its arrival here.
//! So if the middle is taken, the error is at most half of that time. The shortest of the last minute's is used.
//!
//! On a serial line of 115,200 bits per second, the request has 16 bytes and the answer up to 22. So the middle is
//! early by at most 0.3 ms, which the half contains.

use std::collections::VecDeque;
use std::time::{Duration, SystemTime};

use wstac_core::wire::Request;

pub use crate::frame_clock::ClockMatch;
use crate::frame_clock::Stamp;

/// The time between two requests while the board answers.
const EVERY: Duration = Duration::from_secs(1);
/// The answers that are kept.
const KEPT: usize = 60;
/// The most that two clocks of crystals drift apart: 100 ppm each.
const MOST_DRIFT: f64 = 200e-6;
/// The most that a clock drifts that is not a crystal's, before it is known how fast it runs.
const MOST_UNKNOWN_DRIFT: f64 = 0.02;
/// The time between two answers that tells a drift.
const DRIFT_AFTER: Duration = Duration::from_secs(10);

/// An answer of the board. All times are microseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClockAnswer {
    /// The middle between request and answer, by this machine.
    at: f64,
    /// This machine's time less the board's.
    offset: f64,
    /// Half of the time from request to answer.
    half: f64,
}

/// Matches the clock of a board with this machine's.
#[derive(Clone, Debug, Default)]
pub(super) struct BoardClock {
    /// This machine's time since some start, and its wall clock then.
    pub(super) now: Option<(Duration, SystemTime)>,
    asked: Option<Duration>,
    pub(super) answers: VecDeque<ClockAnswer>,
}

impl BoardClock {
    /// Takes this machine's time. Returns a request for the board's if one is due.
    pub(super) fn set_now(&mut self, now: Duration, wall: SystemTime) -> Option<Request> {
        self.now = Some((now, wall));
        let is_due = self.asked.is_none_or(|asked| now.saturating_sub(asked) >= EVERY);
        if is_due {
            self.asked = Some(now);
        }
        is_due.then_some(Request::Time { host_us: us(now) as u64 })
    }

    /// Takes an answer: the time of the request, and the board's time.
    pub(super) fn answered(&mut self, host_us: u64, board_us: u64) {
        let Some((now, _)) = self.now else { return };
        let (asked, arrived) = (host_us as f64, us(now));
        // An answer to a request of an earlier run, or to none.
        if asked > arrived || arrived - asked > us(EVERY * KEPT as u32) {
            return;
        }
        let at = f64::midpoint(asked, arrived);
        self.answers.truncate(KEPT - 1);
        self.answers.push_front(ClockAnswer { at, offset: at - board_us as f64, half: (arrived - asked) / 2.0 });
    }

    /// Returns the answer that is surest now, and how sure it is in microseconds.
    fn best(&self) -> Option<(ClockAnswer, f64)> {
        let now = us(self.now?.0);
        // A board whose crystal is missing runs on a clock of its own.
        let drift = self.fast_ppm().map_or(MOST_UNKNOWN_DRIFT, |ppm| MOST_DRIFT.max(2.0 * ppm.abs() / 1e6));
        let sure = |answer: &ClockAnswer| answer.half + (now - answer.at) * drift;
        let best = self.answers.iter().min_by(|a, b| sure(a).total_cmp(&sure(b)))?;
        Some((*best, sure(best)))
    }

    /// Returns the match of the clocks; `None` before the board has answered.
    pub(super) fn matched(&self) -> Option<ClockMatch> {
        let (answer, within_us) = self.best()?;
        Some(ClockMatch { within_ms: within_us / 1000.0, offset_s: answer.offset / 1e6, fast_ppm: self.fast_ppm() })
    }

    /// Compares the shortest answer of the oldest third with that of the newest one.
    fn fast_ppm(&self) -> Option<f64> {
        let shortest =
            |from: usize, to: usize| self.answers.range(from..to).min_by(|a, b| a.half.total_cmp(&b.half)).copied();
        let (all, third) = (self.answers.len(), self.answers.len() / 3);
        let (new, old) = (shortest(0, third)?, shortest(all - third, all)?);
        let apart = new.at - old.at;
        (apart >= us(DRIFT_AFTER)).then(|| (old.offset - new.offset) / apart * 1e6)
    }

    /// Returns a time of the board on this machine's monotonic clock and on its wall clock; `None` before the board has
    /// answered.
    pub(super) fn of_board(&self, board_us: u64) -> Option<(Duration, Stamp)> {
        let ((now, wall), (answer, within_us)) = (self.now?, self.best()?);
        let ago = us(now) - (board_us as f64 + answer.offset);
        let distance = Duration::try_from_secs_f64(ago.abs() / 1e6).ok()?;
        let within = Duration::try_from_secs_f64(within_us / 1e6).ok()?;
        let (monotonic, time) = if ago < 0.0 {
            (now.checked_add(distance)?, wall.checked_add(distance)?)
        } else {
            (now.checked_sub(distance)?, wall.checked_sub(distance)?)
        };
        Some((monotonic, Stamp { time, within }))
    }
}

fn us(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Asks for `seconds`, on a line that delays requests and answers, of a board that started 5 s earlier and runs
    /// fast by this many millionths. Returns the clock.
    fn after(seconds: u32, fast_ppm: f64, mut delays_us: impl FnMut(u32) -> [f64; 2]) -> (BoardClock, SystemTime) {
        let start = SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000);
        let mut clock = BoardClock::default();
        let at = |us: f64| Duration::from_secs_f64(us / 1e6);
        for second in 0..seconds {
            let asked = f64::from(second) * 1e6 + 1000.0;
            let Some(Request::Time { host_us }) = clock.set_now(at(asked), start + at(asked)) else { panic!("due") };
            let [there, back] = delays_us(second);
            let board = board_us(asked + there, fast_ppm);
            assert_eq!(
                clock.set_now(at(asked + there + back), start + at(asked + there + back)),
                None,
                "asked already"
            );
            clock.answered(host_us, board as u64);
        }
        (clock, start)
    }

    fn board_us(host_us: f64, fast_ppm: f64) -> f64 {
        (host_us + 5e6) * (1.0 + fast_ppm / 1e6)
    }

    #[test]
    fn clocks_match_within_a_millisecond_on_a_serial_line() {
        // 16 bytes there and 22 back at 115,200 bits a second, and up to 3 ms of other messages.
        let mut seed = 1_u32;
        let mut wait = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 16) / 65_536.0 * 3000.0
        };
        for fast_ppm in [-120.0, 0.0, 120.0, 10_000.0] {
            let (clock, start) = after(40, fast_ppm, |second| {
                let other = if second % 3 == 0 { 0.0 } else { wait() };
                [16.0 * 86.8, 22.0 * 86.8 + other]
            });
            let found = clock.matched().unwrap();
            let now_us = 39e6 + 5000.0;
            let (monotonic, shown) = clock.of_board(board_us(now_us, fast_ppm) as u64).unwrap();
            assert_eq!(start + monotonic, shown.time);
            assert!((shown.within.as_secs_f64() * 1000.0 - found.within_ms).abs() < 1e-3, "{found:?} {shown:?}");
            // The board started 5 s before.
            assert!((found.offset_s + 5.0).abs() < 0.001 + fast_ppm.abs() * 50e-6, "{found:?}");
            let wrong = shown.time.duration_since(start).unwrap().as_secs_f64() * 1e6 - now_us;
            assert!(wrong.abs() < 1000.0, "wrong by {wrong} us");
            assert!(wrong.abs() <= found.within_ms * 1000.0, "{found:?}, wrong by {wrong} us");
            let drift = found.fast_ppm.unwrap();
            assert!((drift - fast_ppm).abs() < 20.0, "{drift} for {fast_ppm}");
        }
    }

    #[test]
    fn a_slow_answer_counts_less_than_an_older_fast_one() {
        let (clock, _) = after(3, 0.0, |second| if second == 1 { [100.0, 100.0] } else { [100.0, 90_000.0] });
        let found = clock.matched().unwrap();
        // Before the drift is known, a second may make 20 ms.
        assert!((10.0..30.0).contains(&found.within_ms), "{found:?}");
        assert_eq!(found.fast_ppm, None);
    }

    #[test]
    fn without_answers_or_with_foreign_ones_nothing_is_known() {
        let mut clock = BoardClock::default();
        clock.answered(0, 0);
        assert!(clock.matched().is_none() && clock.of_board(0).is_none());
        let _ = clock.set_now(Duration::from_secs(1), SystemTime::UNIX_EPOCH);
        clock.answered(2_000_000, 5);
        clock.answered(u64::MAX, u64::MAX);
        assert!(clock.matched().is_none() && clock.of_board(0).is_none());
        clock.answered(900_000, 5);
        assert!(
            clock.matched().is_some() && clock.of_board(u64::MAX).is_some_and(|(_, far)| far.time > SystemTime::now())
        );
        clock.answers.clear();
        assert!(clock.matched().is_none());
    }
}
