//! Forests: groups of trees vote, and between the groups the code checks whether a class has already won.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::super::integers::Part;
use super::super::write::forest::Votes;
use super::bases::Bases;
use super::tree::{ATTRIBUTES, Writer, depth, head};
use super::{chunks, classify};

/// Classes whose votes share a register, with one byte each.
const CLASSES_A_WORD: usize = 4;
/// Largest number of registers that hold votes.
const MOST_WORDS: usize = 3;
/// Registers for bases and votes together; votes in memory leave one register less.
///
/// With more, the compiler moves them to and from memory. With 9, 100 trees of 12290 splits took 6 % more instructions
/// and 3 % more bytes.
const REGISTERS: usize = 6;
/// Hundredths of a forest after which the code checks whether the leading class can still be reached.
const CHECKS: [usize; 5] = [66, 76, 84, 90, 95];
/// Hundredths of a forest for the same checks where votes share no registers, so that there is no [`Count::majority`].
const CHECKS_ALONE: [usize; 8] = [52, 58, 64, 70, 76, 82, 88, 94];
/// Number of parts of a forest between which the code checks whether a class has most of all votes.
const MAJORITIES: usize = 25;

/// The way votes are counted.
struct Count {
    classes: usize,
    /// Words of votes: one for each class, or one for four if every leaf is one vote of at most 255.
    words: usize,
    unit: u32,
}

impl Count {
    fn of(votes: &Votes, classes: usize) -> Self {
        let words = classes.div_ceil(CLASSES_A_WORD);
        let fit = votes.table.is_empty() && votes.trees.len() < 256 && words <= MOST_WORDS;
        Self {
            classes,
            words: if fit { words } else { classes },
            unit: if votes.table.is_empty() { 1 } else { votes.unit },
        }
    }

    /// Returns `true` if a word holds votes of four classes. For one class it does not matter.
    fn is_packed(&self) -> bool {
        self.words < self.classes
    }

    /// Returns the code of a class's vote.
    fn vote(&self, class: usize) -> String {
        if self.is_packed() {
            let (word, place) = (class / CLASSES_A_WORD, 8 * (class % CLASSES_A_WORD));
            format!("v{word} = v{word}.wrapping_add({})", 1_u32 << place)
        } else {
            format!("votes[{class}] = votes[{class}].wrapping_add({})", self.unit)
        }
    }

    /// Returns `true` if so many of all trees can give a class most of all votes, and the code checks it.
    fn can_win(&self, trees: usize, all: usize) -> bool {
        self.is_packed() && trees > all / 2
    }

    /// Returns the word that makes a byte's top bit a carry if the byte holds most of all votes.
    fn short(trees: usize) -> u32 {
        (127 - trees as u32 / 2) * 0x0101_0101
    }

    /// Returns the condition that a class has most of all votes.
    ///
    /// It is some instructions only, where [`Self::first`] takes a hundred.
    fn majority(&self, trees: usize) -> String {
        let short = Self::short(trees);
        let sums: Vec<String> = (0..self.words).map(|word| format!("v{word}.wrapping_add({short})")).collect();
        format!("({}) & 0x8080_8080 != 0", sums.join(" | "))
    }

    /// Returns the function that finds the class with most of all votes, if there is one.
    fn most(&self, trees: usize) -> String {
        if !self.is_packed() {
            return String::new();
        }
        let mut body = String::new();
        let short = Self::short(trees);
        for (word, class) in (0..self.words).zip((0..).step_by(CLASSES_A_WORD)) {
            let _ = writeln!(
                body,
                "    let over = all[{word}].wrapping_add({short}) & 0x8080_8080;\n    \
                 if over != 0 {{\n        return {class}_u8.wrapping_add((over.trailing_zeros() / 8) as u8);\n    }}"
            );
        }
        format!(
            "\n/// The class with most of all votes, which there is.\n{ATTRIBUTES}\
             fn most(all: &[u32; {}]) -> u8 {{\n{body}    0\n}}\n",
            self.words
        )
    }

