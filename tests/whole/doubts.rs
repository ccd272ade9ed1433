//! Tests that unclear touches, unreliable answers and unknown textures name their cause.

use wstac_core::model::speeds::KnownSpeeds;
use wstac_core::reason::Reason;
use wstac_core::touch::motion::Contact;
use wstac_core::touch::wave::{Basis, Measured};
use wstac_host::config::Config;
use wstac_host::json::JsonLine;
use wstac_host::output::{Output, TactileEvent};
use wstac_host::text::text_of;
use wstac_host::texture::NoTexture;
use wstac_scene::SceneConfig;

use crate::host::{Sums, first_event, sums};

/// Returns the first event of a scene, `Saw3@150` or TOML, with these keys of the configuration and this model. `alter`
/// gets all frames, and changes or loses some.
fn event(scene: &str, keys: &str, model: &str, alter: impl Fn(&mut Vec<Option<Sums>>)) -> TactileEvent {
    let is_short = scene.contains('@');
    let script = if is_short { SceneConfig::parse_short(scene) } else { SceneConfig::from_toml("scene", scene) };
    let (info, frames) = sums(script.unwrap());
    let mut frames = frames.into_iter().map(Some).collect();
    alter(&mut frames);
    first_event(&info, frames, &Config::parse(keys).unwrap(), &[model])
}

const COHERENCE: &str = "[speed]\nestimator = \"coherence\"";

fn as_it_is(_: &mut Vec<Option<Sums>>) {}

/// Returns the reasons of an event's line of JSON.
fn why(event: &TactileEvent) -> serde_json::Value {
    let output = Output::Event(Box::new(event.clone()));
    let line = serde_json::to_value(JsonLine::new(&output).unwrap()).unwrap();
    line.get("why").cloned().unwrap_or_default()
}

#[test]
fn each_cause_has_its_reason() {
    let slide = |more: &str| format!("specimen = \"Saw3\"\n{more}");
    let changing = slide("speed = [[0, 80], [40, 300]]");
    let narrow = slide("speed = 150\nwidth = 9");
    let dead = slide("speed = 150\n[light]\ndead = [[2, 3], [4, 1]]");
    for (scene, contact, doubt) in [
        ("Saw3@150", Contact::Slide, None),
        ("Saw3@700", Contact::Slide, None),
        ("Saw3@6", Contact::Unclear, Some(Reason::TooSlow)),
        ("Saw3@900", Contact::Unclear, Some(Reason::TooFast)),
        (&changing, Contact::Slide, Some(Reason::SpeedChanges)),
        (&narrow, Contact::Slide, Some(Reason::NotCrossed)),
        (&dead, Contact::Slide, Some(Reason::OutOfLine)),
        ("[[touch]]\nkind = \"press\"", Contact::Press, None),
    ] {
        let found = event(scene, COHERENCE, "builtin:path-svm", as_it_is);
        assert_eq!((found.contact, found.doubt), (Some(contact), doubt), "{scene}");
        assert_eq!(found.reliable, doubt.is_none(), "{scene}");
        assert_eq!(why(&found)["reliable"].as_str(), doubt.map(Reason::as_str), "{scene}");
    }
    // 25 taxels tell more.
    for (scene, doubt, basis) in [
        ("Saw3@150", None, Some(Basis::Edge)),
        (&narrow, None, Some(Basis::Outline)),
        (&changing, Some(Reason::SpeedChanges), None),
    ] {
        let found = event(scene, "", "builtin:path-svm", as_it_is);
        assert_eq!((found.doubt, found.basis), (doubt, basis), "{scene}");
        let acceleration = found.acceleration;
        assert_eq!(acceleration.is_some(), basis == Some(Basis::Edge), "{scene}");
        assert!(acceleration.is_none_or(|known| known.value.abs() < 2.0 * known.sd), "{scene}: {acceleration:?}");
    }
}

#[test]
fn an_acceleration_has_its_sign() {
    for sign in [1.0, -1.0] {
        // 4.9 mm/s² along the way.
        let speeds = [60.0, 61.6, 63.2, 64.8].map(|mm_s| if sign > 0.0 { mm_s } else { 124.8 - mm_s });
        let points: Vec<_> =
            speeds.iter().zip([0, 20, 40, 60]).map(|(mm_s, at)| format!("[{at}, {mm_s:.1}]")).collect();
        let scene = format!("specimen = \"Tri2\"\ndirection = 30\nlength = 20\nspeed = [{}]", points.join(", "));
        let Measured { value, sd } = event(&scene, "", "builtin:path-svm", as_it_is).acceleration.unwrap();
        assert!((value - 4.9 * sign).abs() < 2.0 * sd && value * sign > 3.0 * sd, "{value} ± {sd}, {scene}");
    }
}

