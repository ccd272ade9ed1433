use wstac_core::model::file::{Input, Task};

use super::*;
use crate::model::trained::{Kind, Linear, Node, Row, Trained, Tree};
use crate::model::write::{Options, write};

/// Returns noisy samples of classes that differ in one number, and samples of no class.
fn samples(seed: u64, classes: u16, count: u16) -> LabeledSamples {
    let mut samples =
        LabeledSamples { names: (0..classes).map(|class| class.to_string()).collect(), ..LabeledSamples::default() };
    let mut state = seed;
    let mut noise = |width: i32| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as i32 % (2 * width + 1) - width
    };
    for k in 0..count {
        let label = k % classes;
        let mut numbers = vec![0; 700];
        for number in numbers.iter_mut().take(10) {
            *number = noise(300) as i16;
        }
        // Nearly normal noise, of a standard deviation of 340: some slides are beyond the middle to the next class.
        let sum: i32 = (0..6).map(|_| noise(240)).sum();
        numbers[3] = (1000 * i32::from(label) + sum) as i16;
        samples.numbers.push(numbers);
        samples.labels.push(label);
    }
    samples
}

fn linear(classes: u16) -> Vec<u32> {
    // A class's sum is highest near its place.
    let rows = (0..classes).map(|class| {
        let place = f64::from(class) * 1000.0 / 2048.0;
        let weights = (0..10).map(|input| if input == 3 { 2.0 * place } else { 0.0 }).collect();
        Row { weights, bias: -place * place }
    });
    let kind = Kind::Linear(Linear { pairs: false, rows: rows.collect() });
    model(classes, kind)
}

fn forest(classes: u16) -> Vec<u32> {
    // Five trees, whose bounds between two classes differ.
    let tree = |shift: f64| {
        let mut nodes = Vec::new();
        for class in 0..classes - 1 {
            let at = nodes.len();
            let threshold = (1000.0 * f64::from(class) + 500.0 + shift) / 2048.0;
            nodes.push(Node::Split { input: 3, threshold, strict: false, left: at + 1, right: at + 2 });
            nodes.push(Node::Leaf(vec![(class, 1.0)]));
        }
        nodes.push(Node::Leaf(vec![(classes - 1, 1.0)]));
        Tree { nodes }
    };
    model(classes, Kind::Forest([-300.0, -150.0, 0.0, 150.0, 300.0].map(tree).to_vec()))
}

fn model(classes: u16, kind: Kind) -> Vec<u32> {
    let labels = (0..classes).map(|class| class.to_string()).collect();
    let (task, input, remarks) = (Task::Other, Input::Frames, Vec::new());
    let trained = Trained { labels, task, input, inputs: 10, speeds: None, kind, remarks, mean: None };
    write(&trained, "facts", Options::default()).unwrap().words
}

#[test]
fn a_calibrated_model_has_the_same_answers_and_honest_confidence() {
    let (trained, held_out, unseen) = (samples(1, 4, 2000), samples(2, 4, 2000), samples(3, 4, 4000));
    for words in [linear(4), forest(4)] {
        let found = calibrate(&words, &trained, &held_out, Settings::default()).unwrap();
        assert_eq!(found.dimensions, 3, "four classes have three dimensions");
        let (before, after) = (Model::from_words(&words).unwrap(), Model::from_words(&found.words).unwrap());
        let mut confidences = Vec::new();
        for numbers in &unseen.numbers {
            let answer = after.classification(&padded(numbers));
            assert_eq!(answer.class, before.classify(&padded(numbers)));
            confidences.push(answer.confidence.unwrap());
        }
        let quality = Quality::of(&after, &unseen);
        assert!(quality.accuracy > 0.75 && quality.accuracy < 0.97, "{quality:?}");
        assert!(quality.calibration_error < 0.05, "{quality:?}");
        let known = quality.known.unwrap();
        assert!((known - 0.98).abs() < 0.012, "{quality:?}");
        assert!(confidences.iter().max() > confidences.iter().min());
        // A model without a calibration says nothing.
        assert_eq!(Quality::of(&before, &unseen).known, None);
        // What is far from all classes is unknown: in the number that tells them apart, and in another one.
        for (number, value) in [(3, -6000), (3, 9000), (5, 9000)] {
            let mut other = vec![0; 700];
            other[number] = value;
            // Numbers that tell no class apart have no weight in the projection.
            assert!(number == 5 || after.classification(&padded(&other)).known == Some(false), "{number} {value}");
        }
        assert_eq!(without(&found.words).unwrap(), words);
        assert_eq!(calibrate(&found.words, &trained, &held_out, Settings::default()).unwrap().words, found.words);
        let settings = Settings { dimensions: 0, ..Settings::default() };
        let found = calibrate(&words, &trained, &held_out, settings).unwrap();
        let model = Model::from_words(&found.words).unwrap();
        assert!(model.is_calibrated() && !model.tells_unknown());
        assert_eq!(without(&found.words).unwrap(), words);
    }
}

