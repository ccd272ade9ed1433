//! Writes a data set of random slides with their samples along the path: `path_slides OUT.npz SLIDES SEED SENSOR`.
//!
//! Slides have any direction, 50 to 300 mm/s and 60 to 120 mm. Their sensors are those from number SENSOR on. Textures
//! are the ten of the paper. A fifth argument chooses others: `unknown`, `random` (a thousand by SEED), `ten` (ten of
//! them) or `new`. A sixth is the number of sensors, 1000 without it.

use std::fs::File;
use std::io::{self, BufWriter};

use wstac_core::model::file::INPUTS;
use wstac_scene::specimen::Specimen;
use wstac_tests::textures;
use wstac_train::dataset::arrays::name;
use wstac_train::dataset::npz::{Npz, SCALE};
use wstac_train::dataset::path::{PathSlide, RandomSlides};
use wstac_train::model::trained::in_set_order;

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

/// Writes slides as a data set: `X`, `X_path` and `X_taxel_path` hold their samples, zeros if there is none.
fn write(file: BufWriter<File>, slides: &[PathSlide]) -> io::Result<()> {
    let mut npz = Npz::new(file);
    let zeros = [0; INPUTS];
    npz.samples("X", slides.iter().map(|slide| in_set_order(&slide.frames)))?;
    let paths = slides.iter().map(|slide| in_set_order(slide.path.as_ref().map_or(&zeros, |path| path.numbers())));
    npz.samples("X_path", paths)?;
    let paths =
        slides.iter().map(|slide| in_set_order(slide.taxel_path.as_ref().map_or(&zeros, |path| path.numbers())));
    npz.samples("X_taxel_path", paths)?;
    npz.number("scale", SCALE)?;
    npz.strings("y_specimen", slides.iter().map(|slide| name(&slide.slide.specimen)))?;
    let mut column = |name: &str, of: &dyn Fn(&PathSlide) -> f64| npz.numbers(name, slides.iter().map(of));
    column("speed", &|slide| slide.slide.speed_mm_s)?;
    column("direction", &|slide| slide.slide.direction_deg)?;
    column("length", &|slide| slide.slide.specimen.length_mm)?;
    column("period", &|slide| slide.slide.specimen.period_mm)?;
    column("depth", &|slide| slide.slide.specimen.depth_mm)?;
    column("sensor", &|slide| f64::from(slide.sensor))?;
    column("measured_speed", &|slide| slide.measured.map_or(f64::NAN, |[mm_s, _]| mm_s.into()))?;
    column("measured_direction", &|slide| slide.measured.map_or(f64::NAN, |[_, degrees]| degrees.into()))?;
    npz.numbers("reliable", slides.iter().map(|slide| slide.reliable))?;
    npz.finish().map(drop)
}
