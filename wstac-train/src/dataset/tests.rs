use std::fs;
use std::path::PathBuf;

use super::sweep::Sweep;
use super::*;
use wstac_scene::Slide;
use wstac_scene::sensor::Fidelity;

/// Returns a path that no other test has.
fn scratch(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("wstac-dataset-{}-{name}", std::process::id()))
}

fn sweep(text: &str) -> Sweep {
    Sweep::parse("s.toml", text).unwrap()
}

fn scripts(sweep: &Sweep) -> Vec<SceneConfig> {
    (0..sweep.count()).map(|number| sweep.script(number)).collect()
}

#[test]
fn slides_are_numbered_and_all_combinations_come_round() {
    let default = sweep("");
    assert_eq!((default.count(), default.specimens().len()), (1000, 10));
    assert_eq!(default.script(100), SceneConfig { fidelity: Fidelity::Taxel, ..short("Sin2@150,seed=101") });
    let text = "specimens = [\"Fla0\", \"Saw3\"]\nspeeds = [100, 110.5]\ndirections = [0, 90]\nslides = 5\nseed = 7";
    let said = |script: &SceneConfig| {
        let Slide { specimen, speed_mm_s, direction_deg, .. } = *script.touches[0].slide().unwrap();
        format!("{specimen}@{speed_mm_s},{direction_deg}deg,seed={}", script.seed)
    };
    let all: Vec<String> = scripts(&sweep(text)).iter().map(said).collect();
    assert_eq!(all[..3], ["Fla0@100,0deg,seed=7", "Fla0@110.5,0deg,seed=8", "Fla0@100,90deg,seed=9"]);
    assert_eq!(all[3..6], ["Fla0@110.5,90deg,seed=10", "Fla0@100,0deg,seed=11", "Saw3@100,0deg,seed=12"]);
    assert_eq!(all.len(), 10);
    let more =
        "specimens = [\"Saw3\"]\n[scene]\ndepth = 3.5\nnoise = 2\nfidelity = \"rendered\"\n[scene.light]\nleak = 0.1";
    let script = sweep(more).script(9);
    let expected = (3.5, 0.1, 2.0);
    assert_eq!((script.touches[0].slide().unwrap().specimen.depth_mm, script.light.leak, script.noise), expected);
    assert_eq!(script.fidelity, Fidelity::Rendered);
}

fn short(text: &str) -> SceneConfig {
    SceneConfig::parse_short(text).unwrap()
}

#[test]
fn a_folder_in_place_of_a_sweep_is_named() {
    let folder = scratch("folder");
    fs::create_dir(&folder).unwrap();
    for error in [Sweep::read(&folder).unwrap_err(), random::RandomSweep::read(&folder).unwrap_err()] {
        let message = error.to_string();
        assert!(message.contains(": is a folder, expected the file of a sweep (.toml); help: "), "{message}");
    }
    fs::remove_dir(folder).unwrap();
}

#[test]
fn what_is_wrong_with_a_sweep_is_named() {
    for (text, parts) in [
        ("speed = [1]", vec!["unknown key speed", "speeds"]),
        ("specimens = [\"Saw3\", \"Saw7\"]", vec!["specimens[1]: specimen is \"Saw7\"", "Fla0"]),
        ("specimens = []", vec!["specimens is empty", "at least one"]),
        ("speeds = [100, 0]", vec!["speeds[1]: speed is 0", "1 to 1000"]),
        ("speeds = 100", vec!["speeds", "a list"]),
        ("directions = [0, 1e9]", vec!["directions[1]", "direction is 1000000000", "-3600 to 3600"]),
        ("slides = 0", vec!["slides is 0", "1 to 100000"]),
        ("slides = 100001", vec!["slides is 100001", "1000000"]),
        ("seed = -1", vec!["seed is -1", "expected 0"]),
        ("[scene]\nseed = 1", vec!["[scene] has seed", "above"]),
        ("[scene]\nslide = 1", vec!["[scene] has slide", "above"]),
        ("[scene]\ncolor = 1", vec!["unknown key color", "noise"]),
        ("[scene]\nnoise = -1", vec!["noise is -1", "0 to 100"]),
        ("[scene]\ndepth = 1", vec!["depth is 1", "only with Sin, Saw or Tri"]),
        ("[scene.light]\nleak = 2", vec!["[light] leak is 2", "0 to 1"]),
        ("[scene", vec!["TOML"]),
    ] {
        let message = Sweep::parse("s.toml", text).unwrap_err().to_string();
        for part in ["s.toml"].into_iter().chain(parts) {
            assert!(message.contains(part), "{text:?} gave {message:?}, expected {part:?}");
        }
    }
}

