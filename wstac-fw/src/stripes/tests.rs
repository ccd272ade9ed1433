//! Simulates a sensor and a capture interface: frames of four stripes, forty ticks apart.

use std::cell::RefCell;
use std::format;
use std::mem;
use std::rc::Rc;
use std::string::String;

use super::{Capture, Fault, StripeStep, Stripes, Ticks, Trouble};

/// The ticks from frame to frame. A stripe is complete 7, 14, 21 and 28 ticks after its frame began.
const PERIOD: Ticks = 40;
const STRIPE: Ticks = 7;
const STRIPES: u32 = 4;
/// The tick of a frame until which lines come.
const LAST_LINE: Ticks = 30;

/// The kind of a frame.
#[derive(Clone, Copy, PartialEq)]
enum Frame {
    Good,
    /// The frame has lines, but no vertical sync.
    NoSync,
    /// The frame is missing.
    Nothing,
    /// The frame has another vertical sync after two stripes, and nothing after it.
    Cut,
    /// The interface overruns in its third stripe.
    Overrun,
    /// The frame stops after two stripes.
    Stops,
    /// No code takes rows from its second stripe on, until the frame is over.
    Busy,
    /// Processing the frame takes until the next one's first stripe is complete, and two ticks longer.
    LongWork,
    /// Processing the frame takes until the next one's last stripe is complete, and two ticks longer.
    Event,
    /// Reading its last stripe takes as long.
    SlowEnd,
}

use Frame::{Busy, Cut, Event, Good, LongWork, NoSync, Nothing, Overrun, SlowEnd, Stops};

/// The state that both sides see.
struct World {
    now: Ticks,
    frames: &'static [Frame],
    complete: u32,
    trouble: Option<Trouble>,
    lines: bool,
    /// Whether the interface captures, since a vertical sync.
    in_frame: bool,
    /// The contents of the ring's halves: ten times the frame's number and the stripe's.
    ring: [u8; 2],
}

impl World {
    fn frame(&self) -> Frame {
        self.frames[(self.now / PERIOD) as usize]
    }

    /// Simulates one tick of the sensor and the interface.
    fn tick(&mut self) {
        let (frame, at) = (self.frame(), self.now % PERIOD);
        let cut = matches!(frame, Cut) && at > 2 * STRIPE;
        let sends = match frame {
            Nothing => false,
            Cut | Stops => at <= 2 * STRIPE,
            _ => true,
        };
        if (at == 0 && !matches!(frame, NoSync | Nothing)) || (cut && at == 2 * STRIPE + 1) {
            if self.in_frame && !self.complete.is_multiple_of(STRIPES) {
                self.trouble = Some(Trouble::MisplacedSync);
            }
            self.in_frame = true;
        }
        self.lines |= sends && at < LAST_LINE;
        let stripe = at / STRIPE;
        if self.in_frame && sends && at.is_multiple_of(STRIPE) && (1..=Ticks::from(STRIPES)).contains(&stripe) {
            if frame == Overrun && stripe == 3 {
                self.trouble = Some(Trouble::Overrun);
            }
            self.ring[self.complete as usize % 2] = (self.now / PERIOD * 10 + stripe - 1) as u8;
            self.complete += 1;
            // Nothing is captured beyond the frame until the next sync.
            self.in_frame &= stripe < Ticks::from(STRIPES);
        }
        self.now += 1;
    }

    /// Returns whether the core has other things to do.
    fn is_busy(&self) -> bool {
        let at = self.now % PERIOD;
        let before = (self.now / PERIOD).checked_sub(1).map(|frame| self.frames[frame as usize]);
        (self.frame() == Busy && (2 * STRIPE..30).contains(&at))
            || (matches!(before, Some(LongWork | SlowEnd)) && at <= STRIPE + 2)
            || (before == Some(Event) && at <= 4 * STRIPE + 2)
            || (matches!(self.frame(), LongWork | SlowEnd | Event) && at > 4 * STRIPE + 1)
    }
}

#[derive(Clone)]
struct Interface(Rc<RefCell<World>>);

/// All bytes, for rows of one byte that name themselves.
static BYTES: [u8; 256] = {
    let mut bytes = [0; 256];
    let mut k = 0;
    while k < 256 {
        bytes[k] = k as u8;
        k += 1;
    }
    bytes
};

impl Capture for Interface {
    fn restart(&mut self) {
        let mut world = self.0.borrow_mut();
        (world.complete, world.trouble, world.lines, world.in_frame) = (0, None, false, false);
    }
    fn complete(&self) -> u32 {
        self.0.borrow().complete
    }
    fn trouble(&self) -> Option<Trouble> {
        self.0.borrow().trouble
    }
    fn lines_come(&self) -> bool {
        self.0.borrow().lines
    }
    fn rows(&self, half: usize) -> &[u8] {
        let name = usize::from(self.0.borrow().ring[half]);
        &BYTES[name..=name]
    }
    fn now(&self) -> Ticks {
        self.0.borrow().now
    }
}

