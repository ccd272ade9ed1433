//! Prints the events of a recording, one per line: `cargo run --release -p wstac-host --example events FILE.mcap`.
use std::path::Path;

use wstac_host::source::open::{OpenOptions, open};
use wstac_host::{
    error,
    json::{angle, rounded},
    model_file::ModelFile,
    output::Output,
    session::Session,
};

fn main() -> Result<(), error::Error> {
    let missing = || error::Error::new(error::ErrorKind::Usage, "events", "no argument, expected FILE.mcap");
    let file = std::env::args_os().nth(1).ok_or_else(missing)?;
    let source = open(&file, &OpenOptions::default(), &[])?;
    // Without another configuration, the recording's own holds.
    for output in Session::builder(source).models([ModelFile::open(Path::new("builtin"))?]).build()? {
        let Output::Event(event) = output? else { continue };
        let speed = event.speed.map_or("-".to_owned(), |speed| format!("{:.2}", rounded(speed.mm_s)));
        let direction = event.direction.degrees.map_or("-".to_owned(), |degrees| format!("{:.1}", angle(degrees)));
        let texture = event.texture.ok().and_then(|texture| texture.specimen).unwrap_or("-".to_owned());
        println!("frame={} speed={speed} direction={direction} texture={texture}", event.frame);
    }
    Ok(())
}
