//! A plan of a guided session: the slides, each a recording of its own.
//!
//! ```toml
//! specimens = ["Saw3", "Fla0"]  # what is slid over the sensor
//! speeds = [100, 150]           # mm/s; without it, speed is no label
//! directions = [0, 90]          # whole degrees; without it, direction is no label
//! count = 10                    # slides of every combination; default 10
//! ```

use std::path::Path;

use serde::Deserialize;

use crate::error::{Error, ErrorKind};
use crate::source::Labels;

/// Most slides of a plan.
const MOST: usize = 100_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanFile {
    specimens: Vec<String>,
    #[serde(default)]
    speeds: Vec<f64>,
    #[serde(default)]
    directions: Vec<u16>,
    #[serde(default = "ten")]
    count: usize,
}

fn ten() -> usize {
    10
}

/// A slide that is to be recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedSlide {
    /// The labels of its recording.
    pub labels: Labels,
    /// A line for a person: `Saw3, 150 mm/s, 90 degrees, 2 of 10`.
    pub about: String,
    /// The name of its recording, without `.mcap`.
    pub name: String,
}

/// Reads a plan and returns its slides in order, one specimen after the other.
///
/// # Errors
/// The file cannot be read, or a key is wrong. The error names the file, the key, what was found and what was expected.
pub fn read(path: &Path) -> Result<Vec<PlannedSlide>, Error> {
    let text = crate::text_file::file_text(path)?;
    parse(&text).map_err(|message| Error::new(ErrorKind::Config, path.display(), message))
}

/// Returns the slides of a plan's text.
///
/// # Errors
/// A key is wrong. The message names the key, what was found and what was expected.
pub fn parse(text: &str) -> Result<Vec<PlannedSlide>, String> {
    let file: PlanFile = crate::text_file::from_toml(text)?;
    let is_plain = |name: &String| {
        !name.is_empty() && name.chars().all(|letter| letter.is_alphanumeric() || ['_', '.'].contains(&letter))
    };
    if let Some(name) = file.specimens.iter().find(|name| !is_plain(name)) {
        return Err(format!("specimens has {name:?}, expected letters and digits: it names files"));
    }
    if let Some(speed) = file.speeds.iter().find(|speed| !(**speed > 0.0 && speed.is_finite())) {
        return Err(format!("speeds has {speed}, expected mm/s above 0"));
    }
    if let Some(direction) = file.directions.iter().find(|direction| !(0..360).contains(*direction)) {
        return Err(format!("directions has {direction}, expected whole degrees, 0 to 359"));
    }
    // A duplicate would be the same file twice.
    if let Some(name) = twice(&file.specimens) {
        return Err(format!("specimens has {name:?} twice, expected each once"));
    }
    if let Some(speed) = twice(&file.speeds) {
        return Err(format!("speeds has {speed} twice, expected each once"));
    }
    if let Some(direction) = twice(&file.directions) {
        return Err(format!("directions has {direction} twice, expected each once"));
    }
    let some = |count: usize| count.max(1);
    let all = [file.specimens.len(), some(file.speeds.len()), some(file.directions.len()), file.count];
    let total = all.iter().try_fold(1_usize, |product, &factor| product.checked_mul(factor));
    if !total.is_some_and(|total| (1..=MOST).contains(&total)) {
        return Err(format!("specimens × speeds × directions × count is {all:?}, expected 1 to {MOST} slides"));
    }
    // A list that is left out is one slide without the label.
    let speeds: Vec<Option<f64>> = options(&file.speeds);
    let directions: Vec<Option<u16>> = options(&file.directions);
    let mut slides = Vec::new();
    for specimen in &file.specimens {
        for speed in &speeds {
            for direction in &directions {
                for number in 1..=file.count {
                    slides.push(slide(specimen, *speed, *direction, number, file.count));
                }
            }
        }
    }
    Ok(slides)
}

/// Returns a value that a list has more than once.
fn twice<T: PartialEq>(values: &[T]) -> Option<&T> {
    values.iter().enumerate().find(|(at, value)| values[..*at].contains(value)).map(|(_, value)| value)
}

fn options<T: Copy>(values: &[T]) -> Vec<Option<T>> {
    if values.is_empty() { vec![None] } else { values.iter().copied().map(Some).collect() }
}

fn slide(specimen: &str, speed: Option<f64>, direction: Option<u16>, number: usize, count: usize) -> PlannedSlide {
    let mut labels = Labels::from([("specimen".into(), specimen.into())]);
    let (mut about, mut name) = (vec![specimen.to_owned()], vec![specimen.to_owned()]);
    if let Some(speed) = speed {
        labels.insert("speed".into(), speed.to_string());
        about.push(format!("{speed} mm/s"));
        name.push(format!("{speed}mm_s"));
    }
    if let Some(direction) = direction {
        labels.insert("direction".into(), direction.to_string());
        about.push(format!("{direction} degrees"));
        name.push(format!("{direction}deg"));
    }
    about.push(format!("{number} of {count}"));
    name.push(format!("{number:0width$}", width = count.to_string().len()));
    PlannedSlide { labels, about: about.join(", "), name: name.join("-") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_every_combination_in_order() {
        let plan =
            parse("specimens = [\"Saw3\", \"Fla0\"]\nspeeds = [100, 150.5]\ndirections = [90]\ncount = 10").unwrap();
        assert_eq!(plan.len(), 40);
        let expected = ("Saw3-100mm_s-90deg-01", "Saw3-150.5mm_s-90deg-01");
        assert_eq!((plan[0].name.as_str(), plan[10].name.as_str()), expected);
        assert_eq!(plan[1].about, "Saw3, 100 mm/s, 90 degrees, 2 of 10");
        assert_eq!(plan[39].labels["specimen"], "Fla0");
        let plain = parse("specimens = [\"Saw3\"]").unwrap();
        assert_eq!((plain.len(), plain[9].name.as_str()), (10, "Saw3-10"));
    }

    #[test]
    fn what_is_no_plan_is_said() {
        for (text, part) in [
            ("", "specimens"),
            ("specimens = []", "expected 1 to"),
            ("specimens = [\"a/b\"]", "a/b"),
            ("specimens = [\"a\"]\nspeeds = [0]", "speeds has 0"),
            ("specimens = [\"a\"]\ndirections = [360]", "directions has 360"),
            ("specimens = [\"a\", \"b\", \"a\"]", "specimens has \"a\" twice"),
            ("specimens = [\"a\"]\nspeeds = [100, 100.0]", "speeds has 100 twice"),
            ("specimens = [\"a\"]\ndirections = [90, 0, 90]", "directions has 90 twice"),
            ("specimens = [\"a\"]\ncount = 0", "expected 1 to"),
            ("specimens = [\"a\"]\nslides = 3", "slides"),
        ] {
            let message = parse(text).unwrap_err();
            assert!(message.contains(part), "{message}, expected {part}");
        }
    }
}
