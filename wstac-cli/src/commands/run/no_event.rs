//! The reason why a whole run had no event, as far as the light tells it.

use std::fmt;

use wstac_host::output::Output;
use wstac_host::session::Processor;

/// The light of a run, and whether it had events.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NoEvent {
    /// Whether it is a board, of which the light is not known.
    pub(super) is_board: bool,
    /// Whether there was an event, or a sample that is not complete.
    is_answered: bool,
    /// Whether the baseline was complete.
    baseline: bool,
    /// The smallest light of the brightest taxel, and the largest, as fractions of full scale; `None` before a frame.
    light: Option<[f32; 2]>,
}

/// Light above this fraction of full scale counts as saturated.
const SATURATED: f32 = 0.98;
/// Light below this fraction of full scale counts as none: less than a gray level of 8 bits.
const DARK: f32 = 1.0 / 256.0;

impl NoEvent {
    pub(super) fn output(&mut self, output: &Output) {
        self.is_answered |= match output {
            Output::Event(_) | Output::Interrupted(_) => true,
            Output::End(summary) => {
                let is_known = !self.is_board || (summary.frames > 0 && !summary.baseline_complete);
                summary.incomplete.is_some() || !is_known
            }
            _ => false,
        };
    }

    /// Takes note of the last frame's light.
    pub(super) fn processed(&mut self, processor: &Processor) {
        let Some(taxels) = processor.taxels() else { return };
        let brightest = taxels.into_iter().fold(0.0, f32::max);
        let [least, most] = self.light.unwrap_or([brightest; 2]);
        self.light = Some([least.min(brightest), most.max(brightest)]);
        self.baseline |= processor.pipeline().baseline().is_some();
    }

    /// Returns the reason why there was no event, or `None` if there was one.
    pub(super) fn reason(self) -> Option<Reason> {
        (!self.is_answered).then_some(match self.light {
            Some([_, most]) if self.baseline && most < DARK => Reason::Dark,
            Some([least, _]) if self.baseline && least > SATURATED => Reason::Saturated,
            Some([_, most]) if self.baseline => Reason::Quiet(most),
            _ => Reason::TooShort,
        })
    }
}

/// The reason why a run had no event. `Display` says it with advice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reason {
    /// The source ended before the baseline was complete.
    TooShort,
    /// No taxel ever saw light.
    Dark,
    /// The brightest taxel was saturated all the time.
    Saturated,
    /// The trigger did not fire. The number is the most light of a taxel, as a fraction of full scale.
    Quiet(f32),
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("no event: ")?;
        match self {
            Self::TooShort => f.write_str("the source ended before the baseline was complete"),
            Self::Dark => f.write_str("every taxel stayed dark; check the light, the exposure and [layout]"),
            Self::Saturated => f.write_str("a taxel was saturated all the time; shorten the exposure"),
            Self::Quiet(most) => {
                let percent = 100.0 * most;
                write!(f, "no touch was seen; the brightest taxel reached {percent:.0} % of full scale ")?;
                f.write_str("(a lower margin or multiplier under [trigger], or floor_levels, sees weaker touches)")
            }
        }
    }
}
