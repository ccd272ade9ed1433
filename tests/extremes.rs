//! The ends of every range. Each test names an extreme and what is guaranteed there.

use wstac_core::baseline::Baseline;
use wstac_core::direction::{self, Unclear};
use wstac_core::error::Error;
use wstac_core::features::{FeatureScale, Features};
use wstac_core::frame::Stride;
use wstac_core::green::Green;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::grey::Grey;
use wstac_core::green::packed_rgb::Rgb24;
use wstac_core::green::words::{Y10, Y12, Y16};
use wstac_core::green::ycbcr::{Colour, Matrix, Range};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::sample::Sample;
use wstac_core::speed::{self, Law, NoSpeed, SpeedConfig, ThresholdOn};
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::{Accumulators, Camera};
use wstac_core::trigger::{Event, Incomplete, Rule, Trigger, TriggerConfig};
use wstac_tests::plain_sums::{full_scale, row_bytes};
use wstac_tests::{OwnedEvent, formats};

const FULL_RANGE: Colour = Colour { matrix: Matrix::Bt601, range: Range::Full };

/// What numbers can be wrong in: refused or harmless everywhere.
const NOT_NUMBERS: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

fn size(width: u32, height: u32) -> FrameSize {
    FrameSize::new(width, height).unwrap()
}

/// A layout of 25 taxels of the same place and size.
fn stacked(frame: FrameSize, taxel: [u16; 2], corner: [u16; 2]) -> Layout {
    Layout::new(frame, taxel, [corner; 25]).unwrap()
}

fn any(format: PixelFormat) -> Any {
    Any::new(format, FULL_RANGE, YcbcrMethod::Exact)
}

/// The bytes of a picture that is black (or white) everywhere.
fn uniform(format: PixelFormat, width: u32, height: u32, white: bool) -> Vec<u8> {
    use PixelFormat as F;
    let luma = if white { 255 } else { 0 };
    let row = row_bytes(format, width as usize);
    let packed = row * height as usize;
    match format {
        F::Yuyv => [luma, 128].repeat(packed / 2),
        F::Uyvy => [128, luma].repeat(packed / 2),
        F::Nv12 | F::Yu12 | F::Yuv422p | F::Yuv444p => [vec![luma; packed], vec![128; 2 * packed + 100]].concat(),
        _ => vec![luma; packed],
    }
}

fn features_of<G: Green, L: Ln>(camera: Camera<G>, floor_levels: f64, bytes: &[u8]) -> Features {
    FeatureStream::<G, L>::new(camera, floor_levels).unwrap().push_frame(bytes).unwrap().unwrap().features
}

/// Features with ln `share` (of full scale) in every line, rounded to the nearest.
fn feature(share: f64) -> i16 {
    (share.ln() * 2048.0).round() as i16
}

/// Pushes one frame; what it brought about.
fn push(trigger: &mut Trigger, level: i16) -> Option<OwnedEvent> {
    trigger.push([level; 10], false).map(OwnedEvent::from)
}

fn trigger(window: u32, backtrack: u32, rule: Rule, multiplier: f64) -> Trigger {
    Trigger::new(TriggerConfig::new(window, multiplier, backtrack, rule, 0.2).unwrap())
}

const DARK: i16 = -8000;
const BRIGHT: i16 = 3000;

// Light.

/// All black: every feature is the floor, of every format and kernel; nothing fires, nothing panics.
#[test]
fn all_black_is_the_floor_and_no_event() {
    for format in formats::all() {
        let layout = Layout::paper(size(20, 20)).unwrap();
        let camera = Camera::new(any(format), layout, FrameRate::NOMINAL).unwrap();
        let bytes = uniform(format, 20, 20, false);
        let full_scale = full_scale(format) as f64;
        assert_eq!(Accumulators::new(camera).push_frame(&bytes).unwrap(), [0; 25], "{format:?}");
        let floor = feature(5.0 * 0.5 / full_scale);
        assert_eq!(features_of::<Any, Fixed>(camera, 0.5, &bytes), [floor; 10], "{format:?}");
        assert_eq!(features_of::<Any, Libm>(camera, 0.5, &bytes), [floor; 10], "{format:?}");
        assert_eq!(features_of::<Any, Micromath>(camera, 0.5, &bytes), [floor; 10], "{format:?}");
        let one_count = feature(1.0 / (full_scale * f64::from(camera.pixels())));
        assert_eq!(features_of::<Any, Libm>(camera, 0.0, &bytes), [one_count; 10], "{format:?}");
        let mut pipeline = Pipeline::<Any>::new(camera, 0.5, TriggerConfig::default()).unwrap();
        for _ in 0..200 {
            assert!(pipeline.push_frame(&bytes).unwrap().is_none(), "{format:?}");
        }
        assert!(pipeline.end().baseline_quiet);
    }
}

