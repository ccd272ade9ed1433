//! Gains of whiskers: slides over all of them tell how bright each is beside the others.
//!
//! [`GainsWatch`] takes the frames: the first 25 are untouched, then a block with saw teeth slides over all whiskers, a few
//! times. Light adds up over a slide. Divided by that of a whisker at its place in the simulated sensor, by which models were
//! trained, and by the median of all, it is the gain.

use wstac_core::green::any::Any;
use wstac_core::params::{COLUMNS, ROWS, TAXELS};
use wstac_core::taxels::FrameGeometry;
use wstac_host::error::Error;
use wstac_host::source::SourceEvent;

use crate::calibrate::named;
use crate::light::{LightAboveDark, with_layout_key};

/// Least light of a touch, in standard deviations of the untouched light.
const LEAST_LIGHT: f64 = 50.0;
/// Dark frames that end a touch.
const DARK_FRAMES: u32 = 5;
/// Least light of a whisker, as a fraction of the median: others are dead. A slide has at most two dead ones.
const LEAST: f64 = 0.05;
const MOST_DEAD: usize = 2;
/// Logarithm of the light of a saw block by the square of the distance from the middle, in pitches: its differences are the
/// same for teeth of 2 to 4 mm, at any speed, in any direction (by simulation: a dome lowers outer whiskers).
const OF_SAW: [(usize, f64); 6] = [(0, 0.349), (1, 0.256), (2, 0.169), (4, 0.0), (5, -0.084), (8, -0.346)];
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
                "found {slides} slides over all whiskers without lost frames, expected {LEAST_SLIDES} or more, behind 25 untouched frames"
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

/// Returns the logarithm of each whisker's gain by its light over a slide, `None` of a dead one; `None` if too many are.
fn logarithms(sums: &[f64; TAXELS]) -> Option<[Option<f64>; TAXELS]> {
    let median = |mut numbers: Vec<f64>| {
        numbers.sort_by(f64::total_cmp);
        numbers.get(numbers.len() / 2).copied()
    };
    let least = LEAST * median(sums.to_vec())?;
    let gains: [Option<f64>; TAXELS] = core::array::from_fn(|taxel| {
        let [row, column] = [(taxel / COLUMNS).abs_diff(ROWS / 2), (taxel % COLUMNS).abs_diff(COLUMNS / 2)];
        let (_, expected) = OF_SAW.iter().find(|(squared, _)| *squared == row * row + column * column)?;
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
