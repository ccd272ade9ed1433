//! Pushes any bytes through any valid configuration. Nothing may panic, the sums must equal those of a plain model, and
//! answers must be within their documented ranges.
#![no_main]

use arbitrary::{Result, Unstructured};
use libfuzzer_sys::fuzz_target;
use wstac_core::frame::Stride;
use wstac_core::green::any::{Any, PixelFormat};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::ln::{Ln, fixed::Fixed, libm::Libm, micromath::Micromath};
use wstac_core::paper::direction;
use wstac_core::paper::speed::{self, Law, SpeedConfig, ThresholdOn};
use wstac_core::paper::trigger::{Event, Rule, TriggerConfig};
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::{FrameGeometry, TaxelSums};
use wstac_tests::formats;
use wstac_tests::plain_sums::{self, Picture};

fn picture(input: &mut Unstructured<'_>) -> Result<Picture> {
    let format = *input.choose(&PixelFormat::all().collect::<Vec<_>>())?;
    let (width, height) = (input.int_in_range(2..=20_usize)?, input.int_in_range(2..=20_usize)?);
    let taxel = [input.int_in_range(2..=width)?, input.int_in_range(2..=height)?];
    let mut corners = [[0; 2]; 25];
    for [x, y] in &mut corners {
        *x = input.int_in_range(0..=width - taxel[0])?;
        *y = input.int_in_range(0..=height - taxel[1])?;
    }
    Ok(Picture {
        format,
        color: *input.choose(&formats::COLORS)?,
        method: *input.choose(&formats::METHODS)?,
        width,
        height,
        bytes_per_row: plain_sums::row_bytes(format, width) + input.int_in_range(0..=8_usize)?,
        stride: *input.choose(&[1, 2, 3, 5])?,
        taxel,
        corners,
    })
}

fn camera(picture: &Picture, input: &mut Unstructured<'_>) -> Result<Option<FrameGeometry<Any>>> {
    let size = FrameSize::new(picture.width as u32, picture.height as u32).expect("2 to 20 pixels each way");
    let corners = picture.corners.map(|corner| corner.map(|x| x as u16));
    let layout = Layout::new(size, picture.taxel.map(|x| x as u16), corners).expect("taxels inside the frame");
    let rate = if input.arbitrary()? { (30, 1) } else { (input.arbitrary()?, input.arbitrary()?) };
    let Ok(rate) = FrameRate::new(rate.0, rate.1) else { return Ok(None) };
    let any = Any::new(picture.format, picture.color, picture.method);
    let stride = Stride::try_from(picture.stride as u32).expect("1, 2, 3 or 5");
    let camera = FrameGeometry::with_stride(any, layout, rate, stride)
        .and_then(|camera| camera.with_bytes_per_row(picture.bytes_per_row as u32));
    Ok(camera.ok())
}

fn trigger(input: &mut Unstructured<'_>) -> Result<Option<TriggerConfig>> {
    let rule = *input.choose(&[Rule::Signed, Rule::Literal])?;
    if input.arbitrary()? {
        let window = input.int_in_range(1..=20)?;
        return Ok(TriggerConfig::new(window, 1.1, window, rule, 0.1).ok());
    }
    let (window, backtrack) = (input.int_in_range(0..=71)?, input.int_in_range(0..=71)?);
    Ok(TriggerConfig::new(window, input.arbitrary()?, backtrack, rule, input.arbitrary()?).ok())
}

fn speed(input: &mut Unstructured<'_>, rate: FrameRate) -> Result<Option<SpeedConfig>> {
    let law = match input.int_in_range(0..=1)? {
        0 => Law::PUBLISHED,
        _ => Law { intercept: input.arbitrary()?, slope: input.arbitrary()? },
    };
    let on = *input.choose(&[ThresholdOn::Absolute, ThresholdOn::AboveBaseline])?;
    let threshold = if input.arbitrary()? { 0.0475 } else { input.arbitrary()? };
    Ok(SpeedConfig::new(law, threshold, on, rate).ok())
}

fn check(event: Option<Event<'_>>, last: &mut Option<u64>, config: &SpeedConfig) {
    let Some(event) = event else { return };
    assert!(last.is_none_or(|last| event.frame >= last.saturating_add(70) || event.frame > u64::MAX - 200));
    *last = Some(event.frame);
    assert_eq!(event.sample.frames().count(), 70);
    assert!(event.frames_filled <= 70 && direction::direction(&event).confidence.is_some_and(|of| of <= 32_768));
    let duration = speed::duration(&event, config);
    assert!(duration.is_none_or(|duration| duration.first <= duration.last && duration.last < 70));
    if let Ok(speed) = speed::speed(&event, config) {
        assert!(speed.mm_s.is_finite() && speed.mm_s >= 0.0);
    }
}

fn run<L: Ln>(
    input: &mut Unstructured<'_>,
    camera: FrameGeometry<Any>,
    trigger: TriggerConfig,
    speed: &SpeedConfig,
) -> Result<()> {
    let floor = if input.arbitrary()? { 0.5 } else { input.arbitrary()? };
    let Ok(mut pipeline) = Pipeline::builder(camera).floor_levels(floor).ln(L::default()).trigger(trigger).build()
    else {
        return Ok(());
    };
    let mut bytes = vec![0; camera.frame_bytes()];
    let mut last = None;
    for _ in 0..100 {
        if input.is_empty() {
            break;
        }
        match input.int_in_range(0..=9)? {
            0 => {
                let given = input.bytes(input.len().min(bytes.len()))?;
                check(pipeline.push_frame(given).ok().and_then(|update| update.event()), &mut last, speed);
            }
            1 => {
                let length = input.int_in_range(0..=bytes.len())?;
                check(pipeline.push_stripe(&bytes[..length]).ok().and_then(|update| update.event()), &mut last, speed);
            }
            2 => check(pipeline.push_lost(input.int_in_range(0..=12)?).event(), &mut last, speed),
            3 => check(pipeline.push_lost(input.arbitrary()?).event(), &mut last, speed),
            4 => check(pipeline.abandon_frame().event(), &mut last, speed),
            5 => check(pipeline.finish().event(), &mut last, speed),
            _ => {
                bytes.fill(input.arbitrary()?);
                for _ in 0..input.int_in_range(1..=80)? {
                    check(pipeline.push_frame(&bytes).ok().and_then(|update| update.event()), &mut last, speed);
                }
            }
        }
        pipeline.end();
    }
    Ok(())
}

fn try_input(data: &[u8]) -> Result<()> {
    let input = &mut Unstructured::new(data);
    let picture = picture(input)?;
    let Some(camera) = camera(&picture, input)? else { return Ok(()) };
    let Some(trigger) = trigger(input)? else { return Ok(()) };
    let Some(speed) = speed(input, camera.rate())? else { return Ok(()) };

    let mut bytes = data.repeat(picture.bytes() / data.len().max(1) + 1);
    bytes.truncate(picture.bytes());
    let (pixels, sums) = picture.sums(&bytes);
    assert_eq!(u64::from(camera.pixels()), pixels);
    assert_eq!(TaxelSums::new(camera).push_frame(&bytes), Ok(sums.map(|sum| sum as u32)));

    match input.int_in_range(0..=3)? {
        0 | 1 => run::<Fixed>(input, camera, trigger, &speed),
        2 => run::<Libm>(input, camera, trigger, &speed),
        _ => run::<Micromath>(input, camera, trigger, &speed),
    }
}

fuzz_target!(|data: &[u8]| {
    // There are too few bytes for a configuration.
    let _ = try_input(data);
});
