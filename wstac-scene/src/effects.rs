//! The modeled effects of a scene. Each can be left out, and then costs no time.

use super::beam::Beam;
use super::light::{Dead, LightConfig, Weak};
use super::script::SceneConfig;
use super::sensor::{Fidelity, Pose, SensorConfig, SensorFormat};
use super::specimen::{Body, Specimen};
use super::touch::{Slide, Touch};
use super::whisker::WhiskerConfig;

/// An effect that a scene may have.
#[derive(Clone, Copy)]
pub struct Effect {
    /// Its name: a few words.
    pub name: &'static str,
    /// A description of the computation, with its source or "a guess".
    pub what: &'static str,
    /// Returns its value in a scene, or `None` if the scene does not have it.
    pub value: fn(&SceneConfig) -> Option<String>,
    /// Removes it from a scene.
    pub remove: fn(&mut SceneConfig),
    /// Adds it to a scene that does not have it, at the usual strength.
    pub add: fn(&mut SceneConfig),
}

/// Effects that no scene models.
pub const NEVER: [&str; 7] = [
    "tips that stick: a tip slides over the surface above its base",
    "the tip's own shape and the specimen's wear",
    "whiskers that touch each other or pull at the elastomer between them",
    "recovery of the phosphor, and its dependence on temperature",
    "a lens that is out of focus at its rim only",
    "objects that tilt while they slide",
    "texture across the slide: a block's profile is the same over its width",
];

/// Formats a value that is present if it is above 0.
fn positive(value: f64, unit: &str) -> Option<String> {
    (value > 0.0).then(|| format!("{}{unit}", (value * 1e6).round() / 1e6))
}

/// Makes the effect of a number of the scene that is above 0: its value with a unit, and its usual strength.
macro_rules! amount {
    ($name:literal: $what:literal, $($field:ident).+ $(* $noise:ident)?, $unit:literal, usually $usual:expr) => {
        Effect {
            name: $name,
            what: $what,
            value: |script| positive(script.$($field).+ $(* script.$noise)?, $unit),
            remove: |script| script.$($field).+ = 0.0,
            add: |script| script.$($field).+ = $usual,
        }
    };
}

/// Returns the slides of a scene.
fn slides(script: &mut SceneConfig) -> impl Iterator<Item = &mut Slide> {
    script.touches.iter_mut().filter_map(|touch| match touch {
        Touch::Slide(slide) => Some(slide),
        Touch::Press(_) | Touch::Twist(_) => None,
    })
}

