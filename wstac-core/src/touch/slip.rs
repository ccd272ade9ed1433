//! The slip of a part that is pressed on and held: it moves, and no edge arrives (SPEC §9, "Slip").

use crate::law::Answer;
use crate::paper::direction::Direction;
use crate::paper::trigger::Event;
use crate::params::{COLUMNS, LONGEST_FILLED_GAP, NOMINAL_FRAME_RATE, TAXELS};
use crate::pipeline::Update;
use crate::rate::FrameRate;
use crate::reason::Reason;
use crate::touch::motion::Contact;

/// Frames at 30 per second to know the dark.
const LEARNS: u32 = 16;
/// Most frames at 30 per second from the first light of a press to its brightest frame, and to its end.
const RISES: u32 = 12;
const PRESS: u32 = 32;
/// Frames at 30 per second of rest behind a slip or another touch.
const REST: u32 = 3;
/// Least frames at 30 per second to tell a slip from a release of the press's pattern, and of an unknown one.
const KNOWN: u32 = 2;
const UNKNOWN: u32 = 5;
/// The same for a second slip with little light.
const WEAK: u32 = 7;
/// Frames at 30 per second after which light in a hold that is no slip has ended.
const LONGEST: u32 = 16;
/// Frames at 30 per second after which what does not come to rest may be noise that has grown.
const NOISY: u32 = 512;
/// Lost frames in a row after which the hold is no longer known.
const LONGEST_GAP: u64 = LONGEST_FILLED_GAP as u64;
/// A touch has so many times the energy of noise, rest a fourth of it, and what differs from a pattern so many times.
const TOUCH: i64 = 64;
const DIFFERS: i64 = 4;
/// The least energy of a frame's noise: half a unit rms in each taxel.
const LEAST_NOISE: i64 = 1600;
/// From pitch to pitch light is so much later, in 1/256 of a frame at 30 per second, if it comes from the side.
const SLOPE: u32 = 77;
/// The same after a slip: here a missed slip is better than a false one.
const SECOND_SLOPE: u32 = 51;
/// A second slip has so many times the light of the press, or less than this part of it.
const MOTION: i64 = 2;
/// The least taxels of a press.
const LEAST_LIT: usize = 5;
/// Taxels with at least this light are those of the press, where its brightest one has 255.
const LIT: u8 = 32;

/// A slip: a held part has begun to move.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Slip {
    /// The number of the frame of the alarm: the newest one.
    #[cfg_attr(feature = "wire", serde(serialize_with = "crate::wire::numbers::long"))]
    pub frame: u64,
    /// The number of the first frame with light of the motion.
    #[cfg_attr(feature = "wire", serde(serialize_with = "crate::wire::numbers::long"))]
    pub onset_frame: u64,
    /// The number of the first frame with light of the press, or, after a slip, of the frame in which its rest was
    /// known.
    #[cfg_attr(feature = "wire", serde(serialize_with = "crate::wire::numbers::long"))]
    pub held_since_frame: u64,
    /// The most light of a frame since the onset, as a fraction of the press's brightest frame: above 0.
    pub strength: f32,
}

impl Slip {
    /// Creates a slip.
    pub const fn new(frame: u64, onset_frame: u64, held_since_frame: u64, strength: f32) -> Self {
        Self { frame, onset_frame, held_since_frame, strength }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Learns the dark.
    New,
    Dark,
    /// Light has come.
    Press,
    Held,
    /// Light has come in a hold.
    Rise,
    /// A slip was reported, and goes on.
    Slip,
    /// Some other touch, until it is dark.
    Other,
}

/// Watches for a press, and then for the slip of what is held.
#[derive(Clone, Copy, Debug)]
pub struct SlipDetector {
    rate: FrameRate,
    state: State,
    /// Frames of the dark or of rest.
    quiet: u16,
    /// Whether there was a slip since the press: then the pattern is unknown.
    has_moved: bool,
    /// Whether there was a slip since the dark: then what was held may have left.
    may_be_gone: bool,
    /// The press's pattern: the brightest is 255.
    pattern: [u8; TAXELS],
    /// Light before the touch, in 1/16 of a unit.
    floor: [i32; TAXELS],
    /// Sums of the light of a press or of a rise, in units.
    light: [i32; TAXELS],
    late: [i32; TAXELS],
    next: u64,
    /// The first frames of the press or rise, and of the hold.
    since: u64,
    held_since: u64,
    /// The frame behind the onset of the last slip; 0 before the first.
    behind_onset: u64,
    /// The energy of noise in a frame, and of what a hold's frames have beside the press's pattern.
    noise: i64,
    level: i64,
    now: Flash,
    press: Flash,
}

/// The light of a press or of a rise.
#[derive(Clone, Copy, Debug)]
struct Flash {
    /// The light and the energy of its brightest frames, and the light of all.
    peak: i64,
    energy: i64,
    uneven: i64,
    sum: i64,
    /// The energies of the last frame, and the number of the brightest.
    last: [i64; 2],
    brightest: u64,
}

impl Flash {
    const NONE: Self = Self { peak: 0, energy: 0, uneven: 0, sum: 0, last: [0; 2], brightest: 0 };