#[test]
fn samples_are_the_same_for_any_number_of_threads() {
    let scripts = scripts(&sweep("slides = 2\nspeeds = [100, 200]\n[scene]\nnoise = 2"));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| samples(&scripts, &Config::default())).unwrap()
    };
    let one = with(1);
    assert!(one.iter().all(|outcome| matches!(outcome, Outcome::Sample(..))));
    assert_eq!(with(2), one);
    assert_eq!(with(5), one);
}

/// Checks a hash that was made on x86-64; any other machine must make the same.
#[test]
fn a_sweep_gives_the_same_samples_everywhere() {
    let outcomes = samples(&scripts(&sweep("slides = 1")), &Config::default()).unwrap();
    let mut hash = 0xCBF2_9CE4_8422_2325_u64;
    for outcome in &outcomes {
        let Outcome::Sample(sample, _) = outcome else { panic!("{outcome:?}") };
        let bytes = sample.as_flattened().iter().flat_map(|feature| feature.to_le_bytes());
        hash = bytes.fold(hash, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3));
    }
    assert_eq!(hash, 0xF133_AE53_48D5_A8FF, "{hash:#X}");
}

#[test]
fn a_sample_is_that_of_the_first_event() {
    let script = SceneConfig::from_toml("s", "specimen = \"Saw3\"\nspeed = 150\nfidelity = \"taxel\"").unwrap();
    let config = Config::default();
    let wanted = OutputOptions { features: true, ..OutputOptions::default() };
    let session = Session::builder(SceneSource::new(&script).unwrap()).config(config.clone()).outputs(wanted);
    let (mut features, mut event) = (Vec::new(), None);
    for output in session.build().unwrap() {
        match output.unwrap() {
            Output::Features(frame) => features.push(frame.features),
            Output::Event(first) => event = Some(first.frame as usize),
            _ => {}
        }
    }
    let Outcome::Sample(found, facts) = sample(&script, &config).unwrap() else { panic!() };
    assert!(facts.reliable && facts.duration.is_some_and(|frames| (20..40).contains(&frames)), "{facts:?}");
    let from = event.unwrap();
    for (frame, features) in features[from..from + SAMPLE_FRAMES].iter().enumerate() {
        assert_eq!(found.map(|feature| feature[frame]), *features);
    }
}

#[test]
fn a_slide_that_is_cut_off_has_no_duration() {
    let facts = |scene| match sample(&short(scene), &Config::default()).unwrap() {
        Outcome::Sample(_, facts) => facts,
        other => panic!("{other:?}"),
    };
    assert_eq!(facts("Saw3@20,seed=1").duration, None);
    assert!(facts("Saw3@150,seed=1").duration.is_some());
}

#[test]
fn what_is_no_sample_is_said() {
    let outcome = |more: &str| sample(&sweep(&format!("[scene]\n{more}")).script(0), &Config::default()).unwrap();
    assert_eq!(outcome("[scene.whisker]\noverlap_mm = 0"), Outcome::NoEvent);
    let interrupted = (0..50).map(|number| {
        let sweep = sweep("specimens = [\"Fla0\"]\n[scene.sensor]\ndropped = 0.5");
        sample(&sweep.script(number), &Config::default()).unwrap()
    });
    assert!(interrupted.into_iter().any(|outcome| outcome == Outcome::Incomplete));
}
