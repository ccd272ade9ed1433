//! The file of a scene: its touches, the sensor that they meet, and the seed of all random numbers.
//!
//! ```toml
//! specimen = "Saw3"      # Fla0, Sphere, or Sin, Saw or Tri with a depth of 2, 3 or 4 mm
//! speed = 150            # mm/s; or [[0, 80], [40, 200]]: mm of path, mm/s there
//! direction = 90         # degrees, any; default 0
//! depth = 3.5            # depth of the texture in mm, instead of the name's; the period is then 7
//! period = 5             # period of the texture in mm, instead of twice the depth
//! length = 104.5         # length of the block in mm
//! width = 12             # width of the block across its motion in mm; default: wider than the sensor
//! offset = 3             # distance of the block's middle to the left of its path, in mm
//! skew = 20              # angle of the block's edges and texture against its motion, in degrees
//! edge = 72              # slope of the block's ends in degrees, up to 90
//! radius = 0.5           # radius of a Sphere in mm
//! shape = "block"        # outline: a rectangle that turns with skew; or "rod", "ball", "coin" or "corner"
//! diameter = 8           # of a rod, ball or coin in mm
//! angle = 90             # between the edges of a corner, in degrees; or of a rod in the picture, instead of skew
//! seed = 7               # of all random numbers; default 0
//! noise = 0.8            # scale of all random deviations; 0 for none
//! lead_in = 45           # dark frames before the first touch
//! gap = 70               # dark frames between touches; behind the last one, at least 70
//! fidelity = "rendered"  # or "taxel": taxel sums from their distribution, without pixels
//! ```
//!
//! or, instead of the keys of a slide, any number of `[[slide]]` tables that hold them, or of `[[touch]]` tables:
//!
//! ```toml
//! [[touch]]
//! kind = "slide"         # with the keys of a slide
//! specimen = "Saw3"
//! speed = 150
//! hold = 0.5             # pressed on in the middle of the sensor at `approach` mm/s, then at rest for this time, s
//! travel = 20            # lifted off at `lift` mm/s after this way in mm; default: it slides until it has left
//! turn = 0.2             # degrees by which it and its direction turn per mm of path
//! stop = [20, 0.5]       # place on its path in mm, and time in s of a rest there
//! stick = [5, 0.05]      # the same after every 5 mm
//! after = 0.1            # starts this time in s after the first of the touches that it is there with
//! [[touch]]
//! kind = "twist"         # a specimen is pressed on, turns and is lifted off
//! specimen = "Saw3"      # or a shape; its middle is on the sensor's
//! by = 45                # angle in degrees, counterclockwise
//! rate = 90              # degrees per second
//! pivot = [0, 0]         # the point about which it turns, to the right and up, in mm
//! [[touch]]
//! kind = "press"         # or "hold", a long one, or "poke", on one whisker
//! overlap = 3            # of the plate at its lowest, with the middle whisker, in mm
//! approach = 400         # its vertical speed in mm/s
//! lift = 400             # its speed up; default: approach
//! hold = 0.2             # time at its lowest in s; of a "hold" 5
//! tilt = 2               # of the plate in degrees; it is higher in `direction`
//! direction = 90
//! [[touch]]
//! kind = "poke"
//! whisker = [3, 2]       # its row and column
//! ```
//!
//! The tables `[whisker]`, `[light]` and `[sensor]` are [`WhiskerConfig`], [`LightConfig`] and the camera's.

use wstac_core::params::{BASELINE_WINDOWS, DEFAULT_BACKTRACK, DEFAULT_WINDOW, SAMPLE_FRAMES};

use super::keys::within;
use super::light::LightConfig;
use super::sensor::{Fidelity, SensorConfig};
use super::specimen::{Pattern, Specimen};
use super::touch::{Slide, Touch};
use super::touch_table::{
    FileSlide, FileTouch, SceneFile, SlideKeys as _, parsed_direction, parsed_length, parsed_speed,
};
use super::whisker::WhiskerConfig;
use wstac_host::error::{Error, ErrorKind};

