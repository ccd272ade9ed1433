//! The keys of a scene that a real sensor's slides tell, so that the simulated sensor becomes that one.
//!
//! Slides of a flat block over all whiskers are compared with the same slides in a scene without noise: the light is
//! proportional to `flash_ms` at an edge and to `rubbing_ms` behind it. Behind the last edge it fades with
//! `afterglow_ms`.

use std::fmt;
use std::ops::{Range, RangeInclusive};

use libm::{log, sqrt};
use wstac_core::params::{COLUMNS, TAXELS};

use super::Scene;
use super::light::LightConfig;
use super::script::{NOISE as NOISE_SCALE, SceneConfig};
use super::sensor::{Fidelity, SensorConfig};
use super::touch::{Slide, Touch};
use wstac_host::error::{Error, ErrorKind};

/// Time behind a taxel's brightest frame after which the flash has faded, in s: five times the afterglow of the default
/// scene.
const FADED_S: f64 = 0.225;
/// Fewest frames between the faded flash of the first edge and the last one.
const LEAST_MIDDLE: usize = 3;
/// Fewest slides: fewer give no deviations.
const LEAST_SLIDES: usize = 5;
/// Least light of a whisker, as a fraction of the brightest one's: others are dead.
const LEAST_GAIN: f64 = 0.05;
/// Fewest whiskers that give light.
const LEAST_LIT: usize = 13;
/// Pairs of frames behind the last edge that tell the afterglow, and their least mean square light in that of the
/// noise.
const FADING: usize = 3;
const CLEAR: f64 = 5.0;
/// Frames of the scene whose noise is compared; the largest scale of its noise, and steps of the search for it.
const DARK_FRAMES: usize = 400;
const MOST_NOISE: f64 = 20.0;
const NOISE_STEPS: u32 = 11;
/// Deviation of light that the times of frames leave, as a fraction: how a frame's light is divided between flash and
/// rubbing.
const BY_TIME: f64 = 0.02;
/// The same of the afterglow: light that comes behind the edge.
const OF_GLOW: f64 = 0.01;

/// The light of a slide of a flat block over all whiskers, on a real sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSlide {
    /// The slide, with the block, speed and direction that it truly had.
    pub slide: Slide,
    /// The mean of each taxel in each frame above its mean in the dark, as a fraction of full scale.
    pub frames: Vec<[f64; TAXELS]>,
    /// The standard deviation of a taxel in the dark, as a fraction of full scale.
    pub noise: f64,
    /// The mean of all taxels in the dark, as a fraction of full scale.
    pub dark: f64,
}

/// A number and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard deviation, by the differences between slides; of light at least 2 %.
    pub sd: f64,
}

/// What the slides of a sensor tell.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSensor {
    /// `[light] flash_ms` of the brightest whisker.
    pub flash_ms: Estimate,
    /// `[light] rubbing_ms` of the brightest whisker.
    pub rubbing_ms: Estimate,
    /// `[light] afterglow_ms`; `None` if the light is gone within a frame.
    pub afterglow_ms: Option<Estimate>,
    /// The gain of each whisker, as a fraction of the brightest one's; 0 of a dead one.
    pub gains: [f64; TAXELS],
    /// `[light] run_deviation` with `noise = 1`: the deviation of the light from slide to slide, as a fraction.
    pub run_deviation: f64,
    /// `[sensor] noise` with `noise = 1`.
    pub noise: f64,
    /// `[light] leak`: the mean of the dark above the black level of `[sensor]`, as a fraction of full scale.
    pub leak: f64,
    /// The number of slides that told it.
    pub slides: usize,
    /// Whether the camera's readout is known; otherwise 0 is a guess.
    pub has_readout: bool,
    sensor: SensorConfig,
}

/// Light of a slide by taxel: that of all frames around the first edge, and that of a frame between both edges.
#[derive(Clone, Copy, Debug)]
struct Parts {
    edge: [f64; TAXELS],
    middle: [f64; TAXELS],
}

