//! An event's texture, by a random forest.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::error::Error;
use wstac_core::include_model;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::model::forest::Forest;
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::taxels::FrameGeometry;
use wstac_core::texture;
use wstac_fw::emulated::{bench, host};
use wstac_fw::setup;

const LAYOUT: Layout = match FrameSize::new(400, 400) {
    Ok(size) => match setup::layout(size) {
        Ok(layout) => layout,
        Err(_) => panic!("the configuration does not fit frames of 400 x 400"),
    },
    Err(_) => panic!("400 x 400 is a size of frames"),
};

static MODEL: Forest = include_model!(Forest, "../../wstac-host/models/forest.wsm");

#[entry]
fn main() -> ! {
    match run() {
        Ok(()) => host::done(),
        Err(_) => host::fail("the configuration does not fit the camera\n"),
    }
}

fn run() -> Result<(), Error> {
    let camera = FrameGeometry::with_stride(setup::GREEN, LAYOUT, FrameRate::NOMINAL, setup::STRIDE)?;
    let mut pipeline =
        Pipeline::<_, setup::Ln, _>::with_following(camera, setup::FLOOR, setup::TRIGGER, setup::FOLLOWING)?;
    loop {
        if let Some(event) = pipeline.push_stripe(bench::stripe())? {
            bench::show(texture::texture(&event.sample.flat(), &MODEL).class);
        }
    }
}
