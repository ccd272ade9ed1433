//! `wstac doctor`: what is right and wrong with a sensor.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::output::{Stop, note};
use super::run::signals;
use super::source_arguments::SourceArguments;
use wstac_host::camera::{CameraState, ControlValue};
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::source::{FramePolicy, Source, StreamInfo};
use wstac_linux::controls::controls;
use wstac_linux::device_at;
use wstac_linux::source::is_camera;
use wstac_setup::doctor::controls::{ControlReport, compare};
use wstac_setup::doctor::measure::{Limit, Measured, SETTLING, measure};
use wstac_setup::doctor::mjpeg::{self, MjpegReport, counterpart};
use wstac_setup::doctor::{CameraReport, Known, examine};

/// Measure a sensor that nothing touches, and say what to change
///
/// Frame rate, noise, black level, leaking light, drift, controls and what MJPEG costs: numbers, then what to do about
/// them. Nothing may touch the sensor meanwhile; cover it as it will be used.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// /dev/videoN, or anything else that wstac run reads; a scene is measured up to its first slide
    source: String,

    /// Measure for this long; a camera with MJPEG and another format twice
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds)]
    seconds: f64,

    /// A pixel's value without any light, in gray levels of 255, as an earlier measurement in full darkness gave it
    /// ("black"); without it the darkest pixels stand for it, and light that falls on all pixels alike goes unseen
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    black_level: Option<f64>,

    /// Read the configuration from this TOML file (wstac run --help)
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    options: SourceArguments,
}

const HELP: &str = r#"Exit code: 1 where the source or configuration cannot be used, 2 for wrong arguments, 130
after Ctrl-C, 143 after SIGTERM, otherwise 0: a verdict is an answer, whatever it says.

What is measured, in gray levels of 255 whatever the format; with --json as one object:
  {"source":"/dev/video0: …","camera":{…},"rate":{…},"levels":{…},"noise":{…},"signal":{…},
   "drift":{…},"controls":[…],"mjpeg":{…},"healthy":false,"verdict":[…]}
  camera     who it is: "path", "links" (paths that stay, by serial number first), "serial",
             "card", "driver", "bus"; "format" as it was measured, and all that it offers
             ("modes", as wstac devices --json); null where the source is no camera
  rate       frames a second that were "asked" for, that the driver has "stated" and that its
             timestamps show ("measured"); "jitter_ms" is the deviation of the intervals,
             "longest_ms" the longest; "frames" in "seconds", those "lost" by reason
  levels     "full_scale" in the format's own steps; "mean", "darkest_taxel",
             "brightest_taxel"; "black": --black-level ("black_is_given"), else the mean of the
             darkest 1 % of pixels; "leak": mean less black; shares of pixels at full scale
             ("saturated") and always 0 ("clipped")
  noise      rms from frame to frame: of a taxel's mean ("taxel", the noisiest "worst_taxel")
             and of a "pixel" in a taxel
  signal     the smallest light that fires the trigger: a line (row or column) whose five
             taxels add up to R levels at rest fires when they gain F·e^D − R over a window,
             F = max(R, floor), D = max((multiplier − 1)·|ln(F/255)|, margin);
             rule = "literal": D = (multiplier − 1)·ln(F/255). "one_taxel": where one taxel of
             the line lights up alone, the better of its two lines, the worst taxel;
             "one_taxel_sure": 3.09 deviations of the noise more, for 999 of 1000;
             "five_taxels": where all five of the least sensitive line do, each.
             "line_noise": deviation of a line's mean over a window; "noise_margin": the
             distance to the threshold in such deviations; "false_triggers_per_hour": what
             that makes of normal noise. "lit": [speed] threshold as levels of each of five
             taxels; "rest_of_lit": the brightest line at rest as a share of it
  drift      "levels_per_minute" of the mean of all taxels with its standard "error", of the
             "worst_taxel"; "minutes_to_trigger" until it is as much as five_taxels, null
             where it is less than four standard errors, or gets darker, which never fires
  controls   those that change what gray levels mean, and others that changed: "name", "value",
             "value_at_end", "locked" (null for the others), "why" not, whether it "drifts": it
             changed meanwhile, or the driver says that the hardware changes it
  mjpeg      the same scene "raw" and as "jpeg": "format", "frames", "mean", "taxel_noise",
             "pixel_noise"; "worst_taxel_off": the worst difference of a taxel's mean;
             "dc_step": the smallest step of a block's mean; "corrupt" pictures; "error": the
             worst of the first and half the second, against "lit". null where the source is
             no camera, offers only one kind at this size, or the other cannot be measured
  verdict    what to change, the worst first: "kind", "found", "advice". Kinds: touched, frozen,
             unlocked, drifting_control, slow, rate, jitter, lost, saturated, clipped, leak,
             always_lit, noisy, insensitive, drift, mjpeg. "healthy": there is none
  10 000 pixels, evenly spread, stand for all of them. A camera's first 15 frames are not
  measured. Its controls stay locked afterwards.
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let (mut source, info, config) =
        arguments.options.open_configured(&arguments.source, FramePolicy::Every, arguments.config.as_deref())?;
    note(&info.about);
    note(format_args!("measuring for {} s at most: nothing may touch the sensor", arguments.seconds));
    let signal = signals()?;
    let frames = arguments.options.frames_before_touch(&arguments.source)?;
    // A recording may know its camera, which is not there now.
    let live = is_camera(&arguments.source);
    let limit = Limit { settling: if live { SETTLING } else { 0 }, seconds: arguments.seconds, frames };
    let path = info.camera.as_ref().filter(|_| live).map(|camera| camera.path.clone());
    let before = path.as_deref().map(controls).transpose()?;
    let measured = whole(source.as_mut(), &info, &config, limit, &signal)?;
    // Still open: what the camera does to its controls when it is closed is none of this.
    let camera = match (&path, before, source.info().camera.as_deref()) {
        (Some(path), Some(before), Some(state)) => Some(examined(path, state, &before)?),
        _ => None,
    };
    drop(source);
    let mjpeg = match &camera {
        Some((camera, _)) => compression(arguments, &info, &config, (camera, &measured), limit, &signal)?,
        None => None,
    };
    let asked_fps = camera.is_some().then(|| arguments.options.asked_fps());
    let known = Known { asked_fps, black: arguments.black_level };
    let (camera, controls) = camera.map_or((None, Vec::new()), |(camera, controls)| (Some(camera), controls));
    let report = examine(&info, &config, &measured, known, (camera, controls), mjpeg)?;
    let mut out = std::io::stdout().lock();
    if arguments.json {
        let json = serde_json::to_string(&report).map_err(|error| Error::new("standard output", error))?;
        return Ok(writeln!(out, "{json}")?);
    }
    Ok(writeln!(out, "{report}")?)
}

