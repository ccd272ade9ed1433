//! Objects of any shape: how often their velocity is known and how often it is wrong, by kind and by fault.

pub(crate) mod at_once;
mod crosstalk;
mod extents;
pub(crate) mod scenes;

use std::fmt::Write as _;

use wstac_core::green::gray::Gray;
use wstac_core::law::ByWave;
use wstac_core::layout::Layout;
use wstac_core::paper::trigger::TriggerConfig;
use wstac_core::pipeline::Pipeline;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::at_once::{AtOnce, answer as answer_of};
use wstac_core::touch::motion::{MotionConfig, Readout, ReadoutTime, RowOrder, Velocity};
use wstac_core::touch::slip::SlipDetector;
use wstac_core::touch::taxel_ring::ChosenTaxels;
use wstac_core::touch::wave::{Basis, Extent, Measured, by_wave};
use wstac_host::statistics::percentile;
use wstac_scene::rng::Rng;
use wstac_scene::{Scene, SimulatedFrame};

use crate::touches::each;
use crate::{bold, interval, judged, share};
use scenes::{Drawn, Fault, JUDGE, Kind, Truth, draw};

const SLIDES: u64 = 1000;
const SPEEDS: [f64; 2] = [30.0, 300.0];
/// Fraction of lost frames.
const LOST: f64 = 0.05;
/// Off by more than this fraction or these degrees is wrong.
const WRONG: [f64; 2] = [0.1, 10.0];
/// Least and most reliable answers within one and within two standard deviations, in percent.
const WITHIN: [[f64; 2]; 2] = [[63.0, 73.0], [93.0, 97.5]];

/// What a kind of touches should reach; `None` is reported only.
#[derive(Clone, Copy)]
struct Goal {
    /// Median and 95th percentile of the speed's error in percent, and of the direction's in degrees.
    errors: Option<[[f64; 2]; 2]>,
    /// Least reliable, in percent of slides.
    reliable: Option<f64>,
    /// Most that are reliable and wrong, in percent of slides.
    wrong: f64,
}

struct Row {
    touch: &'static str,
    kind: Kind,
    fault: Fault,
    goal: Goal,
}

const fn row(touch: &'static str, kind: Kind, goal: Goal) -> Row {
    Row { touch, kind, fault: Fault::None, goal }
}

const fn mix(touch: &'static str, fault: Fault) -> Row {
    let goal = known([[1.0, 4.0], [1.0, 4.0]], 70.0, 0.3);
    Row { touch, kind: Kind::Mix, fault, goal }
}

const fn known(errors: [[f64; 2]; 2], reliable: f64, wrong: f64) -> Goal {
    Goal { errors: Some(errors), reliable: Some(reliable), wrong }
}

const fn refused(wrong: f64) -> Goal {
    Goal { errors: None, reliable: None, wrong }
}

const ROUND: Goal = known([[0.5, 2.0], [0.5, 2.5]], 92.0, 0.2);
const PAIR: Goal = known([[1.0, 3.0], [1.0, 3.0]], 85.0, 0.3);

