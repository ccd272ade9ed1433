//! `wstac characterize` measures a real sensor by slides, and reports its answers beside the truth.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::files::Outputs;
use super::output::{Stop, note};
use super::source_arguments::SourceArguments;
use super::{calibrate, record};
use crate::open;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::output::{Output, OutputOptions, ReadoutUsed};
use wstac_host::record::{
    labels,
    plan::{self, PlannedSlide},
};
use wstac_host::session::Processor;
use wstac_host::source::open::OpenOptions;
use wstac_host::source::{Source, SourceEvent, StreamInfo, config_of};
use wstac_host::text_file::file_text;
use wstac_scene::Slide;
use wstac_scene::measured::{MeasuredSensor, MeasuredSlide};
use wstac_scene::sensor::SensorConfig;
use wstac_scene::specimen::{Pattern, Specimen};
use wstac_setup::characterize::{AnswerReport, SlideAnswer, SlideTruth};
use wstac_setup::light::LightAboveDark;
use wstac_train::dataset::recordings::find;

/// Calibrate a sensor, record slides, and report on its answers
///
/// The folder keeps everything. What is there is not made again, so the same command continues after a stop, and makes
/// the report again.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// A camera, or a file or a scene that has the slides of the plan in their order
    source: OsString,

    /// The folder for the configuration, the recordings and the report
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,

    /// The slides to record: a plan, as for wstac record
    ///
    /// By default, 50 slides of a flat block at 80 to 200 mm/s, to the right and upward.
    #[arg(long, value_name = "PLAN.toml")]
    plan: Option<PathBuf>,

    /// The true speeds and directions, such as those of an arm, instead of the planned ones
    #[arg(long, value_name = "FILE.csv")]
    truth: Option<PathBuf>,

    #[command(flatten)]
    options: SourceArguments,
}

const PLAN: &str = "specimens = [\"Fla0\"]\nspeeds = [80, 100, 120, 150, 200]\ndirections = [0, 90]\ncount = 5\n";

const HELP: &str = "\
Steps:
  1 FOLDER/wstac.toml is missing: wstac calibrate writes it. Do not touch
    the sensor for a second; then press a flat plate slowly on all
    whiskers, hold it, and let go, three times.
  2 wstac record --guide records each slide of the plan. Use a flat block
    that is longer and wider than the sensor, with an arm or along a
    ruler. Only blocks that stay for a second tell the light of rubbing:
    one of 105 mm at 80 to 150 mm/s.
  3 The answers are compared with the truth, and the light with that of
    the same slides of the simulated sensor.

Files of the folder:
  wstac.toml   the configuration, for --config
  plan.toml    the plan
  *.mcap       a recording of each slide
  report.html  one page to keep or to send; it loads nothing
  scene.toml   a scene of this sensor: its light, gains, noise and
               afterglow. Its slide is an example. Format and black
               level are guesses.

Truth (--truth FILE.csv):
  recording,speed,direction
  Fla0-80mm_s-0deg-1, 79.8, 0.4
  recording is the name of the file without .mcap, speed is in mm/s, and
  direction in degrees: 0 is to the right, 90 up. Where a field is empty,
  and for recordings that are not there, the plan holds.