/// A slide's parts, and those of its scene by flashes alone and by rubbing alone.
#[derive(Clone, Copy, Debug)]
struct Compared {
    found: Parts,
    flashes: Parts,
    rubbing: Parts,
}

impl MeasuredSensor {
    /// Measures a sensor by its slides. `sensor` is its camera: size, rate and readout. Format and black
    /// level are as in it: guesses, if nobody measured them.
    ///
    /// # Errors
    /// Fewer than five slides are long and slow enough, or a slide cannot be simulated.
    pub fn new(slides: &[MeasuredSlide], sensor: &SensorConfig) -> Result<Self, Error> {
        let refused = |message: String| Error::new(ErrorKind::Data, "slides", message);
        let frame_s = f64::from(sensor.rate.denominator()) / f64::from(sensor.rate.numerator());
        let mut scene = scene_of(sensor);
        let mut usable = Vec::new();
        for slide in slides {
            scene.touches = vec![Touch::Slide(slide.slide)];
            let flashes = flashes_of(&scene)?;
            let peaks = peaks_of(&flashes);
            let found = aligned(&slide.frames, &flashes, &peaks)
                .and_then(|edges| Some((slide, peaks, edges, parts(&slide.frames, &peaks, edges, frame_s)?)));
            usable.extend(found);
        }
        if usable.len() < LEAST_SLIDES {
            return Err(refused(format!(
                "{} of a flat block over all whiskers have light between both edges (expected {LEAST_SLIDES} or more); \
                 help: slide more slowly, or a longer block",
                usable.len()
            )));
        }
        let behind = |(slide, peaks, edges, _): &&(&MeasuredSlide, Peaks, [f64; 2], Parts)| {
            let last = peaks.iter().map(|peaks| peaks[1]).max().unwrap_or_default();
            slide.frames.len() > faded_from(last, edges[1]) + FADING
        };
        let faded = usable.iter().filter(behind).count();
        if faded < LEAST_SLIDES {
            return Err(refused(format!(
                "{faded} of {} go on until the light has faded (expected {LEAST_SLIDES}); help: record longer, or slide faster",
                usable.len()
            )));
        }
        let afterglow_ms = afterglow(&usable, frame_s);
        scene.light.afterglow_ms = afterglow_ms.map_or(0.0, |found| found.value);
        let mut compared = Vec::new();
        for (slide, peaks, _, found) in &usable {
            scene.touches = vec![Touch::Slide(slide.slide)];
            let part = |frames: &[[f64; TAXELS]]| {
                let found = parts(frames, peaks, [0.0; 2], frame_s);
                found.ok_or_else(|| refused("the simulated slide has no light between its edges".into()))
            };
            let rubbing = SceneConfig { light: LightConfig { flash_ms: 0.0, ..scene.light }, ..scene.clone() };
            let (flashes, rubbing) = (part(&flashes_of(&scene)?)?, part(&light_of(&rubbing)?)?);
            compared.push(Compared { found: *found, flashes, rubbing });
        }
        let (gains, of_brightest) = gains(&compared);
        let lit = gains.iter().filter(|gain| **gain > 0.0).count();
        if lit < LEAST_LIT || !gains.iter().all(|gain| gain.is_finite()) {
            return Err(refused(format!("light up {lit} whiskers (expected {LEAST_LIT} or more of {TAXELS})")));
        }
        let (flashes, middles): (Vec<f64>, Vec<f64>) = compared.iter().map(|slide| slide.scales(&gains)).unzip();
        let default = LightConfig::default();
        let of_default = |ratios: &[f64], key: f64| {
            let found = mean(ratios.iter().copied());
            Estimate {
                value: found.value * key,
                sd: libm::hypot(found.sd, found.value * libm::hypot(of_brightest, BY_TIME)) * key,
            }
        };
        let deviation = |ratios: &[f64]| {
            let logs: Vec<f64> = ratios.iter().filter(|ratio| **ratio > 0.0).map(|ratio| log(*ratio)).collect();
            mean(logs.iter().copied()).sd * sqrt(logs.len() as f64)
        };
        let dark = |of: fn(&MeasuredSlide) -> f64| slides.iter().map(of).sum::<f64>() / slides.len() as f64;
        scene.light.leak = (dark(|slide| slide.dark) - sensor.black_level / 255.0).max(0.0);
        Ok(Self {
            flash_ms: of_default(&flashes, default.flash_ms),
            rubbing_ms: of_default(&middles, default.rubbing_ms),
            afterglow_ms,
            gains,
            // Rubbing makes an edge's light differ, too, and a dim one's noise that of the middle.
            run_deviation: deviation(&flashes).min(deviation(&middles)),
            noise: noise_scale(&scene, sqrt(dark(|slide| slide.noise * slide.noise)))?,
            leak: scene.light.leak,
            slides: usable.len(),
            has_readout: true,
            sensor: sensor.clone(),
        })
    }
}

