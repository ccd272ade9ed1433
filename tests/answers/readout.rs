//! Cameras that read their rows one after the other: motion with a readout that is known, and with the same one
//! unknown.
//!
//! The light is simulated in parts of a frame, of which each row has its own: without the scene's rolling shutter.

use std::fmt::Write as _;

use wstac_core::green::gray::Gray;
use wstac_core::layout::Layout;
use wstac_core::params::{COLUMNS, TAXELS};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{Motion, MotionConfig, Readout, ReadoutTime, RowOrder};
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_host::statistics::percentile;
use wstac_scene::{Scene, Slide};

use crate::touches::{Kind, by_default, each, script};
use crate::{Case, Result, share};

const SLIDES: u64 = 1000;
/// Parts of a frame that are simulated one by one. A row of taxels is a fifth of the picture's height, and is read some
/// parts after the one above it.
const PARTS: usize = 50;
/// Readouts in ms from the first to the last row of the picture, the parts of a frame by which each row of taxels is
/// later than the one above it, and the exposure in ms and in parts.
const CAMERAS: [(&str, usize, &str, usize); 6] = [
    ("0", 0, "33", 50),
    ("10", 3, "33", 50),
    ("20", 6, "33", 50),
    ("33", 10, "33", 50),
    ("33", 10, "16", 24),
    ("33", 10, "8", 12),
];
/// The cameras whose exposure is the whole frame.
const WHOLE: usize = 4;

/// The motion of a touch with a known readout and with an unknown one; `None` without an event.
type Motions = Option<[Motion; 2]>;

/// Returns the slide of a number, and the motion of its first event before each camera.
fn answer(number: u64) -> (Slide, [Motions; CAMERAS.len()]) {
    let script = script(Kind::Readout, number);
    let slide = *script.touches[0].slide().expect("all touches are slides");
    let layout = Layout::paper(script.sensor.size).expect("the size is that of the layout");
    let mut fine = script.clone();
    fine.sensor.rate = FrameRate::new(30 * PARTS as u32, 1).expect("the rate is in range");
    let mut scene = Scene::new(&fine).expect("the scene was drawn within its limits");
    // The scene starts its touch with a frame, here with any part of one.
    let first = number as usize % PARTS;
    // The light of each taxel until the end of each part.
    let mut until = vec![[0.0; TAXELS]];
    let mut answers = CAMERAS.map(|(_, delay, _, open)| {
        let camera = Scene::camera(&script).expect("the scene was drawn within its limits");
        let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).expect("sums fit 32 bits");
        let pipeline = Pipeline::builder(geometry).taxels::<TaxelRing>().build().expect("all parameters are defaults");
        (delay, open, camera, pipeline, None)
    });
    for frame in 0.. {
        let end = first + (frame + 2) * PARTS;
        while until.len() <= end
            && let Some((light, _)) = scene.next_light()
        {
            let before = until[until.len() - 1];
            until.push(core::array::from_fn(|taxel| before[taxel] + light[taxel] / PARTS as f64));
        }
        if until.len() <= end || answers.iter().all(|(.., motions)| motions.is_some()) {
            break;
        }
        for (delay, open, camera, pipeline, motions) in &mut answers {
            let light = core::array::from_fn(|taxel| {
                let start = first + frame * PARTS + taxel / COLUMNS * *delay;
                until[start + *open][taxel] - until[start][taxel]
            });
            let update = pipeline.push_taxels(&camera.sums(&light));
            let found = update.event().map(|event| {
                let time = ReadoutTime::from_ms((5 * *delay) as f32 / PARTS as f32 * 1000.0 / 30.0);
                [time, None].map(|time| {
                    let readout = Readout::of_layout(time, RowOrder::Down, &layout, FrameRate::NOMINAL);
                    by_default(&event, MotionConfig::published(FrameRate::NOMINAL).with_readout(readout))
                })
            });
            *motions = motions.or(found);
        }
    }
    (slide, answers.map(|(.., motions)| motions))
}

