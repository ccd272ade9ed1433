use super::*;
use crate::features::Features;
use crate::green::gray::Gray;
use crate::layout::{FrameSize, Layout};
use crate::paper::baseline::Baseline;
use crate::paper::baseline_policy::FixedBaseline;
use crate::paper::sample::Sample;
use crate::pipeline::Pipeline;
use crate::rate::FrameRate;
use crate::taxels::FrameGeometry;
use crate::touch::motion::Readout;
use crate::touch::taxel_ring::ChosenTaxels;

/// Light of a dark taxel, as a fraction of full scale.
const DARK: f64 = 0.004;
/// Full scale of a taxel's sum.
const FULL: f64 = 637_500.0;

fn config() -> MotionConfig {
    MotionConfig::published(FrameRate::NOMINAL).with_readout(Readout::GLOBAL)
}

fn velocity(mm_s: f32, degrees: f32) -> Velocity {
    Velocity { mm_s, mm_s_sd: 1.0, degrees, degrees_sd: 1.0 }
}

/// Light along a path, in mm behind the leading edge.
fn profile(x: f64) -> f64 {
    let rise = 1.0 / (1.0 + (-0.5 * x).exp());
    0.4 * rise * (-x / 40.0).exp()
}

/// A touch: the light of each taxel in each frame, with a gain for each taxel.
fn taxels(mm_s: f64, degrees: f64, gain: impl Fn(usize) -> f64) -> [[f64; TAXELS]; SAMPLE_FRAMES] {
    let (up, right) = degrees.to_radians().sin_cos();
    core::array::from_fn(|frame| {
        core::array::from_fn(|taxel| {
            let (x, y) = (4.0 * ((taxel % 5) as f64 - 2.0), 4.0 * (2.0 - (taxel / 5) as f64));
            let at = (frame as f64 - 16.0) * mm_s / 30.0 - (x * right + y * up);
            DARK + gain(taxel) * profile(at)
        })
    })
}

fn ring(light: &[[f64; TAXELS]; SAMPLE_FRAMES]) -> TaxelRing {
    let mut ring = TaxelRing::new(FULL as u32);
    for frame in light {
        ring.push(&frame.map(|light| (light * FULL) as u32));
    }
    ring
}

fn features(light: &[[f64; TAXELS]; SAMPLE_FRAMES]) -> [Features; SAMPLE_FRAMES] {
    light.map(|frame| {
        core::array::from_fn(|line| {
            let of = |k: usize| if line < 5 { frame[5 * line + k] } else { frame[5 * k + line - 5] };
            ((0..5).map(of).sum::<f64>().ln() * 2048.0).round() as i16
        })
    })
}

fn of_sums(light: &[[f64; TAXELS]; SAMPLE_FRAMES], velocity: &Velocity) -> Option<PathSample> {
    let frames = features(light);
    let dark = ((5.0 * DARK).ln() * 2048.0).round() as i32;
    let baseline = Baseline::new([25 * dark; FEATURES], 25);
    PathSample::of_sums(&Event::new(0, Sample::from_frames(&frames), &baseline), velocity, config(), 70)
}

#[test]
fn a_model_of_fewer_numbers_gets_the_same_ones() {
    let light = taxels(150.0, 10.0, |_| 1.0);
    let velocity = velocity(150.0, 10.0);
    let ring = ring(&light);
    let whole = PathSample::of_taxels(&ring, &velocity, config(), 70).unwrap();
    for frames in [1, 2, 28, 29, 69] {
        let part = PathSample::of_taxels(&ring, &velocity, config(), frames).unwrap();
        let wanted = 10 * usize::from(frames);
        assert_eq!(part.numbers[..wanted], whole.numbers[..wanted]);
        assert_eq!(part.numbers[wanted..], [0; INPUTS][wanted..]);
    }
    let none = PathSample::of_taxels(&ring, &velocity, config(), 0).map(|sample| sample.numbers);
    assert!(none.is_none_or(|numbers| numbers == [0; INPUTS]));
}

#[test]
fn a_slow_touch_covers_less_of_its_path() {
    let covered = |mm_s: f64| {
        let light = taxels(mm_s, 0.0, |_| 1.0);
        let sample = PathSample::of_taxels(&ring(&light), &velocity(mm_s as f32, 0.0), config(), 70).unwrap();
        (1..=70).filter(|&frames| sample.covers(frames)).count()
    };
    let all = [16.0, 30.0, 40.0, 60.0, 120.0].map(covered);
    assert!(all.is_sorted() && all[0] < 28 && all[3] >= 40 && all[4] == 70, "{all:?}");
}

