use wstac_core::model::file::{INPUTS, Input, ModelError, TAXEL_INPUTS, Task};
use wstac_core::model::network::Network as FileNetwork;
use wstac_core::model::speeds::KnownSpeeds;
use wstac_core::model::trees::NARROW;
use wstac_core::texture::texture;
use wstac_scene::rng::SplitMix64;

use super::super::trained::{Boosted, Linear, Network, Node, Row, Score, Tree, file_order, in_file_order};
use super::*;
use crate::model::inspect::inspect;

/// Random models and samples.
struct Chance(SplitMix64);

impl Chance {
    fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    fn next(&mut self, below: u64) -> u64 {
        self.0.bits() % below
    }

    fn sample(&mut self, thresholds: &[(usize, i16)]) -> [i16; INPUTS] {
        let mut sample = [0; INPUTS];
        sample.fill_with(|| self.next(65_536) as i16);
        // Half of the samples are on thresholds or next to them.
        for &(input, threshold) in thresholds {
            if self.next(2) == 0 {
                sample[input] = threshold.saturating_add(self.next(3) as i16 - 1);
            }
        }
        sample
    }
}

/// Creates a random tree of `splits` splits over the first inputs of a sample of 70 frames.
///
/// Its thresholds are within the samples' range.
fn tree<L>(chance: &mut Chance, splits: usize, mut leaf: impl FnMut(&mut Chance) -> L) -> Tree<L> {
    let mut nodes = vec![Node::Leaf(leaf(chance))];
    let mut leaves = vec![0];
    for _ in 0..splits {
        let node = leaves.swap_remove(chance.next(leaves.len() as u64) as usize);
        let (left, right) = (nodes.len(), nodes.len() + 1);
        nodes.push(Node::Leaf(leaf(chance)));
        nodes.push(Node::Leaf(leaf(chance)));
        leaves.extend([left, right]);
        let threshold = (chance.next(70_000) as f64 - 35_000.0 + chance.next(2) as f64 * 0.5) / 2048.0;
        let (input, strict) = (chance.next(700) as usize, chance.next(2) == 0);
        nodes[node] = Node::Split { input, threshold, strict, left, right };
    }
    Tree { nodes }
}

/// Returns the leaf of a sample in the order of data sets, found as the trainer would.
fn walk<'a, L>(tree: &'a Tree<L>, sample: &[i16]) -> &'a L {
    let mut at = 0;
    loop {
        match &tree.nodes[at] {
            Node::Leaf(leaf) => return leaf,
            Node::Split { input, threshold, strict, left, right } => {
                let x = f64::from(sample[*input]) / 2048.0;
                at = if if *strict { x < *threshold } else { x <= *threshold } { *left } else { *right };
            }
        }
    }
}

fn thresholds<L>(tree: &Tree<L>) -> Vec<(usize, i16)> {
    tree.nodes
        .iter()
        .filter_map(|node| match node {
            Node::Split { input, threshold, .. } => Some((*input, (threshold * 2048.0).floor() as i16)),
            Node::Leaf(_) => None,
        })
        .collect()
}

fn to_file(sample: &[i16; INPUTS]) -> [i16; INPUTS] {
    let mut file = [0; INPUTS];
    for (input, &value) in sample.iter().enumerate() {
        file[file_order(input, 70)] = value;
    }
    file
}

fn model(classes: usize, kind: Kind) -> Trained {
    let labels = (0..classes).map(|class| format!("Klasse {class} µ𝛼")).collect();
    let (task, input, remarks) = (Task::Other, Input::Frames, Vec::new());
    Trained { labels, task, input, inputs: INPUTS, speeds: None, kind, remarks, mean: None }
}

/// Writes a model as it is written without a choice.
fn written(model: &Trained) -> Written {
    write(model, "{}", Options::default()).unwrap()
}

fn leaf<L>(leaf: L) -> Tree<L> {
    Tree { nodes: vec![Node::Leaf(leaf)] }
}

/// Returns a tree of one split, of the first input at 0.
fn split<L>(left: L, right: L) -> Tree<L> {
    let split = Node::Split { input: 0, threshold: 0.0, strict: false, left: 1, right: 2 };
    Tree { nodes: vec![split, Node::Leaf(left), Node::Leaf(right)] }
}

