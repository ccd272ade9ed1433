//! The tables `[[slide]]` and `[[touch]]` of a scene's file before they are checked.

use serde::Deserialize;
use wstac_host::text_file::whole_if_any;

use super::keys::within;
use super::light::{LightConfig, taxel_of};
use super::object::extent;
use super::sensor::{Fidelity, SensorConfig};
use super::specimen::{Body, Pattern, Specimen};
use super::touch::{Held, MOST_POINTS, Press, PressKind, Rest, Slide, SpeedProfile, Touch, Twist};
use super::whisker::WhiskerConfig;

/// Speeds of the slowest and fastest slide, in mm/s.
const SPEEDS: (f64, f64) = (1.0, 1000.0);
/// Largest angle of a block's edges against its motion, in degrees.
const MOST_SKEW: f64 = 60.0;
/// Defaults of a press: vertical speed in mm/s; time at its lowest in s, of a press or poke and of a hold.
const APPROACH: f64 = 400.0;
const PRESS_S: f64 = 0.2;
const HOLD_S: f64 = 5.0;

/// The speed of a slide: even, or points of its path.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected a number in mm/s, or points [[mm, mm/s], …]")]
pub(crate) enum FileSpeed {
    Even(f64),
    Points(Vec<[f64; 2]>),
}

/// A table that has the keys of a slide.
pub(crate) trait SlideKeys {
    /// Returns the slide.
    fn slide(&self) -> FileSlide;

    /// Returns the names of the keys of a slide that are there.
    fn keys(&self) -> Vec<&'static str>;
}

