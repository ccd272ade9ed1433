//! The wave: one shape passes all lit whiskers with one slowness, and each has a gain of its own.

use super::light::{Lines, PAD};
use super::squares::{Moments, ONE_FRAME, Point, Points, Polynomial, TIME_SHIFT, TimePlane, sums};
use crate::params::{COLUMNS, TAXELS};
use crate::reason::Reason;
use crate::touch::motion::{length, sqrt};

/// Fewest and most steps of a shape.
const FEWEST_STEPS: usize = 8;
const MOST_STEPS: usize = 128;
/// Fraction bits of a slowness, of taps, of gains, of a lateness.
const TIME_BITS: u32 = 16;
const TAP_BITS: u32 = 12;
const GAIN_BITS: u32 = 8;
const LATE_BITS: u32 = 12;
/// Largest slowness along either axis, in frames per pitch.
const MOST_SLOWNESS: f32 = 16.0;
/// A whisker's lateness counts as if its gain was at least a 16th.
const WEAKEST_GAIN: i32 = 1 << (GAIN_BITS - 4);
const MOST_GAIN: i32 = (1 << (GAIN_BITS + 3)) - 1;
/// Latest a whisker may be, in frames.
const LATEST: f32 = 8.0;
/// A line is bright above a 32nd of its peak.
const BRIGHT_SHIFT: u32 = 5;
/// A line's rising edge is at 102 of 256 parts of its peak.
const EDGE: i32 = 102;
const EDGE_BITS: u32 = 8;
const ROUNDS: usize = 5;
const PARTS: usize = 3;

/// What is known of a wave at its slowness.
#[derive(Default)]
pub(super) struct Wave {
    /// Frames from a column to the next, and from a row to the one below it.
    pub(super) slowness: [f32; 2],
    /// Sums of weights times monomials.
    pub(super) moments: Moments,
    /// Weighted sums of lateness times monomials, in frames, of the whole touch and of its parts.
    pub(super) late: Polynomial,
    pub(super) parts: [Polynomial; PARTS],
    /// Weighted sums of a sine and a cosine of the time between frames at which each whisker's delay ends.
    pub(super) locked: [Polynomial; 2],
    /// Weighted sum of the squares of lateness.
    pub(super) squares: f32,
    /// Each lit whisker's lateness in 2^-12 frames, gain in 2^-8, and number.
    each: [(i32, i16, u8); TAXELS],
    /// The part of the energy that the wave leaves over.
    pub(super) miss: f32,
    /// What the brighter frame beside a whisker's brightest lacks to 0.94 of its light, at least 0. A flash within a
    /// frame, which is smoothed twice, lacks 0.27.
    pub(super) lacks: f32,
}

impl Wave {
    /// Returns the largest lateness, as far as the gain tells it, and the root of its mean square, both in frames,
    /// without a dome of this height at one pitch from the middle.
    pub(super) fn late_without(&self, dome: f32) -> [f32; 2] {
        let [whole, _, _, xx, _, yy] = self.moments.plane();
        let whole = whole.max(1.0);
        let middle = (xx + yy) / whole;
        let (mut farthest, mut most_gain, mut squares) = (0.0_f32, 1, 0.0);
        for &(late, gain, taxel) in &self.each {
            let ([x, y], gain) = (place_of(taxel.into()), i32::from(gain));
            if gain == 0 {
                continue;
            }
            let late = late as f32 * (1.0 / (1 << LATE_BITS) as f32) - dome * ((x * x + y * y) as f32 - middle);
            let of_gain = late * gain as f32;
            farthest = farthest.max(of_gain.abs());
            most_gain = most_gain.max(gain);
            squares += of_gain * of_gain;
        }
        // Weights are 16ths of the squares of gains.
        [farthest / most_gain as f32, sqrt(squares * (1.0 / 16.0) / whole)]
    }
}

/// A lit whisker: its line, its taxel and place, and in which frames it is bright.
#[derive(Clone, Copy, Default)]
pub(super) struct Whisker<'a> {
    line: &'a [i16],
    peak: i32,
    place: [i32; 2],
    taxel: u8,
    first: u8,
    last: u8,
}

