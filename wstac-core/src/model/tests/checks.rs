//! Damaged files with a right checksum: every check refuses them with its own error, and allows what is at its limit.

use super::*;

const BOTH: u16 = LEFT_LEAF | RIGHT_LEAF;
/// The high half of an infinite float32.
const INFINITE: u16 = 0x7F80;

/// Halves that are changed, and the error that follows; `None` if the file is still valid.
type Change<'a> = (&'a [(usize, u16)], Option<ModelError>);

fn check(words: &[u32], changes: &[Change<'_>]) {
    for &(halves, expected) in changes {
        let found = Model::from_words(&with_halves(words.to_vec(), halves)).err();
        assert_eq!(found, expected, "{halves:?}");
    }
}

const fn header(half: u8, found: u16) -> ModelError {
    ModelError::Header { half, found }
}

const fn part(half: u32) -> ModelError {
    ModelError::Part(half)
}

const fn node(half: u32) -> ModelError {
    ModelError::Node(half)
}

const fn label(byte: u32) -> ModelError {
    ModelError::Label(byte)
}

const OVERFLOW: Option<ModelError> = Some(ModelError::Overflow);

/// Returns a file with these bytes in place of its labels and training facts.
fn with_text(words: &[u32], text: &[u8]) -> Vec<u32> {
    let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    bytes.truncate(2 * words[6] as usize);
    bytes.extend(text);
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let mut words: Vec<u32> = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    words[2] = words.len() as u32;
    sealed(words)
}

#[test]
fn a_header_out_of_range_is_refused() {
    let good = forest();
    let length = |found, expected| Some(ModelError::Length { found, expected });
    assert_eq!(Model::from_words(&good[..7]).err(), length(7, 8));
    let mut longer = good.clone();
    longer[2] += 1;
    assert_eq!(Model::from_words(&sealed(longer)).err(), length(30, 31));
    let mut damaged = good.clone();
    damaged[1] ^= 1;
    let checksum = ModelError::Checksum { found: good[1], expected: damaged[1] };
    assert_eq!(Model::from_words(&damaged).err(), Some(checksum));
    // No words but the header: its labels are missing.
    check(&good[..8], &[(&[(4, 8), (12, 16)], Some(label(32)))]);
    check(
        &good,
        &[
            (&[(6, 0)], Some(header(6, 0))),
            (&[(6, 6)], Some(header(6, 6))),
            (&[(8, 0)], Some(header(8, 0))),
            (&[(8, 64)], Some(label(117))),
            (&[(8, 65)], Some(header(8, 65))),
            (&[(9, 4)], Some(header(9, 4))),
            (&[(10, 0)], Some(header(10, 0))),
            (&[(10, 71)], Some(header(10, 71))),
            (&[(12, 15)], Some(header(12, 15))),
            (&[(12, 61)], Some(header(12, 61))),
            (&[(14, 8)], Some(part(27))),
            (&[(14, 9)], Some(header(14, 9))),
            (&[(14, 0x0100)], Some(header(14, 0x0100))),
            (&[(15, 4)], Some(header(15, 4))),
        ],
    );
    let kind = |found, expected| Some(ModelError::Kind { found, expected });
    assert_eq!(LinearSvm::from_words(&good).err(), kind(3, 1));
    assert_eq!(Boosted::from_words(&good).err(), kind(3, 4));
    assert_eq!(Network::from_words(&good).err(), kind(3, 5));
    assert_eq!(Forest::from_words(&boosted(false)).err(), kind(4, 3));
}

#[test]
fn text_that_is_no_text_is_refused() {
    // Its one label starts at byte 44.
    let model = file(4, 2, 1, 0, &[1, 0, 0, 0, 0, 0]);
    let long = |length: u8| [&[length][..], &vec![b'a'; length.into()]].concat();
    for (text, expected) in [
        ([long(63), vec![64, 0], vec![b'b'; 64]].concat(), None),
        ([long(64), vec![0, 0]].concat(), Some(label(44))),
        (vec![1, b'a', 1, 0, b'b', 0, 0, 0], None),
        (vec![1, b'a', 1, 0, b'b', 0, 0, 7], Some(ModelError::End)),
        (vec![1, b'a', 0, 0, 0, 0, 0, 0], Some(ModelError::End)),
        (vec![1, b'a', 5, 0, b'b', 0, 0, 0], Some(label(46))),
        (vec![1, 0xFF, 0, 0], Some(label(45))),
        // The least character of two bytes, one of too many bytes, and characters that are cut off.
        (vec![2, 0xC2, 0x80, 0, 0], None),
        (vec![2, 0xC1, 0xBF, 0, 0], Some(label(45))),
        (vec![2, 0xC2, b'a', 0, 0], Some(label(45))),
        ([vec![1, 0xC2, 0x80, 0], vec![b'b'; 128]].concat(), Some(label(45))),
    ] {
        assert_eq!(Model::from_words(&with_text(&model, &text)).err(), expected, "{text:?}");
    }
}

#[test]
fn a_forest_with_an_impossible_part_is_refused() {
    check(
        &forest(),
        &[
            (&[(7, 1)], Some(header(7, 1))),
            (&[(11, 0)], Some(header(11, 0))),
            (&[(16, 0)], OVERFLOW),
            (&[(16, 0x5555), (17, 0x5555)], None),
            (&[(16, 0x5556), (17, 0x5555)], OVERFLOW),
            // The table ends with the trees, or behind them.
            (&[(18, 33)], Some(part(53))),
            (&[(18, 34)], Some(part(20))),
            // Too many trees, too few, and lengths.
            (&[(11, 4)], Some(part(53))),
            (&[(11, 2)], Some(part(44))),
            (&[(27, 0)], Some(part(27))),
            (&[(44, 9)], Some(part(44))),
            // The first node has a flag, or its right child is itself, inside of its left one, behind a gap or the end.
            (&[(28, SAME)], Some(node(28))),
            (&[(30, 0)], Some(node(28))),
            (&[(30, 4)], Some(node(31))),
            (&[(30, 7)], Some(node(31))),
            (&[(30, 9)], Some(node(28))),
            // Features and leaves, also of right children.
            (&[(34, BOTH | NARROW | 0x2BC)], Some(node(34))),
            (&[(33, 9)], Some(node(31))),
            (&[(33, 9 << 8)], Some(node(31))),
            (&[(38, LEFT_LEAF | 3 << 10)], Some(node(38))),
            (&[(42, 9)], Some(node(40))),
            (&[(43, 9)], Some(node(40))),
            // The entry of the shared leaf: no classes, too many of a class, a class that is none.
            (&[(20, 0)], Some(node(48))),
            (&[(25, 4)], Some(node(48))),
            (&[(24, 3)], Some(node(48))),
            // Entries behind the table, and one that reaches beyond it.
            (&[(49, 25)], Some(node(48))),
            (&[(16, 9), (25, 1), (49, 8)], Some(node(48))),
        ],
    );
    // More classes in an entry than there are.
    let part_of = [2, 0, 7, 0, 2, 0, 1, 0, 0, 1, 0, 2, BOTH | SAME, 1];
    check(&file(3, 0, 1, 1, &part_of), &[(&[], Some(node(28))), (&[(20, 1)], None)]);
    check(&file(3, 0, 1, 1, &[1, 0, 0]), &[(&[], Some(part(20)))]);
}

#[test]
fn trees_are_as_deep_as_their_check_can_follow() {
    for (depth, expected) in [(256, None), (257, Some(node(21 + 3 * 256)))] {
        // Every left child is a node, and its right sibling waits.
        let mut nodes = vec![];
        for level in 0..depth {
            nodes.extend([0, 0, 5 * depth - 5 * level]);
        }
        nodes.extend([BOTH | SAME, 0].repeat(usize::from(depth) + 1));
        let part = [&[1, 0, 0, 0, nodes.len() as u16], &nodes[..]].concat();
        check(&file(3, 0, 1, 1, &part), &[(&[], expected)]);
    }
}

#[test]
fn boosted_trees_with_an_impossible_part_are_refused() {
    let shared = [(&[(16, 3)][..], Some(part(16))), (&[(11, 5)], Some(header(11, 5))), (&[(7, 0)], Some(header(7, 0)))];
    check(&boosted(false), &shared);
    check(&boosted(true), &shared);
    let large = (&[(20, 0xFFFF), (21, 0x7FFE)][..], None);
    check(&boosted(false), &[(&[(18, INFINITE)], None), large, (&[(20, 0), (21, 0x7FFF)], OVERFLOW)]);
    check(&boosted(true), &[(&[(18, INFINITE)], OVERFLOW), (&[(21, INFINITE)], OVERFLOW)]);
    check(&boosted(true), &[(&[(29, INFINITE)], Some(node(26))), (&[(31, INFINITE)], Some(node(26)))]);
    check(&file(4, 2, 1, 0, &[1, 0, 0]), &[(&[], Some(part(16)))]);
    check(&file(4, 2, 3, 0, &[1, 0, 0, 0, 0, 0]), &[(&[], Some(part(16)))]);
    // One leaf that is cut off, and one beside a node.
    let one = |number, tree: &[u16]| file(4, number, 1, 1, &[&[1, 0, 0, 1, 0, 0, tree.len() as u16], tree].concat());
    check(&one(2, &[LEFT_LEAF, 0]), &[(&[], Some(node(23)))]);
    let single = LEFT_LEAF | 1 << 10;
    check(&one(2, &[LEFT_LEAF, 0, 5, BOTH, 0, 1, 2]), &[(&[], None), (&[(23, single)], Some(node(23)))]);
    let wide = one(3, &[LEFT_LEAF, 0, 0, 0, BOTH, 0, 0, 0, 0, 0]);
    check(&wide, &[(&[], None), (&[(23, single)], Some(node(23))), (&[(26, INFINITE)], Some(node(23)))]);
}

#[test]
fn a_linear_model_with_an_impossible_part_is_refused() {
    check(
        &linear(1, 3, 3, &[0; 3], |_, _| 0),
        &[
            (&[(7, 3)], Some(header(7, 3))),
            (&[(11, 1)], Some(header(11, 1))),
            (&[(16, 2)], Some(part(16))),
            (&[(17, 1)], Some(part(16))),
            (&[(10, 69)], Some(part(18))),
        ],
    );
    // One row for three classes.
    check(&linear(1, 3, 1, &[0], |_, _| 0), &[(&[], Some(part(16)))]);
    // A single class has no pairs, so no rows.
    check(&file(2, 2, 1, 0, &[0, 0]), &[(&[], None)]);
    check(&with_text(&file(2, 2, 1, 0, &[]), &[0; 4]), &[(&[], Some(part(16)))]);
}

/// Returns a network of one frame with so many sums in its two layers.
fn small_network(classes: u16, hidden: usize, sums: usize) -> Vec<u32> {
    let mut part = vec![2, 0, hidden as u16, 0];
    part.resize(part.len() + hidden * (4 + 10), 0);
    part.extend([sums as u16, 0]);
    part.resize(part.len() + sums * (4 + hidden.next_multiple_of(10)), 0);
    with_halves(file(5, 2, classes, 0, &part), &[(10, 1)])
}

#[test]
fn a_network_with_an_impossible_part_is_refused() {
    check(
        &small_network(2, 1, 2),
        &[
            (&[(11, 1)], Some(header(11, 1))),
            (&[(16, 1)], Some(part(16))),
            (&[(17, 1)], Some(part(16))),
            (&[(18, 100)], Some(part(18))),
            (&[(19, 47)], None),
        ],
    );
    for (classes, hidden, sums, expected) in [
        (2, 1, 1, None),
        (2, 1, 3, Some(part(34))),
        (3, 1, 1, Some(part(34))),
        (3, 128, 3, None),
        (3, 129, 3, Some(part(18))),
    ] {
        check(&small_network(classes, hidden, sums), &[(&[], expected)]);
    }
    // A word between the scores and the labels.
    let mut longer = small_network(2, 1, 2);
    let labels = longer[6] as usize;
    longer.insert(labels / 2, 0);
    (longer[2], longer[6]) = (longer[2] + 1, longer[6] + 2);
    check(&longer, &[(&[], Some(part(34)))]);
    check(&file(5, 2, 1, 0, &[2, 0]), &[(&[], Some(part(18)))]);
    check(&with_text(&file(5, 2, 1, 0, &[2]), &[0; 6]), &[(&[], Some(part(16)))]);
}