/// One count in one pixel: it is seen wherever in its taxel it is, by that taxel only, and not next to it.
#[test]
fn one_count_in_one_pixel_is_one_in_one_sum() {
    let layout = Layout::paper(size(80, 80)).unwrap();
    let camera = Camera::new(Grey, layout, FrameRate::NOMINAL).unwrap();
    let [width, height] = layout.taxel().map(usize::from);
    for (taxel, corner) in layout.corners().iter().enumerate() {
        let [left, top] = corner.map(usize::from);
        let sums_with_light_at = |x: usize, y: usize| {
            let mut bytes = vec![0; 80 * 80];
            bytes[y * 80 + x] = 1;
            Accumulators::new(camera).push_frame(&bytes).unwrap()
        };
        let mut only = [0; 25];
        only[taxel] = 1;
        let (right, bottom) = (left + width - 1, top + height - 1);
        for (x, y) in [(left, top), (right, top), (left, bottom), (right, bottom)] {
            assert_eq!(sums_with_light_at(x, y), only, "taxel {taxel} at ({x}, {y})");
        }
        for (x, y) in [(left - 1, top), (right + 1, top), (left, top - 1), (left, bottom + 1)] {
            assert_eq!(sums_with_light_at(x, y), [0; 25], "next to taxel {taxel} at ({x}, {y})");
        }
    }
    // Two counts of 16 bits in one of 25 dark taxels: a row and a column rise above the floor of one count.
    let camera = Camera::new(Y16::default(), layout, FrameRate::NOMINAL).unwrap();
    let mut bytes = vec![0; 2 * 80 * 80];
    let [left, top] = layout.corners()[7].map(usize::from);
    bytes[2 * (top * 80 + left)] = 2;
    let full = 65_535.0 * 100.0;
    let mut expected = [feature(1.0 / full); 10];
    (expected[1], expected[5 + 2]) = (feature(2.0 / full), feature(2.0 / full));
    assert_eq!(features_of::<Y16, Fixed>(camera, 0.0, &bytes), expected);
}

/// All saturated: sums are A · G exactly and every feature is ln 5, of every format, method and kernel.
#[test]
fn all_saturated_is_ln_5() {
    for format in formats::all() {
        for method in formats::METHODS {
            let layout = Layout::paper(size(20, 20)).unwrap();
            let camera = Camera::new(Any::new(format, FULL_RANGE, method), layout, FrameRate::NOMINAL).unwrap();
            let bytes = uniform(format, 20, 20, true);
            let full = camera.pixels() * camera.full_scale();
            assert_eq!(Accumulators::new(camera).push_frame(&bytes).unwrap(), [full; 25], "{format:?}");
            assert_eq!(features_of::<Any, Fixed>(camera, 0.5, &bytes), [3296; 10], "{format:?}");
            assert_eq!(features_of::<Any, Fixed<32>>(camera, 0.5, &bytes), [3296; 10], "{format:?}");
            assert_eq!(features_of::<Any, Libm>(camera, 0.5, &bytes), [3296; 10], "{format:?}");
            assert_eq!(features_of::<Any, Micromath>(camera, 0.5, &bytes), [3296; 10], "{format:?}");
        }
    }
}

/// Words above full scale (a driver's padding bits): they count as full scale, and no sum exceeds A · G.
#[test]
fn words_above_full_scale_count_as_full_scale() {
    let layout = stacked(size(3, 3), [3, 3], [0, 0]);
    let word = |green: u16| green.to_le_bytes().repeat(9);
    let ten = |green| {
        Accumulators::new(Camera::new(Y10::default(), layout, FrameRate::NOMINAL).unwrap()).push_frame(&word(green))
    };
    let twelve = |green| {
        Accumulators::new(Camera::new(Y12::default(), layout, FrameRate::NOMINAL).unwrap()).push_frame(&word(green))
    };
    let sixteen = |green| {
        Accumulators::new(Camera::new(Y16::default(), layout, FrameRate::NOMINAL).unwrap()).push_frame(&word(green))
    };
    assert_eq!([ten(1022), ten(1023), ten(1024), ten(0xFFFF)].map(|s| s.unwrap()[0]), [9198, 9207, 9207, 9207]);
    assert_eq!(
        [twelve(4094), twelve(4095), twelve(4096), twelve(0xF000)].map(|s| s.unwrap()[0]),
        [36_846, 36_855, 36_855, 36_855]
    );
    assert_eq!([sixteen(0xFFFE), sixteen(0xFFFF)].map(|s| s.unwrap()[0]), [9 * 65_534, 9 * 65_535]);
}

// Sizes.

/// Taxels of one pixel (for mosaics one cell): each reads exactly its own.
#[test]
fn one_pixel_taxels_read_their_own_pixel() {
    let mut corners = [[0; 2]; 25];
    for (taxel, corner) in corners.iter_mut().enumerate() {
        *corner = [taxel as u16 % 5, taxel as u16 / 5];
    }
    let layout = Layout::new(size(5, 5), [1, 1], corners).unwrap();
    let bytes: Vec<u8> = (1..=25).collect();
    let sums = Accumulators::new(Camera::new(Grey, layout, FrameRate::NOMINAL).unwrap()).push_frame(&bytes).unwrap();
    assert_eq!(sums.map(|sum| sum as u8).to_vec(), bytes);
    for order in formats::BAYER_ORDERS {
        let error = Camera::new(any(PixelFormat::Bayer8(order)), layout, FrameRate::NOMINAL).unwrap_err();
        assert_eq!(error, Error::EmptyTaxel { width: 1, height: 1 });
        let cell = stacked(size(2, 2), [2, 2], [0, 0]);
        let camera = Camera::new(any(PixelFormat::Bayer8(order)), cell, FrameRate::NOMINAL).unwrap();
        assert_eq!(camera.pixels(), 2);
        let sums = Accumulators::new(camera).push_frame(&[1, 2, 4, 8]).unwrap();
        let greens_are_second_and_third =
            matches!(order, wstac_core::green::bayer::BayerOrder::Rggb | wstac_core::green::bayer::BayerOrder::Bggr);
        assert_eq!(sums, [if greens_are_second_and_third { 6 } else { 9 }; 25]);
    }
}

/// Taxels as large as the frame, all on the same place: each sums the whole frame, with every stride.
#[test]
fn whole_frame_taxels_sum_the_whole_frame() {
    let layout = stacked(size(31, 17), [31, 17], [0, 0]);
    let bytes: Vec<u8> = (0..31 * 17_u32).map(|i| (i * 7 % 251) as u8).collect();
    for stride in [1_usize, 2, 3, 5] {
        let camera = Camera::new(Grey, layout, FrameRate::NOMINAL).unwrap();
        let camera = camera.with_stride(Stride::try_from(stride as u32).unwrap()).unwrap();
        let rows = bytes.chunks(31).step_by(stride);
        let expected: u32 = rows.flat_map(|row| row.iter().step_by(stride)).map(|&v| u32::from(v)).sum();
        assert_eq!(Accumulators::new(camera).push_frame(&bytes).unwrap(), [expected; 25], "stride {stride}");
        assert_eq!(camera.pixels() as usize, 31_usize.div_ceil(stride) * 17_usize.div_ceil(stride));
    }
}

