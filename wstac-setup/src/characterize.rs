//! The answers to slides beside their truth, as text and as a page.

use std::fmt::{self, Write as _};

use crate::doctor::page::{escaped, write_head};
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use wstac_core::reason::Reason;
use wstac_host::output::TactileEvent;
use wstac_host::plural::counted;

/// Largest errors of an answer that is not wrong: a fraction of the speed, and degrees (docs/ANSWERS.md).
const WRONG_SPEED: f64 = 0.1;
const WRONG_DEGREES: f64 = 10.0;

/// The speed and direction of a slide.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlideTruth {
    /// The speed in mm/s, if it is known.
    pub mm_s: Option<f64>,
    /// The direction in degrees, if it is known.
    pub degrees: Option<f64>,
}

/// A number and its standard deviation, if it has one.
pub type Answered = (f64, Option<f64>);

/// The answer to a slide.
#[derive(Clone, Debug, PartialEq)]
pub struct SlideAnswer {
    /// The name of its recording.
    pub name: String,
    /// What it truly was.
    pub truth: SlideTruth,
    /// The speed in mm/s, or why there is none.
    pub mm_s: Result<Answered, Reason>,
    /// The direction in degrees, or why there is none.
    pub degrees: Result<Answered, Reason>,
    /// Whether there are answers, and they are reliable.
    pub reliable: bool,
}

impl SlideAnswer {
    /// Returns the answer of an event.
    pub fn new(name: String, truth: SlideTruth, event: &TactileEvent) -> Self {
        let speed = event.speed.map(|speed| (speed.mm_s.into(), speed.sd.map(f64::from)));
        let degrees = event.direction.degrees.map(|found| (found.into(), event.direction.sd.map(f64::from)));
        Self { name, truth, mm_s: speed, degrees, reliable: event.reliable && event.speed.is_ok() }
    }

    /// Returns the error of the speed as a fraction, and by its deviation.
    fn speed_error(&self) -> Option<(f64, Option<f64>)> {
        let ((found, sd), truth) = (self.mm_s.ok()?, self.truth.mm_s?);
        Some((((found - truth) / truth).abs(), sd.map(|sd| (found - truth).abs() / sd)))
    }

    /// Returns the error of the direction in degrees, and by its deviation.
    fn direction_error(&self) -> Option<(f64, Option<f64>)> {
        let ((found, sd), truth) = (self.degrees.ok()?, self.truth.degrees?);
        let error = ((found - truth + 180.0).rem_euclid(360.0) - 180.0).abs();
        Some((error, sd.map(|sd| error / sd)))
    }

    /// Returns whether the answer is reliable and wrong.
    fn is_wrong(&self) -> bool {
        let is_off = |found: Option<(f64, Option<f64>)>, most: f64| found.is_some_and(|(error, _)| error > most);
        self.reliable && (is_off(self.speed_error(), WRONG_SPEED) || is_off(self.direction_error(), WRONG_DEGREES))
    }

    /// Returns the cells of a row.
    fn cells(&self) -> [String; 6] {
        let known = |found: Option<f64>, unit: &str| found.map_or_else(|| "–".into(), |found| format!("{found}{unit}"));
        let answered = |found: &Result<Answered, Reason>, unit: &str| match found {
            Ok((found, Some(sd))) => format!("{found:.1} ± {:.1}{unit}", sd.max(0.1)),
            Ok((found, None)) => format!("{found:.1}{unit}"),
            Err(why) => why.to_string(),
        };
        let doubt = if self.is_wrong() {
            "wrong"
        } else if self.reliable {
            ""
        } else {
            "not reliable"
        };
        [
            self.name.clone(),
            known(self.truth.mm_s, ""),
            known(self.truth.degrees, "°"),
            answered(&self.mm_s, ""),
            answered(&self.degrees, "°"),
            doubt.to_owned(),
        ]
    }
}

const HEADS: [&str; 6] = ["recording", "true mm/s", "true direction", "mm/s", "direction", ""];

