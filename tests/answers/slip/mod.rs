//! Slip in a grasp: how soon it is reported, and what else is taken for it.

mod streams;

use std::fmt::Write as _;

use wstac_core::touch::slip::{Slip, SlipDetector};
use wstac_host::statistics::percentile;

use crate::touches::each;
use crate::{interval, share};
use streams::{Fault, JUDGE, Kind, Stream, draw, hold};

/// Grasps of a row, of each kind of part with a disturbance, and touches of the other rows.
const GRASPS: u64 = 250;
const OF_FAULT: u64 = 100;
const OTHERS: u64 = 500;
/// A slip should be reported within so many frames.
const SOON: u64 = 3;
/// Speeds of the bands, in mm/s.
const BANDS: [[f64; 2]; 4] = [[10.0, 20.0], [20.0, 50.0], [50.0, 100.0], [100.0, 300.0]];
/// Speeds from which textured and flat parts should be reported.
const TEXTURED: [f64; 2] = [20.0, 300.0];
const FLAT: [f64; 2] = [50.0, 300.0];
/// Time of a hold in s, and holds of each disturbance: 5 hours, and 40 of all together.
const HOLD_S: f64 = 300.0;
const HOLDS: u64 = 60;
const HOLDS_OF_ALL: u64 = 480;

/// The reports of a stream.
struct Watched {
    slips: Vec<Slip>,
    /// The frames of a held part's motion, and whether it was held in the frame before the first.
    moves: Vec<u64>,
    is_held: bool,
    /// Seconds in which something was held.
    held_s: f64,
}

fn watch(stream: &Stream) -> Watched {
    let mut detector = SlipDetector::new(stream.rate);
    let mut watched = Watched { slips: vec![], moves: stream.slips.clone(), is_held: false, held_s: 0.0 };
    let frame_s = f64::from(stream.rate.frames_added()) / stream.rate.per_second();
    for (number, taxels) in &stream.frames {
        if watched.moves.first() > Some(number) {
            watched.is_held = detector.held_since_frame().is_some();
        }
        watched.slips.extend(detector.push_taxels(*number, taxels));
        watched.held_s += if detector.held_since_frame().is_some() { frame_s } else { 0.0 };
    }
    watched
}

fn watched(kind: Kind, fault: Fault, speeds: [f64; 2], count: u64) -> Vec<Watched> {
    each(count, |number| watch(&draw(kind, fault, speeds, JUDGE, number)))
}

impl Watched {
    /// Returns the frames from the first motion to its report; below 0 if it came before.
    fn latency(&self) -> Option<f64> {
        Some(self.slips.first()?.frame as f64 - *self.moves.first()? as f64)
    }

    fn is_soon(&self) -> bool {
        self.latency().is_some_and(|latency| (0.0..=SOON as f64).contains(&latency))
    }
}

/// Returns the part of grasps that were reported in time, and the latency in frames: median and 95th percentile.
fn in_time(watched: &[Watched]) -> String {
    let soon = watched.iter().filter(|one| one.is_soon()).count();
    let latencies: Vec<f64> = watched.iter().filter_map(Watched::latency).filter(|latency| *latency >= 0.0).collect();
    let frames =
        |fraction| percentile(latencies.clone(), fraction).map_or("–".into(), |latency| format!("{latency:.0}"));
    format!("{}, {}/{}", interval(soon, watched.len()), frames(0.5), frames(0.95))
}

/// Returns the parts that were not held, and that were reported before they moved.
fn not_held(watched: &[Watched]) -> [String; 2] {
    let count = |is: &dyn Fn(&Watched) -> bool| share(watched.iter().filter(|one| is(one)).count(), watched.len());
    [count(&|one| !one.is_held), count(&|one| one.latency().is_some_and(|latency| latency < 0.0))]
}

/// Returns the part of streams without a slip that have one.
fn wrong(watched: &[Watched]) -> String {
    share(watched.iter().filter(|one| !one.slips.is_empty()).count(), watched.len())
}

/// Returns the rate of events that came by chance, with its interval of 95 % (Byar).
fn per_hour(count: usize, hours: f64) -> String {
    let limit = |count: f64, side: f64| {
        count * (1.0 - 1.0 / (9.0 * count) + side * 1.96 / (3.0 * count.sqrt())).max(0.0).powi(3) / hours
    };
    let low = if count == 0 { 0.0 } else { limit(count as f64, -1.0) };
    format!("{:.2} ({low:.2}…{:.2})", count as f64 / hours, limit(count as f64 + 1.0, 1.0))
}