    fn add(&mut self, frame: u64, light: &Light) {
        if light.energy > self.energy {
            (self.energy, self.brightest) = (light.energy, frame);
        }
        (self.peak, self.uneven) = (self.peak.max(light.sum), self.uneven.max(light.uneven));
        (self.sum, self.last) = (self.sum + light.sum, [light.energy, light.uneven]);
    }
}

/// The light of 25 taxels above the floor, in 1/16 of a unit, and its energy, with and without their mean.
struct Light {
    of: [i32; TAXELS],
    sum: i64,
    energy: i64,
    uneven: i64,
    /// Whether it has risen: a fifth of the energy at most is of taxels below the floor.
    rises: bool,
}

impl Light {
    fn new(of: [i32; TAXELS]) -> Self {
        let sum: i64 = of.iter().map(|&light| i64::from(light)).sum();
        let squares = |less: i64| of.iter().map(|&light| (i64::from(light) - less).pow(2)).sum();
        let (energy, uneven) = (squares(0), squares(sum.div_euclid(TAXELS as i64)));
        let fallen: i64 = of.iter().map(|&light| i64::from(light.min(0)).pow(2)).sum();
        Self { of, sum, energy, uneven, rises: energy > 5 * fallen }
    }

    /// Returns whether light has come that is not the same for all taxels.
    fn is_touch(&self, noise: i64) -> bool {
        self.uneven > TOUCH * noise
    }

    /// Returns the energy of the light that is not of a pattern; if `is_even` is set, nor the same for all taxels.
    fn beside(&self, pattern: &[u8; TAXELS], is_even: bool) -> i64 {
        let count = TAXELS as i64;
        let (mean, even) = if is_even {
            (self.sum.div_euclid(count), pattern.iter().map(|&part| i64::from(part)).sum())
        } else {
            (0, 0)
        };
        let both = || {
            let parts = pattern.iter().map(|&part| count * i64::from(part) - even);
            parts.zip(self.of.iter().map(|&light| i64::from(light) - mean))
        };
        let size: i64 = both().map(|(part, _)| part * part).sum();
        let along: i64 = both().map(|(part, light)| part * light).sum();
        let along = if size > 0 { (256 * along).div_euclid(size) } else { 0 };
        both().map(|(part, light)| light - ((along * part) >> 8)).map(|rest| rest * rest).sum()
    }
}

/// Returns how many feature frames so many frames at 30 per second are, rounded down.
const fn feature_frames(frames: u32, rate: FrameRate) -> u64 {
    let per = rate.denominator() as u64 * rate.frames_added() as u64 * NOMINAL_FRAME_RATE as u64;
    match (frames as u64 * rate.numerator() as u64).checked_div(per) {
        Some(frames) => frames,
        None => 0,
    }
}

impl SlipDetector {
    /// Creates the state before the first frame, for a camera's frame rate.
    pub const fn new(rate: FrameRate) -> Self {
        Self {
            rate,
            state: State::New,
            quiet: 0,
            has_moved: false,
            may_be_gone: false,
            pattern: [0; TAXELS],
            floor: [0; TAXELS],
            light: [0; TAXELS],
            late: [0; TAXELS],
            next: 0,
            since: 0,
            held_since: 0,
            behind_onset: 0,
            noise: LEAST_NOISE,
            level: 0,
            now: Flash::NONE,
            press: Flash::NONE,
        }
    }

    /// Takes the feature frame that a push completed, if it did. Returns the slip that this frame shows.
    ///
    /// It needs a pipeline that keeps taxels ([`PipelineBuilder::taxels`](crate::pipeline::PipelineBuilder::taxels)).
    pub fn push(&mut self, update: &Update<'_>) -> Option<Slip> {
        let (frame, taxels) = update.newest_taxels()?;
        self.push_taxels(frame, taxels)
    }