fn same_answers(
    model: &Trained,
    thresholds: &[(usize, i16)],
    options: Options,
    expected: impl Fn(&[i16; INPUTS]) -> usize,
) -> Vec<u32> {
    let words = write(model, "{}", options).unwrap().words;
    let read = Model::from_words(&words).unwrap();
    for (class, label) in model.labels.iter().enumerate() {
        assert!(read.labels().get(class).unwrap() == *label.as_str());
    }
    let mut chance = Chance::new(5);
    for _ in 0..10_000 {
        let sample = chance.sample(thresholds);
        assert_eq!(usize::from(read.classify(&to_file(&sample))), expected(&sample));
    }
    words
}

/// Returns the class of the pure leaf in which a sample ends.
fn pure(tree: &Tree<Vec<(u16, f64)>>, sample: &[i16; INPUTS]) -> usize {
    usize::from(walk(tree, sample)[0].0)
}

#[test]
fn trees_whose_offsets_need_a_shift_are_the_same() {
    let mut chance = Chance::new(2);
    let mut tree = tree(&mut chance, 40_000, |chance| vec![(chance.next(60) as u16, 1.0)]);
    // The same tree once more, right of a new root.
    let nodes = tree.nodes.len();
    for node in 0..nodes {
        tree.nodes.push(match tree.nodes[node].clone() {
            Node::Split { input, threshold, strict, left, right } => {
                Node::Split { input, threshold, strict, left: left + nodes, right: right + nodes }
            }
            Node::Leaf(leaf) => Node::Leaf(leaf),
        });
    }
    tree.nodes.push(tree.nodes[0].clone());
    tree.nodes[0] = Node::Split { input: 7, threshold: 0.0, strict: false, left: 2 * nodes, right: nodes };
    let trained = model(60, Kind::Forest(vec![tree.clone()]));
    let words = same_answers(&trained, &thresholds(&tree)[..700], Options::default(), |sample| pure(&tree, sample));
    assert!(words[7] > 0, "{}", words[7]);
}

#[test]
fn votes_of_impure_leaves_are_exact() {
    let mut chance = Chance::new(3);
    let mut trees = Vec::new();
    for _ in 0..15 {
        trees.push(tree(&mut chance, 60, |chance| {
            let first = chance.next(8) as u16;
            let (part, of) = [(1.0, 2.0), (1.0, 3.0), (2.0, 7.0), (1.0, 1.0)][chance.next(4) as usize];
            vec![(first, part / of), ((first + 1) % 9, 1.0 - part / of)]
        }));
    }
    let all: Vec<(usize, i16)> = trees.iter().flat_map(thresholds).collect();
    let trained = model(9, Kind::Forest(trees.clone()));
    let written = written(&trained);
    assert_eq!(written.exactness, "thresholds and votes are exact");
    assert_eq!(written.words[8], 42);
    let words = same_answers(&trained, &all, Options::default(), |sample| {
        let mut votes = [0; 9];
        for tree in &trees {
            for (class, share) in walk(tree, sample) {
                votes[usize::from(*class)] += (share * 42.0).round() as u32;
            }
        }
        (0..9).rev().max_by_key(|&class| votes[class]).unwrap()
    });
    let found = inspect(&Model::from_words(&words).unwrap(), &words).trees.unwrap();
    assert_eq!(found.count, 15);
    assert!(found.splits <= 15 * 60 && found.visits_worst >= found.depth && found.visits_mean > 1.0);
}

#[test]
fn leaves_that_are_no_fractions_are_rounded_within_the_bound() {
    let mut chance = Chance::new(4);
    let tree = tree(&mut chance, 300, |chance| {
        let share = chance.next(1 << 30) as f64 / f64::from(1 << 30);
        vec![(0, share), (1, 1.0 - share)]
    });
    let trained = model(2, Kind::Forest(vec![tree.clone()]));
    assert!(written(&trained).exactness.contains("in units of 1/4190266080"));
    same_answers(&trained, &thresholds(&tree), Options::default(), |sample| {
        usize::from(walk(&tree, sample)[1].1 > 0.5)
    });
}

