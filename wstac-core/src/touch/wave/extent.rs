//! Where and how wide a touch is, across its motion.
//!
//! A whisker's energy tells how deep the object bends it. Three cuts of an object are compared with the 25 energies:
//! one with upright sides, one with sloping ones, and that of a ball. Borders between two whiskers, of which one is
//! lit, are alike in their likelihood, so an answer is a mean over all borders and cuts, and its deviation is theirs.

use core::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

use super::fit::place_of;
use super::outline::{highest, valley};
use super::squares::{Fit, Moments, Normal, Polynomial, sums};
use crate::exp::{EXP_FRACTION_BITS, EXP_ONE, exp_of_negative};
use crate::params::{PITCH_MM, TAXELS};
use crate::touch::motion::sqrt;

/// A quantity with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Measured {
    /// The value: in mm, or in mm/s² of an acceleration.
    pub value: f32,
    /// Its standard deviation in the same unit, above 0.
    pub sd: f32,
}

/// Where and how wide a touch is, across its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Extent {
    /// The middle of the object's path, from the sensor's middle to the left of the motion, within 14 mm.
    ///
    /// `None` if a side of the path is beyond the whiskers, with two contacts, in a motion along rows, columns or
    /// diagonals, or if no cut explains the light.
    pub place_mm: Option<Measured>,
    /// The width of the object where it begins to bend the longest whisker, above 0: of a ball, its patch.
    ///
    /// It is there if the place is. A ball whose light grows less steeply from its border than by the root of the
    /// overlap seems up to 1.2 mm narrower, beyond its deviation.
    pub width_mm: Option<Measured>,
    /// Objects side by side, with dark whiskers between them: 1 or 2, and 0 in the dark. Of objects one behind the
    /// other it counts one.
    pub contacts: u8,
}

/// Units of a length to the millimeter, and of a pitch.
const MM: i32 = 256;
const PITCH: f32 = PITCH_MM * MM as f32;
/// Fraction bits of an energy and of a height: of its square, and of the inverse of its deviation.
const BITS: u32 = 10;
const ONE: i32 = 1 << BITS;
const SURE_BITS: u32 = 4;
const SQUARE_BITS: u32 = 2 * SURE_BITS;
/// Bits of a whisker's light that count.
const LIGHT_BITS: u32 = 19;
/// Most energy, of that of the second brightest whisker, and the least of a lit one: 1.25 and 0.15.
const MOST_ENERGY: i32 = 1280;
const LIT_ENERGY: i32 = 154;
const FEWEST: u32 = 5;
/// The deviation of a height: 0.035 and 0.085 of it.
const SD: [i32; 2] = [36, 87];
/// Most that a whisker counts, as one that is dead: a square of 12.
const MOST_SQUARE: i32 = 12 << SQUARE_BITS;
/// The usual height of the dome, of the overlap, and most of it.
const DOME: f32 = 0.55;
const MOST_DOME: f32 = 0.9;
/// A place has the square of its pitches from the middle times so much of the dome.
const DOME_SHIFT: u32 = 3;
const RIDGE: f32 = 2e-3;
/// Places of a border, from half a millimeter inside the last lit whisker to 0.8 mm behind the third dark one, or 2.5
/// mm beyond all.
const BORDERS: usize = 12;
const INSIDE: i32 = MM / 2;
const BEHIND: i32 = 205;
const BEYOND: i32 = 640;
/// Sides of 0.3 and 1.2 mm: their slopes, and their height at the border.
const SIDES: [[i32; 2]; 2] = [[3413, ONE / 2], [853, 0]];
const SLOPING: i32 = 307;
/// Steps of a ball's half width, 0.3 mm.
const BALL_STEP: i32 = 77;
/// Least curvature of a ball's cut, in heights to the square pitch.
const LEAST_CURVATURE: f32 = 1.6e-3;
/// Largest deviation of a ball's middle, in mm.
const MOST_BALL_SD: f32 = 0.8;
/// Deviation of a ball's width, of half of it: the law by which light grows from the border on is not known.
const OF_LAW: f32 = 0.08;
/// Nine square millimeters: the square of the overlap.
const OVERLAP_2: i32 = 9 * MM * MM;
/// Limits of an amplitude.
const OF_SIDES: [i32; 2] = [614, 1638];
const OF_BALL: [i32; 2] = [717, 1638];
/// Largest sum of squares, and the largest probability of a border beyond the whiskers.
const MOST_MISS: i32 = 60 << SQUARE_BITS;
const MOST_BEYOND: f32 = 0.03;
/// Squares that count as seen before, and their number.
const BEFORE: f32 = 8.0;
/// What cuts are apart counts half: none of them is that of a true object.
const APART: f32 = 0.5;
/// Of the place and of the width: a factor of the variance, the least deviation in mm, and mm to a radian of direction.
const SPREAD: [f32; 2] = [1.0, 0.9];
const LEAST: [f32; 2] = [0.04, 0.1];
const TO_RADIAN: [f32; 2] = [0.855, 2.85];
/// Along rows and columns, within 2°, whiskers are in five places across the motion: too few to tell a cut by.
const LEAST_OBLIQUE: f32 = 0.035;
/// Along diagonals, within 2.5°, they are in nine places, of which the outer ones have one or two: coins of 13 mm got
/// widths of 18 mm.
const FROM_DIAGONAL: f32 = 0.062;
const NOWHERE: i32 = i32::MAX;
/// Units of an argument of [`exp_of_negative`] to those of a square; and one unit of its result.
const SCALE: f32 = (1 << (EXP_FRACTION_BITS - SQUARE_BITS)) as f32;
const LIKELY: f32 = 1.0 / EXP_ONE as f32;

