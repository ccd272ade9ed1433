//! Follows the motion of whatever slides, frame by frame.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::error::Error;
use wstac_core::touch::motion::LiveMotion;
use wstac_fw::emulated::{bench, host};
use wstac_fw::setup;

#[entry]
fn main() -> ! {
    match run() {
        Ok(()) => host::done(),
        Err(_) => host::fail(bench::DOES_NOT_FIT),
    }
}

fn run() -> Result<(), Error> {
    let mut pipeline = setup::checked(bench::camera()?)?.build();
    let mut live = LiveMotion::new(bench::MOTION);
    loop {
        pipeline.push_stripe(bench::stripe())?;
        let (next_frame, recent) = pipeline.recent();
        if let Some(baseline) = pipeline.baseline() {
            bench::show(live.push(next_frame, recent, baseline));
        }
    }
}
