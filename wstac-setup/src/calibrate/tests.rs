//! Calibration of simulated cameras whose pose is known.

use rayon::prelude::*;
use wstac_core::layout::FrameSize;

use super::*;
use wstac_host::config::Config;
use wstac_host::source::{Frame, Source, SourceEvent};
use wstac_scene::SceneConfig;
use wstac_scene::rng::Rng;
use wstac_scene::sensor::Pose;
use wstac_scene::source::SceneSource;

/// Largest distance of a taxel's middle from its base at 400 × 400, in pixels.
const MOST_OFF: f64 = 1.5;

/// Reads a scene from its text, with a pose.
fn scene(text: &str) -> SceneConfig {
    SceneConfig::from_toml("scene", text).unwrap()
}

/// Returns the outcome of a scene's frames.
fn seen(script: &SceneConfig) -> (Outcome, FrameSize) {
    let mut source = SceneSource::new(script).unwrap();
    let mut watch = Watch::new(source.info()).unwrap();
    let last = source.truth().last().unwrap().end_s * 30.0 + 12.0;
    for _ in 0..last as u32 {
        match source.next_event().unwrap() {
            SourceEvent::Frame(Frame { bytes, .. }) => watch.take(bytes),
            _ => break,
        }
    }
    (watch.calibrate(), script.sensor.size)
}

fn refusal(text: &str) -> String {
    let (outcome, _) = seen(&scene(text));
    assert_eq!(outcome.to_png()[..4], *b"\x89PNG", "a picture is there all the same");
    outcome.result.unwrap_err().message
}

/// Returns the distances of the taxels' middles, and of the found bases, from the truth, in pixels.
fn offs(calibration: &Calibration, truth: &[[f64; 2]; TAXELS]) -> Vec<[f64; 2]> {
    let size = calibration.layout.taxel().map(|side| (f64::from(side) - 1.0) / 2.0);
    let off = |[x, y]: [f64; 2], truth: [f64; 2]| (x - truth[0]).hypot(y - truth[1]);
    let taxels = calibration.layout.corners().iter().zip(&calibration.centers).zip(truth);
    let offs = taxels.map(|((corner, center), &truth)| {
        let middle = [0, 1].map(|k| f64::from(corner[k]) + size[k]);
        [off(middle, truth), off(*center, truth)]
    });
    offs.collect()
}

/// Returns a random slide before a random camera; every tenth has a dead whisker.
fn random(number: u64) -> (SceneConfig, Option<usize>) {
    let mut rng = Rng::new(number, 99);
    let specimens = ["Fla0", "Sin2", "Sin4", "Saw3", "Tri2", "Tri4"];
    let (specimen, turn) = (specimens[rng.below(6)], 90 * rng.below(4));
    let (speed, leak) = (100.0 + 100.0 * rng.uniform(), 0.1 * rng.uniform());
    let dead = number.is_multiple_of(10).then(|| rng.below(TAXELS));
    let list = dead.map_or(String::new(), |taxel| format!("[{}, {}]", taxel / COLUMNS + 1, taxel % COLUMNS + 1));
    let mut script = scene(&format!(
        "specimen = \"{specimen}\"\nspeed = {speed}\ndirection = {turn}\nseed = {number}\nlead_in = 27\nnoise = {}\n\
         [light]\nleak = {leak}\nunit = {number}\ngain_deviation = 0.1\ndead = [{list}]\n[sensor]\nsize = [400, 400]",
        0.5 + rng.uniform(),
    ));
    script.sensor.pose = Some(Pose::random(&mut rng, script.sensor.size));
    (script, dead)
}

