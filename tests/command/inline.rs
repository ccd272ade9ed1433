//! Tests models as Rust code: it compiles without a warning, cannot panic, and answers like the model file.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};

use wstac_core::model::Model;
use wstac_core::model::file::{INPUTS, Input, Task};
use wstac_tests::command::{program, says, wstac};
use wstac_tests::folder::Folder;
use wstac_tests::random::Random;
use wstac_tests::trained::XGBOOST;
use wstac_train::model::inline::source;
use wstac_train::model::trained::{Boosted, Kind, Linear, Node, Row, Score, Trained, Tree, file_order};
use wstac_train::model::write::{Leaves, Options, write};

/// Runs rustc in a folder. Any message of it is an error.
fn rustc(folder: &Folder, arguments: &[&str]) {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let done = program(rustc).args(arguments).args(["--edition", "2024"]).current_dir(&folder.0).output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success() && said.is_empty(), "{said}");
}

/// Models in a crate without std, like in an application, and a program that reads samples from its standard input and
/// applies each model.
struct Crate {
    folder: Folder,
    models: usize,
}

impl Crate {
    /// Overflow checks are on: generated code must not need them off.
    fn new(name: &str, sources: &[String], optimization: &str) -> Self {
        let folder = Folder::new(name);
        let mut root =
            "//! Models.\n#![no_std]\n#![forbid(unsafe_code)]\n#![deny(warnings, missing_docs)]\n".to_owned();
        let mut answers = String::new();
        for (number, text) in sources.iter().enumerate() {
            folder.file(&format!("m{number}.rs"), text);
            let _ = write!(root, "/// A model.\npub mod m{number};\n");
            let _ = writeln!(answers, "        answers.push(models::m{number}::classify(&sample));");
        }
        folder.file("models.rs", &root);
        let options = ["-C", optimization, "-C", "overflow-checks=on", "-C", "panic=abort"];
        rustc(&folder, &[&["--crate-type=rlib", "--emit=link,obj", "models.rs"], &options[..]].concat());
        folder.file(
            "main.rs",
            format!(
                "use std::io::{{Read, Write}};\nfn main() {{\n    let mut bytes = Vec::new();\n    \
                 std::io::stdin().read_to_end(&mut bytes).unwrap();\n    let mut answers = Vec::new();\n    \
                 for bytes in bytes.chunks(1400) {{\n        let mut sample = [0; 700];\n        \
                 for (x, bytes) in sample.iter_mut().zip(bytes.chunks(2)) {{\n            \
                 *x = i16::from_le_bytes([bytes[0], bytes[1]]);\n        }}\n{answers}    }}\n    \
                 std::io::stdout().write_all(&answers).unwrap();\n}}\n"
            ),
        );
        rustc(&folder, &["main.rs", "--extern", "models=libmodels.rlib", "-C", "panic=abort"]);
        Self { folder, models: sources.len() }
    }

    /// Returns whether its machine code refers to the panics of core.
    fn can_panic(&self) -> bool {
        let code = fs::read(self.folder.0.join("models.o")).unwrap();
        code.windows(9).any(|part| part == b"panicking")
    }

    /// Returns the answer of each model to each sample.
    fn answers(&self, samples: &[[i16; INPUTS]]) -> Vec<Vec<u8>> {
        let bytes: Vec<u8> = samples.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let input = fs::File::open(self.folder.file("samples", bytes)).unwrap();
        let done = program(self.folder.0.join("main")).stdin(input).stderr(Stdio::inherit()).output().unwrap();
        assert!(done.status.success());
        assert_eq!(done.stdout.len(), samples.len() * self.models);
        done.stdout.chunks(self.models).map(<[u8]>::to_vec).collect()
    }
}

fn model(classes: usize, kind: Kind) -> Trained {
    let labels = (0..classes).map(|class| format!("\"Klasse\" {class}\n\\ µ𝛼")).collect();
    let (task, input, remarks) = (Task::Other, Input::Frames, Vec::new());
    Trained { labels, task, input, inputs: INPUTS, speeds: None, kind, remarks, mean: None }
}

/// Returns a random tree with this many splits.
fn tree<L>(random: &mut Random, splits: usize, mut leaf: impl FnMut(&mut Random) -> L) -> Tree<L> {
    let mut nodes = vec![Node::Leaf(leaf(random))];
    let mut leaves = vec![0];
    for _ in 0..splits {
        let node = leaves.swap_remove(random.below(leaves.len() as u64) as usize);
        let (left, right) = (nodes.len(), nodes.len() + 1);
        nodes.extend([Node::Leaf(leaf(random)), Node::Leaf(leaf(random))]);
        leaves.extend([left, right]);
        nodes[node] = split(random, left, right);
    }
    Tree { nodes }
}

