//! Compares the answers of a trained model with those of its model file, and with the labels of a data set.

use std::path::Path;

use wstac_core::model::Model;
use wstac_core::model::file::TAXEL_INPUTS;
use wstac_core::params::{FEATURE_ONE, FEATURES, SAMPLE_FRAMES};
use wstac_host::error::{Error, ErrorKind};

use super::eval::{Truth, array_of, is_sample, samples, truth};
use super::npz::Npz;
use super::trained::{Kind, Linear, Network, Node, Row, Trained, Tree, ends, in_file_order};
use super::{integers, usual_mean};

/// Largest fraction of changed answers that is accepted.
const MOST_CHANGED: f64 = 0.005;
/// Range of all features: those of a camera of 16 bits begin at ln(2.5/65535), and those along a path end at 4.2.
const RANGE: [f64; 2] = [-11.0, 5.0];
/// The margin that scores are trained for, as of an SVM or of log-odds.
const MARGIN: f64 = 1.0;
/// Standard deviation of the rounding to float32, as a part of a number: it is off by up to 2^-24, evenly.
pub(super) const FLOAT32_SPREAD: f64 = 0.42 / 16_777_216.0;
/// The remedy for a model whose sums have the wrong unit.
pub(super) const USE_SCALE: &str = "help: train it on X * scale (scale is 1/2048)";

/// The samples of a data set with its labels, and its name.
pub(super) struct CheckSet {
    name: String,
    samples: Vec<Vec<i16>>,
    truth: Option<Truth>,
}

impl CheckSet {
    /// Takes samples without a file.
    pub(super) fn of(mut samples: Vec<Vec<i16>>) -> Option<Self> {
        samples.retain(|sample| is_sample(sample));
        (!samples.is_empty()).then(|| Self { name: "X".into(), samples, truth: None })
    }

    /// Reads the samples that a model takes, and their labels if the model has some of them.
    pub(super) fn read(path: &Path, model: &Trained) -> Result<Self, Error> {
        let (npz, array) = (Npz::open(path)?, array_of(model.input));
        let all = samples(&npz, array, 1)?;
        let mut truth = truth(&npz, model.task, &model.labels, all.len())?;
        if let Some(truth) = &mut truth {
            let mut rows = all.iter();
            truth.numbers.retain(|_| rows.next().is_some_and(|row| is_sample(row)));
        }
        let set = Self::of(all).map(|set| Self { name: path.display().to_string(), truth, ..set });
        set.ok_or_else(|| {
            let message = format_args!("{array} has only zeros, expected samples to compare answers on");
            Error::new(ErrorKind::Data, path.display(), message)
        })
    }

    /// Returns the mean of each input of a model.
    pub(super) fn mean(&self, inputs: usize) -> Vec<f64> {
        let mut mean = vec![0.0; inputs];
        for sample in &self.samples {
            mean.iter_mut().zip(features(sample, inputs)).for_each(|(sum, feature)| *sum += feature);
        }
        mean.iter().map(|sum| sum / self.samples.len() as f64).collect()
    }

    /// Returns twice the largest value of each sum of a network's hidden layers: other samples have larger ones.
    pub(super) fn tops(&self, network: &Network, inputs: usize) -> Vec<Vec<f64>> {
        let hidden = &network.layers[..network.layers.len().saturating_sub(1)];
        let mut tops: Vec<Vec<f64>> = hidden.iter().map(|layer| vec![0.0; layer.len()]).collect();
        for sample in &self.samples {
            let x: Vec<f64> = features(sample, inputs).collect();
            for (top, sum) in tops.iter_mut().flatten().zip(network.sums(&x).iter().flatten()) {
                *top = top.max(2.0 * sum);
            }
        }
        tops
    }

