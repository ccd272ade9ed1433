//! `wstac scene` renders and explains simulated sensors.

mod explain;
mod render;
mod strain;

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;

use clap::Subcommand;

use super::output::Stop;

/// Render or explain a simulated sensor, or print whisker strain
///
/// A scene is a simulated sensor: a specimen slides over 25 whiskers, their bases glow, and a camera records them.
/// wstac run scene:… reads a scene like a camera.
#[derive(Debug, clap::Args)]
#[command(after_long_help = KEYS)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Arguments),
    Explain(explain::Arguments),
    Strain(strain::Arguments),
}

/// Every key of a scene file with its default.
pub(super) const KEYS: &str = r#"A scene's file (scene:FILE.toml). Every key but the first two is
optional; these are the defaults:

  specimen = "Saw3"      # Fla0, Sphere, or Sin, Saw or Tri with a depth
                         # of 2, 3 or 4 mm
  speed = 150            # mm/s, 1 to 1000; or up to 8 points of the
                         # path: [[0, 80], [40, 200]] for 80 mm/s
                         # at 0 mm and 200 mm/s at 40 mm
  direction = 0          # degrees, any: 0 is right, 90 up
  depth = 3              # depth of the texture in mm, instead of
                         # the name's
  period = 6             # period of the texture in mm; by default
                         # twice the depth
  length = 104.5         # length of the block in mm, fitted to the
                         # paper's speed law
  edge = 72              # slope of the block's ends in degrees;
                         # 90 is upright
  #width = 12            # width of the block across its motion in mm;
                         # by default wider than the sensor
  offset = 0             # distance of the block's middle to the left
                         # of its path in mm
  skew = 0               # angle of edges and texture against the
                         # motion in degrees, -60 to 60; of a shape
                         # -180 to 180
  #shape = "block"       # outline: a rectangle of length and width
                         # that turns with skew; or "corner", "rod",
                         # "ball" or "coin"; a rod without a width
                         # has no end
  #diameter = 8          # diameter of a rod, ball or coin in mm
  #angle = 90            # angle between a corner's edges in degrees;
                         # of a rod, its own in the picture, instead
                         # of skew
  #radius = 0.5          # radius of a Sphere in mm, instead of depth,
                         # period, length and edge
  seed = 0               # seed of all random numbers: the same seed
                         # gives the same bytes on every machine
  noise = 0.8            # scale of all random deviations
                         # (fluctuation, run_deviation, noise of
                         # pixels), fitted to one published number
                         # (table 2); 0 for none
  lead_in = 45           # dark frames before the first touch
  gap = 70               # dark frames after each touch
  fidelity = "rendered"  # or "taxel": taxel sums from their
                         # distribution, without pixels
  [whisker]
  beam = "elastica"      # law of bending; or "linear"
  length_mm = 5
  diameter_mm = 1
  pitch_mm = 4
  dome_degrees = 30      # angle of the cap that carries the whiskers;
                         # 0 for a plane
  overlap_mm = 3         # overlap of the crests with the middle
                         # whisker; at most the radius of a Sphere
  relaxation_ms = 2      # time in which a released whisker springs
                         # back, from 0.001; 0 if it is immediate
  present = "all"        # or "middle": one whisker
  [light]                # a full scale is the light of a taxel whose
                         # pixels are all at full scale
  flash_ms = 11          # light of bending by a strain of 1, in full
                         # scales · ms
  rubbing_ms = 0.01      # light of rubbing (friction) over 1 mm under a
                         # load P L²/EI of 1; 0 for none
  fluctuation = 0.5      # deviation of the rubbing, as a fraction
  fluctuation_mm = 1     # correlation length of the fluctuation
  afterglow_ms = 44.5    # time in which light fades to 1/e, fitted to
                         # the paper's speed law; 0 for none
  gain_deviation = 0.05  # deviation of the whiskers' gains, as a
                         # fraction of the gain
  unit = 0               # number of the sensor: each sensor has its
                         # own gains
  run_deviation = 0.1    # deviation of the gain from slide to slide,
                         # as a fraction of the gain
  leak = 0               # ambient light, as a fraction of full scale
  leak_per_minute = 0    # growth of the leak per minute
  drift_per_minute = 0   # growth of all light per minute, as a
                         # fraction of the light
  crosstalk = 0          # light of a base that is seen at each of the
                         # four beside it, as a fraction
  decay = 0              # fraction of light lost per touch
  dead = []              # whiskers without light, as [row, column],
                         # each 1 to 5
  weak = []              # weak whiskers, as [row, column, gain], the
                         # gain from 0 to 1
  [sensor]
  size = [1280, 720]
  fps = 30
  format = "GREY"        # or another four-character code, such as YUYV,
                         # NV12, RGB3, BG10, MJPG
  matrix = "bt601"       # matrix of YCbCr; or "bt709"
  range = "limited"      # range of YCbCr; or "full"
  quality = 85           # quality of MJPG, 1 to 100
  readout_ms = 0         # rolling shutter: time from the first to the
                         # last row; below 0 if the last comes first
  exposure = 1.0         # fraction of the frame time during which
                         # the shutter is open
  full_well = 25500      # electrons at full scale, at a gain of 1
  read_noise = 60        # electrons
  black_level = 1.0      # in 1/255 of full scale
  gain = 1.0
  blur = 0               # deviation of the point spread, in pixels
  noise = 1.0            # scale of the noise of pixels
  dropped = 0            # fraction of frames that the driver loses
  auto_exposure = false  # in the dark, the camera slows down to a
                         # quarter of its rate
  #[sensor.pose]         # a camera that does not look straight on;
                         # every pixel of a frame is computed then
  #rotation_degrees = 0  # rotation of the picture, counterclockwise
  #tilt_degrees = [0, 0] # tilt of the camera: right side further away,
                         # then lower side further away
  #curvature = 0         # distortion by the lens: below 0 barrel,
                         # above 0 pincushion, -0.15 to 0.15
  #shift = [0, 0]        # shift right and down, in fractions of the
                         # picture's shorter side
  #scale = 1             # scale of the picture
  #uneven = 1            # brightness of the brightest side, divided by
                         # that of the darkest side
  #uneven_degrees = 0    # direction of the brightest side: 0 is right,
                         # 90 is up