    /// Takes the taxels of the feature frame of a number, in the unit of
    /// [`TaxelRing::frames`](crate::touch::taxel_ring::TaxelRing::frames). Returns the slip that this frame shows.
    ///
    /// Numbers that are left out are lost frames. A frame that does not follow the last one is ignored.
    pub fn push_taxels(&mut self, frame: u64, taxels: &[u16; TAXELS]) -> Option<Slip> {
        let lost = frame.checked_sub(self.next)?;
        self.next = frame.saturating_add(1);
        if lost > LONGEST_GAP {
            self.turn(State::New);
        }
        let mut of = [0; TAXELS];
        for ((light, &taxel), &floor) in of.iter_mut().zip(taxels).zip(&self.floor) {
            *light = 16 * i32::from(taxel) - floor;
        }
        let light = Light::new(of);
        match self.state {
            State::New => self.learn(&light),
            State::Dark => self.wait(frame, &light),
            State::Press => return self.press(frame, &light),
            State::Held => self.hold(frame, &light),
            State::Rise if self.has_moved => return self.press(frame, &light),
            State::Rise => return self.rise(frame, &light),
            State::Slip | State::Other => self.rest(frame, &light),
        }
        None
    }

    /// Returns the number of the first frame with light of the press, or of the frame in which the rest behind a slip
    /// was known, while something is held.
    pub const fn held_since_frame(&self) -> Option<u64> {
        match self.state {
            State::Held | State::Rise | State::Slip => Some(self.held_since),
            _ => None,
        }
    }

    /// Corrects a law's answer: a touch in which a slip has begun is unclear, unless it is a reliable slide.
    pub(crate) fn correct(&self, touch: &Event<'_>, answer: &mut Answer) {
        let is_slide = answer.reliable && answer.contact == Some(Contact::Slide);
        if !is_slide && self.behind_onset > touch.touch_frame.unwrap_or(touch.frame) {
            let (none, doubt) = (Reason::NoSlide(Contact::Unclear), Some(Reason::Slips));
            let unclear = Answer::new(Err(none), Direction::by_arrival(Err(none)), false);
            *answer = Answer { contact: Some(Contact::Unclear), doubt, duration: answer.duration, ..unclear };
        }
    }

    /// Returns how many feature frames so many frames at 30 per second are; ties round up.
    fn time(&self, frames: u32) -> u64 {
        feature_frames(2 * frames, self.rate).div_ceil(2)
    }

    fn turn(&mut self, state: State) {
        (self.state, self.quiet) = (state, 0);
    }

    /// Moves the floor by 1/2^down of light below it, and by 1/2^up of light above it.
    fn follow(&mut self, light: &Light, down: u8, up: u8) {
        for (floor, &light) in self.floor.iter_mut().zip(&light.of) {
            *floor += light >> (if light < 0 { down } else { up } & 31);
        }
    }

    /// Begins to sum up light.
    fn begin(&mut self, state: State, frame: u64, light: &Light) {
        self.turn(state);
        (self.since, self.light, self.late, self.now) = (frame, [0; TAXELS], [0; TAXELS], Flash::NONE);
        self.add(frame, light);
    }

    fn add(&mut self, frame: u64, light: &Light) {
        let age = (frame - self.since).min(31) as i32;
        for ((sum, late), &light) in self.light.iter_mut().zip(&mut self.late).zip(&light.of) {
            *sum += light >> 4;
            *late += age * (light >> 4);
        }
        self.now.add(frame, light);
    }

    fn learn(&mut self, light: &Light) {
        let noise = if self.quiet < 2 { LEAST_NOISE } else { self.noise + ((light.uneven - self.noise) >> 2) };
        self.noise = noise.max(LEAST_NOISE);
        let half = u8::from(self.quiet > 0);
        self.follow(light, half, half);
        self.quiet += 1;
        if u64::from(self.quiet) >= self.time(LEARNS) {
            self.turn(State::Dark);
        }
    }

    fn wait(&mut self, frame: u64, light: &Light) {
        if light.rises && light.is_touch(self.noise) {
            self.begin(State::Press, frame, light);
            return;
        }
        let uneven = light.uneven.min(DIFFERS * self.noise);
        self.noise = (self.noise + ((uneven - self.noise) >> 5)).max(LEAST_NOISE);
        self.follow(light, 3, 3);
    }