/// Returns a split. Most thresholds are near a value that many share; the others are anywhere.
fn split<L>(random: &mut Random, left: usize, right: usize) -> Node<L> {
    let threshold = match random.below(4) {
        0 => random.below(66_000) as f64 - 33_000.0,
        1 => random.below(600) as f64 - 300.0,
        _ => random.below(9000) as f64 - 8000.0,
    };
    let (input, strict) = (random.below(700) as usize, random.below(2) == 0);
    Node::Split { input, threshold: (threshold + random.below(2) as f64 * 0.5) / 2048.0, strict, left, right }
}

/// Returns a tree whose depth is its number of splits; every other one continues on the right.
fn chain(random: &mut Random, splits: usize) -> Tree<Vec<(u16, f64)>> {
    let mut nodes = Vec::new();
    for number in 0..splits {
        let (leaf, next) = (2 * number + 1, 2 * number + 2);
        let (left, right) = if number % 2 == 0 { (leaf, next) } else { (next, leaf) };
        // Samples go far down: most thresholds lead to the next split.
        let end = if number % 2 == 0 { -32_768.0 } else { 32_767.0 };
        let near = random.below(if number % 50 == 0 { 65_536 } else { 40 }) as f64 + 1.0;
        let threshold = (if number % 2 == 0 { end + near } else { end - near }) / 2048.0;
        nodes.push(Node::Split { input: random.below(700) as usize, threshold, strict: false, left, right });
        nodes.push(Node::Leaf(vec![(random.below(10) as u16, 1.0)]));
    }
    nodes.push(Node::Leaf(vec![(3, 1.0)]));
    Tree { nodes }
}

fn pure(classes: u64) -> impl Fn(&mut Random) -> Vec<(u16, f64)> {
    move |random| vec![(random.below(classes) as u16, 1.0)]
}

/// Returns random samples. Half of their numbers are exactly on thresholds of the models, one below or one above.
fn samples(random: &mut Random, models: &[Trained], count: usize) -> Vec<[i16; INPUTS]> {
    let mut thresholds = vec![Vec::new(); INPUTS];
    let mut add = |input: usize, threshold: f64| {
        thresholds[file_order(input, 70)].push((threshold * 2048.0).floor().clamp(-32_768.0, 32_767.0) as i16);
    };
    for model in models {
        match &model.kind {
            Kind::Forest(trees) => trees.iter().for_each(|tree| each_threshold(tree, &mut add)),
            Kind::Boosted(boosted) => {
                boosted.scores.iter().flat_map(|score| &score.trees).for_each(|tree| each_threshold(tree, &mut add));
            }
            Kind::Linear(_) | Kind::Network(_) => {}
        }
    }
    let one = |random: &mut Random, on: &Vec<i16>| match random.below(4) {
        0 | 1 if !on.is_empty() => {
            on[random.below(on.len() as u64) as usize].saturating_add(random.below(3) as i16 - 1)
        }
        2 => random.below(12_768) as i16 - 9471,
        _ => random.bits() as i16,
    };
    let mut samples = vec![[0; INPUTS]; count];
    for sample in &mut samples {
        for (x, on) in sample.iter_mut().zip(&thresholds) {
            *x = one(random, on);
        }
    }
    samples
}

fn each_threshold<L>(tree: &Tree<L>, give: &mut impl FnMut(usize, f64)) {
    for node in &tree.nodes {
        if let Node::Split { input, threshold, .. } = node {
            give(*input, *threshold);
        }
    }
}

fn text(model: &Trained, options: Options) -> String {
    source(model, "trained \"file\"\n", "a trainer", options).unwrap().text
}

/// Checks that generated Rust answers like model files, and that every answer occurs.
fn same_answers(
    name: &str,
    models: &[Trained],
    options: Options,
    optimization: &str,
    count: usize,
) -> (Crate, Vec<Vec<u8>>) {
    let sources: Vec<String> = models.iter().map(|model| text(model, options)).collect();
    let made = Crate::new(name, &sources, optimization);
    let files: Vec<Vec<u32>> = models.iter().map(|model| write(model, "", options).unwrap().words).collect();
    let read: Vec<Model> = files.iter().map(|words| Model::from_words(words).unwrap()).collect();
    let samples = samples(&mut Random::new(9), models, count);
    let answers = made.answers(&samples);
    for (sample, answers) in samples.iter().zip(&answers) {
        for (number, (model, &answer)) in read.iter().zip(answers).enumerate() {
            assert_eq!(answer, model.classify(sample), "model {number} of {name}");
        }
    }
    (made, answers)
}

