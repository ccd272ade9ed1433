//! The events of a recording, a line each: `cargo run --release -p wstac-linux --example events FILE.mcap`.
use std::path::Path;

use wstac_host::output::{Output, OutputOptions};
use wstac_host::session::{Processor, run};
use wstac_host::source::config_of;
use wstac_host::source::open::{OpenOptions, open};
use wstac_host::{error::Error, model_file::ModelFile, texture::Textures};

fn main() -> Result<(), Error> {
    let file = std::env::args().nth(1).ok_or_else(|| Error::new("events", "no argument, expected FILE.mcap"))?;
    let mut source = open(&file, &OpenOptions::default(), &[])?;
    // A recording holds the configuration that it was made with.
    let config = config_of(source.as_ref(), None)?;
    let models = [ModelFile::open(Path::new("builtin:svm"))?];
    let mut reading =
        Processor::new(source.info(), &config, OutputOptions::default())?.with_textures(Textures::new(&models)?);
    run(source.as_mut(), &mut reading, |record| {
        let Output::Event(event) = record else { return Ok(()) };
        let speed = event.speed.map_or("-".to_owned(), |speed| format!("{:.2}", speed.mm_s));
        let direction = event.direction.deg.map_or("-".to_owned(), |deg| format!("{:.1}", f64::from(deg)));
        let texture = event.texture.and_then(|texture| texture.specimen).unwrap_or("-".to_owned());
        println!("frame={} speed={speed} direction={direction} texture={texture}", event.frame);
        Ok(())
    })
}