/// Frames of 1 × 1 to 16384 × 16384 pixels are taken, down to the last pixel; 0 and 16385 are refused.
#[test]
fn frame_sizes_from_1_to_16384() {
    for (width, height) in [(0, 1), (1, 0), (16_385, 1), (1, 16_385), (u32::MAX, u32::MAX), (65_536, 65_536)] {
        assert_eq!(FrameSize::new(width, height), Err(Error::FrameSize { width, height }));
    }
    let one = Camera::new(Grey, stacked(size(1, 1), [1, 1], [0, 0]), FrameRate::NOMINAL).unwrap();
    assert_eq!(Accumulators::new(one).push_frame(&[77]).unwrap(), [77; 25]);
    assert_eq!(Accumulators::new(one).push_frame(&[]).unwrap_err(), Error::FrameTooShort { found: 0, expected: 1 });
    for (width, height) in [(16_384, 1), (1, 16_384), (16_384, 16_384)] {
        let corner = [width as u16 - 1, height as u16 - 1];
        let layout = stacked(size(width, height), [1, 1], corner);
        let mut bytes = vec![0; width as usize * height as usize];
        *bytes.last_mut().unwrap() = 200;
        let camera = Camera::new(Grey, layout, FrameRate::NOMINAL).unwrap();
        assert_eq!(Accumulators::new(camera).push_frame(&bytes).unwrap(), [200; 25], "{width}x{height}");
        let outside = Layout::new(size(width, height), [1, 1], [[width as u16, 0]; 25]);
        assert!(matches!(outside, Err(Error::TaxelOutside { taxel: 0, .. })));
    }
    let corner = Layout::new(size(10, 10), [u16::MAX, u16::MAX], [[u16::MAX, u16::MAX]; 25]);
    assert_eq!(
        corner,
        Err(Error::TaxelOutside { taxel: 0, end: (131_070, 131_070), frame: (10, 10) }),
        "ends do not wrap"
    );
}

/// 5 · A · G at the end of 32 bits: accepted and exact up to it, refused beyond it, when built.
#[test]
fn five_taxels_at_the_end_of_32_bits() {
    fn check<G: Green + core::fmt::Debug>(green: G, fits: [u16; 2], too_large: [u16; 2]) {
        let full_scale = u64::from(green.full_scale());
        let most = |taxel: [u16; 2]| 5 * u64::from(taxel[0]) * u64::from(taxel[1]) * full_scale;
        assert!(most(fits) >> 32 == 0 && most(too_large) >> 32 > 0, "the test is wrong");
        let frame = size(u32::from(fits[0].max(too_large[0])), u32::from(fits[1].max(too_large[1])));
        let refused = Camera::new(green, stacked(frame, too_large, [0, 0]), FrameRate::NOMINAL).unwrap_err();
        let pixels = u32::from(too_large[0]) * u32::from(too_large[1]);
        assert_eq!(refused, Error::SumTooLarge { pixels, full_scale: full_scale as u32, frames: 1 });
        let camera = Camera::new(green, stacked(frame, fits, [0, 0]), FrameRate::NOMINAL).unwrap();
        let bytes = vec![255; camera.frame_bytes()];
        let full = camera.pixels() * camera.full_scale();
        assert_eq!(Accumulators::new(camera).push_frame(&bytes).unwrap(), [full; 25]);
        assert_eq!(features_of::<G, Fixed>(camera, 0.5, &bytes), [3296; 10], "ln 5");
        // Too large for two frames added up, and refused then, too.
        let doubled = Camera::new(green, stacked(frame, fits, [0, 0]), FrameRate::new(60, 1).unwrap());
        assert!(matches!(doubled, Err(Error::SumTooLarge { frames: 2, .. })));
    }
    check(Y16::default(), [257, 51], [116, 113]); // A = 13107 and 13108
    check(Y12::default(), [353, 594], [419, 501]);
    check(Y10::default(), [1024, 820], [1013, 829]);
    check(Grey, [2091, 1611], [1836, 1835]);
    check(Rgb24::default(), [2091, 1611], [1836, 1835]);
    for full_scale in [255, 1023, 4095, 65_535] {
        let pixels = u32::MAX / 5 / full_scale;
        let scale = FeatureScale::<Fixed>::new(pixels, full_scale, 1, 0.5).unwrap();
        assert_eq!(scale.feature(5 * pixels * full_scale), 3296, "A = {pixels}, G = {full_scale}");
        for (pixels, frames) in [(pixels + 1, 1), (pixels, 2), (u32::MAX, 1), (pixels, u32::MAX)] {
            let refused = FeatureScale::<Fixed>::new(pixels, full_scale, frames, 0.5).unwrap_err();
            assert_eq!(refused, Error::SumTooLarge { pixels, full_scale, frames });
        }
    }
    let refused = Camera::new(Grey, stacked(size(16_384, 16_384), [16_384; 2], [0, 0]), FrameRate::NOMINAL);
    assert!(matches!(refused, Err(Error::SumTooLarge { pixels: 268_435_456, .. })));
    let fastest = FrameRate::new(u32::MAX, 1).unwrap();
    let refused = Camera::new(Grey, stacked(size(1, 1), [1, 1], [0, 0]), fastest);
    assert!(matches!(refused, Err(Error::SumTooLarge { frames: 143_165_577, .. })));
}