/// Writes the section of the page.
pub(crate) fn section(page: &mut String) {
    page.push_str(include_str!("../slip.txt"));
    let _ = writeln!(
        page,
        "| part | 10 to 20 mm/s | 20 to 50 | 50 to 100 | 100 to 300 | goal: 95 |\n| --- | --- | --- | --- | --- | --- |"
    );
    let mut all = vec![];
    for (kind, name, goal) in [(Kind::Textured, "textured", TEXTURED), (Kind::Flat, "flat", FLAT)] {
        let _ = write!(page, "| {name} |");
        for speeds in BANDS.into_iter().chain([goal]) {
            let watched = watched(kind, Fault::None, speeds, GRASPS);
            let _ = write!(page, " {} |", in_time(&watched));
            all.extend(watched);
        }
        page.push('\n');
    }
    let [missed, early] = not_held(&all);
    let _ = writeln!(
        page,
        "\nThe goal is for textured parts from {} mm/s, flat ones from {} mm/s. \
         {missed} % were not held, {early} % reported early.\n\
         With disturbances, {OF_FAULT} of each part at these speeds, {} releases:\n\n\
         | disturbance | in time, % | not held | releases reported |\n| --- | --- | --- | --- |",
        TEXTURED[0],
        FLAT[0],
        2 * OF_FAULT,
    );
    for (fault, name) in [
        (Fault::None, "none"),
        (Fault::All, "noise × 3, drift, tremor, creep"),
        (Fault::Lost, "5 % of the frames lost"),
        (Fault::Rate(15), "15 frames per second"),
        (Fault::Rate(45), "45 frames per second"),
        (Fault::Rate(60), "60 frames per second"),
        (Fault::Dead, "one dead whisker"),
        (Fault::Gains, "gains spread three times"),
        (Fault::Crosstalk, "cross-talk of 5 %"),
        (Fault::Rolling, "readout of 33 ms"),
        (Fault::Slow, "a press at 8 to 30 mm/s"),
        (Fault::Lifted(0), "lifted 2 to 8 times slower"),
        (Fault::Lifted(33), "the same, readout 33 ms"),
        (Fault::RollingSlow, "45 frames per second, readout ±18 ms, a press at 20 to 40 mm/s"),
    ] {
        let mut both = watched(Kind::Textured, fault, TEXTURED, OF_FAULT);
        both.extend(watched(Kind::Flat, fault, FLAT, OF_FAULT));
        let releases = watched(Kind::Release, fault, TEXTURED, 2 * OF_FAULT);
        let [missed, _] = not_held(&both);
        let _ = writeln!(page, "| {name} | {} | {missed} | {} |", in_time(&both), wrong(&releases));
    }
    others(page);
    holds(page);
}

/// Writes what other touches bring.
fn others(page: &mut String) {
    let second = |kind, frames: u64| {
        let watched = watched(kind, Fault::None, [20.0, 300.0], OTHERS);
        let is_second = |one: &&Watched| {
            let from = one.moves.get(1).copied().unwrap_or(u64::MAX);
            one.slips.iter().any(|slip| (from..from.saturating_add(frames)).contains(&slip.frame))
        };
        share(watched.iter().filter(is_second).count(), watched.len())
    };
    let all = [10.0, 300.0];
    let rows = [
        (Kind::Plate, all, "plates lifted as fast as pressed on"),
        (Kind::Slide, all, "slides from the side"),
        (Kind::Along, [15.0, 30.0], "slides along rows or columns at 15 to 30 mm/s"),
        (Kind::Along, [5.0, 15.0], "at 5 to 15 mm/s"),
        (Kind::Press, all, "short presses"),
        (Kind::Poke, all, "pokes"),
        (Kind::Twist, all, "twists without a hold"),
        (Kind::Row, all, "four slides, short presses, pokes or twists in a row"),
    ];
    let said: Vec<String> = rows
        .into_iter()
        .map(|(kind, speeds, name)| format!("{} {} %", name, wrong(&watched(kind, Fault::None, speeds, OTHERS))))
        .collect();
    let _ = writeln!(
        page,
        "\nSlips in other touches, {OTHERS} of each: {}.\n\
         A second slip after a rest of 1.5 s is reported within 10 frames in {} %.\n\
         After a part has slid off, that of a second grasp is in {} %, \
         and {} % of slides and short presses are reported as slips.",
        said.join(", "),
        second(Kind::Again, 10),
        second(Kind::Two, 10),
        second(Kind::Off, u64::MAX),
    );
}

/// Writes how often a hold has a slip.
fn holds(page: &mut String) {
    let _ = write!(page, "Slips per hour of holding (goal: at most 1):");
    for (fault, name, count) in [
        (Fault::Noise, "noise × 3", HOLDS),
        (Fault::Drift, "drift", HOLDS),
        (Fault::Tremor, "tremor", HOLDS),
        (Fault::Creep, "creep", HOLDS),
        (Fault::All, "all four", HOLDS_OF_ALL),
    ] {
        let watched = each(count, |number| watch(&hold(fault, HOLD_S, JUDGE, number)));
        let slips = watched.iter().map(|one| one.slips.len()).sum();
        let hours = watched.iter().map(|one| one.held_s).sum::<f64>() / 3600.0;
        let _ = write!(
            page,
            "{} {name} {} of {hours:.0} h",
            if fault == Fault::Noise { "" } else { "," },
            per_hour(slips, hours)
        );
    }
    page.push_str(".\n\n");
}
