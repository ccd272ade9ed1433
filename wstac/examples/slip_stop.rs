//! Stops a machine when a part that is held begins to slip.
//!
//!     cargo run -p wstac --example slip_stop SOURCE                              # a file or a scene
//!     cargo run -p wstac --features camera --example slip_stop /dev/video0
use wstac::error::{Error, ErrorKind};
use wstac::output::Output;

/// Put the call that stops your machine here.
fn stop() {
    println!("  stop");
}

fn main() -> Result<(), Error> {
    let spec = std::env::args_os().nth(1);
    let spec = spec.ok_or_else(|| Error::new(ErrorKind::Usage, "slip_stop", "wrong arguments, expected SOURCE"))?;
    for output in wstac::open(&spec)? {
        match output? {
            // A part was pressed on and held, and moves now.
            Output::Slip(slip) => {
                let (frame, onset) = (slip.frame, slip.onset_frame);
                println!("frame {frame}: slip since frame {onset}, {} frames ago", frame - onset);
                stop();
            }
            Output::Fault(report) => eprintln!("frame {}: {}", report.frame, report.fault),
            _ => {}
        }
    }
    Ok(())
}
