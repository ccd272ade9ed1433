//! Reads any words as a model file. Magic number, length and checksum are corrected, so that the code behind them is
//! reached. The file is refused, or the model soon answers every sample with one of its classes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wstac_core::model::Model;
use wstac_core::model::file::{INPUTS, MAGIC, crc};

fuzz_target!(|data: &[u8]| {
    let mut words: Vec<u32> = data.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
    // Tries the words unchanged. They are almost always damaged.
    let _ = Model::from_words(&words);
    if words.len() < 4 {
        return;
    }
    words[0] = u32::from(MAGIC[0]) | u32::from(MAGIC[1]) << 16;
    words[2] = words.len() as u32;
    words[1] = crc(&words);
    let Ok(model) = Model::from_words(&words) else { return };
    let classes = model.labels().len();
    for class in 0..classes {
        assert!(model.labels().get(class).expect("a label for each class").to_string().len() < 256);
    }
    let mut sample = [0; INPUTS];
    for (step, start) in [(0, 0), (0, i16::MIN), (0, i16::MAX), (7919, -16_000), (-12_347, 55)] {
        let mut value: i16 = start;
        sample.fill_with(|| {
            value = value.wrapping_add(step);
            value
        });
        let found = model.classification(&sample);
        assert!(usize::from(found.class) < classes && model.classify(&sample) == found.class);
        let probabilities = model.probabilities(&sample);
        assert_eq!(probabilities.map(|all| all[usize::from(found.class)]), found.confidence);
        assert_eq!(found.known.is_some(), model.tells_unknown());
    }
});