/// A whisker: its place across the motion, its height, and how sure it is.
#[derive(Clone, Copy, Default)]
struct Whisker {
    across: i32,
    height: i16,
    /// Inverse of the height's deviation.
    sure: i16,
    /// How much the dome lowers it.
    lowered: i16,
    /// Square of its pitches from the middle.
    far: i8,
    is_lit: bool,
}

impl Whisker {
    /// Returns the inverse of the height's variance.
    fn weight(&self) -> i32 {
        (i32::from(self.sure) * i32::from(self.sure)) >> SQUARE_BITS
    }

    /// Returns the height of a cut, here above the whisker's tip.
    fn above(&self, height: i32) -> i32 {
        if height > 0 { (height - i32::from(self.lowered)).max(0) } else { 0 }
    }

    /// Returns the square of what a height leaves, in variances.
    fn square(&self, height: i32) -> i32 {
        let rest = ((i32::from(self.height) - height) * i32::from(self.sure)) >> BITS;
        (rest * rest).min(MOST_SQUARE)
    }
}

type Whiskers = [Whisker; TAXELS];

/// What one of the cuts says: how likely it is; means and variances of the place and of the width, in mm.
#[derive(Clone, Copy)]
struct OfCut {
    mass: f32,
    mean: [f32; 2],
    variance: [f32; 2],
    beyond: f32,
}

/// Borders of one side: their sums of squares, the first one, and the way from one to the next.
struct Borders {
    squares: [[i32; BORDERS]; 2],
    first: i32,
    step: i32,
    last_whisker: i32,
}

/// Mean and variance of a place in mm by its likelihood; its integral, and the part of it beyond the whiskers.
struct Likely {
    mean: f32,
    variance: f32,
    mass: f32,
    beyond: f32,
}

impl Extent {
    /// Returns where a touch is by each whisker's light over all of it, and by the direction in which it moved.
    ///
    /// The unit of the light is free, and what is below 0 counts as dark. The direction is that of a
    /// [`Velocity`](crate::touch::motion::Velocity), from 0 to 360 degrees; any other one has no contacts.
    ///
    /// ```
    /// use wstac_core::touch::wave::Extent;
    ///
    /// // A rod of 9 mm moves upward at 60°. Its middle passes 1 mm to the left of the sensor's.
    /// let light = core::array::from_fn(|taxel| {
    ///     let (x, y) = (4.0 * (taxel % 5) as f32 - 8.0, 8.0 - 4.0 * (taxel / 5) as f32);
    ///     let left = -0.866 * x + 0.5 * y;
    ///     if (left - 1.0).abs() < 4.5 { 1000 } else { 0 }
    /// });
    /// let extent = Extent::new(&light, 60.0, 0.5);
    /// let (place, width) = (extent.place_mm.unwrap(), extent.width_mm.unwrap());
    /// assert!((place.value - 1.0).abs() < 2.0 * place.sd && (width.value - 9.0).abs() < 3.0 * width.sd);
    /// assert_eq!(extent.contacts, 1);
    /// ```
    #[inline(never)]
    pub fn new(light: &[i32; TAXELS], degrees: f32, degrees_sd: f32) -> Self {
        let mut extent = Self { place_mm: None, width_mm: None, contacts: 0 };
        let Some(energies) = relative(light).filter(|_| (0.0..=360.0).contains(&degrees)) else { return extent };
        let [right, up] = unit(degrees);
        extent.contacts = 1 + u8::from(valley(&energies, right, up).is_some());
        let [x, y] = [right.abs(), up.abs()];
        let is_oblique = x.min(y) > LEAST_OBLIQUE && (x - y).abs() > FROM_DIAGONAL;
        if extent.contacts == 1
            && is_oblique
            && let Some([place, width]) = across(&energies, right, up, degrees_sd * (PI / 180.0))
        {
            (extent.place_mm, extent.width_mm) = (Some(place), Some(width));
        }
        extent
    }
}