impl Compared {
    /// Returns by which factors flashes and rubbing of the scene become the light that was found, of whiskers with
    /// these gains.
    fn scales(&self, gains: &[f64; TAXELS]) -> (f64, f64) {
        let light = |part: &[f64; TAXELS]| part.iter().zip(gains).map(|(light, gain)| light * gain).sum::<f64>();
        let [edge, middle] = [self.found.edge, self.found.middle].map(|part| {
            // A dead whisker has no light in the scene, so none of its noise counts.
            part.iter().zip(gains).filter(|(_, gain)| **gain > 0.0).map(|(light, _)| light).sum::<f64>()
        });
        let [edge_1, middle_1] = [light(&self.flashes.edge), light(&self.flashes.middle)];
        let [edge_2, middle_2] = [light(&self.rubbing.edge), light(&self.rubbing.middle)];
        let determinant = edge_1 * middle_2 - edge_2 * middle_1;
        ((edge * middle_2 - edge_2 * middle) / determinant, (edge_1 * middle - edge * middle_1) / determinant)
    }
}

/// Returns the gain of each whisker by its flashes, and the deviation of the gain to which they refer.
fn gains(slides: &[Compared]) -> ([f64; TAXELS], f64) {
    // The light differs from slide to slide, but for all whiskers alike.
    let even: Vec<[f64; TAXELS]> = slides
        .iter()
        .map(|slide| {
            let gains: [f64; TAXELS] = core::array::from_fn(|taxel| {
                let mut only = [0.0; TAXELS];
                only[taxel] = 1.0;
                slide.scales(&only).0
            });
            let mut sorted = gains;
            sorted.sort_by(f64::total_cmp);
            // The median of those that give light: others may be dead.
            let most = sorted[TAXELS - 1];
            let dark = sorted.iter().filter(|gain| **gain < LEAST_GAIN * most).count();
            gains.map(|gain| gain / sorted[usize::midpoint(dark, TAXELS - 1)])
        })
        .collect();
    let found: [Estimate; TAXELS] = core::array::from_fn(|taxel| mean(even.iter().map(|gains| gains[taxel])));
    // The largest of 25 numbers is too large by chance.
    let least = |gain: &Estimate| gain.value - 2.0 * gain.sd;
    let brightest = found.into_iter().max_by(|left, right| least(left).total_cmp(&least(right))).unwrap_or(found[0]);
    let most = least(&brightest).max(f64::MIN_POSITIVE);
    let gains = found.map(|gain| if gain.value < LEAST_GAIN * most { 0.0 } else { (gain.value / most).min(1.0) });
    (gains, brightest.sd / most)
}

/// Returns the scene without noise and with even gains.
fn scene_of(sensor: &SensorConfig) -> SceneConfig {
    let mut scene = SceneConfig::new(Vec::new());
    (scene.noise, scene.fidelity, scene.sensor) = (0.0, Fidelity::Taxel, sensor.clone());
    (scene.light.gain_deviation, scene.light.run_deviation, scene.light.fluctuation) = (0.0, 0.0, 0.0);
    (scene.lead_in, scene.gap) = (5, 30);
    scene
}