#[test]
fn what_has_no_path_is_refused() {
    let light = taxels(100.0, 0.0, |_| 1.0);
    let ring = ring(&light);
    for mm_s in [8.0, 0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
        assert_eq!(PathSample::of_taxels(&ring, &velocity(mm_s, 0.0), config(), 70), None, "{mm_s}");
    }
    let dark = TaxelRing::new(FULL as u32);
    assert_eq!(PathSample::of_taxels(&dark, &velocity(100.0, 0.0), config(), 70), None);
    assert_eq!(of_sums(&taxels(100.0, 0.0, |_| 0.0), &velocity(100.0, 0.0)), None);
    // An impossible direction gives numbers, but no panic.
    assert!(PathSample::of_taxels(&ring, &velocity(f32::INFINITY, f32::NAN), config(), 70).is_none());
    assert!(PathSample::of_taxels(&ring, &velocity(1e9, 1e9), config(), 70).is_some());
}

#[test]
fn extremes_do_not_overflow() {
    let mut ring = TaxelRing::new(u32::MAX);
    for frame in 0..SAMPLE_FRAMES {
        let on = |taxel: usize| (frame + taxel) % 7 > 3 && frame > 8;
        ring.push(&core::array::from_fn(|taxel| if on(taxel) { u32::MAX } else { 0 }));
    }
    for mm_s in [9.5, 40.0, 300.0, 1e7] {
        for degrees in 0..36 {
            let sample = PathSample::of_taxels(&ring, &velocity(mm_s, 10.0 * degrees as f32), config(), 70);
            assert!(sample.is_some_and(|sample| sample.numbers.iter().all(|number| number.abs() < 14_000)));
        }
    }
    let frames = core::array::from_fn(|frame| [if frame % 2 == 0 { i16::MIN } else { i16::MAX }; FEATURES]);
    let baseline = Baseline::new([i32::MIN; FEATURES], 1);
    let event = Event::new(0, Sample::from_frames(&frames), &baseline);
    for mm_s in [9.5, 40.0, 300.0, 1e7] {
        assert!(PathSample::of_sums(&event, &velocity(mm_s, 45.0), config(), 70).is_some());
    }
}

#[test]
fn a_ring_keeps_the_last_frames() {
    let mut ring = TaxelRing::new(1 << 20);
    for frame in 0..100 {
        ring.push(&[frame << 5; TAXELS]);
    }
    // 2^20 has 21 bits, so five of them go.
    let light = |ring: &TaxelRing, number: usize| TaxelLight::new(ring, 70).at(number, 3);
    // The oldest four are 30 to 33, and their mean is 32, rounded up.
    assert_eq!([0, 2, 3, 4, 69].map(|number| light(&ring, number)), [0, 0, 1, 2, 67]);
    ring.fill(2);
    assert_eq!([66, 67, 68, 69].map(|number| light(&ring, number)), [64, 65, 65, 65]);
    ring.fill(u32::MAX);
    assert_eq!(TaxelLight::new(&ring, 70).at(69, 0), 0);
}

/// A pipeline that keeps taxels, of frames at this rate.
fn keeping(per_second: u32) -> Pipeline<Gray, Fixed, FixedBaseline, TaxelRing> {
    let layout = Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap();
    let geometry = FrameGeometry::new(Gray, layout, FrameRate::new(per_second, 1).unwrap()).unwrap();
    Pipeline::builder(geometry).taxels::<TaxelRing>().build().unwrap()
}

/// Sums of a dark camera frame, of one of a touch, and of none that is lost.
fn sums(light: &[[f64; TAXELS]; SAMPLE_FRAMES], frame: usize) -> [u32; TAXELS] {
    let light = frame.checked_sub(40).and_then(|frame| light.get(frame)).copied().unwrap_or([DARK; TAXELS]);
    light.map(|light| (light * 8100.0 * 255.0) as u32)
}

#[test]
fn a_pipeline_keeps_the_taxels_of_its_event() {
    let light = taxels(120.0, 30.0, |_| 1.0);
    let of = |lost: &[usize]| {
        let mut pipeline = keeping(30);
        let mut alone = TaxelRing::of(pipeline.geometry());
        let mut events = 0;
        for frame in 0..160 {
            if lost.contains(&frame) {
                pipeline.push_lost(1);
                continue;
            }
            let sums = sums(&light, frame);
            alone.push(&sums);
            let update = pipeline.push_taxels(&sums);
            let Some(event) = update.event() else { continue };
            events += 1;
            // Lost frames are filled in the event's features, but not in its taxels.
            assert_eq!(update.taxels().is_none(), event.frames_filled > 0, "{lost:?}");
            let Some(taxels) = update.taxels() else { continue };
            let of = |ring: &TaxelRing| PathSample::of_taxels(ring, &velocity(120.0, 30.0), config(), 70).unwrap();
            assert_eq!(of(taxels), of(&alone), "{lost:?}");
        }
        assert_eq!(events, 1, "{lost:?}");
        let event = pipeline.finish().event();
        assert!(event.is_none());
    };
    // The event's sample begins at frame 40 or later.
    for lost in [&[][..], &[30], &[60], &[70, 71], &[119], &[140]] {
        of(lost);
    }
}

