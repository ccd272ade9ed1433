//! Calibrations: the confidence of an answer, and whether a sample is known.

use std::boxed::Box;

use wstac_random_models::{KINDS, MOST_WORDS, Maker};

use super::*;
use crate::model::calibration::{CONFIDENCE_ONE, MOST_DIMENSIONS};

/// Returns a file with a calibration of these halves between its kind's part and its labels.
fn with_calibration(words: &[u32], calibration: &[u16]) -> Vec<u32> {
    let halves: Vec<u16> = words.iter().flat_map(|word| [*word as u16, (word >> 16) as u16]).collect();
    let labels = words[6] as usize;
    let (before, behind) = halves.split_at(labels);
    let mut all = before.to_vec();
    if !labels.is_multiple_of(2) {
        all.push(0);
    }
    all.extend(calibration);
    all.extend([labels as u16, (labels >> 16) as u16]);
    let start = all.len();
    // The labels start at a word now, so their padding is another one.
    let mut text: Vec<u8> = behind.iter().flat_map(|half| half.to_le_bytes()).collect();
    let mut at = 0;
    for _ in 0..halves[8] {
        at += 1 + usize::from(text[at]);
    }
    at += 2 + usize::from(u16::from_le_bytes([text[at], text[at + 1]]));
    text.resize(at, 0);
    text.resize(at.next_multiple_of(4), 0);
    all.extend(text.as_chunks::<2>().0.iter().map(|half| u16::from_le_bytes(*half)));
    let halves = all.as_chunks::<2>().0.iter();
    let mut words: Vec<u32> = halves.map(|[low, high]| u32::from(*low) | u32::from(*high) << 16).collect();
    words[2] = words.len() as u32;
    words[6] = start as u32;
    words[7] |= 1 << 24;
    sealed(words)
}

/// Returns the calibration of scores by this factor and these shifts, without a projection.
fn factor(factor: u32, before: u16, behind: u16) -> [u16; 4] {
    [factor as u16, (factor >> 16) as u16, before | behind << 8, 0]
}

/// A random projection, and what it says about a sample by real numbers.
struct Projection {
    shift: u16,
    threshold: u32,
    /// The limit of each class, if they have their own.
    limits: Option<Vec<u32>>,
    biases: Vec<i64>,
    /// For each dimension, the weights of all inputs.
    weights: Vec<Vec<i16>>,
    /// For each class, its place.
    means: Vec<Vec<i16>>,
}

impl Projection {
    fn random(maker: &mut Maker, inputs: usize, classes: usize, dimensions: usize) -> Self {
        let numbers = |maker: &mut Maker, count: usize| maker.sample().iter().cycle().take(count).copied().collect();
        let biases: Vec<i16> = numbers(maker, dimensions);
        Self {
            shift: 12,
            threshold: 200_000_000,
            limits: None,
            biases: biases.iter().map(|&bias| i64::from(bias) << 16).collect(),
            weights: (0..dimensions)
                .map(|_| -> Vec<i16> { numbers(maker, inputs) })
                .map(|row| row.iter().map(|weight| weight >> 7).collect())
                .collect(),
            means: (0..classes).map(|_| numbers(maker, dimensions)).collect(),
        }
    }

    fn halves(&self) -> Vec<u16> {
        let has_limits = u16::from(self.limits.is_some());
        let mut halves = vec![self.shift, has_limits, self.threshold as u16, (self.threshold >> 16) as u16];
        for bias in &self.biases {
            halves.extend((0..4).map(|half| (bias >> (16 * half)) as u16));
        }
        for block in self.weights.chunks(2) {
            for pair in 0..block[0].len() / 2 {
                halves.extend(block.iter().flat_map(|row| [row[2 * pair] as u16, row[2 * pair + 1] as u16]));
            }
        }
        for mean in &self.means {
            halves.extend(mean.iter().map(|&number| number as u16));
            halves.resize(halves.len().next_multiple_of(2), 0);
        }
        halves.extend(self.limits.iter().flatten().flat_map(|limit| [*limit as u16, (limit >> 16) as u16]));
        halves
    }

    fn limit(&self, class: u8) -> u64 {
        self.limits.as_ref().map_or(self.threshold, |limits| limits[usize::from(class)]).into()
    }

    fn distance(&self, sample: &[i16; INPUTS], class: usize) -> u64 {
        let dimensions = self.biases.iter().zip(&self.weights).zip(&self.means[class]);
        dimensions
            .map(|((&bias, weights), &mean)| {
                let products = weights.iter().zip(sample).map(|(&weight, &x)| i64::from(weight) * i64::from(x));
                let sum = i128::from(bias + products.sum::<i64>());
                let at = (sum + (1 << (self.shift - 1))).div_euclid(1 << self.shift);
                let difference = (at - i128::from(mean)).clamp(-8191, 8191);
                (difference * difference) as u64
            })
            .sum()
    }
}

