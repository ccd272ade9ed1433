//! Live motion: its first answers, its later ones, and those that it must not give.

use std::fmt::Write as _;

use wstac_core::green::gray::Gray;
use wstac_core::layout::Layout;
use wstac_core::params::TAXELS;
use wstac_core::pipeline::Pipeline;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{LiveWave, MotionConfig, Readout, ReadoutTime, RowOrder, Velocity};
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_scene::rng::Rng;
use wstac_scene::specimen::Specimen;
use wstac_scene::{Rest, Scene, SceneConfig, SimulatedFrame, Slide, Truth};

use crate::objects::scenes::{self, Drawn, Fault, draw};
use crate::touches::{Kind, each, script};
use crate::{bold, interval, judged, percentiles, share};

/// Touches of a table.
const SLIDES: u64 = 2000;
const OTHERS: u64 = 1000;
const OBJECTS_EACH: u64 = 300;
const OF_CONDITION: u64 = 96;
/// Bounds of speeds, in mm/s.
const SPEEDS: [f64; 5] = [10.0, 30.0, 100.0, 300.0, 600.0];
/// Width of the sensor between its outer whiskers, in mm.
const SPAN_MM: f64 = 16.0;
/// Frames after an object has left in which its velocity may be said first: that of a short one is known when it has.
const LATEST: f64 = 2.0;
/// Speeds of objects, in mm/s.
const OBJECT_SPEEDS: [f64; 2] = [30.0, 300.0];
/// Off by more than this fraction or these degrees is wrong.
const WRONG: [f64; 2] = [0.1, 10.0];
/// Frames after the leading edge has crossed in which a first velocity is in time.
const IN_TIME: f64 = 3.0;
/// Fraction of lost frames.
const LOST: f64 = 0.05;
/// Frames after the last touch in which a velocity may still be said.
const AFTER: f64 = 1.0;

/// A velocity that was said, and what is true.
struct Said {
    /// Frames after the leading edge has crossed all whiskers.
    delay: f64,
    /// Error of the speed as a fraction, and of the direction in degrees.
    errors: [f64; 2],
}

/// The live answers during a touch.
struct Followed {
    speed_mm_s: f64,
    /// The specimen as in the paper.
    specimen: String,
    said: Vec<Said>,
    /// Velocities that were said while nothing slid.
    wrong: usize,
}

impl Followed {
    fn is_in_time(&self) -> bool {
        self.said.first().is_some_and(|said| said.delay <= IN_TIME)
    }
}

/// Returns the path in mm and the speed in mm/s at the end of each frame.
fn path(slide: &Slide, start: f64, frames: usize, fps: f64) -> Vec<[f64; 2]> {
    const STEPS: u32 = 50;
    let (mut path, mut time, mut rested) = (0.0, start, 0.0);
    let mut rest = slide.rest.map_or(f64::INFINITY, |rest| rest.first_mm);
    (1..=frames)
        .map(|end| {
            let step = (end as f64 - time) / f64::from(STEPS);
            let mut speed = slide.speed_at(path);
            if step > 0.0 {
                for _ in 0..STEPS {
                    speed = slide.speed_at(path);
                    if path >= rest {
                        (speed, rested) = (0.0, rested + step / fps);
                        if let Some(Rest { every_mm, rest_s, .. }) = slide.rest
                            && rested >= rest_s
                        {
                            (rest, rested) = (rest + every_mm, 0.0);
                        }
                        continue;
                    }
                    let middle = speed * step / 2.0 / fps;
                    path += slide.speed_at(path + middle) * step / fps;
                }
                time = end as f64;
            }
            [path, speed]
        })
        .collect()
}

fn said(velocity: Velocity, slide: &Slide, speed: f64, delay: f64) -> Said {
    let off = (f64::from(velocity.mm_s) / speed - 1.0).abs();
    let turned = f64::from(velocity.degrees) - slide.direction_deg;
    let degrees = ((turned + 180.0).rem_euclid(360.0) - 180.0).abs();
    Said { delay, errors: [off, degrees] }
}

/// Frames that are lost by chance, one by one or in runs.
struct Losses {
    rng: Rng,
    /// 0 if none is lost.
    longest: f64,
    left: u32,
}

impl Losses {
    /// Returns whether the next frame is lost.
    fn next(&mut self) -> bool {
        if self.left == 0 && 0.5 * (1.0 + self.longest) * self.rng.uniform() < LOST {
            self.left = (1.0 + self.longest * self.rng.uniform()).min(self.longest) as u32;
        }
        let is_lost = self.left > 0;
        self.left = self.left.saturating_sub(1);
        is_lost
    }
}

