//! Strategies that choose formats, pictures and configurations.

use proptest::prelude::*;
use proptest::test_runner::{FileFailurePersistence, RngSeed};
use wstac_core::frame::Stride;
use wstac_core::green::GreenChannel;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::ycbcr::YcbcrEncoding;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::paper::trigger::{Rule, TriggerConfig};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_tests::formats;
use wstac_tests::plain_sums::{self, Picture};
use wstac_tests::random::Random;

/// Returns the settings for this many cases, which are the same in every run.
pub(super) fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(0x5EED),
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct("properties.regressions"))),
        ..ProptestConfig::default()
    }
}

pub(super) fn any_format() -> impl Strategy<Value = PixelFormat> {
    prop::sample::select(PixelFormat::all().collect::<Vec<_>>())
}

pub(super) fn any_color() -> impl Strategy<Value = YcbcrEncoding> {
    prop::sample::select(formats::COLORS.to_vec())
}

pub(super) fn any_method() -> impl Strategy<Value = YcbcrMethod> {
    prop::sample::select(formats::METHODS.to_vec())
}

/// Describes a picture of any format, any size up to 40 × 40, and any layout, stride and padding.
pub(super) fn any_picture() -> impl Strategy<Value = Picture> {
    (2_usize..=40, 2_usize..=40, prop::sample::select(vec![1_usize, 2, 3, 5]), 0_usize..9, any::<u64>()).prop_flat_map(
        |(width, height, stride, padding, seed)| {
            (any_format(), any_color(), any_method(), 2..=width, 2..=height).prop_map(
                move |(format, color, method, taxel_width, taxel_height)| {
                    let mut random = Random::new(seed);
                    let corners = [[0_usize; 2]; 25].map(|_| {
                        [width - taxel_width, height - taxel_height].map(|room| random.below(room as u64 + 1) as usize)
                    });
                    let bytes_per_row = plain_sums::row_bytes(format, width) + padding;
                    let taxel = [taxel_width, taxel_height];
                    Picture { format, color, method, width, height, bytes_per_row, stride, taxel, corners }
                },
            )
        },
    )
}

pub(super) fn layout_of(picture: &Picture) -> Layout {
    let size = FrameSize::new(picture.width as u32, picture.height as u32).unwrap();
    let corners = picture.corners.map(|corner| corner.map(|x| x as u16));
    Layout::new(size, picture.taxel.map(|x| x as u16), corners).unwrap()
}

pub(super) fn camera_of<G: GreenChannel>(green: G, picture: &Picture) -> FrameGeometry<G> {
    let stride = Stride::try_from(picture.stride as u32).unwrap();
    FrameGeometry::with_stride(green, layout_of(picture), FrameRate::NOMINAL, stride)
        .and_then(|camera| camera.with_bytes_per_row(picture.bytes_per_row as u32))
        .unwrap()
}

pub(super) fn any_of(picture: &Picture) -> Any {
    Any::new(picture.format, picture.color, picture.method)
}

prop_compose! {
    pub(super) fn any_trigger_config()(window in 1_u32..=70)(
        backtrack in 0..=(5 * window).min(70 - window),
        literal in any::<bool>(),
        multiplier in prop_oneof![Just(0.0), Just(1.0), 0.0..3.0_f64, 0.0..65_535.9_f64],
        margin in prop_oneof![Just(0.0), 0.0..1.0, 0.0..65_535.9],
        window in Just(window),
    ) -> TriggerConfig {
        let (rule, multiplier) = if literal { (Rule::Literal, multiplier) } else { (Rule::Signed, multiplier.max(1.0)) };
        TriggerConfig::new(window, multiplier, backtrack, rule, margin).unwrap()
    }
}

/// Chooses configurations that fire sometimes, rather than always or never.
pub(super) fn lively_trigger_config() -> impl Strategy<Value = TriggerConfig> {
    (1_u32..=20, 0_u32..=50, any::<bool>()).prop_map(|(window, backtrack, literal)| {
        let backtrack = backtrack.min(5 * window).min(70 - window);
        let (rule, multiplier) = if literal { (Rule::Literal, 0.8) } else { (Rule::Signed, 1.1) };
        TriggerConfig::new(window, multiplier, backtrack, rule, 0.2).unwrap()
    })
}