/// Rows as far apart as a number can say: no size overflows, and no frame is long enough.
#[test]
fn four_gigabytes_from_row_to_row() {
    for format in formats::all() {
        let layout = stacked(size(16, 16_384), [2, 2], [0, 16_382]);
        let camera = Camera::new(any(format), layout, FrameRate::NOMINAL).unwrap();
        let camera = camera.with_bytes_per_row(u32::MAX).unwrap();
        let mut accumulators = Accumulators::new(camera);
        let found = accumulators.push_frame(&[0; 4096]).unwrap_err();
        assert_eq!(found, Error::FrameTooShort { found: 4096, expected: camera.frame_bytes() });
        assert!(camera.frame_bytes() as u64 > 16_383 * u64::from(u32::MAX), "{format:?}");
        let least = row_bytes(format, 16) as u32;
        let narrow = Camera::new(any(format), layout, FrameRate::NOMINAL).unwrap().with_bytes_per_row(least - 1);
        assert_eq!(narrow.unwrap_err(), Error::BytesPerRow { found: least - 1, expected: least });
    }
}

// Trigger.

/// Window and backtrack at both ends: the first window starts at 5m, the sample at t − c, and the event comes with the
/// sample's last frame.
#[test]
fn window_and_backtrack_at_both_ends() {
    for (m, c) in [(1, 0), (1, 5), (5, 25), (11, 55), (12, 58), (35, 35), (69, 1), (70, 0)] {
        let mut trigger = trigger(m, c, Rule::Signed, 1.2);
        let t = 5 * u64::from(m);
        let last = t + 70 - u64::from(c) - 1;
        for frame in 0..last + 200 {
            let level = if frame >= t { BRIGHT } else { DARK };
            let event = push(&mut trigger, level);
            assert_eq!(event.is_some(), frame >= last && (frame - last) % 70 == 0, "m {m}, c {c}, frame {frame}");
            if let Some(event) = event {
                assert_eq!(event.frame, t - u64::from(c) + (frame - last), "m {m}, c {c}");
                assert_eq!(event.sample.len(), 70);
                let dark = if frame == last { c } else { 0 };
                assert_eq!(event.sample.iter().filter(|f| f[0] == DARK).count() as u32, dark, "m {m}, c {c}");
            }
        }
    }
    let build = |m, c| TriggerConfig::new(m, 1.2, c, Rule::Signed, 0.2);
    for m in [0, 71, 256, 257, u32::MAX] {
        assert_eq!(build(m, 0), Err(Error::Window(m)));
    }
    for (m, most) in [(1, 5), (11, 55), (12, 58), (69, 1), (70, 0)] {
        assert!(build(m, most).is_ok());
        for found in [most + 1, most + 256, u32::MAX] {
            assert_eq!(build(m, found), Err(Error::Backtrack { found, most }));
        }
    }
}

/// The multiplier's ends: 0 (literal) fires on any positive sum and no other; 1 (signed) leaves the margin alone; the
/// largest never fires where there is a baseline.
#[test]
fn multiplier_at_both_ends() {
    let fires = |rule, b, base: i16, level: i16| {
        let mut trigger = trigger(5, 0, rule, b);
        (0..25).for_each(|_| assert!(push(&mut trigger, base).is_none()));
        (0..70).any(|_| push(&mut trigger, level).is_some())
    };
    assert!(!fires(Rule::Literal, 0.0, DARK, 0) && fires(Rule::Literal, 0.0, DARK, 1));
    assert!(!fires(Rule::Signed, 1.0, DARK, DARK + 409) && fires(Rule::Signed, 1.0, DARK, DARK + 410));
    let largest = 65_535.999;
    assert!(!fires(Rule::Signed, largest, DARK, i16::MAX) && !fires(Rule::Signed, largest, 1, i16::MAX));
    assert!(!fires(Rule::Literal, largest, 1, i16::MAX) && fires(Rule::Literal, largest, -1, -32_000));
    for b in [65_536.0, f64::MAX, -1e-9, -1.0] {
        assert_eq!(TriggerConfig::new(5, b, 0, Rule::Literal, 0.2), Err(Error::Multiplier(b)));
    }
    assert_eq!(TriggerConfig::new(5, 0.99, 0, Rule::Signed, 0.2), Err(Error::Multiplier(0.99)));
    for margin in [65_536.0, f64::MAX, -1e-9, -1.0] {
        assert_eq!(TriggerConfig::new(5, 1.2, 0, Rule::Signed, margin), Err(Error::Margin(margin)));
    }
}

