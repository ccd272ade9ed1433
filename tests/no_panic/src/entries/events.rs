//! Entry points from features to events, and from events to answers.

use wstac_core::error::{ConfigError, FrameError};
use wstac_core::features::{FeatureScale, Features};
use wstac_core::green::gray::Gray;
use wstac_core::law::{Answer, AnyLaw, ByCoherence, ByEdges, ByWave, EventLaw};
use wstac_core::layout::Layout;
use wstac_core::ln::fixed::Fixed;
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::baseline_policy::{FixedBaseline, TrackingBaseline};
use wstac_core::paper::direction::{self, Direction, Heading};
use wstac_core::paper::sample::Sample;
use wstac_core::paper::speed::{self, Law, LitSpan, Speed, SpeedConfig, ThresholdOn};
use wstac_core::paper::trigger::{ContactEnd, Event, InterruptedSample, Rule, StreamEnd, Trigger, TriggerConfig};
use wstac_core::pipeline::{Finished, Pipeline, Update};
use wstac_core::rate::FrameRate;
use wstac_core::reason::Reason;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::at_once::{AtOnce, answer};
use wstac_core::touch::crosstalk::Correction;
use wstac_core::touch::motion::{
    self, Contact, LiveContact, LiveMotion, LiveWave, Motion, MotionConfig, Readout, ReadoutTime, RowOrder, Velocity,
};
use wstac_core::touch::path_sample::{self, PathSample};
use wstac_core::touch::slip::{Slip, SlipDetector};
use wstac_core::touch::taxel_ring::{ChosenTaxels, NoTaxels, TaxelRing, TaxelStore};
use wstac_core::touch::wave::{self, Basis, Extent, Measured, TaxelMotion, Wave};

entries! {
    trigger:
    new_config(window: u32, multiplier: f64, backtrack: u32, rule: Rule, margin: f64) -> Result<TriggerConfig, ConfigError> {
        TriggerConfig::new(window, multiplier, backtrack, rule, margin)
    }
    one_event_per_touch(config: TriggerConfig) -> TriggerConfig { config.one_event_per_touch() }
    is_per_touch(config: &TriggerConfig) -> bool { config.is_per_touch() }
    baseline_frames(config: &TriggerConfig) -> u16 { config.baseline_frames() }
    new_default() -> TriggerConfig { TriggerConfig::default() }
    new(config: TriggerConfig, frame: u64) -> Trigger { Trigger::starting_at(config, frame) }
    push<'a>(trigger: &'a mut Trigger, features: Features, has_missing_frames: bool) -> Option<Event<'a>> {
        trigger.push(features, has_missing_frames)
    }
    push_then_lose<'a>(trigger: &'a mut Trigger, features: Features, has_missing_frames: bool, lost: u64) -> Option<Event<'a>> {
        trigger.push_then_lose(features, has_missing_frames, lost)
    }
    lost(trigger: &mut Trigger, frames: u64) -> () { trigger.push_lost(frames) }
    finish<'a>(trigger: &'a mut Trigger) -> Option<Event<'a>> { trigger.finish() }
    end(trigger: &Trigger) -> StreamEnd { trigger.end() }
    next(trigger: &Trigger) -> u64 { trigger.next_frame() }
    settled(trigger: &Trigger) -> u64 { trigger.settled_frame() }
    rezero(trigger: &mut Trigger) -> Option<InterruptedSample> { trigger.rezero() }
    interrupted(trigger: &mut Trigger) -> Option<InterruptedSample> { trigger.take_interrupted() }
    contact_end(trigger: &mut Trigger) -> Option<ContactEnd> { trigger.take_contact_end() }
    contact_end_of_update(update: &Update<'_>) -> Option<ContactEnd> { update.contact_end() }
    contact_end_of_finished(finished: &Finished<'_>) -> Option<ContactEnd> { finished.contact_end() }
    recent<'a>(trigger: &'a Trigger) -> (u64, Sample<'a>) { trigger.recent() }
    baseline(trigger: &Trigger) -> Option<&Baseline> { trigger.baseline() }
    thresholds(trigger: &Trigger) -> Option<&[i32; 10]> { trigger.thresholds() }
    baseline_of_totals(totals: [i32; 10], frames: u16) -> Baseline { Baseline::new(totals, frames) }
}

entries! {
    following:
    new_follow(windows: u32) -> Result<TrackingBaseline, ConfigError> { TrackingBaseline::new(windows) }
    follow_windows(follow: &TrackingBaseline) -> u32 { follow.windows() }
    new_following(config: TriggerConfig, frame: u64, follow: TrackingBaseline) -> Trigger<TrackingBaseline> {
        Trigger::with(config, frame, follow)
    }
    push_following<'a>(trigger: &'a mut Trigger<TrackingBaseline>, features: Features, has_missing_frames: bool, lost: u64) -> Option<Event<'a>> {
        trigger.push_then_lose(features, has_missing_frames, lost)
    }
    finish_following<'a>(trigger: &'a mut Trigger<TrackingBaseline>) -> Option<Event<'a>> { trigger.finish() }
    push_frame<'a>(pipeline: &'a mut Pipeline<Gray, Fixed, TrackingBaseline>, bytes: &[u8]) -> Result<Update<'a>, FrameError> {
        pipeline.push_frame(bytes)
    }
    rezero_following(pipeline: &mut Pipeline<Gray, Fixed, TrackingBaseline>) -> Option<InterruptedSample> { pipeline.rezero() }
    rezero_chosen(trigger: &mut Trigger<Option<TrackingBaseline>>) -> Option<InterruptedSample> { trigger.rezero() }
    push_chosen<'a>(trigger: &'a mut Trigger<Option<TrackingBaseline>>, features: Features, has_missing_frames: bool, lost: u64) -> Option<Event<'a>> {
        trigger.push_then_lose(features, has_missing_frames, lost)
    }
}

