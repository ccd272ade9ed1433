//! The recommended changes, in words.

use serde::Serialize;

use super::Report;
use super::controls::ControlReport;
use super::measure::Measured;
use wstac_host::camera::UnlockedReason;
use wstac_host::camera::modes::fps as fps_text;
use wstac_host::config::Config;
use wstac_host::source::{LossReason, StreamInfo};

/// A recommended change.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Its kind in a word, for programs.
    pub kind: &'static str,
    /// The observation.
    pub found: String,
    /// The advice.
    pub advice: String,
}

/// Relative error of a frame rate that is tolerated.
const RATE_OFF: f64 = 0.02;
/// Fraction of a period by which frames may be late, rms.
const JITTER: f64 = 0.25;
/// Fraction of pixels at one end of the scale that is tolerated.
const MANY: f64 = 0.001;
/// Fraction of pixels at the dark end that is tolerated: some are harmless there.
const MANY_DARK: f64 = 0.1;
/// Fraction of the speed law's threshold by which MJPEG may be off.
const HALF: f64 = 0.5;
/// Fraction of that threshold above which leaking light deserves a better cover.
const LEAK: f64 = 0.5;

/// The kind of a finding that holds for every camera, and asks for no change.
pub(super) const READOUT: &str = "readout";

/// Returns the findings, the most important first.
///
/// Findings that make all other numbers doubtful come first, then unwanted changes, then the rest.
pub(super) fn verdict(report: &Report, info: &StreamInfo, config: &Config, measured: &Measured) -> Vec<Finding> {
    let mut findings = Findings(Vec::new());
    let was_still = stillness(&mut findings, report, measured);
    controls(&mut findings, &report.controls);
    rate(&mut findings, report, info);
    // Light that came and went gives no threshold.
    if was_still {
        light(&mut findings, report);
        trigger(&mut findings, report);
        mjpeg(&mut findings, report);
    }
    if report.camera.is_some() && config.readout(info).is_none() {
        readout(&mut findings);
    }
    findings.0
}

struct Findings(Vec<Finding>);

impl Findings {
    fn add(&mut self, kind: &'static str, found: String, advice: &str) {
        self.0.push(Finding { kind, found, advice: advice.to_owned() });
    }
}

/// Returns `true` if nothing touched the sensor and the light stayed constant.
fn stillness(findings: &mut Findings, report: &Report, measured: &Measured) -> bool {
    let touched = match measured.touched {
        Some(frame) => Some(format!("an event starts at frame {frame} of the measurement: it was touched")),
        None => (!measured.quiet).then(|| "the first frames were not quiet: something touched the sensor".to_owned()),
    };
    if let Some(found) = &touched {
        let found = format!("{found}, or the light changed");
        findings.add("touched", found, "measure again with nothing touching; all numbers here are doubtful");
    }
    let is_frozen = report.noise.worst_taxel == 0.0 && report.noise.pixel == Some(0.0);
    if is_frozen && report.levels.clipped.is_none_or(|clipped| clipped < 1.0 - MANY_DARK) {
        let found = "no pixel changes from frame to frame, as no camera's do".into();
        findings.add("frozen", found, "look whether the camera sends one picture again and again, or a test pattern");
    }
    touched.is_none()
}

fn controls(findings: &mut Findings, controls: &[ControlReport]) {
    for control in controls {
        let name = &control.name;
        if control.locked == Some(false) {
            let why = control.why.as_ref().map_or("the driver does not say why", UnlockedReason::name);
            let other = "switch it off with v4l2-ctl or the maker's tool, or use a camera that lets it be locked: gray levels \
                         may change by themselves";
            let advice = match control.why {
                Some(UnlockedReason::Kept) => "leave --keep-controls away: wstac then locks it",
                Some(UnlockedReason::SetAutomatic) => "leave that --control away: wstac then switches it off",
                _ => other,
            };
            findings.add("unlocked", format!("{name} is not locked: {why}"), advice);
        }
        if control.drifts {
            let [start, end] = [control.value, control.value_at_end]
                .map(|value| value.map_or_else(|| "unknown".to_owned(), |value| value.to_string()));
            let found = format!("{name} changes by itself: {start} at the start, {end} at the end");
            findings.add("drifting_control", found, "switch off what changes it, or give it a value with --control");
        }
    }
}

