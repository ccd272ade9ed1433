use wstac_core::green::any::{Any, YcbcrMethod};
use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::fixed::Fixed;
use wstac_core::paper::direction::{self, Heading};
use wstac_core::paper::speed::{self, SpeedConfig};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::FrameGeometry;

use super::specimen::Specimen;
use super::surface::Surface;
use super::whisker::Bending;
use super::*;

const HEADINGS: [Heading; 4] = [Heading::Right, Heading::Up, Heading::Left, Heading::Down];

/// The size of small frames: a seventh of the pixels, the same light.
const SMALL: (u32, u32) = (280, 280);

struct Answer {
    frame: u64,
    reliable: bool,
    speed: f64,
    heading: Heading,
    confidence: f32,
}

fn sized(mut script: SceneConfig, (width, height): (u32, u32)) -> SceneConfig {
    script.sensor.size = FrameSize::new(width, height).unwrap();
    script
}

fn one(slide: &Slide, seed: u64, size: (u32, u32)) -> SceneConfig {
    let text = format!("{}@{},{}deg,seed={seed}", slide.specimen, slide.speed_mm_s, slide.direction_deg);
    sized(SceneConfig::parse_short(&text).unwrap(), size)
}

/// Returns the events of a scene, computed by the whole core.
fn events(script: &SceneConfig) -> Vec<Answer> {
    let camera = FrameGeometry::new(Gray, Layout::paper(script.sensor.size).unwrap(), script.sensor.rate).unwrap();
    let mut pipeline = Pipeline::builder(camera).build().unwrap();
    let config = SpeedConfig::published(script.sensor.rate);
    let (mut scene, mut answers) = (Scene::new(script).unwrap(), Vec::new());
    while let Some(SimulatedFrame::Frame(frame)) = scene.next_shot() {
        let Some(event) = pipeline.push_frame(frame).unwrap().event() else { continue };
        let direction = direction::direction(&event);
        answers.push(Answer {
            frame: event.frame,
            reliable: event.reliable,
            speed: f64::from(speed::speed(&event, &config).unwrap().mm_s),
            heading: direction.heading().unwrap(),
            confidence: direction.confidence().unwrap(),
        });
    }
    let finished = pipeline.finish();
    assert!(finished.event().is_none());
    assert!(finished.end().incomplete.is_none());
    answers
}

/// Checks that every specimen, direction and speed of the paper's range gives one event with the right answers.
#[test]
fn every_slide_is_one_event_with_the_right_answers() {
    let (mut worst, mut least) = (0.0_f64, 1.0_f32);
    for specimen in Specimen::ALL {
        for speed_mm_s in [100.0, 150.0, 200.0] {
            for (seed, heading) in (0..).zip(HEADINGS) {
                let slide = Slide::new(specimen, speed_mm_s, heading.degrees().into());
                let script = one(&slide, seed, SMALL);
                let start = Scene::new(&script).unwrap().truth()[0].start_frame();
                let answers = events(&script);
                let [answer] = &answers[..] else { panic!("{slide:?} is {} events", answers.len()) };
                let error = answer.speed / speed_mm_s - 1.0;
                assert!(answer.reliable, "{slide:?}");
                assert!((answer.frame + 5..=answer.frame + 15).contains(&start), "{slide:?} {}", answer.frame);
                assert_eq!(answer.heading, heading, "{slide:?}");
                worst = worst.max(error.abs());
                least = least.min(answer.confidence);
            }
        }
    }
    assert!(worst < 0.12 && least > 0.5, "speed error {worst:.3}, confidence {least:.2}");
}

fn hash(script: &SceneConfig) -> u64 {
    let mut scene = Scene::new(script).unwrap();
    let (mut hash, mut frames) = (0xCBF2_9CE4_8422_2325, 0);
    while let Some(SimulatedFrame::Frame(frame)) = scene.next_shot() {
        // FNV-1a.
        hash = frame.iter().fold(hash, |hash: u64, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3));
        frames += 1;
    }
    assert_eq!(frames, scene.frames());
    hash
}

/// Checks hashes that were made on x86-64; any other machine must make the same bytes.
#[test]
fn a_seed_gives_the_same_bytes_everywhere() {
    let slide = Slide::new("Sin3".parse().unwrap(), 170.0, 180.0);
    let small = |seed| hash(&one(&slide, seed, (60, 40)));
    assert_eq!(small(7), 0xC064_89BF_52B9_42A1);
    assert_eq!(small(7), small(7));
    assert_ne!(small(7), small(8));
}

