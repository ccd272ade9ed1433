//! Properties of the whole pipeline, from bytes to events and answers.

use proptest::prelude::*;
use wstac_core::frame::Stride;
use wstac_core::green::any::Any;
use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::paper::direction;
use wstac_core::paper::speed::{self, Law, SpeedConfig, ThresholdOn};
use wstac_core::paper::trigger::{Event, InterruptedSample, TriggerConfig};
use wstac_core::pipeline::{CompletedFrame, Pipeline, Update};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_tests::OwnedEvent;
use wstac_tests::random::Random;

use super::choice::{any_of, any_picture, any_trigger_config, config, layout_of, lively_trigger_config};

/// An action on a pipeline.
#[derive(Clone, Debug)]
enum PipelineAction {
    Frame(u64),
    Dark,
    ShortFrame(usize),
    Stripe(usize),
    Lost(u64),
    Abandon,
    Finish,
}

fn any_step() -> impl Strategy<Value = PipelineAction> {
    prop_oneof![
        10 => any::<u64>().prop_map(PipelineAction::Frame),
        10 => Just(PipelineAction::Dark),
        1 => (0_usize..5000).prop_map(PipelineAction::ShortFrame),
        5 => (0_usize..5000).prop_map(PipelineAction::Stripe),
        1 => prop_oneof![0_u64..=10, any::<u64>()].prop_map(PipelineAction::Lost),
        1 => Just(PipelineAction::Abandon),
        1 => Just(PipelineAction::Finish),
    ]
}

fn any_rate() -> impl Strategy<Value = FrameRate> {
    let fraction = prop_oneof![
        (1_u32..=1000).prop_map(|fps| (fps, 1)),
        (1_u32..=240_000).prop_map(|fps| (fps, 1001)),
        (1..=u32::MAX, 1..=u32::MAX),
    ];
    fraction.prop_map(|(numerator, denominator)| FrameRate::new(numerator, denominator).unwrap())
}

fn any_law() -> impl Strategy<Value = Law> {
    let number = || any::<u32>().prop_map(f32::from_bits);
    prop_oneof![Just(Law::PUBLISHED), (number(), number()).prop_map(|(intercept, slope)| Law { intercept, slope }),]
}

fn any_speed_config() -> impl Strategy<Value = SpeedConfig> {
    let threshold = prop_oneof![Just(0.0475), 0.0..5.5, any::<u64>().prop_map(f64::from_bits)];
    let on = prop_oneof![Just(ThresholdOn::Absolute), Just(ThresholdOn::AboveBaseline)];
    (any_law(), threshold, on, any_rate()).prop_map(|(law, threshold, on, rate)| {
        SpeedConfig::new(law, threshold, on, rate).unwrap_or_else(|_| SpeedConfig::published(rate))
    })
}

/// Checks that every answer to an event is one that its documentation allows.
fn check_answers(event: &Event<'_>, config: &SpeedConfig) {
    let direction = direction::direction(event);
    assert!(direction.confidence.unwrap() <= 32_768, "{direction:?}");
    let duration = speed::duration(event, config);
    assert!(duration.is_none_or(|duration| duration.first <= duration.last && duration.last < 70));
    if let Ok(speed) = speed::speed(event, config) {
        assert!(speed.mm_s.is_finite() && speed.mm_s >= 0.0, "{speed:?}");
    }
}

/// Collects everything that updates brought.
#[derive(Debug, Default, PartialEq)]
struct Brought {
    frames: Vec<CompletedFrame>,
    events: Vec<OwnedEvent>,
    interrupted: Vec<InterruptedSample>,
}

impl Brought {
    fn take(&mut self, update: &Update<'_>) {
        self.frames.extend(update.frame());
        self.events.extend(update.event().map(OwnedEvent::from));
        self.interrupted.extend(update.interrupted());
    }
}

