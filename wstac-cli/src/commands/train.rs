//! `wstac train` trains a texture model.

use std::io::Write;
use std::path::{Path, PathBuf};

use wstac_core::model::file::{Input, Task};

use super::dataset::{not_a_source, pool, random, recorded};
use super::files::{Outputs, check_ending, check_figure, ends};
use super::output::{Stop, note, stdout};
use super::progress::while_working;
use super::signals::{Ending, finishing};
use super::values::{fraction, sample, task};
use wstac_host::config::Config;
use wstac_host::plural::counted;
use wstac_host::visible::OneLine;
use wstac_plot::Confusion;
use wstac_train::train::{TrainOptions, TrainedModel, TrainingSet, Trial, train, wilson};

/// Train a texture model, test it, and write a model file
///
/// The model is linear (multinomial logistic regression). It is trained on some sensors or recordings and tested on the
/// others, never on slides of the same one. The same input gives the same bytes with any number of threads.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// Data sets, recordings, or a sweep; by default, simulated slides
    ///
    /// Data sets (.npz) are those of wstac dataset with the same --input. Recordings (.mcap, or folders of them) need
    /// the label specimen. A sweep (.toml) is one of wstac dataset --input path.
    #[arg(value_name = "SET")]
    sets: Vec<PathBuf>,

    /// Write the model to this new file
    #[arg(short, long, value_name = "OUT.wsm")]
    output: PathBuf,

    /// The model's samples
    ///
    /// path and taxel-path hold for any speed, direction and length; frames and taxels hold for those that were
    /// trained.
    #[arg(long, value_parser = sample(), default_value = "path")]
    input: Input,

    /// The property of a specimen that the model tells apart
    ///
    /// The labels are those of the array y, or else of y_specimen, y_pattern or y_depth. Of recordings they are parts
    /// of the label specimen. other takes any names: those of y, or else of y_specimen.
    #[arg(long, value_parser = task(), default_value = "specimen")]
    task: Task,

    /// Fraction of the sensors or recordings that is for tests
    ///
    /// It is for sets without an array split, and for recordings. 0 trains without a test, on all slides.
    #[arg(long, value_name = "FRACTION", default_value = "0.2", value_parser = fraction())]
    test: f64,

    /// Draw the confusions to this new file; by default, beside OUT.wsm
    ///
    /// The default is OUT.confusion.svg.
    #[arg(long, value_name = "FILE.svg")]
    confusion: Option<PathBuf>,

    /// Print one JSON object instead of text
    ///
    /// Its keys are labels, slides, groups, left_out, and test: null, or an object of slides, groups, right, accuracy,
    /// interval, answered, accuracy_of_answered and counts (a row for each label, its last number is of slides without
    /// an answer), and calibration: null, or an object of slides, error and known.
    #[arg(long)]
    json: bool,

    /// Number of threads; by default, one per processor
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// Read the configuration of recordings from this TOML file
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// A note about the training, which inspect prints
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,

    /// Overwrite OUT.wsm and the figure
    #[arg(long)]
    force: bool,
}

const HELP: &str = "\
From nothing to a model:
  wstac train -o my.wsm
  wstac run scene:Saw3@220,30deg --model my.wsm
  Without a set, it simulates 12000 slides of ten textures on 500
  sensors, at 50 to 300 mm/s in any direction, with lengths of 60 to
  120 mm. 100 of the sensors are for tests. It takes about a minute on
  two processors. wstac dataset --help lists the keys of other sweeps.

From your own recordings:
  wstac record /dev/video0 -o a1.mcap --label specimen=Saw3
  wstac train recordings/ -o my.wsm
  Record each texture at least twice, better on more than one sensor
  (--label sensor=NAME). If every recording has the label sensor and
  there are two sensors, sensors are split, otherwise recordings. Other
  names than those of specimens, such as denim, need --task other.

