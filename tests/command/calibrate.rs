//! Tests `wstac calibrate` as a user runs it: a camera that does not look straight on, its configuration, and slides.

use std::path::Path;

use serde_json::Value;
use wstac_tests::command::{ends, event, good, records, refusal, refused, run, says};
use wstac_tests::folder::Folder;

/// A camera that is turned, tilted, curved, shifted and uneven, with a little ambient light.
const CAMERA: &str = "lead_in = 45\n[light]\nleak = 0.02\n[sensor]\nsize = [240, 240]\n[sensor.pose]\nrotation_degrees = 15\n\
                      tilt_degrees = [8, -6]\ncurvature = -0.05\nscale = 0.7\nshift = [0.08, -0.06]\nuneven = 3\n";

/// Returns the number of wrong directions, and the errors of speeds, of five slides with a configuration.
fn answers(folder: &Folder, config: &str) -> (usize, Vec<f64>) {
    let slides = [(0_u16, 100.0), (90, 120.0), (180, 150.0), (270, 180.0), (0, 200.0)];
    let (mut wrong, mut errors) = (0, Vec::new());
    for (seed, (degrees, speed)) in slides.into_iter().enumerate() {
        let slide = format!("specimen = \"Saw3\"\nspeed = {speed}\ndirection = {degrees}\nseed = {seed}\n{CAMERA}");
        let source = folder.scene("slide.toml", &slide);
        let records = records(&["run", &source, "--json", "--config", config]);
        let event = records.into_iter().find(|record| record["kind"] == "event").unwrap_or_default();
        let found = event["direction"]["deg"].as_f64().unwrap_or(f64::NAN);
        let turned = (found - f64::from(degrees) + 180.0).rem_euclid(360.0) - 180.0;
        // Not a number is wrong, too.
        wrong += usize::from(turned.is_nan() || turned.abs() >= 5.0);
        errors.push(event["speed"]["mm_s"].as_f64().map_or(f64::INFINITY, |found| (found / speed - 1.0).abs()));
    }
    (wrong, errors)
}

#[test]
fn a_calibrated_camera_tells_directions_and_speeds() {
    let folder = Folder::new("calibrate-answers");
    let config = &*folder.path("wstac.toml");
    let source = folder.scene("press.toml", format!("specimen = \"Fla0\"\nspeed = 150\n{CAMERA}"));
    let record = records(&["calibrate", &source, "-o", config, "--json"]).remove(0);
    assert_eq!((&record["kind"], &record["found"], &record["dead"]), (&"calibration".into(), &25.into(), &Value::Null));
    assert_eq!(record["centres"].as_array().unwrap().len(), 25);
    assert!((record["rotation_degrees"].as_f64().unwrap() - 15.0).abs() < 2.0, "{record}");
    assert!(std::fs::read(folder.0.join("wstac.png")).unwrap().starts_with(b"\x89PNG"));
    // Everything in the configuration except the layout.
    let written = std::fs::read_to_string(config).unwrap();
    let published = folder.written("published.toml", &written[written.find("[features]").unwrap()..]);
    let (wrong, errors) = answers(&folder, config);
    let (wrong_as_published, as_published) = answers(&folder, &published);
    println!(
        "of 5 slides before a turned camera, directions wrong or none, and how far off speeds are: calibrated {wrong}, \
         {errors:.3?}; with the paper's layout {wrong_as_published}, {as_published:.3?}"
    );
    assert_eq!(wrong, 0);
    // It is valid only for frames of this size.
    let other = format!("specimen = \"Fla0\"\nspeed = 150\n{}", CAMERA.replace("240, 240", "250, 250"));
    let expected = "wstac.toml: [layout] frame is [240, 240], but frames are 250 x 250 pixels";
    refused(&["run", &folder.scene("other.toml", other), "--config", config], &[expected]);
    assert!(wrong_as_published >= 2, "the paper's layout would do");
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(mean(&errors) < 0.08 && mean(&as_published) > 1.5 * mean(&errors), "{errors:?} {as_published:?}");
}

#[test]
fn presses_tell_the_readout() {
    let folder = Folder::new("calibrate-readout");
    let config = &*folder.path("wstac.toml");
    let presses = [(80, 0.5), (120, 0.4), (50, 0.5)]
        .map(|(approach, hold)| format!("[[touch]]\nkind = \"press\"\napproach = {approach}\nhold = {hold}\n"));
    // A slide behind them changes nothing.
    let slide = "[[touch]]\nkind = \"slide\"\nspecimen = \"Saw3\"\nspeed = 80\ndirection = 30\n";
    for (ms, rest) in [(20.0, ""), (-15.0, slide)] {
        let text = format!("[sensor]\nsize = [240, 240]\nreadout_ms = {ms:?}\n{}{rest}", presses.concat());
        let source = folder.scene("presses.toml", &text);
        let calibrate = ["calibrate", &source, "-o", config, "--force", "--json", "--frames", "900"];
        let record = records(&calibrate).remove(0);
        let [found, sd] = ["readout_ms", "readout_sd_ms"].map(|key| record[key].as_f64().unwrap_or(f64::NAN));
        assert!((found - ms).abs() < 1.0 && sd < 1.0, "{record}");
        let written = std::fs::read_to_string(config).unwrap();
        assert!(written.contains(&format!("readout_ms = {found:.1}\n")), "{written}");
    }
}