const ROWS: [Row; 31] = [
    row("wide block", Kind::Wide, known([[0.4, 1.5], [0.25, 1.0]], 97.0, 0.0)),
    row("rod of 3 to 15 mm", Kind::Rod, ROUND),
    row("ball of 5 to 20 mm", Kind::Ball, ROUND),
    row("coin of 5 to 20 mm", Kind::Coin, ROUND),
    row("block of 6 to 20 mm at right angles", Kind::Block, known([[0.5, 2.0], [0.5, 3.0]], 80.0, 0.2)),
    row("corner of a box", Kind::Corner, PAIR),
    row("two fingers of one velocity", Kind::Fingers, PAIR),
    row("narrow block skewed by 3 to 30°", Kind::Skewed, known([[2.0, 7.0], [2.0, 7.0]], 25.0, 0.3)),
    row("oblique bare edge or rod", Kind::Oblique, known([[0.5, 1.5], [0.5, 1.5]], 90.0, 0.1)),
    row("oblique edge, texture behind", Kind::Textured, Goal { errors: None, reliable: Some(30.0), wrong: 0.3 }),
    row("twist about a point on the sensor", Kind::Twist, refused(0.5)),
    row("stop on the sensor", Kind::Stop, refused(0.5)),
    row("two velocities", Kind::Two, refused(0.5)),
    row("speed that changes by more than 15 %", Kind::Changing, refused(0.5)),
    row("stick-slip", Kind::Stick, refused(1.0)),
    row("slow turn, 0.2 to 1° per mm", Kind::Turn, refused(0.5)),
    row("press, then slide", Kind::Pressed, refused(0.5)),
    mix("mix", Fault::None),
    mix("mix, one dead whisker", Fault::Dead),
    mix("mix, gains spread three times", Fault::Gains),
    mix("mix, three times the noise", Fault::Noise),
    mix("mix, 5 % of the frames lost", Fault::Lost),
    mix("mix, 15 frames per second", Fault::Rate(15)),
    mix("mix, 60 frames per second", Fault::Rate(60)),
    mix("mix, 120 frames per second", Fault::Rate(120)),
    mix("mix, readout of 10 to 33 ms, known", Fault::KnownReadout),
    mix("mix, readout of 10 to 33 ms, unknown", Fault::UnknownReadout),
    mix("mix, half of the light after another touch", Fault::Decay),
    mix("mix, ambient light that grows by 1 to 4 % per second", Fault::Drift),
    mix("mix, cross-talk of 5 %", Fault::Crosstalk),
    mix("mix, cross-talk of 5 %, matrix known", Fault::KnownCrosstalk),
];

/// Only in the table of accelerations.
const EVEN: Row = row("speed that changes by less than 15 %", Kind::Even, PAIR);

/// A touch, and the answer to its first event.
struct Answered {
    drawn: Drawn,
    /// A reliable velocity.
    answer: Option<(Velocity, Basis)>,
    extent: Option<Extent>,
    acceleration: Option<Measured>,
    /// Seconds from the first touch to an answer before the event.
    after: Option<f64>,
}

/// Computes the scene of a number with the whole core, until the first event of its last touch.
fn answer(row: &Row, speeds: [f64; 2], number: u64, is_at_once: bool) -> Answered {
    let drawn = draw(row.kind, row.fault, speeds, number);
    let script = &drawn.script;
    let rate = script.sensor.rate;
    let layout = Layout::paper(script.sensor.size).expect("the size is that of the layout");
    let geometry = FrameGeometry::new(Gray, layout, rate).expect("sums fit 32 bits");
    let trigger = TriggerConfig::default().one_event_per_touch();
    let builder = Pipeline::builder(geometry).trigger(trigger).taxels::<ChosenTaxels>();
    let mut pipeline = builder.build().expect("all parameters are defaults");
    pipeline.keep_taxels();
    pipeline.set_correction(crosstalk::correction(row.fault));
    let time = ReadoutTime::from_ms(script.sensor.readout_ms as f32).filter(|_| row.fault != Fault::UnknownReadout);
    let readout = Readout::of_layout(time, RowOrder::Down, &layout, rate);
    let config = MotionConfig::published(rate).with_readout(readout);
    let mut scene = Scene::new(script).expect("the scene was drawn within its limits");
    let judged = if row.fault == Fault::Decay { script.touches.len() / 2 } else { 0 };
    let start = scene.truth()[judged].start_frame() / u64::from(rate.frames_added());
    let mut lost = Rng::new(JUDGE, 2 << 48 | number);
    let (law, mut at_once, mut after) = (ByWave(config), AtOnce::new(config), None);
    let mut slip = SlipDetector::new(rate);
    let (mut answer, mut extent, mut acceleration) = (None, None, None);
    while let Some(SimulatedFrame::Taxels(sums)) = scene.next_shot() {
        let is_lost = row.fault == Fault::Lost && lost.uniform() < LOST;
        let update = if is_lost { pipeline.push_lost(1) } else { pipeline.push_taxels(&sums) };
        slip.push(&update);
        let touch = update.touch().filter(|touch| is_at_once && touch.frame + 60 > start);
        if let Some(touch) = touch {
            let found = answer_of(&touch, &law, Some(&mut at_once), Some(&slip), |answer| *answer);
            let Some(found) = found else { continue };
            after = Some(
                (touch.last_frame() + 1).saturating_sub(start) as f64 / rate.per_second()
                    * f64::from(rate.frames_added()),
            );
            answer = Some((found.velocity().expect("it is reliable"), found.basis.expect("it is reliable")));
            (extent, acceleration) = (found.extent, found.acceleration);
            break;
        }
        // An event of something before the touch does not show it.
        if let Some(event) = update.event().filter(|event| event.frame + 60 > start) {
            if let Some(taxels) = event.taxels() {
                let law = by_wave(&event, taxels, config);
                answer = law.motion.velocity.filter(|_| law.motion.reliable).zip(law.basis);
                (extent, acceleration) = (law.extent, law.acceleration);
            }
            break;
        }
    }
    Answered { drawn, answer, extent, acceleration, after }
}

