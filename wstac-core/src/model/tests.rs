use std::vec;
use std::vec::Vec;

use super::file::{HEADER_HALVES, INPUTS, MAGIC, ModelError, crc};
use super::trees::{LEFT_LEAF, NARROW, RIGHT_LEAF, SAME};
use super::*;

mod calibrated;
mod checks;
mod extremes;
mod kernels;
mod taxels;

/// Returns a file with header, labels and checksum around the part of a kind. Labels are `a`, `b` …
fn file(kind: u16, number: u16, classes: u16, trees: u16, part: &[u16]) -> Vec<u32> {
    let mut halves = vec![0; HEADER_HALVES];
    halves[..2].copy_from_slice(if kind == 5 || number == 4 { &file::MAGIC_2 } else { &MAGIC });
    (halves[6], halves[7], halves[8], halves[9], halves[10], halves[11]) = (kind, number, classes, 1, 70, trees);
    halves.extend(part);
    halves[12] = halves.len() as u16;
    let mut bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
    for class in 0..classes as u8 {
        bytes.extend([1, b'a' + class]);
    }
    bytes.extend([4, 0]);
    bytes.extend("oµk".as_bytes());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    words[2] = words.len() as u32;
    sealed(words)
}

/// Returns the file with a correct checksum.
fn sealed(mut words: Vec<u32>) -> Vec<u32> {
    words[1] = crc(&words);
    words
}

fn below(threshold: i16) -> u16 {
    threshold as u16
}

/// Returns three trees over two features. The last one's leaf is shared: 3 quarters for class 2 and one for class 0.
fn forest() -> Vec<u32> {
    let both = LEFT_LEAF | RIGHT_LEAF;
    let part = [
        [4, 0, 7, 0].as_slice(),
        // The table of leaves: one entry.
        &[2, 0, 1, 0, 2, 3, 0],
        // x0 ≤ 5 ? (x1 ≤ −1 ? 0 : 1) : (x1 ≤ 0 ? 1 : 2)
        &[9, 0, below(5), 6, both | NARROW | 1, below(-1), 1 << 8, both | NARROW | 1, 0, 2 << 8 | 1],
        // x0 ≤ 100 ? 0 : (x0 ≤ 30000 ? 2 : 1), leaves in the feature's half and as two halves
        &[6, LEFT_LEAF, below(100), both, 30_000, 2, 1],
        // x699 ≤ 7 ? (the shared leaf) : (x0 ≤ 0 ? 1 : 2)
        &[8, 699, 7, 5, both | SAME, 3, both | NARROW, 0, 2 << 8 | 1],
    ];
    file(3, 0, 3, 3, &part.concat())
}

fn sample(first: i16, second: i16, last: i16) -> [i16; INPUTS] {
    let mut sample = [0; INPUTS];
    (sample[0], sample[1], sample[699]) = (first, second, last);
    sample
}

#[test]
fn a_forest_votes() {
    let words = forest();
    let forest = Forest::from_words(&words).unwrap();
    // Votes of 4: (0, 0, shared) = 9 of class 0; ties go to the lowest.
    for (sample, class) in [
        (sample(5, -1, 7), 0),
        // 1, 0 and the shared leaf: 5 of class 0, 4 of class 1, 3 of class 2.
        (sample(5, 0, 7), 0),
        // 2, 0 and 2.
        (sample(6, 1, 8), 2),
        // 2, 2 and the shared leaf.
        (sample(101, 1, 0), 2),
        // 1, 0 and 1.
        (sample(0, 3, 9), 1),
        // 0, 0 and 1.
        (sample(-9, -9, 9), 0),
        // 2, 1 and 2; 1, 1 and 2.
        (sample(30_001, 1, 8), 2),
        (sample(30_001, 0, 8), 1),
    ] {
        assert_eq!(forest.classify(&sample), class);
        assert_eq!(Model::from_words(&words).unwrap().classify(&sample), class);
    }
    assert_eq!(forest.labels().get(2).unwrap().chars().collect::<Vec<_>>(), ['c']);
    assert!(forest.labels().get(3).is_none());
    assert!(forest.labels().training() == *"oµk");
    assert_eq!((forest.task(), forest.frames(), forest.trees()), (Task::Specimen, 70, 3));
}

