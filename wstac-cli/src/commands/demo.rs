//! `wstac demo` compares simulated slides with the answers to them.

use std::io::Write;
use std::path::PathBuf;

use wstac_core::model::file::Task;

use super::output::Stop;
use super::source_arguments::at_least;
use crate::open;
use wstac_host::error::Error;
use wstac_host::json::{confidence, rounded};
use wstac_host::model_file::ModelFile;
use wstac_host::output::{Output, TactileEvent};
use wstac_host::plural::counted;
use wstac_host::session::Session;
use wstac_host::source::open::OpenOptions;
use wstac_host::texture::{Texture, Textures, pattern_and_depth};
use wstac_host::visible::Line;

/// Compare simulated slides of every specimen with the answers
///
/// The frames (1280 × 720) are rendered and processed like a camera's. The command needs no camera and no sensor.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Seed of the simulation
    ///
    /// Another seed starts every slide at another phase and with other noise.
    #[arg(long, default_value_t = 1, value_parser = at_least(0_u64))]
    seed: u64,

    /// Name textures with this model
    #[arg(long, value_name = "FILE.wsm", default_value = "builtin:svm")]
    model: PathBuf,
}

/// The slides: every specimen, all four directions, and the range of speeds that the speed law was fitted on.
const SLIDES: [(&str, u32, u32); 12] = [
    ("Fla0", 100, 0),
    ("Sin2", 110, 90),
    ("Sin3", 120, 180),
    ("Sin4", 130, 270),
    ("Saw2", 140, 0),
    ("Saw3", 150, 90),
    ("Saw4", 160, 180),
    ("Tri2", 170, 270),
    ("Tri3", 180, 0),
    ("Tri4", 190, 90),
    ("Saw3", 200, 180),
    ("Saw3", 100, 270),
];

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let files = [ModelFile::open(&arguments.model)?];
    let (textures, task) = (Textures::new(&files)?, files[0].model()?.task());
    let title = if task == Task::Other { "class" } else { task.name() };
    let mut out = super::output::stdout();
    writeln!(out, "truth                          answer")?;
    writeln!(out, "specimen    mm/s  direction    {title:8}    mm/s  direction  confidence")?;
    let (mut errors, mut right, mut named) = (Vec::new(), 0, 0);
    for (number, (specimen, speed, direction)) in (0..).zip(SLIDES) {
        let seed = arguments.seed.wrapping_add(number);
        let event = slide(&format!("scene:{specimen}@{speed},{direction}deg,seed={seed}"), &textures)?;
        write!(out, "{specimen:8}   {speed:5}  {direction:8}°")?;
        let Some(event) = event else {
            writeln!(out, "  no event")?;
            continue;
        };
        let texture = event.texture.and_then(|texture| told(task, texture));
        named += usize::from(texture.is_some() && texture == truth(task, specimen));
        write!(out, "    {:8}", Line(texture.as_deref().unwrap_or("none")))?;
        match event.speed {
            Ok(answer) => {
                let mm_s = rounded(answer.mm_s);
                errors.push((mm_s - f64::from(speed)).abs() / f64::from(speed));
                write!(out, "  {mm_s:6.0}")?;
            }
            Err(_) => write!(out, "  {:>6}", "none")?,
        }
        right += usize::from(event.direction.heading.is_ok_and(|heading| u32::from(heading.degrees()) == direction));
        match event.direction.heading {
            Ok(heading) => write!(out, "  {:8}°", heading.degrees())?,
            Err(_) => write!(out, "  {:>9}", "unclear")?,
        }
        writeln!(out, "  {:10.2}", confidence(event.direction))?;
        out.flush()?;
    }
    let mean = 100.0 * errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    let all = SLIDES.len();
    write!(
        out,
        "{right} of {all} directions right; {}, off by {mean:.1} % on average; ",
        counted(errors.len(), "speed")
    )?;
    match task {
        Task::Other => writeln!(out, "the truth of the model's classes is not known")?,
        _ => writeln!(out, "{named} of {all} {title}s right")?,
    }
    Ok(())
}

/// Returns the answer of a model of this task.
fn told(task: Task, texture: Texture) -> Option<String> {
    match task {
        Task::Specimen => texture.specimen,
        Task::Pattern => texture.pattern,
        Task::Depth => texture.depth_mm.map(in_mm),
        _ => texture.class,
    }
}

/// Returns the correct answer for a specimen, if it is known.
fn truth(task: Task, specimen: &str) -> Option<String> {
    let (pattern, depth) = pattern_and_depth(specimen);
    match task {
        Task::Specimen => Some(specimen.to_owned()),
        Task::Pattern => pattern,
        Task::Depth => depth.map(in_mm),
        _ => None,
    }
}

fn in_mm(depth: f64) -> String {
    format!("{depth} mm")
}

/// Returns the first event of a scene.
fn slide(source: &str, textures: &Textures) -> Result<Option<TactileEvent>, Error> {
    let session = Session::builder(open(source, &OpenOptions::default())?).textures(textures.clone()).build()?;
    let mut first = None;
    for output in session {
        if let Output::Event(event) = output? {
            first.get_or_insert(*event);
        }
    }
    Ok(first)
}