impl Whisker<'_> {
    /// Returns the sum of its place's parts times these.
    fn times(&self, [of_x, of_y]: [i32; 2]) -> i32 {
        of_x * self.place[0] + of_y * self.place[1]
    }

    /// Returns the frames from before the first bright one to the last one, with their light.
    fn light(&self) -> impl Iterator<Item = (i32, i32)> {
        let first = i32::from(self.first) - 1;
        let light = self.line.get(PAD - 1 + usize::from(self.first)..).unwrap_or_default();
        (first..=self.last.into()).zip(light.iter().map(|&light| i32::from(light)))
    }

    /// Returns the light in the brightest frame, and in the brighter one beside it.
    fn brightest(&self) -> [i32; 2] {
        let (mut most, mut beside) = (0, 0);
        let [first, end] = [usize::from(self.first) + PAD - 1, usize::from(self.last) + PAD + 2];
        for &[before, light, after] in self.line.get(first..end).unwrap_or_default().array_windows() {
            if light > most {
                (most, beside) = (light, before.max(after));
            }
        }
        [most, beside].map(i32::from)
    }

    /// Returns the time of the rising edge, where the line first exceeds 40 % of its peak.
    pub(super) fn edge(&self) -> i32 {
        let level = (self.peak * EDGE) >> EDGE_BITS;
        let mut before = 0;
        for (time, light) in self.light() {
            if light > level {
                return (time << TIME_SHIFT) - ((light - level) << TIME_SHIFT) / (light - before.min(level)).max(1);
            }
            before = light;
        }
        0
    }

    /// Returns the time of the middle of the light above a 32nd of the peak.
    pub(super) fn middle(&self) -> i32 {
        let (mut whole, mut sum) = (0, 0);
        for (time, light) in self.light() {
            let light = ((light << 3) - (self.peak >> (BRIGHT_SHIFT - 3))).max(0);
            // Below 2^15 · 70, and 2^15 · 2,415.
            (whole, sum) = (whole + light, sum + light * time);
        }
        let whole = whole.max(1);
        ((sum / whole) << TIME_SHIFT) + ((sum % whole) << TIME_SHIFT) / whole
    }
}

/// Returns the place of a whisker: columns to the right of the middle, and rows below it.
pub(crate) const fn place_of(taxel: usize) -> [i32; 2] {
    // A fifth of what is below 64, for processors that do not divide.
    let row = (taxel as i32 * 13) >> 6;
    [taxel as i32 - row * COLUMNS as i32 - 2, row - 2]
}

/// Lit whiskers.
pub(super) struct Whiskers<'a> {
    all: [Whisker<'a>; TAXELS],
    count: usize,
    /// The lines' length, if the touch is not over there.
    cut: Option<i32>,
}

impl<'a> Whiskers<'a> {
    /// Creates the list of whiskers that `lit` says.
    pub(super) fn new(lines: &'a Lines, lit: u32) -> Self {
        let mut whiskers = lines.padded().enumerate().filter(|(taxel, _)| lit >> taxel & 1 == 1);
        let all = core::array::from_fn(|_| {
            let Some((taxel, (line, peak))) = whiskers.next() else { return Whisker::default() };
            let is_bright = |&light: &i16| i32::from(light) << BRIGHT_SHIFT > peak;
            let light = line.get(PAD..PAD + lines.length).unwrap_or_default();
            let first = light.iter().position(is_bright).unwrap_or(0) as u8;
            let last = light.iter().rposition(is_bright).unwrap_or(0) as u8;
            Whisker { line, peak, place: place_of(taxel), taxel: taxel as u8, first, last }
        });
        Self { all, count: lit.count_ones() as usize, cut: lines.is_cut.then_some(lines.length as i32) }
    }

