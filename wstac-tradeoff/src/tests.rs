//! Tests the whole sweep: its events equal those of the command, whatever other settings run in the same sweep.

use wstac_core::frame::Stride;
use wstac_core::params::{FEATURES, SAMPLE_FRAMES};
use wstac_core::taxels::TaxelSums;

use super::candidate::Candidate;
use super::chosen::Chosen;
use super::parameters::{AnswerLaw, Format, Setting};
use super::slides::{SENSORS, TradeSlide, slides};
use super::streams::{EvaluatedCamera, FirstEvent, camera};
use super::sweep::{self, Plan};
use super::{chosen, map, prices, row};
use wstac_host::config::{Config, Kernel};
use wstac_scene::Scene;
use wstac_train::dataset::{Outcome, Sample, sample};

const SETTINGS: [Setting; 4] = [
    Setting::DEFAULT,
    Setting { format: Format::YuyvLinear, stride: Stride::Three, kernel: Kernel::Libm, law: AnswerLaw::Edges },
    Setting { format: Format::Bayer8, stride: Stride::Two, kernel: Kernel::Micromath, law: AnswerLaw::Published },
    Setting { format: Format::Rgb565, stride: Stride::Five, kernel: Kernel::Fixed, law: AnswerLaw::Coherence },
];

/// Returns a slide's first event with one setting.
fn first_event(slide: &TradeSlide, setting: Setting) -> FirstEvent {
    let script = slide.script(setting.format).unwrap();
    let (mut scene, camera) = (Scene::new(&script).unwrap(), Scene::camera(&script).unwrap());
    let mut camera = EvaluatedCamera::new(camera, setting.format, &[setting], &[0], &Config::default()).unwrap();
    while let Some((light, _)) = scene.next_light() {
        camera.expose(&light, None).unwrap();
    }
    camera.into_streams().next().and_then(|stream| stream.first).unwrap()
}

#[test]
fn a_setting_has_the_programs_events() {
    for (setting, slide) in SETTINGS.into_iter().zip(slides(3)) {
        let script = slide.script(setting.format).unwrap();
        let config = Config::parse(&chosen::config(&setting, "").unwrap()).unwrap();
        let Outcome::Sample(expected, _) = sample(&script, &config).unwrap() else { panic!("{setting}: no sample") };
        let flat = first_event(&slide, setting).sample.unwrap();
        let mut found: Sample = [[0; SAMPLE_FRAMES]; FEATURES];
        for (frame, features) in flat.as_chunks::<FEATURES>().0.iter().enumerate() {
            features.iter().zip(&mut found).for_each(|(feature, row)| row[frame] = *feature);
        }
        assert_eq!(found, *expected, "{setting}");
    }
}

#[test]
fn the_same_whatever_runs_beside_it_and_on_any_number_of_threads() {
    let (config, slides) = (Config::default(), &slides(1)[..2]);
    let models = [Candidate::named("builtin:svm".as_ref()).unwrap()];
    let run = |settings: &[Setting], threads: usize| {
        let plan = Plan { config: &config, settings, models: &models, slides };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sweep::run(&plan)).unwrap()
    };
    let together = run(&SETTINGS, 3);
    assert_eq!(together, run(&SETTINGS, 1));
    for (place, setting) in SETTINGS.into_iter().enumerate() {
        let alone = run(&[setting], 1);
        for (together, alone) in together.iter().zip(&alone) {
            assert_eq!(together[place], alone[0], "{setting}");
        }
    }
}

/// Returns one frame of a slide, with the slide's light at its middle.
fn simulated_frame(slide: &TradeSlide, format: Format) -> Vec<u8> {
    let script = slide.script(format).unwrap();
    let (mut scene, mut camera) = (Scene::new(&script).unwrap(), Scene::camera(&script).unwrap());
    let lights = std::iter::from_fn(|| scene.next_light());
    let frames = lights.skip(48).take(6).map(|(light, _)| camera.expose(&light).to_vec());
    frames.last().unwrap()
}