/// A scene's first touch, the velocity of each frame, and its light.
struct Replayed {
    velocities: Vec<Option<Velocity>>,
    truth: Truth,
    /// The end of the last touch.
    end_s: f64,
    shots: Vec<[u32; TAXELS]>,
    /// Whether each frame completed a feature frame of which none was lost.
    whole: Vec<bool>,
}

/// Returns what happens in a scene, as 25 taxels tell.
fn replay(script: &SceneConfig, condition: Condition) -> Replayed {
    let rate = script.sensor.rate;
    let layout = Layout::paper(script.sensor.size).expect("the size is that of the layout");
    let geometry = FrameGeometry::new(Gray, layout, rate).expect("sums fit 32 bits");
    let mut pipeline = Pipeline::builder(geometry).taxels::<TaxelRing>().build().expect("all parameters are defaults");
    let time =
        ReadoutTime::from_ms(script.sensor.readout_ms as f32).filter(|_| condition.fault != Fault::UnknownReadout);
    let readout = Readout::of_layout(time, RowOrder::Down, &layout, rate);
    let mut live = LiveWave::new(MotionConfig::published(rate).with_readout(readout));
    let mut scene = Scene::new(script).expect("the scene was drawn within its limits");
    let truth = scene.truth()[0];
    let end_s = scene.truth().iter().map(|truth| truth.end_s).fold(0.0, f64::max);
    let (mut velocities, mut shots, mut whole) = (Vec::new(), Vec::new(), Vec::new());
    let mut losses = Losses { rng: Rng::new(script.seed, 2 << 48), longest: condition.longest, left: 0 };
    while let Some(SimulatedFrame::Taxels(sums)) = scene.next_shot() {
        shots.push(sums);
        let is_lost = losses.next();
        let update = if is_lost { pipeline.push_lost(1) } else { pipeline.push_taxels(&sums) };
        whole.push(update.frame().is_some_and(|frame| !frame.has_missing_frames));
        if is_lost {
            velocities.push(None);
            continue;
        }
        let (next_frame, recent) = pipeline.recent();
        let answer =
            pipeline.baseline().and_then(|baseline| live.push(next_frame, recent, baseline, pipeline.taxel_ring()));
        velocities.push(answer.and_then(|touch| touch.velocity));
    }
    Replayed { velocities, truth, end_s, shots, whole }
}

/// Follows the touch of a number.
fn follow(kind: Kind, number: u64) -> Followed {
    let script = script(kind, number);
    let Replayed { velocities, truth, .. } = replay(&script, PLAIN);
    let end = truth.end_s * 30.0;
    let Some(slide) = truth.touch.slide() else {
        let wrong = velocities.iter().flatten().count();
        return Followed { speed_mm_s: 0.0, specimen: String::new(), said: Vec::new(), wrong };
    };
    let path = path(slide, truth.start, velocities.len(), 30.0);
    let (sine, cosine) = slide.direction_deg.to_radians().sin_cos();
    let crossed = path.iter().position(|[path, _]| *path >= SPAN_MM * (sine.abs() + cosine.abs()));
    let crossed = crossed.unwrap_or(path.len());
    let specimen = Specimen { length_mm: Specimen::ALL[0].length_mm, ..slide.specimen }.to_string();
    let mut followed = Followed { speed_mm_s: slide.speed_mm_s, specimen, said: Vec::new(), wrong: 0 };
    for (frame, velocity) in velocities.into_iter().enumerate() {
        let Some(velocity) = velocity else { continue };
        let [_, speed] = path[frame];
        if frame as f64 > end + AFTER {
            followed.wrong += 1;
        } else {
            followed.said.push(said(velocity, slide, speed, frame as f64 - crossed as f64));
        }
    }
    followed
}

/// Kinds of objects of the table by kind.
const OBJECTS: [(&str, scenes::Kind); 15] = [
    ("wide block", scenes::Kind::Wide),
    ("rod of 3 to 15 mm", scenes::Kind::Rod),
    ("oblique bare edge or rod", scenes::Kind::Oblique),
    ("ball of 5 to 20 mm", scenes::Kind::Ball),
    ("coin of 5 to 20 mm", scenes::Kind::Coin),
    ("block of 6 to 20 mm", scenes::Kind::Block),
    ("corner of a box", scenes::Kind::Corner),
    ("two fingers of one velocity", scenes::Kind::Fingers),
    ("narrow block skewed by 3 to 30°", scenes::Kind::Skewed),
    ("oblique edge, texture behind", scenes::Kind::Textured),
    ("two velocities", scenes::Kind::Two),
    ("twist", scenes::Kind::Twist),
    ("speed that changes", scenes::Kind::Changing),
    ("stop, stick-slip", scenes::Kind::Stick),
    ("slow turn", scenes::Kind::Turn),
];