    fn iter(&self) -> impl Iterator<Item = &Whisker<'a>> {
        self.all.iter().take(self.count)
    }

    /// Returns a time of each lit whisker, weighted by its peak.
    pub(super) fn points(&self, time: impl Fn(&Whisker<'a>) -> i32) -> Points {
        self.each(&[(); TAXELS], |whisker, ()| Point { time: time(whisker), weight: whisker.peak })
    }

    /// Returns the slowness of a plane through the rising edges.
    #[inline(never)]
    pub(super) fn start(&self) -> [f32; 2] {
        TimePlane::new(&self.points(Whisker::edge), u32::MAX).slope(1e-3).map(|slowness| slowness * (1.0 / ONE_FRAME))
    }

    /// Returns a value of each lit whisker, and 0 of others.
    fn each<O, T: Copy + Default>(&self, of: &[O], value: impl Fn(&Whisker<'a>, &O) -> T) -> [T; TAXELS] {
        let mut values = [T::default(); TAXELS];
        for (whisker, of) in self.iter().zip(of) {
            if let Some(place) = values.get_mut(usize::from(whisker.taxel)) {
                *place = value(whisker, of);
            }
        }
        values
    }

    /// Fills an empty wave by Gauss-Newton steps from its slowness on.
    ///
    /// # Errors
    /// Nothing holds for all whiskers.
    #[inline(never)]
    pub(super) fn fill(&self, wave: &mut Wave) -> Result<(), Reason> {
        let (mut slowness, mut sums, mut number) = (wave.slowness, Sums::default(), 1);
        loop {
            sums.fill(self, slowness.map(turn))?;
            let step = sums.step(self)?;
            let size = length(step);
            let whole = length(slowness);
            let most = 0.2 * whole + 0.08;
            let part = if size > most { most / size } else { 1.0 };
            let step = step.map(|along| along * part);
            slowness = [slowness[0] + step[0], slowness[1] + step[1]];
            if number == ROUNDS || size < 0.006 * whole {
                (wave.slowness, wave.moments) = (slowness, sums.moments);
                sums.end(self, step, wave);
                sums.parts(self, wave);
                return Ok(());
            }
            number += 1;
        }
    }
}

/// Returns sums of values with [`LATE_BITS`] fraction bits.
#[inline(never)]
fn frames(sums: [i64; 6]) -> Polynomial {
    sums.map(|sum| sum as f32 * (1.0 / (1 << LATE_BITS) as f32))
}

/// Returns frames in units of 2^-16.
#[inline(never)]
fn turn(slowness: f32) -> i32 {
    (slowness.clamp(-MOST_SLOWNESS, MOST_SLOWNESS) * (1 << TIME_BITS) as f32) as i32
}

/// Returns a sine, within 6 %, of turns in units of 2^-16: two parabolas.
fn sine(turns: i32) -> i32 {
    let turns = i32::from(turns as i16);
    (turns * ((1 << (TIME_BITS - 1)) - turns.abs())) >> (2 * TIME_BITS - 4 - LATE_BITS)
}

/// Sums of a whisker's products with the shape.
#[derive(Default)]
struct OfWhisker {
    /// With the shape, and with its derivative in each part.
    zm: i32,
    zd: [i32; PARTS],
    zz: i32,
    /// In units of 2^-8 and of 2^-12 frames.
    gain: i32,
    late: i32,
}

impl OfWhisker {
    fn weight(&self) -> i32 {
        // Squares of gains are below 2^22.
        (self.gain * self.gain) >> 4
    }

    fn weighted(&self, value: i32) -> i64 {
        i64::from(self.weight()) * i64::from(value)
    }

    /// Returns a value times the weight over the gain, as far as that counts for lateness.
    fn times_weight_by_gain(&self, value: i32) -> i64 {
        let by = if self.gain < WEAKEST_GAIN { self.gain * self.gain } else { self.gain * WEAKEST_GAIN };
        i64::from(by) * i64::from(value)
    }
}

/// Sums over the steps of a shape.
#[derive(Default)]
struct Sums {
    of: [OfWhisker; TAXELS],
    mm: i32,
    md: [i32; PARTS],
    dd: [i32; PARTS],
    moments: Moments,
}

impl Sums {
    /// Sums up the whiskers' lines, each shifted by its delay.
    #[inline(never)]
    fn fill(&mut self, whiskers: &Whiskers<'_>, delays: [i32; 2]) -> Result<(), Reason> {
        let (mut start, mut end) = (i32::MAX, i32::MIN);
        for whisker in whiskers.iter() {
            start = start.min((i32::from(whisker.first) << TIME_BITS) - whisker.times(delays));
            end = end.max((i32::from(whisker.last) << TIME_BITS) - whisker.times(delays));
        }
        let start = (start >> TIME_BITS) - 2;
        let end = -((-end) >> TIME_BITS) + 3;
        // The last two frames are smoothed with what is unknown, and interpolation reads two more.
        let known = whiskers.cut.and_then(|cut| {
            whiskers.iter().map(|whisker| (((cut - 4) << TIME_BITS) - whisker.times(delays)) >> TIME_BITS).min()
        });
        let steps = usize::try_from(known.map_or(end, |known| end.min(known)) - start).unwrap_or(0);
        if steps < FEWEST_STEPS {
            return Err(Reason::NotOver);
        }
        let mut shape = [0_i32; MOST_STEPS];
        let shape = shape.get_mut(..steps).ok_or(Reason::NotAlike)?;
        for whisker in whiskers.iter() {
            Shifted::new(whisker, delays, start, steps).add_to(shape);
        }
        // The mean of the lit whiskers.
        let by = (1 << TIME_BITS) / (whiskers.count as i32).max(1);
        for light in shape.iter_mut() {
            *light = (*light * by) >> TIME_BITS;
        }
        let (mut before, mut mm, mut energy) = (0, 0, 0);
        for number in 0..steps {
            let after = shape.get(number + 1).map_or(if known.is_some() { before } else { 0 }, |&light| light);
            let Some(step) = shape.get_mut(number) else { break };
            let (light, slope) = (*step, (after - before + 1) >> 1);
            // Both are below 2^13: the light is in the lower half, and the slope in the upper one.
            *step = light & 0xFFFF | slope << 16;
            (before, mm, energy) = (light, mm + light * light, energy + slope * slope);
        }
        // Three parts of equal energy of the derivative.
        (self.mm, self.md, self.dd) = (mm, [0; PARTS], [0; PARTS]);
        let mut cuts = [steps; PARTS];
        let (mut so_far, mut part) = (0, 0);
        for (number, &step) in shape.iter().enumerate() {
            let (light, slope) = (i32::from(step as i16), step >> 16);
            so_far += slope * slope;
            while part < PARTS - 1 && so_far >= (energy / PARTS as i32) * (part as i32 + 1) {
                if let Some(cut) = cuts.get_mut(part) {
                    *cut = number;
                }
                part += 1;
            }
            if let (Some(md), Some(dd)) = (self.md.get_mut(part), self.dd.get_mut(part)) {
                *md += light * slope;
                *dd += slope * slope;
            }
        }
        for (whisker, of) in whiskers.iter().zip(&mut self.of) {
            let shifted = Shifted::new(whisker, delays, start, steps);
            let mut first = 0;
            (of.zm, of.zz) = (0, 0);
            for (zd, cut) in of.zd.iter_mut().zip(cuts) {
                *zd = shifted.sum(shape, first, cut, &mut of.zm, &mut of.zz);
                first = cut;
            }
        }
        Ok(())
    }

    /// Returns the Gauss-Newton step; sets each whisker's gain and lateness.
    #[inline(never)]
    fn step(&mut self, whiskers: &Whiskers<'_>) -> Result<[f32; 2], Reason> {
        let [md, dd] = [self.md, self.dd].map(|parts| parts.iter().map(|&part| part as f32).sum::<f32>());
        // What the derivative's part along the shape leaves.
        let told = dd - md * md / self.mm as f32;
        if self.mm == 0 || told.is_nan() || told <= 0.0 {
            return Err(Reason::NotAlike);
        }
        let unit = (1 << LATE_BITS) as f32 / told;
        let most = LATEST * (1 << LATE_BITS) as f32;
        let md = md * (1.0 / (1 << GAIN_BITS) as f32);
        for of in self.of.iter_mut().take(whiskers.count) {
            of.gain = (of.zm / (self.mm >> GAIN_BITS).max(1)).clamp(-MOST_GAIN, MOST_GAIN);
            let zd: i32 = of.zd.iter().sum();
            let told = ((zd as f32 - of.gain as f32 * md) * unit).clamp(-most, most) as i32;
            of.late = (told << GAIN_BITS) / of.gain.max(WEAKEST_GAIN);
        }
        self.moments = Moments::new(&whiskers.each(&self.of, |_, of| of.weight()));
        let late = frames(sums(&whiskers.each(&self.of, |_, of| of.weighted(of.late))));
        Ok(TimePlane::of_sums(self.moments.plane(), late).slope(1e-4).map(|along| -along))
    }

    /// Fills the lateness of the wave's parts.
    // Not a part of `end`, whose memory it would add to.
    #[inline(never)]
    fn parts(&self, whiskers: &Whiskers<'_>, wave: &mut Wave) {
        let gains = sums(&whiskers.each(&self.of, |_, of| of.times_weight_by_gain(of.gain)));
        for (number, ((part, md), dd)) in wave.parts.iter_mut().zip(self.md).zip(self.dd).enumerate() {
            let zd = |of: &OfWhisker| of.times_weight_by_gain(of.zd.get(number).copied().unwrap_or(0));
            let (md, by) = (md as f32 * (1.0 / (1 << GAIN_BITS) as f32), 1.0 / (dd as f32).max(1.0));
            for ((sum, zd), gain) in
                part.iter_mut().zip(sums(&whiskers.each(&self.of, |_, of| zd(of)))).zip(gains).take(3)
            {
                *sum = (zd as f32 - gain as f32 * md) * by;
            }
        }
    }

    /// Fills the wave after a last step.
    #[inline(never)]
    fn end(&mut self, whiskers: &Whiskers<'_>, step: [f32; 2], wave: &mut Wave) {
        let step = step.map(|along| (along * (1 << LATE_BITS) as f32) as i32);
        let mut sum = 0;
        for (whisker, of) in whiskers.iter().zip(&mut self.of) {
            of.late += whisker.times(step);
            sum += of.weighted(of.late);
        }
        let mean = (sum as f32 / self.moments.plane()[0].max(1.0)) as i32;
        let (mut squares, mut energy, mut explained) = (0_i64, 0.0_f32, 0.0_f32);
        let (of_mm, mut peaks) = (1.0 / (self.mm as f32).max(1.0), [0_i32; 2]);
        for ((whisker, of), place) in whiskers.iter().zip(&mut self.of).zip(&mut wave.each) {
            of.late -= mean;
            *place = (of.late, of.gain as i16, whisker.taxel);
            squares += of.weighted(of.late) * i64::from(of.late);
            let (zm, zz) = (of.zm as f32, of.zz as f32);
            energy += zz;
            // Not by the gain, whose rounding leaves more than the noise does.
            explained += (zm * zm * of_mm).min(zz);
            let [most, beside] = whisker.brightest();
            peaks = [peaks[0] + most, peaks[1] + beside];
        }
        wave.late = frames(sums(&whiskers.each(&self.of, |_, of| of.weighted(of.late))));
        let turns = wave.slowness.map(turn);
        for (locked, quarters) in wave.locked.iter_mut().zip(0..) {
            // Sines are below 2^12, weights below 2^18.
            let value = |whisker: &Whisker<'_>, of: &OfWhisker| {
                i64::from(of.weight() * sine(whisker.times(turns) + (quarters << (TIME_BITS - 2))))
            };
            *locked = frames(sums(&whiskers.each(&self.of, value)));
        }
        let unit = 1.0 / (1 << LATE_BITS) as f32;
        wave.squares = squares as f32 * unit * unit;
        wave.miss = if energy > 0.0 { (1.0 - explained / energy).max(0.0) } else { 1.0 };
        wave.lacks = (0.94 - peaks[1] as f32 / peaks[0].max(1) as f32).max(0.0);
    }
}