/// The answers to the slides of a sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AnswerReport {
    /// The answers, in order.
    pub slides: Vec<SlideAnswer>,
    /// The recordings that have no event.
    pub without_event: Vec<String>,
    /// The sensors of the recordings, each once.
    pub sensors: Vec<String>,
    /// The recordings that have several events, of which the first is the answer.
    pub of_several: Vec<String>,
}

impl AnswerReport {
    /// Returns sentences that sum the answers up.
    pub fn summary(&self) -> Vec<String> {
        let reliable: Vec<&SlideAnswer> = self.slides.iter().filter(|slide| slide.reliable).collect();
        let (all, count) = (counted(self.slides.len(), "slide"), reliable.len());
        let wrong = self.slides.iter().filter(|slide| slide.is_wrong()).count();
        let mut lines = vec![format!("{all}: {count} reliable; reliable, but off by more than 10 % or 10°: {wrong}.")];
        let speeds: Vec<_> = reliable.iter().filter_map(|slide| slide.speed_error()).collect();
        let directions: Vec<_> = reliable.iter().filter_map(|slide| slide.direction_error()).collect();
        lines.extend(error_line("Speed", &speeds, 100.0, " %"));
        lines.extend(error_line("Direction", &directions, 1.0, "°"));
        if self.sensors.len() > 1 {
            lines.push(format!("Of several sensors, which need a folder each: {}.", self.sensors.join("; ")));
        }
        if !self.without_event.is_empty() {
            lines.push(format!("Without an event: {}.", self.without_event.join(", ")));
        }
        if !self.of_several.is_empty() {
            lines.push(format!("With several events, of which the first counts: {}.", self.of_several.join(", ")));
        }
        lines
    }

    /// Returns a page with the answers, the taxels of the calibration as a PNG, and the keys of the sensor's scene, or
    /// why there are none.
    pub fn to_html(&self, about: &str, overlay: Option<&[u8]>, scene: &Result<String, String>) -> String {
        let mut page = String::new();
        // Writing to a string does not fail.
        let _ = self.write_html(&mut page, about, overlay, scene);
        page
    }

    fn write_html(
        &self,
        page: &mut String,
        about: &str,
        overlay: Option<&[u8]>,
        scene: &Result<String, String>,
    ) -> fmt::Result {
        write_head(page, &format!("WSTac: {about}"), "A WSTac sensor and its answers")?;
        writeln!(page, "<p>{}</p>\n<h2>Answers</h2>", escaped(about))?;
        for line in self.summary() {
            writeln!(page, "<p>{}</p>", escaped(&line))?;
        }
        writeln!(page, "<h2>Sensor</h2>")?;
        match scene {
            Ok(keys) => writeln!(page, "<p>Keys of a scene that is this sensor:</p>\n<pre>{}</pre>", escaped(keys))?,
            Err(why) => writeln!(page, "<p>Not measured: {}</p>", escaped(why))?,
        }
        if let Some(png) = overlay {
            writeln!(
                page,
                "<img alt=\"The 25 taxels\" src=\"data:image/png;base64,{}\">",
                BASE64_STANDARD.encode(png)
            )?;
        }
        writeln!(page, "<h2>Slides</h2>\n<table>\n<tr><th>{}</th></tr>", HEADS.join("</th><th>"))?;
        for slide in &self.slides {
            writeln!(page, "<tr><td>{}</td></tr>", slide.cells().map(|cell| escaped(&cell)).join("</td><td>"))?;
        }
        writeln!(page, "</table>\n</body></html>")
    }
}

