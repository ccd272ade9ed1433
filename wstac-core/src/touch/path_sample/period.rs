//! The period of a texture (SPEC §10, "Period").

use crate::model::file::INPUTS;
use crate::paper::trigger::Event;
use crate::params::SAMPLE_FRAMES;
use crate::touch::motion::{MotionConfig, Velocity, sqrt};
use crate::touch::wave::Measured;

use super::resample::BY_TAXELS;
use super::{FACTS, PathSample};

/// Steps that count: from 4 mm behind the leading edge on.
const FIRST: usize = 8;
const LEAST_STEPS: usize = 20;
const MOST_STEPS: usize = 88;
/// A step is lit above this mean of its three groups, in units of 2^-11: −1.4. The last two such steps are the trailing
/// edge's.
const LIT: i32 = -2867;
const OF_EDGE: usize = 2;
/// Frequencies, and the first and the last of them per mm.
const FREQUENCIES: usize = 56;
const RANGE: [f32; 2] = [1.0 / 13.0, 1.0 / 2.6];
/// Least share of a frequency in the light's changes. Of irregular bumps, 2.5 % have as much.
const SHARE: f32 = 0.8;
/// Least periods that are seen, and the most of one that passes in a frame.
const LEAST_PERIODS: f32 = 2.5;
const OF_FRAME: f32 = 0.4;
/// Deviation, as a fraction: of each; of a window that is not whole periods; of frames.
const DEVIATION: [f32; 3] = [0.0022, 0.04, 0.33];

/// Returns the period of the texture of a slide in mm, from its light so far; `None` where it cannot be told: an object
/// without one, less than 2.5 periods of path, one beyond 2.7 to 12.5 mm, more than 0.4 of it in a frame, and as
/// [`PathSample::of_touch`].
///
/// The velocity is that of the touch's reliable answer. Its deviation is in that of the period.
pub fn period(touch: &Event<'_>, velocity: &Velocity, config: MotionConfig) -> Option<Measured> {
    let mut sample = PathSample::DARK;
    if !sample.fill_from_touch(touch, velocity, config, SAMPLE_FRAMES as u8) {
        return None;
    }
    of_sample(&sample, velocity, config)
}

/// A function of its own: the stack of [`PathSample::fill_from_touch`] is free again.
#[inline(never)]
fn of_sample(sample: &PathSample, velocity: &Velocity, config: MotionConfig) -> Option<Measured> {
    let numbers = sample.numbers().get(FACTS..usize::from(sample.covered).min(INPUTS))?;
    let mut light = [0.0_f32; MOST_STEPS];
    let (mut steps, mut end) = (0, 0_usize);
    for (place, step) in light.iter_mut().zip(numbers.chunks_exact(BY_TAXELS.numbers()).skip(FIRST)) {
        let groups = step.iter().take(BY_TAXELS.groups).map(|&number| i32::from(number)).sum::<i32>();
        *place = groups as f32;
        steps += 1;
        if groups > LIT * BY_TAXELS.groups as i32 {
            end = steps;
        }
    }
    let light = light.get_mut(..end.saturating_sub(OF_EDGE)).filter(|light| light.len() >= LEAST_STEPS)?;
    let (frequency, share) = strongest(light)?;
    let (mm, steps) = (BY_TAXELS.step_mm / frequency, light.len() as f32);
    let (periods, of_frame) = (steps * frequency, velocity.mm_s * config.pitch_mm() / config.pitch_per_frame() / mm);
    if !(share > SHARE && periods >= LEAST_PERIODS && of_frame <= OF_FRAME) {
        return None;
    }
    let [of_each, of_window, of_frames] = DEVIATION;
    let parts = [
        of_each,
        of_window / (periods * periods),
        of_frames * of_frame * of_frame / periods,
        velocity.mm_s_sd / velocity.mm_s,
    ];
    Some(Measured { value: mm, sd: mm * sqrt(parts.iter().map(|part| part * part).sum()) })
}

/// Returns the strongest frequency of light per step, and its share in the changes of the light; `None` at an end of
/// the range.
fn strongest(light: &mut [f32]) -> Option<(f32, f32)> {
    let steps = light.len() as f32;
    let place = |step: usize| step as f32 - (steps - 1.0) / 2.0;
    // Less a straight line.
    let mean = light.iter().sum::<f32>() / steps;
    let (mut rise, mut squares) = (0.0, 0.0);
    for (step, value) in light.iter().enumerate() {
        rise += *value * place(step);
        squares += place(step) * place(step);
    }
    let slope = rise / squares;
    let (mut energy, mut weights) = (0.0, 0.0);
    for (step, value) in light.iter_mut().enumerate() {
        let of_end = 2.0 * place(step) / (steps + 1.0);
        let weight = 1.0 - of_end * of_end;
        *value = (*value - mean - slope * place(step)) * weight;
        energy += *value * *value;
        weights += weight * weight;
    }
    let [first, last] = RANGE.map(|frequency| frequency * BY_TAXELS.step_mm);
    let distance = (last - first) / (FREQUENCIES - 1) as f32;
    let at = |number: usize| power(light, first + distance * number as f32);
    let (mut best, mut most) = (0, 0.0);
    for number in 0..FREQUENCIES {
        let power = at(number);
        if power > most {
            (best, most) = (number, power);
        }
    }
    if best == 0 || best == FREQUENCIES - 1 {
        return None;
    }
    // The top of a parabola.
    let [below, above] = [at(best - 1), at(best + 1)];
    let off = 0.5 * (below - above) / (below - 2.0 * most + above);
    Some((first + distance * (best as f32 + off), 2.0 * most / (energy * weights)))
}

/// Returns the power of light at a frequency per step.
fn power(light: &[f32], frequency: f32) -> f32 {
    let angle = 2.0 * core::f32::consts::PI * frequency;
    let (turn_re, turn_im) = (libm::cosf(angle), libm::sinf(angle));
    let (mut re, mut im) = (1.0_f32, 0.0_f32);
    let mut sums = [0.0_f32; 2];
    for value in light {
        sums[0] += *value * re;
        sums[1] += *value * im;
        (re, im) = (re * turn_re - im * turn_im, re * turn_im + im * turn_re);
    }
    sums[0] * sums[0] + sums[1] * sums[1]
}
