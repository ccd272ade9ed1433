//! Prints the events of a recording, one per line: `cargo run --release -p wstac-host --example events FILE.mcap`.
use std::path::Path;

use wstac_host::source::{config_of, open};
use wstac_host::{error, json, model_file::ModelFile, output::Output, session::Session};

fn main() -> Result<(), error::Error> {
    let missing = || error::Error::new(error::ErrorKind::Usage, "events", "no argument, expected FILE.mcap");
    let file = std::env::args_os().nth(1).ok_or_else(missing)?;
    let source = open::open(&file, &open::OpenOptions::default(), &[])?;
    // Without another configuration, the recording's own holds.
    config_of(source.info(), None)?.notes(source.info()).for_each(|note| eprintln!("{note}"));
    for output in Session::builder(source).models([ModelFile::open(Path::new("builtin"))?]).build()? {
        let Output::Event(event) = output? else { continue };
        let sd = |sd: Option<f64>| sd.map_or(String::new(), |sd| format!("±{:.2}", sd.max(0.01)));
        let speed = event.speed.ok().filter(|_| event.reliable).map_or("-".to_owned(), |speed| {
            format!("{:.2}{}", json::rounded(speed.mm_s), sd(speed.sd.map(json::rounded)))
        });
        let direction = event.direction.degrees.ok().filter(|_| event.reliable).map_or("-".to_owned(), |degrees| {
            format!("{:.1}{}", json::angle(degrees), sd(event.direction.sd.map(json::spread)))
        });
        let texture = event.texture.ok().and_then(|texture| texture.specimen).unwrap_or("-".to_owned());
        println!("frame={} speed={speed} direction={direction} texture={texture}", event.frame);
    }
    Ok(())
}