/// Returns a velocity's errors of the speed as a fraction and of the direction in degrees, against what its basis
/// tells.
fn errors(truth: &Truth, velocity: Velocity, basis: Basis) -> [f64; 2] {
    let whole = [[truth.mm_s, truth.degrees]];
    let motions = if basis == Basis::Edge && !truth.edges.is_empty() { &truth.edges[..] } else { &whole };
    let of = |&[mm_s, degrees]: &[f64; 2]| {
        let turned = f64::from(velocity.degrees) - degrees;
        [(f64::from(velocity.mm_s) / mm_s - 1.0).abs(), ((turned + 180.0).rem_euclid(360.0) - 180.0).abs()]
    };
    let size = |errors: &[f64; 2]| (errors[0] / WRONG[0]).max(errors[1] / WRONG[1]);
    let nearest = motions.iter().map(of).min_by(|a, b| size(a).total_cmp(&size(b)));
    nearest.expect("there is a motion")
}

fn is_wrong(truth: &Truth, [speed, degrees]: [f64; 2]) -> bool {
    truth.has_none || speed > WRONG[0] || degrees > WRONG[1]
}

/// The results of a row.
#[derive(Default)]
struct Tally {
    count: usize,
    reliable: usize,
    wrong: usize,
    /// Errors of speeds in percent, and of directions in degrees.
    errors: [Vec<f64>; 2],
    /// Speeds and directions within one and two standard deviations.
    within: [[usize; 2]; 2],
}

impl Tally {
    fn new(answered: &[Answered]) -> Self {
        let mut tally = Self::default();
        for one in answered {
            let truth = &one.drawn.truth;
            tally.count += 1;
            let Some((velocity, basis)) = one.answer else { continue };
            let [speed, degrees] = errors(truth, velocity, basis);
            tally.reliable += 1;
            tally.wrong += usize::from(is_wrong(truth, [speed, degrees]));
            let in_sd = [
                speed * f64::from(velocity.mm_s) / (1.0 + speed) / f64::from(velocity.mm_s_sd),
                degrees / f64::from(velocity.degrees_sd),
            ];
            for (within, off) in tally.within.iter_mut().zip(in_sd) {
                within[0] += usize::from(off <= 1.0);
                within[1] += usize::from(off <= 2.0);
            }
            tally.errors[0].push(100.0 * speed);
            tally.errors[1].push(degrees);
        }
        tally
    }

    fn error(&self, of: usize, fraction: f64) -> Option<f64> {
        percentile(self.errors[of].clone(), fraction)
    }

    /// Returns how many are reliable and how many of all are wrong, in percent.
    fn fractions(&self) -> String {
        [self.reliable, self.wrong].map(|count| interval(count, self.count)).join("/")
    }