#[test]
fn a_file_says_the_distance_of_its_projection() {
    let (trained, held_out) = (samples(1, 4, 2000), samples(2, 4, 2000));
    let words = linear(4);
    let projection = Projection::of(&trained, 10, 3).unwrap();
    let found = calibrate_with(&words, Some(&projection), &trained, &held_out, Settings::default()).unwrap();
    let model = Model::from_words(&found.words).unwrap();
    let read = projection_of(&found.words).unwrap();
    for (one, other) in read.weights.iter().flatten().zip(projection.weights.iter().flatten()) {
        assert!((one - other).abs() < 2e-4 * projection.weights.iter().flatten().fold(0.0, |a, b| b.abs().max(a)));
    }
    for (one, other) in read.place(&held_out.numbers[7]).iter().zip(projection.place(&held_out.numbers[7])) {
        assert!((one - other).abs() < 0.01, "{one} {other}");
    }
    assert!(projection_of(&words).is_err());
    // Of samples that are not at the bound, real numbers say the same.
    let mean = |label: u16| -> Vec<f64> {
        let places: Vec<Vec<f64>> = trained
            .numbers
            .iter()
            .zip(&trained.labels)
            .filter(|(_, other)| **other == label)
            .map(|(numbers, _)| projection.place(numbers))
            .collect();
        (0..3).map(|d| places.iter().map(|place| place[d]).sum::<f64>() / places.len() as f64).collect()
    };
    let means = [0, 1, 2, 3].map(mean);
    let distance = |numbers: &Vec<i16>| {
        let class = usize::from(model.classify(&padded(numbers)));
        (class, projection.place(numbers).iter().zip(&means[class]).map(|(a, b)| (a - b).powi(2)).sum::<f64>())
    };
    let right = |samples: &LabeledSamples| -> Vec<(usize, f64)> {
        let all = samples.numbers.iter().map(distance).zip(&samples.labels);
        all.filter(|((class, _), label)| *class == usize::from(**label)).map(|(found, _)| found).collect()
    };
    let mut sorted = [const { Vec::new() }; 4];
    for (class, distance) in right(&held_out) {
        sorted[class].push(distance);
    }
    let bounds = sorted.map(|mut own| {
        own.sort_by(f64::total_cmp);
        own[(0.98 * own.len() as f64).ceil() as usize - 1]
    });
    assert!(bounds.iter().any(|bound| (bound / bounds[0] - 1.0).abs() > 0.05), "each class has its own: {bounds:?}");
    let mut checked = 0;
    for numbers in &samples(9, 4, 3000).numbers {
        let (class, distance) = distance(numbers);
        let bound = bounds[class];
        if (distance / bound - 1.0).abs() > 0.01 {
            assert_eq!(model.classification(&padded(numbers)).known, Some(distance < bound), "{distance} {bound}");
            checked += 1;
        }
    }
    assert!(checked > 2900);
    // Of 12 samples, 2 % are none: one bound is for all classes.
    let few = samples(2, 4, 48);
    let found = calibrate_with(&words, Some(&projection), &trained, &few, Settings::default()).unwrap();
    let model = Model::from_words(&found.words).unwrap();
    let most = right(&few).into_iter().map(|(_, distance)| distance).fold(0.0, f64::max);
    for numbers in &samples(9, 4, 3000).numbers {
        let distance = distance(numbers).1;
        if (distance / most - 1.0).abs() > 0.01 {
            assert_eq!(model.classification(&padded(numbers)).known, Some(distance < most), "{distance} {most}");
        }
    }
}

#[test]
fn too_few_samples_are_refused() {
    let (trained, held_out) = (samples(1, 4, 40), samples(2, 4, 7));
    let error = calibrate(&linear(4), &trained, &held_out, Settings::default()).unwrap_err();
    assert_eq!(error, "has 7 samples of the model's classes, expected at least 8");
    let mut of_three = samples(1, 3, 40);
    of_three.labels.iter_mut().for_each(|label| *label %= 3);
    let error = calibrate(&linear(4), &of_three, &samples(2, 4, 40), Settings::default()).unwrap_err();
    assert_eq!(error, "no sample of class 3, expected some of every class");
}