#[test]
fn colored_formats_see_the_same_noise() {
    let slide = slides(1)[0];
    let [rgb, rgb565, yuyv, mjpeg] =
        [Format::Rgb24, Format::Rgb565, Format::YuyvExact, Format::Mjpeg].map(|format| simulated_frame(&slide, format));
    let rgb = rgb.as_chunks::<3>().0;
    let mut brightest = 0;
    // Levels of six bits are at most five apart: the nearest is at most two off. Other noise would be further away.
    for (rgb, word) in rgb.iter().zip(rgb565.as_chunks::<2>().0) {
        let bits = u16::from_le_bytes(*word) >> 5 & 63;
        assert!((bits << 2 | bits >> 4).abs_diff(rgb[1].into()) <= 2, "{rgb:?} {bits}");
        brightest = brightest.max(rgb[1]);
    }
    assert!(brightest > 20, "{brightest}");
    // Luma is every pixel's own: BT.601, 16 to 235, rounded.
    for ([r, g, b], [luma, _]) in rgb.iter().map(|rgb| rgb.map(f64::from)).zip(yuyv.as_chunks::<2>().0) {
        let expected = 16.0 + 219.0 / 255.0 * (0.299 * r + 0.587 * g + 0.114 * b);
        assert!((f64::from(*luma) - expected).abs() < 1.01, "{r} {g} {b}: {luma}, not {expected}");
    }
    // JPEG keeps most of the noise: a frame of the same light with other noise is further away.
    let again = simulated_frame(&slide.with_other_noise(), Format::Mjpeg);
    let far = |bytes: &[u8]| {
        let apart = rgb.iter().zip(bytes.as_chunks::<3>().0).map(|(a, b)| f64::from(a[1].abs_diff(b[1])));
        apart.sum::<f64>() / rgb.len() as f64
    };
    assert!(1.2 * far(&mjpeg) < far(&again), "{} {}", far(&mjpeg), far(&again));
}

#[test]
fn in_the_dark_exact_ycbcr_is_further_off_than_linear() {
    // The format has few values there: rounding does not average out, and the exact method rounds green once more, in
    // every pixel.
    let slide = slides(1)[0];
    let green = |format: Format| {
        let mut script = slide.script(format).unwrap();
        (script.light.flash_ms, script.light.rubbing_ms) = (0.0, 0.0);
        let (mut scene, mut sensor) = (Scene::new(&script).unwrap(), Scene::camera(&script).unwrap());
        let camera = camera(&sensor, format, Stride::One, &Config::default()).unwrap();
        let mut sums = TaxelSums::new(camera);
        let light = scene.next_light().unwrap().0;
        let taxels = sums.push_frame(sensor.expose(&light)).unwrap();
        f64::from(taxels.iter().sum::<u32>()) / f64::from(25 * camera.pixels())
    };
    let [rgb, exact, linear] = [Format::Rgb24, Format::YuyvExact, Format::YuyvLinear].map(green);
    assert!(exact < rgb && rgb < linear && rgb - exact > 1.5 * (linear - rgb), "{rgb} {exact} {linear}");
}