Several slides: any number of [[slide]] tables with the keys from
specimen to radius. Other touches: any number of [[touch]] tables.

  [[touch]]
  kind = "slide"         # with the keys of a slide
  specimen = "Saw3"
  speed = 150
  #hold = 0.5            # pressed on, then still for this time in s
  #travel = 20           # then lifted off after this way in mm
  #turn = 0.2            # degrees it turns per mm of path, -1 to 1
  #stop = [20, 0.5]      # after 20 mm it rests for 0.5 s
  #stick = [5, 0.05]     # the same after every 5 mm
  #after = 0.1           # starts s after the touch before it
                         # started, with it on the sensor
  [[touch]]
  kind = "press"         # a plate on all whiskers
  overlap = 3            # its overlap with the middle whisker at its
                         # lowest in mm; by default overlap_mm
  approach = 400         # its vertical speed in mm/s
  hold = 0.2             # time at its lowest in s
  tilt = 0               # its angle in degrees; it is higher in
  direction = 0          # this direction
  [[touch]]
  kind = "twist"         # a specimen or shape is pressed on, turns
  specimen = "Saw3"      # and is lifted off
  by = 45                # angle in degrees
  rate = 90              # degrees per second
  pivot = [0, 0]         # mm to the right, mm up
  hold = 0.2             # time in which it rests before it turns in s
  [[touch]]
  kind = "hold"          # a press whose hold is 5 by default
  [[touch]]
  kind = "poke"          # a tip on one whisker
  whisker = [3, 3]       # its row and column
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    match &arguments.command {
        Command::Render(arguments) => render::run(arguments),
        Command::Explain(arguments) => explain::run(arguments),
        Command::Strain(arguments) => strain::run(arguments),
    }
}

/// Returns the name of a scene without `scene:`.
fn named(scene: &OsStr) -> &OsStr {
    scene.as_bytes().strip_prefix(b"scene:").map_or(scene, OsStr::from_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_scene::SceneConfig;

    #[test]
    fn examples_can_be_pasted_from_a_narrow_terminal() {
        // Lines of a configuration are printed two columns further to the right.
        for line in KEYS.lines().chain(wstac_host::config::DEFAULT_CONFIGURATION.lines()) {
            assert!(line.chars().count() <= 72, "{line}");
        }
    }

    #[test]
    fn the_defaults_in_the_help_are_the_defaults() {
        let lines = KEYS.lines().skip_while(|line| !line.starts_with("  specimen"));
        let text: String =
            lines.take_while(|line| !line.starts_with("Several")).fold(String::new(), |text, line| text + line + "\n");
        let expected = SceneConfig::parse_short("Saw3@150").unwrap();
        assert_eq!(SceneConfig::from_toml("help", &text).unwrap(), expected);
        // The test counts the keys, because a missing key would have its default and go unnoticed.
        assert_eq!(text.lines().filter(|line| line.contains(" = ")).count(), 17 + 2 + 8 + 15 + 16 + 7);
    }

    #[test]
    fn the_touches_in_the_help_are_read() {
        let text: String = KEYS
            .lines()
            .skip_while(|line| !line.starts_with("  [[touch]]"))
            .fold(String::new(), |text, line| text + line + "\n");
        let scene = SceneConfig::from_toml("help", &text).unwrap();
        let kinds: Vec<_> = scene.touches.iter().map(wstac_scene::Touch::kind).collect();
        assert_eq!(kinds, ["slide", "press", "twist", "hold", "poke"]);
        // What the help states of a touch is its default, except for what a twist must have.
        for key in ["overlap = 3 ", "approach = ", "hold = 0.2 ", "tilt = ", "direction = ", "pivot = "] {
            let found = text.lines().filter(|line| line.starts_with(&format!("  {key}"))).count();
            assert_eq!(found, if key.starts_with("hold") { 2 } else { 1 }, "{key}");
            let without = text.lines().filter(|line| !line.starts_with(&format!("  {key}")));
            let without = SceneConfig::from_toml("help", &without.collect::<Vec<_>>().join("\n")).unwrap();
            assert_eq!(without, scene, "{key}");
        }
    }
}