#[test]
fn boosted_trees_add_up_in_order() {
    let mut chance = Chance::new(6);
    let scores: Vec<Score> = (0..4)
        .map(|score| Score {
            start: score as f32 * 0.1,
            trees: (0..7).map(|_| tree(&mut chance, 20, |chance| chance.next(1000) as f32 / 777.0 - 0.6)).collect(),
        })
        .collect();
    let all: Vec<(usize, i16)> = scores.iter().flat_map(|score| &score.trees).flat_map(thresholds).collect();
    let sum = |score: &Score, sample: &[i16; INPUTS]| {
        score.trees.iter().fold(score.start, |sum, tree| sum + walk(tree, sample))
    };
    let trained = model(4, Kind::Boosted(Boosted { scores: scores.clone(), bound: 0.0 }));
    same_answers(&trained, &all, Options::default(), |sample| {
        (0..4).rev().max_by(|&a, &b| sum(&scores[a], sample).total_cmp(&sum(&scores[b], sample))).unwrap()
    });
    let single = Boosted { scores: scores[..1].to_vec(), bound: 0.25 };
    let trained = model(2, Kind::Boosted(single));
    same_answers(&trained, &all, Options::default(), |sample| usize::from(sum(&scores[0], sample) > 0.25));
    // Rounded leaves decide alike if scores are not close.
    let short = Options { leaves: Leaves::Int16, ..Options::default() };
    let words = write(&trained, "", short).unwrap().words;
    let read = Model::from_words(&words).unwrap();
    for _ in 0..2000 {
        let sample = chance.sample(&all);
        let score = sum(&scores[0], &sample);
        if (score - 0.25).abs() > 1e-3 {
            assert_eq!(read.classify(&to_file(&sample)), u8::from(score > 0.25));
        }
    }
}

#[test]
fn a_linear_model_that_rounding_or_its_unit_spoils_has_a_warning() {
    let row = |weights: &[f64], bias: f64| {
        let mut all = weights.to_vec();
        all.resize(INPUTS, 0.0);
        Row { weights: all, bias }
    };
    let many = |size: f64| vec![size; 400];
    let of = |pairs: bool, classes: usize, rows: Vec<Row>, weights: Weights| {
        let trained = model(classes, Kind::Linear(Linear { pairs, rows }));
        let said = write(&trained, "", Options { weights: Some(weights), ..Options::default() }).unwrap().exactness;
        said.split_once("; warning: ").map(|(_, warning)| warning.to_owned())
    };
    let three = |sizes: &[f64], bias: f64| vec![row(sizes, bias), row(&many(-0.25), 0.0), row(&many(0.1), 0.0)];
    // Healthy: also without weights of one class, and with a bias that some features overcome.
    for pairs in [false, true] {
        assert_eq!(of(pairs, 3, three(&many(0.3), 5.0), Weights::Int16), None);
    }
    assert_eq!(of(false, 3, three(&[], 0.1), Weights::Int16), None);
    assert_eq!(of(false, 2, vec![row(&many(0.3), 0.0)], Weights::Int8), None);
    // In units of samples: 400 weights cannot overcome the bias.
    let small = |bias: f64| ["many", "other"].map(|_| row(&many(0.3 / 2048.0), bias));
    let said = of(true, 3, [&small(9.0)[..], &[row(&many(0.3), 0.0)]].concat(), Weights::Int16).unwrap();
    let one_winner = "2 of 3 pairs of classes can have only one winner for features of -4.62 to 1.61";
    assert!(said.starts_with(one_winner), "{said}");
    assert!(said.ends_with("help: train it on X * scale (scale is 1/2048)"), "{said}");
    assert!(of(false, 2, small(-9.0)[..1].to_vec(), Weights::Int16).unwrap().starts_with("1 of 1 pair of classes"));
    let said = of(false, 3, three(&many(0.3), 9000.0), Weights::Int16).unwrap();
    assert!(said.starts_with("2 of 3 classes can never be the answer"), "{said}");
    // One weight is so large that the others are rounded by half a unit of 0.02, or less in the second pair.
    let large = |most: f64| row(&[&[most][..], &many(0.01)].concat(), 0.0);
    let said = of(true, 3, vec![large(650.0), large(3.0), large(650.0)], Weights::Int16).unwrap();
    let rounded = "rounded weights may change the scores of 2 of 3 pairs of classes by the margin";
    assert!(said.starts_with(rounded) && said.contains("X * scale"), "{said}");
    let said = of(false, 3, vec![large(650.0), large(3.0), large(650.0)], Weights::Int16).unwrap();
    assert!(said.starts_with("rounded weights may change the scores of 3 of 3 classes"), "{said}");
    // The same in any small unit.
    let tiny = |row: Row| Row { weights: row.weights.iter().map(|weight| weight * 1e-6).collect(), bias: 0.0 };
    assert!(of(true, 2, vec![tiny(large(3.0))], Weights::Int8).is_some());
    assert_eq!(of(true, 2, vec![tiny(large(3.0))], Weights::Int16), None);
    // Without a choice they are wider.
    let rows = vec![large(650.0), large(3.0), large(650.0)];
    assert_eq!(of(false, 3, rows.clone(), Weights::Int32), None);
    let written = written(&model(3, Kind::Linear(Linear { pairs: false, rows })));
    assert!(written.exactness.starts_with("weights are int32, twice as large"), "{}", written.exactness);
    assert_eq!(inspect(&Model::from_words(&written.words).unwrap(), &written.words).numbers, "int32");
}

