//! `wstac fit-speed` fits the speed law to a sensor's own slides.

use std::io::Write;
use std::path::PathBuf;

use serde_json::json;
use wstac_core::rate::FrameRate;
use wstac_core::speed::ThresholdOn;

use super::files::Outputs;
use super::output::{Stop, note};
use wstac_host::config::Config;
use wstac_host::plural::counted;
use wstac_host::source::option_text::frame_rate;
use wstac_plot::{Format, SpeedFit, SpeedFits};
use wstac_train::fit::Fit;
use wstac_train::fit::data::Slides;

/// Fit the speed law to slides of known speeds
///
/// The slower a slide is, the longer it is lit. The published law relates its duration D (in frames at 30 per second) to
/// its speed v (in mm/s): D = intercept − slope · log10 v. It is fitted by least squares. The result is valid for one
/// sensor, one specimen length and one threshold.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP)]
pub(super) struct Arguments {
    /// Data sets of labeled slides, made by wstac dataset
    #[arg(required = true, value_name = "DATA.npz")]
    data: Vec<PathBuf>,

    /// Write the law to this new file, for wstac run --config
    ///
    /// The file has one table, [speed].
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,

    /// Draw durations, the law and residuals to this new file
    ///
    /// The ending of the name says what it is: SVG, PNG (300 dots per inch) or PDF.
    #[arg(long, value_name = "FILE.svg|png|pdf")]
    plot: Option<PathBuf>,

    /// The camera's frames per second, such as 30 or 30000/1001
    ///
    /// It is for data sets that do not state it; 30 by default.
    #[arg(long, value_name = "RATE", value_parser = frame_rate)]
    fps: Option<FrameRate>,

    /// The configuration that the data set was made with
    ///
    /// Its speed threshold is written to the table, too.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,

    /// Overwrite the files
    #[arg(long)]
    force: bool,
}

const HELP: &str = r#"Input:
  speed      mm/s of each slide, NaN if it is not known
  duration   lit frames of its event, -1 if it is cut off or never lit
  reliable   optional: slides that are not reliable are left out
  fps        optional: the camera's frames per second; --fps and other
             data sets must not contradict it
  Slides that are left out are counted by their reason. At least three
  different speeds are needed.

Output:
  - the law's parameters with their standard errors, and R²
  - by how much the durations deviate from it
  - by how much the speeds that it gives for the durations are off
  - the speeds that it was fitted on
  - the speeds that it can answer: slower slides are cut off by the
    sample of 70 frames, and faster ones last a frame or less

Output with --json, one line (wrapped here):
  {"kind":"fit","law":"published","intercept":151.06,
   "intercept_error":1.2,"slope":56.29,"slope_error":0.55,"r2":0.9951,
   "deviation_frames":0.41,"speed_error":0.017,"range_mm_s":[100,200],
   "answers_mm_s":[31.1,463.7],"slides":55,"speeds":11,
   "left_out":{"no_speed":0,"no_duration":0,"unreliable":0}}
  speed_error is the root mean square of fractions. It is null if the law
  has no speed for one of the slides.

Output file (-o):
  The table [speed] has law, its parameters and range_mm_s, the speeds
  that the law was fitted on. wstac run marks answers outside this range
  as extrapolated. With --config the table also has threshold and
  threshold_on: durations depend on them, so wstac run needs the same
  values. Without --config they are missing, and a note says so. Replace
  the whole table [speed] of your configuration (wstac.toml) with it.

From a simulated sensor to its law (published protocol, 11 speeds):
  printf '%s\n' 'specimens = ["Saw3"]' 'slides = 55' \
    'speeds = [100,110,120,130,140,150,160,170,180,190,200]' \
    > sweep.toml
  wstac dataset sweep.toml -o slides.npz
  wstac fit-speed slides.npz -o speed.toml --plot residuals.svg
  wstac run scene:Saw3@150 --config speed.toml
"#;

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let outputs = Outputs::new(arguments.force).reading(&arguments.data).reading(&arguments.config);
    outputs.check(arguments.output.iter().chain(&arguments.plot))?;
    let format = arguments.plot.as_deref().map(Format::of).transpose()?;
    let config = arguments.config.as_deref().map(Config::read).transpose()?;
    let mut slides = Slides::default();
    for path in &arguments.data {
        slides.add(path, arguments.fps)?;
    }
    let nominal_frames = f64::from(slides.rate.unwrap_or(FrameRate::NOMINAL).nominal_frames());
    let names: Vec<String> = arguments.data.iter().map(|path| path.display().to_string()).collect();
    let names = names.join(", ");
    let fit = Fit::new(&slides, &names)?;
    if let (Some(path), Some(format)) = (&arguments.plot, format) {
        outputs.write(path, format.encode(&figure(&fit, &slides))?)?;
        note(format_args!("drawn to {}", path.display()));
    }
    if let Some(path) = &arguments.output {
        outputs.write(path, table(&fit, &slides, &names, config.as_ref()))?;
        note(format_args!("law written to {}", path.display()));
        if config.is_none() {
            note(format_args!(
                "{} has no threshold: use it with the threshold that the durations were found with, or give --config",
                path.display()
            ));
        }
    }
    let mut out = super::output::stdout();
    if arguments.json {
        writeln!(out, "{}", as_json(&fit, &slides, nominal_frames))?;
    } else {
        writeln!(out, "{}", in_words(&slides))?;
        write!(out, "{}", text(&fit, nominal_frames))?;
    }
    Ok(out.flush()?)
}