    /// Compares the answers of a trained model with those of its file, and these with the labels of the data set.
    /// Returns what was counted.
    ///
    /// # Errors
    /// More than [`MOST_CHANGED`] of the answers differ, or no more of them are right than by chance.
    pub(super) fn compare(&self, trained: &Trained, model: &Model) -> Result<String, String> {
        let (mut answers, mut margins) = (Vec::with_capacity(self.samples.len()), Vec::new());
        let mut changed = 0;
        for sample in &self.samples {
            let (class, margin) = decide(trained, sample);
            let answer = usize::from(model.classify(&in_file_order(sample)));
            changed += usize::from(class != answer);
            answers.push(answer);
            margins.extend(margin);
        }
        margins.sort_unstable_by(f64::total_cmp);
        let median = margins.get(margins.len() / 2).map(|median| format!(", whose median margin is {median:.2e}"));
        let found = format!("rounding changes {}{}", self.part(changed as f64), median.unwrap_or_default());
        if changed as f64 > MOST_CHANGED * answers.len() as f64 {
            let help = match trained.kind {
                Kind::Linear(_) => {
                    "import it with --weights int32, or without, train it on X * scale without a StandardScaler, with more \
                     regularization, or train trees"
                }
                Kind::Network(_) => "import it with --weights int32, or without, or train it with more regularization",
                _ => "import it with leaves of float32, or train trees whose leaves are of one class",
            };
            return Err(format!("{found}, expected at most {} %; help: {help}", 100.0 * MOST_CHANGED));
        }
        let first = answers.first().and_then(|&first| trained.labels.get(first));
        let is_same = answers.len() > 1 && answers.iter().all(|answer| Some(answer) == answers.first());
        let same = first.filter(|_| is_same).map(|label| format!("; warning: all of them are {label:?}"));
        self.check_scale(trained, &answers)?;
        Ok(found + &same.unwrap_or_default() + &self.graded(&answers)?)
    }

    /// Checks that a network's answers are not more often right on samples without their scale.
    ///
    /// # Errors
    /// It was trained on them.
    fn check_scale(&self, trained: &Trained, answers: &[usize]) -> Result<(), String> {
        let (Kind::Network(network), Some(truth)) = (&trained.kind, &self.truth) else { return Ok(()) };
        let is_right = |number: u16, class: usize| usize::from(truth.of_class.get(class) == Some(&number));
        let right: usize = truth.numbers.iter().zip(answers).map(|(&number, &class)| is_right(number, class)).sum();
        let unscaled = |sample: &Vec<i16>| {
            let x: Vec<f64> = features(sample, trained.inputs).map(|x| x * f64::from(FEATURE_ONE)).collect();
            highest(network.sums(&x).last().map_or(&[], Vec::as_slice), trained.labels.len()).0
        };
        let raw = self.samples.iter().map(unscaled).zip(&truth.numbers).map(|(class, &number)| is_right(number, class));
        let raw: usize = raw.sum();
        // Without its scale, biases hardly count: right answers of a good network change by up to 3 %, of one that was
        // trained without it by 7 % or more.
        if raw * 100 <= right * 100 + 5 * answers.len() {
            return Ok(());
        }
        Err(format!(
            "{right} of {} answers are right in {}, and {raw} on X without its scale, expected a network that was trained \
             on X times its scale; {USE_SCALE}",
            answers.len(),
            self.name
        ))
    }

    /// Returns how many answers are right, in words.
    ///
    /// # Errors
    /// No more are right than by chance: than if the same answers were given to samples in any order.
    fn graded(&self, answers: &[usize]) -> Result<String, String> {
        let none = || format!("; {} has no labels of the model, so that right answers are not counted", self.name);
        let Some(truth) = &self.truth else { return Ok(none()) };
        let (mut labels, mut given) = (vec![0.0; truth.labels.len()], vec![0.0; truth.labels.len()]);
        let (mut right, mut all) = (0.0, 0.0);
        for (&number, &class) in truth.numbers.iter().zip(answers).filter(|(label, _)| truth.of_class.contains(label)) {
            let answer = truth.of_class[class];
            labels[usize::from(number)] += 1.0;
            given[usize::from(answer)] += 1.0;
            right += f64::from(u8::from(number == answer));
            all += 1.0;
        }
        if all == 0.0 {
            return Ok(none());
        }
        let others = answers.len() as f64 - all;
        let others = if others > 0.0 { format!(", {others} have labels that the model lacks") } else { String::new() };
        let chance = labels.iter().zip(&given).map(|(label, answer)| label * answer).sum::<f64>() / (all * all);
        // Two standard deviations, but few samples need not be all right: a kappa of 0.2 is a slight agreement.
        let above = (2.0 * (chance * (1.0 - chance) / all).sqrt()).min(0.2 * (1.0 - chance));
        let found = format!("{right} of {all} answers are right ({:.1} %){others}", 100.0 * right / all);
        if labels.iter().filter(|count| **count > 0.0).count() > 1 && right / all <= chance + above {
            return Err(format!(
                "{found} in {}, expected more than {:.1} %, which chance may reach; {USE_SCALE}, and name the classes in the \
                 order of the training",
                self.name,
                100.0 * (chance + above)
            ));
        }
        Ok(format!("; {found}"))
    }

