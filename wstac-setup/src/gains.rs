//! Gains of whiskers: slides over all of them tell how bright each is beside the others.
//!
//! [`GainsWatch`] takes the frames: the first 25 are untouched, then a block with teeth of 4 mm slides over all
//! whiskers, a few times. Light adds up over a slide. Divided by that of a whisker at its place in the simulated
//! sensor, by which models were trained, and by the median of all, it is the gain.

use wstac_core::green::any::Any;
use wstac_core::params::{COLUMNS, ROWS, TAXELS};
use wstac_core::taxels::FrameGeometry;
use wstac_host::error::Error;
use wstac_host::source::SourceEvent;
use wstac_host::statistics::median;

use crate::calibrate::named;
use crate::light::{LightAboveDark, with_layout_key};

/// Least light of a touch, in standard deviations of the untouched light.
const LEAST_LIGHT: f64 = 50.0;
/// Dark frames that end a touch.
const DARK_FRAMES: u32 = 5;
/// Least light of a whisker, as a fraction of the median: others are dead. A slide has at most two dead ones.
const LEAST: f64 = 0.05;
const MOST_DEAD: usize = 2;
/// Logarithm of a whisker's light by the square of its distance from the middle, in pitches, for teeth of 4 mm: its
/// differences are the same for all patterns, at any speed, in any direction (by simulation: a dome lowers outer
/// whiskers).
const OF_DEEP: [(usize, f64); 6] = [(0, 0.349), (1, 0.256), (2, 0.169), (4, 0.0), (5, -0.084), (8, -0.346)];
/// Fewest slides, and the largest standard deviation of a gain as a fraction.
const LEAST_SLIDES: usize = 3;
const MOST_SD: f64 = 0.02;

/// Light of slides over all whiskers.
#[derive(Clone, Debug)]
pub struct GainsWatch {
    light: LightAboveDark,
    /// The light of each whisker over the touch that is under way, and dark frames since.
    sums: [f64; TAXELS],
    dark: u32,
    has_lost: bool,
    /// By slide: the logarithm of each whisker's gain; `None` of a dead one.
    slides: Vec<[Option<f64>; TAXELS]>,
}

impl GainsWatch {
    /// Creates a watch through the layout of this geometry, before the first frame.
    pub fn new(geometry: FrameGeometry<Any>) -> Self {
        let light = LightAboveDark::new(geometry);
        Self { light, sums: [0.0; TAXELS], dark: 0, has_lost: false, slides: Vec::new() }
    }

    /// Takes an event of the source. Returns the number of slides if one has just ended.
    pub fn take(&mut self, event: &SourceEvent<'_>) -> Option<usize> {
        self.has_lost |= matches!(event, SourceEvent::Lost { .. });
        let light = self.light.take(event)?;
        if light.iter().any(|light| *light > LEAST_LIGHT * self.light.noise()) {
            self.dark = 0;
            self.sums.iter_mut().zip(light).for_each(|(sum, light)| *sum += light);
            return None;
        }
        self.dark += 1;
        (self.dark == DARK_FRAMES && self.end_touch()).then_some(self.slides.len())
    }

    /// Ends a touch. Returns whether it is a slide over all whiskers.
    fn end_touch(&mut self) -> bool {
        let gains = logarithms(&core::mem::replace(&mut self.sums, [0.0; TAXELS]));
        let gains = gains.filter(|_| !core::mem::take(&mut self.has_lost));
        self.slides.extend(gains);
        gains.is_some()
    }

    /// Returns the gain of each whisker over all slides so far; 1 of a dead one.
    ///
    /// # Errors
    /// There are fewer than three slides, or they do not agree. The message says so.
    pub fn gains(&self) -> Result<[f64; TAXELS], String> {
        let slides = self.slides.len();
        if slides < LEAST_SLIDES {
            return Err(format!(
                "found {slides} slides over all whiskers without lost frames, expected {LEAST_SLIDES} or more, \
                 behind 25 untouched frames"
            ));
        }
        let mut gains = [1.0; TAXELS];
        for (taxel, gain) in gains.iter_mut().enumerate() {
            let found: Vec<f64> = self.slides.iter().filter_map(|slide| slide[taxel]).collect();
            if found.len() < slides {
                continue;
            }
            let (count, mean) = (slides as f64, found.iter().sum::<f64>() / slides as f64);
            let squares: f64 = found.iter().map(|one| (one - mean).powi(2)).sum();
            let sd = (squares / (count - 1.0) / count).sqrt();
            if sd > MOST_SD {
                let message = "slides do not agree about the whisker in";
                return Err(format!("{message} {}: expected more slides over all whiskers", named(taxel)));
            }
            *gain = (1e3 * mean.exp()).round() / 1e3;
        }
        Ok(gains)
    }
}

