//! One tree as Rust: a block that is left with the leaf.
//!
//! The smaller of a split's two subtrees is nested and the larger one follows. So even a chain of 65 535 splits is
//! nested at most 16 deep. The rest of a large tree continues in a function of its own, so that no function is too long
//! to compile.

use std::fmt::Write;

use super::super::integers::Part;
use super::bases::Bases;

/// Number of splits after which the rest of a tree continues in another function.
const MOST_SPLITS: u32 = 1000;

/// The state with which trees are written.
pub(super) struct Writer<'a> {
    /// The bases with which thresholds are compared.
    pub(super) bases: &'a Bases,
    pub(super) leaf_type: &'a str,
    /// A leaf's word as Rust.
    pub(super) leaf: &'a dyn Fn(u32) -> String,
    /// Functions in which trees continue.
    pub(super) functions: String,
    /// Number of the functions in which trees continue.
    pub(super) count: usize,
}

impl Writer<'_> {
    /// Returns a tree as an expression whose value is its leaf; the lines after the first start with `indent`.
    pub(super) fn tree(&mut self, tree: &[Part], indent: usize) -> String {
        if let [Part::Leaf(leaf)] = *tree {
            return (self.leaf)(leaf);
        }
        let sizes = sizes(tree);
        let mut waiting = Vec::new();
        let mut text = "'t: {\n".to_owned();
        self.path(&mut text, tree, &sizes, 0, indent + 1, &mut waiting);
        let _ = write!(text, "{:1$}}}", "", 4 * indent);
        while let Some((number, node)) = waiting.pop() {
            let mut body = String::new();
            self.path(&mut body, tree, &sizes, node, 2, &mut waiting);
            let head = head(&format!("part_{number}"), self.bases, "", &format!(" -> {}", self.leaf_type));
            let _ = write!(self.functions, "{head}    't: {{\n{body}    }}\n}}\n");
        }
        text
    }

    /// Writes the path from a node, always into the larger subtree, to a leaf.
    fn path(
        &mut self,
        text: &mut String,
        tree: &[Part],
        sizes: &[u32],
        mut node: u32,
        indent: usize,
        waiting: &mut Vec<(usize, u32)>,
    ) {
        let size = |node: u32| sizes[node as usize];
        let mut splits = 0;
        loop {
            let (input, threshold, left, right) = match tree[node as usize] {
                Part::Leaf(leaf) => {
                    let _ = writeln!(text, "{:1$}break 't {2};", "", 4 * indent, (self.leaf)(leaf));
                    return;
                }
                Part::Split { .. } if splits > MOST_SPLITS => {
                    let call = self.call(node, waiting);
                    let _ = writeln!(text, "{:1$}break 't {call};", "", 4 * indent);
                    return;
                }
                Part::Split { input, threshold, left, right } => (input, threshold, left, right),
            };
            let above = size(right) < size(left);
            let (small, large) = if above { (right, left) } else { (left, right) };
            let condition = self.bases.condition(input, threshold, above);
            let _ = writeln!(text, "{:1$}if {condition} {{", "", 4 * indent);
            if size(small) > MOST_SPLITS {
                let call = self.call(small, waiting);
                let _ = writeln!(text, "{:1$}break 't {call};", "", 4 * indent + 4);
            } else {
                self.path(text, tree, sizes, small, indent + 1, waiting);
                splits += size(small);
            }
            let _ = writeln!(text, "{:1$}}}", "", 4 * indent);
            splits += 1;
            node = large;
        }
    }

    /// Returns a call of the function in which a tree continues at a node.
    fn call(&mut self, node: u32, waiting: &mut Vec<(usize, u32)>) -> String {
        let number = self.count;
        self.count += 1;
        waiting.push((number, node));
        format!("part_{number}(s, bases)")
    }
}

/// Returns the start of a function, up to the bases in variables.
pub(super) fn head(name: &str, bases: &Bases, more: &str, gives: &str) -> String {
    let names: Vec<String> = (0..bases.0.len()).map(|number| format!("b{number}")).collect();
    format!(
        "\n{ATTRIBUTES}fn {name}(s: &[i16; 700], bases: &[i32; {}]{more}){gives} {{\n    let &[{}] = bases;\n",
        names.len(),
        names.join(", ")
    )
}

/// Attributes of functions: rustfmt and clippy of every version leave the text alone, and unused bases cause no
/// warning.
pub(super) const ATTRIBUTES: &str =
    "#[rustfmt::skip]\n#[allow(unused, clippy::all, clippy::pedantic)]\n#[inline(never)]\n";

/// Returns the mean number of splits from the root to a leaf.
///
/// It is close to the number that a sample visits, because training puts similar numbers of samples into all leaves: of
/// 100 trees both were correlated by 0.96.
pub(super) fn depth(tree: &[Part]) -> f64 {
    let mut depths = vec![0_u32; tree.len()];
    let (mut sum, mut leaves) = (0.0, 0.0);
    for (number, part) in tree.iter().enumerate() {
        if let Part::Split { left, right, .. } = *part {
            depths[left as usize] = depths[number] + 1;
            depths[right as usize] = depths[number] + 1;
        } else {
            sum += f64::from(depths[number]);
            leaves += 1.0;
        }
    }
    sum / leaves
}

pub(super) fn splits(tree: &[Part]) -> usize {
    tree.len() / 2
}

/// Returns the number of splits from every node on. Parents precede their children.
fn sizes(tree: &[Part]) -> Vec<u32> {
    let mut sizes = vec![0; tree.len()];
    for (number, part) in tree.iter().enumerate().rev() {
        if let Part::Split { left, right, .. } = *part {
            sizes[number] = 1 + sizes[left as usize] + sizes[right as usize];
        }
    }
    sizes
}
