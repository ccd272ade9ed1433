//! The readout of a camera from a press and its release: the time from the first to the last row of the picture.
//!
//! A plate that comes down on the dome of whiskers touches the middle first, and leaves it last. So what a tilt of the
//! plate, the dome and the placement do to the times of the flashes changes its sign from the press to the release.
//! The readout delays the rows of the picture in both alike. Touches that are no press, such as slides, take no part.

use wstac_core::params::TAXELS;
use wstac_host::statistics::solve;

use super::watch::UNTOUCHED;

/// Light at which a flash begins, in parts of the brightest frame near it and in deviations of the untouched frames.
const LEAST_LIGHT: f64 = 0.003;
const LEAST_DEVIATIONS: f64 = 8.0;
/// Part of both peaks' light below which a frame between them parts two flashes.
const VALLEY: f64 = 0.4;
/// Least light of a whisker, in parts of the middle one's, and the fewest whiskers with so much.
const LEAST_PART: f64 = 0.15;
const LEAST_WHISKERS: usize = 20;
/// Most frames of a flash.
const LONGEST: usize = 40;
/// Most of the light that is left after a frame.
const MOST_LEFT: f64 = 0.9;
/// Steps of a bending that are added up.
const STEPS: usize = 24;
/// Least lateness of the outermost whiskers, in frames, so that the press and the release can be told apart.
const LEAST_LATENESS: f64 = 0.05;
/// How far the release must be the opposite of the press: the cosine of the angle between both.
const OPPOSITE: f64 = -0.9;
/// Most lateness of the outermost column that the press and the release have in common, in frames.
const MOST_ACROSS: f64 = 0.1;
/// Most lateness of the outermost whiskers by a tilt, in parts of that of the corners by the dome: a tilt of some 10°.
const MOST_TILT: f64 = 1.0;
/// Deviation of a press's readout in parts of it, besides that of its residuals: a delay moves rows within their
/// frames, and bendings are not as even as [`bent`] takes them. So much grew the errors of 150 simulated presses.
const UNEVEN: f64 = 0.02;
/// Deviations by which a press differs at most from most others.
const MOST_APART: f64 = 5.0;
/// Most deviation of an answer: in ms, and as a part of a long readout.
const MOST_SD: [f64; 2] = [1.0, 0.03];

/// The readout that presses told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressedReadout {
    /// Milliseconds from the first to the last row of the picture; negative if the bottom comes first.
    pub ms: f64,
    /// Its standard deviation in ms.
    pub sd_ms: f64,
    /// The number of presses, each with its release.
    pub presses: usize,
}

/// The light of every taxel above the untouched one, in every frame; `None` for a frame that was lost.
type Light = [Option<[f64; TAXELS]>];
/// The first frame of a flash, and the one after its last.
type Span = (usize, usize);

/// Returns the readout of a camera whose taxels had these sums, of which the first [`UNTOUCHED`] are without a touch.
///
/// `centers` are in pixels, of a picture with this number of rows.
pub(super) fn readout(
    sums: &Light,
    centers: &[[f64; 2]; TAXELS],
    rows: u16,
    per_second: f64,
) -> Option<PressedReadout> {
    let light = above(sums)?;
    // A row that is exposed later has its flash in an earlier frame.
    let ms_per_slope = -1000.0 * (f64::from(rows) - 1.0) / per_second;
    let told = |pair: &[Span; 2], left: f64| {
        let [press, release] = [lateness(&light, pair[0], left)?, lateness(&light, pair[1], left)?];
        let [slope, sd] = delay(&press, &release, centers)?;
        let ms = slope * ms_per_slope;
        let found = [ms, (sd * ms_per_slope).hypot(UNEVEN * ms)];
        // The rows of a frame are read within its time.
        (found[0].abs() <= 1050.0 / per_second).then_some(found)
    };
    // Each pair has its own afterglow first: what rubs glows on, and would count for that of presses.
    let is_told = |pair: &[Span; 2]| told(pair, afterglow(&light, pair)).is_some();
    let all = pairs(&light);
    let pairs: Vec<_> = all.iter().copied().filter(|pair| is_told(pair)).collect();
    let left = afterglow(&light, pairs.as_flattened());
    let mut found: Vec<[f64; 2]> = pairs.iter().filter_map(|pair| told(pair, left)).collect();
    // Two slides may pass for a press: such a readout is one among others, or the only one of many touches.
    found.sort_by(|one, other| one[0].total_cmp(&other[0]));
    if let (3.., Some(&[middle, _])) = (found.len(), found.get(found.len() / 2)) {
        found.retain(|[ms, sd]| (ms - middle).abs() <= MOST_APART * sd);
    }
    if found.len() == 1 && all.len() > 1 {
        return None;
    }
    let weights: Vec<f64> = found.iter().map(|[_, sd]| 1.0 / (sd * sd)).collect();
    let weight: f64 = weights.iter().sum();
    let ms = found.iter().zip(&weights).map(|([ms, _], weight)| ms * weight).sum::<f64>() / weight;
    let spread = found.iter().zip(&weights).map(|([other, _], weight)| weight * (other - ms).powi(2)).sum::<f64>();
    let count = found.len();
    // Presses that disagree are less certain than each of them says.
    let factor = if count > 1 { (spread / (count as f64 - 1.0)).max(1.0) } else { 1.0 };
    let sd_ms = (factor / weight).sqrt();
    (count > 0 && sd_ms <= MOST_SD[0].max(MOST_SD[1] * ms.abs())).then_some(PressedReadout {
        ms,
        sd_ms,
        presses: count,
    })
}

