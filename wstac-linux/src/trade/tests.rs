//! The sweep as a whole: it hears what the program would, whatever runs beside it.

use wstac_core::frame::Stride;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};

use super::bank::{Eye, Heard};
use super::candidate::Candidate;
use super::knobs::{Format, Front};
use super::slides::{SENSORS, TradeSlide, slides};
use super::sweep::{self, Plan};
use super::{chosen, map, prices, row};
use crate::config::{Config, Kernel};
use crate::dataset::{Outcome, Sample, sample};
use crate::scene::Scene;

const FRONTS: [Front; 4] = [
    Front::DEFAULT,
    Front { format: Format::YuyvLinear, stride: Stride::Three, kernel: Kernel::Libm },
    Front { format: Format::Bayer8, stride: Stride::Two, kernel: Kernel::Micromath },
    Front { format: Format::Rgb565, stride: Stride::Five, kernel: Kernel::Fixed },
];

/// What one setting hears of a slide.
fn heard(slide: &TradeSlide, front: Front) -> Heard {
    let script = slide.script(1.0, front.format).unwrap();
    let (mut scene, camera) = (Scene::new(&script).unwrap(), Scene::camera(&script).unwrap());
    let mut eye = Eye::new(camera, front.format, &[front], &Config::default()).unwrap();
    while let Some((light, _)) = scene.next_light() {
        eye.expose(&light, None).unwrap();
    }
    eye.into_ears().next().and_then(|ear| ear.heard).unwrap()
}

#[test]
fn a_setting_hears_what_the_program_does() {
    for (front, slide) in FRONTS.into_iter().zip(slides(3)) {
        let script = slide.script(1.0, front.format).unwrap();
        let config = Config::parse(&chosen::config(&front)).unwrap();
        let Outcome::Sample(expected, _) = sample(&script, &config).unwrap() else { panic!("{front}: no sample") };
        let flat = heard(&slide, front).sample;
        let mut found: Sample = [[0; SAMPLE_FRAMES]; FEATURES];
        for (frame, features) in flat.as_chunks::<FEATURES>().0.iter().enumerate() {
            features.iter().zip(&mut found).for_each(|(feature, row)| row[frame] = *feature);
        }
        assert_eq!(found, *expected, "{front}");
    }
}

#[test]
fn the_same_whatever_runs_beside_it_and_on_any_number_of_threads() {
    let (config, slides) = (Config::default(), &slides(1)[..2]);
    let models = [Candidate::named("builtin:svm".as_ref()).unwrap()];
    let run = |fronts: &[Front], threads: usize| {
        let plan = Plan { config: &config, fronts, models: &models, slides, light: 1.0 };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sweep::run(&plan)).unwrap()
    };
    let together = run(&FRONTS, 3);
    assert_eq!(together, run(&FRONTS, 1));
    for (place, front) in FRONTS.into_iter().enumerate() {
        let alone = run(&[front], 1);
        for (together, alone) in together.iter().zip(&alone) {
            assert_eq!(together[place], alone[0], "{front}");
        }
    }
}

#[test]
fn coloured_formats_see_the_same_noise() {
    let slide = slides(1)[0];
    let shot = |format| {
        let script = slide.script(1.0, format).unwrap();
        let (mut scene, mut camera) = (Scene::new(&script).unwrap(), Scene::camera(&script).unwrap());
        let lights = std::iter::from_fn(|| scene.next_light());
        let frames = lights.skip(48).take(6).map(|(light, _)| camera.expose(&light).to_vec());
        frames.last().unwrap()
    };
    let rgb = shot(Format::Rgb24);
    let rgb565 = shot(Format::Rgb565);
    let mut brightest = 0;
    // Levels of six bits are at most five apart: the nearest is at most two off. Other noise would be further.
    for (rgb, word) in rgb.as_chunks::<3>().0.iter().zip(rgb565.as_chunks::<2>().0) {
        let bits = u16::from_le_bytes(*word) >> 5 & 63;
        assert!((bits << 2 | bits >> 4).abs_diff(rgb[1].into()) <= 2, "{rgb:?} {bits}");
        brightest = brightest.max(rgb[1]);
    }
    assert!(brightest > 20, "{brightest}");
}

#[test]
fn a_claim_holds_when_it_is_run_again_and_falls_where_files_were_changed() {
    let folder = std::env::temp_dir().join(format!("wstac-claim-{}", std::process::id()));
    let (config, slides) = (Config::default(), slides(1));
    assert_eq!(slides.len(), SENSORS as usize);
    let models = [Candidate::named("builtin:forest".as_ref()).unwrap()];
    let fronts = [Front { format: Format::Grey, stride: Stride::Five, kernel: Kernel::Fixed }];
    let plan = Plan { config: &config, fronts: &fronts, models: &models, slides: &slides, light: 1.0 };
    let row = row::rows(&plan, &sweep::run(&plan).unwrap()).pop().unwrap();
    chosen::write(&folder, &row, models.first(), &prices::Prices::kept().unwrap()).unwrap();
    let [found, claim] = chosen::rerun(&folder).unwrap();
    assert_eq!(map::found(&found), map::found(&claim));
    std::fs::write(folder.join(chosen::CONFIG), "[green]\nstride = 3\n").unwrap();
    let [found, claim] = chosen::rerun(&folder).unwrap();
    assert_ne!(map::found(&found), map::found(&claim));
    std::fs::remove_dir_all(&folder).unwrap();
}