fn light_of(scene: &SceneConfig) -> Result<Vec<[f64; TAXELS]>, Error> {
    let mut scene = Scene::new(scene)?;
    Ok(core::iter::from_fn(|| scene.next_light()).map(|(light, _)| light).collect())
}

/// Returns the scale of the camera's noise with which a dark taxel of the scene has this deviation.
fn noise_scale(scene: &SceneConfig, deviation: f64) -> Result<f64, Error> {
    // Pixels are rounded, so that the deviation is not proportional to the scale.
    let (mut least, mut most) = (0.0, MOST_NOISE);
    for _ in 0..NOISE_STEPS {
        let middle = f64::midpoint(least, most);
        if dark_deviation(scene, middle)? < deviation { least = middle } else { most = middle }
    }
    Ok(f64::midpoint(least, most))
}

/// Returns the standard deviation of a taxel in the dark, as a fraction of full scale.
fn dark_deviation(scene: &SceneConfig, noise: f64) -> Result<f64, Error> {
    let sensor = SensorConfig { noise, ..scene.sensor.clone() };
    let mut sensor = Scene::camera(&SceneConfig { noise: 1.0, sensor, ..scene.clone() })?;
    let full = f64::from(sensor.pixels()) * f64::from(sensor.full_scale());
    let frames: Vec<[u32; TAXELS]> = (0..DARK_FRAMES).map(|_| sensor.sums(&[0.0; TAXELS])).collect();
    let variance = |taxel: usize| mean(frames.iter().map(|sums| f64::from(sums[taxel]) / full)).sd.powi(2);
    Ok(sqrt((0..TAXELS).map(variance).sum::<f64>() / TAXELS as f64 * DARK_FRAMES as f64))
}

/// The brightest frame of each taxel at the first and at the last edge.
type Peaks = [[usize; 2]; TAXELS];

/// Returns the parts of a slide's light whose edges are this many frames behind those of its scene; `None` if the
/// middle of its block is too short for its speed.
fn parts(frames: &[[f64; TAXELS]], peaks: &Peaks, [first_edge, last_edge]: [f64; 2], frame_s: f64) -> Option<Parts> {
    let faded = libm::ceil(FADED_S / frame_s);
    let mut parts = Parts { edge: [0.0; TAXELS], middle: [0.0; TAXELS] };
    for (taxel, &[first, last]) in peaks.iter().enumerate() {
        let of = |range: Range<usize>| frames.get(range).map(|some| some.iter().map(|frame| frame[taxel]).sum::<f64>());
        // The flash may be in the frames beside the brightest one.
        let end = first as f64 + first_edge + faded + 1.0;
        let (begin, whole) = ((first as f64 + first_edge - 2.0).max(0.0) as usize, end as usize);
        let middle = whole + 1..(last as f64 + last_edge - 1.0).max(0.0) as usize;
        let count = middle.len();
        if count < LEAST_MIDDLE {
            return None;
        }
        parts.middle[taxel] = of(middle)? / count as f64;
        // The end is within a frame: one frame more of rubbing would be much beside a weak flash.
        parts.edge[taxel] = of(begin..whole)? + (end - whole as f64) * frames.get(whole)?[taxel];
    }
    Some(parts)
}

/// Returns the peaks of a scene's slide by the light of its flashes.
fn peaks_of(frames: &[[f64; TAXELS]]) -> Peaks {
    let [begin, end] = lit(frames).unwrap_or_default();
    let middle = usize::midpoint(begin, end);
    let brightest = |range: RangeInclusive<usize>, taxel: usize| {
        range.max_by(|left, right| frames[*left][taxel].total_cmp(&frames[*right][taxel])).unwrap_or(middle)
    };
    core::array::from_fn(|taxel| [brightest(begin..=middle, taxel), brightest(middle..=end, taxel)])
}

/// Returns the light of a scene's slide by flashes alone.
fn flashes_of(scene: &SceneConfig) -> Result<Vec<[f64; TAXELS]>, Error> {
    let mut scene = scene.clone();
    scene.light.rubbing_ms = 0.0;
    light_of(&scene)
}