/// η zero, tiny, hugely negative and positive, in both rules: the thresholds are those worked out by hand, the window
/// sum at the threshold does not fire and the next one does.
#[test]
fn eta_at_its_extremes_in_both_rules() {
    // b = 1.25 and 0.75, margin 0.2 (13107 / 65536), m = 5: margin alone is 5 · 2048 · 13107/65536 = 2047.96875.
    // Totals over 25 frames; η = total / 5.
    for (rule, b, total, threshold) in [
        (Rule::Literal, 1.25, 0, 0),
        (Rule::Literal, 1.25, 1, 0),   // 0.25
        (Rule::Literal, 1.25, -1, -1), // −0.25
        (Rule::Literal, 0.75, -25 * 32_768, -122_880),
        (Rule::Literal, 1.25, -25 * 32_768, -204_800), // below every window sum: always fires
        (Rule::Literal, 1.25, 25 * 3296, 20_600),
        (Rule::Signed, 1.25, 0, 2047),
        (Rule::Signed, 1.25, 1, 2048),  // 2048.16875
        (Rule::Signed, 1.25, -1, 2047), // 2047.76875
        (Rule::Signed, 1.25, -25 * 32_768, -122_880),
        (Rule::Signed, 1.25, 25 * 3296, 20_600),
        (Rule::Signed, 1.25, 25 * 1638, 10_237), // 8190 + max(2047.5, 2047.96875)
        (Rule::Signed, 1.25, 25 * 1639, 10_243), // 8195 + max(2048.75, 2047.96875)
    ] {
        for extra in [0, 1] {
            let mut trigger = trigger(5, 0, rule, b);
            let (even, odd) = (total / 25, total % 25);
            for frame in 0..25 {
                push(&mut trigger, (even + if frame == 0 { odd } else { 0 }) as i16);
            }
            let case = format!("{rule:?} {b} total {total}");
            assert_eq!(trigger.baseline().unwrap().totals(), &[total; 10], "{case}");
            assert_eq!(trigger.thresholds().unwrap(), &[threshold; 10], "{case}");
            // A window of exactly the threshold, then of one more, where five features can add up to that.
            let sum = (threshold + extra).max(5 * i32::from(i16::MIN));
            let (each, rest) = (sum.div_euclid(5), sum.rem_euclid(5));
            for frame in 0..5 {
                trigger.push([(each + i32::from(frame < rest)) as i16; 10], false);
            }
            let fired = trigger.end().incomplete.is_some();
            assert_eq!(fired, sum > threshold, "{case}: window sum {sum}");
        }
    }
}

/// A stream around 2^32 and 2^33 frames: the same events at the same distances, none missed, none twice.
#[test]
fn streams_around_2_to_the_32_and_33() {
    let run = |start: u64| {
        let mut trigger = trigger(5, 10, Rule::Signed, 1.2).starting_at(start);
        let mut events = Vec::new();
        for frame in 0..1500_u64 {
            if frame % 211 == 60 {
                trigger.push_lost(3);
            }
            let level = if frame % 130 > 110 { BRIGHT } else { DARK };
            events.extend(push(&mut trigger, level).map(|event| event.frame - start));
        }
        trigger.push_lost(5);
        events.extend(trigger.finish().map(|event| event.frame - start));
        (events, trigger.end().frames - start, trigger.end().incomplete.map(|i| (i.frame - start, i.frames)))
    };
    let expected = run(0);
    assert!(expected.0.len() >= 10, "{expected:?}");
    for around in [1 << 31, 1 << 32, 1 << 33, 1 << 53, u64::MAX - 2000] {
        for before in [0, 1, 20, 34, 99, 105, 700, 1499] {
            assert_eq!(run(around - before), expected, "{around} − {before}");
        }
    }
}

/// Losses of up to 2^64 − 1 frames at every phase, twice: frame numbers stay at the end of all numbers, samples that
/// were open are reported, and the trigger goes on.
#[test]
fn losses_up_to_the_largest_number() {
    for at in 1..130 {
        for lost in [1 << 31, 1 << 32, u64::MAX - 200, u64::MAX - 1, u64::MAX] {
            let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
            for frame in 0..at {
                push(&mut trigger, if frame >= 30 { BRIGHT } else { DARK });
            }
            let open = trigger.end().incomplete;
            trigger.push_lost(lost);
            assert_eq!(trigger.next_frame(), lost.saturating_add(at));
            let event = push(&mut trigger, DARK);
            assert!(event.is_none());
            assert_eq!(trigger.take_interrupted(), open, "{lost} lost after {at} frames");
            assert_eq!(trigger.end().frames, lost.saturating_add(at).saturating_add(1));
            assert!(trigger.end().baseline_complete);
            assert_eq!(trigger.end().baseline_quiet, at >= 25, "{lost} lost after {at} frames");
            trigger.push_lost(u64::MAX);
            trigger.push_lost(u64::MAX);
            let events = (0..500).filter(|_| push(&mut trigger, i16::MAX).is_some()).count();
            assert_eq!(events, 7, "{lost} lost after {at} frames");
            assert_eq!(trigger.end().frames, u64::MAX);
        }
    }
    // Above 45 frames a second losses are counted in groups first.
    for fps in [30, 60, 1000] {
        let layout = stacked(size(2, 2), [1, 1], [0, 0]);
        let camera = Camera::new(Grey, layout, FrameRate::new(fps, 1).unwrap()).unwrap();
        let added = u64::from(camera.rate().frames_added());
        let mut pipeline: Pipeline = Pipeline::new(camera, 0.5, TriggerConfig::default()).unwrap();
        pipeline.push_lost(u64::MAX);
        assert_eq!(pipeline.end().frames, 0, "lost before the first frame");
        pipeline.push_frame(&[9; 4]).unwrap();
        pipeline.push_lost(u64::MAX);
        assert_eq!(
            pipeline.end().frames,
            ((u128::from(u64::MAX) + 1) / u128::from(added)).min(u128::from(u64::MAX)) as u64
        );
        pipeline.push_lost(u64::MAX);
        pipeline.finish();
    }
}

// Time.