#[test]
fn slides_of_a_script_are_an_event_each() {
    let text =
        "[[slide]]\nspecimen = \"Saw3\"\nspeed = 120\n[[slide]]\nspecimen = \"Fla0\"\nspeed = 200\ndirection = 270";
    let script = sized(SceneConfig::from_toml("s", text).unwrap(), (160, 120));
    let (answers, scene) = (events(&script), Scene::new(&script).unwrap());
    assert_eq!(answers.len(), 2);
    for (answer, truth) in answers.iter().zip(scene.truth()) {
        let slide = truth.touch.slide().unwrap();
        assert_eq!(Some(answer.heading), slide.heading());
        assert!((answer.frame..answer.frame + 20).contains(&truth.start_frame()));
        assert!((answer.speed / slide.speed_mm_s - 1.0).abs() < 0.12);
    }
}

#[test]
fn other_frame_rates_see_the_same_slide() {
    for (numerator, denominator) in [(25, 1), (60_000, 1001), (120, 1)] {
        let slide = Slide::new("Tri3".parse().unwrap(), 150.0, 90.0);
        let rate = FrameRate::new(numerator, denominator).unwrap();
        let mut script = one(&slide, 3, (100, 100));
        script.sensor.rate = rate;
        let answers = events(&script);
        assert_eq!(answers.len(), 1, "{rate:?}");
        assert_eq!(answers[0].heading, Heading::Up);
        assert!((answers[0].speed / 150.0 - 1.0).abs() < 0.12, "{rate:?}: {}", answers[0].speed);
    }
}

/// Returns features in units of 2^-11, as real numbers.
///
/// They are the light of a scene without the sensor's noise and quantization. The black level is 1 in 255, and they are
/// floored as by default.
fn exact_features(script: &SceneConfig, finer: f64) -> Vec<[f64; 10]> {
    let mut scene = Scene::new(script).unwrap();
    scene.elastomer = Elastomer::new(Skin::with_fineness(script, finer));
    let mut features = Vec::new();
    while let Some((light, _)) = scene.next_light() {
        let light = light.map(|light| light + 1.0 / 255.0);
        let line = |k: usize| (0..5).map(|n| if k < 5 { light[5 * k + n] } else { light[5 * n + k - 5] }).sum::<f64>();
        features.push(core::array::from_fn(|k| line(k).ln() * 2048.0));
    }
    features
}

/// Returns scenes with a specimen of every shape and all options of light and whisker.
fn odd_scenes() -> Vec<String> {
    let mut texts = Vec::new();
    for (number, specimen) in (0..).zip(Specimen::ALL) {
        let (speed, direction) = (100 + 10 * number, 90 * (number % 4));
        texts.push(format!("specimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}\nseed = {number}"));
    }
    let saw = "specimen = \"Saw2\"\nspeed = 150";
    for more in [
        "period = 1\n[light]\nrubbing_ms = 0",
        "edge = 90\ndepth = 6\n[whisker]\nrelaxation_ms = 0",
        "[whisker]\nbeam = \"linear\"\n[light]\nfluctuation = 2",
        "[whisker]\nrelaxation_ms = 20\n[light]\nafterglow_ms = 5",
        "[light]\nafterglow_ms = 0",
        "[whisker]\nrelaxation_ms = 0.2\n[light]\nafterglow_ms = 0",
        "[whisker]\nrelaxation_ms = 1\nbeam = \"linear\"",
        "[whisker]\ndome_degrees = 0\n[light]\nrubbing_ms = 0.05\ndrift_per_minute = 1",
    ] {
        texts.push(format!("{saw}\n{more}"));
    }
    texts.push("specimen = \"Sphere\"\nspeed = 100\n[whisker]\npresent = \"middle\"\noverlap_mm = 0.4".into());
    texts.push("specimen = \"Sin4\"\nspeed = 1000".into());
    texts.push("specimen = \"Tri2\"\nspeed = 7\nlength = 20".into());
    texts
}

#[test]
fn half_the_step_changes_no_feature_by_more_than_one_unit() {
    let mut worst = 0.0_f64;
    for (text, seed) in odd_scenes().into_iter().flat_map(|text| [1, 2, 3].map(|seed| (text.clone(), seed))) {
        let script = SceneConfig { seed, ..SceneConfig::from_toml("scene", &text).unwrap() };
        let (once, twice) = (exact_features(&script, 1.0), exact_features(&script, 2.0));
        let differences = once.iter().flatten().zip(twice.iter().flatten()).map(|(a, b)| (a - b).abs());
        let most = differences.fold(0.0, f64::max);
        println!("{most:.3} units: {}", text.replace('\n', ", "));
        worst = worst.max(most);
    }
    assert!(worst <= 1.0, "{worst} units");
}

