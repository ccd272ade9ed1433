//! A whisker's tip on its way over a surface: strain, and what is emitted meanwhile.
//!
//! Time goes in pieces that never reach over a kink or a jump of the surface, nor over the moments in which the tip
//! touches it and leaves it. Within a piece the overlap is taken to be linear in time, and strain to go with its root,
//! as that of the linear beam does exactly. What a piece emits is the whole change of its strain, at its mean moment.
//!
//! A surface that falls away faster than the whisker can spring back lets it go; where it rises again it catches it.

use libm::{exp, sqrt};

use super::light::{Exposure, Fluctuation, flash, moment_of_roots};
use super::surface::{Segment, Surface};
use super::whisker::{Bending, Bent};

/// What all whiskers have in common while a specimen slides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage<'a> {
    /// What they touch.
    pub surface: &'a Surface,
    /// How they bend.
    pub bending: &'a Bending,
    /// Speed in mm/s, above 0.
    pub speed_mm_s: f64,
    /// Time constant of springing back in s, 0 for at once.
    pub relaxation_s: f64,
    /// Longest piece of time in s.
    pub step_s: f64,
    /// Largest change of the overlap in a piece, in mm.
    pub step_mm: f64,
    /// Light of a strain of 1 and of rubbing over a mm under a load of 1, in full scales · s.
    pub flash: f64,
    /// See `flash`.
    pub rubbing: f64,
    /// Deviation of the rubbing, as a share, and the distance in mm over which it stays alike.
    pub fluctuation: f64,
    /// See `fluctuation`.
    pub fluctuation_mm: f64,
}

/// How a whisker is.
#[derive(Clone, Debug)]
pub(crate) struct Tip {
    /// How much its crests overlap it, in mm: less than the middle's where the dome lowers it.
    pub overlap_mm: f64,
    /// How it is bent now.
    pub bent: Bent,
    /// Whether it is bent more than the surface asks for, and springs back.
    pub loose: bool,
    /// How its rubbing fluctuates.
    pub fluctuation: Fluctuation,
}

/// What is nearer to each other than this, in mm, has no gap between: rounding.
const LEAST_GAP_MM: f64 = 1e-9;
/// Most pieces of a segment: keys keep well below it.
const MOST_PIECES: f64 = 1e6;

/// Moments of a piece in s, from the start of the stretch.
#[derive(Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
}

impl Piece {
    fn length(self) -> f64 {
        self.to - self.from
    }

    /// At a share of its time.
    fn at(self, share: f64) -> f64 {
        self.from + share * self.length()
    }
}

