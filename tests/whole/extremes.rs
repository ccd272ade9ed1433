//! Tests the ends of every range of light and of sizes. Each test names an extreme and what is guaranteed there.

use wstac_core::error::{ConfigError, FrameError};
use wstac_core::features::{FeatureScale, Features, Floor};
use wstac_core::frame::Stride;
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::bayer::BayerOrder;
use wstac_core::green::gray::Gray;
use wstac_core::green::packed_rgb::Rgb24;
use wstac_core::green::words::{Y10, Y12, Y16};
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding, YcbcrMatrix};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::stream::FeatureStream;
use wstac_core::taxels::{FrameGeometry, TaxelSums};
use wstac_tests::extreme::{feature, size, stacked};
use wstac_tests::formats;
use wstac_tests::plain_sums::{full_scale, row_bytes};

const FULL_RANGE: YcbcrEncoding = YcbcrEncoding { matrix: YcbcrMatrix::Bt601, range: QuantizationRange::Full };

fn any(format: PixelFormat) -> Any {
    Any::new(format, FULL_RANGE, YcbcrMethod::Exact)
}

/// Returns the bytes of a picture that is black (or white) everywhere.
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

fn features_of<G: GreenChannel, L: Ln>(camera: FrameGeometry<G>, floor_levels: f64, bytes: &[u8]) -> Features {
    FeatureStream::<G, L>::new(camera, floor_levels).unwrap().push_frame(bytes).unwrap().unwrap().features
}

// Light.

/// All black: every feature is the floor, with every format and kernel. Nothing fires, and nothing panics.
#[test]
fn all_black_is_the_floor_and_no_event() {
    for format in PixelFormat::all() {
        let layout = Layout::paper(size(20, 20)).unwrap();
        let camera = FrameGeometry::new(any(format), layout, FrameRate::NOMINAL).unwrap();
        let bytes = uniform(format, 20, 20, false);
        let full_scale = full_scale(format) as f64;
        assert_eq!(TaxelSums::new(camera).push_frame(&bytes).unwrap(), [0; 25], "{format:?}");
        let floor = feature(5.0 * 0.5 / full_scale);
        assert_eq!(features_of::<Any, Fixed>(camera, 0.5, &bytes), [floor; 10], "{format:?}");
        assert_eq!(features_of::<Any, Libm>(camera, 0.5, &bytes), [floor; 10], "{format:?}");
        assert_eq!(features_of::<Any, Micromath>(camera, 0.5, &bytes), [floor; 10], "{format:?}");
        let one_count = feature(1.0 / (full_scale * f64::from(camera.pixels())));
        assert_eq!(features_of::<Any, Libm>(camera, 0.0, &bytes), [one_count; 10], "{format:?}");
        let mut pipeline = Pipeline::builder(camera).build().unwrap();
        for _ in 0..200 {
            assert!(pipeline.push_frame(&bytes).unwrap().event().is_none(), "{format:?}");
        }
        assert!(pipeline.end().baseline_quiet);
    }
}

/// All saturated: sums are exactly A · G, and every feature is ln 5, with every format, method and kernel.
#[test]
fn all_saturated_is_ln_5() {
    for format in PixelFormat::all() {
        for method in formats::METHODS {
            let layout = Layout::paper(size(20, 20)).unwrap();
            let camera = FrameGeometry::new(Any::new(format, FULL_RANGE, method), layout, FrameRate::NOMINAL).unwrap();
            let bytes = uniform(format, 20, 20, true);
            let full = camera.pixels() * camera.full_scale();
            assert_eq!(TaxelSums::new(camera).push_frame(&bytes).unwrap(), [full; 25], "{format:?}");
            assert_eq!(features_of::<Any, Fixed>(camera, 0.5, &bytes), [3296; 10], "{format:?}");
            assert_eq!(features_of::<Any, Fixed<32>>(camera, 0.5, &bytes), [3296; 10], "{format:?}");
            assert_eq!(features_of::<Any, Libm>(camera, 0.5, &bytes), [3296; 10], "{format:?}");
            assert_eq!(features_of::<Any, Micromath>(camera, 0.5, &bytes), [3296; 10], "{format:?}");
        }
    }
}

// Sizes.