#[test]
fn linear_models_decide_as_real_numbers_do() {
    let mut chance = Chance::new(7);
    for (pairs, classes, rows) in [(false, 7, 7), (false, 2, 1), (true, 6, 15), (true, 2, 1)] {
        let rows: Vec<Row> = (0..rows)
            .map(|_| Row {
                weights: (0..INPUTS).map(|_| chance.next(2_000_001) as f64 * 1e-6 - 1.0).collect(),
                bias: chance.next(1000) as f64 / 100.0 - 5.0,
            })
            .collect();
        let trained = model(classes, Kind::Linear(Linear { pairs, rows: rows.clone() }));
        for width in [Weights::Int8, Weights::Int16, Weights::Int32] {
            let written = write(&trained, "", Options { weights: Some(width), ..Options::default() }).unwrap();
            let read = Model::from_words(&written.words).unwrap();
            // The bound is that of usual features.
            let margin = 2.0 * written.score_bound;
            let mut decided = 0;
            for _ in 0..500 {
                let mut sample = [0; INPUTS];
                sample.fill_with(|| chance.next(12_768) as i16 - 9471);
                let sums: Vec<f64> = rows
                    .iter()
                    .map(|row| {
                        let products =
                            row.weights.iter().zip(&sample).map(|(weight, &x)| weight * f64::from(x) / 2048.0);
                        products.sum::<f64>() + row.bias
                    })
                    .collect();
                let Some(expected) = decide(pairs, classes, &sums, margin) else { continue };
                decided += 1;
                assert_eq!(usize::from(read.classify(&to_file(&sample))), expected);
            }
            assert!(decided > if width == Weights::Int8 { 0 } else { 450 }, "{width:?} {decided}");
            assert!(width != Weights::Int32 || written.score_bound < 1e-4, "{}", written.score_bound);
        }
    }
}

#[test]
fn a_network_decides_as_real_numbers_do() {
    let mut chance = Chance::new(11);
    let mut number = || chance.next(2_000_001) as f64 * 1e-6 - 1.0;
    for (classes, widths) in [(5, &[30, 5][..]), (4, &[20, 16, 4]), (2, &[7, 1])] {
        let mut inputs = INPUTS;
        let mut layers = vec![];
        for &sums in widths {
            // As a trainer starts: sums stay in the size of their inputs.
            let size = (2.0 / inputs as f64).sqrt();
            let mut row = || Row { weights: (0..inputs).map(|_| size * number()).collect(), bias: size * number() };
            layers.push((0..sums).map(|_| row()).collect::<Vec<Row>>());
            inputs = sums;
        }
        let mut sample = || [(); INPUTS].map(|()| (6000.0 * number()) as i16 - 3000);
        let samples: Vec<[i16; INPUTS]> = (0..400).map(|_| sample()).collect();
        let network = Network { layers, tops: None };
        let scores = |sample: &[i16; INPUTS]| network.sums(&sample.map(|x| f64::from(x) / 2048.0));
        let answer = |scores: &[f64]| {
            let [one] = scores else {
                let best = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b])).unwrap();
                let rest = (0..scores.len()).filter(|other| *other != best);
                return (best as u8, scores[best] - rest.fold(f64::NEG_INFINITY, |most, at| most.max(scores[at])));
            };
            (u8::from(*one > 0.0), one.abs())
        };
        // The ranges of hidden values, from half of the samples.
        let tops = (0..widths.len() - 1).map(|layer| {
            (0..widths[layer])
                .map(|row| samples[..200].iter().fold(0.0_f64, |top, sample| top.max(2.0 * scores(sample)[layer][row])))
                .collect()
        });
        for (width, tops, least) in [
            (Weights::Int8, None, 0.8),
            (Weights::Int16, None, 0.97),
            (Weights::Int16, Some(tops.collect::<Vec<Vec<f64>>>()), 0.99),
        ] {
            let trained = model(classes, Kind::Network(Network { tops, ..network.clone() }));
            let written = write(&trained, "", Options { weights: Some(width), ..Options::default() }).unwrap();
            let read = Model::from_words(&written.words).unwrap();
            let found = inspect(&read, &written.words);
            let expected = (2, "network".into(), Some(widths.to_vec()));
            assert_eq!((read.layout(), found.kind.to_string(), found.layers), expected);
            // The firmware's type is of this kind alone.
            let (alone, first) = (FileNetwork::from_words(&written.words).unwrap(), to_file(&samples[0]));
            assert_eq!(texture(&first, &alone).class, read.classify(&first));
            let (mut alike, mut wrong) = (0, 0.0_f64);
            for sample in &samples {
                let (class, margin) = answer(scores(sample).last().unwrap());
                if read.classify(&to_file(sample)) == class {
                    alike += 1;
                } else {
                    wrong = wrong.max(margin);
                }
            }
            let share = f64::from(alike) / samples.len() as f64;
            assert!(share >= least, "{widths:?} {width:?}: {share}, margins to {wrong}");
        }
    }
}