/// Runs the frames. Returns what came of them: rows as `frame:stripe`, faults with the frame times since the last rows.
fn run(frames: &'static [Frame]) -> String {
    run_with(frames, false)
}

/// Runs the frames. Whether an interrupt takes rows while a frame is processed is `takes_early`: they are written as
/// `~stripe`.
fn run_with(frames: &'static [Frame], takes_early: bool) -> String {
    let world = World { now: 0, frames, complete: 0, trouble: None, lines: false, in_frame: false, ring: [0; 2] };
    let world = Rc::new(RefCell::new(world));
    let mut stripes = Stripes::new(Interface(world.clone()), STRIPES, PERIOD);
    let mut log = String::new();
    let (mut last, mut silent, mut reading) = (0, false, false);
    while world.borrow().now + 1 < PERIOD * frames.len() as Ticks {
        world.borrow_mut().tick();
        let (now, busy) = (world.borrow().now, world.borrow().is_busy());
        if busy {
            while takes_early && let Some(rows) = stripes.early_rows() {
                last = now;
                let (frame, stripe) = (rows[0] / 10, rows[0] % 10);
                log += &if stripe == 0 { format!("{frame}:~0 ") } else { format!("~{stripe} ") };
                assert!(stripes.release(), "nothing was written since");
            }
            continue;
        }
        if mem::take(&mut reading) {
            assert!(!stripes.release(), "written over");
        }
        loop {
            let entry = match stripes.step() {
                StripeStep::Wait(until) => {
                    assert!(until > now, "waiting for the past");
                    break;
                }
                StripeStep::Rows { rows, last: ends } => {
                    (last, silent) = (now, false);
                    let (frame, stripe) = (rows[0] / 10, rows[0] % 10);
                    assert_eq!(ends, u32::from(stripe) == STRIPES - 1, "stripe {stripe}");
                    reading = world.borrow().frame() == SlowEnd && ends;
                    if !reading {
                        assert!(stripes.release(), "nothing was written since");
                    }
                    if stripe == 0 { format!("{frame}:0") } else { format!("{stripe}") }
                }
                StripeStep::Lost(frames) => format!("lost {frames}"),
                StripeStep::Abandoned => "abandoned".into(),
                StripeStep::Fault(fault) => {
                    // A frame that begins in time has rows STRIPE ticks later, so faults are reported within two frame
                    // times. Silence is reported again for as long as it lasts.
                    let again = fault == Fault::Silent && mem::replace(&mut silent, true);
                    assert!(now - last <= 2 * PERIOD || again, "{fault:?} after {} ticks", now - last);
                    format!("{fault:?}")
                }
            };
            log += &entry;
            log.push(' ');
            if reading {
                break;
            }
        }
    }
    log.trim_end().into()
}

#[test]
fn good_frames_come_whole() {
    assert_eq!(run(&[Good, Good, Good]), "0:0 1 2 3 1:0 1 2 3 2:0 1 2 3");
}

#[test]
fn a_lost_sync_costs_the_frame_without_it() {
    assert_eq!(run(&[Good, NoSync, Good, Good]), "0:0 1 2 3 LostSync lost 1 2:0 1 2 3 3:0 1 2 3");
    assert_eq!(run(&[Good, NoSync, NoSync, Good]), "0:0 1 2 3 LostSync lost 2 3:0 1 2 3");
}

#[test]
fn a_sync_inside_a_frame_is_not_taken_for_rows() {
    // Abandoning counts the cut frame. The time tells that none is missing before the next one.
    assert_eq!(run(&[Good, Cut, Good, Good]), "0:0 1 2 3 1:0 1 LostSync abandoned 2:0 1 2 3 3:0 1 2 3");
}

#[test]
fn an_overrun_costs_the_frame_that_it_is_in() {
    assert_eq!(run(&[Good, Overrun, Good]), "0:0 1 2 3 1:0 1 Overrun abandoned 2:0 1 2 3");
    assert_eq!(run(&[Overrun, Overrun, Good]), "0:0 1 Overrun abandoned 1:0 1 Overrun abandoned 2:0 1 2 3");
}

#[test]
fn rows_that_the_core_comes_too_late_for_are_not_summed() {
    assert_eq!(run(&[Good, Busy, Good]), "0:0 1 2 3 1:0 Overrun abandoned 2:0 1 2 3");
}