/// Returns the light above the untouched frames, in deviations of a taxel's noise; `None` if there are too few.
fn above(sums: &Light) -> Option<Vec<Option<[f64; TAXELS]>>> {
    let untouched: Vec<_> = sums.iter().take(UNTOUCHED).flatten().collect();
    if untouched.len() < UNTOUCHED / 2 {
        return None;
    }
    let count = untouched.len() as f64;
    let mean: [f64; TAXELS] =
        core::array::from_fn(|taxel| untouched.iter().map(|sums| sums[taxel]).sum::<f64>() / count);
    let squares: f64 =
        untouched.iter().flat_map(|sums| (0..TAXELS).map(|taxel| (sums[taxel] - mean[taxel]).powi(2))).sum();
    let deviation = (squares / (count * TAXELS as f64)).sqrt().max(1e-9);
    let of = |sums: &[f64; TAXELS]| core::array::from_fn(|taxel| (sums[taxel] - mean[taxel]) / deviation);
    Some(sums.iter().map(|sums| sums.as_ref().map(of)).collect())
}

/// Returns the light of all taxels in a frame.
fn total(light: Option<&[f64; TAXELS]>) -> f64 {
    light.map_or(0.0, |light| light.iter().sum())
}

/// Returns every two flashes in a row, which may be a press and its release.
///
/// The light at which they begin and end is that of these two. By that of the brightest touch, a dim press would have
/// lost its first and last light.
fn pairs(light: &Light) -> Vec<[Span; 2]> {
    let all = flashes(light, (UNTOUCHED, light.len()));
    let alone = |pair: usize| {
        let from = pair.checked_sub(1).map_or(UNTOUCHED, |before| all[before].1);
        let near = flashes(light, (from, all.get(pair + 2).map_or(light.len(), |after| after.0)));
        let peak = |(start, end): Span| {
            (start..end).max_by(|a, b| total(light[*a].as_ref()).total_cmp(&total(light[*b].as_ref())))
        };
        let place = |flash: Span| {
            near.iter().position(|(start, end)| peak(flash).is_some_and(|peak| (*start..*end).contains(&peak)))
        };
        let [press, release] = [place(all[pair])?, place(all[pair + 1])?];
        (release == press + 1).then(|| [near[press], near[release]])
    };
    (0..all.len().saturating_sub(1)).filter_map(alone).collect()
}

/// Returns the frames of each flash in a span: light that rises to a peak between two valleys.
fn flashes(light: &Light, (first, last): Span) -> Vec<Span> {
    let totals = || light[..last].iter().map(|light| total(light.as_ref())).enumerate().skip(first);
    let most = totals().map(|(_, total)| total).fold(0.0, f64::max);
    let least = (LEAST_LIGHT * most).max(LEAST_DEVIATIONS * (TAXELS as f64).sqrt());
    let (mut found, mut start, mut peak, mut valley) = (Vec::new(), None, 0.0_f64, (0, f64::MAX));
    for (frame, total) in totals() {
        let Some(from) = start else {
            if total > least {
                (start, peak, valley) = (Some(frame.saturating_sub(1)), total, (frame, f64::MAX));
            }
            continue;
        };
        if total > peak && valley.1 > VALLEY * peak {
            (peak, valley) = (total, (frame, f64::MAX));
        } else if total < valley.1 {
            valley = (frame, total);
        }
        if total <= least {
            found.push((from, frame + 1));
            start = None;
        } else if valley.1 < VALLEY * peak && total > valley.1 / VALLEY {
            found.push((from, valley.0));
            (start, peak, valley) = (Some(valley.0), total, (frame, f64::MAX));
        }
    }
    // Light that lasts until the next touch is a whole flash. Light that lasts until the last frame may be part of one.
    found.extend(start.filter(|_| last < light.len()).map(|from| (from, last)));
    found
}

