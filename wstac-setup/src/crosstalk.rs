//! Cross-talk between taxels: touches of one whisker at a time tell how much of its light each other taxel sees.
//!
//! [`CrosstalkWatch`] takes the frames: the first 25 are untouched, then each whisker is touched alone with a thin tip,
//! in any order. While one taxel is brighter than twice each other one, the light of the others is taken for its
//! whisker's. The slope of a line through the untouched light, by least squares, is the fraction.

use std::fmt::Write;

use wstac_core::green::any::Any;
use wstac_core::params::TAXELS;
use wstac_core::taxels::FrameGeometry;

use crate::calibrate::{UNTOUCHED, named};
use crate::light::{LightAboveDark, with_layout_key};
use wstac_host::error::Error;
use wstac_host::source::SourceEvent;

/// Largest fraction of the brightest taxel's light that another may have while one whisker is touched.
const MOST_BESIDE: f64 = 0.5;
/// Least light of a touch, in standard deviations of the untouched light, and as a fraction of full scale.
const LEAST_LIGHT: [f64; 2] = [50.0, 0.002];
/// Largest standard deviation of the untouched light, as a fraction of full scale.
const MOST_NOISE: f64 = 0.01;
/// Fewest frames of a whisker, and the largest standard deviation of its fractions.
const LEAST_FRAMES: u32 = 3;
const MOST_SD: f64 = 0.005;
/// Least fraction that is no noise, in standard deviations.
const LEAST_SURE: f64 = 3.0;
/// Largest distance from the line, as a fraction of the whisker's light (root mean square): other whiskers are off it.
const MOST_OFF: f64 = 0.03;

/// Light of whiskers that are touched one at a time.
#[derive(Clone, Debug)]
pub struct CrosstalkWatch {
    light: LightAboveDark,
    /// By whisker: the frames in which it is touched alone, and sums over them.
    touched: [Touched; TAXELS],
}

#[derive(Clone, Copy, Debug, Default)]
struct Touched {
    frames: u32,
    /// Sums over frames: each taxel's light times the whisker's, and squares.
    products: [f64; TAXELS],
    squares: [f64; TAXELS],
}

/// The cross-talk of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Crosstalk {
    /// A row for each taxel: the light of each whisker that it sees, as a fraction of what the whisker's own taxel
    /// sees.
    pub matrix: [[f64; TAXELS]; TAXELS],
    /// The largest fraction that is not a taxel's own, with its taxel and whisker.
    pub largest: (f64, usize, usize),
}

impl Touched {
    /// Returns the fraction of a whisker's light that a taxel sees, its standard deviation, and the distance from the
    /// line.
    fn fraction(&self, whisker: usize, taxel: usize, noise: f64) -> [f64; 3] {
        let own = self.squares[whisker];
        let fraction = self.products[taxel] / own;
        let rest = (self.squares[taxel] - fraction * self.products[taxel]).max(0.0);
        let variance = (rest / f64::from(self.frames - 1)).max(noise * noise);
        [fraction, (variance / own).sqrt(), (rest / own).sqrt()]
    }

    /// Returns the largest standard deviation and distance of a whisker's fractions; infinite with too few frames.
    fn worst(&self, whisker: usize, noise: f64) -> [f64; 2] {
        if self.frames < LEAST_FRAMES {
            return [f64::INFINITY; 2];
        }
        let others = (0..TAXELS).filter(|taxel| *taxel != whisker).map(|taxel| self.fraction(whisker, taxel, noise));
        others.fold([0.0; 2], |[sd, off]: [f64; 2], [_, other_sd, other_off]| [sd.max(other_sd), off.max(other_off)])
    }
}

impl CrosstalkWatch {
    /// Creates a watch through the layout of this geometry, before the first frame.
    pub fn new(geometry: FrameGeometry<Any>) -> Self {
        Self { light: LightAboveDark::new(geometry), touched: [Touched::default(); TAXELS] }
    }

    /// Takes an event of the source. Returns the taxel of a whisker whose light is enough from this frame on.
    pub fn take(&mut self, event: &SourceEvent<'_>) -> Option<usize> {
        let light = self.light.take(event)?;
        let own = (0..TAXELS).max_by(|a, b| light[*a].total_cmp(&light[*b]))?;
        let is_alone = (0..TAXELS).all(|taxel| taxel == own || light[taxel] <= MOST_BESIDE * light[own]);
        if !is_alone || light[own] < (LEAST_LIGHT[0] * self.light.noise()).max(LEAST_LIGHT[1]) {
            return None;
        }
        let was_enough = self.is_enough(own);
        let touched = &mut self.touched[own];
        touched.frames += 1;
        for (taxel, of) in light.iter().enumerate() {
            touched.products[taxel] += of * light[own];
            touched.squares[taxel] += of * of;
        }
        (!was_enough && self.is_enough(own)).then_some(own)
    }