    /// Takes a frame of a press, or of light behind a slip: a second slip, or another touch if the part has left.
    fn press(&mut self, frame: u64, light: &Light) -> Option<Slip> {
        let (now, press, is_again) = (self.now, self.press, self.state == State::Rise);
        let fades = if is_again { 8 } else { 256 };
        // A press is brightest at its end; then its energy falls as the square of light.
        if fades * light.energy <= now.energy || fades * light.uneven <= now.uneven {
            let is_from_side = self.is_from_side();
            self.follow(light, 0, 0);
            if is_again && 6 * now.sum <= press.sum && !is_from_side {
                self.turn(State::Held);
                return None;
            }
            let is_press = now.brightest - self.since <= self.time(RISES) && self.learn_pattern() >= LEAST_LIT;
            self.turn(if is_press && !is_from_side { State::Held } else { State::Other });
            (self.held_since, self.press, self.level) = (self.since, now, self.noise);
            (self.has_moved, self.may_be_gone) = (false, is_again);
            return None;
        }
        let has_risen = 8 * now.last[0] < 7 * now.energy
            && 16 * light.energy > 9 * now.last[0]
            && 16 * light.uneven > 9 * now.last[1];
        let age = frame - self.since;
        if has_risen && !is_again || age > self.time(PRESS) {
            self.turn(State::Other);
            return None;
        }
        self.add(frame, light);
        if !is_again || !light.rises || !light.is_touch(self.noise) || !self.has_most_lit(age) {
            return None;
        }
        if age >= self.time(KNOWN) && self.is_from_side() {
            self.turn(State::Other);
            return None;
        }
        // A press or a release bends whiskers by about as much as the press.
        let sum = self.now.sum;
        let is_motion = sum > MOTION * press.sum && age >= self.time(UNKNOWN);
        let is_weak = MOTION * sum < press.sum && age >= self.time(WEAK);
        if !is_motion && !is_weak || 4 * light.energy <= self.now.energy {
            return None;
        }
        Some(self.slip(frame))
    }

    /// Reports a slip.
    fn slip(&mut self, frame: u64) -> Slip {
        self.turn(State::Slip);
        self.behind_onset = self.since.saturating_add(1);
        let strength = self.now.peak.max(1) as f32 / self.press.peak.max(1) as f32;
        Slip::new(frame, self.since, self.held_since, strength)
    }

    /// Takes the sums of light as the pattern. Returns the number of taxels that are lit by an eighth of the brightest.
    fn learn_pattern(&mut self) -> usize {
        let most = i64::from(self.light.iter().copied().max().unwrap_or(0).max(1));
        for (part, &light) in self.pattern.iter_mut().zip(&self.light) {
            *part = (255 * i64::from(light.max(0)) / most) as u8;
        }
        self.pattern.iter().filter(|&&part| part >= LIT).count()
    }

    /// Returns whether half of the taxels that the press has lit have light that is not noise.
    fn has_most_lit(&self, age: u64) -> bool {
        let limit = self.noise * (age as i64 + 1);
        let lit = self.light.iter().zip(&self.pattern).filter(|&(_, &part)| part >= LIT);
        let all = lit.clone().count();
        2 * lit.filter(|&(&light, _)| light > 0 && 100 * i64::from(light) * i64::from(light) > limit).count() >= all
    }

    /// Returns whether the press has lit one row or column only, and most of the light since is of others: a slow slide
    /// arrives row by row, and the first one looked like a press.
    #[inline(never)]
    fn arrives(&self) -> bool {
        let (mut rows, mut columns, mut lit, mut others) = (0_u8, 0_u8, 0_i64, 0_i64);
        for (taxel, (&light, &part)) in self.light.iter().zip(&self.pattern).enumerate() {
            let light = i64::from(light.max(0));
            if part >= LIT {
                (rows, columns) = (rows | 1 << (taxel / COLUMNS), columns | 1 << (taxel % COLUMNS));
                lit += light;
            } else {
                others += light;
            }
        }
        (rows.is_power_of_two() || columns.is_power_of_two()) && others > lit
    }