/// Checks that the answers of a model differ, so that the comparison is meaningful.
fn assert_different(answers: &[Vec<u8>], model: usize) {
    assert!(answers.iter().any(|answer| answer[model] != answers[0][model]), "model {model}");
}

#[test]
fn forests_answer_as_tables_do() {
    let mut random = Random::new(1);
    let mut forest = |trees: usize, splits: u64, classes: u64| {
        let tree = |_| {
            let splits = random.below(splits) as usize;
            tree(&mut random, splits, pure(classes))
        };
        model(classes as usize, Kind::Forest((0..trees).map(tree).collect()))
    };
    // Votes in shared registers, one tree, an odd number of trees, and separate votes for many classes or trees.
    let mut models = vec![
        forest(20, 60, 10),
        forest(1, 30, 4),
        forest(21, 20, 2),
        forest(9, 60, 40),
        forest(300, 4, 3),
        forest(3, 4, 1),
    ];
    // Leaves of several classes, some of them pure.
    let mut random = Random::new(2);
    let mixed = |random: &mut Random| {
        let first = random.below(8) as u16;
        let (part, of) = [(1.0, 2.0), (1.0, 3.0), (2.0, 7.0), (1.0, 1.0)][random.below(4) as usize];
        vec![(first, part / of), (first + 1, 1.0 - part / of)]
    };
    models.push(model(9, Kind::Forest((0..15).map(|_| tree(&mut random, 30, mixed)).collect())));
    // All classes tie; trees of one leaf.
    let leaf = |class: u16| Tree { nodes: vec![Node::Leaf(vec![(class, 1.0)])] };
    models.push(model(5, Kind::Forest(vec![leaf(4), leaf(2), leaf(3), leaf(1)])));
    models.push(model(
        5,
        Kind::Forest(vec![Tree { nodes: vec![Node::Leaf((0..5).map(|class| (class, 0.2)).collect())] }]),
    ));
    let decided_early = models.len();
    // Most leaves belong to one class, so that most samples have a majority, and some of the others tie.
    let mut skewed = |trees: usize, classes: u64, favor: u64| {
        let leaf = |random: &mut Random| {
            let class = if random.below(100) < favor { classes - 1 } else { random.below(classes) };
            vec![(class as u16, 1.0)]
        };
        model(classes as usize, Kind::Forest((0..trees).map(|_| tree(&mut random, 9, leaf)).collect()))
    };
    models.extend([
        skewed(100, 10, 45),
        skewed(255, 5, 40),
        skewed(254, 2, 0),
        skewed(2, 3, 30),
        skewed(3, 9, 30),
        // Votes in registers of their own, which no majority ends.
        skewed(60, 13, 60),
    ]);
    let (made, answers) = same_answers("forests", &models, Options::default(), "opt-level=2", 3000);
    assert!(!made.can_panic());
    assert_eq!((answers[0][5], answers[0][7], answers[0][8]), (0, 1, 0));
    for model in [0, 1, 2, 3, 4, 6] {
        assert_different(&answers, model);
    }
    let samples = samples(&mut Random::new(9), &models, 3000);
    for (number, model) in models.iter().enumerate().skip(decided_early) {
        let Kind::Forest(trees) = &model.kind else { unreachable!() };
        let words = write(model, "", Options::default()).unwrap().words;
        let unit = 1 + trees.len() as i64 / 2;
        let scores: Vec<Vec<i64>> = samples.iter().map(|sample| sorted_scores(&words, sample)).collect();
        let most = scores.iter().filter(|scores| scores[0] >= unit).count();
        // Answers are compared on both sides of a majority, and right at it.
        assert!((10..3000).contains(&most), "model {number}: {most}");
        assert!(scores.iter().any(|scores| scores[0] == unit || scores[0] == unit - 1), "model {number}");
    }
}