/// Scale of all noise: fitted to one number of the paper's table 2, a linear SVM's specimen accuracy of 83 % (SPEC §8).
pub const NOISE: f64 = 0.8;
/// Largest number of dark frames that a key may request.
const MOST_DARK: u32 = 100_000;
const MOST_TOUCHES: usize = 10_000;
/// Default number of dark frames before the first slide.
///
/// It covers the default trigger's baseline, its backtrack, and two windows to spare.
const DEFAULT_LEAD_IN: u32 = BASELINE_WINDOWS * DEFAULT_WINDOW as u32 + DEFAULT_BACKTRACK as u32 + 10;
/// Default number of dark frames between slides: the length of a sample.
pub(crate) const DEFAULT_GAP: u32 = SAMPLE_FRAMES as u32;

/// Every key of a scene's file with its default, and every table of a touch, as `wstac help scene` prints them.
pub const KEYS: &str = include_str!("keys.txt");

/// A checked scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneConfig {
    /// The touches in the order of time: at least one, but none for a [`Skin`](crate::Skin).
    pub touches: Vec<Touch>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Scale of all random deviations from run to run: gain, rubbing, the sensor's noise; 0 for none.
    pub noise: f64,
    /// Dark frames before the first touch.
    pub lead_in: u32,
    /// Dark frames after each touch. Behind the last one there are at least 70.
    pub gap: u32,
    /// The `[whisker]` table.
    pub whisker: WhiskerConfig,
    /// The `[light]` table.
    pub light: LightConfig,
    /// The `[sensor]` table. Dark frames are feature frames: at 60 frames per second, each is two camera frames.
    pub sensor: SensorConfig,
    /// Whether pixels are rendered, or taxel sums are drawn.
    pub fidelity: Fidelity,
}

impl SceneConfig {
    /// Creates the default scene with these touches.
    pub fn new(touches: Vec<Touch>) -> Self {
        Self {
            touches,
            seed: 0,
            lead_in: DEFAULT_LEAD_IN,
            gap: DEFAULT_GAP,
            noise: NOISE,
            whisker: WhiskerConfig::default(),
            light: LightConfig::default(),
            sensor: SensorConfig::default(),
            fidelity: Fidelity::default(),
        }
    }

    /// Reads the short form.
    ///
    /// It is `Saw3@150`, then `,90deg` (any angle) and `,seed=7` in any order, each at most once.
    ///
    /// # Errors
    /// The text is not in the short form; the message names the part, the value found and the values expected.
    pub fn parse_short(text: &str) -> Result<Self, Error> {
        parse_short(text).map_err(|message| Error::new(ErrorKind::Usage, format_args!("scene:{text}"), message))
    }

    /// Reads a script's text; `subject` names its file.
    ///
    /// # Errors
    /// The script is not valid; the message names the key, the value found and the values expected.
    pub fn from_toml(subject: &str, text: &str) -> Result<Self, Error> {
        let file = wstac_host::text_file::from_toml(text);
        file.and_then(check).map_err(|message| Error::new(ErrorKind::Config, subject, message))
    }

    /// Reads a script that is a table of a larger file, `subject`.
    ///
    /// # Errors
    /// [`SceneConfig::from_toml`] would fail.
    pub fn from_table(subject: &str, table: toml::Table) -> Result<Self, Error> {
        of_table(table).and_then(check).map_err(|message| Error::new(ErrorKind::Config, subject, message))
    }

    /// Reads a script without touches, for a [`Skin`](crate::Skin), that is a table of a larger file, `subject`.
    ///
    /// # Errors
    /// A touch is there, or [`SceneConfig::from_table`] would fail with one.
    pub fn from_table_without_touches(subject: &str, table: toml::Table) -> Result<Self, Error> {
        let checked = of_table(table).and_then(|file| {
            let touches = [("[[slide]]", !file.slide.is_empty()), ("[[touch]]", !file.touch.is_empty())];
            let mut keys = touches.into_iter().filter_map(|(key, is_there)| is_there.then_some(key)).chain(file.keys());
            match keys.next() {
                Some(key) => Err(format!("{key} is there; leave it out: the program says what touches")),
                None => check_sensor(file, Vec::new()),
            }
        });
        checked.map_err(|message| Error::new(ErrorKind::Config, subject, message))
    }
}

fn of_table(table: toml::Table) -> Result<SceneFile, String> {
    // Nobody wrote this text, so a line of it is not told.
    let text = table.to_string();
    let without_line = |message: String| message.split_once(": ").map_or(message.clone(), |(_, rest)| rest.to_owned());
    table.try_into().or_else(|_: toml::de::Error| wstac_host::text_file::from_toml(&text).map_err(without_line))
}