/// Draws the durations, the law and the residuals.
fn figure(fit: &Fit, slides: &Slides) -> String {
    let slides: Vec<_> = slides.used.iter().map(|slide| [slide.speed_mm_s, slide.frames]).collect();
    let fit = SpeedFit {
        name: "published",
        formula: format!("{}, R² {:.4}", fit.words(), fit.line.r2),
        law: |mm_s| fit.frames(mm_s),
    };
    SpeedFits { slides: &slides, fits: &[fit] }.draw()
}

/// Returns the slowest and the fastest speed of the slides.
fn range(slides: &Slides) -> [f64; 2] {
    let speeds = slides.speeds();
    [speeds.first(), speeds.last()].map(|speed| speed.copied().unwrap_or(f64::NAN))
}

fn in_words(slides: &Slides) -> String {
    let ([slowest, fastest], speeds) = (range(slides), slides.speeds().len());
    let mut words =
        vec![format!("{} at {speeds} speeds from {slowest} to {fastest} mm/s", counted(slides.used.len(), "slide"))];
    let reasons = [
        (slides.no_duration, "cut off or never lit"),
        (slides.unreliable, "not reliable"),
        (slides.no_speed, "without a speed"),
    ];
    let there = reasons.into_iter().filter(|(count, _)| *count > 0);
    words.extend(there.map(|(count, reason)| format!("{count} {reason}")));
    words.join("; left out: ")
}

fn text(fit: &Fit, nominal_frames: f64) -> String {
    let line = &fit.line;
    let law = format!("published: {}, R² {:.4}\n", fit.words(), line.r2);
    let parameters = format!(
        "  intercept {:.3} ± {:.3}, slope {:.3} ± {:.3} (standard errors); durations deviate by {:.2} frames\n",
        line.intercept, line.intercept_error, -line.slope, line.slope_error, line.deviation
    );
    let read = match fit.speed_error {
        Some(error) => format!("  speeds that it reads off these durations are off by {:.1} % (rms)\n", 100.0 * error),
        None => "  it has no speed for some of these durations\n".into(),
    };
    let answers = fit.answers(nominal_frames).map_or_else(String::new, |[slowest, fastest]| {
        format!("  it can answer {slowest:.0} to {fastest:.0} mm/s; outside what it was fitted on it is extrapolated\n")
    });
    [law, parameters, read, answers].concat()
}

fn as_json(fit: &Fit, slides: &Slides, nominal_frames: f64) -> serde_json::Value {
    let line = &fit.line;
    json!({
        "kind": "fit",
        "law": "published",
        "intercept": line.intercept,
        "intercept_error": line.intercept_error,
        "slope": -line.slope,
        "slope_error": line.slope_error,
        "r2": line.r2,
        "deviation_frames": line.deviation,
        "speed_error": fit.speed_error,
        "range_mm_s": range(slides),
        "answers_mm_s": fit.answers(nominal_frames),
        "slides": slides.used.len(),
        "speeds": slides.speeds().len(),
        "left_out": {
            "no_speed": slides.no_speed, "no_duration": slides.no_duration, "unreliable": slides.unreliable,
        },
    })
}

/// Returns the table of the configuration, in the 32 bits that the core works with.
fn table(fit: &Fit, slides: &Slides, names: &str, config: Option<&Config>) -> String {
    let [slowest, fastest] = range(slides);
    let line = &fit.line;
    // The range is rounded outwards, so that it holds every speed of the slides.
    let (slowest, fastest) = (below(slowest), -below(-fastest));
    let names = names.replace(|character: char| character.is_control(), " ");
    let table = format!(
        "# wstac fit-speed {names}: {}\n# R² {:.4}, durations deviate by {:.2} frames\n[speed]\nlaw = \"published\"\nintercept = {}\nslope = {}\nrange_mm_s = [{slowest}, {fastest}]\n",
        in_words(slides),
        line.r2,
        line.deviation,
        fit.law.intercept,
        fit.law.slope,
    );
    let threshold = config.map_or_else(String::new, |config| {
        let on = match config.speed.threshold_on {
            ThresholdOn::Absolute => "absolute",
            ThresholdOn::AboveBaseline => "above_baseline",
        };
        format!("threshold = {}\nthreshold_on = \"{on}\"\n", config.speed.threshold)
    });
    table + &threshold
}

/// Returns the highest number of 32 bits that is not above this one.
fn below(number: f64) -> f32 {
    let near = number as f32;
    if f64::from(near) > number { near.next_down() } else { near }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wstac_train::fit::data::Labeled;

    #[test]
    fn what_is_written_is_what_wstac_run_reads() {
        let slide = |n: u32| {
            let speed_mm_s = 80.1 + 13.3 * f64::from(n);
            Labeled { speed_mm_s, frames: 3000.0 / speed_mm_s + 4.2 + 0.1 * f64::from(n % 2) }
        };
        let slides = Slides { used: (0..9).map(slide).collect(), no_duration: 2, ..Slides::default() };
        let with = Config::parse("[speed]\nthreshold = 0.03\nthreshold_on = \"above_baseline\"").unwrap();
        let fit = Fit::new(&slides, "it").unwrap();
        let text = table(&fit, &slides, "a.npz\n[trigger]", Some(&with));
        let config = Config::parse(&text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(config.speed.law(), Some(fit.law), "{text}");
        assert!((config.speed.threshold - 0.03).abs() < 1e-12, "{text}");
        assert_eq!(config.speed.threshold_on, ThresholdOn::AboveBaseline, "{text}");
        let speed = config.durations(FrameRate::NOMINAL).unwrap();
        for (mm_s, extrapolated) in [(80.0, true), (80.1, false), (186.5, false), (186.6, true)] {
            assert_eq!(speed.marked(mm_s).extrapolated, extrapolated, "{mm_s}: {text}");
        }
    }
}
