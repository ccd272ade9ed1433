//! Stops a machine when something slips over the sensor faster than a limit.
//!
//!     cargo run -p wstac-cli --example slip_stop SOURCE MM_S
use std::ffi::OsString;

use wstac_host::error::{Error, ErrorKind};
use wstac_host::json::angle;
use wstac_host::output::{Output, OutputOptions};
use wstac_host::session::Session;
use wstac_host::source::open::{OpenOptions, open};
use wstac_linux::source::Cameras;
use wstac_scene::source::Scenes;

/// Put the call that stops your machine here.
fn stop() {
    println!("  stop");
}

/// Put the call that starts it again here.
fn start() {
    println!("  start");
}

fn main() -> Result<(), Error> {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let (spec, limit) = match arguments.as_slice() {
        [spec, limit] => {
            (spec, limit.to_str().and_then(|limit| limit.parse::<f32>().ok()).filter(|limit| limit.is_finite()))
        }
        _ => return Err(Error::new(ErrorKind::Usage, "slip_stop", "wrong arguments, expected SOURCE MM_S")),
    };
    let limit = limit.ok_or_else(|| Error::new(ErrorKind::Usage, "MM_S", "not a number, expected a speed in mm/s"))?;
    let source = open(spec, &OpenOptions::default(), &[&Cameras, &Scenes])?;
    let outputs = OutputOptions { motion: true, ..OutputOptions::default() };
    let mut stopped = false;
    for output in Session::builder(source).outputs(outputs).build()? {
        match output? {
            // This comes with every frame while something slides. Two standard deviations make the decision safe.
            Output::Motion(motion) => {
                let slip = motion.velocity;
                if !stopped && slip.mm_s - 2.0 * slip.mm_s_sd > limit {
                    let direction = angle(slip.degrees);
                    println!("frame {}: slip at {:.0} mm/s towards {direction:.1}°", motion.frame, slip.mm_s);
                    stop();
                    stopped = true;
                }
            }
            // The light has left: nothing touches the sensor any more.
            Output::ContactEnd(end) if stopped => {
                println!("frame {}: released", end.frame);
                start();
                stopped = false;
            }
            Output::Fault(report) => eprintln!("frame {}: {}", report.frame, report.fault),
            _ => {}
        }
    }
    Ok(())
}
