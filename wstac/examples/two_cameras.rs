//! Reads two sensors at once, each in its own thread, and prints their events.
//!
//!     cargo run --release -p wstac --example two_cameras      # two simulated sensors
//!     cargo run --release -p wstac --features camera --example two_cameras /dev/video0 /dev/video2
//!
//! Each thread opens its own source, so trouble with one camera does not stop the other. The threads share the texture
//! models, which are only read.

use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use wstac::error::{Error, ErrorKind};
use wstac::json::{angle, rounded};
use wstac::model_file::ModelFile;
use wstac::output::Output;
use wstac::session::{Poll, Session};
use wstac::source::FramePolicy;
use wstac::source::open::OpenOptions;

fn main() -> Result<(), Error> {
    let given: Vec<OsString> = std::env::args_os().skip(1).collect();
    let specs = if given.is_empty() {
        ["scene:Saw3@150,90deg", "scene:Tri4@110,180deg"].map(OsString::from).into()
    } else {
        given
    };
    let models = [ModelFile::open(Path::new("builtin"))?];
    // Set this to end the threads. Each of them then prints how its stream ended.
    let stop = AtomicBool::new(false);
    let failed = AtomicUsize::new(0);
    thread::scope(|scope| {
        for spec in &specs {
            scope.spawn(|| {
                if let Err(error) = read(spec, &models, &stop) {
                    failed.fetch_add(1, Ordering::Relaxed);
                    eprintln!("{error}");
                }
            });
        }
    });
    match failed.into_inner() {
        0 => Ok(()),
        failed => {
            let message = format_args!("{failed} of {} sensors failed", specs.len());
            Err(Error::new(ErrorKind::Data, "two_cameras", message))
        }
    }
}

/// Reads one sensor to its end, or until `stop`, and prints its outputs.
///
/// # Errors
/// Returns an error if the source cannot be opened or read any further.
fn read(spec: &OsStr, models: &[ModelFile], stop: &AtomicBool) -> Result<(), Error> {
    // If this program is slower than the camera, older frames are skipped and counted as lost.
    let options = OpenOptions { delivery: FramePolicy::Newest, ..OpenOptions::default() };
    let source = wstac::open_source(spec, &options)?;
    let mut session = Session::builder(source).models(models.to_vec()).build()?;
    // `poll` returns at least once per second, so that the loop checks `stop`. A camera that was unplugged is an
    // `Output::Fault` and not an error: the session waits for it.
    while !stop.load(Ordering::Relaxed) {
        match session.poll()? {
            Poll::Output(output) => print(spec, &output),
            Poll::Waiting => {}
            Poll::Over => return Ok(()),
        }
    }
    Ok(())
}

/// Prints an output of a sensor.
fn print(sensor: &OsStr, output: &Output) {
    let sensor = sensor.display();
    match output {
        Output::Event(event) => {
            let speed = event.speed.map_or("no speed".to_owned(), |speed| format!("{} mm/s", rounded(speed.mm_s)));
            let degrees = event.direction.degrees;
            let direction = degrees.map_or("no direction".to_owned(), |degrees| format!("{}°", angle(degrees)));
            let texture =
                event.texture.as_ref().ok().and_then(|texture| texture.specimen.as_deref()).unwrap_or("no texture");
            println!("{sensor}: frame {}: {speed}, {direction}, {texture}", event.frame);
        }
        Output::Fault(report) => println!("{sensor}: frame {}: {}", report.frame, report.fault),
        Output::End(end) => println!("{sensor}: end after {} frames, {} dropped", end.frames, end.dropped),
        _ => {}
    }
}