fn parse_short(text: &str) -> Result<SceneConfig, String> {
    let mut parts = text.split(',').map(str::trim);
    let what = parts.next().unwrap_or_default();
    let Some((specimen, speed)) = what.split_once('@') else {
        return Err(format!("slide is {what:?}, expected SPECIMEN@SPEED as in Saw3@150, or FILE.toml"));
    };
    // A sphere needs keys that the short form does not have.
    let specimen: Specimen = specimen.parse().map_err(|error: String| error.replace(", or Sphere", ""))?;
    let speed = parsed_speed(speed)?;
    if specimen.pattern == Pattern::Sphere {
        return Err("specimen \"Sphere\" needs a FILE.toml, with overlap_mm under [whisker]".into());
    }
    let (mut direction, mut length, mut seed) = (None, None, None);
    for part in parts {
        let twice = if let Some(degrees) = part.strip_suffix("deg") {
            direction.replace(parsed_direction(degrees)?).map(|_| "direction")
        } else if let Some(mm) = part.strip_suffix("mm").filter(|_| !part.contains('=')) {
            length.replace(parsed_length(mm)?).map(|_| "length")
        } else if let Some(found) = part.strip_prefix("seed=") {
            let expected = |_| format!("seed is {found:?}, expected an integer from 0 to {}", u64::MAX);
            seed.replace(found.parse().map_err(expected)?).map(|_| "seed")
        } else {
            return Err(format!(
                "option is {part:?}, expected an angle as in 90deg, a length as in 60mm, or seed=NUMBER"
            ));
        };
        if let Some(name) = twice {
            return Err(format!("{name} is given twice, expected once"));
        }
    }
    let specimen = Specimen { length_mm: length.unwrap_or(specimen.length_mm), ..specimen };
    let slide = Touch::Slide(Slide::new(specimen, speed, direction.unwrap_or(0.0)));
    Ok(SceneConfig { seed: seed.unwrap_or(0), ..SceneConfig::new(vec![slide]) })
}

fn check(file: SceneFile) -> Result<SceneConfig, String> {
    let numbered = |name: &str, n: usize, message: String| format!("[[{name}]] {n}: {message}");
    let touches = match (&file.slide[..], &file.touch[..]) {
        ([], []) => vec![file.slide().check().map(Touch::Slide)?],
        _ if !file.keys().is_empty() => {
            let name = if file.touch.is_empty() { "slide" } else { "touch" };
            return Err(format!("{} stands beside [[{name}]]; leave one of them out", file.keys().join(", ")));
        }
        (slides, []) => {
            let check = |(n, slide): (usize, &FileSlide)| slide.check().map_err(|e| numbered("slide", n, e));
            (1..).zip(slides).map(check).map(|slide| slide.map(Touch::Slide)).collect::<Result<_, _>>()?
        }
        ([], [first, ..]) if first.after.is_some() => {
            return Err("[[touch]] 1: after is there, expected a touch before it".into());
        }
        ([], touches) => {
            let check =
                |(n, touch): (usize, &FileTouch)| touch.check(&file.whisker).map_err(|e| numbered("touch", n, e));
            (1..).zip(touches).map(check).collect::<Result<Vec<_>, _>>()?
        }
        _ => return Err("[[slide]] stands beside [[touch]]; leave one of them out".into()),
    };
    if touches.len() > MOST_TOUCHES {
        let name = if file.touch.is_empty() { "slide" } else { "touch" };
        return Err(format!("[[{name}]] is there {} times, expected at most {MOST_TOUCHES}", touches.len()));
    }
    check_sensor(file, touches)
}

