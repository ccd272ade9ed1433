//! Boosted trees: functions add up scores, each in the order of its trees, and leave a score that cannot win.
//!
//! The first trees of every score are added up, then the other trees of the score that leads. Any other score is left
//! as soon as the largest leaves of its other trees cannot lift it to the highest one. A single score is left as soon
//! as its side of the bound is certain. `ci/measure peers` has the gain.
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
/// Number of parts of a score's trees of which the first is added up for every score.
const FIRST: usize = 10;
/// Number of parts of a score's trees between which the code checks whether the score can still win.
const CHECKS: usize = 20;

struct Score {
    start: u32,
    trees: Vec<Vec<Part>>,
    /// The least and the most, in bits of a sum, that the trees from each one on can add.
    rests: Vec<(u32, u32)>,
}

impl Score {
    /// Returns the number of trees that are added up first.
    fn first(&self) -> usize {
        self.trees.len().div_ceil(FIRST)
    }

    /// Returns what the trees after the first ones can add, if there are any.
    fn rest(&self) -> Option<(u32, u32)> {
        self.rests.get(self.first()).copied()
    }
}

/// Writes sums of one type.
struct Scorer<'a> {
    short: bool,
    single: bool,
    writer: Writer<'a>,
    functions: String,
}

/// Returns the functions that score, and `classify`.
pub(super) fn body(sums: &Sums, classes: usize) -> String {
    let bases = Bases::of(sums.scores.iter().flat_map(|(_, trees)| trees), BASES);
    let leaf = |bits| {
        if sums.short { format!("{}_i32", bits as i32) } else { format!("f32::from_bits({bits:#010x})") }
    };
    let leaf_type = if sums.short { "i32" } else { "f32" };
    let mut scorer = Scorer {
        short: sums.short,
        single: sums.scores.len() == 1,
        writer: Writer { bases: &bases, leaf_type, leaf: &leaf, functions: String::new(), count: 0 },
        functions: String::new(),
    };
    let mut answer = String::new();
    let mut scores = Vec::new();
    for (number, (start, trees)) in sums.scores.iter().enumerate() {
        let (start, trees) = if sums.short { above_least(*start, trees) } else { (*start, trees.clone()) };
        let rests = if sums.short { rests(&trees) } else { rests_of_floats(start, &trees) };
        let score = Score { start, trees, rests };
        scorer.first(&mut answer, number, &score);
        scorer.rest(number, &score);
        scores.push(score);
    }
    if classes == 1 {
        answer += "    0\n";
    } else if scorer.single {
        let bound = leaf(sums.bound);
        if scores[0].rest().is_some() {
            let _ = writeln!(answer, "    let s0 = rest_0_0(s, bases, s0, {bound});");
        }
        let _ = writeln!(answer, "    u8::from(s0 > {bound})");
    } else {
        scorer.highest(&mut answer, &scores);
    }
    classify(&bases, &answer) + &scorer.functions + &scorer.writer.functions
}

impl Scorer<'_> {
    /// Writes the functions of a score's first trees, and their calls.
    fn first(&mut self, answer: &mut String, number: usize, score: &Score) {
        let _ = writeln!(answer, "    let s{number} = {};", (self.writer.leaf)(score.start));
        let trees: Vec<&Vec<Part>> = score.trees[..score.first()].iter().collect();
        for (chunk, these) in chunks(&trees).into_iter().enumerate() {
            let name = format!("first_{number}_{chunk}");
            let _ = writeln!(answer, "    let s{number} = {name}(s, bases, s{number});");
            let kind = self.writer.leaf_type;
            self.functions += &head(&name, self.writer.bases, &format!(", mut sum: {kind}"), &format!(" -> {kind}"));
            for tree in these {
                self.add(tree);
            }
            self.functions += "    sum\n}\n";
        }
    }

    /// Writes the functions of a score's other trees, the first of which calls the next one.
    fn rest(&mut self, number: usize, score: &Score) {
        let kind = self.writer.leaf_type;
        let (start, step) = (score.first(), (score.trees.len() / CHECKS).max(1));
        let trees: Vec<&Vec<Part>> = score.trees[start..].iter().collect();
        let mut at = start;
        let mut chunks = chunks(&trees).into_iter().enumerate().peekable();
        while let Some((chunk, these)) = chunks.next() {
            let more = format!(", mut sum: {kind}, highest: {kind}");
            self.functions +=
                &head(&format!("rest_{number}_{chunk}"), self.writer.bases, &more, &format!(" -> {kind}"));
            for tree in these {
                if at > start && (at - start).is_multiple_of(step) {
                    self.check(score.rests[at]);
                }
                self.add(tree);
                at += 1;
            }
            let last = if chunks.peek().is_none() {
                "sum".to_owned()
            } else {
                format!("rest_{number}_{}(s, bases, sum, highest)", chunk + 1)
            };
            let _ = writeln!(self.functions, "    {last}\n}}");
        }
    }

    /// Writes a return from a score that cannot win any more, and from a single score that cannot lose.
    fn check(&mut self, (least, most): (u32, u32)) {
        let (lowest, sum) = (self.lowest(), self.plus("sum", most));
        let _ = writeln!(self.functions, "    if {sum} < highest {{\n        return {lowest};\n    }}");
        if self.single {
            let (kind, sum) = (if self.short { "i32::MAX" } else { "f32::INFINITY" }, self.plus("sum", least));
            let _ = writeln!(self.functions, "    if {sum} > highest {{\n        return {kind};\n    }}");
        }
    }

    /// Writes the addition of a tree's leaf.
    fn add(&mut self, tree: &[Part]) {
        let tree = self.writer.tree(tree, 1);
        // Starts and leaves fit in 32 bits together.
        let _ = if self.short {
            writeln!(self.functions, "    sum = sum.wrapping_add({tree});")
        } else {
            writeln!(self.functions, "    sum += {tree};")
        };
    }

    /// Writes which of several scores is the highest; of equal ones it is the first.
    fn highest(&self, answer: &mut String, scores: &[Score]) {
        *answer += "    let (mut class, mut highest) = (0, s0);\n";
        for number in 1..scores.len() {
            let _ = writeln!(
                answer,
                "    if s{number} > highest {{\n        (class, highest) = ({number}, s{number});\n    }}"
            );
        }
        if scores.iter().any(|score| score.rest().is_some()) {
            *answer += "    let leader = class;\n    highest = match leader {\n";
            for (number, score) in scores.iter().enumerate() {
                let which = if number + 1 < scores.len() { number.to_string() } else { "_".into() };
                let _ = if score.rest().is_some() {
                    writeln!(answer, "        {which} => rest_{number}_0(s, bases, s{number}, {}),", self.lowest())
                } else {
                    writeln!(answer, "        {which} => s{number},")
                };
            }
            *answer += "    };\n";
            for (number, score) in scores.iter().enumerate() {
                let (possible, sum) = match score.rest() {
                    Some((_, most)) => {
                        let sum = self.plus(&format!("s{number}"), most);
                        (format!(" && {sum} >= highest"), format!("rest_{number}_0(s, bases, s{number}, highest)"))
                    }
                    None => (String::new(), format!("s{number}")),
                };
                let _ = write!(
                    answer,
                    "    if leader != {number}{possible} {{\n        let sum = {sum};\n        \
                     if sum > highest || sum == highest && {number} < class {{\n            \
                     (class, highest) = ({number}, sum);\n        }}\n    }}\n"
                );
            }
        }
        *answer += "    class\n";
    }

    /// Returns a number below every sum, as Rust.
    fn lowest(&self) -> &'static str {
        if self.short { "i32::MIN" } else { "f32::NEG_INFINITY" }
    }

    /// Returns a sum with a number added, as Rust.
    fn plus(&self, sum: &str, bits: u32) -> String {
        let number = (self.writer.leaf)(bits);
        if self.short { format!("{sum}.wrapping_add({number})") } else { format!("{sum} + {number}") }
    }
}