/// Checks that all light of a slide is the change of its strain, by an independent sum over the profile, point by
/// point.
#[test]
fn all_light_is_the_change_of_strain() {
    let bare = "[light]\nrubbing_ms = 0\nafterglow_ms = 0\ngain_deviation = 0\nrun_deviation = 0\n[whisker]\ndome_degrees = 20";
    for (specimen, speed, relaxation, more) in [
        ("Fla0", 150.0, 0.0, ""),
        ("Fla0", 173.0, 0.0, "length = 300"),
        ("Sin2", 211.3, 0.0, "length = 77\nedge = 90"),
        ("Sin4", 120.0, 0.001, ""),
        ("Saw3", 173.0, 0.0, "period = 0.7"),
        ("Saw3", 1000.0, 0.001, ""),
        ("Tri2", 150.0, 0.0, ""),
        ("Tri4", 1000.0, 0.0, "edge = 20"),
    ] {
        let tolerance = if relaxation > 0.0 { 0.02 } else { 5e-3 };
        let text = format!(
            "specimen = \"{specimen}\"\nspeed = {speed}\nnoise = 0\n{more}\n{bare}\nrelaxation_ms = {relaxation}"
        );
        let script = SceneConfig::from_toml("scene", &text).unwrap();
        let seen = light_between(&lights(&text), 0.0, f64::INFINITY).map(|light| light / 30.0);
        let surface = Surface::new(&script.touches[0].slide().unwrap().specimen, script.whisker.overlap_mm);
        let bending = Bending::new(&script.whisker);
        for (whisker, seen) in script.whisker.whiskers().iter().flatten().zip(seen) {
            let strain = |at: f64| {
                let drop = surface.segments_from(at).first().map_or(f64::INFINITY, |s| s.drop_mm(at));
                bending.at_root((script.whisker.overlap_mm - whisker.lowered - drop).max(0.0).sqrt()).strain
            };
            let points = (surface.length_mm() / 1e-3) as u32;
            let strains = (0..=points).map(|point| strain(f64::from(point) * 1e-3));
            let (change, last) = strains.fold((0.0, 0.0_f64), |(sum, last), now| (sum + (now - last).abs(), now));
            let expected = (change + last) * script.light.flash_ms * 1e-3;
            assert!((seen / expected - 1.0).abs() < tolerance, "{text}: {seen} {expected}");
        }
    }
}

#[test]
fn a_level_surface_is_dark_without_rubbing() {
    for (speed, relaxation) in [(150.0, 0), (173.0, 0), (211.3, 0), (173.0, 2)] {
        let light = "[light]\nrubbing_ms = 0\nafterglow_ms = 0";
        let whisker = format!("[whisker]\nrelaxation_ms = {relaxation}");
        let text = format!("specimen = \"Fla0\"\nspeed = {speed}\nlength = 300\nnoise = 0\n{light}\n{whisker}");
        let truth = scene(&text).truth()[0];
        let (start, end) = (truth.start_s * 30.0, truth.end_s * 30.0);
        let mut frames = 0;
        for (number, light) in (1..).zip(lights(&text)) {
            let frame = f64::from(number);
            // All whiskers are on the plateau.
            if frame > start + (end - start) * 0.15 && frame < end - (end - start) * 0.15 {
                assert!(light.iter().all(|light| *light < 1e-9), "{speed} {relaxation} {frame}: {light:?}");
                frames += 1;
            }
        }
        assert!(frames > 20);
    }
}

#[test]
fn light_of_a_slide_goes_on_through_the_next_ones_start() {
    let slide = "[[slide]]\nspecimen = \"Fla0\"\nspeed = 150\n";
    let light = "[light]\nrun_deviation = 0.3\nafterglow_ms = 5000\n";
    let text = format!("noise = 1\nseed = 2\n{light}{slide}{slide}");
    let second = scene(&text).truth()[1].start_frame() as usize;
    let [before, mean] = [second - 1, second].map(|frame| lights(&text)[frame].iter().sum::<f64>());
    assert!((mean / before - 1.0).abs() < 0.1, "{before} {mean}");
}

#[test]
fn leaks_are_integrated_as_all_light_is() {
    let slide = "specimen = \"Fla0\"\nspeed = 150\nnoise = 0\nfidelity = \"taxel\"\n[light]\nleak = 0.2\n[sensor]\n";
    let dark = |more: &str| f64::from(features(&format!("{slide}black_level = 0\n{more}")).0[3][0]) / 2048.0;
    assert!((dark("") - dark("exposure = 0.5") - 2.0_f64.ln()).abs() < 0.03);
}