/// Writes the tables of readouts.
pub(crate) fn table(page: &mut String) {
    page.push_str(include_str!("readout.txt"));
    let answered = each(SLIDES, answer);
    let cases = |known: usize, camera: usize| {
        let case =
            |(slide, motions): &'_ (Slide, [Motions; CAMERAS.len()])| (*slide, motions[camera].map(|both| both[known]));
        answered.iter().map(case).collect::<Vec<_>>()
    };
    let of_known = [cases_of(&cases, 0), cases_of(&cases, 1)];
    for (name, of_cameras) in ["known", "unknown"].into_iter().zip(&of_known) {
        for ((readout, _, exposure, _), found) in CAMERAS.iter().zip(of_cameras) {
            // A known readout matters little: the page has its ends.
            if name == "known" && !["0", "33"].contains(readout) {
                continue;
            }
            let _ = writeln!(page, "| {name} | {readout} | {exposure} | {}", row(found));
        }
    }
    for camera in 0..WHOLE {
        meets_goals(&of_known, camera);
    }
    page.push_str(READOUTS);
    for [low, high] in [[10.0, 30.0], [30.0, 100.0], [100.0, 200.0], [200.0, 300.0], [300.0, 600.0]] {
        let _ = write!(page, "| {low} to {high} mm/s |");
        for found in of_known.iter().flat_map(|of_cameras| [&of_cameras[0], &of_cameras[WHOLE - 1]]) {
            let result = Result::new(&of(found, &|slide| (low..high).contains(&slide.speed_mm_s)));
            let _ = write!(page, " {} |", share(result.reliable, result.count));
        }
        page.push('\n');
    }
    page.push('\n');
}

/// Checks the goals of the page for a camera whose exposure is the whole frame.
fn meets_goals([known, unknown]: &[Vec<Vec<Found>>; 2], camera: usize) {
    let name = CAMERAS[camera].0;
    let result = Result::new(&of(&known[camera], &|_| true));
    let median = percentile(result.speed.clone(), 0.5).expect("slides are reliable");
    assert!(wrong(&result) == 0 && median <= 0.006, "{name} ms, known: {} wrong, {median}", wrong(&result));
    for within in result.within {
        let part = within as f64 / result.reliable as f64;
        // Deviations that are too wide miss their goal on the page; those that are too small are wrong.
        assert!(part >= 0.63, "{name} ms, known: {part} within one standard deviation");
    }
    let result = Result::new(&of(&unknown[camera], &|_| true));
    assert!(wrong(&result) as u64 <= SLIDES / 500, "{name} ms, unknown: {} wrong", wrong(&result));
    let slow = Result::new(&of(&unknown[camera], &|slide| slide.speed_mm_s < 100.0));
    assert!(slow.reliable * 100 >= slow.count * 85, "{name} ms, unknown: {} of {}", slow.reliable, slow.count);
}

/// Returns how many reliable slides are off by more than 10 % or 10°.
fn wrong(result: &Result) -> usize {
    result.speed.iter().zip(&result.degrees).filter(|(speed, degrees)| **speed > 0.1 || **degrees > 10.0).count()
}

/// A slide, and its motion before a camera.
type Found = (Slide, Option<Motion>);

fn cases_of(cases: &impl Fn(usize, usize) -> Vec<Found>, known: usize) -> Vec<Vec<Found>> {
    (0..CAMERAS.len()).map(|camera| cases(known, camera)).collect()
}

/// Returns the cases of some slides.
fn of<'a>(found: &'a [Found], is_in: &dyn Fn(&Slide) -> bool) -> Vec<Case<'a>> {
    let case = |(slide, motion): &'a Found| Case { slide, motion: *motion };
    found.iter().filter(|(slide, ..)| is_in(slide)).map(case).collect()
}

const READOUTS: &str = "
Reliable slides by speed, in percent, by the readout in ms:

| slides | known: 0 | 33 | unknown: 0 | 33 |
| --- | --- | --- | --- | --- |
";

fn row(found: &[Found]) -> String {
    let result = Result::new(&of(found, &|_| true));
    format!("{} | {} |", result.cells().join(" | "), share(wrong(&result), result.count))
}