Examples:
  wstac characterize /dev/video0 -o my-sensor
  wstac characterize /dev/video0 -o my-sensor --truth arm.csv
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let folder = arguments.output.as_path();
    let truth = arguments.truth.as_deref().map(read_truth).transpose()?.unwrap_or_default();
    let [config, plan, page, scene] =
        ["wstac.toml", "plan.toml", "report.html", "scene.toml"].map(|name| folder.join(name));
    let (text, planned) = plan_of(arguments.plan.as_deref(), &plan)?;
    if let Some(path) = &arguments.truth {
        check_names(path, &truth, folder, &planned)?;
    }
    // Once the source is open: what cannot be opened leaves no folder.
    let keep_plan = || {
        fs::create_dir_all(folder).map_err(|error| Error::io(folder.display(), error))?;
        if plan.exists() { Ok(()) } else { Outputs::new(false).write(&plan, &text) }
    };
    if config.exists() {
        keep_plan()?;
    } else {
        let options = arguments.options.clone();
        let begin = || {
            keep_plan()?;
            note("1 of 3: do not touch the sensor for a second; then press a flat plate on all whiskers three times");
            Ok(())
        };
        let calibration = calibrate::Arguments::of(arguments.source.clone(), config.clone(), options);
        calibrate::find(&calibration, Some(begin))?;
    }
    note("2 of 3: slides");
    let options = arguments.options.clone();
    let session = record::Arguments::guided(arguments.source.clone(), folder.to_owned(), plan, config.clone(), options);
    record::run(&session)?;
    note("3 of 3: answers and light");
    let mut found = Characterized::default();
    for file in find(&[folder.to_owned()])? {
        found.read(&file, &truth)?;
    }
    let measured = found.measured();
    let overlay = fs::read(config.with_extension("png")).ok();
    let about = found.info.as_ref().map_or_else(String::new, |info| info.about.clone());
    let outputs = Outputs::new(true).source(&arguments.source);
    outputs.write(&page, found.report.to_html(&about, overlay.as_deref(), &measured))?;
    match measured {
        Ok(keys) => {
            outputs.write(&scene, keys)?;
            note(format_args!("wrote {} and {}", page.display(), scene.display()));
        }
        Err(why) => {
            note(format_args!("wrote {}; the sensor's light was not measured: {why}", page.display()));
            if scene.exists() {
                note(format_args!("{} is of an earlier run", scene.display()));
            }
        }
    }
    Ok(write!(super::output::stdout(), "{}", found.report)?)
}

/// Returns the text of the plan and its slides. The folder has one plan.
fn plan_of(given: Option<&Path>, kept: &Path) -> Result<(String, Vec<PlannedSlide>), Error> {
    let from = given.unwrap_or(kept);
    let text = if from.exists() || given.is_some() { file_text(from)? } else { PLAN.to_owned() };
    if given.is_some() && kept.exists() && file_text(kept)? != text {
        let message = "is another plan than that of --plan (one folder has one plan); help: name another folder";
        return Err(Error::new(ErrorKind::Usage, kept.display(), message));
    }
    let planned = plan::parse(&text).map_err(|message| Error::new(ErrorKind::Config, from.display(), message))?;
    Ok((text, planned))
}

/// Refuses a truth about a slide that is neither planned nor recorded, before a person waits.
fn check_names(
    path: &Path,
    truth: &BTreeMap<String, SlideTruth>,
    folder: &Path,
    planned: &[PlannedSlide],
) -> Result<(), Error> {
    // There may be no recording yet.
    let recorded = find(&[folder.to_owned()]).unwrap_or_default();
    let is_planned = |name: &String| planned.iter().any(|slide| slide.name == *name);
    let is_recorded = |name: &String| recorded.iter().any(|file| name_of(file) == *name);
    let Some(name) = truth.keys().find(|name| !is_planned(name) && !is_recorded(name)) else { return Ok(()) };
    let message = "no slide of the plan and no recording has this name";
    let message = format!("{message} (found {name:?}, expected one such as {:?})", planned[0].name);
    Err(Error::new(ErrorKind::Data, path.display(), message))
}

