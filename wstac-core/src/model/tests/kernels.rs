//! Fast kernels give the same answers as plain code.

use std::boxed::Box;

use wstac_random_models::{ANSWERS, MOST_WORDS, Maker, answers};

use super::*;

/// Returns a model's answer by plain code.
fn plainly(model: &Model<'_>, sample: &[i16; INPUTS]) -> u8 {
    match model {
        Model::LinearSvm(model) => model.decide::<false, _>(sample, false, |_, _| {}),
        Model::Forest(model) => model.decide::<false, _>(sample, false, |_, _| {}),
        Model::Boosted(model) => model.decide::<false, _>(sample, false, |_, _| {}),
        Model::Network(model) => model.decide::<false, _>(sample, false, |_, _| {}),
    }
}

#[test]
fn fast_answers_are_the_plain_ones() {
    let (mut maker, mut words) = (Box::new(Maker::new(crc)), vec![0; MOST_WORDS]);
    let mut answered = [0; 64];
    let all = answers(&mut maker, &mut words, |words, samples| {
        let model = Model::from_words(words).ok()?;
        Some(samples.each_ref().map(|sample| {
            let class = model.classify(sample);
            assert_eq!(class, plainly(&model, sample));
            assert!(usize::from(class) < model.labels().len());
            answered[usize::from(class)] += 1;
            class
        }))
    });
    assert_eq!(all, Some(ANSWERS));
    // Not all of them are the first class; they go up to those that do not fit a node.
    assert!(answered.iter().filter(|&&count| count > 10).count() >= 17, "{answered:?}");
}