/// Returns the first and the last frame with much light; `None` without light.
fn lit(frames: &[[f64; TAXELS]]) -> Option<[usize; 2]> {
    let sums: Vec<f64> = frames.iter().map(|frame| frame.iter().sum()).collect();
    let most = sums.iter().copied().fold(0.0, f64::max);
    let is_lit = |sum: &f64| *sum > 0.1 * most;
    Some([sums.iter().position(is_lit)?, sums.iter().rposition(is_lit)?])
}

/// Returns by how many frames both edges of a measured slide are behind those of its scene, where changes of the light
/// are most alike. The block may be longer or shorter than that of the scene.
fn aligned(frames: &[[f64; TAXELS]], scene: &[[f64; TAXELS]], peaks: &Peaks) -> Option<[f64; 2]> {
    let [begin, end] = lit(frames)?;
    let middle = usize::midpoint(begin, end);
    let change = |frames: &[[f64; TAXELS]], at: usize, taxel: usize| {
        Some(frames.get(at)?[taxel] - frames.get(at.checked_sub(1)?)?[taxel])
    };
    let mut edges = [0.0; 2];
    for (edge, range) in [begin.saturating_sub(2)..=middle, middle..=end].into_iter().enumerate() {
        let first = peaks.iter().map(|peaks| peaks[edge]).min()?;
        let alike = |start: usize| -> f64 {
            let of = |(taxel, peaks): (usize, &[usize; 2])| -> f64 {
                let near = peaks[edge].saturating_sub(1)..peaks[edge] + 3;
                near.filter_map(|at| {
                    Some(change(scene, at, taxel)? * change(frames, (at + start).checked_sub(first)?, taxel)?)
                })
                .sum()
            };
            peaks.iter().enumerate().map(of).sum()
        };
        let start = range.max_by(|left, right| alike(*left).total_cmp(&alike(*right)))?;
        let [before, best, after] = [start.checked_sub(1)?, start, start + 1].map(alike);
        // The vertex of a parabola through three points.
        let bend = before - 2.0 * best + after;
        let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        edges[edge] = start as f64 - first as f64 + part;
    }
    Some(edges)
}

/// Returns the first frame behind the last edge in which light only fades. The flash may end in the one behind the
/// brightest.
fn faded_from(last: usize, last_edge: f64) -> usize {
    (last as f64 + last_edge + 2.5).max(0.0) as usize
}

/// Returns the afterglow in ms by the light behind the last edge; `None` if too few slides have clear light there.
fn afterglow(slides: &[(&MeasuredSlide, Peaks, [f64; 2], Parts)], frame_s: f64) -> Option<Estimate> {
    let of = |slide: &MeasuredSlide, peaks: &Peaks, last_edge: f64| -> Option<f64> {
        let (mut products, mut squares, mut noise) = (0.0, 0.0, 0.0);
        for (taxel, &[_, last]) in peaks.iter().enumerate() {
            for pair in slide.frames.get(faded_from(last, last_edge)..)?.windows(2).take(FADING) {
                let [light, next] = [pair[0][taxel], pair[1][taxel]];
                products += light * next;
                squares += light * light;
                noise += slide.noise * slide.noise;
            }
        }
        if squares < CLEAR * noise {
            return None;
        }
        squares -= noise;
        let ratio = products / squares;
        (ratio > 0.0 && ratio < 1.0).then(|| -1e3 * frame_s / log(ratio))
    };
    let found: Vec<f64> = slides.iter().filter_map(|(slide, peaks, [_, edge], _)| of(slide, peaks, *edge)).collect();
    (found.len() >= LEAST_SLIDES).then(|| {
        let found = mean(found.iter().copied());
        Estimate { value: found.value, sd: libm::hypot(found.sd, OF_GLOW * found.value) }
    })
}

/// Returns the mean and its standard deviation.
fn mean(values: impl Iterator<Item = f64> + Clone) -> Estimate {
    let count = values.clone().count().max(1) as f64;
    let value = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|one| (one - value) * (one - value)).sum();
    Estimate { value, sd: sqrt(squares / (count - 1.0).max(1.0) / count) }
}