entries! {
    event:
    direction(event: &Event<'_>) -> Direction { direction::direction(event) }
    degrees(heading: Heading) -> u16 { heading.degrees() }
    confidence(direction: &Direction) -> Option<f32> { direction.confidence() }
    heading(direction: &Direction) -> Option<Heading> { direction.heading() }
    direction_by_centroids(heading: Result<Heading, Reason>, confidence: u16) -> Direction { Direction::by_centroids(heading, confidence) }
    direction_by_arrival(angle: Result<[f32; 2], Reason>) -> Direction { Direction::by_arrival(angle) }
    speed_by_arrival(mm_s: f32, sd: f32) -> Speed { Speed::by_arrival(mm_s, sd) }
    lit_frames(event: &Event<'_>) -> Option<u8> { event.lit_frames() }
    contact_end_of(frame: u64, event_frame: u64) -> ContactEnd { ContactEnd::new(frame, event_frame) }
    answer_of_ones_own(speed: Result<Speed, Reason>, direction: Direction, reliable: bool) -> Answer {
        Answer::new(speed, direction, reliable)
    }
    has_texture(answer: &Answer) -> bool { answer.has_texture() }
    velocity_of_answer(answer: &Answer) -> Option<Velocity> { answer.velocity() }
    answer_by_duration(law: &SpeedConfig, event: &Event<'_>) -> Answer { law.answer(event) }
    is_law_per_touch(law: &AnyLaw) -> bool { law.is_per_touch() }
    reason(reason: Reason) -> &'static str { reason.as_str() }
    duration(event: &Event<'_>, config: &SpeedConfig) -> Option<LitSpan> { speed::duration(event, config) }
    speed(event: &Event<'_>, config: &SpeedConfig) -> Result<Speed, Reason> { speed::speed(event, config) }
    duration_frames(duration: LitSpan) -> u8 { duration.frames() }
    duration_cut_off(duration: LitSpan) -> bool { duration.is_cut_off() }
    law_speed(law: Law, frames: f32) -> Option<f32> { law.speed(frames) }
    new_speed_config(law: Law, threshold: f64, on: ThresholdOn, rate: FrameRate) -> Result<SpeedConfig, ConfigError> {
        SpeedConfig::new(law, threshold, on, rate)
    }
    speed_fitted_on(config: SpeedConfig, slowest: f32, fastest: f32) -> Result<SpeedConfig, ConfigError> {
        config.fitted_on(slowest, fastest)
    }
    speed_marked(config: &SpeedConfig, mm_s: f32) -> Speed { config.marked(mm_s) }
    new_motion_config(pitch_mm: f32, rate: FrameRate) -> Result<MotionConfig, ConfigError> { MotionConfig::new(pitch_mm, rate) }
    new_published_motion(rate: FrameRate) -> MotionConfig { MotionConfig::published(rate) }
    motion_with_readout(config: MotionConfig, readout: Readout) -> MotionConfig { config.with_readout(readout) }
    motion_readout(config: MotionConfig) -> Readout { config.readout() }
    unknown_readout(rate: FrameRate) -> Readout { Readout::unknown(rate) }
    readout_time(ms: f32) -> Option<ReadoutTime> { ReadoutTime::from_ms(ms) }
    readout_ms(time: ReadoutTime) -> f32 { time.ms() }
    readout_of_layout(time: Option<ReadoutTime>, order: RowOrder, layout: &Layout, rate: FrameRate) -> Readout {
        Readout::of_layout(time, order, layout, rate)
    }
    readout_is_known(readout: Readout) -> bool { readout.is_known() }
    readout_delays(readout: Readout) -> [f32; 2] { readout.delays() }
    contact_name(contact: Contact) -> &'static str { contact.as_str() }
    new_paper_speed(rate: FrameRate) -> SpeedConfig { SpeedConfig::published(rate) }
}

entries! {
    motion:
    by_edges(event: &Event<'_>, config: MotionConfig) -> Motion { motion::by_edges(event, config) }
    by_coherence(event: &Event<'_>, config: MotionConfig) -> Motion { motion::by_coherence(event, config) }
    new_live_motion(config: MotionConfig) -> LiveMotion { LiveMotion::new(config) }
    reset_live_motion(live: &mut LiveMotion) -> () { live.reset() }
    push_live_motion(live: &mut LiveMotion, frame: u64, recent: Sample<'_>, baseline: &Baseline) -> Option<LiveContact> {
        live.push(frame, recent, baseline)
    }
}

entries! {
    live_wave:
    push_live_wave(
        live: &mut LiveWave,
        frame: u64,
        recent: Sample<'_>,
        baseline: &Baseline,
        ring: &TaxelRing
    ) -> Option<LiveContact> {
        live.push(frame, recent, baseline, Some(ring))
    }
}

entries! {
    path:
    new_ring(full_scale: u32) -> TaxelRing { TaxelRing::new(full_scale) }
    start_ring(ring: &mut TaxelRing, geometry: &FrameGeometry<Gray>) -> () { ring.start(geometry) }
    new_ring_of(geometry: &FrameGeometry<Gray>) -> TaxelRing { TaxelRing::of(geometry) }
    push_ring(ring: &mut TaxelRing, sums: &[u32; 25]) -> () { ring.push(sums) }
    fill_ring(ring: &mut TaxelRing, lost: u32) -> () { ring.fill(lost) }
    of_sums(event: &Event<'_>, velocity: &Velocity, config: MotionConfig, frames: u8) -> Option<PathSample> {
        PathSample::of_sums(event, velocity, config, frames)
    }
    of_taxels(ring: &TaxelRing, velocity: &Velocity, config: MotionConfig, frames: u8) -> Option<PathSample> {
        PathSample::of_taxels(ring, velocity, config, frames)
    }
    is_unbroken_ring(ring: &TaxelRing) -> bool { ring.is_unbroken() }
    add_to_ring(ring: &mut TaxelRing, sums: &[u32; 25], is_first: bool) -> () { ring.add(sums, is_first) }
    complete_in_ring(ring: &mut TaxelRing, has_missing_frames: bool) -> () { ring.complete(has_missing_frames) }
    lose_in_ring(ring: &mut TaxelRing) -> () { ring.lose() }
    skip_in_ring(ring: &mut TaxelRing, frames: u64) -> () { ring.skip(frames) }
    numbers_of_ring(ring: &TaxelRing, scale: &FeatureScale) -> [i16; 1750] { ring.numbers(scale) }
    frames_of_ring(ring: &TaxelRing) -> usize { ring.frames().flatten().count() }
    ring_of_ring(ring: &TaxelRing) -> Option<&TaxelRing> { TaxelStore::ring(ring) }
    ring_of_none(store: &NoTaxels) -> Option<&TaxelRing> { store.ring() }
    add_to_chosen(ring: &mut Option<TaxelRing>, sums: &[u32; 25], is_first: bool) -> () { ring.add(sums, is_first) }
    complete_in_chosen(ring: &mut Option<TaxelRing>, has_missing_frames: bool) -> () { ring.complete(has_missing_frames) }
    lose_in_chosen(ring: &mut Option<TaxelRing>) -> () { ring.lose() }
    skip_in_chosen(ring: &mut Option<TaxelRing>, frames: u64) -> () { ring.skip(frames) }
    event_with_taxels<'a>(event: Event<'a>, ring: &'a TaxelRing) -> Event<'a> { event.with_taxels(ring) }
    whole_taxels_of_event<'a>(event: &Event<'a>) -> Option<&'a TaxelRing> { event.whole_taxels() }
    last_frame(event: &Event<'_>) -> (u64, bool, bool) { (event.last_frame(), event.is_event(), event.is_under_way()) }
    touch_of_update<'a>(update: &Update<'a>) -> Option<Event<'a>> { update.touch() }
    answer_touch(pipeline: &mut Pipeline<Gray, Fixed, FixedBaseline, TaxelRing>) -> () { pipeline.answer_touch() }
    taxels_of_event<'a>(event: &Event<'a>) -> Option<&'a TaxelRing> { event.taxels() }
    event_of_update<'a>(update: &Update<'a>) -> Option<Event<'a>> { update.event() }
    event_of_end<'a>(finished: &Finished<'a>) -> Option<Event<'a>> { finished.event() }
    push_frame_keeping<'a>(pipeline: &'a mut Pipeline<Gray, Fixed, FixedBaseline, TaxelRing>, bytes: &[u8]) -> Result<Update<'a>, FrameError> {
        pipeline.push_frame(bytes)
    }
    push_lost_keeping<'a>(pipeline: &'a mut Pipeline<Gray, Fixed, FixedBaseline, TaxelRing>, frames: u64) -> Update<'a> {
        pipeline.push_lost(frames)
    }
    keep_chosen(pipeline: &mut Pipeline<Gray, Fixed, FixedBaseline, ChosenTaxels>) -> () { pipeline.keep_taxels() }
    correct_chosen(pipeline: &mut Pipeline<Gray, Fixed, FixedBaseline, ChosenTaxels>, correction: Option<Correction>) -> () {
        pipeline.set_correction(correction)
    }
    new_correction(weights: [[i16; 25]; 25]) -> Option<Correction> { Correction::new(weights) }
    weights_of_correction(correction: &Correction) -> &[[i16; 25]; 25] { correction.weights() }
    correct_light(correction: &Correction, light: &[u16; 25]) -> [u16; 25] { correction.apply(light) }
    complete_corrected(ring: &mut ChosenTaxels, has_missing_frames: bool) -> () { ring.complete(has_missing_frames) }
    taxels_of_update<'a>(update: &Update<'a>) -> Option<&'a TaxelRing> { update.taxels() }
    fill_from_sums(sample: &mut PathSample, event: &Event<'_>, velocity: &Velocity, config: MotionConfig, frames: u8) -> bool {
        sample.fill_from_sums(event, velocity, config, frames)
    }
    of_touch(event: &Event<'_>, velocity: &Velocity, config: MotionConfig, frames: u8) -> Option<PathSample> {
        PathSample::of_touch(event, velocity, config, frames)
    }
    fill_from_touch(sample: &mut PathSample, event: &Event<'_>, velocity: &Velocity, config: MotionConfig, frames: u8) -> bool {
        sample.fill_from_touch(event, velocity, config, frames)
    }
    period(touch: &Event<'_>, velocity: &Velocity, config: MotionConfig) -> Option<Measured> {
        path_sample::period(touch, velocity, config)
    }
    covers(sample: &PathSample, frames: u8) -> bool { sample.covers(frames) }
}