/// Frame rates of 1 to 1000 a second, and the odd ones: round(fps / 30) frames are added above 45, 1 up to there; the
/// features of a still picture do not depend on it, and time runs in feature frames.
#[test]
fn frame_rates_from_1_to_1000() {
    let odd = [(30_000, 1001), (60_000, 1001), (45_000, 1001), (2997, 100), (5994, 100), (45_001, 1000), (1, 60)];
    let layout = Layout::paper(size(8, 8)).unwrap();
    let bytes: Vec<u8> = (0..64).map(|i| 3 * i).collect();
    let nominal = features_of::<Grey, Libm>(Camera::new(Grey, layout, FrameRate::NOMINAL).unwrap(), 0.5, &bytes);
    for (numerator, denominator) in (1..=1000).map(|fps| (fps, 1)).chain(odd) {
        let fps = f64::from(numerator) / f64::from(denominator);
        let expected = if fps > 45.0 { (fps / 30.0).round() as u32 } else { 1 };
        let rate = FrameRate::new(numerator, denominator).unwrap();
        assert_eq!(rate.frames_added(), expected, "{numerator}/{denominator}");
        let lasts = f64::from(expected) * 30.0 / fps;
        assert!((f64::from(rate.nominal_frames()) / lasts - 1.0).abs() < 1e-6, "{numerator}/{denominator}");
        let camera = Camera::new(Grey, layout, rate).unwrap();
        let mut stream = FeatureStream::<Grey, Libm>::new(camera, 0.5).unwrap();
        let mut frames = 0;
        for frame in 1..=3 * expected {
            let found = stream.push_frame(&bytes).unwrap();
            assert_eq!(found.is_some(), frame % expected == 0, "{numerator}/{denominator}, frame {frame}");
            if let Some(found) = found {
                frames += 1;
                assert_eq!(found.features, nominal, "{numerator}/{denominator}");
                assert!(!found.patched);
            }
        }
        assert_eq!(frames, 3);
    }
    assert_eq!([45, 46, 74, 75, 76].map(|fps| FrameRate::new(fps, 1).unwrap().frames_added()), [1, 2, 2, 3, 3]);
    assert_eq!(FrameRate::new(0, 1), Err(Error::FrameRate { numerator: 0, denominator: 1 }));
    assert_eq!(FrameRate::new(1, 0), Err(Error::FrameRate { numerator: 1, denominator: 0 }));
}

/// Dropped frames from none to all: time is the same, events are where the light was, and filled frames are counted.
#[test]
fn drop_patterns_from_none_to_all() {
    type Drops = fn(u64) -> bool;
    let patterns: [(&str, Drops, u8); 5] = [
        ("none", |_| false, 0),
        ("every second", |frame| frame % 2 == 1, 35),
        ("every third", |frame| frame % 3 == 2, 23),
        ("seven of eight", |frame| frame % 8 != 0, 62),
        ("one", |frame| frame == 80, 1),
    ];
    for (name, drops, filled) in patterns {
        let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
        let mut events = Vec::new();
        for frame in 0..200 {
            let level = if (60..100).contains(&frame) { BRIGHT } else { DARK };
            if drops(frame) {
                trigger.push_lost(1);
            } else {
                events.extend(push(&mut trigger, level));
            }
        }
        events.extend(trigger.finish().map(OwnedEvent::from));
        assert_eq!(trigger.end().frames, 200, "{name}");
        assert_eq!(events.len(), 1, "{name}");
        assert!((45..=55).contains(&events[0].frame), "{name}: {}", events[0].frame);
        assert!(events[0].frames_filled.abs_diff(filled) <= 1, "{name}: {} filled", events[0].frames_filled);
        assert_eq!(events[0].reliable, filled <= 7, "{name}");
    }
    // All: nothing has arrived, so there is no time; all but the first: a baseline of it, never reliable, no event.
    let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
    (0..300).for_each(|_| trigger.push_lost(1));
    assert!(trigger.finish().is_none());
    assert_eq!((trigger.end().frames, trigger.end().baseline_complete), (0, false));
    push(&mut trigger, DARK);
    (0..300).for_each(|_| trigger.push_lost(1));
    assert!(trigger.finish().is_none());
    let end = trigger.end();
    assert_eq!((end.frames, end.baseline_complete, end.baseline_quiet, end.incomplete), (301, true, false, None));
}

/// 7 and 8 frames lost in a row at every phase: 7 are filled and every event stays where it was; 8 interrupt a sample,
/// spoil a baseline, or start windows afresh. Never does time shift.
#[test]
fn seven_and_eight_lost_in_a_row_at_every_phase() {
    const FRAMES: u64 = 300;
    let bright = |frame: u64| (60..75).contains(&frame);
    // Without losses: windows at 25, 30 …, the one at 60 fires, the sample is 50..120, and the next window is at 130.
    for gap in [7, 8] {
        for at in 1..=FRAMES - gap {
            let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
            let (mut events, mut interrupted) = (Vec::new(), Vec::new());
            for frame in 0..FRAMES {
                if (at..at + gap).contains(&frame) {
                    trigger.push_lost(1);
                } else {
                    events.extend(push(&mut trigger, if bright(frame) { BRIGHT } else { DARK }));
                }
                interrupted.extend(trigger.take_interrupted());
                assert_eq!(trigger.next_frame(), frame + 1);
            }
            events.extend(trigger.finish().map(OwnedEvent::from));
            interrupted.extend(trigger.take_interrupted());
            assert_eq!(trigger.end().frames, FRAMES);
            let context = format!("{gap} lost at {at}");
            assert_eq!(trigger.end().baseline_quiet, gap == 7 || at >= 25, "{context}");

            // What is lit, as the trigger saw it: fills repeat the last frame.
            let seen = |frame: u64| if (at..at + gap).contains(&frame) { bright(at - 1) } else { bright(frame) };
            let fires = |t: u64| (t..t + 5).any(seen);
            let windows_after = |start: u64| (start..=FRAMES - 5).step_by(5).find(|&t| fires(t));
            if gap == 8 && (65..120).contains(&at) {
                // The window at 60 had fired: its sample is cut off, and what is lit afterwards makes one of its own.
                assert_eq!(interrupted, [Incomplete { frame: 50, frames: (at - 50) as u8 }], "{context}");
                let expected: Vec<u64> = windows_after(at + 8).map(|t| t - 10).into_iter().collect();
                assert_eq!(events.iter().map(|event| event.frame).collect::<Vec<_>>(), expected, "{context}");
                continue;
            }
            assert_eq!(interrupted, [], "{context}");
            let first = if gap == 8 && (18..65).contains(&at) {
                // Windows before the gap are dark; the next starts after it.
                windows_after(at + 8)
            } else {
                windows_after(25)
            };
            let expected: Vec<u64> = first.map(|t| t - 10).into_iter().collect();
            assert_eq!(events.iter().map(|event| event.frame).collect::<Vec<_>>(), expected, "{context}");
            for event in &events {
                let filled = (event.frame..event.frame + 70).filter(|frame| (at..at + gap).contains(frame)).count();
                assert_eq!(usize::from(event.frames_filled), filled, "{context}");
                assert_eq!(event.reliable, filled <= 7 && (gap == 7 || at >= 25), "{context}");
            }
        }
    }
}

