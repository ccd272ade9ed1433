//! The tip of a whisker on its way over a surface: its strain, and the light that is emitted meanwhile.
//!
//! Time is divided into pieces. No piece contains a kink or a jump of the surface, or a moment in which the tip touches
//! or leaves it. Within a piece the overlap is taken to be linear in time. The strain is taken to follow the root of
//! the overlap, which is exact for the linear beam. A piece emits the light of the whole change of its strain, at its
//! mean moment.
//!
//! A whisker leaves a surface that falls away faster than the whisker can spring back. If the surface rises again, it
//! meets the whisker again.

use libm::{exp, sqrt};

use super::light::{Exposure, Fluctuation, flash, moment_of_roots};
use super::surface::{Segment, Surface};
use super::whisker::{Bending, Bent};

/// The properties that all whiskers share while a specimen slides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage<'a> {
    /// The law by which they bend.
    pub bending: &'a Bending,
    /// Speed at which the surface passes, above 0: in mm/s, or 1 for a surface in time.
    pub speed_mm_s: f64,
    /// Time constant of the spring-back in s; 0 if it is immediate.
    pub relaxation_s: f64,
    /// Longest piece of time, in s.
    pub step_s: f64,
    /// Largest change of the overlap in a piece, in mm.
    pub step_mm: f64,
    /// Light of a strain of 1, in full scales · s.
    pub flash: f64,
    /// Light of rubbing over 1 mm under a load of 1, in full scales · s.
    pub rubbing: f64,
    /// Standard deviation of the rubbing, as a fraction.
    pub fluctuation: f64,
    /// Distance in mm over which the rubbing stays similar.
    pub fluctuation_mm: f64,
}

/// How a surface rubs a tip in a stretch of time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rub {
    /// The distance in mm that it has passed at the start.
    pub from_mm: f64,
    /// Its speed in mm/s.
    pub mm_s: f64,
}

/// The state of a whisker's tip.
#[derive(Clone, Debug)]
pub(crate) struct Tip {
    /// Overlap of the crests with the whisker, in mm: less than the middle whisker's if the dome lowers it.
    pub overlap_mm: f64,
    /// Its current bend.
    pub bent: Bent,
    /// `true` if it is bent more than the surface requires, and springs back.
    pub loose: bool,
    /// The fluctuation of its rubbing.
    pub fluctuation: Fluctuation,
}

/// Largest distance in mm between two places that counts as no gap: a rounding error.
const LEAST_GAP_MM: f64 = 1e-9;
/// Largest number of pieces in a segment; the permitted key values stay well below it.
const MOST_PIECES: f64 = 1e6;

/// Start and end of a piece in s, from the start of the stretch.
#[derive(Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
}

impl Piece {
    fn length(self) -> f64 {
        self.to - self.from
    }

    /// Returns the moment at a fraction of its time.
    fn at(self, share: f64) -> f64 {
        self.from + share * self.length()
    }
}

impl Passage<'_> {
    /// Returns the overlap at which a surface that falls away at `rate` mm/s begins to fall faster than the whisker
    /// springs back.
    ///
    /// The condition is that d ln strain / dt, which is steepness · rate / overlap, is below −1 / relaxation. Returns
    /// `None` if it does not hold between the two overlaps.
    fn lets_go(&self, rate: f64, [from, to]: [f64; 2]) -> Option<f64> {
        if rate >= 0.0 || self.relaxation_s <= 0.0 {
            return None;
        }
        let holds = |overlap: f64| overlap + self.relaxation_s * rate * self.bending.steepness(overlap) >= 0.0;
        if !holds(from) {
            return Some(from);
        }
        if holds(to) {
            return None;
        }
        let (mut high, mut low) = (from, to);
        for _ in 0..20 {
            let middle = 0.5 * (high + low);
            if holds(middle) { high = middle } else { low = middle }
        }
        Some(low)
    }

    /// Returns the moment at which a loose tip meets the surface again, or `None` if it does not within the piece.
    fn caught(&self, tip: &Tip, [from, to]: [f64; 2], piece: Piece) -> Option<f64> {
        let over = |share: f64| {
            let surface = self.bending.at_root(sqrt((from + share * (to - from)).max(0.0)));
            tip.bent.strain * exp(-share * piece.length() / self.relaxation_s) - surface.strain
        };
        let (mut low, mut high) = (0.0, 1.0);
        let (mut above, mut below) = (over(low), over(high));
        if below >= 0.0 {
            return None;
        }
        if above <= 0.0 {
            return Some(piece.from);
        }
        // Uses false position with the Illinois rule, so that both ends converge.
        for _ in 0..8 {
            let between = low + (high - low) * above / (above - below);
            let there = over(between);
            if there > 0.0 {
                (low, above, below) = (between, there, 0.5 * below);
            } else {
                (high, below, above) = (between, there, 0.5 * above);
            }
        }
        Some(piece.at(high))
    }
}

