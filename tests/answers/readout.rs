//! Cameras that read their rows one after the other: how wrong motion then is.

use std::fmt::Write as _;

use wstac_core::green::gray::Gray;
use wstac_core::layout::Layout;
use wstac_core::params::{COLUMNS, TAXELS};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{self, Motion, MotionConfig};
use wstac_host::statistics::percentile;
use wstac_scene::{Scene, Slide, Touch};

use crate::touches::{Kind, each, script};
use crate::{Case, Result, share};

const SLIDES: u64 = 800;
/// Parts of a frame that are simulated one by one. A row of taxels is a fifth of the picture's height, and is read some
/// parts after the one above it.
const PARTS: usize = 50;
/// Readouts in ms from the first to the last row of the picture, and the parts of a frame by which each row of taxels is
/// later than the one above it.
const READOUTS: [(&str, usize); 4] = [("0", 0), ("10", 3), ("20", 6), ("33", 10)];

/// Returns the slide of a number, its sensor, and the motion of its first event with each readout.
fn answer(number: u64) -> (Slide, u32, [Option<Motion>; READOUTS.len()]) {
    let script = script(Kind::Readout, number);
    let mut fine = script.clone();
    fine.sensor.rate = FrameRate::new(30 * PARTS as u32, 1).expect("the rate is in range");
    let mut scene = Scene::new(&fine).expect("the scene was drawn within its limits");
    // The scene starts its touch with a frame, here with any part of one.
    let first = number as usize % PARTS;
    // The light of each taxel until the end of each part.
    let mut until = vec![[0.0; TAXELS]];
    let mut answers = READOUTS.map(|(_, delay)| {
        let camera = Scene::camera(&script).expect("the scene was drawn within its limits");
        let layout = Layout::paper(script.sensor.size).expect("the size is that of the layout");
        let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).expect("sums fit 32 bits");
        let pipeline = Pipeline::builder(geometry).build().expect("all parameters are defaults");
        (delay, camera, pipeline, None)
    });
    for frame in 0.. {
        let end = first + (frame + 2) * PARTS;
        while until.len() <= end
            && let Some((light, _)) = scene.next_light()
        {
            let before = until[until.len() - 1];
            until.push(core::array::from_fn(|taxel| before[taxel] + light[taxel] / PARTS as f64));
        }
        if until.len() <= end || answers.iter().all(|(.., motion)| motion.is_some()) {
            break;
        }
        for (delay, camera, pipeline, motion) in &mut answers {
            let light = core::array::from_fn(|taxel| {
                let start = first + frame * PARTS + taxel / COLUMNS * *delay;
                until[start + PARTS][taxel] - until[start][taxel]
            });
            let update = pipeline.push_taxels(&camera.sums(&light));
            let found =
                update.event().map(|event| motion::by_coherence(&event, MotionConfig::published(FrameRate::NOMINAL)));
            *motion = motion.or(found);
        }
    }
    let Touch::Slide(slide) = script.touches[0] else { unreachable!("all touches are slides") };
    (slide, script.light.unit, answers.map(|(.., motion)| motion))
}

/// Writes the table of readouts.
pub(crate) fn table(page: &mut String) {
    page.push_str(include_str!("readout.txt"));
    let answered = each(SLIDES, answer);
    for (number, (name, _)) in READOUTS.iter().enumerate() {
        let cases: Vec<_> = answered
            .iter()
            .map(|(slide, unit, motions)| Case { slide, unit: *unit, motion: motions[number] })
            .collect();
        let result = Result::new(&cases);
        let of = |errors: &[f64], fraction, unit: f64| {
            percentile(errors.to_vec(), fraction).map_or("–".into(), |value| format!("{:.1}", unit * value))
        };
        let wrong =
            result.speed.iter().zip(&result.degrees).filter(|(speed, degrees)| **speed > 0.1 || **degrees > 10.0);
        let _ = writeln!(
            page,
            "| {name} | {} | {} | {} | {} | {} | {} | {} |",
            result.count,
            share(result.reliable, result.count),
            of(&result.speed, 0.5, 100.0),
            of(&result.speed, 0.95, 100.0),
            of(&result.degrees, 0.5, 1.0),
            of(&result.degrees, 0.95, 1.0),
            share(wrong.count(), result.count),
        );
    }
}
