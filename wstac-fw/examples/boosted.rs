//! Classifies an event's texture by boosted trees.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::include_model;
use wstac_core::model::boosted::Boosted;
use wstac_core::texture;
use wstac_fw::emulated::bench;

static MODEL: Boosted = include_model!(Boosted, "../../wstac-host/models/boosted.wsm");

#[entry]
fn main() -> ! {
    bench::events(|event| bench::show(texture::texture(&event.sample.flat(), &MODEL).class))
}
