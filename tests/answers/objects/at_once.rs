//! Answers before 70 frames have arrived: how early they come, and what they are worth beside those of whole samples.

use std::fmt::Write as _;

use wstac_core::features::FeatureScale;
use wstac_core::law::{Answer, ByWave};
use wstac_core::paper::trigger::Event;
use wstac_core::touch::at_once::{AtOnce, answer as answer_of};
use wstac_core::touch::slip::SlipDetector;
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_host::model_file::ModelFile;
use wstac_host::output::Output;
use wstac_host::session::Session;
use wstac_host::texture::{NoTexture, Textures};
use wstac_scene::rng::Rng;
use wstac_scene::sensor::Fidelity;
use wstac_scene::source::SceneSource;
use wstac_scene::specimen::{Pattern, Specimen};
use wstac_scene::{SceneConfig, Slide, Touch};

use super::{
    Answered, Fault, FrameGeometry, Gray, JUDGE, Kind, Layout, MotionConfig, Pipeline, ROWS, Readout, SLIDES, SPEEDS,
    Scene, SimulatedFrame, Tally, TriggerConfig, answer, each, percentile,
};
use crate::{at_least, bold, interval, share};

/// Faults of the mix that are hardest.
const HARD: [Fault; 5] = [Fault::None, Fault::Noise, Fault::Lost, Fault::Rate(15), Fault::UnknownReadout];
/// Slides of a texture of the row by texture.
const OF_TEXTURE: u64 = 50;
/// The first sensor of textures. No other part of the project uses it or those behind it.
const FIRST_SENSOR: u32 = 95_000;
/// Speeds of slow blocks in mm/s, and slides at each.
const SLOW: [f64; 12] = [5.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 20.0, 25.0, 30.0, 40.0, 50.0];
const BLOCKS: u64 = 40;
/// A block of 60 mm at 150 mm/s should have speed, direction and texture within this time after the first touch.
const GOAL_S: f64 = 0.6;

/// Returns the model that comes with the program.
pub(crate) fn shipped_model() -> Textures {
    let model = ModelFile::open("builtin:taxel-path-svm".as_ref()).expect("it comes with the program");
    Textures::new(&[model]).expect("it is one model of textures")
}