/// A measurement that no signal ended.
fn whole(
    source: &mut dyn Source,
    info: &StreamInfo,
    config: &Config,
    limit: Limit,
    signal: &AtomicUsize,
) -> Result<Measured, Stop> {
    let measured = measure(source, info, config, limit, signal)?;
    match signal.load(Ordering::Relaxed) {
        0 => Ok(measured),
        signal => Err(Stop::Interrupted(signal as u8)),
    }
}

/// Who the camera is and what its controls did.
fn examined(
    path: &Path,
    state: &CameraState,
    before: &[ControlValue],
) -> Result<(CameraReport, Vec<ControlReport>), Error> {
    let controls = compare(&state.controls, before, &controls(path)?);
    let device = device_at(path).ok_or_else(|| Error::new(path.display(), "does not capture video any more"))?;
    Ok((CameraReport { device, format: state.format.clone() }, controls))
}

/// The same scene in the other kind of format, where the camera has one; why not, on standard error.
fn compression(
    arguments: &Arguments,
    info: &StreamInfo,
    config: &Config,
    (camera, measured): (&CameraReport, &Measured),
    limit: Limit,
    signal: &AtomicUsize,
) -> Result<Option<MjpegReport>, Stop> {
    let size = info.size.into();
    let Some(other) = counterpart(&camera.device.modes, &camera.format, size) else { return Ok(None) };
    let opened = arguments.options.with_format(other, size).open(&arguments.source, FramePolicy::Every);
    let Some((mut source, other)) = compared(opened.map_err(Stop::from))? else { return Ok(None) };
    let format = other.camera.as_ref().map_or("", |camera| &camera.format).to_owned();
    if other.size != info.size || format == camera.format {
        note(format_args!("MJPEG is not compared: the camera gives {} instead", other.about));
        return Ok(None);
    }
    note(&other.about);
    note(format_args!("measuring for {} s more, in {format}", arguments.seconds));
    let second = whole(source.as_mut(), &other, config, limit, signal);
    let Some(second) = compared(second)? else { return Ok(None) };
    let (this, that) = ((&*camera.format, measured), (&*format, &second));
    let is_jpeg = this.0 == "MJPG" || this.0 == "JPEG";
    Ok(Some(if is_jpeg { mjpeg::compare(that, this, config) } else { mjpeg::compare(this, that, config) }))
}

/// What is needed to compare; where it failed, why, on standard error: the report of the first format is finished.
fn compared<T>(result: Result<T, Stop>) -> Result<Option<T>, Stop> {
    match result {
        Ok(there) => Ok(Some(there)),
        Err(Stop::Failed(error)) => {
            note(format_args!("MJPEG is not compared: {error}"));
            Ok(None)
        }
        Err(stop) => Err(stop),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.1..=86_400.0).contains(seconds));
    seconds.ok_or_else(|| format!("{text:?} is no time, expected 0.1 to 86400 s"))
}

fn level(text: &str) -> Result<f64, String> {
    let level = text.parse().ok().filter(|level| (0.0..=255.0).contains(level));
    level.ok_or_else(|| format!("{text:?} is no level, expected 0 to 255"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_format_that_fails_ends_nothing_and_a_signal_does() {
        assert!(matches!(compared(Ok(7)), Ok(Some(7))));
        assert!(matches!(compared::<u8>(Err(Error::new("/dev/video0", "busy").into())), Ok(None)));
        assert!(matches!(compared::<u8>(Err(Stop::Interrupted(15))), Err(Stop::Interrupted(15))));
        assert!(matches!(compared::<u8>(Err(Stop::OutputClosed)), Err(Stop::OutputClosed)));
    }
}