fn rate(findings: &mut Findings, report: &Report, info: &StreamInfo) {
    let rate = &report.rate;
    let off = |fps: f64, other: f64| (fps / other - 1.0).abs() > RATE_OFF;
    if let Some(fps) = rate.measured.filter(|fps| off(*fps, rate.stated)) {
        let found = format!("{fps:.2} frames per second come, the driver states {}", fps_text(info.rate));
        let advice = "shorten the exposure to less than a frame (--control exposure_time_absolute=…, in units of 0.1 ms), \
                      and plug the camera in where nothing shares its USB bus";
        findings.add("slow", found, if fps < rate.stated { advice } else { "state the rate that comes with --fps" });
    } else if let Some(asked) = rate.asked.filter(|asked| off(rate.stated, *asked)) {
        let found = format!("the driver gives {} frames per second, {asked:.2} were asked for", fps_text(info.rate));
        findings.add("rate", found, "choose a format and size that are offered at that rate (--format, --size)");
    }
    if let (Some(jitter), Some(fps)) = (rate.jitter_ms, rate.measured)
        && jitter > 1e3 * JITTER / fps
    {
        let found = format!("frames come {jitter:.1} ms early or late, rms, of {:.1} ms between them", 1e3 / fps);
        let advice = "leave the machine and the USB bus to the camera: a slide's speed is measured in frames";
        findings.add("jitter", found, advice);
    }
    let lost = rate.lost.values().fold(0, |all: u64, frames| all.saturating_add(*frames));
    if lost > 0 {
        let reasons: Vec<_> = rate.lost.iter().map(|(why, frames)| format!("{frames} {why}")).collect();
        let share = 100.0 * lost as f64 / lost.saturating_add(rate.frames) as f64;
        let found = format!("{share:.1} % of frames were lost: {}", reasons.join(", "));
        let all = |expected: LossReason| rate.lost.keys().all(|reason| *reason == expected);
        let advice = if all(LossReason::SimulatedExposure) {
            "lock the exposure"
        } else if all(LossReason::Skipped) {
            "leave the machine to this program, or use a smaller format: it is slower than the camera"
        } else {
            "use a shorter cable, another port or a smaller format, and no other program meanwhile"
        };
        findings.add("lost", found, advice);
    }
}

fn light(findings: &mut Findings, report: &Report) {
    let (levels, lit) = (&report.levels, report.signal.lit);
    if let Some(saturated) = levels.saturated.filter(|saturated| *saturated > MANY) {
        let found = format!("{:.2} % of pixels are at full scale with nothing touching", 100.0 * saturated);
        let advice = "cover the sensor, or lower exposure or gain: no light shows where it is full";
        findings.add("saturated", found, advice);
    }
    if let Some(clipped) = levels.clipped.filter(|clipped| *clipped > MANY_DARK) {
        let found = format!("{:.0} % of pixels are always 0: black is cut off", 100.0 * clipped);
        let advice =
            "raise the black level or brightness a little (--control brightness=…): weak light is lost below 0";
        findings.add("clipped", found, advice);
    }
    if let Some(leak) = levels.leak.filter(|leak| *leak > LEAK * lit) {
        let found = format!("{leak:.1} gray levels of light leak in, a touch counts as light from {lit:.1} on");
        findings.add("leak", found, "cover the sensor better; light that is always there hides light that is not");
    }
    if report.signal.rest_of_lit >= 1.0 {
        let times = report.signal.rest_of_lit;
        let found =
            format!("at rest the sensor is at {times:.1} times the speed law's threshold, so there is no speed");
        let advice =
            "set [speed] threshold_on = \"above_baseline\", or make it darker (cover, black level, brightness)";
        findings.add("always_lit", found, advice);
    }
}

fn trigger(findings: &mut Findings, report: &Report) {
    let signal = &report.signal;
    let (per_hour, one) = (signal.false_triggers_per_hour, signal.one_taxel_sure);
    if per_hour >= 1.0 {
        let found = format!("noise alone triggers {per_hour:.0} times an hour");
        findings.add("noisy", found, "raise [trigger] margin or multiplier, or lower the gain");
    }
    let full = 5.0 * signal.lit;
    if one > full {
        let found =
            format!("one taxel has to gain {one:.1} gray levels to be seen, a touch counts as light from {full:.1} on");
        let advice = "lower [trigger] margin, or the light at rest (cover, black level, brightness)";
        findings.add("insensitive", found, advice);
    }
    let drift = &report.drift;
    if let Some(minutes) = drift.minutes_to(report.signal.five_taxels).filter(|minutes| *minutes < 60.0) {
        let levels = drift.levels_per_minute;
        let (how, what) = if levels > 0.0 { ("brighter", "fires the trigger") } else { ("darker", "hides light") };
        let (rate, time) =
            (levels.abs(), if minutes < 1.0 { "less than a minute" } else { &format!("{minutes:.0} minutes") });
        let found = format!(
            "the picture gets {how} by {rate:.2} gray levels per minute: a trigger's worth, which {what}, in {time}"
        );
        findings.add("drift", found, "let the camera warm up, lock its controls, and keep the light around it steady");
    }
}

fn mjpeg(findings: &mut Findings, report: &Report) {
    let Some(mjpeg) = &report.mjpeg else { return };
    if mjpeg.error > HALF * mjpeg.lit {
        let found = format!(
            "MJPEG is off by up to {:.1} gray levels per taxel, a touch counts as light from {:.1} on",
            mjpeg.error, mjpeg.lit
        );
        let advice =
            format!("use --format {} (uncompressed), with a smaller --size if the rate asks for it", mjpeg.raw.format);
        findings.add("mjpeg", found, &advice);
    }
}

/// Says what an unknown readout costs. docs/ANSWERS.md has the numbers.
fn readout(findings: &mut Findings) {
    let found = "readout unknown: most cameras without a global shutter read their rows one after the other".into();
    let advice = "state the time from the first to the last row, often 10 to 33 ms, with [sensor] readout_ms (0: global \
                  shutter): without it, most slides above 100 mm/s are not reliable";
    findings.add(READOUT, found, advice);
}
