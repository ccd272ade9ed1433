//! `wstac doctor` measures a sensor and reports what to change.

use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::AtomicUsize;
use std::time::SystemTime;

use super::files::{Outputs, check_ending};
use super::output::{Stop, json, note, stdout};
use super::signals::{self, Ending, finishing, number};
use super::source_arguments::SourceArguments;
use super::values::within;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::in_utc;
use wstac_host::plural::counted;
use wstac_host::source::{FramePolicy, Source, StreamInfo};
use wstac_host::text_file::file_text;
use wstac_linux::controls::controls;
use wstac_linux::device_at;
use wstac_linux::source::{is_camera, is_device};
use wstac_setup::doctor::controls::compare;
use wstac_setup::doctor::measure::{Limit, Measured, SETTLING, measure};
use wstac_setup::doctor::mjpeg::{self, MjpegReport, counterpart};
use wstac_setup::doctor::page::{Page, Picture};
use wstac_setup::doctor::{CameraReport, Known, examine};

/// Measure a sensor that nothing touches, and print what to change
///
/// The report has frame rate, noise, black level, leaking light, drift, controls and the cost of MJPEG, and then
/// advice. Nothing may touch the sensor during the measurement. Cover the sensor as it will be covered in use.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// /dev/videoN, or any other source of wstac run
    ///
    /// A scene is measured up to its first slide.
    source: OsString,

    /// Measure for this long
    ///
    /// A camera that offers both MJPEG and another format is measured twice.
    #[arg(long, value_name = "S", default_value = "10", value_parser = within(0.1..=86_400.0, "0.1 to 86400 s"))]
    seconds: f64,

    /// Value of a pixel in full darkness, in gray levels of 255
    ///
    /// Measure it once ("black" in the report). Without it, the darkest pixels are taken for it, and light that falls
    /// on all pixels alike is not noticed.
    #[arg(long, value_name = "LEVEL", value_parser = within(0.0..=255.0, "0 to 255"))]
    black_level: Option<f64>,

    /// Read the configuration from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,

    /// Also write a page for a bug report: picture, numbers, advice, system
    ///
    /// The page is one file, has no scripts, and asks no server for anything. It has the camera's serial number and
    /// your configuration, so look at it before you send it.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,

    /// Overwrite the page of --report
    #[arg(long, requires = "report")]
    force: bool,

    #[command(flatten)]
    options: SourceArguments,
}

const HELP: &str = r#"Measurement:
  Levels are gray levels of 255 in every format. 10 000 pixels, evenly
  spread, stand for all of them. The first 15 frames of a camera are not
  measured. Its controls stay locked afterwards.
  Exit code: 1 if the source or configuration cannot be used, 2 for wrong
  arguments, 130 after Ctrl-C, 143 after SIGTERM, otherwise 0, whatever
  the verdict is.

A page for a bug report (--report FILE.html):
  One file has the advice, the last frame with the taxels, the numbers,
  the machine, the configuration and the JSON. The measurement and the
  output are the same. A measurement that fails writes no page.