/// Returns the class for which sums decide, or `None` if one of them is within the margin.
fn decide(pairs: bool, classes: usize, sums: &[f64], margin: f64) -> Option<usize> {
    if !pairs && sums.len() == 1 {
        return (sums[0].abs() > margin).then(|| usize::from(sums[0] > 0.0));
    }
    let mut scores = sums.to_vec();
    if pairs {
        scores = vec![0.0; classes];
        let mut sums = sums.iter();
        for first in 0..classes {
            for second in first + 1..classes {
                let sum = sums.next()?;
                if sum.abs() <= margin {
                    return None;
                }
                scores[if *sum > 0.0 { first } else { second }] += 1.0;
            }
        }
    }
    let best = (0..classes).rev().max_by(|&a, &b| scores[a].total_cmp(&scores[b]))?;
    let second = (0..classes).filter(|&class| class != best).map(|class| scores[class]).fold(f64::MIN, f64::max);
    (pairs || scores[best] - second > margin).then_some(best)
}

#[test]
fn small_leaves_share_a_word_only_where_the_core_reads_that() {
    let words = written(&model(2, Kind::Forest(vec![split(vec![(0, 1.0)], vec![(1, 1.0)])]))).words;
    let halves: Vec<u16> = words.iter().flat_map(|word| [*word as u16, (word >> 16) as u16]).collect();
    assert!(halves.contains(&(NARROW | 0xC000)));
}

#[test]
fn votes_near_plain_fractions_are_not_called_exact() {
    for off in [1e-7, 1e-10] {
        let tree = leaf(vec![(0, 0.5 + off), (1, 0.5 - off)]);
        let said = written(&model(2, Kind::Forest(vec![tree]))).exactness;
        assert!(said.contains("votes are in units of"), "{said}");
    }
}

#[test]
fn shares_above_one_vote_are_rounded_down_to_it() {
    // The larger fraction is already rounded down, and the other one is zero: neither has a unit from rounding up.
    for more in (1..100).map(|step| f64::from(step) * 7e-9) {
        let written = written(&model(2, Kind::Forest(vec![leaf(vec![(0, 1.0 + more), (1, 1e-12)])])));
        assert_eq!(Model::from_words(&written.words).unwrap().classify(&[0; INPUTS]), 0);
    }
}

#[test]
fn too_many_different_leaves_are_refused_with_what_to_do() {
    let mut chance = Chance::new(5);
    let tree = tree(&mut chance, 9000, |chance| {
        let parts: Vec<u64> = (0..20).map(|_| chance.next(1 << 20)).collect();
        let sum: u64 = parts.iter().sum();
        (0..).zip(&parts).map(|(class, &part)| (class, part as f64 / sum as f64)).collect::<Vec<(u16, f64)>>()
    });
    let error = write(&model(20, Kind::Forest(vec![tree])), "", Options::default()).unwrap_err();
    assert!(error.contains("expected at most 65515") && error.contains("min_samples_leaf"), "{error}");
}