    /// Returns the function that finds the leading class and its lead.
    ///
    /// It has a line or two for every class, which is faster than a loop.
    fn first(&self) -> String {
        let mut body = "    let (mut class, mut first, mut second) = (0, 0, 0);\n".to_owned();
        for class in 0..self.classes {
            let votes = if self.is_packed() {
                format!("all[{}] >> {} & 255", class / CLASSES_A_WORD, 8 * (class % CLASSES_A_WORD))
            } else {
                format!("all[{class}]")
            };
            let _ = write!(
                body,
                "    let votes = {votes};\n    if votes > first {{\n        (class, second, first) = ({class}, first, votes);\n    \
                 }} else if votes > second {{\n        second = votes;\n    }}\n"
            );
        }
        format!(
            "\n/// Of those with most votes the lowest class, and by how much it leads.\n{ATTRIBUTES}\
             fn first(all: &[u32; {}]) -> (u8, u32) {{\n{body}    (class, first.wrapping_sub(second))\n}}\n",
            self.words
        )
    }
}

/// Returns the functions that vote, and `classify`.
pub(super) fn body(votes: &Votes, classes: usize) -> String {
    let count = Count::of(votes, classes);
    let taken = if count.is_packed() { count.words } else { 1 };
    let bases = Bases::of(votes.trees.iter(), REGISTERS - taken);
    let entries = entries(votes, classes);
    let leaf = |leaf: u32| {
        // For entries it is their number, not their position, so that numbers stay small.
        format!("{}_u32", entries.get(&leaf).map_or(leaf, |entry| classes as u32 + entry.0))
    };
    let mut writer = Writer { bases: &bases, leaf_type: "u32", leaf: &leaf, functions: String::new(), count: 0 };
    // Short trees come first: the remaining trees, which an early win skips, are then the most work.
    let mut trees: Vec<&Vec<Part>> = votes.trees.iter().collect();
    trees.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
    let mut functions = String::new();
    let mut answer = format!("    let mut votes = [0; {}];\n    let mut reach = u32::MAX;\n", count.words);
    let checks = if count.is_packed() { &CHECKS[..] } else { &CHECKS_ALONE };
    let ends = checks.iter().map(|part| trees.len() * part / 100).chain([trees.len()]);
    let (mut group, mut start) = (0, 0);
    for end in ends {
        for chunk in chunks(&trees[start..end]) {
            functions += &one_group(group, start, trees.len(), chunk, &count, &mut writer);
            let call = format!("group_{group}(s, bases, &mut votes)");
            let _ = if count.can_win(start + chunk.len(), trees.len()) {
                writeln!(answer, "    if {call} {{\n        return most(&votes);\n    }}")
            } else {
                writeln!(answer, "    {call};")
            };
            group += 1;
            start += chunk.len();
        }
        let left = count.unit * (trees.len() - end) as u32;
        // A tree adds at most one vote to a lead: a check before that can be enough is useless.
        if left > 0 && end > 0 {
            let _ = write!(
                answer,
                "    if {} < reach {{\n        let (class, lead) = first(&votes);\n        \
                 if lead > {left} {{\n            return class;\n        }}\n        reach = lead.wrapping_add({left});\n    }}\n",
                2 * left
            );
        }
    }
    answer += "    first(&votes).0\n";
    classify(&bases, &answer)
        + &count.first()
        + &count.most(trees.len())
        + &shares(&entries, classes)
        + &functions
        + &writer.functions
}

