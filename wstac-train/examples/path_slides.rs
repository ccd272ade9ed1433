//! Writes a data set of random slides with their samples along the path: `path_slides OUT.npz SLIDES SEED SENSOR`.
//!
//! Slides have any direction, 50 to 300 mm/s and 60 to 120 mm. Their sensors are those from number SENSOR on.
//! A fifth argument `unknown` gives textures whose depth or period is outside the trained ones.

use std::fs::File;
use std::io::BufWriter;

use wstac_scene::specimen::Specimen;
use wstac_train::dataset::path::{RandomSlides, write};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (out, numbers, unknown) = match arguments.as_slice() {
        [out, slides, seed, sensor] => (out, [slides, seed, sensor], false),
        [out, slides, seed, sensor, kind] if kind == "unknown" => (out, [slides, seed, sensor], true),
        _ => return Err("expected OUT.npz SLIDES SEED SENSOR [unknown]".into()),
    };
    let [slides, seed, sensor] = numbers.map(|number| number.parse::<u32>());
    let (slides, seed, sensor) = (slides?, seed?.into(), sensor?);
    let mut wanted = RandomSlides { slides, seed, sensors: [sensor, 1000], ..RandomSlides::default() };
    if unknown {
        wanted.specimens = unknown_specimens();
    }
    write(BufWriter::new(File::create(out)?), &wanted.all()?)?;
    Ok(())
}

/// Returns textures whose depth or period is at least 1.5 times below or above the trained ones: depths of 2 to 4 mm and
/// periods of 4 to 8 mm.
fn unknown_specimens() -> Vec<Specimen> {
    let textured = &Specimen::ALL[1..];
    let changed = [(2.0 / 1.5, 1.0), (1.0, 1.0), (0.0, 12.0), (0.0, 16.0), (0.0, 4.0 / 1.5), (0.0, 2.0)];
    let of = |specimen: &Specimen| {
        let specimen = *specimen;
        changed.map(|(depth_mm, period_mm)| {
            if depth_mm > 0.0 {
                // The shallower depth with the specimen's own period, and with the usual one.
                let period_mm = if depth_mm > 1.0 { specimen.period_mm } else { 2.0 * depth_mm * period_mm };
                Specimen { depth_mm, period_mm, ..specimen }
            } else {
                Specimen { period_mm, ..specimen }
            }
        })
    };
    textured.iter().flat_map(of).collect()
}
