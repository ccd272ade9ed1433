//! Models at the limits of the format.

use super::*;

const BOTH: u16 = LEFT_LEAF | RIGHT_LEAF;

/// Returns a forest of so many classes and these trees' nodes, with votes of 1.
fn forest_of(classes: u16, trees: &[Vec<u16>], shift: u16) -> Vec<u32> {
    let mut part = vec![1, 0, 0, 0];
    for tree in trees {
        let units = tree.len().div_ceil(1 << shift);
        part.push(units as u16);
        part.extend(tree);
        part.resize(part.len() + (units << shift) - tree.len(), 0);
    }
    let mut words = file(3, 0, classes, trees.len() as u16, &part);
    // The place of the labels may take more than a half.
    let labels = HEADER_HALVES + part.len();
    words[6] = labels as u32;
    words[7] = u32::from(shift);
    sealed(words)
}

fn both_answer(words: &[u32], sample: &[i16; INPUTS]) -> u8 {
    let forest = Forest::from_words(words).unwrap();
    let class = forest.classify(sample);
    assert_eq!(class, forest.decide::<false, _>(sample, false, |_, _| {}));
    class
}

#[test]
fn where_every_class_has_the_same_votes_the_first_wins() {
    for classes in 1..=20_u16 {
        let leaf = |class: u16| vec![BOTH | SAME, class];
        let trees: Vec<Vec<u16>> = (0..3 * classes).map(|tree| leaf(classes - 1 - tree % classes)).collect();
        let words = forest_of(classes, &trees, 0);
        assert_eq!(both_answer(&words, &[0; INPUTS]), 0, "{classes}");
        // One more vote decides, although it comes last.
        let trees: Vec<Vec<u16>> = trees.into_iter().chain([leaf(classes - 1)]).collect();
        assert_eq!(u16::from(both_answer(&forest_of(classes, &trees, 0), &[0; INPUTS])), classes - 1);
    }
}

#[test]
fn where_every_score_is_the_same_the_first_class_wins() {
    for floats in [false, true] {
        let mut words = boosted(floats);
        // Every leaf and start becomes 0.
        let model = |words: &[u32]| Boosted::from_words(words).unwrap().classify(&[0; INPUTS]);
        assert_eq!(model(&words), 0);
        let empty = file(4, if floats { 3 } else { 2 }, 5, 0, &[&[5, 0, 0][..], &[0; 15]].concat());
        assert_eq!(model(&empty), 0, "no trees at all, and all starts 0");
        // Every leaf and start is 0, but class 3 starts with the least number above 0.
        let mut part = [&[5, 0, 0][..], &[0; 15]].concat();
        part[3 + 3 * 3 + 1] = 1;
        words = file(4, if floats { 3 } else { 2 }, 5, 0, &part);
        assert_eq!(model(&words), 3, "an integer of 1, or a float32 that is subnormal");
    }
    for (kind, number) in [(1, 1), (1, 2)] {
        let words = linear_zeros(kind, number, 6);
        assert_eq!(LinearSvm::from_words(&words).unwrap().classify(&[i16::MIN; INPUTS]), 0);
    }
}

/// Returns a linear model whose weights and biases are 0.
fn linear_zeros(kind: u16, number: u16, rows: u16) -> Vec<u32> {
    let mut part = vec![0; 2 + usize::from(rows) * (4 + if number == 1 { 350 } else { 700 })];
    part[0] = rows;
    file(kind, number, rows, 0, &part)
}

/// Returns a model whose weights are all one half, as two int8 or an int16; row 1 is less by a bias.
fn limits(number: u16, weight: u16) -> Vec<u32> {
    let row = if number == 1 { 350 } else { 700 };
    let mut part = vec![3, 0];
    part.extend([0, 0, 0, 0, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 1, 0, 0, 0]);
    part.resize(part.len() + 3 * row, weight);
    file(1, number, 3, 0, &part)
}

