use super::super::file::{Input, TAXEL_INPUTS};
use super::*;

/// Returns a file as one of taxels, with all of its tens of inputs and a shift.
fn of_taxels(mut words: Vec<u32>, shift: u32) -> Vec<u32> {
    (words[5], words[7]) = (words[5] & !0xFFFF | 0xAF, shift | 3 << 16);
    sealed(words)
}

/// A sample of taxels whose last number is its only one.
fn sample(last: i16) -> [i16; TAXEL_INPUTS] {
    let mut sample = [0; TAXEL_INPUTS];
    sample[1749] = last;
    sample
}

#[test]
fn a_linear_model_of_taxels_reads_all_of_them() {
    let mut part = vec![1, 0, 0, 0, 0, 0];
    part.resize(6 + 1750, 0);
    part[6 + 1749] = 1;
    let words = of_taxels(file(1, 2, 2, 0, &part), 0);
    let model = Model::from_words(&words).unwrap();
    assert_eq!((model.input(), model.frames()), (Input::Taxels, 175));
    assert_eq!([1, 0, -1].map(|last| model.classify(&sample(last))), [1, 0, 0]);
    // Another length is answered, without a meaning.
    assert_eq!(model.classify(&[i16::MAX; INPUTS]), 0);
    for (tens, is_right) in [(0, false), (1, false), (174, false), (176, false)] {
        let mut words = words.clone();
        words[5] = words[5] & !0xFFFF | tens;
        assert_eq!(Model::from_words(&sealed(words)).is_ok(), is_right, "{tens}");
    }
}

#[test]
fn features_of_taxels_have_eleven_bits() {
    let both = LEFT_LEAF | RIGHT_LEAF;
    // x1749 ≤ −1 ? class 7 in the feature's half : (x1749 ≤ 5 ? class 8 : class 1), and padding.
    let part = [1, 0, 0, 0, 3, LEFT_LEAF | 7 << 11 | 0x6D5, below(-1), both | NARROW | 0x6D5, 5, 1 << 8 | 8, 0];
    let words = of_taxels(file(3, 0, 9, 1, &part), 1);
    let model = Model::from_words(&words).unwrap();
    assert_eq!([-1, 0, 5, 6].map(|last| model.classify(&sample(last))), [7, 8, 8, 1]);
    assert!(usize::from(model.classify(&[-1; INPUTS])) < 9);
    // Beyond the last number, or without a shift, which fast walks take for ten bits.
    let mut beyond = words.clone();
    beyond[10] = beyond[10] & !0x7FF_0000 | 1750 << 16;
    assert!(matches!(Model::from_words(&sealed(beyond)), Err(ModelError::Node(_) | ModelError::Part(_))));
    let error = Model::from_words(&of_taxels(words, 0)).unwrap_err();
    assert_eq!(error, ModelError::Header { half: 14, found: 0 });
}

#[test]
fn a_longer_sample_has_the_answers_of_the_shorter_one_in_front() {
    let mut maker = wstac_random_models::Maker::new(crc);
    let mut words = vec![0; wstac_random_models::MOST_WORDS];
    for round in 0..20 * wstac_random_models::KINDS {
        let length = maker.model(round % wstac_random_models::KINDS, round.into(), &mut words);
        let model = Model::from_words(&words[..length]).unwrap();
        let short: [i16; INPUTS] =
            core::array::from_fn(|input| ((input as u32).wrapping_mul(2_654_435_761) >> 7) as i16);
        let mut long = [9; TAXEL_INPUTS];
        long[..INPUTS].copy_from_slice(&short);
        assert_eq!(model.classification(&short), model.classification(&long), "{round}");
    }
}