/// Defines a table that has the keys of a slide and some of its own, which are passed as a list in brackets.
macro_rules! slide_table {
    ($(#[$of:meta])* $name:ident { $($own:tt)* } $($key:ident: $type:ty,)*) => {
        $(#[$of])*
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        pub(crate) struct $name {
            $(pub $key: Option<$type>,)*
            $($own)*
        }

        impl SlideKeys for $name {
            fn slide(&self) -> FileSlide {
                FileSlide { $($key: self.$key.clone(),)* }
            }

            fn keys(&self) -> Vec<&'static str> {
                let keys = [$((stringify!($key), self.$key.is_some()),)*];
                keys.into_iter().filter_map(|(key, is_there)| is_there.then_some(key)).collect()
            }
        }
    };
}

/// Defines a table with the keys of a slide, and with its own.
macro_rules! with_slide_keys {
    ($(#[$of:meta])* $name:ident { $($own:tt)* }) => {
        slide_table! {
            $(#[$of])* $name { $($own)* }
            specimen: String, shape: String, speed: FileSpeed, direction: f64, depth: f64, period: f64, length: f64,
            width: f64, diameter: f64, angle: f64, edge: f64, radius: f64, skew: f64, offset: f64,
        }
    };
}

with_slide_keys! {
    /// The keys of a slide.
    #[derive(Clone, Debug, Default, PartialEq)]
    FileSlide {}
}

with_slide_keys! {
    /// The keys of any touch.
    #[derive(Clone, Debug)]
    FileTouch {
        kind: String,
        overlap: Option<f64>,
        approach: Option<f64>,
        lift: Option<f64>,
        hold: Option<f64>,
        tilt: Option<f64>,
        pub after: Option<f64>,
        turn: Option<f64>,
        travel: Option<f64>,
        by: Option<f64>,
        rate: Option<f64>,
        #[serde(default, deserialize_with = "whole_if_any")]
        pivot: Option<[f64; 2]>,
        #[serde(default, deserialize_with = "whole_if_any")]
        stop: Option<[f64; 2]>,
        #[serde(default, deserialize_with = "whole_if_any")]
        stick: Option<[f64; 2]>,
        #[serde(default, deserialize_with = "whole_if_any")]
        whisker: Option<[i64; 2]>,
    }
}

with_slide_keys! {
    /// A scene's file before it is checked.
    SceneFile {
        pub seed: Option<i64>,
        pub noise: Option<f64>,
        pub lead_in: Option<i64>,
        pub gap: Option<i64>,
        #[serde(default)]
        pub whisker: WhiskerConfig,
        #[serde(default)]
        pub light: LightConfig,
        #[serde(default)]
        pub sensor: SensorConfig,
        #[serde(default)]
        pub fidelity: Fidelity,
        #[serde(default)]
        pub slide: Vec<FileSlide>,
        #[serde(default)]
        pub touch: Vec<FileTouch>,
    }
}

impl FileSlide {
    /// Returns the slide; an error names the key, the value found and the values expected.
    pub(crate) fn check(&self) -> Result<Slide, String> {
        let named = match (&self.specimen, &self.shape) {
            (Some(name), _) => name.parse()?,
            (None, Some(_)) => Specimen::ALL[0],
            (None, None) => return Err("specimen is missing, expected a name such as \"Saw3\"".into()),
        };
        let specimen = self.check_specimen(named)?;
        let (speed_mm_s, profile) = match self.speed.as_ref().ok_or("speed is missing, expected a number in mm/s")? {
            FileSpeed::Even(speed) => (checked_speed(*speed)?, None),
            FileSpeed::Points(points) => {
                let profile = SpeedProfile::new(points).ok_or_else(|| {
                    format!("speed is {points:?}, expected 1 to {MOST_POINTS} points [mm, mm/s], places rising from 0")
                })?;
                for [_, speed] in points {
                    checked_speed(*speed)?;
                }
                (profile.speed_at(0.0), Some(profile))
            }
        };
        let (direction_deg, offset_mm) = (checked_direction(self.direction)?, self.offset.unwrap_or(0.0));
        let (skew_key, skew_deg) = match (self.angle, self.skew) {
            (Some(_), Some(_)) if specimen.body == Body::Rod => {
                return Err("angle and skew both state how the rod lies; leave one of them out".into());
            }
            // Both ends of a rod are alike.
            (Some(angle), None) if specimen.body == Body::Rod => {
                within("angle", angle, -360.0, 360.0)?;
                let turned = libm::fmod(angle - direction_deg, 180.0);
                ("skew by angle", if turned < 0.0 { turned + 90.0 } else { turned - 90.0 })
            }
            _ => ("skew", self.skew.unwrap_or(0.0)),
        };
        let most = if extent(&specimen, 0.0).is_none() { MOST_SKEW } else { 180.0 };
        within(skew_key, skew_deg, -most, most)?;
        within("offset", offset_mm, -100.0, 100.0)?;
        let slide = Slide::new(specimen, speed_mm_s, direction_deg);
        Ok(Slide { skew_deg, offset_mm, profile, ..slide })
    }

    /// Checks a slide's own values, and returns the specimen with them.
    fn check_specimen(&self, named: Specimen) -> Result<Specimen, String> {
        let body = self.check_body()?;
        let is_sphere = named.pattern == Pattern::Sphere;
        let keys: &[&str] = match body {
            Body::Prism if is_sphere => &["radius"],
            Body::Prism | Body::Block => &["length", "width", "edge"],
            Body::Rod => &["diameter", "width", "angle"],
            Body::Ball => &["diameter"],
            Body::Coin => &["diameter", "edge"],
            Body::Corner { .. } => &["angle", "length", "edge"],
        };
        let is_textured = named.is_textured();
        for (key, found, has, others) in [
            ("radius", self.radius, false, "Sphere"),
            ("depth", self.depth, is_textured, "Sin, Saw or Tri"),
            ("period", self.period, is_textured, "Sin, Saw or Tri"),
            ("length", self.length, false, "a block or a corner"),
            ("width", self.width, false, "a block or a rod"),
            ("edge", self.edge, false, "a block, a coin or a corner"),
            ("diameter", self.diameter, false, "shape = \"rod\", \"ball\" or \"coin\""),
            ("angle", self.angle, false, "shape = \"corner\" or \"rod\""),
        ] {
            if let Some(found) = found.filter(|_| !has && !keys.contains(&key)) {
                return Err(format!("{key} is {found}, expected only with {others}"));
            }
        }
        if body != Body::Prism && is_sphere || matches!(body, Body::Rod | Body::Ball) && is_textured {
            let shape = body.name().unwrap_or_default();
            return Err(format!("specimen is \"{named}\", but a {shape} has no texture; leave specimen or shape out"));
        }
        if is_sphere {
            let radius = self.radius.unwrap_or(named.depth_mm);
            within("radius", radius, 0.01, 100.0)?;
            return Ok(Specimen::sphere(radius));
        }
        let mut specimen = named;
        if is_textured {
            specimen = Specimen::block(named.pattern, self.depth.unwrap_or(named.depth_mm));
            specimen.period_mm = self.period.unwrap_or(specimen.period_mm);
            within("depth", specimen.depth_mm, 0.001, 100.0)?;
            within("period", specimen.period_mm, 0.1, 1000.0)?;
        }
        specimen.body = body;
        specimen.length_mm = self.length.or(self.diameter).unwrap_or(named.length_mm);
        specimen.edge_degrees = self.edge.unwrap_or(named.edge_degrees);
        within(if self.diameter.is_some() { "diameter" } else { "length" }, specimen.length_mm, 0.1, 1000.0)?;
        within("edge", specimen.edge_degrees, 1.0, 90.0)?;
        if let Some(width) = self.width {
            within("width", width, 0.1, 1000.0)?;
            specimen.width_mm = width;
        }
        Ok(specimen)
    }

    /// Returns the outline that `shape` names, and checks that it has what it needs.
    fn check_body(&self) -> Result<Body, String> {
        let Some(shape) = self.shape.as_deref() else { return Ok(Body::Prism) };
        let needs = |key: &str, found: Option<f64>| match found {
            Some(_) => Ok(()),
            None => Err(format!("shape = {shape:?} needs {key}, in mm")),
        };
        match shape {
            "block" => needs("width", self.width).map(|()| Body::Block),
            "rod" => needs("diameter", self.diameter).map(|()| Body::Rod),
            "ball" => needs("diameter", self.diameter).map(|()| Body::Ball),
            "coin" => needs("diameter", self.diameter).map(|()| Body::Coin),
            "corner" => {
                let degrees = self.angle.unwrap_or(90.0);
                within("angle", degrees, 10.0, 170.0)?;
                Ok(Body::Corner { degrees })
            }
            _ => Err(format!("shape is {shape:?}, expected block, rod, ball, coin or corner")),
        }
    }
}

impl FileTouch {
    /// Returns the touch; an error names the key, the value found and the values expected.
    pub(crate) fn check(&self, whisker: &WhiskerConfig) -> Result<Touch, String> {
        self.refuse_others()?;
        let (kind, hold_s) = match self.kind.as_str() {
            "slide" => return self.check_slide().map(Touch::Slide),
            "twist" => return self.check_twist().map(Touch::Twist),
            "press" => (PressKind::Press, PRESS_S),
            "poke" => (PressKind::Poke, PRESS_S),
            _ => (PressKind::Hold, HOLD_S),
        };
        let whisker_of = match (self.whisker, kind) {
            (Some([row, column]), PressKind::Poke) => {
                taxel_of("whisker", row, column)?;
                Some([row as u8, column as u8])
            }
            (None, PressKind::Poke) => return Err("whisker is missing, expected its row and column".into()),
            _ => None,
        };
        let Held { approach_mm_s, lift_mm_s, hold_s, .. } = self.check_held(hold_s)?;
        let press = Press {
            kind,
            overlap_mm: self.overlap.unwrap_or(whisker.overlap_mm),
            approach_mm_s,
            lift_mm_s,
            hold_s,
            tilt_deg: self.tilt.unwrap_or(0.0),
            direction_deg: checked_direction(self.direction)?,
            whisker: whisker_of,
        };
        within("overlap", press.overlap_mm, 0.01, 0.95 * whisker.length_mm)?;
        within("tilt", press.tilt_deg, 0.0, 45.0)?;
        Ok(Touch::Press(press))
    }

    fn check_slide(&self) -> Result<Slide, String> {
        let slide = self.slide().check()?;
        let (hold, travel) = (("hold", self.hold), ("travel", self.travel));
        for ((key, found), (needed, other)) in
            [(("approach", self.approach), hold), (travel, hold), (("lift", self.lift), travel)]
        {
            if found.is_some() && other.is_none() {
                return Err(format!("{key} needs {needed}"));
            }
        }
        let turn_deg_mm = self.turn.unwrap_or(0.0);
        within("turn", turn_deg_mm, -1.0, 1.0)?;
        self.after.map_or(Ok(()), |after| within("after", after, 0.0, 60.0))?;
        let rest = match (self.stop, self.stick) {
            (Some(_), Some(_)) => return Err("stop and stick exclude each other".into()),
            (Some([first_mm, rest_s]), None) => Some(Rest { first_mm, every_mm: f64::INFINITY, rest_s }),
            (None, Some([every_mm, rest_s])) => Some(Rest { first_mm: every_mm, every_mm, rest_s }),
            (None, None) => None,
        };
        if let Some(rest) = &rest {
            let key = if self.stop.is_some() { "stop" } else { "stick" };
            within(&format!("{key}'s distance"), rest.first_mm, 0.5, 2000.0)?;
            within(&format!("{key}'s time"), rest.rest_s, 0.0, 60.0)?;
        }
        let held = self.hold.map(|_| self.check_held(0.0)).transpose()?;
        Ok(Slide { turn_deg_mm, rest, held, after_s: self.after, ..slide })
    }

    fn check_twist(&self) -> Result<Twist, String> {
        if let Some(key) = self.keys().into_iter().find(|key| ["speed", "skew", "offset"].contains(key)) {
            return Err(format!("{key} is there, expected only with kind = \"slide\""));
        }
        let slide = FileSlide { speed: Some(FileSpeed::Even(SPEEDS.0)), ..self.slide() }.check()?;
        let twist = Twist {
            specimen: slide.specimen,
            direction_deg: slide.direction_deg,
            pivot_mm: self.pivot.unwrap_or_default(),
            by_deg: self.by.ok_or("by is missing, expected an angle in degrees")?,
            speed_deg_s: self.rate.ok_or("rate is missing, expected degrees per second")?,
            held: Held { travel_mm: Some(0.0), ..self.check_held(PRESS_S)? },
        };
        twist.pivot_mm.into_iter().try_for_each(|mm| within("pivot", mm, -100.0, 100.0))?;
        within("by", twist.by_deg.abs(), 0.1, 360.0)?;
        within("rate", twist.speed_deg_s, 1.0, 3600.0)?;
        Ok(twist)
    }

    /// Returns how a specimen is pressed on.
    fn check_held(&self, hold_s: f64) -> Result<Held, String> {
        let (approach_mm_s, hold_s) = (self.approach.unwrap_or(APPROACH), self.hold.unwrap_or(hold_s));
        let lift_mm_s = self.lift.unwrap_or(approach_mm_s);
        within("approach", approach_mm_s, 1.0, 10_000.0)?;
        within("lift", lift_mm_s, 1.0, 10_000.0)?;
        within("hold", hold_s, 0.0, 3600.0)?;
        self.travel.map_or(Ok(()), |travel| within("travel", travel, 0.1, 1000.0))?;
        Ok(Held { approach_mm_s, lift_mm_s, hold_s, travel_mm: self.travel })
    }

    /// Refuses an unknown kind, and keys of other kinds of touches.
    fn refuse_others(&self) -> Result<(), String> {
        let (kind, presses) = (&self.kind, &["press", "poke", "hold"][..]);
        if !["slide", "twist"].iter().chain(presses).any(|known| kind == known) {
            return Err(format!("kind is {kind:?}, expected slide, press, poke, hold or twist"));
        }
        for (key, is_there, kinds) in [
            ("overlap", self.overlap.is_some(), presses),
            ("tilt", self.tilt.is_some(), presses),
            ("whisker", self.whisker.is_some(), &["poke"]),
            ("after", self.after.is_some(), &["slide"]),
            ("stop", self.stop.is_some(), &["slide"]),
            ("stick", self.stick.is_some(), &["slide"]),
            ("turn", self.turn.is_some(), &["slide"]),
            ("travel", self.travel.is_some(), &["slide"]),
            ("by", self.by.is_some(), &["twist"]),
            ("rate", self.rate.is_some(), &["twist"]),
            ("pivot", self.pivot.is_some(), &["twist"]),
        ] {
            if is_there && !kinds.contains(&self.kind.as_str()) {
                let kinds: Vec<_> = kinds.iter().map(|kind| format!("{kind:?}")).collect();
                return Err(format!("{key} is there, expected only with kind = {}", kinds.join(" or ")));
            }
        }
        let is_press = presses.contains(&self.kind.as_str());
        match self.keys().into_iter().find(|key| is_press && *key != "direction") {
            Some(key) => Err(format!("{key} is there, expected only with kind = \"slide\" or \"twist\"")),
            None => Ok(()),
        }
    }
}

/// Reads a speed of the short form.
pub(crate) fn parsed_speed(found: &str) -> Result<f64, String> {
    let (slowest, fastest) = SPEEDS;
    let speed = found.parse().ok().and_then(|speed| checked_speed(speed).ok());
    speed.ok_or_else(|| {
        let is_with_unit = found.strip_suffix("mm/s").is_some_and(|number| number.trim().parse::<f64>().is_ok());
        let without = if is_with_unit { ", without the unit, as in Saw3@150" } else { "" };
        format!("speed is {found:?}, expected {slowest} to {fastest} mm/s{without}")
    })
}

/// Reads a direction of the short form.
pub(crate) fn parsed_direction(found: &str) -> Result<f64, String> {
    let direction = found.parse().ok().and_then(|degrees| checked_direction(Some(degrees)).ok());
    direction.ok_or_else(|| format!("direction is {found:?}, expected an angle in degrees"))
}

/// Returns the length that the text of a short form gives, in mm.
pub(crate) fn parsed_length(found: &str) -> Result<f64, String> {
    let length: f64 = found.parse().map_err(|_| format!("length is {found:?}, expected a number of mm, as in 60mm"))?;
    within("length", length, 0.1, 1000.0)?;
    Ok(length)
}

fn checked_speed(found: f64) -> Result<f64, String> {
    let (slowest, fastest) = SPEEDS;
    if (slowest..=fastest).contains(&found) {
        return Ok(found);
    }
    Err(format!("speed is {found}, expected {slowest} to {fastest} mm/s"))
}

/// Checks a direction and turns it into 0 ≤ degrees < 360.
fn checked_direction(found: Option<f64>) -> Result<f64, String> {
    let found = found.unwrap_or(0.0);
    within("direction", found, -3600.0, 3600.0)?;
    let turned = libm::fmod(found, 360.0);
    let positive = if turned < 0.0 { turned + 360.0 } else { turned };
    // A tiny negative angle rounds to a whole turn.
    Ok(if positive >= 360.0 { 0.0 } else { positive + 0.0 })
}