    fn is_enough(&self, whisker: usize) -> bool {
        self.touched[whisker].worst(whisker, self.light.noise())[0] <= MOST_SD
    }

    /// Returns the cross-talk of all frames so far.
    ///
    /// # Errors
    /// The first frames were touched, or whiskers have too little light, or were not touched alone. The message names
    /// them.
    pub fn crosstalk(&self) -> Result<Crosstalk, String> {
        if self.light.untouched() < UNTOUCHED || self.light.noise() > MOST_NOISE {
            return Err(format!(
                "expected {UNTOUCHED} untouched frames first, found {}, or a touch in them",
                self.light.untouched()
            ));
        }
        let names =
            |is_it: &dyn Fn(usize) -> bool| -> Vec<String> { (0..TAXELS).filter(|at| is_it(*at)).map(named).collect() };
        let worst = |whisker: usize| self.touched[whisker].worst(whisker, self.light.noise());
        // Infinite is no distance, but of a whisker with too few frames.
        let mixed = names(&|whisker| worst(whisker)[1].is_finite() && worst(whisker)[1] > MOST_OFF);
        if !mixed.is_empty() {
            return Err(format!(
                "light beside {} does not follow its own, expected a touch of each whisker alone in a room of even light",
                mixed.join("; ")
            ));
        }
        let dim = names(&|whisker| worst(whisker)[0] > MOST_SD);
        if !dim.is_empty() {
            return Err(format!(
                "{} of 25 whiskers have too little light ({}), expected a touch of each whisker alone",
                dim.len(),
                dim.join("; ")
            ));
        }
        let mut found = Crosstalk { matrix: [[0.0; TAXELS]; TAXELS], largest: (0.0, 0, 0) };
        for (taxel, row) in found.matrix.iter_mut().enumerate() {
            for (whisker, share) in row.iter_mut().enumerate() {
                let [fraction, sd, _] = self.touched[whisker].fraction(whisker, taxel, self.light.noise());
                // Values that noise can cause are left out: negative ones are, so noise of far taxels would add up.
                let sure = if fraction > LEAST_SURE * sd { (fraction * 1e4).round() / 1e4 } else { 0.0 };
                *share = if taxel == whisker { 1.0 } else { sure };
                if taxel != whisker && *share > found.largest.0 {
                    found.largest = (*share, taxel, whisker);
                }
            }
        }
        Ok(found)
    }
}

impl Crosstalk {
    /// Returns the text of a configuration with this as `crosstalk` of `[layout]`, and nothing else changed.
    ///
    /// # Errors
    /// The text cannot be changed by lines, or sensors with so much cross-talk cannot be corrected.
    pub fn written_to(&self, text: &str) -> Result<String, Error> {
        let mut key = "crosstalk = [\n".to_owned();
        for row in self.matrix {
            let numbers: Vec<_> = row.iter().map(f64::to_string).collect();
            // Writing to a string does not fail.
            let _ = writeln!(key, "    [{}],", numbers.join(", "));
        }
        key += "]\n";
        with_layout_key(text, "crosstalk", &key)
    }
}

