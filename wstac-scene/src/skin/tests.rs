use super::*;
use crate::object::Object;
use crate::touch::Touch;
use crate::{Slide, Truth};

/// Returns the light of a scene's frames, and that of a skin that is told the overlaps of its only slide every `step_s`
/// s.
fn both(text: &str, step_s: f64) -> [Vec<[f64; TAXELS]>; 2] {
    let script = SceneConfig::from_toml("scene", text).unwrap();
    let mut scene = Scene::new(&script).unwrap();
    let [Truth { touch: touch @ Touch::Slide(Slide { speed_mm_s, .. }), start_s, end_s, .. }] = *scene.truth() else {
        panic!("{text}: expected one slide")
    };
    let object = Object::new(&touch, 0.0, &script.whisker);
    let whiskers = script.whisker.whiskers();
    let mut camera = SkinCamera::new(&script).unwrap();
    let (mut theirs, mut own) = (Vec::new(), Vec::new());
    while let Some((light, _)) = scene.next_light() {
        theirs.push(light);
    }
    for step in 1.. {
        let time = f64::from(step) * step_s;
        let overlap: [f64; TAXELS] =
            core::array::from_fn(|taxel| object.overlap_mm(taxel, &whiskers[taxel].unwrap(), time - start_s).max(-1.0));
        let speed = if time >= start_s && time <= end_s { speed_mm_s } else { 0.0 };
        if let Some(light) = camera.step(&overlap, &[speed; TAXELS], step_s).unwrap() {
            own.push(light);
        }
        if own.len() == theirs.len() {
            break;
        }
    }
    [own, theirs]
}

/// A skin that is told a scene's overlaps gives the scene's light: within 1 % of the brightest frame, in steps of 0.1
/// ms.
#[test]
fn told_overlaps_give_the_light_of_the_scene() {
    for (text, most) in [
        ("specimen = \"Fla0\"\nspeed = 60\ndirection = 30\nnoise = 0", 0.002),
        ("specimen = \"Tri4\"\nspeed = 150\ndirection = 90\nnoise = 0", 0.01),
        ("specimen = \"Sin3\"\nspeed = 100\ndirection = 200\nwidth = 12\nnoise = 0", 0.01),
        ("shape = \"ball\"\ndiameter = 12\nspeed = 120\ndirection = 45\nnoise = 0\n[sensor]\nexposure = 0.5", 0.01),
        // The rubbing fluctuates by other numbers along the path of each whisker: only the whole is the same.
        ("specimen = \"Saw3\"\nspeed = 200\ndirection = 10\nseed = 7", 0.03),
    ] {
        let [own, theirs] = both(text, 1e-4);
        let brightest = theirs.iter().flatten().copied().fold(0.0, f64::max);
        let pairs = own.iter().flatten().zip(theirs.iter().flatten());
        let worst = pairs.map(|(own, theirs)| libm::fabs(own - theirs)).fold(0.0, f64::max) / brightest;
        assert!(brightest > 0.05 && worst < most, "{text}: off by {worst:.5} of {brightest}");
    }
}

#[test]
fn frames_do_not_depend_on_how_time_is_divided() {
    let frames = |steps: u32, seconds: f64| {
        let mut camera = SkinCamera::new(&SceneConfig::new(Vec::new())).unwrap();
        let overlap = |time: f64| [(40.0 * time - 5.0).min(3.0); TAXELS];
        let at = |step: u32| camera.step(&overlap(f64::from(step + 1) * seconds), &[0.0; TAXELS], seconds).unwrap();
        (0..steps).filter_map(at).map(|light| light[7]).collect::<Vec<_>>()
    };
    let whole = frames(3000, 1e-4);
    assert_eq!(whole.len(), 9);
    for (steps, seconds) in [(300, 1e-3), (150, 2e-3), (891, 1.0 / 2970.0), (60, 5e-3)] {
        let other = frames(steps, seconds);
        assert_eq!(other.len(), 9, "{seconds}");
        let worst = whole.iter().zip(&other).map(|(a, b)| libm::fabs(a - b)).fold(0.0, f64::max);
        assert!(worst < 2e-3 * whole.iter().copied().fold(0.0, f64::max), "{seconds}: {worst}");
    }
}

#[test]
fn a_hold_becomes_dark_and_a_slip_lights_up() {
    let mut skin = Skin::new(&SceneConfig::new(Vec::new()));
    let mut step = |overlap: f64, rubbing: f64| skin.step(&[overlap; TAXELS], &[rubbing; TAXELS], 1e-3).unwrap()[12];
    let pressed = (0..20).map(|k| step(0.15 * f64::from(k), 0.0)).fold(0.0, f64::max);
    let held = (0..500).map(|_| step(3.0, 0.0)).last().unwrap();
    let slips = (0..300).map(|_| step(3.0, 60.0)).last().unwrap();
    assert!(pressed > 0.05 && held < 1e-4 && slips > 0.003, "{pressed} {held} {slips}");
    let released = (0..20).map(|_| step(-1.0, 0.0)).last().unwrap();
    assert!(released > 0.03, "{released}");
}

#[test]
fn what_is_no_step_is_refused_and_changes_nothing() {
    let mut camera = SkinCamera::new(&SceneConfig::new(Vec::new())).unwrap();
    let (mut wrong, mut fast) = ([0.0; TAXELS], [0.0; TAXELS]);
    (wrong[3], fast[24]) = (f64::NAN, -1.0);
    for (overlap, rubbing, seconds, part) in [
        (wrong, [0.0; TAXELS], 1e-3, "overlap_mm is NaN, expected -10000 to 10000"),
        ([1e9; TAXELS], [0.0; TAXELS], 1e-3, "overlap_mm is 1000000000"),
        ([0.0; TAXELS], fast, 1e-3, "rubbing_mm_s is -1, expected 0 to 10000"),
        ([0.0; TAXELS], [f64::INFINITY; TAXELS], 1e-3, "rubbing_mm_s is inf"),
        ([0.0; TAXELS], [0.0; TAXELS], 0.0, "seconds is 0, expected above 0 and at most 0.033333"),
        ([0.0; TAXELS], [0.0; TAXELS], f64::NAN, "seconds is NaN"),
        ([0.0; TAXELS], [0.0; TAXELS], 0.04, "seconds is 0.04"),
    ] {
        let message = camera.step(&overlap, &rubbing, seconds).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    assert!(camera.skin().steps.seconds.abs() < 1e-12);
    for (key, part) in [
        ("sensor.readout_ms = 20", "[sensor] readout_ms is 20, expected 0 for a skin"),
        ("sensor.auto_exposure = true", "[sensor] auto_exposure is true, expected false for a skin"),
        ("sensor.dropped = 0.1", "[sensor] dropped is 0.1, expected 0 for a skin"),
        ("light.leak_per_minute = 0.1", "[light] leak_per_minute is 0.1, expected 0 for a skin"),
    ] {
        let script = SceneConfig::from_table_without_touches("skin", key.parse().unwrap()).unwrap();
        let message = SkinCamera::new(&script).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    for (key, part) in [
        ("speed = 9", "speed is there; leave it out"),
        ("[[touch]]\nkind = \"hold\"", "[[touch]] is there; leave it out"),
        ("[[slide]]\nspeed = 9", "[[slide]] is there; leave it out"),
    ] {
        let message = SceneConfig::from_table_without_touches("skin", key.parse().unwrap()).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}
