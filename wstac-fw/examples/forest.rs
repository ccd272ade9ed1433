//! Classifies an event's texture by a random forest.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::include_model;
use wstac_core::model::forest::Forest;
use wstac_core::texture;
use wstac_fw::emulated::bench;

static MODEL: Forest = include_model!(Forest, "../../wstac-host/models/forest.wsm");

#[entry]
fn main() -> ! {
    bench::events(|event| bench::show(texture::texture(&event.sample.flat(), &MODEL).class))
}
