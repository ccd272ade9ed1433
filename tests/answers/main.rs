//! Writes docs/ANSWERS.md to standard output: how well motion, kinds of touch and textures are known, on touches that
//! nobody used while the estimators and models were built. `ci/answers` compares it with the page. With the argument
//! `motion`, `limits`, `live`, `readout`, `judge` (objects), `at-once`, `blocks` (slow flat ones), `slip`, `textures`
//! or `learn` (new textures) it writes only that section, and with `base` only the tables of the kinds of touch and of
//! cameras, whose lines are lines of the page.

mod live;
mod objects;
mod readout;
mod slip;
mod textures;
mod touches;

use std::fmt::Write as _;

use wstac_core::touch::motion::{Contact, Motion};
use wstac_host::statistics::percentile;
use wstac_scene::Slide;
use wstac_train::train::wilson;

use touches::{Answered, Kind, answers};

/// Slides of the main table, and touches of the others.
const SLIDES: u64 = 4000;
const OTHERS: u64 = 1000;

/// The slide of a touch, and its motion.
struct Case<'a> {
    slide: &'a Slide,
    motion: Option<Motion>,
}

/// The results of a set of slides.
struct Result {
    count: usize,
    /// Slides with a reliable velocity.
    reliable: usize,
    /// Errors of reliable speeds, as fractions.
    speed: Vec<f64>,
    /// Errors of reliable directions, in degrees.
    degrees: Vec<f64>,
    /// Reliable speeds and directions within one standard deviation.
    within: [usize; 2],
}

impl Result {
    fn new<'a>(cases: impl IntoIterator<Item = &'a Case<'a>>) -> Self {
        let mut result = Self { count: 0, reliable: 0, speed: vec![], degrees: vec![], within: [0; 2] };
        for case in cases {
            result.count += 1;
            let Some(motion) = case.motion.filter(|motion| motion.reliable) else { continue };
            let Some(velocity) = motion.velocity else { continue };
            let speed = (f64::from(velocity.mm_s) / case.slide.speed_mm_s - 1.0).abs();
            let turned = f64::from(velocity.degrees) - case.slide.direction_deg;
            let degrees = ((turned + 180.0).rem_euclid(360.0) - 180.0).abs();
            result.reliable += 1;
            result.within[0] += usize::from(speed * case.slide.speed_mm_s <= f64::from(velocity.mm_s_sd));
            result.within[1] += usize::from(degrees <= f64::from(velocity.degrees_sd));
            result.speed.push(speed);
            result.degrees.push(degrees);
        }
        result
    }

    /// Returns the cells of a row: the reliable part, and errors of speed and direction.
    fn cells(&self) -> [String; 3] {
        [share(self.reliable, self.count), percentiles(&self.speed, 100.0), percentiles(&self.degrees, 1.0)]
    }

    /// Returns a row of a table.
    fn row(&self, name: &str) -> String {
        let wrong = self.speed.iter().filter(|error| **error > 0.1).count();
        format!("| {name} | {} | {wrong} |", self.cells().join(" | "))
    }
}

const HEAD: &str = "\
reliable, % | speed error, %: median/p95 | direction error, °: median/p95 | wrong |
| --- | --- | --- | --- | --- |";

/// Returns the slides of answered touches.
fn cases(answered: &[Answered]) -> Vec<Case<'_>> {
    let case = |one| Some(Case { slide: Answered::slide(one)?, motion: one.motion });
    answered.iter().filter_map(case).collect()
}

/// A table of slides whose property is between bounds.
fn table(page: &mut String, property: &str, cases: &[Case<'_>], of: impl Fn(&Case<'_>) -> f64, bounds: &[[f64; 2]]) {
    let _ = writeln!(page, "| {property} | {HEAD}");
    for [low, high] in bounds {
        let rows = cases.iter().filter(|case| (*low..*high).contains(&of(case)));
        let _ = writeln!(page, "{}", Result::new(rows).row(&format!("{low} to {high}")));
    }
    page.push('\n');
}

/// Returns the name of the least reliable group of slides, and how many percent of it are reliable.
fn least(groups: &[(String, Result)]) -> [String; 2] {
    let part = |result: &Result| result.reliable as f64 / result.count.max(1) as f64;
    let least = groups.iter().min_by(|(_, a), (_, b)| part(a).total_cmp(&part(b)));
    least.map_or_else(<[String; 2]>::default, |(name, result)| [name.clone(), share(result.reliable, result.count)])
}

/// Percent of a number in another.
pub(crate) fn share(count: usize, of: usize) -> String {
    if of == 0 { "–".into() } else { format!("{:.1}", 100.0 * count as f64 / of as f64) }
}

