//! Tests answers about events: those of the wave, those of coherence, and those of neither.

use super::{Basis, Wave};
use crate::green::gray::Gray;
use crate::law::{Answer, ByCoherence, ByWave, EventLaw};
use crate::layout::{FrameSize, Layout};
use crate::ln::fixed::Fixed;
use crate::paper::baseline_policy::FixedBaseline;
use crate::paper::speed::SpeedConfig;
use crate::paper::trigger::{ContactEnd, InterruptedSample, TriggerConfig};
use crate::pipeline::Pipeline;
use crate::rate::FrameRate;
use crate::reason::Reason;
use crate::taxels::FrameGeometry;
use crate::touch::at_once::{AtOnce, answer};
use crate::touch::motion::{Contact, MotionConfig, Readout, Velocity};
use crate::touch::taxel_ring::{TaxelRing, TaxelStore};

/// Full scale of a taxel's sum.
const FULL: f64 = 637_500.0;
/// The frame in which a touch's light reaches the middle.
const MIDDLE: f64 = 60.0;

/// A touch: the light of a whisker in a frame, by its place to the right of the middle and above it, in pitches.
type Light<'a> = &'a dyn Fn(f64, f64, f64) -> f64;

/// An event's answer by 25 taxels and by coherence.
struct Found {
    wave: Answer,
    coherence: Answer,
    /// Why the wave alone has no velocity.
    refused: Option<Reason>,
    /// The velocity for a sample along the path.
    path: Option<Velocity>,
    frames_filled: u8,
    /// The number of the sample's last frame.
    last: usize,
}

/// Returns the sums of a frame of this light.
fn sums(light: Light<'_>, frame: usize) -> [u32; 25] {
    core::array::from_fn(|taxel| {
        let (x, y) = ((taxel % 5) as f64 - 2.0, 2.0 - (taxel / 5) as f64);
        let noise = ((frame * 7 + taxel * 3) % 5) as f64 * 1e-6;
        (FULL * (0.004 + 0.3 * light(frame as f64, x, y) + noise)) as u32
    })
}

fn pipeline<T: TaxelStore>(trigger: TriggerConfig) -> Pipeline<Gray, Fixed, FixedBaseline, T> {
    let layout = Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap();
    let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap();
    Pipeline::builder(geometry).trigger(trigger).taxels::<T>().build().unwrap()
}

fn config() -> MotionConfig {
    MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL)
}

/// Returns the first event of 200 frames of which some are lost. The stream ends in front of frame `end`.
fn found<T: TaxelStore>(light: Light<'_>, lost: &[usize], end: usize) -> Found {
    let mut pipeline = pipeline::<T>(TriggerConfig::default().one_event_per_touch());
    let config = config();
    let of = |event: crate::paper::trigger::Event<'_>| Found {
        wave: ByWave(config).answer(&event),
        coherence: ByCoherence(config).answer(&event),
        refused: event.taxels().and_then(|taxels| Wave::EMPTY.clone().fit(taxels.frames(), config).err()),
        path: ByWave(config).path_velocity(&event, ByWave(config).answer(&event).velocity()),
        frames_filled: event.frames_filled,
        last: event.frame as usize + 69,
    };
    for frame in 0..end {
        let is_lost = lost.contains(&frame);
        let update = if is_lost { pipeline.push_lost(1) } else { pipeline.push_taxels(&sums(light, frame)) };
        if let Some(event) = update.event() {
            return of(event);
        }
    }
    of(pipeline.finish().event().expect("the touch has an event"))
}

fn kept(light: Light<'_>, lost: &[usize]) -> Found {
    found::<TaxelRing>(light, lost, 200)
}

/// Light of a flash that rises in a frame and fades in `fade`.
fn flash(t: f64, fade: f64) -> f64 {
    (-(t / fade).max(0.0)).exp() / (1.0 + (-t / 0.5).exp())
}

