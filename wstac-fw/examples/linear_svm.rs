//! Classifies an event's texture by a linear SVM.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use wstac_core::include_model;
use wstac_core::model::linear_svm::LinearSvm;
use wstac_core::texture;
use wstac_fw::emulated::bench;

static MODEL: LinearSvm = include_model!(LinearSvm, "../../wstac-host/models/svm.wsm");

#[entry]
fn main() -> ! {
    bench::events(|event| bench::show(texture::texture(&event.sample.flat(), &MODEL).class))
}