impl Passage<'_> {
    /// Goes on for `length` s, at the start of which the tip is `passed` mm behind the leading end.
    pub(crate) fn advance(&self, tip: &mut Tip, passed: f64, length: f64, exposure: &mut Exposure) {
        let reached = passed + self.speed_mm_s * length;
        let moment = |place: f64| ((place - passed) / self.speed_mm_s).clamp(0.0, length);
        // Up to where it has come. What rounding leaves between segments is no gap.
        let mut place = passed;
        for segment in self.surface.segments_from(passed) {
            if segment.from >= reached {
                break;
            }
            let (first, last) = (segment.from.max(passed), segment.to.min(reached));
            if first > place + LEAST_GAP_MM {
                self.free(tip, Piece { from: moment(place), to: moment(first) }, exposure);
            }
            self.cross(tip, segment, [first, last], [moment(first), moment(last)], passed, exposure);
            place = last;
        }
        if reached > place + LEAST_GAP_MM {
            self.free(tip, Piece { from: moment(place), to: length }, exposure);
        }
    }

    /// Goes over a segment, or what of it lies between two places, in mm, from one moment to another.
    fn cross(
        &self,
        tip: &mut Tip,
        segment: &Segment,
        [first, last]: [f64; 2],
        [from, to]: [f64; 2],
        passed: f64,
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
            // Only what touches is gone over in pieces.
            let share = start / (start - end);
            let (place, at) = (first + share * (last - first), piece.at(share));
            if start < 0.0 {
                self.free(tip, Piece { to: at, ..piece }, exposure);
                self.over(tip, overlap, [place, last], Piece { from: at, ..piece }, passed, exposure);
            } else {
                self.over(tip, overlap, [first, place], Piece { to: at, ..piece }, passed, exposure);
                self.free(tip, Piece { from: at, ..piece }, exposure);
            }
            return;
        }
        self.over(tip, overlap, [first, last], piece, passed, exposure);
    }

    /// Goes in pieces over what lies between two places, in mm, where the overlap is smooth.
    fn over(
        &self,
        tip: &mut Tip,
        overlap: impl Fn(f64) -> f64,
        [first, last]: [f64; 2],
        whole: Piece,
        passed: f64,
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
            self.piece(tip, [before, after], piece, passed, exposure);
            before = after;
        }
    }
    /// A piece over which the overlap goes from one value to another, in mm; below 0 there is none.
    fn piece(&self, tip: &mut Tip, [before, after]: [f64; 2], piece: Piece, passed: f64, exposure: &mut Exposure) {
        let crossing = || piece.at(before / (before - after));
        match (before > 0.0, after > 0.0) {
            (true, true) => self.touch(tip, [before, after], piece, passed, exposure),
            (false, false) => self.free(tip, piece, exposure),
            (false, true) => {
                let touched = crossing();
                self.free(tip, Piece { to: touched, ..piece }, exposure);
                self.touch(tip, [0.0, after], Piece { from: touched, ..piece }, passed, exposure);
            }
            (true, false) => {
                let left = crossing();
                self.touch(tip, [before, 0.0], Piece { to: left, ..piece }, passed, exposure);
                self.free(tip, Piece { from: left, ..piece }, exposure);
            }
        }
    }

    /// The overlap jumps to `overlap` mm at the moment `at`.
    fn jump(&self, tip: &mut Tip, overlap: f64, at: f64, exposure: &mut Exposure) {
        let bent = self.bending.at_root(sqrt(overlap.max(0.0)));
        tip.loose = self.relaxation_s > 0.0 && bent.strain < tip.bent.strain;
        if !tip.loose {
            exposure.add(self.flash * flash(tip.bent.strain, bent.strain), at, 0.0);
            tip.bent = bent;
        }
    }

    /// There is a surface under the tip all the time, and the overlap goes from one value to another.
    fn touch(&self, tip: &mut Tip, [mut from, to]: [f64; 2], mut piece: Piece, passed: f64, exposure: &mut Exposure) {
        let rate = (to - from) / piece.length();
        if tip.loose {
            let Some(caught) = self.caught(tip, [from, to], piece) else {
                self.free(tip, piece, exposure);
                return;
            };
            self.free(tip, Piece { to: caught, ..piece }, exposure);
            from += rate * (caught - piece.from);
            piece.from = caught;
            // As bent as it was, but on the surface, which loads it.
            tip.bent = self.bending.at_root(sqrt(from.max(0.0)));
            tip.loose = false;
        }
        let Some(lets_go) = self.lets_go(rate, [from, to]) else {
            self.follow(tip, [from, to], piece, passed, exposure);
            return;
        };
        let moment = (piece.from + (lets_go - from) / rate).clamp(piece.from, piece.to);
        if lets_go < from {
            self.follow(tip, [from, lets_go], Piece { to: moment, ..piece }, passed, exposure);
        }
        tip.loose = true;
        self.free(tip, Piece { from: moment, ..piece }, exposure);
    }

    /// The overlap at which a surface that falls away at `rate` mm/s begins to fall faster than the whisker springs back,
    /// if it does from one overlap to another: d ln strain / dt, which is steepness · rate / overlap, below −1 / relaxation.
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

    /// The moment at which a loose tip meets the surface again, if it does within the piece.
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
        // False position, the Illinois way: both ends close in.
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

    /// The tip stays on the surface, and the overlap goes from one value to another.
    fn follow(&self, tip: &mut Tip, [from, to]: [f64; 2], piece: Piece, passed: f64, exposure: &mut Exposure) {
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
        // The mean of what goes with a root: its end, less the change that comes before it. By how much the load does not
        // go with the root, its middle tells, with Simpson's weight.
        let change = after.load - before.load;
        let bow = if libm::fabs(to - from) < 1e-12 {
            0.0
        } else {
            self.bending.at_root(middle).load - before.load - change * (middle - from) / (to - from)
        };
        let load = after.load - change * share + bow * (2.0 / 3.0);
        let mut friction = [1.0; 3];
        if self.fluctuation > 0.0 {
            let place = |at: f64| (passed + self.speed_mm_s * at) / self.fluctuation_mm;
            let fluctuations = tip.fluctuation.over(place(piece.from), place(piece.to));
            friction = fluctuations.map(|value| (1.0 + self.fluctuation * value).max(0.0));
        }
        let [first, last, mean] = friction;
        // Of a product of two straight lines.
        let together = mean * load + (last - first) * change / 12.0;
        let rubbing = (self.rubbing * self.speed_mm_s * length * together).max(0.0);
        let emitted = flash + rubbing;
        if emitted > 0.0 {
            // The more there is at the end, the later its light.
            let later = 0.5 + (last * after.load - first * before.load) / (12.0 * together).max(f64::MIN_POSITIVE);
            let moment = flash * piece.at(share) + rubbing * piece.at(later.clamp(0.0, 1.0));
            exposure.add(emitted, moment / emitted, length);
        }
    }

    /// Nothing is touched: the whisker springs back.
    fn free(&self, tip: &mut Tip, piece: Piece, exposure: &mut Exposure) {
        spring_back(tip, self.relaxation_s, self.flash, [piece.from, piece.to], exposure);
    }
}

/// A whisker that touches nothing springs back from one moment to another, in s.
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
    // So little is no strain at all.
    tip.bent.strain = if after < 1e-9 { 0.0 } else { after };
    tip.loose = tip.bent.strain > 0.0;
}