#[test]
fn sums_at_the_limits_are_exact() {
    for (number, weight, each) in [(2, 0x8000, -32_768), (2, 0x7FFF, 32_767), (1, 0x8080, -128), (1, 0x7F7F, 127)] {
        let words = limits(number, weight);
        let model = LinearSvm::from_words(&words).unwrap();
        for x in [i16::MIN, i16::MAX] {
            let mut sums = vec![];
            model.each_sum::<true, _>(&[x; INPUTS], |_, sum| sums.push(sum));
            let sum = 700 * each * i64::from(x);
            assert_eq!(sums, [sum, sum - 1, sum + 1], "{number} {weight}");
            assert_eq!(model.classify(&[x; INPUTS]), 2);
        }
    }
}

#[test]
fn sums_are_of_32_bits_only_if_none_can_exceed_them() {
    // Two weights of 32767 reach 32768 times 65534: a bias of 65535 is the largest that fits.
    let largest = 0x7FFF_7FFF;
    for (number, inputs, biases, weights, fits) in [
        // The first row's second word, and the second row's, of two rows; then a third row.
        (2, 4, &[65_535, 0][..], vec![0, 0, largest, 0], true),
        (2, 4, &[65_536, 0], vec![0, 0, largest, 0], false),
        (2, 4, &[0, 65_536], vec![0, 0, 0, largest], false),
        (2, 4, &[0, 0, 65_535], vec![0, 0, 0, 0, 0, largest], true),
        (2, 4, &[0, 0, 65_536], vec![0, 0, 0, 0, 0, largest], false),
        // Words of int8: -128, -1, -128, -1 are 258.
        (1, 1020, &[0], vec![0xFF80_FF80; 255], false),
        (1, 1016, &[0], vec![0xFF80_FF80; 254], true),
    ] {
        let words: Vec<u32> = biases.iter().flat_map(|&bias| [bias, 0]).chain(weights).collect();
        let rows = rows::Rows::new(&words, biases.len(), inputs, number).unwrap();
        assert_eq!(rows.fits_32_bits, fits, "{number} {biases:?}");
    }
}

#[test]
fn one_class_is_always_the_answer() {
    // A score above the bound of two classes is possible, too.
    let boosted = [file(4, 2, 1, 0, &[1, 0, 0, 0, 0, 0]), file(4, 2, 1, 0, &[1, 0, 0, 0, 5, 0])];
    for words in [forest_of(1, &[vec![BOTH | SAME, 0]], 0), linear_zeros(1, 2, 1)].into_iter().chain(boosted) {
        assert_eq!(Model::from_words(&words).unwrap().classify(&[7; INPUTS]), 0);
    }
}

/// Returns a chain of so many splits to one side. Its leaf is 0 while the number of input 3 is beyond a threshold, and
/// 1 at the end.
fn chain(depth: u16, to_right: bool) -> Vec<u16> {
    let mut nodes = vec![];
    for level in 1..depth {
        let (leaf, threshold) = if to_right { (LEFT_LEAF, level as i16) } else { (RIGHT_LEAF, -(level as i16)) };
        nodes.extend([leaf | 3, below(threshold)]);
    }
    let last = if to_right { depth as i16 } else { -(depth as i16) };
    nodes.extend([BOTH | NARROW | 3, below(last), if to_right { 1 << 8 } else { 1 }]);
    nodes
}

#[test]
fn chains_of_any_depth_end_where_they_should() {
    for depth in [1, 2, 64, 300, 20_000] {
        for to_right in [false, true] {
            let words = forest_of(2, &[chain(depth, to_right)], 0);
            let end = if to_right { depth as i16 + 1 } else { -(depth as i16) };
            for (x, class) in [(end, 1), (if to_right { end - 1 } else { end + 1 }, 0), (0, 0)] {
                let mut sample = [0; INPUTS];
                sample[3] = x;
                assert_eq!(both_answer(&words, &sample), class, "{depth} {to_right} {x}");
            }
        }
    }
}

