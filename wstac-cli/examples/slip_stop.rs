//! Stops a machine when a part that is held begins to slip.
//!
//!     cargo run -p wstac-cli --example slip_stop SOURCE
use wstac_host::error::{Error, ErrorKind};
use wstac_host::output::Output;
use wstac_host::session::Session;
use wstac_host::source::open::{OpenOptions, open};
use wstac_linux::source::Cameras;
use wstac_scene::source::Scenes;

/// Put the call that stops your machine here.
fn stop() {
    println!("  stop");
}

fn main() -> Result<(), Error> {
    let spec = std::env::args_os().nth(1);
    let spec = spec.ok_or_else(|| Error::new(ErrorKind::Usage, "slip_stop", "wrong arguments, expected SOURCE"))?;
    let source = open(&spec, &OpenOptions::default(), &[&Cameras, &Scenes])?;
    for output in Session::builder(source).build()? {
        match output? {
            // A part was pressed on and held, and moves now.
            Output::Slip(slip) => {
                println!("frame {}: slip since frame {}", slip.frame, slip.onset_frame);
                stop();
            }
            Output::Fault(report) => eprintln!("frame {}: {}", report.frame, report.fault),
            _ => {}
        }
    }
    Ok(())
}
