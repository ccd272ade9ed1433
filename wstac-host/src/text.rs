//! Outputs as lines of text for a person: what commands print, and what recordings keep beside JSON.

use std::fmt::{self, Write as _};

use wstac_core::touch::motion::Velocity;
use wstac_core::touch::wave::Measured;

use crate::json::{angle, angle_with_deviation, confidence, real, rounded, short, strength, with_deviation};
use crate::output::{DisturbedBaseline, InterruptedReport, Output, TactileEvent};
use crate::plural::counted;
use crate::texture::{Texture, pattern_and_depth};

/// Returns an output as one line of text.
///
/// ```
/// use wstac_host::output::Output;
/// use wstac_host::text::text_of;
///
/// assert!(text_of(&Output::BaselineDisturbed { frame: 25 }).starts_with("at frame 25: the baseline was not quiet"));
/// ```
pub fn text_of(record: &Output) -> String {
    let mut line = String::new();
    // Writing to a string does not fail.
    let _ = text(&mut line, record);
    line
}

/// Writes an output as one line of text.
///
/// # Errors
/// `line` is a string, which takes everything: there is none.
pub fn text(line: &mut String, record: &Output) -> fmt::Result {
    match record {
        Output::Features(features) => {
            write!(line, "frame {}  features", features.frame)?;
            features.features.iter().try_for_each(|feature| write!(line, " {:8.4}", real(*feature)))
        }
        Output::Motion(motion) => {
            let Velocity { mm_s, mm_s_sd, degrees, degrees_sd, .. } = motion.velocity;
            write!(line, "frame {}  speed {} mm/s", motion.frame, with_deviation(rounded(mm_s), mm_s_sd))?;
            write!(line, ", direction {}°", angle_with_deviation(degrees, degrees_sd))
        }
        Output::Event(event) => text_of_event(line, event),
        Output::EarlyTexture(early) => {
            write!(line, "at frame {}: texture ", early.frame.saturating_add(early.frames.into()))?;
            text_of_texture(line, &early.texture)?;
            write!(line, ", from the first {} of the event at frame {}", counted(early.frames, "frame"), early.frame)
        }
        Output::Interrupted(InterruptedReport { frame, frames, .. }) => {
            write!(line, "incomplete event at frame {frame}: a gap ended it after {frames} of 70 frames")
        }
        Output::ContactEnd(end) => {
            write!(line, "end of contact at frame {}, of the event at frame {}", end.frame, end.event_frame)
        }
        Output::Slip(slip) => {
            let (frame, onset, held) = (slip.frame, slip.onset_frame, slip.held_since_frame);
            write!(line, "slip at frame {frame}, since frame {onset}: held since frame {held}")?;
            write!(line, ", strength {:.2}", strength(slip.strength))
        }
        Output::Fault(report) => {
            write!(line, "at frame {}: {}: {}", report.frame, report.fault.kind, report.fault)
        }
        Output::Lost(lost) => {
            write!(line, "at frame {}: {} lost: {}", lost.frame, counted(lost.frames, "frame"), lost.reason)
        }
        Output::BaselineDisturbed { frame } => write!(line, "at frame {frame}: {DisturbedBaseline}"),
        Output::End(end) => {
            write!(line, "end after {}, {} dropped", counted(end.frames, "frame"), end.dropped)?;
            end.incomplete.map_or(Ok(()), |sample| {
                write!(line, "; an event at frame {} was incomplete: {} of 70 frames", sample.frame, sample.frames)
            })
        }
    }
}