#[test]
fn boosted_trees_answer_as_tables_do() {
    let mut random = Random::new(3);
    let mut boosted = |scores: usize, trees: usize, splits: u64, whole: bool| {
        let leaf = |random: &mut Random| {
            if whole { (random.below(2001) as f32 - 1000.0) / 1024.0 } else { random.below(1000) as f32 / 777.0 - 0.6 }
        };
        let scores: Vec<Score> = (0..scores)
            .map(|score| Score {
                start: score as f32 * 0.125,
                trees: (0..trees)
                    .map(|_| {
                        let splits = random.below(splits) as usize;
                        tree(&mut random, splits, leaf)
                    })
                    .collect(),
            })
            .collect();
        model(scores.len().max(2), Kind::Boosted(Boosted { scores, bound: 0.25 }))
    };
    let mut models = vec![
        boosted(4, 6, 10, true),
        boosted(4, 6, 10, false),
        boosted(1, 12, 10, true),
        boosted(1, 12, 10, false),
        boosted(3, 0, 1, true),
        boosted(4, 5, 1, false),
    ];
    // More splits for one score than one function has.
    let large = boosted(1, 4, 1500, false);
    // Scores of a few values tie often, and the first class of the highest ones is the answer, even if one is left
    // early.
    let mut coarse = |scores: usize, trees: usize, start: f32| {
        let leaf = |random: &mut Random| (random.below(3) as f32 - 1.0) / 4.0;
        let scores: Vec<Score> = (0..scores)
            .map(|_| Score { start, trees: (0..trees).map(|_| tree(&mut random, 5, leaf)).collect() })
            .collect();
        model(scores.len().max(2), Kind::Boosted(Boosted { scores, bound: 0.25 }))
    };
    models.extend([coarse(5, 15, 0.0), coarse(3, 50, 0.5), coarse(1, 30, 0.0), coarse(7, 2, 0.25), coarse(2, 1, 0.0)]);
    let samples = samples(&mut Random::new(9), &models, 3000);
    for (number, model) in models.iter().enumerate().skip(6) {
        let words = write(model, "", Options::default()).unwrap().words;
        let ties = samples.iter().map(|sample| sorted_scores(&words, sample)).filter(|scores| scores[0] == scores[1]);
        assert!(ties.count() > 10, "model {number}");
    }
    models.push(large);
    for leaves in [Leaves::Auto, Leaves::Int16, Leaves::Float32] {
        let options = Options { leaves, ..Options::default() };
        // The large model takes most of the time to compile, and its leaves are as those of the others.
        let models = if leaves == Leaves::Auto { &models[..] } else { &models[..11] };
        let (made, answers) = same_answers(&format!("boosted-{leaves:?}"), models, options, "opt-level=2", 3000);
        assert!(!made.can_panic());
        for model in [0, 1, 2, 3, 11].into_iter().filter(|model| *model < models.len()) {
            assert_different(&answers, model);
        }
        let float = text(&models[0], options).contains("f32");
        assert_eq!(float, leaves == Leaves::Float32, "{leaves:?}");
    }
}

/// Returns the scores or votes of a model's classes for a sample, the highest first.
fn sorted_scores(words: &[u32], sample: &[i16; INPUTS]) -> Vec<i64> {
    let mut scores = Vec::new();
    Model::from_words(words).unwrap().each_score(sample, |_, score| scores.push(score));
    scores.sort_unstable_by(|a, b| b.cmp(a));
    scores
}

#[test]
fn sums_that_float32_rounds_up_win() {
    let leaf = |value: f32| Tree { nodes: vec![Node::Leaf(value)] };
    // From 2^24 on, float32 is even: each sum with 1.5 is rounded up to 2 more, and 40 of them to 80 more than 2^24,
    // not to 60. The other score is between.
    let up = Score { start: 16_777_216.0, trees: (0..40).map(|_| leaf(1.5)).collect() };
    let mut fixed: Vec<Tree<f32>> = (0..39).map(|_| leaf(0.0)).collect();
    fixed.insert(0, leaf(16_777_286.0));
    let fixed = Score { start: 0.0, trees: fixed };
    let models = [
        model(2, Kind::Boosted(Boosted { scores: vec![fixed.clone(), up.clone()], bound: 0.0 })),
        model(2, Kind::Boosted(Boosted { scores: vec![up.clone(), fixed], bound: 0.0 })),
        model(2, Kind::Boosted(Boosted { scores: vec![up], bound: 16_777_286.0 })),
    ];
    let options = Options { leaves: Leaves::Float32, ..Options::default() };
    let (_, answers) = same_answers("rounded-up", &models, options, "opt-level=2", 2);
    assert_eq!(answers, [[1, 0, 1], [1, 0, 1]]);
}