/// Returns the features of all frames of a scene, and the number of lost frames.
fn features(text: &str) -> (Vec<[i16; 10]>, u32) {
    let script = SceneConfig::from_toml("scene", text).unwrap();
    let mut scene = Scene::new(&script).unwrap();
    let sensor = scene.sensor();
    let green = Any::new(sensor.format(), sensor.color(), YcbcrMethod::Exact);
    let layout = Layout::paper(script.sensor.size).unwrap();
    let camera = FrameGeometry::new(green, layout, script.sensor.rate).unwrap();
    let mut stream: FeatureStream<Any, Fixed> = FeatureStream::new(camera, 0.5).unwrap();
    let (mut features, mut lost) = (Vec::new(), 0);
    while let Some(shot) = scene.next_shot() {
        let frame = match shot {
            SimulatedFrame::Frame(bytes) | SimulatedFrame::Jpeg(bytes, _) => stream.push_frame(bytes).unwrap(),
            SimulatedFrame::Taxels(sums) => stream.push_taxels(&sums),
            SimulatedFrame::Lost(frames, _) => {
                lost += frames;
                None
            }
        };
        features.extend(frame.map(|frame| frame.features));
    }
    (features, lost)
}

/// Checks whole scenes: drawn taxels are within a level of rendered ones, for every format that allows it.
#[test]
fn taxel_fidelity_agrees_with_rendered_frames() {
    let mut worst = 0.0_f64;
    for (number, format) in (0..).zip(["GREY", "Y12", "RGB3", "GRBG", "RGBP"]) {
        let text = |fidelity| {
            let slide = format!("specimen = \"Sin3\"\nspeed = 150\nseed = {number}\nnoise = 2\ngap = 70");
            let light = "[light]\nleak = 0.01";
            let sensor = format!("[sensor]\nsize = [320, 240]\nformat = \"{format}\"\ngain = 2\nblur = 2");
            format!("{slide}\nfidelity = \"{fidelity}\"\n{light}\n{sensor}")
        };
        let (rendered, drawn) = (features(&text("rendered")).0, features(&text("taxel")).0);
        assert_eq!(rendered.len(), drawn.len());
        for (a, b) in rendered.iter().flatten().zip(drawn.iter().flatten()) {
            // In levels of 255 of a row of five taxels.
            let level = |feature: &i16| 255.0 * (f64::from(*feature) / 2048.0).exp();
            // Five times the variation of a row of 900 pixels: 0.6 levels, and more in brighter light.
            let noise = 5.0 * 2.0 * 2.0 * (5.0 * 900.0_f64).sqrt().recip() * 5.0 * (0.6 + (level(a) / 500.0).sqrt());
            worst = worst.max((level(a) - level(b)).abs() / (0.1 + noise));
        }
    }
    assert!(worst < 1.0, "{worst}");
    assert!(worst > 0.05, "{worst}: the noise is part of it");
}

#[test]
fn dropped_frames_are_lost_frames() {
    let slide = "specimen = \"Fla0\"\nspeed = 150\nfidelity = \"taxel\"\n[sensor]\n";
    let (all, none) = features(slide);
    let (some, lost) = features(&format!("{slide}dropped = 0.3"));
    assert_eq!((none, some.len() + lost as usize), (0, all.len()));
    assert!((0.2..0.4).contains(&(f64::from(lost) / all.len() as f64)), "{lost}");
    let (few, lost) = features(&format!("{slide}dropped = 0.9"));
    assert!(lost as usize > 5 * few.len());
}

#[test]
fn auto_exposure_slows_down_in_the_dark() {
    let slide = "specimen = \"Saw3\"\nspeed = 150\nlead_in = 100\nfidelity = \"taxel\"\n[sensor]\n";
    let (all, _) = features(slide);
    let (some, lost) = features(&format!("{slide}auto_exposure = true"));
    assert_eq!(some.len() + lost as usize, all.len());
    // Most of the dark part lacks three of four frames.
    assert!(lost > 80, "{lost}");
}

#[test]
fn a_shorter_exposure_is_darker_and_a_gain_makes_up_for_it() {
    let slide = "specimen = \"Tri3\"\nspeed = 150\nnoise = 0\nfidelity = \"taxel\"\n[sensor]\nblack_level = 0\n";
    let brightest = |more: &str| features(&format!("{slide}{more}")).0.iter().flatten().copied().max().unwrap();
    let (whole, half) = (brightest(""), brightest("exposure = 0.5"));
    let factor = f64::from(whole - half) / 2048.0;
    assert!((factor - 2.0_f64.ln()).abs() < 0.1, "{factor}");
    assert!((brightest("exposure = 0.5\ngain = 2") - whole).abs() < 200);
}