/// Checks that every base is within 1.5 pixels for random poses.
///
/// The variable `WSTAC_LONG_POSES` sets their number; without it there are 6.
#[test]
fn every_base_is_found_from_any_pose() {
    let count = std::env::var("WSTAC_LONG_POSES").map_or(6, |count| count.parse().expect("a whole number"));
    let found: Vec<Vec<[f64; 2]>> = (0..count)
        .into_par_iter()
        .map(|number| {
            let (script, dead) = random(number);
            let (outcome, size) = seen(&script);
            let pose = script.sensor.pose.unwrap();
            let calibration = outcome.result.unwrap_or_else(|refusal| panic!("{number}: {refusal:?}, {pose:?}"));
            assert_eq!(calibration.dead, dead, "{number}: {pose:?}");
            offs(&calibration, &pose.centers(size))
        })
        .collect();
    let all: Vec<[f64; 2]> = found.into_iter().flatten().collect();
    let rms = |k: usize| (all.iter().map(|off| off[k] * off[k]).sum::<f64>() / all.len() as f64).sqrt();
    let most = |k: usize| all.iter().map(|off| off[k]).fold(0.0, f64::max);
    println!(
        "{count} poses at 400 x 400: taxels {:.2} pixels from their bases at most, {:.2} root mean square; before rounding to whole \
         pixels {:.2} and {:.2}",
        most(0),
        rms(0),
        most(1),
        rms(1),
    );
    assert!(most(0) <= MOST_OFF, "{}", most(0));
}

const POSED: &str =
    "[sensor.pose]\nrotation_degrees = 12\ntilt_degrees = [8, -6]\ncurvature = -0.05\nscale = 0.85\nuneven = 3";

#[test]
fn what_is_not_sure_is_refused() {
    let slide = "specimen = \"Fla0\"\nspeed = 200\nlead_in = 27\n";
    let sized = "[sensor]\nsize = [200, 200]\n";
    for (rest, expected) in [
        // No light: a lens cap, or only noise.
        (format!("[light]\nflash_ms = 0\nrubbing_ms = 0\n{sized}noise = 0\n{POSED}"), "nothing glowed"),
        (format!("[light]\nflash_ms = 0\nrubbing_ms = 0\n{sized}noise = 5\n{POSED}"), "nothing glowed"),
        (format!("[light]\ndead = [[1, 1], [3, 4], [5, 2]]\n{sized}{POSED}"), "found 22 spots of light"),
        // A sensor of 4 × 4.
        (
            format!(
                "[light]\ndead = [[1, 5], [2, 5], [3, 5], [4, 5], [5, 1], [5, 2], [5, 3], [5, 4], [5, 5]]\n{sized}{POSED}"
            ),
            "found 16 spots",
        ),
        // Half out of the picture: two columns are complete.
        (format!("{sized}[sensor.pose]\nshift = [0.5, 0]"), "expected 25 whiskers"),
        // The last column is cut by the edge.
        (format!("{sized}[sensor.pose]\nshift = [0.1, 0]"), "edge"),
        (format!("{sized}[sensor.pose]\nrotation_degrees = 45\nscale = 0.7"), "expected"),
        (
            format!("{sized}[sensor.pose]\nrotation_degrees = 25\nscale = 0.7"),
            "turned by 25 degrees, expected at most 15",
        ),
        // Light beyond the camera's range.
        (format!("[light]\nflash_ms = 4000\n{sized}{POSED}"), "reach full scale"),
        // Spots that merge.
        (format!("{sized}blur = 20\n{POSED}"), "expected"),
    ] {
        let message = refusal(&format!("{slide}{rest}"));
        println!("{message}");
        assert!(message.contains(expected), "{rest}: {message:?}, expected {expected:?}");
    }
    // Touched before the first frames are over, however early, and no frames at all.
    for (lead_in, speed) in [(3, 100), (20, 200)] {
        let text = format!("specimen = \"Fla0\"\nspeed = {speed}\nlead_in = {lead_in}\n{sized}");
        for text in [text.clone(), format!("{text}{POSED}")] {
            let early = refusal(&text);
            assert!(early.contains("the first 25 frames were not untouched"), "{lead_in} {speed}: {early}");
        }
    }
    let short = Watch::new(SceneSource::new(&scene(&format!("{slide}{sized}"))).unwrap().info()).unwrap().calibrate();
    assert!(short.result.unwrap_err().message.contains("found 0 frames, expected 25 untouched ones"));
}