/// Something slides at this speed and angle. Its light across the motion is that of `cut`, in pitches to the left.
fn slide(mm_s: f64, degrees: f64, cut: impl Fn(f64) -> f64) -> impl Fn(f64, f64, f64) -> f64 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let slowness = 120.0 / mm_s;
    move |t, x, y| {
        let late = t - MIDDLE - slowness * (x * cosine + y * sine);
        cut(y * cosine - x * sine) * flash(late, 3.0)
    }
}

fn rod(left: f64) -> f64 {
    (-left.powi(2) / 0.8).exp()
}

fn check(answer: &Answer, mm_s: f64, degrees: f64, basis: Basis) {
    let velocity = answer.velocity().unwrap();
    assert!((f64::from(velocity.mm_s) / mm_s - 1.0).abs() < 0.02, "{answer:?}");
    assert!((f64::from(velocity.degrees) - degrees).abs() < 2.0, "{answer:?}");
    assert_eq!((answer.reliable, answer.doubt, answer.basis), (true, None, Some(basis)));
}

#[test]
fn slides_have_the_velocity_of_the_wave() {
    let narrow = kept(&slide(60.0, 30.0, rod), &[]);
    check(&narrow.wave, 60.0, 30.0, Basis::Outline);
    assert!(narrow.wave.extent.is_some_and(|extent| extent.contacts == 1));
    // Coherence takes it for an edge.
    assert_ne!(narrow.coherence.doubt, None);
    check(&kept(&slide(150.0, 200.0, |_| 1.0), &[]).wave, 150.0, 200.0, Basis::Edge);
}