/// Taxels of one pixel (of one cell in mosaics): each reads exactly its own.
#[test]
fn one_pixel_taxels_read_their_own_pixel() {
    let mut corners = [[0; 2]; 25];
    for (taxel, corner) in corners.iter_mut().enumerate() {
        *corner = [taxel as u16 % 5, taxel as u16 / 5];
    }
    let layout = Layout::new(size(5, 5), [1, 1], corners).unwrap();
    let bytes: Vec<u8> = (1..=25).collect();
    let sums =
        TaxelSums::new(FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap()).push_frame(&bytes).unwrap();
    assert_eq!(sums.map(|sum| sum as u8).to_vec(), bytes);
    for order in BayerOrder::ALL {
        let error = FrameGeometry::new(any(PixelFormat::Bayer8(order)), layout, FrameRate::NOMINAL).unwrap_err();
        assert_eq!(error, ConfigError::EmptyTaxel { width: 1, height: 1 });
        let cell = stacked(size(2, 2), [2, 2], [0, 0]);
        let camera = FrameGeometry::new(any(PixelFormat::Bayer8(order)), cell, FrameRate::NOMINAL).unwrap();
        assert_eq!(camera.pixels(), 2);
        let sums = TaxelSums::new(camera).push_frame(&[1, 2, 4, 8]).unwrap();
        let greens_are_second_and_third = matches!(order, BayerOrder::Rggb | BayerOrder::Bggr);
        assert_eq!(sums, [if greens_are_second_and_third { 6 } else { 9 }; 25]);
    }
}

/// Frames of 1 × 1 to 16384 × 16384 pixels are accepted, down to the last pixel; 0 and 16385 are refused.
#[test]
fn frame_sizes_from_1_to_16384() {
    for (width, height) in [(0, 1), (1, 0), (16_385, 1), (1, 16_385), (u32::MAX, u32::MAX), (65_536, 65_536)] {
        assert_eq!(FrameSize::new(width, height), Err(ConfigError::FrameSize { width, height }));
    }
    let one = FrameGeometry::new(Gray, stacked(size(1, 1), [1, 1], [0, 0]), FrameRate::NOMINAL).unwrap();
    assert_eq!(TaxelSums::new(one).push_frame(&[77]).unwrap(), [77; 25]);
    assert_eq!(TaxelSums::new(one).push_frame(&[]).unwrap_err(), FrameError::FrameTooShort { found: 0, expected: 1 });
    for (width, height) in [(16_384, 1), (1, 16_384), (16_384, 16_384)] {
        let corner = [width as u16 - 1, height as u16 - 1];
        let layout = stacked(size(width, height), [1, 1], corner);
        let mut bytes = vec![0; width as usize * height as usize];
        *bytes.last_mut().unwrap() = 200;
        let camera = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap();
        assert_eq!(TaxelSums::new(camera).push_frame(&bytes).unwrap(), [200; 25], "{width}x{height}");
        let outside = Layout::new(size(width, height), [1, 1], [[width as u16, 0]; 25]);
        assert!(matches!(outside, Err(ConfigError::TaxelOutside { taxel: 0, .. })));
    }
    let corner = Layout::new(size(10, 10), [u16::MAX, u16::MAX], [[u16::MAX, u16::MAX]; 25]);
    let expected = Err(ConfigError::TaxelOutside { taxel: 0, end: (131_070, 131_070), frame: (10, 10) });
    assert_eq!(corner, expected, "ends do not wrap");
}

/// 5 · A · G at the end of 32 bits: it is accepted and exact up to there, and refused beyond when the geometry is
/// built.
#[test]
fn five_taxels_at_the_end_of_32_bits() {
    fn check<G: GreenChannel + core::fmt::Debug>(green: G, fits: [u16; 2], too_large: [u16; 2]) {
        let full_scale = u64::from(green.full_scale());
        let most = |taxel: [u16; 2]| 5 * u64::from(taxel[0]) * u64::from(taxel[1]) * full_scale;
        assert!(most(fits) >> 32 == 0 && most(too_large) >> 32 > 0, "the test is wrong");
        let frame = size(u32::from(fits[0].max(too_large[0])), u32::from(fits[1].max(too_large[1])));
        let refused = FrameGeometry::new(green, stacked(frame, too_large, [0, 0]), FrameRate::NOMINAL).unwrap_err();
        let pixels = u32::from(too_large[0]) * u32::from(too_large[1]);
        assert_eq!(refused, ConfigError::SumTooLarge { pixels, full_scale: full_scale as u32, frames: 1 });
        let camera = FrameGeometry::new(green, stacked(frame, fits, [0, 0]), FrameRate::NOMINAL).unwrap();
        let bytes = vec![255; camera.frame_bytes()];
        let full = camera.pixels() * camera.full_scale();
        assert_eq!(TaxelSums::new(camera).push_frame(&bytes).unwrap(), [full; 25]);
        assert_eq!(features_of::<G, Fixed>(camera, 0.5, &bytes), [3296; 10], "ln 5");
        // Too large for two frames added up, so also refused then.
        let doubled = FrameGeometry::new(green, stacked(frame, fits, [0, 0]), FrameRate::new(60, 1).unwrap());
        assert!(matches!(doubled, Err(ConfigError::SumTooLarge { frames: 2, .. })));
    }
    check(Y16::default(), [257, 51], [116, 113]); // A = 13107 and 13108
    check(Y12::default(), [353, 594], [419, 501]);
    check(Y10::default(), [1024, 820], [1013, 829]);
    check(Gray, [2091, 1611], [1836, 1835]);
    check(Rgb24::default(), [2091, 1611], [1836, 1835]);
    for full_scale in [255, 1023, 4095, 65_535] {
        let pixels = u32::MAX / 5 / full_scale;
        let floor = Floor::new(0.5, full_scale).unwrap();
        let scale = FeatureScale::<Fixed>::new(pixels, full_scale, 1, floor).unwrap();
        assert_eq!(scale.feature(5 * pixels * full_scale), 3296, "A = {pixels}, G = {full_scale}");
        for (pixels, frames) in [(pixels + 1, 1), (pixels, 2), (u32::MAX, 1), (pixels, u32::MAX)] {
            let refused = FeatureScale::<Fixed>::new(pixels, full_scale, frames, floor).unwrap_err();
            assert_eq!(refused, ConfigError::SumTooLarge { pixels, full_scale, frames });
        }
    }
    let refused = FrameGeometry::new(Gray, stacked(size(16_384, 16_384), [16_384; 2], [0, 0]), FrameRate::NOMINAL);
    assert!(matches!(refused, Err(ConfigError::SumTooLarge { pixels: 268_435_456, .. })));
    let fastest = FrameRate::new(u32::MAX, 1).unwrap();
    let refused = FrameGeometry::new(Gray, stacked(size(1, 1), [1, 1], [0, 0]), fastest);
    assert!(matches!(refused, Err(ConfigError::SumTooLarge { frames: 143_165_577, .. })));
}

