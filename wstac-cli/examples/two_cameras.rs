//! Two sensors at once, a thread each, into one channel.
//!
//!     cargo run --release -p wstac-linux --example two_cameras                            # two simulated sensors
//!     cargo run --release -p wstac-linux --example two_cameras /dev/video0 /dev/video2
//!
//! A source is opened in the thread that reads it and stays there: whatever one camera does, the other goes on. Texture
//! models are only read, so the threads share them.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SendError, Sender, channel};
use std::thread;

use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_host::model_file::ModelFile;
use wstac_host::output::{Output, OutputOptions};
use wstac_host::session::Processor;
use wstac_host::source::FramePolicy;
use wstac_host::source::open::{OpenOptions, open};
use wstac_host::texture::Textures;
use wstac_linux::source::Cameras;
use wstac_scene::source::Scenes;

/// What a sensor's thread says, and which sensor it is.
type Said = (usize, Result<Output, Error>);

fn main() -> Result<(), Error> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let specs = if given.is_empty() {
        ["scene:Saw3@150,90deg", "scene:Tri4@110,180deg"].map(str::to_owned).into()
    } else {
        given
    };
    let models = [ModelFile::open(Path::new("builtin:forest"))?];
    // Set it from wherever your program learns that it is to end: each thread then says how its stream ended.
    let stop = AtomicBool::new(false);
    let (sender, receiver) = channel();
    let mut failed = 0;
    thread::scope(|scope| {
        for (sensor, spec) in specs.iter().enumerate() {
            let (sender, models, stop) = (sender.clone(), &models, &stop);
            scope.spawn(move || {
                if let Err(error) = read(sensor, spec, models, stop, &sender) {
                    // Nobody may listen any more; then nobody misses it.
                    let _ = sender.send((sensor, Err(error)));
                }
            });
        }
        // The threads hold the other ends: the channel closes when the last of them is done.
        drop(sender);
        for (sensor, said) in receiver {
            match said {
                Ok(record) => print(&specs[sensor], &record),
                Err(error) => {
                    failed += 1;
                    eprintln!("{error}");
                }
            }
        }
    });
    if failed == 0 {
        Ok(())
    } else {
        Err(Error::new("two_cameras", format_args!("{failed} of {} sensors failed", specs.len())))
    }
}

/// Reads one sensor to its end, or until `stop`.
///
/// # Errors
/// Where the source cannot be opened, or read any further.
fn read(
    sensor: usize,
    spec: &str,
    models: &[ModelFile],
    stop: &AtomicBool,
    sender: &Sender<Said>,
) -> Result<(), Error> {
    // Answers in time: where this program is the slower one, older frames are skipped and counted as lost.
    let mut source =
        open(spec, &OpenOptions { delivery: FramePolicy::Newest, ..OpenOptions::default() }, &[&Cameras, &Scenes])?;
    let textures = Textures::new(models)?;
    let mut reading =
        Processor::new(source.info(), &Config::default(), OutputOptions::default())?.with_textures(textures);
    let give = |record| sender.send((sensor, Ok(record)));
    let no_listener = |_: SendError<Said>| Error::new(spec, "nobody takes its records");
    while !stop.load(Ordering::Relaxed) {
        // Comes back at least once a second, with SourceEvent::Waiting where there is nothing, so that `stop` is seen. A camera
        // that was unplugged is waited for, which is a Output::Fault and no error.
        let item = match source.next_event() {
            Ok(item) => item,
            Err(error) => {
                reading.finish(give).map_err(no_listener)?;
                return Err(error);
            }
        };
        if !reading.take(&item, give).map_err(no_listener)? {
            return Ok(());
        }
    }
    reading.finish(give).map_err(no_listener)
}

/// A line of what a sensor gives.
fn print(sensor: &str, record: &Output) {
    match record {
        Output::Event(event) => {
            let speed = event.speed.map_or("no speed".to_owned(), |speed| format!("{} mm/s", speed.mm_s));
            let direction = event.direction.deg.map_or("no direction".to_owned(), |deg| format!("{deg}°"));
            let texture =
                event.texture.as_ref().and_then(|texture| texture.specimen.as_deref()).unwrap_or("no texture");
            println!("{sensor}: frame {}: {speed}, {direction}, {texture}", event.frame);
        }
        Output::Fault(fault) => println!("{sensor}: frame {}: {}", fault.frame, fault.message),
        Output::End(end) => println!("{sensor}: end after {} frames, {} dropped", end.frames, end.dropped),
        // Features and early textures come where they are asked for; an incomplete sample has no answers.
        Output::Features { .. } | Output::EarlyTexture(_) | Output::Interrupted(_) => {}
    }
}