/// Returns the energies in units of a 1,024th of the second brightest, below twice that; `None` in the dark.
fn relative(light: &[i32; TAXELS]) -> Option<[i16; TAXELS]> {
    let most = light.iter().copied().max().unwrap_or(0).max(0);
    let shift = (i32::BITS - most.leading_zeros()).saturating_sub(LIGHT_BITS);
    let light = light.map(|light| light >> (shift & 31));
    let [most, second] = highest(light.into_iter());
    let by = if second > 0 { second } else { most };
    // Not `clamp`, whose check of its limits is a panic that stays in small programs.
    (by > 0).then(|| light.map(|light| ((light.min(2 * by).max(0) << BITS) / by) as i16))
}

/// Returns the cosine and the sine of an angle in degrees, off by less than 10⁻⁵.
pub(super) fn unit(degrees: f32) -> [f32; 2] {
    let quarters = (degrees * (1.0 / 90.0)) as i32;
    let angle = (degrees - 90.0 * quarters as f32) * (PI / 180.0);
    let sine = |x: f32| {
        let square = x * x;
        let (mut term, mut sum) = (x, x);
        for number in [6.0, 20.0, 42.0, 72.0] {
            term *= (0.0 - square) / number;
            sum += term;
        }
        sum
    };
    let (s, c) = (sine(angle), sine(FRAC_PI_2 - angle));
    match quarters & 3 {
        0 => [c, s],
        1 => [0.0 - s, c],
        2 => [0.0 - c, 0.0 - s],
        _ => [s, 0.0 - c],
    }
}

/// Returns the place and the width of a touch of these energies.
#[inline(never)]
fn across(energies: &[i16; TAXELS], right: f32, up: f32, angle_sd: f32) -> Option<[Measured; 2]> {
    let mut whiskers = [Whisker::default(); TAXELS];
    let lit = Some(seen(energies, right, up, &mut whiskers)).filter(|&lit| lit >= FEWEST)?;
    let of_plane = cut(&mut whiskers, right, up)?;
    let is_lit = |whisker: &&Whisker| whisker.is_lit;
    let last = whiskers.iter().filter(is_lit).map(|whisker| whisker.across).max()?;
    let first = whiskers.iter().filter(is_lit).map(|whisker| whisker.across).min()?;
    let amplitude = amplitude(&whiskers, first, last);
    let middle = (first + last) >> 1;
    let sides = [1, -1].map(|sign| Borders::new(&whiskers, sign, sign * middle, amplitude));
    let [left, right] = sides.each_ref().map(|side| side.squares.each_ref().map(|squares| least(squares)));
    let of_sides = [left[0] + right[0], left[1] + right[1]];
    let ball = Ball::new(&whiskers, &of_plane, first, last);
    let of_ball = ball.as_ref().map_or(NOWHERE, |ball| least(&ball.squares));
    let least = of_ball.min(of_sides[0]).min(of_sides[1]);
    if least > MOST_MISS {
        return None;
    }
    let scale = (BEFORE + least as f32 * (1.0 / (1 << SQUARE_BITS) as f32)) / (BEFORE + 2.0 + lit as f32);
    let scale = 0.5 / scale.max(1.0) * SCALE;
    let likely = |more: i32| likelihood(more, APART * scale) as f32 * LIKELY;
    let mut parts = [OfCut { mass: 0.0, mean: [0.0; 2], variance: [0.0; 2], beyond: 0.0 }; 3];
    for ((part, squares), kind) in parts.iter_mut().zip(of_sides).zip(0..) {
        let [left, right] = [&sides[0], &sides[1]].map(|side| side.likely(kind, scale));
        *part = OfCut {
            mass: left.mass * right.mass * likely(squares - least),
            mean: [0.5 * (left.mean - right.mean), left.mean + right.mean],
            variance: [0.25 * (left.variance + right.variance), left.variance + right.variance],
            beyond: 1.0 - (1.0 - left.beyond) * (1.0 - right.beyond),
        };
    }
    if let (Some(ball), Some(part)) = (ball, parts.last_mut()) {
        *part = ball.part(scale, likely(of_ball - least));
    }
    let whole: f32 = parts.iter().map(|part| part.mass).sum();
    let mean_of = |values: [f32; 3]| parts.iter().zip(values).map(|(part, of)| part.mass * of).sum::<f32>() / whole;
    if !(whole > 0.0 && mean_of(parts.map(|part| part.beyond)) < MOST_BEYOND) {
        return None;
    }
    let measured = |k: usize| {
        let at = |pair: &[f32; 2]| pair.get(k).copied().unwrap_or(0.0);
        let value = mean_of(parts.map(|part| at(&part.mean)));
        let variance = mean_of(parts.map(|part| {
            let off = at(&part.mean) - value;
            at(&part.variance) + off * off
        }));
        let (turned, least) = (at(&TO_RADIAN) * angle_sd, at(&LEAST));
        Measured { value, sd: sqrt(at(&SPREAD) * variance + turned * turned + least * least) }
    };
    let (place, width) = (measured(0), measured(1));
    (width.value > 0.0).then_some([place, width])
}

