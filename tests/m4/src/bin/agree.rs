//! Answers of models and samples by chance, of every kind and at the limits, are those of a host: the number that
//! `tests/random_models` says, which a test of the core compares to the plain way.
#![no_std]
#![no_main]

use wstac_core::model::Model;
use wstac_core::model::file::crc;
use wstac_m4::{done, fail};
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