    /// Returns whether the light came from one side: its mean time rises along the sensor by more than that of a slide
    /// at 400 mm/s.
    fn is_from_side(&self) -> bool {
        let most = self.light.iter().copied().max().unwrap_or(0);
        let (mut lit, mut times, mut sums) = (0, 0, [[0_i64; 3]; 2]);
        for (taxel, (&light, &late)) in (0..).zip(self.light.iter().zip(&self.late)) {
            if light <= 0 || light < most / 8 {
                continue;
            }
            let time = (256 * i64::from(late)).div_euclid(light.into());
            (lit, times) = (lit + 1, times + time);
            for ([place, square, product], at) in sums.iter_mut().zip([taxel % COLUMNS as i64, taxel / COLUMNS as i64])
            {
                (*place, *square, *product) = (*place + at, *square + at * at, *product + at * time);
            }
        }
        let slopes = sums.map(|[place, square, product]| {
            let spread = lit * square - place * place;
            if spread > 0 { (lit * product - place * times).div_euclid(spread) } else { 0 }
        });
        let slope = if self.state == State::Rise { SECOND_SLOPE } else { SLOPE };
        let most = feature_frames(slope, self.rate).min(u16::MAX.into()) as i64;
        let bounded = slopes.map(|slope| slope.clamp(-i64::from(i32::MAX), i32::MAX.into()));
        bounded.iter().map(|slope| slope * slope).sum::<i64>() > most * most
    }

    fn hold(&mut self, frame: u64, light: &Light) {
        let beside = light.beside(&self.pattern, true);
        if light.rises && (beside > self.limit() || light.is_touch(self.noise) && 64 * light.energy > self.press.energy)
        {
            self.begin(State::Rise, frame, light);
            return;
        }
        self.level += (beside - self.level) >> 6;
        self.follow(light, 1, 3);
    }

    /// Returns the energy beside the pattern from which light is not noise.
    fn limit(&self) -> i64 {
        DIFFERS * self.noise.max(self.level)
    }

    fn rise(&mut self, frame: u64, light: &Light) -> Option<Slip> {
        let last = self.now.last[0];
        self.add(frame, light);
        let (age, now, press) = (frame - self.since, self.now, self.press);
        let is_lit = light.rises && 3 * light.energy >= last && light.beside(&self.pattern, true) > self.limit();
        let sums = Light::new(self.light);
        let (beside, energy) = (sums.beside(&self.pattern, false), sums.energy);
        let differs = |part| part * beside > energy;
        let is_more = 4 * now.sum > 5 * press.sum;
        let lasts = press.brightest - self.held_since;
        let (is_short, least) = (2 * lasts <= self.time(KNOWN), self.time(KNOWN).max(lasts));
        // The first frame of a release may show a part of it, and of some rows: then its light jumps in the second one.
        let parts = if age > 1 { 2 } else { 3 + 3 * i64::from(!is_short && light.energy > 32 * last) };
        let is_weak = parts * now.peak < press.peak && differs(50);
        // A release takes as long as its press, and is no brighter.
        let is_known = age > least || 8 * now.peak > 9 * press.peak || is_short && differs(12);
        let is_late = age >= least && is_known && differs(28);
        let is_other = self.may_be_gone && self.is_from_side();
        if is_lit && (is_more || is_weak || is_late) && self.has_most_lit(age) && !is_other {
            if self.arrives() {
                self.turn(State::Other);
                return None;
            }
            return Some(self.slip(frame));
        }
        if 16 * light.energy < now.energy || age >= self.time(LONGEST) {
            self.turn(if 6 * now.sum > press.sum || is_other { State::Other } else { State::Held });
            self.follow(light, 0, 0);
        }
        None
    }

    fn rest(&mut self, frame: u64, light: &Light) {
        self.now.energy = self.now.energy.max(light.energy);
        let is_rest = 256 * light.energy <= self.now.energy || 4 * light.uneven < TOUCH * self.noise;
        self.quiet = if is_rest { self.quiet + 1 } else { 0 };
        if u64::from(self.quiet) >= self.time(REST) {
            if self.state == State::Slip {
                (self.has_moved, self.held_since) = (true, frame);
                self.turn(State::Held);
            } else {
                self.turn(State::Dark);
            }
            self.follow(light, 0, 0);
            return;
        }
        if frame - self.since > self.time(NOISY) {
            self.noise = self.noise.max((self.noise + (self.noise >> 8)).min(light.uneven));
        }
        self.follow(light, 0, 6);
    }
}

const MOST_BYTES: usize = 512;
const _: () = assert!(size_of::<SlipDetector>() <= MOST_BYTES);

#[cfg(test)]
mod tests;