fn least(squares: &[i32]) -> i32 {
    squares.iter().copied().min().unwrap_or(0)
}

/// Returns how likely squares are that are so much above the least, in units of 2^-31; `scale` is half the inverse of a
/// square's scale, in units of [`SCALE`].
fn likelihood(more: i32, scale: f32) -> u32 {
    exp_of_negative((more as f32 * scale) as u32)
}

/// Fills the whiskers with their heights, and returns how many are lit.
fn seen(energies: &[i16; TAXELS], right: f32, up: f32, whiskers: &mut Whiskers) -> u32 {
    let [right, up] = [right, up].map(|part| (part * PITCH) as i32);
    let mut lit = 0;
    for ((taxel, whisker), &energy) in whiskers.iter_mut().enumerate().zip(energies) {
        let [x, y] = place_of(taxel);
        let energy = i32::from(energy).min(MOST_ENERGY);
        let height = (energy * (ONE + energy)) >> (BITS + 1);
        *whisker = Whisker {
            across: -x * up - y * right,
            far: (x * x + y * y) as i8,
            height: height as i16,
            sure: ((ONE << SURE_BITS) / (SD[0] + ((SD[1] * height) >> BITS)).max(1)) as i16,
            lowered: 0,
            is_lit: energy > LIT_ENERGY,
        };
        lit += u32::from(whisker.is_lit);
    }
    lit
}

/// Fits a parabola across the motion on a dome to the lit whiskers, and sets how much the dome lowers each.
#[inline(never)]
fn cut(whiskers: &mut Whiskers, right: f32, up: f32) -> Option<Fit> {
    let usual = (DOME * ONE as f32) as i32;
    let (mut weights, mut heights, mut squares, mut count) = ([0; TAXELS], [0_i64; TAXELS], 0_i64, 0);
    for ((whisker, place), sum) in
        whiskers.iter().zip(&mut weights).zip(&mut heights).filter(|((whisker, _), _)| whisker.is_lit)
    {
        let weight = whisker.weight();
        let height = i32::from(whisker.height) + ((usual * i32::from(whisker.far)) >> DOME_SHIFT);
        // Below 2^10 · 2^11.
        (*place, *sum) = (weight, i64::from(weight * height));
        squares += i64::from(weight * height) * i64::from(height);
        count += 1;
    }
    let unit = 1.0 / ONE as f32;
    let one: Polynomial = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let left: Polynomial = [0.0, 0.0 - up, 0.0 - right, 0.0, 0.0, 0.0];
    let left_2 = [0.0, 0.0, 0.0, up * up, 2.0 * right * up, right * right];
    let far = [0.0, 0.0, 0.0, 1.0, 0.0, 1.0];
    let sums = sums(&heights).map(|sum| sum as f32 * unit);
    let normal = Normal::new(&Moments::new(&weights).products(), &[one, left, left_2, far], &sums);
    let found = normal.fit(&[0, 1, 2, 3], squares as f32 * unit * unit, count, RIDGE)?;
    let [height, slope, bow, dome, _] = found.coefficients;
    let top = whiskers.iter().filter(|whisker| whisker.is_lit).fold(0.3_f32, |top, whisker| {
        let across = whisker.across as f32 * (1.0 / PITCH);
        top.max(height + across * (slope + across * bow))
    });
    let lowered = (DOME - (1 << DOME_SHIFT) as f32 * dome) / top;
    let lowered = (lowered.clamp(0.0, MOST_DOME) * ONE as f32) as i32;
    for whisker in whiskers {
        whisker.lowered = ((lowered * i32::from(whisker.far)) >> DOME_SHIFT) as i16;
    }
    Some(found)
}

