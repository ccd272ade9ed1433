//! Tests the data types of the core with serde, by postcard without allocation. What was written is read again, and
//! values that no constructor makes are refused.

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;
use wstac_core::fixed::Q16;
use wstac_core::frame::Stride;
use wstac_core::green::any::{PixelFormat, YcbcrMethod};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::baseline::Baseline;
use wstac_core::paper::direction::{Direction, Heading};
use wstac_core::paper::speed::{Law, LitSpan, Speed, ThresholdOn};
use wstac_core::paper::trigger::{ContactEnd, InterruptedSample, Rule, StreamEnd, TriggerConfig};
use wstac_core::rate::FrameRate;
use wstac_core::reason::Reason;
use wstac_core::stream::FeatureFrame;
use wstac_core::touch::motion::Contact;
use wstac_core::touch::slip::Slip;
use wstac_tests::formats;

/// Writes and reads `value`, and checks that every shorter message is refused.
fn round_trip<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let mut buffer = [0; 512];
    let written = postcard::to_slice(value, &mut buffer).unwrap();
    assert_eq!(&postcard::from_bytes::<T>(written).unwrap(), value);
    for length in 0..written.len() {
        assert!(postcard::from_bytes::<T>(&written[..length]).is_err(), "{value:?} from {length} bytes");
    }
}

/// Writes a `value` that has the fields of a `T`, and reads a `T`.
fn read_as<T: DeserializeOwned>(value: impl Serialize) -> Result<T, postcard::Error> {
    let mut buffer = [0; 512];
    postcard::from_bytes(postcard::to_slice(&value, &mut buffer).unwrap())
}

fn layout_fields(frame: (u32, u32), taxel: [u16; 2], last: [u16; 2]) -> impl Serialize {
    let mut corners = [[1_u16, 2_u16]; 25];
    corners[24] = last;
    (frame, taxel, corners)
}

#[test]
fn data_types_are_read_as_they_were_written() {
    for (width, height) in [(1, 1), (16_384, 16_384), (1280, 720)] {
        round_trip(&FrameSize::new(width, height).unwrap());
    }
    for side in [4, 400, 16_384] {
        round_trip(&Layout::paper(FrameSize::new(side, side).unwrap()).unwrap());
    }
    for (numerator, denominator) in [(30, 1), (30_000, 1001), (u32::MAX, u32::MAX), (1, u32::MAX)] {
        round_trip(&FrameRate::new(numerator, denominator).unwrap());
    }
    for stride in [Stride::One, Stride::Two, Stride::Three, Stride::Five] {
        round_trip(&stride);
    }
    round_trip(&TriggerConfig::default());
    round_trip(&TriggerConfig::new(70, 65_535.999, 0, Rule::Signed, 65_535.999).unwrap());
    round_trip(&TriggerConfig::new(1, 0.0, 5, Rule::Literal, 0.0).unwrap());
    round_trip(&Q16::new(1.2).unwrap());
    for format in PixelFormat::all() {
        round_trip(&format);
    }
    for color in formats::COLORS {
        round_trip(&color);
    }
    round_trip(&[YcbcrMethod::Exact, YcbcrMethod::Linear]);
    round_trip(&Baseline::new([-190_000, 1, 2, 3, 4, 5, 6, 7, i32::MIN, i32::MAX], 25));
    round_trip(&FeatureFrame::new([i16::MIN, -1, 0, 1, i16::MAX, 5, 6, 7, 8, 9], true));
    round_trip(&InterruptedSample::new(u64::MAX, 69));
    let incomplete = Some(InterruptedSample::new(1 << 40, 1));
    let mut end = StreamEnd::new(u64::MAX);
    (end.baseline_complete, end.incomplete) = (true, incomplete);
    round_trip(&end);
    round_trip(&Law::PUBLISHED);
    round_trip(&[ThresholdOn::Absolute, ThresholdOn::AboveBaseline]);
    round_trip(&LitSpan::new(0, 69));
    round_trip(&[Speed::new(102.5), Speed::by_arrival(102.5, 0.5)]);
    for contact in [Contact::Slide, Contact::Press, Contact::Poke, Contact::Unclear] {
        round_trip(&[Reason::NoSlide(contact)]);
        round_trip(&Direction::by_arrival(Err(Reason::NoSlide(contact))));
    }
    round_trip(&Direction::by_arrival(Ok([359.5, 0.25])));
    round_trip(&ContactEnd::new(u64::MAX, 0));
    round_trip(&Slip::new(u64::MAX, 1, 0, 0.4));
    round_trip(&[Reason::BaselineAbove, Reason::NeverValid, Reason::OutsideLaw]);
    round_trip(&[Reason::CutOff { at_most: None }, Reason::CutOff { at_most: Some(45.0) }]);
    for heading in [Ok(Heading::Right), Ok(Heading::Up), Ok(Heading::Left), Ok(Heading::Down)] {
        round_trip(&Direction::by_centroids(heading, 32_768));
    }
    round_trip(&Direction::by_centroids(Err(Reason::NeverLit), 0));
    round_trip(&Direction::by_centroids(Err(Reason::NoOrder), 6553));
}

