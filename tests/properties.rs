//! What holds for every input: proptest over formats, layouts, stripes, losses and configurations. The seed is fixed;
//! what once failed is kept beside this file and tried first.

use proptest::prelude::*;
use proptest::test_runner::{FileFailurePersistence, RngSeed};

use wstac_core::direction;
use wstac_core::features::Features;
use wstac_core::frame::Stride;
use wstac_core::green::Green;
use wstac_core::green::any::{Any, PixelFormat, YcbcrMethod};
use wstac_core::green::grey::Grey;
use wstac_core::green::ycbcr::{Colour, Matrix, Range};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::speed::{self, Law, SpeedConfig, ThresholdOn};
use wstac_core::taxels::{Accumulators, Camera};
use wstac_core::trigger::{Event, Rule, Trigger, TriggerConfig};
use wstac_tests::plain_sums::{self, Picture};
use wstac_tests::random::Random;
use wstac_tests::{OwnedEvent, formats, plain_trigger, with_green_type};

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(0x5EED),
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct("properties.regressions"))),
        ..ProptestConfig::default()
    }
}

// What there is to choose from.

fn any_format() -> impl Strategy<Value = PixelFormat> {
    prop::sample::select(formats::all())
}

fn any_colour() -> impl Strategy<Value = Colour> {
    prop::sample::select(formats::COLOURS.to_vec())
}

fn any_method() -> impl Strategy<Value = YcbcrMethod> {
    prop::sample::select(formats::METHODS.to_vec())
}

/// A picture's description: any format, any size up to 40 × 40, any layout, stride and padding.
fn any_picture() -> impl Strategy<Value = Picture> {
    (2_usize..=40, 2_usize..=40, prop::sample::select(vec![1_usize, 2, 3, 5]), 0_usize..9, any::<u64>()).prop_flat_map(
        |(width, height, stride, padding, seed)| {
            (any_format(), any_colour(), any_method(), 2..=width, 2..=height).prop_map(
                move |(format, colour, method, taxel_width, taxel_height)| {
                    let mut random = Random::new(seed);
                    let corners = [[0_usize; 2]; 25].map(|_| {
                        [width - taxel_width, height - taxel_height].map(|room| random.below(room as u64 + 1) as usize)
                    });
                    let bytes_per_row = plain_sums::row_bytes(format, width) + padding;
                    let taxel = [taxel_width, taxel_height];
                    Picture { format, colour, method, width, height, bytes_per_row, stride, taxel, corners }
                },
            )
        },
    )
}

fn layout_of(picture: &Picture) -> Layout {
    let size = FrameSize::new(picture.width as u32, picture.height as u32).unwrap();
    let corners = picture.corners.map(|corner| corner.map(|x| x as u16));
    Layout::new(size, picture.taxel.map(|x| x as u16), corners).unwrap()
}

fn camera_of<G: Green>(green: G, picture: &Picture) -> Camera<G> {
    let stride = Stride::try_from(picture.stride as u32).unwrap();
    Camera::with_stride(green, layout_of(picture), FrameRate::NOMINAL, stride)
        .and_then(|camera| camera.with_bytes_per_row(picture.bytes_per_row as u32))
        .unwrap()
}

fn any_of(picture: &Picture) -> Any {
    Any::new(picture.format, picture.colour, picture.method)
}