    /// Checks that the float32 numbers of a trainer's file are exact enough for the answers.
    ///
    /// # Errors
    /// That rounding alone changes more than [`MOST_CHANGED`] of the answers, by an estimate.
    pub(super) fn check_float32(&self, trained: &Trained, spreads: &[f64]) -> Result<(), String> {
        // Nearly the normal distribution.
        let flips =
            |lead: f64, spread: f64| if spread > 0.0 { 1.0 / (1.0 + (1.7 * lead.abs() / spread).exp()) } else { 0.0 };
        let changes = |sample: &Vec<i16>| match (&trained.kind, of_float32(trained)) {
            (_, Some(linear)) => {
                let mut sums: Vec<(f64, f64)> =
                    linear.rows.iter().map(|row| blurred(row, sample, trained.inputs)).collect();
                // The sum of a class against that of the next, or the single sum against 0.
                sums.sort_unstable_by(|one, other| other.0.total_cmp(&one.0));
                let [first, second] = [0, 1].map(|at| sums.get(at).copied().unwrap_or_default());
                flips(first.0 - second.0, (first.1 + second.1).sqrt())
            }
            (Kind::Linear(linear), None) => {
                let (classes, x) = (trained.labels.len(), features(sample, trained.inputs).collect::<Vec<f64>>());
                let class = decide_sums(linear, classes, &x).0;
                let sums = pairs_of(classes).zip(linear.rows.iter().zip(spreads));
                let of_class = sums.filter(|(pair, _)| pair.contains(&class));
                of_class.fold(0.0, |most, (_, (row, &spread))| flips(row.sum(&x), spread).max(most))
            }
            _ => 0.0,
        };
        let changed: f64 = self.samples.iter().map(changes).sum();
        if changed <= MOST_CHANGED * self.samples.len() as f64 {
            return Ok(());
        }
        Err(format!(
            "has float32 numbers, whose rounding changes about {} of the trainer, expected at most {} %{}",
            self.part(changed.round()),
            100.0 * MOST_CHANGED,
            use_float64(spreads)
        ))
    }

    fn part(&self, of_answers: f64) -> String {
        let all = self.samples.len();
        format!("{of_answers} of {all} answers of {} ({:.2} %)", self.name, 100.0 * of_answers / all as f64)
    }
}

/// Returns a linear model whose numbers a trainer rounded from float64 to float32 when it saved them.
///
/// Rows behind a scaler, and those of pairs, are computed from others: nothing is known of them.
fn of_float32(trained: &Trained) -> Option<&Linear> {
    let Kind::Linear(linear) = &trained.kind else { return None };
    let is_float32 = |number: &f64| f64::from(*number as f32).total_cmp(number).is_eq();
    let mut numbers = linear.rows.iter().flat_map(|row| row.weights.iter().chain([&row.bias]));
    (!linear.pairs && trained.mean.is_none() && numbers.all(is_float32)).then_some(linear)
}

/// Returns the remedy for float32 numbers: ONNX has no others for pairs.
fn use_float64(spreads: &[f64]) -> &'static str {
    if spreads.is_empty() {
        "; help: save it with float64 numbers, or by wstac.save in Python"
    } else {
        "; help: train it behind StandardScaler(), which subtracts means, or train a LinearSVC"
    }
}

/// Returns a warning if float32 numbers move scores of usual features by the margin of a training; otherwise no text.
pub(super) fn float32_warning(trained: &Trained, spreads: &[f64]) -> String {
    let rows = of_float32(trained).map_or(&[][..], |linear| &linear.rows);
    let usual = vec![(usual_mean(trained.inputs) * f64::from(FEATURE_ONE)) as i16; TAXEL_INPUTS];
    let spread = |row: &Row| blurred(row, &usual, trained.inputs).1.sqrt();
    let all: Vec<f64> = rows.iter().map(spread).chain(spreads.iter().copied()).collect();
    let moved = all.iter().filter(|&&spread| spread >= MARGIN).count();
    if moved == 0 {
        return String::new();
    }
    format!(
        "; warning: float32 numbers move {moved} of {} scores by the margin of their training or more{}",
        all.len(),
        use_float64(spreads)
    )
}

