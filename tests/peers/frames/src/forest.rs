//! A forest with any number of full trees, to measure the cost of one more tree.

use std::hint::black_box;

use wstac_core::model::file::{INPUTS, crc};
use wstac_core::model::forest::Forest;

/// The number of splits from the root to a leaf.
const DEPTH: u32 = 7;

/// Classifies `count` samples with a forest of `trees` trees that are seven splits deep. Returns a number that depends
/// on all answers, or 0 if the forest could not be built.
#[unsafe(no_mangle)]
pub extern "C" fn wstac_forest(trees: u16, count: usize) -> u32 {
    let words = file(trees);
    let Ok(forest) = Forest::from_words(&words) else { return 0 };
    let samples: [[i16; INPUTS]; 16] = std::array::from_fn(|sample| {
        std::array::from_fn(|input| (sample * 7919 + input * 104_729).wrapping_mul(2_654_435_761) as i16)
    });
    (0..count).fold(1, |all, index| all + u32::from(forest.classify(black_box(&samples[index % 16]))))
}

/// Returns the model file: two classes, and one tree after another.
fn file(trees: u16) -> Vec<u32> {
    let mut halves = vec![0_u16; 20];
    // A vote of 1 counts 1, and there is no table of leaves.
    halves[16] = 1;
    for tree in 0..trees {
        let at = halves.len();
        halves.push(0);
        node(&mut halves, DEPTH - 1, u32::from(tree) + 1);
        halves[at] = (halves.len() - at - 1) as u16;
    }
    let labels = halves.len();
    halves.extend([1 | u16::from(b'a') << 8, 1 | u16::from(b'b') << 8, 0]);
    if halves.len() % 2 == 1 {
        halves.push(0);
    }
    let words = halves.len() / 2;
    halves[..11].copy_from_slice(&[0x5357, 0x314D, 0, 0, words as u16, (words >> 16) as u16, 3, 0, 2, 0, 70]);
    halves[11] = trees;
    halves[12] = labels as u16;
    halves[13] = (labels >> 16) as u16;
    let mut words: Vec<u32> =
        halves.as_chunks::<2>().0.iter().map(|[low, high]| u32::from(*low) | u32::from(*high) << 16).collect();
    words[1] = crc(&words);
    words
}

fn node(halves: &mut Vec<u16>, depth: u32, chance: u32) {
    let next = chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
    let (at, input, threshold) = (halves.len(), (next >> 8) % 700, (next >> 16) as u16);
    halves.extend([input as u16, threshold, 0]);
    if depth == 0 {
        // Two leaves, which are the bytes of one half-word.
        halves[at] |= 0b111 << 13;
        halves[at + 2] = 1 << (8 * (next & 1));
        return;
    }
    node(halves, depth - 1, next);
    halves[at + 2] = (halves.len() - at) as u16;
    node(halves, depth - 1, next.rotate_left(7));
}
