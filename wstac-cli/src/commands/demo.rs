//! `wstac demo` compares simulated slides with the answers to them.

use std::io::Write;
use std::path::PathBuf;

use wstac_core::model::file::Task;

use super::output::Stop;
use super::values::at_least;
use wstac_host::error::Error;
use wstac_host::json::{angle, angle_with_deviation, rounded, with_deviation};
use wstac_host::model_file::ModelFile;
use wstac_host::output::{Output, TactileEvent};
use wstac_host::plural::counted;
use wstac_host::session::Session;
use wstac_host::statistics::mean;
use wstac_host::texture::{Texture, Textures};
use wstac_host::visible::OneLine;
use wstac_scene::SceneConfig;
use wstac_scene::source::SceneSource;

/// Compare simulated slides of many objects with the answers
///
/// The frames (1280 × 720) are rendered and processed like a camera's. The command needs no camera and no sensor.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Seed of the simulation
    ///
    /// Another seed starts every slide at another phase and with other noise.
    #[arg(long, default_value_t = 1, value_parser = at_least(0_u64))]
    seed: u64,

    /// Texture model
    #[arg(long, value_name = "FILE.wsm", default_value = "builtin")]
    model: PathBuf,
}

/// The slides: every specimen, at a length in mm, a speed in mm/s and a direction in degrees.
const SLIDES: [(&str, u32, u32, u32); 12] = [
    ("Fla0", 105, 100, 0),
    ("Sin2", 105, 150, 90),
    ("Sin3", 60, 120, 30),
    ("Sin4", 160, 180, 200),
    ("Saw2", 80, 140, 315),
    ("Saw3", 105, 60, 90),
    ("Saw4", 40, 75, 135),
    ("Tri2", 120, 300, 270),
    ("Tri3", 105, 200, 12),
    ("Tri4", 90, 250, 240),
    ("Saw3", 60, 400, 180),
    ("Sin4", 105, 40, 45),
];

/// Slides of other objects: what it is, its keys in a scene's file, its speed in mm/s and its direction in degrees.
const OBJECTS: [(&str, &str, u32, u32); 4] = [
    ("rod of 6 mm", "shape = \"rod\"\ndiameter = 6", 120, 20),
    ("ball of 12 mm", "shape = \"ball\"\ndiameter = 12", 80, 250),
    ("corner of a box", "shape = \"corner\"\nlength = 60", 150, 100),
    ("Sin3, rolling shutter", "specimen = \"Sin3\"\n[sensor]\nreadout_ms = 30", 100, 60),
];

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let files = [ModelFile::open(&arguments.model)?];
    let (textures, task) = (Textures::new(&files)?, files[0].model()?.task());
    let title = if task == Task::Other { "class" } else { task.name() };
    let mut out = super::output::stdout();
    writeln!(out, "truth                                    answer")?;
    writeln!(out, "specimen    length    mm/s  direction    {title:8}          mm/s     direction")?;
    let (mut errors, mut turns, mut named, mut unknown) = (Vec::new(), Vec::new(), 0, 0);
    let specimens = SLIDES.map(|(name, length, speed, direction)| {
        let keys = format!("specimen = \"{name}\"\nlength = {length}");
        (format!("{name:8}    {length:3} mm"), Some(name), keys, speed, direction)
    });
    let objects =
        OBJECTS.map(|(what, keys, speed, direction)| (what.to_owned(), None, keys.to_owned(), speed, direction));
    for (number, (what, specimen, keys, speed, direction)) in (0..).zip(specimens.into_iter().chain(objects)) {
        if number == SLIDES.len() as u64 {
            writeln!(out, "object                mm/s  direction                      mm/s     direction")?;
        }
        let mut script = SceneConfig::from_toml(&what, &format!("speed = {speed}\ndirection = {direction}\n{keys}"))?;
        script.seed = arguments.seed.wrapping_add(number);
        let event = slide(&script, &textures)?;
        write!(out, "{what:21}{speed:5}  {direction:8}°")?;
        let Some(event) = event else {
            writeln!(out, "  no event")?;
            continue;
        };
        let mut shown = String::new();
        if let Some(specimen) = specimen {
            let is_unknown = event.texture.as_ref().is_ok_and(|texture| texture.known == Some(false));
            unknown += usize::from(is_unknown);
            let without = if is_unknown { "unknown" } else { "none" };
            let texture = event.texture.ok().and_then(|texture| told(task, texture));
            let truth = told(task, Texture::of(Task::Specimen, specimen.to_owned()));
            named += usize::from(texture.is_some() && texture == truth);
            shown = texture.unwrap_or(without.to_owned());
        }
        write!(out, "    {:8}", OneLine(&shown))?;
        match event.speed {
            Ok(answer) => {
                let mm_s = rounded(answer.mm_s);
                errors.push((mm_s - f64::from(speed)).abs() / f64::from(speed));
                write!(out, "  {:>12}", with_deviation(mm_s, answer.sd.unwrap_or(f32::NAN)))?;
            }
            Err(_) => write!(out, "  {:>12}", "none")?,
        }
        match event.direction.degrees {
            Ok(degrees) => {
                let off = (angle(degrees) - f64::from(direction) + 180.0).rem_euclid(360.0) - 180.0;
                turns.push(off.abs());
                let sd = event.direction.sd.unwrap_or(f32::NAN);
                write!(out, "  {:>12}°", angle_with_deviation(degrees, sd))?;
            }
            Err(_) => write!(out, "  {:>13}", "none")?,
        }
        writeln!(out)?;
        out.flush()?;
    }
    let all = SLIDES.len();
    let (speeds, directions) = (counted(errors.len(), "speed"), counted(turns.len(), "direction"));
    let (error, turn) = (100.0 * mean(errors).unwrap_or(0.0), mean(turns).unwrap_or(0.0));
    write!(out, "{speeds}, off by {error:.1} % on average; {directions}, off by {turn:.1}° on average; ")?;
    match task {
        Task::Other => writeln!(out, "the truth of the model's classes is not known")?,
        _ => writeln!(out, "{named} of {all} {title}s right, {unknown} unknown")?,
    }
    Ok(())
}

/// Returns what a model of this task says of a texture.
fn told(task: Task, texture: Texture) -> Option<String> {
    match task {
        Task::Specimen => texture.specimen,
        Task::Pattern => texture.pattern,
        Task::Depth => texture.depth_mm.map(|depth| format!("{depth} mm")),
        _ => texture.class,
    }
}

/// Returns the first event of a scene.
fn slide(script: &SceneConfig, textures: &Textures) -> Result<Option<TactileEvent>, Error> {
    let session = Session::builder(SceneSource::new(script)?).textures(textures.clone()).build()?;
    let mut first = None;
    for output in session {
        if let Output::Event(event) = output? {
            first.get_or_insert(*event);
        }
    }
    Ok(first)
}