/// The last frames of a stream lost: 7 can complete a sample, 8 leave it incomplete, and the end counts them.
#[test]
fn losses_at_the_very_end() {
    for arrived in 100..=125_u64 {
        for lost in 0..=9 {
            let mut trigger = trigger(5, 10, Rule::Signed, 1.2);
            let mut events = 0;
            for frame in 0..arrived {
                events +=
                    u32::from(push(&mut trigger, if (60..75).contains(&frame) { BRIGHT } else { DARK }).is_some());
            }
            trigger.push_lost(lost);
            events += u32::from(trigger.finish().is_some());
            let context = format!("{arrived} arrived, {lost} lost");
            let complete = arrived >= 120 || (lost <= 7 && arrived + lost >= 120);
            assert_eq!(events, u32::from(complete), "{context}");
            let end = trigger.end();
            assert_eq!(end.frames, arrived + lost, "{context}");
            let (open, interrupted) = (end.incomplete, trigger.take_interrupted());
            if complete {
                assert_eq!((open, interrupted), (None, None), "{context}");
            } else if lost > 7 {
                let frames = (arrived - 50) as u8;
                assert_eq!((open, interrupted), (None, Some(Incomplete { frame: 50, frames })), "{context}");
            } else {
                let frames = (arrived + lost - 50) as u8;
                assert_eq!((open, interrupted), (Some(Incomplete { frame: 50, frames }), None), "{context}");
            }
        }
    }
}

// Answers.

/// What `answer` says of a sample that is lit over `lit`, above a dark baseline.
fn with_event<T>(lit: core::ops::Range<usize>, answer: impl Fn(&Event<'_>) -> T) -> T {
    let mut frames = [[DARK; 10]; 70];
    frames[lit].fill([-2000; 10]);
    let baseline = Baseline::new([25 * i32::from(DARK); 10], 25);
    let sample = Sample::from_frames(&frames);
    answer(&Event { frame: 0, sample, baseline: &baseline, frames_filled: 0, reliable: true })
}

/// Durations of 0, of 67 (the longest that is not cut off) and of 69 frames, and none.
#[test]
fn durations_0_and_69() {
    let config = SpeedConfig::paper(FrameRate::NOMINAL);
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
        let Err(NoSpeed::CutOff { at_most: Some(bound) }) = answer(lit.clone()) else {
            panic!("{lit:?} is not cut off")
        };
        assert!(close(bound, frames), "{lit:?}: {bound}");
    }
    assert_eq!((duration(0..0), answer(0..0)), (None, Err(NoSpeed::NeverValid)));
    // Without any light above baseline there is no direction either.
    let direction = with_event(0..0, direction::direction);
    assert_eq!((direction.heading, direction.confidence), (Err(Unclear::NeverLit), 0));
}

/// The laws at their poles and beyond: no speed, never an infinite or negative one.
#[test]
fn speed_laws_at_their_poles() {
    let physical = |track, afterglow| Law::Physical { track, afterglow };
    let law = physical(90.0, 7.0);
    assert_eq!([7.0, 6.999, 0.0, -1.0, f32::NAN].map(|frames| law.speed(frames)), [None; 5]);
    assert_eq!(law.speed(8.0), Some(2700.0));
    assert_eq!(law.speed(f32::from_bits(7.0_f32.to_bits() + 1)).map(f32::is_finite), Some(true));
    assert_eq!(physical(f32::MAX, 7.0).speed(8.0), None);
    assert_eq!(physical(90.0, f32::MAX).speed(69.0), None);
    assert!(physical(90.0, f32::MIN).speed(69.0).is_some_and(|mm_s| mm_s >= 0.0));
    // At an event: an afterglow of 10 frames, lit for 10 and for 11.
    let config = |law, rate| SpeedConfig::new(law, 0.0475, ThresholdOn::Absolute, rate).unwrap();
    let answer = |law, rate, lit| with_event(lit, |event| speed::speed(event, &config(law, rate)));
    let law = physical(90.0, 10.0);
    assert_eq!(answer(law, FrameRate::NOMINAL, 20..31), Err(NoSpeed::OutsideLaw));
    assert_eq!(answer(law, FrameRate::NOMINAL, 20..32).map(|speed| speed.mm_s), Ok(2700.0));
    assert_eq!(answer(law, FrameRate::NOMINAL, 0..11), Err(NoSpeed::CutOff { at_most: None }));
    let paper = |intercept, slope| Law::Paper { intercept, slope };
    assert_eq!(paper(f32::MAX, 56.29).speed(10.0), None);
    assert_eq!(paper(151.06, f32::MIN_POSITIVE).speed(10.0), None);
    assert_eq!(paper(f32::MIN, 56.29).speed(10.0), Some(0.0));
    assert!(paper(151.06, f32::MAX).speed(10.0).is_some_and(|mm_s| (mm_s - 1.0).abs() < 1e-6));
    // One frame a second: 30 nominal frames each, so one frame of difference is 30.
    let slow = FrameRate::new(1, 1).unwrap();
    let speed = answer(Law::PAPER, slow, 20..22).unwrap();
    assert!((f64::from(speed.mm_s) / 10_f64.powf((151.06 - 30.0) / 56.29) - 1.0).abs() < 1e-5, "{speed:?}");
    // The slowest rate that can be said, over the longest sample: no overflow, no speed above zero to speak of.
    let slowest = FrameRate::new(1, u32::MAX).unwrap();
    assert_eq!(answer(Law::PAPER, slowest, 1..69).map(|speed| speed.mm_s), Ok(0.0));
    assert!(answer(law, slowest, 1..69).is_ok_and(|speed| speed.mm_s > 0.0 && speed.extrapolated));
}