/// A tip that is on its way over a surface, and the light that it emits meanwhile.
pub(crate) struct Crossing<'a> {
    /// The properties of all tips.
    pub passage: &'a Passage<'a>,
    /// The tip.
    pub tip: &'a mut Tip,
    /// How the surface rubs it.
    pub rub: Rub,
    /// Where its light is added.
    pub exposure: &'a mut Exposure,
}

impl Crossing<'_> {
    /// Advances over a surface by `length` s; at the start the tip is `passed` mm behind the leading end.
    pub(crate) fn advance(&mut self, surface: &Surface, passed: f64, length: f64) {
        let speed_mm_s = self.passage.speed_mm_s;
        let reached = passed + speed_mm_s * length;
        let moment = |place: f64| ((place - passed) / speed_mm_s).clamp(0.0, length);
        // Up to the place that the tip has reached. A gap that rounding leaves between segments does not count.
        let mut place = passed;
        for segment in surface.segments_from(passed) {
            if segment.from >= reached {
                break;
            }
            let (first, last) = (segment.from.max(passed), segment.to.min(reached));
            if first > place + LEAST_GAP_MM {
                self.free(Piece { from: moment(place), to: moment(first) });
            }
            self.cross(segment, [first, last], Piece { from: moment(first), to: moment(last) });
            place = last;
        }
        if reached > place + LEAST_GAP_MM {
            self.free(Piece { from: moment(place), to: length });
        }
    }

    /// Advances by `length` s in which the overlap changes evenly from one value to another, in mm; a gap is below 0.
    pub(crate) fn approach(&mut self, [before, after]: [f64; 2], length: f64) {
        let overlap = |share: f64| before * (1.0 - share) + after * share;
        self.over(overlap, [0.0, 1.0], Piece { from: 0.0, to: length });
    }

    /// Advances over a segment, or over a part of it between two places in mm, from one moment to another.
    fn cross(&mut self, segment: &Segment, [first, last]: [f64; 2], piece: Piece) {
        let crests = self.tip.overlap_mm;
        let overlap = |place: f64| crests - segment.drop_mm(place);
        let (start, end) = (overlap(first), overlap(last));
        if start <= 0.0 && end <= 0.0 {
            return self.free(piece);
        }
        if segment.is_straight() && start.min(end) < 0.0 {
            // Only the part that touches is divided into pieces.
            let share = start / (start - end);
            let (place, at) = (first + share * (last - first), piece.at(share));
            if start < 0.0 {
                self.free(Piece { to: at, ..piece });
                self.over(overlap, [place, last], Piece { from: at, ..piece });
            } else {
                self.over(overlap, [first, place], Piece { to: at, ..piece });
                self.free(Piece { from: at, ..piece });
            }
            return;
        }
        self.over(overlap, [first, last], piece);
    }

    /// Advances in pieces between two places in mm over which the overlap is smooth.
    fn over(&mut self, overlap: impl Fn(f64) -> f64, [first, last]: [f64; 2], whole: Piece) {
        let mut before = overlap(first);
        let change = libm::fabs(overlap(last) - before) / self.passage.step_mm;
        let parts = libm::ceil((whole.length() / self.passage.step_s).max(change)).clamp(1.0, MOST_PIECES) as u32;
        self.jump(before, whole.from);
        let share = |part: u32| f64::from(part) / f64::from(parts);
        for part in 1..=parts {
            let piece = Piece { from: whole.at(share(part - 1)), to: whole.at(share(part)) };
            let after = overlap(first + (last - first) * share(part));
            self.piece([before, after], piece);
            before = after;
        }
    }

    /// Advances over a piece in which the overlap goes from one value to another, in mm; below 0 there is no overlap.
    fn piece(&mut self, [before, after]: [f64; 2], piece: Piece) {
        let crossing = || piece.at(before / (before - after));
        match (before > 0.0, after > 0.0) {
            (true, true) => self.touch([before, after], piece),
            (false, false) => self.free(piece),
            (false, true) => {
                let touched = crossing();
                self.free(Piece { to: touched, ..piece });
                self.touch([0.0, after], Piece { from: touched, ..piece });
            }
            (true, false) => {
                let left = crossing();
                self.touch([before, 0.0], Piece { to: left, ..piece });
                self.free(Piece { from: left, ..piece });
            }
        }
    }

    /// Changes the overlap to `overlap` mm at the moment `at`, as at a jump of the surface.
    fn jump(&mut self, overlap: f64, at: f64) {
        let (passage, tip) = (self.passage, &mut *self.tip);
        let bent = passage.bending.at_root(sqrt(overlap.max(0.0)));
        tip.loose = passage.relaxation_s > 0.0 && bent.strain < tip.bent.strain;
        if !tip.loose {
            self.exposure.add(passage.flash * flash(tip.bent.strain, bent.strain), at, 0.0);
            tip.bent = bent;
        }
    }

    /// Advances over a piece in which a surface is under the tip all the time and the overlap goes from one value to
    /// another.
    fn touch(&mut self, [mut from, to]: [f64; 2], mut piece: Piece) {
        let rate = (to - from) / piece.length();
        if self.tip.loose {
            let Some(caught) = self.passage.caught(self.tip, [from, to], piece) else { return self.free(piece) };
            self.free(Piece { to: caught, ..piece });
            from += rate * (caught - piece.from);
            piece.from = caught;
            // The bend stays the same, but the tip is on the surface, which loads it.
            self.tip.bent = self.passage.bending.at_root(sqrt(from.max(0.0)));
            self.tip.loose = false;
        }
        let Some(lets_go) = self.passage.lets_go(rate, [from, to]) else { return self.follow([from, to], piece) };
        let moment = (piece.from + (lets_go - from) / rate).clamp(piece.from, piece.to);
        if lets_go < from {
            self.follow([from, lets_go], Piece { to: moment, ..piece });
        }
        self.tip.loose = true;
        self.free(Piece { from: moment, ..piece });
    }

    /// Advances over a piece in which the tip stays on the surface and the overlap goes from one value to another.
    fn follow(&mut self, [from, to]: [f64; 2], piece: Piece) {
        let Self { passage, tip, rub, exposure } = self;
        let middle = sqrt((0.5 * (from + to)).max(0.0));
        let [from, to] = [sqrt(from.max(0.0)), sqrt(to.max(0.0))];
        let (before, after, length) = (tip.bent, passage.bending.at_root(to), piece.length());
        tip.bent = after;
        let share = moment_of_roots(from, to);
        let flash = passage.flash * flash(before.strain, after.strain);
        if passage.rubbing <= 0.0 {
            exposure.add(flash, piece.at(share), length);
            return;
        }
        // The mean of a quantity that follows a root is its end value, less the change that comes before it. The middle
        // shows by how much the load deviates from the root; it has Simpson's weight.
        let change = after.load - before.load;
        let bow = if libm::fabs(to - from) < 1e-12 {
            0.0
        } else {
            passage.bending.at_root(middle).load - before.load - change * (middle - from) / (to - from)
        };
        let load = after.load - change * share + bow * (2.0 / 3.0);
        let mut friction = [1.0; 3];
        if passage.fluctuation > 0.0 {
            let place = |at: f64| (rub.from_mm + rub.mm_s * at) / passage.fluctuation_mm;
            let fluctuations = tip.fluctuation.over(place(piece.from), place(piece.to));
            friction = fluctuations.map(|value| (1.0 + passage.fluctuation * value).max(0.0));
        }
        let [first, last, mean] = friction;
        // The mean of a product of two straight lines.
        let together = mean * load + (last - first) * change / 12.0;
        let rubbing = (passage.rubbing * rub.mm_s * length * together).max(0.0);
        let emitted = flash + rubbing;
        if emitted > 0.0 {
            // The larger the value at the end, the later its light.
            let later = 0.5 + (last * after.load - first * before.load) / (12.0 * together).max(f64::MIN_POSITIVE);
            let moment = flash * piece.at(share) + rubbing * piece.at(later.clamp(0.0, 1.0));
            exposure.add(emitted, moment / emitted, length);
        }
    }

    /// Lets the whisker spring back while the tip touches no surface.
    fn free(&mut self, piece: Piece) {
        let Passage { relaxation_s, flash, .. } = *self.passage;
        spring_back(self.tip, relaxation_s, flash, [piece.from, piece.to], self.exposure);
    }
}

/// Lets a whisker that touches no surface spring back from one moment to another, in s.
pub(crate) fn spring_back(tip: &mut Tip, relaxation_s: f64, light: f64, [from, to]: [f64; 2], exposure: &mut Exposure) {
    let before = tip.bent.strain;
    tip.bent = Bent::default();
    tip.loose = before > 0.0;
    if before <= 0.0 || to <= from {
        tip.bent.strain = before.max(0.0);
        return;
    }
    if relaxation_s <= 0.0 {
        exposure.add(light * before, from, 0.0);
        tip.loose = false;
        return;
    }
    let times = (to - from) / relaxation_s;
    let left = exp(-times);
    let after = before * left;
    // The mean moment of a part of an exponential fall; its spread is at most that of the whole.
    let share = if times < 1e-3 { 0.5 - times / 12.0 } else { 1.0 / times - left / (1.0 - left) };
    let spread = (to - from).min(sqrt(12.0) * relaxation_s);
    exposure.add(light * (before - after), from + share * (to - from), spread);
    // A strain this small counts as zero.
    tip.bent.strain = if after < 1e-9 { 0.0 } else { after };
    tip.loose = tip.bent.strain > 0.0;
}