/// Checks that a model has more than one answer; trees may have a single leaf each.
///
/// # Errors
/// No sample changes the answer.
pub(super) fn check_varies(trained: &Trained) -> Result<(), String> {
    let (beyond, all) = integers::beyond(trained);
    // A few splits may be where only extremes are.
    if all >= 10 && 20 * beyond >= 19 * all {
        return Err(format!("has {beyond} of {all} thresholds beyond all features, expected few; {USE_SCALE}"));
    }
    let mut ranges = vec![RANGE; trained.inputs];
    let (pairs, rows) = match &trained.kind {
        Kind::Linear(Linear { pairs, rows }) => (*pairs, rows),
        Kind::Network(Network { layers, .. }) => {
            let Some((scores, hidden)) = layers.split_last() else { return Ok(()) };
            for layer in hidden {
                let range = |row: &Row| <[f64; 2]>::from(row.ends(&ranges)).map(|end| end.max(0.0));
                ranges = layer.iter().map(range).collect();
            }
            (false, scores)
        }
        _ => return Ok(()),
    };
    let is_fixed = if pairs || rows.len() == 1 {
        // The first class of a row always wins, or the second.
        let always = |row: &Row| {
            let (least, most) = row.ends(&ranges);
            [least > 0.0, most <= 0.0]
        };
        let wins: Vec<[bool; 2]> = rows.iter().map(always).collect();
        let classes = trained.labels.len();
        let of = |class| pairs_of(classes).zip(&wins).filter(move |(pair, _)| pair.contains(&class));
        let is_beaten = |class| of(class).any(|(pair, wins)| !wins[usize::from(pair[1] == class)]);
        wins.iter().all(|wins| wins[0] || wins[1]) || pairs && !(0..classes).all(is_beaten)
    } else {
        let least = |row: &Row, other: &Row| {
            let weights = row.weights.iter().zip(&other.weights).map(|(weight, other)| weight - other);
            ends(row.bias - other.bias, weights.zip(ranges.iter().copied())).0
        };
        rows.iter().any(|row| rows.iter().all(|other| std::ptr::eq(row, other) || least(row, other) >= 0.0))
    };
    if trained.labels.len() < 2 || !is_fixed {
        return Ok(());
    }
    let label = trained.labels.get(decide(trained, &[-2048; TAXEL_INPUTS]).0).map_or("", String::as_str);
    Err(format!("names every sample {label:?}, expected a model whose answer depends on its sample; {USE_SCALE}"))
}

/// Returns the features of a sample that a model takes, in the order of its inputs.
fn features(sample: &[i16], inputs: usize) -> impl Iterator<Item = f64> {
    let frames = inputs / FEATURES;
    let rows = sample.chunks(SAMPLE_FRAMES).flat_map(move |row| row.iter().take(frames));
    rows.map(|&units| f64::from(units) / f64::from(FEATURE_ONE))
}

/// Returns a sum, and its variance by the rounding of its numbers to float32.
fn blurred(row: &Row, sample: &[i16], inputs: usize) -> (f64, f64) {
    let add = |sums: (f64, f64), product: f64| (sums.0 + product, sums.1 + (product * FLOAT32_SPREAD).powi(2));
    let products = row.weights.iter().zip(features(sample, inputs)).map(|(weight, x)| weight * x);
    products.chain([row.bias]).fold((0.0, 0.0), add)
}

/// Returns the class of a trained model, and for weighted sums by how much it wins: its score over the next, or its
/// closest pair.
fn decide(trained: &Trained, sample: &[i16]) -> (usize, Option<f64>) {
    let (classes, x) = (trained.labels.len(), features(sample, trained.inputs).collect::<Vec<f64>>());
    match &trained.kind {
        Kind::Linear(linear) => {
            let (class, margin) = decide_sums(linear, classes, &x);
            (class, Some(margin))
        }
        Kind::Forest(trees) => {
            let mut votes = vec![0.0; classes];
            trees.iter().flat_map(|tree| leaf(tree, &x)).for_each(|(class, vote)| votes[usize::from(*class)] += vote);
            (best(&votes), None)
        }
        Kind::Boosted(boosted) => {
            let add = |sum: f32, tree: &Tree<f32>| sum + leaf(tree, &x);
            let scores: Vec<f64> =
                boosted.scores.iter().map(|score| score.trees.iter().fold(score.start, add).into()).collect();
            let [score] = scores[..] else { return (best(&scores), None) };
            (usize::from(score > boosted.bound.into()), None)
        }
        Kind::Network(network) => {
            let (class, margin) = highest(network.sums(&x).last().map_or(&[], Vec::as_slice), classes);
            (class, Some(margin))
        }
    }
}

