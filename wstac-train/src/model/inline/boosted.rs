//! Boosted trees: one function adds up a score, in the order of its trees.
//!
//! For int16 leaves, each tree's smallest leaf is added to the score's start, and the rest of a leaf is 0 to 65 535. A
//! Cortex-M builds such a number in one instruction; a negative number takes two. The code takes 124 612 bytes instead
//! of 146 606 for 7053 splits.

use std::fmt::Write;

use super::super::integers::Part;
use super::super::write::boosted::Sums;
use super::bases::Bases;
use super::tree::{Writer, head};
use super::{chunks, classify};

/// Bases that fit a Cortex-M's registers next to the sample, the sum and the numbers of a split.
const BASES: usize = 4;

/// Returns the functions that score, and `classify`.
pub(super) fn body(sums: &Sums, classes: usize) -> String {
    let bases = Bases::of(sums.scores.iter().flat_map(|(_, trees)| trees), BASES);
    let number = |bits: u32| {
        if sums.short { format!("{}_i32", bits as i32) } else { format!("f32::from_bits({bits:#010x})") }
    };
    let kind = if sums.short { "i32" } else { "f32" };
    let mut writer = Writer { bases: &bases, leaf_type: kind, leaf: &number, functions: String::new(), count: 0 };
    let (mut functions, mut answer) = (String::new(), String::new());
    for (score, (start, trees)) in sums.scores.iter().enumerate() {
        let (start, trees) = if sums.short { above_least(*start, trees) } else { (*start, trees.clone()) };
        let trees: Vec<&Vec<Part>> = trees.iter().collect();
        let _ = writeln!(answer, "    let sum = {};", number(start));
        for (chunk, these) in chunks(&trees).into_iter().enumerate() {
            let name = format!("score_{score}_{chunk}");
            let _ = writeln!(answer, "    let sum = {name}(s, bases, sum);");
            functions += &head(&name, &bases, &format!(", mut sum: {kind}"), &format!(" -> {kind}"));
            for tree in these {
                let tree = writer.tree(tree, 1);
                // Starts and leaves fit in 32 bits together.
                let _ = if sums.short {
                    writeln!(functions, "    sum = sum.wrapping_add({tree});")
                } else {
                    writeln!(functions, "    sum += {tree};")
                };
            }
            functions += "    sum\n}\n";
        }
        if sums.scores.len() > 1 && score == 0 {
            answer += "    let (mut class, mut highest) = (0, sum);\n";
        } else if score > 0 {
            let _ = writeln!(answer, "    if sum > highest {{\n        (class, highest) = ({score}, sum);\n    }}");
        }
    }
    if classes == 1 {
        answer += "    0\n";
    } else if sums.scores.len() == 1 {
        let _ = writeln!(answer, "    u8::from(sum > {})", number(sums.bound));
    } else {
        answer += "    class\n";
    }
    classify(&bases, &answer) + &functions + &writer.functions
}

/// Returns a start and trees of int16 leaves so that the smallest leaf of every tree is 0.
///
/// All sums stay the same, in 32 bits that may wrap in between.
fn above_least(start: u32, trees: &[Vec<Part>]) -> (u32, Vec<Vec<Part>>) {
    let (mut start, mut trees) = (start, trees.to_vec());
    for tree in &mut trees {
        let value = |part: &Part| if let Part::Leaf(bits) = part { Some(i32::from(*bits as i16)) } else { None };
        let least = tree.iter().filter_map(value).min().unwrap_or(0);
        start = start.wrapping_add(least as u32);
        for part in tree {
            if let Part::Leaf(bits) = part {
                *bits = (i32::from(*bits as i16) - least) as u32;
            }
        }
    }
    (start, trees)
}