/// Returns the name of a recording, without its ending.
fn name_of(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Reads the true speeds and directions of recordings by name.
fn read_truth(path: &Path) -> Result<BTreeMap<String, SlideTruth>, Error> {
    let text = file_text(path)?;
    let wrong = |line: usize, message: String| {
        Error::new(ErrorKind::Data, path.display(), format_args!("line {line}: {message}"))
    };
    let mut lines = (1..).zip(text.lines());
    // Spreadsheets write a mark of UTF-8 in front.
    let heads = lines.next().map(|(_, line)| line.trim_start_matches('\u{feff}').trim()).unwrap_or_default();
    if heads != "recording,speed,direction" {
        return Err(wrong(1, format!("wrong names of columns (found {heads:?}, expected recording,speed,direction)")));
    }
    let mut truth = BTreeMap::new();
    for (line, row) in lines.filter(|(_, row)| !row.trim().is_empty()) {
        let fields: Vec<&str> = row.split(',').map(str::trim).collect();
        let [name, speed, direction] = fields[..] else {
            return Err(wrong(line, format!("wrong number of fields (found {}, expected 3)", fields.len())));
        };
        let number = |field: &str, expected: &str, is_valid: fn(f64) -> bool| match field {
            "" => Ok(None),
            _ => field.parse().ok().filter(|number| is_valid(*number)).map(Some).ok_or_else(|| {
                wrong(line, format!("wrong number (found {field:?}, expected {expected}, or an empty field)"))
            }),
        };
        let mm_s = number(speed, "a speed in mm/s above 0", |mm_s| mm_s > 0.0 && mm_s.is_finite())?;
        let degrees = number(direction, "a direction in degrees", f64::is_finite)?;
        if truth.insert(name.to_owned(), SlideTruth { mm_s, degrees }).is_some() {
            return Err(wrong(line, format!("recording {name:?} is there twice (expected each once)")));
        }
    }
    Ok(truth)
}

/// The answers and the light of a sensor's recordings.
#[derive(Default)]
struct Characterized {
    info: Option<StreamInfo>,
    readout_ms: Option<f64>,
    report: AnswerReport,
    slides: Vec<MeasuredSlide>,
}

impl Characterized {
    /// Reads a recording of one slide.
    fn read(&mut self, file: &Path, truth: &BTreeMap<String, SlideTruth>) -> Result<(), Error> {
        let name = name_of(file);
        let mut source = open(file, &OpenOptions::default())?;
        let info = source.info().clone();
        let config = config_of(&info, None)?;
        let labeled = info.recorded.as_ref().map(|recorded| &recorded.labels);
        let specimen = labeled.and_then(|labels| labels.get("specimen")).cloned().unwrap_or_default();
        let wrong = |message: String| Error::new(ErrorKind::Data, file.display(), message);
        let (mm_s, degrees) = labeled.map(labels::check).transpose().map_err(wrong)?.unwrap_or_default();
        let planned = SlideTruth { mm_s, degrees: degrees.map(f64::from) };
        let own = truth.get(&name).copied().unwrap_or_default();
        let truth = SlideTruth { mm_s: own.mm_s.or(planned.mm_s), degrees: own.degrees.or(planned.degrees) };
        let mut light = LightAboveDark::new(config.geometry(&info)?);
        let mut processor = Processor::new(&info, &config, OutputOptions::default())?;
        let (mut frames, mut has_lost, mut answer, mut events) = (Vec::new(), false, None, 0);
        loop {
            let event = source.next_event()?;
            frames.extend(light.take(&event));
            has_lost |= matches!(event, SourceEvent::Lost { .. });
            let goes_on = processor.process(&event, |output| {
                if let Output::Event(event) = &output {
                    events += 1;
                    answer.get_or_insert_with(|| SlideAnswer::new(name.clone(), truth, event));
                }
                Ok::<(), Error>(())
            })?;
            if !goes_on {
                break;
            }
        }
        match answer {
            Some(answer) => self.report.slides.push(answer),
            None => self.report.without_event.push(name.clone()),
        }
        if events > 1 {
            self.report.of_several.push(name.clone());
        }
        if has_lost {
            note(format_args!("{name} has lost frames: it does not tell the sensor's light"));
        }
        if let (Some(mm_s), Some(degrees), "Fla0", false) = (truth.mm_s, truth.degrees, &*specimen, has_lost) {
            let slide = Slide::new(Specimen::block(Pattern::Flat, 0.0), mm_s, degrees);
            let dark = light.dark().iter().sum::<f64>() / light.dark().len() as f64;
            self.slides.push(MeasuredSlide { slide, frames, noise: light.mean_noise(), dark });
        }
        self.readout_ms = ReadoutUsed::of(config.sensor.readout).ms();
        let sensors = &mut self.report.sensors;
        sensors.extend(info.sensor().filter(|sensor| !sensors.contains(sensor)));
        self.info.get_or_insert(info);
        Ok(())
    }

    /// Returns the keys of the scene that is this sensor, or why there are none.
    fn measured(&self) -> Result<String, String> {
        let info = self.info.as_ref().ok_or("there is no recording")?;
        let readout_ms = self.readout_ms.unwrap_or_default();
        let sensor = SensorConfig { size: info.size, rate: info.rate, readout_ms, ..SensorConfig::default() };
        let mut found = MeasuredSensor::new(&self.slides, &sensor).map_err(|error| error.to_string())?;
        found.has_readout = self.readout_ms.is_some();
        Ok(format!("# An example slide: replace it by others.\nspecimen = \"Fla0\"\nspeed = 100\n{found}"))
    }
}