#[test]
fn camera_frames_that_are_added_up_are_one_frame_of_taxels() {
    let mut pipeline = keeping(60);
    let mut alone = TaxelRing::of(pipeline.geometry());
    for frame in 0..200_u32 {
        let one: [u32; TAXELS] = core::array::from_fn(|taxel| 1000 * frame + taxel as u32);
        let other = one.map(|sum| sum + 500);
        assert!(pipeline.push_taxels(&one).taxels().is_none(), "a part of a frame");
        let update = pipeline.push_taxels(&other);
        let mut both = one;
        for (both, other) in both.iter_mut().zip(other) {
            *both += other;
        }
        alone.push(&both);
        assert_eq!(update.taxels().is_some(), frame >= 69, "{frame}");
        let Some(taxels) = update.taxels() else { continue };
        for number in 0..SAMPLE_FRAMES {
            for taxel in 0..TAXELS {
                let (kept, whole) =
                    (TaxelLight::new(taxels, 70).at(number, taxel), TaxelLight::new(&alone, 70).at(number, taxel));
                // Each camera frame loses its lowest bits, and so does the dark.
                assert!(kept.abs_diff(whole) <= 2, "{frame} {number} {taxel}: {kept} {whole}");
            }
        }
    }
    // A camera frame of two is lost, and then the taxels are not whole for 70 frames.
    pipeline.push_taxels(&[9; TAXELS]);
    assert!(pipeline.push_lost(1).taxels().is_none());
    for frame in 0..70 {
        pipeline.push_taxels(&[9; TAXELS]);
        assert_eq!(pipeline.push_taxels(&[9; TAXELS]).taxels().is_some(), frame == 69, "{frame}");
    }
    pipeline.restart();
    pipeline.push_taxels(&[9; TAXELS]);
    assert!(pipeline.push_taxels(&[9; TAXELS]).taxels().is_none());
}

#[test]
fn taxels_are_kept_only_if_asked_for() {
    let layout = Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap();
    let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap();
    let mut pipeline = Pipeline::builder(geometry).taxels::<ChosenTaxels>().build().unwrap();
    let keeps =
        |pipeline: &mut Pipeline<_, _, _, _>| (0..70).any(|_| pipeline.push_taxels(&[9; TAXELS]).taxels().is_some());
    assert!(!keeps(&mut pipeline));
    pipeline.keep_taxels();
    assert!(keeps(&mut pipeline));
    let mut ring = TaxelRing::new(255);
    ring.fill(1);
    assert!(!ring.is_unbroken() && TaxelStore::ring(&NoTaxels).is_none());
}

#[test]
fn inputs_have_steps() {
    assert_eq!(Input::Frames.steps(), None);
    assert_eq!(Input::Path.steps(), Some((2.0, 24)));
    assert_eq!(Input::TaxelPath.steps(), Some((1.0, 8)));
}

#[test]
fn light_before_a_touch_under_way_is_not_its_own() {
    let light = taxels(120.0, 30.0, |_| 1.0);
    let of = |before: f64| {
        let mut ring = TaxelRing::new(FULL as u32);
        (0..SAMPLE_FRAMES).for_each(|_| ring.push(&[(before * FULL) as u32; TAXELS]));
        light[..50].iter().for_each(|frame| ring.push(&frame.map(|light| (light * FULL) as u32)));
        let baseline = Baseline::new([0; FEATURES], 25);
        let frames = features(&light);
        let mut touch = Event::new(0, Sample::from_frames(&frames), &baseline).with_taxels(&ring);
        touch.frames = 50;
        PathSample::of_touch(&touch, &velocity(120.0, 30.0), config(), 40).unwrap()
    };
    let dark = of(DARK);
    assert!(dark.covers(40) && dark == of(0.5) && dark == of(1.0));
    let whole = PathSample::of_taxels(&ring(&light), &velocity(120.0, 30.0), config(), 40).unwrap();
    assert_eq!(dark.numbers()[..100], whole.numbers()[..100]);
}

#[test]
fn numbers_over_time_are_logarithms_of_each_taxel() {
    let (pixels, full) = (2500, 2500 * 255);
    let floor = crate::features::Floor::new(0.5, 255).unwrap();
    let scale = crate::features::FeatureScale::<Fixed>::new(pixels, 255, 1, floor).unwrap();
    let mut ring = TaxelRing::new(full);
    let sum = |frame: usize, taxel: usize| ((frame * 31 + taxel * 977) % 600 * 1000) as u32;
    for frame in 0..80 {
        ring.push(&core::array::from_fn(|taxel| sum(frame, taxel)));
    }
    ring.fill(1);
    let numbers = ring.numbers(&scale);
    for (at, &number) in numbers.iter().enumerate() {
        // Frames 11 to 79, and the last one once more. Sums of 20 bits lose four of them.
        let sum = sum((11 + at / TAXELS).min(79), at % TAXELS) >> 4 << 4;
        let light = (f64::from(sum) / f64::from(full)).max(0.5 / 255.0);
        assert!((f64::from(number) - 2048.0 * light.ln()).abs() <= 1.0, "{at}: {number}");
    }
    // The darkest one is half a gray level, within the rounding of ln 5.
    assert!((i32::from(*numbers.iter().min().unwrap()) + 12_769).abs() <= 1);
}