/// What objects of the table by condition are before.
#[derive(Clone, Copy)]
struct Condition {
    name: &'static str,
    fault: Fault,
    /// Longest run of lost frames.
    longest: f64,
    /// Readout of the rows, if it is not that of the fault.
    readout_ms: Option<f64>,
}

const fn condition(name: &'static str, fault: Fault, longest: f64, readout_ms: Option<f64>) -> Condition {
    Condition { name, fault, longest, readout_ms }
}

const PLAIN: Condition = condition("no fault", Fault::None, 0.0, None);
const CONDITIONS: [Condition; 13] = [
    PLAIN,
    condition("5 % of the frames lost", Fault::None, 1.0, None),
    condition("the same in runs of up to 6", Fault::None, 6.0, None),
    condition("15 frames per second", Fault::Rate(15), 0.0, None),
    condition("60 frames per second", Fault::Rate(60), 0.0, None),
    condition("120 frames per second", Fault::Rate(120), 0.0, None),
    condition("60 frames per second, 5 % lost", Fault::Rate(60), 1.0, None),
    condition("120 frames per second, in runs", Fault::Rate(120), 6.0, None),
    condition("rows read within 20 ms, known", Fault::KnownReadout, 0.0, Some(20.0)),
    condition("33 ms, known", Fault::KnownReadout, 0.0, Some(33.0)),
    condition("20 ms, unknown", Fault::UnknownReadout, 0.0, Some(20.0)),
    condition("33 ms, unknown", Fault::UnknownReadout, 0.0, Some(33.0)),
    condition("one dead whisker", Fault::Dead, 0.0, None),
];

/// The live answers about an object.
#[derive(Clone, Copy, Default)]
struct OfObject {
    /// Frames of the touch.
    frames: usize,
    /// Velocities that were said, and those that were wrong.
    said: usize,
    wrong: usize,
    /// Whether the first one was wrong; `None` if there was none.
    first: Option<bool>,
    /// Whether the first one came within three frames after the last whisker's light, and within two after the end.
    in_time: bool,
    is_latest: bool,
}

/// Returns the frame in which the last whisker that the touch lights exceeds a quarter of its peak.
fn last_lit(shots: &[[u32; TAXELS]]) -> usize {
    let base = shots[0];
    let lights = || (0..TAXELS).map(|taxel| shots.iter().map(move |sums| sums[taxel].saturating_sub(base[taxel])));
    let peaks: Vec<u32> = lights().map(|light| light.max().unwrap_or(0)).collect();
    let highest = peaks.iter().copied().max().unwrap_or(0);
    let lit = lights().zip(&peaks).filter(|(_, peak)| 8 * **peak > highest);
    lit.filter_map(|(mut light, peak)| light.position(|light| 4 * light > *peak)).max().unwrap_or(0)
}

/// Follows the touch of an object. A velocity is wrong if it is neither that of the object in this frame, nor across an
/// edge.
fn follow_object(kind: scenes::Kind, condition: Condition, number: u64) -> OfObject {
    let Drawn { mut script, truth: drawn } = draw(kind, condition.fault, OBJECT_SPEEDS, number);
    script.sensor.readout_ms = condition.readout_ms.unwrap_or(script.sensor.readout_ms);
    let Replayed { velocities, truth, end_s, shots, whole } = replay(&script, condition);
    let rate = script.sensor.rate;
    let (fps, added) = (rate.per_second(), f64::from(rate.frames_added()));
    let end = fps * end_s;
    let mut of = OfObject { frames: (end - truth.start) as usize, ..OfObject::default() };
    let slide = truth.touch.slide();
    let path = slide.map_or_else(Vec::new, |slide| path(slide, truth.start, velocities.len(), fps));
    let last = last_lit(&shots) as f64;
    let mut after = 0.0;
    for (frame, (velocity, is_whole)) in velocities.into_iter().zip(whole).enumerate() {
        // A frame that was lost says nothing.
        after += f64::from(is_whole && frame as f64 + 1.0 - added > end);
        let Some(velocity) = velocity else { continue };
        let is_right = slide.filter(|_| !drawn.has_none && after <= LATEST).is_some_and(|slide| {
            // Whatever turns about a place has the same direction on the sensor all the time.
            let [_, speed] = path[frame];
            let motions = drawn.edges.iter().map(|[mm_s, degrees]| [mm_s / slide.speed_mm_s, *degrees]);
            motions.chain([[1.0, slide.direction_deg]]).any(|[part, degrees]| {
                let turned = f64::from(velocity.degrees) - degrees;
                (f64::from(velocity.mm_s) / (part * speed) - 1.0).abs() <= WRONG[0]
                    && ((turned + 180.0).rem_euclid(360.0) - 180.0).abs() <= WRONG[1]
            })
        });
        of.said += 1;
        of.wrong += usize::from(!is_right);
        if of.first.is_none() {
            of.first = Some(!is_right);
            (of.in_time, of.is_latest) = (frame as f64 <= last + 3.0 * added, after <= LATEST);
        }
    }
    of
}