/// Checks that a press lights all rows and columns in one frame, that a hold is dark while nothing moves, and that a
/// poke lights one taxel.
#[test]
fn presses_flash_when_they_come_and_when_they_go() {
    let text = "noise = 0\n[[touch]]\nkind = \"hold\"\nhold = 2\nlift = 20\n[[touch]]\nkind = \"poke\"\nwhisker = [2, 4]\nhold = 0.5";
    let [hold, poke] = [0, 1].map(|k| scene(text).truth()[k]);
    assert!((hold.end_s - hold.start_s - 2.1575).abs() < 1e-9);
    let lights = lights(text);
    let total = |from: f64, to: f64| light_between(&lights, from, to);
    let (down, up) = (total(hold.start_s, hold.start_s + 0.5), total(hold.end_s - 0.16, hold.end_s + 0.5));
    let between = total(hold.start_s + 1.0, hold.end_s - 0.2);
    for taxel in 0..TAXELS {
        assert!(down[taxel] > 0.05 && (up[taxel] / down[taxel] - 1.0).abs() < 0.1, "{taxel}: {down:?} {up:?}");
        assert!(between[taxel] < 1e-6 * down[taxel] + 1e-6, "{taxel}: {between:?}");
    }
    let tip = total(poke.start_s, poke.end_s + 0.5);
    let lit = tip.map(|light| light > 1e-6);
    assert_eq!(lit.iter().position(|lit| *lit), Some(8));
    assert_eq!(lit.iter().filter(|lit| **lit).count(), 1);
    // It leaves in the same way beside a slide that comes after it.
    let slide = "kind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 50\nafter = 3";
    let beside = self::lights(&text.replace("kind = \"poke\"\nwhisker = [2, 4]\nhold = 0.5", slide));
    for (number, (alone, beside)) in lights.iter().zip(&beside).enumerate().take(125) {
        assert!(alone.iter().zip(beside).all(|(a, b)| (a - b).abs() < 1e-4), "{number}: {alone:?} {beside:?}");
    }
}

/// Checks that the same light passes neighbors after pitch / speed, along the direction of motion.
#[test]
fn an_oblique_slide_reaches_whiskers_in_their_order() {
    let text = "specimen = \"Fla0\"\nspeed = 40\ndirection = 30\nnoise = 0\n[whisker]\ndome_degrees = 0\n[light]\ngain_deviation = 0";
    let (start, lights) = (scene(text).truth()[0].start_s, lights(text));
    let whiskers = WhiskerConfig::default().whiskers();
    let (c, s) = touch::unit(30.0);
    for (taxel, whisker) in whiskers.iter().flatten().enumerate() {
        let first = lights.iter().position(|light| light[taxel] > 1e-9).unwrap() as f64 / 30.0;
        let expected = start + (8.0 * (c + s) + whisker.along(c, s)) / 40.0;
        assert!((-1e-9..1.0 / 30.0 + 1e-9).contains(&(expected - first)), "{whisker:?}: {first} {expected}");
    }
}

/// Checks that a slide whose profile is even gives nearly the light of an even slide.
#[test]
fn an_even_profile_is_an_even_slide() {
    let light = |speed: &str| {
        let text = format!("specimen = \"Saw3\"\nspeed = {speed}\nnoise = 0\ndirection = 90");
        lights(&text).into_flattened()
    };
    let (even, points) = (light("120"), light("[[0, 120], [50, 120]]"));
    let most = even.iter().fold(0.0_f64, |most, light| most.max(*light));
    assert_eq!(even.len(), points.len());
    for (a, b) in even.iter().zip(&points) {
        assert!((a - b).abs() < 2e-3 * most, "{a} {b}");
    }
}

/// Whatever the keys are, a frame costs a bounded number of steps, and what would cost more is refused.
#[test]
fn no_key_makes_a_frame_take_for_ever() {
    let scene = |keys: &str| {
        let text = format!("specimen = \"Saw3\"\nlead_in = 0\nfidelity = \"taxel\"\n{keys}");
        Scene::new(&SceneConfig::from_toml("s.toml", &text).unwrap())
    };
    for keys in [
        "speed = 1\n[whisker]\nrelaxation_ms = 0.001\n[sensor]\nfps = 1",
        "speed = 1000\nperiod = 0.1\nlength = 1000\n[whisker]\nrelaxation_ms = 0.001\n[sensor]\nfps = 6",
        "speed = 1\n[whisker]\nrelaxation_ms = 0.003\n[sensor]\nfps = 8\nauto_exposure = true",
    ] {
        let message = scene(keys).unwrap_err().to_string();
        assert!(message.contains("expected at most 10000: raise fps"), "{keys}: {message}");
    }
    // The costliest scenes of each key that are taken.
    for keys in [
        "speed = 1\nlength = 1000\n[whisker]\nrelaxation_ms = 0.001\n[sensor]\nfps = 7",
        "speed = 1000\nlength = 1000\nperiod = 0.1\n[sensor]\nfps = 1",
        "speed = 1000\nlength = 1000\n[light]\nfluctuation_mm = 0.1\nrubbing_ms = 1\n[sensor]\nfps = 1",
        "speed = 1000\nlength = 1000\nperiod = 0.1\nshape = \"block\"\nwidth = 900\nskew = 30\n[sensor]\nfps = 1",
        "speed = [[0, 1000], [0.001, 1], [999, 1000]]\nlength = 1000\n[sensor]\nfps = 1",
        "speed = 1\nlength = 1000\n[light]\nafterglow_ms = 0.1\n[sensor]\nfps = 1",
    ] {
        let mut scene = scene(keys).unwrap();
        let started = std::time::Instant::now();
        for _ in 0..5 {
            scene.next_shot();
        }
        // An optimized program needs a tenth of it.
        assert!(started.elapsed().as_secs() < 30, "{keys}: {:?}", started.elapsed());
    }
}