/// Returns what `take` finds in the answers about a scene, which come as the program gives them; `None` if it finds
/// nothing.
pub(crate) fn in_answers<T>(
    script: &SceneConfig,
    scene: &mut Scene,
    mut take: impl FnMut(&Event<'_>, &Answer, (MotionConfig, &FeatureScale)) -> Option<T>,
) -> Option<T> {
    let layout = Layout::paper(script.sensor.size).expect("the size is that of the layout");
    let geometry = FrameGeometry::new(Gray, layout, script.sensor.rate).expect("sums fit 32 bits");
    let scale = FeatureScale::of(&geometry, 0.5).expect("the floor fits");
    let builder = Pipeline::builder(geometry).trigger(TriggerConfig::default().one_event_per_touch());
    let mut pipeline = builder.taxels::<TaxelRing>().build().expect("all parameters are defaults");
    let config = MotionConfig::published(script.sensor.rate).with_readout(Readout::GLOBAL);
    let (law, mut at_once) = (ByWave(config), AtOnce::new(config));
    let mut slip = SlipDetector::new(script.sensor.rate);
    while let Some(shot) = scene.next_shot() {
        let update = match shot {
            SimulatedFrame::Taxels(sums) => pipeline.push_taxels(&sums),
            SimulatedFrame::Frame(bytes) => pipeline.push_frame(bytes).expect("it is a whole frame"),
            _ => continue,
        };
        slip.push(&update);
        let answered = update.touch().or(update.event()).and_then(|touch| {
            answer_of(&touch, &law, Some(&mut at_once), Some(&slip), |answer| take(&touch, answer, (config, &scale)))?
        });
        if answered.is_some() {
            return answered;
        }
    }
    None
}

/// Returns the seconds from the first touch to the answer of speed, direction and texture, and whether the texture is
/// right; `None` if the answer came with the whole sample, or not at all.
fn of_texture(textures: &Textures, number: u64) -> Option<(f64, bool)> {
    let mut rng = Rng::new(JUDGE, 3 << 48 | number);
    let specimen = Specimen { length_mm: 60.0, ..Specimen::ALL[number as usize % Specimen::ALL.len()] };
    let mut script = SceneConfig::new(vec![Touch::Slide(Slide::new(specimen, 150.0, 360.0 * rng.uniform()))]);
    script.light.unit = FIRST_SENSOR + number as u32;
    script.seed = JUDGE + number;
    let mut scene = Scene::new(&script).expect("the scene was drawn within its limits");
    let start = scene.truth()[0].start_frame();
    in_answers(&script, &mut scene, |touch, found, (config, scale)| {
        let texture = textures.of_event(touch, found, config, scale);
        if touch.is_event() || texture == Err(NoTexture::TooShort) && touch.is_under_way() {
            return None;
        }
        let name = format!("{}{}", specimen.pattern.name(), specimen.depth_mm);
        let is_right = texture.is_ok_and(|texture| texture.specimen == Some(name));
        Some(((touch.last_frame() + 1 - start) as f64 / 30.0, is_right))
    })
}

/// Returns the number of events of a slide of a block.
fn events_of_block(block: Specimen, mm_s: f64, number: u64) -> usize {
    let mut rng = Rng::new(JUDGE, 5 << 48 | number);
    let mut script = SceneConfig::new(vec![Touch::Slide(Slide::new(block, mm_s, 360.0 * rng.uniform()))]);
    (script.fidelity, script.seed, script.light.unit) = (Fidelity::Taxel, rng.bits(), FIRST_SENSOR + number as u32);
    let source = SceneSource::new(&script).expect("the scene was drawn within its limits");
    let session = Session::builder(source).build().expect("all parameters are defaults");
    session.filter(|output| matches!(output, Ok(Output::Event(_)))).count()
}

/// Writes how often a slow slide of a block is more than one event.
pub(crate) fn blocks(page: &mut String) {
    let _ = write!(page, "Blocks with more than one event (goal: 0 %), {BLOCKS} each, within ±15 %,");
    let speeds = SLOW.map(|mm_s| mm_s.to_string()).join("/");
    let _ = write!(page, " at {speeds} mm/s:");
    for (name, block) in [("flat", Specimen::ALL[0]), ("Saw4", Specimen::block(Pattern::Saw, 4.0))] {
        let count =
            |mm_s| each(BLOCKS, |number| events_of_block(block, mm_s, number)).iter().filter(|of| **of > 1).count();
        let part = |count| bold(count > 0, share(count, BLOCKS as usize));
        let parts = SLOW.map(|mm_s| part(count(mm_s))).join("/");
        let _ = write!(page, "{} {name} {parts} %", if name == "flat" { "" } else { "," });
    }
    page.push_str(".\n\n");
}

/// Writes the section of the page.
pub(crate) fn section(page: &mut String) {
    page.push_str(include_str!("../at_once.txt"));
    let _ = writeln!(page, "| touch | after, s: median/p95 | reliable/wrong, % |\n| --- | --- | --- |");
    let (mut early, mut reliable) = (0, 0);
    for row in ROWS.iter().filter(|row| row.kind != Kind::Mix || HARD.contains(&row.fault)) {
        let answered = each(SLIDES, |number| answer(row, SPEEDS, number, true));
        let tally = Tally::new(&answered);
        let after: Vec<f64> = answered.iter().filter_map(|one: &Answered| one.after).collect();
        let second = |fraction| percentile(after.clone(), fraction).map_or("–".into(), |time| format!("{time:.2}"));
        let _ = writeln!(page, "| {} | {}/{} | {} |", row.touch, second(0.5), second(0.95), tally.fractions());
        (early, reliable) = (early + after.len(), reliable + tally.reliable);
    }
    let _ = writeln!(page, "\n{} % of these answers came before the whole sample.", share(early, reliable));
    let textures = shipped_model();
    let count = OF_TEXTURE * Specimen::ALL.len() as u64;
    let found: Vec<(f64, bool)> = each(count, |number| of_texture(&textures, number)).into_iter().flatten().collect();
    let within = |limit: f64| found.iter().filter(|(time, _)| *time <= limit).count();
    let second = |fraction| percentile(found.iter().map(|(time, _)| *time).collect(), fraction).unwrap_or(f64::NAN);
    let _ = writeln!(
        page,
        "\nBlocks of 60 mm with the ten textures, at 150 mm/s in any direction, {OF_TEXTURE} of each: {} % have speed, direction and \
         texture within {GOAL_S} s of the first touch (goal: all), {} % before the whole sample, after {:.2} s (median) and {:.2} s \
         (p95); {} % of these textures are right.\n",
        at_least(within(GOAL_S), count as usize, 100.0),
        interval(found.len(), count as usize),
        second(0.5),
        second(0.95),
        interval(found.iter().filter(|(_, is_right)| *is_right).count(), found.len()),
    );
    blocks(page);
}