/// Checks that every format and frame size has a layout whose taxels match the core's.
#[test]
fn every_format_and_size_is_calibrated() {
    let cases = [
        ("GREY", [160, 120]),
        ("YUYV", [160, 120]),
        ("RGGB", [160, 120]),
        ("BG12", [322, 243]),
        ("Y16", [321, 241]),
        ("MJPG", [640, 480]),
        ("NV12", [642, 480]),
        ("RGBP", [399, 401]),
        ("GB10", [646, 482]),
        ("RGB3", [800, 600]),
    ];
    for (format, [width, height]) in cases {
        let text = format!(
            "specimen = \"Saw3\"\nspeed = 200\nlead_in = 27\n[sensor]\nsize = [{width}, {height}]\nformat = \"{format}\"\n{POSED}"
        );
        let script = scene(&text);
        let (outcome, size) = seen(&script);
        let calibration = outcome.result.unwrap_or_else(|refusal| panic!("{format} {width}x{height}: {refusal:?}"));
        let bayer = ["RGGB", "BG12", "GB10"].contains(&format);
        if bayer {
            let even =
                calibration.layout.corners().iter().flatten().chain(&calibration.layout.taxel()).all(|n| n % 2 == 0);
            assert!(even, "{format}: {:?}", calibration.layout);
        }
        // Rounding to whole pixels, for a mosaic to pairs of pixels.
        let rounding = if bayer { 1.0 } else { 0.5 } * core::f64::consts::SQRT_2;
        let most = rounding + 0.004 * f64::from(width.min(height));
        let off =
            offs(&calibration, &script.sensor.pose.unwrap().centers(size)).iter().map(|off| off[0]).fold(0.0, f64::max);
        println!("{format} {width}x{height}: {off:.2} pixels at most");
        assert!(off <= most, "{format} {width}x{height}: {off} pixels off, expected at most {most}");
        let config = Config::parse(&calibration.to_toml("a test")).unwrap();
        assert_eq!(config.layout(size), Ok(calibration.layout));
    }
}

/// A calibration replaces what it measures in a configuration and keeps the rest, in the file as well.
#[test]
fn a_calibration_goes_into_a_configuration() {
    let (outcome, size) = seen(&scene("specimen = \"Fla0\"\nspeed = 100\n[sensor]\nsize = [400, 400]"));
    let calibration = outcome.result.as_ref().unwrap();
    let (config, text) = calibration.applied_to(&Config::default(), "a scene").unwrap();
    assert_eq!(text, calibration.to_toml("a scene"));
    assert_eq!(config.layout(size).unwrap(), calibration.layout);
    let own = "[trigger]\nwindow = 8\nmargin = 0.9\n[speed]\nlaw = \"published\"\n[sensor]\npitch_mm = 5.0";
    let (config, text) = calibration.applied_to(&Config::parse(own).unwrap(), "a\nscene").unwrap();
    assert!(text.starts_with("# A configuration with the calibration of a scene\n"), "{text}");
    assert_eq!(config.layout(size).unwrap(), calibration.layout);
    let trigger = config.trigger().unwrap();
    assert_eq!((trigger.window(), config.sensor.pitch_mm), (8, 5.0));
    assert!(config.speed.law().is_some() && !text.contains("margin = 0.9"), "{text}");
    assert_eq!(Config::parse(&text).unwrap().to_toml(), config.to_toml());
    // Every whisker is a spot of light, which has the whisker's base in it.
    let whiskers = outcome.spots().iter().filter(|spot| spot.is_whisker).count();
    assert_eq!(whiskers, TAXELS);
}

/// The picture of the light so far is bright at the bases and dark between them.
#[test]
fn the_light_so_far_is_where_the_whiskers_are() {
    let script = scene("specimen = \"Fla0\"\nspeed = 100\n[sensor]\nsize = [800, 800]");
    let mut source = SceneSource::new(&script).unwrap();
    let mut watch = Watch::new(source.info()).unwrap();
    while let SourceEvent::Frame(Frame { bytes, .. }) = source.next_event().unwrap() {
        watch.take(bytes);
    }
    let picture = watch.glow();
    let calibration = watch.calibrate().result.unwrap();
    let scale = picture.size[0] as f64 / 800.0;
    let light = |[x, y]: [f64; 2]| picture.light[(y * scale) as usize * picture.size[0] + (x * scale) as usize];
    assert!(picture.size[0] <= 400 && picture.size[0] == picture.size[1], "{:?}", picture.size);
    assert_eq!(picture.light.len(), picture.size[0] * picture.size[1]);
    for center in calibration.centers {
        let between = [center[0] + calibration.pitch[0] / 2.0, center[1]];
        // Whiskers at the border glow less than half as bright as the brightest.
        assert!(light(center) > 0.3, "{center:?}: {}", light(center));
        assert!(between[0] > 790.0 || light(between) < 0.05, "{between:?}: {}", light(between));
    }
}