/// Returns the part of the light that is left after a frame, which follows from how flashes end.
fn afterglow(light: &Light, flashes: &[(usize, usize)]) -> f64 {
    let (mut products, mut squares) = (0.0, 1e-9);
    for &(start, end) in flashes {
        let totals: Vec<f64> = light[start..end].iter().map(|light| total(light.as_ref())).collect();
        let peak = totals.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(frame, _)| frame);
        for pair in totals.get(peak + 2..).unwrap_or_default().windows(2) {
            products += pair[0] * pair[1];
            squares += pair[0] * pair[0];
        }
    }
    (products / squares).clamp(0.0, MOST_LEFT)
}

/// Returns when each taxel is bent, as the middle in time, in frames; `None` for one without enough light. There is no
/// answer if too few of them are, or if a frame was lost.
fn lateness(light: &Light, (start, end): (usize, usize), left: f64) -> Option<[Option<f64>; TAXELS]> {
    if end - start > LONGEST {
        return None;
    }
    let frames: Vec<[f64; TAXELS]> = light[start..end].iter().copied().collect::<Option<_>>()?;
    let sums: [f64; TAXELS] = core::array::from_fn(|taxel| frames.iter().map(|light| light[taxel]).sum());
    let mut sorted = sums;
    sorted.sort_by(f64::total_cmp);
    let least = (LEAST_PART * sorted[TAXELS / 2]).max(LEAST_DEVIATIONS * (frames.len() as f64).sqrt());
    let time = |taxel: usize| {
        let light = frames.iter().map(|light| light[taxel]);
        // Without the afterglow of the frame before, what is left is the light of this frame's bending.
        let fresh: Vec<f64> =
            light.clone().zip(std::iter::once(0.0).chain(light)).map(|(now, before)| now - left * before).collect();
        let of = |weight: &dyn Fn(f64) -> f64| -> f64 {
            fresh.iter().enumerate().map(|(frame, light)| weight(frame as f64) * light).sum()
        };
        let total = of(&|_| 1.0);
        let middle = of(&|frame| frame) / total;
        let variance = of(&|frame| (frame - middle).powi(2)) / total;
        (sums[taxel] > least && total > 0.0).then(|| bent(middle, variance, left))
    };
    let times: [Option<f64>; TAXELS] = core::array::from_fn(time);
    (times.iter().flatten().count() >= LEAST_WHISKERS).then_some(times)
}

/// Returns the middle in time of a bending whose fresh light has this middle and variance among frames.
///
/// A frame adds up what came in it, so that light at any time of it counts for the whole frame, and what came early in
/// it has faded at its end. So the middle of a bending that is shorter than some frames depends on when it comes. It is
/// taken for even, of the length that gives the variance.
fn bent(middle: f64, variance: f64, left: f64) -> f64 {
    // The light that an instant at this part of a frame gives to the next frame.
    let next = |part: f64| {
        if left < 0.01 { 0.0 } else { (left.powf(1.0 - part) - left) / (1.0 - left) }
    };
    let moments = |time: f64, length: f64| {
        let (mut mean, mut square) = (0.0, 0.0);
        for step in 0..STEPS {
            let at = time + length * ((step as f64 + 0.5) / STEPS as f64 - 0.5);
            let later = next(at - at.floor());
            mean += (at.floor() + later) / STEPS as f64;
            square += (at.floor().powi(2) + later * (2.0 * at.floor() + 1.0)) / STEPS as f64;
        }
        (mean, square - mean * mean)
    };
    let at_length = |length: f64| {
        let mut time = middle + 0.5;
        for _ in 0..12 {
            time += 0.7 * (middle - moments(time, length).0);
        }
        (time, moments(time, length).1)
    };
    // The variance grows with the length.
    let (mut short, mut long) = (0.0, LONGEST as f64 / 4.0);
    for _ in 0..16 {
        let length = f64::midpoint(short, long);
        if at_length(length).1 < variance { short = length } else { long = length }
    }
    at_length(f64::midpoint(short, long)).0
}