/// Returns a start and trees of int16 leaves so that the smallest leaf of every tree is 0.
///
/// All sums stay the same, in 32 bits that may wrap in between.
fn above_least(start: u32, trees: &[Vec<Part>]) -> (u32, Vec<Vec<Part>>) {
    let (mut start, mut trees) = (start, trees.to_vec());
    for tree in &mut trees {
        let least = leaves(tree).map(|bits| i32::from(bits as i16)).min().unwrap_or(0);
        start = start.wrapping_add(least as u32);
        for part in tree {
            if let Part::Leaf(bits) = part {
                *bits = (i32::from(*bits as i16) - least) as u32;
            }
        }
    }
    (start, trees)
}

fn leaves(tree: &[Part]) -> impl Iterator<Item = u32> {
    tree.iter().filter_map(|part| if let Part::Leaf(bits) = part { Some(*bits) } else { None })
}

fn floats(tree: &[Part]) -> impl Iterator<Item = f64> {
    leaves(tree).map(|bits| f64::from(f32::from_bits(bits)))
}

/// Returns the least and the most that trees of leaves from [`above_least`] can add, from each tree on.
///
/// A sum and the most stay at most the largest possible sum, which fits in 32 bits.
fn rests(trees: &[Vec<Part>]) -> Vec<(u32, u32)> {
    from_each_on(trees, 0, |most, tree| most + leaves(tree).max().unwrap_or(0))
        .into_iter()
        .map(|most| (0, most))
        .collect()
}

/// Returns bounds of what trees of float32 leaves can add, from each tree on.
///
/// An addition rounds by at most 2^-24 of its sum, and no sum is larger than the start and the largest leaf of every
/// tree together. The bounds have twice that room for every tree, and for the additions and conversions of a check.
fn rests_of_floats(start: u32, trees: &[Vec<Part>]) -> Vec<(u32, u32)> {
    let largest = |tree: &Vec<Part>| floats(tree).map(f64::abs).fold(0.0, f64::max);
    let all = f64::from(f32::from_bits(start).abs()) + trees.iter().map(largest).sum::<f64>();
    let room = |left: usize| (left as f64 + 4.0) * all / f64::from(1 << 23);
    from_each_on(trees, (0.0, 0.0), |(least, most), tree| {
        (least + floats(tree).fold(f64::INFINITY, f64::min), most + floats(tree).fold(f64::NEG_INFINITY, f64::max))
    })
    .into_iter()
    .enumerate()
    .map(|(number, (least, most)): (usize, (f64, f64))| {
        let room = room(trees.len() - number);
        (((least - room) as f32).next_down().to_bits(), ((most + room) as f32).next_up().to_bits())
    })
    .collect()
}

/// Returns what `add` makes of every tree and those behind it, for each tree.
fn from_each_on<T: Copy>(trees: &[Vec<Part>], none: T, add: impl Fn(T, &Vec<Part>) -> T) -> Vec<T> {
    let mut all: Vec<T> = trees
        .iter()
        .rev()
        .scan(none, |rest, tree| {
            *rest = add(*rest, tree);
            Some(*rest)
        })
        .collect();
    all.reverse();
    all
}