/// Returns the leaf of a sample. The tree has no circle.
fn leaf<'t, L>(tree: &'t Tree<L>, x: &[f64]) -> &'t L {
    let mut at = 0;
    loop {
        match &tree.nodes[at] {
            Node::Leaf(leaf) => return leaf,
            Node::Split { input, threshold, strict, left, right } => {
                let is_left = if *strict { x[*input] < *threshold } else { x[*input] <= *threshold };
                at = if is_left { *left } else { *right };
            }
        }
    }
}

/// Returns the class of the largest score; the first of equal ones wins.
fn best(scores: &[f64]) -> usize {
    (0..scores.len()).rev().max_by(|&a, &b| scores[a].total_cmp(&scores[b])).unwrap_or(0)
}

/// Iterates over the pairs of classes in the order of their sums.
fn pairs_of(classes: usize) -> impl Iterator<Item = [usize; 2]> {
    (0..classes).flat_map(move |first| (first + 1..classes).map(move |second| [first, second]))
}

fn decide_sums(linear: &Linear, classes: usize, x: &[f64]) -> (usize, f64) {
    let sums: Vec<f64> = linear.rows.iter().map(|row| row.sum(x)).collect();
    if linear.pairs {
        let pairs = || pairs_of(classes).zip(&sums);
        let mut votes = vec![0.0; classes];
        pairs().for_each(|(pair, &sum)| votes[pair[usize::from(sum <= 0.0)]] += 1.0);
        let class = best(&votes);
        let of_class = pairs().filter(|(pair, _)| pair.contains(&class));
        return (class, of_class.fold(f64::INFINITY, |least, (_, sum)| least.min(sum.abs())));
    }
    highest(&sums, classes)
}

/// Returns the class of the highest score, or of a single one that decides between two, and by how much it wins.
fn highest(sums: &[f64], classes: usize) -> (usize, f64) {
    let [sum] = sums[..] else {
        let class = best(sums);
        let others = sums.iter().enumerate().filter(|(other, _)| *other != class);
        return (class, sums[class] - others.fold(f64::NEG_INFINITY, |most, (_, &sum)| most.max(sum)));
    };
    (if classes == 1 { 0 } else { usize::from(sum > 0.0) }, sum.abs())
}

#[cfg(test)]
mod tests {
    use wstac_core::model::file::{INPUTS, Input};

    use super::super::trained::{Boosted, Score, guess_task};
    use super::super::write::{Options, Weights, write};
    use super::*;

    /// Returns a model whose weights differ in size by `most`, and samples that its small weights decide.
    fn case(pairs: bool, most: f64) -> (Trained, CheckSet) {
        let row = |class: usize| Row {
            // A large weight of an input that never changes, and small ones that decide.
            weights: (0..INPUTS)
                .map(|input| if input == 0 { most } else { f64::from(input / 70 % 3 == class) })
                .collect(),
            bias: 2.0 * most,
        };
        let labels: Vec<String> = (0..3).map(|class| class.to_string()).collect();
        let mut rows: Vec<Row> = (0..3).map(row).collect();
        if pairs {
            rows = [[0, 1], [0, 2], [1, 2]].map(|[a, b]| difference(&rows[a], &rows[b], most)).into();
        }
        let kind = Kind::Linear(Linear { pairs, rows });
        let (task, input, inputs) = (guess_task(&labels), Input::Frames, INPUTS);
        let model = Trained { labels, task, input, inputs, speeds: None, kind, remarks: Vec::new(), mean: None };
        let sample = |number: usize| {
            let number_of = |input: usize| match input {
                0 => -4096,
                _ => 100 * i16::from(input / 70 % 3 == number % 3),
            };
            (0..INPUTS).map(number_of).collect()
        };
        (model, CheckSet { name: "set.npz".into(), samples: (0..300).map(sample).collect(), truth: None })
    }

    fn difference(first: &Row, second: &Row, most: f64) -> Row {
        let mut weights: Vec<f64> = first.weights.iter().zip(&second.weights).map(|(a, b)| a - b).collect();
        weights[0] = most;
        Row { weights, bias: 2.0 * most }
    }

