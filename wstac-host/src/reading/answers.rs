//! An event's answers, as a record.

use wstac_core::direction::{Direction, Heading, Unclear, direction};
use wstac_core::features::Features;
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_core::speed::{self, NoSpeed, Speed, SpeedConfig};
use wstac_core::trigger::Event;

use super::record::{DirectionRecord, EventRecord, SpeedRecord, Why};
use crate::texture::{TextureRecord, Textures};

/// What the core answers to an event: worked out here, or sent by a board.
pub(crate) struct EventAnswers {
    /// Number of the first frame of the sample.
    pub frame: u64,
    /// Lit frames, last less first.
    pub duration: Option<u8>,
    /// Sliding speed, or why there is none.
    pub speed: Result<Speed, NoSpeed>,
    /// Sliding direction.
    pub direction: Direction,
    /// Frames of the sample that were filled.
    pub frames_filled: u8,
    /// Whether the baseline was quiet and the sample complete enough.
    pub reliable: bool,
}

impl EventAnswers {
    fn of(event: &Event<'_>, config: &SpeedConfig) -> Self {
        Self {
            frame: event.frame,
            duration: speed::duration(event, config).map(speed::LitSpan::frames),
            speed: speed::speed(event, config),
            direction: direction(event),
            frames_filled: event.frames_filled,
            reliable: event.reliable,
        }
    }
}

#[cfg(feature = "board")]
impl From<&wstac_core::wire::Answers<'_>> for EventAnswers {
    fn from(answers: &wstac_core::wire::Answers<'_>) -> Self {
        let &wstac_core::wire::Answers { frame, duration, speed, direction, frames_filled, reliable, .. } = answers;
        Self { frame, duration, speed, direction, frames_filled, reliable }
    }
}

impl EventRecord {
    /// Makes a record of an event's answers; `bound` makes a speed of the mm/s of a cut-off event.
    pub(crate) fn new(
        answers: &EventAnswers,
        bound: impl FnOnce(f32) -> Speed,
        texture: Option<TextureRecord>,
        sample: Option<&[Features; SAMPLE_FRAMES]>,
    ) -> Self {
        let mut why = Why { texture: texture.is_none().then_some("no model was given"), ..Why::default() };
        let mut speed_at_most = None;
        let speed = match answers.speed {
            Ok(speed) => Some(speed.into()),
            Err(reason) => {
                if let NoSpeed::CutOff { at_most: Some(mm_s) } = reason {
                    speed_at_most = Some(bound(mm_s).into());
                }
                why.speed = Some(no_speed(reason));
                None
            }
        };
        let direction = answers.direction;
        why.direction = direction.heading.err().map(|unclear| match unclear {
            Unclear::NeverLit => "unclear: a row and a column never light up",
            Unclear::NoOrder => "unclear: neither rows nor columns light up in order",
        });
        let over_time = |feature: usize| move |frame: &Features| real(frame[feature]);
        Self {
            frame: answers.frame,
            frames: SAMPLE_FRAMES,
            duration_frames: answers.duration,
            speed,
            speed_at_most,
            direction: DirectionRecord {
                deg: direction.heading.ok().map(Heading::degrees),
                confidence: (f64::from(direction.confidence()) * 1e4).round() / 1e4,
            },
            texture,
            frames_filled: answers.frames_filled,
            reliable: answers.reliable,
            why,
            sample: sample
                .map(|sample| (0..FEATURES).map(|feature| sample.iter().map(over_time(feature)).collect()).collect()),
        }
    }
}

/// An event's answers.
pub(super) fn answers(event: &Event<'_>, config: &SpeedConfig, textures: &Textures, with_sample: bool) -> EventRecord {
    let flat = event.sample.flat();
    let sample = flat.as_chunks().0.as_array().filter(|_| with_sample);
    let answers = EventAnswers::of(event, config);
    EventRecord::new(&answers, |mm_s| config.marked(mm_s), textures.of_sample(&flat), sample)
}

impl From<Speed> for SpeedRecord {
    fn from(speed: Speed) -> Self {
        Self { mm_s: rounded(speed.mm_s), extrapolated: speed.extrapolated }
    }
}

/// Why an event that is cut off has no speed.
const CUT_OFF: &str = "cut off: the sample starts or ends above the speed threshold";

impl EventRecord {
    /// Whether the sample starts or ends in the light, so that the slide lasted longer than it shows.
    pub fn is_cut_off(&self) -> bool {
        self.why.speed == Some(CUT_OFF)
    }
}

fn no_speed(reason: NoSpeed) -> &'static str {
    match reason {
        NoSpeed::BaselineAbove => "the baseline is above the speed threshold",
        NoSpeed::NeverValid => "no frame is above the speed threshold",
        NoSpeed::CutOff { .. } => CUT_OFF,
        NoSpeed::OutsideLaw => "the speed law has no finite speed for this duration",
    }
}

/// A feature as a real number.
pub(crate) fn real(feature: i16) -> f64 {
    f64::from(feature) / f64::from(FEATURE_ONE)
}

/// A record's feature, a real number, in units of 1/2048 again, without loss: it is an exact multiple of that.
pub fn units(real: f64) -> i16 {
    (real * f64::from(FEATURE_ONE)) as i16
}

/// A speed for output: one decimal, or four significant digits where that is finer.
fn rounded(mm_s: f32) -> f64 {
    let tenths = (f64::from(mm_s) * 10.0).round() / 10.0;
    if tenths >= 100.0 { tenths } else { format!("{mm_s:.3e}").parse().unwrap_or(tenths) }
}