/// A limit in percent, and on which side of it a goal is.
type Goal = (char, f64);
/// First velocities in time, and wrong ones: of slides of all speeds; and wrong ones of objects, and if the speed
/// changes.
const SLIDES_GOALS: [Goal; 2] = [('≥', 89.5), ('≤', 0.7)];
const WRONG_GOALS: [Goal; 2] = [('≤', 1.0), ('≤', 3.0)];
/// Rods and bare edges within three frames after the last whisker's light.
const SOON_GOAL: Goal = ('≥', 60.0);
/// All velocities of wide blocks that are wrong.
const WIDE_GOAL: f64 = 1.5;

/// Returns a fraction in percent with its interval and its goal, bold if it misses that.
fn beside(count: usize, of: usize, goal: Option<Goal>) -> String {
    let Some((side, limit)) = goal else { return interval(count, of) };
    let percent = 100.0 * count as f64 / of.max(1) as f64;
    let is_missed = of > 0 && if side == '≥' { percent < limit } else { percent > limit };
    format!("{} {side}{limit}", judged(count, of, is_missed))
}

/// Returns the table of live motion by kind of object.
fn objects() -> String {
    let mut page = String::from(
        "| object | first velocity: answered, % of touches | within 3 frames of the last whisker \
         | wrong, % of answered | all velocities: % of frames | wrong, % |\n\
         | --- | --- | --- | --- | --- | --- |\n",
    );
    let mut latest = Vec::new();
    for (name, kind) in OBJECTS {
        let all = each(OBJECTS_EACH, |number| follow_object(kind, PLAIN, number));
        let first: Vec<bool> = all.iter().filter_map(|one| one.first).collect();
        let sum = |of: &dyn Fn(&OfObject) -> usize| all.iter().map(of).sum::<usize>();
        let said = sum(&|one| one.said);
        let count = |of: &dyn Fn(&OfObject) -> bool| all.iter().filter(|one| of(one)).count();
        let is_soon = matches!(kind, scenes::Kind::Rod | scenes::Kind::Oblique);
        let changes = matches!(kind, scenes::Kind::Changing | scenes::Kind::Stick);
        if matches!(kind, scenes::Kind::Ball | scenes::Kind::Coin | scenes::Kind::Block | scenes::Kind::Corner) {
            let count = count(&|one| one.is_latest);
            let kind = name.split(' ').next().unwrap_or(name);
            latest.push(format!("{kind} {}", judged(count, first.len(), count < first.len())));
        }
        // Frames of one touch are alike: they have no interval.
        let wrong = sum(&|one| one.wrong);
        let mut of_all = share(wrong, said);
        if kind == scenes::Kind::Wide {
            of_all = bold(100.0 * wrong as f64 > WIDE_GOAL * said as f64, of_all) + &format!(" ≤{WIDE_GOAL}");
        }
        let _ = writeln!(
            page,
            "| {name} | {} | {} | {} | {} | {of_all} |",
            interval(first.len(), all.len()),
            beside(count(&|one| one.in_time), all.len(), is_soon.then_some(SOON_GOAL)),
            beside(count(&|one| one.first == Some(true)), first.len(), Some(WRONG_GOALS[usize::from(changes)])),
            share(said, sum(&|one| one.frames)),
        );
    }
    let _ = writeln!(
        page,
        "\nFirst velocities at most 2 frames after the end (goal: all), % of answered: {}.",
        latest.join(", ")
    );
    page
}