/// A line that is shifted by cubic convolution (Keys 1981).
struct Shifted<'a> {
    taps: [i32; 4],
    /// The first step that it has a part in, and its light from a step before that on.
    from: usize,
    values: &'a [i16],
}

impl<'a> Shifted<'a> {
    fn new(whisker: &Whisker<'a>, delays: [i32; 2], start: i32, steps: usize) -> Self {
        let (line, delay) = (whisker.line, whisker.times(delays));
        let u = (delay & 0xFFFF) >> (TIME_BITS - TAP_BITS);
        let square = (u * u) >> TAP_BITS;
        let cube = (square * u) >> TAP_BITS;
        let first = (2 * square - u - cube) >> 1;
        let third = (u + 4 * square - 3 * cube) >> 1;
        let last = (cube - square) >> 1;
        let taps = [first, (1 << TAP_BITS) - first - third - last, third, last];
        // The step's place in the line, less one.
        let at = start + (delay >> TIME_BITS) - 1 + PAD as i32;
        let from = (-at).max(0) as usize;
        let behind = (at + from as i32) as usize;
        let to = (line.len() as i32 - 3 - at).clamp(0, steps as i32) as usize;
        let values = line.get(behind..(behind + to.saturating_sub(from) + 3).min(line.len()));
        Self { taps, from, values: values.filter(|_| from < to).unwrap_or_default() }
    }

