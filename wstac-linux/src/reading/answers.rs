//! An event's answers, as a record.

use wstac_core::direction::{self, Unclear};
use wstac_core::params::{FEATURE_ONE, FEATURES};
use wstac_core::speed::{self, NoSpeed, Speed, SpeedConfig};
use wstac_core::trigger::Event;

use super::record::{DirectionRecord, EventRecord, SpeedRecord, Why};
use crate::texture::Textures;

/// An event's answers.
pub(super) fn answers(event: &Event<'_>, config: &SpeedConfig, textures: &Textures, with_sample: bool) -> EventRecord {
    let texture = textures.of_sample(&event.sample.flat());
    let mut why = Why { texture: texture.is_none().then_some("no model was given"), ..Why::default() };
    let mut speed_at_most = None;
    let speed = match speed::speed(event, config) {
        Ok(speed) => Some(speed.into()),
        Err(reason) => {
            if let NoSpeed::CutOff { at_most: Some(mm_s) } = reason {
                speed_at_most = Some(Speed::new(mm_s).into());
            }
            why.speed = Some(no_speed(reason));
            None
        }
    };
    let direction = direction::direction(event);
    why.direction = direction.heading.err().map(|unclear| match unclear {
        Unclear::NeverLit => "unclear: a row and a column never light up",
        Unclear::NoOrder => "unclear: neither rows nor columns light up in order",
    });
    EventRecord {
        frame: event.frame,
        frames: event.sample.frames().count(),
        duration_frames: speed::duration(event, config).map(speed::Duration::frames),
        speed,
        speed_at_most,
        direction: DirectionRecord {
            deg: direction.heading.ok().map(direction::Heading::degrees),
            confidence: (f64::from(direction.confidence()) * 1e4).round() / 1e4,
        },
        texture,
        frames_filled: event.frames_filled,
        reliable: event.reliable,
        why,
        sample: with_sample
            .then(|| (0..FEATURES).map(|feature| event.sample.feature(feature).map(real).collect()).collect()),
    }
}

impl From<Speed> for SpeedRecord {
    fn from(speed: Speed) -> Self {
        Self { mm_s: rounded(speed.mm_s), extrapolated: speed.extrapolated }
    }
}

fn no_speed(reason: NoSpeed) -> &'static str {
    match reason {
        NoSpeed::BaselineAbove => "the baseline is above the speed threshold",
        NoSpeed::NeverValid => "no frame is above the speed threshold",
        NoSpeed::CutOff { .. } => "cut off: the sample starts or ends above the speed threshold",
        NoSpeed::OutsideLaw => "the speed law has no finite speed for this duration",
    }
}

/// A feature as a real number.
pub(super) fn real(feature: i16) -> f64 {
    f64::from(feature) / f64::from(FEATURE_ONE)
}

/// A speed for output: one decimal, or four significant digits where that is finer.
fn rounded(mm_s: f32) -> f64 {
    let tenths = (f64::from(mm_s) * 10.0).round() / 10.0;
    if tenths >= 100.0 { tenths } else { format!("{mm_s:.3e}").parse().unwrap_or(tenths) }
}