fn scene(text: &str) -> Scene {
    Scene::new(&SceneConfig::from_toml("scene", text).unwrap()).unwrap()
}

/// Returns the light of all frames of a scene.
fn lights(text: &str) -> Vec<[f64; TAXELS]> {
    let mut scene = scene(text);
    std::iter::from_fn(|| scene.next_light().map(|(light, _)| light)).collect()
}

/// Checks that a body that is much wider than the sensor gives the light of one without an end, whose surface is
/// computed in another way.
#[test]
fn a_wide_body_is_one_without_an_end() {
    for (endless, wide_text) in [
        ("specimen = \"Fla0\"", "specimen = \"Fla0\"\nshape = \"block\"\nwidth = 500"),
        ("specimen = \"Tri3\"\nlength = 40", "specimen = \"Tri3\"\nlength = 40\nshape = \"block\"\nwidth = 500"),
        ("specimen = \"Sin2\"\nedge = 90", "specimen = \"Sin2\"\nedge = 90\nshape = \"block\"\nwidth = 500"),
        ("shape = \"rod\"\ndiameter = 4", "shape = \"rod\"\ndiameter = 4\nwidth = 500"),
        ("shape = \"rod\"\ndiameter = 15", "shape = \"rod\"\ndiameter = 15\nwidth = 500"),
    ] {
        let more = "speed = 130\ndirection = 30\nnoise = 0";
        let (endless, wide) = (lights(&format!("{endless}\n{more}")), lights(&format!("{wide_text}\n{more}")));
        let most = endless.iter().flatten().fold(0.0_f64, |most, light| most.max(*light));
        assert_eq!(endless.len(), wide.len());
        for (a, b) in endless.iter().flatten().zip(wide.iter().flatten()) {
            assert!((a - b).abs() < 2e-3 * most, "{wide_text}: {a} {b}, of {most}");
        }
    }
}

/// Checks the first light of every whisker against where a body's outline meets it, by geometry.
#[test]
fn bodies_light_the_whiskers_that_they_meet_when_they_do() {
    let (speed, degrees, offset) = (20.0, 30.0, 1.0);
    // The distance from the leading end to the outline, `left` mm from the middle.
    let circle = |radius: f64| move |left: f64| radius - (radius * radius - left * left).sqrt();
    // Whiskers reach 3 mm below the top of a ball of 7 mm.
    let ball = |left: f64| 7.0 - (49.0 - 16.0 - left * left).sqrt();
    let corner = |left: f64| left.abs();
    let turned = |left: f64| {
        // A block of 10 mm that is turned by 20 degrees has its foremost corner on its left.
        let (sin, cos) = 20_f64.to_radians().sin_cos();
        let corner = 5.0 * cos;
        let behind = if left > -corner { (left + corner) * sin / cos } else { (-corner - left) * cos / sin };
        if left > corner { f64::NAN } else { behind }
    };
    let outlines: [(&str, &dyn Fn(f64) -> f64); 4] = [
        ("shape = \"ball\"\ndiameter = 14", &ball),
        ("shape = \"coin\"\ndiameter = 9\nedge = 90", &circle(4.5)),
        ("shape = \"corner\"\nlength = 30\nedge = 90", &corner),
        ("shape = \"block\"\nwidth = 10\nskew = 20\nedge = 90", &turned),
    ];
    for (body, outline) in outlines {
        let text = format!("{body}\nspeed = {speed}\ndirection = {degrees}\noffset = {offset}\nnoise = 0");
        let lights = lights(&format!("{text}\n[whisker]\ndome_degrees = 0\nrelaxation_ms = 0\n[sensor]\nfps = 240"));
        let (c, s) = touch::unit(degrees);
        let whiskers = WhiskerConfig::default().whiskers();
        let found = (0..TAXELS).map(|taxel| lights.iter().position(|light| light[taxel] > 1e-9));
        let expected = whiskers.iter().flatten().map(|whisker| {
            Some(whisker.along(c, s) + outline(whisker.along(-s, c) - offset)).filter(|place| place.is_finite())
        });
        let pairs: Vec<_> = found.zip(expected).collect();
        let first = pairs.iter().filter_map(|(found, place)| found.zip(*place).map(|(found, place)| (place, found)));
        let (least, at) = first.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        for (taxel, (found, place)) in pairs.into_iter().enumerate() {
            let frame = place.map(|place| at as f64 + (place - least) / speed * 240.0);
            match (found, frame) {
                (Some(found), Some(frame)) => {
                    assert!((found as f64 - frame).abs() < 2.0, "{body} {taxel}: {found} {frame}");
                }
                (found, frame) => assert_eq!(found.is_some(), frame.is_some(), "{body} {taxel}"),
            }
        }
    }
}