/// Returns the height of the lit whiskers between two, of what the dome leaves of it.
#[inline(never)]
fn amplitude(whiskers: &Whiskers, first: i32, last: i32) -> i32 {
    let inner = |whisker: &Whisker| whisker.across > first + SLOPING && whisker.across < last - SLOPING;
    let is_known = whiskers.iter().filter(|whisker| whisker.is_lit && inner(whisker)).count() >= 3;
    let height = |whisker: &Whisker| if is_known && !inner(whisker) { 0 } else { ONE - i32::from(whisker.lowered) };
    ratio(whiskers, OF_SIDES, &whiskers.each_ref().map(height))
}

/// Returns the factor that fits heights to those of lit whiskers, within limits.
fn ratio(whiskers: &Whiskers, [least, most]: [i32; 2], heights: &[i32; TAXELS]) -> i32 {
    let (mut products, mut squares) = (0, 0);
    for (whisker, &height) in whiskers.iter().zip(heights).filter(|(whisker, _)| whisker.is_lit) {
        // Below 25 · 2^10 · 2^11.
        products += whisker.weight() * ((i32::from(whisker.height) * height) >> BITS);
        squares += whisker.weight() * ((height * height) >> BITS);
    }
    ((products as f32 / (squares as f32).max(1.0) * ONE as f32) as i32).clamp(least, most)
}

impl Borders {
    /// Compares borders on one side. Whiskers from `middle` on count; with the sign −1 all is mirrored.
    #[inline(never)]
    fn new(whiskers: &Whiskers, sign: i32, middle: i32, amplitude: i32) -> Self {
        let (mut last_whisker, mut last) = (i32::MIN, i32::MIN);
        for whisker in whiskers {
            last_whisker = last_whisker.max(sign * whisker.across);
            if whisker.is_lit {
                last = last.max(sign * whisker.across);
            }
        }
        let mut dark = [NOWHERE - BEHIND; 3];
        for whisker in whiskers.iter().filter(|whisker| !whisker.is_lit && sign * whisker.across > last) {
            let mut at = sign * whisker.across;
            for place in &mut dark {
                if at < *place {
                    core::mem::swap(place, &mut at);
                }
            }
        }
        let end = (dark[2] + BEHIND).min(last_whisker + BEYOND);
        let step = (end - (last - INSIDE)) / BORDERS as i32;
        let mut borders = Self { squares: [[0; BORDERS]; 2], first: last - INSIDE + step / 2, step, last_whisker };
        for whisker in whiskers.iter().filter(|whisker| sign * whisker.across >= middle) {
            let of = |height| whisker.square((whisker.above(height) * amplitude) >> BITS);
            let [outside, inside] = [of(0), of(ONE)];
            for (squares, [slope, at_border]) in borders.squares.iter_mut().zip(SIDES) {
                let mut from_border = borders.first - sign * whisker.across;
                for square in squares {
                    let height = ((from_border * slope) >> 8) + at_border;
                    *square += match height {
                        ..=0 => outside,
                        ONE.. => inside,
                        _ => of(height),
                    };
                    from_border += step;
                }
            }
        }
        borders
    }

    /// Returns the border of a kind of side.
    fn likely(&self, kind: usize, scale: f32) -> Likely {
        let squares = self.squares.get(kind).map_or(&[][..], |squares| squares);
        Likely::new(squares, self.first, self.step, scale, |place| place > self.last_whisker)
    }
}

