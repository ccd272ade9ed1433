//! Answers of models and samples by chance, of every kind and at the limits, are those of a host: the number that
//! `tests/src/random_models.rs` says, which a test of the core compares to the plain way.
#![no_std]
#![no_main]

use wstac_m4::{done, fail};

#[allow(dead_code)]
#[path = "../../../src/random_models.rs"]
mod random_models;

use random_models::{ANSWERS, MOST_WORDS, Maker, answers};

#[cortex_m_rt::entry]
fn main() -> ! {
    let (mut maker, mut words) = (Maker::new(), [0; MOST_WORDS]);
    match answers(&mut maker, &mut words, |_, _, _| ()) {
        Some(ANSWERS) => done(),
        Some(_) => fail("the board answers otherwise than the host\n"),
        None => fail("the board refuses a model\n"),
    }
}