The answer:
  Accuracy is that of the model file on slides that were not trained on,
  with Wilson's interval of 95 %, and for each label. A slide has no
  answer if it has no velocity, shows too little of the path, or is said
  to be unknown. It counts as wrong, here and in wstac model eval. The
  accuracy of the slides with an answer is printed beside it. The figure
  has a row for each label, and a column for each answer.
  If each texture has three sensors or recordings to train on, and
  about 50 slides, 15 % of them are kept aside for a calibration: then
  events have a confidence, and textures can be unknown. --input
  taxel-path finds most textures that were not trained, path only some.
  With fewer slides, wstac model learn makes a better model, which has
  both from three slides of each texture on.
  A note warns if guessing would have been right as often.
  The model needs no calibration of its inputs: their means and scales
  are part of its weights, which are int16.
  Exit code: 0, 1 if a set cannot be used or has one group only, 2 for
  wrong arguments, 130 after Ctrl-C, 143 after SIGTERM.
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let output = &arguments.output;
    let confusion = arguments.confusion.clone().unwrap_or_else(|| output.with_extension("confusion.svg"));
    check_figure(&confusion)?;
    let outputs = Outputs::new(arguments.force).reading(&arguments.sets).reading(&arguments.config);
    check_ending(output, &["wsm"])?;
    outputs.check([output, &confusion])?;
    let options = TrainOptions {
        input: arguments.input,
        task: arguments.task,
        test: arguments.test,
        note: arguments.note.clone(),
    };
    let threads = pool(arguments.threads)?;
    let set = gathered(arguments, &options, &threads)?;
    // Nothing is written until the model is there.
    finishing(Ending::AtOnce);
    note("training and testing the model");
    let trained = while_working("training and testing", || threads.install(|| train(set, &options)))?;
    if trained.left_out > 0 {
        let slides = counted(trained.left_out, "slide");
        note(format_args!("left out of the training: {slides} without a velocity, or with too little of the path"));
    }
    finishing(Ending::Whole);
    let bytes = trained.written.bytes();
    // The model is there even if its figure cannot be written.
    outputs.write(output, &bytes)?;
    if let Some(trial) = &trained.trial {
        outputs.write(&confusion, figure(trial, output))?;
    }
    let mut out = std::io::BufWriter::new(stdout());
    if arguments.json {
        writeln!(out, "{}", as_json(&trained))?;
    } else {
        text(&mut out, &trained)?;
    }
    out.flush()?;
    let (path, classes) = (output.display(), trained.labels.len());
    note(format_args!("{path}: {} bytes, {classes} classes, trained on {}", bytes.len(), trained.words()));
    if let Some(why) = &trained.why_uncalibrated {
        note(format_args!("not calibrated, so the model gives no confidence, and names unknown textures, too: {why}"));
        if let Some(command) = learn_command(arguments).filter(|_| !trained.is_simulated) {
            note(format_args!("help: few slides are enough for {command}"));
        }
    }
    if let Some(trial) = trained.trial.as_ref().filter(|trial| trial.is_guessing()) {
        let (right, slides, labels) = (trial.right(), counted(trial.slides(), "slide"), trial.labels.len());
        note(format_args!(
            "warning: {right} of {slides} right is no better than guessing one of {labels} textures: do not use {path}"
        ));
    }
    if trained.trial.is_some() {
        note(format_args!("{}: the confusions", confusion.display()));
    } else {
        note("there was no test: nothing is known about the accuracy on other slides");
    }
    Ok(())
}

/// Returns the command that learns a model of the same sets; `None` if a data set has no samples for it.
fn learn_command(arguments: &Arguments) -> Option<String> {
    let is_set = |path: &PathBuf| ends(path, "npz");
    // A data set has samples of one input only. Of a recording, 25 taxels tell textures apart best.
    let base = match arguments.input {
        Input::Path if arguments.sets.iter().any(is_set) => "builtin:embedding",
        Input::Frames | Input::Taxels if arguments.sets.iter().any(is_set) => return None,
        _ => "builtin:taxel-embedding",
    };
    let sets: Vec<String> = arguments.sets.iter().map(|set| set.display().to_string()).collect();
    let output = arguments.output.with_extension("learned.wsm");
    Some(format!("wstac model learn {base} {} -o {}", sets.join(" "), output.display()))
}

