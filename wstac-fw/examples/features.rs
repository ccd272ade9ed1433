//! Computes only features: a stripe of rows in, ten features per frame out. A program without events needs no pipeline.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::error::Error;
use wstac_core::stream::FeatureStream;
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
    let mut stream = FeatureStream::<setup::GreenChannel, setup::Ln>::with_floor(bench::camera()?, setup::FLOOR)?;
    loop {
        if let Some(frame) = stream.push_stripe(bench::stripe())? {
            bench::show(frame.features);
        }
    }
}