proptest! {
    #![proptest_config(config(150))]

    #[test]
    fn nothing_panics_for_any_bytes_and_any_configuration(
        picture in any_picture(), rate in any_rate(), trigger in prop_oneof![any_trigger_config(), lively_trigger_config()],
        floor in prop_oneof![Just(0.5), Just(0.0), any::<u64>().prop_map(f64::from_bits)],
        speed in any_speed_config(), kernel in 0..3, steps in prop::collection::vec(any_step(), 0..400),
    ) {
        fn run<L: wstac_core::ln::Ln>(
            camera: FrameGeometry<Any>, floor: f64, trigger: TriggerConfig, speed: &SpeedConfig, steps: &[PipelineAction],
        ) {
            let builder = Pipeline::builder(camera).floor_levels(floor).ln(L::default()).trigger(trigger);
            let Ok(mut pipeline) = builder.build() else { return };
            let mut buffer = vec![0; camera.frame_bytes()];
            for step in steps {
                let update = match *step {
                    PipelineAction::Frame(seed) => {
                        let mut random = Random::new(seed);
                        let most = 1 + random.below(255);
                        buffer.fill_with(|| random.below(most) as u8);
                        pipeline.push_frame(&buffer).ok()
                    }
                    PipelineAction::Dark => {
                        buffer.fill(3);
                        pipeline.push_frame(&buffer).ok()
                    }
                    PipelineAction::ShortFrame(bytes) => pipeline.push_frame(&buffer[..bytes.min(buffer.len())]).ok(),
                    PipelineAction::Stripe(bytes) => pipeline.push_stripe(&buffer[..bytes.min(buffer.len())]).ok(),
                    PipelineAction::Lost(frames) => Some(pipeline.push_lost(frames)),
                    PipelineAction::Abandon => Some(pipeline.abandon_frame()),
                    PipelineAction::Finish => {
                        if let Some(event) = pipeline.finish().event() {
                            check_answers(&event, speed);
                        }
                        None
                    }
                };
                if let Some(event) = update.and_then(|update| update.event()) {
                    check_answers(&event, speed);
                }
                pipeline.end();
            }
        }
        let stride = Stride::try_from(picture.stride as u32).unwrap();
        let camera = FrameGeometry::with_stride(any_of(&picture), layout_of(&picture), rate, stride)
            .and_then(|camera| camera.with_bytes_per_row(picture.bytes_per_row as u32));
        // The rate may be too high for 32 bits.
        let Ok(camera) = camera else { return Ok(()) };
        match kernel {
            0 => run::<Fixed>(camera, floor, trigger, &speed, &steps),
            1 => run::<Libm>(camera, floor, trigger, &speed, &steps),
            _ => run::<Micromath>(camera, floor, trigger, &speed, &steps),
        }
    }

    #[test]
    fn losses_add_up(
        config in lively_trigger_config(), fps in prop_oneof![Just(30_u32), 1_u32..400], seed in any::<u64>(),
    ) {
        let mut random = Random::new(seed);
        let rate = FrameRate::new(fps, 1).unwrap();
        let layout = Layout::paper(FrameSize::new(5, 5).unwrap()).unwrap();
        let camera = FrameGeometry::new(Gray, layout, rate).unwrap();
        let mut once = Pipeline::builder(camera).trigger(config).build().unwrap();
        let mut twice = once.clone();
        let (mut first, mut second) = (Brought::default(), Brought::default());
        for frame in 0..300 * rate.frames_added() {
            let bytes = [if frame / 90 % 2 == 1 { 150 } else { 10 } + random.below(9) as u8; 25];
            first.take(&once.push_frame(&bytes).unwrap());
            // Stripes give what the whole frame does.
            second.take(&twice.push_stripe(&bytes[..10]).unwrap());
            second.take(&twice.push_stripe(&bytes[10..]).unwrap());
            if random.below(20) == 0 {
                let most = [3, 12, 300][random.below(3) as usize];
                let (a, b) = (random.below(most), random.below(most));
                first.take(&once.push_lost(a + b));
                second.take(&twice.push_lost(a));
                second.take(&twice.push_lost(b));
            }
            prop_assert_eq!(once.end().frames, twice.end().frames);
            prop_assert_eq!(&first.interrupted, &second.interrupted);
        }
        let (end_of_once, end_of_twice) = (once.finish(), twice.finish());
        first.events.extend(end_of_once.event().map(OwnedEvent::from));
        second.events.extend(end_of_twice.event().map(OwnedEvent::from));
        prop_assert_eq!(first, second);
        prop_assert_eq!(end_of_once.interrupted(), end_of_twice.interrupted());
        prop_assert_eq!(end_of_once.end(), end_of_twice.end());
    }
}