/// Returns a function in which some trees of `all` vote, from the tree `start` on. It returns whether a class has most
/// of all votes, once that is possible.
fn one_group(
    group: usize,
    start: usize,
    all: usize,
    trees: &[&Vec<Part>],
    count: &Count,
    writer: &mut Writer,
) -> String {
    let can_win = count.can_win(start + trees.len(), all);
    let gives = if can_win { " -> bool" } else { "" };
    let mut text =
        head(&format!("group_{group}"), writer.bases, &format!(", votes: &mut [u32; {}]", count.words), gives);
    let words: Vec<String> = (0..count.words).map(|word| format!("v{word}")).collect();
    let kept = words.join(", ");
    let won = if count.is_packed() { count.majority(all) } else { String::new() };
    if count.is_packed() {
        let _ = writeln!(text, "    let [mut {}] = *votes;", words.join(", mut "));
    }
    for (number, tree) in (start..).zip(trees) {
        let since = number.saturating_sub(all / 2 + 1);
        if count.can_win(number, all) && number > start && since.is_multiple_of((all / MAJORITIES).max(1)) {
            let _ = writeln!(text, "    if {won} {{\n        *votes = [{kept}];\n        return true;\n    }}");
        }
        let leaves: BTreeSet<u32> =
            tree.iter().filter_map(|part| if let Part::Leaf(leaf) = part { Some(*leaf) } else { None }).collect();
        let mut arms: Vec<(String, String)> = leaves
            .iter()
            .filter(|&&leaf| (leaf as usize) < count.classes)
            .map(|&class| (class.to_string(), count.vote(class as usize)))
            .collect();
        if leaves.iter().any(|&leaf| leaf as usize >= count.classes) {
            arms.push(("leaf".into(), format!("shares(votes, leaf.wrapping_sub({}))", count.classes)));
        } else if let Some((last, _)) = arms.last_mut() {
            *last = "_".into();
        }
        let _ = writeln!(text, "    match {} {{", writer.tree(tree, 1));
        for (leaf, vote) in arms {
            let _ = writeln!(text, "        {leaf} => {vote},");
        }
        text += "    }\n";
    }
    if count.is_packed() {
        let _ = writeln!(text, "    *votes = [{kept}];");
    }
    if can_win {
        let _ = writeln!(text, "    {won}");
    }
    text + "}\n"
}

/// Leaves that do not belong to a single class: by their words, their numbers and fractions.
type Entries = BTreeMap<u32, (u32, Vec<(u16, u32)>)>;

fn entries(votes: &Votes, classes: usize) -> Entries {
    let mut entries = Entries::new();
    let mut at = 0;
    while let Some((&shares, rest)) = votes.table.get(at..).and_then(<[u16]>::split_first) {
        let share = |share: &[u16; 3]| (share[0], u32::from(share[1]) | u32::from(share[2]) << 16);
        let shares: Vec<(u16, u32)> = rest.as_chunks::<3>().0.iter().take(usize::from(shares)).map(share).collect();
        let (number, length) = (entries.len() as u32, 1 + 3 * shares.len());
        entries.insert((at + classes) as u32, (number, shares));
        at += length;
    }
    entries
}

/// Returns the function that adds the fractions of an entry.
fn shares(entries: &Entries, classes: usize) -> String {
    if entries.is_empty() {
        return String::new();
    }
    let mut starts = vec!["0".to_owned()];
    let (mut whose, mut shares) = (Vec::new(), Vec::new());
    for (_, entry) in entries.values() {
        for (class, share) in entry {
            whose.push(class.to_string());
            shares.push(share.to_string());
        }
        starts.push(whose.len().to_string());
    }
    format!(
        "\n/// Adds what a leaf gives to each class.\n{ATTRIBUTES}fn shares(votes: &mut [u32; {classes}], leaf: u32) {{\n    \
         static STARTS: [u16; {}] = [{}];\n    static CLASSES: [u8; {all}] = [{}];\n    static SHARES: [u32; {all}] = [{}];\n    \
         let leaf = leaf as usize;\n    \
         let (Some(&start), Some(&end)) = (STARTS.get(leaf), STARTS.get(leaf.wrapping_add(1))) else {{ return }};\n    \
         let (start, end) = (usize::from(start), usize::from(end));\n    \
         let (Some(classes), Some(shares)) = (CLASSES.get(start..end), SHARES.get(start..end)) else {{ return }};\n    \
         for (class, share) in classes.iter().zip(shares) {{\n        \
         if let Some(votes) = votes.get_mut(usize::from(*class)) {{\n            \
         *votes = votes.wrapping_add(*share);\n        }}\n    }}\n}}\n",
        starts.len(),
        starts.join(", "),
        whose.join(", "),
        shares.join(", "),
        all = whose.len(),
    )
}