/// Returns a share in percent with Wilson's interval of 95 %, or without it if nothing is counted.
pub(crate) fn interval(count: usize, of: usize) -> String {
    judged(count, of, false)
}

/// Returns a share as [`interval`] does, bold if it misses its goal.
pub(crate) fn judged(count: usize, of: usize, is_missed: bool) -> String {
    if count == 0 {
        return bold(is_missed, share(count, of));
    }
    let [low, high] = wilson(count as u32, of as u32).map(|limit| 100.0 * limit);
    let percent = 100.0 * (count as f64 / of.max(1) as f64);
    format!("{} ({low:.1}…{high:.1})", bold(is_missed, format!("{percent:.1}")))
}

/// Returns a share as [`interval`] does, bold if it is below a goal in percent.
pub(crate) fn at_least(count: usize, of: usize, goal: f64) -> String {
    judged(count, of, 100.0 * (count as f64) < goal * of as f64)
}

/// Returns the median and the 95th percentile of errors.
pub(crate) fn percentiles(errors: &[f64], unit: f64) -> String {
    let at = |fraction| percentile(errors.to_vec(), fraction).map(|value| format!("{:.2}", unit * value));
    at(0.5).zip(at(0.95)).map_or("–".into(), |(median, high)| format!("{median}/{high}"))
}

/// Returns a cell, bold if it misses its goal.
pub(crate) fn bold(is_missed: bool, cell: String) -> String {
    if is_missed { format!("**{cell}**") } else { cell }
}

/// Returns a percentile with its interval of 95 %, by the ranks that a percentile may have by chance.
fn quantile(errors: &[f64], fraction: f64, unit: f64) -> String {
    let n = errors.len() as f64;
    let half = 1.96 * (fraction * (1.0 - fraction) / n.max(1.0)).sqrt();
    let at = |fraction: f64| percentile(errors.to_vec(), fraction.clamp(0.0, 1.0)).map_or(f64::NAN, |x| unit * x);
    format!("{:.2} ({:.2}…{:.2})", at(fraction), at(fraction - half), at(fraction + half))
}

