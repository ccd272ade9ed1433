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
    /// Advances the tip over a surface by `length` s; at the start it is `passed` mm behind the leading end.
    pub(crate) fn advance(
        &self,
        tip: &mut Tip,
        surface: &Surface,
        passed: f64,
        rub: Rub,
        length: f64,
        exposure: &mut Exposure,
    ) {
        let reached = passed + self.speed_mm_s * length;
        let moment = |place: f64| ((place - passed) / self.speed_mm_s).clamp(0.0, length);
        // Up to the place that the tip has reached. A gap that rounding leaves between segments does not count.
        let mut place = passed;
        for segment in surface.segments_from(passed) {
            if segment.from >= reached {
                break;
            }
            let (first, last) = (segment.from.max(passed), segment.to.min(reached));
            if first > place + LEAST_GAP_MM {
                self.free(tip, Piece { from: moment(place), to: moment(first) }, exposure);
            }
            self.cross(tip, segment, [first, last], [moment(first), moment(last)], rub, exposure);
            place = last;
        }
        if reached > place + LEAST_GAP_MM {
            self.free(tip, Piece { from: moment(place), to: length }, exposure);
        }
    }

    /// Advances the tip by `length` s in which its overlap changes evenly from one value to another, in mm; a gap is
    /// below 0.
    pub(crate) fn approach(
        &self,
        tip: &mut Tip,
        [before, after]: [f64; 2],
        length: f64,
        rub: Rub,
        exposure: &mut Exposure,
    ) {
        let overlap = |share: f64| before * (1.0 - share) + after * share;
        self.over(tip, overlap, [0.0, 1.0], Piece { from: 0.0, to: length }, rub, exposure);
    }

    /// Advances over a segment, or over a part of it between two places in mm, from one moment to another.
    fn cross(
        &self,
        tip: &mut Tip,
        segment: &Segment,
        [first, last]: [f64; 2],
        [from, to]: [f64; 2],
        rub: Rub,
        exposure: &mut Exposure,
    ) {
        let crests = tip.overlap_mm;
        let overlap = |place: f64| crests - segment.drop_mm(place);
        let (start, end) = (overlap(first), overlap(last));
        let piece = Piece { from, to };
        if start <= 0.0 && end <= 0.0 {
            self.free(tip, piece, exposure);
            return;
        }
        if segment.is_straight() && start.min(end) < 0.0 {
            // Only the part that touches is divided into pieces.
            let share = start / (start - end);
            let (place, at) = (first + share * (last - first), piece.at(share));
            if start < 0.0 {
                self.free(tip, Piece { to: at, ..piece }, exposure);
                self.over(tip, overlap, [place, last], Piece { from: at, ..piece }, rub, exposure);
            } else {
                self.over(tip, overlap, [first, place], Piece { to: at, ..piece }, rub, exposure);
                self.free(tip, Piece { from: at, ..piece }, exposure);
            }
            return;
        }
        self.over(tip, overlap, [first, last], piece, rub, exposure);
    }

    /// Advances in pieces between two places in mm over which the overlap is smooth.
    fn over(
        &self,
        tip: &mut Tip,
        overlap: impl Fn(f64) -> f64,
        [first, last]: [f64; 2],
        whole: Piece,
        rub: Rub,
        exposure: &mut Exposure,
    ) {
        let mut before = overlap(first);
        let change = libm::fabs(overlap(last) - before) / self.step_mm;
        let parts = libm::ceil((whole.length() / self.step_s).max(change)).clamp(1.0, MOST_PIECES) as u32;
        self.jump(tip, before, whole.from, exposure);
        let share = |part: u32| f64::from(part) / f64::from(parts);
        for part in 1..=parts {
            let piece = Piece { from: whole.at(share(part - 1)), to: whole.at(share(part)) };
            let after = overlap(first + (last - first) * share(part));
            self.piece(tip, [before, after], piece, rub, exposure);
            before = after;
        }
    }
    /// Advances over a piece in which the overlap goes from one value to another, in mm; below 0 there is no overlap.
    fn piece(&self, tip: &mut Tip, [before, after]: [f64; 2], piece: Piece, rub: Rub, exposure: &mut Exposure) {
        let crossing = || piece.at(before / (before - after));
        match (before > 0.0, after > 0.0) {
            (true, true) => self.touch(tip, [before, after], piece, rub, exposure),
            (false, false) => self.free(tip, piece, exposure),
            (false, true) => {
                let touched = crossing();
                self.free(tip, Piece { to: touched, ..piece }, exposure);
                self.touch(tip, [0.0, after], Piece { from: touched, ..piece }, rub, exposure);
            }
            (true, false) => {
                let left = crossing();
                self.touch(tip, [before, 0.0], Piece { to: left, ..piece }, rub, exposure);
                self.free(tip, Piece { from: left, ..piece }, exposure);
            }
        }
    }

    /// Changes the overlap to `overlap` mm at the moment `at`, as at a jump of the surface.
    fn jump(&self, tip: &mut Tip, overlap: f64, at: f64, exposure: &mut Exposure) {
        let bent = self.bending.at_root(sqrt(overlap.max(0.0)));
        tip.loose = self.relaxation_s > 0.0 && bent.strain < tip.bent.strain;
        if !tip.loose {
            exposure.add(self.flash * flash(tip.bent.strain, bent.strain), at, 0.0);
            tip.bent = bent;
        }
    }

    /// Advances over a piece in which a surface is under the tip all the time and the overlap goes from one value to
    /// another.
    fn touch(&self, tip: &mut Tip, [mut from, to]: [f64; 2], mut piece: Piece, rub: Rub, exposure: &mut Exposure) {
        let rate = (to - from) / piece.length();
        if tip.loose {
            let Some(caught) = self.caught(tip, [from, to], piece) else {
                self.free(tip, piece, exposure);
                return;
            };
            self.free(tip, Piece { to: caught, ..piece }, exposure);
            from += rate * (caught - piece.from);
            piece.from = caught;
            // The bend stays the same, but the tip is on the surface, which loads it.
            tip.bent = self.bending.at_root(sqrt(from.max(0.0)));
            tip.loose = false;
        }
        let Some(lets_go) = self.lets_go(rate, [from, to]) else {
            self.follow(tip, [from, to], piece, rub, exposure);
            return;
        };
        let moment = (piece.from + (lets_go - from) / rate).clamp(piece.from, piece.to);
        if lets_go < from {
            self.follow(tip, [from, lets_go], Piece { to: moment, ..piece }, rub, exposure);
        }
        tip.loose = true;
        self.free(tip, Piece { from: moment, ..piece }, exposure);
    }

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

    /// Advances over a piece in which the tip stays on the surface and the overlap goes from one value to another.
    fn follow(&self, tip: &mut Tip, [from, to]: [f64; 2], piece: Piece, rub: Rub, exposure: &mut Exposure) {
        let middle = sqrt((0.5 * (from + to)).max(0.0));
        let [from, to] = [sqrt(from.max(0.0)), sqrt(to.max(0.0))];
        let (before, after, length) = (tip.bent, self.bending.at_root(to), piece.length());
        tip.bent = after;
        let share = moment_of_roots(from, to);
        let flash = self.flash * flash(before.strain, after.strain);
        if self.rubbing <= 0.0 {
            exposure.add(flash, piece.at(share), length);
            return;
        }
        // The mean of a quantity that follows a root is its end value, less the change that comes before it. The middle
        // shows by how much the load deviates from the root; it has Simpson's weight.
        let change = after.load - before.load;
        let bow = if libm::fabs(to - from) < 1e-12 {
            0.0
        } else {
            self.bending.at_root(middle).load - before.load - change * (middle - from) / (to - from)
        };
        let load = after.load - change * share + bow * (2.0 / 3.0);
        let mut friction = [1.0; 3];
        if self.fluctuation > 0.0 {
            let place = |at: f64| (rub.from_mm + rub.mm_s * at) / self.fluctuation_mm;
            let fluctuations = tip.fluctuation.over(place(piece.from), place(piece.to));
            friction = fluctuations.map(|value| (1.0 + self.fluctuation * value).max(0.0));
        }
        let [first, last, mean] = friction;
        // The mean of a product of two straight lines.
        let together = mean * load + (last - first) * change / 12.0;
        let rubbing = (self.rubbing * rub.mm_s * length * together).max(0.0);
        let emitted = flash + rubbing;
        if emitted > 0.0 {
            // The larger the value at the end, the later its light.
            let later = 0.5 + (last * after.load - first * before.load) / (12.0 * together).max(f64::MIN_POSITIVE);
            let moment = flash * piece.at(share) + rubbing * piece.at(later.clamp(0.0, 1.0));
            exposure.add(emitted, moment / emitted, length);
        }
    }

    /// Lets the whisker spring back while the tip touches no surface.
    fn free(&self, tip: &mut Tip, piece: Piece, exposure: &mut Exposure) {
        spring_back(tip, self.relaxation_s, self.flash, [piece.from, piece.to], exposure);
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