impl fmt::Display for MeasuredSensor {
    /// Writes the keys of a scene, with their deviations and what is still a guess.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sensor, slides, run_deviation, .. } = self;
        writeln!(
            f,
            "# Measured with {slides} slides of a flat block. All other keys are guesses: wstac scene explain."
        )?;
        writeln!(f, "noise = 1\n\n[light]")?;
        let mut key = |name: &str, found: Estimate| writeln!(f, "{name} = {:.4}    # ± {:.4}", found.value, found.sd);
        key("flash_ms", self.flash_ms)?;
        key("rubbing_ms", self.rubbing_ms)?;
        match self.afterglow_ms {
            Some(found) => key("afterglow_ms", found)?,
            None => writeln!(f, "afterglow_ms = 0    # gone within a frame")?,
        }
        writeln!(f, "fluctuation = {}    # a guess", LightConfig::default().fluctuation * NOISE_SCALE)?;
        writeln!(
            f,
            "gain_deviation = 0    # the gains are measured: dead and weak\nrun_deviation = {run_deviation:.3}"
        )?;
        writeln!(f, "leak = {:.5}    # if black is {} of 255", self.leak, sensor.black_level)?;
        let at = |taxel: usize| (taxel / COLUMNS + 1, taxel % COLUMNS + 1);
        let dead = (0..TAXELS).filter(|taxel| self.gains[*taxel] == 0.0).map(at);
        let dead: Vec<String> = dead.map(|(row, column)| format!("[{row}, {column}]")).collect();
        writeln!(f, "dead = [{}]", dead.join(", "))?;
        let weak = (0..TAXELS).filter(|taxel| self.gains[*taxel] > 0.0 && self.gains[*taxel] < 1.0);
        let weak = weak.map(|taxel| (at(taxel), self.gains[taxel]));
        let weak: Vec<String> = weak.map(|((row, column), gain)| format!("[{row}, {column}, {gain:.3}]")).collect();
        writeln!(f, "weak = [{}]", weak.join(", "))?;
        let [width, height] = [sensor.size.width(), sensor.size.height()];
        let rate = f64::from(sensor.rate.numerator()) / f64::from(sensor.rate.denominator());
        writeln!(f, "\n[sensor]\nsize = [{width}, {height}]\nfps = {rate}")?;
        let guess = if self.has_readout { "" } else { "    # a guess: no press told it" };
        writeln!(f, "readout_ms = {}{guess}", sensor.readout_ms)?;
        let beyond = if self.noise > 0.99 * MOST_NOISE { "    # or more" } else { "" };
        writeln!(f, "noise = {:.3}{beyond}", self.noise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SimulatedFrame;
    use crate::specimen::{Pattern, Specimen};

    /// Returns slides of a sensor as they are measured: taxel sums, less those of 25 dark frames.
    fn measured(keys: &str, seed: u64) -> (Vec<MeasuredSlide>, SensorConfig) {
        let mut slides = Vec::new();
        let text = format!("speed = 100\nspecimen = \"Fla0\"\nnoise = 1\nfidelity = \"taxel\"\n{keys}");
        let sensor = SceneConfig::from_toml("sensor", &text).unwrap();
        for (number, speed) in [60.0, 80.0, 100.0, 150.0].into_iter().cycle().take(40).enumerate() {
            let slide = Slide::new(Specimen::block(Pattern::Flat, 0.0), speed, f64::from(number as u8 / 4 % 2) * 90.0);
            let script =
                SceneConfig { touches: vec![Touch::Slide(slide)], seed: seed + number as u64, ..sensor.clone() };
            let camera = Scene::camera(&script).unwrap();
            let full = f64::from(camera.pixels()) * f64::from(camera.full_scale());
            let mut scene = Scene::new(&script).unwrap();
            let mut frames = Vec::new();
            while let Some(shot) = scene.next_shot() {
                let SimulatedFrame::Taxels(sums) = shot else { continue };
                frames.push(sums.map(|sum| f64::from(sum) / full));
            }
            let dark: Vec<[f64; TAXELS]> = frames.drain(..25).collect();
            let of = |taxel: usize| mean(dark.iter().map(|frame| frame[taxel]));
            let noise = sqrt((0..TAXELS).map(|taxel| of(taxel).sd.powi(2)).sum::<f64>());
            let all = (0..TAXELS).map(|taxel| of(taxel).value).sum::<f64>() / 25.0;
            for frame in &mut frames {
                *frame = core::array::from_fn(|taxel| frame[taxel] - of(taxel).value);
            }
            slides.push(MeasuredSlide { slide, frames, noise, dark: all });
        }
        (slides, sensor.sensor)
    }

    #[test]
    fn a_sensor_is_measured_again() {
        for (seed, [flash, rubbing, glow, run, noise, leak]) in [
            (1, [11.0, 0.01, 44.5, 0.1, 1.0, 0.0]),
            (2, [7.0, 0.02, 70.0, 0.05, 2.0, 0.02]),
            (3, [16.0, 0.005, 25.0, 0.15, 0.5, 0.01]),
        ] {
            let keys = format!(
                "[light]\nflash_ms = {flash}\nrubbing_ms = {rubbing}\nafterglow_ms = {glow}\nrun_deviation = {run}\n\
                 gain_deviation = 0\nleak = {leak}\nweak = [[2, 3, 0.5], [5, 5, 0.8]]\ndead = [[4, 1]]\n[sensor]\nnoise = {noise}"
            );
            let (slides, sensor) = measured(&keys, 1000 * seed);
            let found = MeasuredSensor::new(&slides, &sensor).unwrap();
            let near = |found: Estimate, expected: f64| {
                let error = (found.value - expected).abs();
                assert!(error < 3.0 * found.sd, "{found:?}, expected {expected}");
                assert!(found.sd < 0.1 * expected, "{found:?}, expected {expected}");
            };
            near(found.flash_ms, flash);
            near(found.rubbing_ms, rubbing);
            near(found.afterglow_ms.unwrap(), glow);
            assert!((found.run_deviation / run - 1.0).abs() < 0.5, "{found:?}");
            assert!((found.noise / noise - 1.0).abs() < 0.15, "{found:?}");
            assert!((found.leak - leak).abs() < 0.001, "{found:?}");
            for (taxel, gain) in found.gains.into_iter().enumerate() {
                let expected = [(7, 0.5), (24, 0.8), (15, 0.0)].into_iter().find(|(weak, _)| *weak == taxel);
                assert!((gain - expected.map_or(1.0, |(_, gain)| gain)).abs() < 0.06, "{taxel}: {gain}");
            }
            if seed > 1 {
                continue;
            }
            // Its scene is the same sensor.
            let (again, sensor) = measured(&found.to_string().replacen("noise = 1\n", "", 1), 77_000 + seed);
            near(MeasuredSensor::new(&again, &sensor).unwrap().flash_ms, flash);
        }
    }

    #[test]
    fn slides_that_tell_nothing_are_refused() {
        let (mut slides, sensor) = measured("[light]\ndead = []", 9);
        slides.truncate(4);
        let message = MeasuredSensor::new(&slides, &sensor).unwrap_err().to_string();
        assert!(message.contains("4 of a flat block"), "{message}");
        let keys = "dead = [[1, 1], [1, 2], [1, 3], [1, 4], [1, 5], [2, 1], [2, 2], [2, 3], [2, 4], [2, 5], [3, 1], [3, 2], [3, 3]]";
        let (few, sensor) = measured(&format!("[light]\n{keys}"), 9);
        let message = MeasuredSensor::new(&few, &sensor).unwrap_err().to_string();
        assert!(message.contains("light up 12 whiskers"), "{message}");
        let dark = MeasuredSlide { frames: vec![[0.0; TAXELS]; 90], ..slides[0].clone() };
        assert!(MeasuredSensor::new(&vec![dark; 9], &sensor).is_err());
    }
}