prop_compose! {
    fn any_trigger_config()(window in 1_u32..=70)(
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

/// Configurations that fire now and then rather than always or never.
fn lively_trigger_config() -> impl Strategy<Value = TriggerConfig> {
    (1_u32..=20, 0_u32..=50, any::<bool>()).prop_map(|(window, backtrack, literal)| {
        let backtrack = backtrack.min(5 * window).min(70 - window);
        let (rule, multiplier) = if literal { (Rule::Literal, 0.8) } else { (Rule::Signed, 1.1) };
        TriggerConfig::new(window, multiplier, backtrack, rule, 0.2).unwrap()
    })
}

/// A stream of features: dark with noise, bright now and then, from every level there is.
fn features(frames: usize, seed: u64) -> Vec<Features> {
    let mut random = Random::new(seed);
    let dark = -16_000 + random.below(17_000) as i64;
    let noise = 1 + random.below(60);
    let mut bright = 0;
    (0..frames)
        .map(|_| {
            if bright > 0 {
                bright -= 1;
            } else if random.below(90) == 0 {
                bright = random.below(80);
            }
            let level = if bright > 0 { dark + (3_290 - dark) / 2 } else { dark };
            [0; 10].map(|_| (level + random.below(noise) as i64) as i16)
        })
        .collect()
}

/// Pushes one frame; what it brought about.
fn push(trigger: &mut Trigger, features: Features) -> Option<OwnedEvent> {
    trigger.push(features, false).map(OwnedEvent::from)
}

fn finish(trigger: &mut Trigger) -> Option<OwnedEvent> {
    trigger.finish().map(OwnedEvent::from)
}

// Bytes to sums.

proptest! {
    #![proptest_config(config(3000))]

    #[test]
    fn sums_are_those_of_the_plain_model(picture in any_picture(), seed in any::<u64>()) {
        let bytes = Random::new(seed).bytes(picture.bytes());
        let (pixels, sums) = picture.sums(&bytes);
        let expected = sums.map(|sum| sum as u32);
        let camera = camera_of(any_of(&picture), &picture);
        prop_assert_eq!(u64::from(camera.pixels()), pixels);
        prop_assert_eq!(u64::from(camera.full_scale()), plain_sums::full_scale(picture.format));
        prop_assert_eq!(camera.frame_bytes(), picture.bytes());
        let mut any = Accumulators::new(camera);
        prop_assert_eq!(any.push_frame(&bytes).unwrap(), expected);
        // Accumulators are empty again, and one byte less is no frame.
        prop_assert!(any.push_frame(&bytes[1..]).is_err());
        prop_assert_eq!(any.push_frame(&bytes).unwrap(), expected);
        let typed = with_green_type!(picture.format, picture.colour, picture.method, green => {
            Accumulators::new(camera_of(green, &picture)).push_frame(&bytes).unwrap()
        });
        prop_assert_eq!(typed, expected);
    }

    #[test]
    fn any_split_into_stripes_gives_the_sums_of_the_whole_frame(picture in any_picture(), seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let bytes = random.bytes(picture.bytes());
        let mut whole = Accumulators::new(camera_of(any_of(&picture), &picture));
        let expected = whole.push_frame(&bytes).unwrap();
        let mut striped = Accumulators::new(camera_of(any_of(&picture), &picture));
        if formats::is_planar(picture.format) {
            prop_assert!(striped.push_stripe(&bytes).is_err());
            return Ok(());
        }
        let (mut row, mut sums) = (0, None);
        while row < picture.height {
            prop_assert!(sums.is_none(), "sums before the last row");
            let rows = (1 + random.below(5) as usize).min(picture.height - row);
            let (start, end) = (row * picture.bytes_per_row, (row + rows) * picture.bytes_per_row);
            // The padding after a stripe's last row may be missing.
            let padding = picture.bytes_per_row - plain_sums::row_bytes(picture.format, picture.width);
            let cut = random.below(padding as u64 + 1) as usize;
            sums = striped.push_stripe(&bytes[start..(end - cut).min(bytes.len())]).unwrap();
            row += rows;
        }
        prop_assert_eq!(sums, Some(expected));
    }

    #[test]
    fn an_abandoned_frame_leaves_nothing_behind(picture in any_picture(), rows in 0_usize..40, seed in any::<u64>()) {
        prop_assume!(!formats::is_planar(picture.format));
        let bytes = Random::new(seed).bytes(picture.bytes());
        let mut accumulators = Accumulators::new(camera_of(any_of(&picture), &picture));
        let expected = accumulators.push_frame(&bytes).unwrap();
        let rows = rows.min(picture.height - 1);
        prop_assert_eq!(accumulators.push_stripe(&bytes[..rows * picture.bytes_per_row]).unwrap(), None);
        prop_assert_eq!(accumulators.push_frame(&bytes).is_err(), rows > 0);
        accumulators.abandon_frame();
        prop_assert_eq!(accumulators.push_frame(&bytes).unwrap(), expected);
    }
}

/// The bytes of one grey picture, `levels` row by row, in another format, without padding.
fn in_format(format: PixelFormat, levels: &[u8], width: usize, random: &mut Random) -> Vec<u8> {
    use PixelFormat as F;
    let words = |factor: u16| levels.iter().flat_map(|&v| (u16::from(v) * factor).to_le_bytes()).collect();
    let pairs = || levels.chunks(width).flat_map(|row| row.chunks(2));
    let second = |pair: &[u8]| pair.get(1).copied().unwrap_or(0);
    let planes = |row_bytes: usize, chroma: usize| {
        let padded =
            levels.chunks(width).flat_map(|row| row.iter().copied().chain(std::iter::repeat_n(7, row_bytes - width)));
        padded.chain(std::iter::repeat_n(128, chroma)).collect()
    };
    let (height, cells) = (levels.len() / width, width.div_ceil(2));
    match format {
        F::Grey | F::Bayer8(_) => levels.to_vec(),
        F::Y10 | F::Bayer10(_) => words(4),
        F::Y12 | F::Bayer12(_) => words(16),
        F::Y16 => words(257),
        F::Rgb24 | F::Bgr24 => levels.iter().flat_map(|&v| [random.bits() as u8, v, random.bits() as u8]).collect(),
        F::Rgbx32 => levels.iter().flat_map(|&v| [random.bits() as u8, v, random.bits() as u8, 9]).collect(),
        F::Xrgb32 => levels.iter().flat_map(|&v| [9, random.bits() as u8, v, random.bits() as u8]).collect(),
        F::Rgb565 => {
            let red_and_blue = random.bits() as u16 & 0xF81F;
            levels.iter().flat_map(|&v| (u16::from(v) >> 2 << 5 | red_and_blue).to_le_bytes()).collect()
        }
        F::Yuyv => pairs().flat_map(|pair| [pair[0], 128, second(pair), 128]).collect(),
        F::Uyvy => pairs().flat_map(|pair| [128, pair[0], 128, second(pair)]).collect(),
        F::Nv12 => planes(2 * cells, 2 * cells * height.div_ceil(2)),
        F::Yu12 => planes(width, 2 * cells * height.div_ceil(2)),
        F::Yuv422p => planes(width, 2 * cells * height),
        F::Yuv444p => planes(width, 2 * levels.len()),
    }
}

proptest! {
    #![proptest_config(config(600))]

    #[test]
    fn formats_agree_on_one_grey_picture(picture in any_picture(), method in any_method(), seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let levels = random.bytes(picture.width * picture.height);
        let sums_in = |format: PixelFormat, levels: &[u8], random: &mut Random| {
            let colour = Colour { matrix: picture.colour.matrix, range: Range::Full };
            let bytes_per_row = plain_sums::row_bytes(format, picture.width);
            let picture = Picture { format, colour, method, bytes_per_row, ..picture.clone() };
            let bytes = in_format(format, levels, picture.width, random);
            Accumulators::new(camera_of(any_of(&picture), &picture)).push_frame(&bytes).unwrap()
        };
        let grey = sums_in(PixelFormat::Grey, &levels, &mut random);
        let widened: Vec<u8> = levels.iter().map(|&v| v >> 2 << 2 | v >> 6).collect();
        for format in formats::all() {
            let expected = match format {
                PixelFormat::Y10 => grey.map(|sum| sum * 4),
                PixelFormat::Y12 => grey.map(|sum| sum * 16),
                PixelFormat::Y16 => grey.map(|sum| sum * 257),
                PixelFormat::Rgb565 => sums_in(PixelFormat::Grey, &widened, &mut random),
                // Mosaics see half the pixels: below.
                PixelFormat::Bayer8(_) | PixelFormat::Bayer10(_) | PixelFormat::Bayer12(_) => continue,
                _ => grey,
            };
            prop_assert_eq!(sums_in(format, &levels, &mut random), expected, "{:?}", format);
        }
        // In the two orders with green on the same diagonal; of every bit depth.
        let mosaic = formats::BAYER_ORDERS.map(|order| sums_in(PixelFormat::Bayer8(order), &levels, &mut random));
        prop_assert_eq!(mosaic[0], mosaic[3]);
        prop_assert_eq!(mosaic[1], mosaic[2]);
        for (order, eight) in formats::BAYER_ORDERS.into_iter().zip(mosaic) {
            prop_assert_eq!(sums_in(PixelFormat::Bayer10(order), &levels, &mut random), eight.map(|sum| sum * 4));
            prop_assert_eq!(sums_in(PixelFormat::Bayer12(order), &levels, &mut random), eight.map(|sum| sum * 16));
        }
        // Both diagonals together are the grey picture, where cells are counted as pixels are.
        if picture.stride == 1 {
            let even = |x: usize| x & !1;
            let snapped = Picture {
                format: PixelFormat::Grey,
                bytes_per_row: picture.width,
                taxel: picture.taxel.map(even),
                corners: picture.corners.map(|corner| corner.map(even)),
                ..picture.clone()
            };
            let (_, sums) = snapped.sums(&levels);
            for ((a, b), whole) in mosaic[0].into_iter().zip(mosaic[1]).zip(sums) {
                prop_assert_eq!(u64::from(a + b), whole);
            }
        }
    }

    #[test]
    fn ycbcr_layouts_agree_on_one_picture(
        picture in any_picture(), colour in any_colour(), method in any_method(), seed in any::<u64>(),
    ) {
        let (width, height) = (picture.width & !1, picture.height & !1);
        let taxel = [picture.taxel[0].min(width), picture.taxel[1].min(height)];
        let corners = picture.corners.map(|[x, y]| [x.min(width - taxel[0]), y.min(height - taxel[1])]);
        let mut random = Random::new(seed);
        let luma = random.bytes(width * height);
        // One chroma sample for 2 × 2 pixels, seen through each layout.
        let (cb, cr) = (random.bytes(width * height / 4), random.bytes(width * height / 4));
        let cell = |x: usize, y: usize| y / 2 * (width / 2) + x / 2;
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pairs = || pixels().filter(|(x, _)| x % 2 == 0);
        let at = |x: usize, y: usize| luma[y * width + x];
        let yuyv = pairs().flat_map(|(x, y)| [at(x, y), cb[cell(x, y)], at(x + 1, y), cr[cell(x, y)]]).collect::<Vec<u8>>();
        let uyvy = yuyv.chunks(2).flat_map(|pair| [pair[1], pair[0]]).collect::<Vec<u8>>();
        let nv12 = [luma.clone(), cb.iter().zip(&cr).flat_map(|(&cb, &cr)| [cb, cr]).collect()].concat();
        let yu12 = [luma.clone(), cb.clone(), cr.clone()].concat();
        let half = |plane: &[u8]| pairs().map(|(x, y)| plane[cell(x, y)]).collect::<Vec<u8>>();
        let full = |plane: &[u8]| pixels().map(|(x, y)| plane[cell(x, y)]).collect::<Vec<u8>>();
        let yuv422p = [luma.clone(), half(&cb), half(&cr)].concat();
        let yuv444p = [luma.clone(), full(&cb), full(&cr)].concat();
        let sums = [
            (PixelFormat::Yuyv, yuyv), (PixelFormat::Uyvy, uyvy), (PixelFormat::Nv12, nv12),
            (PixelFormat::Yu12, yu12), (PixelFormat::Yuv422p, yuv422p), (PixelFormat::Yuv444p, yuv444p),
        ].map(|(format, bytes)| {
            let bytes_per_row = plain_sums::row_bytes(format, width);
            let picture = Picture { format, colour, method, width, height, bytes_per_row, taxel, corners, ..picture };
            Accumulators::new(camera_of(any_of(&picture), &picture)).push_frame(&bytes).unwrap()
        });
        for other in &sums[1..] {
            prop_assert_eq!(other, &sums[0]);
        }
    }
}

// Features to events.

proptest! {
    #![proptest_config(config(1500))]

    #[test]
    fn events_are_those_of_the_plain_model(
        config in prop_oneof![any_trigger_config(), lively_trigger_config()],
        frames in 0_usize..900, losses in prop::collection::vec((0_usize..900, 1_u64..=7), 0..30), seed in any::<u64>(),
    ) {
        // Losses of up to 7 in a row, each after a frame that arrived: the plain model gets them filled in by hand.
        let arriving = features(frames, seed);
        let mut filled = Vec::new();
        let mut trigger = Trigger::new(config);
        let mut events = Vec::new();
        for (number, frame) in arriving.into_iter().enumerate() {
            filled.push((frame, false));
            events.extend(push(&mut trigger, frame));
            if let Some(&(_, lost)) = losses.iter().find(|loss| loss.0 == number) {
                filled.extend((0..lost).map(|_| (frame, true)));
                trigger.push_lost(lost);
            }
            prop_assert_eq!(trigger.next_frame(), filled.len() as u64);
        }
        events.extend(finish(&mut trigger));
        let (expected, open) = plain_trigger::events(&filled, &config);
        for (event, expected) in events.iter().zip(&expected) {
            prop_assert_eq!(event, expected);
        }
        prop_assert_eq!(events.len(), expected.len());
        let end = trigger.end();
        prop_assert_eq!(end.frames, filled.len() as u64);
        prop_assert_eq!(end.baseline_complete, filled.len() >= 5 * usize::from(config.window()));
        prop_assert_eq!(end.incomplete.map(|i| (i.frame, i.frames)), open);
    }

    #[test]
    fn samples_never_overlap_whatever_is_lost(
        config in prop_oneof![any_trigger_config(), lively_trigger_config()],
        losses in prop::collection::vec((0_usize..600, prop_oneof![1_u64..=20, 60_u64..200, any::<u64>()]), 0..30),
        start in prop_oneof![Just(0), any::<u32>().prop_map(u64::from)], seed in any::<u64>(),
    ) {
        let mut trigger = Trigger::starting_at(config, start);
        let mut frames_seen = start;
        let mut last: Option<u64> = None;
        let mut check = |event: Option<OwnedEvent>, now: u64| {
            // At the end of all numbers time stands still.
            if let Some(event) = event.filter(|_| now < u64::MAX) {
                assert_eq!(event.sample.len(), 70);
                assert!(event.frame >= start && event.frame.saturating_add(70) <= now, "{} at {now}", event.frame);
                assert!(last.is_none_or(|last| event.frame >= last.saturating_add(70)), "{last:?}, {}", event.frame);
                last = Some(event.frame);
            }
        };
        for (number, frame) in features(600, seed).into_iter().enumerate() {
            let event = push(&mut trigger, frame);
            frames_seen = frames_seen.saturating_add(1);
            check(event, frames_seen);
            if let Some(&(_, lost)) = losses.iter().find(|loss| loss.0 == number) {
                trigger.push_lost(lost);
                frames_seen = frames_seen.saturating_add(lost);
            }
            prop_assert_eq!(trigger.next_frame(), frames_seen);
            if let Some(interrupted) = trigger.take_interrupted() {
                prop_assert!((1..=69).contains(&interrupted.frames));
            }
        }
        let event = finish(&mut trigger);
        check(event, frames_seen);
        prop_assert_eq!(trigger.end().frames, frames_seen);
    }

    #[test]
    fn after_a_long_gap_frames_have_their_own_numbers(
        config in lively_trigger_config(), before in 0_usize..200, gap in 8_u64..5000, seed in any::<u64>(),
    ) {
        // What follows a long gap is what follows a quiet baseline of its own length, moved in time: windows start
        // afresh, and the baseline stays.
        let m = usize::from(config.window());
        let quiet = vec![[-8000; 10]; 5 * m + before];
        let after = features(500, seed);
        let mut gapped = Trigger::new(config);
        for &frame in &quiet {
            gapped.push(frame, false);
        }
        gapped.push_lost(gap);
        let mut plain = Trigger::new(config);
        // Of the quiet stream only whole windows, so that the next starts with `after`; at least 70 to look back on.
        for _ in 0..5 * m + 70_usize.next_multiple_of(m) {
            plain.push([-8000; 10], false);
        }
        let shift = gapped.next_frame() as i64 - plain.next_frame() as i64;
        for frame in after {
            let (found, expected) = (push(&mut gapped, frame), push(&mut plain, frame));
            prop_assert_eq!(found.is_some(), expected.is_some());
            if let (Some(found), Some(expected)) = (found, expected) {
                prop_assert_eq!(found.frame as i64, expected.frame as i64 + shift);
                prop_assert_eq!(found.sample, expected.sample);
            }
        }
    }
}

// All of it.

/// What can be done to a pipeline.
#[derive(Clone, Debug)]
enum Step {
    Frame(u64),
    Dark,
    ShortFrame(usize),
    Stripe(usize),
    Lost(u64),
    Abandon,
    Finish,
}

fn any_step() -> impl Strategy<Value = Step> {
    prop_oneof![
        10 => any::<u64>().prop_map(Step::Frame),
        10 => Just(Step::Dark),
        1 => (0_usize..5000).prop_map(Step::ShortFrame),
        5 => (0_usize..5000).prop_map(Step::Stripe),
        1 => prop_oneof![0_u64..=10, any::<u64>()].prop_map(Step::Lost),
        1 => Just(Step::Abandon),
        1 => Just(Step::Finish),
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
    prop_oneof![
        Just(Law::PAPER),
        Just(Law::PHYSICAL),
        (number(), number()).prop_map(|(intercept, slope)| Law::Paper { intercept, slope }),
        (number(), number()).prop_map(|(track, afterglow)| Law::Physical { track, afterglow }),
    ]
}

fn any_speed_config() -> impl Strategy<Value = SpeedConfig> {
    let threshold = prop_oneof![Just(0.0475), 0.0..5.5, any::<u64>().prop_map(f64::from_bits)];
    let on = prop_oneof![Just(ThresholdOn::Absolute), Just(ThresholdOn::AboveBaseline)];
    (any_law(), threshold, on, any_rate()).prop_map(|(law, threshold, on, rate)| {
        SpeedConfig::new(law, threshold, on, rate).unwrap_or_else(|_| SpeedConfig::paper(rate))
    })
}

/// Every answer to an event is one that its documentation allows.
fn check_answers(event: &Event<'_>, config: &SpeedConfig) {
    let direction = direction::direction(event);
    assert!(direction.confidence <= 32_768, "{direction:?}");
    let duration = speed::duration(event, config);
    assert!(duration.is_none_or(|duration| duration.first <= duration.last && duration.last < 70));
    if let Ok(speed) = speed::speed(event, config) {
        assert!(speed.mm_s.is_finite() && speed.mm_s >= 0.0, "{speed:?}");
    }
}

proptest! {
    #![proptest_config(config(400))]

    #[test]
    fn nothing_panics_for_any_bytes_and_any_configuration(
        picture in any_picture(), rate in any_rate(), trigger in prop_oneof![any_trigger_config(), lively_trigger_config()],
        floor in prop_oneof![Just(0.5), Just(0.0), any::<u64>().prop_map(f64::from_bits)],
        speed in any_speed_config(), kernel in 0..3, steps in prop::collection::vec(any_step(), 0..400),
    ) {
        fn run<L: wstac_core::ln::Ln>(
            camera: Camera<Any>, floor: f64, trigger: TriggerConfig, speed: &SpeedConfig, steps: &[Step],
        ) {
            let Ok(mut pipeline) = Pipeline::<Any, L>::new(camera, floor, trigger) else { return };
            let mut buffer = vec![0; camera.frame_bytes()];
            for step in steps {
                let event = match *step {
                    Step::Frame(seed) => {
                        let mut random = Random::new(seed);
                        let most = 1 + random.below(255);
                        buffer.fill_with(|| random.below(most) as u8);
                        pipeline.push_frame(&buffer).unwrap_or(None)
                    }
                    Step::Dark => {
                        buffer.fill(3);
                        pipeline.push_frame(&buffer).unwrap_or(None)
                    }
                    Step::ShortFrame(bytes) => pipeline.push_frame(&buffer[..bytes.min(buffer.len())]).unwrap_or(None),
                    Step::Stripe(bytes) => pipeline.push_stripe(&buffer[..bytes.min(buffer.len())]).unwrap_or(None),
                    Step::Lost(frames) => pipeline.push_lost(frames),
                    Step::Abandon => pipeline.abandon_frame(),
                    Step::Finish => pipeline.finish(),
                };
                if let Some(event) = event {
                    check_answers(&event, speed);
                }
                pipeline.take_interrupted();
                pipeline.end();
            }
        }
        let stride = Stride::try_from(picture.stride as u32).unwrap();
        let camera = Camera::with_stride(any_of(&picture), layout_of(&picture), rate, stride)
            .and_then(|camera| camera.with_bytes_per_row(picture.bytes_per_row as u32));
        // A rate can be too high for 32 bits.
        let Ok(camera) = camera else { return Ok(()) };
        match kernel {
            0 => run::<Fixed>(camera, floor, trigger, &speed, &steps),
            1 => run::<Libm>(camera, floor, trigger, &speed, &steps),
            _ => run::<Micromath>(camera, floor, trigger, &speed, &steps),
        }
    }

    #[test]
    fn any_split_into_stripes_gives_the_events_of_whole_frames(
        config in lively_trigger_config(), fps in prop_oneof![Just(30_u32), 1_u32..200], seed in any::<u64>(),
    ) {
        let mut random = Random::new(seed);
        let layout = Layout::paper(FrameSize::new(10, 8).unwrap()).unwrap();
        let rate = FrameRate::new(fps, 1).unwrap();
        let camera = Camera::new(Grey, layout, rate).unwrap().with_bytes_per_row(13).unwrap();
        let mut whole: Pipeline = Pipeline::new(camera, 0.5, config).unwrap();
        let mut striped = whole.clone();
        let mut events = 0;
        for frame in 0..400 * rate.frames_added() {
            let level = if frame / 120 % 2 == 1 { 150 } else { 10 };
            let bytes: Vec<u8> = (0..8 * 13).map(|_| level + random.below(20) as u8).collect();
            let expected = whole.push_frame(&bytes).unwrap().map(OwnedEvent::from);
            let mut found = None;
            let mut left = &bytes[..];
            while !left.is_empty() {
                let (stripe, rest) = left.split_at((13 * (1 + random.below(8) as usize)).min(left.len()));
                prop_assert!(found.is_none());
                found = striped.push_stripe(stripe).unwrap().map(OwnedEvent::from);
                left = rest;
            }
            events += usize::from(found.is_some());
            prop_assert_eq!(found, expected);
        }
        prop_assert!(events > 0);
    }

    #[test]
    fn losses_add_up(
        config in lively_trigger_config(), fps in prop_oneof![Just(30_u32), 1_u32..400], seed in any::<u64>(),
    ) {
        let mut random = Random::new(seed);
        let rate = FrameRate::new(fps, 1).unwrap();
        let layout = Layout::paper(FrameSize::new(5, 5).unwrap()).unwrap();
        let mut once: Pipeline = Pipeline::new(Camera::new(Grey, layout, rate).unwrap(), 0.5, config).unwrap();
        let mut twice = once.clone();
        let (mut first, mut second) = (Vec::new(), Vec::new());
        for frame in 0..300 * rate.frames_added() {
            let bytes = [if frame / 90 % 2 == 1 { 150 } else { 10 } + random.below(9) as u8; 25];
            first.extend(once.push_frame(&bytes).unwrap().map(OwnedEvent::from));
            second.extend(twice.push_frame(&bytes).unwrap().map(OwnedEvent::from));
            if random.below(20) == 0 {
                let most = [3, 12, 300][random.below(3) as usize];
                let (a, b) = (random.below(most), random.below(most));
                first.extend(once.push_lost(a + b).map(OwnedEvent::from));
                second.extend(twice.push_lost(a).map(OwnedEvent::from));
                second.extend(twice.push_lost(b).map(OwnedEvent::from));
            }
            prop_assert_eq!(once.end().frames, twice.end().frames);
            prop_assert_eq!(once.take_interrupted(), twice.take_interrupted());
        }
        first.extend(once.finish().map(OwnedEvent::from));
        second.extend(twice.finish().map(OwnedEvent::from));
        prop_assert_eq!(first, second);
        prop_assert_eq!(once.end(), twice.end());
    }

    #[test]
    fn eight_and_sixteen_bits_of_one_picture_have_the_same_features(seed in any::<u64>(), matrix in any::<bool>()) {
        // 65535 = 257 · 255, so the shares of full scale are equal; the kernel may round them apart by a unit.
        let mut random = Random::new(seed);
        let levels = random.bytes(25 * 20);
        let layout = Layout::paper(FrameSize::new(25, 20).unwrap()).unwrap();
        let matrix = if matrix { Matrix::Bt601 } else { Matrix::Bt709 };
        let colour = Colour { matrix, range: Range::Full };
        let [eight, sixteen] = [PixelFormat::Grey, PixelFormat::Y16].map(|format| {
            let green = Any::new(format, colour, YcbcrMethod::Exact);
            let camera = Camera::new(green, layout, FrameRate::NOMINAL).unwrap();
            let mut stream = wstac_core::stream::FeatureStream::<Any, Fixed>::new(camera, 0.0).unwrap();
            stream.push_frame(&in_format(format, &levels, 25, &mut random)).unwrap().unwrap().features
        });
        for (a, b) in eight.into_iter().zip(sixteen) {
            prop_assert!((a - b).abs() <= 1, "{} {}", a, b);
        }
    }
}