    fn compared(model: &Trained, set: &CheckSet) -> Result<String, String> {
        let words = write(model, "", Options { weights: Some(Weights::Int16), ..Options::default() }).unwrap().words;
        set.compare(model, &Model::from_words(&words).unwrap())
    }

    #[test]
    fn changed_answers_are_counted_and_refused() {
        for pairs in [false, true] {
            let (model, set) = case(pairs, 10.0);
            let found = compared(&model, &set).unwrap();
            assert!(found.starts_with("rounding changes 0 of 300 answers of set.npz (0.00 %)"), "{found}");
            // Small weights are rounded to 0: every answer is that of equal scores.
            let (model, set) = case(pairs, 1e6);
            let error = compared(&model, &set).unwrap_err();
            assert!(error.starts_with("rounding changes 200 of 300 answers of set.npz (66.67 %)"), "{error}");
            assert!(error.contains("expected at most 0.5 %; help: "), "{error}");
        }
    }

    #[test]
    fn weights_that_all_classes_share_decide_nothing() {
        let (mut model, set) = case(false, 1e6);
        if let Kind::Linear(linear) = &mut model.kind {
            linear.drop_shared();
        }
        assert!(compared(&model, &set).unwrap().contains("changes 0 of 300"));
    }

    #[test]
    fn with_a_mean_weights_below_a_unit_still_count() {
        let (mut model, set) = case(false, 1e5);
        assert!(compared(&model, &set).unwrap_err().contains("changes 200 of 300"));
        model.mean = Some(set.mean(INPUTS));
        assert!(compared(&model, &set).unwrap().contains("changes 0 of 300"));
    }

    #[test]
    fn answers_that_are_not_above_chance_are_refused() {
        let (model, mut set) = case(false, 10.0);
        let truth = |shift: usize, last: u16| Truth {
            from: "y".into(),
            labels: ["0", "1", "2", "denim"].map(str::to_owned).into(),
            numbers: (0..300).map(|number| if number < 30 { last } else { ((number + shift) % 3) as u16 }).collect(),
            of_class: vec![0, 1, 2],
        };
        // A label that the model has not counts nowhere.
        set.truth = Some(truth(0, 3));
        let right = "; 270 of 270 answers are right (100.0 %), 30 have labels that the model lacks";
        assert!(compared(&model, &set).unwrap().ends_with(right));
        set.truth = Some(truth(1, 0));
        let error = compared(&model, &set).unwrap_err();
        assert!(error.starts_with("10 of 300 answers are right (3.3 %) in set.npz, expected more than "), "{error}");
        assert!(error.contains("X * scale (scale is 1/2048)"), "{error}");
        // The same answer for every sample is right by chance; with one label in the set nothing is known.
        let one = vec![1; 300];
        assert!(set.graded(&one).unwrap_err().contains("which chance may reach"));
        set.truth.as_mut().unwrap().numbers.fill(1);
        assert_eq!(set.graded(&one).unwrap(), "; 300 of 300 answers are right (100.0 %)");
        assert!(CheckSet::of(vec![vec![0; INPUTS]; 2]).is_none());
        // Two samples are too few to ask for more.
        set.truth.as_mut().unwrap().numbers = vec![0, 1];
        assert!(set.graded(&[0, 1]).is_ok());
        set.truth.as_mut().unwrap().numbers.fill(3);
        assert!(set.graded(&[0, 1]).unwrap().contains("no labels of the model"));
    }

    #[test]
    fn a_model_with_one_answer_is_refused() {
        for pairs in [false, true] {
            let (mut model, _) = case(pairs, 10.0);
            assert_eq!(check_varies(&model), Ok(()));
            let Kind::Linear(linear) = &mut model.kind else { unreachable!() };
            // As after a training on samples without their scale: weights are small beside the bias.
            let biases = [9.0, 40.0, 8.0];
            for (row, bias) in linear.rows.iter_mut().zip(if pairs { [-9.0, 9.0, 8.0] } else { biases }) {
                row.weights.iter_mut().for_each(|weight| *weight *= 1.0 / 2048.0);
                row.bias = bias;
            }
            let error = check_varies(&model).unwrap_err();
            assert!(error.starts_with("names every sample \"1\", expected "), "{error}");
            // Of pairs, class 1 still wins both of its own.
            let Kind::Linear(linear) = &mut model.kind else { unreachable!() };
            linear.rows[1].weights[5] = 10.0;
            assert_eq!(check_varies(&model).is_ok(), !pairs);
            let Kind::Linear(linear) = &mut model.kind else { unreachable!() };
            linear.rows[2].weights[5] = 10.0;
            assert_eq!(check_varies(&model), Ok(()));
        }
    }