/// Returns what scores say by real numbers: the probability of each.
fn softmax(scores: &[i64], factor: u32, before: u16, behind: u16) -> Vec<f64> {
    let highest = scores.iter().copied().max().unwrap();
    let weight = |score: i64| {
        let distance = (i128::from(highest) - i128::from(score)) >> before;
        let x = (distance.min(u32::MAX.into()) as f64 * f64::from(factor) / f64::from(behind).exp2()).floor();
        (-x / f64::from(1 << 20)).exp()
    };
    let sum: f64 = scores.iter().map(|&score| weight(score)).sum();
    scores.iter().map(|&score| weight(score) / sum).collect()
}

#[test]
fn every_kind_says_how_sure_it_is() {
    let (mut maker, mut words) = (Box::new(Maker::new(crc)), vec![0; MOST_WORDS]);
    let (mut between, mut known) = (0, [0; 2]);
    for seed in 2000..2080 {
        for kind in 0..KINDS {
            let length = maker.model(kind, seed, &mut words);
            let plain = Model::from_words(&words[..length]).unwrap();
            assert!(!plain.is_calibrated() && !plain.tells_unknown());
            let (classes, inputs) = (plain.labels().len(), 10 * usize::from(plain.frames()));
            // Votes are of few units, sums of many.
            let (number, before, behind) =
                [(1 << 20, 0, 0), (3 << 28, 20, 31), (u32::MAX, 31, 63), (77, 0, 3)][seed as usize % 4];
            let mut halves = factor(number, before, behind).to_vec();
            let dimensions = [0, 1, 9, MOST_DIMENSIONS][seed as usize / 4 % 4];
            let mut projection = Projection::random(&mut maker, inputs, classes, dimensions);
            // Every third file has a limit for each class.
            projection.limits = seed.is_multiple_of(3).then(|| (1..=classes as u32).map(|k| k * 40_000_000).collect());
            if dimensions > 0 {
                halves[3] = dimensions as u16;
                halves.extend(projection.halves());
            }
            let file = with_calibration(&words[..length], &halves);
            let model = Model::from_words(&file).unwrap();
            assert!(model.is_calibrated() && model.tells_unknown() == (dimensions > 0));
            assert!(model.labels().get(0).unwrap() == *"a");
            for _ in 0..8 {
                let sample = maker.sample();
                let found = model.classification(&sample);
                assert_eq!(found.class, plain.classify(&sample), "{kind} {seed}");
                assert_eq!(model.classify(&sample), found.class);
                assert_eq!(plain.classification(&sample), Classification { confidence: None, known: None, ..found });
                let slowly = match &model {
                    Model::LinearSvm(model) => model.calibrated::<false, _>(&sample),
                    Model::Forest(model) => model.calibrated::<false, _>(&sample),
                    Model::Boosted(model) => model.calibrated::<false, _>(&sample),
                    Model::Network(model) => model.calibrated::<false, _>(&sample),
                };
                assert_eq!(slowly, found, "{kind} {seed}");
                let probabilities = model.probabilities(&sample).unwrap();
                assert_eq!(Some(probabilities[usize::from(found.class)]), found.confidence);
                let mut scores = Vec::new();
                model.each_score(&sample, |class, score| {
                    assert_eq!(usize::from(class), scores.len());
                    scores.push(score);
                });
                assert_eq!(scores.len(), classes);
                let expected = softmax(&scores, number, before, behind);
                for (class, (&found, expected)) in probabilities.iter().zip(expected).enumerate() {
                    let expected = (expected * f64::from(CONFIDENCE_ONE)).min(f64::from(CONFIDENCE_ONE - 1));
                    assert!((f64::from(found) - expected).abs() <= 1.0, "{kind} {seed}: {class} {found} {expected}");
                    between += u32::from(found > 40 && found < CONFIDENCE_ONE - 40);
                }
                assert!(probabilities[classes..].iter().all(|&rest| rest == 0));
                let is_known = (dimensions > 0)
                    .then(|| projection.distance(&sample, found.class.into()) <= projection.limit(found.class));
                assert_eq!(found.known, is_known, "{kind} {seed}");
                if let Some(is_known) = is_known {
                    known[usize::from(is_known)] += 1;
                }
            }
        }
    }
    assert!(between > 1000 && known.iter().all(|&count| count > 300), "{between} {known:?}");
}