entries! {
    law:
    answer_by_coherence(law: &ByCoherence, event: &Event<'_>) -> Answer { law.answer(event) }
    answer_by_edges(law: &ByEdges, event: &Event<'_>) -> Answer { law.answer(event) }
}

entries! {
    any_law:
    answer_by_wave(law: &ByWave, event: &Event<'_>) -> Answer { law.answer(event) }
    path_velocity(law: &ByWave, event: &Event<'_>, of_answer: Option<Velocity>) -> Option<Velocity> { law.path_velocity(event, of_answer) }
    answer_at_once(at_once: &mut AtOnce, touch: &Event<'_>, law: &ByWave, slip: &SlipDetector) -> Option<Answer> { answer(touch, law, Some(at_once), Some(slip), |answer| *answer) }
    end_at_once(at_once: &mut AtOnce, update: &Update<'_>) -> Option<ContactEnd> { at_once.end(update) }
    finish_at_once(at_once: &mut AtOnce, end: Option<ContactEnd>) -> [Option<ContactEnd>; 2] { at_once.finish(end) }
    last_end(at_once: &mut AtOnce) -> Option<ContactEnd> { at_once.last_end() }
    restart_at_once(at_once: &mut AtOnce) -> Option<ContactEnd> { at_once.restart() }
    new_at_once(config: MotionConfig) -> AtOnce { AtOnce::new(config) }
    answer_by_any(law: &AnyLaw, event: &Event<'_>) -> Answer { law.answer(event) }
    by_wave(event: &Event<'_>, taxels: &TaxelRing, config: MotionConfig) -> TaxelMotion { wave::by_wave(event, taxels, config) }
}

entries! {
    slip:
    new_slip_detector(rate: FrameRate) -> SlipDetector { SlipDetector::new(rate) }
    push_to_slip(detector: &mut SlipDetector, update: &Update<'_>) -> Option<Slip> { detector.push(update) }
    push_taxels_to_slip(detector: &mut SlipDetector, frame: u64, taxels: &[u16; 25]) -> Option<Slip> { detector.push_taxels(frame, taxels) }
    held_since_frame(detector: &SlipDetector) -> Option<u64> { detector.held_since_frame() }
    new_slip(frame: u64, onset_frame: u64, held_since_frame: u64, strength: f32) -> Slip { Slip::new(frame, onset_frame, held_since_frame, strength) }
}

entries! {
    wave:
    new_wave() -> Wave { Wave::EMPTY }
    fit_wave(wave: &mut Wave, frames: &[Option<[u16; 25]>], config: MotionConfig) -> Result<(Velocity, Basis), Reason> {
        wave.fit(frames.iter().map(Option::as_ref), config)
    }
    fit_wave_of_ring(wave: &mut Wave, ring: &TaxelRing, config: MotionConfig) -> Result<(Velocity, Basis), Reason> {
        wave.fit(ring.frames(), config)
    }
    extent_of_wave(wave: &Wave, velocity: &Velocity) -> Extent { wave.extent(velocity) }
    extent_of_light(light: &[i32; 25], degrees: f32, degrees_sd: f32) -> Extent { Extent::new(light, degrees, degrees_sd) }
}
