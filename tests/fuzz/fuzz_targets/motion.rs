//! Pushes any features through a trigger, or any light of 25 taxels through a pipeline, and asks all estimators of
//! motion and the detector of slips. Nothing may panic, and answers must be within their documented ranges.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wstac_core::green::gray::Gray;
use wstac_core::law::{Answer, ByWave};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::trigger::{Trigger, TriggerConfig};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::at_once::{AtOnce, answer};
use wstac_core::touch::motion::{
    self, Contact, LiveWave, Motion, MotionConfig, Readout, ReadoutTime, RowOrder, Velocity,
};
use wstac_core::touch::slip::SlipDetector;
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_core::touch::wave::{Extent, Measured, TaxelMotion, Wave, by_wave};

/// Frames of the baseline, which nothing touches.
const BASELINE: usize = 25;
/// Frames of a sample, and of a baseline of taxels, which follow the last light.
const SAMPLE: usize = 70;

fuzz_target!(|data: &[u8]| {
    let Some((&[rate, pitch, rest, readout], data)) = data.split_first_chunk() else { return };
    let rate = FrameRate::new(u32::from(rate) + 1, 1 + u32::from(rest & 1)).expect("a rate above 0");
    let config = MotionConfig::new(0.01 + f32::from(pitch), rate).expect("a pitch from 0.01 to 256 mm");
    let layout = Layout::paper(FrameSize::new(400, 400).expect("a size")).expect("it fits");
    // Unknown, or up to a second either way.
    let time = (rest & 2 > 0).then(|| 8.0 * (f32::from(readout) - 125.0)).and_then(ReadoutTime::from_ms);
    let config = config.with_readout(Readout::of_layout(time, RowOrder::Right, &layout, rate));
    if rest & 4 == 0 {
        of_features(data, config);
    } else {
        let geometry = FrameGeometry::new(Gray, layout, rate).expect("sums fit 32 bits");
        of_taxels(data, geometry, config, [8, 16, 32].map(|bit| rest & bit > 0));
    }
});

fn of_features(data: &[u8], config: MotionConfig) {
    let mut trigger = Trigger::new(TriggerConfig::default());
    for _ in 0..BASELINE {
        trigger.push([-3000; 10], false);
    }
    for frame in data.as_chunks::<20>().0 {
        let features = std::array::from_fn(|k| i16::from_le_bytes([frame[2 * k], frame[2 * k + 1]]));
        if let Some(event) = trigger.push(features, false) {
            for found in [motion::by_coherence(&event, config), motion::by_edges(&event, config)] {
                check(&found);
                assert_eq!(found.velocity.is_some(), found.contact == Contact::Slide, "{found:?}");
            }
        }
    }
}