Output with --json, one object (wrapped here):
  {"source":"/dev/video0: …","camera":{…},"rate":{…},"levels":{…},
   "noise":{…},"signal":{…},"drift":{…},"controls":[…],"mjpeg":{…},
   "healthy":false,"verdict":[…]}
  camera     null if the source is no camera
    path, serial, card, driver, bus
               its identity
    links      paths that stay the same, by serial number first
    format     as it was measured
    modes      all that it offers, as in wstac devices --json
  rate       frames per second
    asked, stated, measured
               requested, stated by the driver, seen in its timestamps
    jitter_ms, longest_ms
               deviation of the intervals, and the longest of them
    frames, seconds, lost
               frames in this time, and those lost, by reason
  levels     brightness at rest
    full_scale in steps of the format
    mean, darkest_taxel, brightest_taxel
               means of all taxels, and of one
    black      --black-level (then black_is_given is true), or the mean
               of the darkest 1 % of pixels
    leak       mean less black
    saturated, clipped
               fractions of pixels at full scale, and always at 0
  noise      rms from frame to frame
    taxel      of a taxel's mean; worst_taxel is the noisiest one
    pixel      of a pixel in a taxel
  signal     the smallest light that fires the trigger
    one_taxel  if one taxel lights up alone: the worst taxel, by the
               better of its row and its column
    one_taxel_sure
               the same plus 3.09 deviations of the noise, so that 999 of
               1000 touches fire
    five_taxels
               light of each taxel if all five of the least sensitive row
               or column light up
    line_noise deviation of the mean of a row or column over a window
    noise_margin
               distance to the threshold, in such deviations
    false_triggers_per_hour
               expected if the noise is normal
    lit        [speed] threshold, as levels of each of five taxels
    rest_of_lit
               the brightest row or column at rest, as a fraction of lit
  drift      change of brightness at rest
    levels_per_minute, error
               of the mean of all taxels, with its standard error
    worst_taxel
               the same of one taxel
    minutes_to_trigger
               until the drift equals five_taxels; null if it is below
               four standard errors, or gets darker, which never fires
  controls   those that change gray levels, and others that changed:
             name, value, value_at_end, locked (null for the others), why
             not, drifts (it changed, or the driver says that the
             hardware changes it)
  mjpeg      the same scene raw and as jpeg; null if the source is no
             camera or offers only one of the two at this size
    format, frames, mean, taxel_noise, pixel_noise
               of each of the two
    worst_taxel_off
               the largest difference of a taxel's mean
    dc_step    the smallest step of a block's mean
    corrupt    pictures that could not be decoded
    error      the worst of worst_taxel_off and half of dc_step; compare
               it with lit
  verdict    what to change, the worst first: kind, found, advice. Kinds:
             touched, frozen, unlocked, drifting_control, slow, rate,
             jitter, lost, saturated, clipped, leak, always_lit, noisy,
             insensitive, drift, mjpeg, readout
  healthy    true if nothing is to be changed; readout, which a camera
             has whose readout is unknown, does not count

The threshold of the trigger:
  A row or column whose five taxels add up to R levels at rest fires when
  they gain F·e^D − R over a window, with F = max(R, floor) and
  D = max((multiplier − 1)·|ln(F/255)|, margin).
  With rule = "literal", D = (multiplier − 1)·ln(F/255).
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let outputs = Outputs::new(arguments.force).source(&arguments.source).reading(&arguments.config);
    if let Some(page) = &arguments.report {
        check_ending(page, &["html", "htm"])?;
        outputs.check([page])?;
    }
    let (mut source, info, config) =
        arguments.options.open_configured(&arguments.source, FramePolicy::Every, arguments.config.as_deref())?;
    note(&info.about);
    config.doubts().for_each(note);
    note(format_args!("measuring for at most {} s: do not touch the sensor", arguments.seconds));
    finishing(Ending::InTime);
    let signal = number();
    let frames = arguments.options.frames_before_touch(&arguments.source)?;
    // A recording may name its camera, which need not be connected now.
    let live = is_camera(&arguments.source);
    let limit = Limit { settling: if live { SETTLING } else { 0 }, seconds: arguments.seconds, frames };
    let path = info.camera.as_ref().map(|camera| camera.path.clone()).filter(|path| live && is_device(path));
    let before = path.as_deref().map(controls).transpose()?;
    let measured = measure(source.as_mut(), &info, &config, limit, &signal)?;
    signals::check()?;
    // The camera is still open, so changes that it makes when it is closed do not count.
    let camera = match (&path, before, source.info().camera.as_deref()) {
        (Some(path), Some(before), Some(state)) => {
            let controls = compare(&state.controls, &before, &controls(path)?);
            let gone = || Error::new(ErrorKind::Device, path.display(), "does not capture video any more");
            let device = device_at(path).ok_or_else(gone)?;
            Some((CameraReport { device, format: state.format.clone() }, controls))
        }
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
    let json = json(&report)?;
    if let Some(path) = &arguments.report {
        let bytes = &measured.last;
        // Numbers are what counts; without a picture the page has the others.
        let layout = config.geometry(&info).map(|geometry| *geometry.layout());
        let picture = layout.ok().filter(|_| !bytes.is_empty()).map(|layout| Picture::new(&info, &layout, bytes));
        let configuration = arguments.config.as_deref().map(file_text).transpose()?;
        let configuration = configuration.or_else(|| info.recorded.as_ref().map(|own| own.configuration.clone()));
        let page = Page {
            report: &report,
            picture: picture.as_ref(),
            system: &system(),
            configuration: &configuration.unwrap_or_default(),
            json: &json,
        };
        outputs.write(path, page.to_html())?;
        note(format_args!("wrote {}: look at it, then attach it to a bug report", path.display()));
    }
    let mut out = stdout();
    Ok(if arguments.json { writeln!(out, "{json}") } else { writeln!(out, "{report}") }?)
}