    fn of(&self, values: &'a [i16]) -> impl Iterator<Item = i32> + use<'a> {
        let [a, b, c, d] = self.taps;
        values.array_windows().map(move |&[p, q, r, s]| {
            let outer = a * i32::from(p) + d * i32::from(s);
            let inner = b * i32::from(q) + c * i32::from(r);
            (outer + inner + (1 << (TAP_BITS - 1))) >> TAP_BITS
        })
    }

    fn add_to(&self, shape: &mut [i32]) {
        for (sum, light) in shape.get_mut(self.from..).unwrap_or_default().iter_mut().zip(self.of(self.values)) {
            *sum += light;
        }
    }

    /// Adds the products of the steps from `first` to before `end`, and returns those with the slope.
    fn sum(&self, shape: &[i32], first: usize, end: usize, zm: &mut i32, zz: &mut i32) -> i32 {
        let first = first.max(self.from);
        let values = self.values.get(first - self.from..).unwrap_or_default();
        let shape = shape.get(first..end).unwrap_or_default();
        let (mut of_zm, mut of_zd, mut of_zz) = (0, 0, 0);
        for (z, &step) in self.of(values).zip(shape) {
            // Below 2^13: a core with products of halves takes them at once.
            let (z, m, d) = (i32::from(z as i16), i32::from(step as i16), step >> 16);
            of_zm += z * m;
            of_zd += z * d;
            of_zz += z * z;
        }
        (*zm, *zz) = (*zm + of_zm, *zz + of_zz);
        of_zd
    }
}