#[test]
fn sizes_and_rates_that_cannot_be_are_refused() {
    assert!(read_as::<FrameSize>((1_u32, 16_384_u32)).is_ok());
    for size in [(0_u32, 1_u32), (1, 0), (16_385, 1), (1, 16_385), (u32::MAX, 1), (65_537, 1)] {
        assert!(read_as::<FrameSize>(size).is_err(), "{size:?}");
    }
    assert!(read_as::<FrameRate>((30_u32, 1_u32)).is_ok());
    for rate in [(0_u32, 1_u32), (1, 0), (0, 0)] {
        assert!(read_as::<FrameRate>(rate).is_err(), "{rate:?}");
    }
    for stride in 0..=300_u32 {
        assert_eq!(read_as::<Stride>(stride).is_ok(), [1, 2, 3, 5].contains(&stride), "{stride}");
    }
}

#[test]
fn layouts_that_leave_the_frame_are_refused() {
    assert!(read_as::<Layout>(layout_fields((20, 20), [10, 10], [10, 10])).is_ok());
    for (frame, taxel, last) in [
        ((20, 20), [10, 10], [11, 10]),
        ((20, 20), [10, 10], [10, 11]),
        ((20, 20), [10, 10], [u16::MAX, 0]),
        ((20, 20), [0, 10], [0, 0]),
        ((20, 20), [10, 0], [0, 0]),
        ((20, 20), [u16::MAX, 1], [1, 0]),
        ((0, 20), [10, 10], [0, 0]),
        ((20, 16_385), [10, 10], [0, 0]),
    ] {
        assert!(read_as::<Layout>(layout_fields(frame, taxel, last)).is_err(), "{frame:?} {taxel:?} {last:?}");
    }
}

#[test]
fn trigger_parameters_that_cannot_be_are_refused() {
    let q16 = |x: f64| (x * 65_536.0) as u32;
    let read = |window: u8, backtrack: u8, rule: Rule, multiplier: f64| {
        read_as::<TriggerConfig>((window, backtrack, rule, q16(multiplier), q16(0.2), false))
    };
    let expected = Ok(TriggerConfig::new(7, 1.5, 9, Rule::Signed, f64::from(q16(0.2)) / 65_536.0).unwrap());
    assert_eq!(read(7, 9, Rule::Signed, 1.5), expected);
    assert!(read(5, 25, Rule::Literal, 0.5).is_ok() && read(1, 5, Rule::Signed, 1.0).is_ok());
    for (window, backtrack, rule, multiplier) in [
        (0, 0, Rule::Signed, 1.2),
        (71, 0, Rule::Signed, 1.2),
        (255, 0, Rule::Signed, 1.2),
        (5, 26, Rule::Signed, 1.2),
        (1, 6, Rule::Signed, 1.2),
        (12, 59, Rule::Signed, 1.2),
        (70, 1, Rule::Literal, 1.2),
        (5, 255, Rule::Literal, 1.2),
        (5, 10, Rule::Signed, 0.999),
        (5, 10, Rule::Signed, 0.0),
    ] {
        assert!(read(window, backtrack, rule, multiplier).is_err(), "{window} {backtrack} {rule:?} {multiplier}");
    }
}
