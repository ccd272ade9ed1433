//! From samples to scores of linear models: the error of whole numbers as weights, and the error that rounded features
//! add.

use wstac_core::model::file::{HEADER_HALVES, INPUTS, Input, Task};
use wstac_core::model::linear_svm::BLOCK;
use wstac_tests::random::Random;
use wstac_train::model::trained::{Kind, Linear, Row, Trained, file_order};
use wstac_train::model::write::{Options, Weights, write};

use super::{FEATURE, Largest, ONE};

/// The number of classes, which is also the number of rows. It is odd, so that the last block is not full.
const ROWS: usize = 5;
/// The range of usual features in the writer's bound: ln(2.5/255) to ln 5.
const USUAL: (f64, f64) = (-9471.0, 3296.0);

/// The rounding error of 64-bit floating point here: about 1400 roundings of numbers below 700 · 4.7, by 2^-53 each. It
/// counts because the worst samples reach the bound.
const IN_64_BITS: f64 = 1e-9;

/// Returns the biases and weights of a model file with weights of int16, or of int32, which are two rows of int16 each.
/// The documentation of linear models describes their places.
fn rows_of(words: &[u32], width: Weights) -> Vec<(i64, Vec<i64>)> {
    let halves: Vec<u16> = words.iter().flat_map(|&word| [word as u16, (word >> 16) as u16]).collect();
    let biases = HEADER_HALVES + 2;
    assert_eq!(usize::from(halves[HEADER_HALVES]), ROWS);
    let bias = |row: usize| (0..4).map(|half| i64::from(halves[biases + 4 * row + half]) << (16 * half)).sum::<i64>();
    let count = if width == Weights::Int32 { 2 * ROWS } else { ROWS };
    let mut at = biases + 4 * count;
    let mut rows: Vec<_> = (0..count).map(|row| (bias(row), Vec::with_capacity(INPUTS))).collect();
    for block in rows.chunks_mut(BLOCK) {
        for _ in 0..INPUTS / 2 {
            for (_, weights) in &mut *block {
                weights.extend([halves[at], halves[at + 1]].map(|half| i64::from(half as i16)));
                at += 2;
            }
        }
    }
    if width == Weights::Int16 {
        return rows;
    }
    let whole = |(high, low): (&i64, &i64)| high * 32_768 + low;
    let pair =
        |[high, low]: &[(i64, Vec<i64>); 2]| (whole((&high.0, &low.0)), high.1.iter().zip(&low.1).map(whole).collect());
    rows.as_chunks().0.iter().map(pair).collect()
}

/// Compares scores in whole numbers with 64-bit scores of the trained weights. Features are random or the worst
/// possible ones. Then does the same for real features, which the core rounds.
#[test]
fn scores_are_within_their_bound() {
    let mut random = Random::new(5);
    let mut uniform = |from: f64, to: f64| from + (to - from) * random.below(1 << 40) as f64 / (1_u64 << 40) as f64;
    let (mut weights_only, mut whole) = (Largest::default(), Largest::default());
    // Models of int32 come last.
    for number in 0..24 {
        let (width, full) =
            if number < 20 { (Weights::Int16, 32_767.0) } else { (Weights::Int32, 32_767.0 * 32_768.0) };
        let trained: Vec<Row> = (0..ROWS)
            .map(|_| Row {
                weights: (0..INPUTS).map(|_| uniform(-1.0, 1.0).powi(3)).collect(),
                bias: uniform(-9.0, 9.0),
            })
            .collect();
        let model = Trained {
            labels: (0..ROWS).map(|class| class.to_string()).collect(),
            task: Task::Other,
            input: Input::Frames,
            inputs: INPUTS,
            speeds: None,
            kind: Kind::Linear(Linear { pairs: false, rows: trained.clone() }),
            remarks: Vec::new(),
            mean: None,
        };
        let written = write(&model, "", Options { weights: Some(width), ..Options::default() }).unwrap();
        let largest = trained.iter().flat_map(|row| &row.weights).fold(0.0_f64, |most, weight| most.max(weight.abs()));
        let unit = largest / full;
        for (class, ((bias, integers), row)) in rows_of(&written.words, width).iter().zip(&trained).enumerate() {
            // The error that rounded features add.
            let added = row.weights.iter().map(|weight| weight.abs()).sum::<f64>() * FEATURE / ONE;
            let weight_of = |input: usize| integers[file_order(input, 70)] as f64 * unit;
            // The first two samples are the worst: each feature is at the end of its range where the rounded weight
            // does most harm, and is rounded by almost half a unit in the same direction. The other samples are random.
            for kind in 0..12 {
                let harm = if kind == 0 { 1.0 } else { -1.0 };
                let real: Vec<f64> = (0..INPUTS)
                    .map(|input| {
                        if kind > 1 {
                            return uniform(USUAL.0, USUAL.1) / ONE;
                        }
                        let off = (weight_of(input) - row.weights[input]) * harm;
                        let end = if off > 0.0 { USUAL.1 } else { USUAL.0 };
                        (end - 0.4999 * harm * row.weights[input].signum()) / ONE
                    })
                    .collect();
                let rounded: Vec<i64> = real.iter().map(|x| (x * ONE).round() as i64).collect();
                let sum: i64 = rounded.iter().enumerate().map(|(i, x)| integers[file_order(i, 70)] * x).sum();
                let score = (bias + sum) as f64 * unit / ONE;
                let of = |x: &dyn Fn(usize) -> f64| {
                    row.bias + row.weights.iter().enumerate().map(|(input, weight)| weight * x(input)).sum::<f64>()
                };
                let what = format_args!("model {number}, class {class}, sample {kind}");
                let same = (score - of(&|input| rounded[input] as f64 / ONE)).abs();
                weights_only.see(same, written.score_bound + IN_64_BITS, what);
                whole.see((score - of(&|input| real[input])).abs(), written.score_bound + added + IN_64_BITS, what);
            }
        }
    }
    weights_only.print("score, of the same features", 1.0, "for weights up to 1");
    whole.print("score, of real features", 1.0, "for weights up to 1");
}