impl Likely {
    /// Returns what sums of squares say of places at even steps.
    fn new(squares: &[i32], first: i32, step: i32, scale: f32, is_beyond: impl Fn(i32) -> bool) -> Self {
        let least = least(squares);
        let (mut whole, mut sum, mut square, mut beyond) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
        let width = step as f32 * (1.0 / MM as f32);
        let likely = squares.iter().map(|squares| likelihood(squares - least, scale));
        for (likely, number) in likely.zip(0_i32..).filter(|&(likely, _)| likely != 0) {
            let (likely, steps) = (likely as f32, number as f32);
            (whole, sum, square) = (whole + likely, sum + likely * steps, square + likely * steps * steps);
            if is_beyond(first + number * step) {
                beyond += likely;
            }
        }
        let mean = sum / whole;
        Self {
            mean: first as f32 * (1.0 / MM as f32) + mean * width,
            variance: (square / whole - mean * mean + 1.0 / 12.0).max(1.0 / 12.0) * width * width,
            mass: whole * LIKELY * width,
            beyond: beyond / whole,
        }
    }
}

/// A ball: its middle by the parabola, and how well each half width fits.
struct Ball {
    middle: i32,
    middle_sd: f32,
    squares: [i32; BORDERS],
    first: i32,
    ends: [i32; 2],
}

impl Ball {
    /// Compares balls; `None` if the parabola has no top between the lit whiskers.
    #[inline(never)]
    fn new(whiskers: &Whiskers, of_plane: &Fit, first: i32, last: i32) -> Option<Self> {
        let [_, slope, bow, ..] = of_plane.coefficients;
        if bow.is_nan() || bow > 0.0 - LEAST_CURVATURE {
            return None;
        }
        let by = -0.5 / bow;
        let middle = (slope * by).clamp(-4.0, 4.0) * PITCH;
        let middle = middle as i32;
        if middle < first || middle > last {
            return None;
        }
        // Half of the variance: dark whiskers tell it, too.
        let middle_sd = FRAC_1_SQRT_2 * PITCH_MM * of_plane.deviation(1) * by;
        if middle_sd.is_nan() || middle_sd > MOST_BALL_SD {
            return None;
        }
        let apart = |whisker: &Whisker| (whisker.across - middle).abs();
        let widest = whiskers.iter().filter(|whisker| whisker.is_lit).map(apart).max()?;
        let mut ball = Self {
            middle,
            middle_sd,
            squares: [0; BORDERS],
            first: (widest - BALL_STEP + BALL_STEP / 2).max(MM),
            ends: whiskers.iter().fold([NOWHERE, -NOWHERE], |[least, most], whisker| {
                [least.min(whisker.across), most.max(whisker.across)]
            }),
        };
        for (squares, number) in ball.squares.iter_mut().zip(0..) {
            let half = (ball.first + number * BALL_STEP).max(MM);
            let by = (1 << 20) / half;
            let square = half * half;
            let curved = square / ((square + OVERLAP_2) >> BITS).max(1);
            let height = |whisker: &Whisker| {
                let part = (apart(whisker) * by) >> BITS;
                let part = (part * part) >> BITS;
                if part >= ONE {
                    return 0;
                }
                let third = (((part * part) >> BITS) * part) >> BITS;
                whisker.above(ONE - ((curved * part + (ONE - curved) * third) >> BITS))
            };
            let heights = whiskers.each_ref().map(height);
            let amplitude = ratio(whiskers, OF_BALL, &heights);
            *squares = (whiskers.iter().zip(&heights))
                .map(|(whisker, height)| whisker.square((height * amplitude) >> BITS))
                .sum();
        }
        Some(ball)
    }

    /// Returns what the ball says of the place and the width.
    fn part(&self, scale: f32, likely: f32) -> OfCut {
        let Self { middle, middle_sd, ends: [least, most], .. } = *self;
        let half = Likely::new(&self.squares, self.first, BALL_STEP, scale, |half| {
            middle + half > most || middle - half < least
        });
        // Two borders move by one half width: twice the area, times √(2π).
        OfCut {
            mass: 5.013_257 * half.mass * middle_sd * likely,
            mean: [middle as f32 * (1.0 / MM as f32), 2.0 * half.mean],
            variance: [middle_sd * middle_sd, 4.0 * half.variance + (OF_LAW * half.mean) * (OF_LAW * half.mean)],
            beyond: half.beyond,
        }
    }
}

#[cfg(test)]
mod tests;