/// Returns the light of every taxel over the frames between two moments in s.
fn light_between(lights: &[[f64; TAXELS]], from: f64, to: f64) -> [f64; TAXELS] {
    let frames = &lights[(from * 30.0) as usize..((to * 30.0) as usize).min(lights.len())];
    core::array::from_fn(|taxel| frames.iter().map(|light| light[taxel]).sum())
}

const BALL: &str = "[[touch]]\nkind = \"slide\"\nshape = \"ball\"\ndiameter = 6\n";
const NO_NOISE: &str = "noise = 0\nlead_in = 45\n[whisker]\ndome_degrees = 0\n[light]\ngain_deviation = 0";

/// Checks that two balls light the whiskers of each of them as if it were alone, wherever they are not on one whisker.
#[test]
fn two_objects_bend_the_whiskers_that_each_of_them_meets() {
    let ball = |offset: i32, speed: i32, more: &str| format!("{BALL}speed = {speed}\noffset = {offset}\n{more}");
    let scene = |touches: &str| lights(&format!("{NO_NOISE}\n{touches}"));
    let (left, right) = (scene(&ball(8, 60, "")), scene(&ball(-8, 90, "")));
    let both = scene(&(ball(8, 60, "") + &ball(-8, 90, "after = 0")));
    for taxel in 0..TAXELS {
        // Moving to the right, the left ball lights the upper row. The light ends before the scene that is shorter.
        let alone = if taxel < 5 { &left } else { &right };
        let (mut most, mut worst) = (0.0_f64, 0.0_f64);
        for (both, alone) in both.iter().zip(alone) {
            let expected = alone[taxel];
            (most, worst) = (most.max(expected), worst.max((both[taxel] - expected).abs()));
        }
        let is_lit = taxel / 5 == 0 || taxel / 5 == 4;
        // Random starts differ.
        assert!(worst < 0.02 * most + 1e-9 && (most > 0.0) == is_lit, "{taxel}: {worst} of {most}");
    }
    // Two on the same path are one: the whisker is bent by the one that bends it most.
    let twice = scene(&(ball(0, 60, "") + &ball(0, 60, "after = 0")));
    let once = scene(&ball(0, 60, ""));
    let sum = |lights: &[[f64; TAXELS]]| lights.iter().flatten().sum::<f64>();
    assert!((sum(&twice) / sum(&once) - 1.0).abs() < 1e-3, "{} {}", sum(&twice), sum(&once));
    let scene = "[[touch]]\nkind = \"hold\"\nhold = 1\n".to_owned() + &ball(0, 60, "after = 0.5");
    let truth = self::scene(&scene).truth().to_vec();
    assert!((truth[1].start_s - truth[0].start_s - 0.5).abs() < 1e-9);
}

#[test]
fn a_held_block_is_dark_until_it_slides() {
    let slide = "[[touch]]\nkind = \"slide\"\nspecimen = \"Tri3\"\nspeed = 60\nhold = 1.5\ntravel = 20\nlift = 40\n";
    let text = format!("{NO_NOISE}\nrubbing_ms = 0\n{slide}");
    let truth = scene(&text).truth()[0];
    assert!((truth.end_s - truth.start_s - (3.0 / 400.0 + 1.5 + 20.0 / 60.0 + 3.0 / 40.0)).abs() < 1e-9);
    let (lights, start) = (lights(&text), truth.start_s);
    let pressed = light_between(&lights, start, start + 0.5);
    let held = light_between(&lights, start + 1.2, start + 1.45);
    let slides = light_between(&lights, start + 1.55, start + 1.8);
    for taxel in 0..TAXELS {
        assert!(pressed[taxel] > 0.05 && held[taxel] < 1e-6, "{taxel}: {pressed:?} {held:?}");
        assert!(slides[taxel] > 0.05, "{taxel}: {slides:?}");
    }
    // A flat block that was pressed on shows nothing of its motion but its rubbing.
    let flat = lights_of_flat(&text);
    assert!(light_between(&flat, start + 1.55, start + 1.8).iter().all(|light| *light < 1e-6));
}