/// Returns two classes with a score each, of two trees each, with float32 or int16 leaves.
fn boosted(floats: bool) -> Vec<u32> {
    let both = LEFT_LEAF | RIGHT_LEAF;
    let value = |value: i16| if floats { f32::from(value).to_bits() } else { i32::from(value) as u32 };
    let long = |number: u32| [number as u16, (number >> 16) as u16];
    let leaf = |number: i16| if floats { long(value(number)).to_vec() } else { vec![number as u16] };
    let mut part = vec![2, 0, 0];
    for start in [10, -10] {
        part.push(2);
        part.extend(long(value(start)));
    }
    for (threshold, low, high) in [(0, 1, -5), (10, 2, -5), (0, 3, 30), (10, -4, 50)] {
        let leaves = [leaf(low), leaf(high)].concat();
        part.extend([2 + leaves.len() as u16, both, below(threshold)]);
        part.extend(leaves);
    }
    file(4, if floats { 3 } else { 2 }, 2, 4, &part)
}

#[test]
fn boosted_trees_add_up() {
    for floats in [false, true] {
        let words = boosted(floats);
        let model = Boosted::from_words(&words).unwrap();
        // 13 against −11, 7 against 16, 0 against 70.
        for (first, class) in [(0, 0), (1, 1), (11, 1)] {
            assert_eq!(model.classify(&sample(first, 0, 0)), class, "{floats} {first}");
        }
    }
}

/// Returns the int16 weights of `rows` rows: `weight(row, input)`.
fn linear(kind: u16, classes: u16, rows: usize, biases: &[i64], weight: impl Fn(usize, usize) -> i16) -> Vec<u32> {
    let mut part = vec![rows as u16, 0];
    for bias in biases {
        part.extend((0..4).map(|word| (bias >> (16 * word)) as u16));
    }
    for block in (0..rows).collect::<Vec<_>>().chunks(linear_svm::BLOCK) {
        for pair in 0..INPUTS / 2 {
            part.extend(block.iter().flat_map(|&row| [weight(row, 2 * pair) as u16, weight(row, 2 * pair + 1) as u16]));
        }
    }
    file(kind, 2, classes, 0, &part)
}

#[test]
fn a_linear_model_weighs() {
    // Class k uses only input k.
    let words = linear(1, 7, 7, &[0, 0, 0, 0, 0, 0, 500], |row, input| i16::from(row == input) * 100);
    let model = LinearSvm::from_words(&words).unwrap();
    assert_eq!(model.classify(&sample(0, 0, 0)), 6);
    assert_eq!(model.classify(&sample(4, 6, 0)), 1);
    // In a tie the lowest class wins.
    assert_eq!(model.classify(&sample(6, 6, 0)), 0);
    // All weights and inputs at their limits: no sum overflows.
    for extreme in [i16::MIN, i16::MAX] {
        let words = linear(1, 2, 2, &[1 << 61, -(1 << 61)], |row, _| if row == 0 { extreme } else { i16::MIN });
        let model = LinearSvm::from_words(&words).unwrap();
        assert_eq!(model.classify(&[i16::MIN; INPUTS]), 0);
    }
    let one = linear(1, 2, 1, &[-3], |_, input| i16::from(input == 0));
    let one = LinearSvm::from_words(&one).unwrap();
    assert_eq!([3, 4].map(|first| one.classify(&sample(first, 0, 0))), [0, 1]);
}

#[test]
fn one_against_one_votes() {
    // Rows 0–1, 0–2, 1–2: the class with the larger input of the two wins.
    let pairs = [(0, 1), (0, 2), (1, 2)];
    let words = linear(2, 3, 3, &[0; 3], |row, input| {
        let (first, second) = pairs[row];
        let place = |class: usize| if class == 2 { 699 } else { class };
        i16::from(input == place(first)) - i16::from(input == place(second))
    });
    let model = LinearSvm::from_words(&words).unwrap();
    for (sample, class) in [(sample(3, 2, 1), 0), (sample(1, 3, 2), 1), (sample(1, 2, 3), 2), (sample(1, 2, 2), 2)] {
        assert_eq!(model.classify(&sample), class);
    }
}