#[test]
fn a_calibration_that_is_not_valid_is_refused() {
    let words = forest();
    let model =
        |halves: &[u16]| Model::from_words(&with_calibration(&words, halves)).map(|model| model.is_calibrated());
    // The forest's part ends at an odd half.
    let labels = words[6] as usize;
    assert_eq!(labels % 2, 1);
    let refused = Err(ModelError::Calibration(labels as u32 + 1));
    assert_eq!(model(&factor(5, 31, 63)), Ok(true));
    assert_eq!(model(&factor(0, 0, 0)), refused);
    assert_eq!(model(&factor(5, 32, 0)), refused);
    assert_eq!(model(&factor(5, 0, 64)), refused);
    assert_eq!(model(&[]), refused);
    assert_eq!(model(&[5, 0]), refused);
    assert_eq!(model(&[&factor(5, 0, 0)[..], &[0, 0]].concat()), refused);
    let projected = |dimensions: u16, shift: u16, zero: u16, bias: u16, more: usize| {
        let mut halves = vec![5, 0, 0, dimensions, shift, zero, 9, 9];
        let rows = usize::from(dimensions) * (4 + INPUTS) + 3 * usize::from(dimensions.next_multiple_of(2));
        let start = halves.len();
        halves.resize(start + rows + more, 0);
        if let Some(high) = halves.get_mut(start + 3) {
            *high = bias;
        }
        model(&halves)
    };
    assert_eq!(projected(2, 40, 0, 0x4000, 0), Ok(true));
    assert_eq!(projected(32, 1, 0, 0, 0), Ok(true));
    assert_eq!(projected(3, 1, 0, 0, 0), Ok(true));
    assert_eq!(projected(33, 1, 0, 0, 0), refused);
    assert_eq!(projected(2, 0, 0, 0, 0), refused);
    assert_eq!(projected(2, 41, 0, 0, 0), refused);
    // Limits are there if the flag says so, and only then: two halves for each of three classes.
    assert_eq!(projected(2, 1, 1, 0, 6), Ok(true));
    for (flag, more) in [(1, 0), (1, 4), (2, 6), (0, 6)] {
        assert_eq!(projected(2, 1, flag, 0, more), refused, "{flag} {more}");
    }
    assert_eq!(projected(2, 1, 0, 0, 2), refused);
    assert_eq!(projected(2, 40, 0, 0x4001, 0), Err(ModelError::Overflow));
    // Where the kind's part ends.
    let good = with_calibration(&words, &factor(5, 0, 0));
    let last = good[6] as usize / 2 - 1;
    for (end, error) in [
        (labels as u32 - 1, None),
        (labels as u32 + 1, None),
        (15, Some(ModelError::Calibration(good[6]))),
        (good[6], Some(ModelError::Calibration(good[6]))),
        (u32::MAX, Some(ModelError::Calibration(good[6]))),
    ] {
        let mut words = good.clone();
        words[last] = end;
        let found = Model::from_words(&sealed(words)).unwrap_err();
        assert!(error.is_none_or(|error| found == error), "{end}: {found}");
    }
    let mut odd = good.clone();
    odd[6] += 1;
    assert_eq!(Model::from_words(&sealed(odd)).unwrap_err(), ModelError::Calibration(good[6] + 1));
    // One half more between the calibration and its start, so that the labels start in the middle of a word.
    let mut halves: Vec<u16> = good.iter().flat_map(|word| [*word as u16, (word >> 16) as u16]).collect();
    halves.insert(good[6] as usize - 2, 0);
    halves.push(0);
    let mut moved: Vec<u32> =
        halves.as_chunks::<2>().0.iter().map(|[low, high]| u32::from(*low) | u32::from(*high) << 16).collect();
    (moved[2], moved[6]) = (good[2] + 1, good[6] + 1);
    assert_eq!(Model::from_words(&sealed(moved)).unwrap_err(), ModelError::Calibration(good[6] + 1));
    let mut filled = good.clone();
    filled[labels / 2] |= 1 << 16;
    assert_eq!(Model::from_words(&sealed(filled)).unwrap_err(), ModelError::Calibration(labels as u32));
    // Without the flag the calibration would be part of the trees.
    let mut unflagged = good;
    unflagged[7] &= !(1 << 24);
    assert!(Model::from_words(&sealed(unflagged)).is_err());
}

#[test]
fn a_later_calibration_is_refused() {
    let mut words = with_calibration(&forest(), &factor(5, 0, 0));
    words[7] += 1 << 24;
    let error = Model::from_words(&sealed(words)).unwrap_err();
    assert_eq!(error, ModelError::Header { half: 15, found: 512 });
}