/// NaN, infinities, subnormal numbers, negative zero and negative numbers in every real parameter: refused, or as
/// harmless as zero.
#[test]
fn not_numbers_are_refused_or_harmless() {
    let same = |a: f64, b: f64| a.to_bits() == b.to_bits();
    let tiny = f64::from_bits(1);
    for bad in NOT_NUMBERS.into_iter().chain([-tiny, -1.0, f64::MIN]) {
        let floor = FeatureScale::<Fixed>::new(100, 255, 1, bad).unwrap_err();
        assert!(matches!(floor, Error::FloorLevels(found) if same(found, bad)), "{bad}");
        for rule in [Rule::Literal, Rule::Signed] {
            let multiplier = TriggerConfig::new(5, bad, 10, rule, 0.2).unwrap_err();
            assert!(matches!(multiplier, Error::Multiplier(found) if same(found, bad)), "{bad}");
            let margin = TriggerConfig::new(5, 1.2, 10, rule, bad).unwrap_err();
            assert!(matches!(margin, Error::Margin(found) if same(found, bad)), "{bad}");
        }
    }
    for zero in [0.0, -0.0, tiny, f64::MIN_POSITIVE] {
        let config = |b, margin| TriggerConfig::new(5, b, 10, Rule::Literal, margin).unwrap();
        assert_eq!(config(zero, 0.2), config(0.0, 0.2));
        assert_eq!(config(1.2, zero), config(1.2, 0.0));
        assert!(TriggerConfig::new(5, zero, 10, Rule::Signed, 0.2).is_err());
    }
    let floor = |levels| FeatureScale::<Fixed>::new(100, 255, 1, levels).map(|scale| scale.floor());
    assert_eq!(floor(-0.0), floor(0.0));
    assert_eq!(floor(0.0), Ok(feature(1.0 / 25_500.0)));
    assert_eq!([floor(tiny), floor(f64::MIN_POSITIVE), floor(1e-9)], [Ok(i16::MIN); 3], "saturates at −16");
    assert_eq!((floor(255.0), floor(255.000_001).is_err()), (Ok(3296), true));

    let speed = |threshold| SpeedConfig::new(Law::PAPER, threshold, ThresholdOn::Absolute, FrameRate::NOMINAL);
    for bad in NOT_NUMBERS.into_iter().chain([-tiny, -1.0, 0.0, -0.0, 5.000_001, f64::MAX]) {
        assert!(matches!(speed(bad), Err(Error::SpeedThreshold(found)) if same(found, bad)), "{bad}");
    }
    for on in [ThresholdOn::Absolute, ThresholdOn::AboveBaseline] {
        for threshold in [tiny, f64::MIN_POSITIVE, 5.0] {
            let config = SpeedConfig::new(Law::PAPER, threshold, on, FrameRate::NOMINAL).unwrap();
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
        let refused = [
            Law::Paper { intercept: bad, slope: 56.29 },
            Law::Paper { intercept: 151.06, slope: bad },
            Law::Physical { track: bad, afterglow: 5.0 },
            Law::Physical { track: 114.0, afterglow: bad },
        ];
        for refused in refused.map(law) {
            assert!(matches!(refused, Err(Error::SpeedLaw(found)) if found.to_bits() == bad.to_bits()), "{bad}");
        }
    }
    for bad in [0.0, -0.0, -1.0, -f32::from_bits(1), f32::MIN] {
        for refused in [Law::Paper { intercept: 151.06, slope: bad }, Law::Physical { track: bad, afterglow: 5.0 }] {
            assert!(matches!(law(refused), Err(Error::SpeedLaw(found)) if found.to_bits() == bad.to_bits()), "{bad}");
        }
    }
    let tiny = f32::from_bits(1);
    for harmless in [
        Law::Paper { intercept: -0.0, slope: tiny },
        Law::Paper { intercept: tiny, slope: f32::MAX },
        Law::Physical { track: tiny, afterglow: -0.0 },
        Law::Physical { track: f32::MAX, afterglow: -tiny },
        Law::Physical { track: f32::MAX, afterglow: f32::MIN },
    ] {
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

/// A recorded baseline and sample that no sensor can have made: answers, but no overflow.
#[test]
fn recorded_numbers_that_no_sensor_makes() {
    let frames: [Features; 70] = core::array::from_fn(|frame| [if frame % 2 == 0 { i16::MIN } else { i16::MAX }; 10]);
    for total in [i32::MIN, -1, 0, 1, i32::MAX] {
        for count in [0, 1, 25, u16::MAX] {
            let baseline = Baseline::new([total; 10], count);
            let sample = Sample::from_frames(&frames);
            let event = Event { frame: u64::MAX, sample, baseline: &baseline, frames_filled: 255, reliable: true };
            let direction = direction::direction(&event);
            assert!(direction.heading.is_err() && direction.confidence <= 32_768);
            for on in [ThresholdOn::Absolute, ThresholdOn::AboveBaseline] {
                let config = SpeedConfig::new(Law::PAPER, 0.0475, on, FrameRate::NOMINAL).unwrap();
                assert!(speed::speed(&event, &config).is_err(), "the last frame is lit");
            }
        }
    }
    assert_eq!(speed::Duration { first: 9, last: 3 }.frames(), 0);
}