    /// Returns the names of the columns whose goals are not reached.
    fn missed(&self, goal: &Goal) -> Vec<&'static str> {
        let percent = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
        let mut missed = vec![];
        if goal.reliable.is_some_and(|least| percent(self.reliable, self.count) < least) {
            missed.push("reliable");
        }
        if percent(self.wrong, self.count) > goal.wrong {
            missed.push("wrong");
        }
        let Some(limits) = goal.errors else { return missed };
        for (of, names) in [["speed", "speed sd"], ["direction", "direction sd"]].into_iter().enumerate() {
            let error = |at: usize| self.error(of, [0.5, 0.95][at]);
            if [0, 1].into_iter().any(|at| error(at).is_none_or(|error| error > limits[of][at])) {
                missed.push(names[0]);
            }
            let within = |at: usize| percent(self.within[of][at], self.reliable);
            if [0, 1].into_iter().any(|at| !(WITHIN[at][0]..=WITHIN[at][1]).contains(&within(at))) {
                missed.push(names[1]);
            }
        }
        missed
    }

    /// Returns the cells of a row of the page, with intervals and goals; objects.txt has those of the mix. What misses
    /// its goal is bold.
    fn page(&self, Row { goal, kind, .. }: &Row) -> String {
        let missed = self.missed(goal);
        let has_own = *kind != Kind::Mix;
        let bold = |column: &str, cell| bold(missed.contains(&column), cell);
        let of = |column: &str, count: usize| judged(count, self.count, missed.contains(&column));
        let error = |of: usize, column: &str| {
            let found = [0.5, 0.95].map(|fraction| self.error(of, fraction).map(|error| format!("{error:.2}")));
            let [Some(median), Some(high)] = found else { return bold(column, "–".into()) };
            let most = goal.errors.filter(|_| has_own).map(|most| format!(" ≤{}/{}", most[of][0], most[of][1]));
            bold(column, format!("{median}/{high}")) + &most.unwrap_or_default()
        };
        let within =
            |of: usize, column: &str| bold(column, self.within[of].map(|count| share(count, self.reliable)).join("/"));
        format!(
            "{}{} | {}{} | {} | {} | {}, {} |",
            of("reliable", self.reliable),
            goal.reliable.filter(|_| has_own).map_or_else(String::new, |least| format!(" ≥{least}")),
            of("wrong", self.wrong),
            if has_own { format!(" ≤{}", goal.wrong) } else { String::new() },
            error(0, "speed"),
            error(1, "direction"),
            within(0, "speed sd"),
            within(1, "direction sd"),
        )
    }
}

const PAGE_HEAD: &str = "\
| touch | reliable, % | wrong, % | speed error, %: median/p95 | direction error, °: median/p95 | within 1/2 sd, %: speed, direction |
| --- | --- | --- | --- | --- | --- |";
/// Bounds of the speeds of the table by speed, in mm/s, and its touches of each kind and speed.
const DECADES: [[f64; 2]; 4] = [[10.0, 30.0], [30.0, 100.0], [100.0, 300.0], [300.0, 600.0]];
const OF_DECADE: u64 = 300;

/// Writes the section of the page.
pub(crate) fn section(page: &mut String) {
    page.push_str(include_str!("../objects.txt"));
    let _ = writeln!(page, "{PAGE_HEAD}");
    let mut others = extents::HEADS.map(|head| head.to_owned() + "\n");
    for row in ROWS.iter().chain([&EVEN]) {
        let answered = each(SLIDES, |number| answer(row, SPEEDS, number, false));
        if row.kind != Kind::Even {
            let _ = writeln!(page, "| {} | {}", row.touch, Tally::new(&answered).page(row));
        }
        extents::rows(&mut others, row.touch, row.kind, &answered);
    }
    let [places, accelerations] = others;
    let _ = writeln!(
        page,
        "\nBy speed in mm/s, {OF_DECADE} of each, reliable/wrong in %:\n\n\
         | touch | 10 to 30 | 30 to 100 | 100 to 300 | 300 to 600 |\n| --- | --- | --- | --- | --- |"
    );
    for row in
        ROWS.iter().filter(|row| row.fault == Fault::None && row.goal.reliable.is_some() && row.kind != Kind::Mix)
    {
        let _ = write!(page, "| {} |", row.touch);
        for speeds in DECADES {
            // Other touches than those of the first table.
            let answered = each(OF_DECADE, |number| answer(row, speeds, SLIDES + number, false));
            let tally = Tally::new(&answered);
            let _ = write!(page, " {} |", tally.fractions());
        }
        page.push('\n');
    }
    let _ = write!(
        page,
        "\nThe place and the width of what is lit across the motion, and how many objects it is of:\n\n{places}\n\
         The acceleration, where an edge tells the motion; that of a constant speed is 0:\n\n{accelerations}"
    );
}