/// Each frame has a byte of how many are lost or how often it is repeated, and the roots of 25 taxels' light.
fn of_taxels(
    data: &[u8],
    geometry: FrameGeometry<Gray>,
    config: MotionConfig,
    [is_at_once, glows, is_per_touch]: [bool; 3],
) {
    let (rate, most) = (geometry.rate(), geometry.pixels() * geometry.full_scale());
    let trigger = TriggerConfig::default();
    let trigger = if is_per_touch || is_at_once { trigger.one_event_per_touch() } else { trigger };
    let builder = Pipeline::builder(geometry).trigger(trigger).taxels::<TaxelRing>();
    let mut pipeline = builder.build().expect("all parameters are defaults");
    let (mut slips, mut live, mut at_once) = (SlipDetector::new(rate), LiveWave::new(config), AtOnce::new(config));
    let mut wave = Wave::EMPTY;
    let mut light = [0_u32; 25];
    let dark = [[SAMPLE as u8; 26]].into_iter().map(|_| (0, SAMPLE, [0; 25]));
    let frames = data.as_chunks::<26>().0.iter().map(|[how, taxels @ ..]| {
        let times = usize::from(how >> 4);
        if how & 15 == 0 { (times as u64, 0, *taxels) } else { (0, 1 + times, *taxels) }
    });
    for (lost, times, taxels) in dark.clone().chain(frames).chain(dark) {
        for number in 0..times + usize::from(lost > 0) {
            let roots = taxels.map(u32::from);
            // Whiskers may glow on.
            let glow = |taxel: usize| if glows { light[taxel] / 2 } else { 0 };
            light = std::array::from_fn(|taxel| (roots[taxel] * roots[taxel]).max(glow(taxel)).min(65_025));
            let sums = light.map(|light| (u64::from(most) * (300 + u64::from(light)) / 65_325) as u32);
            let is_lost = lost > 0 && number == 0;
            let update = if is_lost { pipeline.push_lost(lost) } else { pipeline.push_taxels(&sums) };
            if let Some(slip) = slips.push(&update) {
                assert!(slip.strength > 0.0 && slip.strength.is_finite(), "{slip:?}");
                assert!(slip.held_since_frame <= slip.onset_frame && slip.onset_frame <= slip.frame, "{slip:?}");
            }
            if let Some(event) = update.event()
                && let Some(taxels) = event.taxels()
            {
                check_taxels(&by_wave(&event, taxels, config));
            }
            let touch = update.touch().or(update.event()).filter(|_| is_at_once);
            let found = touch
                .and_then(|touch| answer(&touch, &ByWave(config), Some(&mut at_once), Some(&slips), |answer| *answer));
            let _ = at_once.end(&update);
            if let Some(found) = found {
                check_answer(&found);
                pipeline.answer_touch();
            }
            let (next_frame, recent) = pipeline.recent();
            let Some(baseline) = pipeline.baseline() else { continue };
            if let Some(touch) = live.push(next_frame, recent, baseline, pipeline.taxel_ring()) {
                assert_eq!(touch.velocity.is_some(), touch.basis.is_some(), "{touch:?}");
                assert!(touch.velocity.is_none() || touch.contact == Contact::Slide, "{touch:?}");
                touch.velocity.iter().for_each(check_velocity);
            }
        }
        if let Some(ring) = pipeline.taxel_ring()
            && let Ok((velocity, _)) = wave.fit(ring.frames(), config)
        {
            check_velocity(&velocity);
            check_extent(&wave.extent(&velocity));
            wave.acceleration().iter().for_each(check_measured);
        }
    }
}

fn check(found: &Motion) {
    assert!((0.0..=1.0).contains(&found.coherence), "{found:?}");
    assert!(found.velocity.is_none() || found.contact == Contact::Slide, "{found:?}");
    assert!(!found.reliable || found.velocity.is_some(), "{found:?}");
    // A press or a poke may be clear, although it has no velocity.
    let is_clear = found.reliable || matches!(found.contact, Contact::Press | Contact::Poke);
    assert!(if found.doubt.is_some() { !found.reliable } else { is_clear }, "{found:?}");
    found.velocity.iter().for_each(check_velocity);
}

fn check_velocity(velocity: &Velocity) {
    let Velocity { mm_s, mm_s_sd, degrees, degrees_sd, .. } = *velocity;
    assert!(mm_s > 0.0 && mm_s.is_finite() && mm_s_sd > 0.0 && mm_s_sd.is_finite(), "{velocity:?}");
    assert!((0.0..360.0).contains(&degrees) && degrees_sd > 0.0 && degrees_sd.is_finite(), "{velocity:?}");
}

fn check_taxels(found: &TaxelMotion) {
    check(&found.motion);
    assert_eq!(found.basis.is_some(), found.motion.reliable, "{found:?}");
    found.extent.iter().for_each(check_extent);
    found.acceleration.iter().for_each(check_measured);
}

fn check_answer(found: &Answer) {
    let is_still = matches!(found.contact, Some(Contact::Press | Contact::Poke));
    assert!(!found.reliable || found.velocity().is_some() || is_still, "{found:?}");
    assert_eq!(found.basis.is_some(), found.reliable && !is_still, "{found:?}");
    found.velocity().iter().for_each(check_velocity);
    found.extent.iter().for_each(check_extent);
    found.acceleration.iter().for_each(check_measured);
}

fn check_extent(extent: &Extent) {
    assert!(extent.contacts <= 2, "{extent:?}");
    assert!(extent.place_mm.is_none_or(|place| place.value.abs() <= 14.0), "{extent:?}");
    assert!(extent.width_mm.is_none_or(|width| width.value > 0.0), "{extent:?}");
    extent.place_mm.iter().chain(&extent.width_mm).for_each(check_measured);
}

fn check_measured(measured: &Measured) {
    assert!(measured.value.is_finite() && measured.sd > 0.0 && measured.sd.is_finite(), "{measured:?}");
}