/// Rows as far apart as a number allows: no size overflows, and no frame is long enough.
#[test]
fn four_gigabytes_from_row_to_row() {
    for format in PixelFormat::all() {
        let layout = stacked(size(16, 16_384), [2, 2], [0, 16_382]);
        let camera = FrameGeometry::new(any(format), layout, FrameRate::NOMINAL).unwrap();
        let camera = camera.with_bytes_per_row(u32::MAX).unwrap();
        let mut accumulators = TaxelSums::new(camera);
        let found = accumulators.push_frame(&[0; 4096]).unwrap_err();
        assert_eq!(found, FrameError::FrameTooShort { found: 4096, expected: camera.frame_bytes() });
        assert!(camera.frame_bytes() as u64 > 16_383 * u64::from(u32::MAX), "{format:?}");
        let least = row_bytes(format, 16) as u32;
        let narrow = FrameGeometry::new(any(format), layout, FrameRate::NOMINAL).unwrap().with_bytes_per_row(least - 1);
        assert_eq!(narrow.unwrap_err(), ConfigError::BytesPerRow { found: least - 1, expected: least });
    }
}

/// 5 · A · G with a stride: A is what it counts, so a frame that is too large for stride 1 may be accepted and right.
#[test]
fn the_32_bit_limit_counts_what_the_stride_counts() {
    // 8-bit taxels of 4104 x 4104 pixels hold 16 842 816; 5 · 255 of them do not fit, a quarter does not, a ninth does.
    let layout = stacked(size(4104, 4104), [4104, 4104], [0, 0]);
    let camera = |stride| FrameGeometry::with_stride(Gray, layout, FrameRate::NOMINAL, stride);
    for stride in [Stride::One, Stride::Two] {
        assert!(matches!(camera(stride), Err(ConfigError::SumTooLarge { .. })), "{stride:?}");
    }
    let bytes = vec![255; 4104 * 4104];
    for stride in [Stride::Three, Stride::Five] {
        let camera = camera(stride).unwrap();
        let counted = 4104_u32.div_ceil(u32::from(stride.get()));
        assert_eq!(camera.pixels(), counted * counted);
        assert_eq!(TaxelSums::new(camera).push_frame(&bytes).unwrap(), [255 * counted * counted; 25]);
    }
}

/// A frame that stops in the middle of its stripes: the next whole frame is refused until the first is abandoned, which
/// keeps its place in time.
#[test]
fn a_frame_that_stops_in_its_stripes_can_be_given_up() {
    let camera = FrameGeometry::new(Gray, Layout::paper(size(40, 40)).unwrap(), FrameRate::NOMINAL).unwrap();
    let mut pipeline = Pipeline::builder(camera).build().unwrap();
    let frame = [3; 1600];
    assert!(pipeline.push_frame(&frame).unwrap().event().is_none());
    assert!(pipeline.push_stripe(&frame[..400]).unwrap().frame().is_none());
    assert!(pipeline.push_lost(1).event().is_none());
    assert!(matches!(pipeline.push_frame(&frame), Err(FrameError::FrameUnderWay { rows: 10 })));
    assert!(pipeline.abandon_frame().event().is_none());
    assert!(pipeline.push_frame(&frame).unwrap().event().is_none());
    assert_eq!(pipeline.end().frames, 4);
}