/// Returns facts about this machine and program, as far as the system tells them.
fn system() -> Vec<(&'static str, String)> {
    let file = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    // The value of the first line that starts so.
    let value = |text: &str, start: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(start));
        line.map(|rest| rest.trim_start_matches([' ', '\t', ':', '=']).trim_matches('"').to_owned())
    };
    let threads = std::thread::available_parallelism().map_or(0, usize::from);
    let cpu = file("/proc/cpuinfo");
    let cpu = value(&cpu, "model name").or_else(|| value(&cpu, "Model")).unwrap_or_default();
    let command: Vec<_> = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    let facts = [
        ("wstac", env!("CARGO_PKG_VERSION").to_owned()),
        ("command", format!("wstac {}", command.join(" "))),
        ("time", in_utc(SystemTime::now())),
        ("system", value(&file("/etc/os-release"), "PRETTY_NAME").unwrap_or_default()),
        ("kernel", file("/proc/sys/kernel/osrelease").trim().to_owned()),
        ("architecture", std::env::consts::ARCH.to_owned()),
        ("processor", format!("{cpu} ({})", counted(threads, "thread"))),
        ("memory", memory(&file("/proc/meminfo")).unwrap_or_default()),
    ];
    facts.into_iter().filter(|(_, value)| !value.is_empty()).collect()
}

/// Returns the size of the memory by the text of /proc/meminfo.
fn memory(text: &str) -> Option<String> {
    let kib: f64 =
        text.lines().find_map(|line| line.strip_prefix("MemTotal:"))?.split_whitespace().next()?.parse().ok()?;
    Some(format!("{:.1} GB", kib * 1024.0 / 1e9))
}

/// Measures the same scene in the other kind of format: MJPEG or raw.
///
/// Returns `None` if the camera does not have both kinds, or if the second measurement fails. Then standard error has
/// the reason of the failure.
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
    note(format_args!("measuring for another {} s, in {format}", arguments.seconds));
    let second = measure(source.as_mut(), &other, config, limit, signal).map_err(Stop::from);
    let Some(second) = compared(second.and_then(|second| signals::check().map(|()| second)))? else { return Ok(None) };
    let (this, that) = ((&*camera.format, measured), (&*format, &second));
    let is_jpeg = this.0 == "MJPG" || this.0 == "JPEG";
    Ok(Some(if is_jpeg { mjpeg::compare(that, this, config) } else { mjpeg::compare(this, that, config) }))
}

/// Returns the result, or `None` after a note if it failed: the report of the first format is complete without it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_format_that_fails_ends_nothing_and_a_signal_does() {
        assert!(matches!(compared(Ok(7)), Ok(Some(7))));
        assert!(matches!(compared::<u8>(Err(Error::new(ErrorKind::Device, "/dev/video0", "busy").into())), Ok(None)));
        assert!(matches!(compared::<u8>(Err(Stop::Interrupted(15))), Err(Stop::Interrupted(15))));
        assert!(matches!(compared::<u8>(Err(Stop::OutputClosed)), Err(Stop::OutputClosed)));
    }
}