/// Tests weights of int32, which are two rows of int16: first one of units of 2^15.
#[test]
fn wide_weights_weigh() {
    // Class 0 has the weight 2^15 + 1 of input 0, class 1 has 2^15 + 2 of input 1, class 2 a bias of -2^15 + 7.
    let words = linear(1, 3, 6, &[0, 0, 0, 0, -1, 7], |row, input| match (row, input) {
        (0 | 1, 0) | (2, 1) => 1,
        (3, 1) => 2,
        _ => 0,
    });
    let words = with_halves(words, &[(1, file::MAGIC_2[1]), (7, 4), (HEADER_HALVES, 3)]);
    let model = LinearSvm::from_words(&words).unwrap();
    assert_eq!(model.layout(), 2);
    let mut scores = vec![];
    model.each_score(&sample(10, -10, 5), |_, score| scores.push(score));
    assert_eq!(scores, [10 * 32_769, -10 * 32_770, -32_768 + 7]);
    assert_eq!([(7, 7), (8, 7), (-9, -9)].map(|(first, second)| model.classify(&sample(first, second, 0))), [1, 0, 2]);
    // A first layout has no such weights, and a bias times 2^15 must fit.
    for (halves, expected) in
        [(vec![(1, MAGIC[1])], ModelError::Version(b'1')), (vec![(HEADER_HALVES + 2 + 3, 1)], ModelError::Overflow)]
    {
        assert_eq!(LinearSvm::from_words(&with_halves(words.clone(), &halves)).unwrap_err(), expected);
    }
}

fn with_halves(mut words: Vec<u32>, halves: &[(usize, u16)]) -> Vec<u32> {
    for &(at, half) in halves {
        let shift = 16 * (at % 2);
        words[at / 2] = words[at / 2] & !(0xFFFF << shift) | u32::from(half) << shift;
    }
    sealed(words)
}

/// Returns a network of int16 weights over two inputs: max(0, x0 + x1) / 2 and max(0, −x0 − x1) / 2, and scores of
/// both.
fn network() -> Vec<u32> {
    let mut part = vec![2, 0, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0];
    part.extend([1, 1, 0xFFFF, 0xFFFF]);
    part.extend([0; 2 * (INPUTS - 2)]);
    // Class 0 above 100 by the first value, class 1 by the second one, class 2 has 100.
    part.extend([3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 100, 0, 0, 0]);
    part.extend([[1, 0, 0, 1], [0; 4], [0; 4], [0; 4], [0; 4]].concat());
    part.extend([0; 10]);
    file(5, 2, 3, 0, &part)
}

#[test]
fn a_network_has_hidden_values() {
    let words = network();
    let model = Network::from_words(&words).unwrap();
    for (first, second, scores, class) in [
        (150, 51, [100, 0, 100], 0),
        (150, 52, [101, 0, 100], 0),
        (-150, -52, [0, 101, 100], 1),
        (3, 2, [2, 0, 100], 2),
        // Values end at 32767.
        (i16::MAX, i16::MAX, [32_767, 0, 100], 0),
        (i16::MIN, i16::MIN, [0, 32_767, 100], 1),
    ] {
        let mut found = vec![];
        model.each_score(&sample(first, second, 0), |_, score| found.push(score));
        assert_eq!((&found[..], model.classify(&sample(first, second, 0))), (&scores[..], class));
    }
    let at = HEADER_HALVES + 2 + 2 + 8 + 2 * INPUTS;
    for (halves, expected) in [
        (vec![(1, MAGIC[1])], ModelError::Version(b'1')),
        (vec![(7, 3)], ModelError::Header { half: 7, found: 3 }),
        (vec![(HEADER_HALVES, 4)], ModelError::Part(HEADER_HALVES as u32)),
        (vec![(HEADER_HALVES + 2, 0)], ModelError::Part(HEADER_HALVES as u32 + 2)),
        (vec![(HEADER_HALVES + 3, 48)], ModelError::Part(HEADER_HALVES as u32 + 2)),
        // Scores are not shifted.
        (vec![(at + 1, 1)], ModelError::Part(at as u32)),
    ] {
        let error = Network::from_words(&with_halves(words.clone(), &halves)).unwrap_err();
        assert_eq!(error, expected, "{halves:?}");
    }
}