fn text_of_event(line: &mut String, event: &TactileEvent) -> fmt::Result {
    write!(line, "event at frame {}: ", event.frame)?;
    match event.contact {
        Some(contact) if event.speed.is_err() => write!(line, "{contact}")?,
        Some(contact) => {
            write!(line, "{contact}, ")?;
            text_of_motion(line, event)?;
        }
        None => text_of_motion(line, event)?,
    }
    text_of_extent(line, event)?;
    if let Ok(texture) = &event.texture {
        line.write_str(", texture ")?;
        text_of_texture(line, texture)?;
    }
    if let Some(speeds) = event.texture_doubt {
        write!(line, " (the model knows {speeds})")?;
    }
    if let Some(Measured { value, sd }) = event.period_mm {
        write!(line, ", period {value:.2} ± {sd:.2} mm")?;
    }
    if let Some(frames) = event.lit_frames {
        // From the first frame to the last is one step less than there are frames.
        write!(line, ", lit {}", counted(u16::from(frames) + 1, "frame"))?;
    }
    if event.frames_filled > 0 {
        write!(line, ", {} of 70 frames filled", event.frames_filled)?;
    }
    if !event.reliable {
        line.write_str(", not reliable")?;
        if let Some(doubt) = event.doubt {
            write!(line, ": {doubt}")?;
        }
    }
    Ok(())
}

/// Writes what 25 taxels tell besides the velocity: `, by the outline, 8.2 ± 0.6 mm wide, 3.1 ± 0.4 mm to the left of
/// the motion`.
fn text_of_extent(line: &mut String, event: &TactileEvent) -> fmt::Result {
    if let Some(basis) = event.basis {
        write!(line, ", by the {}", basis.as_str())?;
    }
    let Some(extent) = event.extent else { return Ok(()) };
    if let Some(Measured { value, sd }) = extent.width_mm {
        write!(line, ", {value:.1} ± {} mm wide", short(sd))?;
    }
    if let Some(Measured { value, sd }) = extent.place_mm {
        let side = if value < 0.0 { "right" } else { "left" };
        write!(line, ", {:.1} ± {} mm to the {side} of the motion", value.abs(), short(sd))?;
    }
    if extent.contacts > 1 {
        write!(line, ", {} contacts", extent.contacts)?;
    }
    Ok(())
}

/// Writes speed and direction, or why there is none.
fn text_of_motion(line: &mut String, event: &TactileEvent) -> fmt::Result {
    match (event.speed, event.speed_at_most) {
        (Ok(speed), _) => {
            let mm_s = rounded(speed.mm_s);
            match speed.sd {
                Some(sd) => write!(line, "speed {} mm/s", with_deviation(mm_s, sd))?,
                None => write!(line, "speed {mm_s:.0} mm/s")?,
            }
            if speed.extrapolated {
                line.write_str(" (extrapolated)")?;
            }
        }
        (Err(why), Some(most)) => {
            let extrapolated = if most.extrapolated { "extrapolated; " } else { "" };
            write!(line, "speed at most {:.0} mm/s ({extrapolated}{})", rounded(most.mm_s), why.as_str())?;
        }
        (Err(why), None) => write!(line, "no speed ({})", why.as_str())?,
    }
    match event.direction.degrees {
        Ok(degrees) => {
            let sd = event.direction.sd;
            let shown = sd.map_or_else(|| angle(degrees).to_string(), |sd| angle_with_deviation(degrees, sd));
            write!(line, ", direction {shown}°")?;
            confidence(event.direction).map_or(Ok(()), |of| write!(line, " (confidence {})", certainty(of)))
        }
        Err(why) => write!(line, ", no direction ({})", why.as_str()),
    }
}

/// Returns a confidence with two decimals, rounded down: nothing is certain.
fn certainty(confidence: f64) -> String {
    format!("{:.2}", (100.0 * confidence + 1e-9).floor() / 100.0)
}

fn text_of_texture(line: &mut String, texture: &Texture) -> fmt::Result {
    // The name of a specimen has both. Another model may disagree with it.
    let of_name = texture.specimen.as_deref().map(pattern_and_depth);
    let (pattern, depth) = of_name.unwrap_or_default();
    let mut words: Vec<String> = texture.specimen.iter().chain(&texture.class).cloned().collect();
    words.extend(texture.pattern.clone().filter(|_| texture.pattern != pattern));
    words.extend(texture.depth_mm.filter(|_| texture.depth_mm != depth).map(|depth| format!("{depth} mm deep")));
    match (texture.known, texture.confidence) {
        (Some(false), _) => line.write_str("unknown"),
        (_, Some(confidence)) => write!(line, "{} (confidence {})", words.join(", "), certainty(confidence)),
        (_, None) => write!(line, "{} (no confidence)", words.join(", ")),
    }
}