/// Checks all of a scene's file but its touches.
fn check_sensor(file: SceneFile, touches: Vec<Touch>) -> Result<SceneConfig, String> {
    file.whisker.check().map_err(|message| format!("[whisker] {message}"))?;
    file.light.check().map_err(|message| format!("[light] {message}"))?;
    let SceneFile { whisker, light, sensor, fidelity, .. } = file;
    let slides = touches.iter().filter_map(Touch::slide);
    let spheres = slides.filter(|slide| slide.specimen.pattern == Pattern::Sphere);
    for radius in spheres.map(|slide| slide.specimen.depth_mm) {
        if whisker.overlap_mm > radius {
            let found = whisker.overlap_mm;
            return Err(format!("[whisker] overlap_mm is {found}, expected 0 to a Sphere's radius, {radius}"));
        }
    }
    let script = SceneConfig { whisker, light, sensor, fidelity, ..SceneConfig::new(touches) };
    let seed = file.seed.unwrap_or(0);
    let seed = u64::try_from(seed).map_err(|_| format!("seed is {seed}, expected 0 to {}", i64::MAX))?;
    let noise = file.noise.unwrap_or(script.noise);
    within("noise", noise, 0.0, 100.0)?;
    within("noise of [sensor] times noise", script.sensor.noise * noise, 0.0, 10_000.0)?;
    let lead_in = checked_frames("lead_in", file.lead_in, 0, script.lead_in)?;
    let gap = checked_frames("gap", file.gap, 1, script.gap)?;
    Ok(SceneConfig { seed, noise, lead_in, gap, ..script })
}