/// Reads all sets; without any, simulates slides by default.
fn gathered(arguments: &Arguments, options: &TrainOptions, threads: &rayon::ThreadPool) -> Result<TrainingSet, Stop> {
    let simulated = |file: Option<&PathBuf>| {
        let sweep = random::sweep(file.map(PathBuf::as_path))?;
        let slides = random::simulate(&sweep, threads)?;
        let mut set = TrainingSet::of_sweep(&sweep, &slides, options);
        if let Some(file) = file {
            set.sources = vec![file.display().to_string()];
        }
        Ok::<_, Stop>(set)
    };
    if arguments.sets.is_empty() {
        return simulated(None);
    }
    let mut set = TrainingSet::default();
    let mut recordings = Vec::new();
    for path in &arguments.sets {
        if ends(path, "npz") {
            set.extend(TrainingSet::read(path, options)?);
        } else if ends(path, "toml") {
            set.extend(simulated(Some(path))?);
        } else if path.is_dir() || ends(path, "mcap") {
            recordings.push(path.clone());
        } else {
            let expected = "a data set (.npz), recordings (.mcap), a folder of them, or a sweep (.toml)";
            return Err(not_a_source(path, "set", expected).into());
        }
    }
    if !recordings.is_empty() {
        let config = arguments.config.as_deref().map(Config::read).transpose()?;
        let recordings = recorded::read_all(&recordings, config.as_ref(), options.input, threads)?;
        set.extend(TrainingSet::of_recordings(&recordings, options)?);
    }
    Ok(set)
}

/// Returns a fraction with its interval, in percent.
fn percent(right: u32, of: u32) -> String {
    let [low, high] = wilson(right, of);
    let share = if of == 0 { 0.0 } else { 100.0 * f64::from(right) / f64::from(of) };
    format!("{share:.1} % ({:.1} … {:.1})", 100.0 * low, 100.0 * high)
}

fn sentence(trial: &Trial) -> String {
    let (right, slides) = (trial.right(), trial.slides());
    let groups = counted(trial.groups, "group");
    let all = format!("{} right: {right} of {}", percent(right, slides), counted(slides, "slide"));
    let all = format!("{all} of {groups} that were not trained on");
    match trial.answered() {
        named if named < slides => format!("{all}; of {named} with an answer, {} right", percent(right, named)),
        _ => all,
    }
}

fn text(out: &mut impl Write, trained: &TrainedModel) -> Result<(), Stop> {
    let Some(trial) = &trained.trial else { return Ok(()) };
    writeln!(out, "{}", sentence(trial))?;
    for (class, label) in trial.labels.iter().enumerate() {
        let [right, of] = trial.of_class(class);
        let label = OneLine(label).to_string();
        let share = if of == 0 { "no slide".into() } else { percent(right, of) };
        writeln!(out, "  {label:<10} {share:<24} {right} of {of}")?;
    }
    if trial.without_answer() > 0 {
        let slides = counted(trial.without_answer(), "slide");
        writeln!(
            out,
            "{slides} without an answer count as wrong: no velocity, too little of the path, or said to be unknown"
        )?;
    }
    writeln!(out, "A group is a sensor or a recording; intervals are Wilson's, 95 %.")?;
    Ok(())
}

fn as_json(trained: &TrainedModel) -> serde_json::Value {
    let test = trained.trial.as_ref().map(|trial| {
        let (right, slides) = (trial.right(), trial.slides());
        serde_json::json!({
            "slides": slides,
            "groups": trial.groups,
            "right": right,
            "accuracy": f64::from(right) / f64::from(slides.max(1)),
            "interval": wilson(right, slides),
            "answered": trial.answered(),
            "accuracy_of_answered": f64::from(right) / f64::from(trial.answered().max(1)),
            "counts": trial.counts,
        })
    });
    let calibration = trained.calibration.map(|quality| {
        serde_json::json!({
            "slides": quality.samples,
            "error": quality.calibration_error,
            "known": quality.known,
        })
    });
    serde_json::json!({
        "labels": trained.labels,
        "slides": trained.slides,
        "groups": trained.groups,
        "left_out": trained.left_out,
        "test": test,
        "calibration": calibration,
    })
}

/// Draws the confusions.
fn figure(trial: &Trial, model: &Path) -> String {
    let name = model.file_name().unwrap_or_default().to_string_lossy();
    let caption = format!(
        "{name}: {}. Each row has the slides of a texture, and a cell is darker the more of them got its answer. \
         Intervals are Wilson's, 95 %.",
        sentence(trial)
    );
    Confusion { labels: &trial.labels, counts: &trial.counts, caption: &caption }.draw()
}