/// Adds a balanced tree over the bits of input 0's number from `low` on: 2^levels leaves, of class 1 if the bits are
/// all 1. Returns its number of nodes.
fn balanced(nodes: &mut Vec<u16>, levels: u32, low: i32, shift: usize) -> usize {
    let half = 1 << (levels - 1);
    let threshold = below((low + half - 1) as i16);
    if levels == 1 {
        nodes.extend([BOTH | NARROW, threshold, u16::from(low + 1 == i32::from(i16::MAX)) << 8]);
        return 1;
    }
    let at = nodes.len();
    nodes.extend([0, threshold, 0]);
    let left = balanced(nodes, levels - 1, low, shift);
    let offset = (nodes.len() - at).next_multiple_of(1 << shift);
    nodes.resize(at + offset, 0);
    nodes[at + 2] = (offset >> shift) as u16;
    left + 1 + balanced(nodes, levels - 1, low + half, shift)
}

#[test]
fn a_tree_of_65535_nodes_answers() {
    let mut nodes = vec![];
    assert_eq!(balanced(&mut nodes, 16, i32::from(i16::MIN), 2), 65_535);
    let words = forest_of(2, &[nodes], 2);
    for (x, class) in [(i16::MAX, 1), (i16::MAX - 1, 0), (i16::MIN, 0), (0, 0), (-1, 0)] {
        assert_eq!(both_answer(&words, &[x; INPUTS]), class, "{x}");
    }
}

#[test]
fn floats_that_could_overflow_are_refused_and_subnormal_ones_count() {
    let with = |leaf: f32, start: f32| {
        let [leaf, start] = [leaf, start].map(|number| [number.to_bits() as u16, (number.to_bits() >> 16) as u16]);
        let part = [&[1, 0, 0, 1][..], &start, &[6, BOTH, 0], &leaf, &leaf].concat();
        file(4, 3, 2, 1, &part)
    };
    let class = |leaf, start| Boosted::from_words(&with(leaf, start)).map(|model| model.classify(&[0; INPUTS]));
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -f32::MAX, 2.0_f32.powi(96)] {
        assert!(matches!(class(bad, 0.0), Err(ModelError::Node(_))), "{bad}");
        assert_eq!(class(0.0, bad), Err(ModelError::Overflow), "{bad}");
    }
    let tiny = f32::from_bits(1);
    for (leaf, start, expected) in [(tiny, 0.0, 1), (-tiny, 0.0, 0), (tiny, -tiny, 0), (0.0, -0.0, 0), (tiny, tiny, 1)]
    {
        assert_eq!(class(leaf, start), Ok(expected), "{leaf:e} {start:e}");
    }
    let largest = f32::from_bits(2.0_f32.powi(96).to_bits() - 1);
    assert_eq!((class(largest, largest), class(-largest, -largest)), (Ok(1), Ok(0)));
}

#[test]
fn flags_of_forests_are_refused_in_boosted_trees() {
    let tree = |node: u16, leaves: &[u16]| {
        let part = [&[2, 0, 0, 1, 0, 0, 0, 0, 0][..], &[2 + leaves.len() as u16, node, 0], leaves].concat();
        Boosted::from_words(&file(4, 2, 2, 1, &part)).map(|_| ())
    };
    assert_eq!(tree(BOTH, &[1, 2]), Ok(()));
    assert!(tree(BOTH | NARROW, &[1]).is_err());
    assert!(tree(BOTH | NARROW, &[1, 2]).is_err());
    assert!(tree(BOTH | SAME, &[]).is_err());
}

#[test]
fn bytes_are_used_where_they_lie_and_only_if_aligned() {
    let words = forest();
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let mut shifted = vec![0; bytes.len() + 8];
    let start = 4 + shifted.as_ptr().align_offset(4);
    shifted[start..start + bytes.len()].copy_from_slice(&bytes);
    let length = 4 * words.len();
    let model = Model::from_bytes(&shifted[start..start + length]).unwrap();
    assert_eq!(model.classify(&sample(5, -1, 7)), 0);
    for off in 1..4 {
        let moved = Model::from_bytes(&shifted[start + off..start + off + length]);
        assert_eq!(moved.err(), Some(ModelError::Alignment));
        assert_eq!(Model::from_bytes(&shifted[start..start + length - off]).err(), Some(ModelError::Alignment));
        assert_eq!(Model::from_bytes(&shifted[start - off..start + length]).err(), Some(ModelError::Alignment));
    }
}