#[test]
fn a_claim_holds_when_it_is_run_again_and_falls_where_files_were_changed() {
    let folder = std::env::temp_dir().join(format!("wstac-claim-{}", std::process::id()));
    let (config, slides) = (Config::default(), slides(1));
    assert_eq!(slides.len(), SENSORS as usize);
    let models = [Candidate::named("builtin:forest".as_ref()).unwrap()];
    let settings = [Setting { stride: Stride::Five, ..Setting::PUBLISHED }];
    let plan = Plan { config: &config, settings: &settings, models: &models, slides: &slides };
    let row = row::rows(&plan, &sweep::run(&plan).unwrap()).pop().unwrap();
    let right = row.found.accuracy[0].unwrap().mean;
    assert!((30.0..95.0).contains(&right), "{right}");
    let text = chosen::config(&settings[0], "").unwrap();
    chosen::write(&folder, &row, models.first(), &prices::Prices::kept().unwrap(), &[], &text).unwrap();
    let rerun = || {
        let chosen = Chosen::read(&folder).unwrap();
        (chosen.again().unwrap(), chosen.claim)
    };
    let (found, claim) = rerun();
    assert_eq!(map::found(&found), map::found(&claim));
    std::fs::write(folder.join(chosen::CONFIG), text.replace("stride = 5", "stride = 3")).unwrap();
    let (found, claim) = rerun();
    assert_ne!(map::found(&found), map::found(&claim));
    std::fs::write(folder.join(chosen::CONFIG), text).unwrap();
    let other = Candidate::named("builtin:boosted-10".as_ref()).unwrap();
    let bytes: Vec<u8> = other.file.words().iter().flat_map(|word| word.to_le_bytes()).collect();
    std::fs::write(folder.join(chosen::MODEL), bytes).unwrap();
    let (found, claim) = rerun();
    assert_ne!(found.found.accuracy, claim.found.accuracy);
    assert_eq!(found.found.direction_errors, claim.found.direction_errors);
    // A choice without a model leaves no file of an earlier model behind.
    chosen::write(&folder, &row, None, &prices::Prices::kept().unwrap(), &[], "").unwrap();
    assert!(!folder.join(chosen::MODEL).exists() && folder.join(chosen::BUILD).exists());
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn models_are_weighed_with_the_laws_that_they_go_with() {
    let (config, slides) = (Config::default(), slides(1));
    let models = ["svm", "path-svm", "taxel-path-svm"];
    let models = models.map(|name| Candidate::named(format!("builtin:{name}").as_ref()).unwrap());
    let settings = AnswerLaw::ALL.map(|law| Setting { law, stride: Stride::Five, ..Setting::DEFAULT });
    let plan = Plan { config: &config, settings: &settings, models: &models, slides: &slides };
    let rows = row::rows(&plan, &sweep::run(&plan).unwrap());
    let names: Vec<_> = rows.iter().map(|row| (row.setting.law, row.model.as_deref().unwrap_or("none"))).collect();
    let of_path = |law| [(law, "none"), (law, "builtin:path-svm"), (law, "builtin:taxel-path-svm")];
    let published = [(AnswerLaw::Published, "none"), (AnswerLaw::Published, "builtin:svm")];
    let of_arrival = [AnswerLaw::Wave, AnswerLaw::Coherence, AnswerLaw::Edges].map(of_path);
    assert_eq!(names, [of_arrival.as_flattened(), &published].concat());
    for row in &rows {
        // A wave may refuse a slide, which has no direction then.
        let refused = usize::from(row.setting.law == AnswerLaw::Wave);
        assert!(row.found.events == 20 && row.found.direction_errors <= refused, "{row:?}");
        // The wave answers at once, but not with a model of ten sums.
        let is_at_once = row.setting.law == AnswerLaw::Wave && row.model.as_deref() != Some("builtin:path-svm");
        let latency = row.found.latency.unwrap();
        assert!(if is_at_once { latency < 40.0 } else { (55.0..65.0).contains(&latency) }, "{row:?}");
        assert_eq!(row.found.latency, row::motion_latency(row, &rows), "{row:?}");
        let [mean, _] = row.found.speed.unwrap();
        assert!(mean < if row.setting.law == AnswerLaw::Published { 6.0 } else { 1.5 }, "{row:?}");
        // 18 of 20 slides from 50 to 300 mm/s.
        let is_right = |right: f64| right >= if row.setting.law == AnswerLaw::Published { 50.0 } else { 90.0 };
        assert!(row.found.accuracy[0].is_none_or(|right| is_right(right.mean)), "{row:?}");
    }
}