/// Returns the table of live motion by what the camera does to a mix of objects.
pub(crate) fn cameras() -> String {
    let mut page = String::from(
        "| mix of objects | first velocity: answered, % of touches | wrong, % of answered | all velocities: wrong, % |\n\
         | --- | --- | --- | --- |\n",
    );
    for condition in CONDITIONS {
        let all = each(OF_CONDITION, |number| follow_object(scenes::Kind::Mix, condition, number));
        let first: Vec<bool> = all.iter().filter_map(|one| one.first).collect();
        let wrong = first.iter().filter(|is_wrong| **is_wrong).count();
        let [said, of_them] = [all.iter().map(|one| one.said).sum(), all.iter().map(|one| one.wrong).sum()];
        let [first, wrong] = [share(first.len(), all.len()), share(wrong, first.len())];
        let _ = writeln!(page, "| {} | {first} | {wrong} | {} |", condition.name, share(of_them, said));
    }
    page
}

/// The columns of answers.
fn columns(said: &[&Said]) -> String {
    let of = |number: usize, unit| percentiles(&said.iter().map(|said| said.errors[number]).collect::<Vec<_>>(), unit);
    format!("{} | {} |", of(0, 100.0), of(1, 1.0))
}

const COLUMNS: &str = "speed error, %: median/p95 | direction error, °: median/p95 | wrong, %";

/// Slides of a row of the table: of any direction, and along rows or columns.
type Slides<'a> = [Vec<&'a Followed>; 2];

/// A table of the answers of slides by speed.
fn by_speed(page: &mut String, rows: &[(String, Slides<'_>)]) {
    let _ = writeln!(
        page,
        "| first velocity: speed | in time, % | {COLUMNS} | wrong of all velocities, %: any direction/along rows or columns |\n\
         | --- | --- | --- | --- | --- | --- |"
    );
    // The goals are of all speeds.
    for (number, (name, [slides, straight])) in rows.iter().enumerate() {
        let first: Vec<&Said> = slides.iter().filter_map(|slide| slide.said.first()).collect();
        let in_time = slides.iter().filter(|slide| slide.is_in_time()).count();
        let wrong = first.iter().filter(|said| said.errors[0] > 0.1).count();
        let [soon, most] = SLIDES_GOALS.map(|goal| (number == 0).then_some(goal));
        let all = [slides, straight].map(|slides| {
            let all: Vec<&Said> = slides.iter().flat_map(|slide| &slide.said).collect();
            let is_wrong = |said: &&&Said| said.errors.iter().zip(WRONG).any(|(off, most)| *off > most);
            share(all.iter().filter(is_wrong).count(), all.len())
        });
        let _ = writeln!(
            page,
            "| {name} | {} | {} {} | {} |",
            beside(in_time, slides.len(), soon),
            columns(&first),
            beside(wrong, first.len(), most),
            all.join("/"),
        );
    }
    page.push('\n');
}

/// Writes the tables of live motion.
pub(crate) fn tables(page: &mut String) {
    page.push_str(include_str!("live.txt"));
    let slides = each(SLIDES, |number| follow(Kind::Slide, number));
    let straight = each(OTHERS, |number| follow(Kind::Straight, number));
    let within = |low: f64, high: f64| {
        let own = [&slides, &straight]
            .map(|slides| slides.iter().filter(|slide| (low..high).contains(&slide.speed_mm_s)).collect());
        (format!("{low} to {high} mm/s"), own)
    };
    let mut rows = vec![within(10.0, 600.0)];
    rows.extend(SPEEDS.windows(2).map(|pair| within(pair[0], pair[1])));
    by_speed(page, &rows);
    let by_specimen = Specimen::ALL.map(|specimen| {
        let name = specimen.to_string();
        let own: Vec<&Followed> = slides.iter().filter(|slide| slide.specimen == name).collect();
        let of = |is: fn(&Followed) -> bool| share(own.iter().filter(|slide| is(slide)).count(), own.len());
        format!("{name} {}/{}", of(Followed::is_in_time), of(|slide| !slide.said.is_empty()))
    });
    let _ = writeln!(page, "By specimen, in time/answered, %: {}.\n", by_specimen.join(", "));
    let wrong = |touches: &[Followed]| touches.iter().map(|touch| touch.wrong).sum::<usize>();
    let still = [(Kind::Press, "presses"), (Kind::Poke, "pokes"), (Kind::Hold, "holds")].map(|(kind, name)| {
        let touches = each(OTHERS, |number| follow(kind, number));
        format!("{} of {} {name}", wrong(&touches), touches.len())
    });
    page.push_str(include_str!("live_objects.txt"));
    *page += &objects();
    page.push('\n');
    *page += &cameras();
    page.push('\n');
    let _ = writeln!(
        page,
        "Frames with a velocity while nothing slides: {}, and {} of {} slides, two frames after their end and later.",
        still.join(", "),
        wrong(&slides),
        slides.len()
    );
}