fn lights_of_flat(text: &str) -> Vec<[f64; TAXELS]> {
    lights(&text.replace("Tri3", "Fla0"))
}

/// Checks that a twist lights whiskers the more the farther they are from its pivot, and the pivot's own not at all.
#[test]
fn a_twist_lights_what_is_far_from_its_pivot() {
    let twist = "[[touch]]\nkind = \"twist\"\nspecimen = \"Tri3\"\nby = 60\nrate = 60\nhold = 1\npivot = [-8, 8]\n";
    let text = format!("{NO_NOISE}\nrubbing_ms = 0\n{twist}");
    let truth = scene(&text).truth()[0];
    let lights = lights(&text);
    let light = light_between(&lights, truth.start_s + 1.05, truth.start_s + 1.95);
    // A whisker crosses teeth in proportion to its distance, here four times as many.
    assert!(light[0] < 1e-6 && (3.0..5.0).contains(&(light[24] / light[6])), "{light:?}");
}

#[test]
fn a_slide_rests_where_it_is_told_to() {
    let of = |keys: &str| {
        let text = format!("[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 50\n{keys}");
        *SceneConfig::from_toml("s", &text).unwrap().touches[0].slide().unwrap()
    };
    let (even, stop, stick) = (of(""), of("stop = [20, 0.5]"), of("stick = [5, 0.1]"));
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
    close(stop.moved_mm(0.39), 19.5);
    close(stop.moved_mm(0.7), 20.0);
    close(stop.moved_mm(1.0), 25.0);
    close(stop.time_s(30.0), 1.1);
    // After 12 mm it has rested twice.
    close(stick.moved_mm(0.44), 12.0);
    close(stick.moved_mm(0.15), 5.0);
    for place in [3.0, 4.99, 7.0, 33.3, 104.0] {
        close(stick.moved_mm(stick.time_s(place)), place);
        close(even.moved_mm(even.time_s(place)), place);
    }
}

/// Checks that a slide that turns meets whiskers in the order of an arc, and ends turned.
#[test]
fn a_slide_turns_with_its_path() {
    let scene = |turn: f64| {
        let slide = "[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 40\nlength = 30";
        let lights = lights(&format!("{NO_NOISE}\n[sensor]\nfps = 120\n{slide}\nturn = {turn}"));
        let first = |taxel: usize| lights.iter().position(|light| light[taxel] > 1e-9).unwrap() as f64;
        // How much later the upper than the lower whisker of the first and last columns is met, in mm.
        [0, 4].map(|column| (first(column) - first(20 + column)) / 120.0 * 40.0)
    };
    assert!(scene(0.0).iter().all(|later| later.abs() < 1e-9));
    let [first, last] = scene(0.5);
    // By 8 mm from the middle the edge has turned by 4 degrees, so that 16 mm across are 1.1 mm along.
    assert!((-1.6..-0.6).contains(&first) && (0.6..1.6).contains(&last), "{first} {last}");
}

#[test]
fn light_is_seen_beside_and_decays_over_touches() {
    let poke = "[[touch]]\nkind = \"poke\"\nwhisker = [1, 2]\n";
    let text = |more: &str| format!("{NO_NOISE}\n{more}\n{poke}{poke}{poke}");
    let of = |more: &str| {
        let truth = scene(&text(more)).truth().to_vec();
        let lights = lights(&text(more));
        truth.iter().map(|one| light_between(&lights, one.start_s - 0.1, one.end_s + 1.5)).collect::<Vec<_>>()
    };
    let (plain, beside, less) = (of(""), of("crosstalk = 0.1"), of("decay = 0.2"));
    for taxel in 0..TAXELS {
        let share = [1.0, 0.1, 0.0][match taxel {
            1 => 0,
            0 | 2 | 6 => 1,
            _ => 2,
        }];
        assert!((beside[0][taxel] - share * plain[0][1]).abs() < 1e-9, "{taxel}: {beside:?}");
    }
    for (touch, part) in [1.0, 0.8, 0.64].into_iter().enumerate() {
        assert!((less[touch][1] / plain[0][1] - part).abs() < 1e-3, "{touch}: {less:?}");
    }
}