/// Checks that an object's place and width are in the line of text and in that of JSON.
#[test]
fn a_narrow_object_has_its_place_and_width() {
    let ball = "shape = \"ball\"\ndiameter = 15\nspeed = 100\ndirection = 30";
    let found = event(ball, "", "builtin:path-svm", as_it_is);
    assert!(found.reliable, "{found:?}");
    let extent = found.extent.unwrap();
    let (place, width) = (extent.place_mm.unwrap(), extent.width_mm.unwrap());
    assert!(place.value.abs() < 1.0 && (5.0..15.0).contains(&width.value) && extent.contacts == 1, "{extent:?}");
    let output = Output::Event(Box::new(found.clone()));
    let text = text_of(&output);
    let side = if place.value < 0.0 { "right" } else { "left" };
    let expected =
        format!(", by the outline, {:.1} ± {:.1} mm wide, {:.1} ± ", width.value, width.sd, place.value.abs());
    assert!(text.contains(&expected) && text.contains(&format!(" mm to the {side} of the motion")), "{text}");
    assert!(!text.contains("contacts"), "{text}");
    let line = serde_json::to_value(JsonLine::new(&output).unwrap()).unwrap();
    for (name, measured) in [("place_mm", place), ("width_mm", width)] {
        let value = line[name]["value"].as_f64().unwrap();
        assert!((value - f64::from(measured.value)).abs() < 0.006 && line[name]["sd"].as_f64() > Some(0.0), "{line}");
    }
    assert_eq!((line["basis"].as_str(), line["contacts"].as_u64()), (Some("outline"), Some(1)));
}

#[test]
fn lost_frames_and_a_disturbed_baseline_are_reasons() {
    let whole = event("Saw3@150", "", "builtin:path-svm", as_it_is);
    let touch = whole.touch_frame.unwrap() as usize;
    let lost = event("Saw3@150", "", "builtin:path-svm", |frames| {
        (0..8).for_each(|number| frames[touch + 2 * number] = None);
    });
    assert_eq!((lost.frames_filled, lost.reliable, lost.doubt), (8, false, Some(Reason::LostFrames)));
    let disturbed = event("Saw3@150", "", "builtin:path-svm", |frames| frames[10] = frames[touch + 8]);
    assert_eq!((disturbed.reliable, disturbed.doubt), (false, Some(Reason::Baseline)));
    // By edges, too.
    let lost = event("Saw3@150", "[speed]\nestimator = \"edges\"", "builtin:path-svm", |frames| {
        (0..8).for_each(|number| frames[touch + 2 * number] = None);
    });
    assert_eq!(lost.doubt, Some(Reason::LostFrames));
}

#[test]
fn a_speed_that_a_model_does_not_know_is_a_reason() {
    let [path, over_time] = [(50, 300), (100, 200)].map(|(slowest, fastest)| KnownSpeeds::new(slowest, fastest));
    for (scene, model, expected) in [
        ("Saw3@150", "builtin:path-svm", None),
        ("Sin4@305", "builtin:path-svm", None),
        ("Saw3@400", "builtin:path-svm", path),
        ("Sin4@40,45deg", "builtin:path-svm", path),
        ("Saw3@150", "builtin:svm", None),
        ("Saw3@400", "builtin:svm", over_time),
    ] {
        let found = event(scene, "", model, as_it_is);
        let known = found.texture.as_ref().unwrap().known;
        assert_eq!(known == Some(false), expected.is_some(), "{scene} {model}: {known:?}");
        assert_eq!(found.texture_doubt, expected, "{scene} {model}");
        let text = expected.map(|speeds| format!("the speed is outside of those that the model knows: {speeds}"));
        assert_eq!(why(&found)["texture"].as_str(), text.as_deref(), "{scene} {model}");
    }
}

#[test]
fn laws_of_durations_have_no_doubt_and_models_say_that_they_need_the_speed() {
    let published = "[speed]\nlaw = \"published\"";
    let found = event("Saw3@6", published, "builtin:path-svm", as_it_is);
    assert_eq!((found.contact, found.doubt), (None, None));
    assert_eq!(found.texture, Err(NoTexture::NoSpeed));
    assert_eq!(why(&found)["texture"], "the speed is not known, and the model needs it");
    assert!(why(&found).get("reliable").is_none());
}
