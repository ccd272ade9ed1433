//! Classifies every sample of the file `samples` (700 int16 each) and writes four 32-bit numbers for each to `answers`:
//! the class, the number of repetitions, the ticks of these repetitions with `classify`, and their ticks with an empty
//! function.
#![no_std]
#![no_main]

use core::hint::black_box;

use wstac_fw::emulated::clock::Clock;
use wstac_fw::emulated::host::{File, done, fail};

include!(concat!(env!("OUT_DIR"), "/answer.rs"));

/// The repetitions of a short classification: ten are timed to four instructions.
const REPEATS: u32 = 10;
/// From this many ticks, a single classification is timed well enough: to one part in 2,500.
const LONG: u32 = 2500;

#[inline(never)]
fn classify(sample: &[i16; 700]) -> u8 {
    answer(sample)
}

#[inline(never)]
fn nothing(sample: &[i16; 700]) -> u8 {
    black_box(sample);
    0
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(clock) = Clock::start() else { fail("the clock started twice\n") };
    let samples = File::open(b"samples\0");
    let answers = File::create(b"answers\0");
    let (mut bytes, mut sample) = ([0; 1400], [0; 700]);
    while samples.read(&mut bytes) {
        for (number, bytes) in sample.iter_mut().zip(bytes.as_chunks().0) {
            *number = i16::from_le_bytes(*bytes);
        }
        let mut class = 0;
        let (once, ()) = clock.ticks(|| class = black_box(classify(black_box(&sample))));
        let repeats = if once < LONG { REPEATS } else { 1 };
        let (busy, ()) = clock.ticks(|| (0..repeats).for_each(|_| class = black_box(classify(black_box(&sample)))));
        let (empty, ()) = clock.ticks(|| (0..repeats).for_each(|_| class |= black_box(nothing(black_box(&sample)))));
        let halves = [class.into(), repeats, busy, empty].map(|number: u32| [number as i16, (number >> 16) as i16]);
        answers.write(halves.as_flattened());
    }
    done()
}