#[test]
fn deep_and_large_trees_compile() {
    let mut random = Random::new(4);
    let models = [
        model(10, Kind::Forest(vec![chain(&mut random, 300)])),
        model(10, Kind::Forest(vec![chain(&mut random, 1000)])),
        // Many functions. The largest tree has five times as many nodes, and takes the compiler five times as long.
        model(10, Kind::Forest(vec![tree(&mut random, 6_000, pure(10))])),
    ];
    for model in &models {
        let deepest = text(model, Options::default()).lines().map(|line| line.len() - line.trim_start().len()).max();
        assert!(deepest.unwrap() <= 4 * 20, "{deepest:?}");
    }
    let (_, answers) = same_answers("large", &models, Options::default(), "opt-level=0", 2000);
    for model in 0..3 {
        assert_different(&answers, model);
    }
}

#[test]
fn a_panic_would_be_found() {
    let mut random = Random::new(5);
    let forest = model(3, Kind::Forest(vec![tree(&mut random, 10, pure(3))]));
    let text = text(&forest, Options::default());
    let panics = text.replacen("i32::from(s[", "i32::from(s[s[0] as usize + ", 1);
    assert_ne!(text, panics);
    assert!(Crate::new("panics", &[panics], "opt-level=2").can_panic());
}

#[test]
fn what_is_generated_says_what_it_is() {
    let mut random = Random::new(6);
    let mut short = model(3, Kind::Forest(vec![tree(&mut random, 10, pure(3)), tree(&mut random, 5, pure(3))]));
    if let Kind::Forest(trees) = &mut short.kind {
        for node in trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
            if let Node::Split { input, .. } = node {
                *input %= 300;
            }
        }
    }
    short.inputs = 300;
    let first = text(&short, Options::default());
    let lines: Vec<&str> = first.lines().collect();
    assert_eq!(
        lines[0],
        r#"// Made by `wstac model import` from the file "trained \"file\"\n" of "a trainer": do not edit."#
    );
    assert!(
        lines[1].starts_with("// 3 classes, 2 trees, ")
            && lines[1].ends_with(" splits; thresholds and votes are exact.")
    );
    assert!(
        first.contains(r#"pub const LABELS: [&str; 3] = ["\"Klasse\" 0\n\\ µ𝛼", "#)
            && first.contains("FRAMES: usize = 30;")
    );
    assert_eq!(first, text(&short, Options::default()));
    let row = Row { weights: vec![1.0; 700], bias: 0.0 };
    let linear = model(2, Kind::Linear(Linear { pairs: false, rows: vec![row] }));
    let error = source(&linear, "", "", Options::default()).unwrap_err();
    assert!(error.contains("linear") && error.contains("table"), "{error}");
    let error = source(&model(0, Kind::Forest(vec![])), "", "", Options::default()).unwrap_err();
    assert!(error.contains("0 classes"), "{error}");
}

fn import(file: &Path, output: &Path, more: &[&str]) -> Output {
    program(wstac()).args(["model", "import"]).arg(file).arg("-o").arg(output).args(more).output().unwrap()
}

#[test]
fn the_output_says_which_backend() {
    let folder = Folder::new("command");
    let file = folder.file("trained.json", XGBOOST);
    let is_rust = |path: &Path| fs::read(path).unwrap().starts_with(b"// Made by");
    for (name, more, rust) in [
        ("a.rs", &[][..], true),
        ("b.wsm", &[], false),
        ("c", &[], false),
        ("d.txt", &["--backend", "inline"], true),
        ("e.rs", &["--backend", "inline"], true),
        ("f.bin", &["--backend", "table"], false),
    ] {
        let output = folder.0.join(name);
        let done = import(&file, &output, more);
        assert!(done.status.success(), "{name}: {}", String::from_utf8_lossy(&done.stderr));
        assert_eq!(is_rust(&output), rust, "{name}");
        assert!(!import(&file, &output, more).status.success(), "{name} is written over");
    }
    for (name, backend) in [("g.rs", "table"), ("g.wsm", "inline")] {
        let output = folder.0.join(name);
        says(&import(&file, &output, &["--backend", backend]), 2, &[name, "--backend"]);
        assert!(!output.exists());
    }
    let first = fs::read_to_string(folder.0.join("a.rs")).unwrap();
    let made = Crate::new("from-command", &[first], "opt-level=2");
    let mut samples = [[0_i16; INPUTS]; 4];
    for (sample, x) in samples.iter_mut().zip([-3073, -3072, -32_768, 5]) {
        sample[69 * 10] = x;
    }
    assert_eq!(made.answers(&samples), [[0], [1], [0], [1]]);
}
