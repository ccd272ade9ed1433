//! Cameras that read their rows one after the other: how wrong motion then is.

use std::fmt::Write as _;

use wstac_core::green::gray::Gray;
use wstac_core::layout::Layout;
use wstac_core::params::{COLUMNS, TAXELS};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{self, Motion, MotionConfig, Readout, RowOrder};
use wstac_host::statistics::percentile;
use wstac_scene::{Scene, Slide, Touch};

use crate::touches::{Kind, each, script};
use crate::{Case, Result, share};

const SLIDES: u64 = 1000;
/// Parts of a frame that are simulated one by one. A row of taxels is a fifth of the picture's height, and is read some
/// parts after the one above it.
const PARTS: usize = 50;
/// Readouts in ms from the first to the last row of the picture, and the parts of a frame by which each row of taxels is
/// later than the one above it.
const READOUTS: [(&str, usize); 4] = [("0", 0), ("10", 3), ("20", 6), ("33", 10)];

/// The motion of a slide with a readout that is known, and with the same one unknown.
type Motions = Option<[Motion; 2]>;

/// Returns the slide of a number, its sensor, and the motion of its first event with each readout.
fn answer(number: u64) -> (Slide, u32, [Motions; READOUTS.len()]) {
    let kind = if std::env::var_os("PRESS").is_some() { Kind::Press } else { Kind::Readout };
    let script = script(kind, number);
    let mut fine = script.clone();
    fine.sensor.rate = FrameRate::new(30 * PARTS as u32, 1).expect("the rate is in range");
    let mut scene = Scene::new(&fine).expect("the scene was drawn within its limits");
    // The scene starts its touch with a frame, here with any part of one.
    let first = number as usize % PARTS;
    // The light of each taxel until the end of each part.
    let mut until = vec![[0.0; TAXELS]];
    let layout = Layout::paper(script.sensor.size).expect("the size is that of the layout");
    let mut answers = READOUTS.map(|(_, delay)| {
        let camera = Scene::camera(&script).expect("the scene was drawn within its limits");
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
            let found = update.event().map(|event| {
                // The time of all rows: that of five rows of taxels.
                let ms = (5 * *delay) as f32 / PARTS as f32 * 1000.0 / 30.0;
                [Some(ms), None].map(|ms| {
                    let readout = Readout::of_layout(ms, RowOrder::Down, &layout, FrameRate::NOMINAL);
                    motion::by_coherence(&event, MotionConfig::published(FrameRate::NOMINAL).with_readout(readout))
                })
            });
            *motion = motion.or(found);
        }
    }
    let slide =
        script.touches[0].slide().copied().unwrap_or(Slide::new(wstac_scene::specimen::Specimen::ALL[0], 1000.0, 0.0));
    (slide, script.light.unit, answers.map(|(.., motion)| motion))
}

/// Writes the table of readouts.
pub(crate) fn table(page: &mut String) {
    page.push_str(include_str!("readout.txt"));
    let answered = each(SLIDES, answer);
    let dump = std::env::var_os("DUMP").is_some();
    for (known, of_known) in ["known", "unknown"].into_iter().enumerate() {
        for (number, (name, _)) in READOUTS.iter().enumerate() {
            let cases: Vec<_> = answered
                .iter()
                .map(|(slide, unit, motions)| Case {
                    slide,
                    unit: *unit,
                    motion: motions[number].map(|both| both[known]),
                })
                .collect();
            if dump {
                for c in &cases {
                    let m = c.motion;
                    let v = m.and_then(|m| m.velocity).unwrap_or_default();
                    let _ = writeln!(
                        page,
                        "D,{of_known},{name},{},{},{:?},{},{:?},{},{},{},{}",
                        c.slide.speed_mm_s,
                        c.slide.direction_deg,
                        m.map(|m| m.contact),
                        m.is_some_and(|m| m.reliable),
                        m.and_then(|m| m.doubt),
                        v.mm_s,
                        v.mm_s_sd,
                        v.degrees,
                        v.degrees_sd
                    );
                }
            }
            let _ = writeln!(page, "{}", row(of_known, name, &cases));
        }
    }
}

fn row(known: &str, name: &str, cases: &[Case<'_>]) -> String {
    let result = Result::new(cases);
    let of = |errors: &[f64], fraction, unit: f64| {
        percentile(errors.to_vec(), fraction).map_or("–".into(), |value| format!("{:.2}", unit * value))
    };
    let wrong = result.speed.iter().zip(&result.degrees).filter(|(speed, degrees)| **speed > 0.1 || **degrees > 10.0);
    format!(
        "| {known} | {name} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
        result.count,
        share(result.reliable, result.count),
        of(&result.speed, 0.5, 100.0),
        of(&result.speed, 0.95, 100.0),
        of(&result.degrees, 0.5, 1.0),
        of(&result.degrees, 0.95, 1.0),
        share(result.within[0], result.reliable),
        share(result.within[1], result.reliable),
        share(wrong.count(), result.count),
    )
}