impl std::fmt::Display for Crosstalk {
    /// Writes one line: the largest fraction, and between which taxel and whisker it is.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (share, taxel, whisker) = self.largest;
        let (taxel, whisker) = (named(taxel), named(whisker));
        write!(
            f,
            "the largest cross-talk is {:.1} %: the taxel in {taxel} sees it of the whisker in {whisker}",
            100.0 * share
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_host::config::Config;
    use wstac_host::error::ErrorKind;
    use wstac_host::source::Source;
    use wstac_scene::SceneConfig;
    use wstac_scene::source::SceneSource;

    /// Returns a watch that has seen a scene of pokes of these whiskers, with more keys.
    fn poked(whiskers: impl IntoIterator<Item = usize>, keys: &str) -> CrosstalkWatch {
        let poke = |at: usize| format!("[[touch]]\nkind = \"poke\"\nwhisker = [{}, {}]\n", at / 5 + 1, at % 5 + 1);
        let pokes: String = whiskers.into_iter().map(poke).collect();
        let script =
            SceneConfig::from_toml("pokes", &format!("gap = 10\nfidelity = \"taxel\"\n{keys}\n{pokes}")).unwrap();
        let mut source = SceneSource::new(&script).unwrap();
        let mut watch = CrosstalkWatch::new(Config::default().geometry(source.info()).unwrap());
        loop {
            match source.next_event().unwrap() {
                SourceEvent::End => return watch,
                event => _ = watch.take(&event),
            }
        }
    }

    #[test]
    fn pokes_tell_the_cross_talk() {
        for share in [0.0, 0.05, 0.15] {
            let watch = poked((0..TAXELS).rev(), &format!("[light]\ncrosstalk = {share}\nleak = 0.02"));
            let found = watch.crosstalk().unwrap();
            for (taxel, row) in found.matrix.iter().enumerate() {
                for (whisker, found) in row.iter().enumerate() {
                    let far = (taxel / 5).abs_diff(whisker / 5) + (taxel % 5).abs_diff(whisker % 5);
                    let truth = [1.0, share, 0.0][far.min(2)];
                    assert!((found - truth).abs() < 0.003, "taxel {taxel} of {whisker}: {found}, expected {truth}");
                }
            }
            assert!((found.largest.0 - share).abs() < 0.003, "{found}");
            let text = found.written_to("").unwrap();
            assert!(Config::parse(&text).unwrap().layout.correction().is_some(), "{text}");
        }
    }

    #[test]
    fn what_is_not_touched_alone_is_named() {
        let error = |watch: CrosstalkWatch| watch.crosstalk().unwrap_err();
        let without = error(poked((0..TAXELS).filter(|whisker| *whisker != 11), ""));
        assert_eq!(
            without,
            "1 of 25 whiskers have too little light (row 3, column 2), expected a touch of each whisker alone"
        );
        let press = error(poked([], "[[touch]]\nkind = \"press\""));
        assert!(press.starts_with("25 of 25 whiskers have too little light (row 1, column 1; "), "{press}");
        // A ball along a row lights one whisker after the other, but not alone.
        let rod = "[[touch]]\nkind = \"slide\"\nshape = \"ball\"\ndiameter = 6\nspeed = 60\n";
        let mixed = error(poked(0..TAXELS, rod));
        assert!(mixed.starts_with("light beside row 3, column "), "{mixed}");
        let drifting = error(poked(0..TAXELS, "[light]\nleak_per_minute = 0.05"));
        assert!(drifting.contains("does not follow its own"), "{drifting}");
        let early = error(poked(0..TAXELS, "lead_in = 3"));
        assert!(early.contains("25 untouched frames first"), "{early}");
        let none = CrosstalkWatch::new(*poked([0], "").light.camera());
        assert_eq!(error(none), "expected 25 untouched frames first, found 0, or a touch in them");
    }

    #[test]
    fn only_the_key_of_a_configuration_is_changed() {
        let mut found = Crosstalk { matrix: [[0.0; TAXELS]; TAXELS], largest: (0.0, 0, 0) };
        (0..TAXELS).for_each(|at| found.matrix[at][at] = 1.0);
        found.matrix[1][0] = 0.0521;
        let layout = "# mine\n[layout] # places\npreset = \"paper\"\n\n[sensor]\npitch_mm = 3.5 # measured\n";
        let once = found.written_to(layout).unwrap();
        assert!(once.contains("    [0.0521, 1, 0, "), "{once}");
        assert!(once.ends_with("[sensor]\npitch_mm = 3.5 # measured\n"), "{once}");
        let lines: Vec<_> = once.lines().collect();
        assert_eq!(lines.len(), layout.lines().count() + 27);
        assert!(layout.lines().all(|line| lines.contains(&line)));
        found.matrix[1][0] = 0.07;
        assert_eq!(found.written_to(&once).unwrap(), once.replace("0.0521", "0.07"));
        assert!(found.written_to("[sensor]\npitch_mm = 3.5").unwrap().contains("3.5\n\n[layout]\ncrosstalk = ["));
        // A table that has no line of its own.
        assert_eq!(found.written_to("layout.preset = \"paper\"").unwrap_err().kind(), ErrorKind::Config);
        found.matrix[1][0] = 0.6;
        assert!(found.written_to(layout).unwrap_err().message().contains("crosstalk[1][0] is 0.6, expected 0 to 0.5"));
    }
}
