//! Writes docs/ANSWERS.md to standard output: how well motion, kinds of touch and textures are known, on touches that
//! nobody used while the estimators and models were built. `ci/answers` compares it with the page. With the argument
//! `textures` it writes only that section.

mod live;
mod textures;
mod touches;

use std::fmt::Write as _;

use wstac_core::motion::{Contact, Motion};
use wstac_host::statistics::percentile;
use wstac_scene::Slide;

use touches::{Answered, Kind, answers};

/// Slides of the main table, and touches of the others.
const SLIDES: u64 = 4000;
const OTHERS: u64 = 1000;

/// The slide of a touch, and one estimator's motion.
struct Case<'a> {
    slide: &'a Slide,
    unit: u32,
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

    /// Returns a row of a table.
    fn row(&self, name: &str) -> String {
        let of = |numbers: &[f64], fraction, unit: f64| {
            percentile(numbers.to_vec(), fraction).map_or("–".into(), |value| format!("{:.2}", unit * value))
        };
        let share = |count: usize, of: usize| match of {
            0 => "–".into(),
            _ => format!("{:.1}", 100.0 * count as f64 / of as f64),
        };
        let wrong = self.speed.iter().filter(|error| **error > 0.1).count();
        format!(
            "| {name} | {} | {} | {} | {} | {} | {} | {wrong} | {} | {} |",
            self.count,
            share(self.reliable, self.count),
            of(&self.speed, 0.5, 100.0),
            of(&self.speed, 0.95, 100.0),
            of(&self.degrees, 0.5, 1.0),
            of(&self.degrees, 0.95, 1.0),
            share(self.within[0], self.reliable),
            share(self.within[1], self.reliable),
        )
    }
}

const HEAD: &str = "\
slides | reliable, % | speed error, %: median | p95 | direction error, °: median | p95 | wrong by more than 10 % | speed within 1 sd, % | direction within 1 sd, % |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |";

/// Returns the slides of answered touches, with the motion of an estimator: 0 by coherence, 1 by edges.
fn cases(answered: &[Answered], estimator: usize) -> Vec<Case<'_>> {
    let of = |one: &'_ Answered| one.motions.map(|motions| motions[estimator]);
    let case = |one| Some(Case { slide: Answered::slide(one)?, unit: one.unit, motion: of(one) });
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

/// The share of touches of a kind that have each answer.
fn kinds(page: &mut String) {
    let expected = [
        (Kind::Slide, "slide", Contact::Slide),
        (Kind::Press, "press", Contact::Press),
        (Kind::Poke, "poke", Contact::Poke),
        (Kind::Hold, "hold", Contact::Press),
    ];
    let _ = writeln!(page, "| touch | seen | events | slide | press | poke | unclear | right, % of seen |");
    let _ = writeln!(page, "| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (kind, name, right) in expected {
        let answered = answers(kind, OTHERS);
        let contacts: Vec<Contact> = answered.iter().filter_map(|one| one.motions).map(|[by, _]| by.contact).collect();
        let count = |contact| contacts.iter().filter(|found| **found == contact).count();
        let _ = writeln!(
            page,
            "| {name} | {} of {} | {} | {} | {} | {} | {} | {:.1} |",
            contacts.len(),
            answered.len(),
            answered.iter().map(|one| one.events).sum::<usize>(),
            count(Contact::Slide),
            count(Contact::Press),
            count(Contact::Poke),
            count(Contact::Unclear),
            100.0 * count(right) as f64 / contacts.len().max(1) as f64,
        );
    }
    page.push('\n');
}

fn main() {
    if std::env::args().nth(1).as_deref() == Some("textures") {
        print!("{}", textures::section());
        return;
    }
    let mut page = String::from(include_str!("head.txt"));
    let slides = answers(Kind::Slide, SLIDES);
    for (estimator, name) in ["By coherence", "By edges"].into_iter().enumerate() {
        let cases = cases(&slides, estimator);
        let _ = writeln!(page, "## {name}\n");
        let speed = |case: &Case<'_>| case.slide.speed_mm_s;
        let goals = [[10.0, 600.0], [20.0, 400.0], [15.0, 600.0], [60.0, 300.0], [10.0, 100.0], [100.0, 600.0]];
        table(&mut page, "speed, mm/s", &cases, speed, &goals);
        let bounds = [10.0, 15.0, 20.0, 40.0, 60.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0];
        let bounds: Vec<[f64; 2]> = bounds.windows(2).map(|pair| [pair[0], pair[1]]).collect();
        table(&mut page, "speed, mm/s", &cases, speed, &bounds);
        if estimator > 0 {
            continue;
        }
        let lengths = [[20.0, 40.0], [40.0, 60.0], [60.0, 80.0], [80.0, 120.0], [120.0, 160.0]];
        table(&mut page, "length, mm", &cases, |case| case.slide.specimen.length_mm, &lengths);
        let angle = |case: &Case<'_>| {
            let turned = case.slide.direction_deg % 90.0;
            turned.min(90.0 - turned)
        };
        table(&mut page, "angle to the nearer axis, °", &cases, angle, &[[0.0, 15.0], [15.0, 30.0], [30.0, 45.0]]);
        let _ = writeln!(page, "| specimen | {HEAD}");
        for specimen in wstac_scene::specimen::Specimen::ALL {
            let same = |case: &&Case<'_>| {
                let own = case.slide.specimen;
                own.pattern == specimen.pattern && (own.depth_mm - specimen.depth_mm).abs() < 1e-9
            };
            let _ = writeln!(page, "{}", Result::new(cases.iter().filter(same)).row(&specimen.to_string()));
        }
        page.push('\n');
        let mut units: Vec<u32> = cases.iter().map(|case| case.unit).collect();
        units.sort_unstable();
        units.dedup();
        let _ = writeln!(page, "These slides are of {} sensors.\n", units.len());
    }
    page.push_str(include_str!("kinds.txt"));
    kinds(&mut page);
    page.push_str(include_str!("limits.txt"));
    let _ = writeln!(page, "| condition | {HEAD}");
    for (kind, name) in [
        (Kind::Straight, "along rows and columns"),
        (Kind::Dim, "a fifth of the light"),
        (Kind::Bright, "four times the light"),
        (Kind::Noisy, "2.5 times the noise, 3 times the spread of gains"),
        (Kind::Pitch, "texture period equal to the pitch"),
        (Kind::Dead, "one dead whisker, three weak ones"),
        (Kind::Skewed, "edges at up to 15° from the right angle"),
        (Kind::Narrow, "blocks of 6 to 20 mm in width"),
        (Kind::Changing, "speed that changes; compared with that of the first 8 mm"),
        (Kind::Stop, "a stop within the slide"),
        (Kind::Slow, "1 to 9 mm/s"),
        (Kind::Two, "two slides within one sample; compared with the first"),
        (Kind::Lost, "a twentieth of the frames lost"),
    ] {
        let answered = answers(kind, OTHERS);
        let _ = writeln!(page, "{}", Result::new(&cases(&answered, 0)).row(name));
    }
    live::tables(&mut page);
    page += &textures::section();
    print!("{page}");
}