/// The goals beside what was reached.
fn goals(page: &mut String, cases: &[Case<'_>]) {
    let within =
        |low: f64, high: f64| Result::new(cases.iter().filter(|case| (low..high).contains(&case.slide.speed_mm_s)));
    let [all, main, wide, narrow, slow, fast] =
        [[10.0, 600.0], [20.0, 400.0], [15.0, 600.0], [60.0, 300.0], [10.0, 100.0], [100.0, 600.0]]
            .map(|[low, high]| within(low, high));
    let _ = writeln!(page, "| goal | speed, mm/s | wanted | reached |\n| --- | --- | --- | --- |");
    let mut row = |goal: &str, speed: &str, wanted: &str, reached: String| {
        let _ = writeln!(page, "| {goal} | {speed} | {wanted} | {reached} |");
    };
    row("speed error, %: median", "20 to 400", "at most 0.5", quantile(&main.speed, 0.5, 100.0));
    row("speed error, %: p95", "20 to 400", "at most 2.5", quantile(&main.speed, 0.95, 100.0));
    row("speed error, %: p95", "10 to 600", "at most 10", quantile(&all.speed, 0.95, 100.0));
    row("direction error, °: median", "10 to 600", "at most 0.5", quantile(&all.degrees, 0.5, 1.0));
    row("direction error, °: p95", "10 to 600", "at most 2", quantile(&all.degrees, 0.95, 1.0));
    row("reliable, %", "15 to 600", "at least 90", interval(wide.reliable, wide.count));
    row("reliable, %", "60 to 300", "at least 97", interval(narrow.reliable, narrow.count));
    let wrong = all.speed.iter().filter(|error| **error > 0.1).count();
    let share = interval(wrong, all.reliable);
    row(
        "reliable, and wrong by more than 10 %",
        "10 to 600",
        "0 of 2000",
        format!("{wrong} of {}: {share} %", all.reliable),
    );
    for (name, result) in [("10 to 100", &slow), ("100 to 600", &fast)] {
        for (what, count) in ["speed", "direction"].into_iter().zip(result.within) {
            let percent = 100.0 * count as f64 / result.reliable.max(1) as f64;
            let is_missed = !(63.0..=73.0).contains(&percent);
            row(&format!("{what} within 1 sd, %"), name, "63 to 73", judged(count, result.reliable, is_missed));
        }
    }
    page.push('\n');
}

/// The share of touches of a kind that have each answer.
fn kinds(page: &mut String) {
    let expected = [
        (Kind::Slide, "slide", Contact::Slide),
        (Kind::Press, "press", Contact::Press),
        (Kind::Poke, "poke", Contact::Poke),
        (Kind::Hold, "hold", Contact::Press),
    ];
    let _ =
        writeln!(page, "| touch | seen | events | right, % of seen (goal: at least 99) |\n| --- | --- | --- | --- |");
    for (kind, name, right) in expected {
        let answered = answers(kind, OTHERS);
        let contacts: Vec<Contact> = answered.iter().filter_map(|one| Some(one.motion?.contact)).collect();
        let _ = writeln!(
            page,
            "| {name} | {} of {} | {} | {} |",
            contacts.len(),
            answered.len(),
            answered.iter().map(|one| one.events).sum::<usize>(),
            interval(contacts.iter().filter(|found| **found == right).count(), contacts.len()),
        );
    }
    page.push('\n');
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some(part) = arguments.first() {
        let mut section = String::new();
        match part.as_str() {
            "motion" => motion(&mut section),
            "limits" => limits(&mut section),
            "live" => live::tables(&mut section),
            "readout" => readout::table(&mut section),
            "judge" => objects::section(&mut section),
            "at-once" => objects::at_once::section(&mut section),
            "blocks" => objects::at_once::blocks(&mut section),
            "slip" => slip::section(&mut section),
            "conditions" => section = textures::conditions::section(),
            "base" => {
                kinds(&mut section);
                section += &live::cameras();
            }
            "period" => section = textures::periods::section(),
            "learn" => section = textures::learning(),
            _ => section = textures::section(),
        }
        print!("{section}");
        return;
    }
    let mut page = String::from(include_str!("head.txt"));
    motion(&mut page);
    page.push_str(include_str!("kinds.txt"));
    kinds(&mut page);
    limits(&mut page);
    readout::table(&mut page);
    objects::section(&mut page);
    objects::at_once::section(&mut page);
    slip::section(&mut page);
    live::tables(&mut page);
    page += &textures::section();
    page += &textures::periods::section();
    print!("{page}");
}

/// Writes the tables of slides.
fn motion(page: &mut String) {
    let slides = answers(Kind::Slide, SLIDES);
    let cases = cases(&slides);
    let _ = writeln!(page, "## Slides\n");
    goals(page, &cases);
    let speed = |case: &Case<'_>| case.slide.speed_mm_s;
    let bounds = [10.0, 15.0, 20.0, 40.0, 60.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0];
    let bounds: Vec<[f64; 2]> = bounds.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    table(page, "speed, mm/s", &cases, speed, &bounds);
    let specimens = wstac_scene::specimen::Specimen::ALL.map(|specimen| {
        let same = |case: &&Case<'_>| {
            let own = case.slide.specimen;
            own.pattern == specimen.pattern && (own.depth_mm - specimen.depth_mm).abs() < 1e-9
        };
        (specimen.to_string(), Result::new(cases.iter().filter(same)))
    });
    let lengths = [[20, 40], [40, 60], [60, 80], [80, 120], [120, 160]].map(|[low, high]| {
        let within = |case: &&Case<'_>| (f64::from(low)..f64::from(high)).contains(&case.slide.specimen.length_mm);
        (format!("{low} to {high} mm"), Result::new(cases.iter().filter(within)))
    });
    let ([specimen, of_specimen], [length, of_length]) = (least(&specimens), least(&lengths));
    let _ = writeln!(
        page,
        "The least reliable specimen is {specimen} with {of_specimen} %, the least reliable length {length} with {of_length} %.\n"
    );
}

/// Writes the table of conditions under which motion is hard to know.
fn limits(page: &mut String) {
    page.push_str(include_str!("limits.txt"));
    let _ = writeln!(page, "| condition | {HEAD}");
    for (kind, name) in [
        (Kind::Straight, "along rows and columns"),
        (Kind::Dim, "a fifth of the light"),
        (Kind::Bright, "four times the light"),
        (Kind::Noisy, "2.5 times the noise, 3 times the spread of gains"),
        (Kind::Pitch, "texture period equal to the pitch"),
        (Kind::OneWeak, "one weak whisker"),
        (Kind::Dead, "one dead whisker, three weak ones"),
        (Kind::Slow, "1 to 9 mm/s"),
        (Kind::Two, "two slides within one sample; compared with the first"),
    ] {
        let answered = answers(kind, OTHERS);
        let _ = writeln!(page, "{}", Result::new(&cases(&answered)).row(name));
    }
}