    #[test]
    fn a_network_with_one_answer_is_refused() {
        let (mut model, _) = case(false, 10.0);
        let mut network = |bias: f64| {
            let hidden = Row { weights: vec![1.0; INPUTS], bias };
            let scores = [2.0, -1.0, 0.5].map(|weight| Row { weights: vec![weight], bias: weight - 2.0 });
            model.kind = Kind::Network(Network { layers: vec![vec![hidden], scores.into()], tops: None });
            check_varies(&model)
        };
        // The hidden value is 0 for all features, then for some.
        assert!(network(-5001.0 * 0.7).unwrap_err().contains("names every sample \"0\""));
        // Class 0 also wins for every value above 0.
        assert!(network(0.0).is_err());
        let Kind::Network(Network { layers, .. }) = &mut model.kind else { unreachable!() };
        layers[1][2].bias = 3.0;
        assert_eq!(check_varies(&model), Ok(()));
    }

    #[test]
    fn numbers_that_float32_rounded_too_much_are_refused() {
        let (mut model, set) = case(false, 0.0);
        let said = |model: &mut Trained, biases: [f64; 3]| {
            let Kind::Linear(linear) = &mut model.kind else { unreachable!() };
            linear.rows.iter_mut().zip(biases).for_each(|(row, bias)| row.bias = bias);
            set.check_float32(model, &[])
        };
        // Biases that all classes share, as of features with large weights that hardly vary. They are float32.
        let error = said(&mut model, [1e9; 3]).unwrap_err();
        assert!(error.starts_with("has float32 numbers, whose rounding changes about "), "{error}");
        let moved = "; warning: float32 numbers move 3 of 3 scores by the margin";
        assert!(float32_warning(&model, &[]).starts_with(moved));
        assert_eq!(said(&mut model, [64.0; 3]).map(|()| float32_warning(&model, &[])), Ok(String::new()));
        // Of pairs, only a reader knows the numbers of which sums are computed.
        let (pairs, set_of_pairs) = case(true, 10.0);
        assert_eq!(set_of_pairs.check_float32(&pairs, &[0.01; 3]), Ok(()));
        let error = set_of_pairs.check_float32(&pairs, &[1e9; 3]).unwrap_err();
        assert!(error.contains("changes about 150 of 300 answers") && error.contains("StandardScaler()"), "{error}");
        assert!(float32_warning(&pairs, &[0.5, 2.0, 0.5]).contains("numbers move 1 of 3 scores"));
        // These are not, or are small.
        assert_eq!(said(&mut model, [1e9, 1e9, 1e9 + 0.1]), Ok(()));
        assert_eq!(said(&mut model, [64.0; 3]), Ok(()));
    }

    /// Returns a tree of an input that is 100 units in the samples of a class.
    fn tree<L>(class: usize, leaves: [L; 2]) -> Tree<L> {
        let [low, high] = leaves.map(Node::Leaf);
        let split = Node::Split { input: 70 * (3 + class), threshold: 0.02, strict: class == 1, left: 1, right: 2 };
        Tree { nodes: vec![split, low, high] }
    }

    #[test]
    fn answers_of_trees_are_those_of_their_file() {
        let (mut model, set) = case(false, 10.0);
        let forest =
            |class: u16| tree(class.into(), [vec![(class, 0.25), ((class + 1) % 3, 0.75)], vec![(class, 1.0)]]);
        let scores = |class| Score { start: 0.5, trees: vec![tree(class, [-0.3, 0.1]), tree(class, [0.0, 0.7])] };
        let boosted = Kind::Boosted(Boosted { scores: (0..3).map(scores).collect(), bound: 0.0 });
        for kind in [Kind::Forest((0..3).map(forest).collect()), boosted] {
            model.kind = kind;
            let found = compared(&model, &set).unwrap();
            let none = "rounding changes 0 of 300 answers of set.npz (0.00 %); set.npz has no labels";
            assert!(found.starts_with(none), "{found}");
        }
        let classes: Vec<usize> = set.samples.iter().map(|sample| decide(&model, sample).0).collect();
        assert!(classes.iter().enumerate().all(|(number, class)| *class == number % 3));
    }
}
