//! Tests the ends of every range of answers and of real parameters. Each test names an extreme and what is guaranteed
//! there.

use wstac_core::error::ConfigError;
use wstac_core::features::{FeatureScale, Features, Floor};
use wstac_core::ln::fixed::Fixed;
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::direction;
use wstac_core::paper::sample::Sample;
use wstac_core::paper::speed::{self, Law, SpeedConfig, ThresholdOn};
use wstac_core::paper::trigger::{Event, Rule, TriggerConfig};
use wstac_core::rate::FrameRate;
use wstac_core::reason::Reason;
use wstac_tests::extreme::{DARK, feature};

/// Values that are wrong for real numbers: refused or harmless everywhere.
const NOT_NUMBERS: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

/// Returns what `answer` gives for a sample that is lit over `lit`, above a dark baseline.
fn with_event<T>(lit: core::ops::Range<usize>, answer: impl Fn(&Event<'_>) -> T) -> T {
    let mut frames = [[DARK; 10]; 70];
    frames[lit].fill([-2000; 10]);
    let baseline = Baseline::new([25 * i32::from(DARK); 10], 25);
    let sample = Sample::from_frames(&frames);
    answer(&Event::new(0, sample, &baseline))
}

/// Durations of 0, of 67 (the longest that is not cut off) and of 69 frames, and none.
#[test]
fn durations_0_and_69() {
    let config = SpeedConfig::published(FrameRate::NOMINAL);
    let duration =
        |lit| with_event(lit, |event| speed::duration(event, &config).map(|d| (d.first, d.last, d.frames())));
    let answer = |lit| with_event(lit, |event| speed::speed(event, &config));
    let law = |frames: f64| 10_f64.powf((151.06 - frames) / 56.29);
    let close = |found: f32, frames: f64| (f64::from(found) / law(frames) - 1.0).abs() < 1e-5;
    for frame in 1..69 {
        assert_eq!(duration(frame..frame + 1), Some((frame as u8, frame as u8, 0)));
        let speed = answer(frame..frame + 1).unwrap();
        assert!(close(speed.mm_s, 0.0) && speed.extrapolated, "{speed:?}");
    }
    assert_eq!(duration(1..69), Some((1, 68, 67)));
    let slowest = answer(1..69).unwrap();
    assert!(close(slowest.mm_s, 67.0) && slowest.extrapolated, "{slowest:?}");
    assert_eq!(duration(0..70), Some((0, 69, 69)));
    for (lit, frames) in [(0..70, 69.0), (0..1, 0.0), (69..70, 0.0), (0..69, 68.0), (1..70, 68.0)] {
        let Err(Reason::CutOff { at_most: Some(bound) }) = answer(lit.clone()) else {
            panic!("{lit:?} is not cut off")
        };
        assert!(close(bound, frames), "{lit:?}: {bound}");
    }
    assert_eq!((duration(0..0), answer(0..0)), (None, Err(Reason::NeverValid)));
    // Without any light above baseline there is no direction either.
    let direction = with_event(0..0, direction::direction);
    assert_eq!((direction.degrees, direction.confidence), (Err(Reason::NeverLit), Some(0)));
}

/// The law where 32 bits end: no speed, never an infinite or negative one.
#[test]
fn the_speed_law_where_32_bits_end() {
    let config = |law, rate| SpeedConfig::new(law, 0.0475, ThresholdOn::Absolute, rate).unwrap();
    let answer = |law, rate, lit| with_event(lit, |event| speed::speed(event, &config(law, rate)));
    let paper = |intercept, slope| Law { intercept, slope };
    assert_eq!(answer(paper(f32::MAX, 56.29), FrameRate::NOMINAL, 20..31), Err(Reason::OutsideLaw));
    assert_eq!(answer(paper(f32::MAX, 56.29), FrameRate::NOMINAL, 0..11), Err(Reason::CutOff { at_most: None }));
    assert_eq!(paper(f32::MAX, 56.29).speed(10.0), None);
    assert_eq!(paper(151.06, f32::MIN_POSITIVE).speed(10.0), None);
    assert_eq!(paper(f32::MIN, 56.29).speed(10.0), None);
    assert!(paper(151.06, f32::MAX).speed(10.0).is_some_and(|mm_s| (mm_s - 1.0).abs() < 1e-6));
    // One frame per second: 30 nominal frames each, so one frame of difference is 30.
    let slow = FrameRate::new(1, 1).unwrap();
    let speed = answer(Law::PUBLISHED, slow, 20..22).unwrap();
    assert!((f64::from(speed.mm_s) / 10_f64.powf((151.06 - 30.0) / 56.29) - 1.0).abs() < 1e-5, "{speed:?}");
    // The slowest possible rate over the longest sample: no overflow, and a speed that is too small for 32 bits is no
    // answer instead of 0.
    let slowest = FrameRate::new(1, u32::MAX).unwrap();
    assert_eq!(answer(Law::PUBLISHED, slowest, 1..69), Err(Reason::OutsideLaw));
}

/// NaN, infinities, subnormal numbers, negative zero and negative numbers in every real parameter: refused, or as
/// harmless as zero.
#[test]
fn not_numbers_are_refused_or_harmless() {
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
    let tiny = f64::from_bits(1);
    for bad in NOT_NUMBERS.into_iter().chain([-tiny, -1.0, f64::MIN]) {
        let floor = Floor::new(bad, 255).unwrap_err();
        assert!(matches!(floor, ConfigError::FloorLevels(found) if same(found, bad)), "{bad}");
        for rule in [Rule::Literal, Rule::Signed] {
            let multiplier = TriggerConfig::new(5, bad, 10, rule, 0.2).unwrap_err();
            assert!(matches!(multiplier, ConfigError::Multiplier(found) if same(found, bad)), "{bad}");
            let margin = TriggerConfig::new(5, 1.2, 10, rule, bad).unwrap_err();
            assert!(matches!(margin, ConfigError::Margin(found) if same(found, bad)), "{bad}");
        }
    }
    for zero in [0.0, -0.0, tiny, f64::MIN_POSITIVE] {
        let config = |b, margin| TriggerConfig::new(5, b, 10, Rule::Literal, margin).unwrap();
        assert_eq!(config(zero, 0.2), config(0.0, 0.2));
        assert_eq!(config(1.2, zero), config(1.2, 0.0));
        assert!(TriggerConfig::new(5, zero, 10, Rule::Signed, 0.2).is_err());
    }
    let floor = |levels| {
        Floor::new(levels, 255)
            .and_then(|floor| FeatureScale::<Fixed>::new(100, 255, 1, floor))
            .map(|scale| scale.floor())
    };
    assert_eq!(floor(-0.0), floor(0.0));
    assert_eq!(floor(0.0), Ok(feature(1.0 / 25_500.0)));
    assert_eq!([floor(tiny), floor(f64::MIN_POSITIVE), floor(1e-9)], [Ok(i16::MIN); 3], "saturates at −16");
    assert_eq!((floor(255.0), floor(255.000_001).is_err()), (Ok(3296), true));

    let speed = |threshold| SpeedConfig::new(Law::PUBLISHED, threshold, ThresholdOn::Absolute, FrameRate::NOMINAL);
    for bad in NOT_NUMBERS.into_iter().chain([-tiny, -1.0, 0.0, -0.0, 5.000_001, f64::MAX]) {
        assert!(matches!(speed(bad), Err(ConfigError::SpeedThreshold(found)) if same(found, bad)), "{bad}");
    }
    for on in [ThresholdOn::Absolute, ThresholdOn::AboveBaseline] {
        for threshold in [tiny, f64::MIN_POSITIVE, 5.0] {
            let config = SpeedConfig::new(Law::PUBLISHED, threshold, on, FrameRate::NOMINAL).unwrap();
            let duration = with_event(30..40, |event| speed::duration(event, &config)).map(|d| (d.first, d.last));
            let expected = match (threshold < 1.0, on) {
                (false, _) => None,
                (true, ThresholdOn::Absolute) => Some((0, 69)),
                (true, ThresholdOn::AboveBaseline) => Some((30, 39)),
            };
            assert_eq!(duration, expected, "{threshold} {on:?}");
        }
    }
    let law = |law| SpeedConfig::new(law, 0.0475, ThresholdOn::Absolute, FrameRate::NOMINAL);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let refused = [Law { intercept: bad, slope: 56.29 }, Law { intercept: 151.06, slope: bad }];
        for refused in refused.map(law) {
            assert!(
                matches!(refused, Err(ConfigError::SpeedLaw { found, .. }) if found.to_bits() == bad.to_bits()),
                "{bad}"
            );
        }
    }
    for bad in [0.0, -0.0, -1.0, -f32::from_bits(1), f32::MIN] {
        let refused = law(Law { intercept: 151.06, slope: bad });
        assert!(
            matches!(refused, Err(ConfigError::SpeedLaw { found, .. }) if found.to_bits() == bad.to_bits()),
            "{bad}"
        );
    }
    let tiny = f32::from_bits(1);
    for harmless in [Law { intercept: -0.0, slope: tiny }, Law { intercept: tiny, slope: f32::MAX }] {
        let config = law(harmless).unwrap();
        for frames in 0..=69 {
            assert!(harmless.speed(frames as f32).is_none_or(|mm_s| mm_s.is_finite() && mm_s >= 0.0), "{harmless:?}");
        }
        for lit in [0..1, 1..2, 1..69, 0..70] {
            if let Ok(speed) = with_event(lit, |event| speed::speed(event, &config)) {
                assert!(speed.mm_s.is_finite() && speed.mm_s >= 0.0 && speed.extrapolated, "{harmless:?} {speed:?}");
            }
        }
    }
}

/// A recorded baseline and sample that no sensor can produce: answers, but no overflow.
#[test]
fn recorded_numbers_that_no_sensor_makes() {
    let frames: [Features; 70] = core::array::from_fn(|frame| [if frame % 2 == 0 { i16::MIN } else { i16::MAX }; 10]);
    for total in [i32::MIN, -(1 << 24), -1, 0, 1, 1 << 22, 1 << 24, i32::MAX] {
        for count in [0, 1, 25, u16::MAX] {
            let baseline = Baseline::new([total; 10], count);
            let sample = Sample::from_frames(&frames);
            let mut event = Event::new(u64::MAX, sample, &baseline);
            event.frames_filled = 255;
            let direction = direction::direction(&event);
            assert!(direction.degrees.is_err() && direction.confidence.unwrap() <= 32_768);
            for on in [ThresholdOn::Absolute, ThresholdOn::AboveBaseline] {
                let config = SpeedConfig::new(Law::PUBLISHED, 0.0475, on, FrameRate::NOMINAL).unwrap();
                assert!(speed::speed(&event, &config).is_err(), "the last frame is lit");
            }
        }
    }
    assert_eq!(speed::LitSpan::new(9, 3).frames(), 0);
}