fn checked_frames(name: &str, found: Option<i64>, least: u32, default: u32) -> Result<u32, String> {
    let Some(found) = found else { return Ok(default) };
    match u32::try_from(found) {
        Ok(frames) if (least..=MOST_DARK).contains(&frames) => Ok(frames),
        _ => Err(format!("{name} is {found}, expected {least} to {MOST_DARK} frames")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_say_the_same() {
        let short = SceneConfig::parse_short("Saw3@150,seed=7,90deg").unwrap();
        assert_eq!(short, SceneConfig::parse_short("Saw3@150.0, 90deg, seed=7").unwrap());
        let keys = "specimen = \"Saw3\"\nspeed = 150.0\ndirection = 90";
        assert_eq!(short, SceneConfig::from_toml("a", &format!("{keys}\nseed = 7")).unwrap());
        assert_eq!(short, SceneConfig::from_toml("a", &format!("seed = 7\n[[slide]]\n{keys}")).unwrap());
        let two = format!("gap = 71\nlead_in = 3\n[[slide]]\n{keys}\n[[slide]]\nspecimen = \"Fla0\"\nspeed = 99");
        let two = SceneConfig::from_toml("a", &two).unwrap();
        assert_eq!((two.touches.len(), two.gap, two.lead_in, two.seed), (2, 71, 3, 0));
        let slide = two.touches[1].slide().unwrap();
        assert!((slide.direction_deg, slide.speed_mm_s) == (0.0, 99.0));
        let texts = ["specimen = \"Fla0\"\nspeed = 99", "specimen = \"Fla0\"\nspeed = [[0, 99]]\ndirection = -360"];
        let [even, profile] = texts.map(|text| SceneConfig::from_toml("a", text).unwrap().touches[0]);
        let (even, profile) = (*even.slide().unwrap(), *profile.slide().unwrap());
        assert_eq!(Slide { profile: None, ..profile }, even);
        assert_eq!(profile.profile.unwrap().points(), [[0.0, 99.0]]);
    }

    #[test]
    fn a_rod_may_state_its_angle_in_the_picture() {
        for (direction, angle, skew) in
            [(0, 90, 0.0), (90, 0, 0.0), (30, 130, 10.0), (350, 70, -10.0), (0, -100, -10.0)]
        {
            let text = format!("shape = \"rod\"\ndiameter = 5\nspeed = 9\ndirection = {direction}\nangle = {angle}");
            let script = SceneConfig::from_toml("a", &text).unwrap();
            assert!((script.touches[0].slide().unwrap().skew_deg - skew).abs() < 1e-9, "{text}");
        }
    }

    #[test]
    fn touches_that_are_not_slides() {
        let text =
            "[[touch]]\nkind = \"press\"\n[[touch]]\nkind = \"poke\"\nwhisker = [5, 1]\n[[touch]]\nkind = \"hold\"";
        let script = SceneConfig::from_toml("a", text).unwrap();
        assert_eq!(script.touches.iter().map(Touch::kind).collect::<Vec<_>>(), ["press", "poke", "hold"]);
        for (text, part) in [
            ("[[touch]]", "kind"),
            ("[[touch]]\nkind = \"rub\"", "kind is \"rub\", expected slide, press, poke, hold or twist"),
            ("[[touch]]\nkind = \"poke\"", "[[touch]] 1: whisker is missing"),
            ("[[touch]]\nkind = \"poke\"\nwhisker = [0, 1]", "[0, 1]"),
            ("[[touch]]\nkind = \"press\"\nwhisker = [1, 1]", "whisker is there, expected only with kind = \"poke\""),
            ("[[touch]]\nkind = \"press\"\nspeed = 9", "speed is there, expected only with kind = \"slide\""),
            (
                "[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 9\ntilt = 1",
                "tilt is there, expected only with",
            ),
            ("[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 9\ntravel = 1", "travel needs hold"),
            ("[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 9\nhold = 1\nlift = 9", "lift needs travel"),
            (
                "[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 9\nafter = 1",
                "after is there, expected a touch",
            ),
            ("[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 9\nstick = [0, 1]", "stick's distance is 0"),
            (
                "[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 9\nstick = [1, 1]\nstop = [1, 1]",
                "stop and stick exclude each other",
            ),
            ("[[touch]]\nkind = \"slide\"\nspecimen = \"Fla0\"\nspeed = 9\nturn = 2", "turn is 2, expected -1 to 1"),
            ("[[touch]]\nkind = \"twist\"\nspecimen = \"Fla0\"\nrate = 9", "by is missing, expected an angle"),
            ("[[touch]]\nkind = \"twist\"\nspecimen = \"Fla0\"\nby = 9\nrate = 9\nspeed = 9", "speed is there"),
            ("[[touch]]\nkind = \"hold\"\nby = 9", "by is there, expected only with kind = \"twist\""),
            ("[[touch]]\nkind = \"press\"\noverlap = 9", "overlap is 9, expected 0.01 to 4.75"),
            ("speed = 9\n[[touch]]\nkind = \"hold\"", "beside [[touch]]"),
            ("[[slide]]\nspecimen = \"Fla0\"\nspeed = 9\n[[touch]]\nkind = \"hold\"", "beside [[touch]]"),
        ] {
            let message = SceneConfig::from_toml("s.toml", text).unwrap_err().to_string();
            assert!(message.contains(part), "{text:?} gave {message:?}, expected {part:?}");
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, parts) in [
            ("", ["slide is \"\"", "Saw3@150"]),
            ("Saw3", ["slide is \"Saw3\"", "Saw3@150"]),
            ("Saw7@150", ["specimen is \"Saw7\"", "followed by 2, 3 or 4"]),
            ("saw3@150", ["specimen is \"saw3\"", "; did you mean Saw3?"]),
            ("Saw3@150mm/s", ["speed is \"150mm/s\"", "without the unit, as in Saw3@150"]),
            ("Saw3@150,length=80mm", ["option is \"length=80mm\"", "as in 60mm"]),
            ("Saw3@fast", ["speed is \"fast\"", "1 to 1000 mm/s"]),
            ("Saw3@nan", ["speed is \"nan\"", "1 to 1000 mm/s"]),
            ("Saw3@0", ["speed is \"0\"", "1 to 1000 mm/s"]),
            ("Saw3@150,updeg", ["direction is \"up\"", "an angle in degrees"]),
            ("Saw3@150,infdeg", ["direction is \"inf\"", "an angle in degrees"]),
            ("Saw3@150,seed=-1", ["seed is \"-1\"", "expected an integer"]),
            ("Saw3@150,left", ["option is \"left\"", "seed=NUMBER"]),
            ("Saw3@150,0deg,0deg", ["direction is given twice", "once"]),
        ] {
            let message = SceneConfig::parse_short(text).unwrap_err().to_string();
            for part in parts {
                assert!(message.contains(part), "{text:?} gave {message:?}, expected {part:?}");
            }
        }
        for (text, parts) in [
            ("", ["specimen is missing", "Saw3"]),
            ("specimen = \"Saw3\"", ["speed is missing", "mm/s"]),
            ("specimen = 3", ["specimen: found 3", "a text in quotes"]),
            ("specimen = \"Saw3\"\nspeed = \"fast\"", ["speed", "fast"]),
            ("specimen = \"Saw3\"\nspeed = inf", ["speed is inf", "1000"]),
            ("specimen = \"Saw3\"\nspeed = [[0, 9], [0, 10]]", ["speed is [[0.0, 9.0], [0.0, 10.0]]", "rising"]),
            ("specimen = \"Saw3\"\nspeed = 9\nwidth = 0", ["width is 0", "0.1 to 1000"]),
            ("specimen = \"Saw3\"\nspeed = 9\nskew = 90", ["skew is 90", "-60 to 60"]),
            ("specimen = \"Saw3\"\nspeed = 9\n[light]\nweak = [[1, 6, 0.5]]", ["weak has [1, 6]", "1 to 5"]),
            ("specimen = \"Saw3\"\nspeed = 9\ncolor = 1", ["color", "lead_in"]),
            ("specimen = \"Saw3\"\nspeed = 9\nseed = -1", ["seed is -1", "expected 0"]),
            ("specimen = \"Saw3\"\nspeed = 9\ngap = 0", ["gap is 0", "1 to 100000"]),
            ("specimen = \"Saw3\"\nspeed = 9\nlead_in = -1", ["lead_in is -1", "0 to 100000"]),
            ("speed = 9\n[[slide]]\nspeed = 9", ["beside [[slide]]", "leave one of them out"]),
            ("[[slide]]\nspeed = 9", ["[[slide]] 1: specimen is missing", "Saw3"]),
            ("[[slide]", ["TOML", "1"]),
            ("specimen = \"Saw3\"\nspeed = 9\nnoise = -1", ["noise is -1", "0 to 100"]),
            ("specimen = \"Saw3\"\nspeed = 9\nradius = 1", ["radius is 1", "only with Sphere"]),
            ("specimen = \"Fla0\"\nspeed = 9\ndepth = 1", ["depth is 1", "only with Sin, Saw or Tri"]),
            ("shape = \"cone\"\nspeed = 9", ["shape is \"cone\"", "block, rod, ball, coin or corner"]),
            ("shape = \"ball\"\nspeed = 9", ["shape = \"ball\"", "needs diameter, in mm"]),
            ("shape = \"block\"\nspeed = 9", ["shape = \"block\"", "needs width, in mm"]),
            ("shape = \"rod\"\nspeed = 9\ndiameter = 0", ["diameter is 0", "0.1 to 1000"]),
            ("shape = \"coin\"\nspeed = 9\ndiameter = 9\nwidth = 9", ["width is 9", "only with a block or a rod"]),
            (
                "shape = \"rod\"\nspeed = 9\ndiameter = 9\nskew = 1\nangle = 2",
                ["angle and skew", "leave one of them out"],
            ),
            ("shape = \"corner\"\nspeed = 9\nangle = 5", ["angle is 5", "10 to 170"]),
            ("specimen = \"Saw3\"\nspeed = 9\nangle = 90", ["angle is 90", "only with shape = \"corner\" or \"rod\""]),
            (
                "shape = \"ball\"\nspecimen = \"Saw3\"\nspeed = 9\ndiameter = 9",
                ["specimen is \"Saw3\"", "a ball has no texture"],
            ),
            ("specimen = \"Sphere\"\nspeed = 9\nedge = 1", ["edge is 1", "only with a block"]),
            ("specimen = \"Saw3\"\nspeed = 9\nperiod = nan", ["period is NaN", "0.1 to 1000"]),
            ("specimen = \"Saw3\"\nspeed = 9\n[light]\ncrosstalk = 1", ["crosstalk is 1", "0 to 0.25"]),
            ("specimen = \"Saw3\"\nspeed = 9\n[light]\ndecay = 2", ["[light] decay is 2", "0 to 1"]),
            ("specimen = \"Saw3\"\nspeed = 9\n[light]\nleak = 2", ["[light] leak is 2", "0 to 1"]),
            ("specimen = \"Saw3\"\nspeed = 9\n[whisker]\noverlap_mm = 5", ["[whisker] overlap_mm is 5", "0 to 4.75"]),
            ("specimen = \"Saw3\"\nspeed = 9\n[whisker]\nrelaxation_ms = 1e-9", ["relaxation_ms is", "1000, or 0"]),
            ("specimen = \"Saw3\"\nspeed = 9\n[whisker]\nbeam = \"stiff\"", ["stiff", "elastica"]),
        ] {
            let message = SceneConfig::from_toml("s.toml", text).unwrap_err().to_string();
            for part in ["s.toml"].into_iter().chain(parts) {
                assert!(message.contains(part), "{text:?} gave {message:?}, expected {part:?}");
            }
        }
    }
}