#[test]
fn what_does_not_slide_is_reliable_as_by_coherence() {
    let press = |t: f64, _: f64, _: f64| flash(t - MIDDLE, 3.0);
    let poke = |t: f64, x: f64, y: f64| if (x, y) == (1.0, 0.0) { flash(t - MIDDLE, 3.0) } else { 0.0 };
    // Held for a second.
    let hold = |t: f64, _: f64, _: f64| flash(t - MIDDLE, 3.0) + 0.9 * flash(t - MIDDLE - 30.0, 3.0);
    let touches: [(Light<'_>, Contact); 3] =
        [(&press, Contact::Press), (&poke, Contact::Poke), (&hold, Contact::Press)];
    for (light, contact) in touches {
        let Found { wave, coherence, .. } = kept(light, &[]);
        assert_eq!((wave.contact, wave.reliable, wave.doubt), (Some(contact), true, None), "{contact:?}");
        assert_eq!((wave.velocity(), wave.basis, wave.extent), (None, None, None));
        assert_eq!((coherence.contact, coherence.reliable), (wave.contact, wave.reliable));
    }
}

#[test]
fn a_slow_wide_touch_has_the_velocity_of_coherence() {
    let found = kept(&slide(13.0, 0.0, |_| 1.0), &[]);
    // The wave sees the flash of the first column.
    assert_eq!(found.refused, Some(Reason::NoSlide(Contact::Press)));
    check(&found.wave, 13.0, 0.0, Basis::Edge);
    assert_eq!(found.wave.extent, None);
    // Not if a corner stays dark.
    let dark = kept(&|t, x, y| if x + y > 3.5 { 0.0 } else { slide(13.0, 0.0, |_| 1.0)(t, x, y) }, &[]);
    assert!(dark.coherence.reliable && dark.refused == found.refused);
    assert_eq!((dark.wave.reliable, dark.wave.doubt, dark.wave.basis), (false, Some(Reason::NotAlike), None));
}

#[test]
fn what_the_wave_refuses_is_not_reliable() {
    // A press, and then a slide.
    let press = |t: f64| flash(t - MIDDLE + 25.0, 1.0);
    let found = kept(&|t, x, y| press(t) + slide(150.0, 30.0, |_| 1.0)(t, x, y), &[]);
    assert_eq!(found.refused, Some(Reason::NoSlide(Contact::Press)));
    assert_eq!((found.wave.reliable, found.wave.basis, found.wave.extent), (false, None, None));
    assert!(found.wave.doubt.is_some() && found.wave.doubt == found.coherence.doubt);
    // Two fingers, of which one is a quarter faster.
    let fingers = |t: f64, x: f64, y: f64| {
        let mm_s = if y > 0.0 { 120.0 } else { 160.0 };
        slide(mm_s, 0.0, |left| f64::from(left.abs() > 1.5))(t, x, y)
    };
    let found = kept(&fingers, &[]);
    assert_eq!((found.wave.reliable, found.wave.doubt), (false, Some(Reason::TwoObjects)));
    assert_eq!((found.wave.basis, found.wave.velocity().is_some()), (None, found.coherence.velocity().is_some()));
    let extent = found.wave.extent.unwrap();
    assert_eq!((extent.contacts, extent.place_mm, extent.width_mm), (2, None, None));
}

#[test]
fn a_slide_that_changes_its_speed_has_no_velocity_and_taps_are_pokes() {
    // From 150 to 75 mm/s.
    let slower = |t: f64, x: f64, _: f64| flash(t - MIDDLE - 1.1 * x - 0.15 * x * x, 3.0);
    let found = kept(&slower, &[]);
    assert_eq!((found.refused, found.wave.doubt), (Some(Reason::SpeedChanges), Some(Reason::SpeedChanges)));
    assert_eq!((found.wave.contact, found.wave.reliable, found.wave.basis), (Some(Contact::Slide), false, None));
    assert_eq!(found.wave.speed.err(), Some(Reason::SpeedChanges));
    assert_eq!((found.wave.velocity(), found.path), (None, found.coherence.velocity()));
    assert!(found.path.is_some());
    // One whisker is lit eight times.
    let taps = |t: f64, x: f64, y: f64| {
        let of = |tap: u32| flash(t - MIDDLE - 6.0 * f64::from(tap), 0.5);
        if (x, y) == (1.0, 0.0) { (0..8).map(of).sum() } else { 0.0 }
    };
    let found = kept(&taps, &[]);
    assert_eq!(found.refused, Some(Reason::SpeedChanges));
    assert_eq!((found.wave.contact, found.wave.reliable), (Some(Contact::Poke), true));
}

/// Checks that light from before a loss is not that of the touch.
#[test]
fn only_frames_that_arrived_light_whiskers() {
    let mut ring = TaxelRing::new(u16::MAX.into());
    (0..70).for_each(|frame| ring.push(&[if frame < 5 { 9 } else { 1000 }; 25]));
    assert!(ring.are_all_lit());
    ring.lose();
    let one = |light| core::array::from_fn(|taxel| if taxel == 3 { light } else { 9 });
    (0..20).for_each(|frame| ring.push(&one(if frame < 5 { 9 } else { 1000 })));
    assert!(!ring.are_all_lit());
    ring.skip(40);
    assert!(!ring.are_all_lit());
    (0..3).for_each(|_| ring.push(&[1000; 25]));
    assert!(ring.are_all_lit());
}

#[test]
fn an_event_that_is_not_reliable_stays_so() {
    let touch = slide(60.0, 30.0, |_| 1.0);
    let lost: [usize; 8] = core::array::from_fn(|number| 52 + 2 * number);
    let found = kept(&touch, &lost);
    assert_eq!((found.frames_filled, found.wave.reliable, found.wave.doubt), (8, false, Some(Reason::LostFrames)));
    assert_eq!((found.wave.basis, found.wave.extent), (None, None));
}

#[test]
fn a_sample_that_ends_with_lost_frames_has_its_taxels() {
    let touch = slide(60.0, 30.0, rod);
    let last = kept(&touch, &[]).last;
    for lost in 1..=7 {
        let lost: std::vec::Vec<_> = (last + 1 - lost..=last).collect();
        let found = kept(&touch, &lost);
        assert_eq!(usize::from(found.frames_filled), lost.len());
        check(&found.wave, 60.0, 30.0, Basis::Outline);
    }
    // The stream ends with them, or frames behind the sample are lost, too.
    check(&found::<TaxelRing>(&touch, &[last - 1, last], last + 1).wave, 60.0, 30.0, Basis::Outline);
    check(&kept(&touch, &[last - 1, last, last + 1, last + 2]).wave, 60.0, 30.0, Basis::Outline);
}

#[test]
fn without_taxels_no_slide_is_reliable() {
    let wide = slide(150.0, 30.0, |_| 1.0);
    let found = |light: Light<'_>| found::<Option<TaxelRing>>(light, &[], 200);
    let Found { wave, coherence, .. } = found(&wide);
    assert!(coherence.reliable);
    assert_eq!((wave.reliable, wave.doubt, wave.basis), (false, Some(Reason::LostFrames), None));
    let press = found(&|t, _, _| flash(t - MIDDLE, 3.0)).wave;
    assert_eq!((press.contact, press.reliable, press.doubt), (Some(Contact::Press), true, None));
}

/// The answers at once about 320 frames, and the ends of touches.
#[derive(Default)]
struct AtOnceOf {
    /// Each answer, the frame in which it came, and the frames of its sample.
    answers: std::vec::Vec<(u64, u8, Answer)>,
    ends: std::vec::Vec<ContactEnd>,
    interrupted: std::vec::Vec<InterruptedSample>,
}

impl AtOnceOf {
    fn new(light: Light<'_>, lost: &[u64]) -> Self {
        Self::of(|frame| sums(light, frame as usize), lost, |_| true)
    }

    /// Follows frames of these sums. `takes` says whether the program takes an answer in this frame.
    fn of(sums: impl Fn(u64) -> [u32; 25], lost: &[u64], takes: impl Fn(u64) -> bool) -> Self {
        let mut pipeline = pipeline::<TaxelRing>(TriggerConfig::default().one_event_per_touch());
        let (law, mut at_once, mut found) = (ByWave(config()), AtOnce::new(config()), Self::default());
        for frame in 0..320 {
            let is_lost = lost.contains(&frame);
            let update = if is_lost { pipeline.push_lost(1) } else { pipeline.push_taxels(&sums(frame)) };
            found.interrupted.extend(update.interrupted());
            let touch = update.event().or(update.touch());
            let answer =
                touch.and_then(|touch| answer(&touch, &law, Some(&mut at_once), None, |answer| (touch, *answer)));
            found.ends.extend(at_once.end(&update));
            let Some((touch, answer)) = answer.filter(|_| takes(frame)) else { continue };
            assert_eq!(touch.lit_frames().is_none(), touch.end_frame.is_none());
            assert_eq!(answer.duration, touch.lit_frames());
            found.answers.push((frame, touch.frames, answer));
            pipeline.answer_touch();
        }
        found.ends.extend(at_once.last_end());
        found
    }

    /// Returns the only answer.
    fn one(&self) -> (u64, u8, &Answer) {
        let [(frame, frames, answer)] = &self.answers[..] else { panic!("{:?}", self.answers) };
        (*frame, *frames, answer)
    }
}

#[test]
fn an_answer_that_is_not_taken_comes_again() {
    let rod = slide(60.0, 30.0, rod);
    let first = AtOnceOf::new(&rod, &[]).one().0;
    let found = AtOnceOf::of(|frame| sums(&rod, frame as usize), &[], |frame| frame > first + 3);
    assert_eq!(found.one().0, first + 4);
    check(found.one().2, 60.0, 30.0, Basis::Outline);
}

#[test]
fn an_event_has_one_end_that_of_its_last_light() {
    let edge = slide(40.0, 30.0, |_| 1.0);
    let end_of = |light: Light<'_>| AtOnceOf::new(light, &[]).ends.iter().map(|end| end.frame).next_back();
    // The two ends of a block, and two strokes of a robot: 93 and 147 mm apart.
    for (later, events) in [(70_u32, 1), (110, 2)] {
        let found = AtOnceOf::new(&|t, x, y| edge(t, x, y) + edge(t - f64::from(later), x, y), &[]);
        assert_eq!((found.answers.len(), found.ends.len()), (events, events), "{:?}", found.ends);
        assert_eq!(found.ends.last().map(|end| end.frame - u64::from(later)), end_of(&edge));
    }
    // A stream that ends while the other end is under way.
    let (mut pipeline, mut at_once, law) = (
        pipeline::<TaxelRing>(TriggerConfig::default().one_event_per_touch()),
        AtOnce::new(config()),
        ByWave(config()),
    );
    let (mut answers, mut ends) = (0, 0);
    for frame in 0..150 {
        let update = pipeline.push_taxels(&sums(&|t, x, y| edge(t, x, y) + edge(t - 70.0, x, y), frame));
        let is_answered = update
            .touch()
            .or(update.event())
            .is_some_and(|touch| answer(&touch, &law, Some(&mut at_once), None, |_| ()).is_some());
        answers += usize::from(is_answered);
        ends += usize::from(at_once.end(&update).is_some());
        if is_answered {
            pipeline.answer_touch();
        }
    }
    let finished = pipeline.finish();
    ends += at_once.finish(finished.contact_end()).iter().flatten().count();
    assert_eq!((answers, ends), (1, 1));
}

/// Checks that this law answers both of two strokes, 147 mm apart, as it does without [`AtOnce`].
fn check_law(law: &impl EventLaw, trigger: TriggerConfig) {
    let edge = slide(40.0, 30.0, |_| 1.0);
    let light: Light<'_> = &|t, x, y| edge(t, x, y) + edge(t - 110.0, x, y);
    let (mut pipeline, mut at_once, mut events) = (pipeline::<TaxelRing>(trigger), AtOnce::new(config()), 0);
    for frame in 0..300 {
        let update = pipeline.push_taxels(&sums(light, frame));
        assert!(update.touch().is_none_or(|touch| answer(&touch, law, Some(&mut at_once), None, |_| ()).is_none()));
        if let Some(event) = update.event() {
            assert_eq!(answer(&event, law, Some(&mut at_once), None, |answer| *answer), Some(law.answer(&event)));
            events += 1;
        }
    }
    assert_eq!(events, 2);
}

#[test]
fn events_by_other_laws_are_as_without() {
    check_law(&SpeedConfig::published(FrameRate::NOMINAL), TriggerConfig::default());
    check_law(&ByCoherence(config()), TriggerConfig::default().one_event_per_touch());
}

/// Black, saturated, a lit whisker, and sums beyond full scale: there is no velocity, and nothing before 70 frames.
#[test]
fn extremes_are_not_answered_before_their_events() {
    let lit = |light, of: fn(usize) -> bool| core::array::from_fn(|taxel| if of(taxel) { light } else { 2550 });
    let all = |_| true;
    for (bright, events) in [
        (lit(0, all), 0),
        (lit(FULL as u32, all), 1),
        (lit(FULL as u32, |taxel| taxel == 12), 1),
        (lit(u32::MAX, all), 1),
        (lit(u32::MAX, |taxel| taxel % 2 == 0), 1),
    ] {
        for until in [61, 75, 320] {
            let found =
                AtOnceOf::of(|frame| if (60..until).contains(&frame) { bright } else { lit(2550, all) }, &[], |_| true);
            assert_eq!(found.answers.len(), events, "{bright:?} until {until}");
            assert!(found.answers.iter().all(|(_, frames, answer)| *frames == 70 && answer.velocity().is_none()));
        }
    }
}