/// Returns the delay of a press and its release in frames per pixel, with its deviation; `None` if they are no such
/// pair.
fn delay(
    press: &[Option<f64>; TAXELS],
    release: &[Option<f64>; TAXELS],
    centers: &[[f64; 2]; TAXELS],
) -> Option<[f64; 2]> {
    let both: Vec<_> = (0..TAXELS).filter_map(|taxel| Some((centers[taxel], press[taxel]?, release[taxel]?))).collect();
    if both.len() < LEAST_WHISKERS {
        return None;
    }
    let count = both.len() as f64;
    let mean = |axis: usize| both.iter().map(|(center, ..)| center[axis]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    // Across the array, from −1 to 1.
    let half = both.iter().map(|(center, ..)| (center[0] - x).abs().max((center[1] - y).abs())).fold(1.0, f64::max);
    let row = |[u, v]: [f64; 2]| {
        let [u, v] = [(u - x) / half, (v - y) / half];
        [1.0, u, v, u * u + v * v]
    };
    let shape: Vec<[f64; 4]> = both.iter().map(|(center, ..)| row(*center)).collect();
    let times = |pick: fn(&([f64; 2], f64, f64)) -> f64| -> Vec<f64> { both.iter().map(pick).collect() };
    let (pressed, [_, p_x, p_y, p_c]) = fit(&shape, &times(|both| both.1))?;
    let (released, [_, r_x, r_y, r_c]) = fit(&shape, &times(|both| both.2))?;
    // The curvature reaches the corners, twice as far as the slope.
    let [press, release] = [[p_x, 2.0 * p_c], [r_x, 2.0 * r_c]];
    let [p, r] = [press[0].hypot(press[1]), release[0].hypot(release[1])];
    let cosine = (press[0] * release[0] + press[1] * release[1]) / (p * r);
    if p.min(r) < LEAST_LATENESS || cosine > OPPOSITE || p_c <= 0.0 {
        return None;
    }
    let ratio = r / p;
    let [slope, across] = [(r_y, p_y), (r_x, p_x)].map(|(release, press)| (release + ratio * press) / (1.0 + ratio));
    // A slide is late along its path in both flashes, and rows are never late along themselves. Two slides that go to
    // and fro have more lateness than any tilt.
    if across.abs() > MOST_ACROSS || p_x.hypot(p_y - slope) > MOST_TILT * 2.0 * p_c {
        return None;
    }
    let residuals = (released + ratio * ratio * pressed) / (1.0 + ratio).powi(2);
    Some([slope / half, residuals.sqrt() / half])
}

/// Returns the least squares' solution of times of this shape, and the variance of its slope along the columns.
fn fit(shape: &[[f64; 4]], times: &[f64]) -> Option<(f64, [f64; 4])> {
    // The normal equations, with the unit vector of the slope as another right side.
    let mut system = [[0.0; 6]; 4];
    for (row, time) in shape.iter().zip(times) {
        for (equation, factor) in system.iter_mut().zip(row) {
            equation[..4].iter_mut().zip(row).for_each(|(sum, other)| *sum += factor * other);
            equation[4] += factor * time;
        }
    }
    system[2][5] = 1.0;
    let solved = solve(system)?;
    let solution = solved.map(|row| row[4]);
    let squares: f64 = shape
        .iter()
        .zip(times)
        .map(|(row, time)| (time - row.iter().zip(solution).map(|(factor, value)| factor * value).sum::<f64>()).powi(2))
        .sum();
    Some((squares / (shape.len() as f64 - 4.0) * solved[2][5], solution))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;
    use wstac_core::params::COLUMNS;
    use wstac_core::rate::FrameRate;
    use wstac_scene::rng::Rng;
    use wstac_scene::{Scene, SceneConfig};

    /// Parts of a frame that are simulated one by one.
    const PARTS: usize = 40;

    type Sums = Vec<Option<[f64; TAXELS]>>;

    /// Returns the keys of a press.
    fn press(number: u64, unit: Option<u32>) -> String {
        let mut rng = Rng::new(0x7ead, number);
        let mut between = |low: f64, high: f64| low + (high - low) * rng.uniform();
        let own = 1 + (between(0.0, 100.0) as u32);
        let unit = unit.unwrap_or(own);
        let (tilt, direction) = (between(0.0, 2.0), between(0.0, 360.0));
        let (overlap, approach, hold) = (between(2.2, 3.5), between(20.0, 150.0), between(0.2, 0.6));
        format!(
            "seed = {number}\n[sensor]\nsize = [400, 400]\n[light]\nunit = {unit}\n[[touch]]\nkind = \"press\"\noverlap = {overlap}\n\
             approach = {approach}\nhold = {hold}\ntilt = {tilt}\ndirection = {direction}\n"
        )
    }

    /// Returns the sums of a scene for each readout, in parts of a frame from a row of taxels to the next.
    fn seen<const N: usize>(text: &str, first: usize, delays: [usize; N]) -> [Sums; N] {
        let script = SceneConfig::from_toml("presses", text).unwrap();
        let mut fine = script.clone();
        fine.sensor.rate = FrameRate::new(30 * PARTS as u32, 1).unwrap();
        let mut scene = Scene::new(&fine).unwrap();
        let mut until = vec![[0.0; TAXELS]];
        while let Some((light, _)) = scene.next_light() {
            let before = until[until.len() - 1];
            until.push(core::array::from_fn(|taxel| before[taxel] + light[taxel] / PARTS as f64));
        }
        let frames = (until.len() - first) / PARTS - 3;
        delays.map(|delay| {
            let mut camera = Scene::camera(&script).unwrap();
            let sums = (0..frames).map(|frame| {
                let light = core::array::from_fn(|taxel| {
                    let start = first + frame * PARTS + taxel / COLUMNS * delay;
                    until[start + PARTS][taxel] - until[start][taxel]
                });
                Some(camera.sums(&light).map(f64::from))
            });
            sums.collect()
        })
    }

    fn pressed<const N: usize>(number: u64, delays: [usize; N]) -> [Sums; N] {
        seen(&press(number, None), number as usize % PARTS, delays)
    }

    /// Returns the readout in ms that a delay is.
    fn ms(delay: usize) -> f64 {
        delay as f64 / PARTS as f64 / 80.0 * 399.0 * 1000.0 / 30.0
    }

    /// Returns the keys of a touch of another kind, by chance.
    fn other(rng: &mut Rng, unit: u32) -> String {
        let kinds = [
            "specimen = \"Fla0\"",
            "specimen = \"Saw3\"",
            "specimen = \"Sin4\"",
            "shape = \"rod\"\ndiameter = 6",
            "shape = \"ball\"\ndiameter = 20",
        ];
        let (speed, direction) = (30.0 * 10_f64.powf(rng.uniform()), 360.0 * rng.uniform());
        format!(
            "seed = {}\n{}\nspeed = {speed}\ndirection = {direction}\n[sensor]\nsize = [400, 400]\n[light]\nunit = {unit}\n",
            rng.below(1000),
            kinds[rng.below(5)]
        )
    }

    const CENTERS: [[f64; 2]; TAXELS] = {
        let mut centers = [[0.0; 2]; TAXELS];
        let mut taxel = 0;
        while taxel < TAXELS {
            centers[taxel] = [(taxel % COLUMNS) as f64 * 80.0 + 40.0, (taxel / COLUMNS) as f64 * 80.0 + 40.0];
            taxel += 1;
        }
        centers
    };

    /// Prints the table for any number of presses: `PRESSES=1000`. The test is of ten.
    #[test]
    fn a_press_and_its_release_tell_the_readout() {
        let presses = std::env::var("PRESSES").map_or(10, |count| count.parse().unwrap());
        let delays = [0, 2, 5, 8];
        let read = |number| pressed(number, delays).map(|sums| readout(&sums, &CENTERS, 400, 30.0));
        let found: Vec<_> = (0..presses).into_par_iter().map(read).collect();
        for (k, delay) in delays.into_iter().enumerate() {
            let truth = ms(delay);
            let told = found.iter().filter_map(|found| found[k].as_ref());
            let mut errors: Vec<f64> = told.map(|found| (found.ms - truth).abs()).collect();
            errors.sort_by(f64::total_cmp);
            let within = errors.iter().filter(|error| **error <= 1.0).count();
            let part = |part: f64| errors.get((errors.len() as f64 * part) as usize).copied().unwrap_or(f64::NAN);
            println!(
                "{delay}: {within} of {presses} within 1 ms, {} told, {:.2} {:.2}",
                errors.len(),
                part(0.5),
                part(0.9)
            );
            assert!(10 * within as u64 >= 9 * presses);
        }
    }

    /// Prints the table for any number of sources: `PRESSES=400`. The test is of 24.
    #[test]
    fn slides_around_presses_leave_the_readout_and_its_deviation() {
        let sources = std::env::var("PRESSES").map_or(24, |count| count.parse().unwrap());
        let delays = [0, 5];
        let read = |number: u64| {
            let mut rng = Rng::new(0x0714, number);
            let unit = 1 + rng.below(100) as u32;
            let pressed = |of: u64| press(2 * number + of, Some(unit));
            let texts = [other(&mut rng, unit), pressed(0), other(&mut rng, unit), pressed(1), other(&mut rng, unit)];
            let parts = texts.map(|text| seen(&text, rng.below(PARTS), delays));
            [0, 1].map(|k| readout(&parts.each_ref().map(|sums| &*sums[k]).concat(), &CENTERS, 400, 30.0))
        };
        let found: Vec<_> = (0..sources).into_par_iter().map(read).collect();
        let told: Vec<_> = found.iter().flat_map(|found| found.iter().zip(delays)).collect();
        let by_sd =
            told.iter().map(|(found, delay)| found.map_or(f64::NAN, |found| (found.ms - ms(*delay)) / found.sd_ms));
        let rms = (by_sd.map(|off| off * off).sum::<f64>() / told.len() as f64).sqrt();
        println!("{sources} sources, all told, errors of {rms:.2} deviations");
        // A source that tells nothing is not a number.
        assert!((0.6..=1.1).contains(&rms), "{rms}: {told:?}");
    }

    #[test]
    fn what_is_no_press_tells_nothing() {
        let slide = |text: &str| {
            let script = SceneConfig::from_toml("slide", text).unwrap();
            let (mut scene, mut camera) = (Scene::new(&script).unwrap(), Scene::camera(&script).unwrap());
            let mut sums = Vec::new();
            while let Some((light, _)) = scene.next_light() {
                sums.push(Some(camera.sums(&light).map(f64::from)));
            }
            sums
        };
        for (speed, direction) in [(60, 0), (150, 90), (150, 45), (300, 80), (400, 270), (600, 180)] {
            let text = format!("specimen = \"Fla0\"\nspeed = {speed}\ndirection = {direction}\n");
            assert_eq!(readout(&slide(&text), &CENTERS, 400, 30.0), None, "{text}");
        }
        // Two slides, nearly to and fro, have flashes that are nearly opposite.
        let two = ["Sin4\"\nspeed = 150\ndirection = 30", "Tri2\"\nspeed = 250\ndirection = 200"];
        let both = two.map(|text| slide(&format!("specimen = \"{text}\n"))).concat();
        assert_eq!(readout(&both, &CENTERS, 400, 30.0), None);
        let [press] = pressed(3, [5]);
        let alone = readout(&press, &CENTERS, 400, 30.0).unwrap();
        // Nor does it change what a press before it tells by more than 0.3 of its deviation.
        for touch in [
            "specimen = \"Saw3\"\nspeed = 60\ndirection = 30",
            "specimen = \"Sin4\"\nspeed = 150\ndirection = 58",
            "specimen = \"Fla0\"\nspeed = 300\ndirection = 90",
            "shape = \"rod\"\ndiameter = 6\nspeed = 60\ndirection = 20",
            "shape = \"ball\"\ndiameter = 20\nspeed = 30",
            "[[touch]]\nkind = \"poke\"\nwhisker = [2, 4]",
        ] {
            let both = [press.clone(), slide(touch)].concat();
            let found = readout(&both, &CENTERS, 400, 30.0);
            assert!(
                found.is_some_and(|found| (found.ms - alone.ms).abs() < 0.3 * alone.sd_ms),
                "{touch}: {found:?}, {alone:?}"
            );
        }
        // The press alone, one with a lost frame, and one that nobody sees.
        assert_eq!(readout(&press[..50], &CENTERS, 400, 30.0), None);
        let mut lost = press.clone();
        lost[46] = None;
        assert_eq!(readout(&lost, &CENTERS, 400, 30.0), None);
        let dark: Vec<_> = press.iter().map(|sums| sums.map(|sums| sums.map(|sum| sum.min(2700.0)))).collect();
        assert_eq!(readout(&dark, &CENTERS, 400, 30.0), None);
    }
}
