//! The event's numbers, and an explanation of the figure, in words.

use wstac_core::paper::speed::{Law, ThresholdOn};

use super::event::Found;
use wstac_core::params::SAMPLE_FRAMES;
use wstac_host::json::{angle, confidence, rounded, with_deviation};
use wstac_host::output::TactileEvent;
use wstac_host::texture::Texture;

/// Returns the complete caption.
pub(super) fn caption(found: &Found) -> String {
    let record = &found.record;
    let start = record.frame as f64 * found.frame_s;
    let what = format!("Event {} of {}; first frame {} ({start:.2} s).", found.number, found.about, record.frame);
    let mut answers: Vec<String> = record.contact.iter().map(ToString::to_string).collect();
    answers.extend([speed(record, found.law), direction(record)]);
    answers.extend(record.texture.as_ref().ok().map(texture));
    let mut sentences = vec![what, format!("{}.", capitalized(&answers.join("; ")))];
    if record.frames_filled > 0 {
        sentences.push(format!("{} of {} frames were lost, and filled.", record.frames_filled, SAMPLE_FRAMES));
    }
    if !record.reliable {
        let doubt = if found.law.is_some() { "" } else { ", or speed and direction are doubtful" };
        sentences.push(format!("Not reliable: the baseline was not quiet, or too many frames were filled{doubt}."));
    }
    match found.saturated() {
        0 => {}
        1 => sentences.push("One taxel reached full scale: its light is cut off.".to_owned()),
        count => sentences.push(format!("{count} taxels reached full scale: their light is cut off.")),
    }
    sentences.push(drawn(found));
    sentences.join(" ")
}

/// Returns the text with its first letter as that of a sentence.
fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn speed(record: &TactileEvent, law: Option<Law>) -> String {
    let law = if law.is_some() { "logarithmic law" } else { "arrival times" };
    match (record.speed, record.speed_at_most) {
        (Ok(speed), _) => {
            let doubt = if speed.extrapolated { ", extrapolated" } else { "" };
            let mm_s = rounded(speed.mm_s);
            let found = speed.sd.map_or_else(|| mm_s.to_string(), |sd| with_deviation(mm_s, sd));
            format!("speed {found} mm/s ({law}{doubt})")
        }
        (Err(why), Some(most)) => format!("speed at most {} mm/s ({})", rounded(most.mm_s), why.as_str()),
        (Err(why), None) => format!("no speed ({})", why.as_str()),
    }
}

fn direction(record: &TactileEvent) -> String {
    match record.direction.degrees {
        Ok(degrees) => {
            let trust = match (confidence(record.direction), record.direction.sd) {
                (Some(confidence), _) => format!(" (confidence {confidence})"),
                (None, Some(sd)) => format!(" \u{b1} {sd:.1}\u{b0}"),
                (None, None) => String::new(),
            };
            format!("direction {}\u{b0}{trust}", angle(degrees))
        }
        Err(why) => format!("no direction ({})", why.as_str()),
    }
}

fn texture(texture: &Texture) -> String {
    let mut names: Vec<String> = texture.specimen.iter().chain(&texture.class).cloned().collect();
    if texture.specimen.is_none() {
        names.extend(texture.pattern.clone());
        names.extend(texture.depth_mm.map(|depth| format!("{depth} mm deep")));
    }
    if texture.known == Some(false) {
        return "texture unknown".to_owned();
    }
    let trust =
        texture.confidence.map(|confidence| format!(" (confidence {:.2})", (100.0 * confidence).floor() / 100.0));
    format!("texture {}{}", names.join(", "), trust.unwrap_or_default())
}

fn drawn(found: &Found) -> String {
    let ((threshold, on), [slowest, fastest]) = (found.lit_threshold, found.fitted);
    let on = match on {
        ThresholdOn::Absolute => "",
        ThresholdOn::AboveBaseline => " above the baseline",
    };
    let common = "a, b: light of the five taxels of each row or column; numbers stand at its centroid. Dashed: thresholds of the \
                  trigger. Gray: the window that fired. Dotted: first and last lit frame.";
    match found.law {
        Some(_) => format!(
            "{common} Lit: above {threshold} of full scale{on}. d: thick where the law was fitted, {slowest} to {fastest} mm/s."
        ),
        None => format!("{common} d: centroids of panel c along the motion, and the line of the event's speed."),
    }
}
