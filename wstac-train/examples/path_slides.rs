//! Writes a data set of random slides with their samples along the path: `path_slides OUT.npz SLIDES SEED SENSOR`.
//!
//! Slides have any direction, 50 to 300 mm/s and 60 to 120 mm. Their sensors are those from number SENSOR on. Textures
//! are the ten of the paper. A fifth argument chooses others: `unknown`, `random` (a thousand by SEED), `ten` (ten of
//! them) or `new`. A sixth is the number of sensors, 1000 without it.

use std::fs::File;
use std::io::BufWriter;

use wstac_scene::specimen::Specimen;
use wstac_train::dataset::path::{RandomSlides, write};
use wstac_train::dataset::textures;

/// The number of random textures.
const RANDOM: usize = 1000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (out, numbers, textures) = match arguments.as_slice() {
        [out, slides, seed, sensor] => (out, [slides, seed, sensor], "paper"),
        [out, slides, seed, sensor, textures] | [out, slides, seed, sensor, textures, _] => {
            (out, [slides, seed, sensor], textures.as_str())
        }
        _ => return Err("expected OUT.npz SLIDES SEED SENSOR [paper|unknown|random|ten|new [SENSORS]]".into()),
    };
    let sensors = arguments.get(5).map_or(Ok(1000), |number| number.parse::<u32>())?;
    let [slides, seed, sensor] = numbers.map(|number| number.parse::<u32>());
    let (slides, seed, sensor) = (slides?, seed?.into(), sensor?);
    let specimens = match textures {
        "paper" => Specimen::ALL.to_vec(),
        "unknown" => textures::unknown().into_iter().map(|(_, specimen)| specimen).collect(),
        "random" => textures::random(seed, RANDOM),
        "ten" => textures::random(seed, 10),
        "new" => textures::NEW.to_vec(),
        other => return Err(format!("textures {other}, expected paper, unknown, random, ten or new").into()),
    };
    let wanted = RandomSlides { specimens, slides, seed, sensors: [sensor, sensors], ..RandomSlides::default() };
    write(BufWriter::new(File::create(out)?), &wanted.all()?)?;
    Ok(())
}