/// Returns the logarithm of each whisker's gain by its light over a slide, `None` of a dead one; `None` if too many are
/// dead.
fn logarithms(sums: &[f64; TAXELS]) -> Option<[Option<f64>; TAXELS]> {
    let least = LEAST * median(sums.to_vec())?;
    let gains: [Option<f64>; TAXELS] = core::array::from_fn(|taxel| {
        let [row, column] = [(taxel / COLUMNS).abs_diff(ROWS / 2), (taxel % COLUMNS).abs_diff(COLUMNS / 2)];
        let (_, expected) = OF_DEEP.iter().find(|(squared, _)| *squared == row * row + column * column)?;
        (sums[taxel] > least.max(f64::MIN_POSITIVE)).then(|| sums[taxel].ln() - expected)
    });
    let middle = median(gains.into_iter().flatten().collect())?;
    let is_slide = gains.iter().flatten().count() + MOST_DEAD >= TAXELS;
    is_slide.then(|| gains.map(|gain| gain.map(|gain| gain - middle)))
}

/// Returns the text of a configuration with these as `gains` of `[layout]`, and nothing else changed.
///
/// # Errors
/// The text cannot be changed by lines.
pub fn written_to(gains: &[f64; TAXELS], text: &str) -> Result<String, Error> {
    let rows: Vec<String> = gains
        .chunks(COLUMNS)
        .map(|row| format!("    {},\n", row.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")))
        .collect();
    with_layout_key(text, "gains", &format!("gains = [\n{}]\n", rows.concat()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_host::config::Config;
    use wstac_host::source::Source;
    use wstac_scene::SceneConfig;
    use wstac_scene::source::SceneSource;

    /// Returns a watch that has seen a scene of these touches.
    fn watched(touches: &str, keys: &str) -> GainsWatch {
        let text = format!("lead_in = 27\nfidelity = \"taxel\"\n{keys}\n{touches}");
        let mut source = SceneSource::new(&SceneConfig::from_toml("slides", &text).unwrap()).unwrap();
        let mut watch = GainsWatch::new(Config::default().geometry(source.info()).unwrap());
        let mut ends = Vec::new();
        loop {
            let event = source.next_event().unwrap();
            if matches!(event, SourceEvent::End) {
                break;
            }
            ends.extend(watch.take(&event));
        }
        assert!(ends.iter().copied().eq(1..=watch.slides.len()), "{ends:?}");
        watch
    }

    fn slides(specimens: &[&str]) -> String {
        let one = |(number, specimen): (usize, &&str)| {
            let (speed, direction) = (60 + 25 * number, 100 * number);
            format!(
                "[[touch]]\nkind = \"slide\"\nspecimen = \"{specimen}\"\nspeed = {speed}\ndirection = {direction}\n"
            )
        };
        specimens.iter().enumerate().map(one).collect()
    }

    #[test]
    fn gains_are_those_of_the_sensor() {
        let even = watched(&slides(&["Saw4", "Sin4", "Tri4"]), "[light]\ngain_deviation = 0").gains().unwrap();
        assert!(even.iter().all(|gain| (gain - 1.0).abs() < 0.01), "the table is that of the scene: {even:?}");
        let keys = "[light]\ngain_deviation = 0\nweak = [[2, 3, 0.15], [5, 5, 0.6]]\ndead = [[4, 1]]";
        let found = watched(&slides(&["Saw4"; 3]), keys).gains().unwrap();
        for (taxel, gain) in found.into_iter().enumerate() {
            let expected =
                [(7, 0.15), (24, 0.6)].iter().find(|(weak, _)| *weak == taxel).map_or(1.0, |(_, gain)| *gain);
            assert!((gain / expected - 1.0).abs() < 0.02, "{taxel}: {gain}, expected {expected}");
        }
        let text = written_to(&found, "[layout]\npreset = \"paper\"\ngains = [1.5]\n# more\n").unwrap();
        assert!(text.starts_with("[layout]\ngains = [\n") && text.ends_with("preset = \"paper\"\n# more\n"), "{text}");
        assert!(Config::parse(&text).unwrap().layout.correction().is_some());
    }

    #[test]
    fn touches_that_tell_no_gains_are_refused() {
        let poke = "[[touch]]\nkind = \"poke\"\nwhisker = [3, 3]\n";
        for (touches, says) in [
            (slides(&["Saw4"; 2]), "found 2 slides"),
            (format!("{poke}{poke}{}", slides(&["Saw4"; 2])), "found 2 slides"),
            (slides(&["Sin2", "Saw4", "Saw3"]), "do not agree about the whisker in row"),
        ] {
            let refusal = watched(&touches, "").gains().unwrap_err();
            assert!(refusal.contains(says), "{refusal}, expected {says}");
        }
    }
}