#[test]
fn what_is_made_of_a_frame_may_take_until_the_next_ones_first_stripe() {
    assert_eq!(run(&[Good, LongWork, Good, Good]), "0:0 1 2 3 1:0 1 2 3 2:0 1 2 3 3:0 1 2 3");
}

#[test]
fn an_interrupt_takes_rows_while_an_event_is_computed() {
    let lost = "0:0 1 2 3 Overrun lost 1 2:0 1 2 3 3:0 1 2 3";
    assert_eq!(run(&[Event, Good, Good, Good]), lost);
    let whole = "0:0 1 2 3 1:~0 ~1 ~2 3 2:0 1 2 3 3:0 1 2 3";
    assert_eq!(run_with(&[Event, Good, Good, Good], true), whole);
    // Whatever else is to be done waits for the next step.
    let expected = "0:0 1 2 3 1:~0 ~1 Overrun abandoned 2:0 1 2 3 3:0 1 2 3";
    assert_eq!(run_with(&[Event, Overrun, Good, Good], true), expected);
    assert_eq!(run_with(&[Event, NoSync, Event, Good], true), "0:0 1 2 3 LostSync lost 1 2:0 1 2 3 3:~0 ~1 ~2 3");
    assert_eq!(run_with(&[Event, Cut, Good, Good], true), "0:0 1 2 3 1:~0 ~1 LostSync abandoned 2:0 1 2 3 3:0 1 2 3");
}

#[test]
fn a_last_stripe_that_is_written_over_while_it_is_read_costs_its_frame() {
    // Capture restarts in the middle of the next frame, which is lost, too.
    assert_eq!(run(&[Good, SlowEnd, Good, Good]), "0:0 1 2 3 1:0 1 2 3 Overrun abandoned lost 1 3:0 1 2 3");
}

#[test]
fn a_silent_sensor_is_told_of_until_it_speaks_and_time_counts_the_frames() {
    assert_eq!(run(&[Good, Nothing, Nothing, Good, Good]), "0:0 1 2 3 Silent lost 2 3:0 1 2 3 4:0 1 2 3");
    let expected = "0:0 1 2 3 Silent Silent Silent lost 5 6:0 1 2 3";
    assert_eq!(run(&[Good, Nothing, Nothing, Nothing, Nothing, Nothing, Good]), expected);
    // No frame counts as lost before the first frame: time begins there.
    assert_eq!(run(&[Nothing, Nothing, Good]), "Silent 2:0 1 2 3");
}

#[test]
fn a_frame_that_stops_is_given_up() {
    // The sync that shows it has passed when capture restarts, so that frame is lost, too.
    assert_eq!(run(&[Good, Stops, Good, Good]), "0:0 1 2 3 1:0 1 LostSync abandoned lost 1 3:0 1 2 3");
    assert_eq!(run(&[Good, Stops, Nothing, Nothing, Good]), "0:0 1 2 3 1:0 1 abandoned Silent lost 2 4:0 1 2 3");
}

/// Returns a capture interface whose number of complete stripes a test sets.
fn interface() -> (Rc<RefCell<World>>, Stripes<Interface>) {
    let world =
        World { now: 0, frames: &[Good], complete: 0, trouble: None, lines: false, in_frame: false, ring: [0; 2] };
    let world = Rc::new(RefCell::new(world));
    (world.clone(), Stripes::new(Interface(world), STRIPES, PERIOD))
}

#[test]
fn a_stripe_is_not_handed_out_when_the_next_one_is_complete() {
    for released in [false, true] {
        let (world, mut stripes) = interface();
        world.borrow_mut().complete = 1;
        assert!(matches!(stripes.step(), StripeStep::Rows { .. }));
        // It was complete while the first was read. The first may have been overwritten, whether the reader asks or
        // not.
        world.borrow_mut().complete = 2;
        assert!(!(released && stripes.release()));
        assert_eq!(stripes.step(), StripeStep::Fault(Fault::Overrun));
        assert_eq!(stripes.step(), StripeStep::Abandoned);
        assert!(matches!(stripes.step(), StripeStep::Wait(_)));
    }
}

#[test]
fn counts_may_begin_again_at_zero() {
    // Years of three stripes per frame: 2^32 is not a multiple of three.
    let (world, mut stripes) = interface();
    (stripes.per_frame, stripes.taken, world.borrow_mut().complete) = (3, u32::MAX - 4, u32::MAX - 4);
    for stripe in 0..9_u32 {
        world.borrow_mut().complete = (u32::MAX - 3).wrapping_add(stripe);
        assert_eq!(stripes.is_in_frame(), !stripe.is_multiple_of(3), "stripe {stripe}");
        assert!(matches!(stripes.step(), StripeStep::Rows { .. }), "stripe {stripe}");
        assert!(stripes.release(), "stripe {stripe}");
    }
}