/// All effects, in the order in which light passes through them.
pub const EFFECTS: [Effect; 26] = [
    Effect {
        name: "shapes",
        what: "blocks, rods, balls, coins and corners; rigid, and below its middle a rod is as wide as there (a guess)",
        value: |script| {
            let slides = script.touches.iter().filter_map(Touch::slide);
            let names: Vec<_> = slides.filter_map(|slide| slide.specimen.body.name()).collect();
            names.first().map(|first| if names.len() > 1 { format!("{}", names.len()) } else { (*first).into() })
        },
        remove: |script| slides(script).for_each(|slide| slide.specimen.body = Body::Prism),
        add: |script| slides(script).for_each(|slide| slide.specimen = Specimen::ball(12.0)),
    },
    Effect {
        name: "objects at once",
        what: "a whisker that two of them touch is bent by the one that bends it more (a guess)",
        value: |script| {
            let count = script.touches.iter().filter(|touch| touch.after_s().is_some()).count();
            (count > 0).then(|| format!("{}", count + 1))
        },
        remove: |script| slides(script).for_each(|slide| slide.after_s = None),
        add: |script| {
            let Some(slide) = script.touches.first().and_then(Touch::slide).copied() else { return };
            script.touches.push(Touch::Slide(Slide { after_s: Some(0.1), ..slide }));
        },
    },
    Effect {
        name: "uneven motion",
        what: "held, turning, resting or twisting; an object is rigid, and goes on at once (a guess)",
        value: |script| {
            let is_uneven = |touch: &&Touch| touch.slide().map_or(touch.kind() == "twist", Slide::changes);
            script.touches.iter().find(is_uneven).map(|touch| touch.kind().into())
        },
        remove: |script| {
            script.touches.retain(|touch| touch.kind() != "twist");
            for slide in slides(script) {
                *slide = Slide { turn_deg_mm: 0.0, rest: None, held: None, profile: None, ..*slide };
            }
        },
        add: |script| slides(script).for_each(|slide| slide.turn_deg_mm = 0.2),
    },
    Effect {
        name: "large bends",
        what: "the elastica (Bisshopp and Drucker 1945) instead of the linear beam",
        value: |script| (script.whisker.beam == Beam::Elastica).then(|| "beam = \"elastica\"".into()),
        remove: |script| script.whisker.beam = Beam::Linear,
        add: |script| script.whisker.beam = Beam::Elastica,
    },
    amount! {
        "dome": "lowers the outer whiskers' tips (paper: 30°)",
        whisker.dome_degrees, "°", usually WhiskerConfig::default().dome_degrees
    },
    amount! {
        "springing back": "a released whisker springs back in a finite time (a guess)",
        whisker.relaxation_ms, " ms", usually WhiskerConfig::default().relaxation_ms
    },
    amount! {
        "rubbing": "light of friction × speed × load (a guess)",
        light.rubbing_ms, " ms per mm", usually LightConfig::default().rubbing_ms
    },
    Effect {
        name: "uneven rubbing",
        what: "fluctuates along the way (a guess)",
        value: |script| {
            let rubs = script.light.rubbing_ms > 0.0;
            positive(script.light.fluctuation * script.noise, " of it").filter(|_| rubs)
        },
        remove: |script| script.light.fluctuation = 0.0,
        add: |script| {
            script.light.fluctuation = LightConfig::default().fluctuation;
            script.light.rubbing_ms = LightConfig::default().rubbing_ms;
        },
    },
    amount! {
        "afterglow": "light fades exponentially (fitted to the paper's speed law)",
        light.afterglow_ms, " ms", usually LightConfig::default().afterglow_ms
    },
    amount! {
        "unlike whiskers": "each has its own gain, that of its sensor (a guess)",
        light.gain_deviation, "", usually LightConfig::default().gain_deviation
    },
    amount! {
        "unlike runs": "each slide has its own gain (a guess; all noise scaled to fit one cell of table 2)",
        light.run_deviation * noise, "", usually LightConfig::default().run_deviation
    },
    Effect {
        name: "dead whiskers",
        what: "bend, but give no light",
        value: |script| (script.light.dead != Dead::default()).then(|| format!("{}", script.light.dead.count())),
        remove: |script| script.light.dead = Dead::default(),
        add: |script| script.light.dead = Dead::try_from(vec![[3, 3]]).unwrap_or_default(),
    },
    Effect {
        name: "weak whiskers",
        what: "give less light",
        value: |script| (script.light.weak != Weak::default()).then(|| format!("{}", script.light.weak.count())),
        remove: |script| script.light.weak = Weak::default(),
        add: |script| script.light.weak = Weak::try_from(vec![(3, 3, 0.5)]).unwrap_or_default(),
    },
    amount! {
        "cross-talk": "a base's light is seen at the four beside it (a guess)",
        light.crosstalk, " of it", usually 0.05
    },
    amount! {
        "decay": "each touch has less light than the one before (a guess)",
        light.decay, " per touch", usually 0.02
    },
    amount! {
        "leak": "ambient light on every pixel",
        light.leak, " of full scale", usually 0.01
    },
    amount! {
        "growing leak": "ambient light grows with time",
        light.leak_per_minute, " of full scale per minute", usually 0.01
    },
    Effect {
        name: "drift",
        what: "light grows or fades with time",
        value: |script| {
            let drift = script.light.drift_per_minute;
            (drift.abs() > 0.0).then(|| format!("{drift} per minute"))
        },
        remove: |script| script.light.drift_per_minute = 0.0,
        add: |script| script.light.drift_per_minute = -0.1,
    },
    Effect {
        name: "short shutter",
        what: "open for a fraction of the frame only",
        value: |script| (script.sensor.exposure < 1.0).then(|| format!("{}", script.sensor.exposure)),
        remove: |script| script.sensor.exposure = 1.0,
        add: |script| script.sensor.exposure = 0.5,
    },
    Effect {
        name: "pose",
        what: "a camera that is turned, tilted, bent by its lens or unevenly bright; all pixels are computed",
        value: |script| script.sensor.pose.map(|pose| format!("turned by {}°", pose.rotation_degrees)),
        remove: |script| script.sensor.pose = None,
        add: |script| {
            // Sums are only drawn for a camera that looks straight on.
            script.fidelity = Fidelity::Rendered;
            script.sensor.pose = Some(Pose { rotation_degrees: 10.0, ..Pose::default() });
        },
    },
    amount! {
        "noise of pixels": "shot and read noise in electrons (a guess; all noise scaled to fit one cell of table 2)",
        sensor.noise * noise, " times", usually SensorConfig::default().noise
    },
    amount! {
        "blur": "Gaussian point spread",
        sensor.blur, " px", usually 3.0
    },
    Effect {
        name: "color",
        what: "a format other than GREY",
        value: |script| {
            let SensorConfig { format, .. } = script.sensor;
            (format != SensorFormat::GREY && !format.is_jpeg()).then(|| format.to_string())
        },
        remove: |script| script.sensor.format = SensorFormat::GREY,
        add: |script| set_format(script, "YUYV"),
    },
    Effect {
        name: "MJPEG",
        what: "each frame is compressed and decoded again",
        value: |script| script.sensor.format.is_jpeg().then(|| format!("quality {}", script.sensor.quality)),
        remove: |script| script.sensor.format = SensorFormat::GREY,
        add: |script| set_format(script, "MJPG"),
    },
    amount! {
        "dropped frames": "the driver loses frames at random",
        sensor.dropped, " of them", usually 0.05
    },
    Effect {
        name: "auto-exposure",
        what: "a camera that slows down to a quarter of its rate in the dark",
        value: |script| script.sensor.auto_exposure.then(|| "on".into()),
        remove: |script| script.sensor.auto_exposure = false,
        add: |script| script.sensor.auto_exposure = true,
    },
];

fn set_format(script: &mut SceneConfig, code: &str) {
    // Sums are only drawn for formats that store green.
    script.fidelity = Fidelity::Rendered;
    if let Ok(format) = code.parse() {
        script.sensor.format = format;
    }
}

/// Returns the scene without any effect.
///
/// It keeps a linear beam on a plane, light of bending without afterglow, and a perfect gray camera.
pub fn bare(script: &SceneConfig) -> SceneConfig {
    let mut bare = script.clone();
    for effect in &EFFECTS {
        (effect.remove)(&mut bare);
    }
    bare
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_come_and_go() {
        let script = SceneConfig::parse_short("Saw3@150").unwrap();
        let none = bare(&script);
        for effect in &EFFECTS {
            assert_eq!((effect.value)(&none), None, "{}", effect.name);
            let mut with = none.clone();
            (effect.add)(&mut with);
            assert!((effect.value)(&with).is_some(), "{}", effect.name);
            (effect.remove)(&mut with);
            assert_eq!((effect.value)(&with), None, "{}", effect.name);
        }
    }
}