#[test]
fn what_cannot_be_written_is_said() {
    let boosted = |number: f32| {
        let scores = vec![Score { start: 0.0, trees: vec![leaf(number)] }];
        Kind::Boosted(Boosted { scores, bound: 0.0 })
    };
    let leaf = |share: f64| leaf(vec![(0, share)]);
    let row = |weight: f64| Row { weights: vec![weight; 700], bias: 0.0 };
    let network = |layers: &[(usize, usize)]| {
        let layer = |&(sums, inputs)| vec![Row { weights: vec![1.0; inputs], bias: 0.0 }; sums];
        Kind::Network(Network { layers: layers.iter().map(layer).collect(), tops: None })
    };
    for (trained, says) in [
        (model(0, Kind::Forest(vec![leaf(1.0)])), "0 classes"),
        (model(65, Kind::Forest(vec![leaf(1.0)])), "65 classes"),
        (model(2, Kind::Forest(vec![])), "0 trees"),
        (model(2, Kind::Forest(vec![leaf(1.0), leaf(f64::NAN)])), "tree 1: node 0"),
        (model(2, Kind::Forest(vec![leaf(0.4)])), "tree 0: node 0"),
        (model(2, boosted(f32::NAN)), "tree 0 of score 0: node 0: leaf NaN"),
        (model(2, boosted(f32::MAX)), "leaf 340"),
        (model(3, boosted(0.0)), "1 scores"),
        (model(3, Kind::Linear(Linear { pairs: false, rows: vec![row(1.0)] })), "1 weighted sums of 3 classes"),
        (model(2, Kind::Linear(Linear { pairs: false, rows: vec![row(f64::INFINITY)] })), "weight inf"),
        (model(3, network(&[(3, 700)])), "a network of 1 layers"),
        (model(3, network(&[(129, 700), (3, 129)])), "hidden layer 1 has 129 sums"),
        (model(3, network(&[(4, 700), (2, 4)])), "2 scores of 3 classes"),
        (model(3, network(&[(4, 700), (3, 5)])), "layer 1 has 5 weights a sum, expected 4"),
        (Trained { inputs: 699, ..model(2, boosted(0.0)) }, "699 inputs"),
    ] {
        let error = write(&trained, "", Options::default()).unwrap_err();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn equal_votes_stay_equal_where_others_are_rounded() {
    let share = std::f64::consts::FRAC_1_SQRT_2;
    let rounded = split([5, 6, 7, 8].map(|class| (class, 0.25)).to_vec(), vec![(5, share), (6, 1.0 - share)]);
    // Classes 0, 1 and 2 have 7/9 each; in units of 2^-24 the first would have less.
    let ninths = [[(0, 3.0), (3, 6.0)], [(0, 4.0), (2, 5.0)], [(1, 7.0), (2, 2.0)]];
    let mut trees: Vec<_> = ninths.map(|shares| leaf(shares.map(|(class, part)| (class, part / 9.0)).to_vec())).into();
    trees.push(rounded);
    let written = written(&model(9, Kind::Forest(trees)));
    assert!(written.exactness.contains("votes are in units of"), "{}", written.exactness);
    assert_eq!(Model::from_words(&written.words).unwrap().classify(&[0; INPUTS]), 0);
}

#[test]
fn a_file_says_at_which_speeds_its_model_was_trained() {
    let speeds = KnownSpeeds::new(50, 300);
    let rows = vec![Row { weights: vec![0.5; INPUTS], bias: 0.0 }; 2];
    let forest = || Kind::Forest([0, 1].map(|class| leaf(vec![(class, 1.0)])).into());
    for kind in [forest(), Kind::Linear(Linear { pairs: false, rows })] {
        let trained = Trained { speeds, ..model(2, kind) };
        let mut words = written(&trained).words;
        assert_eq!((words[4] >> 24, words[7] >> 8 & 0xFF), (75, 25));
        assert_eq!(Model::from_words(&words).unwrap().known_speeds(), speeds);
        // The slowest is not faster than the fastest.
        words[7] = words[7] & !0xFF00 | 151 << 8;
        words[1] = crc(&words);
        let found = Model::from_words(&words).unwrap_err();
        assert!(matches!(found, ModelError::Header { half: 14, .. }), "{found:?}");
    }
    let words = written(&model(2, forest())).words;
    assert_eq!(Model::from_words(&words).unwrap().known_speeds(), None);
}

#[test]
fn a_file_says_which_sample_its_model_takes() {
    let rows = vec![Row { weights: vec![0.5; 20], bias: 0.0 }; 3];
    for (number, input) in (0..).zip([Input::Frames, Input::Path, Input::TaxelPath]) {
        let kind = Kind::Linear(Linear { pairs: false, rows: rows.clone() });
        let trained = Trained { input, inputs: 20, ..model(3, kind) };
        let mut words = written(&trained).words;
        assert_eq!(words[7] >> 16, number, "{input:?}");
        assert_eq!(Model::from_words(&words).unwrap().input(), input);
        // Another number is that of a later version.
        words[7] = words[7] & 0xFFFF | 4 << 16;
        words[1] = crc(&words);
        let error = Model::from_words(&words).unwrap_err();
        assert_eq!(error, ModelError::Header { half: 15, found: 4 });
        let range = "(half 15 is 4, expected 0 to 3, or 256 to 259 with a calibration)";
        assert!(error.to_string().ends_with(range), "{error}");
    }
}

#[test]
fn models_of_taxels_answer_as_trained() {
    let mut chance = Chance::new(9);
    let input_of = |chance: &mut Chance| chance.next(TAXEL_INPUTS as u64) as usize;
    // Classes beyond those that fit a node, and leaves of several classes.
    let mut tree = tree(&mut chance, 500, |chance| vec![(chance.next(12) as u16, 1.0)]);
    for node in &mut tree.nodes {
        if let Node::Split { input, .. } = node {
            *input = input_of(&mut chance);
        }
    }
    let rows = |chance: &mut Chance, rows: usize, inputs: usize| -> Vec<Row> {
        let weight = |chance: &mut Chance| chance.next(2001) as f64 / 1e4 - 0.1;
        (0..rows).map(|_| Row { weights: (0..inputs).map(|_| weight(chance)).collect(), bias: 0.5 }).collect()
    };
    let linear = Linear { pairs: false, rows: rows(&mut chance, 12, TAXEL_INPUTS) };
    let layers = vec![rows(&mut chance, 20, TAXEL_INPUTS), rows(&mut chance, 12, 20)];
    let network = Network { layers, tops: None };
    let score = |number: u16| {
        let nodes = tree.nodes.iter().map(|node| match node {
            Node::Leaf(leaf) => Node::Leaf(if leaf[0].0 == number { 0.75 } else { -0.25 }),
            Node::Split { input, threshold, strict, left, right } => {
                Node::Split { input: *input, threshold: *threshold, strict: *strict, left: *left, right: *right }
            }
        });
        Score { start: 0.5, trees: vec![Tree { nodes: nodes.collect() }] }
    };
    let boosted = Boosted { scores: (0..12).map(score).collect(), bound: 0.0 };
    let kinds = [
        Kind::Forest(vec![tree.clone(), tree.clone()]),
        Kind::Boosted(boosted),
        Kind::Linear(linear.clone()),
        Kind::Network(network.clone()),
    ];
    for (number, kind) in kinds.into_iter().enumerate() {
        let trained = Trained { input: Input::Taxels, inputs: TAXEL_INPUTS, ..model(12, kind) };
        let wide = Options { weights: Some(Weights::Int32).filter(|_| number > 1), ..Options::default() };
        let words = write(&trained, "{}", wide).unwrap().words;
        let read = Model::from_words(&words).unwrap();
        assert_eq!((read.input(), read.frames()), (Input::Taxels, 175));
        let mut same = 0;
        for _ in 0..500 {
            let sample: Vec<i16> = (0..TAXEL_INPUTS).map(|_| -(chance.next(9000) as i16)).collect();
            let x: Vec<f64> = sample.iter().map(|&x| f64::from(x) / 2048.0).collect();
            let highest = |sums: &[f64]| (0..12).rev().max_by(|&a: &usize, &b| sums[a].total_cmp(&sums[b])).unwrap();
            let sums = || -> Vec<f64> { linear.rows.iter().map(|row| row.sum(&x)).collect() };
            let expected = match number {
                0 | 1 => usize::from(walk(&tree, &sample)[0].0),
                2 => highest(&sums()),
                _ => highest(network.sums(&x).last().unwrap()),
            };
            same += usize::from(usize::from(read.classify(&in_file_order(&sample))) == expected);
        }
        // Rounding of weights may decide between scores that are nearly equal.
        assert!(same >= if number < 2 { 500 } else { 498 }, "{number}: {same}");
    }
}
