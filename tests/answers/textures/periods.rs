//! Periods of textures: shares that are told and right, deviations, and objects without a period.

use std::fmt::Write as _;

use wstac_core::touch::path_sample;
use wstac_core::touch::wave::Measured;
use wstac_host::texture::{NoTexture, Textures};
use wstac_scene::rng::Rng;
use wstac_scene::specimen::Specimen;
use wstac_scene::{Scene, SceneConfig, Slide, Touch};

use crate::objects::at_once::{in_answers, shipped_model};
use crate::objects::scenes::{Fault, JUDGE, Kind, draw};
use crate::touches::each;
use crate::{interval, share};

const SPEEDS: [f64; 6] = [20.0, 30.0, 50.0, 80.0, 120.0, 300.0];
const SLIDES: u64 = 600;
/// The first sensor. No other part of the project uses it or those behind it.
const FIRST_SENSOR: u32 = 97_000;
/// A period is right if it is off by at most this fraction.
const RIGHT: f64 = 0.05;
const OBJECTS: [(&str, Kind); 6] = {
    let [rods, balls, coins, fingers, ..] = super::conditions::OBJECTS;
    [rods, balls, coins, fingers, ("oblique bare edges and rods", Kind::Oblique), ("rods at an angle", Kind::SkewedRod)]
};

/// Returns the period of the first event, as `wstac run` has it with the model that comes with it.
fn of_scene(textures: &Textures, script: &SceneConfig) -> Option<Measured> {
    let mut scene = Scene::new(script).expect("the scene was drawn within its limits");
    in_answers(script, &mut scene, |touch, found, (config, scale)| {
        let is_early =
            touch.is_under_way() && textures.of_event(touch, found, config, scale) == Err(NoTexture::TooShort);
        (!is_early).then(|| {
            let velocity = found.velocity().filter(|_| found.reliable)?;
            path_sample::period(touch, &velocity, config)
        })
    })
    .flatten()
}

/// Returns the section of the page.
pub(crate) fn section() -> String {
    let (mut page, textures) = (String::from(HEAD), shipped_model());
    for (row, speeds) in SPEEDS.windows(2).enumerate() {
        let of = |number: u64| {
            let mut rng = Rng::new(JUDGE, 4 << 48 | (row as u64) << 32 | number);
            let mut between = |low: f64, high: f64| low + (high - low) * rng.uniform();
            let pattern = Specimen::ALL[1 + between(0.0, 9.0) as usize].pattern;
            let specimen = Specimen { length_mm: between(60.0, 120.0), ..Specimen::block(pattern, between(1.5, 5.0)) };
            let speed = speeds[0] * (speeds[1] / speeds[0]).powf(between(0.0, 1.0));
            let slide = Slide::new(specimen, speed, between(0.0, 360.0));
            let mut script = SceneConfig::new(vec![Touch::Slide(slide)]);
            script.light.unit = FIRST_SENSOR + number as u32;
            script.seed = JUDGE + number;
            let found = of_scene(&textures, &script)?;
            let off = (f64::from(found.value) - specimen.period_mm).abs();
            Some((off / specimen.period_mm, off / f64::from(found.sd)))
        };
        let found: Vec<(f64, f64)> = each(SLIDES, of).into_iter().flatten().collect();
        let count = |is_one: &dyn Fn(&(f64, f64)) -> bool| found.iter().filter(|one| is_one(one)).count();
        let right = count(&|one| one.0 <= RIGHT);
        let _ = writeln!(
            page,
            "| {} to {} mm/s | {} | {} | {} | {}/{} |",
            speeds[0],
            speeds[1],
            share(found.len(), SLIDES as usize),
            interval(right, SLIDES as usize),
            interval(found.len() - right, SLIDES as usize),
            share(count(&|one| one.1 <= 1.0), found.len()),
            share(count(&|one| one.1 <= 2.0), found.len()),
        );
    }
    let of_objects = OBJECTS.map(|(name, kind)| {
        let told = each(500, |number| of_scene(&textures, &draw(kind, Fault::None, [30.0, 300.0], number).script));
        format!("{name} {}", interval(told.iter().flatten().count(), told.len()))
    });
    let _ =
        writeln!(page, "\nOf 500 objects of each kind, so many have a period, in percent: {}.", of_objects.join(", "));
    page
}

const HEAD: &str = "
### Periods of textures

Textures of all patterns with periods of 3 to 10 mm, from 60 to 120 mm long, in any direction, 600 in each row.
Right is within 5 %.

| speed | told, % | right, % of all | wrong, % of all | within 1/2 sd, % of told |
| --- | ---: | ---: | ---: | ---: |
";