#[test]
fn measured_cross_talk_is_taken_out_of_speeds() {
    let folder = Folder::new("calibrate-crosstalk");
    let config = folder.written("wstac.toml", "[layout] # mine\npreset = \"paper\"\n");
    let keys = "gap = 10\n[light]\ncrosstalk = 0.08\n[sensor]\nsize = [240, 240]\n";
    let poke = |at: usize| format!("[[touch]]\nkind = \"poke\"\nwhisker = [{}, {}]\n", at / 5 + 1, at % 5 + 1);
    let pokes = |count: usize| format!("{keys}{}", (0..count).map(poke).collect::<String>());
    let few = folder.scene("few.toml", pokes(24));
    let dark = "1 of 25 whiskers have too little light (row 5, column 5), expected a touch";
    refused(&["calibrate", &few, "--crosstalk", "-o", &config], &[dark]);
    let all = folder.scene("all.toml", pokes(25));
    let record = records(&["calibrate", &all, "--crosstalk", "-o", &config, "--json"]).remove(0);
    assert!(record["kind"] == "crosstalk" && (record["largest"].as_f64().unwrap() - 0.08).abs() < 0.005, "{record}");
    let written = std::fs::read_to_string(&config).unwrap();
    assert!(written.starts_with("[layout] # mine\ncrosstalk = [\n    [1, 0.0"), "{written}");
    assert!(written.ends_with("]\npreset = \"paper\"\n"), "{written}");

    let slide = folder.scene("slide.toml", format!("specimen = \"Fla0\"\nspeed = 60\ndirection = 25\n{keys}"));
    let speed = |arguments: &[&str]| event(&[&["run"], arguments].concat())["speed"]["mm_s"].as_f64().unwrap();
    let [without, with] = [speed(&[&slide]), speed(&[&slide, "--model", "none", "--config", &config])];
    println!("at 60 mm/s with cross-talk of 8 %: {without:.2} mm/s without the matrix, {with:.2} with it");
    assert!((without / 60.0 - 1.0).abs() > 0.015 && (with / 60.0 - 1.0).abs() < 0.005, "{without} {with}");
    let other = folder.written("other.toml", format!("{written}[speed]\nestimator = \"coherence\"\n"));
    let unused = "[layout] crosstalk corrects no speeds but those of estimator = \"wave\"";
    ends(&["run", &slide, "--config", &other], 0, &[unused]);
    // A recording has the matrix in it.
    let recording = folder.path("slide.mcap");
    good(&["record", &slide, "-o", &recording, "--config", &config]);
    assert_eq!(speed(&[&recording]).to_bits(), with.to_bits());
}

#[test]
fn a_refusal_leaves_a_picture_and_no_configuration() {
    let folder = Folder::new("calibrate-refusal");
    let [config, picture] = &["wstac.toml", "seen.png"].map(|name| folder.path(name));
    let camera = CAMERA.replace("leak", "dead = [[1, 1], [3, 4], [5, 2]]\nleak");
    let source = folder.scene("press.toml", format!("specimen = \"Fla0\"\nspeed = 150\n{camera}"));
    let output = run(["calibrate", &source, "-o", config, "--overlay", picture]);
    says(&output, 1, &["found 22 spots of light, expected 25 whiskers", "seen.png shows"]);
    assert!(output.stdout.is_empty() && !Path::new(config).exists());
    assert!(std::fs::read(picture).unwrap().starts_with(b"\x89PNG"));
    // Only the default picture of a refusal is overwritten without --force.
    for _ in 0..2 {
        refused(&["calibrate", &source, "-o", config], &["found 22"]);
        assert!(folder.0.join("wstac.refused.png").exists());
    }
}

#[test]
fn what_cannot_be_calibrated_is_said() {
    let folder = Folder::new("calibrate-wrong");
    let config = &*folder.path("wstac.toml");
    let early = folder.scene("early.toml", "specimen = \"Saw3\"\nspeed = 150\nlead_in = 5\n");
    let sums = folder.scene("sums.toml", "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"");
    for (arguments, code, expected) in [
        (&["nothing", "-o", config][..], 1, "no such file"),
        (&["scene:Saw3@150"], 2, "--output"),
        (&["scene:Saw3@150", "-o", config, "--frames", "29"], 2, "29"),
        (&["scene:Saw3@150", "-o", config, "--overlay", config], 2, "expected two names"),
        (&["scene:Saw3@150", "-o", config, "--frames", "40"], 1, "nothing glowed"),
        (&[&early, "-o", config], 1, "cut the start of a video off (ffmpeg -ss SECONDS"),
        (&[&sums, "-o", config, "--force"], 1, "taxel sums, expected frames"),
    ] {
        ends(&[&["calibrate"], arguments].concat(), code, &[expected]);
    }
    // No folder that can be written to, not even by root: the source is not opened.
    for (command, name) in [
        ("calibrate", "/proc/new.toml"),
        ("characterize", "/proc/new"),
        ("dataset", "/proc/new.npz"),
        ("plot", "/proc/new.svg"),
        ("record", "/proc/new.mcap"),
        ("train", "/proc/new.wsm"),
        ("trade", "/proc/new"),
    ] {
        let source = if command == "trade" { "--quick" } else { "nothing" };
        let said = refusal(&[command, source, "-o", name]);
        assert!(said.contains(name) && !said.contains("nothing:"), "{said}");
    }
}