/// Returns a sentence about errors and whether their deviations hold; `None` without errors.
fn error_line(name: &str, errors: &[(f64, Option<f64>)], scale: f64, unit: &str) -> Option<String> {
    let mut sorted: Vec<f64> = errors.iter().map(|(error, _)| scale * error).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |part: f64| {
        let place = part * (sorted.len().max(1) - 1) as f64;
        let [below, above] = [place.floor(), place.ceil()].map(|place| sorted.get(place as usize).copied());
        Some(below? + (above? - below?) * place.fract())
    };
    let [median, most] = [at(0.5)?, at(0.95)?];
    let mut line = format!("{name}: off by {median:.1}{unit} (median) and {most:.1}{unit} (95 %)");
    let by_sd: Vec<f64> = errors.iter().filter_map(|(_, by_sd)| *by_sd).collect();
    if !by_sd.is_empty() {
        let count = by_sd.len();
        let within = |most: f64| by_sd.iter().filter(|error| **error <= most).count();
        let percent = |most: f64| 100 * within(most) / count;
        let _ = write!(
            line,
            "; of {count}, {} % within one standard deviation (expected 63 to 73), {} % within two (93 to 97.5)",
            percent(1.0),
            percent(2.0)
        );
        // A count that is two of its own standard deviations too low is no longer chance.
        let is_few = |most: f64, part: f64| {
            let expected = part * count as f64;
            (within(most) as f64) < expected - 2.0 * (expected * (1.0 - part)).sqrt()
        };
        if count >= 10 && (is_few(1.0, 0.63) || is_few(2.0, 0.93)) {
            line.push_str(": too few, so this sensor's deviations are larger than stated");
        }
    }
    Some(line + ".")
}

impl fmt::Display for AnswerReport {
    /// Writes a table of all slides, and the summary.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows: Vec<[String; 6]> = self.slides.iter().map(SlideAnswer::cells).collect();
        let widths: [usize; 6] = std::array::from_fn(|column| {
            let cells = rows.iter().map(|row| row[column].chars().count());
            cells.chain([HEADS[column].chars().count()]).max().unwrap_or_default()
        });
        for row in std::iter::once(&HEADS.map(str::to_owned)).chain(&rows) {
            let mut line = format!("{:1$}", row[0], widths[0]);
            for (cell, width) in row.iter().zip(widths).skip(1) {
                let _ = write!(line, "  {cell:>width$}");
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        self.summary().iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slide(mm_s: f64, sd: f64, degrees: f64, reliable: bool) -> SlideAnswer {
        let truth = SlideTruth { mm_s: Some(100.0), degrees: Some(0.0) };
        let (mm_s, degrees) = (Ok((mm_s, Some(sd))), Ok((degrees, Some(1.0))));
        SlideAnswer { name: "a<b".into(), truth, mm_s, degrees, reliable }
    }

    #[test]
    fn answers_are_compared_with_the_truth() {
        let slides = vec![slide(101.0, 1.5, 359.0, true), slide(120.0, 1.0, 3.0, true), slide(300.0, 1.0, 90.0, false)];
        let report = AnswerReport {
            slides,
            without_event: vec!["c".into()],
            of_several: vec!["d".into()],
            sensors: vec!["e".into(), "f".into()],
        };
        assert_eq!(
            report.summary(),
            [
                "3 slides: 2 reliable; reliable, but off by more than 10 % or 10°: 1.",
                "Speed: off by 10.5 % (median) and 19.1 % (95 %); of 2, 50 % within one standard deviation (expected 63 to \
                 73), 50 % within two (93 to 97.5).",
                "Direction: off by 2.0° (median) and 2.9° (95 %); of 2, 50 % within one standard deviation (expected 63 to \
                 73), 50 % within two (93 to 97.5).",
                "Of several sensors, which need a folder each: e; f.",
                "Without an event: c.",
                "With several events, of which the first counts: d.",
            ]
        );
        let off = AnswerReport { slides: vec![slide(104.0, 1.5, 0.0, true); 10], ..report.clone() }.summary();
        assert!(
            off[1].ends_with(
                "; of 10, 0 % within one standard deviation (expected 63 to 73), 0 % within two (93 to 97.5): \
                                  too few, so this sensor's deviations are larger than stated."
            ),
            "{}",
            off[1]
        );
        let text = report.to_string();
        assert!(text.lines().nth(1).unwrap().ends_with("101.0 ± 1.5  359.0 ± 1.0°"), "{text}");
        assert!(text.contains("wrong") && text.contains("not reliable"), "{text}");
        let page = report.to_html("x", None, &Err("few slides".into()));
        assert!(page.contains("a&lt;b") && page.contains("Not measured: few slides"), "{page}");
    }
}
