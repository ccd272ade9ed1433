//! Checks that random models and samples of every kind, extremes included, get the same answers as on a host. All
//! answers together are one number in `tests/random_models`, which a unit test of the core compares with a plain
//! implementation.
#![no_std]
#![no_main]

use wstac_core::model::Model;
use wstac_core::model::file::crc;
use wstac_fw::emulated::host::{done, fail};
use wstac_random_models::{ANSWERS, MOST_WORDS, Maker, answers};

#[cortex_m_rt::entry]
fn main() -> ! {
    let (mut maker, mut words) = (Maker::new(crc), [0; MOST_WORDS]);
    let all = answers(&mut maker, &mut words, |words, samples| {
        let model = Model::from_words(words).ok()?;
        Some(samples.each_ref().map(|sample| model.classify(sample)))
    });
    match all {
        Some(ANSWERS) => done(),
        Some(_) => fail("the board answers otherwise than the host\n"),
        None => fail("the board refuses a model\n"),
    }
}
